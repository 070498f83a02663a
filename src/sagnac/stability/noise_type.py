"""Cluster times of a curve, the power law that rules at each, and its degrees of freedom."""

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import Note, quoted, refusal
from sagnac.stability import Estimator
from sagnac.stability.estimators import Properties, properties_of
from sagnac.stability.sums import Track

# ---- clusters ----------------------------------------------------------------------


def cluster_sizes(
    taus: ArrayLike | None, angles: int, sample_rate: float, estimator: Properties
) -> tuple[NDArray[np.int64], tuple[Note, ...]]:
    """(points,) clusters in samples, ascending, at the cluster times asked for, and notes.

    Parameters
    ----------
    taus
        s, or None for those of the estimator's own grid.
    angles
        Accumulated angles in the record.
    sample_rate
        Hz.
    estimator
        Its row of the table.

    Raises
    ------
    ValueError
        If the record is too short, or a cluster time cannot be used.
    """
    smallest, largest = estimator.shortest, estimator.longest(angles)
    if largest < smallest or angles < estimator.fewest_angles:
        few = f"{angles} accumulated angles are too few for {estimator.name}"
        raise ValueError(f"values: {few}; record longer or use oadev")
    if taus is None and estimator.octaves:
        return 2 ** np.arange(int(largest).bit_length(), dtype=np.int64), ()
    if taus is None:
        # 20 points a decade.
        count = 1 + math.ceil(20 * math.log10(largest / smallest))
        grid = np.geomspace(smallest, largest, count) / estimator.step
        sizes = np.unique(np.rint(grid).astype(np.int64) * estimator.step)
        return sizes[(sizes >= smallest) & (sizes <= largest)], ()
    masked = np.ma.atleast_1d(taus)
    given = masked.compressed() if np.ma.is_masked(masked) else masked.data
    if given.dtype.kind not in "iuf" and given.size:
        raise refusal("taus", f"is {quoted(taus)}; give cluster times in s")
    wanted = given.astype(np.float64)
    if wanted.ndim != 1 or wanted.size == 0:
        raise refusal("taus", f"has shape {wanted.shape}; give one or more cluster times in s")
    if not np.isfinite(wanted).all():
        raise refusal("taus", "holds a value that is not finite; give cluster times in s")
    rounded = np.rint(wanted * sample_rate / estimator.step) * estimator.step
    outside = (rounded < smallest) | (rounded > largest)
    if outside.any():
        span = f"use {smallest / sample_rate:.12g} s to {largest / sample_rate:.12g} s"
        first = wanted[outside][0]
        raise ValueError(f"taus: {first:.12g} s is out of range for {estimator.name}; {span}")
    sizes = np.unique(rounded.astype(np.int64))
    moved = np.abs(rounded - wanted * sample_rate) > 1e-6 * rounded
    notes = []
    if moved.any():
        unit = "two sample intervals" if estimator.step == 2 else "the sample interval"
        notes.append(f"{int(moved.sum())} of {wanted.size} taus rounded to a multiple of {unit}")
    if sizes.size < wanted.size:
        notes.append(f"{wanted.size - sizes.size} of {wanted.size} taus coincide and are merged")
    return sizes, tuple(Note(text=text) for text in notes)


# ---- noise type --------------------------------------------------------------------

_FEWEST_FOR_NOISE: Final = 30  # Riley and Greenhall


