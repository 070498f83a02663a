"""The paper's experiment again: every figure and table, on the simulated rig.

`plan` lists the recordings and analyses, and `reproduce` makes those that are not yet in the
folder: each run is recorded, analyzed, and kept in a file. Results are in the field's units, as the
paper's numbers are.
"""

import json
import math
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from sagnac.analysis.evidence import Evidence
from sagnac.analysis.pipeline import answer_of
from sagnac.analysis.settings import Settings
from sagnac.core.documents import finite
from sagnac.core.errors import RecordingError
from sagnac.core.processes import GIBIBYTE, Means, Standing, Told, completed, nobody
from sagnac.core.units import DEGREE, DEGREE_PER_ROOT_HOUR
from sagnac.core.whole_files import made, write_text
from sagnac.lines.published import AS_PRINTED, FAIR
from sagnac.noise.curve_fit import is_in_paper, paper_fit
from sagnac.noise.estimates import Estimate, Status, unobserved
from sagnac.noise.readings import PLAIN, ReadingName
from sagnac.paper import prediction
from sagnac.paper.prediction import Run, Scope
from sagnac.paper.trials import FITTED_TERMS, FORMS, Form, Trial, least_squares, trials
from sagnac.recording.model import Channel, Recording
from sagnac.report.quantities import curve_columns
from sagnac.rig.config import RigConfig
from sagnac.rig.simulate import Simulation, simulate
from sagnac.stability.curve import StabilityCurve

# ---- outcome -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """Outcome of one run, in field units, per gyro.

    Attributes
    ----------
    run
        What was recorded, and how it was analyzed.
    truth_deg_per_sqrt_h
        N of the gyro, or N-bar of the pair, as simulated.
    value, low, high, confidence, status
        The estimate of N; NaN where it is not observable.
    lines
        How many were found.
    least_squares
        N by each of `FORMS`, signed as `least_squares` says; empty where the curve has
        fewer than five points within 10 %.
    readings
        N by each reading of Step 4, whatever its interval; empty unless the run is `by_curve`.
    curve
        Columns of the stability curve as `curve_columns` has them, s and deg/h; ``shown`` says
        which points have an error of 10 % or less, as the paper cuts it.
    """

    run: Run
    truth_deg_per_sqrt_h: float
    value: float
    low: float
    high: float
    confidence: float
    status: Status
    lines: int
    least_squares: Mapping[Form, float]
    readings: Mapping[ReadingName, float]
    curve: Mapping[str, list[float]]


def outcome_of(run: Run, simulation: Simulation) -> Outcome:
    """Analyze the recording of a run, and set the estimate beside its truth."""
    recording, truth = simulation.recording, simulation.truth
    search = AS_PRINTED if run.as_printed else FAIR
    interval = run.interval_s
    settings = Settings(gyros=run.gyros, method=run.method, interval=interval, published=search)
    if run.preparation == "rate":
        recording = _rate_sampled(recording, run.gyros[0], run.interval_s)
    answer, evidence = answer_of(recording, settings)
    noise = truth.pairs["-".join(run.gyros)] if len(run.gyros) == 2 else truth.gyros[run.gyros[0]]
    estimate = _step_4(evidence) if run.by_curve else answer.estimate
    readings = prediction.by_each_reading(evidence) if run.by_curve else {}
    return Outcome(
        run=run,
        truth_deg_per_sqrt_h=noise.arw_deg_per_sqrt_h,
        value=estimate.value / DEGREE_PER_ROOT_HOUR,
        low=estimate.low / DEGREE_PER_ROOT_HOUR,
        high=estimate.high / DEGREE_PER_ROOT_HOUR,
        confidence=estimate.confidence,
        status=estimate.status,
        lines=len(evidence.lines),
        least_squares=least_squares_of(evidence.curve),
        readings={name: one / DEGREE_PER_ROOT_HOUR for name, one in readings.items()},
        curve={**curve_columns(evidence.curve), "shown": is_in_paper(evidence.curve).tolist()},
    )


def _step_4(evidence: Evidence) -> Estimate:
    """N by the default reading; at rest, where nothing is removed, by the same."""
    try:
        fit = paper_fit(evidence.curve, squares=PLAIN.squares)
    except RecordingError:
        return unobserved("angle_random_walk", evidence.settings.confidence)
    return fit.coefficients["angle_random_walk"]


def _rate_sampled(recording: Recording, name: str, interval: float) -> Recording:
    """Mean rates over 1 s, one every `interval`."""
    angle = recording.gyro(name).values[:: max(1, round(recording.sample_rate))]
    rates = np.diff(angle)[:: max(1, round(interval))]
    channel = Channel(name=name, kind="rate", shown_in="rad/s", values=rates)
    return Recording(gyros=(channel,), sample_rate=1.0 / interval)


def least_squares_of(curve: StabilityCurve) -> dict[Form, float]:
    """N by each of `FORMS`, of the points of a curve that are good to 10 %, as the paper cuts it.

    Parameters
    ----------
    curve
        Overlapping Allan deviation.

    Returns
    -------
    dict
        deg/sqrt(h), signed as `least_squares` says; empty with fewer than five points.
    """
    kept = is_in_paper(curve)
    if np.count_nonzero(kept) < FITTED_TERMS:
        return {}
    tau, deviation = curve.tau[kept], curve.deviation[kept]
    return {form: least_squares(tau, deviation, form) / DEGREE_PER_ROOT_HOUR for form in FORMS}


def write_outcome(path: Path, outcome: Outcome) -> None:
    """Keep a finished run as JSON; the file appears only when it is whole.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    write_text(path, json.dumps(finite(asdict(outcome)), allow_nan=False, indent=1))


