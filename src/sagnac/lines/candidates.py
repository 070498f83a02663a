"""New candidates in frequency and in order."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.lines import _kernels
from sagnac.lines.components import MOST_ORDERS, Components, joined, no_components
from sagnac.lines.joint_fit import order_sums, sums_at_orders, tone_sums
from sagnac.lines.products import Sampling
from sagnac.lines.selection import LOWEST_CYCLES, Residue, floor_of_orders, mean_square_step, speeds
from sagnac.spectrum.floor import noise_floor
from sagnac.table.turns import FEW_TURNS, full_turns

_PEAKS_A_ROUND: Final = 200
# Phase, in rad rms, by which an order strays from a tone before it is looked for on its own scale;
# whether a line found in time follows the table better is asked in the end.
_SMEARED: Final = 1.0
# Even angles for a cycle of the highest order there, and how many there may be in all.
_ANGLES_A_CYCLE: Final = 8
_MOST_ANGLES: Final = 2**24
# So many peaks beyond the frequencies of the orders that are looked for as a rule may be the smear
# of higher ones.
_CROWDED: Final = 100
# How a peak at a whole order counts beside one in frequency of the same height: at a steady table
# it is both, and the table's.
_WHOLE: Final = 2.0
# Highest peak of a line on the scale that it smears on, in its mean height there.
_SMEARED_PEAK: Final = 30.0


def new_orders(
    left: Residue, known: Components, reach: FloatArray | None = None
) -> tuple[Components, FloatArray, NDArray[np.bool_]]:
    """Whole orders of table angle that stand above the floor and are not known yet.

    Returns
    -------
    orders
        With their amplitudes.
    height
        (orders,) power of the increments.
    waiting
        (orders,) bool: with `reach`, of `earth_amplitudes`, those that Earth rate could make.
        They wait until it is fitted beside the known ones.
    """
    samples, table = left.sampled.samples, left.sampled.table
    nothing = no_components(samples)
    if table is None:
        return nothing, np.empty(0), np.empty(0, dtype=bool)
    speed = speeds(table)
    fastest = float(speed.max())
    highest = min(MOST_ORDERS, int(np.pi / fastest)) if fastest > 0.0 else 0
    if highest < 1:
        return nothing, np.empty(0), np.empty(0, dtype=bool)
    sums = order_sums(left.steps, table, highest)[1:]
    orders = np.arange(1.0, highest + 1.0)
    length = samples * mean_square_step(orders, speed) / 2.0
    height = np.abs(sums) ** 2 / (2.0 * length)
    ratio = height / floor_of_orders(orders, speed, left.floor)
    turns = full_turns(table)
    # Orders closer than one cycle over the whole range, or fewer cycles than one from table motion
    # itself, are not told apart.
    for order in known.orders:
        ratio[np.abs(orders - order) * turns < 0.99] = 0.0
    standing = np.flatnonzero((ratio > left.threshold) & (orders * turns > 0.99))
    waiting = np.zeros(standing.size, dtype=bool)
    if reach is not None:
        waiting = np.abs(sums[standing]) <= length[standing] * reach[standing]
    found = replace(
        nothing,
        orders=orders[standing],
        free=np.zeros(standing.size, dtype=bool),
        cosine=sums.real[standing] / length[standing],
        sine=sums.imag[standing] / length[standing],
    )
    return found, height[standing], waiting


def new_lines(
    left: Residue, known: Components, reach: FloatArray | None
) -> tuple[Components, FloatArray, bool]:
    """Peaks above the floor, in frequency and in order, that no stronger one explains.

    An order smears over all the frequencies that it sweeps on an unsteady table, and a tone
    over as many orders; each stands highest on its own scale. So the peaks of both scales
    are taken together, the one of most power first, and what a stronger one on the other scale
    may have made waits for the next round. In the first round, with `reach`,
    so does what Earth rate may have made.

    Parameters
    ----------
    left
        What is left of the angle.
    known
        Lines that are out of it already.
    reach
        Of `earth_amplitudes`, or None.

    Returns
    -------
    found
        New lines, with amplitudes near enough to start from.
    restless
        Frequencies of known tones beside which peaks stand: their own doing, they drift.
    waiting
        Whether there are peaks that may be lines and wait for what is out by then.
    """
    samples, table = left.sampled.samples, left.sampled.table
    # In red noise the jump from the record's end to its start leaks with one sign into whole bins
    # and with the other into the halves between, whose floor may be twice as high.
    halves = noise_floor(left.power[1::2])
    peaks = _peaks(left.power, left.floor, halves, left.threshold, first=2 * LOWEST_CYCLES)
    frequency = peaks.place * (0.5 / (left.power.size - 1))
    cell = 1.5 / samples
    found = no_components(samples)
    if table is None:
        ends = np.stack([frequency - cell, frequency + cell])
        chosen, waiting = _strongest([peaks], ends, peaks.height, samples, frequency.size)
        tones = frequency[chosen]
    else:
        speed = speeds(table) / (2.0 * np.pi)
        slowest, fastest = float(speed.min()), float(speed.max())
        turns = full_turns(table)
        beyond = frequency > MOST_ORDERS * np.median(speed)
        broken = _order_peaks(left, table, crowded=int(beyond.sum()) > _CROWDED)
        broken_orders = broken.place * (0.5 / turns)
        off = np.abs(broken_orders - np.rint(broken_orders)) * turns > 1.0
        off |= broken_orders > MOST_ORDERS + 0.5
        beside = np.abs(known.orders - broken_orders[:, np.newaxis]) * turns < 1.0
        off &= ~beside.any(axis=1)
        broken, broken_orders = broken.select(off), broken_orders[off]
        whole, heights, patient = found, np.empty(0), np.empty(0, dtype=bool)
        if turns >= FEW_TURNS:
            whole, heights, patient = new_orders(left, known, reach)
        in_order = _Peaks(
            place=np.concatenate([2.0 * turns * whole.orders, broken.place]),
            height=np.concatenate([heights, broken.height]),
        )
        orders = np.concatenate([whole.orders, broken_orders])
        ends = np.stack(
            [
                np.concatenate([frequency, slowest * orders]) - cell,
                np.concatenate([frequency, fastest * orders]) + cell,
            ]
        )
        height = np.concatenate([peaks.height, _WHOLE * heights, broken.height])
        first_broken = frequency.size + whole.size
        chosen, waiting = _strongest([peaks, in_order], ends, height, samples, first_broken)
        tones = frequency[chosen[: frequency.size]]
        chosen = chosen[frequency.size :]
        found = whole.select(chosen[: whole.size] & ~patient)
        loose = np.sort(broken_orders[chosen[whole.size :]])
        if loose.size:
            nearest = np.rint(loose)
            is_whole = np.abs(loose - nearest) * turns < 0.5
            loose = np.where(is_whole, nearest, loose)
            square = samples * mean_square_step(loose, speeds(table))
            sums = sums_at_orders(left.steps, left.sampled, loose)[0]
            sums *= 2.0 / square
            found = joined(
                found,
                replace(
                    no_components(samples),
                    orders=loose,
                    free=~is_whole,
                    cosine=sums.real,
                    sine=sums.imag,
                ),
            )
    near = np.abs(known.frequencies - tones[:, np.newaxis]) * samples < 1.0
    restless = known.frequencies[near.any(axis=0)]
    tones = tones[~near.any(axis=1)]
    if tones.size == 0:
        return found, restless, waiting
    # An increment of a tone is 2j sin(pi f) times its phasor in the middle of the step.
    sums = tone_sums(left.steps, tones)[0]
    sums *= 1j / (left.steps.size * np.sin(np.pi * tones))
    nothing = no_components(samples)
    tones_found = replace(nothing, frequencies=tones, cosine=sums.real, sine=sums.imag)
    return joined(found, tones_found), restless, waiting


@dataclass(frozen=True, slots=True, kw_only=True)
class _Peaks:
    """Peaks of a spectrum: place and height of each, in half bins and in power of increments."""

    place: FloatArray
    height: FloatArray

    def select(self, keep: NDArray[np.bool_]) -> "_Peaks":
        return _Peaks(place=self.place[keep], height=self.height[keep])


def _strongest(
    scales: list[_Peaks], ends: FloatArray, height: FloatArray, samples: int, broken: int
) -> tuple[NDArray[np.bool_], bool]:
    """Which peaks are lines for sure: none of a stronger one's leakage, or smeared from one.

    And whether there are others that one of those on the other scale keeps waiting.

    Parameters
    ----------
    scales
        Peaks in frequency and, where the table turns, in order.
    ends
        (2, peaks) lowest and highest frequency that each sweeps, cycles a sample.
    height
        (peaks,) by which the stronger of two is told, in one unit for both scales.
    samples
        Length of the record.
    broken
        Number of the first peak at an order that is not whole.
    """
    place = np.concatenate([peaks.place for peaks in scales])
    scale = np.repeat(np.arange(len(scales)), [peaks.place.size for peaks in scales])
    low, high = ends
    cells = samples * (high - low)
    chosen, explained, waiting = np.zeros((3, place.size), dtype=bool)
    leakage = np.zeros(place.size)
    pending = False
    for at in np.argsort(height)[::-1].tolist():
        if explained[at]:
            continue
        alike = scale == scale[at]
        beyond = np.maximum(low - high[at], low[at] - high)
        overlapping = ~alike & (beyond < 0.0)
        # Sidelobes of a rectangular window fall as 1 / (pi * bins)^2; ten times that leaves room
        # for several of them adding up. What waits is found in the next round.
        hidden = height[at] < 10.0 * leakage[at]
        # A tone on a table that stops again and again has images at orders that do not sweep it.
        # While one may still wait, orders that are not whole wait with it.
        pending |= bool(waiting[at]) and not hidden
        waiting[at] |= pending and at >= broken
        if not (hidden or waiting[at]):
            chosen[at] = True
            if chosen.sum() == _PEAKS_A_ROUND:
                break
            # Its image, smeared over many cells, has little height in any: what is lower is taken
            # for the image, and makes nothing else wait.
            smeared = _SMEARED_PEAK * height[at] / np.maximum(cells, cells[at])
            explained |= overlapping & (height < smeared)
        # What stands higher may be its image or a line: seen only when it is out. That holds for
        # what is not sure itself, too: a weaker image of it is no surer.
        waiting |= overlapping
        if hidden:
            continue
        # Beyond what it sweeps a smeared line falls off as its modulation does: in steps taken here
        # for hundredths of the sweep.
        unit = np.maximum(np.maximum(cells, cells[at]) / 100.0, 1.0)
        distance = np.where(alike, np.abs(place - place[at]) / 2.0, samples * beyond / unit)
        sidelobe = height[at] / (np.pi * np.maximum(distance, 1.0)) ** 2
        leakage += np.where(overlapping, 0.0, sidelobe)
        explained |= alike & (distance < 1.5)
    return chosen, bool(np.any(waiting & ~explained & ~chosen))


def _order_peaks(left: Residue, table: FloatArray, *, crowded: bool) -> _Peaks:
    """Peaks of the spectrum over table angle; a half bin is half a cycle over all turns.

    To order 128, or where the frequencies beyond are `crowded` to the highest that samples tell.
    No peaks at orders so low that on this table they are tones, and none where it turns so little
    that orders are not told apart.
    """
    nothing = _Peaks(place=np.empty(0), height=np.empty(0))
    speed = speeds(table)
    fastest = float(speed.max())
    low, high = series.extent(table)
    turns = (high - low) / (2.0 * np.pi)
    highest = float(MOST_ORDERS)
    if crowded:
        highest = max(highest, _MOST_ANGLES / (2.0 * _ANGLES_A_CYCLE * max(turns, 1.0)))
    highest = min(highest, np.pi / fastest) if fastest > 0.0 else 0.0
    lowest = _SMEARED / max(_wander(left.sampled), 1e-300)
    if turns < FEW_TURNS or lowest > highest:
        return nothing
    # An increment of exp(1j k alpha) is 1j k step exp(1j k alpha): the steps' products with those
    # of the table, shared out among even angles, are transformed in one. With eight angles to a
    # cycle of the highest order, a millionth of the power of what lies beyond it is folded back.
    scale = _ANGLES_A_CYCLE * highest / (2.0 * np.pi)
    length = scipy.fft.next_fast_len(int(2.0 * (high - low) * scale) + 4, real=True)
    grid = np.zeros(length)
    for span in series.through(left.steps.size, table, left.steps):
        here = table[span.start : span.stop + 1]
        _kernels.spread(here, left.steps[span], low, scale, grid)
    sums = scipy.fft.rfft(grid, overwrite_x=True)[: int(length / _ANGLES_A_CYCLE)]
    spacing = _ANGLES_A_CYCLE * highest / length
    power = np.square(sums.real) + np.square(sums.imag)
    power /= np.sinc(np.arange(power.size) / length) ** 8
    # Floors change slowly with order.
    coarse = np.geomspace(LOWEST_CYCLES / turns, highest, 400)
    level = floor_of_orders(coarse, speed, left.floor)
    level = np.interp(np.arange(power.size) * spacing, coarse, level)
    power /= table.size * float(np.mean(speed**2))
    first = max(2 * LOWEST_CYCLES, int(lowest / spacing))
    peaks = _peaks(power, level, None, left.threshold, first=first)
    return replace(peaks, place=peaks.place * (2.0 * turns * spacing))


def _wander(sampled: Sampling) -> float:
    """How far the table strays from a steady rate, rad rms."""
    # The last block may be a short one, and the lags then have a mean.
    lag = sampled.lag - sampled.lag.mean()
    rate = float(lag @ (sampled.angle - sampled.angle.mean())) / max(float(lag @ lag), 1e-300)
    return float(np.std(sampled.angle - rate * lag))


def _peaks(
    power: FloatArray,
    floor: FloatArray,
    halves: FloatArray | None,
    threshold: float,
    *,
    first: int,
) -> _Peaks:
    """Where power over floor peaks above the threshold, from half bin `first` on.

    `floor` is of the whole bins and `halves` of those between; of all of them where that is None.
    """
    found: list[FloatArray] = []
    for span in series.through(power.size - 1, power, floor, *([] if halves is None else [halves])):
        start, stop = max(span.start, first), span.stop
        if stop <= start:
            continue
        here = power[start - 1 : stop + 1]
        if halves is None:
            level = floor[start - 1 : stop + 1]
        else:
            at = np.arange(start - 1, stop + 1)
            after = np.minimum((at + 1) // 2, floor.size - 1)
            between = np.minimum(at // 2, halves.size - 1)
            level = np.maximum(0.5 * (floor[at // 2] + floor[after]), halves[between])
        ratio = here / level
        left, inner, right = ratio[:-2], ratio[1:-1], ratio[2:]
        # A peak midway between half bins shows 0.9 of its height: one below the threshold by
        # that much may be above it once refined, and is pruned there if it is not.
        top = np.flatnonzero((inner > 0.9 * threshold) & (inner >= left) & (inner > right))
        left, inner, right = left[top], inner[top], right[top]
        # The top of a parabola through three ordinates.
        offset = 0.5 * (left - right) / (left - 2.0 * inner + right)
        found.append(np.stack([start + top + offset, here[top + 1]]))
    place, height = np.concatenate(found, axis=1) if found else np.empty((2, 0))
    return _Peaks(place=place, height=height)
