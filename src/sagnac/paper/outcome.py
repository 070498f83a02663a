"""One run of the paper's experiment: recorded, analyzed, and kept in a file."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from sagnac.analysis.pipeline import answer_of
from sagnac.analysis.result import Answer
from sagnac.analysis.settings import Settings
from sagnac.arrays import FloatArray
from sagnac.coefficients.curve_fit import paper_fit
from sagnac.coefficients.estimates import Estimate, Status, unobserved
from sagnac.coefficients.readings import PLAIN, ReadingName
from sagnac.errors import RecordingError
from sagnac.formats.files import replacing
from sagnac.lines.published import AS_PRINTED, FAIR
from sagnac.paper.prediction import Run, by_each_reading
from sagnac.paper.trials import FITTED_TERMS, FORMS, Form, least_squares
from sagnac.recording.model import Channel, Recording
from sagnac.rig.simulate import Simulation
from sagnac.stability.curve import StabilityCurve
from sagnac.stability.noise_type import ieee_relative_error
from sagnac.units import DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR

PAPER_POINT_ERROR: Final = 0.1
"""Relative error above which the paper shows and fits no point of a curve."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """Outcome of one run, in field units, per gyro.

    Attributes
    ----------
    truth_deg_per_sqrt_h
        N of the gyro, or N-bar of the pair, as simulated.
    value, low, high, confidence, status
        The estimate of N; NaN where it is not observable.
    least_squares
        N by each of `FORMS`, signed as `least_squares` says; empty where the curve has
        fewer than five points within 10 %.
    readings
        N by each reading of Step 4, whatever its interval; empty unless the run is `by_curve`.
    tau_s, deviation, low_curve, high_curve
        The stability curve, deg/h, all of one length.
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
    readings: Mapping[ReadingName, float]
    tau_s: tuple[float, ...]
    deviation: tuple[float, ...]
    low_curve: tuple[float, ...]
    high_curve: tuple[float, ...]

    def __post_init__(self) -> None:
        points = {len(self.tau_s), len(self.deviation), len(self.low_curve), len(self.high_curve)}
        if len(points) != 1:
            raise ValueError(f"the curve of {self.name} has columns of {sorted(points)} points")


def outcome_of(run: Run, simulation: Simulation) -> Outcome:
    """Analyze the recording of a run, and set the estimate beside its truth."""
    recording, interval = simulation.recording, run.interval_s
    search = AS_PRINTED if run.as_printed else FAIR
    settings = Settings(gyros=run.gyros, method=run.method, interval=interval, published=search)
    if run.preparation == "rate":
        recording = _rate_sampled(recording, run.gyros[0], interval)
    answer = answer_of(recording, settings)
    truth = simulation.truth
    noise = truth.pairs["-".join(run.gyros)] if len(run.gyros) == 2 else truth.gyros[run.gyros[0]]
    estimate, curve = answer.angle_random_walk, answer.curve
    readings: dict[ReadingName, float] = {}
    if run.by_curve:
        readings = by_each_reading(answer)
        estimate = _step_4(answer)
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
        lines=len(answer.lines),
        least_squares=least_squares_of(curve),
        readings={name: one / DEGREE_PER_ROOT_HOUR for name, one in readings.items()},
        tau_s=tuple(curve.tau.tolist()),
        deviation=_shown(curve.deviation),
        low_curve=_shown(curve.low),
        high_curve=_shown(curve.high),
    )


def _step_4(answer: Answer) -> Estimate:
    """N by the default reading; at rest, where nothing is removed, by the same."""
    try:
        fit = paper_fit(answer.curve, squares=PLAIN.squares)
    except RecordingError:
        return unobserved("angle_random_walk", answer.angle_random_walk.confidence)
    return fit.coefficients["angle_random_walk"]


def _shown(values: FloatArray) -> tuple[float, ...]:
    """Points of a curve, deg/h."""
    return tuple((values / DEGREE_PER_HOUR).tolist())


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
    clusters = np.round(curve.tau * curve.sample_rate).astype(int)
    kept = np.array(
        [
            ieee_relative_error(curve.samples - 1, int(cluster)) <= PAPER_POINT_ERROR
            for cluster in clusters
        ]
    )
    if np.count_nonzero(kept) < FITTED_TERMS:
        return {}
    return {
        form: least_squares(curve.tau[kept], curve.deviation[kept], form) / DEGREE_PER_ROOT_HOUR
        for form in FORMS
    }


def write_outcome(path: Path, outcome: Outcome) -> None:
    """Keep a finished run as JSON; the file appears only when it is whole.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    values = _without_nan(asdict(outcome))
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(values, allow_nan=False, indent=1), encoding="utf-8")


def _without_nan(value: Any) -> Any:
    """None in place of what JSON has no number for."""
    if isinstance(value, dict):
        return {key: _without_nan(one) for key, one in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value


def read_outcome(path: Path) -> Outcome | None:
    """A finished run, or None: a file that is not one is made again."""
    try:
        values: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        for key, value in values.items():
            if isinstance(value, list):
                values[key] = tuple(value)
            elif isinstance(value, dict):
                values[key] = {
                    name: math.nan if one is None else one for name, one in value.items()
                }
            elif value is None:
                values[key] = math.nan
        return Outcome(**values)
    except (OSError, ValueError, TypeError, AttributeError):
        return None
