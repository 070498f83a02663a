"""Channels that are analyzed one by one: what one does not give does not cost the others."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Protocol

from sagnac.analysis.result import Alone, Analysis
from sagnac.analysis.settings import Progress, Settings
from sagnac.analysis.trust import require_strict
from sagnac.core.errors import Note, RecordingError
from sagnac.quality.check import accept
from sagnac.quality.effects import effect_words
from sagnac.quality.profile import profile_of
from sagnac.quality.repeats import pair_notes
from sagnac.recording.model import Recording


class Run(Protocol):
    """A function that analyzes a recording."""

    def __call__(
        self, recording: Recording, settings: Settings, /, *, progress: Progress | None = None
    ) -> Analysis:
        """The analysis."""


def gyros_alone(
    recording: Recording, settings: Settings, run: Run, progress: Progress | None
) -> Analysis:
    """Several gyros at rest, each alone: `Analysis.of_gyros`.

    Parameters
    ----------
    recording, settings
        With the gyros that the settings name, two or more.
    run
        What analyzes one.
    progress
        Called with the stage and the fraction of it done.

    Raises
    ------
    RecordingError
        The first refusal, if no gyro gives anything or the settings are strict.
    """
    names = settings.gyros
    alone = each_alone(dict.fromkeys(names, recording), settings, run, progress)
    if not alone.analyses:
        raise next(iter(alone.refused.values()))
    beside = accept(_beside_each_other(recording, tuple(alone.analyses)), settings.accepted)
    require_strict(beside, settings)
    return Analysis.of_gyros(alone, names, beside)


def each_alone(
    recordings: Mapping[str, Recording], settings: Settings, run: Run, progress: Progress | None
) -> Alone:
    """Channels one by one; what one of them does not give does not cost the others.

    Parameters
    ----------
    recordings
        Channel -> recording that holds it.
    settings
        For all of them; if they are strict, every refusal is an error.
    run
        What analyzes one.
    progress
        Called with the stage, the channel before it, and the fraction of it done.

    Raises
    ------
    RecordingError
        For a channel that is refused, if the settings are strict.
    """
    analyses: dict[str, Analysis] = {}
    refused: dict[str, RecordingError] = {}
    for name, recording in recordings.items():

        def told(stage: str, fraction: float, name: str = name) -> None:
            if progress is not None:
                progress(f"{name}: {stage}", fraction)

        try:
            found = run(recording, replace(settings, gyros=(name,)), progress=told)
        except RecordingError as error:
            if settings.strict:
                raise
            refused[name] = error
        else:
            analyses[name] = _without_notes_of_others(found, name)
    return Alone(analyses=analyses, refused=refused)


def _without_notes_of_others(analysis: Analysis, name: str) -> Analysis:
    """An analysis of one channel without what reading noticed of the others."""
    recording = analysis.recording
    others = {one.name for one in (*recording.gyros, *recording.accelerometers)} - {name}
    notes = tuple(note for note in analysis.notes if note.channel not in others)
    return replace(analysis, notes=notes)


def _beside_each_other(recording: Recording, names: tuple[str, ...]) -> tuple[Note, ...]:
    """Findings of gyros on each other; at rest they spoil no answer, since each is taken alone."""
    profiles = {name: profile_of(recording.gyro(name)) for name in names}
    return tuple(
        replace(
            note,
            level="warning",
            text=note.text.removesuffix(f"; {effect_words(note.effect)}"),
            effect=None,
        )
        for note in pair_notes(profiles)
    )
