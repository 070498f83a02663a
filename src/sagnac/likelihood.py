"""Q, N, B, K, R from a spectrum, and each gyro's own N from three, with intervals."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize_scalar, nnls
from scipy.stats import chi2, ncx2, norm

from sagnac import series
from sagnac.difference import angle_increments, per_gyro
from sagnac.estimates import (
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
    typical_square,
)
from sagnac.noise import (
    COEFFICIENT_NAMES,
    STOCHASTIC_NAMES,
    CoefficientName,
    cosine_power_basis,
    markov_cosine_power,
)
from sagnac.recording import FloatArray, Kind, RecordingError
from sagnac.spectrum import bin_sums, cosine_length, cosine_transform

# The same probability for two parameters.
_PRESENCE_OF_TWO: Final = 11.83

# How far above the terms a bin has to be to be called something else, where chance (one in
# ten million) does not put it there. Less is taken for a departure of the terms.
_STANDS_OUT: Final = 1.5

# Steps of angle, in readout steps squared, at which the error of a readout is white noise: a
# quarter that the angle turns about its mean (the error's correlation is below 1 % from there on),
# and twice the error's own variance, 1/12. A steady rate alone makes at most a quarter.
_DITHERED: Final = 0.25 + 2.0 / 12.0
# Steps of angle over which a rate counts as steady: their variance is about the mean of so many.
_STEADY: Final = 8
# Steps of angle fewer than these have no variance to speak of.
_LEAST_STEPS: Final = 32
# Share of the root mean square of the second differences. Where nothing dithers the readout its
# step is larger than that, and what the rounding of a file leaves of a zero is smaller.
_ROUNDING: Final = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Readout:
    """The step of a readout, and from where on its error is white noise of the angle.

    Attributes
    ----------
    step
        rad. Of an angle that is dithered from sample to sample, the smallest change there is.
    every
        The error is white where every so-many-th sample is taken, a power of two: 1 where the
        angle is dithered as it is. None where too few samples are left before that.
    """

    step: float
    every: int | None


def readout_of(angle: ArrayLike) -> Readout:
    """Whether what an angle does dithers the steps it is read out in.

    A walk over a readout step Delta leaves an error e that is uniform, of variance Delta^2/12,
    and uncorrelated with every increment of the walk (from any place within a step the average
    over places is zero). Its autocovariance over a time in which the angle strays by
    sigma about a steady turn is ``sum_m Delta^2/(2 pi^2 m^2) exp(-2 pi^2 m^2 sigma^2/Delta^2)``
    times a cosine of the turn (Widrow and Kollár, Quantization Noise, 2008, characteristic
    functions). So it is white noise, as quantization is taken to be, only of angles taken so far
    apart that sigma is half a step or more; of angles taken closer it is a slow error of many
    samples, which a fit would call angle random walk.

    Parameters
    ----------
    angle
        (samples,) as read out, before anything is taken off.

    Returns
    -------
    Readout
        Of an angle that never leaves one steady turn the step is 0, and `every` is 1.
    """
    values = np.asarray(angle, dtype=np.float64)
    every, step = 1, 0.0
    taken = values
    while taken.size > _LEAST_STEPS:
        if every == 1:
            finest, size = _smallest_change(values, 0.0)
            if size == 0.0:
                return Readout(step=0.0, every=1)
            step, _ = _smallest_change(values, _ROUNDING * size)
        if _variance_of_steps(taken) >= _DITHERED * step**2:
            return Readout(step=finest if every == 1 else step, every=every)
        taken = series.every(taken, 2)
        every *= 2
    return Readout(step=step, every=None)


def _smallest_change(values: FloatArray, above: float) -> tuple[float, float]:
    """Smallest second difference above a size, infinite if none, and root mean square of all."""
    # Smaller ones are rounding. There is no steady rate in any, however many steps that is.
    rounding = 8.0 * np.finfo(float).eps * max(map(abs, series.extent(values)))
    smallest, squares = math.inf, 0.0
    for span in series.through(values.size - 2, values):
        changes = np.abs(np.diff(values[span.start : span.stop + 2], n=2))
        changes = changes[changes > rounding]
        squares += float(changes @ changes)
        smallest = min(smallest, float(changes[changes > above].min(initial=math.inf)))
    return smallest, math.sqrt(squares / (values.size - 2))


def _variance_of_steps(values: FloatArray) -> float:
    """Mean variance of `_STEADY` steps in a row."""
    count, total = (values.size - 1) // _STEADY, 0.0
    for some in series.spans(count, max(1, series.SPAN // _STEADY)):
        steps = np.diff(values[_STEADY * some.start : _STEADY * some.stop + 1])
        total += float(steps.reshape(-1, _STEADY).var(axis=1, ddof=1).sum())
        series.release(values)
    return total / count


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


@dataclass(frozen=True, slots=True, kw_only=True)
class CosineSpectrum:
    """What `spectrum_fit` fits: the increments in the basis that it fits them in.

    Attributes
    ----------
    transform
        (samples,) orthonormal cosine transform (DCT-II) of the increments, rad, a series.
    interval
        Between samples, s.
    terms
        To fit.
    slope
        Taken off the increments first, rad per sample; zero without ``rate_ramp``.
    sinusoid
        Frequency of the one taken off, Hz, with the square of its amplitude in the
        increments, rad^2; None where none was.
    """

    transform: FloatArray
    interval: float
    terms: tuple[CoefficientName, ...]
    slope: float
    sinusoid: tuple[float, float] | None


def cosine_spectrum(
    values: ArrayLike,
    *,
    kind: Kind,
    sample_rate: float,
    terms: Sequence[CoefficientName] = COEFFICIENT_NAMES,
    sinusoid: float | None = None,
) -> CosineSpectrum:
    """Transform once what is to be fitted over several bands.

    Of 2^17 increments or more a few of the last may be left out, so that their number has
    a divisor for a transform in parts; a long series is worked through by spans.

    Parameters
    ----------
    values, kind, sample_rate, terms, sinusoid
        As in `likelihood_fit`.

    Raises
    ------
    RecordingError
        If a sample is not finite, or there are too few.
    ValueError
        If an argument makes no sense.
    """
    unknown = [name for name in terms if name not in COEFFICIENT_NAMES]
    if unknown or not terms:
        raise ValueError(f"terms {list(terms)} is not a choice of {', '.join(COEFFICIENT_NAMES)}")
    interval = 1.0 / sample_rate
    increments = angle_increments(values, kind=kind, sample_rate=sample_rate)
    _require_increments(increments.size)
    increments = increments[: cosine_length(increments.size)]
    wave = 0.0
    if sinusoid is not None:
        wave, increments = _without_sinusoid(increments, sinusoid * interval)
    slope = 0.0
    if "rate_ramp" in terms:
        slope, increments = _without_slope(increments)
    return CosineSpectrum(
        transform=cosine_transform(increments),
        interval=interval,
        terms=tuple(terms),
        slope=slope,
        sinusoid=None if sinusoid is None else (sinusoid, wave),
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
    bins = _cosine_bins(samples, interval, masked, band)
    power = bins.mean(transform, transform)
    # Of angles a few steps apart a single square may be zero.
    if not np.median(power) > 0.0:
        raise RecordingError("the values do not vary; a spectrum needs noise, check the channel")
    columns = [STOCHASTIC_NAMES.index(name) for name in names]

    def spectrum_of(more: Callable[[FloatArray], FloatArray] | None, whole: bool) -> _Spectrum:
        def expected(index: FloatArray) -> FloatArray:
            basis = cosine_power_basis(index, samples, interval)[:, columns]
            return basis if more is None else np.concatenate([basis, more(index)], axis=1)

        spectrum = _Spectrum(
            basis=_bin_means(bins, expected),
            power=power,
            count=bins.count,
            weight=bins.count,
            frequency=np.asarray(0.25 * (bins.starts + bins.stops - 1.0) / (samples * interval)),
        )
        if whole or "rate_ramp" not in terms:
            return spectrum
        return _less_slope(spectrum, bins, samples, expected)

    def markov_power(index: FloatArray, time: float) -> FloatArray:
        return markov_cosine_power(index, samples, interval, time)[:, np.newaxis]

    more = more_whole = None
    if markov:
        found = _markov_time(
            lambda time: _maximize(
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

    spectrum, departure, notes = _with_departure(spectrum_of(more, False))
    best = _maximize(spectrum)
    if more is not None:
        optional |= _markov_estimates(best, time, gyros_differenced, confidence)
    if cosine.sinusoid is not None:
        sinusoid, wave = cosine.sinusoid
        density = float(np.interp(sinusoid, spectrum.frequency, best.mean))
        # The rate is averaged over each interval, which takes sinc off the amplitude.
        gain = float(np.sinc(sinusoid * interval)) * interval
        optional["sinusoid_amplitude"] = per_gyro_estimate(
            _sinusoid(wave / gain**2, 2.0 * density / samples / gain**2, confidence),
            gyros_differenced,
            confidence,
        )
    squares: dict[CoefficientName, tuple[float, float, float, Status]] = {
        name: _profile(spectrum, best, column, confidence) for column, name in enumerate(names)
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


def _without_sinusoid(increments: FloatArray, cycles: float) -> tuple[float, FloatArray]:
    """Squared amplitude of a sinusoid of `cycles` per sample, and the increments less it."""
    if not 0.0 < cycles < 0.5:
        raise ValueError(
            f"sinusoid is at {cycles:g} of the sample rate; give a frequency below one half of it"
        )
    phase = 2.0 * np.pi * cycles * np.arange(increments.size)
    waves = np.stack([np.cos(phase), np.sin(phase)])
    centred = increments - increments.mean()
    amplitudes = np.linalg.solve(waves @ waves.T, waves @ centred)
    return float(amplitudes @ amplitudes), centred - amplitudes @ waves


def _sinusoid(
    square: float, variance: float, confidence: float
) -> tuple[float, float, float, Status]:
    """Squared amplitude from the measured one, whose two parts have `variance` each.

    Over the variance it is a non-central chi-square of two degrees of freedom.
    """
    seen = square / variance

    def limit(probability: float) -> float:
        # The non-centrality at which what was seen stands at `probability`.
        return variance * crossing(
            lambda centre: probability - float(ncx2.cdf(seen, 2, max(centre, 1e-12))),
            0.0,
            seen + 1.0,
        )

    tail = 0.5 - 0.5 * confidence
    if seen > _PRESENCE_OF_TWO and float(chi2.sf(seen, 2)) < tail:
        return max(square - 2.0 * variance, 0.0), limit(1.0 - tail), limit(tail), "estimated"
    high = limit(1.0 - confidence) if float(chi2.cdf(seen, 2)) > 1.0 - confidence else variance
    return high, 0.0, high, "upper bound"


def _without_slope(increments: FloatArray) -> tuple[float, FloatArray]:
    """Slope per sample of the increments by least squares, and what is left."""
    size = increments.size
    middle = 0.5 * (size - 1)
    moment = 0.0
    for span in series.through(size, increments):
        moment += float((np.arange(span.start, span.stop) - middle) @ increments[span])
    slope = 12.0 * moment / (float(size) * (float(size) ** 2 - 1.0))
    rest = series.empty(size)
    for span in series.through(size, increments, rest):
        rest[span] = increments[span] - slope * (np.arange(span.start, span.stop) - middle)
    return slope, rest


@dataclass(frozen=True, slots=True, kw_only=True)
class _Spectrum:
    """Squares of the cosine transform, averaged over bins.

    `power` (bins,) is the mean of `count` squares whose mean is ``basis @ squares``;
    `weight` is the number of degrees of freedom granted to a bin.
    """

    basis: FloatArray
    power: FloatArray
    count: FloatArray
    weight: FloatArray
    frequency: FloatArray


_SINGLE: Final = 64
_PER_OCTAVE: Final = 32
_LEAST_BINS: Final = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class _Bins:
    """Ranges of the index k of a cosine transform, without what is masked.

    `edges` are all starts and the last stop; `keep` says which of the ranges between them are
    used; `starts` and `stops` (bins,) are those.
    """

    edges: NDArray[np.int64]
    keep: NDArray[np.bool_]
    starts: NDArray[np.int64]
    stops: NDArray[np.int64]

    @property
    def count(self) -> FloatArray:
        return np.asarray(self.stops - self.starts, dtype=np.float64)

    def mean(self, one: FloatArray, other: FloatArray) -> FloatArray:
        """Mean over each bin of products of values at k = 0, 1, …"""
        sums = bin_sums(lambda span: one[span] * other[span], self.edges, one, other)
        return np.asarray(sums[self.keep] / self.count)


def _require_increments(samples: int) -> None:
    if samples <= _LEAST_BINS:
        raise RecordingError(f"{samples} increments are too few for a spectrum; record longer")


def _cosine_bins(
    samples: int,
    interval: float,
    masked: Sequence[tuple[float, float]],
    band: tuple[float, float] | None,
    *,
    narrowest: int = 1,
) -> _Bins:
    resolution = 1.0 / (2.0 * samples * interval)
    octaves = math.log2(samples / _SINGLE) if samples > _SINGLE else 0.0
    steps = max(1, round(_PER_OCTAVE * octaves))
    spaced = np.unique(np.round(np.geomspace(_SINGLE, samples, steps + 1)).astype(np.int64))
    excluded = [np.zeros((0, 2))]
    if len(masked):
        limits = np.asarray(masked, dtype=np.float64).reshape(-1, 2) / resolution
        if not (np.isfinite(limits).all() and (limits[:, 0] <= limits[:, 1]).all()):
            raise ValueError(f"masked is {list(masked)}; give pairs (low, high) in Hz")
        # Two indices are one resolution cell, 1/duration.
        excluded.append(np.stack([np.floor(limits[:, 0]) - 2, np.ceil(limits[:, 1]) + 3], axis=1))
    if band is not None:
        low, high = band
        if not 0.0 <= low < high:
            raise ValueError(f"band is {band}; give (low, high) in Hz with low below high")
        top = min(high / resolution, samples)
        excluded.append(
            np.array([[0.0, math.ceil(low / resolution)], [math.floor(top) + 1.0, samples]])
        )
    ranges = np.clip(np.concatenate(excluded), 1, samples).astype(np.int64)
    singles = np.arange(1, min(_SINGLE, samples) + 1, narrowest)
    wide = spaced[(spaced <= samples) & (np.diff(spaced, prepend=0) >= narrowest)]
    between = np.arange(singles[-1], wide[0] if wide.size else samples, narrowest)
    edges = np.unique(np.concatenate([singles, between, wide, [samples], ranges.ravel()]))
    starts, stops = edges[:-1], edges[1:]
    opened = np.searchsorted(np.sort(ranges[:, 0]), starts, side="right")
    closed = np.searchsorted(np.sort(ranges[:, 1]), starts, side="right")
    keep = (opened <= closed) & (stops - starts >= narrowest)
    if np.count_nonzero(keep) < _LEAST_BINS:
        raise RecordingError(
            "masked and band leave too few frequencies to fit; mask less or record longer"
        )
    return _Bins(edges=edges, keep=keep, starts=starts[keep], stops=stops[keep])


def _bin_means(bins: _Bins, expected: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Mean over each bin of expected squares by index, (bins, terms)."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    centre = 0.5 * (bins.starts + bins.stops - 1.0)
    # Half a step beyond the first and the last: a sum by the integral over its steps.
    half = np.where(bins.count > 1.0, 0.5 * bins.count, 0.0)
    index = centre[:, np.newaxis] + half[:, np.newaxis] * nodes
    basis = expected(index.ravel()).reshape(*index.shape, -1)
    return np.asarray(np.einsum("bnt,n->bt", basis, 0.5 * weights))


def _slope_transform(index: FloatArray, samples: int) -> FloatArray:
    """Cosine transform (DCT-II, orthonormal) of 0, 1, 2, …, at k > 0."""
    half = 0.5 * np.pi * index / samples
    shape = -math.sqrt(2.0 / samples) * np.cos(half) / (2.0 * np.sin(half) ** 2)
    return np.asarray(np.where(index % 2 == 1, shape, 0.0))


def _less_slope(
    spectrum: _Spectrum,
    bins: _Bins,
    samples: int,
    expected: Callable[[FloatArray], FloatArray],
) -> _Spectrum:
    """`spectrum` of increments less their slope by least squares, expected as such.

    With d the transform of a unit slope, D its square, the squares have the mean
    ``A_k (1 - 2 d_k^2/D) + d_k^2 sum(d_j^2 A_j)/D^2`` in place of A_k. The first is left
    out: nearly all of it is the slope.
    """
    index = np.arange(1.0, min(_SINGLE, samples), 2.0)
    shape = _slope_transform(index, samples) ** 2
    shape /= shape.sum()
    share = np.zeros((spectrum.power.size, 1))
    low = (bins.count == 1.0) & (bins.starts < _SINGLE) & (bins.starts % 2 == 1)
    share[low, 0] = shape[bins.starts[low] // 2]
    basis = spectrum.basis * (1.0 - 2.0 * share) + share * (shape @ expected(index))
    rest = bins.starts > 1
    return _Spectrum(
        basis=basis[rest],
        power=spectrum.power[rest],
        count=spectrum.count[rest],
        weight=spectrum.weight[rest],
        frequency=spectrum.frequency[rest],
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Optimum:
    """Squared coefficients at a maximum, -2 log likelihood, Fisher information, mean."""

    squares: FloatArray
    deviance: float
    fisher: FloatArray
    mean: FloatArray


def _maximize(
    spectrum: _Spectrum,
    *,
    start: FloatArray | None = None,
    fixed: tuple[int, float] | None = None,
    limited: bool = False,
) -> _Optimum:
    """Most likely squared coefficients, one of them held if asked, or all kept above zero."""
    basis = spectrum.basis
    free = np.ones(basis.shape[1], dtype=np.bool_)
    offset = np.zeros(spectrum.power.size)
    if fixed is not None:
        free[fixed[0]] = False
        offset = basis[:, fixed[0]] * fixed[1]
    columns = basis[:, free]
    squares = np.zeros(columns.shape[1]) if start is None else start[free]
    if limited:
        squares = np.maximum(squares, 0.0)
    mean = offset + columns @ squares
    if not mean.min() > 0.0:
        squares = _non_negative_start(spectrum, columns)
        mean = offset + columns @ squares
    deviance = _deviance(spectrum, mean)
    while squares.size and math.isfinite(deviance):
        # Newton's curvature where it is one, which squares of one degree of freedom leave in
        # doubt far from the maximum; else its expectation (scoring).
        expected = spectrum.weight / mean**2
        gradient = columns.T @ (expected * (mean - spectrum.power))
        observed = expected * (2.0 * spectrum.power / mean - 1.0)
        curvature = columns.T @ (observed[:, np.newaxis] * columns)
        if not _is_positive(curvature):
            curvature = columns.T @ (expected[:, np.newaxis] * columns)
        solve = _solve_non_negative if limited else _solve
        move = solve(curvature, curvature @ squares - gradient) - squares
        before = deviance
        for halvings in range(40):
            trial = squares + 0.5**halvings * move
            trial_mean = offset + columns @ trial
            outcome = _deviance(spectrum, trial_mean)
            if outcome < deviance:
                squares, mean, deviance = trial, trial_mean, outcome
                break
        if before - deviance < CONVERGED:
            break
    weight = spectrum.weight / mean**2 if math.isfinite(deviance) else np.zeros(mean.size)
    return _Optimum(
        squares=_joined(squares, free, fixed),
        deviance=deviance,
        fisher=0.5 * basis.T @ (weight[:, np.newaxis] * basis),
        mean=mean,
    )


def _deviance(spectrum: _Spectrum, mean: FloatArray) -> float:
    """-2 log likelihood of the squares, infinite where their mean is not positive."""
    if not mean.min() > 0.0:
        return math.inf
    return float(spectrum.weight @ (np.log(mean) + spectrum.power / mean))


def _joined(
    squares: FloatArray, free: NDArray[np.bool_], fixed: tuple[int, float] | None
) -> FloatArray:
    whole = np.zeros(free.size)
    whole[free] = squares
    if fixed is not None:
        whole[fixed[0]] = fixed[1]
    return whole


def _is_positive(matrix: FloatArray) -> bool:
    diagonal = np.diag(matrix)
    if not diagonal.min() > 0.0:
        return False
    scale = 1.0 / np.sqrt(diagonal)
    try:
        # With room for rounding: nearly collinear terms are not a direction to trust.
        np.linalg.cholesky(matrix * scale * scale[:, np.newaxis] - 1e-9 * np.eye(scale.size))
    except np.linalg.LinAlgError:
        return False
    return True


def _solve(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Solve normal equations; directions that the data cannot see stay at zero."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    scaled = matrix * scale * scale[:, np.newaxis]
    return np.asarray(np.linalg.lstsq(scaled, scale * vector, rcond=1e-12)[0] * scale)


def _solve_non_negative(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Solve normal equations for the best squares that are not negative."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    values, vectors = np.linalg.eigh(matrix * scale * scale[:, np.newaxis])
    seen = values > 1e-12 * values[-1]
    root = np.sqrt(values[seen])
    side = vectors[:, seen].T
    return np.asarray(nnls(root[:, np.newaxis] * side, side @ (scale * vector) / root)[0] * scale)


def _non_negative_start(spectrum: _Spectrum, columns: FloatArray) -> FloatArray:
    if not columns.shape[1]:
        return np.zeros(0)
    # Single squares have a chi-square of one degree of freedom: smooth before weighting.
    kernel = np.ones(min(9, spectrum.power.size))
    count = spectrum.count
    smooth = np.convolve(spectrum.power * count, kernel, "same") / np.convolve(
        count, kernel, "same"
    )
    root = np.sqrt(spectrum.weight) / smooth
    scale = 1.0 / np.maximum(np.linalg.norm(columns * root[:, np.newaxis], axis=0), 1e-300)
    solution, _ = nnls(columns * root[:, np.newaxis] * scale, spectrum.power * root)
    return np.asarray(solution * scale)


def _with_departure(spectrum: _Spectrum) -> tuple[_Spectrum, float, tuple[str, ...]]:
    """`spectrum` with weights that allow for what the terms do not describe, how much, and notes.

    Bins that stand far above the terms (a line left, a resonance) weigh nothing; for the
    rest a common relative departure is estimated where it is significant.
    """
    if np.count_nonzero(spectrum.count >= 8.0) < 3 * _LEAST_BINS:
        return spectrum, 0.0, ()
    notes = []
    trial, departure = _departure(spectrum)
    standing = np.zeros(spectrum.power.size, dtype=np.bool_)
    while departure > 0.0:
        ratio = spectrum.power / _maximize(trial).mean
        chance = chi2.sf(spectrum.count * ratio, spectrum.count)
        more = ~standing & (ratio > _STANDS_OUT) & (chance < 1e-7)
        if not more.any() or np.count_nonzero(standing | more) > 0.5 * standing.size:
            break
        standing |= more
        trial, departure = _departure(
            replace(spectrum, weight=np.where(standing, 0.0, spectrum.weight))
        )
    if standing.any():
        frequency = spectrum.frequency[standing]
        notes.append(
            f"{frequency.size} of {standing.size} bins of the spectrum, from {frequency[0]:.4g} to "
            f"{frequency[-1]:.4g} Hz, stand far above the fitted terms (a line or a resonance is "
            "left) and are left out of the likelihood fit"
        )
    if departure > 0.0:
        ratio = spectrum.power / _maximize(trial).mean
        worst = int(np.argmax(trial.weight * (ratio - 1.0) ** 2))
        notes.append(
            f"the spectrum departs from the fitted terms by {100.0 * departure:.2g} % of the power "
            f"in a bin, most at {spectrum.frequency[worst]:.4g} Hz (x {ratio[worst]:.3g}); the "
            "likelihood intervals allow for it"
        )
    return trial, departure + float(standing.any()), tuple(notes)


def _departure(spectrum: _Spectrum) -> tuple[_Spectrum, float]:
    """Weights with the relative departure of the bins that explains their scatter, or 0."""
    used = (spectrum.count >= 8.0) & (spectrum.weight > 0.0)
    freedom = max(1, np.count_nonzero(used) - spectrum.basis.shape[1])

    def weighted(departure: float) -> tuple[_Spectrum, float]:
        weight = np.where(
            spectrum.weight > 0.0, 1.0 / (1.0 / spectrum.count + 0.5 * departure**2), 0.0
        )
        trial = replace(spectrum, weight=weight)
        ratio = spectrum.power / _maximize(trial).mean - 1.0
        return trial, float(0.5 * weight[used] @ ratio[used] ** 2) - freedom

    trial, surplus = weighted(0.0)
    if surplus < 5.0 * math.sqrt(np.sum(2.0 + 12.0 / spectrum.count[used])):
        return trial, 0.0
    low, high = math.log(1e-4), math.log(10.0)
    for _ in range(12):
        trial, surplus = weighted(math.exp(0.5 * (low + high)))
        if surplus > 0.0:
            low = 0.5 * (low + high)
        else:
            high = 0.5 * (low + high)
    departure = math.exp(high)
    return weighted(departure)[0], departure


def _profile(
    spectrum: _Spectrum, best: _Optimum, column: int, confidence: float
) -> tuple[float, float, float, Status]:
    """Square of one coefficient: value, low, high and status by profile likelihood."""
    two_sided = _threshold(confidence)
    one_sided = _threshold(2.0 * confidence - 1.0)
    scale = 1.0 / np.sqrt(np.diag(best.fisher))
    covariance = np.linalg.pinv(best.fisher * scale * scale[:, np.newaxis], rcond=1e-12)
    error = math.sqrt(max(covariance[column, column], 1.0)) * scale[column]
    value = float(best.squares[column])
    # How the other squares move when this one does.
    direction = covariance[:, column] * scale / (covariance[column, column] * scale[column])

    def deviance(square: float) -> float:
        start = best.squares + direction * (square - value)
        return _maximize(spectrum, start=start, fixed=(column, square)).deviance

    absent = deviance(0.0)
    if value > 0.0 and absent - best.deviance > max(PRESENCE, two_sided):

        def rise(square: float) -> float:
            return math.sqrt(max(deviance(square) - best.deviance, 0.0)) - math.sqrt(two_sided)

        step = error * math.sqrt(two_sided)
        high = crossing(rise, value, step)
        if math.isfinite(high):
            return value, crossing(rise, value, -step, 0.0), high, "estimated"
    reference, origin = (best.deviance, value) if value > 0.0 else (absent, 0.0)

    def rise_above(square: float) -> float:
        return math.sqrt(max(deviance(square) - reference, 0.0)) - math.sqrt(one_sided)

    high = crossing(rise_above, origin, error * math.sqrt(one_sided))
    if not high < typical_square(spectrum.basis[:, column], best.mean):
        return math.nan, math.nan, math.nan, "not observable"
    return high, 0.0, high, "upper bound"


def _threshold(confidence: float) -> float:
    return float(chi2.ppf(max(confidence, 1e-6), 1))


def _ramp(
    spectrum: _Spectrum, bins: _Bins, transform: FloatArray, slope: float, confidence: float
) -> tuple[float, float, float, Status]:
    """Square of the ramp per sample: value, low, high and status by profile likelihood.

    The spectrum is of increments that `slope` was taken off; a further slope takes its
    share from each square. The squared coefficients are kept from falling below zero here:
    a line that meets the lowest frequency exactly would leave its variance free to vanish.
    """
    low = (bins.count == 1.0) & (bins.starts < _SINGLE)
    shape = np.where(low, _slope_transform(bins.starts.astype(np.float64), transform.size), 0.0)
    cosine = np.zeros(bins.starts.size)
    cosine[low] = transform[bins.starts[low]]
    if not shape.any():
        return UNSEEN

    def fitted(further: float) -> _Optimum:
        less = spectrum.power + further * shape * (further * shape - 2.0 * cosine)
        return _maximize(replace(spectrum, power=less), start=start, limited=True)

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
    threshold = _threshold(confidence)

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
    fit: Callable[[float | None], _Optimum], interval: float, samples: int
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
    if best.squares[-1] > 0.0 and fit(None).deviance - best.deviance > _PRESENCE_OF_TWO:
        return time, float(best.squares[-1])
    return None


def _markov_estimates(
    best: _Optimum, time: float, gyros_differenced: int, confidence: float
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Separation:
    """Angle random walk of each of three gyros, from their differences alone.

    Attributes
    ----------
    angle_random_walk
        By gyro, rad/sqrt(s).
    notes
        What was noticed, a negative variance among it.
    """

    angle_random_walk: Mapping[str, Estimate]
    notes: tuple[str, ...] = ()


def three_cornered_hat(
    gyros: Mapping[str, ArrayLike],
    *,
    kind: Kind,
    sample_rate: float,
    confidence: float = 0.95,
    masked: Sequence[tuple[float, float]] = (),
    band: tuple[float, float] | None = None,
) -> Separation:
    """Each gyro's own angle random walk from three that turn together.

    What the gyros share (the table, the Earth) is in each of them and in no difference of
    them, so only the differences are used: the first less the second and the second less
    the third. Their spectra and cross spectrum are the sum of Q, N, B and K of three
    independent gyros; all twelve squares are fitted at once by likelihood on the cosine
    transforms, as in `likelihood_fit`. This is the three-cornered hat by covariances
    (`sagnac.difference.groslambert_covariance`) with the weights that lose nothing.

    A square may come out negative where a gyro is much quieter than the other two, or
    where the gyros' noises are not independent. Then, and wherever the square is below
    three standard deviations, an upper bound is given and a note says why.

    Parameters
    ----------
    gyros
        Three channels of one length by name, rad for ``angle`` and ``increment``, rad/s
        for ``rate``; the share of common motion already alike, lines removed or masked.
    kind
        What one sample is.
    sample_rate
        Samples per second.
    confidence
        Of every interval and bound.
    masked, band
        As in `likelihood_fit`.

    Returns
    -------
    Separation
        By the names given.

    Raises
    ------
    RecordingError
        If a sample is not finite, the differences do not vary, or too little is left.
    ValueError
        If there are not three gyros of one length, or another argument makes no sense.
    """
    require_confidence(confidence)
    if len(gyros) != 3:
        raise ValueError(f"gyros has {len(gyros)} channels; a three-cornered hat takes three")
    channels = [
        angle_increments(values, kind=kind, sample_rate=sample_rate) for values in gyros.values()
    ]
    sizes = {channel.size for channel in channels}
    if len(sizes) != 1:
        raise ValueError(f"gyros have {sorted(sizes)} increments; give one span of all three")
    _require_increments(channels[0].size)
    samples, interval = cosine_length(channels[0].size), 1.0 / sample_rate
    # A ramp lives in the lowest indices, and least squares took what noise looks like one.
    lowest = 4.0 / (samples * interval)
    low, high = band if band is not None else (0.0, math.inf)
    # One product of two transforms fits a singular matrix, at infinite likelihood.
    bins = _cosine_bins(samples, interval, masked, (max(low, lowest), high), narrowest=4)
    basis = _bin_means(bins, lambda index: cosine_power_basis(index, samples, interval))
    one, other = (
        cosine_transform(_without_slope(series.less(first, second)[:samples])[1])
        for first, second in pairwise(channels)
    )
    moments = np.stack([bins.mean(*pair) for pair in ((one, one), (one, other), (other, other))], 1)
    if not min(moments[:, 0].min(), moments[:, 2].min()) > 0.0:
        raise RecordingError(
            f"two of the gyros {', '.join(gyros)} are the same; check the columns (--columns)"
        )
    squares, errors = _separate(basis, moments, bins.count)
    column = STOCHASTIC_NAMES.index("angle_random_walk")
    notes = []
    estimates = {}
    for gyro, name in enumerate(gyros):
        square, error = float(squares[gyro, column]), float(errors[gyro, column])
        reach = error * float(norm.ppf(0.5 + 0.5 * confidence))
        if square > math.sqrt(PRESENCE) * error and square > reach:
            estimates[name] = per_gyro_estimate(
                (square, square - reach, square + reach, "estimated"), 1, confidence
            )
            continue
        bound = max(square, 0.0) + error * float(norm.ppf(max(confidence, 0.5)))
        estimates[name] = per_gyro_estimate((bound, 0.0, bound, "upper bound"), 1, confidence)
        what = "negative" if square < 0.0 else "within three standard deviations of zero"
        notes.append(
            f"the squared angle random walk of {name} alone came out {what}: it is much quieter "
            "than the others, or their noises are not independent; an upper bound is given"
        )
    return Separation(angle_random_walk=estimates, notes=tuple(notes))


# First less second and second less third, in terms of the three gyros.
_DIFFERENCES: Final = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0]])


def _separate(
    basis: FloatArray, moments: FloatArray, count: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Squares of each gyro and their errors, (3, terms) each, by Fisher scoring.

    The spectral matrix of the two differences is linear in the squares; scoring is least
    squares on its entries in the metric of their own covariance, repeated.
    """
    terms = basis.shape[1]

    def solve(squares: FloatArray) -> tuple[float, FloatArray]:
        """-2 log likelihood and the inverse spectral matrices, (bins, 2, 2)."""
        density = basis @ squares.T
        spectral = np.einsum("ig,bg,jg->bij", _DIFFERENCES, density, _DIFFERENCES)
        determinant = spectral[:, 0, 0] * spectral[:, 1, 1] - spectral[:, 0, 1] ** 2
        if not (determinant.min() > 0.0 and spectral[:, 0, 0].min() > 0.0):
            return math.inf, spectral
        inverse = spectral[:, ::-1, ::-1] / determinant[:, np.newaxis, np.newaxis]
        inverse[:, 0, 1] *= -1.0
        inverse[:, 1, 0] *= -1.0
        trace = (
            inverse[:, 0, 0] * moments[:, 0]
            + 2.0 * inverse[:, 0, 1] * moments[:, 1]
            + inverse[:, 1, 1] * moments[:, 2]
        )
        return float(count @ (np.log(determinant) + trace)), inverse

    # The three spectra by covariances, averaged over all bins, start it as white noise.
    total = moments.T @ count / count.sum()
    start = np.maximum([total[0] + total[1], -total[1], total[2] + total[1]], 0.01 * total[0])
    squares = np.zeros((3, terms))
    squares[:, STOCHASTIC_NAMES.index("angle_random_walk")] = start / basis[0, 1]
    deviance, inverse = solve(squares)
    matrix = np.stack([moments[:, 0], moments[:, 1], moments[:, 1], moments[:, 2]], axis=1).reshape(
        -1, 2, 2
    )
    for _ in range(100):
        reach = inverse @ _DIFFERENCES
        coupling = np.einsum("ig,bih->bgh", _DIFFERENCES, reach) ** 2
        fisher = 0.5 * np.einsum("b,bs,bt,bgh->gsht", count, basis, basis, coupling)
        observed = np.einsum("big,bij,bjg->bg", reach, matrix, reach)
        score = 0.5 * np.einsum("b,bs,bg->gs", count, basis, observed)
        target = _solve(fisher.reshape(3 * terms, -1), score.ravel()).reshape(3, terms)
        share = 1.0
        for _ in range(40):
            trial = squares + share * (target - squares)
            outcome, trial_inverse = solve(trial)
            if outcome <= deviance:
                break
            share *= 0.5
        else:
            break
        fall = deviance - outcome
        squares, deviance, inverse = trial, outcome, trial_inverse
        if fall < CONVERGED:
            break
    fisher = fisher.reshape(3 * terms, -1)
    scale = 1.0 / np.sqrt(np.diag(fisher))
    covariance = np.linalg.pinv(fisher * scale * scale[:, np.newaxis], rcond=1e-12)
    return squares, (np.sqrt(np.diag(covariance)) * scale).reshape(3, terms)
