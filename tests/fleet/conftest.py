"""Short recordings that campaigns are tried on."""

from pathlib import Path

import numpy as np
import pytest

from sagnac.core.units import DEGREE_PER_ROOT_HOUR
from sagnac.formats import write
from sagnac.recording.model import Recording

WALK = 1e-3 * DEGREE_PER_ROOT_HOUR


def write_recording(path: Path, *, seed: int, seconds: float = 120.0) -> Path:
    """White rate noise of one gyro at 100 Hz."""
    rate = WALK * 10.0 * np.random.default_rng(seed).standard_normal(round(100.0 * seconds))
    return write(Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=100.0), path)


def write_rack(place: Path, *, second: float = 120.0) -> Path:
    """Two units on two days, and one damaged file. The second day lasts `second` seconds."""
    for number, name in enumerate(("A_day1", "A_day2", "B_day1", "B_day2")):
        seconds = 120.0 if "day1" in name else second
        write_recording(place / f"{name}.parquet", seed=number, seconds=seconds)
    whole = (place / "A_day1.parquet").read_bytes()
    (place / "C_day1.parquet").write_bytes(whole[: len(whole) // 2])
    return place


@pytest.fixture(scope="session")
def folder(tmp_path_factory) -> Path:
    return write_rack(tmp_path_factory.mktemp("recordings"))
