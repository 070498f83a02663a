"""The judgement of a recording: what has to hold before a figure can rest on it."""

import math
from collections.abc import Callable, Container, Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

from sagnac.core.arrays import FloatArray, extent
from sagnac.core.errors import Note, ranked
from sagnac.quality import distribution, encoder_faults, gaps, physics, readout, repeats, spikes
from sagnac.quality.profile import Profile, profile_of
from sagnac.recording.channel import Channel
from sagnac.recording.model import MINIMUM_SAMPLES, Recording, require_recording

# A table that covers less than this, rad, is at rest: no encoder reads finer for hours.
_AT_REST: Final = math.radians(1.0)
# Ratio of two shares of the table that no wrong unit makes.
_ALIKE: Final = 2.0
# What looks for one thing in the samples of a gyro.
Detector = Callable[[Recording, Profile], tuple[Note, ...]]


def integrity(recording: Recording) -> tuple[Note, ...]:
    """Checks that hold before any figure can rest on the data.

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
        notes += gaps.not_finite_notes(recording, channel.name, channel.values)
    if recording.times is not None:
        notes += gaps.stamp_notes(recording, recording.times)
    for gyro in recording.gyros:
        notes += gaps.stuck_notes(recording, gyro)
    if not notes:
        notes += physics.gravity_notes(recording)
    return ranked(notes)


def judged(recording: Recording, gyros: Sequence[str] = ()) -> tuple[Note, ...]:
    """The judgement of the noise of a sound recording: findings, each with its effect on N.

    A finding of level ``error`` moves N by more than 5 %, or by nobody knows how much: what is
    read is then no estimate of N.

    Parameters
    ----------
    recording
        In which `integrity` found no error.
    gyros
        Names of those that are looked at; all unless given.

    Returns
    -------
    tuple of Note
        Errors first, each with a `name`.
    """
    chosen = [recording.gyro(name) for name in gyros] if gyros else list(recording.gyros)
    turns = recording.table is not None and _turned(recording.table) > _AT_REST
    notes = [*physics.rate_doubts(recording), *(() if turns else physics.earth_notes(recording))]
    if turns:
        lost = spikes.lost_rows(recording, chosen)
        notes += lost.notes(recording)
        # What leaps there would else be called spikes and jumps.
        recording = lost.closed(recording)
        chosen = [recording.gyro(gyro.name) for gyro in chosen]
    profiles = {gyro.name: profile_of(gyro) for gyro in chosen}
    for profile in profiles.values():
        notes += physics.wrong_unit_notes(recording, profile, standing=not turns)
        notes += _of_samples(recording, profile, standing=not turns)
    notes += repeats.pair_notes(profiles, partial(_sense_alike, recording))
    if recording.table is not None and not turns:
        notes += encoder_faults.jump_notes(recording, recording.table)
    elif recording.table is not None:
        notes += encoder_faults.turn_notes(recording) or spikes.slip_notes(recording, chosen)
        for gyro in _not_rolled_over(chosen, notes):
            notes += encoder_faults.across_notes(recording, gyro)
            notes += physics.earth_on_table_notes(recording, gyro)
    return ranked(notes)


def _sense_alike(recording: Recording, first: str, second: str) -> bool:
    """Whether both sense the table's rate, in shares that no wrong unit would leave alike."""
    shares = [
        abs(encoder_faults.table_share(recording, recording.gyro(name))) for name in (first, second)
    ]
    return min(shares) > encoder_faults.LEAST_SHARE and max(shares) < _ALIKE * min(shares)


def _of_samples(recording: Recording, profile: Profile, *, standing: bool) -> tuple[Note, ...]:
    """Findings in the samples of one gyro: one cause that spoils them all, else each."""
    is_bench = standing and profile.channel.sensor == "gyro"
    causes = [one for one in _CAUSES if is_bench or one is not physics.motion_notes]
    # The others would only see what follows from the first.
    found = next(filter(None, (cause(recording, profile) for cause in causes)), ())
    if found:
        return found
    found = spikes.spike_notes(recording, profile)
    if not standing and not _warns(found):
        # The end of a heavy tail is the noise's on a bench alone: a table that sweeps has one.
        found = ()
    found = found or encoder_faults.jump_notes(recording, profile.channel)
    if _warns(found):
        # A table that starts and stops changes noise and rate by right.
        return found + (distribution.unsteady_notes(recording, profile) if standing else ())
    if not standing:
        # No motion makes large deviations rare.
        return found + distribution.flat_notes(recording, profile)
    changing = distribution.unsteady_notes(recording, profile)
    stepping = () if changing else distribution.step_notes(recording, profile)
    if stepping:
        return found + changing + stepping
    flat = distribution.flat_notes(recording, profile)
    return found + changing + (flat or distribution.heavy_notes(recording, profile))


