"""Q, N, B, K, R from a stability curve or a spectrum, each with an interval and a status."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Final, Literal, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.fft import dct
from scipy.linalg import solve_triangular
from scipy.optimize import minimize_scalar, nnls
from scipy.stats import chi2, ncx2, norm

from sagnac.difference import angle_increments, per_gyro
from sagnac.noise import (
    COEFFICIENT_NAMES,
    STOCHASTIC_NAMES,
    CoefficientName,
    allan_variance_basis,
    cosine_power_basis,
    markov_allan_variance,
    markov_cosine_power,
    overlapped_allan_covariance,
    sinusoid_allan_variance,
)
from sagnac.recording import FloatArray, Kind, RecordingError
from sagnac.stability import StabilityCurve, ieee_relative_error
from sagnac.units import COEFFICIENT_UNITS

Status = Literal["estimated", "upper bound", "not observable"]
FitName = Literal["paper", "weighted", "likelihood"]
OptionalName = Literal["markov_driving_noise", "markov_correlation_time", "sinusoid_amplitude"]

# A term is called present where leaving it out costs three standard deviations: a false
# alarm of 0.13 % for each term that is not there.
_PRESENCE: Final = 9.0

# The same probability for two parameters.
_PRESENCE_OF_TWO: Final = 11.83

# How far above the terms a bin has to be to be called something else, where chance (one in
# ten million) does not put it there. Less is taken for a departure of the terms.
_STANDS_OUT: Final = 1.5

# Of -2 log likelihood, and of standard deviations at a limit: far below what chance does.
_CONVERGED: Final = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """One coefficient in SI.

    ``estimated``: `value` within [`low`, `high`] at `confidence`. ``upper bound``:
    `value` and `high` are the bound, `low` is 0. ``not observable``: all three are NaN.
    """

    value: float
    low: float
    high: float
    confidence: float
    status: Status


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """All coefficients by one method.

    Attributes
    ----------
    method
        ``paper``: least squares on Eq. 3. ``weighted``: non-negative generalized least
        squares on the curve. ``likelihood``: Whittle on the spectrum.
    coefficients
        By name; per gyro (the factor for a difference is already taken out).
    notes
        What was noticed.
    optional
        Terms beside the five that were asked for: q_c in rad/s/sqrt(s) and T_c in s of a
        Markov rate, the peak rate of a sinusoid in rad/s.
    departure
        Of a likelihood fit: relative departure of the spectrum from the terms that chance does
        not explain, 1 or more where bins had to be left out; 0 where the terms suffice.
    """

    method: FitName
    coefficients: Mapping[CoefficientName, Estimate]
    notes: tuple[str, ...] = ()
    departure: float = 0.0
    optional: Mapping[OptionalName, Estimate] = field(default_factory=dict)


def paper_fit(
    curve: StabilityCurve, *, gyros_differenced: int = 1, confidence: float = 0.95
) -> Fit:
    """Fit Q, N, B, K, R to the Allan variance by the paper's least squares on Eq. 3.

    Points whose IEEE error ``1/sqrt(2 (N/n - 1))`` is above 10 % are left out. The paper
    does not say on what scale its squares are taken; here each residual is relative to the
    fitted variance, for on the plain scale the shortest tau would decide alone. Squared
    coefficients are kept from falling below zero. All points weigh alike, whatever is known
    of their errors; the intervals know it and carry the covariance of the points through.

    Parameters
    ----------
    curve
        Allan deviation, plain or overlapping, SI.
    gyros_differenced
        1, or 2 where the curve is of a difference of two gyros.
    confidence
        Of every interval and bound.

    Returns
    -------
    Fit
        With all five names; what the statuses mean stands in `weighted_fit`.

    Raises
    ------
    RecordingError
        If fewer than two points are left.
    ValueError
        If the curve is of another estimator.
    """
    points = _curve_points(curve, ("oadev", "adev"))
    within = [
        ieee_relative_error(points.angles - 1, int(factor)) <= 0.1 for factor in points.factors
    ]
    return _curve_fit("paper", points.keep(np.array(within)), gyros_differenced, confidence)


def weighted_fit(
    curve: StabilityCurve,
    *,
    gyros_differenced: int = 1,
    confidence: float = 0.95,
    markov: bool = False,
    sinusoid: float | None = None,
) -> Fit:
    """Fit Q, N, B, K, R to the overlapped Allan variance by generalized least squares.

    The weights are the full covariance between the points, from the fitted terms
    themselves (`sagnac.noise.overlapped_allan_covariance`), repeated until they agree.
    Squared coefficients are kept from falling below zero.

    Intervals come from the same fit without that limit, for what one term loses at its
    limit another gains; where the value lies outside they are widened to hold it. They
    follow the variance of the estimate as it changes with the coefficient, so that they
    turn lopsided where few degrees of freedom stand behind it. ``estimated``: the estimate
    lies more than three standard deviations above zero, as they are without the term.
    ``upper bound``: the one-sided limit at `confidence`. ``not observable``: at that limit
    the term alone would lie above the fitted curve at half of its points or more.

    Where the curve departs from Eq. 3 by more than chance, a common relative departure of
    the points is estimated and enters the weights and intervals.

    Parameters
    ----------
    curve
        Overlapping Allan deviation, SI.
    gyros_differenced
        1, or 2 where the curve is of a difference of two gyros.
    confidence
        Of every interval and bound.
    markov
        Fit a first-order Markov rate besides. Its time is the most likely one of the
        curve; what is unknown of it is in the errors of all.
    sinusoid
        Frequency in Hz of a sinusoidal rate to fit besides: of Eq. 3's kind, but its
        beating with the noise is not in the covariance. Of a difference of two the
        amplitude is the root mean square of the gyros'.

    Returns
    -------
    Fit
        With all five names, and the optional terms asked for.

    Raises
    ------
    RecordingError
        If the curve has fewer than two points.
    ValueError
        If the curve is of another estimator, or `sinusoid` is not above zero.
    """
    points = _curve_points(curve, ("oadev",))
    if sinusoid is not None and not sinusoid > 0.0:
        raise ValueError(f"sinusoid is {sinusoid}; give its frequency in Hz, above zero")
    return _curve_fit(
        "weighted", points, gyros_differenced, confidence, markov=markov, sinusoid=sinusoid
    )


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
    _check_confidence(confidence)
    per_gyro(1.0, gyros_differenced)
    unknown = [name for name in terms if name not in COEFFICIENT_NAMES]
    if unknown or not terms:
        raise ValueError(f"terms {list(terms)} is not a choice of {', '.join(COEFFICIENT_NAMES)}")
    names = tuple(name for name in STOCHASTIC_NAMES if name in terms)
    interval = 1.0 / sample_rate
    increments = angle_increments(values, kind=kind, sample_rate=sample_rate)
    optional: dict[OptionalName, Estimate] = {}
    wave = None
    if sinusoid is not None:
        wave, increments = _without_sinusoid(increments, sinusoid * interval)
        masked = [*masked, (sinusoid, sinusoid)]
    slope = 0.0
    if "rate_ramp" in terms:
        slope, increments = _without_slope(increments)
    samples = increments.size
    bins = _cosine_bins(samples, interval, masked, band)
    transform = dct(increments, type=2, norm="ortho")
    power = bins.mean(transform**2)
    if not power.min() > 0.0:
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
        optional["markov_driving_noise"] = optional["markov_correlation_time"] = _estimate(
            _UNSEEN, gyros_differenced, confidence
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
    if wave is not None and sinusoid is not None:
        density = float(np.interp(sinusoid, spectrum.frequency, best.mean))
        # The rate is averaged over each interval, which takes sinc off the amplitude.
        gain = float(np.sinc(sinusoid * interval)) * interval
        optional["sinusoid_amplitude"] = _estimate(
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
            slope,
            confidence,
        )
        squares["rate_ramp"] = (*(np.array([value, low, high]) / interval**4), status)
    estimates = {
        name: _estimate(squares.get(name, _UNSEEN), gyros_differenced, confidence)
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
        return variance * _crossing(
            lambda centre: probability - float(ncx2.cdf(seen, 2, max(centre, 1e-12))),
            0.0,
            seen + 1.0,
        )

    tail = 0.5 - 0.5 * confidence
    if seen > _PRESENCE_OF_TWO and float(chi2.sf(seen, 2)) < tail:
        return max(square - 2.0 * variance, 0.0), limit(1.0 - tail), limit(tail), "estimated"
    high = limit(1.0 - confidence) if float(chi2.cdf(seen, 2)) > 1.0 - confidence else variance
    return high, 0.0, high, "upper bound"


def _check_confidence(confidence: float) -> None:
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence is {confidence}; give a number between 0 and 1")


def _without_slope(increments: FloatArray) -> tuple[float, FloatArray]:
    """Slope per sample of the increments by least squares, and what is left."""
    centred = np.arange(increments.size) - 0.5 * (increments.size - 1)
    slope = float(centred @ increments / (centred @ centred))
    return slope, increments - slope * centred


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

    `edges` are all starts; `keep` says which of the ranges they open are used; `starts`
    and `stops` (bins,) are those.
    """

    edges: NDArray[np.int64]
    keep: NDArray[np.bool_]
    starts: NDArray[np.int64]
    stops: NDArray[np.int64]

    @property
    def count(self) -> FloatArray:
        return np.asarray(self.stops - self.starts, dtype=np.float64)

    def mean(self, squares: FloatArray) -> FloatArray:
        """Mean over each bin of values at k = 0, 1, …"""
        return np.asarray(np.add.reduceat(squares, self.edges)[self.keep] / self.count)


