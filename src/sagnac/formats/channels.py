"""Raw numbers of a column -> channel in SI: gyros, counters among them, and the table."""

import math
from dataclasses import replace

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import Note, RecordingError, counted
from sagnac.formats.scales import Scale
from sagnac.formats.unit_text import parsed_unit
from sagnac.recording.channel import Channel
from sagnac.recording.columns import Taken
from sagnac.recording.encoder_readings import angle_of_readings
from sagnac.recording.kinds import finite_extent
from sagnac.recording.unwrapping import unwrapped
from sagnac.units import unit_of


def gyro_channel(name: str, raw: FloatArray, scale: Scale, counter_period: float | None) -> Taken:
    """A gyro.

    Parameters
    ----------
    name
        As the user calls it.
    raw
        (samples,) as the file has them; written over.
    scale
        Kind, and size of one raw number.
    counter_period
        Counts after which a counter starts over, or None.

    Raises
    ------
    RecordingError
        If it cannot be such a counter: it is no angle, or spans more than that holds.
    """
    if counter_period is None:
        return _in_si(name, scale, raw)
    if scale.kind != "angle":
        raise RecordingError(
            f"a counter that rolls over is an angle, not kind {scale.kind}",
            channel=name,
            remedy="state {kind angle}, or leave out {counter-bits} and {counter-period}",
        )
    extent = finite_extent(raw)
    if extent >= counter_period:
        raise RecordingError(
            f"it spans {extent:.6g} counts, more than a counter of {counter_period:.9g} holds",
            channel=name,
            remedy="state the right {counter-bits} or {counter-period}",
        )
    continuous, wraps = unwrapped(raw, counter_period)
    if not wraps:
        return _in_si(name, scale, continuous)
    bits = math.log2(counter_period)
    what = f"{bits:g} bit counter" if bits.is_integer() else f"counter of {counter_period:.9g}"
    text = f"the {what} rolled over {counted(wraps, 'time')}: unwrapped"
    return _in_si(name, scale, continuous, Note(channel=name, text=text))


def _in_si(name: str, scale: Scale, readings: FloatArray, *notes: Note) -> Taken:
    """The channel of these readings, which become SI in place."""
    values = series.scale(readings, scale.factor)
    channel = Channel(
        name=name, kind=scale.kind, shown_in=scale.unit, values=values, sensor=scale.sensor
    )
    return Taken(channel=channel, notes=notes)


def table_channel(raw: FloatArray, scale: Scale, counter_period: float | None) -> Taken:
    """The table angle: missing samples filled in where they can be, and unwrapped.

    Parameters
    ----------
    raw
        (samples,) as the file has them; written over.
    scale
        Size of one raw number.
    counter_period
        Counts after which counters start over, or None. A table in a plain unit is none.
    """
    taken = angle_of_readings(
        raw,
        # Notes show the unit as it is stated.
        replace(unit_of(scale.unit, "angle"), name=scale.unit),
        counter_period=None if parsed_unit(scale.unit).is_plain else counter_period,
    )
    channel = Channel(name="table", kind="angle", shown_in=scale.unit, values=taken.angle)
    return Taken(channel=channel, notes=taken.notes)
