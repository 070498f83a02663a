"""Q, N, B, K and R by maximum likelihood from a spectrum."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar
from scipy.stats import norm

from sagnac.arrays import FloatArray
from sagnac.coefficients.cosine_spectrum import (
    PRESENCE_OF_TWO,
    SINGLE,
    CosineSpectrum,
    Ordinates,
    SpectrumBins,
    bin_means,
    cosine_bins,
    cosine_spectrum,
    fitted_sinusoid,
    less_slope,
    slope_transform,
)
from sagnac.coefficients.estimates import (
    CONVERGED,
    PRESENCE,
    UNSEEN,
    Estimate,
    Fit,
    OptionalName,
    Status,
    crossing,
    per_gyro_estimate,
    require_confidence,
)
from sagnac.coefficients.laws import (
    COEFFICIENT_NAMES,
    STOCHASTIC_NAMES,
    CoefficientName,
    cosine_power_basis,
    markov_cosine_power,
)
from sagnac.coefficients.maximum import (
    Optimum,
    likelihood_drop,
    maximize,
    profile_interval,
    with_departure,
)
from sagnac.errors import RecordingError
from sagnac.recording.difference import per_gyro
from sagnac.recording.model import Kind


def likelihood_fit(
    values: ArrayLike,
    *,
    kind: Kind,
    sample_rate: float,
    gyros_differenced: int = 1,
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
    each term is that of the finite record (`sagnac.noise.cosine_power_basis`), so that
    there is no window and no bias of a window. The rate ramp is a straight line in the
    increments. For the other terms it is taken off by least squares, and what that takes of
    each term is taken off its expected squares; for its own interval it is fitted as a line
    in noise of the terms.

    Squared coefficients may come out negative inside the fit: holding them at zero would
    push what they share with N into N (a third of a standard error for white noise).
    What is reported is never negative and never zero. Intervals are of the profile
    likelihood. ``estimated``: without the term twice the log likelihood falls by more
    than 9 (three standard deviations) and the interval excludes zero. ``upper bound``:
    the one-sided limit at `confidence`. ``not observable``: at that limit the
    term alone would lie above the fitted spectrum in half of the bins or more.

    Bins that stand out above the terms by half or more and by more than chance (one in
    ten million) are left out, and said so: a line that is left, or a resonance. Where the
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
    gyros_differenced
        1, or 2 where `values` is a difference of two gyros.
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
        Look for a first-order Markov rate besides. It is kept where it lowers twice the
        log likelihood by more than 11.8 (three standard deviations of two parameters);
        the uncertainty of its time is then in the intervals of the others, and its own
        intervals are of the Fisher information.
    sinusoid
        Frequency in Hz of a sinusoidal rate to fit besides and take off. Of a difference
        of two the amplitude is the root mean square of the gyros'.

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
        gyros_differenced=gyros_differenced,
        confidence=confidence,
        masked=masked,
        band=band,
        markov=markov,
    )


def spectrum_fit(
    cosine: CosineSpectrum,
    *,
    gyros_differenced: int = 1,
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
    gyros_differenced, confidence, masked, band, markov
        As in `likelihood_fit`.

    Raises
    ------
    RecordingError
        If the values do not vary, or too few frequencies are left.
    ValueError
        If an argument makes no sense.
    """
    require_confidence(confidence)
    per_gyro(1.0, gyros_differenced)
    transform, interval, terms = cosine.transform, cosine.interval, cosine.terms
    names = tuple(name for name in STOCHASTIC_NAMES if name in terms)
    samples = transform.size
    optional: dict[OptionalName, Estimate] = {}
    if cosine.sinusoid is not None:
        masked = [*masked, (cosine.sinusoid[0], cosine.sinusoid[0])]
    bins = cosine_bins(samples, interval, masked, band)
    power = bins.mean(transform, transform)
    # Of angles a few steps apart a single square may be zero.
    if not np.median(power) > 0.0:
        raise RecordingError("the values do not vary; a spectrum needs noise, check the channel")
    columns = [STOCHASTIC_NAMES.index(name) for name in names]

    def spectrum_of(more: Callable[[FloatArray], FloatArray] | None, whole: bool) -> Ordinates:
        def expected(index: FloatArray) -> FloatArray:
            basis = cosine_power_basis(index, samples, interval)[:, columns]
            return basis if more is None else np.concatenate([basis, more(index)], axis=1)

        spectrum = Ordinates(
            basis=bin_means(bins, expected),
            power=power,
            count=bins.count,
            weight=bins.count,
            frequency=np.asarray(0.25 * (bins.starts + bins.stops - 1.0) / (samples * interval)),
        )
        if whole or "rate_ramp" not in terms:
            return spectrum
        return less_slope(spectrum, bins, samples, expected)

    def markov_power(index: FloatArray, time: float) -> FloatArray:
        return markov_cosine_power(index, samples, interval, time)[:, np.newaxis]

    more = more_whole = None
    if markov:
        found = _markov_time(
            lambda time: maximize(
                spectrum_of(
                    None if time is None else (lambda index: markov_power(index, time)), False
                )
            ),
            interval,
            samples,
        )
        optional["markov_driving_noise"] = optional["markov_correlation_time"] = per_gyro_estimate(
            UNSEEN, gyros_differenced, confidence
        )
        if found is not None:
            time, driving = found

            def more_whole(index: FloatArray) -> FloatArray:
                return markov_power(index, time)

            def more(index: FloatArray) -> FloatArray:
                # The second column is how the first changes with the logarithm of its time.
                change = markov_power(index, 1.01 * time) - markov_power(index, time / 1.01)
                return np.concatenate(
                    [markov_power(index, time), driving * change / (2.0 * math.log(1.01))], axis=1
                )

    spectrum, departure, notes = with_departure(spectrum_of(more, False))
    best = maximize(spectrum)
    if more is not None:
        optional |= _markov_estimates(best, time, gyros_differenced, confidence)
    if cosine.sinusoid is not None:
        sinusoid, wave = cosine.sinusoid
        density = float(np.interp(sinusoid, spectrum.frequency, best.mean))
        # The rate is averaged over each interval, which takes sinc off the amplitude.
        gain = float(np.sinc(sinusoid * interval)) * interval
        optional["sinusoid_amplitude"] = per_gyro_estimate(
            fitted_sinusoid(wave / gain**2, 2.0 * density / samples / gain**2, confidence),
            gyros_differenced,
            confidence,
        )
    squares: dict[CoefficientName, tuple[float, float, float, Status]] = {
        name: profile_interval(spectrum, best, column, confidence)
        for column, name in enumerate(names)
    }
    if "rate_ramp" in terms and names:
        weight = bins.count.copy()
        weight[bins.starts > 1] = spectrum.weight
        value, low, high, status = _ramp(
            replace(spectrum_of(more_whole, True), weight=weight),
            bins,
            transform,
            cosine.slope,
            confidence,
        )
        squares["rate_ramp"] = (*(np.array([value, low, high]) / interval**4), status)
    estimates = {
        name: per_gyro_estimate(squares.get(name, UNSEEN), gyros_differenced, confidence)
        for name in COEFFICIENT_NAMES
    }
    return Fit(
        method="likelihood",
        coefficients=estimates,
        notes=notes,
        departure=departure,
        optional=optional,
    )


