"""One way in: coefficients from a stability curve, or from samples."""

from numpy.typing import ArrayLike

from sagnac.coefficients.curve_fit import paper_fit, weighted_fit
from sagnac.coefficients.estimates import Fit, FitName
from sagnac.coefficients.spectrum_fit import likelihood_fit
from sagnac.recording.model import Kind
from sagnac.stability import check_choice
from sagnac.stability.curve import StabilityCurve


def fit_coefficients(
    curve_or_values: StabilityCurve | ArrayLike,
    *,
    method: FitName = "likelihood",
    kind: Kind | None = None,
    sample_rate: float | None = None,
    confidence: float = 0.95,
) -> Fit:
    """Q, N, B, K and R of one gyro, each with an interval and a status.

    Of two gyros give ``(x - z) / sqrt(2)``, or the curve of that: the coefficients are then per
    gyro.

    Parameters
    ----------
    curve_or_values
        For ``weighted`` and ``paper`` a `StabilityCurve` of an Allan deviation in rad/s. For
        ``likelihood`` (samples,), rad for ``angle`` and ``increment``, rad/s for ``rate``.
    method
        ``likelihood``: by the spectrum of the samples (`likelihood_fit`). ``weighted``: by
        generalized least squares on the curve (`weighted_fit`). ``paper``: by the paper's least
        squares on Eq. 3 (`paper_fit`).
    kind, sample_rate
        What one sample is, and samples per second; a curve knows both.
    confidence
        Of every interval and bound.

    Returns
    -------
    Fit
        With all five names.

    Raises
    ------
    RecordingError
        If the data cannot be fitted: a sample that is not finite, too few points.
    ValueError
        If the method does not take what is given, or an argument makes no sense.

    Examples
    --------
    >>> import numpy as np
    >>> from sagnac.coefficients.fit import fit_coefficients
    >>> from sagnac.stability.curve import stability_curve
    >>> rate = 1e-6 * np.random.default_rng(3).standard_normal(5000)  # rad/s, at 1 Hz
    >>> fit = fit_coefficients(rate, kind="rate", sample_rate=1.0)
    >>> walk = fit.coefficients["angle_random_walk"]
    >>> walk.status, bool(walk.low < 1e-6 < walk.high)
    ('estimated', True)
    >>> curve = stability_curve(rate, kind="rate", sample_rate=1.0)
    >>> by_curve = fit_coefficients(curve, method="weighted").coefficients["angle_random_walk"]
    >>> round(by_curve.to("deg/h/sqrt(Hz)").value, 1)
    0.2
    """
    check_choice("method", method, FitName)
    if isinstance(curve_or_values, StabilityCurve):
        if method == "likelihood":
            raise ValueError(
                "method 'likelihood' fits the spectrum of samples and was given a StabilityCurve; "
                "give the samples with their kind and sample_rate, or method 'weighted' or 'paper'"
            )
        if kind is not None or sample_rate is not None:
            raise ValueError("kind and sample_rate are those of the curve; leave them out")
        fit = weighted_fit if method == "weighted" else paper_fit
        return fit(curve_or_values, confidence=confidence)
    if method != "likelihood":
        raise ValueError(
            f"method {method!r} fits a StabilityCurve and was given samples; "
            "give stability_curve(...) of them, or method 'likelihood'"
        )
    if kind is None or sample_rate is None:
        missing = "kind" if kind is None else "sample_rate"
        raise ValueError(f"{missing} is missing; samples take kind and sample_rate")
    return likelihood_fit(
        curve_or_values,
        kind=kind,
        sample_rate=sample_rate,
        confidence=confidence,
    )
