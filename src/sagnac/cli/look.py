"""``sagnac check``, ``convert``, ``plan`` and ``app``: a recording looked at before an analysis."""

import json
import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from cyclopts import Parameter

import sagnac
from sagnac.cli import options as typed
from sagnac.cli import output as results
from sagnac.cli.options import NO_OPTIONS, File, Options
from sagnac.core import overwriting, units
from sagnac.core.errors import per_cent, rounded
from sagnac.core.texts import OPTION_OF, by_name, text_of, whole_number
from sagnac.core.version import __version__
from sagnac.report import error_text, findings_data, note_text

if TYPE_CHECKING:
    from sagnac.analysis.planning import Plan, PlanRow


# ---- check -------------------------------------------------------------------------


def check(file: File, /, *, options: Options = NO_OPTIONS) -> int:
    """Data quality: gaps, jumps, wraps, stuck channels, clipping, units that look wrong.

    Exit status 1 if an error was found, or with --strict a warning.
    """
    statement, settings = typed.statement_of(options), typed.settings_of(options)
    recording: sagnac.Recording | None = None
    try:
        with typed.reading(file, options, verify=False) as read:
            recording = read.recording
            read.progress("check", 0.0)
            findings = sagnac.check(recording, accepted=settings.accepted)
    except sagnac.RecordingError:
        if recording is None and not options.as_json:
            _suggest(file, statement)
        raise
    if options.as_json:
        print(json.dumps(_check_document(file, recording, findings), allow_nan=False, indent=1))
    else:
        from sagnac.formats import accelerometers_in
        from sagnac.report import text

        others = [note for note in recording.notes if note not in findings]
        below = text.findings(findings), text.notes(others)
        print(text.blocks(text.recording(recording), *below), end="\n\n")
        turns = recording.table is not None
        print(f"read with: {_command_for(file, statement, {}, turns=turns)}")
        if besides := accelerometers_in(file, statement):
            print(f"with its accelerometers: {_command_for(file, statement, besides, turns=turns)}")
    refused = ("error", "warning") if settings.strict else ("error",)
    errors = [finding for finding in findings if finding.level in refused]
    if not errors:
        return results.DONE
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    results.complain(f"{file}: {note_text(errors[0])}{more}")
    return results.DATA_ERROR


def _suggest(file: Path, statement: "sagnac.Statement") -> None:
    """Print the command that would read a file that states too little.

    Raises
    ------
    RecordingError
        If no statement would let it be read, since it is damaged.
    """
    lacking = sagnac.missing(file, statement)
    if not lacking:
        return
    if "columns" in lacking:
        # They name the gyros, too.
        statement = replace(statement, gyros=None)
    from sagnac.formats import gyros_in
    from sagnac.recording.columns import ACCELEROMETER_NAMES, USUAL_NAMES
    from sagnac.report import sections

    headers = (units.split_header(name)[0] for name in sagnac.columns(file))
    turns = any(header in USUAL_NAMES["table"] for header in headers)
    command = _command_for(file, statement, lacking, turns=turns)
    words = re.findall(r"\b(?:KIND|UNIT|HZ|SIZE|COLUMN)\b", command)
    heading = "To read it, put in what stands in capitals"
    if not words:
        heading = "This reads it"
        try:
            together = _options_of(statement, lacking)
            added = sagnac.keywords({name: together[name] for name in lacking})
            sagnac.read(file, replace(statement, **added), verify=False)
        except sagnac.RecordingError as error:
            heading = f"Even with what is missing stated it cannot be read: {error_text(error)}"
    gyros = gyros_in(file, statement) if "COLUMN" in words else ()
    are_forces = {*gyros} <= {*ACCELEROMETER_NAMES}
    facts = {"said": heading, "command": command, "found": gyros, "are_forces": are_forces}
    print(sections.rendered("to_read.txt", **facts), end="\n\n")


def _command_for(
    file: Path, statement: "sagnac.Statement", besides: Mapping[str, str], *, turns: bool
) -> str:
    """The command that would read a file with what is stated, and with other options besides."""
    options = _options_of(statement, besides)
    turns = turns if "table" not in options else options["table"] != "none"
    # A name that begins with a dash would be taken for an option.
    named = f"./{file}" if str(file).startswith("-") else str(file)
    words = ["sagnac", "analyze" if turns else "avar", shlex.quote(named)]
    for name, value in options.items():
        words += [f"--{name.replace('_', '-')}", shlex.quote(value)]
    return " ".join(words)


def _options_of(statement: "sagnac.Statement", besides: Mapping[str, str]) -> dict[str, str]:
    """Options as they are typed: what is stated, and others, which count for what they name."""
    # The channels first, then what they are.
    named = dict.fromkeys(("gyros", "accelerometers", "columns"))
    named |= {field.name: None for field in fields(statement)}
    stated = {OPTION_OF.get(name, name): getattr(statement, name) for name in named}
    options = {name: text_of(value) for name, value in stated.items() if value not in (None, {})}
    for name, value in besides.items():
        before = options.get(name, "")
        if name == "unit" and before and "=" in value and "=" not in before:
            # One unit for all gyros cannot stand beside one for the accelerometers.
            before = f"gyros={before}"
        is_joined = "=" in before and "=" in value
        options[name] = text_of({**by_name(before), **by_name(value)}) if is_joined else value
    return options


