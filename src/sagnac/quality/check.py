"""The judgement of a recording: what has to hold before a figure can rest on it.

`DETECTORS` is the list of all that is looked for, with what it does to N and its remedy.
"""

import math
from collections.abc import Callable, Container, Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby, product
from typing import Final, NamedTuple

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import Note, choices_of, ranked
from sagnac.core.units import SENSED
from sagnac.quality import distribution, encoder, physics, readout, samples
from sagnac.quality.effects import DIVIDED, STRETCH
from sagnac.quality.profile import Notes, Profile, turned
from sagnac.recording.channel import Channel
from sagnac.recording.model import MINIMUM_SAMPLES, Recording, require_recording

# ---- detectors ---------------------------------------------------------------------


class Detector(NamedTuple):
    """Something that is looked for in a recording.

    Attributes
    ----------
    name
        By which a finding is accepted.
    find
        Given a recording and the profile of one of its channels, the findings; None if they are
        found elsewhere: on reading, or beside the answer.
    of_each
        Whether it is asked of each channel, one after the other with those beside it in the list;
        else of the recording once.
    unless
        Names of findings that explain what would be seen here; it is not asked if there is one, of
        the same channel if it is of a channel.
    sees, effect, remedy
        What is seen in the data, what it does to N, and what to do; inputs of the package in
        braces (see `sagnac.core.errors.worded`).
    """

    name: str
    find: Callable[[Recording, Profile], Notes] | None
    of_each: bool
    unless: tuple[str, ...]
    sees: str
    effect: str
    remedy: str


_WRONG_UNIT: Final = ("N is wrong by the same factor", "state {unit}, {kind} and {rate}")
_UNREAD: Final = ("missing", "gaps", "stuck")
# The first of these that is found spoils all samples of a gyro; single samples and jumps hide what
# is slow.
_CAUSES: Final = ("wraps", "interleaved", "motion", "dropouts", "resolution", "clipping", "repeats")
_SINGLE: Final = (*_CAUSES, "spikes", "steps")

