"""Raw numbers of a column -> channel in SI: counters, encoder, null pulse."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import BooleanArray, FloatArray
from sagnac.errors import Note, RecordingError, counted
from sagnac.formats.scales import Scale
from sagnac.formats.unit_text import parsed_unit
from sagnac.recording.encoder import fill_missing, mark_missing
from sagnac.recording.kinds import unwrapped
from sagnac.recording.model import Channel
from sagnac.units import ARCSECOND

# Twice the periodic error that an encoder may have: what an interpolated reading may be off by.
ENCODER_ACCURACY: Final = 10.0 * ARCSECOND
# Steps of more than this share of a range leave it in doubt which way round they went.
DOUBTFUL_STEP: Final = 0.25
_TURN: Final = 2.0 * math.pi
_TABLE: Final = "table"


@dataclass(frozen=True, slots=True, kw_only=True)
class Made:
    """A channel, and what was noticed on the way."""

    channel: Channel
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Readings:
    """Raw readings, (samples,), and what was noticed of them."""

    values: FloatArray
    notes: tuple[Note, ...] = ()


def _made(name: str, scale: Scale, readings: Readings) -> Made:
    """The channel of these readings, which become SI in place."""
    values = readings.values
    if scale.factor != 1.0:

        def convert(block: slice) -> None:
            values[block] *= scale.factor

        series.map(convert, values.size, values)
    channel = Channel(name=name, kind=scale.kind, shown_in=scale.unit, values=values)
    return Made(channel=channel, notes=readings.notes)


# --- gyros ------------------------------------------------------------------------------------


def gyro_channel(name: str, raw: FloatArray, scale: Scale, counter_bits: int | None) -> Made:
    """A gyro.

    Parameters
    ----------
    name
        As the user calls it.
    raw
        (samples,) as the file has them; written over.
    scale
        Kind, and size of one raw number.
    counter_bits
        Width of a counter that rolls over, or None.

    Raises
    ------
    RecordingError
        If it cannot be such a counter.
    """
    if counter_bits is None:
        return _made(name, scale, Readings(values=raw))
    if scale.kind != "angle":
        raise RecordingError(
            f"a counter that rolls over is an angle, not kind {scale.kind}",
            channel=name,
            remedy="state {kind angle}, or leave out {counter-bits}",
        )
    return _made(name, scale, rolled_over(name, raw, counter_bits))


def rolled_over(name: str, raw: FloatArray, bits: int) -> Readings:
    """Readings of a counter of so many bits, made continuous.

    Raises
    ------
    RecordingError
        If they span more than it holds.
    """
    period = float(2**bits)
    reach = extent(raw)
    if reach >= period:
        raise RecordingError(
            f"it spans {reach:.6g} counts, more than {bits} bits hold",
            channel=name,
            remedy="state the right {counter-bits}",
        )
    values, wraps = unwrapped(raw, period)
    if not wraps:
        return Readings(values=values)
    text = f"the {bits} bit counter rolled over {wraps} times: unwrapped"
    return Readings(values=values, notes=(Note(channel=name, text=text),))


# --- table ------------------------------------------------------------------------------------


def table_channel(raw: FloatArray, scale: Scale, counter_bits: int | None) -> Made:
    """The table angle: missing samples filled in where they can be, and unwrapped.

    Parameters
    ----------
    raw
        (samples,) as the file has them; written over.
    scale
        Size of one raw number.
    counter_bits
        Width of counters, or None.
    """
    marked = missing_marked(raw, scale)
    period = table_period(extent(raw), scale, counter_bits)
    filled = missing_filled(raw, period, scale)
    continuous = table_unwrapped(raw, period)
    notes = (*marked, *filled, *continuous.notes)
    return _made(_TABLE, scale, Readings(values=continuous.values, notes=notes))


def missing_marked(values: FloatArray, scale: Scale) -> tuple[Note, ...]:
    """Set readings that stand for missing ones to NaN, in place; what was found."""
    marked = mark_missing(values, _TURN / scale.factor)
    notes: list[Note] = []
    if marked.off_path:
        alike = "" if marked.reading is None else f", all reading {marked.reading:.6g} {scale.unit}"
        text = f"{counted(marked.off_path, 'sample')} off its path{alike}: taken as missing"
        notes.append(Note(channel=_TABLE, text=text))
    if marked.held:
        text = f"{counted(marked.held, 'repeated sample')} while it turns: taken as missing"
        notes.append(Note(channel=_TABLE, text=text))
    return tuple(notes)


def table_period(reach: float, scale: Scale, counter_bits: int | None) -> float:
    """Reading at which the table starts over; inf where it does not.

    Parameters
    ----------
    reach
        Largest less smallest reading. More than a turn is a running angle, or a counter that is
        wider than a turn.
    scale
        Size of one reading.
    counter_bits
        Width of counters, or None.
    """
    turn = _TURN / scale.factor
    if reach <= turn * (1.0 + 1e-9):
        return turn
    is_counter = counter_bits is not None and not parsed_unit(scale.unit).is_plain
    width = 2.0**counter_bits if counter_bits is not None and is_counter else 0.0
    return width if reach < width else math.inf


def missing_filled(values: FloatArray, period: float, scale: Scale) -> tuple[Note, ...]:
    """Interpolate missing readings, in place; what was done."""
    filled = fill_missing(values, period, accuracy=ENCODER_ACCURACY / scale.factor)
    if not filled.samples:
        return ()
    error = filled.error * scale.factor / ARCSECOND
    known = f" (known ones are met to {error:.2g} arcsec)" if math.isfinite(error) else ""
    text = (
        f"{counted(filled.samples, 'missing sample')}, at most {filled.longest} in a row, "
        f"interpolated from their neighbours{known}"
    )
    return (Note(channel=_TABLE, text=text),)


def table_unwrapped(raw: FloatArray, period: float) -> Readings:
    """Readings that start over at `period`, made continuous."""
    if math.isinf(period):
        return Readings(values=raw)
    values, wraps = unwrapped(raw, period)
    notes: list[Note] = []
    if wraps:
        text = f"unwrapped where it starts over, {wraps} times"
        notes.append(Note(channel=_TABLE, text=text))
    largest = largest_step(values) / period
    if largest > DOUBTFUL_STEP:
        text = f"moves by up to {largest:.2f} of its range between samples; unwrapping is in doubt"
        notes.append(Note(channel=_TABLE, text=text, level="warning"))
    return Readings(values=values, notes=tuple(notes))


def largest_step(values: FloatArray) -> float:
    """Largest change from sample to sample, either way; samples that are NaN are passed over."""

    def of_block(block: slice) -> float:
        steps = np.abs(np.diff(values[block.start : block.stop + 1]))
        return float(np.fmax.reduce(steps))

    largest = 0.0
    for one in series.map(of_block, max(values.size - 1, 0), values):
        # NaN is no change that can be told.
        largest = max(largest, one)
    return largest


def extent(values: FloatArray) -> float:
    """Largest less smallest of the finite samples, 0 where there is none."""

    def ends(block: slice) -> tuple[float, float]:
        finite = values[block][np.isfinite(values[block])]
        return float(finite.min(initial=math.inf)), float(finite.max(initial=-math.inf))

    found = series.map(ends, values.size, values)
    lowest = min((low for low, _ in found), default=math.inf)
    highest = max((high for _, high in found), default=-math.inf)
    return max(highest - lowest, 0.0)


# --- null pulse -------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Pulses:
    """(samples,) true on the first sample of every null pulse, and what was noticed."""

    rising: BooleanArray
    notes: tuple[Note, ...] = ()


def null_pulses(key: str, values: FloatArray) -> Pulses:
    """The null pulses of a column.

    Parameters
    ----------
    key
        Of the column, for the message.
    values
        (samples,), not 0 where the pulse is up.

    Raises
    ------
    RecordingError
        If it takes more than two values.
    """
    levels = np.unique(series.every(values, max(1, values.size // 100_000)))
    rising = np.empty(values.size, dtype=np.bool_)

    def is_finite(block: slice) -> bool:
        np.not_equal(values[block], 0.0, out=rising[block])
        return bool(np.isfinite(values[block]).all())

    finite = all(series.map(is_finite, values.size, values))
    if levels.size > 2 or not finite:
        raise RecordingError(
            f"column {key} takes more than two values",
            channel="null_pulse",
            remedy="name a column of 0 and 1 with {null-pulse}",
        )
    high = np.count_nonzero(rising)
    rising[1:] &= ~rising[:-1]
    if np.count_nonzero(rising) == high:
        return Pulses(rising=rising)
    text = "stays up for more than a sample; its first is taken"
    return Pulses(rising=rising, notes=(Note(channel="null_pulse", text=text),))
