"""The paper's experiment again: every figure and table, on the simulated rig.

`plan` lists the recordings and analyses, and `reproduce` makes those that are not yet in the
folder. Results are in the field's units, as the paper's numbers are.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sagnac.errors import RecordingError
from sagnac.paper.outcome import Outcome, outcome_of, read_outcome, write_outcome
from sagnac.paper.plan import FULL, Scope, Table, cell_name, plan, published_cell_name
from sagnac.paper.prediction import Prediction, predicted_angle_random_walk
from sagnac.paper.published import TABLE_1, TABLE_2
from sagnac.paper.trials import Trial, trials
from sagnac.rig.simulate import Simulation, simulate
from sagnac.units import DEGREE

__all__ = ["Cell", "Outcome", "Progress", "Reproduction", "outcomes_of_table", "reproduce"]

Progress = Callable[[str, float], None]


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
    folder: Path, scope: Scope = FULL, *, progress: Progress | None = None
) -> Reproduction:
    """Make every run that `folder` does not hold yet, one after another.

    Each result is ``folder/runs/NAME-DIGEST.json``, written beside and renamed, so that an
    interrupted reproduction goes on where it stopped. The digest covers configuration,
    settings and version; results of another one are left alone and not used.

    Parameters
    ----------
    folder
        Exists.
    scope
        How much to simulate.
    progress
        Called with the run's number and name, and the finished part of it.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    report = progress or (lambda _stage, _fraction: None)
    runs = plan(scope)
    store = _store(folder)
    outcomes: dict[str, Outcome] = {}
    computed = 0
    for config, numbered in groupby(enumerate(runs, start=1), key=lambda item: item[1].config):
        simulation: Simulation | None = None  # lets go of one recording before the next is made
        for number, run in numbered:
            path = store / f"{run.key}.json"
            outcome = read_outcome(path)
            if outcome is None:
                stage = f"{number}/{len(runs)} {run.name}"
                report(stage, 0.0)
                simulation = simulation or simulate(config)
                report(stage, 0.2)
                outcome = outcome_of(run, simulation)
                write_outcome(path, outcome)
                report(stage, 1.0)
                computed += 1
            outcomes[run.name] = outcome
    return Reproduction(
        scope=scope,
        outcomes=outcomes,
        trials=trials(scope.figure_duration_s),
        prediction=predicted_angle_random_walk(np.geomspace(5.0, 200.0, 120) * DEGREE),
        computed=computed,
    )


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


class Cell(NamedTuple):
    """A cell of a table: rate in deg/s, day from 1, the published N, and what came out.

    `outcome` is by our method, `by_paper` by the paper's.
    """

    rate: float
    day: int
    published: float
    outcome: Outcome
    by_paper: Outcome


def outcomes_of_table(reproduction: Reproduction, table: Table) -> Iterator[Cell]:
    """Cells of a table, day by day at each rate."""
    published = TABLE_1 if table == "table1" else TABLE_2
    for rate, days in published.items():
        for day in range(1, reproduction.scope.days + 1):
            outcome = reproduction.outcomes[cell_name(table, rate, day)]
            by_paper = reproduction.outcomes[published_cell_name(table, rate, day)]
            yield Cell(rate, day, days[day - 1], outcome, by_paper)
