"""The coefficients that the answer of an analysis rests on."""

from collections.abc import Mapping

from sagnac.analysis.result import Analysis
from sagnac.coefficients.estimates import Estimate, Fit
from sagnac.coefficients.laws import COEFFICIENT_NAMES, CoefficientName


def headline_fit(analysis: Analysis) -> Fit | None:
    """The fit that the answer rests on, or None if the answer is of no fit."""
    for fit in analysis.fits.values():
        if fit.coefficients.get("angle_random_walk") == analysis.angle_random_walk:
            return fit
    return None


def headline_coefficients(analysis: Analysis) -> Mapping[CoefficientName, Estimate]:
    """All coefficients beside the answer: of the average, else of the fit; none of neither."""
    if analysis.coefficients:
        return analysis.coefficients
    fit = headline_fit(analysis)
    return {} if fit is None else fit.coefficients


def headline_estimates(analysis: Analysis) -> dict[CoefficientName, Estimate]:
    """Coefficients estimated or bounded beside the answer, else the answer alone."""
    estimates = headline_coefficients(analysis) or {"angle_random_walk": analysis.angle_random_walk}
    return {
        name: estimates[name]
        for name in COEFFICIENT_NAMES
        if name in estimates and estimates[name].status != "not observable"
    }


def answer_coefficients(analysis: Analysis) -> Mapping[CoefficientName, Estimate]:
    """All coefficients beside the answer, with the answer among them."""
    return {
        **headline_coefficients(analysis),
        "angle_random_walk": analysis.angle_random_walk,
    }