def _ramp(
    spectrum: Ordinates, bins: SpectrumBins, transform: FloatArray, slope: float, confidence: float
) -> tuple[float, float, float, Status]:
    """Square of the ramp per sample: value, low, high and status by profile likelihood.

    The spectrum is of increments that `slope` was taken off; a further slope takes its
    share from each square. The squared coefficients are kept from falling below zero here:
    a line that meets the lowest frequency exactly would leave its variance free to vanish.
    """
    low = (bins.count == 1.0) & (bins.starts < SINGLE)
    shape = np.where(low, slope_transform(bins.starts.astype(np.float64), transform.size), 0.0)
    cosine = np.zeros(bins.starts.size)
    cosine[low] = transform[bins.starts[low]]
    if not shape.any():
        return UNSEEN

    def fitted(further: float) -> Optimum:
        less = spectrum.power + further * shape * (further * shape - 2.0 * cosine)
        return maximize(replace(spectrum, power=less), start=start, limited=True)

    start = np.zeros(spectrum.basis.shape[1])
    further, error = 0.0, math.inf
    for _ in range(20):
        best = fitted(further)
        start = best.squares
        information = float(shape**2 @ (1.0 / best.mean))
        error = 1.0 / math.sqrt(information)
        moved = float(shape @ (cosine / best.mean)) / information
        if abs(moved - further) < CONVERGED * error:
            break
        further = moved
    total = slope + further
    sign = math.copysign(1.0, total)
    threshold = likelihood_drop(confidence)

    def rise(size: float) -> float:
        excess = fitted(sign * size - slope).deviance - best.deviance
        return math.sqrt(max(excess, 0.0)) - math.sqrt(threshold)

    step = error * math.sqrt(threshold)
    high = crossing(rise, abs(total), step)
    if not math.isfinite(high):
        return UNSEEN
    if fitted(-slope).deviance - best.deviance > max(PRESENCE, threshold):
        return total**2, crossing(rise, abs(total), -step, 0.0) ** 2, high**2, "estimated"
    return high**2, 0.0, high**2, "upper bound"


def _markov_time(
    fit: Callable[[float | None], Optimum], interval: float, samples: int
) -> tuple[float, float] | None:
    """Correlation time and squared driving noise of a Markov rate, where there is one.

    `fit` is the maximum with such a rate of a given time as the last term, or without.
    """
    grid = np.geomspace(3.0 * interval, samples * interval / 8.0, 25)
    deviances = [fit(float(time)).deviance for time in grid]
    at = int(np.argmin(deviances))
    refined = minimize_scalar(
        lambda logarithm: fit(math.exp(logarithm)).deviance,
        bounds=np.log(grid[[max(at - 1, 0), min(at + 1, grid.size - 1)]]),
        method="bounded",
        options={"xatol": 1e-3},
    )
    time = math.exp(refined.x)
    best = fit(time)
    if best.squares[-1] > 0.0 and fit(None).deviance - best.deviance > PRESENCE_OF_TWO:
        return time, float(best.squares[-1])
    return None


def _markov_estimates(
    best: Optimum, time: float, gyros_differenced: int, confidence: float
) -> dict[OptionalName, Estimate]:
    """q_c and T_c from the last two terms: the square, and the logarithm of the time."""
    scale = 1.0 / np.sqrt(np.diag(best.fisher))
    covariance = np.linalg.pinv(best.fisher * scale * scale[:, np.newaxis], rcond=1e-12)
    errors = np.sqrt(np.diag(covariance)) * scale
    deviations = float(norm.ppf(0.5 + 0.5 * confidence))
    square, shift = float(best.squares[-2]), float(best.squares[-1])
    spread = math.exp(deviations * float(errors[-2]) / square)
    length = math.exp(deviations * float(errors[-1]))
    middle = time * math.exp(shift)
    return {
        "markov_driving_noise": per_gyro_estimate(
            (square, square / spread, square * spread, "estimated"), gyros_differenced, confidence
        ),
        "markov_correlation_time": Estimate(
            value=middle,
            low=middle / length,
            high=middle * length,
            confidence=confidence,
            status="estimated",
        ),
    }
