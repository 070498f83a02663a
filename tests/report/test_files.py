"""Files whole or not at all."""

import pytest

from sagnac.errors import RecordingError
from sagnac.report import files


def test_nothing_is_left_of_a_file_that_cannot_be_written(tmp_path):
    with pytest.raises(RecordingError, match="cannot be written"):
        files.write_text(tmp_path / "none" / "a.json", "{}")
    assert list(tmp_path.iterdir()) == []
