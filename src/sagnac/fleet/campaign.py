"""A campaign from recordings to its table and page."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import partial
from inspect import signature
from itertools import chain
from pathlib import Path
from typing import Any

from sagnac.analysis.settings import Settings
from sagnac.core import arrays, errors, processes
from sagnac.core.overwriting import outputs_in, require_free
from sagnac.fleet import table
from sagnac.fleet.page import write_overview, write_page
from sagnac.fleet.runner import Campaign, Completed, completed_here, completed_there, run
from sagnac.fleet.tasks import Choices, tasks_of
from sagnac.formats.statement import Statement


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignReport:
    """A campaign that has been done and written.

    Attributes
    ----------
    campaign
        Its rows.
    lines
        Of the table: N, its interval and its status for each gyro of each recording.
    paths
        Page, tables and picture.
    replaced
        Lines of another campaign that the table in the folder had before.

    Examples
    --------
    That of no recordings; `campaign` makes one of some.

    >>> from sagnac.fleet.runner import Campaign
    >>> report = CampaignReport(campaign=Campaign(rows=(), computed=0), lines=(), paths=())
    >>> report.to_frame().empty, report.campaign.failed
    (True, ())
    """

    campaign: Campaign
    lines: tuple[table.Line, ...]
    paths: tuple[Path, ...]
    replaced: int = 0

    def __repr__(self) -> str:
        rows, failed = errors.counted(len(self.campaign.rows), "row"), len(self.campaign.failed)
        return f"<CampaignReport of {rows}, {failed} without an answer; N stands in .lines>"

    @property
    def scatter(self) -> dict[tuple[str, str], table.Scatter]:
        """How N scatters, deg/sqrt(h), by method and gyros."""
        return {key: table.scatter_of(own) for key, own in table.groups_of(self.lines).items()}

    def to_frame(self) -> Any:
        """The table as a pandas frame; column names carry the units.

        Raises
        ------
        MissingExtra
            If pandas is not installed.
        """
        rows = [asdict(line) for line in self.lines]
        return arrays.pandas_for("a campaign as a data frame").DataFrame(rows)


def campaign(
    sources: str | Path | Sequence[str | Path],
    folder: str | Path,
    settings: Settings | None = None,
    *,
    pattern: str = "",
    span: float | None = None,
    workers: int | None = None,
    memory: float | None = None,
    scheduler: str | None = None,
    told: processes.Told | None = None,
    force: bool = False,
    **choices: Any,
) -> CampaignReport:
    """Analyze many recordings, and put them together in one table and on one page.

    Parameters
    ----------
    sources
        A TOML of a campaign, or recordings and folders of recordings.
    folder
        ``campaign.csv``, ``campaign.parquet``, ``index.html``, ``campaign.png`` and the reports go
        into it. What an earlier start with the same folder has done is kept.
    settings
        For all recordings; ``Settings()`` unless given.
    pattern
        A regular expression that finds ``(?P<unit>…)``, ``(?P<day>…)`` and ``(?P<rate>…)`` in the
        path of a recording.
    span
        Also cut each recording into spans of this length, s.
    workers, memory
        Processes on this machine, and bytes that they may take together.
    scheduler
        Address of a Dask cluster to work on instead, ``tcp://host:8786``.
    told
        Called with where it stands after each recording.
    force
        Replace a table or page there that no campaign made, too.
    **choices
        Fields of `Settings` and of `sagnac.formats.Statement`, for all recordings:
        ``method="none"``, ``kind="rate"``, ``unit="deg/h"``, ``sample_rate=100.0``.

    Returns
    -------
    CampaignReport
        A recording that is not there or cannot be analyzed is a row that says why.

    Raises
    ------
    RecordingError
        If the TOML of a campaign cannot be read, a folder holds no recording, the one for the
        results cannot be written to, or a cluster has no workers.
    WouldOverwrite
        If a table or page is there that no campaign made, and `force` is not set.
    ValueError
        If a choice cannot be.
    TypeError
        If a choice is a field of neither.

    Examples
    --------
    >>> import numpy as np
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from sagnac import Recording, write
    >>> random = np.random.default_rng(1)
    >>> with TemporaryDirectory() as place:
    ...     rack = Path(place) / "rack"
    ...     rack.mkdir()
    ...     rate = random.standard_normal(3000)
    ...     still = Recording.from_arrays(x=rate, kind="rate", unit="deg/h", sample_rate=10.0)
    ...     path = write(still, rack / "A.npz")
    ...     report = campaign(rack, Path(place) / "report", workers=1, method="none")
    >>> [(Path(line.file).name, line.state, line.gyros) for line in report.lines]
    [('A.npz', 'done', 'x')]
    """
    listed = errors.as_several(sources)
    if not listed or not all(isinstance(source, str | Path) for source in listed):
        problem = f"is {errors.quoted(sources)}; give paths of recordings, or of a folder"
        raise errors.ArgumentTypeError("sources", problem)
    errors.require_progress(told, "told")
    if span is not None and not (errors.is_finite(span) and span > 0.0):
        raise errors.refusal("span", f"is {errors.quoted(span)}; give seconds above zero")
    paths, place = [Path(source) for source in listed], errors.path_of("folder", folder).absolute()
    tasks = tasks_of(paths, _choices(settings or Settings(), pattern, choices))
    if scheduler is not None and (workers is not None or memory is not None):
        raise ValueError("workers and memory are of this machine; a cluster has its own")
    completed: Completed = partial(completed_here, means=processes.means_of(workers, memory))
    if scheduler is not None:
        completed = partial(completed_there, scheduler=scheduler)
    require_free(outputs_in(place, "campaign"), [Path(task.path) for task in tasks], force=force)
    made = run(tasks, place, completed, span, told or processes.nobody)
    lines = tuple(table.lines_of(made.each))
    replaced = table.rows_replaced(place, made.rows)
    title = paths[0].stem if len(paths) == 1 else f"{len(tasks)} recordings"
    page, tables = write_page(made, lines, place, title), table.write_tables(lines, place)
    written = (page, *tables, *write_overview(lines, table.walk_limits(made), place))
    return CampaignReport(campaign=made, lines=lines, replaced=replaced, paths=written)


def _choices(settings: Settings, pattern: str, given: dict[str, Any]) -> Choices:
    """Each choice where it belongs; the gyros belong to both."""
    names = [[one.name for one in fields(kind)] for kind in (Settings, Statement)]
    known = dict.fromkeys((*signature(campaign).parameters, *chain(*names)))
    remedy = "give Settings(...), or its fields by name"
    errors.require_type("settings", settings, Settings, remedy)
    errors.require_type("pattern", pattern, str, "give a regular expression")
    errors.require_keywords("campaign", given, (name for name in known if name != "choices"))
    own, stated = ({name: given[name] for name in each if name in given} for each in names)
    settings, statement = replace(settings, **own), Statement(**stated)
    return Choices(settings=settings, stated=own, statement=statement, pattern=pattern)
