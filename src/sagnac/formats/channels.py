"""Raw numbers of a column -> channel in SI: gyros, counters among them, and the table."""

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


def gyro_channel(name: str, raw: FloatArray, scale: Scale, counter_bits: int | None) -> Taken:
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
        If it cannot be such a counter: it is no angle, or spans more than that holds.
    """
    if counter_bits is None:
        return _in_si(name, scale, raw)
    if scale.kind != "angle":
        raise RecordingError(
            f"a counter that rolls over is an angle, not kind {scale.kind}",
            channel=name,
            remedy="state {kind angle}, or leave out {counter-bits}",
        )
    period = float(2**counter_bits)
    extent = finite_extent(raw)
    if extent >= period:
        raise RecordingError(
            f"it spans {extent:.6g} counts, more than {counter_bits} bits hold",
            channel=name,
            remedy="state the right {counter-bits}",
        )
    continuous, wraps = unwrapped(raw, period)
    if not wraps:
        return _in_si(name, scale, continuous)
    text = f"the {counter_bits} bit counter rolled over {counted(wraps, 'time')}: unwrapped"
    return _in_si(name, scale, continuous, Note(channel=name, text=text))


def _in_si(name: str, scale: Scale, readings: FloatArray, *notes: Note) -> Taken:
    """The channel of these readings, which become SI in place."""
    values = series.scale(readings, scale.factor)
    channel = Channel(
        name=name, kind=scale.kind, shown_in=scale.unit, values=values, sensor=scale.sensor
    )
    return Taken(channel=channel, notes=notes)


def table_channel(raw: FloatArray, scale: Scale, counter_bits: int | None) -> Taken:
    """The table angle: missing samples filled in where they can be, and unwrapped.

    Parameters
    ----------
    raw
        (samples,) as the file has them; written over.
    scale
        Size of one raw number.
    counter_bits
        Width of counters, or None. A table in a plain unit is none.
    """
    is_counter = counter_bits is not None and not parsed_unit(scale.unit).is_plain
    taken = angle_of_readings(
        raw,
        # Notes show the unit as it is stated.
        replace(unit_of(scale.unit, "angle"), name=scale.unit),
        counter_period=2.0**counter_bits if counter_bits is not None and is_counter else None,
    )
    channel = Channel(name="table", kind="angle", shown_in=scale.unit, values=taken.angle)
    return Taken(channel=channel, notes=taken.notes)