def _wrapped(recording: Recording, profile: Profile) -> tuple[Note, ...]:
    """A counter that starts over, which reading saw already: the error that it is."""
    seen = tuple(
        replace(note, level="error")
        for note in recording.notes
        if note.name == "wraps" and note.channel == profile.channel.name
    )
    return seen or physics.wrap_notes(recording, profile)


# In the order in which they are looked for.
_CAUSES: Final[tuple[Detector, ...]] = (
    _wrapped,
    distribution.interleaved_notes,
    physics.motion_notes,
    # Zeros far from the mean look like a readout of one step from there to zero.
    distribution.dropout_notes,
    readout.resolution_notes,
    readout.saturation_notes,
    repeats.repeat_notes,
    repeats.twice_notes,
)


def _not_rolled_over(gyros: Iterable[Channel], notes: Iterable[Note]) -> list[Channel]:
    """Gyros whose turn is known: what a counter that starts over turned is not."""
    spoilt = {note.channel for note in notes if note.name == "wraps"}
    return [gyro for gyro in gyros if gyro.name not in spoilt]


def _warns(notes: Iterable[Note]) -> bool:
    return any(note.level != "remark" for note in notes)


def judged_remainder(
    recording: Recording, channel: str, increments: FloatArray, sample_rate: float
) -> tuple[Note, ...]:
    """The judgement of what is left of gyros on a turning table without motion, lines and spikes.

    Noise that changes, and noise that is full of spikes, do not show beside the motion.

    Parameters
    ----------
    recording
        It tells when a sample was taken.
    channel
        Gyro name, or ``x-z``.
    increments
        (samples,) rad.
    sample_rate
        Of these, Hz.

    Returns
    -------
    tuple of Note
        Findings, each with a `name`.
    """
    left = Channel(name=channel, values=increments, kind="increment", shown_in="rad")
    alone = replace(
        recording,
        gyros=(left,),
        sample_rate=sample_rate,
        times=None,
        table=None,
        null_pulse=None,
        accelerometers=(),
        pickoffs=(),
        temperature=None,
    )
    profile = profile_of(left)
    # Steps of two readouts together are flat, and no soft limit.
    return distribution.unsteady_notes(alone, profile) or distribution.heavy_notes(alone, profile)


def accept(notes: Iterable[Note], names: Container[str]) -> tuple[Note, ...]:
    """Findings, those that the caller takes knowingly turned into remarks that say so.

    Parameters
    ----------
    notes
        Findings.
    names
        Of those that are accepted.
    """
    return tuple(
        replace(note, level="remark", text=f"accepted: {note.text}")
        if note.name in names and note.level != "remark"
        else note
        for note in notes
    )


def check(recording: Recording, *, accepted: Container[str] = ()) -> tuple[Note, ...]:
    """Everything that can be said about the quality of the data.

    Besides `integrity`, that of the accelerometers, too: what `judged` finds, and an encoder that
    the gyros do not follow. These are looked at only of gyros in which `integrity` found no error.
    What reading warned of is in it.

    Parameters
    ----------
    recording
        Still or turning.
    accepted
        Names of findings that are taken knowingly: see `accept`.

    Returns
    -------
    tuple of Note
        Errors first, then warnings, then remarks.

    Examples
    --------
    >>> import numpy as np
    >>> rate = np.random.default_rng(1).standard_normal(6000)
    >>> rate[2000:3000] = rate[2000]
    >>> stuck = Recording.from_arrays(x=rate, kind="rate", unit="deg/h", sample_rate=10.0)
    >>> [note.level for note in check(stuck)][:1]
    ['error']
    """
    require_recording(recording)
    found = accept(_findings(recording), accepted)
    said = {note.text for note in found}
    doubts = [note for note in recording.notes if note.level == "warning" and note.text not in said]
    return ranked((*doubts, *found))


def _findings(recording: Recording) -> tuple[Note, ...]:
    forces = [recording.of_accelerometer(one.name) for one in recording.accelerometers]
    notes = [note for one in (recording, *forces) for note in integrity(one)]
    spoilt = {note.channel for note in notes if note.level == "error"}
    sound = [gyro for gyro in recording.gyros if gyro.name not in spoilt]
    known = {one.name for one in (*recording.gyros, *recording.accelerometers)}
    if not sound or spoilt - known:
        return ranked(notes)
    notes += judged(recording, [gyro.name for gyro in sound])
    for gyro in _not_rolled_over(sound, notes):
        notes += encoder_faults.table_notes(recording, gyro)
    if recording.table is not None:
        turned = _turned(recording.table) / (2.0 * math.pi)
        notes.append(Note(channel="table", text=f"covers {turned:.2f} turns"))
    return ranked(notes)


def _turned(table: Channel) -> float:
    """Angle between the ends of what an encoder covers, rad."""
    lowest, highest = extent(table.values)
    return highest - lowest
