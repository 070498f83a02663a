"""The paper's experiment again: every figure and table, on the simulated rig.

Yu et al., *Sensors* 2013, 13, 2750. `plan` lists the recordings and analyses, `reproduce`
makes those that are not yet in the folder, and `predicted_angle_random_walk` is what
Table 2 is for: the choice of table rate. Results are in the field's units, as the paper's
numbers are.
"""

import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.result import Analysis
from sagnac.analysis.settings import Settings
from sagnac.arrays import FloatArray
from sagnac.coefficients.estimates import Status
from sagnac.formats.source import replacing
from sagnac.paper.least_squares import FITTED_TERMS, FORMS, Form, least_squares
from sagnac.paper.plan import FULL, Run, Scope, cell_name, plan
from sagnac.paper.prediction import Prediction, predicted_angle_random_walk
from sagnac.paper.published import TABLE_1, TABLE_2
from sagnac.paper.trials import Trial, trials
from sagnac.recording.difference import per_gyro
from sagnac.recording.model import Channel, Recording
from sagnac.rig.config import RigConfig
from sagnac.rig.simulate import Simulation, simulate
from sagnac.stability.degrees_of_freedom import ieee_relative_error
from sagnac.units import DEGREE, DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR

Progress = Callable[[str, float], None]
_PAPER_POINT_ERROR: Final = 0.1  # the cut the paper states for every curve


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What one run gave, in field units, per gyro.

    Attributes
    ----------
    truth_deg_per_sqrt_h
        N of the gyro, or N-bar of the pair, as simulated.
    value, low, high, confidence, status
        The estimate of N; NaN where it is not observable.
    least_squares
        N by each of `FORMS`, signed as `least_squares` says; empty where the curve has
        fewer than five points within 10 %.
    tau_s, deviation, low_curve, high_curve
        The stability curve, deg/h.
    """

    name: str
    table_rate_deg_per_s: float
    mode: str
    method: str
    seed: int
    duration_s: float
    interval_s: float
    truth_deg_per_sqrt_h: float
    value: float
    low: float
    high: float
    confidence: float
    status: Status
    lines: int
    least_squares: Mapping[Form, float]
    tau_s: tuple[float, ...]
    deviation: tuple[float, ...]
    low_curve: tuple[float, ...]
    high_curve: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduction:
    """Everything made: outcomes by run name, the trials behind Figure 3, the prediction."""

    scope: Scope
    outcomes: Mapping[str, Outcome]
    trials: tuple[Trial, ...]
    prediction: Prediction
    computed: int = field(default=0)


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
    store = folder / "runs"
    store.mkdir(exist_ok=True)
    outcomes: dict[str, Outcome] = {}
    computed = 0
    last: tuple[RigConfig, Simulation] | None = None
    for number, run in enumerate(runs, start=1):
        path = store / f"{run.key}.json"
        known = _read(path)
        if known is not None:
            outcomes[run.name] = known
            continue
        stage = f"{number}/{len(runs)} {run.name}"
        report(stage, 0.0)
        if last is None or last[0] != run.config:
            last = None  # lets go of one recording before the next is made
            last = (run.config, simulate(run.config))
        report(stage, 0.2)
        outcome = _outcome(run, last[1])
        _write(path, outcome)
        report(stage, 1.0)
        outcomes[run.name] = outcome
        computed += 1
    return Reproduction(
        scope=scope,
        outcomes=outcomes,
        trials=trials(scope.figure_duration_s),
        prediction=predicted_angle_random_walk(np.geomspace(5.0, 200.0, 120) * DEGREE),
        computed=computed,
    )


def _outcome(run: Run, simulation: Simulation) -> Outcome:
    recording, interval = simulation.recording, run.interval_s
    settings = Settings(gyros=run.gyros, method=run.method, interval=interval)
    if run.preparation == "rate":
        recording = _rate_sampled(recording, run.gyros[0], interval)
        settings = replace(settings, interval=None)
    analysis = analyze(recording, settings)
    truth = simulation.truth
    noise = truth.pairs["-".join(run.gyros)] if len(run.gyros) == 2 else truth.gyros[run.gyros[0]]
    estimate = analysis.angle_random_walk
    curve = analysis.curve

    def shown(values: FloatArray) -> tuple[float, ...]:
        each = [per_gyro(value**2, analysis.gyros_differenced) for value in values]
        return tuple((np.array(each) / DEGREE_PER_HOUR).tolist())

    return Outcome(
        name=run.name,
        table_rate_deg_per_s=run.config.table.rate_deg_per_s,
        mode=run.config.gyro.mode,
        method=run.method,
        seed=run.config.seed,
        duration_s=run.config.duration_s,
        interval_s=1.0 / curve.sample_rate,
        truth_deg_per_sqrt_h=noise.arw_deg_per_sqrt_h,
        value=estimate.value / DEGREE_PER_ROOT_HOUR,
        low=estimate.low / DEGREE_PER_ROOT_HOUR,
        high=estimate.high / DEGREE_PER_ROOT_HOUR,
        confidence=estimate.confidence,
        status=estimate.status,
        lines=len(analysis.lines),
        least_squares=_least_squares_of(analysis),
        tau_s=tuple(curve.tau.tolist()),
        deviation=shown(curve.deviation),
        low_curve=shown(curve.low),
        high_curve=shown(curve.high),
    )


def _rate_sampled(recording: Recording, name: str, interval: float) -> Recording:
    """Mean rates over 1 s, one every `interval`."""
    angle = recording.gyro(name).values[:: max(1, round(recording.sample_rate))]
    rates = np.diff(angle)[:: max(1, round(interval))]
    channel = Channel(name=name, kind="rate", unit="rad/s", values=rates)
    return Recording(gyros=(channel,), sample_rate=1.0 / interval)


def _least_squares_of(analysis: Analysis) -> dict[Form, float]:
    curve = analysis.curve
    clusters = np.round(curve.tau * curve.sample_rate).astype(int)
    kept = np.array(
        [
            ieee_relative_error(curve.samples - 1, int(cluster)) <= _PAPER_POINT_ERROR
            for cluster in clusters
        ]
    )
    if np.count_nonzero(kept) < FITTED_TERMS:
        return {}
    return {
        form: least_squares(
            curve.tau[kept],
            curve.deviation[kept],
            form,
            gyros_differenced=analysis.gyros_differenced,
        )
        / DEGREE_PER_ROOT_HOUR
        for form in FORMS
    }


def _write(path: Path, outcome: Outcome) -> None:
    values = {
        key: None if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in asdict(outcome).items()
    }
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(values, allow_nan=False, indent=1), encoding="utf-8")


def _read(path: Path) -> Outcome | None:
    """A finished run, or None: a file that is not one is made again."""
    try:
        values: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        for key, value in values.items():
            if isinstance(value, list):
                values[key] = tuple(value)
            elif value is None:
                values[key] = math.nan
        return Outcome(**values)
    except (OSError, ValueError, TypeError, AttributeError):
        return None


def outcomes_of_table(
    reproduction: Reproduction, table: Literal["table1", "table2"]
) -> Iterable[tuple[float, int, float, Outcome]]:
    """Cells of a table: rate in deg/s, day, the published N, what came out."""
    published = TABLE_1 if table == "table1" else TABLE_2
    for rate, days in published.items():
        for day in range(1, reproduction.scope.days + 1):
            name = cell_name(table, rate, day)
            yield rate, day, days[day - 1], reproduction.outcomes[name]
