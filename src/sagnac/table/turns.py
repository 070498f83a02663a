"""Turns of the table, angles taken once a turn, and motion over less than a few turns.

Over part of a turn orders are no basis: many sums of them make the same function of the angle, so
that a search takes one for another and goes on. The function itself is well known. All orders are
fitted to it at once, each with a prior, as many as the record asks for (Schwarz's criterion),
beside table motion and Earth rate.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac.core import arrays
from sagnac.core.arrays import BooleanArray, ComplexArray, FloatArray, IntegerArray
from sagnac.core.errors import RecordingError
from sagnac.core.units import ARCSECOND
from sagnac.recording.model import Recording
from sagnac.table import kinematics
from sagnac.table.kinematics import KINEMATIC_RATE, LARGEST_EARTH_RATE, Kinematics, harmonic_sum
from sagnac.table.whitened import Whitened, whitened

# ---- turns -------------------------------------------------------------------------

# A table that makes fewer turns than this does not tell neighbouring orders apart.
FEW_TURNS: Final = 4.0

# Seconds of a turning table below which its averages of 1 s do not say how steadily it turns.
SHORTEST: Final = 10.0

_TURN: Final = 2.0 * np.pi


def is_turning(table: FloatArray | None) -> bool:
    """Whether the table angle, (samples,) rad, moves at all."""
    if table is None:
        return False
    lowest, highest = arrays.extent(table)
    return bool(highest - lowest > np.radians(0.1))


def turns(recording: Recording) -> bool:
    """Whether a recording is of a turning table, by its encoder or by its null pulses."""
    pulse = recording.null_pulse
    of_encoder = recording.table is not None and is_turning(recording.table.values)
    return of_encoder or (pulse is not None and int(np.count_nonzero(pulse)) > 1)


def full_turns(table: FloatArray) -> float:
    """Turns between the lowest and the highest table angle, (samples,) rad."""
    lowest, highest = arrays.extent(table)
    return (highest - lowest) / _TURN


def mean_rate(table: FloatArray, sample_rate: float) -> float:
    """Mean speed of the table, rad/s, signed by its net direction if it has one.

    Parameters
    ----------
    table
        (samples,) unwrapped table angle, rad.
    sample_rate
        Hz.
    """
    net = float(table[-1] - table[0])
    # Quantization noise of the encoder would add to the path at every sample.
    coarse = arrays.every(table, max(1, round(sample_rate / KINEMATIC_RATE)))
    path = float(np.abs(np.diff(coarse)).sum()) + abs(float(table[-1] - coarse[-1]))
    sign = -1.0 if net < 0.0 and abs(net) > 0.5 * path else 1.0
    return sign * path * sample_rate / (table.size - 1)


def full_turn_times(table: FloatArray, *, null_angle: float = 0.0) -> FloatArray:
    """Fractional sample numbers at which the table passes each full turn.

    The time is interpolated linearly between the two samples beside the pass. A table that
    reverses passes the same angle again. Only passes in its net direction that open a new turn
    count, so that the turns between consecutive times are whole.

    Parameters
    ----------
    table
        (samples,) unwrapped table angle, rad.
    null_angle
        Table angle of the null pulse, rad.

    Returns
    -------
    FloatArray
        (passes,) ascending.
    """
    sign = -1.0 if table[-1] < table[0] else 1.0
    times = [np.empty(0)]
    # The furthest turn stays while the table goes back: each is passed once.
    reached = -np.inf
    for block in arrays.blocks(table.size - 1):
        turn = sign * ((table[block.start : block.stop + 1] - null_angle) / _TURN)
        furthest = np.maximum.accumulate(np.maximum(turn, reached))
        lowest = np.ceil(turn[0]) if block.start == 0 else np.floor(reached) + 1.0
        whole = np.arange(lowest, np.floor(furthest[-1]) + 1.0)
        times.append(_passed(furthest, whole, block.start))
        reached = float(furthest[-1])
    return np.concatenate(times)


def _passed(furthest: FloatArray, whole: FloatArray, start: int) -> FloatArray:
    """Fractional sample numbers at which `furthest`, from sample `start`, reaches `whole` turns."""
    after = np.maximum(np.searchsorted(furthest, whole, side="left"), 1)
    before = furthest[after - 1]
    step = furthest[after] - before
    fraction = np.where(step > 0.0, (whole - before) / np.where(step > 0.0, step, 1.0), 0.0)
    return np.asarray(start + after - 1 + np.clip(fraction, 0.0, 1.0))


def full_rotation_samples(
    angle: FloatArray, table: FloatArray | None, null_pulse: BooleanArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Full rotation interval sampling (FRIS): the angle at each full turn, Eq. 8.

    Full turns are counted from the null pulse if there is one, and otherwise from the angle at
    which the encoder reads zero. The time of each is interpolated in the encoder's angle; without
    an encoder it is taken midway between the pulse and the sample before.

    Parameters
    ----------
    angle
        (samples,) gyro angle or difference of two, rad.
    table
        (samples,) table angle, rad, or None.
    null_pulse
        (samples,) bool, true on the first sample at or after the pulse; None beside a `table`.

    Returns
    -------
    times
        (turns + 1,) fractional sample numbers, ascending.
    values
        (turns + 1,) the angle at `times`, rad.

    Raises
    ------
    RecordingError
        If the table completes fewer than two full turns.

    References
    ----------
    Eqs. 8 and 9 of Yu et al. 2013.
    """
    pulses = np.empty(0, dtype=np.int64) if null_pulse is None else np.flatnonzero(null_pulse)
    pulses = pulses[pulses > 0]
    times = pulses.astype(np.float64) - 0.5
    if table is not None:
        times = full_turn_times(table, null_angle=_null_angle(table, pulses))
    # Two full turns are three passes.
    if times.size < 3:
        covered = "" if table is None else f" (it covers {360.0 * full_turns(table):.1f} deg)"
        nothing = "full rotation interval sampling has nothing to sample"
        problem = f"the table never completes two full turns{covered}, so {nothing}"
        raise RecordingError(problem, channel="table", remedy="use {method fos}")
    first = np.minimum(times.astype(np.int64), angle.size - 2)
    fraction = times - first
    before = angle[first]
    return times, before + fraction * (angle[first + 1] - before)


