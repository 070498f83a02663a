"""The paper's experiment again: every figure and table, on the simulated rig.

`plan` lists the recordings and analyses, and `reproduce` makes those that are not yet in the
folder. Results are in the field's units, as the paper's numbers are.
"""

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final, Literal, NamedTuple

import numpy as np

from sagnac.errors import RecordingError
from sagnac.paper.outcome import Outcome, outcome_of, read_outcome, write_outcome
from sagnac.paper.prediction import (
    FULL,
    TABLE_1,
    TABLE_2,
    Prediction,
    Run,
    Scope,
    Table,
    cell_name,
    plan,
    predicted_angle_random_walk,
    printed_cell_name,
    published_cell_name,
)
from sagnac.paper.trials import Trial, trials
from sagnac.processes import GIBIBYTE, Means, Standing, completed, nobody
from sagnac.rig.config import RigConfig
from sagnac.rig.simulate import simulate
from sagnac.units import DEGREE

__all__ = ["Cell", "Order", "Outcome", "Reproduction", "outcomes_of_table", "reproduce"]

# Two hours of three gyros at 500 Hz, and what their analysis holds.
_NEEDED: Final = 1.5 * GIBIBYTE


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduction:
    """Everything made.

    Attributes
    ----------
    scope
        How much was simulated.
    outcomes
        By run name.
    trials
        What was tried to explain Figure 3.
    prediction
        N against table rate.
    computed
        Runs that were not there yet.
    """

    scope: Scope
    outcomes: Mapping[str, Outcome]
    trials: tuple[Trial, ...]
    prediction: Prediction
    computed: int = 0


def reproduce(
    folder: Path,
    scope: Scope = FULL,
    *,
    means: Means | None = None,
    told: Callable[[Standing], None] = nobody,
) -> Reproduction:
    """Make every run that `folder` does not hold yet.

    Each recording is simulated once, for all runs of it. Each result is
    ``folder/runs/NAME-DIGEST.json``, written beside and renamed, so that an
    interrupted reproduction goes on where it stopped. The digest covers configuration,
    settings and version; results of another one are left alone and not used.

    Parameters
    ----------
    folder
        Exists.
    scope
        How much to simulate.
    means
        Processes that make the runs, one recording each at a time, and their memory. None: this
        process does it all. A script that asks for processes has to be importable
        (``if __name__ == "__main__"``).
    told
        Called before the first run, and as runs are made.

    Raises
    ------
    RecordingError
        If the folder cannot be written to, or a process dies.
    """
    runs = plan(scope)
    store = _store(folder)
    kept = {run.name: read_outcome(_path(store, run)) for run in runs}
    outcomes = {name: outcome for name, outcome in kept.items() if outcome is not None}
    missing = [run for run in runs if run.name not in outcomes]
    began, before = time.perf_counter(), len(outcomes)

    def tell() -> None:
        told(
            Standing(
                done=len(outcomes),
                total=len(runs),
                elapsed_s=time.perf_counter() - began,
                computed=len(outcomes) - before,
            )
        )

    if missing:
        tell()
        for outcome in _made(_by_recording(missing), store, means):
            outcomes[outcome.name] = outcome
            tell()
    return Reproduction(
        scope=scope,
        outcomes={run.name: outcomes[run.name] for run in runs},
        trials=trials(scope.figure_duration_s),
        prediction=predicted_angle_random_walk(np.geomspace(5.0, 200.0, 120) * DEGREE),
        computed=len(missing),
    )


def _path(store: Path, run: Run) -> Path:
    return store / f"{run.key}.json"


def _by_recording(runs: Iterable[Run]) -> list[tuple[Run, ...]]:
    """Runs of one recording together, in the order of the first of each."""
    together: dict[RigConfig, list[Run]] = {}
    for run in runs:
        together.setdefault(run.config, []).append(run)
    return [tuple(own) for own in together.values()]


def _made(
    recordings: Sequence[tuple[Run, ...]], store: Path, means: Means | None
) -> Iterator[Outcome]:
    """Outcomes of all runs, as they come."""
    if means is None:
        for runs in recordings:
            yield from _of_recording(runs, store)
        return
    ended = completed(recordings, partial(_all_of_recording, store=store), means, lambda _: _NEEDED)
    with closing(ended):
        for runs, future in ended:
            try:
                outcomes = future.result()
            except BrokenProcessPool:
                raise RecordingError(
                    f"the process that made {runs[0].name} died; it was killed, or memory ran out",
                    path=str(store),
                    remedy="start again, with fewer processes ({workers 1}); what is made is kept",
                ) from None
            yield from outcomes


def _all_of_recording(runs: tuple[Run, ...], store: Path) -> list[Outcome]:
    return list(_of_recording(runs, store))


def _of_recording(runs: tuple[Run, ...], store: Path) -> Iterator[Outcome]:
    """Outcomes of runs of one recording, each kept as soon as it is there."""
    simulation = simulate(runs[0].config)
    for run in runs:
        outcome = outcome_of(run, simulation)
        write_outcome(_path(store, run), outcome)
        yield outcome


def _store(folder: Path) -> Path:
    store = folder / "runs"
    try:
        store.mkdir(exist_ok=True)
    except OSError as error:
        raise RecordingError(
            f"cannot be written ({error.strerror})",
            path=str(store),
            remedy="choose another output",
        ) from None
    return store


Order = Literal["by_paper", "as_printed"]


class Cell(NamedTuple):
    """A cell of a table: rate in deg/s, day from 1, the published N, and what came out.

    `outcome` is by our method, `by_paper` by the paper's, `as_printed` by its steps in the paper's
    order; at rest the last two are one.
    """

    rate: float
    day: int
    published: float
    outcome: Outcome
    by_paper: Outcome
    as_printed: Outcome

    def by(self, order: Order) -> Outcome:
        """What the paper's method gave in that order of its steps."""
        return self.by_paper if order == "by_paper" else self.as_printed


def outcomes_of_table(reproduction: Reproduction, table: Table) -> list[Cell]:
    """Cells of a table, day by day at each rate."""
    cells = []
    published = TABLE_1 if table == "table1" else TABLE_2
    for rate, days in published.items():
        for day in range(1, reproduction.scope.days + 1):
            outcome = reproduction.outcomes[cell_name(table, rate, day)]
            by_paper = reproduction.outcomes[published_cell_name(table, rate, day)]
            printed = by_paper
            if rate > 0.0:
                printed = reproduction.outcomes[printed_cell_name(table, rate, day)]
            cells.append(Cell(rate, day, days[day - 1], outcome, by_paper, printed))
    return cells
