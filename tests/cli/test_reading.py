"""Reading a file, and naming it in what goes wrong afterwards."""

import pytest

from sagnac.cli.reading import naming, read_file
from sagnac.errors import RecordingError
from sagnac.formats import Statement


def test_an_error_that_names_no_file_gets_one_and_another_keeps_its_own(tmp_path):
    with pytest.raises(RecordingError) as caught, naming(tmp_path / "a.csv"):
        raise RecordingError("is stuck", channel="x")
    assert str(caught.value) == f"{tmp_path / 'a.csv'}: x: is stuck"
    with pytest.raises(RecordingError) as caught, naming(tmp_path / "a.csv"):
        raise RecordingError("is no TOML", path="a.toml")
    assert str(caught.value) == "a.toml: is no TOML"


def test_reading_is_timed_and_told(bare):
    told = []
    statement = Statement(kind="rate", unit="deg/h", sample_rate=100.0)
    read = read_file(bare, statement, lambda stage, fraction: told.append((stage, fraction)))
    assert read.recording.samples == 4000
    assert list(read.seconds) == ["read"]
    assert told == [("read", 0.0), ("read", 1.0)]
