"""The Allan family: gyro samples in, a stability curve with intervals out.

Notation
--------
x
    Accumulated angle (the phase of time and frequency metrology), N samples tau0 apart. N
    rates or increments make N + 1 angles, the first of them zero.
m
    Cluster in samples; tau = m tau0.
alpha
    Power law of the rate noise, S(f) ~ f^alpha, from 2 (white angle, quantization) over
    0 (angle random walk) and -2 (rate random walk) to -4.

References
----------
SP1065
    W. J. Riley, Handbook of Frequency Stability Analysis, NIST SP 1065, 2008: every
    definition, and the degrees of freedom of the total and Theo1 families.
Greenhall and Riley
    Uncertainty of stability variances based on finite differences, PTTI 2003.
Riley and Greenhall
    Power law noise identification using the lag 1 autocorrelation, EFTF 2004.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaincinv

from sagnac import _kernels, series
from sagnac.recording import FloatArray, Kind, RecordingError

Estimator = Literal[
    "adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "totdev", "mtotdev", "theo1", "theoh", "haar"
]
Gaps = Literal["reject", "omit"]

# Share of the variance below which nobody asks what removing lines took.
_SEEN_SHARE: Final = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class StabilityCurve:
    """Deviation against cluster time, with its interval and its settings.

    Attributes
    ----------
    tau
        (points,) cluster times, s.
    deviation
        (points,) in the unit of the values given, per second.
    terms
        (points,) number of squared terms averaged.
    edf
        (points,) equivalent degrees of freedom of the variance.
    low, high
        (points,) limits of `deviation` at `confidence`.
    noise_type
        (points,) power-law exponent of the rate noise at each point: 2 quantization
        (white angle), 1 flicker angle, 0 angle random walk (white rate), -1 bias
        instability (flicker rate), -2 rate random walk, -3, -4 (ramp-like).
    estimator, kind, sample_rate, confidence, samples
        The settings it was made with.
    notes
        What was noticed, gap terms left out among them.
    """

    tau: FloatArray
    deviation: FloatArray
    terms: NDArray[np.int64]
    edf: FloatArray
    low: FloatArray
    high: FloatArray
    noise_type: NDArray[np.int64]
    estimator: Estimator
    kind: Kind
    sample_rate: float
    confidence: float
    samples: int
    notes: tuple[str, ...] = ()


def stability_curve(
    values: ArrayLike,
    *,
    kind: Kind,
    sample_rate: float,
    estimator: Estimator = "oadev",
    taus: ArrayLike | None = None,
    confidence: float = 0.683,
    gaps: Gaps = "reject",
    noise_type: int | None = None,
) -> StabilityCurve:
    """Stability of a gyro against cluster time, with chi-squared intervals.

    The constant rate is taken out before anything is summed or differenced: the mean of
    rates and increments, the end-to-end ramp of angles. No estimator here responds to it,
    and a table turns 1e9 arcsec in two hours, which would cost the digits of the noise.

    Parameters
    ----------
    values
        (samples,) in any unit; NaN marks a missing sample.
    kind
        ``rate`` (unit/s), ``increment`` (unit turned over each sample interval) or ``angle``
        (unit, accumulated). There is no default.
    sample_rate
        Samples per second.
    estimator
        ``adev``, ``oadev`` Allan, plain and overlapping; ``mdev`` modified; ``tdev``
        tau mdev / sqrt(3); ``hdev``, ``ohdev`` Hadamard; ``totdev``, ``mtotdev`` total and
        modified total; ``theo1``; ``theoh``, overlapping Allan to a fifth of the record and
        bias-removed Theo1 beyond; ``haar``, the Haar wavelet standard deviation, which is
        OADEV / sqrt(2). The biases of ``totdev``, ``mtotdev`` and ``theo1`` are left in.
    taus
        Cluster times wanted, s, each rounded to a whole number of samples. For ``theo1``
        they are the spans m tau0 of its definition, as published tables list them; the tau
        of the curve is then its effective 0.75 m tau0. None: 20 to the decade, up to the
        longest that the record allows (for ``haar`` every power of two).
    confidence
        Probability content of [low, high].
    gaps
        ``reject``: a missing sample is an error. ``omit``: every term that touches one is
        left out, counted and noted; a missing rate or increment breaks the accumulated
        angle, so each term that spans it goes.
    noise_type
        Power law of the rate noise for the intervals, -4 to 2; None identifies it at each
        tau.

    Returns
    -------
    StabilityCurve
        `deviation` in the unit per second (the unit itself for ``tdev``).

    Raises
    ------
    RecordingError
        If a value is infinite, or missing and `gaps` is ``reject``.
    ValueError
        If an argument cannot be used, or the record is too short.
    """
    _check_choice("kind", kind, Kind)
    _check_choice("estimator", estimator, Estimator)
    _check_choice("gaps", gaps, Gaps)
    if not (math.isfinite(sample_rate) and sample_rate > 0.0):
        raise ValueError(f"sample_rate {sample_rate!r} is not a positive number of hertz")
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence {confidence!r} is not between 0 and 1; give 0.95 for 95 %")
    if noise_type is not None:
        _check_noise_type(noise_type, estimator)
    samples = np.asarray(values, dtype=np.float64)
    if samples.ndim != 1:
        raise ValueError(f"values has shape {samples.shape}; give one channel, shape (samples,)")
    track = _track(samples, kind, sample_rate, gaps, estimator)
    notes: list[str] = []
    if track.missing:
        notes.append(f"{track.missing} of {samples.size} samples are missing")
    clusters = _clusters(taus, track.angle.size, sample_rate, estimator, notes)
    scale = 1.0 if kind == "rate" else sample_rate

    points = _POINTS[estimator](track, clusters, notes)
    tau = points.tau_samples / sample_rate
    deviation = np.sqrt(points.variance) * scale
    if estimator == "tdev":
        deviation = deviation * tau / math.sqrt(3.0)
    noise = (
        _noise_types(track, points.clusters, _DIFFERENCES[estimator], notes)
        if noise_type is None
        else np.full(tau.size, noise_type, dtype=np.int64)
    )
    edf = np.array(
        [
            _degrees_of_freedom(rule, int(alpha), int(cluster), track.angle.size, int(terms))
            for rule, alpha, cluster, terms in zip(
                points.estimators, noise, points.clusters, points.windows, strict=True
            )
        ]
    )
    low, high = _limits(deviation, edf, confidence)
    return StabilityCurve(
        tau=tau,
        deviation=deviation,
        terms=points.terms,
        edf=edf,
        low=low,
        high=high,
        noise_type=noise,
        estimator=estimator,
        kind=kind,
        sample_rate=float(sample_rate),
        confidence=float(confidence),
        samples=int(samples.size),
        notes=tuple(notes),
    )


def with_noise_restored(curve: StabilityCurve, taken: FloatArray, lines: int) -> StabilityCurve:
    """`curve` with the variance added that went with removed lines, and a note that says so.

    Parameters
    ----------
    curve
        Allan deviation of what the removal left.
    taken
        (points,) Allan variance that `noise.taken_allan_variance` gives, in the square of the
        curve's unit.
    lines
        How many were removed, for the note.

    Returns
    -------
    StabilityCurve
        `deviation`, `low` and `high` all raised by the same factor at each point.

    Raises
    ------
    ValueError
        If `curve` is not an Allan deviation, or `taken` does not fit it.
    """
    if curve.estimator not in {"adev", "oadev"}:
        raise ValueError(
            f"curve is of {curve.estimator}, and what lines took is known for an Allan deviation; "
            "give adev or oadev"
        )
    if taken.shape != curve.tau.shape or not np.all(taken >= 0.0):
        raise ValueError(
            f"taken has shape {taken.shape}; give one variance, zero or more, for each of the "
            f"{curve.tau.size} points"
        )
    raised = np.hypot(curve.deviation, np.sqrt(taken))
    factor = np.divide(
        raised, curve.deviation, out=np.ones_like(raised), where=curve.deviation > 0.0
    )
    share = np.divide(taken, raised**2, out=np.zeros_like(raised), where=raised > 0.0)
    most = int(np.argmax(share))
    notes = curve.notes
    if share[most] >= _SEEN_SHARE:
        counted = "1 line" if lines == 1 else f"{lines} lines"
        notes += (
            f"removal of {counted} took up to {100.0 * share[most]:.2g} % of the noise variance "
            f"(at tau = {curve.tau[most]:.4g} s); it is added back",
        )
    return replace(
        curve, deviation=raised, low=curve.low * factor, high=curve.high * factor, notes=notes
    )


def ieee_relative_error(samples: int, cluster: int) -> float:
    """Relative error of an Allan deviation, 1/sqrt(2 (N/n - 1)), of IEEE Std 952.

    `samples` rates in clusters of `cluster`; it counts the N/n - 1 independent differences
    and knows neither overlap nor noise type.

    Raises
    ------
    ValueError
        If there are fewer than two clusters.
    """
    if cluster < 1 or samples < 2 * cluster:
        raise ValueError(
            f"cluster {cluster} leaves under two clusters in {samples} samples; "
            f"use 1 to {samples // 2}"
        )
    return 1.0 / math.sqrt(2.0 * (samples / cluster - 1.0))


def equivalent_degrees_of_freedom(
    estimator: Estimator, noise_type: int, cluster: int, samples: int
) -> float:
    """Equivalent degrees of freedom of a stability variance over a whole record.

    Finite-difference estimators by the exact sum of Greenhall and Riley; the total and Theo1
    families by the formulas of SP1065, section 5.4, and by counting for total variances of
    angle noise, which it leaves out.

    Greenhall and Riley average the angle over each sample interval. White rate samples are
    not like that at m = 1, where overlapped terms have 2 (N - 2)/3 degrees of freedom and the
    paper has 15 % more: a 95 % interval covers 93 % there. At m = 2 and beyond it covers 95 to
    96 %.

    Parameters
    ----------
    estimator
        As in `stability_curve`; ``theoh`` at a cluster means its Theo1 part.
    noise_type
        Power law of the rate noise, 2 to -2, or to -4 for ``hdev`` and ``ohdev``.
    cluster
        m: tau = m tau0; for ``theo1`` and ``theoh`` the span m.
    samples
        N: accumulated angles, one more than there are rates.

    Raises
    ------
    ValueError
        If an argument is out of its range.
    """
    _check_choice("estimator", estimator, Estimator)
    _check_noise_type(noise_type, estimator)
    smallest, largest = _cluster_range(estimator, samples)
    if not smallest <= cluster <= largest:
        raise ValueError(
            f"cluster {cluster} is out of range for {estimator}; use {smallest} to {largest}"
        )
    rule: Estimator = "theo1" if estimator == "theoh" else estimator
    windows = _window_count(rule, cluster, samples)
    return _degrees_of_freedom(rule, noise_type, cluster, samples, windows)


# --- the record ----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Track:
    """Accumulated angle without its constant rate, and where it is whole.

    Of a record with `missing` samples the angle is whole in stretches of so many (`lengths`)
    from `starts` on. Between them angles are missing (NaN), or, if `broken`, the sum of rates or
    increments is, so that the angles of two stretches have nothing to do with each other.
    """

    angle: FloatArray
    starts: NDArray[np.int64]
    lengths: NDArray[np.int64]
    missing: int = 0
    broken: bool = False


def _track(
    samples: FloatArray, kind: Kind, sample_rate: float, gaps: Gaps, estimator: Estimator
) -> _Track:
    smallest = 3 if kind == "angle" else 2
    if samples.size < smallest:
        raise ValueError(
            f"values has {samples.size} samples; an Allan variance takes {smallest} or more"
        )
    # One sum tells a clean record without a second array of its size.
    with np.errstate(over="ignore", invalid="ignore"):
        mean = series.mean(samples)
    missing = 0
    starts, stops = np.array([0]), np.array([samples.size])
    if not math.isfinite(mean):
        missing = _count_gaps(samples, sample_rate, gaps, estimator)
    if missing:
        starts, stops = _whole_stretches(samples)
    present = samples.size - missing
    if present < smallest:
        raise RecordingError(
            f"values: {present} of {samples.size} samples are present; "
            f"an Allan variance takes {smallest} or more"
        )
    if kind == "angle":
        first, last = int(starts[0]), int(stops[-1]) - 1
        slope = _exact_slope((samples[last] - samples[first]) / (last - first), samples.size)
        angle = _without_ramp(samples, slope, float(samples[first]))
        return _Track(angle=angle, starts=starts, lengths=stops - starts, missing=missing)
    if missing:
        mean = _mean_of_present(samples)
        samples = _filled(samples, mean)
    return _Track(
        angle=_accumulated(samples, mean),
        starts=starts,
        lengths=stops - starts + 1,
        missing=missing,
        broken=missing > 0,
    )


def _whole_stretches(samples: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Where samples begin and cease to be present."""
    edges = []
    before = False
    for span in series.through(samples.size, samples):
        present = ~np.isnan(samples[span])
        edges.append(span.start + np.flatnonzero(np.diff(present, prepend=before)))
        before = bool(present[-1])
    edges.append(np.array([samples.size] if before else [], dtype=np.int64))
    whole = np.concatenate(edges)
    return whole[::2], whole[1::2]