def _null_angle(table: FloatArray, pulses: IntegerArray) -> float:
    """Table angle of the null pulse, rad: 0 if no sample of `pulses` has one."""
    if pulses.size == 0:
        return 0.0
    # It lies somewhere in the step before; the mean over the turns is finer than a step.
    return float(np.angle(np.exp(0.5j * (table[pulses] + table[pulses - 1])).sum()))


# ---- part turn ---------------------------------------------------------------------

# Numbers of orders that are tried.
_ORDERS: Final = (4, 8, 16, 32, 64, 128)
# The most averages, those of some hours.
_MOST: Final = 2**17
# Orders that the averages of a fast table show, and the most averages that are made for that. With
# these, twenty sweeps of 0.4 to 2 turns took 2 s each, and 18 left no order as lines in time.
_SHOWN: Final = 64
_MOST_FAST: Final = 2**15


@dataclass(frozen=True, slots=True, kw_only=True)
class AngleFunction:
    """A function of the table angle, as a sum of orders that mean nothing one by one.

    Attributes
    ----------
    orders, phasor
        (orders,) and ``cosine + 1j * sine`` of each, rad.
    taken
        (3, orders) noise that went with it: frequency and bandwidth, Hz, and one-sided rate
        density, (rad/s)^2/Hz.
    masked
        (low, high) bands in Hz of which it took a tenth of the noise or more.
    """

    orders: FloatArray
    phasor: ComplexArray
    taken: FloatArray
    masked: tuple[tuple[float, float], ...]

    def less(self, angle: FloatArray, table: FloatArray) -> FloatArray:
        """(samples,) an angle without the function, rad: a new array."""
        return arrays.elementwise(
            lambda own, at: own - harmonic_sum(at, self.orders, self.phasor), angle, table
        )


