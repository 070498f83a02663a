"""Short recordings that campaigns are tried on."""

from pathlib import Path

import numpy as np
import pytest

from sagnac.core.units import DEGREE_PER_ROOT_HOUR
from sagnac.formats import write
from sagnac.recording.model import Recording

WALK = 1e-3 * DEGREE_PER_ROOT_HOUR


def write_recording(path: Path, *, seed: int, seconds: float = 120.0, walk: float = WALK) -> Path:
    """White rate noise of one gyro at 100 Hz."""
    random = np.random.default_rng(seed)
    rate = walk * 10.0 * random.standard_normal(round(100.0 * seconds))
    write(
        Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=100.0),
        path,
    )
    return path


@pytest.fixture(scope="session")
def folder(tmp_path_factory) -> Path:
    """Two units on two days, and one file that is damaged."""
    place = tmp_path_factory.mktemp("recordings")
    for number, name in enumerate(("A_day1", "A_day2", "B_day1", "B_day2")):
        write_recording(place / f"{name}.parquet", seed=number)
    whole = (place / "A_day1.parquet").read_bytes()
    (place / "C_day1.parquet").write_bytes(whole[: len(whole) // 2])
    return place