def _check_document(
    file: Path, recording: "sagnac.Recording", findings: "Sequence[sagnac.Note]"
) -> dict[str, Any]:
    """Findings in the schema ``sagnac.check/1``."""
    return {
        "schema": "sagnac.check/1",
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


# ---- convert -----------------------------------------------------------------------


def convert(
    source: Annotated[Path, Parameter(name="IN")],
    target: Annotated[Path, typed.one_argument(typed.path, "OUT", name="OUT")],
    /,
    *,
    options: typed.Reading = typed.NO_STATEMENT,
    force: typed.Force = False,
) -> None:
    """Read a recording and write it so that reading it again needs no option.

    Parameters
    ----------
    source
        A recording.
    target
        Its suffix says the format.
    """
    from sagnac.formats.statement import of_conversion
    from sagnac.report import text

    overwriting.require_free(of_conversion(target), typed.inputs([source], options), force=force)
    with typed.reading(source, options) as read:
        recording = read.recording
    with results.progress_shown() as progress:
        progress("write", 0.0)
        written = sagnac.write(recording, target, force=force)
    print(text.blocks(text.recording(recording), text.notes(recording.notes)))
    results.print_paths([written])


# ---- plan --------------------------------------------------------------------------

_half_widths = typed.of_analysis(typed.several(typed.half_width), "1%,…", show_default=False)
_Within = Annotated[tuple[float, ...], _half_widths]


def plan(
    file: File, /, *, options: Options = NO_OPTIONS, within: _Within = (0.1, 0.05, 0.02, 0.01)
) -> None:
    """How long to record for an interval of N, or to decide --spec, from a short recording.

    Several gyros at rest have a plan each; --gyros picks one.

    Parameters
    ----------
    within
        Half width of the interval of N: 10%,5%,2%,1% unless stated.
    """
    from sagnac.formats.files import about

    settings = typed.settings_of(options)
    with typed.reading(file, options) as read:
        analysis = read.analyzed(settings)
    with about(file):
        plans = sagnac.plan(analysis, within=within)
    refused = {name: error_text(error) for name, error in plans.refused.items()}
    if options.as_json:
        print(json.dumps(_plan_document(plans.plans, refused), allow_nan=False, indent=1))
    else:
        lines = [f"{name}: {why}" for name, why in refused.items()]
        print("\n\n".join([*(_text(one) for one in plans.plans), *lines]))


def _wanted(row: "PlanRow") -> str:
    if row.limit is None:
        return f"± {rounded(100.0 * (row.half_width or 0.0), 3)} %"
    return f"{row.limit.in_words} decided, 90 % sure"


def _text(plan: "Plan") -> str:
    from sagnac.report import sections, text

    shown = plan.shown
    interval = f"± {rounded(100.0 * shown.half_width)} % at {per_cent(shown.confidence)}"
    reached = f"After {_spoken(shown.duration / 3600.0)} the interval is {interval}."
    forecast = sections.rendered("forecast.txt", analysis=plan.analysis, shown=shown)
    listed = [(_wanted(row), _spoken(row.hours)) for row in plan.rows]
    table = text.table(("interval of N", "record"), listed)
    return text.blocks(text.answer(plan.analysis), reached, forecast, table)


def _spoken(hours: float | None) -> str:
    if hours is None:
        return "over a year"
    if hours < 1.0:
        return f"{60.0 * hours:.2g} min" if hours >= 1.0 / 60.0 else f"{3600.0 * hours:.2g} s"
    return f"{hours:.3g} h" if hours < 100.0 else f"{hours / 24.0:.3g} days"


def _plan_document(plans: "Sequence[Plan]", refused: Mapping[str, str]) -> dict[str, Any]:
    """The plan of the first gyro, and if there are several that of each by name."""
    document = {"schema": "sagnac.plan/1", "version": __version__, **_plain(plans[0])}
    if len(plans) > 1:
        document["gyros"] = {plan.analysis.channel: _plain(plan) for plan in plans}
    if refused:
        document["refused"] = refused
    return document


def _plain(plan: "Plan") -> dict[str, Any]:
    shown = plan.shown
    return {
        "channel": plan.analysis.channel,
        "recorded_h": shown.duration / 3600.0,
        "half_width": shown.half_width,
        "confidence": shown.confidence,
        "supposes": "whole band" if shown.efficient else "average",
        "plan": [
            {"half_width": row.half_width, "hours": row.hours}
            if row.limit is None
            else {"limit_rad_per_sqrt_s": row.limit.value, "hours": row.hours}
            for row in plan.rows
        ],
    }


# ---- app ---------------------------------------------------------------------------


def app(
    file: Annotated[Path | None, Parameter(name="FILE")] = None,
    /,
    *,
    port: Annotated[int, typed.one_argument(whole_number, "N", group=typed.OUTPUT)] = 0,
    no_browser: Annotated[bool, Parameter(group=typed.OUTPUT)] = False,
    debug: typed.Debug = False,
) -> None:
    """A page to work in, for this machine alone: open, understand and analyze a recording.

    Prints its address, which holds a token, on one line, and serves it until it is interrupted.
    Files are opened and written below the folder of FILE, else the current one.

    Parameters
    ----------
    file
        A recording, or a folder of recordings.
    port
        To listen on; any that is free.
    no_browser
        Print the address, open nothing.
    """
    if not 0 <= port <= 65_535:
        raise results.UsageError(f"--port is {port}; give 1 to 65535, or 0 for any that is free")
    from sagnac.app.server import serve

    def opened(address: str) -> None:
        print(address, flush=True)
        if not no_browser:
            import threading
            import webbrowser

            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()

    serve(file, port=port, opened=opened)


COMMANDS: Final = (check, convert, plan, app)
