"""Files in, recordings out: what is stated, what is refused, and that nothing is lost."""

import hashlib
import math
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st

from sagnac import series
from sagnac.errors import RecordingError
from sagnac.formats import Statement, columns, parquet, read, write
from sagnac.formats.unit_text import Header, UnitText, parsed_header, parsed_unit
from sagnac.recording.model import Channel, Recording

ARCSECOND = math.pi / 180.0 / 3600.0
SAMPLES = 600
SUFFIXES = ("csv", "tsv", "parquet", "mat", "npz", "h5")


def walk(seed: int = 0, samples: int = SAMPLES) -> np.ndarray:
    return np.cumsum(np.random.default_rng(seed).normal(size=samples))


def text(header: str, *values: np.ndarray) -> str:
    rows = "\n".join(
        ",".join(repr(float(item)) for item in row) for row in zip(*values, strict=True)
    )
    return f"{header}\n{rows}\n"


def save(path: Path, content: str) -> Path:
    path.write_text(content, encoding="utf-8")
    return path


def timed(path: Path, values: np.ndarray, times: np.ndarray | None = None) -> Path:
    times = np.arange(values.size) / 100.0 if times is None else times
    return save(path, text("time[s],x[arcsec]", times, values))


def refused(path: Path, *words: str, statement: Statement | None = None) -> str:
    """The one line that `read` refuses the file with; it names the file and each word."""
    with pytest.raises(RecordingError) as caught:
        read(path, statement or Statement(kind="angle"))
    # As the command writes it: the inputs that a remedy names are options there.
    message = caught.value.line(lambda name, value: f"--{name} {value}".strip())
    assert "\n" not in message
    for word in (path.name, *words):
        assert word in message
    return message


def example(kind: str = "angle", *, times: bool = False) -> Recording:
    stamps = np.arange(SAMPLES) / 50.0 + np.random.default_rng(9).uniform(0.0, 0.004, SAMPLES)
    unit = "deg/h" if kind == "rate" else "arcsec"
    return Recording(
        gyros=tuple(
            Channel(name=name, kind=kind, unit=unit, values=1e-6 * walk(seed))
            for seed, name in enumerate(("left", "z"))
        ),
        sample_rate=(SAMPLES - 1) / float(stamps[-1] - stamps[0]) if times else 50.0,
        times=stamps - stamps[0] if times else None,
        table=Channel(
            name="table",
            kind="angle",
            unit="deg",
            values=0.02 * np.arange(SAMPLES) + 1e-4 * walk(7),
        ),
        null_pulse=np.arange(SAMPLES) % 314 == 0,
    )


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("kind", ["angle", "increment", "rate"])
@pytest.mark.parametrize("times", [False, True])
def test_what_is_written_is_read_back_without_options(tmp_path, suffix, kind, times):
    recording = example(kind, times=times)
    path = write(recording, tmp_path / f"run.{suffix}")
    back = read(path)
    assert [gyro.name for gyro in back.gyros] == ["left", "z"]
    for gyro, original in zip(back.gyros, recording.gyros, strict=True):
        assert (gyro.kind, gyro.unit) == (original.kind, original.unit)
        np.testing.assert_allclose(gyro.values, original.values, rtol=1e-15, atol=1e-24)
    np.testing.assert_allclose(back.table.values, recording.table.values, rtol=1e-15, atol=1e-18)
    np.testing.assert_array_equal(back.null_pulse, recording.null_pulse)
    if times:
        assert back.sample_rate == pytest.approx(recording.sample_rate, rel=1e-4)
        np.testing.assert_allclose(back.times, recording.times, rtol=1e-15)
    else:
        assert back.sample_rate == 50.0
        assert back.times is None
    assert back.provenance.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert not [item for item in tmp_path.iterdir() if item.name.endswith(".part")]


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.floats(-1e9, 1e9, allow_subnormal=False), min_size=16, max_size=40, unique=True),
    st.sampled_from(["csv", "parquet"]),
)
def test_any_values_survive_in_radians(tmp_path_factory, values, suffix):
    path = tmp_path_factory.mktemp("any") / f"run.{suffix}"
    array = np.array(values)
    gyro = Channel(name="x", kind="angle", unit="rad", values=array)
    back = read(write(Recording(gyros=(gyro,), sample_rate=2.5), path))
    np.testing.assert_array_equal(back.gyros[0].values, array)
    assert back.sample_rate == 2.5


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("x[arcsec]", "x", "arcsec"),
        (" gyro z [ deg/s ] ", "gyro z", "deg/s"),
        ("x", "x", None),
        ("x[]", "x", None),
        ("[arcsec]", "[arcsec]", None),
    ],
)
def test_headers(header, name, unit):
    assert parsed_header(header) == Header(name=name, unit=unit)


