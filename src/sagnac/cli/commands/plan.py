"""``sagnac plan``: how long to record."""

import json
from collections.abc import Mapping, Sequence
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
    from sagnac.analysis.planning import Plan, PlanRow
    from sagnac.analysis.result import Analysis
    from sagnac.errors import RecordingError
    from sagnac.specification.planning import Shown

SCHEMA: Final = "sagnac.plan/1"


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
    widths = None if within is None else _widths(within)
    with progresses.shown() as progress:
        read = read_file(file, statement, progress, memory=options.memory)
        from sagnac.analysis.pipeline import analyze as run
        from sagnac.analysis.planning import WIDTHS
        from sagnac.analysis.planning import plan as planned

        with naming(file, read.recording):
            analysis = run(read.recording, settings, progress=progress)
            try:
                found = planned(analysis, within=widths or WIDTHS)
            except ValueError as error:
                if type(error) is not ValueError:
                    raise
                raise UsageError(f"--{error}") from None
    if options.as_json:
        print(json.dumps(_document(found.plans, found.refused), allow_nan=False, indent=1))
    else:
        said = [f"{name}: {why}" for name, why in _texts(found.refused).items()]
        print("\n\n".join([*(_text(one) for one in found.plans), *said]))
    return DONE


def _texts(refused: "Mapping[str, RecordingError]") -> dict[str, str]:
    from sagnac.report.command_line import error_text

    return {name: error_text(error) for name, error in refused.items()}


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


def _wanted(row: "PlanRow") -> str:
    if row.limit is None:
        return f"± {rounded(100.0 * (row.half_width or 0.0), 3)} %"
    return f"N ≤ {row.limit.in_unit:.6g} {row.limit.unit.symbol} decided, 90 % sure"


def _text(plan: "Plan") -> str:
    from sagnac.report import text

    shown = plan.shown
    listed = [(_wanted(row), _spoken(row.hours)) for row in plan.rows]
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
    """Basis of a longer recording's answer, as the forecast takes it."""
    resting = analysis.average
    supposed = "whole band" if shown.efficient else "average"
    now = resting is not None and resting.member == supposed
    verb = "stays" if now else "becomes"
    if not shown.efficient:
        said = f"Forecast for an answer that {verb} an average over bands of the spectrum."
        if "bias_instability" in shown.coefficients:
            return said
        return f"{said}\nB is not estimated yet: one that a longer record shows widens it."
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


def _document(plans: "Sequence[Plan]", refused: "Mapping[str, RecordingError]") -> dict[str, Any]:
    """The plan of the first gyro, and if there are several that of each by name."""
    document = {"schema": SCHEMA, "version": __version__, **_plain(plans[0])}
    if len(plans) > 1:
        document["gyros"] = {plan.analysis.channel: _plain(plan) for plan in plans}
    if refused:
        document["refused"] = _texts(refused)
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
