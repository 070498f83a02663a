"""Small files and recordings that the tests of formats read and write."""

import math
from pathlib import Path

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.formats import Statement, read
from sagnac.recording.model import Channel, Recording

ARCSECOND = math.pi / 180.0 / 3600.0


SAMPLES = 600


SUFFIXES = ("csv", "tsv", "parquet", "feather", "mat", "npz", "h5")


IMU_HEADER = """% PSINS-format SIMU log file
% comments

0.0 0.0 -90.6 0.0 0.0 0.0
34.246 108.910 380.0 0.0 5.0 9.78
0.1 0.2 0.4 125 125 125
"""


def walk(seed: int = 0, samples: int = SAMPLES) -> np.ndarray:
    return np.cumsum(np.random.default_rng(seed).normal(size=samples))


def text(header: str, *values: np.ndarray) -> str:
    rows = "\n".join(
        ",".join(repr(float(item)) for item in row) for row in zip(*values, strict=True)
    )
    return f"{header}\n{rows}\n"


def save(path: Path, content: str) -> Path:
    path.write_text(content, encoding="utf-8")
    return path


def timed(path: Path, values: np.ndarray, times: np.ndarray | None = None) -> Path:
    times = np.arange(values.size) / 100.0 if times is None else times
    return save(path, text("time[s],x[arcsec]", times, values))


def refused(path: Path, *words: str, statement: Statement | None = None) -> str:
    """The one line that `read` refuses the file with; it names the file and each word."""
    with pytest.raises(RecordingError) as caught:
        read(path, statement or Statement(kind="angle"))
    # As the command writes it: the inputs that a remedy names are options there.
    message = caught.value.line(lambda name, value: f"--{name} {value}".strip())
    assert "\n" not in message
    for word in (path.name, *words):
        assert word in message
    return message


def example(kind: str = "angle", *, times: bool = False) -> Recording:
    stamps = np.arange(SAMPLES) / 50.0 + np.random.default_rng(9).uniform(0.0, 0.004, SAMPLES)
    unit = "deg/h" if kind == "rate" else "arcsec"
    return Recording(
        gyros=tuple(
            Channel(name=name, kind=kind, shown_in=unit, values=1e-6 * walk(seed))
            for seed, name in enumerate(("left", "z"))
        ),
        sample_rate=(SAMPLES - 1) / float(stamps[-1] - stamps[0]) if times else 50.0,
        times=stamps - stamps[0] if times else None,
        table=Channel(
            name="table",
            kind="angle",
            shown_in="deg",
            values=0.02 * np.arange(SAMPLES) + 1e-4 * walk(7),
        ),
        null_pulse=np.arange(SAMPLES) % 314 == 0,
    )


def imu(path: Path, header: str = IMU_HEADER, samples: int = 2000) -> tuple[Path, np.ndarray]:
    counts = np.random.default_rng(3).integers(-9, 10, (samples, 6))
    rows = "\n".join(" ".join(str(item) for item in row) for row in counts)
    return save(path, f"{header}{rows}\n"), counts
