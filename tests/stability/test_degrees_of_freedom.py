"""Degrees of freedom against published sums, exact filters and simulation."""

import math
from itertools import product

import numpy as np
import pytest
from scipy.stats import chi2

from sagnac.stability.curve import stability_curve
from sagnac.stability.noise_type import equivalent_degrees_of_freedom
from tests import naive_stability as naive
from tests.stability.examples import THOUSAND_POINTS

PUBLISHED = ("adev", "oadev", "mdev", "hdev", "ohdev")
LONG = {"oadev": (1, 0, -1, -2), "mdev": (2, 1, 0, -2), "ohdev": (-1, -3, -4)}


@pytest.mark.parametrize(
    ("estimator", "alpha", "m", "samples"),
    [
        *(one for one in product(PUBLISHED, (2, 1, 0, -1, -2), (1, 2, 7, 20), (400,))),
        *(("ohdev", alpha, 9, 300) for alpha in (-3, -4)),
        # Long clusters are summed by panels, not over every lag.
        *((name, alpha, 700, n) for name in LONG for alpha in LONG[name] for n in (2400, 6000)),
    ],
)
def test_degrees_of_freedom_are_the_greenhall_riley_sum(estimator, alpha, m, samples):
    by_panels = m == 700
    expected = naive.greenhall_riley(
        alpha,
        3 if estimator in ("hdev", "ohdev") else 2,
        m,
        samples,
        modified=estimator == "mdev",
        overlapping=estimator not in ("adev", "hdev"),
        long_filter=by_panels and estimator != "mdev" and alpha <= 0,
    )
    found = equivalent_degrees_of_freedom(estimator, alpha, m, samples)
    assert found == pytest.approx(expected, rel=2e-4 if by_panels else 1e-6)


@pytest.mark.parametrize(
    ("alpha", "m", "tolerance"),
    [*((0, m, 1e-3) for m in (50, 128, 400)), *((2, m, 1e-9) for m in (1, 5, 300))],
)
def test_white_noise_is_exact(alpha, m, tolerance):
    """White angles, and long clusters of sampled white rates, have the covariance of the filter."""
    samples = 4001
    weights = np.concatenate((np.ones(m), -np.ones(m)))
    if alpha == 2:
        weights = np.zeros(2 * m + 1)
        weights[[0, m, 2 * m]] = 1, -2, 1
    exact = naive.filter_degrees_of_freedom(weights, samples - 2 * m)
    found = equivalent_degrees_of_freedom("oadev", alpha, m, samples)
    assert found == pytest.approx(exact, rel=tolerance)


def test_a_million_sample_cluster_costs_no_digits():
    for alpha in (2, 1, 0, -1, -2):
        long = equivalent_degrees_of_freedom("oadev", alpha, 1_000_000, 5_000_001)
        short = equivalent_degrees_of_freedom("oadev", alpha, 1000, 5001)
        # Rate noise knows only N/m; angle noise gains terms with m.
        if alpha <= 0:
            assert long == pytest.approx(short, rel=5e-3)
        else:
            assert long > short
    assert equivalent_degrees_of_freedom("mdev", 2, 1_000_000, 5_000_001) == pytest.approx(
        equivalent_degrees_of_freedom("mdev", 2, 1000, 5001), rel=5e-3
    )


@pytest.mark.parametrize(
    ("estimator", "alpha", "expected"),
    [
        ("totdev", 0, 1.5 * 100 * 400 / 405),
        ("totdev", -1, 1.17 * 100 - 0.22),
        ("totdev", -2, 0.93 * 100 - 0.36),
        ("mtotdev", 2, 1.9 * 100 - 2.1),
        ("mtotdev", 0, 1.1 * 100 - 1.2),
        ("mtotdev", -2, 0.75 * 100 - 0.31),
    ],
)
def test_total_degrees_of_freedom_of_sp1065(estimator, alpha, expected):
    assert equivalent_degrees_of_freedom(estimator, alpha, 10, 1001) == pytest.approx(expected)


@pytest.mark.parametrize("runs", [300, pytest.param(600, marks=pytest.mark.statistics)])
@pytest.mark.parametrize("alpha", [2, 0, -2])
def test_degrees_of_freedom_are_those_of_simulated_variances(alpha, runs):
    """2 (mean)^2 / variance over runs, for the families that go by fitted formulas."""
    generator = np.random.default_rng(30)
    samples = 256
    cases = {"totdev": 32, "mtotdev": 16, "theo1": 64}
    found = {name: [] for name in cases}
    for _ in range(runs):
        rates = naive.power_law_rates(generator, samples, alpha)
        for name, m in cases.items():
            curve = stability_curve(
                rates, kind="rate", sample_rate=1.0, estimator=name, taus=[m], noise_type=alpha
            )
            found[name].append(curve.deviation[0] ** 2)
    for name, m in cases.items():
        simulated = 2.0 * np.mean(found[name]) ** 2 / np.var(found[name])
        stated = equivalent_degrees_of_freedom(name, alpha, m, samples + 1)
        assert simulated == pytest.approx(stated, rel=0.3 * np.sqrt(600.0 / runs))


@pytest.mark.parametrize("m", [1, 4, 30, 99, 180, 250])
def test_total_variance_of_white_angle_noise(m):
    """(tr Q)^2 / tr Q^2 of the matrix of the total variance itself."""
    samples, last = 300, 299
    matrix = np.zeros((samples - 2, samples))
    for row, i in zip(matrix, range(1, last), strict=True):
        row[i] -= 2
        if i >= m:
            row[i - m] += 1
        else:
            row[0] += 2
            row[m - i] -= 1
        if i + m <= last:
            row[i + m] += 1
        else:
            row[last] += 2
            row[2 * last - i - m] -= 1
    gram = matrix @ matrix.T
    exact = np.trace(gram) ** 2 / np.sum(gram**2)
    assert equivalent_degrees_of_freedom("totdev", 2, m, samples) == pytest.approx(exact, rel=0.06)


def test_intervals_are_chi_squared_at_any_confidence():
    for confidence in (0.5, 0.683, 0.95, 0.999):
        curve = stability_curve(
            THOUSAND_POINTS, kind="rate", sample_rate=1.0, taus=[1, 50], confidence=confidence
        )
        tail = 0.5 * (1.0 - confidence)
        for k in range(2):
            upper, lower = chi2.ppf([1.0 - tail, tail], curve.edf[k])
            assert curve.low[k] == pytest.approx(
                curve.deviation[k] * math.sqrt(curve.edf[k] / upper)
            )
            assert curve.high[k] == pytest.approx(
                curve.deviation[k] * math.sqrt(curve.edf[k] / lower)
            )
