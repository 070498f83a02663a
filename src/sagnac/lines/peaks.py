"""Peaks of a spectrum over its noise floor, in frequency and in order of table angle."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.fft

from sagnac import series
from sagnac.arrays import BooleanArray, FloatArray
from sagnac.lines import _kernels
from sagnac.lines.components import MOST_ORDERS
from sagnac.lines.detection import LOWEST_CYCLES, Residue, floor_of_orders
from sagnac.lines.products import Sampling
from sagnac.lines.turning import Turning
from sagnac.spectrum.floor import noise_floor

# Phase, in rad rms, by which an order strays from a tone before it is looked for on its own scale;
# whether a line found in time follows the table better is asked in the end.
_SMEARED: Final = 1.0
# Even angles for a cycle of the highest order there, and how many there may be in all.
_ANGLES_A_CYCLE: Final = 8
_MOST_ANGLES: Final = 2**24
# Orders at which the floor is taken; it changes slowly with order.
_FLOOR_POINTS: Final = 400
# A peak midway between half bins shows this share of its height: one below the threshold by that
# much may be above it once refined, and is pruned there if it is not.
_MIDWAY: Final = 0.9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Peaks:
    """Peaks of a spectrum.

    Attributes
    ----------
    place
        (peaks,) in half bins: half cycles a record, or over the table's whole range.
    height
        (peaks,) power of the increments, rad^2.
    """

    place: FloatArray
    height: FloatArray

    def __post_init__(self) -> None:
        if self.place.shape != self.height.shape:
            raise ValueError(
                f"place has shape {self.place.shape}; give that of height, {self.height.shape}"
            )

    def select(self, keep: BooleanArray) -> "Peaks":
        """The peaks where `keep`, (peaks,) bool, is true."""
        return Peaks(place=self.place[keep], height=self.height[keep])


NO_PEAKS: Final = Peaks(place=np.empty(0), height=np.empty(0))


def peaks_in_frequency(left: Residue) -> Peaks:
    """Peaks of the increments' spectrum over frequency."""
    power = left.spectrum.power
    # In red noise the jump from the record's end to its start leaks with one sign into whole bins
    # and with the other into the halves between, whose floor may be twice as high.
    halves = noise_floor(power[1::2])
    floor = left.spectrum.floor
    return _peaks(
        power,
        lambda span: _level_of_half_bins(floor, halves, span),
        left.threshold,
        2 * LOWEST_CYCLES,
        floor,
        halves,
    )


def peaks_in_order(left: Residue, *, crowded: bool) -> Peaks:
    """Peaks of the increments' spectrum over table angle.

    There are none at orders so low that on this table they are tones.

    Parameters
    ----------
    left
        What is left of the angle.
    crowded
        Whether peaks crowd beyond the frequencies of order 128. If so, the search goes on to the
        highest order that samples tell.
    """
    turns = left.turning
    if turns is None:
        return NO_PEAKS
    highest = _highest_order(turns, crowded=crowded)
    lowest = _SMEARED / max(_wander(left.sampled), 1e-300)
    if lowest > highest:
        return NO_PEAKS
    power, spacing = _power_over_angle(left.steps, turns, highest)
    coarse = np.geomspace(LOWEST_CYCLES / turns.turns, highest, _FLOOR_POINTS)
    level = floor_of_orders(coarse, turns.speeds, left.spectrum.floor)
    level = np.interp(np.arange(power.size) * spacing, coarse, level)
    first = max(2 * LOWEST_CYCLES, int(lowest / spacing))
    found = _peaks(power, lambda span: level[span], left.threshold, first)
    return replace(found, place=found.place * (2.0 * turns.turns * spacing))


def _highest_order(turns: Turning, *, crowded: bool) -> float:
    """Highest order looked for: 128, more if crowded, and none that samples do not tell."""
    highest = float(MOST_ORDERS)
    if crowded:
        highest = max(highest, _MOST_ANGLES / (2.0 * _ANGLES_A_CYCLE * max(turns.turns, 1.0)))
    return min(highest, np.pi / turns.fastest) if turns.fastest > 0.0 else 0.0


