"""What stands above the noise floor: candidates in frequency and in order, and their judgement.

Every candidate is judged against the floor at its own frequency, with one false-alarm
probability for the whole band to Nyquist.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.optimize import brentq

from sagnac import _kernels, regression, rotation, series, spectrum
from sagnac.recording import FloatArray
from sagnac.regression import ComponentFit, Components, Sampling

# Below this many cycles a record nothing can be told from the random walk.
_LOWEST_CYCLES: Final = 4
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
# Samples over which a table speed is taken.
_SPEED_SPAN: Final = 32
# Highest peak of a line on the scale that it smears on, in its mean height there.
_SMEARED_PEAK: Final = 30.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Residue:
    """Increments of an angle in which lines are looked for.

    Attributes
    ----------
    steps
        (samples - 1,) increments, rad, without their mean.
    sampled
        When, and at which table angles, the angle was sampled.
    threshold
        Ratio of power to floor that a line exceeds.
    power
        (2 bins - 1,) periodogram at whole and half bins, rad^2.
    floor
        (bins,) noise floor at the whole bins, rad^2.
    """

    steps: FloatArray
    sampled: Sampling
    threshold: float
    power: FloatArray
    floor: FloatArray


def residue(steps: FloatArray, sampled: Sampling, threshold: float) -> Residue:
    """`Residue` of increments, (samples - 1,) rad."""
    power = spectrum.periodogram(steps, padding=2)
    return Residue(
        steps=steps,
        sampled=sampled,
        threshold=threshold,
        power=power,
        floor=spectrum.noise_floor(power[::2]),
    )


def detection_threshold(bins: int, false_alarm: float) -> float:
    """Ratio of power to floor that noise exceeds anywhere with probability `false_alarm`.

    The maximum of a periodogram over continuous frequency, not over its bins alone:
    ``bins * sqrt(pi p / 3) * exp(-p) = false_alarm``, the mean number of upcrossings of
    level p by a chi-square field of two degrees of freedom (Rice's formula). Where the floor
    is only known with a relative error s, as `spectrum.noise_floor` knows it, exp(-p)
    averages to exp(-p + (s p)^2 / 2), which for a few thousand bins is a third more.

    Raises
    ------
    ValueError
        If `false_alarm` is not above zero.
    """
    if not false_alarm > 0.0:
        raise ValueError(f"false_alarm is {false_alarm}; give a probability above zero")
    scatter = spectrum.floor_scatter(bins)
    return float(
        brentq(
            lambda p: (
                np.log(bins)
                + 0.5 * np.log(np.pi * p / 3.0)
                - p
                + 0.5 * (scatter * p) ** 2
                - np.log(false_alarm)
            ),
            1.0,
            100.0,
        )
    )


# --- candidates ---------------------------------------------------------------------------


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
    nothing = regression.no_components(samples)
    if table is None:
        return nothing, np.empty(0), np.empty(0, dtype=bool)
    speed = speeds(table)
    fastest = float(speed.max())
    highest = min(regression.MOST_ORDERS, int(np.pi / fastest)) if fastest > 0.0 else 0
    if highest < 1:
        return nothing, np.empty(0), np.empty(0, dtype=bool)
    sums = regression.order_sums(left.steps, table, highest)[1:]
    orders = np.arange(1.0, highest + 1.0)
    length = samples * _mean_square_step(orders, speed) / 2.0
    height = np.abs(sums) ** 2 / (2.0 * length)
    ratio = height / _floor_of_orders(orders, speed, left.floor)
    turns = rotation.full_turns(table)
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


def earth_amplitudes(table: FloatArray, sample_rate: float) -> FloatArray:
    """(orders,) largest amplitude, rad, that Earth rate on an unsteady table puts into each order.

    0 for order 1, in which Earth rate and the harmonic are one at a steady table (Eq. 16).
    """
    highest = regression.MOST_ORDERS
    orders = np.arange(1.0, highest + 1.0)
    # The table turns slowly beside the samples: every so-many-th angle tells the same.
    stride = max(1, int(1.0 / (highest * float(speeds(table).max()) + 1e-9)))
    stride = min(stride, max(1, table.size // 10_000))
    every = series.every(table, stride)
    rate = sample_rate / stride
    length = every.size * _mean_square_step(orders, speeds(every)) / 2.0
    largest = np.zeros(highest)
    # Order 1 is what a steady table would make of it; it goes first, since with ripple in the rate
    # neighbouring orders are not orthogonal to it and would not show beside it.
    net = float(every[-1] - every[0]) / (every.size - 1) * rate
    path = rotation.mean_rate(every, rate)
    steady = 1.0 / net if abs(net) > 0.5 * abs(path) else 0.0
    steps = series.empty(every.size - 1)
    for function, whole, sign in ((np.cos, np.sin, 1.0), (np.sin, np.cos, -1.0)):
        for span in series.spans(steps.size):
            here = every[span.start : span.stop + 1]
            steps[span] = function(here[1:]) / rate - sign * steady * np.diff(whole(here))
        sums = regression.order_sums(steps, every, highest)[1:]
        largest = np.maximum(largest, np.abs(sums) / np.maximum(length, np.finfo(float).tiny))
    largest[0] = 0.0
    return 2.0 * rotation.EARTH_RATE * largest


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
    halves = spectrum.noise_floor(left.power[1::2])
    peaks = _peaks(left.power, left.floor, halves, left.threshold, first=2 * _LOWEST_CYCLES)
    frequency = peaks.place * (0.5 / (left.power.size - 1))
    cell = 1.5 / samples
    found = regression.no_components(samples)
    if table is None:
        ends = np.stack([frequency - cell, frequency + cell])
        chosen, waiting = _strongest([peaks], ends, peaks.height, samples, frequency.size)
        tones = frequency[chosen]
    else:
        speed = speeds(table) / (2.0 * np.pi)
        slowest, fastest = float(speed.min()), float(speed.max())
        turns = rotation.full_turns(table)
        beyond = frequency > regression.MOST_ORDERS * np.median(speed)
        broken = _order_peaks(left, table, crowded=int(beyond.sum()) > _CROWDED)
        broken_orders = broken.place * (0.5 / turns)
        off = np.abs(broken_orders - np.rint(broken_orders)) * turns > 1.0
        off |= broken_orders > regression.MOST_ORDERS + 0.5
        beside = np.abs(known.orders - broken_orders[:, np.newaxis]) * turns < 1.0
        off &= ~beside.any(axis=1)
        broken, broken_orders = broken.select(off), broken_orders[off]
        whole, heights, patient = found, np.empty(0), np.empty(0, dtype=bool)
        if turns >= rotation.FEW_TURNS:
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
            square = samples * _mean_square_step(loose, speeds(table))
            sums = regression.sums_at_orders(left.steps, left.sampled, loose)[0]
            sums *= 2.0 / square
            found = regression.joined(
                found,
                replace(
                    regression.no_components(samples),
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
    sums = regression.tone_sums(left.steps, tones)[0]
    sums *= 1j / (left.steps.size * np.sin(np.pi * tones))
    nothing = regression.no_components(samples)
    tones_found = replace(nothing, frequencies=tones, cosine=sums.real, sine=sums.imag)
    return regression.joined(found, tones_found), restless, waiting


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
    highest = float(regression.MOST_ORDERS)
    if crowded:
        highest = max(highest, _MOST_ANGLES / (2.0 * _ANGLES_A_CYCLE * max(turns, 1.0)))
    highest = min(highest, np.pi / fastest) if fastest > 0.0 else 0.0
    lowest = _SMEARED / max(_wander(left.sampled), 1e-300)
    if turns < rotation.FEW_TURNS or lowest > highest:
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
    coarse = np.geomspace(_LOWEST_CYCLES / turns, highest, 400)
    level = _floor_of_orders(coarse, speed, left.floor)
    level = np.interp(np.arange(power.size) * spacing, coarse, level)
    power /= table.size * float(np.mean(speed**2))
    first = max(2 * _LOWEST_CYCLES, int(lowest / spacing))
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


# --- judgement ---------------------------------------------------------------------------


def speeds(alpha: FloatArray) -> FloatArray:
    """Table speeds, rad a sample, at a few hundred evenly spaced ranks."""
    apart = max(1, alpha.size // 4000)
    # Over many samples a swing of the table would average out.
    span = min(apart, _SPEED_SPAN)
    places = np.arange(0, alpha.size - span, apart)
    speed = np.sort(np.abs(series.at(alpha, places + span) - series.at(alpha, places))) / span
    return speed[np.linspace(0, speed.size - 1, min(200, speed.size)).astype(np.int64)]


def _mean_square_step(orders: FloatArray, speed: FloatArray) -> FloatArray:
    """Mean square increment of exp(i k alpha), for each order."""
    return np.asarray((4.0 * np.sin(np.outer(orders, speed) / 2.0) ** 2).mean(axis=1))


def _floor_of_orders(orders: FloatArray, speed: FloatArray, floor: FloatArray) -> FloatArray:
    """Noise floor that each order meets: over the frequencies it sweeps, weighted by power."""
    frequency = np.outer(orders, speed) / (2.0 * np.pi)
    weight = np.sin(np.pi * frequency) ** 2
    bins = np.minimum(frequency * (2.0 * (floor.size - 1)), floor.size - 1).astype(np.int64)
    total = weight.sum(axis=1)
    total[total == 0.0] = 1.0
    return np.asarray((floor[bins] * weight).sum(axis=1) / total)


def floors(components: Components, alpha: FloatArray | None, floor: FloatArray) -> FloatArray:
    """(components,) noise floor at each component's own frequency."""
    bins = np.rint(components.frequencies * (2.0 * (floor.size - 1))).astype(np.int64)
    in_time = floor[np.clip(bins, 0, floor.size - 1)]
    if alpha is None or components.orders.size == 0:
        return in_time
    return np.concatenate([_floor_of_orders(components.orders, speeds(alpha), floor), in_time])


def significances(fit: ComponentFit, levels: FloatArray) -> FloatArray:
    """(components,) Wald statistic of each pair of amplitudes, chi-square with 2 dof."""
    pair = np.stack([fit.components.cosine, fit.components.sine], axis=1)
    block = fit.covariance[:, :2, :2]
    # A pseudo-inverse: of two components that coincide, each direction counts once.
    precision = np.linalg.pinv(block, rcond=1e-9, hermitian=True)
    return np.asarray(np.einsum("ni,nij,nj->n", pair, precision, pair) / levels)


def significant(
    fit: ComponentFit, alpha: FloatArray | None, floor: FloatArray, threshold: float
) -> Components:
    """The components that stand above the floor with all others fitted beside them."""
    levels = floors(fit.components, alpha, floor)
    lowest = _LOWEST_CYCLES / (2.0 * (floor.size - 1))
    significance = significances(fit, levels)
    keep = significance > 2.0 * threshold
    in_time = slice(fit.components.orders.size, None)
    frequencies = fit.components.frequencies
    keep[in_time] &= (frequencies >= 0.75 * lowest) & (frequencies < 0.5)
    # Two that moved to one place share one line between them, with amplitudes that mean nothing:
    # the stronger takes it.
    turns = 0.0 if alpha is None else rotation.full_turns(alpha)
    angles = fit.components.orders.size
    for places, begin in (
        (fit.components.orders * turns, 0),
        (frequencies * (2.0 * fit.components.center), angles),
    ):
        ascending = np.argsort(places)
        close = np.flatnonzero(np.diff(places[ascending]) < 0.5)
        for first, second in zip(ascending[close], ascending[close + 1], strict=True):
            pair = (begin + int(first), begin + int(second))
            keep[min(pair, key=lambda index: float(significance[index]))] = False
    return fit.components.select(keep)
