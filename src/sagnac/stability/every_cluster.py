"""The overlapping Allan deviation at every cluster time of a record, exactly.

The sum of squared second differences over all starts,

    V(m) = sum over k of (x[k + 2m] - 2 x[k + m] + x[k])^2,    k = 0 .. M - 1 - 2m,

takes M terms for one cluster and M^2 / 4 for all. Written out, it is three sums of squares, the
autocorrelation R(2m), and two sums of x[k] x[k + m] that lack m products at one end of the
record. R is one transform. The missing products are those (j, i = j + m) below the line i = 2j:
a triangle, cut into rectangles of halving size, each of them a short correlation. So the whole
takes O(M log^2 M).

The angle of a random walk of the rate is large beside its differences over a small cluster, and
the expansion would lose them to rounding. V(m) does not change if a straight line is taken from
x; so clusters of like size are summed in stretches of eight of the longest, each without its
own line, and what two stretches share is subtracted.
"""

from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike
from scipy import fft

from sagnac.arrays import FloatArray
from sagnac.recording.model import Kind
from sagnac.stability.accumulate import accumulated_track
from sagnac.stability.sums import second_difference_sums

# Clusters up to here are summed term by term, which is as fast, as are those with few starts,
# whose sums may be small by chance.
_DIRECT: Final = 32
_FEW_STARTS: Final = 1024
# The longest cluster of a set over its shortest, and the starts of a stretch over the longest
# cluster: (6 * 8)^3 roundings of a rate random walk are 1e-10 of its variance.
_SPAN: Final = 6
_STARTS: Final = 6
# Side of the smallest rectangle that is worth a transform.
_SMALL: Final = 32
# Angles transformed at a time.
_AT_ONCE: Final = 2**20


