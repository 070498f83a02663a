"""Candidates for lines: which peaks are lines for sure, and which wait for a stronger one.

An order smears over all the frequencies that it sweeps on an unsteady table, and a tone over as
many orders; each stands highest on its own scale. So the peaks of both scales are judged together,
the highest first, and each may keep weaker ones waiting, or claim them for its own.
"""

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.lines import detection
from sagnac.lines.components import Components, components_of, joined
from sagnac.lines.detection import Band, Peaks, inside
from sagnac.lines.joint_fit import sums_at_orders
from sagnac.lines.sampling import MOST_ORDERS, mean_square_step
from sagnac.lines.state import State
from sagnac.spectrum.sums import tone_sums

# ---- strongest ---------------------------------------------------------------------

PEAKS_A_ROUND: Final = 200
# Half width of a peak, in bins: what stands so near on the same scale is that peak.
_MAIN_LOBE: Final = 1.5


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


def strongest(candidates: Candidates, most: int = PEAKS_A_ROUND) -> tuple[BooleanArray, bool]:
    """Which candidates are lines for sure: no leakage of a stronger one, and no image of one.

    The highest is judged first. A candidate in the main lobe of a higher one, or among the images
    of a chosen one, is taken for it and plays no part. Each of the others:

    - is *hidden* if it stands less than ten times above the leakage of the higher ones;
    - *waits* if a higher one on the other scale sweeps some of its frequencies, sure or not: either
      may be the other's image, which is seen when one is out;
    - waits as well if its order is not whole and some higher one waits: a tone on a table that
      stops again and again has images at orders that do not sweep it;
    - is chosen if neither is so, up to `most`, which are enough for one round.

    Those that are not hidden leak, and claim their main lobe, whether they are chosen or wait.

    Returns
    -------
    chosen
        (peaks,) bool: lines for sure.
    waiting
        Whether others that one on the other scale keeps waiting are hidden, or were not reached.
    """
    place, height = candidates.place, candidates.height
    low, high = candidates.low, candidates.high
    claimed, held, chosen, passed = np.zeros((4, place.size), dtype=bool)
    leakage = np.zeros(place.size)
    some_wait = False
    for at in np.argsort(height)[::-1].tolist():
        if claimed[at]:
            continue
        # Sidelobes of a rectangular window fall as 1 / (pi * bins)^2; ten times that leaves room
        # for several of them adding up.
        if height[at] >= 10.0 * leakage[at]:
            alike = candidates.in_angle == candidates.in_angle[at]
            bins = 0.5 * np.abs(place - place[at])
            cells = candidates.samples * np.maximum(high - low, high[at] - low[at])
            # Cycles a sample from what it sweeps to what the others do; below zero if they meet.
            beyond = np.maximum(low - high[at], low[at] - high)
            overlapping = ~alike & (beyond < 0.0)
            held[at] = np.any(overlapping & passed)
            some_wait |= bool(held[at])
            if not (held[at] or (some_wait and candidates.broken[at])):
                chosen[at] = True
                if chosen.sum() == most:
                    break
                # It makes images on the other scale, smeared over many cells: none is higher than
                # 30 times their mean height.
                claimed |= overlapping & (height * cells < 30.0 * height[at])
            # Beyond what it sweeps a smeared line falls off as its modulation does: in steps taken
            # here for hundredths of the sweep.
            smeared = candidates.samples * beyond / np.maximum(0.01 * cells, 1.0)
            apart = np.maximum(np.where(alike, bins, smeared), 1.0)
            leakage += np.where(overlapping, 0.0, height[at] / (np.pi * apart) ** 2)
            claimed |= alike & (bins < _MAIN_LOBE)
        held[at] |= some_wait and candidates.broken[at]
        passed[at] = True
    for own in (candidates.in_angle, ~candidates.in_angle):
        others = passed & ~own
        begun = np.searchsorted(np.sort(low[others]), high[own])
        held[own] |= begun > np.searchsorted(np.sort(high[others]), low[own], side="right")
    # One that waits in plain sight has claimed its own place: it comes up again by itself.
    return chosen, bool(np.any(held & ~claimed & ~chosen))


# ---- crowding ----------------------------------------------------------------------


