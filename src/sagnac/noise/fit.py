"""Q, N, B, K and R by maximum likelihood from a spectrum, and one way in to this and other fits."""

from collections.abc import Sequence

from numpy.typing import ArrayLike

from sagnac.core.errors import require_choice, require_confidence
from sagnac.noise.cosine_spectrum import (
    CosineSpectrum,
    cosine_bins,
    cosine_spectrum,
    ordinates,
)
from sagnac.noise.curve_fit import paper_fit, weighted_fit
from sagnac.noise.estimates import Fit, FitBand, FitName, SquaredEstimate, unobserved
from sagnac.noise.laws import COEFFICIENT_NAMES, CoefficientName
from sagnac.noise.likelihood import maximize, profile_interval, with_departure
from sagnac.noise.ramp import ramp_square
from sagnac.recording.model import Kind
from sagnac.stability.curve import StabilityCurve


def likelihood_fit(
    values: ArrayLike,
    *,
    kind: Kind,
    sample_rate: float,
    confidence: float = 0.95,
    masked: Sequence[tuple[float, float]] = (),
    band: tuple[float, float] | None = None,
    terms: Sequence[CoefficientName] = COEFFICIENT_NAMES,
) -> Fit:
    """Fit Q, N, B, K, R to the spectrum by likelihood.

    The spectrum is the squared cosine transform (DCT-II) of the angle increments, one
    degree of freedom at every k / (2 samples interval) Hz. In that basis white rate and
    rate random walk are exactly uncorrelated at every length, and the expected square of
    each term is that of the finite record (`sagnac.noise.laws.cosine_power_basis`), so that
    there is no window and no bias of a window. The rate ramp is a straight line in the
    increments. For the other terms it is taken off by least squares, and what that takes of
    each term is taken off its expected squares; its own interval is that of a line in any noise
    of the terms that the lowest ordinates allow (`sagnac.noise.ramp`).

    Squared coefficients may come out negative inside the fit: holding them at zero would
    push what they share with N into N (a third of a standard error for white noise).
    What is reported is never negative and never zero. Intervals are of the profile
    likelihood. ``estimated``: without the term twice the log likelihood falls by more
    than 9 (three standard deviations) and the interval excludes zero. ``upper bound``:
    the one-sided limit at `confidence`. ``not observable``: at that limit the
    term alone would lie above the fitted spectrum in half of the bins or more.

    Bins that stand out above the terms by half or more and by more than chance (one in
    ten million) are left out, and said so: a line that is left, or a resonance. If the
    rest departs from the terms by more than chance, the common relative departure of the
    bins is estimated and enters the weights and intervals.

    Parameters
    ----------
    values
        (samples,), rad for ``angle`` and ``increment``, rad/s for ``rate``.
    kind
        What one sample is.
    sample_rate
        Samples per second.
    confidence
        Of every interval and bound.
    masked
        Frequency bands (low, high) in Hz to leave out, for lines that were removed; each
        is widened by one resolution cell, 1/duration, on either side.
    band
        Lowest and highest frequency used, Hz; all by default.
    terms
        The terms to fit; the others are taken to be absent and come back as
        ``not observable``.

    Returns
    -------
    Fit
        With all five names.

    Raises
    ------
    RecordingError
        If a sample is not finite, the values do not vary, or too few frequencies are left.
    ValueError
        If an argument makes no sense.
    """
    return spectrum_fit(
        cosine_spectrum(values, kind=kind, sample_rate=sample_rate, terms=terms),
        confidence=confidence,
        masked=masked,
        band=band,
    )


def spectrum_fit(
    cosine: CosineSpectrum,
    *,
    confidence: float = 0.95,
    masked: Sequence[tuple[float, float]] = (),
    band: tuple[float, float] | None = None,
) -> Fit:
    """`likelihood_fit` of what is transformed already.

    Parameters
    ----------
    cosine
        Of the values.
    confidence, masked, band
        As in `likelihood_fit`.

    Raises
    ------
    RecordingError
        If the values do not vary, or too few frequencies are left.
    ValueError
        If an argument makes no sense.
    """
    require_confidence(confidence)
    bins = cosine_bins(cosine.transform.size, cosine.interval, masked, band)
    weighed = with_departure(ordinates(cosine, bins))
    best = maximize(weighed.spectrum)
    squares: dict[CoefficientName, SquaredEstimate] = {
        name: profile_interval(weighed.spectrum, best, column, confidence)
        for column, name in enumerate(cosine.names)
    }
    if "rate_ramp" in cosine.terms and cosine.names:
        lowest = bins.starts[bins.count == 1.0]
        squares["rate_ramp"] = ramp_square(cosine, lowest, confidence)
    low, high = band or (0.0, 0.5 / cosine.interval)
    return Fit(
        method="likelihood",
        coefficients={
            name: squares[name].root(name, confidence)
            if name in squares
            else unobserved(name, confidence)
            for name in COEFFICIENT_NAMES
        },
        notes=weighed.notes,
        departure=weighed.departure,
        band=FitBand(
            low=low,
            high=high,
            interval=cosine.interval,
            masked=tuple((float(one[0]), float(one[1])) for one in masked),
        ),
        squares=dict(zip(cosine.names, best.squares.tolist(), strict=True)),
    )


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
    >>> from sagnac.noise.fit import fit_coefficients
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
    require_choice("method", method, FitName)
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
