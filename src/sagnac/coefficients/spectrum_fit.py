"""Q, N, B, K and R by maximum likelihood from a spectrum, and a Markov rate beside them."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar
from scipy.special import ndtri

from sagnac.coefficients.cosine_spectrum import (
    CosineSpectrum,
    MarkovRate,
    SpectrumModel,
    cosine_spectrum,
    sinusoid_square,
    spectrum_model,
)
from sagnac.coefficients.estimates import (
    Estimate,
    Fit,
    FitBand,
    OptionalName,
    SquaredEstimate,
    require_confidence,
    unobserved,
)
from sagnac.coefficients.laws import COEFFICIENT_NAMES, CoefficientName
from sagnac.coefficients.limits import PRESENCE_OF_TWO
from sagnac.coefficients.maximum import (
    Optimum,
    errors_of,
    maximize,
    profile_interval,
    with_departure,
)
from sagnac.coefficients.ramp import ramp_square
from sagnac.recording.model import Kind


def found_markov(model: SpectrumModel) -> MarkovRate | None:
    """The most likely Markov rate, if leaving it out costs three standard deviations.

    Its time is looked for from three sample intervals to an eighth of the record.
    """

    def fit(time: float) -> Optimum:
        return maximize(model.ordinates(MarkovRate(time=time)))

    interval = model.cosine.interval
    grid = np.geomspace(3.0 * interval, model.samples * interval / 8.0, 25)
    at = int(np.argmin([fit(float(time)).deviance for time in grid]))
    refined = minimize_scalar(
        lambda logarithm: fit(math.exp(logarithm)).deviance,
        bounds=np.log(grid[[max(at - 1, 0), min(at + 1, grid.size - 1)]]),
        method="bounded",
        options={"xatol": 1e-3},
    )
    time = math.exp(refined.x)
    best = fit(time)
    driving = float(best.squares[-1])
    absent = maximize(model.ordinates()).deviance
    if driving > 0.0 and absent - best.deviance > PRESENCE_OF_TWO:
        return MarkovRate(time=time, driving=driving)
    return None


def markov_estimates(
    best: Optimum, rate: MarkovRate | None, confidence: float
) -> dict[OptionalName, Estimate]:
    """q_c and T_c of a Markov rate, or that there is none.

    Parameters
    ----------
    best
        Maximum of a spectrum whose last two terms are the squared driving noise, and the
        logarithm of the time.
    rate
        The one that was found.
    confidence
        As in `likelihood_fit`.
    """
    if rate is None:
        names: tuple[OptionalName, ...] = ("markov_driving_noise", "markov_correlation_time")
        return {name: unobserved(name, confidence) for name in names}
    errors = errors_of(best.fisher)
    deviations = float(ndtri(0.5 + 0.5 * confidence))
    square, shift = float(best.squares[-2]), float(best.squares[-1])
    spread = math.exp(deviations * float(errors[-2]) / square)
    length = math.exp(deviations * float(errors[-1]))
    middle = rate.time * math.exp(shift)
    return {
        "markov_driving_noise": SquaredEstimate(
            value=square, low=square / spread, high=square * spread, status="estimated"
        ).root("markov_driving_noise", confidence),
        "markov_correlation_time": Estimate(
            name="markov_correlation_time",
            value=middle,
            low=middle / length,
            high=middle * length,
            confidence=confidence,
            status="estimated",
        ),
    }


def likelihood_fit(
    values: ArrayLike,
    *,
    kind: Kind,
    sample_rate: float,
    confidence: float = 0.95,
    masked: Sequence[tuple[float, float]] = (),
    band: tuple[float, float] | None = None,
    terms: Sequence[CoefficientName] = COEFFICIENT_NAMES,
    markov: bool = False,
    sinusoid: float | None = None,
) -> Fit:
    """Fit Q, N, B, K, R to the spectrum by likelihood.

    The spectrum is the squared cosine transform (DCT-II) of the angle increments, one
    degree of freedom at every k / (2 samples interval) Hz. In that basis white rate and
    rate random walk are exactly uncorrelated at every length, and the expected square of
    each term is that of the finite record (`sagnac.coefficients.laws.cosine_power_basis`), so that
    there is no window and no bias of a window. The rate ramp is a straight line in the
    increments. For the other terms it is taken off by least squares, and what that takes of
    each term is taken off its expected squares; its own interval is that of a line in any noise
    of the terms that the lowest ordinates allow (`sagnac.coefficients.ramp`).

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
    markov
        Look for a first-order Markov rate besides. It is kept if it lowers twice the
        log likelihood by more than 11.8 (three standard deviations of two parameters);
        the uncertainty of its time is then in the intervals of the others, and its own
        intervals are of the Fisher information.
    sinusoid
        Frequency in Hz of a sinusoidal rate to fit besides and take off.

    Returns
    -------
    Fit
        With all five names, and the optional terms asked for.

    Raises
    ------
    RecordingError
        If a sample is not finite, the values do not vary, or too few frequencies are left.
    ValueError
        If an argument makes no sense.
    """
    return spectrum_fit(
        cosine_spectrum(values, kind=kind, sample_rate=sample_rate, terms=terms, sinusoid=sinusoid),
        confidence=confidence,
        masked=masked,
        band=band,
        markov=markov,
    )


def spectrum_fit(
    cosine: CosineSpectrum,
    *,
    confidence: float = 0.95,
    masked: Sequence[tuple[float, float]] = (),
    band: tuple[float, float] | None = None,
    markov: bool = False,
) -> Fit:
    """`likelihood_fit` of what is transformed already.

    Parameters
    ----------
    cosine
        Of the values.
    confidence, masked, band, markov
        As in `likelihood_fit`.

    Raises
    ------
    RecordingError
        If the values do not vary, or too few frequencies are left.
    ValueError
        If an argument makes no sense.
    """
    require_confidence(confidence)
    model = spectrum_model(cosine, masked, band)
    rate = found_markov(model) if markov else None
    weighed = with_departure(model.ordinates(rate))
    best = maximize(weighed.spectrum)
    squares: dict[CoefficientName, SquaredEstimate] = {
        name: profile_interval(weighed.spectrum, best, column, confidence)
        for column, name in enumerate(model.names)
    }
    if "rate_ramp" in cosine.terms and model.names:
        lowest = model.bins.starts[model.bins.count == 1.0]
        squares["rate_ramp"] = ramp_square(cosine, lowest, confidence)
    optional: dict[OptionalName, Estimate] = {}
    if markov:
        optional |= markov_estimates(best, rate, confidence)
    if cosine.sinusoid is not None:
        optional["sinusoid_amplitude"] = sinusoid_square(
            cosine, weighed.spectrum.frequency, best.mean, confidence
        ).root("sinusoid_amplitude", confidence)
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
        optional=optional,
        band=FitBand(
            low=low,
            high=high,
            interval=cosine.interval,
            masked=tuple((float(one[0]), float(one[1])) for one in masked),
        ),
        squares=dict(zip(model.names, best.squares.tolist(), strict=False)),
    )
