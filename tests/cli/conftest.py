"""Recordings that the commands are tried on."""

from pathlib import Path

import numpy as np
import pytest

from sagnac.cli import main


@pytest.fixture(scope="session")
def rig(tmp_path_factory) -> Path:
    """The quiet rig at 100 Hz, which states everything itself."""
    config = tmp_path_factory.mktemp("rig") / "config.toml"
    config.write_text('preset = "quiet"\nsample_rate_hz = 100.0\n')
    return config


@pytest.fixture(scope="session")
def recording(rig) -> Path:
    """Five minutes of it."""
    path = rig.with_name("run.parquet")
    assert main(["simulate", str(rig), "-o", str(path), "--duration", "5min"]) == 0
    return path


@pytest.fixture(scope="session")
def still(rig) -> Path:
    """A minute of it at rest."""
    path = rig.with_name("still.parquet")
    words = ["simulate", str(rig), "-o", str(path), "--duration", "60", "--table-rate", "0"]
    assert main(words) == 0
    return path


@pytest.fixture(scope="session")
def bare(tmp_path_factory) -> Path:
    """White rate noise of one gyro, in a CSV that says nothing about it."""
    path = tmp_path_factory.mktemp("bare") / "bare.csv"
    rate = np.random.default_rng(5).normal(size=4000)
    path.write_text("x\n" + "\n".join(f"{value:.6f}" for value in rate) + "\n")
    return path


@pytest.fixture(scope="session")
def gapped(bare) -> Path:
    """The white noise with time stamps, 500 samples not there and three NaN."""
    rate = np.loadtxt(bare, skiprows=1)
    rate[[100, 101, 3500]] = np.nan
    rows = [f"{place / 100.0:.2f},{rate[place]:.6f}" for place in range(rate.size)]
    path = bare.with_name("gapped.csv")
    path.write_text("t,x\n" + "\n".join(rows[:600] + rows[1100:]) + "\n")
    return path
