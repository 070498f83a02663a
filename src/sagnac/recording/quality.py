"""The judgement of a recording: what has to hold before a figure can rest on it."""

import math

from sagnac import series
from sagnac.errors import Note, ranked
from sagnac.recording.encoder_mismatch import table_notes
from sagnac.recording.gaps import stamp_notes
from sagnac.recording.jumps import jump_notes
from sagnac.recording.model import MINIMUM_SAMPLES, Recording
from sagnac.recording.not_finite import not_finite_notes
from sagnac.recording.saturation import saturation_notes
from sagnac.recording.stuck import stuck_notes
from sagnac.recording.wrong_unit import wrong_unit_notes


def integrity(recording: Recording) -> tuple[Note, ...]:
    """What has to hold before any figure can rest on the data.

    Enough samples, all finite, time that runs forwards without gaps, no stuck gyro. A
    table may stand still, so a constant encoder is judged against the gyro, by
    `require_encoder_follows`.

    Returns
    -------
    tuple of Note
        Errors first. Times in the texts are s from the first sample of the file, as
        ``slice`` takes them.
    """
    if recording.samples < MINIMUM_SAMPLES:
        text = (
            f"{recording.samples} samples are too few, at least {MINIMUM_SAMPLES} are "
            "needed; give a longer file or a wider {slice}"
        )
        return (Note(level="error", text=text),)
    notes: list[Note] = []
    for channel in [*recording.gyros, *([recording.table] if recording.table else [])]:
        notes += not_finite_notes(recording, channel.name, channel.values)
    if recording.times is not None:
        notes += stamp_notes(recording, recording.times)
    for gyro in recording.gyros:
        notes += stuck_notes(recording, gyro)
    return ranked(notes)


def check(recording: Recording) -> tuple[Note, ...]:
    """Everything that can be said about the quality of the data.

    Besides `integrity`: jumps, saturation, units that look wrong, and an encoder that the
    gyros do not follow. These are looked at only if `integrity` found no error.

    Returns
    -------
    tuple of Note
        Errors first.
    """
    notes = list(integrity(recording))
    if any(note.level == "error" for note in notes):
        return tuple(notes)
    for gyro in recording.gyros:
        notes += wrong_unit_notes(recording, gyro)
        notes += jump_notes(recording, gyro)
        notes += saturation_notes(recording, gyro)
        notes += table_notes(recording, gyro)
    if recording.table is not None:
        notes += jump_notes(recording, recording.table)
        lowest, highest = series.extent(recording.table.values)
        turned = (highest - lowest) / (2.0 * math.pi)
        notes.append(Note(channel="table", text=f"covers {turned:.2f} turns"))
    return ranked(notes)