def _cosine_bins(
    samples: int,
    interval: float,
    masked: Sequence[tuple[float, float]],
    band: tuple[float, float] | None,
    *,
    narrowest: int = 1,
) -> _Bins:
    if samples <= _LEAST_BINS:
        raise RecordingError(f"{samples} increments are too few for a spectrum; record longer")
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
    blocked = np.zeros(samples + 1, dtype=np.int64)
    np.add.at(blocked, ranges[:, 0], 1)
    np.add.at(blocked, ranges[:, 1], -1)
    keep = (np.cumsum(blocked)[starts] <= 0) & (stops - starts >= narrowest)
    if np.count_nonzero(keep) < _LEAST_BINS:
        raise RecordingError(
            "masked and band leave too few frequencies to fit; mask less or record longer"
        )
    return _Bins(edges=starts, keep=keep, starts=starts[keep], stops=stops[keep])


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
        if before - deviance < _CONVERGED:
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


def _cholesky(covariance: FloatArray) -> FloatArray:
    """Lower factor of a covariance that may be positive only to rounding.

    Neighbouring points of an overlapped curve are nearly copies of each other where one noise
    rules, so that the smallest eigenvalue of their correlation can come out below zero. A share
    of it, the least that makes it positive, is added to the diagonal.
    """
    scale = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(scale, scale)
    nugget = 0.0
    while True:
        try:
            root = np.linalg.cholesky(correlation + nugget * np.eye(scale.size))
        except np.linalg.LinAlgError:
            if not nugget < 1e-3:
                raise
            nugget = max(10.0 * nugget, 1e-13)
            continue
        return np.asarray(root * scale[:, np.newaxis])


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


