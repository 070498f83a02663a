"""Faults of an encoder: lost rows, slips, a turn that is not full, gyros that do not turn along."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from sagnac.core.arrays import FloatArray, IntegerArray, blocks, empty, less, some_steps, values_at
from sagnac.core.errors import Level, Note, RecordingError, counted
from sagnac.core.marks import marked, marked_steps
from sagnac.core.units import ARCSECOND, DEGREE, split_factor
from sagnac.quality.distribution import LEAST_FOR_SPIKES, find_spikes, jump_notes
from sagnac.quality.effects import remedy_without, seen
from sagnac.quality.profile import Notes, Profile, other_units, scatter_of, turned
from sagnac.recording.channel import Channel, angle_of
from sagnac.recording.model import Recording, second_of

# ---- lost rows and slips -----------------------------------------------------------

# Steps before and behind a leap that tell the usual one.
_SIDE: Final = 2


def without_lost_rows(recording: Recording, gyros: Sequence[Channel]) -> tuple[Recording, Notes]:
    """A recording without what its channels of angle turned in rows that are not in the file.

    Where k rows are lost, the encoder's step is k steps longer than those around it, and so is that
    of every gyro of kind ``angle`` that is steady enough to tell.

    Parameters
    ----------
    recording
        Of a table that turns on, or none.
    gyros
        That are looked at.

    Returns
    -------
    recording
        Its times are left as they are.
    notes
        A warning, if any rows were lost.
    """
    table = recording.table
    if table is None or not turned(table) or table.values.size < 4 * _SIDE:
        return recording, ()
    places = _leaps(table.values)
    usual, beyond, uneven = _steps_around(table.values, places)
    rows = np.rint(_ratio(beyond, usual))
    kept = (rows >= 1.0) & (uneven < 0.3 * np.abs(usual))
    for channel in (table, *gyros):
        if channel.kind == "angle" and kept.any():
            usual, beyond, _ = _steps_around(channel.values, places)
            # The scatter is zero if the table stands, or turns by whole steps of its readout. The
            # difference of two rounded readings is off by 0.4 steps (sqrt(1/6)).
            step = Profile(channel=channel, sample_rate=recording.sample_rate).step
            least, part = _scatter(channel.values, float(np.abs(usual[kept]).min()))
            tells = (np.abs(usual) > 8.0 * max(least, 0.4 * step)) & (part < 0.125)
            is_met = np.abs(_ratio(beyond, usual) - rows) < 0.15 + 0.01 * rows
            kept &= np.where(tells, is_met, channel is not table)
    places, rows = places[kept], rows[kept]
    if not places.size:
        return recording, ()

    def closed(channel: Channel) -> Channel:
        if channel.kind != "angle":
            return channel
        # What is left is the step that is usual there: how the rate changed meanwhile is not known.
        moved = np.append(0.0, np.cumsum(_steps_around(channel.values, places)[1]))
        values = less(channel.values, lambda number: moved[np.searchsorted(places, number)])
        return replace(channel, values=values)

    fact = f"{counted(int(rows.sum()), 'row')} of the file lost at {counted(places.size, 'place')}"
    fact += f", the first at {second_of(recording, int(places[0])):.3f} s"
    why = "where channels of angle leap by whole steps: lines in time break there"
    text = f"{fact}, {why}; {remedy_without(recording, places + 1)}"
    whole = replace(recording, gyros=tuple(map(closed, recording.gyros)), table=closed(table))
    return whole, (Note(name="lost", level="warning", channel="table", text=text),)


def _leaps(values: FloatArray) -> IntegerArray:
    """Samples before steps that are longer than those around them by 0.6 of these or more."""
    steps = values.size - 2 * _SIDE - 1
    four = (values[n : n + steps] for n in (0, _SIDE, _SIDE + 1, 2 * _SIDE + 1))

    def is_leap(first: FloatArray, here: FloatArray, behind: FloatArray, last: FloatArray) -> Any:
        return np.abs(behind - here) > 0.4 * np.abs(here - first + last - behind)

    return np.flatnonzero(marked(is_leap, *four)) + _SIDE


def _steps_around(values: FloatArray, places: IntegerArray) -> tuple[FloatArray, ...]:
    """(places,) usual step around places, by how much the step there is longer, and how uneven."""
    at = places[:, np.newaxis] + np.array([-_SIDE, 0, 1, 1 + _SIDE])
    first, before, behind, last = values_at(values, at).T
    usual = 0.5 * (before - first + last - behind) / _SIDE
    return usual, behind - before - usual, np.abs(before - first - last + behind) / _SIDE


def _ratio(beyond: FloatArray, usual: FloatArray) -> FloatArray:
    return beyond / np.where(usual == 0.0, np.inf, usual)


def _scatter(values: FloatArray, slowest: float) -> tuple[float, float]:
    """Scatter of steps about those around them, without what is far off, and as a part of these.

    A latch that is off by some time scatters the more the faster a table turns: the part is that of
    steps half as long as the `slowest` or longer.
    """
    last = values.size - 2 - _SIDE
    places = np.linspace(_SIDE, last, min(20_000, last)).astype(np.int64)
    usual, beyond, _ = _steps_around(values, places)
    turning = np.abs(usual) > 0.5 * slowest
    # A table that is so fast in few places has none among these: it is taken to have no jitter.
    parts = np.append(beyond[turning] / usual[turning], 0.0)
    return scatter_of(beyond), scatter_of(parts)


def slip_notes(recording: Recording, profile: Profile) -> Notes:
    """Jumps of the encoder that the gyro which senses it most does not make: a warning.

    At rest, or if no gyro senses the table, jumps far beyond the usual step count.
    """
    table = profile.table
    if table is None:
        return ()
    values, gyros = table.channel.values, profile.together.values()
    known = [one for one in gyros if abs(one.share) > LEAST_SHARE]
    if profile.standing or (values.size > LEAST_FOR_SPIKES and not known):
        return jump_notes(recording, table)
    if values.size <= LEAST_FOR_SPIKES:
        return ()
    gyro = max(known, key=lambda one: abs(one.share))
    angle = angle_of(gyro.channel, recording.sample_rate)
    steps = empty(angle.size - 1)
    for block in blocks(steps.size):
        part = slice(block.start, block.stop + 1)
        steps[block] = np.diff(values[part]) - np.diff(angle[part]) / gyro.share
    slips = find_spikes(steps, sample_rate=1.0)
    inside = (slips.index >= _SIDE) & (slips.index < values.size - 1 - _SIDE)
    # Less is that of a sound encoder, or the count that a coarse one is off by at times; and the
    # encoder itself leaps by about as much.
    far = (np.abs(slips.height) > max(10.0 * ARCSECOND, 1.5 * table.step)) & inside
    places, height = slips.index[far], slips.height[far]
    itself = np.abs(_steps_around(values, places)[1] - height) < 0.3 * np.abs(height)
    places, height = places[itself] + 1, height[itself]
    if not places.size:
        return ()
    alone = f"that gyro {gyro.name} does not make, by up to {np.abs(height).max() / DEGREE:.3g} deg"
    problem = f"{seen(recording, places, 'jump', alone)}; a pair of gyros is free of them"
    text = f"{problem}; {remedy_without(recording, places)}"
    return (Note(name="steps", level="warning", channel="table", text=text),)


# ---- encoder mismatch --------------------------------------------------------------

# A gyro senses at most the whole of the table's rate; a tenth is left for its scale factor. From
# the second share on it senses the table.
LARGEST_SHARE: Final = 1.1
_SENSES: Final = 0.2
# From this share on the gyro tells a jump of the encoder, for it moves by less than half of that
# within this many samples around: no table leaves its gyros behind, but the two may be sampled some
# samples apart.
LEAST_SHARE: Final = 0.05
_REACH: Final = 2
# A gyro is said to turn above this rate: more than the bias of any gyro on a rate table, except
# a MEMS gyro as it comes from the factory.
TURNING_RATE: Final = 2.0 * DEGREE


def require_encoder_follows(recording: Recording, gyro: Channel) -> None:
    """Refuse an encoder whose motion is not the gyro's: see `follow_notes`.

    Raises
    ------
    RecordingError
        If the two do not belong together.
    """
    for note in follow_notes(recording, Profile.of(recording, gyro)):
        raise RecordingError.of(note, recording.path)


def follow_notes(recording: Recording, profile: Profile) -> Notes:
    """An encoder whose motion is not the gyro's: an error.

    The record is cut into blocks of at least 1 s and the share of the table rate that the
    gyro senses is taken as the median over the blocks in which the table turns. A block
    disagrees when gyro rate minus share times table rate exceeds the larger of 2 deg/s and
    a fifth of the rate sensed at the table's usual rate. One block in a hundred may (a
    start, a stop, a stamp that came late); more is an error. A gyro across the axis,
    whose share is about zero, therefore follows any encoder as long as it does not turn
    itself, and turning below 2 deg/s decides nothing. A share beyond 1.1 is an error too:
    no gyro turns faster than its table.
    """
    table, name = profile.table, profile.name
    if table is None:
        return ()
    share = 0.0 if math.isnan(profile.share) else profile.share
    limit = max(TURNING_RATE, 0.2 * abs(share) * table.usual_rate)
    disagree = np.flatnonzero(np.abs(profile.rates - share * table.rates) > limit)
    if disagree.size > max(2.0, 0.01 * profile.rates.size):
        first = disagree[0]
        part = f"{100.0 * disagree.size / profile.rates.size:.0f} % of the record"
        when = f"first at {second_of(recording, int(profile.edges[first])):.1f} s"
        gyro, encoder = (f"{one.rates[first] / DEGREE:.3g} deg/s" for one in (profile, table))
        problem = f"the encoder does not follow gyro {name} in {part}, {when}"
        remedy = "name the right column and unit with {table}, or take a sound stretch with {slice}"
        text = f"{problem} (gyro {gyro}, encoder {encoder}); {remedy}"
        return (Note(name="encoder", level="error", channel="table", text=text),)
    if abs(share) > LARGEST_SHARE:
        remedy = _likely_unit(profile) or "state {unit} and {kind}"
        remedy += ", or the table's with {table COLUMN:UNIT}"
        text = f"turns {share:.3g} times as fast as the table: a unit or kind is wrong; {remedy}"
        return (Note(name="encoder", level="error", channel=name, text=text),)
    if abs(share) < LEAST_SHARE:
        return ()
    jumps = jumps_of_encoder(table.channel.values)
    sizes = table.channel.values[jumps + 1] - table.channel.values[jumps]
    around = turned_around(profile, jumps)
    alone = np.abs(around) < 0.5 * np.abs(share * sizes)
    if not alone.any():
        return ()
    at = jumps[alone] + 1
    # Less what the table turned in that sample, as the gyro shows it beside.
    sizes -= around / (share * (2 * _REACH + 1))
    first = f"{sizes[alone][0] / DEGREE:.3g} deg at {second_of(recording, int(at[0])):.3f} s"
    problem = f"{counted(at.size, 'jump')} that gyro {name} does not make, the first by {first}"
    text = f"{problem}; {remedy_without(recording, at)}"
    return (Note(name="encoder", level="error", channel="table", text=text),)


def jumps_of_encoder(angle: FloatArray) -> IntegerArray:
    """Samples before steps of a degree or more that are ten times the usual ones.

    A count of a coarse encoder is none.
    """
    steps = np.abs(some_steps(angle, 100_000))
    count = 1.5 * float(steps[steps > 0.0].min(initial=math.pi))
    limit = max(DEGREE, count, 10.0 * float(np.quantile(steps, 0.99)))
    return np.flatnonzero(marked_steps(angle, lambda steps: np.abs(steps) > limit)) - 1


def turned_around(profile: Profile, steps: IntegerArray) -> FloatArray:
    """Angle that a gyro turns from two samples before each step to as many behind, rad."""
    angle = angle_of(profile.channel, profile.sample_rate)
    # Step n leads from sample n to the next.
    last = np.minimum(steps + 1 + _REACH, angle.size - 1)
    return angle[last] - angle[np.maximum(steps - _REACH, 0)]


def table_notes(recording: Recording, profile: Profile) -> Notes:
    """How a gyro and the encoder go together."""
    if profile.table is None:
        return ()
    if wrong := follow_notes(recording, profile):
        return wrong
    if math.isnan(profile.share):
        return (Note(channel="table", text="the table does not turn"),)
    text = f"senses {profile.share:.4f} of the table rate"
    return across_notes(recording, profile) or (Note(channel=profile.name, text=text),)


def across_notes(recording: Recording, profile: Profile) -> Notes:
    """A gyro that senses next to nothing of a table that turns: a warning.

    It names the gyro that does, or the unit in which this one would. If no gyro senses the table,
    and in one other unit all of them would, that is an error: what is read is in the wrong unit.
    """
    table, share = profile.table, profile.share
    # Below this a gyro is mounted across the axis, or a unit is wrong: a degree called a radian
    # leaves 0.017 of the whole.
    if table is None or profile.standing or abs(share) >= 0.02 or table.usual_rate <= TURNING_RATE:
        return ()
    gyros = profile.each(recording)
    best = max(gyros, key=lambda one: abs(one.share))
    in_degrees, unit = share / DEGREE, split_factor(table.channel.shown_in)[1]
    level: Level = "warning"
    text = f"senses {100.0 * share:.2g} % of the table rate"
    across = f"{text}: it is mounted across the axis"
    if abs(best.share) > _SENSES:
        other = f"gyro {best.name} senses {100.0 * best.share:.3g} %"
        text = f"{across}, while {other}: name that ({{gyros}})"
    elif unit == "rad" and _SENSES < abs(in_degrees) < LARGEST_SHARE:
        sensed = f"would sense {100.0 * in_degrees:.3g} % of it if the encoder were in degrees"
        text = f"{text}, and {sensed}: state {{table COLUMN:deg}}"
    elif all(_likely_unit(one) for one in gyros):
        level = "error"
        text = f"{text}: {_likely_unit(profile)}"
    else:
        text = f"{across}, or a unit or kind is wrong ({{unit}}, {{kind}}, {{table COLUMN:UNIT}})"
    return (Note(name="encoder", level=level, channel=profile.name, text=text),)


def _likely_unit(profile: Profile) -> str:
    """The unit, kind or unit of time in which a gyro would sense the table; empty if none is."""
    units = other_units(profile.channel).items()
    candidates = [(times, unit, f"{{unit {unit}}}") for unit, times in units]
    also = ""
    if profile.channel.kind == "rate":
        # The table's rate has the unit of time, and that of the gyro has its own.
        of_time = "a unit of time a thousand times"
        candidates.append((1e-3, f"{of_time} larger", "{time COLUMN:UNIT}"))
        candidates.append((1e3, f"{of_time} smaller", "{time COLUMN:UNIT}"))
        counted = profile.share * profile.sample_rate
        if _SENSES < abs(counted) < LARGEST_SHARE:
            also = f", or {{kind increment}}, as which it would sense {100.0 * counted:.3g} %"
    for times, where, statement in candidates:
        if _SENSES < abs(profile.share * times) < LARGEST_SHARE:
            sensed = 100.0 * profile.share * times
            return f"in {where} it would sense {sensed:.3g} %; state {statement}{also}"
    return ""


# ---- encoder turn ------------------------------------------------------------------

# Samples before and behind a start over that the excess is taken over, as many steps on either side
# that tell the rate, and all of these.
_STEPS: Final = 2 * _REACH + 1
_OUTER: Final = _REACH + _STEPS + 1


def turn_notes(recording: Recording, profile: Profile) -> Notes:
    """An encoder whose angle leaps each time its readings start over: a warning.

    Its turn is not 360 degrees in the unit that is stated, or its scale does not close. The leap
    stands once in every turn. A pair of gyros is free of it, and one gyro alone has it as its own.
    What the gyro that senses the table most turns there is no leap: a table that steps from
    position to position speeds up or brakes at the same angle in every turn.
    """
    table, turn = profile.table, 2.0 * math.pi
    if table is None or profile.standing:
        return ()
    gyros, angle = profile.together.values(), table.channel.values
    beside = max(gyros, key=lambda one: abs(one.share))
    # The places lie where a reading steps: the samples around may hold one step more than others.
    least = max(10.0 * ARCSECOND, 1.25 * table.step)
    gyro = angle_of(beside.channel, recording.sample_rate)
    # The share of a gyro across the axis is noise.
    part = 1.0 / beside.share if abs(beside.share) > LEAST_SHARE else 0.0

    def excess(at: IntegerArray) -> tuple[FloatArray, FloatArray]:
        """That of the encoder, and of the encoder less the gyro."""
        leap, forwards = _excess(angle, at)
        return leap * forwards, (leap - part * _excess(gyro, at)[0]) * forwards

    ends = angle[:-1], angle[1:]
    halves = marked(lambda one, two: np.floor(one / math.pi) != np.floor(two / math.pi), *ends)
    passes = np.flatnonzero(halves[_OUTER:-_OUTER]) + _OUTER
    # Whole turns are passed at even numbers of half turns.
    around = values_at(angle, np.stack([passes, passes + 1], axis=1))
    number = np.floor(around.max(axis=1) / math.pi)
    for start in (0.0, 1.0):
        at = passes[number % 2.0 == start]
        if at.size < 4:
            continue
        at = at[:: max(1, at.size // 4001)]
        # Other places tell the scatter.
        other = np.linspace(_OUTER, angle.size - 1 - _OUTER, 4001).astype(np.int64)
        # The encoder makes a leap of its own, and the gyro does not. Where a table turns back, an
        # encoder that is read late differs from the gyro without a leap.
        alone, leap = (_leap(*each, least) for each in zip(excess(at), excess(other), strict=True))
        if alone * leap <= 0.0:
            continue
        factor, unit = split_factor(table.channel.shown_in)
        right = f"{factor * turn / (turn - leap):.8g}{unit}"
        where = "short of" if leap > 0.0 else "beyond"
        over = f"{abs(leap) / DEGREE:.3g} deg {where} a full turn, {counted(at.size, 'time')}"
        remedy = f"if that is one turn, state {{table COLUMN:{right}}}"
        text = f"its readings start over {over}: {remedy}"
        text += "; a pair of gyros is free of it, and one alone has only an upper bound"
        return (Note(name="encoder", level="warning", channel="table", text=text),)
    return ()


def _leap(leaps: FloatArray, usual: FloatArray, least: float) -> float:
    """Median leap, rad, beside what is usual elsewhere; 0 if a sound encoder may show it.

    Parameters
    ----------
    leaps, usual
        (places,) rad, where the readings start over, and elsewhere.
    least
        That an encoder whose scale closes does not make, rad.
    """
    leap = float(np.median(leaps))
    scatter = scatter_of(usual - np.median(usual))
    # What is the same in every turn, a ripple of the motor, scatters elsewhere and not here.
    here = scatter_of(leaps - leap) ** 2 * (1.0 + 4.0 / math.sqrt(leaps.size))
    ripple = math.sqrt(max(scatter**2 - here, 0.0))
    # Less is that of a sound encoder where its scale closes, or chance: a normal median is 1.2533
    # times as wide as the mean.
    chance = 8.0 * 1.2533 * scatter / math.sqrt(leaps.size)
    # No peak of a ripple exceeds four deviations: one of a single order is 1.4 times as high.
    return leap if abs(leap) >= max(least, chance, 4.0 * ripple) else 0.0


def _excess(angle: FloatArray, at: IntegerArray) -> tuple[FloatArray, FloatArray]:
    """By how much an angle goes on at places beyond what it does around them, and its direction."""
    edges = np.array([-_REACH - _STEPS, -_REACH, 1 + _REACH, 1 + _REACH + _STEPS])
    before, inside, behind = np.diff(values_at(angle, at[:, np.newaxis] + edges)).T
    return inside - 0.5 * (before + behind), np.sign(before + behind)