_ON_READING: Final[tuple[Detector, ...]] = (
    Detector("missing", samples.missing_notes, True, (), "samples that are no finite numbers",
             "nothing is read of that gyro", STRETCH),
    Detector("gaps", samples.stamp_notes, False, (),
             "stamps that jump, stand still, run back or change rate", "nothing is read", STRETCH),
    Detector("stuck", samples.stuck_notes, True, (), "a gyro that gives one value for a while",
             "nothing is read of that gyro", STRETCH),
    Detector("units", physics.gravity_notes, False, _UNREAD,
             "accelerometers that show gravity in another unit than theirs", *_WRONG_UNIT),
)  # fmt: skip
_IN_SOUND_DATA: Final[tuple[Detector, ...]] = (
    Detector("units", physics.time_notes, False, (), "samples farther apart than gyros are read",
             "N is wrong by the root of the factor", "state the unit of {time}, or {rate}"),
    Detector("units", physics.earth_notes, False, (),
             "means at rest that are Earth's rate in another unit, or gravity", *_WRONG_UNIT),
    Detector("units", physics.rate_notes, True, (), "a rate or a scatter that no gyro has",
             *_WRONG_UNIT),
    Detector("wraps", readout.wrap_notes, True, (),
             "a counter that starts over, or signed counts that are read as unsigned",
             "N is of the leaps", "state the width of the counter ({counter-bits})"),
    Detector("interleaved", samples.interleaved_notes, True, _CAUSES,
             "samples of several sensors by turns in one column", "N is of none of them",
             "write each into a column of its own"),
    Detector("motion", physics.motion_notes, True, _CAUSES,
             "turns on what is read as a still bench", "the motion counts as noise",
             "state the encoder ({table}), or take a stretch at rest ({slice})"),
    # Zeros far from the mean look like a readout of one step from there to zero.
    Detector("dropouts", samples.dropout_notes, True, _CAUSES,
             "samples of exactly zero far from the mean", "raises N", samples.LEAVE_OUT),
    Detector("dropouts", samples.lost_row_notes, True, (),
             "rows that even time stamps show to be missing", "raises N of rates",
             "get the file again from its source"),
    Detector("resolution", readout.resolution_notes, True, _CAUSES,
             "steps of the readout beside the scatter from sample to sample",
             "N is in part the steps", "read out finer, and store in double precision"),
    Detector("clipping", readout.saturation_notes, True, _CAUSES, "samples at a limit of the range",
             "lowers N", "take a wider range, or a stretch without ({slice})"),
    Detector("repeats", samples.repeat_notes, True, _CAUSES, "samples that repeat the one before",
             "held samples lower the noise between samples", STRETCH),
    Detector("repeats", samples.twice_notes, True, _CAUSES, "stretches that repeat earlier ones",
             "an interval counts them twice", STRETCH),
    Detector("repeats", samples.filled_notes, True, _CAUSES,
             "samples on the straight line between two others", "gaps that were filled raise N",
             samples.LEAVE_OUT),
    Detector("spikes", distribution.spike_notes, True, _CAUSES, "samples far off their neighbours",
             "left in, they raise N; an answer goes without them if they are few", STRETCH),
    Detector("moved", distribution.bump_notes, True, _CAUSES,
             "a unit on a bench that is nudged, or turned for a second or a few",
             "left in, it raises N; an answer goes without it", STRETCH),
    Detector("unsteady", distribution.unsteady_notes, True, _CAUSES,
             "noise that changes or grows in the course of the record",
             "N is a mean of several", "take an even stretch ({slice})"),
    Detector("steps", distribution.step_notes, True, (*_SINGLE, "unsteady"),
             "a rate or an angle that jumps once or a few times", "raises N at long times",
             STRETCH),
    Detector("short-tails", distribution.flat_notes, True, _SINGLE,
             "fewer large samples than noise has", "lowers N if it is a soft saturation",
             "take a wider range"),
    Detector("spikes", distribution.heavy_notes, True, _SINGLE, "noise that is no even noise",
             "N holds the spikes or bursts", STRETCH),
    # Two gyros that one hand turns share that motion, and neither is a copy.
    Detector("copy", physics.copy_notes, False, ("motion",),
             "a gyro that repeats another, at once or later",
             "the difference of the two hides the noise that they share",
             "name another gyro ({gyros})"),
    Detector("units", physics.unequal_notes, False, (), "two gyros of which one is far quieter",
             "N of their difference is of one of them", "state {unit}, or see each ({gyros})"),
    Detector("encoder", encoder.turn_notes, False, (), "an encoder that starts over beside a turn",
             "N of a single gyro holds the encoder's error", "state its unit ({table})"),
    Detector("steps", encoder.slip_notes, False, ("encoder",), "jumps of the encoder alone",
             "N of a single gyro holds the encoder's error", STRETCH),
    Detector("encoder", encoder.across_notes, True, ("wraps",),
             "a table encoder that the gyros do not follow",
             "N of a single gyro holds the encoder's error",
             "state its column and unit ({table})"),
    Detector("units", physics.earth_on_table_notes, True, ("wraps",),
             "Earth rate on a table that only another unit of time would show", *_WRONG_UNIT),
)  # fmt: skip
_ELSEWHERE: Final = (
    Detector("lost", None, False, (),
             "rows that are missing from the file, seen by the table's angle",
             "lines in time break there", STRETCH),
    Detector("shared", None, False, (), "noise that two gyros have in common",
             "their difference hides it", "see each alone ({gyros})"),
    Detector("unlike", None, False, (),
             "two gyros that do not show the table's motion alike, as behind unlike filters",
             "raises N of their difference", "give both the same filter, or name others ({gyros})"),
    Detector("high-pass", None, False, (),
             "a spectrum that is level over a decade, and lower below",
             "lowers N if the output takes off its own bias at rest",
             "record the output without that correction"),
    Detector("warm-up", None, False, (), "a rate that settles in the course of the record",
             "none: it is taken off for the answer, and stays in the curve",
             "leave it out ({slice}), or fit it beside a column of temperature ({covariates})"),
)  # fmt: skip
DETECTORS: Final = (*_ON_READING, *_IN_SOUND_DATA, *_ELSEWHERE)
"""All that is looked for, in the order in which it is."""
# Names of what is found in recordings that are sound enough to be read.
FINDINGS: Final = tuple(sorted({one.name for one in DETECTORS} - set(_UNREAD)))


def _asked(
    detectors: Iterable[Detector], recording: Recording, profiles: Sequence[Profile]
) -> list[Note]:
    """Findings of detectors, as far as none explains another."""
    notes: list[Note] = []
    for of_each, together in groupby(detectors, lambda one: one.of_each):
        for profile, detector in product(profiles if of_each else profiles[:1], list(together)):
            causes = [one for one in notes if one.name in detector.unless and one.level != "remark"]
            explained = any(one.channel == profile.name or not of_each for one in causes)
            if detector.find is not None and not explained:
                notes += detector.find(recording, profile)
    return notes


# ---- judgement ---------------------------------------------------------------------


