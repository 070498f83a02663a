"""Least squares beside white noise and a walk, against what was put in."""

import numpy as np
import pytest

from sagnac.table.whitened import whitened

SIZE = 9000
TIME = np.arange(SIZE) * 0.1


def averages(white: float, walk: float, seed: int) -> np.ndarray:
    """(averages,) of ten samples each of a walk, one of its steps in all, and of white noise."""
    random = np.random.default_rng(seed)
    fine = np.cumsum(random.standard_normal(10 * SIZE)) * walk / np.sqrt(10.0)
    return fine.reshape(SIZE, 10).mean(axis=1) + white * random.standard_normal(SIZE)


def hats(pieces: int) -> np.ndarray:
    """(pieces - 1, averages) slow columns, which take the lowest frequencies of any noise."""
    knots = np.arange(1.0, pieces)[:, np.newaxis]
    return np.maximum(1.0 - np.abs(TIME / TIME[-1] * pieces - knots), 0.0)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("white", "walk"), [(1.0, 0.1), (1.0, 1.0), (0.0, 1.0), (1.0, 0.0)])
def test_the_two_noises_are_told_apart(white, walk, seed):
    fit = whitened(averages(white, walk, seed), hats(8), np.inf)
    assert np.sqrt(fit.readings) == pytest.approx(white, abs=0.04 + 0.12 * (walk == 1.0))
    # The ends of white noise, which do not meet, look like a walk of its size over 9000 steps.
    assert np.sqrt(fit.walk) == pytest.approx(walk, rel=0.15, abs=3.0 * white / np.sqrt(SIZE))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_coefficients_hold_within_their_errors(seed):
    rate = np.cumsum(np.random.default_rng(50 + seed).standard_normal(SIZE)) * 0.01
    columns = np.stack([np.cumsum(rate) * 0.1, rate])
    truth = np.array([1e-3, 0.3])
    fit = whitened(averages(0.5, 0.01, seed) + truth @ columns, columns, np.inf)
    errors = np.sqrt(np.diag(fit.covariance))
    assert np.all(np.abs(fit.values - truth) < 4.0 * errors)


def test_what_grows_evenly_with_time_is_left_out():
    noise, columns = averages(1.0, 0.1, 4), hats(8)
    fit, turned = (whitened(noise + slope * TIME, columns.copy(), np.inf) for slope in (0.0, 40.0))
    assert turned.values == pytest.approx(fit.values, rel=1e-6)
    assert turned.walk == pytest.approx(fit.walk, rel=1e-6)


def test_a_line_that_no_column_holds_does_not_bend_one_that_swings_with_it():
    # A table angle with ripple at the frequency of a line of the gyro, and a slow wander.
    wander = 1e3 * np.sin(2.0 * np.pi * TIME / 200.0)
    ripple = 10.0 * np.sin(2.0 * np.pi * 0.4 * TIME)
    line = 3.0 * np.sin(2.0 * np.pi * 0.4 * TIME + 0.4)
    fit = whitened(averages(0.1, 0.001, 5) + line, (wander + ripple)[np.newaxis], 0.01)
    assert abs(fit.values[0]) < 1e-5


@pytest.mark.parametrize("phase", [0.0, 1.0, 2.0])
def test_a_strong_line_that_ends_anywhere_is_no_walk(phase):
    """It leaks to every frequency: without a fade the walk is read three to six times too large."""
    line = 10.0 * np.cos(2.0 * np.pi * 2.623 * TIME + phase)
    noise = averages(1.0, 0.03, 6)
    fit, cut = (whitened(noise + line, hats(8), np.inf, faded=faded) for faded in (True, False))
    assert np.sqrt(fit.readings) == pytest.approx(1.0, abs=0.04)
    assert np.sqrt(fit.walk) == pytest.approx(0.03, rel=0.3)
    assert np.sqrt(cut.walk) > 0.08


def test_the_walk_is_not_that_of_the_skirts_of_a_line():
    """They fill bins, which stood far above the noise and were read as a walk of 0.045."""
    line = 3.0 * np.cos(2.0 * np.pi * 0.0556 * TIME)
    fit = whitened(averages(1e-3, 0.003, 7) + line, hats(8), np.inf, faded=True)
    assert 0.002 < np.sqrt(fit.walk) < 0.007
