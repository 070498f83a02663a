"""Which peaks are lines for sure, and which wait until a stronger one is out.

An order smears over all the frequencies that it sweeps on an unsteady table, and a tone over as
many orders; each stands highest on its own scale. So the peaks of both scales are judged together,
the highest first, and each may keep weaker ones waiting, or claim them for its own.
"""

from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from sagnac.arrays import BooleanArray, FloatArray

PEAKS_A_ROUND: Final = 200
# Half width of a peak, in bins: what stands so near on the same scale is that peak.
_MAIN_LOBE: Final = 1.5
# Sidelobes of a rectangular window fall as 1 / (pi * bins)^2; ten times that leaves room for
# several of them adding up.
_ROOM: Final = 10.0
# Highest peak of a line on the scale that it smears on, in its mean height there.
_SMEARED_PEAK: Final = 30.0
# Beyond what it sweeps a smeared line falls off as its modulation does: in steps taken here for
# hundredths of the sweep.
_FALL: Final = 100.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Candidates:
    """Peaks on both scales, any of which may be a line, and what each could have made.

    Attributes
    ----------
    place
        (peaks,) in half bins of the peak's own scale.
    in_angle
        (peaks,) bool: in order of table angle; else in frequency.
    broken
        (peaks,) bool: at an order that is not whole.
    height
        (peaks,) by which the stronger of two is told, in one unit for both scales.
    low, high
        (peaks,) lowest and highest frequency that each sweeps, cycles a sample.
    samples
        Length of the record.
    """

    place: FloatArray
    in_angle: BooleanArray
    broken: BooleanArray
    height: FloatArray
    low: FloatArray
    high: FloatArray
    samples: int

    def __post_init__(self) -> None:
        for one in fields(self)[:-1]:
            shape = getattr(self, one.name).shape
            if shape != self.place.shape:
                raise ValueError(f"{one.name} has shape {shape}; give {self.place.shape}")

    @property
    def size(self) -> int:
        """Number of candidates."""
        return self.place.size

    def alike(self, at: int) -> BooleanArray:
        """Which are on the same scale as one of them."""
        return np.asarray(self.in_angle == self.in_angle[at])

    def beyond(self, at: int) -> FloatArray:
        """Cycles a sample from what one sweeps to what the others do; below zero if they meet."""
        return np.asarray(np.maximum(self.low - self.high[at], self.low[at] - self.high))

    def overlapping(self, at: int) -> BooleanArray:
        """Which sweep some of the same frequencies on the other scale: one may be its image."""
        return np.asarray(~self.alike(at) & (self.beyond(at) < 0.0))

    def main_lobe(self, at: int) -> BooleanArray:
        """Which are so near on the same scale that they are this one, itself among them."""
        near = 0.5 * np.abs(self.place - self.place[at]) < _MAIN_LOBE
        return np.asarray(self.alike(at) & near)

    def sidelobes(self, at: int) -> FloatArray:
        """Height of its leakage at each of the others: of images there is none."""
        cells = self.samples * (self.high - self.low)
        unit = np.maximum(np.maximum(cells, cells[at]) / _FALL, 1.0)
        apart = np.where(
            self.alike(at),
            0.5 * np.abs(self.place - self.place[at]),
            self.samples * self.beyond(at) / unit,
        )
        height = self.height[at] / (np.pi * np.maximum(apart, 1.0)) ** 2
        return np.where(self.overlapping(at), 0.0, height)

    def images(self, at: int) -> BooleanArray:
        """Which it makes on the other scale: smeared over many cells, low in each of them."""
        cells = self.samples * (self.high - self.low)
        smeared = _SMEARED_PEAK * self.height[at] / np.maximum(cells, cells[at])
        return np.asarray(self.overlapping(at) & (self.height < smeared))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Choice:
    """Settled part of the candidates.

    Attributes
    ----------
    chosen
        (peaks,) bool: lines for sure.
    waiting
        Whether others that one on the other scale keeps waiting are hidden, or were not reached.
    """

    chosen: BooleanArray
    waiting: bool


def strongest(candidates: Candidates) -> Choice:
    """Which candidates are lines for sure: no leakage of a stronger one, and no image of one.

    The highest is judged first. A candidate in the main lobe of a higher one, or among the images
    of a chosen one, is taken for it and plays no part. Each of the others:

    - is *hidden* if it stands less than ten times above the leakage of the higher ones;
    - *waits* if a higher one on the other scale sweeps some of its frequencies, sure or not: either
      may be the other's image, which is seen when one is out;
    - waits as well if its order is not whole and some higher one waits: a tone on a table that
      stops again and again has images at orders that do not sweep it;
    - is chosen if neither is so. `PEAKS_A_ROUND` are enough for one round.

    Those that are not hidden leak, and claim their main lobe, whether they are chosen or wait.
    """
    claimed, held, chosen = np.zeros((3, candidates.size), dtype=bool)
    leakage = np.zeros(candidates.size)
    some_wait = False
    for at in np.argsort(candidates.height)[::-1].tolist():
        if claimed[at]:
            continue
        hidden = candidates.height[at] < _ROOM * leakage[at]
        some_wait |= bool(held[at]) and not hidden
        held[at] |= some_wait and candidates.broken[at]
        if not (hidden or held[at]):
            chosen[at] = True
            if chosen.sum() == PEAKS_A_ROUND:
                break
            claimed |= candidates.images(at)
        held |= candidates.overlapping(at)
        if not hidden:
            leakage += candidates.sidelobes(at)
            claimed |= candidates.main_lobe(at)
    # One that waits in plain sight has claimed its own place: it comes up again by itself.
    return Choice(chosen=chosen, waiting=bool(np.any(held & ~claimed & ~chosen)))