def integrity(recording: Recording) -> Notes:
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
        problem = f"{recording.samples} samples are too few, at least {MINIMUM_SAMPLES} are needed"
        return (Note(level="error", text=f"{problem}; give a longer file or a wider {{slice}}"),)
    channels = [*recording.gyros, *([recording.table] if recording.table else [])]
    return ranked(_asked(_ON_READING, recording, [Profile.of(recording, one) for one in channels]))


def judged(recording: Recording, gyros: Sequence[str] = ()) -> Notes:
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
    names = gyros or [gyro.name for gyro in recording.gyros]
    # What leaps at lost rows would else be called spikes and jumps.
    whole, lost = encoder.without_lost_rows(recording, [recording.gyro(name) for name in names])
    profiles = profiles_of(whole, names)
    findings = _asked(_IN_SOUND_DATA, whole, profiles)
    # They hold each other, and with them arrays as long as the record, until they are parted.
    profiles[0].together.clear()
    return ranked((*lost, *findings))


def profiles_of(recording: Recording, names: Iterable[str]) -> list[Profile]:
    """The profiles of gyros, each of which knows the others."""
    standing, together = not turned(recording.table), dict[str, Profile]()
    profile = partial(Profile, sample_rate=recording.sample_rate, standing=standing)
    table = None if recording.table is None else profile(channel=recording.table)
    for name in names:
        channel = recording.gyro(name)
        together[name] = profile(channel=channel, table=table, together=together)
    return list(together.values())


def judged_remainder(
    recording: Recording, channel: str, increments: FloatArray, sample_rate: float
) -> Notes:
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
    alone = Recording(gyros=(left,), sample_rate=sample_rate, provenance=recording.provenance)
    profile = Profile.of(alone, left)
    # Steps of two readouts together are flat, and no soft limit.
    return distribution.unsteady_notes(alone, profile) or distribution.heavy_notes(alone, profile)


ACCEPTED: Final = "accepted: "
"""Before the text of a finding that is accepted."""


def accept(notes: Iterable[Note], names: Container[str]) -> Notes:
    """Findings, those that the caller takes knowingly turned into remarks that say so.

    Of what N would be divided by, remarks as well.

    Parameters
    ----------
    notes
        Findings.
    names
        Of those that are accepted.
    """

    def accepted(note: Note) -> Note:
        is_open = note.name in names and not note.text.startswith(ACCEPTED)
        if is_open and (note.level != "remark" or note.name in DIVIDED):
            return replace(note, level="remark", text=f"{ACCEPTED}{note.text}")
        return note

    return tuple(map(accepted, notes))


def check(recording: Recording, *, accepted: Iterable[str] = ()) -> Notes:
    """Everything that can be said about the quality of the data.

    Besides `integrity`, what `judged` finds, both of the accelerometers, too; and an encoder that
    the gyros do not follow. These are looked at only in what `integrity` found no error in.
    What reading warned of is in it.

    Parameters
    ----------
    recording
        Still or turning.
    accepted
        Names of findings that are taken knowingly (`FINDINGS`): see `accept`.

    Returns
    -------
    tuple of Note
        Errors first, then warnings, then remarks.

    Raises
    ------
    ValueError
        If a name is none of a finding.

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
    accepted = choices_of("accepted", accepted, FINDINGS)
    findings = accept(_findings(recording), accepted)
    seen = {note.text for note in findings}
    doubts = [note for note in recording.notes if note.level == "warning" and note.text not in seen]
    return ranked((*accept(doubts, accepted), *findings))


def _findings(recording: Recording) -> Notes:
    forces = [recording.of_accelerometer(one.name) for one in recording.accelerometers]
    notes = [note for one in (recording, *forces) for note in integrity(one)]
    spoilt = {note.channel for note in notes if note.level == "error"}
    sound = [gyro.name for gyro in recording.gyros if gyro.name not in spoilt]
    known = {one.name for one in (*recording.gyros, *recording.accelerometers)}
    if not sound or spoilt - known:
        return ranked(notes)
    notes += judged(recording, sound)
    title = SENSED["accelerometer"].titles["angle_random_walk"]
    for force in forces:
        heard = judged(force) if force.gyros[0].name not in spoilt else ()
        # Stamps are those of the gyros.
        own = [one for one in heard if one not in notes]
        notes += [replace(one, text=one.text.replace("angle random walk", title)) for one in own]
    # What a counter that starts over turned is not known.
    wrapped = {note.channel for note in notes if note.name == "wraps"}
    for profile in profiles_of(recording, sound):
        if profile.name not in wrapped:
            notes += encoder.table_notes(recording, profile)
    if recording.table is not None:
        turns = turned(recording.table) / (2.0 * math.pi)
        notes.append(Note(channel="table", text=f"covers {turns:.2f} turns"))
    return ranked(notes)
