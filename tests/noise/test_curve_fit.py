"""Fits to a curve: exact on laws, honest on noise."""

import math
from functools import cache

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.stats import binom

from sagnac.core.errors import RecordingError
from sagnac.noise.curve_fit import paper_fit, paper_squares, weighted_fit
from sagnac.stability.curve import StabilityCurve, stability_curve
from tests.noise.examples import NAMES, white

# Five terms, each of which rules some part of the curve from 1 s to a quarter of 2e6 s.
TRUTH = dict(zip(NAMES, (3.0, 0.2, 0.01, 1e-4, 1e-6), strict=True))


def law_curve(truth, *, samples, taus):
    """A curve that is Eq. 3 exactly."""
    variance = (
        3.0 * truth["quantization"] ** 2 / taus**2
        + truth["angle_random_walk"] ** 2 / taus
        + 2.0 * math.log(2.0) / math.pi * truth["bias_instability"] ** 2
        + truth["rate_random_walk"] ** 2 * taus / 3.0
        + truth["rate_ramp"] ** 2 * taus**2 / 2.0
    )
    deviation = np.sqrt(variance)
    return StabilityCurve(
        tau=taus,
        deviation=deviation,
        terms=(samples + 1 - 2 * taus).astype(np.int64),
        edf=np.full(taus.size, 10.0),
        low=deviation,
        high=deviation,
        noise_type=np.zeros(taus.size, dtype=np.int64),
        estimator="oadev",
        kind="rate",
        sample_rate=1.0,
        confidence=0.95,
        samples=samples,
    )


def log_taus(samples, points=40):
    return np.unique(np.round(np.geomspace(1.0, samples / 4, points)))


@pytest.mark.parametrize("fit", [paper_fit, weighted_fit])
def test_curve_fits_recover_the_law_exactly(fit):
    samples = 2_000_000
    curve = law_curve(TRUTH, samples=samples, taus=log_taus(samples, 60))
    result = fit(curve)
    assert tuple(result.coefficients) == NAMES
    for name, estimate in result.coefficients.items():
        if fit is paper_fit and name in ("rate_random_walk", "rate_ramp"):
            # Within the paper's cut at N/51 the ramp and the walk rule no part of the curve.
            assert estimate.status != "estimated" or estimate.low <= TRUTH[name] <= estimate.high
            continue
        assert estimate.status == "estimated", name
        assert estimate.value == pytest.approx(TRUTH[name], rel=1e-3)
        assert estimate.low < TRUTH[name] < estimate.high


def test_paper_fit_leaves_out_what_its_ten_percent_cut_leaves_out():
    samples = 7200
    taus = log_taus(samples)
    curve = law_curve(TRUTH | {"quantization": 0.1}, samples=samples, taus=taus)
    # 1/sqrt(2 (N/n - 1)) is 10 % at N/n = 51: what lies beyond must not matter.
    spoiled = np.where(samples / taus < 51.0, 100.0 * curve.deviation, curve.deviation)
    other = StabilityCurve(
        **{
            field: getattr(curve, field)
            for field in StabilityCurve.__dataclass_fields__
            if field != "deviation"
        },
        deviation=spoiled,
    )
    assert paper_fit(other) == paper_fit(curve)
    assert weighted_fit(other).coefficients != weighted_fit(curve).coefficients


def test_a_curve_unlike_eq_3_widens_the_interval_and_says_so():
    rate = white(20_000, 12)
    clean = weighted_fit(stability_curve(rate, kind="rate", sample_rate=1.0))
    wave = rate + 0.3 * np.sin(2.0 * np.pi * np.arange(rate.size) / 40.0)
    fit = weighted_fit(stability_curve(wave, kind="rate", sample_rate=1.0))
    assert clean.notes == ()
    assert "departs from the fitted terms" in fit.notes[0].text
    estimate, reference = (result.coefficients["angle_random_walk"] for result in (fit, clean))
    assert estimate.high - estimate.low > 2.0 * (reference.high - reference.low)


def test_plain_allan_curve_for_the_paper_only():
    rate = white(7200, 14)
    plain = stability_curve(rate, kind="rate", sample_rate=1.0, estimator="adev")
    estimate = paper_fit(plain).coefficients["angle_random_walk"]
    assert estimate.low < 1.0 < estimate.high
    with pytest.raises(ValueError, match="takes oadev"):
        weighted_fit(plain)
    with pytest.raises(ValueError, match="takes oadev or adev"):
        paper_fit(stability_curve(rate, kind="rate", sample_rate=1.0, estimator="mdev"))


def test_a_curve_of_few_points_gives_what_it_can():
    rate = white(400, 15)
    curve = stability_curve(rate, kind="rate", sample_rate=1.0, taus=[1.0, 2.0, 4.0])
    fit = paper_fit(curve)
    assert "enough for quantization, angle_random_walk only" in fit.notes[0].text
    assert fit.coefficients["angle_random_walk"].status == "estimated"
    assert fit.coefficients["rate_ramp"].status == "not observable"
    with pytest.raises(RecordingError, match="record longer"):
        paper_fit(stability_curve(white(60, 1), kind="rate", sample_rate=1.0, taus=[1.0, 5.0]))


@pytest.mark.parametrize("squares", ["plain", "two terms"])
def test_plain_squares_are_those_of_equation_3(squares):
    """Written out: non-negative least squares on the variance within the cut at 10 %."""
    curve = stability_curve(white(7200, 5), kind="rate", sample_rate=1.0)
    shown = 7200 / curve.tau >= 51.0
    if squares == "two terms":
        shown &= curve.tau <= 20.0
    tau, variance = curve.tau[shown], curve.deviation[shown] ** 2
    columns = np.stack([3.0 / tau**2, 1.0 / tau, 2.0 * np.log(2.0) / np.pi * tau**0, tau / 3.0,
                        tau**2 / 2.0], axis=1)  # fmt: skip
    if squares == "two terms":
        columns = columns[:, :2]
    expected = lsq_linear(columns, variance, bounds=(0.0, np.inf), tol=1e-14).x[1]
    found = paper_fit(curve, squares=squares).coefficients
    assert found["angle_random_walk"].value == pytest.approx(np.sqrt(expected), rel=1e-3)
    assert paper_squares(curve, squares=squares) == pytest.approx(np.sqrt(expected), rel=1e-3)
    if squares == "two terms":
        assert {found[name].status for name in found if name not in list(found)[:2]} == {
            "not observable"
        }


@cache
def curve_of(seed):
    return stability_curve(white(3600, seed), kind="rate", sample_rate=1.0)


@pytest.mark.parametrize("draws", [15, pytest.param(60, marks=pytest.mark.statistics)])
@pytest.mark.parametrize("squares", ["plain", "relative", "two terms"])
def test_intervals_of_each_reading_hold_the_walk(squares, draws):
    held, values = 0, []
    for seed in range(draws):
        estimate = paper_fit(curve_of(seed), squares=squares).coefficients["angle_random_walk"]
        assert estimate.status == "estimated"
        held += estimate.low <= 1.0 <= estimate.high
        values.append(estimate.value)
    # Fewer come three times in a thousand.
    assert held >= binom.ppf(3e-3, draws, 0.95)
    assert np.mean(values) == pytest.approx(1.0, abs=0.31 / math.sqrt(draws))