def _mean_of_present(samples: FloatArray) -> float:
    total, count = 0.0, 0
    for span in series.through(samples.size, samples):
        present = samples[span][~np.isnan(samples[span])]
        total += float(present.sum())
        count += present.size
    return total / count


def _filled(samples: FloatArray, value: float) -> FloatArray:
    """With `value` in the place of what is missing, a new series."""
    filled = series.empty(samples.size)
    for span in series.through(samples.size, samples, filled):
        filled[span] = np.where(np.isnan(samples[span]), value, samples[span])
    return filled


def _without_ramp(samples: FloatArray, slope: float, offset: float) -> FloatArray:
    angle = series.empty(samples.size)
    for span in series.through(samples.size, samples, angle):
        _kernels.subtract_ramp(samples[span], slope, offset, span.start, angle[span])
    return angle


def _accumulated(samples: FloatArray, mean: float) -> FloatArray:
    """Angles from zero on, one more than there are samples."""
    angle = series.empty(samples.size + 1)
    angle[0] = total = 0.0
    for span in series.through(samples.size, samples, angle):
        after = angle[span.start + 1 : span.stop + 1]
        total = _kernels.accumulate_deviations(samples[span], mean, total, after)
    return angle


def _mirrored(angle: FloatArray) -> FloatArray:
    """From the last to the first, a series of its own."""
    mirrored = series.empty(angle.size)
    for span in series.through(angle.size, angle, mirrored):
        mirrored[span] = angle[angle.size - span.stop : angle.size - span.start][::-1]
    return mirrored


