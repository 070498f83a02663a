"""``sagnac campaign``: many recordings, one table, one page; resumes."""

import math
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from cyclopts import Group, Parameter

import sagnac
from sagnac.cli import output as results
from sagnac.cli.options import (
    NO_OPTIONS,
    OUTPUT,
    Force,
    Options,
    Workers,
    one_argument,
    settings_of,
    statement_of,
)
from sagnac.cli.output import DATA_ERROR, DONE, UsageError, complain, standings
from sagnac.errors import counted, one_line
from sagnac.texts import seconds

if TYPE_CHECKING:
    from sagnac.fleet.table import Line

_WORK = Group("Work", sort_key=2)
# Rows with a reason that a terminal shows.
_MOST_REASONS: Final = 20


def campaign(
    sources: Annotated[list[Path], Parameter(name="SOURCE")],
    /,
    *,
    options: Options = NO_OPTIONS,
    output: Annotated[Path, Parameter(name=["-o", "--output"], group=OUTPUT, metavar="DIR")],
    pattern: Annotated[str, Parameter(group=_WORK, metavar="REGEX", show_default=False)] = "",
    span: Annotated[float | None, one_argument(seconds, group=_WORK, metavar="2h")] = None,
    workers: Annotated[Workers, Parameter(group=_WORK)] = None,
    scheduler: Annotated[str | None, Parameter(group=_WORK, metavar="ADDRESS")] = None,
    force: Force = False,
) -> int:
    """Many recordings in; one table and one page out, a report for each.

    campaign.csv, campaign.parquet, index.html and campaign.png go into DIR. Started again with the
    same DIR it does only what is not there yet. The exit status is 1 if a recording could not be
    analyzed; else, with --spec, 3 if a gyro fails and 4 if one is undecided.

    Parameters
    ----------
    sources
        A CONFIG.toml, or recordings and folders of them.
    output
        Folder.
    pattern
        Finds (?P<unit>…), (?P<day>…) and (?P<rate>…) in the path of a recording.
    span
        Also cut each recording into spans of this length: N against time.
    scheduler
        Of a Dask cluster, tcp://host:8786, to work on.
    """
    from sagnac.fleet.page import reason_text
    from sagnac.fleet.table import yield_of

    if options.as_json:
        raise UsageError("--json is not for a campaign; its table is campaign.csv")
    settings, statement = settings_of(options), statement_of(options)
    stated = {one.name: getattr(statement, one.name) for one in fields(statement)}
    results.require_writable(output)
    results.ready_to_draw()
    try:
        made = sagnac.campaign(
            sources, output, settings, pattern=pattern, span=span, workers=workers,
            memory=options.memory, scheduler=scheduler, told=standings(), force=force,
            **{name: value for name, value in stated.items() if value},
        )  # fmt: skip
    except KeyboardInterrupt:
        complain(f"stopped; start the same campaign again, and it goes on ({output.absolute()})")
        raise
    except ValueError as error:
        if type(error) is not ValueError:
            raise
        raise UsageError(f"--{error}") from error
    _print(made, output, settings.confidence)
    failed = made.campaign.failed
    for row in failed:
        complain(reason_text(row.task.path, row.result.reason))
    found = yield_of(made.campaign)
    if failed or found is None:
        return DATA_ERROR if failed else DONE
    return results.status_of(found.decision)


def _print(report: "sagnac.CampaignReport", output: Path, confidence: float) -> None:
    from sagnac.fleet.page import deviation_words
    from sagnac.fleet.table import groups_of, scatter_of, specifications_of, yield_of
    from sagnac.report.quantities import number

    made, lines = report.campaign, report.lines
    groups = groups_of(lines)
    several = len({method for method, _ in groups}) > 1
    for (method, gyros), group in groups.items():
        done = [line for line in group if line.state == "done"]
        scatter = scatter_of(done, confidence)
        by = f" by {method}" if several else ""
        print(f"{gyros or 'no gyro'}{by}: {len(done)} of {len(group)} recordings analyzed")
        if scatter.found is None:
            continue
        mean = scatter.found.mean
        print(f"  mean N  {number(mean.value)} °/√h  [{number(mean.low)}, {number(mean.high)}]")
        for name, value, interval in deviation_words(scatter.found):
            print(f"  scatter {name}: {value}  [{interval.replace(' … ', ', ')}]")
        for name, why in scatter.found.hidden.items():
            print(f"  scatter between {name}s is not observable: {why}")
    for line in lines:
        if line.same_as:
            print(f"{line.file}: has the data of {line.same_as}, and does not count")
    found = yield_of(made)
    if found is not None:
        limits = [limit.in_words for one in specifications_of(made) for limit in one.limits]
        print(f"{', '.join(limits)}: {found.in_words()}; {found.share_in_words()}")
    _print_reasons(lines)
    kept = len(made.rows) - made.computed
    before = f", {kept} kept from an earlier start, which was resumed" if kept else ""
    print(f"{counted(made.computed, 'row')} analyzed now{before}")
    if report.replaced:
        lost = counted(report.replaced, "line")
        print(f"replaced the earlier campaign.csv: {lost} of it are not of this campaign")
    results.print_paths([output / path.name for path in report.paths])


def _print_reasons(lines: "Sequence[Line]") -> None:
    """Rows without an estimate, or that do not pass, each with its reason; the table has all."""
    told = [
        line
        for line in lines
        if line.state == "done" and line.reason and math.isnan(line.start_s) and not line.same_as
    ]
    for line in told[:_MOST_REASONS]:
        said = line.verdict or line.status
        print(f"{Path(line.file).name}, gyro {line.gyros}: {said}: {one_line(line.reason)}")
    if len(told) > _MOST_REASONS:
        print(f"… and {len(told) - _MOST_REASONS} more: column reason of campaign.csv")