def function_of_angle(
    angle: FloatArray,
    kinematic: Kinematics,
    tones: Sequence[float] | FloatArray = (),
    before: AngleFunction | None = None,
) -> AngleFunction | None:
    """Part of a gyro angle that goes with the table angle over part of a turn, or a few.

    Parameters
    ----------
    angle
        (samples,) of a gyro or of a difference, rad.
    kinematic
        Of that table.
    tones
        (tones,) Hz, of tones in the angle. They are fitted with the function, which would take a
        part of each.
    before
        The function that was found with fewer tones: the new one has orders in the same steps.

    Returns
    -------
    AngleFunction or None
        None if nothing goes with the angle.
    """
    # At a rate that varies by less than a tenth an order that is not whole is a line in time.
    is_steady = kinematics.rate_variation(kinematic) <= 0.1
    kinematic = _with_faster_averages(kinematic)
    highest = math.floor(kinematics.highest_harmonic(kinematic))
    # Hz of order 1, the highest being 0.4 of the averages' rate.
    first = 0.4 / (max(highest, 1) * kinematic.interval)
    # A slow table shows every order that is tried in fewer averages.
    times = max(1, min(highest // (2 * _ORDERS[-1]), kinematic.angle.size // 10_000))
    known = (kinematic.angle, kinematic.cosine, kinematic.sine)
    slow = np.stack([kinematics.averaged(each, times)[:_MOST] for each in known])
    kinematic = replace(kinematic, block=times * kinematic.block, angle=slow[0])
    shown = kinematics.averages_of(angle, kinematic.block)[:_MOST]
    # Fewer averages tell nothing.
    if shown.size < 100:
        return None
    cycles = np.array(tones) * kinematic.interval
    cycles = cycles[cycles < 0.5, np.newaxis]
    waves = np.exp(2j * np.pi * cycles * np.arange(shown.size))
    slow = np.concatenate([slow, waves.real, waves.imag])
    free = np.full(len(slow), np.inf)
    free[1:3] = LARGEST_EARTH_RATE
    plain = shown - whitened(shown, slow.copy(), free, groups=0).values @ slow
    time = np.arange(shown.size, dtype=np.float64)
    line = np.polynomial.Polynomial.fit(time, plain, 1)(time)
    # The standard deviation of an order's prior.
    size = max(30.0 * ARCSECOND, float(np.std(plain - line)))

    # The farther the table turns in an average, the lower is the average of an order.
    turned = np.abs(np.gradient(kinematic.angle)) / (2.0 * np.pi)

    def fit_of(case: _Case, noises: tuple[float, float] | None) -> Whitened:
        terms = _terms(*case)[:, np.newaxis]
        phases, gain = terms * kinematic.angle, np.sinc(terms * turned)
        columns = np.concatenate([slow, gain * np.cos(phases), gain * np.sin(phases)])
        prior = np.concatenate([free, np.full(2 * case[0], size)])
        return whitened(shown, columns, prior, noises, groups=0, crowded=True)

    counts = dict.fromkeys(min(count, highest, shown.size // 20) for count in (0, *_ORDERS))
    # An order that is not whole has another phase in every turn, so that over a few it takes a
    # function of all the angle that they cover.
    covered = math.ceil(full_turns(kinematic.angle) + 0.5)
    parts = (1,) if is_steady else (1, covered)
    parts = parts if before is None else (round(1.0 / before.orders[0]),)
    # Ordinates of one order, real and imaginary.
    ordinates = 2.0 * first * shown.size * kinematic.interval
    case, fit = _chosen(fit_of, [(count, part) for part in parts for count in counts], ordinates)
    if case[0] == 0:
        return None
    orders = _terms(*case)
    # The first are of table angle, Earth rate and tones.
    values = fit.values[free.size :].reshape(2, -1)
    freedom = fit.freedom - 2.0 * cycles.size
    # A coefficient takes the noise of one of two parts of an ordinate.
    reached, width = first * orders, first * freedom / (ordinates * orders.size)
    density = 2.0 * fit.walk / kinematic.interval
    much_taken = freedom > 0.1 * ordinates * orders[-1]
    taken = np.stack([reached, np.full(orders.size, width), np.full(orders.size, density)])
    masked = ((0.0, float(reached[-1]) + first),) if much_taken else ()
    phasor = values[0] + 1j * values[1]
    return AngleFunction(orders=orders, phasor=phasor, taken=taken, masked=masked)


# How many orders, and into how many steps one is parted.
_Case = tuple[int, int]


def _chosen(
    fit_of: Callable[[_Case, tuple[float, float] | None], Whitened],
    cases: Sequence[_Case],
    ordinates: float,
) -> tuple[_Case, Whitened]:
    """The best case by Schwarz's criterion, and its fit; `ordinates` are those of one order."""
    most = max(count for count, _ in cases)
    # All are judged beside the noise that the largest leaves: what is left of lines is no noise.
    largest = [fit_of(case, None) for case in cases if case[0] == most]
    quietest = min(largest, key=lambda fit: fit.deviance)
    fits = {case: fit_of(case, (quietest.readings, quietest.walk)) for case in cases}
    # Schwarz's sample is of ordinates that all reach.
    weight = math.log(max(ordinates * most, math.e))
    best = min(cases, key=lambda case: fits[case].deviance + weight * fits[case].freedom)
    return best, fits[best]


def _with_faster_averages(kinematic: Kinematics) -> Kinematics:
    """Kinematics whose averages can show `_SHOWN` orders, unless that takes too many of them."""
    usual, reach = 1.0 / kinematic.interval, kinematics.highest_harmonic(kinematic)
    most = _MOST_FAST * kinematic.sample_rate / kinematic.table.size
    enough = 20.0 * _SHOWN * kinematic.sample_rate / kinematic.table.size
    rate = min(max(usual * _SHOWN / reach, enough), most)
    if rate <= usual:
        return kinematic
    # An average takes a whole number of samples. Rounded down, it shows no fewer orders.
    rate = kinematic.sample_rate / max(1, math.floor(kinematic.sample_rate / rate))
    return kinematics.kinematics(kinematic.table, kinematic.sample_rate, rate=rate)


def _terms(count: int, parts: int) -> FloatArray:
    """(count,) orders in steps of a part of one."""
    return np.arange(1.0, count + 1.0) / parts
