"""Settings of a filter: models above each sensor's curve, or those stated.

The sensors are those that an ``analysis.json`` states. The full models are plain data, too: TOML,
and JSON of schema ``sagnac.filter/1``.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Self

import numpy as np

from sagnac.core.arrays import FloatArray
from sagnac.core.documents import documents_of, read_analyses
from sagnac.core.errors import RecordingError
from sagnac.core.units import SENSED, UNITS, field_unit
from sagnac.core.units import Sensor as SensorKind
from sagnac.navigation.definitions import definition_of
from sagnac.navigation.models import (
    FilterModel,
    Markov,
    UpperLimit,
    envelope,
    overbound,
    upper_limit,
    white_and_markov,
)
from sagnac.noise.laws import markov_allan_variance

# ---- sensors -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sensor:
    """Measurement of one gyro, or of one accelerometer with m for rad.

    Attributes
    ----------
    name
        ``x``, ``az``, or ``x-z`` for what two gyros make per gyro.
    kind
        ``gyro`` or ``accelerometer``.
    tau, deviation, edf
        (points,) of the Allan deviation: s, rad/s, degrees of freedom.
    white, white_high
        N and its upper limit, rad/sqrt(s); NaN if it was not observable. `white` is NaN for a
        bound.
    angle
        Q, rad, if it was estimated; else 0.
    sample_rate
        Of the recording, Hz.
    source
        File and hash, for a comment.
    covariance
        Of the coefficients, as the document states it; None if it does not.
    """

    name: str
    tau: FloatArray
    deviation: FloatArray
    edf: FloatArray
    white: float
    white_high: float
    angle: float
    sample_rate: float
    source: str
    covariance: Mapping[str, Any] | None = field(default=None)
    kind: SensorKind = "gyro"

    def __post_init__(self) -> None:
        if not self.tau.shape == self.deviation.shape == self.edf.shape:
            raise ValueError(
                f"tau, deviation and edf have shapes {self.tau.shape}, {self.deviation.shape} "
                f"and {self.edf.shape}; give one shape"
            )
        for name in ("tau", "deviation", "edf"):
            values = getattr(self, name)
            if not values.size or not (np.isfinite(values) & (values > 0.0)).all():
                raise ValueError(f"{name} is not above zero throughout; give finite numbers")


def sensors_in(path: Path) -> tuple[Sensor, ...]:
    """Every gyro and accelerometer in an ``analysis.json``, or in a folder of such files.

    Parameters
    ----------
    path
        The file, of one analysis or of several; a folder that a command wrote; or a campaign's.

    Raises
    ------
    RecordingError
        If it holds no such document.
    """
    return tuple(sensor for file in documents_of(path) for sensor in _sensors_of(file))


def _sensors_of(path: Path) -> list[Sensor]:
    with as_written(path):
        return [one for document in read_analyses(path) for one in sensors_of(document)]


@contextmanager
def as_written(path: Path) -> Iterator[None]:
    """Errors in what a document states are those of its file."""
    try:
        yield
    except RecordingError as error:
        raise error.at(str(path)) from None
    except ValueError as error:
        raise RecordingError(
            str(error), path=str(path), remedy="give the analysis.json as it was written"
        ) from None


def sensors_of(document: Mapping[str, Any]) -> list[Sensor]:
    """Every gyro and accelerometer of a document of schema ``sagnac.analysis/1``.

    Raises
    ------
    ValueError
        If it states what cannot be.
    """
    found = []
    for stated in document.get("gyros", {}).values() or [document]:
        whole = _sensor(stated["channel"], "gyro", stated, stated["input"])
        each = [_own(whole, name, own) for name, own in stated["per_gyro"].items()]
        found += each or [whole]
    forces = (document.get("accelerometers") or {}).items()
    return found + [
        _sensor(name, "accelerometer", stated, document["input"]) for name, stated in forces
    ]


def _sensor(
    name: str, kind: SensorKind, stated: Mapping[str, Any], given: Mapping[str, Any]
) -> Sensor:
    """What a document states of a sensor; `given` is its recording."""
    sensed, curve = SENSED[kind], stated["curve"]
    if "edf" not in curve:
        raise RecordingError(
            "states no degrees of freedom of its curve",
            channel=name,
            remedy="analyze the recording again",
        )
    if kind == "gyro":
        deviation, unit = curve["deviation_deg_per_h"], "deg/h"
    else:
        deviation, unit = curve["deviation"], curve["unit"]
    white, high = _walk(stated[sensed.keys["angle_random_walk"]], kind)
    quantization = stated["coefficients"].get(sensed.keys["quantization"], {})
    angle = 0.0
    if quantization.get("status") == "estimated":
        angle = sensed.coefficients["quantization"][quantization["unit"]] * quantization["value"]
    return Sensor(
        name=name,
        kind=kind,
        tau=np.asarray(curve["tau_s"], dtype=np.float64),
        deviation=UNITS[unit].size * np.asarray(deviation, dtype=np.float64),
        edf=np.asarray(curve["edf"], dtype=np.float64),
        white=white,
        white_high=high,
        angle=angle,
        sample_rate=float(given["sample_rate_hz"]),
        source=f"{given['path'] or 'a recording in memory'}, SHA-256 {given['sha256'] or 'none'}",
        covariance=stated.get("covariance"),
    )


def _own(pair: Sensor, name: str, stated: Mapping[str, Any]) -> Sensor:
    """One gyro of a triad: its own N in the curve that two of them share.

    The square of N is told apart by the three-cornered hat; what lies beside it in the curve is
    taken to be the same for all.
    """
    white, high = _walk(stated, pair.kind)
    if math.isnan(high) or math.isnan(pair.white):
        own = pair.deviation
    else:
        square = high if math.isnan(white) else white
        variance = pair.deviation**2 + (square**2 - pair.white**2) / pair.tau
        own = np.sqrt(np.maximum(variance, square**2 / pair.tau))
    return replace(pair, name=name, deviation=own, white=white, white_high=high)


def _walk(stated: Mapping[str, Any], kind: SensorKind) -> tuple[float, float]:
    """N and its upper limit, rad/sqrt(s) or m/s/sqrt(s); N is NaN for a bound."""
    if stated["status"] == "not observable":
        return math.nan, math.nan
    size = SENSED[kind].coefficients["angle_random_walk"][stated["unit"]]
    bound = stated["status"] == "upper bound"
    return math.nan if bound else size * stated["value"], size * stated["high"]


# ---- settings ----------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FilterSetting:
    """The models of one sensor; those of an accelerometer have m/s^2 where a gyro's have rad/s.

    Attributes
    ----------
    name
        ``x``, ``az``, or ``x-z`` for what two gyros make per gyro.
    kind
        ``gyro`` or ``accelerometer``.
    simple
        White noise and a random walk, all that most tools take; one Markov rate in the place of
        the walk for tools that take that (`as_markov`).
    full
        With Markov rates, and white angle noise if the recording shows it.
    source
        File and hash, or who stated it; for a comment.
    limit
        What the models lie above; None if they were stated and not measured.
    sample_rate
        Of the recording, Hz; None if there is none.
    estimate
        N as estimated, rad/sqrt(s) or m/s/sqrt(s); NaN if it was not.
    covariance
        Of the coefficients, as the document states it; None if it does not.
    stated
        What a data sheet states beside the noise, in words: name -> text.
    """

    name: str
    kind: SensorKind = "gyro"
    simple: FilterModel
    full: FilterModel
    source: str
    limit: UpperLimit | None = None
    sample_rate: float | None = None
    estimate: float = math.nan
    covariance: Mapping[str, Any] | None = None
    stated: Mapping[str, str] = field(default_factory=dict)

    def inflation(self, model: FilterModel) -> float | None:
        """Median over the cluster times of model over measured deviation; None if stated."""
        return None if self.limit is None else self.limit.inflation(model)

    def as_markov(self, time: float) -> Self:
        """The same with one Markov rate of this correlation time, s, in the place of the walk."""
        return replace(self, simple=self._with_time(time))

    def _with_time(self, time: float) -> FilterModel:
        if self.limit is not None:
            least = min(self.simple.white, self.full.white)
            return white_and_markov(self.limit, time, least_white=least)
        driving = self.simple.walk
        if self.full.markov:
            (slow,) = self.full.markov
            unit = markov_allan_variance(np.array([slow.peak_tau]), 1.0, time)
            driving = slow.peak_deviation / math.sqrt(float(unit[0]))
        rate = Markov(driving_noise=driving, correlation_time=time)
        return FilterModel(white=self.simple.white, markov=(rate,))

    def in_words(self) -> str:
        """The simple model in one line, in the field's units, ASCII."""
        model = self.simple
        white = field_unit("angle_random_walk", self.kind)
        walk = field_unit("rate_random_walk", self.kind)
        rate = UNITS[SENSED[self.kind].rate_unit]
        bias = f"K {model.walk / walk.size:.4g} {walk.name}"
        for one in model.markov:
            size, time = one.deviation / rate.size, one.correlation_time
            bias = f"Markov bias {size:.4g} {rate.name} over {time:.4g} s"
        share = model.white / self.estimate
        seen = "not estimated" if math.isnan(share) else f"{share:.3f} of the estimate"
        inflation, seen = self.inflation(model), f" ({seen})"
        rest = ", stated, not measured"
        if inflation is None:
            seen = ""
        else:
            rest = f", {inflation:.3f} of the Allan deviation (median)"
        more = "".join(f", {key} {text}" for key, text in self.stated.items())
        density = f"{model.white / white.size:.4g} {white.name}"
        return f"{self.name}: N {density}{seen}, {bias}{rest}{more}"


