"""What all methods have in common, and the one way in."""

import math

import pytest

from sagnac.noise.curve_fit import paper_fit, weighted_fit
from sagnac.noise.fit import fit_coefficients, likelihood_fit
from sagnac.stability.curve import stability_curve
from tests.noise.examples import white


@pytest.mark.parametrize("seed", range(4))
def test_white_noise_shows_nothing_else_and_no_zero(seed):
    rate = white(7200, seed)
    curve = stability_curve(rate, kind="rate", sample_rate=1.0)
    for fit in (
        likelihood_fit(rate, kind="rate", sample_rate=1.0),
        weighted_fit(curve),
        paper_fit(curve),
    ):
        assert fit.notes == ()
        for name, estimate in fit.coefficients.items():
            if name == "angle_random_walk":
                assert estimate.status == "estimated"
                assert 0.0 < estimate.low <= estimate.value <= estimate.high
                assert estimate.value == pytest.approx(1.0, abs=0.1)
            else:
                assert estimate.status == "upper bound"
                assert estimate.value == estimate.high > 0.0
                assert estimate.low == 0.0


def test_confidence_widens_every_interval():
    rate = white(5000, 13)
    curve = stability_curve(rate, kind="rate", sample_rate=1.0)

    def widths(confidence):
        for fit in (
            likelihood_fit(rate, kind="rate", sample_rate=1.0, confidence=confidence),
            weighted_fit(curve, confidence=confidence),
            paper_fit(curve, confidence=confidence),
        ):
            for estimate in fit.coefficients.values():
                assert estimate.confidence == confidence
                yield estimate.high - estimate.low

    for narrow, wide in zip(widths(0.683), widths(0.99), strict=True):
        # A bound may be lost altogether where few degrees of freedom stand behind it.
        assert math.isnan(wide) or narrow < wide


def test_one_way_in_to_every_method():
    rate = white(2000, 41)
    curve = stability_curve(rate, kind="rate", sample_rate=1.0)
    assert fit_coefficients(rate, kind="rate", sample_rate=1.0) == likelihood_fit(
        rate, kind="rate", sample_rate=1.0
    )
    assert fit_coefficients(curve, method="paper") == paper_fit(curve)
    by_curve = fit_coefficients(curve, method="weighted", confidence=0.9)
    assert by_curve == weighted_fit(curve, confidence=0.9)


@pytest.mark.parametrize(
    ("of_curve", "change", "words"),
    [
        (True, {}, "method 'likelihood' fits the spectrum of samples"),
        (True, {"method": "paper", "kind": "rate"}, "those of the curve; leave them out"),
        (False, {"method": "weighted"}, "method 'weighted' fits a StabilityCurve"),
        (False, {"method": "whittle"}, "method is 'whittle'; use one of paper, weighted"),
        (False, {"sample_rate": 1.0}, "kind is missing"),
        (False, {"kind": "rate"}, "sample_rate is missing"),
        (False, {"kind": "phase", "sample_rate": 1.0}, "kind is 'phase'; use one of angle"),
        (False, {"kind": "rate", "sample_rate": -1.0}, "sample_rate is -1.0; give"),
    ],
)
def test_a_combination_that_cannot_be_fitted_fails_at_once(of_curve, change, words):
    rate = white(100, 42)
    given = stability_curve(rate, kind="rate", sample_rate=1.0) if of_curve else rate
    with pytest.raises(ValueError, match=words):
        fit_coefficients(given, **change)