def deviation_at_every_tau(
    values: ArrayLike, *, kind: Kind, sample_rate: float
) -> tuple[FloatArray, FloatArray]:
    """Overlapping Allan deviation at all of the N/2 cluster times of a record.

    Parameters
    ----------
    values
        (samples,) in any unit, none missing.
    kind, sample_rate
        As in `stability_curve`.

    Returns
    -------
    tuple[FloatArray, FloatArray]
        (clusters,) cluster times, s, and deviations in the unit of `values` per second: those
        of `stability_curve` for each of these times, in O(N log^2 N).

    Raises
    ------
    RecordingError
        If a value is missing or infinite.
    ValueError
        If there are too few.

    Examples
    --------
    >>> import numpy as np
    >>> from sagnac.stability.every_cluster import deviation_at_every_tau
    >>> rate = np.random.default_rng(1).standard_normal(10_000)
    >>> tau, deviation = deviation_at_every_tau(rate, kind="rate", sample_rate=100.0)
    >>> tau.size, bool(abs(deviation[0] - 1.0) < 0.05)
    (5000, True)
    """
    samples = np.asarray(values, dtype=np.float64)
    if samples.ndim != 1:
        raise ValueError(f"values has shape {samples.shape}; give one channel, shape (samples,)")
    angle = np.asarray(accumulated_track(samples, kind, sample_rate, "reject").angle)
    cluster = np.arange(1, (angle.size - 1) // 2 + 1)
    variance = _sums_of_all_clusters(angle) / (2.0 * cluster**2 * (angle.size - 2.0 * cluster))
    scale = 1.0 if kind == "rate" else sample_rate
    return cluster / sample_rate, scale * np.sqrt(variance)


def _sums_of_all_clusters(angle: FloatArray) -> FloatArray:
    """((angles - 1) // 2,) V(m) from m = 1 on."""
    longest = (angle.size - 1) // 2
    direct = np.arange(1, longest + 1)
    direct = direct[(direct <= _DIRECT) | (angle.size - 2 * direct <= _FEW_STARTS)]
    sums = np.empty(longest)
    while longest > _DIRECT:
        shorter = max(longest // _SPAN, _DIRECT)
        sums[shorter:longest] = _sums_up_to(angle, longest)[shorter:]
        longest = shorter
    sums[direct - 1] = second_difference_sums(angle, direct)
    return sums


def _sums_up_to(angle: FloatArray, longest: int) -> FloatArray:
    """(longest,) V(m), over stretches that are long beside the longest cluster."""
    step = _STARTS * longest
    shared = 2 * longest
    # The last stretch, which takes the rest of the record, is at least as long as what is shared.
    stretches = max((angle.size - shared) // step, 0)
    sums = _sums_in_rows(angle[None, stretches * step :], longest)
    if stretches:
        at_once = max(_AT_ONCE // (step + shared), 1)
        long = sliding_window_view(angle, step + shared)[::step][:stretches]
        short = sliding_window_view(angle, shared)[step::step][:stretches]
        for first in range(0, stretches, at_once):
            sums += _sums_in_rows(long[first : first + at_once], longest)
            sums -= _sums_in_rows(short[first : first + at_once], longest)
    return sums


def _sums_in_rows(rows: FloatArray, longest: int) -> FloatArray:
    """(longest,) V(m), added over the rows, (rows, angles), each a record of its own."""
    length = rows.shape[1]
    place = np.arange(length) - 0.5 * (length - 1)
    slopes = rows @ place / (place @ place)
    rows = rows - rows.mean(axis=1, keepdims=True) - slopes[:, None] * place
    m = np.arange(1, longest + 1)
    squares = np.concatenate([[0.0], np.cumsum((rows**2).sum(axis=0))])
    ends = squares[length] - squares[2 * m] + squares[length - 2 * m]
    middle = squares[length - m] - squares[m]
    correlation = _correlation(rows, 2 * longest)
    neighbours = 2.0 * correlation[m] - _triangle(rows, longest) - _triangle(rows[:, ::-1], longest)
    return np.asarray(ends + 4.0 * middle + 2.0 * correlation[2 * m] - 4.0 * neighbours)


def _correlation(rows: FloatArray, longest: int) -> FloatArray:
    """(longest + 1,) sums of x[k] x[k + lag] over each row, added over the rows."""
    size = fft.next_fast_len(rows.shape[1] + longest, real=True)
    power = np.abs(fft.rfft(rows, size, axis=1)) ** 2
    return np.asarray(fft.irfft(power.sum(axis=0), size)[: longest + 1])


def _triangle(rows: FloatArray, longest: int) -> FloatArray:
    """(longest,) sums over j < m of x[j] x[j + m], m from 1 on, added over the rows."""
    side = _SMALL * 2 ** max((-(-longest // _SMALL) - 1).bit_length(), 0)
    head = np.zeros((rows.shape[0], 2 * side))
    head[:, : min(2 * longest, rows.shape[1])] = rows[:, : 2 * longest]
    sums = np.zeros(2 * side + 1)
    size = side
    while size > _SMALL:
        _add_rectangles(sums, head, size)
        size //= 2
    _add_small_triangles(sums, head, size)
    return sums[1 : longest + 1]


def _add_rectangles(sums: FloatArray, head: FloatArray, size: int) -> None:
    """The products of j in [b, b + size/2) and i in [2b + size, 2b + 2 size), b = 0, size, ..."""
    half, count = size // 2, head.shape[1] // (2 * size)
    first = head[:, : count * size].reshape(-1, count, size)[:, :, :half]
    second = head.reshape(-1, count, 2 * size)[:, :, size:]
    period = 3 * half
    spectrum = np.einsum("rcf,rcf->cf", np.conj(fft.rfft(first, period)), fft.rfft(second, period))
    # Circular lags -(half - 1) .. size - 1 belong to m = b + size + lag.
    products = np.roll(fft.irfft(spectrum, period), half - 1, axis=1)
    for parity in (0, 1):
        # Every second block, so that no two write to one place.
        block = products[parity::2]
        start = parity * size + size - half + 1
        target = sums[start : start + block.shape[0] * 2 * size]
        # The last block may end before the array does.
        padded = np.zeros((block.shape[0], 2 * size))
        padded[:, : period - 1] = block[:, : period - 1]
        target += padded.ravel()[: target.size]


def _add_small_triangles(sums: FloatArray, head: FloatArray, size: int) -> None:
    """The products of j in [b, b + size) and i in (2j, 2b + 2 size), b = 0, size, ..."""
    count = head.shape[1] // (2 * size)
    first = head[:, : count * size].reshape(-1, count, size)
    second = head.reshape(-1, count, 2 * size)
    for lag in range(1, 2 * size):
        width = min(lag, size, 2 * size - lag)
        products = np.einsum("rca,rca->c", first[:, :, :width], second[:, :, lag : lag + width])
        sums[lag : lag + count * size : size] += products
