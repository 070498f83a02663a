"""The noise that goes with the lines when they are removed, and how the curve gets it back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.coefficients.laws import sinusoid_allan_variance
from sagnac.lines.model import Line
from sagnac.lines.selection import speeds
from sagnac.lines.wandering import DriftingLine
from sagnac.spectrum import periodogram

if TYPE_CHECKING:
    from sagnac.lines.search import Search


def taken_allan_variance(
    tau: FloatArray,
    frequency: FloatArray,
    bandwidth: FloatArray,
    density: FloatArray,
    *,
    interval: float,
) -> FloatArray:
    """Allan variance of the noise that goes with fitted lines when they are removed.

    Least squares of p real parameters takes p degrees of freedom of the noise, on average the
    power in a bandwidth of p/2 cycles a record; the Allan variance of the rest is lower by
    ``sum 2 sin^4(pi f tau) / (pi f tau)^2`` times that power. So it is for angles taken at any
    multiple of `interval`: what lies above their Nyquist frequency is folded by the sine.

    Parameters
    ----------
    tau
        (points,), s, multiples of `interval`.
    frequency
        (bands,) where noise was taken, Hz, above zero and below ``0.5 / interval``.
    bandwidth
        (bands,) how much, Hz: half the parameters over the length of the record.
    density
        (bands,) one-sided rate density of the noise there, (rad/s)^2/Hz, of increments over
        `interval` as `spectrum.density` gives it.
    interval
        Of the samples that the lines were fitted to, s.

    Returns
    -------
    FloatArray
        (points,), (rad/s)^2.
    """
    # Increments over an interval show less of a rate than its amplitude: here it is the angle's.
    amplitude = np.sqrt(2.0 * bandwidth * density) / np.sinc(frequency * interval)
    return np.asarray(
        sinusoid_allan_variance(np.asarray(tau)[:, np.newaxis], amplitude, frequency).sum(axis=1)
    )


# Cells that the noise taken with one line is spread over.
_MOST_CELLS: Final = 64


def taken_bands(line: DriftingLine) -> tuple[FloatArray, FloatArray]:
    """Where noise went with the line, and how much: frequencies and bandwidths.

    Half the parameters, in cycles a record, spread evenly over the band. What stays of a line
    because it lies below the noise makes up for some of it, up to a quarter in trials.

    Returns
    -------
    frequency, bandwidth
        (cells,) cycles per sample.
    """
    low, high = line.band
    cells = int(np.clip(round((high - low) * line.samples), 1, _MOST_CELLS))
    frequency = low + (np.arange(cells) + 0.5) * (high - low) / cells
    return frequency, np.full(cells, 0.5 * line.parameters / (line.samples * cells))


# Bins on each side of a line whose noise the fit takes with the line.
TAKEN_BINS: Final = 2.0


def masked_bands(lines: tuple[Line, ...], search: Search) -> tuple[tuple[float, float], ...]:
    """Bands in Hz in which the fit took the noise with the line."""
    width = TAKEN_BINS * search.sample_rate / search.angle.size
    bands: list[tuple[float, float]] = [
        (found.band[0] * search.sample_rate - width, found.band[1] * search.sample_rate + width)
        for found in search.drifting
    ]
    for line in lines:
        if line.scale == "time":
            bands.append((line.frequency - width, line.frequency + width))
        elif search.table is not None:
            speed = speeds(search.table) * search.sample_rate / (2.0 * np.pi)
            low, high = float(speed[0]), float(speed[-1])
            # Spread over many bins, a component takes two of many ordinates: nothing to mask.
            if line.frequency * (high - low) < 20.0 * width:
                center = 0.5 * (low + high) * line.frequency
                bands.append((center - 10.0 * width, center + 10.0 * width))
    return tuple(bands)


def noise_taken(lines: tuple[Line, ...], search: Search) -> FloatArray:
    """`taken` of `Removal`: half a cycle a record for each parameter fitted, where it was."""
    rate, cell = search.sample_rate, search.sample_rate / search.angle.size
    bands: list[tuple[float, float]] = []
    for found in search.drifting:
        cells = zip(*taken_bands(found), strict=True)
        bands += [(place * rate, width * rate) for place, width in cells]
    turn_rate = 0.0
    if search.table is not None:
        turn_rate = float(np.median(speeds(search.table))) * rate / (2.0 * np.pi)
    drifting = {found.frequency * rate for found in search.drifting}
    for line in lines:
        if line.scale == "time" and line.frequency not in drifting:
            bands.append((line.frequency, 1.5 * cell))
        elif line.scale == "angle":
            fitted = 1.5 if line.frequency_error > 0.0 else 1.0
            bands.append((line.frequency * turn_rate, fitted * cell))
    frequency, bandwidth = np.array(bands).reshape(-1, 2).T
    inside = (frequency > 0.0) & (frequency < 0.5 * rate)
    frequency, bandwidth = frequency[inside], bandwidth[inside]
    bins = np.rint(frequency / rate * (2.0 * (search.left.floor.size - 1))).astype(np.int64)
    density = periodogram.density(search.left.floor[bins], rate)
    return np.stack([frequency, bandwidth, density])
