"""Every band and every choice of terms against the likelihood itself."""

import numpy as np
import pytest
from benchmarks.gallery import Gyro, low_passed, swaying
from scipy.stats import gamma

from sagnac.noise.band_models import (
    FALL,
    WALK,
    ScaledLaws,
    band_models,
    fitted_models,
    models_of_one_band,
)
from sagnac.spectrum.levels import robust_levels
from sagnac.spectrum.tapered import tapered_spectrum


def fitted(level, shape, laws, columns):
    """Squares and covariance of the one model of all bins."""
    relative = np.zeros((level.size, FALL + 1))
    relative[:, columns] = laws
    relative[:, :FALL] /= level[:, None]
    ones = np.ones(level.size)
    scaled = ScaledLaws(
        shape=shape, chance=ones, low_passed=ones > 0.0, laws=relative, scale=np.ones(FALL + 1)
    )
    _, squares, covariance = fitted_models(
        scaled, np.array([[0, level.size]]), np.array([columns]), np.array([np.inf])
    )
    return squares[0], covariance[0]


# Bins, their shape, the terms of the mean at their rise, the columns of these and their truth.
FITS = {
    "two terms": (12, 40.0, np.geomspace(1e-2, 4.0, 12), [0, 1], [0.5, 1.0]),
    "a fall": (14, 60.0, np.geomspace(1e-3, 1.0, 14), [WALK, FALL], [1.0, 1.0]),
    # Frequencies of 0.1 to 30 corners of a filter of first order, below which 70 times N is read.
    "a readout behind a fall": (
        *(25, 80.0, np.geomspace(0.01, 900.0, 25) / 900.0),
        *([0, WALK, FALL], [70.0, 1.0, 900.0]),
    ),
}


@pytest.mark.parametrize("name", FITS)
def test_a_fit_is_the_maximum_of_the_gamma_likelihood(name):
    bins, shape, rise, columns, truth = FITS[name]
    shape = np.full(bins, shape)

    def mean_of(b):
        if FALL not in columns:
            return b[0] * rise + b[1]
        return (b[0] * rise if len(b) == 3 else 0.0) + b[-2] / (1.0 + b[-1] * rise)

    laws = np.stack([np.ones(bins) if one == WALK else rise for one in columns], axis=1)
    level = np.random.default_rng(13).gamma(shape, mean_of(truth) / shape)
    best, covariance = fitted(level, shape, laws, columns)
    assert np.all(np.abs(best - truth) < 4.0 * np.sqrt(np.diagonal(covariance)))

    def cost(b):
        return -gamma.logpdf(level, shape, scale=mean_of(b) / shape).sum()

    steps = np.diag(1e-4 * best)
    for step in (*steps, *-steps):
        assert min(cost(best + 10.0 * step), cost(best + 100.0 * step)) > cost(best) - 1e-6
    slope = [
        np.log(mean_of(best + step) / mean_of(best - step)) / (2.0 * step.sum()) for step in steps
    ]
    fisher = np.array(slope) @ np.diag(shape) @ np.transpose(slope)
    assert np.allclose(covariance, np.linalg.inv(fisher))


def test_models_of_one_band_hold_the_walk_and_no_term_outside_the_mask():
    values = np.random.default_rng(21).standard_normal(20_000) / 10.0
    levels = robust_levels(tapered_spectrum(values, sample_rate=100.0))
    models = models_of_one_band(levels, (0.1, 30.0), 0b0011)
    assert 1 <= models.count <= 2
    assert models.holding(WALK).all()
    assert not (models.mask & ~0b0011).any()
    assert np.sqrt(models.squares[models.mask == 0b0010, WALK]) == pytest.approx(1.0, rel=0.03)
    assert models_of_one_band(levels, (49.0, 49.5), 0b0011).count == 0


@pytest.mark.parametrize("order", [1, 2])
def test_a_low_pass_is_a_divisor_of_the_walk_at_its_own_corner(order):
    levels = robust_levels(
        tapered_spectrum(
            low_passed(
                np.random.default_rng(2), 200_000, 100.0, gyro=Gyro(), corner=0.02, order=order
            ).increments,
            sample_rate=100.0,
        )
    )
    models = models_of_one_band(levels, (0.0, 2.2), 1 << WALK | 1 << (FALL + order - 1))
    row = int(np.argmax(models.falling))
    assert models.falling[row]
    assert np.sqrt(models.squares[row, WALK]) == pytest.approx(1.0, rel=0.02)
    # |H|^2 = 1/(1 + (f/corner)^(2 order)), the corner at 2 Hz.
    corner = models.squares[row, FALL + order - 1] ** (-0.5 / order)
    assert corner == pytest.approx(2.0, rel=0.05)


def test_the_top_of_a_hump_is_no_walk_if_the_spectrum_below_it_is_lower():
    gyro = swaying(np.random.default_rng(5), 60_000, 100.0, gyro=Gyro(), peak=30.0, low=0.3)
    models = band_models(robust_levels(tapered_spectrum(gyro.increments, sample_rate=100.0)))
    high = models.squares[:, WALK] > 4.0
    assert high.any()
    assert models.weights[high].sum() < 1e-6


def test_laws_that_fall_by_thirty_decades_in_the_level_are_fitted_in_every_band():
    # A law of such a size at the lowest frequency leaves nothing of the highest in a running sum,
    # and what is fitted there began at infinity.
    steep = np.diff(np.random.default_rng(3).standard_normal(40_000), n=4)
    levels = robust_levels(tapered_spectrum(steep, sample_rate=100.0))
    models = band_models(levels)
    assert models.count
    assert np.isfinite(models.squares).all()
