"""Reading a file, and naming it in what goes wrong afterwards."""

import numpy as np
import pytest

from sagnac.cli.output import naming, read_file
from sagnac.core.errors import RecordingError
from sagnac.formats import Statement
from sagnac.recording.model import Recording

RECORDING = Recording.from_arrays(x=[-1.5, 0.0, 2.5], kind="rate", unit="deg/h", sample_rate=100.0)


def test_an_error_that_names_no_file_gets_one_and_another_keeps_its_own(tmp_path):
    with pytest.raises(RecordingError) as caught, naming(tmp_path / "a.csv", RECORDING):
        raise RecordingError("is stuck", channel="x")
    assert str(caught.value) == f"{tmp_path / 'a.csv'}: x: is stuck"
    with pytest.raises(RecordingError) as caught, naming(tmp_path / "a.csv", RECORDING):
        raise RecordingError("is no TOML", path="a.toml")
    assert str(caught.value) == "a.toml: is no TOML"


def test_numbers_that_a_library_cannot_take_are_told(tmp_path):
    with pytest.raises(RecordingError) as caught, naming(tmp_path / "a.csv", RECORDING):
        raise np.linalg.LinAlgError("Singular matrix")
    assert str(caught.value) == (
        f"{tmp_path / 'a.csv'}: the analysis fails (Singular matrix) on x: 3 samples from "
        "-1.5 to 2.5 deg/h; look at the data with sagnac check"
    )


def test_reading_is_timed_and_told(bare):
    told = []
    statement = Statement(kind="rate", unit="deg/h", sample_rate=100.0)
    read = read_file(bare, statement, lambda stage, fraction: told.append((stage, fraction)))
    assert read.recording.samples == 4000
    assert list(read.seconds) == ["read"]
    assert told == [("read", 0.0), ("read", 1.0)]
