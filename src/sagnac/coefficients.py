"""Q, N, B, K, R from a stability curve or a spectrum, each with an interval and a status."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.optimize import nnls
from scipy.stats import chi2

from sagnac.difference import per_gyro
from sagnac.noise import (
    COEFFICIENT_NAMES,
    STOCHASTIC_NAMES,
    CoefficientName,
    cosine_power_basis,
)
from sagnac.recording import FloatArray, Kind, RecordingError

Status = Literal["estimated", "upper bound", "not observable"]
FitName = Literal["paper", "weighted", "likelihood"]

# A term is called present where leaving it out costs three standard deviations: a false
# alarm of 0.13 % for each term that is not there.
_PRESENCE: Final = 9.0


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
    """

    method: FitName
    coefficients: Mapping[CoefficientName, Estimate]
    notes: tuple[str, ...] = ()


def likelihood_fit(
    values: FloatArray,
    *,
    kind: Kind,
    sample_rate: float,
    gyros_differenced: int = 1,
    confidence: float = 0.95,
    masked: Sequence[tuple[float, float]] = (),
    band: tuple[float, float] | None = None,
    terms: Sequence[CoefficientName] = COEFFICIENT_NAMES,
) -> Fit:
    """Fit Q, N, B, K, R to the spectrum by likelihood.

    The spectrum is the squared cosine transform (DCT-II) of the angle increments, one
    degree of freedom at every k / (2 samples interval) Hz. In that basis white rate and
    rate random walk are exactly uncorrelated at every length, and the expected square of
    each term is that of the finite record (`sagnac.noise.cosine_power_basis`), so that
    there is no window and no bias of a window. The rate ramp is a straight line in the
    increments and is fitted as one, with the others (restricted likelihood).

    Squared coefficients may come out negative inside the fit: holding them at zero would
    push what they share with N into N (a third of a standard error for white noise).
    What is reported is never negative and never zero. Intervals are of the profile
    likelihood. ``estimated``: without the term twice the log likelihood falls by more
    than 9 (three standard deviations) and the interval excludes zero. ``upper bound``:
    the one-sided limit at `confidence`. ``not observable``: that limit is above the level
    at which the term alone would make up all of the power seen.

    Where the spectrum departs from the five terms by more than chance, the common
    relative departure of the bins is estimated and enters the weights and intervals.

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
    _check(confidence, sample_rate)
    per_gyro(1.0, gyros_differenced)
    unknown = [name for name in terms if name not in COEFFICIENT_NAMES]
    if unknown or not terms:
        raise ValueError(f"terms {list(terms)} is not a choice of {', '.join(COEFFICIENT_NAMES)}")
    names = tuple(name for name in STOCHASTIC_NAMES if name in terms)
    interval = 1.0 / sample_rate
    increments = _increments(values, kind=kind, sample_rate=sample_rate)
    slope = 0.0
    if "rate_ramp" in terms:
        slope, increments = _without_slope(increments)
    spectrum = _cosine_spectrum(
        increments,
        interval=interval,
        names=names,
        masked=masked,
        band=band,
        ramp="rate_ramp" in terms,
    )
    spectrum, notes = _with_departure(spectrum)
    best = _maximize(spectrum)
    squares: dict[CoefficientName, tuple[float, float, float, Status]] = {
        name: _profile(spectrum, best, column, confidence) for column, name in enumerate(names)
    }
    if "rate_ramp" in terms:
        ramp = _ramp(spectrum, best, slope, confidence)
        squares["rate_ramp"] = (
            ramp[0] / interval**4,
            ramp[1] / interval**4,
            ramp[2] / interval**4,
            ramp[3],
        )
    estimates = {
        name: _estimate(squares.get(name, _UNSEEN), gyros_differenced, confidence)
        for name in COEFFICIENT_NAMES
    }
    return Fit(method="likelihood", coefficients=estimates, notes=notes)


def _check(confidence: float, sample_rate: float) -> None:
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence is {confidence}; give a number between 0 and 1")
    if not (math.isfinite(sample_rate) and sample_rate > 0.0):
        raise ValueError(f"sample_rate is {sample_rate}; give samples per second, above zero")


def _increments(values: FloatArray, *, kind: Kind, sample_rate: float) -> FloatArray:
    values = np.asarray(values, dtype=np.float64)
    if values.ndim != 1:
        raise ValueError(f"values has {values.ndim} dimensions; give one channel")
    if kind not in ("angle", "increment", "rate"):
        raise ValueError(f"kind is {kind!r}; state angle, increment or rate")
    finite = np.isfinite(values)
    if not finite.all():
        raise RecordingError(
            f"sample {int(np.argmin(finite))} is not finite and a spectrum has no room for gaps; "
            "take a span without gaps (--slice)"
        )
    if kind == "angle":
        return np.diff(values)
    return values / sample_rate if kind == "rate" else values


def _without_slope(increments: FloatArray) -> tuple[float, FloatArray]:
    """Slope per sample of the increments by least squares, and what is left."""
    centred = np.arange(increments.size) - 0.5 * (increments.size - 1)
    slope = float(centred @ increments / (centred @ centred))
    return slope, increments - slope * centred


@dataclass(frozen=True, slots=True, kw_only=True)
class _Spectrum:
    """Squares of the cosine transform, averaged over bins.

    `power` (bins,) is the mean of `count` squares whose mean is ``basis @ squares``;
    `weight` is the number of degrees of freedom granted to a bin. Below the first
    averaged bin `transform` and `ramp` are the transform itself and that of a unit ramp,
    elsewhere 0: a ramp falls as 1/k^2 and is long gone there.
    """

    basis: FloatArray
    power: FloatArray
    count: FloatArray
    weight: FloatArray
    transform: FloatArray
    ramp: FloatArray
    frequency: FloatArray


_SINGLE: Final = 64
_PER_OCTAVE: Final = 32
_LEAST_BINS: Final = 8


def _cosine_spectrum(
    increments: FloatArray,
    *,
    interval: float,
    names: Sequence[CoefficientName],
    masked: Sequence[tuple[float, float]],
    band: tuple[float, float] | None,
    ramp: bool,
) -> _Spectrum:
    samples = increments.size
    if samples <= _LEAST_BINS:
        raise RecordingError(f"{samples} increments are too few for a spectrum; record longer")
    transform = dct(increments, type=2, norm="ortho")
    resolution = 1.0 / (2.0 * samples * interval)
    octaves = math.log2(samples / _SINGLE) if samples > _SINGLE else 0.0
    steps = max(1, round(_PER_OCTAVE * octaves))
    spaced = np.unique(np.round(np.geomspace(_SINGLE, samples, steps + 1)).astype(np.int64))
    edges = [np.arange(1, min(_SINGLE, samples) + 1), spaced[spaced <= samples]]
    excluded = np.zeros((0, 2), dtype=np.int64)
    if len(masked):
        # Two indices are one resolution cell, 1/duration.
        limits = np.asarray(masked, dtype=np.float64).reshape(-1, 2) / resolution
        if not (np.isfinite(limits).all() and (limits[:, 0] <= limits[:, 1]).all()):
            raise ValueError(f"masked is {list(masked)}; give pairs (low, high) in Hz")
        excluded = np.stack([np.floor(limits[:, 0]) - 2, np.ceil(limits[:, 1]) + 3], axis=1).astype(
            np.int64
        )
    if band is not None:
        low, high = band
        if not 0.0 <= low < high:
            raise ValueError(f"band is {band}; give (low, high) in Hz with low below high")
        inside = [math.ceil(low / resolution), math.floor(min(high / resolution, samples)) + 1]
        outside = np.array([[0, inside[0]], [inside[1], max(samples, inside[1])]])
        excluded = np.concatenate([excluded, outside])
    excluded = np.clip(excluded, 1, samples)
    starts = np.unique(np.concatenate([*edges, excluded.ravel()]))
    stops = starts[1:]
    starts = starts[:-1]
    blocked = np.zeros(samples + 1, dtype=np.int64)
    np.add.at(blocked, excluded[:, 0], 1)
    np.add.at(blocked, excluded[:, 1], -1)
    keep = np.cumsum(blocked)[starts] == 0
    if np.count_nonzero(keep) < _LEAST_BINS:
        raise RecordingError(
            "masked and band leave too few frequencies to fit; mask less or record longer"
        )
    power = np.add.reduceat(transform[1:] ** 2, starts - 1)
    starts, stops = starts[keep], stops[keep]
    count = (stops - starts).astype(np.float64)
    power = power[keep] / count
    if not power.min() > 0.0:
        raise RecordingError("the values do not vary; a spectrum needs noise, check the channel")
    single = count == 1.0
    nodes, weights = np.polynomial.legendre.leggauss(4)
    spread = 0.5 * count[:, np.newaxis] * nodes
    index = np.where(
        single[:, np.newaxis],
        starts[:, np.newaxis],
        0.5 * (starts + stops - 1.0)[:, np.newaxis] + spread,
    )
    basis = cosine_power_basis(index.ravel(), samples, interval).reshape(*index.shape, -1)
    basis = np.einsum("bnt,n->bt", basis, 0.5 * weights)
    columns = [STOCHASTIC_NAMES.index(name) for name in names]
    half = 0.5 * np.pi * starts / samples
    low_index = single & (starts < _SINGLE)
    ramp_shape = np.where(
        low_index & (starts % 2 == 1) & ramp,
        -math.sqrt(2.0 / samples) * np.cos(half) / (2.0 * np.sin(half) ** 2),
        0.0,
    )
    return _Spectrum(
        basis=basis[:, columns],
        power=power,
        count=count,
        weight=count,
        transform=np.where(low_index, transform[starts], 0.0),
        ramp=ramp_shape,
        frequency=0.5 * (starts + stops - 1.0) * resolution,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Optimum:
    """Squared coefficients at a maximum, -2 log likelihood, ramp and its information."""

    squares: FloatArray
    deviance: float
    ramp: float
    information: float
    fisher: FloatArray


def _deviance(
    spectrum: _Spectrum, mean: FloatArray, ramp: float | None
) -> tuple[float, float, float, FloatArray]:
    """-2 log likelihood, the ramp, its information, and the squares less the ramp."""
    inverse = 1.0 / mean
    information = float(spectrum.ramp**2 @ inverse)
    restricted = ramp is None and information > 0.0
    if restricted:
        ramp = float((spectrum.transform * spectrum.ramp) @ inverse) / information
    ramp = ramp or 0.0
    power = spectrum.power
    if information > 0.0:
        power = power + ramp * spectrum.ramp * (ramp * spectrum.ramp - 2.0 * spectrum.transform)
    total = float(spectrum.weight @ (np.log(mean) + power * inverse))
    if restricted:
        total += math.log(information)
        # The square of a residual is short by the variance that the fitted ramp took.
        power = power + spectrum.ramp**2 / information
    return total, ramp, information, power


def _maximize(
    spectrum: _Spectrum,
    *,
    start: FloatArray | None = None,
    fixed: tuple[int, float] | None = None,
    ramp: float | None = None,
) -> _Optimum:
    """Fisher scoring over the squared coefficients, one of them or the ramp held if asked.

    With the ramp held the squares are kept from falling below zero: a ramp that meets the
    lowest frequency exactly would leave its variance free to vanish, at infinite likelihood.
    """
    basis = spectrum.basis
    free = np.ones(basis.shape[1], dtype=np.bool_)
    offset = np.zeros(spectrum.power.size)
    if fixed is not None:
        free[fixed[0]] = False
        offset = basis[:, fixed[0]] * fixed[1]
    columns = basis[:, free]
    squares = np.zeros(columns.shape[1]) if start is None else start[free]
    if ramp is not None:
        squares = np.maximum(squares, 0.0)
    mean = offset + columns @ squares
    if not mean.min() > 0.0:
        squares = _non_negative_start(spectrum, columns)
        mean = offset + columns @ squares
    if not mean.min() > 0.0:
        return _Optimum(
            squares=_joined(squares, free, fixed),
            deviance=math.inf,
            ramp=0.0,
            information=0.0,
            fisher=np.zeros((basis.shape[1],) * 2),
        )
    deviance, slope, information, power = _deviance(spectrum, mean, ramp)
    for _ in range(100):
        if not squares.size:
            break
        weight = spectrum.weight / mean**2
        solve = _solve if ramp is None else _solve_non_negative
        target = solve(
            columns.T @ (weight[:, np.newaxis] * columns), columns.T @ (weight * (power - offset))
        )
        share = 1.0
        for _ in range(40):
            trial = squares + share * (target - squares)
            trial_mean = offset + columns @ trial
            if trial_mean.min() > 0.0:
                outcome = _deviance(spectrum, trial_mean, ramp)
                if outcome[0] <= deviance:
                    break
            share *= 0.5
        else:
            break
        fall = deviance - outcome[0]
        squares, mean = trial, trial_mean
        deviance, slope, information, power = outcome
        if fall < 1e-7:
            break
    weight = spectrum.weight / mean**2
    return _Optimum(
        squares=_joined(squares, free, fixed),
        deviance=deviance,
        ramp=slope,
        information=information,
        fisher=0.5 * basis.T @ (weight[:, np.newaxis] * basis),
    )


def _joined(
    squares: FloatArray, free: NDArray[np.bool_], fixed: tuple[int, float] | None
) -> FloatArray:
    whole = np.zeros(free.size)
    whole[free] = squares
    if fixed is not None:
        whole[fixed[0]] = fixed[1]
    return whole


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
    weight = spectrum.count
    smooth = np.convolve(spectrum.power * weight, kernel, "same") / np.convolve(
        weight, kernel, "same"
    )
    root = np.sqrt(weight) / smooth
    scale = 1.0 / np.maximum(np.linalg.norm(columns * root[:, np.newaxis], axis=0), 1e-300)
    solution, _ = nnls(columns * root[:, np.newaxis] * scale, spectrum.power * root)
    return np.asarray(solution * scale)


def _with_departure(spectrum: _Spectrum) -> tuple[_Spectrum, tuple[str, ...]]:
    """Weights that allow for what the terms do not describe, where that is significant."""
    averaged = spectrum.count >= 8.0

    def excess(departure: float) -> tuple[_Spectrum, float, float]:
        weight = 1.0 / (1.0 / spectrum.count + 0.5 * departure**2)
        trial = replace(spectrum, weight=weight)
        best = _maximize(trial)
        ratio = spectrum.power / (spectrum.basis @ best.squares) - 1.0
        pearson = 0.5 * weight[averaged] @ ratio[averaged] ** 2
        freedom = max(1, np.count_nonzero(averaged) - spectrum.basis.shape[1])
        spread = math.sqrt(np.sum(2.0 + 12.0 / spectrum.count[averaged]))
        return trial, float(pearson - freedom), spread

    if np.count_nonzero(averaged) < 3 * _LEAST_BINS:
        return spectrum, ()
    _, surplus, spread = excess(0.0)
    if surplus < 5.0 * spread:
        return spectrum, ()
    low, high = math.log(1e-4), math.log(10.0)
    for _ in range(12):
        middle = 0.5 * (low + high)
        trial, surplus, _ = excess(math.exp(middle))
        low, high = (middle, high) if surplus > 0.0 else (low, middle)
    departure = math.exp(0.5 * (low + high))
    trial, _, _ = excess(departure)
    ratio = spectrum.power / (spectrum.basis @ _maximize(trial).squares)
    worst = int(np.argmax(np.where(averaged, trial.weight * (ratio - 1.0) ** 2, 0.0)))
    return trial, (
        f"the spectrum departs from the fitted terms by {100.0 * departure:.2g} % of the power in "
        f"a bin, most at {spectrum.frequency[worst]:.4g} Hz (x {ratio[worst]:.3g}); the likelihood "
        "intervals allow for it",
    )


def _crossing(
    rise: Callable[[float], float], inside: float, step: float, limit: float = math.inf
) -> float:
    """Where `rise`, negative at `inside`, crosses zero towards `step`, not beyond `limit`.

    Infinite where it does not within a million steps.
    """
    low, low_value = inside, rise(inside)
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
        if abs(high_value) < 1e-4:
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
    mean = spectrum.basis @ best.squares
    alone = spectrum.weight.sum() / (spectrum.weight @ (spectrum.basis[:, column] / mean))
    if not high < alone:
        return math.nan, math.nan, math.nan, "not observable"
    return high, 0.0, high, "upper bound"


def _threshold(confidence: float) -> float:
    return float(chi2.ppf(max(confidence, 1e-6), 1))


def _ramp(
    spectrum: _Spectrum, best: _Optimum, slope: float, confidence: float
) -> tuple[float, float, float, Status]:
    """Square of the ramp per sample: value, low, high and status by profile likelihood.

    `slope` was taken off before; the spectrum holds the rest.
    """
    if best.information == 0.0:
        return math.nan, math.nan, math.nan, "not observable"
    total = slope + best.ramp
    sign = math.copysign(1.0, total)
    threshold = _threshold(confidence)

    def deviance(size: float) -> float:
        return _maximize(spectrum, start=best.squares, ramp=sign * size - slope).deviance

    lowest = deviance(abs(total))

    def rise(size: float) -> float:
        return math.sqrt(max(deviance(size) - lowest, 0.0)) - math.sqrt(threshold)

    step = math.sqrt(threshold / best.information)
    high = _crossing(rise, abs(total), step)
    if not math.isfinite(high):
        return math.nan, math.nan, math.nan, "not observable"
    if deviance(0.0) - lowest > max(_PRESENCE, threshold):
        return total**2, _crossing(rise, abs(total), -step, 0.0) ** 2, high**2, "estimated"
    return high**2, 0.0, high**2, "upper bound"


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
