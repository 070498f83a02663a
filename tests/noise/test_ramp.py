"""The rate ramp in noise whose law is not known."""

import math

import numpy as np
import pytest

from sagnac.noise.lowest_ordinates import rate_ramp

SAMPLES, INTERVAL = 2000, 0.5
DURATION = SAMPLES * INTERVAL


def increments(generator, walk=0.0, slope=0.0):
    """Of white rate noise of N = 1, a random walk of the rate and a ramp, rad."""
    rate = generator.standard_normal(SAMPLES) / math.sqrt(INTERVAL)
    rate += walk * math.sqrt(INTERVAL) * np.cumsum(generator.standard_normal(SAMPLES))
    return INTERVAL * (rate + slope * INTERVAL * np.arange(SAMPLES))


def found(generator, **noise):
    return rate_ramp(increments(generator, **noise), sample_rate=1.0 / INTERVAL)


# Standard errors of a slope by least squares, in white rate and in a random walk of it.
WHITE = math.sqrt(12.0 / DURATION**3)


def walking(walk):
    return walk * math.sqrt(1.2 / DURATION)


def test_the_error_of_a_ramp_allows_for_a_walk_that_could_be_unseen():
    ramp = found(np.random.default_rng(1), slope=100.0 * WHITE)
    assert ramp.status == "estimated"
    assert ramp.low < 100.0 * WHITE < ramp.high
    half = 0.5 * (ramp.high - ramp.low)
    # Least squares would say 1.96; a walk that crosses N in the sixth ordinate could be unseen.
    assert 1.9 * WHITE < half < 2.0 * math.hypot(WHITE, walking(6.0 * math.pi / DURATION))


def test_slopes_that_a_random_walk_makes_are_no_ramps():
    generator = np.random.default_rng(2)
    # Crosses N in the third ordinate: hardly any of the spectrum shows the walk.
    walk = 3.0 * math.pi / DURATION
    ramps = [found(generator, walk=walk) for _ in range(100)]
    assert sum(ramp.status == "estimated" for ramp in ramps) <= 2


@pytest.mark.parametrize(
    "crossing",
    [
        pytest.param(0.0, marks=pytest.mark.statistics),
        1.0,
        pytest.param(3.0, marks=pytest.mark.statistics),
        20.0,
    ],
)
def test_intervals_hold_whatever_the_walk(crossing):
    walk = crossing * math.pi / DURATION
    truth = 15.0 * math.hypot(WHITE, walking(walk))
    generator = np.random.default_rng([3, round(crossing)])
    ramps = [found(generator, walk=walk, slope=truth) for _ in range(100)]
    estimated = [ramp for ramp in ramps if ramp.status == "estimated"]
    assert len(estimated) > 20
    held = [ramp.low <= truth <= ramp.high for ramp in estimated]
    assert np.mean(held) >= 0.92
    bounds = [ramp.high >= truth for ramp in ramps if ramp.status == "upper bound"]
    assert not bounds or np.mean(bounds) >= 0.92


def test_sign_and_scale_do_not_matter():
    noise = increments(np.random.default_rng(4), slope=60.0 * WHITE)
    one = rate_ramp(noise, sample_rate=2.0)
    other = rate_ramp(-1e-9 * noise, sample_rate=2.0)
    assert other.status == one.status
    for name in ("value", "low", "high"):
        assert getattr(other, name) == pytest.approx(1e-9 * getattr(one, name), rel=1e-6, abs=0.0)


def test_a_long_record_is_summed_without_a_change():
    generator = np.random.default_rng(5)
    rate = generator.standard_normal(200_000) + 1e-5 * np.arange(200_000)
    fine = rate_ramp(rate, sample_rate=1.0)
    coarse = rate_ramp(rate.reshape(-1, 40).sum(axis=1), sample_rate=1.0 / 40.0)
    assert fine.status == "estimated"
    assert fine.value == pytest.approx(coarse.value, rel=1e-3)
    assert fine.low < 1e-5 < fine.high


def test_a_warm_up_that_was_taken_off_leaves_no_ramp():
    """An exponential of a third of the record and a ramp are hardly told apart."""
    settling = DURATION / 3.0
    times = INTERVAL * np.arange(SAMPLES)
    generator = np.random.default_rng(7)
    held, short = 0, 0
    for _ in range(40):
        noise = increments(generator)
        # As a fit takes it off, which follows the noise: here by 60 times the error of a slope.
        noise += INTERVAL * 60.0 * WHITE * DURATION * np.exp(-times / settling)
        alone = rate_ramp(noise, sample_rate=2.0)
        short += alone.low > 0.0
        held += rate_ramp(noise, sample_rate=2.0, settling=settling).low == 0.0
    assert short > 30
    assert held >= 38


def test_without_the_lowest_frequencies_a_ramp_is_not_observable():
    noise = increments(np.random.default_rng(6))
    masked = rate_ramp(noise, sample_rate=2.0, masked=((0.0, 0.001),))
    assert masked.status == "not observable"
    assert rate_ramp(noise[:6], sample_rate=2.0) == masked
