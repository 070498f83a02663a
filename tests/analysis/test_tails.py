"""The interval of noise whose large deviations are more frequent than normal ones."""

import numpy as np
import pytest
from scipy.special import ndtri

from sagnac import Recording, analyze

SAMPLES, RATE = 120_000, 100.0
HALF_AN_HOUR = 180_000


def walk_of(noise):
    still = Recording.from_arrays(x=1e-6 * noise, kind="rate", unit="rad/s", sample_rate=RATE)
    return analyze(still).angle_random_walk


def half_width(estimate):
    return 0.5 * np.log(float(estimate.high) / float(estimate.low))


@pytest.mark.parametrize("draw", ["laplace", "mixed"])
def test_a_fourth_cumulant_widens_the_interval_by_what_it_adds(draw):
    rng = np.random.default_rng(2)
    if draw == "laplace":
        noise = rng.laplace(size=SAMPLES)
    else:
        noise = rng.standard_normal(SAMPLES) * np.where(rng.random(SAMPLES) < 0.05, 5.0, 1.0)
    noise /= noise.std()
    # The same order with normal sizes: what differs is the distribution alone.
    normal = ndtri((np.argsort(np.argsort(noise)) + 0.5) / SAMPLES)
    excess = np.mean(noise**4) - 3.0
    without = half_width(walk_of(normal))
    expected = np.hypot(without, 1.96 * 0.5 * np.sqrt(excess / SAMPLES))
    assert half_width(walk_of(noise)) == pytest.approx(expected, rel=0.02)
    assert expected > 1.2 * without


def with_tails(seed, louder=1.0):
    """Student's noise with four degrees of freedom; its second half is multiplied by `louder`."""
    noise = np.random.default_rng([seed, 4]).standard_t(4.0, size=SAMPLES // 2)
    return noise * np.where(np.arange(noise.size) < noise.size // 2, 1.0, louder)


def is_unsteady(noise):
    still = Recording.from_arrays(x=1e-6 * noise, kind="rate", unit="rad/s", sample_rate=RATE)
    return "unsteady" in {note.name for note in analyze(still).findings}


@pytest.mark.parametrize("draws", [2, pytest.param(8, marks=pytest.mark.statistics)])
def test_even_noise_with_tails_is_steady(draws):
    """Its parts differ by 5 to 10 %, more than normal noise does: these two had a warning each."""
    assert sum(is_unsteady(with_tails(seed)) for seed in range(draws)) <= draws // 8


def test_noise_with_tails_that_grows_is_unsteady():
    assert all(is_unsteady(with_tails(seed, louder=1.2)) for seed in range(2))


@pytest.mark.statistics
@pytest.mark.parametrize("draw", ["laplace", "student"])
def test_intervals_of_noise_with_tails_hold_the_truth(draw):
    """The truth is that of the distribution, not of the samples drawn from it."""
    held = []
    for seed in range(1000, 1040):
        rng = np.random.default_rng(seed)
        if draw == "laplace":
            noise = rng.laplace(size=HALF_AN_HOUR) / np.sqrt(2.0)
        else:
            noise = rng.standard_t(5.0, size=HALF_AN_HOUR) / np.sqrt(5.0 / 3.0)
        walk = walk_of(noise)
        # White noise of a rate: N is its deviation over the root of the sample rate.
        held.append(float(walk.low) <= 1e-6 / np.sqrt(RATE) <= float(walk.high))
    print(f"{draw}: {sum(held)} of {len(held)} hold")
    assert sum(held) >= 36
