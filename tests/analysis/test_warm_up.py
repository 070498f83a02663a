"""The bias that settles after power-on."""

import numpy as np
import pytest
from benchmarks.gallery import Gyro, warming

from sagnac.analysis.corrections import find_warm_up, without_warm_up
from sagnac.analysis.pipeline import analyze
from sagnac.recording.model import Recording
from tests.instruments import Readout, turntable

RATE = 100.0


def test_warm_up_is_found_and_a_walk_is_none():
    rng = np.random.default_rng(16)
    gyro = warming(rng, 60_000, RATE, gyro=Gyro(walk=0.1), rate=2.0, time=50.0)
    found = find_warm_up(gyro.increments, sample_rate=RATE)
    assert found is not None
    assert found.time == pytest.approx(50.0, rel=0.2)
    rest = without_warm_up(gyro.increments, found, sample_rate=RATE)
    assert abs(rest[:1000].mean()) < 0.05 * gyro.increments[:1000].mean()


@pytest.mark.parametrize("walk", [0.0, 0.1, 0.3, 1.0, 1e3])
def test_a_walk_does_not_settle(walk):
    rng = np.random.default_rng(16)
    for _ in range(20):
        wandering = walk * np.cumsum(rng.standard_normal(20_000)) / RATE
        rate = rng.standard_normal(20_000) + wandering
        assert find_warm_up(rate / RATE, sample_rate=RATE) is None


@pytest.mark.parametrize("time", [5.0, 20.0])
def test_what_settles_by_the_noise_of_a_sample_is_found(time):
    rng = np.random.default_rng(17)
    settling = np.exp(-np.arange(20_000) / RATE / time)
    for _ in range(20):
        rate = rng.standard_normal(20_000) + settling
        found = find_warm_up(rate / RATE, sample_rate=RATE)
        assert found is not None
        assert found.time == pytest.approx(time, rel=0.5)


def test_what_a_pair_drifts_apart_is_said_in_full():
    made = turntable(5, seconds=900.0, sample_rate=50.0, walk=1e-3, readout=Readout(step=1e-3))
    seconds = np.arange(made.encoder.size) / 50.0
    x = made.angles["x"] - 20.0 * 60.0 * np.exp(-seconds / 60.0)
    recording = Recording.from_arrays(
        x=x,
        z=made.angles["z"],
        table=made.encoder,
        kind="angle",
        unit="arcsec",
        sample_rate=50.0,
    )
    analysis = analyze(recording, gyros=("x", "z"))
    (text,) = [note.text for note in analysis.notes if "the rate settles by" in note.text]
    assert float(text.split("settles by ")[1].split()[0]) == pytest.approx(20.0, rel=0.1)
