"""The runs that the figures and tables need."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Final, Literal

from sagnac import __version__
from sagnac.analysis.settings import Method
from sagnac.paper.published import FIGURE_3, TABLE_1, TABLE_2
from sagnac.paper.trials import Preparation, config_of_run, trials
from sagnac.rig.config import RigConfig
from sagnac.rig.sections import GyroMode

RUN_SCHEMA: Final = "sagnac.reproduction-run/1"
PAIR: Final = ("x", "z")
_MODE_OF_TABLE: Final[Mapping[str, GyroMode]] = {"table1": "dithered", "table2": "rate-biased"}


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
    """

    table_duration_s: float = 7200.0
    figure_duration_s: float = 7200.0
    days: int = 3

    def __post_init__(self) -> None:
        """Refuse what the paper has no column for.

        Raises
        ------
        ValueError
            If `days` is not 1, 2 or 3.
        """
        if not 1 <= self.days <= 3:
            raise ValueError(f"days is {self.days}; the paper has three, give 1 to 3")


# Half an hour: in less, the preset's line at 0.0137 Hz is not told from the random walk.
FULL: Final = Scope()
QUICK: Final = Scope(table_duration_s=1800.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One recording and one analysis of it.

    `preparation` ``rate`` keeps every so-many-th mean rate over 1 s instead of the angle.
    """

    name: str
    config: RigConfig
    gyros: tuple[str, ...]
    method: Method
    interval_s: float = 1.0
    preparation: Preparation = "angle"

    @property
    def key(self) -> str:
        """Name and a digest of everything the result depends on."""
        what = json.dumps({"schema": RUN_SCHEMA, "version": __version__, **asdict(self)})
        return f"{self.name}-{hashlib.sha256(what.encode()).hexdigest()[:12]}"


def cell_name(table: Literal["table1", "table2"], rate: float, day: int) -> str:
    """Name of the run of one table cell; days count from 1."""
    return f"{table}-{rate:g}-day{day}"


def plan(scope: Scope) -> tuple[Run, ...]:
    """Every run; those of one recording stand together."""
    runs: list[Run] = []
    for number, (table, published) in enumerate(
        (("table1", TABLE_1), ("table2", TABLE_2)), start=1
    ):
        for rate in published:
            for day in range(1, scope.days + 1):
                config = config_of_run(
                    _MODE_OF_TABLE[table],
                    rate,
                    1000 * number + round(rate) * 10 + day,
                    scope.table_duration_s,
                )
                name = f"{table}-{rate:g}-day{day}"
                runs.append(Run(name=name, config=config, gyros=PAIR, method="fos"))
                if table == "table2" and rate == 40.0:
                    long = replace(config, duration_s=scope.figure_duration_s)
                    runs.append(
                        Run(name=f"figure2-day{day}", config=long, gyros=PAIR, method="fris")
                    )
    for trial in trials(scope.figure_duration_s):
        runs += [
            Run(
                name=f"figure3-{trial.name}-{interval:g}s",
                config=trial.config,
                gyros=("z",),
                method=trial.method,
                interval_s=interval,
                preparation=trial.preparation,
            )
            for interval in FIGURE_3
        ]
    return tuple(runs)
