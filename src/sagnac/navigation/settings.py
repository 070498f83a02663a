"""Settings of a filter: models above each sensor's curve, or those stated.

The sensors are those that an ``analysis.json`` states. The full models are plain data, too: TOML,
and JSON of schema ``sagnac.filter/1``.
"""

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any, Final, Self

import numpy as np

from sagnac.core.documents import Documented, documents_of, read_analyses
from sagnac.core.errors import RecordingError, refusal
from sagnac.core.units import SENSED, UNITS, Sensor, field_unit
from sagnac.core.version import __version__
from sagnac.navigation import definitions, models

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
    white_bound
        Its upper bound if it was not estimated, in the same units; NaN if there is none.
    covariance
        Of the coefficients, as the document states it; None if it does not.
    walk_bound
        Largest K that the recording allows if it shows none, rad/s/sqrt(s), infinite if it tells
        nothing of it; NaN if it shows one.
    doubts
        What the analysis found wrong of the recording and did not accept, and what it took off, in
        words.
    stated
        What a data sheet states beside the noise, in words: name -> text.
    has_lines
        Whether lines were left in the curve.
    is_pair
        Whether it is what two gyros make per gyro.
    """

    name: str
    kind: Sensor = "gyro"
    simple: models.FilterModel
    full: models.FilterModel
    source: str
    limit: models.UpperLimit | None = None
    sample_rate: float | None = None
    estimate: float = math.nan
    white_bound: float = math.nan
    covariance: Mapping[str, Any] | None = None
    walk_bound: float = math.nan
    doubts: tuple[str, ...] = ()
    stated: Mapping[str, str] = field(default_factory=dict)
    has_lines: bool = False
    is_pair: bool = False

    @property
    def excess(self) -> float:
        """White noise of the simple model over N as estimated or bounded; NaN if N was not."""
        known = self.white_bound if math.isnan(self.estimate) else self.estimate
        return self.simple.white / known if known > 0.0 else math.nan

    def inflation(self, model: models.FilterModel) -> float | None:
        """Median over the cluster times of model over measured deviation; None if stated."""
        return None if self.limit is None else self.limit.inflation(model)

    def as_markov(self, time: float) -> Self:
        """The same with one Markov rate of this correlation time, s, in the place of the walk."""
        if self.limit is None:
            walk = models.Markov(driving_noise=self.simple.walk, correlation_time=time)
            rates = tuple(one.slowed_to(time) for one in self.full.markov) or (walk,)
            return replace(self, simple=models.FilterModel(white=self.simple.white, markov=rates))
        least = min(self.simple.white, self.full.white)
        return replace(self, simple=models.white_and_markov(self.limit, time, least_white=least))

    def in_words(self) -> str:
        """The simple model in one line, in the field's units, ASCII."""
        model = self.simple
        white = field_unit("angle_random_walk", self.kind)
        walk = field_unit("rate_random_walk", self.kind)
        rate = UNITS[SENSED[self.kind].rate_unit]
        bound = _at_most(self.walk_bound / walk.size)
        # Flicker, ramps and Markov rates as well as K.
        slow = "; it covers all slow noise that the curve allows" * (model.walk > self.walk_bound)
        bias = f"K {model.walk / walk.size:.4g} {walk.name}"
        unseen = f" (not estimated{bound}{slow})"
        for one in model.markov:
            size, time = one.deviation / rate.size, one.correlation_time
            bias = f"Markov bias {size:.4g} {rate.name} over {time:.4g} s"
            unseen = f" (K not estimated{bound}{f' {walk.name}' * bool(bound)})"
        if self.walk_bound > 0.0:
            bias += unseen
        inflation, seen, rest = self.inflation(model), "", ", stated, not measured"
        if inflation is not None:
            seen = f" (not estimated{_at_most(self.white_bound / white.size)})"
            rest = f", {inflation:.3f} of the Allan deviation (median)"
            if self.estimate > 0.0:
                seen = f" ({self.excess:.3f} of the estimate)"
        more = "".join(f", {key} {text}" for key, text in self.stated.items())
        density = f"{model.white / white.size:.4g} {white.name}"
        return f"{self.name}: N {density}{seen}, {bias}{rest}{more}"


def _at_most(bound: float) -> str:
    return f", at most {bound:.4g}" if math.isfinite(bound) else ""


# ---- measured ----------------------------------------------------------------------