@pytest.mark.parametrize(
    ("unit", "factor", "name"),
    [("0.1arcsec", 0.1, "arcsec"), ("5e-3 deg/s", 5e-3, "deg/s"), ("″", 1.0, "arcsec")],
)
def test_factors(unit, factor, name):
    assert parsed_unit(unit) == UnitText(factor=factor, name=name)


def test_values_are_in_si_by_the_header(tmp_path):
    degrees = walk()
    path = save(tmp_path / "run.csv", text("time[ms],x[deg]", np.arange(SAMPLES) * 2.0, degrees))
    recording = read(path, Statement(kind="angle"))
    np.testing.assert_allclose(recording.gyros[0].values, np.deg2rad(degrees), rtol=1e-14)
    assert recording.sample_rate == 500.0
    assert recording.times is None


def test_counts_take_their_size_from_the_scale(tmp_path):
    counts = np.rint(10.0 * walk())
    path = save(tmp_path / "run.csv", text("x", counts))
    stated = Statement(kind="angle", unit="counts", scale="0.1arcsec", sample_rate=100.0)
    values = read(path, stated).gyros[0].values
    np.testing.assert_allclose(values, 0.1 * ARCSECOND * counts, rtol=1e-14)


def test_delimiters_comments_and_files_without_header(tmp_path):
    x = walk()
    plain = read(
        save(tmp_path / "a.csv", text("x[deg]", x)), Statement(kind="angle", sample_rate=10)
    )
    rows = "\n".join(f"{i};{str(float(item)).replace('.', ',')}" for i, item in enumerate(x))
    german = save(tmp_path / "b.csv", f"# bench 3\nn;x[deg]\n{rows}\n")
    headless = save(
        tmp_path / "c.txt", "\n".join(f"{i} {float(item)!r}" for i, item in enumerate(x)) + "\n"
    )
    stated = Statement(kind="angle", sample_rate=10.0)
    np.testing.assert_array_equal(read(german, stated).gyros[0].values, plain.gyros[0].values)
    stated = Statement(kind="angle", sample_rate=10.0, columns={"x": "2"}, unit="deg")
    np.testing.assert_array_equal(read(headless, stated).gyros[0].values, plain.gyros[0].values)
    assert columns(headless) == ("1", "2")


def test_command_line_is_heard_before_toml_and_toml_before_the_file(tmp_path):
    x = walk()
    path = save(tmp_path / "run.csv", text("x[arcsec]", x))
    beside = tmp_path / "run.csv.toml"
    save(beside, 'kind = "increment"\nunit = "arcmin"\nsample_rate = 100.0\n')
    by_toml = read(path)
    assert by_toml.gyros[0].kind == "increment"
    np.testing.assert_allclose(by_toml.gyros[0].values, 60.0 * ARCSECOND * x, rtol=1e-14)
    by_caller = read(path, Statement(kind="angle", unit="deg", sample_rate=200.0))
    assert by_caller.gyros[0].kind == "angle"
    assert by_caller.sample_rate == 200.0
    np.testing.assert_allclose(by_caller.gyros[0].values, np.deg2rad(x), rtol=1e-14)
    assert any("the file says arcsec, taken as deg" in str(note) for note in by_caller.notes)
    beside.unlink()
    by_file = read(path, Statement(kind="angle", sample_rate=100.0))
    np.testing.assert_allclose(by_file.gyros[0].values, ARCSECOND * x, rtol=1e-14)


def test_toml_of_the_same_stem_counts_only_if_it_is_a_statement(tmp_path):
    path = timed(tmp_path / "run.csv", walk())
    save(tmp_path / "run.toml", 'kind = "angle"\n')
    assert read(path).gyros[0].kind == "angle"
    save(tmp_path / "run.toml", "sample_rate = 3.0\nlatitude_deg = 28.0\n")
    assert any("run.toml" in str(note) for note in read(path, Statement(kind="angle")).notes)


