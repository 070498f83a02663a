"""Recordings that the commands are tried on."""

from pathlib import Path

import numpy as np
import pytest

from sagnac.cli import main


@pytest.fixture(scope="session")
def recording(tmp_path_factory) -> Path:
    """Five minutes of the quiet rig at 100 Hz: states everything itself."""
    folder = tmp_path_factory.mktemp("recording")
    config = folder / "config.toml"
    config.write_text('preset = "quiet"\nsample_rate_hz = 100.0\n')
    path = folder / "run.parquet"
    assert main(["simulate", str(config), "-o", str(path), "--duration", "5min"]) == 0
    return path


@pytest.fixture(scope="session")
def still(recording) -> Path:
    """A minute of the same rig at rest."""
    path = recording.with_name("still.parquet")
    arguments = ["simulate", str(recording.with_name("config.toml")), "-o", str(path)]
    assert main([*arguments, "--duration", "60", "--table-rate", "0"]) == 0
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
