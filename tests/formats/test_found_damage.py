"""Damaged files that once were answered with something else than one line."""

import pytest

from sagnac.errors import RecordingError
from sagnac.formats import read
from tests.fuzz.test_readers import SEED, sound
from tests.fuzz.worker import STATEMENTS, damaged, outcome


@pytest.mark.parametrize(("suffix", "number"), [("mat", 106), ("h5", 4), ("h5", 9), ("csv", 1799)])
def test_damage_that_once_escaped(tmp_path, suffix, number):
    sound(tmp_path, suffix)
    path = damaged(tmp_path, suffix, SEED, number)
    assert outcome(path, STATEMENTS[number % len(STATEMENTS)]) in ("read", "refused")


def test_a_row_that_is_no_text_is_refused_in_one_line(tmp_path, capfd):
    path = tmp_path / "run.csv"
    rows = [b"x[deg/s],z[deg/s]", *(b"%d.5,1.25" % n for n in range(200)), b"1.0,2.0,\xff\xff"]
    path.write_bytes(b"\n".join([*rows, b""]))
    with pytest.raises(RecordingError) as caught:
        read(path, sample_rate=100.0)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr().err == ""