def _crossing(
    rise: Callable[[float], float], inside: float, step: float, limit: float = math.inf
) -> float:
    """Where `rise`, negative at `inside`, crosses zero towards `step`, not beyond `limit`.

    Infinite where it does not within a million steps; `inside` itself where `rise` is not
    negative there, as when weights that differ between two trial values put it beyond.
    """
    low, low_value = inside, rise(inside)
    if low_value >= 0.0:
        return inside
    for _ in range(26):
        high = inside + step
        if abs(high - inside) >= abs(limit - inside):
            high = limit
        high_value = min(rise(high), 1e3)
        if high_value >= 0.0 or high == limit:
            break
        low, low_value = high, high_value
        step *= 1.8
    else:
        return math.copysign(math.inf, step)
    for _ in range(60):
        if abs(high_value) < _CONVERGED:
            return high
        share = low_value / (low_value - high_value)
        middle = low + min(max(share, 0.02), 0.98) * (high - low)
        value = rise(middle)
        if value < 0.0:
            low, low_value = middle, value
        else:
            high, high_value = middle, value
    return 0.5 * (low + high)


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
    if value > 0.0 and absent - best.deviance > max(_PRESENCE, two_sided):

        def rise(square: float) -> float:
            return math.sqrt(max(deviance(square) - best.deviance, 0.0)) - math.sqrt(two_sided)

        step = error * math.sqrt(two_sided)
        high = _crossing(rise, value, step)
        if math.isfinite(high):
            return value, _crossing(rise, value, -step, 0.0), high, "estimated"
    reference, origin = (best.deviance, value) if value > 0.0 else (absent, 0.0)

    def rise_above(square: float) -> float:
        return math.sqrt(max(deviance(square) - reference, 0.0)) - math.sqrt(one_sided)

    high = _crossing(rise_above, origin, error * math.sqrt(one_sided))
    if not high < _alone(spectrum.basis[:, column], best.mean):
        return math.nan, math.nan, math.nan, "not observable"
    return high, 0.0, high, "upper bound"