def test_parquet_metadata_and_hdf5_attributes_state_everything(tmp_path):
    x = walk()
    field = pa.field("x", pa.float64(), metadata={"unit": "arcsec", "kind": "increment"})
    schema = pa.schema([field], metadata={"sample_rate": "250"})
    pq.write_table(pa.table([pa.array(x)], schema=schema), tmp_path / "run.parquet")
    with h5py.File(tmp_path / "run.h5", "w") as file:
        group = file.create_group("imu")
        group.attrs["sample_rate"] = 250.0
        group.attrs["kind"] = "increment"
        group.create_dataset("x", data=x).attrs["units"] = "arcsec"
    for name in ("run.parquet", "run.h5"):
        recording = read(tmp_path / name)
        assert recording.gyros[0].kind == "increment"
        assert recording.sample_rate == 250.0
        np.testing.assert_allclose(recording.gyros[0].values, ARCSECOND * x, rtol=1e-14)


def test_parquet_time_stamps_and_missing_samples(tmp_path):
    x = walk()
    stamps = (1_700_000_000 * 10**9 + 10_000_000 * np.arange(SAMPLES)).astype("datetime64[ns]")
    table = pa.table({"time": stamps, "x[arcsec]": x})
    pq.write_table(table, tmp_path / "run.parquet")
    recording = read(tmp_path / "run.parquet", Statement(kind="angle"))
    assert recording.sample_rate == 100.0
    assert recording.times is None
    missing = table.set_column(1, "x[arcsec]", pa.array([None, *map(int, 1e3 * x[1:])]))
    pq.write_table(missing, tmp_path / "null.parquet", row_group_size=100)
    refused(tmp_path / "null.parquet", "x:", "1 sample NaN", "--slice")


def test_matlab_matrix_and_version_7_3(tmp_path):
    matrix = np.stack([walk(1), walk(2), walk(3)], axis=1)
    scipy.io.savemat(tmp_path / "run.mat", {"w": matrix, "note": "bench"})
    stated = Statement(kind="rate", unit="deg/s", sample_rate=100.0, columns={"z": "w.3"})
    values = read(tmp_path / "run.mat", stated).gyros[0].values
    np.testing.assert_allclose(values, np.deg2rad(matrix[:, 2]), rtol=1e-14)
    with h5py.File(tmp_path / "new.mat", "w", userblock_size=512) as file:
        file.create_dataset("w", data=matrix.T)
        text_set = file.create_dataset("kind", data=np.frombuffer(b"rate", np.uint8).astype("u2"))
        text_set.attrs["MATLAB_class"] = np.bytes_("char")
    with (tmp_path / "new.mat").open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    again = read(tmp_path / "new.mat", stated).gyros[0].values
    np.testing.assert_array_equal(again, values)


IMU_HEADER = """% PSINS-format SIMU log file
% comments

0.0 0.0 -90.6 0.0 0.0 0.0
34.246 108.910 380.0 0.0 5.0 9.78
0.1 0.2 0.4 125 125 125
"""


def imu(path: Path, header: str = IMU_HEADER, samples: int = 2000) -> tuple[Path, np.ndarray]:
    counts = np.random.default_rng(3).integers(-9, 10, (samples, 6))
    rows = "\n".join(" ".join(str(item) for item in row) for row in counts)
    return save(path, f"{header}{rows}\n"), counts


def test_psins_header_states_rate_kind_and_factors(tmp_path):
    path, counts = imu(tmp_path / "run.imu")
    recording = read(path, Statement(span=(2.0, 7.0)))
    assert recording.sample_rate == 200.0
    assert [gyro.name for gyro in recording.gyros] == ["x", "y", "z"]
    assert {gyro.kind for gyro in recording.gyros} == {"increment"}
    assert recording.provenance.span_s == (2.0, 7.0)
    for gyro, column, factor in zip(recording.gyros, counts.T, (0.1, 0.2, 0.4), strict=False):
        expected = factor * ARCSECOND * column[400:1400]
        np.testing.assert_allclose(gyro.values, expected, rtol=1e-14)


