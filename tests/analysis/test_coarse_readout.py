"""Coarse readouts through the whole analysis of a still bench."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.recording.model import Channel, Recording
from tests.noise.examples import read_out


def bench(walk, samples, seed, *, step, rate=10.0):
    """A still gyro read out in steps; `walk` in rad/sqrt(s), `step` in rad."""
    _, reading = read_out(walk / math.sqrt(rate) / step, samples, seed)
    gyro = Channel(name="x", kind="angle", shown_in="rad", values=step * reading)
    return Recording(gyros=(gyro,), sample_rate=rate)


@pytest.mark.parametrize("draws", [6, pytest.param(16, marks=pytest.mark.statistics)])
def test_a_coarse_readout_on_a_still_bench_does_not_shorten_the_interval(draws):
    # 1e-5 deg/sqrt(h) and 0.001 arcsec: a fifth of a step between the angles of a fit.
    step, walk = math.radians(0.001 / 3600.0), math.radians(1e-5) / 60.0
    errors = []
    for seed in range(draws):
        result = analyze(
            bench(walk, 12_000, seed, step=step), Settings(gyros=("x",), method="none")
        )
        answer = result.angle_random_walk
        assert answer.status == "estimated"
        assert [note for note in result.notes if "readout step of x (0.001 arcsec)" in note.text]
        errors.append((answer.value - walk) / ((answer.high - answer.low) / (2.0 * 1.96)))
    # The mean of independent errors of unit variance, and the sum of their squares, which chance
    # makes larger once in a thousand.
    assert abs(np.mean(errors)) < 3.0 / math.sqrt(draws)
    assert np.sum(np.square(errors)) < chi2.ppf(0.999, draws)


@pytest.mark.parametrize("draws", [2, pytest.param(10, marks=pytest.mark.statistics)])
@pytest.mark.parametrize("walk", [5e-6, 1e-5])
def test_a_readout_that_hides_the_walk_leaves_a_bound(walk, draws):
    step, walk = math.radians(0.01 / 3600.0), math.radians(walk) / 60.0
    for seed in range(draws):
        result = analyze(
            bench(walk, 12_000, seed, step=step), Settings(gyros=("x",), method="none")
        )
        answer = result.angle_random_walk
        assert answer.status == "upper bound"
        assert walk < answer.high < 30.0 * walk
        assert [note for note in result.notes if "too few times" in note.text]
        fit = result.fits["likelihood"].coefficients["angle_random_walk"]
        assert fit.status == "not observable"
