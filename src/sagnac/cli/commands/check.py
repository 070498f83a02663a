"""``sagnac check``: the quality of the data."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from sagnac.cli import progress as progresses
from sagnac.cli.errors import DATA_ERROR, DONE, complain
from sagnac.cli.options import NO_OPTIONS, File, Options, one_or_by_name, settings_of, statement_of
from sagnac.cli.reading import (
    command_for,
    command_with_accelerometers,
    naming,
    read_file,
)
from sagnac.cli.settings_file import with_settings
from sagnac.errors import RecordingError
from sagnac.version import __version__

if TYPE_CHECKING:
    from sagnac.errors import Note
    from sagnac.formats import Statement
    from sagnac.recording.model import Recording

SCHEMA: Final = "sagnac.check/1"


def check(file: File, /, *, options: Options = NO_OPTIONS) -> int:
    """Data quality: gaps, jumps, wraps, stuck channels, clipping, units that look wrong.

    Exit status 1 if an error was found, or with --strict a warning.
    """
    options = with_settings(options)
    statement = statement_of(options)
    settings = settings_of(options)
    with progresses.shown() as progress:
        try:
            recording = read_file(
                file, statement, progress, memory=options.memory, verify=False
            ).recording
        except RecordingError:
            if not options.as_json:
                _suggest(file, statement)
            raise
        from sagnac.recording.quality import check as findings_of

        progress("check", 0.0)
        with naming(file, recording):
            findings = findings_of(recording, accepted=settings.accepted)
    if options.as_json:
        print(json.dumps(_document(file, recording, findings), allow_nan=False, indent=1))
    else:
        from sagnac.report import text

        print(
            text.blocks(
                text.recording(recording), text.findings(findings), text.notes(recording.notes)
            ),
            f"read with: {command_for(file, statement)}",
            sep="\n\n",
        )
        if (command := command_with_accelerometers(file, statement)) is not None:
            print(f"with its accelerometers: {command}")
    refused = ("error", "warning") if settings.strict else ("error",)
    errors = [finding for finding in findings if finding.level in refused]
    if not errors:
        return DONE
    from sagnac.report.command_line import note_text

    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    complain(f"{file}: {note_text(errors[0])}{more}")
    return DATA_ERROR


def _suggest(file: Path, statement: "Statement") -> None:
    """Print the command that would read a file that states too little; nothing if it is wrong."""
    from sagnac.formats import missing

    try:
        lacking = missing(file, statement)
    except RecordingError:
        return
    if not lacking:
        return
    command = command_for(file, statement, lacking)
    words = re.findall(r"\b(?:KIND|UNIT|HZ|SIZE|COLUMN)\b", command)
    said = "To read it, put in what stands in capitals"
    if not words:
        said = _outcome(file, statement, lacking)
    print(f"{said}:\n\n    {command}\n")
    if "COLUMN" in words:
        from sagnac.formats import gyros_in

        if found := gyros_in(file, statement):
            print(f"COLUMN may be any of {', '.join(found)}\n")


def _outcome(file: Path, statement: "Statement", lacking: Mapping[str, str]) -> str:
    """Outcome for a file once what is lacking is stated, in words."""
    from sagnac.formats import read
    from sagnac.report.command_line import error_text

    parsed: dict[str, Any] = {
        name: one_or_by_name(value) if name in ("columns", "kind", "unit") else value
        for name, value in lacking.items()
    }
    if "columns" in lacking:
        parsed["gyros"] = None
    try:
        read(file, replace(statement, **parsed), verify=False)
    except RecordingError as error:
        return f"Even with what is missing stated it cannot be read: {error_text(error)}"
    return "This reads it"


def _document(file: Path, recording: "Recording", findings: "Sequence[Note]") -> dict[str, Any]:
    """Findings in the schema ``sagnac.check/1``."""
    from sagnac.report.command_line import findings_data, note_text

    return {
        "schema": SCHEMA,
        "version": __version__,
        "input": {
            "path": str(file),
            "sha256": recording.provenance.sha256 if recording.provenance else None,
            "samples": recording.samples,
            "sample_rate_hz": recording.sample_rate,
            "gyros": [channel.name for channel in recording.gyros],
            "table": recording.table is not None,
        },
        "findings": [{**one, "message": one["text"]} for one in findings_data(findings)],
        "notes": [note_text(note) for note in recording.notes],
    }