def identified_noise_types(
    track: Track, clusters: NDArray[np.int64], estimator: Properties
) -> tuple[NDArray[np.int64], tuple[Note, ...]]:
    """(points,) power law of the rate noise at each cluster, by lag-1 autocorrelation, and notes.

    Angles a cluster apart lose a parabola and are differenced until they are stationary.
    From short clusters to long, on octaves at least, the type found before stands as long as
    the reading is within its scatter of it, or less red. Beyond the longest cluster that leaves
    30 angles, the last type stands.

    Parameters
    ----------
    track
        The record.
    clusters
        (points,) in samples, ascending.
    estimator
        Its row of the table.

    References
    ----------
    Riley and Greenhall, Power law noise identification using the lag 1 autocorrelation,
    EFTF 2004.
    """
    longest = int(np.diff(track.stretches).max(initial=1)) - 1
    usable = longest // (_FEWEST_FOR_NOISE - 1)
    # Clusters asked for, and octaves from one up whose 200 angles leave no doubt between one type
    # and the next.
    anchor = max(1, min(int(clusters[0]), longest // 200))
    octaves = anchor * 2 ** np.arange(int(clusters[-1]).bit_length(), dtype=np.int64)
    ladder = np.unique(np.concatenate((octaves[octaves <= clusters[-1]], clusters)))
    ladder = ladder[ladder <= usable]
    exponents: list[int] = []
    for m in map(int, ladder):
        exponent, scatter = _read_noise(track, m, estimator.order)
        if math.isnan(exponent):
            break
        readings = (exponent, exponent + scatter, exponent - scatter)
        types = [max(_nearest_type(one, m), estimator.lowest_exponent) for one in readings]
        nearest, above, below = types
        # Noise only gets redder with the cluster time: in a sum of power laws the redder rules
        # the longer, and a reading that says otherwise is scatter, or a line.
        stands = exponents and (below <= exponents[-1] <= above or nearest > exponents[-1])
        exponents.append(exponents[-1] if stands else nearest)
    if not exponents:
        few = f"under {_FEWEST_FOR_NOISE} angles, or no noise, to tell it from"
        text = f"noise type taken as 0 (angle random walk) for the intervals: {few}"
        return np.zeros(clusters.size, dtype=np.int64), (Note(text=text),)
    ladder = ladder[: len(exponents)]
    carried = int((clusters > usable).sum())
    longest_times = f"the intervals of the {carried} longest cluster times"
    text = f"{longest_times} rest on the type of noise that {ladder[-1]} samples show"
    notes = (Note(text=text),) if carried else ()
    place = np.maximum(np.searchsorted(ladder, clusters, side="right") - 1, 0)
    return np.array(exponents, dtype=np.int64)[place], notes


def _read_noise(track: Track, cluster: int, order: int) -> tuple[float, float]:
    """Exponent as read, not rounded, and about its standard deviation times 1.3."""
    starts, lengths = track.stretches[:, 0], np.diff(track.stretches)[:, 0]
    counts = (lengths - 1) // cluster + 1
    enough = counts >= _FEWEST_FOR_NOISE
    first, count = _sample_stretches(starts[enough], lengths[enough], cluster)
    level = lag_one_order(track.angle, first, count, cluster, order)
    return 2.0 - 2.0 * level, 2.0 / math.sqrt(min(int(counts[enough].sum()), int(count.sum())))


def lag_one_order(
    angle: FloatArray, first: NDArray[np.int64], count: NDArray[np.int64], cluster: int, order: int
) -> float:
    """Differences needed plus fractional order, from pooled lag-1 autocorrelation.

    Stretches begin at `first` and hold `count` angles a cluster apart. Each loses its own
    parabola; the whole is differenced, up to `order` times, until ``r1 / (1 + r1) < 1/4``. NaN for
    a constant.
    """
    by_count: dict[int, list[FloatArray]] = {}
    for start, size in zip(first, count, strict=True):
        row = angle[start : start + size * cluster : cluster]
        by_count.setdefault(row.size, []).append(row)
    stretches = [_without_parabola(np.stack(alike)) for alike in by_count.values()]
    for differences in range(order + 1):
        product = square = 0.0
        for rows in stretches:
            about = rows - rows.mean(axis=1, keepdims=True)
            product += float(np.einsum("ij,ij->", about[:, 1:], about[:, :-1]))
            square += float(np.vdot(about, about))
        if not square > 0.0:
            return math.nan
        # What is left of the parabola's three parameters pulls the correlation down.
        correlation = product / square + max(3 - differences, 1) / float(count.mean())
        fraction = correlation / (1.0 + correlation)
        if fraction < 0.25:
            break
        if differences < order:
            stretches = [np.diff(rows, axis=1) for rows in stretches]
    return differences + fraction


def _without_parabola(rows: FloatArray) -> FloatArray:
    """(stretches, count) angles from the first of each on, less the parabola of each."""
    size = rows.shape[1]
    place = np.arange(size) - 0.5 * (size - 1)
    terms = np.stack([np.ones(size), place, place**2 - (size**2 - 1.0) / 12.0])
    rows = rows - rows[:, :1]
    return np.asarray(rows - (rows @ terms.T / (terms**2).sum(axis=1)) @ terms)


def _nearest_type(exponent: float, cluster: int) -> int:
    # Angles taken a cluster apart stay correlated after differencing if they are integrals of
    # a random walk: the method reads -2.4, -3.9 and -4.6 for -2, -3 and -4.
    steepest = (-2.5, -3.5) if cluster == 1 else (-3.1, -4.25)
    return 2 - sum(exponent < bound for bound in (1.5, 0.5, -0.5, -1.5, *steepest))


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
    is_short = counts.sum() <= length * most
    readings = min(cluster, most, length * most // max(int(counts.sum()), 1))
    for start, size, count in zip(starts.tolist(), lengths.tolist(), counts.tolist(), strict=True):
        pieces = readings if is_short else max(1, count // length)
        for k in range(pieces):
            offset = k * cluster // pieces if is_short else k * count // pieces * cluster
            places.append(start + offset)
            whole = (size - 1 - offset) // cluster + 1
            sizes.append(whole if is_short else min(length, count // pieces))
    if is_short:
        return np.array(places), np.array(sizes)
    chosen = np.unique(np.rint(np.linspace(0, len(places) - 1, most)).astype(np.int64))
    return np.array(places)[chosen], np.array(sizes)[chosen]


def check_noise_type(noise_type: int, estimator: Properties) -> None:
    """Refuse a power law for which the estimator does not converge.

    Raises
    ------
    ValueError
        With the exponents to choose from.
    """
    lowest = estimator.lowest_exponent
    if isinstance(noise_type, bool) or noise_type not in range(lowest, 3):
        outside = f"{noise_type!r} is out of range for {estimator.name}"
        raise refusal("noise_type", f"{outside}; use {lowest} to 2")


# ---- degrees of freedom ------------------------------------------------------------


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
    row = properties_of(estimator)
    check_noise_type(noise_type, row)
    return row.freedom(noise_type, cluster, samples, row.windows(cluster, samples))
