"""``sagnac plan``: how long to record."""

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Final

from cyclopts import Parameter

from sagnac.cli import progress as progresses
from sagnac.cli.errors import DONE, UsageError
from sagnac.cli.options import ANALYSIS, NO_OPTIONS, File, Options, names, settings_of, statement_of
from sagnac.cli.reading import naming, read_file
from sagnac.cli.settings_file import with_settings
from sagnac.errors import rounded
from sagnac.version import __version__

if TYPE_CHECKING:
    from sagnac.analysis.result import Analysis
    from sagnac.specification.planning import Shown

SCHEMA: Final = "sagnac.plan/1"
_WIDTHS: Final = (0.1, 0.05, 0.02, 0.01)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Row:
    """A wanted interval, or a limit to decide, and the hours that it takes; None if over a year."""

    wanted: str
    key: dict[str, float]
    hours: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Plan:
    """What a gyro or a difference shows, and what it would take."""

    analysis: "Analysis"
    shown: "Shown"
    rows: list[_Row]


def plan(
    file: File,
    /,
    *,
    options: Options = NO_OPTIONS,
    within: Annotated[
        str | None,
        Parameter(
            group=ANALYSIS,
            metavar="1%,…",
            help="Half width of the interval of N: 10%,5%,2%,1% unless stated.",
        ),
    ] = None,
) -> int:
    """How long to record for an interval of N, or to decide --spec, from a short recording.

    Several gyros at rest have a plan each; --gyros picks one.
    """
    options = with_settings(options)
    statement, settings = statement_of(options), settings_of(options)
    widths = _WIDTHS if within is None else _widths(within)
    with progresses.shown() as progress:
        read = read_file(file, statement, progress, memory=options.memory)
        from sagnac.analysis.pipeline import analyze as run

        with naming(file, read.recording):
            analysis = run(read.recording, settings, progress=progress)
            plans, refused = _plans(analysis, widths)
    if options.as_json:
        print(json.dumps(_document(plans, refused), allow_nan=False, indent=1))
    else:
        said = [f"{name}: {why}" for name, why in refused.items()]
        print("\n\n".join([*(_text(one) for one in plans), *said]))
    return DONE


def _plans(analysis: "Analysis", widths: tuple[float, ...]) -> tuple[list[_Plan], dict[str, str]]:
    """A plan for each gyro that was taken alone, and why there is none of the others."""
    from sagnac.errors import RecordingError
    from sagnac.report.command_line import error_text

    plans: list[_Plan] = []
    errors = dict(analysis.refused)
    for name, one in (analysis.gyros or {analysis.channel: analysis}).items():
        try:
            plans.append(_plan(one, widths))
        except RecordingError as error:
            errors[name] = error
    if not plans:
        raise next(iter(errors.values()))
    return plans, {name: error_text(error) for name, error in errors.items()}


def _plan(analysis: "Analysis", widths: tuple[float, ...]) -> _Plan:
    from sagnac.analysis.forecast import shown_by

    shown = shown_by(analysis)
    rows = [*(_width(shown, width) for width in widths), *_limits(shown, analysis)]
    return _Plan(analysis=analysis, shown=shown, rows=rows)


def _widths(text: str) -> tuple[float, ...]:
    found = []
    for one in names(text):
        try:
            value = float(one.removesuffix("%")) / (100.0 if one.endswith("%") else 1.0)
        except ValueError:
            value = 0.0
        if not 0.0 < value < 1.0:
            raise UsageError(f"--within {one}: give a half width such as 1% or 0.01")
        found.append(value)
    return tuple(found)


def _width(shown: "Shown", width: float) -> _Row:
    from sagnac.errors import RecordingError

    try:
        hours = shown.duration_for(width) / 3600.0
    except RecordingError:
        hours = None
    return _Row(wanted=f"± {rounded(100.0 * width, 3)} %", key={"half_width": width}, hours=hours)


def _limits(shown: "Shown", analysis: "Analysis") -> list[_Row]:
    """Limits of N; others are not forecast."""
    from sagnac.errors import RecordingError

    specification = analysis.settings.specification
    rows = []
    for limit in specification.limits if specification else ():
        if limit.coefficient != "angle_random_walk":
            raise UsageError(f"--spec {limit.letter}: only an interval of N is forecast")
        try:
            hours = shown.duration_to_decide(limit.value) / 3600.0
        except RecordingError:
            hours = None
        wanted = f"N ≤ {limit.in_unit:.6g} {limit.unit.symbol} decided, 90 % sure"
        rows.append(_Row(wanted=wanted, key={"limit_rad_per_sqrt_s": limit.value}, hours=hours))
    return rows


def _text(plan: _Plan) -> str:
    from sagnac.report import text

    shown = plan.shown
    listed = [(row.wanted, _spoken(row.hours)) for row in plan.rows]
    return "\n\n".join(
        (
            text.answer(plan.analysis),
            f"After {_spoken(shown.duration / 3600.0)} the interval is "
            f"± {rounded(100.0 * shown.half_width)} % at {100.0 * shown.confidence:g} %.",
            _supposition(plan.analysis, shown),
            text.table(("interval of N", "record"), listed),
        )
    )


def _supposition(analysis: "Analysis", shown: "Shown") -> str:
    """What the forecast takes a longer recording's answer to rest on."""
    resting = analysis.average
    supposed = "whole band" if shown.efficient else "average"
    now = resting is not None and resting.member == supposed
    verb = "stays" if now else "becomes"
    if not shown.efficient:
        return f"Forecast for an answer that {verb} an average over bands of the spectrum."
    return (
        f"Forecast for an answer that {verb} the likelihood of the whole\n"
        f"band to {shown.highest:.3g} Hz. An average over bands would have another interval."
    )


def _spoken(hours: float | None) -> str:
    if hours is None:
        return "over a year"
    if hours < 1.0:
        return f"{60.0 * hours:.2g} min" if hours >= 1.0 / 60.0 else f"{3600.0 * hours:.2g} s"
    return f"{hours:.3g} h" if hours < 100.0 else f"{hours / 24.0:.3g} days"


def _document(plans: list[_Plan], refused: dict[str, str]) -> dict[str, Any]:
    """The plan of the first gyro, and if there are several that of each by name."""
    document = {"schema": SCHEMA, "version": __version__, **_plain(plans[0])}
    if len(plans) > 1:
        document["gyros"] = {plan.analysis.channel: _plain(plan) for plan in plans}
    if refused:
        document["refused"] = refused
    return document


def _plain(plan: _Plan) -> dict[str, Any]:
    shown = plan.shown
    return {
        "channel": plan.analysis.channel,
        "recorded_h": shown.duration / 3600.0,
        "half_width": shown.half_width,
        "confidence": shown.confidence,
        "supposes": "whole band" if shown.efficient else "average",
        "plan": [{**row.key, "hours": row.hours} for row in plan.rows],
    }