def setting_of(sensor: Sensor, *, confidence: float = 0.95, most_markov: int = 2) -> FilterSetting:
    """The models of one sensor, above the upper confidence limit of its curve.

    Parameters
    ----------
    sensor
        Its curve and its N.
    confidence
        That the Allan deviation of the sensor lies below that of the models, at all cluster times
        of twenty degrees of freedom or more together.
    most_markov
        Of the full model.

    Raises
    ------
    RecordingError
        If the curve is too short.
    """
    try:
        limit = upper_limit(sensor.tau, sensor.deviation, sensor.edf, confidence=confidence)
    except RecordingError as error:
        raise RecordingError(error.problem, channel=sensor.name, remedy=error.remedy) from None
    # What is estimated in the spectrum counts even if a low-pass hides it from the curve.
    seen = 0.0 if math.isnan(sensor.white) else sensor.white_high
    return FilterSetting(
        name=sensor.name,
        kind=sensor.kind,
        simple=overbound(limit, most_markov=0, least_white=seen, walks=True),
        full=overbound(limit, most_markov=most_markov, least_white=seen, angle=sensor.angle > 0.0),
        source=sensor.source,
        limit=limit,
        sample_rate=sensor.sample_rate,
        estimate=sensor.white,
        covariance=sensor.covariance,
    )