def _power_over_angle(
    steps: FloatArray, turns: Turning, highest: float
) -> tuple[FloatArray, float]:
    """Power of the increments at even orders up to `highest`, and how far apart these are.

    An increment of exp(1j k alpha) is 1j k step exp(1j k alpha): the steps' products with those
    of the table, shared out among even angles, are transformed in one. With eight angles to a
    cycle of the highest order, a millionth of the power of what lies beyond it is folded back.
    """
    table = turns.table
    scale = _ANGLES_A_CYCLE * highest / (2.0 * np.pi)
    span_of_table = (turns.high - turns.low) * scale
    length = scipy.fft.next_fast_len(int(2.0 * span_of_table) + 4, real=True)

    def spread(grid: FloatArray, span: slice) -> FloatArray:
        """One block added to the grid, which all of them add to, one after the other."""
        here = table[span.start : span.stop + 1]
        _kernels.spread(here, steps[span], turns.low, scale, grid)
        return grid

    grid = series.reduce(spread, np.zeros(length), steps.size, table, steps)
    sums = scipy.fft.rfft(grid, overwrite_x=True)[: int(length / _ANGLES_A_CYCLE)]
    power = np.square(sums.real) + np.square(sums.imag)
    power /= np.sinc(np.arange(power.size) / length) ** 8
    power /= table.size * float(np.mean(turns.speeds**2))
    return power, _ANGLES_A_CYCLE * highest / length


def _wander(sampled: Sampling) -> float:
    """How far the table strays from a steady rate, rad rms."""
    # The last block may be a short one, and the lags then have a mean.
    lag = sampled.lag - sampled.lag.mean()
    rate = float(lag @ (sampled.angle - sampled.angle.mean())) / max(float(lag @ lag), 1e-300)
    return float(np.std(sampled.angle - rate * lag))


def _level_of_half_bins(floor: FloatArray, halves: FloatArray, span: slice) -> FloatArray:
    """Floor at half bins: the mean of the whole ones beside, or that of the halves if higher.

    Parameters
    ----------
    floor
        (bins,) at the whole bins.
    halves
        (bins - 1,) or fewer, at the bins between; half bin n takes that of n // 2.
    span
        Which half bins; bin k is half bin 2 k.
    """
    first, last = span.start // 2, (span.stop - 1) // 2
    whole = floor[first : last + 2]
    if whole.size < last - first + 2:
        whole = np.append(whole, floor[-1])
    between = halves[first : last + 1]
    if between.size < last - first + 1:
        between = np.append(between, np.full(last - first + 1 - between.size, halves[-1]))
    level = np.empty(2 * between.size)
    np.maximum(whole[:-1], between, out=level[0::2])
    np.maximum(0.5 * (whole[:-1] + whole[1:]), between, out=level[1::2])
    return level[span.start - 2 * first : span.stop - 2 * first]


def _peaks(
    power: FloatArray,
    level_over: Callable[[slice], FloatArray],
    threshold: float,
    first: int,
    *levels: FloatArray,
) -> Peaks:
    """Where power over floor peaks above the threshold, from half bin `first` on.

    Parameters
    ----------
    power
        (half bins,) rad^2.
    level_over
        Gives the floor over a slice of the half bins.
    threshold
        Ratio of power to floor.
    first
        Half bin to begin with, one or more.
    levels
        Series that `level_over` reads.
    """

    def over(span: slice) -> FloatArray:
        start, stop = max(span.start, first), span.stop
        if stop <= start:
            return np.empty((2, 0))
        here = power[start - 1 : stop + 1]
        ratio = here / level_over(slice(start - 1, stop + 1))
        left, inner, right = ratio[:-2], ratio[1:-1], ratio[2:]
        top = np.flatnonzero((inner > _MIDWAY * threshold) & (inner >= left) & (inner > right))
        left, inner, right = left[top], inner[top], right[top]
        # The top of a parabola through three ordinates.
        offset = 0.5 * (left - right) / (left - 2.0 * inner + right)
        return np.stack([start + top + offset, here[top + 1]])

    found = series.map(over, power.size - 1, power, *levels)
    place, height = np.concatenate(found, axis=1) if found else np.empty((2, 0))
    return Peaks(place=place, height=height)