def test_psins_damaged(tmp_path):
    path, _ = imu(tmp_path / "run.imu")
    save(path, path.read_text()[:-7])
    refused(path, "cut off")
    refused(imu(tmp_path / "none.imu", header="% nothing\n")[0], "header", "positive")
    refused(imu(tmp_path / "zero.imu", header=IMU_HEADER.replace(" 5.0 ", " 0 "))[0], "interval")
    refused(save(tmp_path / "words.imu", "hello\n"), "PSINS")
    refused(save(tmp_path / "short.imu", IMU_HEADER), "too few")


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_encoder_is_unwrapped_either_way_and_reversing(tmp_path, sign):
    angle = sign * 900.0 * np.sin(np.linspace(0.0, 6.0, SAMPLES))
    content = text("time[s],x[deg],table[deg]", np.arange(SAMPLES) / 100, walk(), angle % 360.0)
    table = read(save(tmp_path / "run.csv", content), Statement(kind="angle")).table
    np.testing.assert_allclose(np.rad2deg(table.values - table.values[0]), angle, atol=1e-9)


@pytest.mark.parametrize("bits", [16, 24, 32])
def test_counters_that_roll_over(tmp_path, bits):
    counts = np.rint(np.linspace(0.0, 5.3 * 2**bits, SAMPLES)) + np.rint(10.0 * walk())
    rolled = (counts + 2 ** (bits - 1)) % 2**bits - 2 ** (bits - 1)
    path = save(tmp_path / "run.csv", text("time[s],x", np.arange(SAMPLES) / 100, rolled))
    stated = Statement(kind="angle", unit="counts", scale="1arcsec", counter_bits=bits)
    values = read(path, stated).gyros[0].values / ARCSECOND
    np.testing.assert_allclose(values - values[0], counts - counts[0], atol=1e-3)
    refused(
        path,
        "x:",
        "--counter-bits",
        statement=Statement(kind="increment", unit="counts", scale="1arcsec", counter_bits=bits),
    )


def test_null_pulse_is_its_first_sample(tmp_path):
    pulse = (np.arange(SAMPLES) % 100 >= 97).astype(float)
    content = text("time[s],x[deg],null", np.arange(SAMPLES) / 100, walk(), pulse)
    path = save(tmp_path / "run.csv", content)
    recording = read(path, Statement(kind="angle", null_pulse="null"))
    np.testing.assert_array_equal(np.flatnonzero(recording.null_pulse), np.arange(97, 600, 100))
    stated = Statement(kind="angle", null_pulse="x")
    refused(path, "null_pulse", "--null-pulse", statement=Statement(kind="angle", null_pulse="off"))
    with pytest.raises(RecordingError, match="two channels"):
        read(path, stated)


def test_stamps_on_a_coarse_clock_are_uniform_and_jitter_is_kept(tmp_path):
    times = np.round(np.arange(SAMPLES) / 512.0, 3)
    recording = read(timed(tmp_path / "coarse.csv", walk(), times), Statement(kind="angle"))
    assert recording.times is None
    assert recording.sample_rate == pytest.approx(512.0, rel=1e-3)
    assert any("clock" in str(note) for note in recording.notes)
    times = np.arange(SAMPLES) / 100.0
    times[300] = times[299]
    recording = read(timed(tmp_path / "repeat.csv", walk(), times), Statement(kind="angle"))
    np.testing.assert_allclose(recording.times, times, atol=1e-12)
    assert any("1 repeated stamp" in str(note) for note in recording.notes)


def test_time_none_ignores_the_stamps(tmp_path):
    times = np.arange(SAMPLES) / 100.0
    times[300:] += 9.0
    path = timed(tmp_path / "run.csv", walk(), times)
    refused(path, "time", "1 gap", "5 steps", "2.990 s", "--slice")
    recording = read(path, Statement(kind="angle", time="none", sample_rate=100.0))
    assert recording.times is None
    assert recording.samples == SAMPLES


def test_slice_takes_the_sound_stretch_that_the_message_names(tmp_path):
    values = walk()
    values[100:103] = np.nan
    path = timed(tmp_path / "run.csv", values)
    message = refused(path, "x:", "3 samples NaN or infinite", "1.000 s")
    start = float(message.split("--slice ")[1].rstrip(":"))
    recording = read(path, Statement(kind="angle", span=(start, None)))
    assert recording.samples == SAMPLES - 103
    assert recording.provenance.span_s == pytest.approx((1.03, 6.0))


