"""Files of other formats with bytes changed or cut off: one line, and no other exception."""

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.formats import read
from tests.fuzz.sound import sound


# A process tries each of NetCDF first; tests/fuzz makes thousands of these and of others.
@pytest.mark.parametrize(
    ("ending", "trials"),
    [
        *((ending, 24) for ending in ("bag", "mcap", "db3", "tdms", "ulg", "mseed", "feather")),
        ("nc", 8),
    ],
)
def test_damage_is_said_in_one_line(tmp_path, ending, trials):
    sound(tmp_path, ending)
    whole = (tmp_path / f"sound.{ending}").read_bytes()
    generator = np.random.default_rng(21)
    path = tmp_path / f"bad.{ending}"
    for trial in range(trials):
        content = bytearray(whole)
        if trial % 4 == 0:
            del content[int(generator.integers(1, len(whole))) :]
        else:
            for place in generator.integers(0, len(whole), 1 + trial % 7):
                content[place] = int(generator.integers(256))
        path.write_bytes(bytes(content))
        before = set(tmp_path.iterdir())
        said = ""
        try:
            read(path, kind="rate", unit="rad/s", sample_rate=100.0, verify=False)
        except RecordingError as error:
            said = str(error)
        assert "\n" not in said
        assert set(tmp_path.iterdir()) == before


def test_a_turning_table_whose_record_has_no_whole_row_is_too_short(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time[s],x[deg/s],table[deg]\n0,10.3,0\n0.01,10.8,0.4\n0.02,10.3")
    with pytest.raises(RecordingError, match="samples are too few"):
        read(path, kind="rate", time="none", sample_rate=100.0)