def worst(settings: Sequence[FilterSetting]) -> FilterSetting:
    """One that covers all of them: the largest white noise, the largest walk.

    Its full model lies above the limits of all together.
    """
    names = list(dict.fromkeys(one.name for one in settings))
    name = names[0] if len(names) == 1 else f"the worst of {', '.join(names)}"
    loudest = replace(max(settings, key=lambda one: one.simple.white), name=name)
    limits = [one.limit for one in settings if one.limit is not None]
    if len(settings) == 1 or len(limits) < len(settings):
        return loudest
    limit = envelope(limits)
    return replace(
        loudest,
        simple=FilterModel(
            white=loudest.simple.white, walk=max(one.simple.walk for one in settings)
        ),
        full=overbound(
            limit,
            most_markov=max(len(one.full.markov) for one in settings),
            least_white=max(one.full.white for one in settings),
            angle=any(one.full.angle > 0.0 for one in settings),
        ),
        limit=limit,
    )


def by_name(settings: Sequence[FilterSetting]) -> tuple[FilterSetting, ...]:
    """One for each name: what several recordings have of one name is covered by the worst."""
    names = dict.fromkeys((one.kind, one.name) for one in settings)
    return tuple(worst([one for one in settings if (one.kind, one.name) == name]) for name in names)