def test_kind_unit_and_rate_are_never_defaulted(tmp_path):
    x = walk()
    path = save(tmp_path / "run.csv", text("x[deg/s]", x))
    refused(path, "x:", "--kind", statement=Statement(sample_rate=10.0))
    refused(path, "--rate", "--time", statement=Statement(kind="rate"))
    refused(
        path, "x:", "angle", "deg/s", "--unit", statement=Statement(kind="angle", sample_rate=10.0)
    )
    bare = save(tmp_path / "bare.csv", text("x,t,alpha", x, np.arange(SAMPLES), x))
    refused(bare, "x:", "--unit", statement=Statement(kind="angle", time="t:s", table="none"))
    refused(bare, "time", "--time t:s", statement=Statement(kind="angle", unit="deg", table="none"))
    refused(
        bare,
        "table",
        "--table alpha:deg",
        statement=Statement(kind="angle", unit="deg", sample_rate=1.0),
    )
    counts = Statement(kind="angle", unit="counts", sample_rate=1.0, table="none")
    refused(bare, "x:", "--scale", statement=counts)
    both = Statement(kind="angle", unit="deg", scale="0.1arcsec", sample_rate=1.0, table="none")
    refused(bare, "x:", "contradict", "--unit", statement=both)


def test_rate_has_to_agree_with_the_stamps(tmp_path):
    path = timed(tmp_path / "run.csv", walk())
    refused(
        path, "100 Hz", "500 Hz", "--rate", statement=Statement(kind="angle", sample_rate=500.0)
    )


def test_missing_columns_list_those_there_are(tmp_path):
    path = save(tmp_path / "run.csv", text("time[s],gyro[deg]", np.arange(SAMPLES) / 10, walk()))
    refused(path, "x, y, z", "gyro[deg]", "--columns")
    refused(path, "z:", "gyro[deg]", "--columns", statement=Statement(kind="angle", gyros=("z",)))
    refused(path, "enc", "--table", statement=Statement(kind="angle", table="enc", gyros=("gyro",)))
    assert read(path, Statement(kind="angle", gyros=("gyro",))).gyros[0].name == "gyro"
    assert columns(path) == ("time[s]", "gyro[deg]")


def test_data_that_are_not_sound(tmp_path):
    values = walk()
    values[200] = np.inf
    refused(timed(tmp_path / "inf.csv", values), "x:", "1 sample", "2.000 s")
    times = np.arange(SAMPLES) / 100.0
    times[300:] -= 1.0
    refused(timed(tmp_path / "back.csv", walk(), times), "time", "backwards", "2.990 s", "--time")
    values = walk()
    values[200:400] = values[200]
    refused(timed(tmp_path / "stuck.csv", values), "x:", "stuck", "2.000 s", "--slice")
    refused(timed(tmp_path / "few.csv", walk(samples=5)), "5 samples", "too few")
    refused(save(tmp_path / "head.csv", "time[s],x[arcsec]\n"), "too few", "longer")


def test_no_file_or_not_one_of_ours(tmp_path):
    refused(tmp_path / "none.csv", "no such file")
    refused(save(tmp_path / "run.xyz", "1"), ".parquet")
    refused(save(tmp_path / "empty.csv", ""), "empty")
    (tmp_path / "folder.csv").mkdir()
    refused(tmp_path / "folder.csv", "cannot be opened")
    (tmp_path / "binary.csv").write_bytes(bytes(range(256)))
    refused(tmp_path / "binary.csv", "not text")
    path = write(example(), tmp_path / "run.parquet").rename(tmp_path / "run.csv")
    refused(path, "is Parquet", ".parquet")


@pytest.mark.parametrize("suffix", ["parquet", "mat", "npz", "h5"])
def test_not_the_format_it_claims_and_cut_off(tmp_path, suffix):
    whole = write(example(), tmp_path / f"run.{suffix}").read_bytes()
    path = tmp_path / f"bad.{suffix}"
    save(path, "time[s],x[arcsec]\n1,2\n" * 50)
    refused(path, "not", "damaged", "get the file again")
    path.write_bytes(np.random.default_rng(0).bytes(5000))
    refused(path, "damaged")
    for share in (0.01, 0.3, 0.6, 0.97):
        path.write_bytes(whole[: int(share * len(whole))])
        refused(path, "cut off", "get the file again")


def test_csv_cut_off_and_with_text_in_it(tmp_path):
    ramp = 1e4 + 7.0 * np.arange(SAMPLES) + 0.1 * walk()
    whole = timed(tmp_path / "run.csv", ramp).read_text()
    last = whole.rindex(",")
    refused(save(tmp_path / "row.csv", whole[:last]), "cut off")
    refused(save(tmp_path / "number.csv", whole[: last + 3]), "x[arcsec]", "cut off")
    unended = read(save(tmp_path / "unended.csv", whole[:-1]), Statement(kind="angle"))
    assert any("no line end" in str(note) for note in unended.notes)
    refused(save(tmp_path / "word.csv", whole.replace("0.05,", "0.05,stop")), "stop")


