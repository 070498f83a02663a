"""Statements in a TOML beside the file and in attributes."""

import h5py
import numpy as np
import pytest

from sagnac import analyze, judge
from sagnac.core.errors import RecordingError
from sagnac.core.units import DEGREE_PER_ROOT_HOUR
from sagnac.formats import Statement, read
from sagnac.formats.statement import beside, from_mapping
from tests.formats.examples import ARCSECOND, refused, save, text, timed, walk


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


def test_a_rate_against_that_of_the_file_is_told_and_leaves_a_limit_undecided(tmp_path):
    """Ten times the rate makes N smaller by the root of ten, and a gyro out of its limit passed."""
    walk_rate = 0.15 / 60.0 * np.sqrt(100.0)  # deg/s of 0.15 deg/sqrt(h) at 100 Hz
    rates = walk_rate * np.random.default_rng(3).standard_normal(20_000)
    with h5py.File(tmp_path / "run.h5", "w") as file:
        column = file.create_dataset("x", data=rates)
        column.attrs.update({"unit": "deg/s", "kind": "rate"})
        file.attrs["sample_rate"] = 100.0
    typed = read(tmp_path / "run.h5", Statement(sample_rate=1000.0))
    (warned,) = (note for note in typed.notes if note.level == "warning")
    assert str(warned) == "time: the file says 100 Hz, taken as 1000 Hz as stated"
    (judged,) = judge(analyze(typed), "0.1deg/sqrt(h)").judgements
    assert judged.estimate.high < 0.1 * DEGREE_PER_ROOT_HOUR
    assert judged.decision == "undecided"
    # What the file says, or what was measured beside it, is no contradiction.
    for rate in (None, 100.0, 99.7):
        alike = read(tmp_path / "run.h5", Statement(sample_rate=rate))
        assert not [note for note in alike.notes if note.level == "warning"]
        (judged,) = judge(analyze(alike), "0.1deg/sqrt(h)").judgements
        assert judged.decision == "fail"


def test_a_rate_is_no_contradiction_where_labview_knows_none_or_stamps_rule(tmp_path):
    rows = "".join(f"\t{value!r}\n" for value in walk().tolist())
    head = "LabVIEW Measurement\nX_Columns\tNo\n***End_of_Header***\t\nDelta_X\t{}\t\n"
    for step, said in (("1.000000", 0), ("0.010000", 1)):
        whole = f"{head.format(step)}***End_of_Header***\t\nX_Value\tx\n{rows}"
        path = save(tmp_path / "run.lvm", whole)
        taken = read(path, Statement(kind="angle", unit="arcsec", sample_rate=200.0))
        assert taken.sample_rate == 200.0
        assert sum("taken as 200 Hz as stated" in str(note) for note in taken.notes) == said
    # The column of times that such a file names is empty, and is offered to nobody.
    assert not read(path, Statement(kind="angle", unit="arcsec")).notes
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["x"], file["time"] = walk(), np.arange(walk().size) / 100.0
        file.attrs["sample_rate"] = 50.0
    stamped = Statement(kind="angle", unit="arcsec", sample_rate=100.0, time="time:s")
    assert "warning" not in {note.level for note in read(tmp_path / "run.h5", stamped).notes}
    with h5py.File(tmp_path / "run.h5", "a") as file:
        file.attrs["sample_rate"] = 100.0
    (offer,) = read(tmp_path / "run.h5", Statement(kind="angle", unit="arcsec")).notes
    assert "{time time:UNIT} takes it" in offer.text


def test_toml_of_the_same_stem_counts_only_if_it_is_a_statement(tmp_path):
    path = timed(tmp_path / "run.csv", walk())
    save(tmp_path / "run.toml", 'kind = "angle"\n')
    assert read(path).gyros[0].kind == "angle"
    save(tmp_path / "run.toml", "sample_rate = 3.0\nlatitude_deg = 28.0\n")
    assert any("run.toml" in str(note) for note in read(path, Statement(kind="angle")).notes)


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


def test_the_toml_is_named_not_the_file(tmp_path):
    path = timed(tmp_path / "run.csv", walk())
    save(tmp_path / "run.csv.toml", 'kind = "angel"')
    with pytest.raises(RecordingError) as caught:
        beside(path)
    assert caught.value.path == str(tmp_path / "run.csv.toml")
    assert caught.value.problem == "kind is 'angel'; use one of angle, increment, rate"


def test_flat_text_stands_for_lists_and_mappings():
    stated = from_mapping(
        {"gyros": "x, z", "unit": "x=arcsec, table=deg", "sample_rate": "250", "counter_bits": "16"}
    )
    assert stated == Statement(
        gyros=("x", "z"),
        unit={"x": "arcsec", "table": "deg"},
        sample_rate=250.0,
        counter_bits=16,
    )


@pytest.mark.parametrize(
    "content", [{"unit": "x=arcsec,deg"}, {"sample_rate": "fast"}, {"span": [1, 2]}, {"gyros": 5}]
)
def test_metadata_that_cannot_be(content):
    with pytest.raises(RecordingError):
        from_mapping(content)