def plain_peaks(peaks: Peaks) -> Peaks:
    """The peaks that are no leakage of a higher one.

    Parameters
    ----------
    peaks
        In frequency, half bins.
    """
    # The highest are looked at.
    peaks = peaks.select(np.argsort(peaks.height)[::-1][:3000])
    everywhere = np.zeros(peaks.place.size)
    in_angle = everywhere > 0.0
    candidates = Candidates(
        place=peaks.place, height=peaks.height, in_angle=in_angle, broken=in_angle,
        low=everywhere, high=everywhere, samples=1,
    )  # fmt: skip
    return peaks.select(strongest(candidates, peaks.place.size)[0])


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
    places = np.concatenate([plain_peaks(peaks).place / (2.0 * half_bins), known.frequencies])
    bands: tuple[Band, ...] = ()
    # More than 60 tones may not be fitted together: fewer peaks are a crowd then. The middle half
    # of a crowd spreads over 150 bins, a line that drifts over fewer; beside more than 120 tones
    # nobody asks whether a crowd is such a line.
    smaller = (20, 10, 5)
    steps = [(0, 40, 150), *((60, crowd, 150) for crowd in smaller)]
    for most, crowd, spread in (*steps, *((120, crowd, 0) for crowd in smaller)):
        if np.count_nonzero(~inside(places, bands)) > most:
            bands = detection.joined_bands((*bands, *_crowds(places, crowd, spread / half_bins)))
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
    places = plain_peaks(peaks).place / (4.0 * (bins - 1))
    margin = 2.0 ** (0.5 * detection.WIDTH)
    bands = ((place / margin, min(place * margin, 0.5)) for place in places.tolist())
    return detection.joined_bands(tuple(bands))


def _crowds(places: FloatArray, crowd: int, spread: float) -> list[Band]:
    """Eighths of an octave with a crowd whose middle half spreads over some cycles a sample."""
    octave = np.floor(np.log2(np.maximum(places, 1e-300)) / detection.WIDTH)
    bands = []
    for number in np.unique(octave):
        here = places[octave == number]
        low, high = np.quantile(here, [0.25, 0.75])
        if here.size >= crowd and high - low >= spread:
            low, high = 2.0 ** (detection.WIDTH * np.array([number, number + 1.0]))
            bands.append((float(low), float(min(high, 0.5))))
    return bands


# ---- candidates --------------------------------------------------------------------


class NewLines(NamedTuple):
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
    known, sampled = state.components, state.record.sampled
    # A peak lies at a half bin.
    frequencies = tones.place * (0.5 / (state.look().power.size - 1))
    outside = ~inside(frequencies, bands)
    tones, frequencies = tones.select(outside), frequencies[outside]
    (whole, whole_height, patient), broken = new_orders(state), broken_orders(state, frequencies)
    broken_places = broken.place * (0.5 / sampled.turns) if broken.place.size else broken.place
    orders = np.concatenate([whole.orders, broken_places])
    # A tone takes half of its main lobe on either side.
    speed, cell = sampled.speeds / (2.0 * np.pi), _MAIN_LOBE / sampled.samples
    ends = [frequencies.size, frequencies.size + whole.size]
    place = np.arange(frequencies.size + orders.size)
    candidates = Candidates(
        place=np.concatenate([tones.place, 2.0 * sampled.turns * whole.orders, broken.place]),
        in_angle=place >= ends[0],
        broken=place >= ends[1],
        # At a steady table a whole order is in frequency, too, and is the table's: it counts twice.
        height=np.concatenate([tones.height, 2.0 * whole_height, broken.height]),
        low=np.concatenate([frequencies, float(speed.min()) * orders]) - cell,
        high=np.concatenate([frequencies, float(speed.max()) * orders]) + cell,
        samples=sampled.samples,
    )
    chosen, waiting = strongest(candidates)
    in_time, at_whole, at_broken = np.split(chosen, ends)
    lines = whole.select(at_whole & ~patient)
    # Known tones beside which others stand are told from new ones.
    near = np.abs(known.frequencies - frequencies[in_time][:, np.newaxis]) * sampled.samples < 1.0
    fresh, restless = frequencies[in_time][~near.any(axis=1)], known.frequencies[near.any(axis=0)]
    # A strong tone in the gyros is also in the angle that they lead. Where the table stands, their
    # product looks like orders until the tone is out: these wait while it is found, piece by piece.
    drifts = restless.size > 0 and lines.size + fresh.size > 0
    if not drifts:
        lines = joined(lines, _lines_at_orders(state, np.sort(broken_places[at_broken])))
    lines = joined(lines, _lines_at_frequencies(state, fresh))
    return NewLines(lines=lines, restless=restless, waiting=waiting and not drifts)


