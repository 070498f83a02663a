"""Periodogram of a series, its density and its bins."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray, IntegerArray
from sagnac.spectrum.transforms import power_spectrum, transform_length


def periodogram(increments: FloatArray, padding: int = 1) -> FloatArray:
    """Power of the increments at k / (padding * transform_length(size)) cycles a sample.

    Parameters
    ----------
    increments
        (samples,) in memory or mapped; no more than some blocks of them are held at a time.
    padding
        Frequencies for each one of the unpadded transform.

    Returns
    -------
    (padding * transform_length(size) // 2 + 1,) in the unit of `increments` squared, a series.
    """
    return power_spectrum(
        increments, padding * transform_length(increments.size), 1.0 / increments.size
    )


def density(power: FloatArray, sample_rate: float) -> FloatArray:
    """One-sided rate density, (rad/s)^2/Hz, of a periodogram of angle increments (rad^2)."""
    return 2.0 * sample_rate * power


def smoothed(power: FloatArray, points: int = 2000) -> tuple[FloatArray, FloatArray]:
    """Periodogram averaged into log-spaced bins, for a figure.

    Narrow peaks survive: each bin keeps its mean, and bins are as narrow as the
    periodogram's own at low frequency.

    Returns
    -------
    frequency, power
        (points or fewer,) cycles per sample, and mean power.
    """
    bins = power.size
    edges = np.unique(np.geomspace(1, bins, points + 1).astype(np.int64))
    mean = bin_sums(lambda block: power[block], edges, power) / np.diff(edges)
    center = (edges[:-1] + edges[1:] - 1) / 2.0
    return center / (2.0 * (bins - 1)), mean


def bin_sums(
    values_of: Callable[[slice], FloatArray], edges: IntegerArray, *touched: FloatArray
) -> FloatArray:
    """Sums of a series from each edge to the next.

    Parameters
    ----------
    values_of
        Gives a block of the series.
    edges
        (bins + 1,) places in it, ascending.
    touched
        Series that it is made of, whose memory is given back on the way.

    Returns
    -------
    (bins,) in the unit of the series.

    Examples
    --------
    >>> import numpy as np
    >>> values = np.arange(10.0)
    >>> bin_sums(lambda block: values[block], np.array([0, 2, 10]), values)
    array([ 1., 44.])
    """
    start, stop = int(edges[0]), int(edges[-1])
    total = np.zeros(edges.size - 1)

    def sums(block: slice) -> _Partial:
        here = slice(start + block.start, start + block.stop)
        first = int(np.searchsorted(edges, here.start, "right")) - 1
        last = int(np.searchsorted(edges, here.stop, "left"))
        begins = np.maximum(edges[first:last], here.start) - here.start
        return _Partial(bins=slice(first, last), sums=np.add.reduceat(values_of(here), begins))

    # A bin may go on from one block to the next.
    for partial in series.map(sums, stop - start, *touched):
        total[partial.bins] += partial.sums
    return total


@dataclass(frozen=True, slots=True, kw_only=True)
class _Partial:
    """Sums over the part of some bins that lies in one block."""

    bins: slice
    sums: FloatArray
