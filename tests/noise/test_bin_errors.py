"""What the levels show beside chance, against levels drawn with errors that are known."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.noise.band_models import FALL, FLOOR, models_of_one_band
from sagnac.noise.laws import rate_density_basis
from sagnac.noise.model_average import error_of_bins, with_error_of_bins
from sagnac.noise.slow_laws import WALK
from sagnac.spectrum.levels import robust_levels
from sagnac.spectrum.tapered import tapered_spectrum

INTERVAL = 0.01
# Squared N and K of the levels that are drawn.
SQUARES = (1.0, 0.3)
MASK = 0b1010
ALL = (0.0, 50.0)


@pytest.fixture(scope="module")
def levels():
    noise = np.random.default_rng(4).standard_normal(100_000)
    return robust_levels(tapered_spectrum(noise, sample_rate=1.0 / INTERVAL))


@pytest.fixture(scope="module")
def laws(levels):
    return levels.law(lambda frequency: rate_density_basis(frequency, INTERVAL))


def drawn(levels, laws, generator, *, shape, error):
    """Levels of the law, with gamma chance of a shape and a relative error besides."""
    mean = laws[:, [1, 3]] @ SQUARES
    chance = generator.gamma(shape, 1.0 / np.asarray(shape), mean.size)
    besides = np.exp(error * generator.standard_normal(mean.size))
    return replace(
        levels,
        level=mean * chance * besides,
        shape=np.broadcast_to(shape, mean.shape).copy(),
        outstanding=np.zeros(mean.size),
    )


def fitted(levels):
    models = models_of_one_band(levels, ALL, MASK).heaviest()
    return models.kept(models.mask == MASK)


@pytest.mark.parametrize(
    ("error", "low", "high"), [(0.01, 0.009, 0.011), (0.02, 0.018, 0.022), (0.1, FLOOR, FLOOR)]
)
def test_the_error_beside_chance_is_found_and_is_the_floor_at_most(levels, laws, error, low, high):
    generator = np.random.default_rng(5)
    found = []
    for _ in range(60):
        some = drawn(levels, laws, generator, shape=1e6, error=error)
        found.append(error_of_bins(some, fitted(some)))
    assert low <= np.median(found) <= high
    assert max(found) <= FLOOR


@pytest.mark.parametrize("draws", [60, pytest.param(200, marks=pytest.mark.statistics)])
def test_chance_alone_leaves_no_error_in_half_of_the_recordings(levels, laws, draws):
    generator = np.random.default_rng(6)
    none = 0
    for _ in range(draws):
        some = drawn(levels, laws, generator, shape=levels.shape, error=0.0)
        none += error_of_bins(some, fitted(some)) == 0.0
    # Three standard errors of as many throws of a coin.
    assert abs(none - 0.5 * draws) < 3.0 * np.sqrt(0.25 * draws)


@pytest.mark.parametrize(
    ("error", "draws"),
    [
        (0.02, 100),
        pytest.param(0.0, 1000, marks=pytest.mark.statistics),
        pytest.param(0.02, 1000, marks=pytest.mark.statistics),
    ],
)
def test_the_covariance_is_the_scatter_of_the_fits(levels, laws, error, draws):
    generator = np.random.default_rng(7)
    squares, own, allowed = [], [], []
    for _ in range(draws):
        some = drawn(levels, laws, generator, shape=3000.0, error=error)
        models = fitted(some)
        squares.append(models.squares[0, [WALK, 3]])
        allowed.append(models.covariance[0, WALK, WALK])
        own.append(with_error_of_bins(some, models, error).covariance[0])
    scatter = np.cov(np.array(squares).T)
    expected = np.mean(own, axis=0)[np.ix_([WALK, 3], [WALK, 3])]
    # A variance of 1000 draws errs by 4.5 %: 3.3 of such errors.
    np.testing.assert_allclose(np.diag(expected), np.diag(scatter), rtol=3.3 * np.sqrt(2.0 / draws))
    assert np.mean(allowed) > 1.3 * scatter[0, 0]


def test_the_floor_itself_changes_nothing(levels, laws):
    some = drawn(levels, laws, np.random.default_rng(8), shape=500.0, error=0.0)
    some = replace(some, level=some.level / (1.0 + (some.frequency / 60.0) ** 2))
    models = models_of_one_band(some, ALL, MASK | 1 << FALL)
    assert models.falling.any()
    same = with_error_of_bins(some, models, FLOOR)
    scale = np.sqrt(np.einsum("mii->mi", models.covariance))
    scale = np.where(scale > 0.0, scale, 1.0)
    relative = (same.covariance - models.covariance) / (scale[:, :, None] * scale[:, None, :])
    assert np.abs(relative).max() < 1e-6