def measured_in(
    source: Documented | str | Path, *, confidence: float = 0.95, most_markov: int = 2
) -> list[FilterSetting]:
    """The models of every gyro and accelerometer of an analysis, or of several.

    Each lies above the upper confidence limit of the curve of its sensor.

    Parameters
    ----------
    source
        An analysis; the path of an ``analysis.json`` of one or of several; or a folder that a
        command wrote, a campaign's too.
    confidence
        That the Allan deviation of a sensor lies below that of its models, at all cluster times
        of twenty degrees of freedom or more together.
    most_markov
        Of the full model.

    Raises
    ------
    RecordingError
        If it holds no such document, or a curve is too short.
    ValueError
        If an analysis states what cannot be.
    """
    if not isinstance(source, str | Path):
        return _measured(json.loads(source.to_json()), confidence, most_markov)
    settings = []
    for file in documents_of(Path(source)):
        with as_written(file):
            for document in read_analyses(file):
                settings += _measured(document, confidence, most_markov)
    return settings


@contextmanager
def as_written(path: Path) -> Iterator[None]:
    """Errors in what a document states are those of its file."""
    try:
        yield
    except RecordingError as error:
        raise error.at(str(path)) from None
    except ValueError as error:
        remedy = "give the analysis.json as it was written"
        raise RecordingError(str(error), path=str(path), remedy=remedy) from None


def _measured(
    document: Mapping[str, Any], confidence: float, most_markov: int
) -> list[FilterSetting]:
    """The models of every sensor of a document of schema ``sagnac.analysis/1``."""
    sensors: list[tuple[str, Sensor, Mapping[str, Any], Mapping[str, Any]]] = []
    for whole in document.get("gyros", {}).values() or [document]:
        # A triad has one curve, in which each gyro has its own N.
        each = whole["per_gyro"] or {whole["channel"]: whole["angle_random_walk"]}
        sensors += [(name, "gyro", walk, whole) for name, walk in each.items()]
    for name, force in (document.get("accelerometers") or {}).items():
        whole = {"input": document["input"], **force}
        sensors.append((name, "accelerometer", force["velocity_random_walk"], whole))
    settings = []
    for name, kind, walk, whole in sensors:
        _require_sound(name, kind, walk, whole)
        try:
            limit, white, high = _limit(walk, whole, kind, confidence)
        except RecordingError as error:
            raise RecordingError(error.problem, channel=name, remedy=error.remedy) from None
        # What the spectrum shows or allows counts even if a low-pass hides it from the curve.
        least, given = 0.0 if math.isnan(high) else high, whole["input"]
        steps = whole["coefficients"].get(SENSED[kind].keys["quantization"], {})
        angle = steps.get("status") == "estimated" and steps["value"] > 0.0
        slow = whole["coefficients"].get(SENSED[kind].keys["rate_random_walk"], {})
        ramp = whole["coefficients"].get(SENSED[kind].keys["rate_ramp"], {})
        doubts = _doubts(name, [sensor[0] for sensor in sensors], document, whole)
        if ramp.get("status") == "estimated":
            why = "is in its curve, and K covers it; a unit that stands still and warm has less"
            doubts = (*doubts, f"{name}: a ramp of {ramp['value']:.4g} {ramp['unit']} {why}")
        setting = FilterSetting(
            name=name,
            kind=kind,
            simple=models.overbound(limit, most_markov=0, least_white=least, walks=True),
            full=models.overbound(limit, most_markov=most_markov, least_white=least, angle=angle),
            source=f"{given['path'] or 'a recording in memory'}, "
            f"SHA-256 {given['sha256'] or 'none'}",
            limit=limit,
            sample_rate=float(given["sample_rate_hz"]),
            estimate=white,
            white_bound=high if math.isnan(white) else math.nan,
            covariance=whole.get("covariance"),
            walk_bound=_walk_bound(slow, kind),
            doubts=doubts,
            # An analysis takes the lines out of accelerometers whatever is asked for.
            has_lines=kind == "gyro" and whole["settings"]["method"] == "none",
            is_pair=name == whole.get("channel") and whole.get("gyros_differenced") == 2,
        )
        settings.append(setting)
    return settings


def _walk_bound(slow: Mapping[str, Any], kind: Sensor) -> float:
    """`FilterSetting.walk_bound`, from the coefficient K of a document."""
    if slow.get("status") != "upper bound":
        return math.nan if slow.get("status") == "estimated" else math.inf
    return float(slow["high"] * SENSED[kind].coefficients["rate_random_walk"][slow["unit"]])


