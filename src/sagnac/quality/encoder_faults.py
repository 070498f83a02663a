"""Faults of an encoder: single steps, a turn that is not full, gyros that do not turn along."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagnac.core.arrays import BLOCK, FloatArray, IntegerArray, blocks, values_at
from sagnac.core.errors import Level, Note, RecordingError, counted
from sagnac.core.units import ARCSECOND, DEGREE, UNITS, split_factor
from sagnac.quality.profile import remedy_of, scatter_of, some_steps
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording, second_of
from sagnac.recording.stamps import Places, longest_between

# ---- jumps -------------------------------------------------------------------------

# Steps that tell what is usual.
_LOOKED_AT: Final = 20_000
# Jumps from which on they may be steps of a readout, how large these may be, and how near to a
# whole number of steps.
_OFTEN: Final = 3
_COARSEST: Final = 0.1 * DEGREE
_WHOLE: Final = 0.05


def jump_notes(recording: Recording, channel: Channel) -> tuple[Note, ...]:
    """Steps of over 20 times the 99 % quantile, which is 50 sigma of noise: a warning.

    Small ones that are all whole numbers of the smallest are no jumps: a motion that is all but
    steady meets the steps of a readout so.
    """
    values = channel.values
    steps = some_steps(values, _LOOKED_AT)
    middle = float(np.median(steps))
    limit = 20.0 * float(np.quantile(np.abs(steps - middle), 0.99))
    if limit <= 0.0:
        return ()
    jumps = Places(
        values=values, test=lambda some: np.abs(np.diff(some) - middle) > limit, following=1
    )
    found = jumps.tally()
    if found.count == 0 or (found.count >= _OFTEN and _of_readout(values, jumps.all(), middle)):
        return ()
    text = (
        f"{counted(found.count, 'jump')} of over 20 times the usual step, the first at "
        f"{second_of(recording, found.first + 1):.3f} s; "
        f"{remedy_of(recording, jumps.longest_between(recording.samples, later=1))}"
    )
    return (Note(name="steps", level="warning", channel=channel.name, text=text),)


def _of_readout(values: FloatArray, places: IntegerArray, middle: float) -> bool:
    """Whether all jumps are whole numbers of one small step."""
    sizes = np.abs(values[places + 1] - values[places] - middle)
    step = float(sizes.min())
    parts = sizes / step
    return bool(sizes.max() < _COARSEST and np.all(np.abs(parts - np.rint(parts)) < _WHOLE))


# ---- encoder mismatch --------------------------------------------------------------

# A gyro senses at most the whole of the table's rate; a tenth is left for its scale factor.
LARGEST_SHARE: Final = 1.1
# An encoder jumps if it moves by this much from one sample to the next, this many times as far as
# it usually does, and the gyro moves less than half of that within this many samples around: no
# table leaves its gyros behind, but the two may be sampled some samples apart.
LEAST_JUMP: Final = 1.0 * DEGREE
JUMP_RATIO: Final = 10.0
JUMP_REACH: Final = 2
LEAST_SHARE: Final = 0.05
# Below this share a gyro is mounted across the axis, or a unit is wrong: a degree called a radian
# leaves 0.017 of the whole. From the other on it senses the table.
LEAST_SENSED: Final = 0.02
_SENSES: Final = 0.2
# Units that are taken for one another.
_UNITS_OF_RATE: Final = ("deg/s", "rad/s", "deg/h")
_UNITS_OF_ANGLE: Final = ("arcsec", "deg", "rad")
# A gyro is said to turn above this rate: more than the bias of any gyro on a rate table, except
# a MEMS gyro as it comes from the factory.
TURNING_RATE: Final = 2.0 * DEGREE


def require_encoder_follows(recording: Recording, gyro: Channel) -> None:
    """Refuse an encoder whose motion is not the gyro's.

    The record is cut into blocks of at least 1 s and the share of the table rate that the
    gyro senses is taken as the median over the blocks in which the table turns. A block
    disagrees when gyro rate minus share times table rate exceeds the larger of 2 deg/s and
    a fifth of the rate sensed at the table's usual rate. One block in a hundred may (a
    start, a stop, a stamp that came late); more is an error. A gyro across the axis,
    whose share is about zero, therefore follows any encoder as long as it does not turn
    itself, and turning below 2 deg/s decides nothing. A share beyond 1.1 is an error too:
    no gyro turns faster than its table.

    Raises
    ------
    RecordingError
        If the two do not belong together.
    """
    wrong = _encoder_error(recording, gyro)
    if wrong is not None:
        raise RecordingError.of(wrong, recording.path)


def _block_angles(channel: Channel, sample_rate: float, edges: NDArray[np.intp]) -> FloatArray:
    """Angle turned from each edge to the next, rad, shape (edges - 1,)."""
    values, number = channel.values, edges.size - 1
    turned = np.empty(number)
    # As many stretches at a time as a block of samples holds.
    for some in blocks(number, max(1, BLOCK * number // int(edges[-1]))):
        inside = edges[some.start : some.stop + 1]
        if channel.kind == "angle":
            turned[some] = np.diff(values[inside])
            continue
        # reduceat runs its last sum to the end of what it is given: the last edge included.
        steps = values[inside[0] + 1 : inside[-1] + 1]
        turned[some] = np.add.reduceat(steps, inside[:-1] - inside[0])
    return turned / sample_rate if channel.kind == "rate" else turned


def block_rates(recording: Recording, channel: Channel) -> tuple[FloatArray, NDArray[np.intp]]:
    """Mean rate over blocks of about a second, rad/s, and the samples they start at."""
    samples = recording.samples
    second = max(1, round(recording.sample_rate))
    blocks = min(max(min(samples // second, 4096), 20), samples - 1)
    edges = np.linspace(0, samples - 1, blocks + 1).astype(np.intp)
    seconds = np.diff(edges) / recording.sample_rate
    return _block_angles(channel, recording.sample_rate, edges) / seconds, edges[:-1]


def _share(gyro_rate: FloatArray, table_rate: FloatArray) -> float:
    """Share of the table rate that the gyro senses; NaN if the table does not turn."""
    usual = float(np.percentile(np.abs(table_rate), 90.0))
    turning = np.abs(table_rate) > max(0.2 * usual, 0.05 * DEGREE)
    if not turning.any():
        return math.nan
    return float(np.median(gyro_rate[turning] / table_rate[turning]))


def table_share(recording: Recording, gyro: Channel) -> float:
    """Share of the table rate that a gyro senses; NaN if nothing turns."""
    if recording.table is None:
        return math.nan
    return _share(block_rates(recording, gyro)[0], block_rates(recording, recording.table)[0])


def _encoder_error(recording: Recording, gyro: Channel) -> Note | None:
    """Why the encoder and a gyro do not belong together, if they do not."""
    if recording.table is None:
        return None
    gyro_rate, starts = block_rates(recording, gyro)
    table_rate, _ = block_rates(recording, recording.table)
    share = _share(gyro_rate, table_rate)
    usual = float(np.percentile(np.abs(table_rate), 90.0))
    if math.isnan(share):
        share = 0.0
    limit = max(TURNING_RATE, 0.2 * abs(share) * usual)
    disagree = np.flatnonzero(np.abs(gyro_rate - share * table_rate) > limit)
    if disagree.size > max(2.0, 0.01 * gyro_rate.size):
        first = disagree[0]
        at = second_of(recording, int(starts[first]))
        text = (
            f"the encoder does not follow gyro {gyro.name} in "
            f"{100.0 * disagree.size / gyro_rate.size:.0f} % of the record, first at {at:.1f} s "
            f"(gyro {gyro_rate[first] / DEGREE:.3g} deg/s, encoder "
            f"{table_rate[first] / DEGREE:.3g} deg/s); name the right column and unit with "
            "{table}, or take a sound stretch with {slice}"
        )
        return Note(name="encoder", level="error", channel="table", text=text)
    if abs(share) > LARGEST_SHARE:
        likely = _likely_unit(gyro, share, recording.sample_rate)
        right = f"; {likely}" if likely else "; state {unit} and {kind}"
        text = (
            f"turns {share:.3g} times as fast as the table: a unit or kind is wrong{right}, or the "
            "table's with {table COLUMN:UNIT}"
        )
        return Note(name="encoder", level="error", channel=gyro.name, text=text)
    return _unfollowed_jump(recording, recording.table, gyro, share)


def _unfollowed_jump(
    recording: Recording, table: Channel, gyro: Channel, share: float
) -> Note | None:
    """A jump of the encoder that the gyro does not make; None if it senses too little."""
    if abs(share) < LEAST_SHARE:
        return None
    jumps = jumps_of_encoder(table.values)
    if jumps.size == 0:
        return None
    jump = table.values[jumps + 1] - table.values[jumps]
    turned = turned_around(gyro, recording.sample_rate, jumps)
    alone = np.flatnonzero(np.abs(turned) < 0.5 * np.abs(share * jump))
    if alone.size == 0:
        return None
    at = jumps[alone]
    text = (
        f"{counted(alone.size, 'jump')} that gyro {gyro.name} does not make, the first by "
        f"{jump[alone[0]] / DEGREE:.3g} deg at {second_of(recording, int(at[0]) + 1):.3f} s; "
        f"{remedy_of(recording, longest_between(recording.samples, at + 1))}"
    )
    return Note(name="encoder", level="error", channel="table", text=text)


def jumps_of_encoder(angle: FloatArray) -> IntegerArray:
    """Samples before steps of `LEAST_JUMP` that are `JUMP_RATIO` times the usual ones."""
    steps = np.abs(some_steps(angle, 100_000))
    limit = max(LEAST_JUMP, JUMP_RATIO * float(np.quantile(steps, 0.99)))
    return Places(values=angle, test=lambda some: np.abs(np.diff(some)) > limit, following=1).all()


def turned_around(gyro: Channel, sample_rate: float, steps: IntegerArray) -> FloatArray:
    """Angle that a gyro turns from `JUMP_REACH` samples before each step to as many behind, rad."""
    values = gyro.values
    # Step n leads from sample n to the next.
    first = np.maximum(steps - JUMP_REACH, 0)
    last = np.minimum(steps + 1 + JUMP_REACH, values.size - 1)
    if gyro.kind == "angle":
        return values[last] - values[first]
    turned = np.zeros(steps.size)
    for number in range(1, 2 * JUMP_REACH + 2):
        some = first + number
        turned = turned + values[np.minimum(some, last)] * (some <= last)
    return turned / (sample_rate if gyro.kind == "rate" else 1.0)


def table_notes(recording: Recording, gyro: Channel) -> tuple[Note, ...]:
    """How a gyro and the encoder go together."""
    if recording.table is None:
        return ()
    wrong = _encoder_error(recording, gyro)
    if wrong is not None:
        return (wrong,)
    share = table_share(recording, gyro)
    if math.isnan(share):
        return (Note(channel="table", text="the table does not turn"),)
    return across_notes(recording, gyro) or (
        Note(channel=gyro.name, text=f"senses {share:.4f} of the table rate"),
    )


def across_notes(recording: Recording, gyro: Channel) -> tuple[Note, ...]:
    """A gyro that senses next to nothing of a table that turns: a warning.

    It names the gyro that does, or the unit in which this one would. If no gyro senses the table,
    and in one other unit all of them would, that is an error: what is read is in the wrong unit.
    """
    table = recording.table
    if table is None:
        return ()
    table_rate, _ = block_rates(recording, table)
    share = table_share(recording, gyro)
    turns = float(np.percentile(np.abs(table_rate), 90.0)) > TURNING_RATE
    if not (turns and abs(share) < LEAST_SENSED):
        return ()
    text = f"senses {100.0 * share:.2g} % of the table rate: it is mounted across the axis"
    others = {one.name: table_share(recording, one) for one in recording.gyros}
    best = max(others, key=lambda name: abs(others[name]))
    in_degrees = share / DEGREE
    level: Level = "warning"
    likely = {_likely_unit(one, others[one.name], recording.sample_rate) for one in recording.gyros}
    if abs(others[best]) > _SENSES:
        text += f", while gyro {best} senses {100.0 * others[best]:.3g} %: name that ({{gyros}})"
    elif split_factor(table.shown_in)[1] == "rad" and _SENSES < abs(in_degrees) < LARGEST_SHARE:
        text = (
            f"senses {100.0 * share:.2g} % of the table rate, and would sense "
            f"{100.0 * in_degrees:.3g} % of it if the encoder were in degrees: state "
            "{table COLUMN:deg}"
        )
    elif "" not in likely:
        level = "error"
        own = _likely_unit(gyro, share, recording.sample_rate)
        text = f"senses {100.0 * share:.2g} % of the table rate: {own}"
    else:
        text += ", or a unit or kind is wrong ({unit}, {kind}, {table COLUMN:UNIT})"
    return (Note(name="encoder", level=level, channel=gyro.name, text=text),)


def _likely_unit(gyro: Channel, share: float, sample_rate: float) -> str:
    """The unit, kind or unit of time in which a gyro would sense the table; empty if none is.

    Parameters
    ----------
    gyro
        As stated.
    share
        Of the table rate that it senses as stated.
    sample_rate
        Hz.
    """
    factor, stated = split_factor(gyro.shown_in)
    said = "" if factor == 1.0 else f"{factor:g}"
    units = _UNITS_OF_RATE if gyro.kind == "rate" else _UNITS_OF_ANGLE
    found = [
        (share * UNITS[unit].size / UNITS[stated].size, f"{said}{unit}", f"{{unit {said}{unit}}}")
        for unit in units
        if unit != stated and stated in UNITS
    ]
    if gyro.kind == "rate":
        # The table's rate has the unit of time, and that of the gyro has its own.
        found += [
            (share * times, f"a unit of time a thousand times {which}", "{time COLUMN:UNIT}")
            for times, which in ((1e-3, "larger"), (1e3, "smaller"))
        ]
    for other, where, statement in found:
        if _SENSES < abs(other) < LARGEST_SHARE:
            return f"in {where} it would sense {100.0 * other:.3g} %; state {statement}"
    return ""


# ---- encoder turn ------------------------------------------------------------------

# Readings start over at one of these, turns.
_STARTS_OVER: Final = (0.0, 0.5)
# Samples before and behind a start that the excess is taken over, and as many steps on either side
# that tell the rate.
_REACH: Final = 2
_STEPS: Final = 2 * _REACH + 1
_OUTER: Final = _REACH + _STEPS + 1
# Fewest starts, other places that tell the scatter, and its multiple that the median lies off by.
_FEWEST: Final = 4
_PLACES: Final = 4001
_SIGMAS: Final = 8.0
# An excess below this is that of a sound encoder where its scale closes.
_CLOSES: Final = 10.0 * ARCSECOND
# A normal median is this much wider than the mean.
_MEDIAN: Final = 1.2533


def turn_notes(recording: Recording) -> tuple[Note, ...]:
    """An encoder whose angle leaps each time its readings start over: a warning.

    Its turn is not 360 degrees in the unit that is stated, or its scale does not close. The leap
    stands once in every turn. A pair of gyros is free of it, and one gyro alone has it as its own.
    """
    table = recording.table
    if table is None:
        return ()
    for start in _STARTS_OVER:
        at = _starts(table.values, start)
        if at.size < _FEWEST:
            continue
        at = at[:: max(1, at.size // _PLACES)]
        other = np.linspace(_OUTER, table.values.size - 1 - _OUTER, _PLACES).astype(np.int64)
        usual = _excess(table.values, other)
        scatter = scatter_of(usual - np.median(usual))
        leap = float(np.median(_excess(table.values, at)))
        if abs(leap) < max(_CLOSES, _SIGMAS * _MEDIAN * scatter / math.sqrt(at.size)):
            continue
        factor, unit = split_factor(table.shown_in)
        right = f"{factor * 2.0 * math.pi / (2.0 * math.pi - leap):.8g}{unit}"
        where = "short of" if leap > 0.0 else "beyond"
        text = (
            f"its readings start over {abs(leap) / DEGREE:.3g} deg {where} a full turn, "
            f"{counted(int(at.size), 'time')}: if that is one turn, state "
            f"{{table COLUMN:{right}}}; a pair of gyros is free of it, and one alone has only an "
            "upper bound"
        )
        return (Note(name="encoder", level="warning", channel="table", text=text),)
    return ()


def _starts(angle: FloatArray, start: float) -> IntegerArray:
    """Samples before the angle passes a whole number of turns and `start` of one."""
    turn = 2.0 * math.pi
    found = Places(
        values=angle, test=lambda some: np.diff(np.floor(some / turn - start)) != 0.0, following=1
    ).all()
    return found[(found >= _OUTER) & (found < angle.size - _OUTER)]


def _excess(angle: FloatArray, at: IntegerArray) -> FloatArray:
    """By how much the angle goes on at places beyond what it does before and behind, forwards."""
    edges = np.array([-_REACH - _STEPS, -_REACH, 1 + _REACH, 1 + _REACH + _STEPS])
    before, inside, behind = np.diff(values_at(angle, at[:, np.newaxis] + edges)).T
    return np.asarray((inside - 0.5 * (before + behind)) * np.sign(before + behind))