@pytest.mark.parametrize(
    "content",
    [
        "kind =",
        'kinds = "angle"',
        'kind = "angel"',
        "time = 5",
        'unit = "furlong"',
        "sample_rate = 0",
    ],
)
def test_toml_that_cannot_be(tmp_path, content):
    path = timed(tmp_path / "run.csv", walk())
    save(tmp_path / "run.csv.toml", content)
    refused(path, "run.csv.toml")


@pytest.mark.parametrize("start", [1000.0, SAMPLES / 100.0 - 0.01])
def test_a_slice_beyond_the_end_is_blamed_on_the_slice(tmp_path, start):
    path = timed(tmp_path / "run.csv", walk())
    said = "fewer than two samples"
    refused(path, said, "--slice", statement=Statement(kind="angle", span=(start, None)))
    options = {"time": "none", "sample_rate": 100.0, "span": (start, None)}
    refused(path, said, "--slice", statement=Statement(kind="angle", **options))


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ({"kind": "angel"}, "kind is 'angel'.*angle, increment, rate"),
        ({"kind": {"x": "angel"}}, "kind is 'angel'.*angle, increment, rate"),
        ({"unit": "furlong"}, "unit is 'furlong'.*arcsec.*deg/s.*counts"),
        ({"unit": {"x": 5}}, "unit is 5"),
        ({"unit": "2counts"}, "unit is '2counts'"),
        ({"scale": "counts"}, "scale is 'counts'.*0.1arcsec"),
        ({"scale": "0arcsec"}, "scale is '0arcsec'"),
        ({"scale": 0.1}, "scale is 0.1"),
        ({"sample_rate": -1.0}, "sample_rate is -1.0.*above zero"),
        ({"sample_rate": math.nan}, "sample_rate is nan"),
        ({"counter_bits": 12}, "counter_bits is 12.*16, 24, 32"),
        ({"gyros": ("x", "x")}, "gyros is .*different"),
        ({"gyros": ()}, "gyros is .*one or more"),
        ({"gyros": ("x", "")}, "gyros is"),
        ({"span": (5.0, 5.0)}, "span is 5:5"),
        ({"span": (-1.0, None)}, "limit -1.0"),
        ({"time": 5}, "time is 5"),
        ({"columns": {"x": 2}}, "columns is"),
    ],
)
def test_arguments_that_cannot_be(statement, said):
    with pytest.raises(ValueError, match=said) as caught:
        Statement(**statement)
    assert "\n" not in str(caught.value)


def test_parquet_in_chunks_is_the_recording_written_whole(tmp_path, monkeypatch):
    monkeypatch.setattr(parquet, "ROWS_PER_GROUP", 100)
    recording = example()
    kinds = {gyro.name: gyro.kind for gyro in recording.gyros}
    path = tmp_path / "run.parquet"
    with parquet.Writer(path, kinds=kinds, sample_rate=50.0, table=True, null_pulse=True) as out:
        for start in range(0, SAMPLES, 70):
            part = slice(start, start + 70)
            chunk = {gyro.name: gyro.values[part] for gyro in recording.gyros}
            chunk |= {
                "table": recording.table.values[part],
                "null_pulse": recording.null_pulse[part],
            }
            out.append(chunk)
        assert not path.exists()
    assert pq.ParquetFile(path).num_row_groups > 3
    chunked, whole = read(path), read(write(recording, tmp_path / "whole.parquet"))
    for one, other in zip(
        (*chunked.gyros, chunked.table), (*whole.gyros, whole.table), strict=True
    ):
        np.testing.assert_array_equal(one.values, other.values)


def test_parquet_writer_leaves_nothing_after_an_error(tmp_path):
    writer = parquet.Writer(tmp_path / "run.parquet", kinds={"x": "angle"}, sample_rate=1.0)

    def fill() -> None:
        with writer as out:
            out.append({"x": np.zeros(10)})
            out.append({"y": np.zeros(10)})

    with pytest.raises(ValueError, match="announced"):
        fill()
    assert list(tmp_path.iterdir()) == []