def _count_gaps(samples: FloatArray, sample_rate: float, gaps: Gaps, estimator: Estimator) -> int:
    infinite, first = _tally(np.isinf, samples)
    if infinite:
        raise RecordingError(
            f"values: sample {first} ({first / sample_rate:g} s) is infinite, "
            f"{infinite} in all; mark bad samples as NaN and use gaps='omit'"
        )
    missing, first = _tally(np.isnan, samples)
    if missing and gaps == "reject":
        raise RecordingError(
            f"values: sample {first} ({first / sample_rate:g} s) is missing, "
            f"{missing} in all; use gaps='omit' or fill them first"
        )
    if missing and estimator in _WHOLE_RECORD_ONLY:
        raise RecordingError(
            f"values: sample {first} ({first / sample_rate:g} s) is missing and "
            f"{estimator} needs a whole record; gaps='omit' works with oadev, mdev and ohdev"
        )
    return missing


def _tally(
    is_bad: Callable[[FloatArray], NDArray[np.bool_]], samples: FloatArray
) -> tuple[int, int]:
    """How many samples are bad, and the first of them."""
    count, first = 0, samples.size
    for span in series.through(samples.size, samples):
        bad = np.flatnonzero(is_bad(samples[span]))
        if bad.size:
            count += bad.size
            first = min(first, span.start + int(bad[0]))
    return count, first


def _exact_slope(slope: float, samples: int) -> float:
    """`slope` rounded to so few bits that its product with any index is exact.

    What is left of the ramp is too small to cost digits, and removing it adds no rounding.
    """
    mantissa, exponent = math.frexp(slope)
    scale = 2.0 ** (53 - samples.bit_length())
    return math.ldexp(round(mantissa * scale) / scale, exponent)


# --- the clusters --------------------------------------------------------------------------


