"""The largest N that the lowest frequencies of an angle allow beside noise of its readings."""

import math

import numpy as np
import pytest

from sagnac.noise.lowest_ordinates import highest_walk

SIZE, WITHIN, INTERVAL = 1024, 8, 2.0  # averages, samples of each, s
TIME = np.linspace(-1.0, 1.0, SIZE)
NO_MOTION = np.zeros((0, SIZE))


def averages(random: np.random.Generator, *, noise: float) -> np.ndarray:
    """Means of a walk of N = 1, beside white noise whose law meets N^2 at ordinate 1/noise."""
    steps = random.standard_normal(SIZE * WITHIN) * math.sqrt(INTERVAL / WITHIN)
    walk = np.cumsum(steps).reshape(SIZE, WITHIN).mean(axis=1)
    readings = noise * SIZE / np.pi * math.sqrt(INTERVAL)
    return walk + readings * random.standard_normal(SIZE)


def wander(random: np.random.Generator) -> np.ndarray:
    """Motion of a table that shows at the lowest frequencies."""
    return np.cumsum(np.cumsum(random.standard_normal(SIZE)))


def bounds(draws: int, noise: float, seed: int = 1, confidence: float = 0.95) -> np.ndarray:
    """Of recordings that hold a line, a table's wander by an error of its share, and a delay."""
    random = np.random.default_rng(seed)
    found = []
    for _ in range(draws):
        motion = wander(random)
        rate = np.gradient(motion)
        angle = averages(random, noise=noise) + 5.0 * TIME + 0.3 * motion - 2.0 * rate
        found.append(
            highest_walk(angle, np.stack([motion, rate]), interval=INTERVAL, confidence=confidence)
        )
    return np.array(found)


def test_without_noise_of_readings_the_bound_lies_close_above_the_truth():
    found = bounds(20, 0.0)
    assert np.count_nonzero(found >= 1.0) >= 16
    assert 1.05 < np.median(found) < 1.3


@pytest.mark.parametrize(("noise", "most"), [(0.1, 2.2), (0.5, 6.0)])
def test_readings_hide_what_lies_above_the_lowest_frequencies(noise, most):
    # The lowest average of all ordinates would be some sixteen times the truth at 0.5.
    found = bounds(12, noise)
    assert np.count_nonzero(found >= 1.0) >= 10
    assert np.median(found) < most


def test_no_motion_that_is_allowed_for_moves_the_bound():
    random = np.random.default_rng(4)
    motion, angle = wander(random)[np.newaxis], averages(random, noise=0.1)
    expected = highest_walk(angle, motion, interval=INTERVAL)
    more = angle + 300.0 * TIME - 40.0 * motion[0]
    assert highest_walk(more, motion, interval=INTERVAL) == pytest.approx(expected, rel=1e-6)
    assert highest_walk(more, NO_MOTION, interval=INTERVAL) > 10.0 * expected


def test_a_line_is_left_out_where_it_is_masked():
    angle = averages(np.random.default_rng(5), noise=0.0)
    line = 20.0 / (2.0 * SIZE * INTERVAL)
    heard = angle + 20.0 * np.sin(2.0 * np.pi * line * INTERVAL * np.arange(SIZE))
    expected = highest_walk(angle, NO_MOTION, interval=INTERVAL)
    beside = [(line * 0.9, line * 1.1)]
    assert highest_walk(heard, NO_MOTION, interval=INTERVAL) > 2.5 * expected
    found = highest_walk(heard, NO_MOTION, interval=INTERVAL, masked=beside)
    assert found == pytest.approx(expected, rel=0.3)


def test_lines_at_all_of_the_lowest_frequencies_leave_no_bound():
    angle = averages(np.random.default_rng(6), noise=0.0)
    everything = [(0.0, 64.0 / (2.0 * SIZE * INTERVAL))]
    assert highest_walk(angle, NO_MOTION, interval=INTERVAL, masked=everything) == math.inf


@pytest.mark.statistics
@pytest.mark.parametrize("noise", [0.0, 0.03, 0.1, 0.3, 1.0, 5.0])
@pytest.mark.parametrize("confidence", [0.95, 0.8])
def test_bounds_hold_as_often_as_they_say(noise, confidence):
    found = bounds(400, noise, confidence=confidence)
    held = float(np.mean(found >= 1.0))
    print(f"noise {noise:g}: {100.0 * held:.1f} % hold, median {np.median(found):.2f}")
    # N^2 that the noise hides is taken to be as likely as that it shows.
    assert held > confidence - 3.0 * math.sqrt(confidence * (1.0 - confidence) / 400)