# ---- plain data --------------------------------------------------------------------

# By kind of sensor: the integral, a sample, and N and K in the field's units, as keys.
_KEYS: Final[Mapping[SensorKind, tuple[str, str, str, str]]] = {
    "gyro": ("rad", "rad_per_s", "deg_per_sqrt_h", "deg_per_h_per_sqrt_h"),
    "accelerometer": ("m_per_s", "m_per_s2", "m_per_s_per_sqrt_h", "mg_per_sqrt_h"),
}
_WALK: Final[Mapping[SensorKind, str]] = {"gyro": "rad_per_s2", "accelerometer": "m_per_s3"}


def plain(
    gyros: Sequence[FilterSetting],
    accelerometers: Sequence[FilterSetting],
    *,
    rate: float,
    version: str,
) -> dict[str, Any]:
    """Simple and full models of some sensors, continuous and discrete.

    Parameters
    ----------
    gyros, accelerometers
        Each sensor of its kind.
    rate
        Of the discrete form, Hz.
    version
        Of this package.
    """
    definition, limit = definition_of("toml"), gyros[0].limit
    bound = {}
    if limit is not None:
        bound = {
            "confidence": limit.confidence,
            "tau_s": [float(limit.tau[0]), float(limit.tau[-1])],
        }
    forces = {one.name: _sensor_data(one, rate) for one in accelerometers}
    return {
        "schema": "sagnac.filter/1",
        "version": version,
        "definition": definition.text,
        "reference": definition.reference,
        **bound,
        "update_rate_hz": rate,
        "sensors": {one.name: _sensor_data(one, rate) for one in gyros},
        **({"accelerometers": forces} if forces else {}),
    }


def _sensor_data(setting: FilterSetting, rate: float) -> dict[str, Any]:
    covariance = setting.covariance
    return {
        "source": setting.source,
        "measured": setting.limit is not None,
        "simple": _model(setting, setting.simple, rate),
        "full": _model(setting, setting.full, rate),
        **({} if covariance is None else {"covariance": dict(covariance)}),
        **({"stated": dict(setting.stated)} if setting.stated else {}),
    }


def _model(setting: FilterSetting, model: FilterModel, rate: float) -> dict[str, Any]:
    step, inflation, kind = 1.0 / rate, setting.inflation(model), setting.kind
    integral, sample, white, walk = _KEYS[kind]
    sizes = [field_unit(name, kind).size for name in ("angle_random_walk", "rate_random_walk")]
    return {
        **({} if inflation is None else {"inflation": inflation}),
        "continuous": {
            f"white_{sample}_per_sqrt_hz": model.white,
            f"white_{white}": model.white / sizes[0],
            f"walk_{_WALK[kind]}_per_sqrt_hz": model.walk,
            f"walk_{walk}": model.walk / sizes[1],
            f"{'angle' if kind == 'gyro' else 'velocity'}_{integral}": model.angle,
            "markov": [
                {
                    f"driving_noise_{sample}_per_sqrt_s": one.driving_noise,
                    "correlation_time_s": one.correlation_time,
                    f"deviation_{sample}": one.deviation,
                }
                for one in model.markov
            ],
        },
        "discrete": {
            f"white_{sample}": model.white_per_sample(step),
            f"walk_{sample}": model.walk_per_sample(step),
            "markov": [
                {"decay": one.decay(step), f"step_{sample}": one.step(step)} for one in model.markov
            ],
        },
    }