def _doubts(name: str, names: Sequence[str], *documents: Mapping[str, Any]) -> tuple[str, ...]:
    """Warnings and errors on a sensor, or on no sensor alone, and a drift that was taken off."""
    doubts = []
    for one in chain.from_iterable(document.get("findings", ()) for document in documents):
        of = set(re.split(r", |-", one["channel"]))
        # A warm-up was taken off N alone: the walk of a setting lies above it in the curve.
        counts = one["level"] != "remark" or one.get("name") == "warm-up"
        if counts and (name in of or not of <= set(names)):
            doubts.append(f"{one['channel']}: {one['text']}".removeprefix(": "))
    if any(document.get("settings", {}).get("covariates") for document in documents):
        # A filter that is given the rates as they are does not expect that drift.
        problem = "the analysis took off what followed the temperature, and no setting holds it"
        doubts.append(f"{problem}: give the filter rates that are compensated alike")
    return tuple(dict.fromkeys(doubts))


def _require_sound(
    name: str, kind: Sensor, walk: Mapping[str, Any], whole: Mapping[str, Any]
) -> None:
    """Refuse a sensor whose curve is not that of its noise, so that its N is withheld.

    The curve shows an error in the data, or it is that of two gyros of a triad that are not told
    apart.
    """
    errors = [one for one in whole.get("findings", ()) if one["level"] == "error"]
    if errors and walk["status"] == "not observable":
        title = SENSED[kind].titles["angle_random_walk"]
        problem = f"nothing can be exported, for no {title} is given: {errors[0]['text']}"
        remedy = f"analyze sound data, or leave that {kind} out"
        raise RecordingError(problem, channel=name, remedy=remedy)
    if kind == "gyro" and whole.get("per_gyro") and walk["status"] == "not observable":
        problem = "nothing can be exported, for its noise is not told from that of the other two"
        remedy = "analyze two gyros whose difference is sound, or each at rest"
        raise RecordingError(problem, channel=name, remedy=remedy)


def _limit(
    walk: Mapping[str, Any], whole: Mapping[str, Any], kind: Sensor, confidence: float
) -> tuple[models.UpperLimit, float, float]:
    """Upper limit of the curve of a sensor with its own N, `walk`; that N and its upper limit.

    The square of N of a gyro of a triad is told apart by the three-cornered hat; what lies beside
    it in the curve of two of them is taken to be the same for all.
    """
    curve = whole["curve"]
    if "edf" not in curve:
        problem = "states no degrees of freedom of its curve"
        raise RecordingError(problem, remedy="analyze the recording again")
    key, unit = "deviation_deg_per_h", "deg/h"
    if kind == "accelerometer":
        key, unit = "deviation", curve["unit"]
    columns = {name: np.asarray(curve[name], dtype=np.float64) for name in ("tau_s", key, "edf")}
    tau, deviation, edf = columns.values()
    if not tau.shape == deviation.shape == edf.shape:
        shapes = f"{tau.shape}, {deviation.shape} and {edf.shape}"
        raise ValueError(f"tau_s, {key} and edf have shapes {shapes}; give one shape")
    for name, values in columns.items():
        if not values.size or not (np.isfinite(values) & (values > 0.0)).all():
            raise refusal(name, "is not above zero throughout; give finite numbers")
    deviation = UNITS[unit].size * deviation
    white, high = _walk(walk, kind)
    shared, _ = _walk(whole[SENSED[kind].keys["angle_random_walk"]], kind)
    if whole.get("per_gyro") and not math.isnan(high + shared):
        square = (high if math.isnan(white) else white) ** 2
        deviation = np.sqrt(np.maximum(deviation**2 + (square - shared**2) / tau, square / tau))
    return models.upper_limit(tau, deviation, edf, confidence=confidence), white, high


def _walk(stated: Mapping[str, Any], kind: Sensor) -> tuple[float, float]:
    """N and its upper limit, rad/sqrt(s) or m/s/sqrt(s); N is NaN for a bound."""
    if stated["status"] == "not observable":
        return math.nan, math.nan
    size = SENSED[kind].coefficients["angle_random_walk"][stated["unit"]]
    bound = stated["status"] == "upper bound"
    return math.nan if bound else size * stated["value"], size * stated["high"]


# ---- together ----------------------------------------------------------------------