def read_outcome(path: Path, run: Run) -> Outcome | None:
    """A finished run, or None: a file that is not one is made again."""
    try:
        return Outcome(**{**_numbered(json.loads(path.read_text(encoding="utf-8"))), "run": run})
    except (OSError, ValueError, TypeError):
        return None


def _numbered(value: Any) -> Any:
    """The same tree with NaN for every None of JSON."""
    if isinstance(value, dict):
        return {key: _numbered(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_numbered(one) for one in value]
    return math.nan if value is None else value


# ---- reproduction ------------------------------------------------------------------

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
    prediction: prediction.Prediction
    computed: int = 0


def reproduce(
    folder: Path, scope: Scope = prediction.FULL, *, means: Means | None = None, told: Told = nobody
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
        process does it all.
    told
        Called before the first run, and as runs are made.

    Raises
    ------
    RecordingError
        If the folder cannot be written to, or a process dies.
    """
    runs = prediction.plan(scope)
    store = made(folder / "runs")
    kept = {run.name: read_outcome(store / f"{run.key}.json", run) for run in runs}
    outcomes = {name: outcome for name, outcome in kept.items() if outcome is not None}
    missing = [run for run in runs if run.name not in outcomes]
    began = time.perf_counter()

    def tell() -> None:
        done, elapsed = len(outcomes), time.perf_counter() - began
        computed = done - (len(runs) - len(missing))
        told(Standing(done=done, total=len(runs), elapsed_s=elapsed, computed=computed))

    if missing:
        tell()
        for outcome in _made(_by_recording(missing), store, means):
            outcomes[outcome.run.name] = outcome
            tell()
    return Reproduction(
        scope=scope,
        outcomes={run.name: outcomes[run.name] for run in runs},
        trials=trials(scope.figure_duration_s),
        prediction=prediction.predicted_angle_random_walk(np.geomspace(5.0, 200.0, 120) * DEGREE),
        computed=len(missing),
    )


Runs = tuple[Run, ...]


def _by_recording(runs: Iterable[Run]) -> list[Runs]:
    """Runs of one recording together, in the order of the first of each."""
    together: dict[RigConfig, list[Run]] = {}
    for run in runs:
        together.setdefault(run.config, []).append(run)
    return [tuple(own) for own in together.values()]


def _made(recordings: Sequence[Runs], store: Path, means: Means | None) -> Iterator[Outcome]:
    """Outcomes of all runs, as they come."""
    if means is None:
        for runs in recordings:
            yield from _of_recording(runs, store)
        return
    ended = completed(recordings, partial(_all_of_recording, store=store), means, lambda _: _NEEDED)
    with closing(ended):
        for runs, future in ended:
            try:
                yield from future.result()
            except BrokenProcessPool:
                why = f"the process that made {runs[0].name} died; it was killed, or memory ran out"
                remedy = "start again, with fewer processes ({workers 1}); what is made is kept"
                raise RecordingError(why, path=str(store), remedy=remedy) from None


def _all_of_recording(runs: Runs, store: Path) -> list[Outcome]:
    return list(_of_recording(runs, store))


def _of_recording(runs: Runs, store: Path) -> Iterator[Outcome]:
    """Outcomes of runs of one recording, each kept as soon as it is there."""
    simulation = simulate(runs[0].config)
    for run in runs:
        outcome = outcome_of(run, simulation)
        write_outcome(store / f"{run.key}.json", outcome)
        yield outcome


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


def outcomes_of_table(reproduction: Reproduction, table: prediction.Table) -> list[Cell]:
    """Cells of a table, day by day at each rate."""
    cells, runs = [], reproduction.outcomes
    for rate, days in prediction.TABLES[table].published.items():
        for day, published in enumerate(days[: reproduction.scope.days], start=1):
            own, paper = (runs[prediction.cell_name(table, rate, day, by)] for by in ("", "paper"))
            printed = runs.get(prediction.cell_name(table, rate, day, "printed"), paper)
            cells.append(Cell(rate, day, published, own, paper, printed))
    return cells