def test_writing_where_it_cannot_be(tmp_path):
    with pytest.raises(RecordingError, match="cannot be written"):
        write(example(), tmp_path / "no" / "run.csv")
    with pytest.raises(RecordingError, match=r"use one of .*\.csv"):
        write(example(), tmp_path / "run.imu")
    gyro = Channel(name="a,b", kind="angle", unit="rad", values=walk())
    with pytest.raises(ValueError, match="cannot stand"):
        write(Recording(gyros=(gyro,), sample_rate=1.0), tmp_path / "run.csv")


# --- recordings longer than memory should hold ------------------------------------------------

LONG = 3000


def long_columns() -> dict[str, np.ndarray]:
    """Everything that is done to a column on reading, across any border of spans."""
    counts = np.rint(np.linspace(0.0, 5.3 * 2**16, LONG) + 10.0 * walk(1, LONG))
    return {
        "time": 1_700_000_000 * 10**9 + 20_000_000 * np.arange(LONG, dtype=np.int64),
        "uneven": 5.0 + np.arange(LONG) / 50.0 + np.random.default_rng(9).uniform(0, 0.004, LONG),
        "x": ((counts + 2**15) % 2**16 - 2**15).astype(np.int32),
        "z": 3e4 * walk(2, LONG),
        "table": (7.3 * np.arange(LONG) + walk(3, LONG)) % 360.0,
        "null": (np.arange(LONG) % 100 >= 97).astype(np.uint8),
    }


def long_file(path: Path, layout: str) -> Path:
    arrays = long_columns()
    if path.suffix == ".parquet":
        rows = LONG if layout == "one piece" else 700
        pq.write_table(pa.table(arrays), path, row_group_size=rows)
    elif path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            matrix = np.column_stack([arrays.pop("z"), arrays.pop("table")])
            chunks = {} if layout == "one piece" else {"chunks": (128, 1), "compression": "gzip"}
            file.create_dataset("m", data=matrix, **chunks)
            for name, values in arrays.items():
                chunks = {} if layout == "one piece" else {"chunks": (300,), "compression": "gzip"}
                file.create_dataset(name, data=values, **chunks)
    elif path.suffix == ".npz":
        np.savez(path, **arrays)
    else:
        save(path, text(",".join(arrays), *arrays.values()))
    return path


STATED = {
    "whole": {"time": "time:ns"},
    "from a stamp": {"time": "time:ns", "span": (17.03, None)},
    "between stamps": {"time": "uneven:s", "span": (3.0, 41.7)},
    "uneven stamps": {"time": "uneven:s"},
    "between samples": {"time": "none", "sample_rate": 50.0, "span": (0.51, 59.0)},
}


@pytest.mark.parametrize("layout", ["one piece", "in pieces"])
@pytest.mark.parametrize("suffix", ["parquet", "h5", "npz", "csv"])
@pytest.mark.parametrize("stated", STATED)
def test_long_recordings_are_read_span_by_span(tmp_path, monkeypatch, suffix, layout, stated):
    path = long_file(tmp_path / f"run.{suffix}", layout)
    statement = Statement(
        kind="angle",
        unit={"x": "0.5arcsec", "z": "arcsec", "table": "deg"},
        null_pulse="null",
        columns={"x": "x", "z": "m.1", "table": "m.2"} if suffix == "h5" else {"x": "x", "z": "z"},
        **STATED[stated],
    )
    rolled = replace(statement, gyros=("x",), counter_bits=16)
    once = [read(path, one) for one in (statement, rolled)]
    monkeypatch.setattr(series, "IN_MEMORY", 0)
    for length in (97, 700):
        monkeypatch.setattr(series, "SPAN", length)
        for one, recording in zip((statement, rolled), once, strict=True):
            back = read(path, one)
            assert back.notes == recording.notes
            assert back.sample_rate == recording.sample_rate
            assert back.provenance == recording.provenance
            read_channels = (*recording.gyros, recording.table)
            for channel, other in zip((*back.gyros, back.table), read_channels, strict=True):
                assert series.is_mapped(channel.values)
                assert (channel.name, channel.kind, channel.unit) == (
                    other.name,
                    other.kind,
                    other.unit,
                )
                np.testing.assert_array_equal(channel.values, other.values)
            np.testing.assert_array_equal(back.null_pulse, recording.null_pulse)
            assert (back.times is None) == (recording.times is None) == ("uneven" not in str(one))
            if back.times is not None:
                np.testing.assert_array_equal(back.times, recording.times)
    # And both are right: the table and the counter without their wraps.
    arrays = long_columns()
    span = slice(*(round(50.0 * edge) if edge else None for edge in (one.span or (None, None))))
    if once[0].times is None:
        table = np.unwrap(np.deg2rad(arrays["table"]))[span]
        assert once[0].table.values - once[0].table.values[0] == pytest.approx(
            table - table[0], abs=1e-9
        )
        counts = np.unwrap(arrays["x"], period=2**16)[span] * 0.5 * ARCSECOND
        assert once[1].gyros[0].values - once[1].gyros[0].values[0] == pytest.approx(
            counts - counts[0], abs=1e-12
        )


