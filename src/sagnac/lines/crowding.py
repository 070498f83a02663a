"""Bands of vibration: peaks that crowd over too many bins to be lines, even lines that drift.

A motor shaft whose speed wanders, or a structure that is shaken, fills a band with hundreds of
peaks. Fitted as lines they would take hours and mean nothing: such a band is named, left in the
angle, and left out of every fit of the spectrum.
"""

from typing import Final

import numpy as np

from sagnac.arrays import BooleanArray, FloatArray
from sagnac.lines.components import Components
from sagnac.lines.peaks import Peaks

Band = tuple[float, float]

# Width of a band to begin with, octaves, and peaks that crowd in it.
_WIDTH: Final = 0.125
_CROWD: Final = 40
# Tones that may be fitted together. If there are more, fewer peaks are a crowd.
_MANY: Final = 60
_SMALLER_CROWDS: Final = (20, 10, 5)
# Bins over which the middle half of a crowd has to spread: a line that drifts spreads over fewer.
_SPREAD: Final = 150
# Tones beside which nobody asks whether a crowd is a line that drifts.
_TOO_MANY: Final = 120
# Lines that drift, this many of them nearer than a 64th of an octave, are one band; if there are
# more than `_MANY_DRIFT` in all, so are two in an eighth of an octave.
_DRIFT_ALIKE: Final = 3
_BESIDE: Final = 1.0 / 64.0
_MANY_DRIFT: Final = 6
# Half width of a peak in half bins, and how far above the leakage of higher ones it is its own.
_MAIN_LOBE: Final = 3.0
_ROOM: Final = 10.0
# Highest peaks looked at.
_MOST: Final = 3000


def plain_peaks(peaks: Peaks) -> Peaks:
    """The peaks that are no leakage of a higher one.

    Parameters
    ----------
    peaks
        In frequency, half bins.
    """
    order = np.argsort(-peaks.height, kind="stable")[:_MOST]
    place, height = peaks.place[order], peaks.height[order]
    leakage = np.zeros(place.size)
    plain = np.ones(place.size, dtype=bool)
    for at in range(place.size):
        if height[at] < _ROOM * leakage[at]:
            plain[at] = False
        if not plain[at]:
            continue
        apart = np.abs(place - place[at])
        beside = apart < _MAIN_LOBE
        beside[: at + 1] = False
        plain &= ~beside
        leakage += height[at] / (0.5 * np.pi * np.maximum(apart, 2.0)) ** 2
    return Peaks(place=place[plain], height=height[plain])


def crowded_bands(peaks: Peaks, known: Components, bins: int) -> tuple[Band, ...]:
    """Bands in which peaks and known tones crowd.

    Parameters
    ----------
    peaks
        In frequency, half bins.
    known
        Lines that are out of the increments already.
    bins
        Of the spectrum, from 0 to half a cycle a sample.

    Returns
    -------
    tuple of (low, high)
        Cycles a sample, ascending and apart. With 40 tones and more in an eighth of an octave;
        with fewer, down to 5, if more than 60 were left to fit.
    """
    half_bins = 2.0 * (bins - 1)
    # A peak at half bin n lies at n / (2 half_bins) cycles a sample.
    found = np.concatenate([plain_peaks(peaks).place / (2.0 * half_bins), known.frequencies])
    bands: tuple[Band, ...] = ()
    steps = [(0, _CROWD, _SPREAD)]
    steps += [(_MANY, crowd, _SPREAD) for crowd in _SMALLER_CROWDS]
    steps += [(_TOO_MANY, crowd, 0) for crowd in _SMALLER_CROWDS]
    for most, crowd, spread in steps:
        if np.count_nonzero(~inside(found, bands)) > most:
            bands = joined_bands((*bands, *_crowds(found, crowd, spread / half_bins)))
    return bands


def bands_of_peaks(peaks: Peaks, bins: int) -> tuple[Band, ...]:
    """An eighth of an octave about every peak, of a search that has gone on for long enough.

    Parameters
    ----------
    peaks
        In frequency, half bins.
    bins
        Of the spectrum, from 0 to half a cycle a sample.
    """
    found = plain_peaks(peaks).place / (4.0 * (bins - 1))
    margin = 2.0 ** (0.5 * _WIDTH)
    return joined_bands(
        tuple((place / margin, min(place * margin, 0.5)) for place in found.tolist())
    )


def _crowds(found: FloatArray, crowd: int, spread: float) -> list[Band]:
    """Eighths of an octave with a crowd whose middle half spreads over some cycles a sample."""
    octave = np.floor(np.log2(np.maximum(found, 1e-300)) / _WIDTH)
    bands = []
    for number in np.unique(octave):
        here = found[octave == number]
        if here.size < crowd:
            continue
        low, high = np.quantile(here, [0.25, 0.75])
        if high - low >= spread:
            bands.append((2.0 ** (number * _WIDTH), 2.0 ** ((number + 1.0) * _WIDTH)))
    return [(float(low), float(min(high, 0.5))) for low, high in bands]


def wandering_bands(drifting: tuple[Band, ...]) -> tuple[Band, ...]:
    """Bands of vibration that were taken for several lines that drift.

    Parameters
    ----------
    drifting
        (low, high) of each such line, cycles a sample.

    Returns
    -------
    tuple of (low, high)
        Cycles a sample: from the lowest to the highest of lines side by side.
    """
    bands = _side_by_side(drifting, _BESIDE, _DRIFT_ALIKE)
    if len(drifting) > _MANY_DRIFT:
        bands += _side_by_side(drifting, _WIDTH, 2)
    return joined_bands(tuple(bands))


def _side_by_side(drifting: tuple[Band, ...], octaves: float, least: int) -> list[Band]:
    """From the lowest to the highest of runs of lines no farther apart than that."""
    result, run = [], list[Band]()
    for line in (*sorted(drifting), (np.inf, np.inf)):
        if run and line[0] > max(high for _, high in run) * 2.0**octaves:
            if len(run) >= least:
                # What wanders is seen but in part.
                margin = 2.0 ** (0.5 * octaves)
                highest = max(high for _, high in run)
                result.append((run[0][0] / margin, min(highest * margin, 0.5)))
            run = []
        run.append(line)
    return result


def joined_bands(bands: tuple[Band, ...]) -> tuple[Band, ...]:
    """The same bands, ascending, those that touch made one."""
    result: list[Band] = []
    for low, high in sorted(bands):
        if result and low <= result[-1][1] * (1.0 + 1e-9):
            result[-1] = (result[-1][0], max(high, result[-1][1]))
        else:
            result.append((low, high))
    return tuple(result)


def inside(frequencies: FloatArray, bands: tuple[Band, ...]) -> BooleanArray:
    """(frequencies,) which lie in one of the bands."""
    within = np.zeros(frequencies.size, dtype=bool)
    for low, high in bands:
        within |= (frequencies >= low) & (frequencies <= high)
    return within


def without_tones_in(components: Components, bands: tuple[Band, ...]) -> Components:
    """Lines less the tones in some bands."""
    if not bands or components.frequencies.size == 0:
        return components
    keep = np.ones(components.size, dtype=bool)
    keep[components.orders.size :] = ~inside(components.frequencies, bands)
    return components if keep.all() else components.select(keep)
