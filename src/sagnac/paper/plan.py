"""The runs that the figures and tables need."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Final, Literal, get_args

from sagnac.analysis.settings import Method
from sagnac.paper.laboratory import on_day
from sagnac.paper.published import FIGURE_3, PAIR, TABLE_1, TABLE_2
from sagnac.paper.trials import Preparation, config_of_run, trials
from sagnac.rig.config import RigConfig
from sagnac.rig.sections import GyroMode
from sagnac.version import __version__

RUN_SCHEMA: Final = "sagnac.reproduction-run/2"
Table = Literal["table1", "table2"]
_MODE_OF_TABLE: Final[Mapping[Table, GyroMode]] = {"table1": "dithered", "table2": "rate-biased"}
_FIRST_SEED: Final[Mapping[Table, int]] = {"table1": 1000, "table2": 2000}
_CELL_OF_FIGURE_2: Final[tuple[Table, float]] = ("table2", 40.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scope:
    """How much is simulated.

    Attributes
    ----------
    table_duration_s
        Length of each recording of Tables 1 and 2 (and so of Figures 4 to 6), s.
    figure_duration_s
        Length of those of Figures 2 and 3, s; below two hours they have too few points to
        fit five terms to.
    days
        Recordings per table cell, 1 to 3: the paper's days, here seeds.

    Raises
    ------
    ValueError
        If `days` is not 1, 2 or 3, or a duration is not positive.
    """

    table_duration_s: float = 7200.0
    figure_duration_s: float = 7200.0
    days: int = 3

    def __post_init__(self) -> None:
        if not 1 <= self.days <= 3:
            raise ValueError(f"days is {self.days}; the paper has three, give 1 to 3")
        for name in ("table_duration_s", "figure_duration_s"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} is {getattr(self, name)!r}; it must be positive")


FULL: Final = Scope()
# Half an hour: in less, the preset's 0.0137 Hz line cannot be told from the random walk.
QUICK: Final = Scope(table_duration_s=1800.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One recording and one analysis of it.

    `preparation` ``rate`` takes one mean rate over 1 s in each interval instead of the angle.
    `by_curve` takes the fit of the Allan curve as the answer whatever the method: Step 4.
    `as_printed` takes Steps 1 to 3 in the paper's order, with no lowest frequency.

    Raises
    ------
    ValueError
        If there are not one or two gyros, or the preparation is not known.
    """

    name: str
    config: RigConfig
    gyros: tuple[str, ...]
    method: Method
    interval_s: float = 1.0
    preparation: Preparation = "angle"
    by_curve: bool = False
    as_printed: bool = False

    def __post_init__(self) -> None:
        if not 1 <= len(self.gyros) <= 2:
            raise ValueError(f"gyros are {self.gyros!r}; give one, or two to be differenced")
        if self.preparation not in get_args(Preparation):
            choices = ", ".join(get_args(Preparation))
            raise ValueError(f"preparation is {self.preparation!r}; use one of {choices}")

    @property
    def key(self) -> str:
        """Name and a digest of everything the result depends on."""
        what = json.dumps({"schema": RUN_SCHEMA, "version": __version__, **asdict(self)})
        return f"{self.name}-{hashlib.sha256(what.encode()).hexdigest()[:12]}"


def cell_name(table: Table, rate: float, day: int) -> str:
    """Name of the run of one table cell; days count from 1."""
    return f"{table}-{rate:g}-day{day}"


def published_cell_name(table: Table, rate: float, day: int) -> str:
    """Name of the run of one table cell by the paper's method."""
    return f"{cell_name(table, rate, day)}-paper"


def printed_cell_name(table: Table, rate: float, day: int) -> str:
    """Name of the run of one table cell by the paper's method in the paper's order."""
    return f"{cell_name(table, rate, day)}-printed"


def plan(scope: Scope) -> tuple[Run, ...]:
    """Every run; those of one recording stand together."""
    tables = _runs_of_table("table1", TABLE_1, scope) + _runs_of_table("table2", TABLE_2, scope)
    return (*tables, *_runs_of_figure_3(scope))


def _runs_of_table(
    table: Table, published: Mapping[float, tuple[float, ...]], scope: Scope
) -> list[Run]:
    """Runs of every cell, ours and the paper's; the recording of Figure 2 comes after its cell."""
    runs: list[Run] = []
    for rate in published:
        for day in range(1, scope.days + 1):
            seed = _FIRST_SEED[table] + round(rate) * 10 + day
            config = config_of_run(_MODE_OF_TABLE[table], rate, seed, scope.table_duration_s)
            config = on_day(config, seed)
            runs.append(
                Run(name=cell_name(table, rate, day), config=config, gyros=PAIR, method="fos")
            )
            # At rest the paper removes nothing.
            runs.append(
                Run(
                    name=published_cell_name(table, rate, day),
                    config=config,
                    gyros=PAIR,
                    method="fos-paper" if rate > 0.0 else "none",
                    by_curve=True,
                )
            )
            if rate > 0.0:
                runs.append(
                    Run(
                        name=printed_cell_name(table, rate, day),
                        config=config,
                        gyros=PAIR,
                        method="fos-paper",
                        by_curve=True,
                        as_printed=True,
                    )
                )
            if (table, rate) == _CELL_OF_FIGURE_2:
                long = replace(config, duration_s=scope.figure_duration_s)
                runs.append(Run(name=f"figure2-day{day}", config=long, gyros=PAIR, method="fris"))
    return runs


def _runs_of_figure_3(scope: Scope) -> list[Run]:
    return [
        Run(
            name=f"figure3-{trial.name}-{interval:g}s",
            config=trial.config,
            gyros=("z",),
            method=trial.method,
            interval_s=interval,
            preparation=trial.preparation,
        )
        for trial in trials(scope.figure_duration_s)
        for interval in FIGURE_3
    ]