def new_orders(state: State) -> tuple[Components, FloatArray, BooleanArray]:
    """Whole orders of table angle that stand above the floor and are not known yet.

    Returns
    -------
    lines
        The orders with their amplitudes.
    height
        (orders,) power of the increments, rad^2.
    patient
        (orders,) bool: no larger than Earth rate could make them. They wait until Earth rate is
        fitted beside the known ones.
    """
    sampled = state.record.sampled
    highest = min(MOST_ORDERS, int(np.pi / sampled.fastest)) if sampled.fastest > 0.0 else 0
    orders, sums = np.arange(1.0, highest + 1.0), state.order_sums[1 : highest + 1]
    length = sampled.samples * mean_square_step(orders, sampled.speeds) / 2.0
    height = np.abs(sums) ** 2 / (2.0 * length)
    ratio = height / detection.floor_of_orders(orders, sampled.speeds, state.look().floor)
    # Orders closer than one cycle over the whole range, or fewer cycles than one from table motion
    # itself, are not told apart.
    for order in state.components.orders:
        ratio[np.abs(orders - order) * sampled.turns < 0.99] = 0.0
    standing = np.flatnonzero((ratio > state.record.threshold) & (orders * sampled.turns > 0.99))
    patient = np.zeros(standing.size, dtype=bool)
    if state.patience is not None:
        patient = np.abs(sums[standing]) <= length[standing] * state.patience[standing]
    phasor = sums[standing] / length[standing]
    lines = components_of(sampled.samples, orders=orders[standing], phasor=phasor)
    return lines, height[standing], patient


def broken_orders(state: State, frequencies: FloatArray) -> Peaks:
    """Peaks at orders that are not whole, or too high for a sum of their own, and not known yet.

    `frequencies` are those of the peaks in frequency, cycles a sample: they tell whether it is
    worth while to look beyond order 128.
    """
    sampled = state.record.sampled
    if sampled.table is None:
        return detection.NO_PEAKS
    beyond = frequencies > MOST_ORDERS * np.median(sampled.speeds / (2.0 * np.pi))
    # So many may be the smear of orders that are not looked for as a rule.
    crowded, given = int(beyond.sum()) > 100, (state.look().floor, state.record.threshold)
    peaks = detection.peaks_in_order(state.steps, sampled, *given, crowded=crowded)
    orders = peaks.place * (0.5 / sampled.turns)
    # A peak is placed to a tenth of a cycle over the whole range. With a whole cycle here, of 40
    # orders 0.55 to 0.95 cycles off a whole one 21 were found, and 132 that were none. Earth rate,
    # fitted beside it, leaves order 1 with two shoulders.
    cycles = np.where(orders < 1.5, 1.0, 0.5)
    off = np.abs(orders - np.rint(orders)) * sampled.turns > cycles
    off |= orders > MOST_ORDERS + 0.5
    apart = np.abs(state.components.orders - orders[:, np.newaxis]) * sampled.turns
    beside = apart < cycles[:, np.newaxis]
    return peaks.select(off & ~beside.any(axis=1))


def _lines_at_orders(state: State, orders: FloatArray) -> Components:
    """Lines at any orders, ascending; whole where it is not told from a whole one."""
    sampled, nearest = state.record.sampled, np.rint(orders)
    is_whole = np.abs(orders - nearest) * sampled.turns < 0.5
    orders = np.where(is_whole, nearest, orders)
    sums = sums_at_orders(state.steps, sampled, orders)[0]
    sums *= 2.0 / (sampled.samples * mean_square_step(orders, sampled.speeds))
    return components_of(sampled.samples, orders=orders, free=~is_whole, phasor=sums)


def _lines_at_frequencies(state: State, frequencies: FloatArray) -> Components:
    """Lines at frequencies, cycles a sample."""
    sums = tone_sums(state.steps, frequencies)[0]
    # An increment of a tone is 2j sin(pi f) times its phasor in the middle of the step.
    sums *= 1j / (state.steps.size * np.sin(np.pi * frequencies))
    return components_of(state.record.angle.size, frequencies=frequencies, phasor=sums)
