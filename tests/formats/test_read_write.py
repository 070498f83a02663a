"""Reading and writing by the format of the file; what every format has in common."""

import hashlib
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sagnac.core.errors import MissingExtra, RecordingError
from sagnac.formats import read, registry, write
from sagnac.formats.read_write import format_of
from sagnac.formats.registry import FORMATS, Format
from sagnac.recording.channel import Pickoff
from sagnac.recording.model import Channel, Recording
from tests.formats.examples import (
    SUFFIXES,
    example,
    refused,
    save,
    timed,
    walk,
)
from tests.processes import PYTHON, ran

pytestmark = pytest.mark.usefixtures("trusted_hdf5")


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("kind", ["angle", "increment", "rate"])
@pytest.mark.parametrize("times", [False, True])
def test_what_is_written_is_read_back_without_options(tmp_path, suffix, kind, times):
    of_force = {"kind": "rate", "shown_in": "m/s^2", "sensor": "accelerometer"}
    forces = {name: walk(seed) for seed, name in enumerate(("ax", "ay", "az"))}
    recording = replace(
        example(kind, times=times),
        accelerometers=tuple(
            Channel(name=name, values=one, **of_force) for name, one in forces.items()
        ),
        pickoffs=(Pickoff(gyro="left", values=walk(3)), Pickoff(gyro="z", values=walk(4))),
    )
    path = write(recording, tmp_path / f"run.{suffix}")
    back = read(path)
    assert [gyro.name for gyro in back.gyros] == ["left", "z"]
    for force, original in zip(back.accelerometers, recording.accelerometers, strict=True):
        assert (force.name, force.sensor) == (original.name, "accelerometer")
        assert (force.kind, force.shown_in) == ("rate", "m/s^2")
        np.testing.assert_allclose(force.values, original.values, rtol=1e-15)
    for pickoff, original in zip(back.pickoffs, recording.pickoffs, strict=True):
        assert pickoff.gyro == original.gyro
        np.testing.assert_allclose(pickoff.values, original.values, rtol=1e-14, atol=1e-14)
    for gyro, original in zip(back.gyros, recording.gyros, strict=True):
        assert (gyro.kind, gyro.shown_in) == (original.kind, original.shown_in)
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
    gyro = Channel(name="x", kind="angle", shown_in="rad", values=array)
    back = read(write(Recording(gyros=(gyro,), sample_rate=2.5), path))
    np.testing.assert_array_equal(back.gyros[0].values, array)
    assert back.sample_rate == 2.5


def test_no_file_or_not_one_of_ours(tmp_path):
    refused(tmp_path / "none.csv", "no such file")
    (tmp_path / "folder.csv").mkdir()
    refused(tmp_path / "folder.csv", "a folder", "mav0/imu0/data.csv")
    (tmp_path / "binary.csv").write_bytes(bytes(range(256)))
    refused(tmp_path / "binary.csv", "not text")


@pytest.mark.parametrize("suffix", ["parquet", "feather", "mat", "npz", "h5"])
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


def test_writing_where_it_cannot_be(tmp_path):
    with pytest.raises(RecordingError, match="cannot be written"):
        write(example(), tmp_path / "no" / "run.csv")
    with pytest.raises(RecordingError, match=r"use one of .*\.csv"):
        write(example(), tmp_path / "run.imu")
    gyro = Channel(name="a,b", kind="angle", shown_in="rad", values=walk())
    with pytest.raises(ValueError, match="cannot stand"):
        write(Recording(gyros=(gyro,), sample_rate=1.0), tmp_path / "run.csv")


@pytest.mark.parametrize("known", FORMATS, ids=lambda known: f"{known.name} {known.module}")
def test_a_format_is_known_by_suffix_and_by_beginning(known):
    for suffix in known.suffixes:
        assert format_of(suffix.upper(), known.beginning or b"anything") == known
    for suffix in known.also:
        assert format_of(suffix, known.beginning) == known
    module = __import__(f"sagnac.formats.{known.module}", fromlist=["open_source"])
    assert callable(module.open_source)
    assert not known.writes or callable(module.write)


