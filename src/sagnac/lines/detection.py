"""Peaks of a spectrum over its noise floor, in frequency and in order of table angle.

Peaks that crowd over too many bins to be lines, even lines that drift, are bands of vibration.

A motor shaft whose speed wanders, or a structure that is shaken, fills a band with hundreds of
peaks. Fitted as lines they would take hours and mean nothing: such a band is named, left in the
angle, and left out of every fit of the spectrum.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.fft
from scipy.optimize import brentq

from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray, blocks
from sagnac.core.errors import is_finite, quoted, refusal, require_shape
from sagnac.lines import _kernels
from sagnac.lines.components import Components
from sagnac.lines.joint_fit import ComponentFit
from sagnac.lines.sampling import MOST_ORDERS, Sampling
from sagnac.spectrum.periodogram import periodogram
from sagnac.spectrum.power_laws import floor_scatter, noise_floor

# ---- detection ---------------------------------------------------------------------

# Below this many cycles a record nothing can be told from the random walk.
LOWEST_CYCLES: Final = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spectrum:
    """Power of increments of an angle, and its noise floor.

    Attributes
    ----------
    power
        (2 bins - 1,) periodogram at whole and half bins, rad^2.
    floor
        (bins,) noise floor at the whole bins, rad^2.
    """

    power: FloatArray
    floor: FloatArray


def spectrum(steps: FloatArray) -> Spectrum:
    """`Spectrum` of increments, (samples - 1,) rad."""
    power = periodogram(steps, padding=2, single=True)
    return Spectrum(power=power, floor=noise_floor(power[::2]))


def detection_threshold(bins: int, false_alarm: float) -> float:
    """Ratio of power to floor that noise exceeds anywhere with probability `false_alarm`.

    The maximum of a periodogram over continuous frequency, not over its bins alone:
    ``bins * sqrt(pi p / 3) * exp(-p) = false_alarm``, the mean number of upcrossings of
    level p by a chi-square field of two degrees of freedom (Rice's formula). The floor is only
    known with a relative error s (`spectrum.floor_scatter`): exp(-p) then averages to
    exp(-p + (s p)^2 / 2), which for a few thousand bins is a third more.

    Raises
    ------
    ValueError
        If `false_alarm` is not between 0 and 1, or so large that every bin would hold a line.
    """
    if not (is_finite(false_alarm) and 0.0 < false_alarm < min(1.0, max(bins, 2) / np.e)):
        remedy = "give a number between 0 and 1, such as 0.01"
        raise refusal("false_alarm", f"is {quoted(false_alarm)}; {remedy}")
    scatter = floor_scatter(bins)

    def excess(p: float) -> float:
        crossings = np.log(bins) + 0.5 * np.log(np.pi * p / 3.0) - p + 0.5 * (scatter * p) ** 2
        return float(crossings - np.log(false_alarm))

    return float(brentq(excess, 1.0, 100.0))


def floor_of_orders(orders: FloatArray, speed: FloatArray, floor: FloatArray) -> FloatArray:
    """(orders,) noise floor that each meets over the frequencies that it sweeps, by power.

    Parameters
    ----------
    orders
        Of table angle.
    speed
        (ranks,) speeds of the table, rad a sample.
    floor
        (bins,) noise floor, rad^2.
    """
    frequency = np.outer(orders, speed) / (2.0 * np.pi)
    weight = np.sin(np.pi * frequency) ** 2
    bins = np.minimum(frequency * (2.0 * (floor.size - 1)), floor.size - 1).astype(np.int64)
    total = weight.sum(axis=1)
    total[total == 0.0] = 1.0
    return np.asarray((floor[bins] * weight).sum(axis=1) / total)


def floors(components: Components, sampled: Sampling, floor: FloatArray) -> FloatArray:
    """(components,) noise floor at each component's own frequency, rad^2."""
    bins = np.rint(components.frequencies * (2.0 * (floor.size - 1))).astype(np.int64)
    in_angle = floor_of_orders(components.orders, sampled.speeds, floor)
    return np.concatenate([in_angle, floor[np.clip(bins, 0, floor.size - 1)]])


def significances(fit: ComponentFit, levels: FloatArray) -> FloatArray:
    """(components,) Wald statistic of each pair of amplitudes, chi-square with 2 dof.

    Parameters
    ----------
    fit
        The joint fit of all components.
    levels
        (components,) noise floor of each, rad^2.
    """
    pair = fit.components.phasor.view(np.float64).reshape(-1, 2)
    # A pseudo-inverse: if two components coincide, each direction counts once.
    precision = np.linalg.pinv(fit.covariance[:, :2, :2], rcond=1e-9, hermitian=True)
    return np.asarray(np.einsum("ni,nij,nj->n", pair, precision, pair) / levels)


def significant(
    fit: ComponentFit, sampled: Sampling, floor: FloatArray, threshold: float
) -> Components:
    """The components that stand above the floor with all others fitted beside them.

    Only those count that lie where lines are looked for: below half a cycle, and not too low. If
    two have moved to one place, to half a cycle, the stronger one takes the line: it is one, and
    their amplitudes mean nothing.
    """
    components, angles = fit.components, fit.components.orders.size
    significance = significances(fit, floors(components, sampled, floor))
    keep = significance > 2.0 * threshold
    cycles = components.frequencies * (2.0 * (floor.size - 1))
    keep[angles:] &= (cycles >= 0.75 * LOWEST_CYCLES) & (components.frequencies < 0.5)
    # Orders are apart from tones below zero.
    in_time = components.frequencies * (2.0 * components.center)
    places = np.concatenate([-1.0 - components.orders * sampled.turns, in_time])
    ascending = np.argsort(places)
    close = np.flatnonzero(np.diff(places[ascending]) < 0.5)
    pairs = np.stack([ascending[close], ascending[close + 1]])
    keep[np.where(significance[pairs[0]] <= significance[pairs[1]], *pairs)] = False
    return components.select(keep)


# ---- peaks -------------------------------------------------------------------------

# Even angles for a cycle of the highest order that is looked for.
_ANGLES_A_CYCLE: Final = 8


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
        require_shape("place", self.place.shape, self.height.shape)

    def select(self, keep: BooleanArray | IntegerArray) -> "Peaks":
        """The peaks where `keep`, (peaks,) bool, is true, or those of these numbers."""
        return Peaks(place=self.place[keep], height=self.height[keep])


NO_PEAKS: Final = Peaks(place=np.empty(0), height=np.empty(0))


def peaks_in_frequency(spectrum: Spectrum, threshold: float) -> Peaks:
    """Peaks over frequency whose ratio of power to floor exceeds a threshold."""
    # In red noise the jump from the record's end to its start leaks with one sign into whole bins
    # and with the other into the halves between, whose floor may be twice as high.
    halves = noise_floor(spectrum.power[1::2])
    return peaks(spectrum.power, spectrum.floor, threshold, 2 * LOWEST_CYCLES, halves)


def peaks_in_order(
    steps: FloatArray, sampled: Sampling, floor: FloatArray, threshold: float, *, crowded: bool
) -> Peaks:
    """Peaks of the increments' spectrum over table angle.

    There are none at orders so low that on this table they are tones.

    Parameters
    ----------
    steps
        (samples - 1,) increments of what is left of the angle, rad.
    sampled
        How the table turns.
    floor
        (bins,) noise floor of the increments, rad^2.
    threshold
        Ratio of power to floor that a peak exceeds.
    crowded
        Whether peaks crowd beyond the frequencies of order 128. If so, the search goes on to the
        highest order that samples tell.
    """
    table = sampled.table
    if table is None or sampled.fastest == 0.0:
        return NO_PEAKS
    highest = float(MOST_ORDERS)
    if crowded:
        # As many even angles as that takes, 2^24 at most.
        highest = max(highest, 2**24 / (2.0 * _ANGLES_A_CYCLE * max(sampled.turns, 1.0)))
    # None that samples do not tell.
    highest = min(highest, np.pi / sampled.fastest)
    # How far the table strays from a steady rate. The last block may be a short one, and the lags
    # then have a mean.
    lag, angle = sampled.blocks.lag - sampled.blocks.lag.mean(), sampled.blocks.angle
    rate = float(lag @ (angle - angle.mean())) / max(float(lag @ lag), 1e-300)
    # An order that strays from a tone by less than 1 rad rms is not looked for on its own scale;
    # whether a line found in time follows the table better is asked in the end.
    lowest = 1.0 / max(float(np.std(angle - rate * lag)), 1e-300)
    if lowest > highest:
        return NO_PEAKS
    power, spacing = _power_over_angle(steps, table, sampled, highest)
    # The floor changes slowly with order.
    coarse = np.geomspace(LOWEST_CYCLES / sampled.turns, highest, 400)
    level = floor_of_orders(coarse, sampled.speeds, floor)
    level = np.interp(np.arange(power.size) * spacing, coarse, level)
    standing = peaks(power, level, threshold, max(2 * LOWEST_CYCLES, int(lowest / spacing)))
    # Below order 64 nothing more is asked, since bearings and gears make orders that stand close.
    high = standing.place * spacing >= 64.0
    if np.any(high):
        alone = _stands_alone(power - level, standing.place)
        # Beside an order that is one, its skirts have to wait for it as they are.
        if not alone[np.argmax(np.where(high, standing.height, 0.0))]:
            standing = standing.select(alone | ~high)
    return replace(standing, place=standing.place * (2.0 * sampled.turns * spacing))


def _stands_alone(power: FloatArray, place: FloatArray) -> BooleanArray:
    """Whether each peak holds 0.7 of the power (above the floor) in the whole bins about it.

    A tone on a table that stops or turns unevenly makes a band of peaks where its order would be.
    An order half-way between two half bins holds 0.8; mains on tables that stop still passed with
    0.4.
    """
    at = np.rint(place).astype(np.int64)
    about = np.clip(at[:, np.newaxis] + np.arange(-20, 21, 2), 0, power.size - 1)
    return np.asarray(power[at] > 0.7 * power[about].sum(axis=1))


def _power_over_angle(
    steps: FloatArray, table: FloatArray, sampled: Sampling, highest: float
) -> tuple[FloatArray, float]:
    """Power of the increments at even orders up to `highest`, and how far apart these are.

    An increment of exp(1j k alpha) is 1j k step exp(1j k alpha): the steps' products with those
    of the table, shared out among even angles, are transformed in one. With eight angles to a
    cycle of the highest order, a millionth of the power of what lies beyond it is folded back.
    """
    scale, (low, high) = _ANGLES_A_CYCLE * highest / (2.0 * np.pi), sampled.ends
    length = scipy.fft.next_fast_len(int(2.0 * (high - low) * scale) + 4, real=True)
    grid = np.zeros(length)
    for block in blocks(steps.size):
        _kernels.spread(table[block.start : block.stop + 1], steps[block], low, scale, grid)
    sums = scipy.fft.rfft(grid, overwrite_x=True)[: int(length / _ANGLES_A_CYCLE)]
    power = np.square(sums.real) + np.square(sums.imag)
    power /= np.sinc(np.arange(power.size) / length) ** 8
    power /= sampled.samples * float(np.mean(sampled.speeds**2))
    return power, _ANGLES_A_CYCLE * highest / length


_NONE: Final[FloatArray] = np.empty(0)


def peaks(
    power: FloatArray, floor: FloatArray, threshold: float, first: int, halves: FloatArray = _NONE
) -> Peaks:
    """Where power over floor peaks above the threshold, at the top of a parabola.

    Parameters
    ----------
    power
        (half bins,) rad^2; bin k is half bin 2 k.
    floor
        (half bins,) rad^2; at the whole bins alone if `halves` are given.
    threshold
        Ratio of power to floor.
    first
        Half bin to begin with, one or more.
    halves
        Floor at the bins between: a half bin has the mean of the whole ones beside it, or that of
        the halves if it is higher.
    """
    # A peak midway between half bins shows 0.9 of its height: one below the threshold by that much
    # may be above it once refined, and is pruned there if it is not.
    least, rows = 0.9 * threshold, [np.empty((2, 0))]
    for block in blocks(power.size - 1, start=first):
        rows.append(_kernels.peaks(power, floor, halves, block.start, block.stop, least))
    place, height = np.concatenate(rows, axis=1)
    return Peaks(place=place, height=height)


# ---- crowding ----------------------------------------------------------------------

Band = tuple[float, float]

# Width of a band to begin with, octaves.
WIDTH: Final = 0.125


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
    # Three nearer than a 64th of an octave are one band; if there are more than six lines in all,
    # so are two in an eighth of an octave.
    bands = _side_by_side(drifting, 1.0 / 64.0, 3)
    if len(drifting) > 6:
        bands += _side_by_side(drifting, WIDTH, 2)
    return joined_bands(tuple(bands))


def _side_by_side(drifting: tuple[Band, ...], octaves: float, least: int) -> list[Band]:
    """From the lowest to the highest of runs of lines no farther apart than that."""
    # What wanders is seen but in part.
    margin = 2.0 ** (0.5 * octaves)
    runs: list[list[Band]] = []
    for line in sorted(drifting):
        if not runs or line[0] > max(high for _, high in runs[-1]) * 2.0**octaves:
            runs.append([])
        runs[-1].append(line)
    ends = [(run[0][0], max(high for _, high in run)) for run in runs if len(run) >= least]
    return [(low / margin, min(high * margin, 0.5)) for low, high in ends]


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
