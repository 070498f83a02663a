"""Raw columns and what was stated about them -> Recording, in named steps.

Columns that are not taken may speak against what is: time stamps, and counters of samples.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from sagnac.core import arrays, units
from sagnac.core.errors import RecordingError
from sagnac.formats import choice as choices
from sagnac.formats import suspicions
from sagnac.formats.choice import Choice, Scale, scale_of
from sagnac.formats.source import Column, Source, Stored
from sagnac.formats.statement import Statements
from sagnac.quality.check import integrity
from sagnac.recording.channel import Conversion
from sagnac.recording.columns import GYRO_NAMES, gyro_of, pulses_of
from sagnac.recording.encoder_readings import table_of_readings
from sagnac.recording.model import Provenance, Recording
from sagnac.recording.stamps import RATE_AGREEMENT, Stretch, stretch_of


def assemble(
    source: Source, statements: Statements, provenance: Callable[[], Provenance], *, verify: bool
) -> Recording:
    """Build the recording.

    Parameters
    ----------
    source
        The opened file.
    statements
        Of caller, TOML and file.
    provenance
        Gives where the file came from, called once the columns are there; the span is
        filled in here.
    verify
        Raise on what `integrity` calls an error, and keep the rest as notes. Without, the
        findings are left to `check`.

    Raises
    ------
    RecordingError
        If a column, kind, unit or rate is missing or contradicts another, or the data are
        not sound. It does not name the file.
    """
    _require_readable(source, statements)
    choice = choices.choose(source.columns, statements)
    choices.require_known(choice, source.columns, statements)
    sensors = choice.sensors
    scales = {one.key: scale_of(name, one, statements, sensor) for sensor, name, one in sensors}
    if choice.table is not None:
        choices.role_unit("table", choice.table)
    by_caller, by_toml, by_file = (one.sample_rate for one in statements.in_order)
    if choice.time is None and statements.first("sample_rate") is None:
        remedy = "state {rate HZ} or {time COLUMN:UNIT}"
        raise RecordingError("neither a sample rate nor time stamps are stated", remedy=remedy)
    second = choices.role_unit("time", choice.time).size if choice.time else 1.0
    stored = source.opened(choice.keys)
    check_lengths(stored.lengths)
    stretch = _stretch(choice.time, second, stored, statements)
    notes = [*source.notes, *choice.notes]
    notes += [note for scale in scales.values() for note in scale.notes]
    notes += stretch.sampling.notes
    if choice.time is not None:
        notes += suspicions.stamp_unit_notes(choice.time, stretch.sampling.sample_rate)
    notes += suspicions.force_notes(choice.gyros)
    notes += suspicions.slice_notes(statements.caller.span, stretch)
    notes += suspicions.unused_notes(source, choice, statements, stretch)
    taken, is_typed = by_caller or by_toml, by_caller is not None
    # Stamps rule a rate that is typed, and agree with it; LabVIEW states 1 Hz where it knows none.
    if is_typed and (choice.time is not None or by_file == 1.0):
        taken = None
    if by_file and taken and abs(taken / by_file - 1.0) > (RATE_AGREEMENT if is_typed else 0.0):
        rates = (f"{one:.9g} Hz" for one in (by_file, taken))
        notes.append(choices.contradiction(*rates, is_typed=is_typed, channel="time"))
    stretch = replace(stretch, sampling=replace(stretch.sampling, notes=tuple(notes)))
    made = _recording(choice, scales, stored, stretch, statements.counter_period)
    sliced = stretch.span_s if statements.caller.span is not None else None
    recording = replace(made, provenance=replace(provenance(), span_s=sliced))
    return verified(recording) if verify else recording


def _require_readable(source: Source, statements: Statements) -> None:
    """Refuse a gyro, asked for or by its usual name, that holds no real numbers.

    Raises
    ------
    RecordingError
        Rather than that fewer gyros are taken without a word.
    """
    for name in statements.gyros or GYRO_NAMES:
        key = statements.column(name) or name
        if key in source.unreadable:
            problem = f"{source.unreadable[key]}, no real numbers"
            remedy = "correct the file, or name the gyros to take with {gyros}"
            raise RecordingError(problem, channel=key, remedy=remedy)


def check_lengths(lengths: Mapping[str, int]) -> None:
    """Refuse columns that are not of one length.

    Raises
    ------
    RecordingError
        If one has more or fewer samples than the first.
    """
    (first, samples), *others = lengths.items()
    for key, length in others:
        if length != samples:
            problem = f"has {length} samples but {first} has {samples}"
            remedy = "name columns sampled together with {columns}"
            raise RecordingError(problem, channel=key, remedy=remedy)


def _stretch(time: Column | None, second: float, stored: Stored, statements: Statements) -> Stretch:
    """The samples that the caller's slice takes, their rate and their times.

    Raises
    ------
    RecordingError
        If there are too few samples, or the stamps make no sense.
    """
    samples, stamps = next(iter(stored.lengths.values())), None
    if time is not None and samples > 1:
        stamps = stored.read([time.key], 0, samples, by_first=True)[time.key]
        arrays.elementwise(np.multiply, stamps, second, out=stamps)
    return stretch_of(samples, statements.caller.span, statements.first("sample_rate"), stamps)


def _recording(
    choice: Choice, scales: dict[str, Scale], stored: Stored, stretch: Stretch, period: float | None
) -> Recording:
    """The samples that are taken, loaded and in SI, with notes on their columns.

    Raises
    ------
    RecordingError
        If a counter or the null pulse cannot be one.
    """
    sampling, table, pulses = stretch.sampling, None, None
    apart = [one.key for one in (choice.time, choice.null_pulse) if one is not None]
    keys = [key for key in choice.keys if key not in apart]
    columns = stored.read(keys, stretch.first, stretch.stop)
    sensors = []
    for _, name, one in choice.sensors:
        scale = scales[one.key]
        # Beside a gyro that counts no angle it is the encoder that starts over.
        own_period = period if choice.table is None or scale.kind == "angle" else None
        raw = columns.pop(one.key)
        sensors.append(_sensor(name, raw, scale, own_period, sampling.sample_rate))
    if choice.table is not None:
        raw, unit = columns.pop(choice.table.key), choice.table.unit or ""
        doubts = suspicions.table_counter_notes(choice.table.name, raw, unit)
        table = table_of_readings(raw, unit, counter_period=period)
        table = replace(table, notes=(*doubts, *table.notes))
    if choice.null_pulse is not None:
        # Loaded by itself: it shrinks to an eighth before the next is in memory.
        key = choice.null_pulse.key
        pulses = pulses_of(stored.read([key], stretch.first, stretch.stop).pop(key), column=key)
    dithers = {name: columns[one.key] for name, one in choice.pickoffs.items()}
    warmth = columns[choice.temperature.key] if choice.temperature else None
    return Recording.from_channels(
        sensors, sampling, table=table, null_pulse=pulses, pickoffs=dithers, temperature=warmth
    )


def _sensor(
    name: str, raw: arrays.FloatArray, scale: Scale, period: float | None, sample_rate: float
) -> Conversion:
    """A gyro, with what its numbers speak against, or an accelerometer."""
    channel_of = partial(gyro_of, name, raw, kind=scale.kind, unit=scale.unit, out=raw)
    if units.sensor_of(scale.unit) == "accelerometer":
        return channel_of()
    # The channel is made in place: what the raw numbers tell has to be asked before.
    doubts = () if period else suspicions.counter_notes(name, raw, scale.kind, scale.unit)
    taken = channel_of(period=period, inputs="{counter-bits} or {counter-period}")
    if scale.kind == "angle" and not doubts:
        doubts = suspicions.rate_notes(name, taken.channel.values)
    if scale.kind == "increment":
        doubts += suspicions.increment_notes(name, taken.channel.values, sample_rate)
    return replace(taken, notes=(*doubts, *taken.notes))


def verified(recording: Recording) -> Recording:
    """The recording with what `integrity` noticed.

    A gyro or accelerometer that is not sound does not cost the others: an error is noted, and
    whoever uses that channel refuses it.

    Raises
    ------
    RecordingError
        If the data are not sound, or none of the gyros is.
    """
    forces = (recording.of_accelerometer(one.name) for one in recording.accelerometers)
    doubts = dict.fromkeys(note for one in (recording, *forces) for note in integrity(one))
    errors = [note for note in doubts if note.level == "error"]
    gyros = {gyro.name for gyro in recording.gyros}
    spoilt = {note.channel for note in errors}
    bearable = spoilt - {one.name for one in recording.accelerometers} < gyros
    if errors and not bearable:
        raise RecordingError.of(errors[0])
    return replace(recording, notes=(*recording.notes, *doubts))