def _cluster_range(estimator: Estimator, samples: int) -> tuple[int, int]:
    """Smallest and largest m for `samples` angles; the span for Theo1."""
    if estimator in ("adev", "oadev", "haar"):
        return 1, (samples - 1) // 2
    if estimator in ("mdev", "tdev", "mtotdev"):
        return 1, samples // 3
    if estimator in ("hdev", "ohdev"):
        return 1, (samples - 1) // 3
    if estimator == "totdev":
        return 1, samples - 1
    if estimator == "theo1":
        return 10, (samples - 1) // 2 * 2
    return 1, int(_THEO1_EFFECTIVE * ((samples - 1) // 2 * 2))


def _clusters(
    taus: ArrayLike | None,
    samples: int,
    sample_rate: float,
    estimator: Estimator,
    notes: list[str],
) -> NDArray[np.int64]:
    smallest, largest = _cluster_range(estimator, samples)
    if largest < smallest or (estimator == "theoh" and samples < _THEOH_SMALLEST):
        raise ValueError(
            f"values: {samples} accumulated angles are too few for {estimator}; "
            "record longer or use oadev"
        )
    step = 2 if estimator == "theo1" else 1
    if taus is None:
        if estimator == "haar":
            return 2 ** np.arange(int(largest).bit_length(), dtype=np.int64)
        count = 1 + math.ceil(_POINTS_PER_DECADE * math.log10(largest / smallest))
        grid = np.geomspace(smallest, largest, count)
        clusters = np.unique(np.rint(grid / step).astype(np.int64) * step)
        return np.asarray(clusters[(clusters >= smallest) & (clusters <= largest)])
    wanted = np.atleast_1d(np.asarray(taus, dtype=np.float64))
    if wanted.ndim != 1 or wanted.size == 0:
        raise ValueError(f"taus has shape {wanted.shape}; give one or more cluster times in s")
    if not np.isfinite(wanted).all():
        raise ValueError("taus holds a value that is not finite; give cluster times in s")
    rounded = np.rint(wanted * sample_rate / step) * step
    outside = (rounded < smallest) | (rounded > largest)
    if outside.any():
        raise ValueError(
            f"taus: {wanted[outside][0]:g} s is out of range for {estimator}; "
            f"use {smallest / sample_rate:g} s to {largest / sample_rate:g} s"
        )
    clusters = np.unique(rounded.astype(np.int64))
    moved = np.abs(rounded - wanted * sample_rate) > 1e-6 * rounded
    if moved.any():
        unit = "two sample intervals" if step == 2 else "the sample interval"
        notes.append(f"{int(moved.sum())} of {wanted.size} taus rounded to a multiple of {unit}")
    if clusters.size < wanted.size:
        notes.append(f"{wanted.size - clusters.size} of {wanted.size} taus coincide and are merged")
    return clusters


# --- the variances -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Points:
    """Variances per sample interval squared, one for each cluster.

    `windows` counts the outer averages, which rule the degrees of freedom; `terms` all
    squares; `estimators` names the rule of each point.
    """

    tau_samples: FloatArray
    variance: FloatArray
    terms: NDArray[np.int64]
    windows: NDArray[np.int64]
    clusters: NDArray[np.int64]
    estimators: list[Estimator]


def _window_count(estimator: Estimator, cluster: int, samples: int) -> int:
    """Outer averages of a whole record, none skipped."""
    if estimator == "adev":
        return (samples - 1) // cluster - 1
    if estimator == "hdev":
        return (samples - 1) // cluster - 2
    if estimator in ("oadev", "haar"):
        return samples - 2 * cluster
    if estimator == "ohdev":
        return samples - 3 * cluster
    if estimator in ("mdev", "tdev", "mtotdev"):
        return samples - 3 * cluster + 1
    if estimator == "totdev":
        return samples - 2
    return samples - cluster


def _difference_points(estimator: Estimator) -> Callable[..., _Points]:
    """Allan and Hadamard variances, plain, overlapping and Haar."""
    order = _DIFFERENCES[estimator]
    overlapping = estimator not in ("adev", "hdev")
    divisor = 6.0 if order == 3 else 4.0 if estimator == "haar" else 2.0

    def points(track: _Track, clusters: NDArray[np.int64], notes: list[str]) -> _Points:
        if overlapping:
            sums, terms = _overlapping_sums(track, clusters, order)
        else:
            # Plain clusters are overlapping ones of one sample on every m-th angle.
            columns = [_overlapping_sums(_every(track, int(m)), _ONE, order) for m in clusters]
            sums = np.array([column[0] for column, _ in columns])
            terms = np.array([column[0] for _, column in columns])
        return _averaged(
            estimator, track, clusters, sums=sums, terms=terms, divisor=divisor, notes=notes
        )

    return points


def _every(track: _Track, step: int) -> _Track:
    """Every `step`-th angle."""
    starts = -(-track.starts // step)
    lengths = (track.starts + track.lengths - 1) // step - starts + 1
    return replace(
        track,
        angle=series.every(track.angle, step),
        starts=starts[lengths > 0],
        lengths=lengths[lengths > 0],
    )


def _overlapping_sums(
    track: _Track, clusters: NDArray[np.int64], order: int
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Sums and numbers of squared differences that touch no gap."""
    angle = track.angle
    if track.missing and not track.broken:
        # Angles on both sides of a gap belong together.
        sums, terms = np.zeros(clusters.size), np.zeros(clusters.size, dtype=np.int64)
        for span in series.spans(angle.size, _STARTS):
            for j, m in enumerate(map(int, clusters)):
                total, count = _kernels.sum_squared_differences_with_gaps(
                    angle, m, order, span.start, span.stop
                )
                sums[j] += total
                terms[j] += count
            series.release(angle)
        return sums, terms
    kernel = (
        _kernels.sum_squared_second_differences
        if order == 2
        else _kernels.sum_squared_third_differences
    )
    return _stretch_sums(
        track,
        lambda stretch: _difference_sums(kernel, stretch, clusters),
        lambda starts, lengths: _kernels.sum_squared_differences_in_stretches(
            angle, starts, lengths, clusters, order
        ),
    ), _counts(track, order * clusters)


def _counts(track: _Track, reaches: NDArray[np.int64]) -> NDArray[np.int64]:
    """Terms that lie in one stretch each, by how far on the last angle of a term is."""
    return np.array(
        [np.maximum(track.lengths - reach, 0).sum() for reach in reaches], dtype=np.int64
    )


def _stretch_sums(
    track: _Track,
    of_long: Callable[[FloatArray], FloatArray],
    of_short: Callable[[NDArray[np.int64], NDArray[np.int64]], FloatArray],
) -> FloatArray:
    """Sums over all stretches, the long ones one by one, the short ones many at a time."""
    angle = track.angle
    short = track.lengths <= _STARTS
    sums = of_short(track.starts[:0], track.lengths[:0])
    for start, length in zip(track.starts[~short], track.lengths[~short], strict=True):
        sums += of_long(angle[start : start + length])
    starts, lengths = track.starts[short], track.lengths[short]
    for span in series.spans(angle.size):
        first, last = np.searchsorted(starts, (span.start, span.stop))
        if last > first:
            sums += of_short(starts[first:last], lengths[first:last])
            series.release(angle)
    return sums


def _difference_sums(
    kernel: Callable[..., FloatArray], angle: FloatArray, clusters: NDArray[np.int64]
) -> FloatArray:
    """Sums of squared differences from every start, of a mapped angle some starts at a time."""
    sums = np.zeros(clusters.size)
    for span in series.spans(angle.size, _STARTS):
        sums = kernel(angle, clusters, span.start, span.stop, sums)
        series.release(angle)
    return sums


def _window_sums(angle: FloatArray, clusters: NDArray[np.int64]) -> FloatArray:
    """Sums of squared second differences of sums over a cluster, from every start."""
    windows = np.zeros(clusters.size)
    for j, m in enumerate(map(int, clusters)):
        for span in series.spans(m if 3 * m <= angle.size else 0, _STARTS):
            windows[j] = _kernels.window_difference(
                angle, m, span.start, span.stop, float(windows[j])
            )
            series.release(angle)
    sums = windows**2
    for span in series.spans(angle.size, _STARTS):
        sums, windows = _kernels.sum_squared_window_differences(
            angle, clusters, span.start, span.stop, sums, windows
        )
        series.release(angle)
    return sums


def _reflected_sums(angle: FloatArray, clusters: NDArray[np.int64]) -> FloatArray:
    """Sums of squared second differences centred on every inner sample.

    Beyond an end the angle is its point reflection in that end, reached in a mirrored copy of
    the record.
    """
    sums = _difference_sums(_kernels.sum_squared_second_differences, angle, clusters)
    mirrored = _mirrored(angle)
    last = angle.size - 1
    first_end, last_end = float(angle[0]), float(angle[last])
    for j, m in enumerate(map(int, clusters)):
        right = last - m  # last centre whose right arm stays inside
        # Centres whose left arm, whose both arms, and whose right arm are reflected.
        left, both, rest = 1, max(right + 1, 1), max(m, right + 1)
        parts = (
            (
                left,
                min(m, right + 1),
                angle[left + m :],
                mirrored[left + right :],
                first_end,
                1,
                -1,
            ),
            (
                both,
                m,
                mirrored[both - right :],
                mirrored[both + right :],
                first_end + last_end,
                -1,
                -1,
            ),
            (rest, last, mirrored[rest - right :], angle[rest - m :], last_end, -1, 1),
        )
        for begin, stop, ahead, behind, ends, sign_ahead, sign_behind in parts:
            for span in series.spans(max(stop - begin, 0)):
                sums[j] += _kernels.sum_squared_arms(
                    angle[begin + span.start : begin + span.stop],
                    ahead[span],
                    behind[span],
                    ends,
                    float(sign_ahead),
                    float(sign_behind),
                )
                series.release(angle, mirrored)
    return sums


def _whole_counts(
    estimator: Estimator, clusters: NDArray[np.int64], samples: int
) -> NDArray[np.int64]:
    return np.array([_window_count(estimator, int(m), samples) for m in clusters], dtype=np.int64)


def _modified_points(estimator: Estimator) -> Callable[..., _Points]:
    def points(track: _Track, clusters: NDArray[np.int64], notes: list[str]) -> _Points:
        sums = _stretch_sums(
            track,
            lambda stretch: _window_sums(stretch, clusters),
            lambda starts, lengths: _kernels.sum_squared_window_differences_in_stretches(
                track.angle, starts, lengths, clusters
            ),
        )
        terms = _counts(track, 3 * clusters - 1)
        return _averaged(
            estimator,
            track,
            clusters,
            sums=sums / clusters.astype(np.float64) ** 2,
            terms=terms,
            divisor=2.0,
            notes=notes,
        )

    return points


def _averaged(
    estimator: Estimator,
    track: _Track,
    clusters: NDArray[np.int64],
    *,
    sums: FloatArray,
    terms: NDArray[np.int64],
    divisor: float,
    notes: list[str],
) -> _Points:
    """Means of squared differences over 2 m^2 (6 m^2 for Hadamard), less what gaps took."""
    kept = terms > 0
    if not kept.any():
        raise RecordingError(
            f"values: the gaps leave no term of {estimator} at any tau asked for; ask for shorter"
        )
    if track.missing:
        whole = _whole_counts(estimator, clusters, track.angle.size)
        lost = whole - terms
        notes.append(
            f"gaps left out {int(lost.sum())} of {int(whole.sum())} terms, "
            f"at most {100.0 * float((lost / whole).max()):.3g} % of those at one tau"
        )
        if not kept.all():
            notes.append(f"{int((~kept).sum())} taus have no term free of gaps and are left out")
    m = clusters[kept].astype(np.float64)
    return _Points(
        tau_samples=m,
        variance=sums[kept] / (divisor * m * m * terms[kept]),
        terms=terms[kept],
        windows=terms[kept],
        clusters=clusters[kept],
        estimators=[estimator] * int(kept.sum()),
    )


def _total_points(track: _Track, clusters: NDArray[np.int64], notes: list[str]) -> _Points:
    """Total variance, SP1065 section 5.2.11."""
    return _averaged(
        "totdev",
        track,
        clusters,
        sums=_reflected_sums(track.angle, clusters),
        terms=_whole_counts("totdev", clusters, track.angle.size),
        divisor=2.0,
        notes=notes,
    )


def _modified_total_points(track: _Track, clusters: NDArray[np.int64], notes: list[str]) -> _Points:
    """Modified total variance, SP1065 section 5.2.12."""
    whole = _whole_counts("mtotdev", clusters, track.angle.size)
    strides = [_stride(int(w), 3 * int(m), int(m)) for w, m in zip(whole, clusters, strict=True)]
    windows = -(-whole // np.array(strides))
    sums = np.array(
        [
            _kernels.sum_modified_total_terms(track.angle, int(m), stride)
            for m, stride in zip(clusters, strides, strict=True)
        ]
    )
    m = clusters.astype(np.float64)
    _note_strides("mtotdev", strides, clusters, notes)
    notes.append("mtotdev keeps its bias: its variance lies below that of mdev")
    return _Points(
        tau_samples=m,
        variance=sums / (2.0 * m**4 * windows),
        terms=windows * 6 * clusters,
        windows=windows,
        clusters=clusters,
        estimators=["mtotdev"] * clusters.size,
    )


def _theo1_points(track: _Track, spans: NDArray[np.int64], notes: list[str]) -> _Points:
    """Theo1, SP1065 section 5.2.15, of even spans m; tau = 0.75 m tau0."""
    variance, windows, strides = _theo1_variances(track.angle, spans)
    _note_strides("theo1", strides, spans, notes)
    notes.append("theo1 keeps its bias (theoh removes it); taus asked for are its spans m tau0")
    return _Points(
        tau_samples=_THEO1_EFFECTIVE * spans.astype(np.float64),
        variance=variance,
        terms=windows * (spans // 2),
        windows=windows,
        clusters=spans,
        estimators=["theo1"] * spans.size,
    )


def _theo1_variances(
    angle: FloatArray, spans: NDArray[np.int64]
) -> tuple[FloatArray, NDArray[np.int64], list[int]]:
    variance, windows, strides = [], [], []
    mirrored = _mirrored(angle)
    for m in map(int, spans):
        stride = _stride(angle.size - m, m // 2, m)
        count = -(-(angle.size - m) // stride)
        total = _kernels.sum_theo1_terms(angle, mirrored, m, stride)
        series.release(angle, mirrored)
        variance.append(total / (_THEO1_EFFECTIVE * m * m * count))
        windows.append(count)
        strides.append(stride)
    return np.array(variance), np.array(windows, dtype=np.int64), strides


def _theoh_points(track: _Track, clusters: NDArray[np.int64], notes: list[str]) -> _Points:
    """Bias-removed hybrid: OADEV up to a fifth of the record, Theo1 less its bias beyond."""
    angle = track.angle
    short = clusters[clusters <= _THEOH_ALLAN_SHARE * (angle.size - 1)]
    spans = np.unique(2 * np.rint(clusters[short.size :] / (2 * _THEO1_EFFECTIVE)).astype(np.int64))
    variance, windows, strides = _theo1_variances(angle, spans)
    if spans.size:
        variance = variance * _theo1_bias_removal(angle, notes)
        _note_strides("theoh", strides, spans, notes)
    return _Points(
        tau_samples=np.concatenate((short.astype(np.float64), _THEO1_EFFECTIVE * spans)),
        variance=np.concatenate((_overlapping_allan(angle, short), variance)),
        terms=np.concatenate((angle.size - 2 * short, windows * (spans // 2))),
        windows=np.concatenate((angle.size - 2 * short, windows)),
        clusters=np.concatenate((short, spans)),
        estimators=["oadev" if i < short.size else "theo1" for i in range(short.size + spans.size)],
    )


def _overlapping_allan(angle: FloatArray, clusters: NDArray[np.int64]) -> FloatArray:
    m = clusters.astype(np.float64)
    sums = _difference_sums(_kernels.sum_squared_second_differences, angle, clusters)
    return sums / (2.0 * m * m * (angle.size - 2 * clusters))


def _theo1_bias_removal(angle: FloatArray, notes: list[str]) -> float:
    """Mean ratio of Allan to Theo1 variance at equal tau up to a tenth of the record.

    Allan at m = 9 + 3 i beside Theo1 at 12 + 4 i, i = 0 .. 0.1 N / 3 - 3.
    """
    last = int(0.1 * angle.size / 3.0 - 3.0)
    steps = np.arange(last + 1)
    if steps.size > _BIAS_RATIOS:
        steps = np.unique(np.rint(np.linspace(0, last, _BIAS_RATIOS)).astype(np.int64))
        notes.append(f"theoh takes its bias from {steps.size} of {last + 1} ratios, evenly spaced")
    theo1, _, _ = _theo1_variances(angle, 12 + 4 * steps)
    allan = _overlapping_allan(angle, 9 + 3 * steps)
    usable = theo1 > 0.0
    return float(np.mean(allan[usable] / theo1[usable])) if usable.any() else 1.0


def _stride(windows: int, squares: int, cluster: int) -> int:
    """Spacing of the outer windows that bounds the work at one tau.

    Windows an eighth of a cluster apart are so correlated that skipping between them costs
    next to nothing, so it is never wider.
    """
    return min(max(1, math.ceil(windows * squares / _LARGEST_WORK)), max(1, cluster // 8))


def _note_strides(
    estimator: Estimator, strides: Sequence[int], clusters: NDArray[np.int64], notes: list[str]
) -> None:
    skipped = [(int(m), s) for m, s in zip(clusters, strides, strict=True) if s > 1]
    if skipped:
        widest = max(s / m for m, s in skipped)
        notes.append(
            f"{estimator} averages every k-th window at {len(skipped)} of {len(strides)} taus, "
            f"k = {min(s for _, s in skipped)} to {max(s for _, s in skipped)}, "
            f"at most {widest:.2g} of a cluster"
        )


# --- noise type ----------------------------------------------------------------------------


def _noise_types(
    track: _Track, clusters: NDArray[np.int64], order: int, notes: list[str]
) -> NDArray[np.int64]:
    """Power law of the rate noise at each cluster, by lag-1 autocorrelation.

    Angles a cluster apart lose a parabola and are differenced until they are stationary.
    From short clusters to long, on octaves at least, the type found before stands as long as
    the reading is within its scatter of it, or less red; and it stands for good where fewer than
    30 angles are left.
    """
    starts, lengths = track.starts, track.lengths
    longest = int(lengths.max(initial=1)) - 1
    usable = longest // (_FEWEST_FOR_NOISE - 1)
    anchor = max(1, min(int(clusters[0]), longest // _SURE_OF_NOISE))
    octaves = anchor * 2 ** np.arange(int(clusters[-1]).bit_length(), dtype=np.int64)
    ladder = np.unique(np.concatenate((octaves[octaves <= clusters[-1]], clusters)))
    ladder = ladder[ladder <= usable]
    found: list[int] = []
    for m in map(int, ladder):
        reading, scatter = _read_noise(track.angle, starts, lengths, m, order)
        previous = found[-1] if found else None
        if math.isnan(reading):
            break
        lowest = -2 if order == 2 else -4
        nearest = max(_nearest_type(reading, m), lowest)
        above = max(_nearest_type(reading + scatter, m), lowest)
        below = max(_nearest_type(reading - scatter, m), lowest)
        # Noise only gets redder with the cluster time: of a sum of power laws the redder rules
        # the longer, and a reading that says otherwise is scatter, or a line.
        stands = previous is not None and (below <= previous <= above or nearest > previous)
        found.append(previous if previous is not None and stands else nearest)
    if not found:
        notes.append(
            "noise type taken as 0 (angle random walk) for the intervals: "
            f"under {_FEWEST_FOR_NOISE} angles, or no noise, to tell it from"
        )
        return np.zeros(clusters.size, dtype=np.int64)
    ladder = ladder[: len(found)]
    carried = int((clusters > usable).sum())
    if carried:
        notes.append(
            f"noise type of the {carried} longest taus is that found at {ladder[-1]} samples"
        )
    place = np.maximum(np.searchsorted(ladder, clusters, side="right") - 1, 0)
    return np.array(found, dtype=np.int64)[place]


def _read_noise(
    angle: FloatArray,
    starts: NDArray[np.int64],
    lengths: NDArray[np.int64],
    cluster: int,
    order: int,
) -> tuple[float, float]:
    """Exponent as read, not rounded, and about its standard deviation times 1.3."""
    counts = (lengths - 1) // cluster + 1
    enough = counts >= _FEWEST_FOR_NOISE
    first, count = _sample_stretches(starts[enough], lengths[enough], cluster)
    if series.is_mapped(angle):
        # Reading here and there would bring in all of the record.
        places = np.concatenate(
            [start + cluster * np.arange(size) for start, size in zip(first, count, strict=True)]
        )
        ascending = np.argsort(places)
        values = np.empty(places.size)
        values[ascending] = series.at(angle, places[ascending])
        ends = np.cumsum(count)
        level = float(_kernels.lag_one_order(values, ends - count, count, 1, order))
    else:
        level = float(_kernels.lag_one_order(angle, first, count, cluster, order))
    return 2.0 - 2.0 * level, 2.0 / math.sqrt(min(int(counts[enough].sum()), int(count.sum())))


def _nearest_type(reading: float, cluster: int) -> int:
    bounds = _NOISE_BOUNDS if cluster == 1 else _NOISE_BOUNDS_APART
    return 2 - sum(reading < bound for bound in bounds)


def _sample_stretches(
    starts: NDArray[np.int64], lengths: NDArray[np.int64], cluster: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Where to read angles a cluster apart, and how many: some 32 000 in all at most.

    They fix the autocorrelation to half a percent, far inside the width of a noise type. A
    short record is read up to eight times, each time starting elsewhere in the cluster.
    """
    length, most = 4096, 8
    counts = (lengths - 1) // cluster + 1
    places, sizes = [], []
    if counts.sum() <= length * most:
        readings = min(cluster, most, int(length * most // counts.sum()))
        for start, size in zip(starts, lengths, strict=True):
            for k in range(readings):
                offset = k * cluster // readings
                places.append(int(start) + offset)
                sizes.append((int(size) - 1 - offset) // cluster + 1)
        return np.array(places), np.array(sizes)
    for start, count in zip(starts, counts, strict=True):
        pieces = max(1, int(count) // length)
        for k in range(pieces):
            places.append(int(start) + (k * int(count) // pieces) * cluster)
            sizes.append(min(length, int(count) // pieces))
    chosen = np.unique(np.rint(np.linspace(0, len(places) - 1, most)).astype(np.int64))
    return np.array(places)[chosen], np.array(sizes)[chosen]


# --- intervals -----------------------------------------------------------------------------


def _degrees_of_freedom(
    estimator: Estimator, noise_type: int, cluster: int, samples: int, windows: int
) -> float:
    if estimator in _FINITE_DIFFERENCE:
        return _greenhall_riley(estimator, noise_type, cluster, windows)
    ratio = (samples - 1) / cluster
    alpha = max(noise_type, -2)
    # The published fits are for long clusters and run past what one-sample clusters have.
    shortest = _greenhall_riley("oadev", alpha, 1, samples - 2)
    if estimator == "totdev":
        if alpha > 0:
            return _total_of_angle_noise(cluster, samples)
        slope, offset = _TOTAL_COEFFICIENTS[alpha]
        edf = slope * ratio - offset
        if alpha == 0:
            # The table is for long clusters; Stein's factor for white rate leads up to them.
            edf *= 4.0 * cluster**2 / (4.0 * cluster**2 + 5.0)
        return min(max(edf, _SMALLEST_EDF), shortest)
    if estimator == "mtotdev":
        slope, offset = _MODIFIED_TOTAL_COEFFICIENTS[alpha]
        return min(max(slope * ratio - offset, _SMALLEST_EDF), shortest)
    return max(_theo1_degrees_of_freedom(alpha, _THEO1_EFFECTIVE * cluster, samples), 1.0)


def _total_of_angle_noise(cluster: int, samples: int) -> float:
    """White angle noise, of which SP1065 gives none: (tr Q)^2 / tr Q^2 of the total variance.

    Counted to leading order: each reflected difference holds an end of the record twice, and
    that one angle, met in every reflected difference, is what rules long clusters.
    """
    n, m = float(samples), float(cluster)
    if 2 * cluster < samples:
        inner = n - 2.0 * m
        return (6.0 * inner + 20.0 * m) ** 2 / (70.0 * inner + 32.0 * m * m + 340.0 * m)
    one, both = n - m, 2.0 * m - n  # differences that hold one end, and both
    return (20.0 * one + 14.0 * both) ** 2 / (32.0 * one**2 + 64.0 * both**2 + 64.0 * one * both)


@lru_cache(maxsize=4096)
def _greenhall_riley(estimator: Estimator, noise_type: int, cluster: int, windows: int) -> float:
    """Exact degrees of freedom of `windows` squared differences in a row.

    The filter factor F is 1 for modified variances, m for plain ones, and infinite for long
    clusters of rate noise, as in the paper.

    With gaps the windows are taken as if they stood in one row, which is on the safe side:
    apart they would be less correlated.
    """
    order = _DIFFERENCES[estimator]
    modified = estimator in ("mdev", "tdev")
    overlapping = estimator not in ("adev", "hdev")
    if modified:
        filter_factor = 1.0
    elif noise_type <= 0 and cluster * (order + 1) > _LONGEST_FILTERED:
        filter_factor = math.inf
    else:
        filter_factor = float(cluster)
    inverse = _kernels.inverse_degrees_of_freedom(
        windows,
        cluster if overlapping else 1,
        filter_factor,
        noise_type,
        order,
        _GAUSS_NODES,
        _GAUSS_WEIGHTS,
    )
    return 1.0 / float(inverse)


def _theo1_degrees_of_freedom(alpha: int, tau: float, samples: int) -> float:
    """SP1065 Table 9: `tau` in samples (0.75 of the span), `samples` angles."""
    n = float(samples)
    if alpha == 2:
        return (0.86 * (n + 1.0) * (n - 4.0 / 3.0 * tau) / (n - tau)) * (tau / (tau + 1.14))
    if alpha == 1:
        return (
            (4.798 * n * n - 6.374 * n * tau + 12.387 * tau)
            / (math.sqrt(tau + 36.6) * (n - tau))
            * (tau / (tau + 0.3))
        )
    if alpha == 0:
        rise = tau * math.sqrt(tau)
        return ((4.1 * n + 0.8) / tau - (3.1 * n + 6.5) / n) * (rise / (rise + 5.2))
    if alpha == -1:
        return (2.0 * n * n - 1.3 * n * tau - 3.5 * tau) / (n * tau) * (tau**3 / (tau**3 + 2.3))
    scaled = 4.4 * n - 1.0
    return (
        (4.4 * n - 2.0)
        / (2.9 * tau)
        * (scaled**2 - 8.6 * tau * scaled + 11.4 * tau**2)
        / (4.4 * n - 3.0) ** 2
    )


def _limits(
    deviation: FloatArray, edf: FloatArray, confidence: float
) -> tuple[FloatArray, FloatArray]:
    """Limits of the deviation: edf s^2 / sigma^2 is chi-squared with edf degrees."""
    tail = 0.5 * (1.0 - confidence)
    upper = 2.0 * gammaincinv(0.5 * edf, 1.0 - tail)
    lower = 2.0 * gammaincinv(0.5 * edf, tail)
    return deviation * np.sqrt(edf / upper), deviation * np.sqrt(edf / lower)


def _check_choice(name: str, value: object, allowed: object) -> None:
    choices = get_args(allowed)
    if value not in choices:
        raise ValueError(f"{name} {value!r} is not known; use one of {', '.join(choices)}")


def _check_noise_type(noise_type: int, estimator: Estimator) -> None:
    lowest = -2 if _DIFFERENCES[estimator] == 2 else -4
    if noise_type not in range(lowest, 3):
        raise ValueError(
            f"noise_type {noise_type!r} is out of range for {estimator}; use {lowest} to 2"
        )


_THEO1_EFFECTIVE: Final = 0.75
_THEOH_ALLAN_SHARE: Final = 0.2
_THEOH_SMALLEST: Final = 90  # the first ratio needs 0.1 N / 3 - 3 >= 0
_BIAS_RATIOS: Final = 48
_POINTS_PER_DECADE: Final = 20
_FEWEST_FOR_NOISE: Final = 30  # Riley and Greenhall
_SURE_OF_NOISE: Final = 200  # angles that leave no doubt between one type and the next
_NOISE_BOUNDS: Final = (1.5, 0.5, -0.5, -1.5, -2.5, -3.5)
# Angles taken a cluster apart stay correlated after differencing where they are integrals of
# a random walk: the method reads -2.4, -3.9 and -4.6 for -2, -3 and -4.
_NOISE_BOUNDS_APART: Final = (1.5, 0.5, -0.5, -1.5, -3.1, -4.25)
_LARGEST_WORK: Final = 3e7  # squares at one tau before windows are skipped
_SMALLEST_EDF: Final = 0.5
_ONE: Final = np.ones(1, dtype=np.int64)
# Starts worked on before the memory of a mapped angle is given back: half a megabyte of it beside
# each of some hundred places. A multiple of the kernels' block.
_STARTS: Final = 2**16
_LONGEST_FILTERED: Final = 100  # lags beyond which Greenhall and Riley let F grow to infinity
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)

_DIFFERENCES: Final[dict[Estimator, int]] = {
    name: 3 if name in ("hdev", "ohdev") else 2 for name in get_args(Estimator)
}
_FINITE_DIFFERENCE: Final = ("adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "haar")
_WHOLE_RECORD_ONLY: Final = ("totdev", "mtotdev", "theo1", "theoh")
_POINTS: Final[dict[Estimator, Callable[..., _Points]]] = {
    "adev": _difference_points("adev"),
    "oadev": _difference_points("oadev"),
    "haar": _difference_points("haar"),
    "hdev": _difference_points("hdev"),
    "ohdev": _difference_points("ohdev"),
    "mdev": _modified_points("mdev"),
    "tdev": _modified_points("tdev"),
    "totdev": _total_points,
    "mtotdev": _modified_total_points,
    "theo1": _theo1_points,
    "theoh": _theoh_points,
}
# edf = b T / tau - c: SP1065 Tables 7 and 8.
_TOTAL_COEFFICIENTS: Final = {0: (1.50, 0.0), -1: (1.17, 0.22), -2: (0.93, 0.36)}
_MODIFIED_TOTAL_COEFFICIENTS: Final = {
    2: (1.90, 2.10),
    1: (1.20, 1.40),
    0: (1.10, 1.20),
    -1: (0.85, 0.50),
    -2: (0.75, 0.31),
}