def worst(settings: Sequence[FilterSetting]) -> FilterSetting:
    """One that covers all of them: the largest white noise, the largest walk.

    Its full model lies above the limits of all together.
    """
    names = list(dict.fromkeys(one.name for one in settings))
    name = names[0] if len(names) == 1 else f"the worst of {', '.join(names)}"
    loudest = max(settings, key=lambda one: one.simple.white)
    farthest = max(settings, key=lambda one: one.simple.walk)
    # A walk that one of them shows is no bound.
    seen = math.isnan(farthest.walk_bound)
    bound = math.nan if seen else float(np.nanmax([one.walk_bound for one in settings]))
    # Of several recordings each doubt has its file.
    several = len({one.source for one in settings}) > 1
    files = [f"{one.source.rpartition(', SHA-256')[0]}: " * several for one in settings]
    of = [file + doubt for file, one in zip(files, settings, strict=True) for doubt in one.doubts]
    loudest = replace(loudest, name=name, walk_bound=bound, doubts=tuple(dict.fromkeys(of)))
    limits = [one.limit for one in settings if one.limit is not None]
    if len(settings) == 1 or len(limits) < len(settings):
        return loudest
    limit = models.envelope(limits)
    full = [one.full for one in settings]
    most, least = max(len(one.markov) for one in full), max(one.white for one in full)
    angle = any(one.angle > 0.0 for one in full)
    covering = models.overbound(limit, most_markov=most, least_white=least, angle=angle)
    simple = models.FilterModel(white=loudest.simple.white, walk=farthest.simple.walk)
    source = loudest.source
    if source != farthest.source:
        source = f"{source} (N); {farthest.source} (K)"
    return replace(loudest, simple=simple, full=covering, limit=limit, source=source)


def by_name(settings: Sequence[FilterSetting]) -> tuple[FilterSetting, ...]:
    """One for each name: what several recordings have of one name is covered by the worst."""
    names = dict.fromkeys((one.kind, one.name) for one in settings)
    return tuple(worst([one for one in settings if (one.kind, one.name) == name]) for name in names)


# ---- plain data --------------------------------------------------------------------

# By kind of sensor, as keys: a sample, its integral, its derivative, and N and K in the field's.
_KEYS: Final[Mapping[Sensor, tuple[str, str, str, str, str]]] = {
    "gyro": ("rad_per_s", "angle_rad", "rad_per_s2", "deg_per_sqrt_h", "deg_per_h_per_sqrt_h"),
    "accelerometer": (
        "m_per_s2", "velocity_m_per_s", "m_per_s3", "m_per_s_per_sqrt_h", "mg_per_sqrt_h",
    ),
}  # fmt: skip


def plain(sensors: Mapping[Sensor, Sequence[FilterSetting]], rate: float) -> dict[str, Any]:
    """Simple and full models of some sensors, continuous and discrete.

    Parameters
    ----------
    sensors
        Each by its kind; gyros are among them.
    rate
        Of the discrete form, Hz.
    """
    definition = definitions.definition_of("toml")
    every = (one.limit for settings in sensors.values() for one in settings)
    limits = [limit for limit in every if limit is not None]
    data: dict[str, Any] = {
        "schema": "sagnac.filter/1",
        "version": __version__,
        "definition": definition.text,
        "reference": definition.reference,
    }
    if limits:
        data["confidence"] = limits[0].confidence
        data["tau_s"] = list(models.common_span(limits))
    data["update_rate_hz"] = rate
    for kind, settings in sensors.items():
        key = "sensors" if kind == "gyro" else "accelerometers"
        data[key] = {one.name: _sensor_data(one, 1.0 / rate) for one in settings}
    return data


def _sensor_data(setting: FilterSetting, step: float) -> dict[str, Any]:
    covariance, doubts = dict(setting.covariance or {}), list(setting.doubts)
    optional = {"covariance": covariance, "stated": dict(setting.stated), "warnings": doubts}
    return {
        "source": setting.source,
        "measured": setting.limit is not None,
        "simple": _model(setting, setting.simple, step),
        "full": _model(setting, setting.full, step),
        **{key: stated for key, stated in optional.items() if stated},
    }


def _model(setting: FilterSetting, model: models.FilterModel, step: float) -> dict[str, Any]:
    sample, integral, derivative, white, walk = _KEYS[setting.kind]
    white_unit = field_unit("angle_random_walk", setting.kind)
    walk_unit = field_unit("rate_random_walk", setting.kind)
    inflation = setting.inflation(model)
    steps = [{"decay": one.decay(step), f"step_{sample}": one.step(step)} for one in model.markov]
    return {
        **({} if inflation is None else {"inflation": inflation}),
        "continuous": {
            f"white_{sample}_per_sqrt_hz": model.white,
            f"white_{white}": model.white / white_unit.size,
            f"walk_{derivative}_per_sqrt_hz": model.walk,
            f"walk_{walk}": model.walk / walk_unit.size,
            integral: model.angle,
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
            "markov": steps,
        },
    }