def test_only_what_a_slice_needs_is_read(tmp_path):
    arrays = long_columns()
    taken = slice(1500, 1600)
    pq.write_table(pa.table(arrays), tmp_path / "run.parquet", row_group_size=500)
    metadata = pq.read_metadata(tmp_path / "run.parquet")
    spoilt = bytearray((tmp_path / "run.parquet").read_bytes())
    for group in range(metadata.num_row_groups):
        for number in range(metadata.num_columns):
            chunk = metadata.row_group(group).column(number)
            if (group, chunk.path_in_schema) != (3, "z"):
                first = chunk.dictionary_page_offset or chunk.data_page_offset
                spoilt[first : first + chunk.total_compressed_size] = bytes(
                    chunk.total_compressed_size
                )
    (tmp_path / "run.parquet").write_bytes(spoilt)
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file.create_dataset("z", data=arrays["z"], chunks=(500,), compression="gzip")
        file.create_dataset("x", data=arrays["x"], chunks=(500,), compression="gzip")
        chunks = [
            (name, file[name].id.get_chunk_info(number))
            for name in ("x", "z")
            for number in range(6)
        ]
    spoilt = bytearray((tmp_path / "run.h5").read_bytes())
    for name, chunk in chunks:
        if (name, chunk.chunk_offset) != ("z", (1500,)):
            spoilt[chunk.byte_offset : chunk.byte_offset + chunk.size] = bytes(chunk.size)
    (tmp_path / "run.h5").write_bytes(spoilt)
    stated = Statement(kind="angle", unit="arcsec", sample_rate=50.0, gyros=("z",))
    for name in ("run.parquet", "run.h5"):
        sliced = replace(stated, span=(30.0, 32.0), time="none", table="none")
        values = read(tmp_path / name, sliced).gyros[0].values
        np.testing.assert_allclose(values, arrays["z"][taken] * ARCSECOND, rtol=1e-15)
        assert values.base is None or values.base.size == 100
        refused(tmp_path / name, "damaged", statement=replace(sliced, span=None))


def test_missing_samples_and_integers_in_different_pieces(tmp_path, monkeypatch):
    big = 2**53 + 2 * np.arange(LONG)
    table = pa.table({"x": pa.array([None if i == 900 else int(v) for i, v in enumerate(big)])})
    pq.write_table(table, tmp_path / "run.parquet", row_group_size=700)
    stated = Statement(kind="angle", unit="rad", sample_rate=1.0)
    monkeypatch.setattr(series, "IN_MEMORY", 0)
    monkeypatch.setattr(series, "SPAN", 100)
    values = read(tmp_path / "run.parquet", stated, verify=False).gyros[0].values
    expected = big.astype(float)
    expected[900] = np.nan
    np.testing.assert_array_equal(values, expected)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_long_recordings_are_written_span_by_span(tmp_path, monkeypatch, suffix):
    recording = example(times=True)
    whole = read(write(recording, tmp_path / f"whole.{suffix}"))
    monkeypatch.setattr(series, "IN_MEMORY", 0)
    monkeypatch.setattr(series, "SPAN", 97)
    monkeypatch.setattr(parquet, "ROWS_PER_GROUP", 97)
    back = read(write(whole, tmp_path / f"spans.{suffix}"))
    assert back.sample_rate == whole.sample_rate
    np.testing.assert_array_equal(back.times, whole.times)
    np.testing.assert_array_equal(back.null_pulse, whole.null_pulse)
    for gyro, other in zip((*back.gyros, back.table), (*whole.gyros, whole.table), strict=True):
        np.testing.assert_allclose(gyro.values, other.values, rtol=1e-15, atol=1e-24)
