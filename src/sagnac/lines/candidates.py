"""Candidates for lines: which peaks are lines for sure, and which wait for a stronger one.

An order smears over all the frequencies that it sweeps on an unsteady table, and a tone over as
many orders; each stands highest on its own scale. So the peaks of both scales are judged together,
the highest first, and each may keep weaker ones waiting, or claim them for its own.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.lines.components import (
    MOST_ORDERS,
    Components,
    Turning,
    joined,
    mean_square_step,
    no_components,
)
from sagnac.lines.detection import (
    NO_PEAKS,
    Band,
    Peaks,
    floor_of_orders,
    inside,
    peaks_in_order,
)
from sagnac.lines.joint_fit import sums_at_orders, tone_sums
from sagnac.lines.state import State

# ---- strongest ---------------------------------------------------------------------

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

    @property
    def size(self) -> int:
        """Number of candidates."""
        return self.place.size

    def beside(self, at: int) -> "Neighbours":
        """What one of them makes of the others."""
        alike = self.in_angle == self.in_angle[at]
        bins = 0.5 * np.abs(self.place - self.place[at])
        cells = self.samples * np.maximum(self.high - self.low, self.high[at] - self.low[at])
        # Cycles a sample from what it sweeps to what the others do; below zero if they meet.
        beyond = np.maximum(self.low - self.high[at], self.low[at] - self.high)
        overlapping = ~alike & (beyond < 0.0)
        apart = np.where(alike, bins, self.samples * beyond / np.maximum(cells / _FALL, 1.0))
        leakage = self.height[at] / (np.pi * np.maximum(apart, 1.0)) ** 2
        return Neighbours(
            overlapping=overlapping,
            main_lobe=alike & (bins < _MAIN_LOBE),
            leakage=np.where(overlapping, 0.0, leakage),
            images=overlapping & (self.height * cells < _SMEARED_PEAK * self.height[at]),
        )

    def overlapped(self, some: BooleanArray) -> BooleanArray:
        """Which sweep some of the frequencies that `some` on the other scale do."""
        result = np.zeros(self.size, dtype=bool)
        for own in (self.in_angle, ~self.in_angle):
            others = some & ~own
            begun = np.searchsorted(np.sort(self.low[others]), self.high[own])
            ended = np.searchsorted(np.sort(self.high[others]), self.low[own], side="right")
            result[own] = begun > ended
        return result


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Neighbours:
    """What one candidate makes of the others, (peaks,) each.

    Attributes
    ----------
    overlapping
        Which sweep some of the same frequencies on the other scale: one may be its image.
    main_lobe
        Which are so near on the same scale that they are this one, itself among them.
    leakage
        Height of its sidelobes at each: of images there is none.
    images
        Which it makes on the other scale: smeared over many cells, low in each of them.
    """

    overlapping: BooleanArray
    main_lobe: BooleanArray
    leakage: FloatArray
    images: BooleanArray


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
    claimed, held, chosen, passed = np.zeros((4, candidates.size), dtype=bool)
    leakage = np.zeros(candidates.size)
    some_wait = False
    for at in np.argsort(candidates.height)[::-1].tolist():
        if claimed[at]:
            continue
        if candidates.height[at] >= _ROOM * leakage[at]:
            beside = candidates.beside(at)
            held[at] = np.any(beside.overlapping & passed)
            some_wait |= bool(held[at])
            if not (held[at] or (some_wait and candidates.broken[at])):
                chosen[at] = True
                if chosen.sum() == PEAKS_A_ROUND:
                    break
                claimed |= beside.images
            leakage += beside.leakage
            claimed |= beside.main_lobe
        held[at] |= some_wait and candidates.broken[at]
        passed[at] = True
    held |= candidates.overlapped(passed)
    # One that waits in plain sight has claimed its own place: it comes up again by itself.
    return Choice(chosen=chosen, waiting=bool(np.any(held & ~claimed & ~chosen)))


# ---- candidates --------------------------------------------------------------------

# More peaks than these beyond the frequencies of the orders that are looked for as a rule may be
# the smear of higher ones.
_CROWDED: Final = 100
# How a peak at a whole order counts beside one in frequency of the same height: at a steady table
# it is both, and the table's.
_WHOLE: Final = 2.0
# Half the bins that a tone takes.
_CELL: Final = 1.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NewOrders:
    """Whole orders that stand above the floor and are not known yet.

    Attributes
    ----------
    lines
        The orders with their amplitudes.
    height
        (orders,) power of the increments, rad^2.
    patient
        (orders,) bool: no larger than Earth rate could make them. They wait until Earth rate is
        fitted beside the known ones.
    """

    lines: Components
    height: FloatArray
    patient: BooleanArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NewLines:
    """Result of one look at the increments.

    Attributes
    ----------
    lines
        New lines, with amplitudes near enough to start from.
    restless
        Frequencies, cycles a sample, of known tones beside which peaks stand: their own doing, they
        drift.
    waiting
        Whether there are peaks that may be lines and wait for what is out by then.
    """

    lines: Components
    restless: FloatArray
    waiting: bool


def new_lines(state: State, tones: Peaks, bands: tuple[Band, ...] = ()) -> NewLines:
    """Peaks above the floor, in frequency and in order, that no stronger one explains.

    Parameters
    ----------
    state
        A search on its way, looked at.
    tones
        Peaks in frequency of what is left of the angle.
    bands
        (low, high), cycles a sample: peaks in frequency there are no lines.
    """
    known, turns = state.components, state.record.turning
    tones = tones.select(~inside(frequencies_of(state, tones), bands))
    frequencies = frequencies_of(state, tones)
    broken = broken_orders(state, frequencies)
    whole = new_orders(state)
    choice = strongest(candidates_of(state, tones, whole, broken))
    in_time, at_whole, at_broken = np.split(
        choice.chosen, [tones.place.size, tones.place.size + whole.lines.size]
    )
    found = whole.lines.select(at_whole & ~whole.patient)
    # Known tones beside which others stand are told from new ones.
    near = np.abs(known.frequencies - frequencies[in_time][:, np.newaxis])
    near = near * state.record.angle.size < 1.0
    fresh, restless = frequencies[in_time][~near.any(axis=1)], known.frequencies[near.any(axis=0)]
    # A strong tone in the gyros is also in the angle that they lead. Where the table stands, their
    # product looks like orders until the tone is out: these wait while it is found, piece by piece.
    drifts = restless.size > 0 and found.size + fresh.size > 0
    if turns is not None and not drifts:
        orders = np.sort(broken.place[at_broken] * (0.5 / turns.turns))
        found = joined(found, _lines_at_orders(state, turns, orders))
    found = joined(found, _lines_at_frequencies(state, fresh))
    return NewLines(lines=found, restless=restless, waiting=choice.waiting and not drifts)


def frequencies_of(state: State, peaks: Peaks) -> FloatArray:
    """(peaks,) cycles a sample, of peaks in frequency."""
    return peaks.place * (0.5 / (state.look().power.size - 1))


def new_orders(state: State) -> NewOrders:
    """Whole orders of table angle that stand above the floor and are not known yet."""
    known, turns, sums = state.components, state.record.turning, state.order_sums
    none, samples = no_components(state.record.angle.size), state.record.angle.size
    highest = 0
    if turns is not None and turns.fastest > 0.0:
        highest = min(MOST_ORDERS, int(np.pi / turns.fastest))
    if turns is None or sums is None or highest < 1:
        return NewOrders(lines=none, height=np.empty(0), patient=np.empty(0, dtype=bool))
    sums = sums[1 : highest + 1]
    orders = np.arange(1.0, highest + 1.0)
    length = samples * mean_square_step(orders, turns.speeds) / 2.0
    height = np.abs(sums) ** 2 / (2.0 * length)
    ratio = height / floor_of_orders(orders, turns.speeds, state.look().floor)
    # Orders closer than one cycle over the whole range, or fewer cycles than one from table motion
    # itself, are not told apart.
    for order in known.orders:
        ratio[np.abs(orders - order) * turns.turns < 0.99] = 0.0
    standing = np.flatnonzero((ratio > state.record.threshold) & (orders * turns.turns > 0.99))
    patient = np.zeros(standing.size, dtype=bool)
    if state.patience is not None:
        patient = np.abs(sums[standing]) <= length[standing] * state.patience[standing]
    lines = replace(
        none,
        orders=orders[standing],
        free=np.zeros(standing.size, dtype=bool),
        cosine=sums.real[standing] / length[standing],
        sine=sums.imag[standing] / length[standing],
    )
    return NewOrders(lines=lines, height=height[standing], patient=patient)


def broken_orders(state: State, frequencies: FloatArray) -> Peaks:
    """Peaks at orders that are not whole, or too high for a sum of their own, and not known yet.

    `frequencies` are those of the peaks in frequency, cycles a sample: they tell whether it is
    worth while to look beyond order 128.
    """
    turns = state.record.turning
    if turns is None:
        return NO_PEAKS
    beyond = frequencies > MOST_ORDERS * np.median(turns.speeds / (2.0 * np.pi))
    peaks = peaks_in_order(
        state.steps,
        state.record.sampled,
        turns,
        state.look().floor,
        state.record.threshold,
        crowded=int(beyond.sum()) > _CROWDED,
    )
    orders = peaks.place * (0.5 / turns.turns)
    off = np.abs(orders - np.rint(orders)) * turns.turns > 1.0
    off |= orders > MOST_ORDERS + 0.5
    beside = np.abs(state.components.orders - orders[:, np.newaxis]) * turns.turns < 1.0
    return peaks.select(off & ~beside.any(axis=1))


def candidates_of(state: State, tones: Peaks, whole: NewOrders, broken: Peaks) -> Candidates:
    """All peaks side by side: in frequency, at whole orders, at broken ones."""
    places, speed = 2.0 * whole.lines.orders, np.zeros(1)
    orders = whole.lines.orders
    turns, samples = state.record.turning, state.record.angle.size
    if turns is not None:
        places, speed = turns.turns * places, turns.speeds / (2.0 * np.pi)
        orders = np.concatenate([orders, broken.place * (0.5 / turns.turns)])
    frequency = frequencies_of(state, tones)
    cell = _CELL / samples
    in_angle = np.repeat([False, True], [frequency.size, orders.size])
    return Candidates(
        place=np.concatenate([tones.place, places, broken.place]),
        in_angle=in_angle,
        broken=np.arange(in_angle.size) >= frequency.size + whole.height.size,
        height=np.concatenate([tones.height, _WHOLE * whole.height, broken.height]),
        low=np.concatenate([frequency, float(speed.min()) * orders]) - cell,
        high=np.concatenate([frequency, float(speed.max()) * orders]) + cell,
        samples=samples,
    )


def _lines_at_orders(state: State, turns: Turning, orders: FloatArray) -> Components:
    """Lines at any orders, ascending; whole where it is not told from a whole one."""
    samples = state.record.angle.size
    nearest = np.rint(orders)
    is_whole = np.abs(orders - nearest) * turns.turns < 0.5
    orders = np.where(is_whole, nearest, orders)
    sums = sums_at_orders(state.steps, state.record.sampled, orders)[0]
    sums *= 2.0 / (samples * mean_square_step(orders, turns.speeds))
    return replace(
        no_components(samples), orders=orders, free=~is_whole, cosine=sums.real, sine=sums.imag
    )


def _lines_at_frequencies(state: State, frequencies: FloatArray) -> Components:
    """Lines at frequencies, cycles a sample."""
    sums = tone_sums(state.steps, frequencies)[0]
    # An increment of a tone is 2j sin(pi f) times its phasor in the middle of the step.
    sums *= 1j / (state.steps.size * np.sin(np.pi * frequencies))
    none = no_components(state.record.angle.size)
    return replace(none, frequencies=frequencies, cosine=sums.real, sine=sums.imag)
