"""Reading a file, and naming it in what goes wrong afterwards."""

import numpy as np
import pytest

from sagnac.cli.options import Reading, reading
from sagnac.core.errors import RecordingError

STATED = Reading(kind="rate", unit="deg/h", rate=100.0)


@pytest.fixture
def few(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("x\n" + "-1.5\n0.5\n0.0\n2.5\n" * 4)
    return path


def test_an_error_that_names_no_file_gets_one_and_another_keeps_its_own(few):
    with pytest.raises(RecordingError) as caught, reading(few, STATED):
        raise RecordingError("is stuck", channel="x")
    assert str(caught.value) == f"{few}: x: is stuck"
    with pytest.raises(RecordingError) as caught, reading(few, STATED):
        raise RecordingError("is no TOML", path="a.toml")
    assert str(caught.value) == "a.toml: is no TOML"


def test_numbers_that_a_library_cannot_take_are_told(few):
    with pytest.raises(RecordingError) as caught, reading(few, STATED):
        raise np.linalg.LinAlgError("Singular matrix")
    assert str(caught.value) == (
        f"{few}: the analysis fails (Singular matrix) on x: 16 samples from "
        "-1.5 to 2.5 deg/h; look at the data with sagnac check"
    )


def test_reading_is_timed(bare):
    with reading(bare, STATED) as read:
        assert read.recording.samples == 4000
    assert list(read.seconds) == ["read"]
