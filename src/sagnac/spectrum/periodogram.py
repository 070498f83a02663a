"""Periodogram of a series, its density and its bins."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.spectrum.transforms import power_spectrum, transform_length


def periodogram(increments: FloatArray, padding: int = 1) -> FloatArray:
    """Power of the increments at k / (padding * transform_length(size)) cycles a sample.

    Parameters
    ----------
    increments
        (samples,) in memory or mapped; no more than some spans of them are held at a time.
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
    mean = bin_sums(lambda span: power[span], edges, power) / np.diff(edges)
    center = (edges[:-1] + edges[1:] - 1) / 2.0
    return center / (2.0 * (bins - 1)), mean


def bin_sums(
    values_of: Callable[[slice], FloatArray], edges: NDArray[np.int64], *release_of: FloatArray
) -> FloatArray:
    """Sums of a series from each edge to the next.

    Parameters
    ----------
    values_of
        Gives a span of the series.
    edges
        (bins + 1,) places in it, ascending.
    release_of
        Mapped series that it is made of.

    Returns
    -------
    (bins,) in the unit of the series.
    """
    total = np.zeros(edges.size - 1)

    def sums(span: slice) -> tuple[slice, FloatArray]:
        start, stop = int(edges[0]) + span.start, int(edges[0]) + span.stop
        first = int(np.searchsorted(edges, start, "right")) - 1
        last = int(np.searchsorted(edges, stop, "left"))
        here = np.maximum(edges[first:last], start) - start
        return slice(first, last), np.add.reduceat(values_of(slice(start, stop)), here)

    for some, partial in series.each(
        sums, int(edges[-1] - edges[0]), series.SPAN, release_of=release_of
    ):
        total[some] += partial
    return total