@pytest.mark.parametrize(
    ("suffix", "beginning", "said"),
    [
        (".xyz", b"1", "no format has this suffix; unpack it, or convert it to one of .csv"),
        (".csv", b"", "is empty"),
        (".csv", b"PAR1", "is Parquet, not what its suffix claims; rename it to end in .parquet"),
        (".mat", b"PK\x03\x04", "is NumPy npz"),
        (".npz", b"MATLAB 5.0", "is MATLAB, .* end in .mat"),
    ],
)
def test_files_of_no_format(suffix, beginning, said):
    with pytest.raises(RecordingError, match=said):
        format_of(suffix, beginning)


@pytest.mark.parametrize("suffixes", [(), ("csv",), (".CSV",)])
def test_formats_that_cannot_be(suffixes):
    with pytest.raises(ValueError, match="suffixes is"):
        Format(name="odd", suffixes=suffixes, module="odd")


def test_a_library_that_is_not_installed_is_named(tmp_path, monkeypatch):
    path = timed(tmp_path / "run.csv", walk())

    def missing(name):
        raise ModuleNotFoundError(f"No module named {name!r}", name="pyarrow.csv")

    monkeypatch.setattr("sagnac.formats.read_write.import_module", missing)
    refused(path, "reading CSV needs pyarrow.csv, which is not installed", "pip install pyarrow")


def test_libraries_are_loaded_when_a_file_is_opened():
    code = (
        "import sys, sagnac.formats; "
        "print([name for name in ('h5py', 'pyarrow', 'scipy.io') if name in sys.modules])"
    )
    done = ran(PYTHON, "-c", code, check=True)
    assert done.stdout.strip() == "[]"


def test_errors_are_data(tmp_path):
    path = timed(tmp_path / "run.csv", walk())
    with pytest.raises(RecordingError) as caught:
        read(path)
    error = caught.value
    assert (error.path, error.channel) == (str(path), "x")
    assert error.problem == "its kind is not stated"
    assert error.remedy == "state {kind angle|increment|rate}"


@pytest.mark.parametrize(
    "which",
    [
        ("run.bag", "rosbag", "rosbags", "ros"),
        ("run.tdms", "tdms", "nptdms", "tdms"),
        ("run.ulg", "ulog", "pyulog", "ulog"),
        ("run.mseed", "miniseed", "pymseed", "miniseed"),
    ],
)
def test_a_library_that_is_missing_is_named_with_its_extra(tmp_path, monkeypatch, which):
    name, module, package, extra = which
    monkeypatch.delitem(sys.modules, f"sagnac.formats.{module}", raising=False)
    for loaded in [one for one in sys.modules if one.partition(".")[0] == package]:
        monkeypatch.delitem(sys.modules, loaded)
    monkeypatch.setitem(sys.modules, package, None)
    known = next(one for one in FORMATS if one.module == module)
    (tmp_path / name).write_bytes(known.beginning + bytes(64))
    with pytest.raises(MissingExtra) as caught:
        read(tmp_path / name)
    assert str(caught.value) == (
        f"{tmp_path / name}: reading {known.name} needs {package}, which is not installed; "
        f"install it with pip install '.[{extra}]' in the folder of sagnac's source"
    )


class _Point:
    """An entry point of another package."""

    def __init__(self, named):
        self.name, self._named = "mine", named

    def load(self):
        return self._named


@pytest.fixture
def points(monkeypatch):
    named = []
    monkeypatch.setattr(registry, "entry_points", lambda group: [_Point(one) for one in named])
    return named


def test_another_package_adds_a_format(tmp_path, points):
    points.append(Format(name="Mine", suffixes=(".mine",), module="tests.formats.mine"))
    recording = read(save(tmp_path / "run.mine", "".join(f"{n % 7}\n" for n in range(100))))
    assert recording.provenance.format == "Mine"
    np.testing.assert_array_equal(recording.gyros[0].values, np.arange(100) % 7)


def test_an_entry_point_names_a_format(tmp_path, points):
    points.append(object)
    with pytest.raises(TypeError, match=r"entry point mine of sagnac.formats is .* name a Format"):
        read(save(tmp_path / "run.csv", "x\n1\n"))


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("name", ["file", "args", "allow_pickle", "mdict"])
def test_a_gyro_may_be_called_as_an_argument_of_a_library(name, suffix, tmp_path):
    recording = Recording.from_arrays(**{name: walk()}, kind="rate", unit="deg/h", sample_rate=10.0)
    (found,) = read(write(recording, tmp_path / f"run.{suffix}")).gyros
    assert found.name == name
    np.testing.assert_allclose(found.values, recording.gyros[0].values, rtol=1e-14)