def _alone(term: FloatArray, total: FloatArray) -> float:
    """Square at which a term would make all that was seen at half of the places."""
    return float(np.median(total / term))


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
    cosine = np.where(low, transform[bins.starts], 0.0)
    if not shape.any():
        return _UNSEEN

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
        if abs(moved - further) < _CONVERGED * error:
            break
        further = moved
    total = slope + further
    sign = math.copysign(1.0, total)
    threshold = _threshold(confidence)

    def rise(size: float) -> float:
        excess = fitted(sign * size - slope).deviance - best.deviance
        return math.sqrt(max(excess, 0.0)) - math.sqrt(threshold)

    step = error * math.sqrt(threshold)
    high = _crossing(rise, abs(total), step)
    if not math.isfinite(high):
        return _UNSEEN
    if fitted(-slope).deviance - best.deviance > max(_PRESENCE, threshold):
        return total**2, _crossing(rise, abs(total), -step, 0.0) ** 2, high**2, "estimated"
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
        "markov_driving_noise": _estimate(
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


def _estimate(
    squares: tuple[float, float, float, Status], gyros_differenced: int, confidence: float
) -> Estimate:
    value, low, high, status = squares
    return Estimate(
        value=per_gyro(value, gyros_differenced),
        low=per_gyro(low, gyros_differenced),
        high=per_gyro(high, gyros_differenced),
        confidence=confidence,
        status=status,
    )


_UNSEEN: Final[tuple[float, float, float, Status]] = (
    math.nan,
    math.nan,
    math.nan,
    "not observable",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _CurvePoints:
    """What a fit needs of a curve: arrays (points,), and the record they are of.

    `shortfall` is the root of how many times fewer terms a point has than the record
    would allow; `edf` is None where the points overlap and their covariance is known.
    """

    factors: NDArray[np.int64]
    variance: FloatArray
    shortfall: FloatArray
    edf: FloatArray | None
    angles: int
    interval: float

    @property
    def tau(self) -> FloatArray:
        return np.asarray(self.factors * self.interval)

    def keep(self, chosen: NDArray[np.bool_]) -> "_CurvePoints":
        return replace(
            self,
            factors=self.factors[chosen],
            variance=self.variance[chosen],
            shortfall=self.shortfall[chosen],
            edf=None if self.edf is None else self.edf[chosen],
        )


def _curve_points(curve: StabilityCurve, estimators: Sequence[str]) -> _CurvePoints:
    if curve.estimator not in estimators:
        raise ValueError(
            f"the curve is {curve.estimator}; this fit of Eq. 3 takes {' or '.join(estimators)}"
        )
    angles = curve.samples if curve.kind == "angle" else curve.samples + 1
    factors = np.round(curve.tau * curve.sample_rate).astype(np.int64)
    overlapped = curve.estimator == "oadev"
    terms = angles - 2 * factors
    return _CurvePoints(
        factors=factors,
        variance=curve.deviation**2,
        shortfall=np.sqrt(terms / curve.terms) if overlapped else np.ones(factors.size),
        edf=None if overlapped else curve.edf,
        angles=angles,
        interval=1.0 / curve.sample_rate,
    ).keep((curve.deviation > 0.0) & (curve.terms > 0))


# In which order terms are given up where a curve has too few points for all.
_FIRST_TERMS: Final[tuple[CoefficientName, ...]] = (
    "angle_random_walk",
    "quantization",
    "bias_instability",
    "rate_random_walk",
    "rate_ramp",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _CurveModel:
    """Eq. 3 with some of its terms, on the points of a curve.

    `nuisance` (points,) is a direction, of either sign, that the errors allow for: how the
    curve changes with the logarithm of a Markov rate's time.
    """

    points: _CurvePoints
    names: tuple[CoefficientName | OptionalName, ...]
    basis: FloatArray
    departure: float = 0.0
    correlation_time: float = 0.0
    nuisance: FloatArray | None = None

    def covariance(self, squares: FloatArray) -> FloatArray:
        """Covariance of the points if `squares` were true, (points, points)."""
        points = self.points
        sizes = dict(zip(self.names, np.sqrt(squares), strict=True))
        covariance = overlapped_allan_covariance(
            points.factors.tolist(),
            {name: sizes.get(name, 0.0) for name in COEFFICIENT_NAMES},
            angles=points.angles,
            interval=points.interval,
            markov=(sizes.get("markov_driving_noise", 0.0), self.correlation_time),
        )
        mean = self.basis @ squares
        scale = points.shortfall
        if points.edf is not None:
            # Plain clusters share less: the correlation is kept, the spread is theirs.
            known = np.maximum(np.diag(covariance), 1e-12 * mean**2)
            scale = mean * np.sqrt(2.0 / points.edf / known)
        covariance = covariance * scale * scale[:, np.newaxis]
        # A few hundred-thousandths of each variance are its own, which leaves the matrix invertible
        # whatever rounding and the far lags of 1/f do.
        own = 3e-5 * np.diag(covariance) + (self.departure**2 + 1e-10) * mean**2
        return np.asarray(covariance + np.diag(own))

    def relative(self) -> FloatArray:
        """Non-negative squares by least squares relative to the fitted variance."""
        squares = np.zeros(self.basis.shape[1])
        scale = self.points.variance
        for _ in range(20):
            solution = _scaled_nnls(self.basis / scale[:, np.newaxis], self.points.variance / scale)
            if np.allclose(solution, squares, rtol=1e-6, atol=0.0):
                break
            squares = solution
            scale = self.basis @ squares
        return squares

    def generalized(self, start: FloatArray, held: int | None = None) -> FloatArray:
        """Non-negative squares by least squares in the metric of their own covariance.

        From `start`, of which the term `held` keeps its value.
        """
        squares = start.copy()
        free = np.arange(squares.size) != held
        rest = self.points.variance - self.basis[:, ~free] @ squares[~free]
        if not squares.any():
            scale = self.points.variance
            squares[free] = _scaled_nnls(self.basis[:, free] / scale[:, np.newaxis], rest / scale)
        if not squares.any():
            # Without noise there is no covariance to weigh with, and nothing to weigh.
            return squares
        for _ in range(20):
            root = _cholesky(self.covariance(squares))
            solution = _scaled_nnls(
                solve_triangular(root, self.basis[:, free], lower=True),
                solve_triangular(root, rest, lower=True),
            )
            agreed = np.allclose(solution, squares[free], rtol=1e-4, atol=0.0)
            squares[free] = solution
            if agreed or not squares.any():
                break
        return squares

    def unlimited(self, method: FitName, squares: FloatArray, column: int) -> tuple[float, float]:
        """One square free of the limit at zero, and its error, were `squares` the truth."""
        covariance = self.covariance(squares)
        # The paper's residuals are relative, whatever their errors.
        metric = np.diag((self.basis @ squares) ** 2) if method == "paper" else covariance
        root = _cholesky(metric)
        basis = self.basis
        if self.nuisance is not None:
            basis = np.column_stack([basis, self.nuisance])
        whitened = solve_triangular(root, basis, lower=True)
        scale = 1.0 / np.maximum(np.linalg.norm(whitened, axis=0), 1e-300)
        inverse = np.linalg.pinv(whitened * scale, rcond=1e-10)[column] * scale[column]
        row = solve_triangular(root, inverse, lower=True, trans="T")
        return float(row @ self.points.variance), math.sqrt(float(row @ covariance @ row))

    def with_markov(self, time: float) -> "_CurveModel":
        """The same model with a Markov rate of that correlation time for one more term."""
        return replace(
            self,
            names=(*self.names, "markov_driving_noise"),
            basis=np.column_stack([self.basis, markov_allan_variance(self.points.tau, 1.0, time)]),
            correlation_time=time,
        )

    def residual(self, squares: FloatArray) -> tuple[float, float]:
        """Chi-square of the points, and the log determinant of their covariance."""
        root = _cholesky(self.covariance(squares))
        residual = solve_triangular(root, self.points.variance - self.basis @ squares, lower=True)
        return float(np.dot(residual, residual)), 2.0 * float(np.log(np.diag(root)).sum())

    def misfit(self, squares: FloatArray) -> float:
        """Chi-square of the points over its expectation, less one."""
        freedom = max(1, self.points.factors.size - len(self.names))
        return self.residual(squares)[0] / freedom - 1.0


def _scaled_nnls(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    if matrix.shape[1] == 0:
        # scipy 1.17 frees memory twice, and the process with it, on a matrix without columns.
        return np.empty(0)
    scale = 1.0 / np.linalg.norm(matrix, axis=0)
    return np.asarray(nnls(matrix * scale, vector)[0] * scale)


def _curve_fit(
    method: FitName,
    points: _CurvePoints,
    gyros_differenced: int,
    confidence: float,
    *,
    markov: bool = False,
    sinusoid: float | None = None,
) -> Fit:
    _check_confidence(confidence)
    per_gyro(1.0, gyros_differenced)
    size = points.factors.size
    if size < 2:
        raise RecordingError(
            f"{size} points of the curve can be fitted and Eq. 3 needs 2 or more; record longer"
        )
    notes = []
    names: tuple[CoefficientName | OptionalName, ...] = tuple(
        name for name in COEFFICIENT_NAMES if name in _FIRST_TERMS[: max(1, min(5, size - 1))]
    )
    if len(names) < len(COEFFICIENT_NAMES):
        notes.append(f"{size} points of the curve are enough for {', '.join(names)} only")
    basis = allan_variance_basis(points.tau)[
        :, [column for column, name in enumerate(COEFFICIENT_NAMES) if name in names]
    ]
    if sinusoid is not None:
        names = (*names, "sinusoid_amplitude")
        basis = np.column_stack([basis, sinusoid_allan_variance(points.tau, 1.0, sinusoid)])
    model = _CurveModel(points=points, names=names, basis=basis)
    optional: dict[OptionalName, Estimate] = {}
    if markov:
        model = _with_curve_markov(model)
    squares = model.relative()
    reference = model.generalized(squares)
    freedom = max(1, size - len(model.names))
    if model.misfit(reference) * freedom > 6.0 * math.sqrt(2.0 * freedom) + 12.0:
        model, reference = _with_curve_departure(model, squares)
        notes.append(
            f"the curve departs from the fitted terms by {100.0 * model.departure:.2g} % of the "
            f"variance at a point; the {method} intervals allow for it"
        )
    if method == "weighted":
        squares = reference
    unseen = _estimate(_UNSEEN, gyros_differenced, confidence)
    estimates = dict.fromkeys(COEFFICIENT_NAMES, unseen)
    for column, name in enumerate(model.names):
        estimate = _estimate(
            _curve_interval(
                model,
                method,
                column=column,
                value=float(squares[column]),
                reference=reference,
                confidence=confidence,
            ),
            gyros_differenced,
            confidence,
        )
        if name in estimates:
            estimates[name] = estimate
        else:
            optional[cast(OptionalName, name)] = estimate
    if markov:
        seen = optional["markov_driving_noise"].status == "estimated"
        optional["markov_correlation_time"] = (
            _curve_markov_time(model, reference, confidence) if seen else unseen
        )
    return Fit(method=method, coefficients=estimates, notes=tuple(notes), optional=optional)


def _with_curve_markov(model: _CurveModel) -> _CurveModel:
    """`model` with a Markov rate of the most likely correlation time besides."""
    tau = model.points.tau

    def deviance(logarithm: float) -> float:
        trial = model.with_markov(math.exp(logarithm))
        return sum(trial.residual(trial.generalized(trial.relative())))

    grid = np.log(np.geomspace(tau[0], tau[-1], 17))
    at = int(np.argmin([deviance(float(logarithm)) for logarithm in grid]))
    refined = minimize_scalar(
        deviance,
        bounds=(grid[max(at - 1, 0)], grid[min(at + 1, grid.size - 1)]),
        method="bounded",
        options={"xatol": 0.01},
    )
    time = math.exp(float(refined.x))
    model = model.with_markov(time)
    square = model.generalized(model.relative())[-1]
    change = markov_allan_variance(tau, 1.0, 1.01 * time) - markov_allan_variance(
        tau, 1.0, time / 1.01
    )
    return replace(model, nuisance=square * change / (2.0 * math.log(1.01)))


def _curve_markov_time(model: _CurveModel, reference: FloatArray, confidence: float) -> Estimate:
    _, error = model.unlimited("weighted", reference, reference.size)
    spread = math.exp(error * float(norm.ppf(0.5 + 0.5 * confidence)))
    return Estimate(
        value=model.correlation_time,
        low=model.correlation_time / spread,
        high=model.correlation_time * spread,
        confidence=confidence,
        status="estimated",
    )


def _with_curve_departure(
    model: _CurveModel, reference: FloatArray
) -> tuple[_CurveModel, FloatArray]:
    low, high = math.log(1e-4), math.log(10.0)
    for _ in range(14):
        model = replace(model, departure=math.exp(0.5 * (low + high)))
        reference = model.generalized(reference)
        if model.misfit(reference) > 0.0:
            low = math.log(model.departure)
        else:
            high = math.log(model.departure)
    return model, reference


def _curve_interval(
    model: _CurveModel,
    method: FitName,
    *,
    column: int,
    value: float,
    reference: FloatArray,
    confidence: float,
) -> tuple[float, float, float, Status]:
    """Square of one coefficient: value, low, high and status.

    The limits are where the estimate, with the weights and the error that hold if the
    limit is the truth, lies the wanted number of standard deviations from it.
    """
    two_sided = float(norm.ppf(0.5 + 0.5 * confidence))
    one_sided = float(norm.ppf(max(confidence, 0.5)))
    unlimited, error = model.unlimited(method, reference, column)

    def deviations(square: float) -> float:
        start = reference.copy()
        start[column] = square
        squares = model.generalized(start, held=column)
        if not squares.any():
            return math.inf
        estimate, spread = model.unlimited(method, squares, column)
        return (estimate - square) / spread

    if unlimited > 0.0 and value > 0.0:
        absent = deviations(0.0)
        if absent > max(math.sqrt(_PRESENCE), two_sided):
            high = _crossing(
                lambda square: -deviations(square) - two_sided, unlimited, two_sided * error
            )
            low = _crossing(
                lambda square: deviations(square) - two_sided, unlimited, -two_sided * error, 0.0
            )
            if math.isfinite(high):
                return value, min(low, value), max(high, value), "estimated"
    inside = max(unlimited, 0.0)
    high = _crossing(
        lambda square: min(-deviations(square), (square - inside) / error) - one_sided,
        inside,
        one_sided * error,
    )
    if not high < _alone(model.basis[:, column], model.basis @ reference):
        return _UNSEEN
    return high, 0.0, high, "upper bound"


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
    _check_confidence(confidence)
    if len(gyros) != 3:
        raise ValueError(f"gyros has {len(gyros)} channels; a three-cornered hat takes three")
    channels = [
        angle_increments(values, kind=kind, sample_rate=sample_rate) for values in gyros.values()
    ]
    sizes = {channel.size for channel in channels}
    if len(sizes) != 1:
        raise ValueError(f"gyros have {sorted(sizes)} increments; give one span of all three")
    samples, interval = channels[0].size, 1.0 / sample_rate
    # A ramp lives in the lowest indices, and least squares took what noise looks like one.
    lowest = 4.0 / (samples * interval)
    low, high = band if band is not None else (0.0, math.inf)
    # One product of two transforms fits a singular matrix, at infinite likelihood.
    bins = _cosine_bins(samples, interval, masked, (max(low, lowest), high), narrowest=4)
    basis = _bin_means(bins, lambda index: cosine_power_basis(index, samples, interval))
    one, other = (
        dct(_without_slope(first - second)[1], type=2, norm="ortho")
        for first, second in pairwise(channels)
    )
    moments = np.stack([bins.mean(one**2), bins.mean(one * other), bins.mean(other**2)], axis=1)
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
        if square > math.sqrt(_PRESENCE) * error and square > reach:
            estimates[name] = _estimate(
                (square, square - reach, square + reach, "estimated"), 1, confidence
            )
            continue
        bound = max(square, 0.0) + error * float(norm.ppf(max(confidence, 0.5)))
        estimates[name] = _estimate((bound, 0.0, bound, "upper bound"), 1, confidence)
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
        if fall < _CONVERGED:
            break
    fisher = fisher.reshape(3 * terms, -1)
    scale = 1.0 / np.sqrt(np.diag(fisher))
    covariance = np.linalg.pinv(fisher * scale * scale[:, np.newaxis], rcond=1e-12)
    return squares, (np.sqrt(np.diag(covariance)) * scale).reshape(3, terms)


def in_units(name: CoefficientName, value: float) -> dict[str, float]:
    """One coefficient in every unit that it is written in.

    Parameters
    ----------
    name
        Of the coefficient.
    value
        SI.

    Returns
    -------
    dict
        By unit, the field's first. Angle random walk as a noise density is per root hertz
        of a two-sided spectrum, as the IEEE standards define it: 1 deg/sqrt(h) is
        60 deg/h/sqrt(Hz), and rad/sqrt(s) and rad/s/sqrt(Hz) are the same number.
    """
    return {unit: value / size for unit, size in COEFFICIENT_UNITS[name].items()}
