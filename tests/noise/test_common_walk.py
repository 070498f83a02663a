"""The angle random walk that gyros on a turning table share, against what was put in."""

import math

import numpy as np
import pytest

from sagnac.noise.cross_spectra import CommonWalk, common_walk, differenced_factor

RATE = 10.0


def averaged_triad(seed, *, share, readout=0.0, drift=0.0, gyros=3, seconds=2000):
    """Increments of 0.1 s averages of 50 Hz angles, walk 1 rad/sqrt(s), `share` of it common.

    The readout error, rad, and the drift of the rate are alike in all.
    """
    generator = np.random.default_rng(seed)
    steps = 50 * seconds
    common = math.sqrt(share) * np.cumsum(generator.standard_normal(steps))
    own = np.cumsum(generator.standard_normal((gyros, steps)), axis=1)
    angles = math.sqrt(1.0 - share) * own + common
    angles += readout * generator.standard_normal(steps)
    angles += drift * np.cumsum(np.cumsum(generator.standard_normal(steps)))
    return np.diff(angles.reshape(gyros, -1, 5).mean(axis=2), axis=1) / math.sqrt(50.0)


def found(increments):
    return common_walk(increments, sample_rate=RATE, band_hz=(0.005, 2.5))


@pytest.mark.parametrize(("share", "gyros"), [(0.3, 2), (0.6, 3)])
def test_a_common_walk_is_told_from_the_readout_of_the_encoder(share, gyros):
    shared = found(averaged_triad(1, share=share, readout=3.0, drift=1e-4, gyros=gyros))
    assert shared.is_present
    # Three standard deviations of a single draw.
    half = 0.5 * (shared.high - shared.low)
    assert abs(shared.square - share) < 1.5 * half < 0.2


def test_the_readout_of_an_encoder_alone_is_no_common_walk():
    shared = found(averaged_triad(5, share=0.0, readout=3.0))
    assert not shared.is_present
    assert shared.low <= 0.0 <= shared.high


def test_what_chance_often_does_is_no_common_walk():
    """At 2.5 standard deviations an interval of 95 % leaves zero out, which proves nothing."""
    interval = {"square": 2.5, "low": 0.5, "high": 4.5, "confidence": 0.95}
    assert not CommonWalk(**interval, error=1.0).is_present
    assert CommonWalk(**interval, error=0.8).is_present


def test_the_factor_is_that_of_the_difference():
    generator = np.random.default_rng(9)
    common, *own = generator.standard_normal((3, 100_000))
    one, other = (common * math.sqrt(0.4) + each for each in own)
    difference = np.std(one - other) / math.sqrt(2.0)
    alone = math.sqrt(0.5 * (np.var(one) + np.var(other)))
    assert differenced_factor(0.4, 1.0) == pytest.approx(difference / alone, rel=0.01)


def test_too_narrow_a_band_is_refused():
    with pytest.raises(ValueError, match="bins do not tell"):
        common_walk(averaged_triad(2, share=0.0), sample_rate=RATE, band_hz=(0.1, 0.3))


@pytest.mark.statistics
@pytest.mark.parametrize(("share", "gyros"), [(0.0, 2), (0.3, 3), (0.6, 2)])
def test_intervals_of_a_common_walk_hold(share, gyros):
    runs = [
        found(averaged_triad(seed, share=share, readout=2.0, gyros=gyros)) for seed in range(200)
    ]
    held = sum(run.low <= share <= run.high for run in runs)
    assert held >= 184
    mean = np.mean([run.square for run in runs])
    assert mean == pytest.approx(share, abs=0.02)


@pytest.mark.parametrize(
    ("square", "error", "reach"), [(-4.0, 1.0, -2.0), (-0.5, 1.0, 2.0), (4.0, 1.0, 6.0)]
)
def test_a_walk_that_is_seen_reaches_to_the_end_of_its_interval(square, error, reach):
    walk = CommonWalk(
        square=square,
        low=square - 2.0 * error,
        high=square + 2.0 * error,
        confidence=0.95,
        error=error,
    )
    assert walk.reach == reach
