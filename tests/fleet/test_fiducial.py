import numpy as np
import pytest
from scipy.stats import chi2

from sagnac.fleet.design import chance_of_less, draws_of
from tests.fleet.examples import DYESTUFF, design_of


def test_draws_of_a_balanced_design_are_generalized_pivots() -> None:
    draws = draws_of(DYESTUFF, count=40_000, seed=1)
    random = np.random.default_rng(2)
    run = 58830.0 / random.chisquare(24, 400_000)
    batch = np.maximum(56357.5 / random.chisquare(5, 400_000) - run, 0.0) / 5.0
    levels = [0.025, 0.25, 0.5, 0.75, 0.975]
    assert np.quantile(draws["run"], levels) == pytest.approx(np.quantile(run, levels), rel=0.02)
    found, wanted = np.quantile(draws["batch"], levels), np.quantile(batch, levels)
    assert found == pytest.approx(wanted, rel=0.05)


def test_known_variances_are_taken_from_the_scatter_of_runs() -> None:
    random = np.random.default_rng(3)
    known = np.full(200, 0.04)
    values = random.normal(0.0, np.sqrt(0.04 + 0.01), 200)
    draws = draws_of(design_of(values, {}, known), seed=1)
    residual = values - values.mean()
    wanted = residual @ residual / np.random.default_rng(4).chisquare(199, 100_000) - 0.04
    assert np.quantile(draws["run"], 0.5) == pytest.approx(np.quantile(wanted, 0.5), rel=0.02)
    # Errors that are overstated leave nothing for the runs.
    assert np.quantile(draws_of(design_of(values, {}, 4.0 * known))["run"], 0.975) == 0.0


def test_a_bound_is_above_zero_however_close_the_runs_lie() -> None:
    known, count = 0.01, 12
    shape = np.random.default_rng(5).normal(size=count)
    shape -= shape.mean()
    law = chi2(count - 1)
    for length in (0.0, 1e-9, 2.0, 12.0):
        # Residual squares that sum up to `length` known variances.
        values = shape * np.sqrt(length * known / (shape @ shape))
        design = design_of(values, {}, np.full(count, known))
        assert chance_of_less(design) == pytest.approx(law.cdf(length), rel=1e-6, abs=0.0)
        draws = draws_of(design, count=10_000, bounded="run")["run"]
        # The squares over known + s are chi-square.
        wanted = known * (max(length, law.ppf(0.16)) / law.ppf(0.025) - 1.0)
        assert np.quantile(draws, 0.975) == pytest.approx(wanted, rel=0.05)


def test_bounds_hold_at_least_as_often_as_they_say() -> None:
    random, known, held = np.random.default_rng(6), 0.01, 0
    for number in range(300):
        values = random.normal(0.0, np.sqrt(known + 0.25 * known), 8)
        design = design_of(values, {}, np.full(values.size, known))
        draws = draws_of(design, count=400, seed=number, bounded="run")["run"]
        held += bool(0.25 * known <= np.quantile(draws, 0.95))
    assert held >= 0.95 * 300 - 3.0 * np.sqrt(0.95 * 0.05 * 300)
