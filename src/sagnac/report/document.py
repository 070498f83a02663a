"""An analysis as JSON, schema ``sagnac.analysis/1``, and read back from it.

A document holds the answer and what it rests on, not the recording: `recording`, the spectra, the
curve before removal and the residual are not set, and asking for one of them says so.
"""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from operator import methodcaller
from pathlib import Path
from typing import Any, Final

import numpy as np

from sagnac.analysis import json_data, result
from sagnac.analysis.result import Analysis
from sagnac.analysis.settings import Settings
from sagnac.analysis.verdict import verdict_of
from sagnac.core import arrays, units
from sagnac.core.documents import ANALYSES, ANALYSIS, AS_WRITTEN, finite, read_one_analysis
from sagnac.core.errors import ArgumentError, Note, RecordingError, path_of
from sagnac.core.units import Sensor, Unit
from sagnac.core.version import __version__
from sagnac.lines.model import Line
from sagnac.noise import cross_spectra, model_average
from sagnac.noise.estimates import Estimate, Fit
from sagnac.noise.laws import COEFFICIENT_NAMES, CoefficientName
from sagnac.report import error_text, findings_data, note_text, quantities, sections, tables
from sagnac.stability.curve import StabilityCurve

# ---- document ----------------------------------------------------------------------

Refused = Mapping[str, str]

_ENDS: Final = ("value", "low", "high")
_DEVIATION: Final = "deviation_deg_per_h"  # of the curve of gyros
_COUNTS: Final = ("terms", "noise_type")


def analysis_document(analysis: Analysis) -> dict[str, Any]:
    """Everything a program may want to know of an analysis, in field units.

    Returns
    -------
    dict
        Of schema ``sagnac.analysis/1``: strings, finite numbers, None, lists and
        mappings only. What is not a number (a coefficient that cannot be observed) is None.
        Coefficients and curve are per gyro; lines are of the channel they name. Of several gyros
        at rest all is of the first, ``per_gyro`` holds N of each, and ``gyros`` the document of
        each; ``refused`` says why a channel has none.
    """
    result.require_gyro(analysis)
    curve, verdict = analysis.curve, verdict_of(analysis)
    covariates = analysis.settings.covariates
    document = {
        "schema": ANALYSIS,
        "version": __version__,
        "input": _input(analysis),
        "settings": {
            "method": analysis.settings.method,
            "interval_s": analysis.settings.interval,
            "confidence": analysis.settings.confidence,
            # Not there if there are none, as in documents of earlier versions.
            **({"covariates": list(covariates)} if covariates else {}),
        },
        "channel": analysis.channel,
        "gyros_differenced": 2 if analysis.is_pair else 1,
        "angle_random_walk": {
            **_estimate(analysis.angle_random_walk),
            "source": analysis.source,
            **json_data.choice_data(analysis),
        },
        "coefficients": _coefficients(result.headline_coefficients(analysis)),
        **_of_sensor(analysis),
        **({} if verdict is None else {"verdict": sections.verdict_data(verdict)}),
        "parts": json_data.parts_data(analysis),
        "shares": json_data.shares_data(analysis),
        "triad": json_data.triad_data(analysis),
        "estimates": {name: _coefficients(fit.coefficients) for name, fit in analysis.fits.items()},
        "per_gyro": {name: _estimate(walk) for name, walk in analysis.per_gyro.items()},
        "lines": [tables.line_data(line) for line in analysis.lines],
        "curve": {"estimator": curve.estimator, **_points(curve, units.UNITS["deg/h"], _DEVIATION)},
        **_family(analysis),
        "findings": findings_data(analysis.findings),
        **_beside(analysis),
        "notes": [note_text(note) for note in analysis.notes],
        "seconds": dict(analysis.seconds),
    }
    return dict(finite(document))


def many_document(
    analyses: Iterable[Analysis], unit: Analysis | None = None, refused: Refused | None = None
) -> dict[str, Any]:
    """One document of several analyses (several files, or several gyros of one).

    Parameters
    ----------
    analyses
        In their order.
    unit
        Of which they are the gyros: its accelerometers, and what was refused, stand beside them,
        and the verdict is its own, since a gyro that was refused has none.
    refused
        Why, of each file that has no analysis.
    """
    analyses, refused = list(analyses), refused or {}
    decision = sections.overall_decision(analyses if unit is None else [unit], refused)
    return {
        "schema": ANALYSES,
        "version": __version__,
        **({} if decision is None else {"verdict": {"overall": decision}}),
        "analyses": [analysis_document(analysis) for analysis in analyses],
        **({"refused": dict(refused)} if refused else {}),
        **({} if unit is None else _beside(unit, gyros=False)),
    }


def comparison_document(analyses: Mapping[str, Analysis], refused: Refused) -> dict[str, Any]:
    """One document of several methods on one recording.

    Parameters
    ----------
    analyses
        By method.
    refused
        Why, of each method that this recording does not allow.
    """
    methods = {method: analysis_document(analysis) for method, analysis in analyses.items()}
    head = {"schema": "sagnac.comparison/1", "version": __version__}
    return {**head, "methods": methods, "refused": dict(refused)}


def self_noise_data(found: cross_spectra.SelfNoise) -> dict[str, Any]:
    """Self-noise of several gyros, in the field's units; what cannot be told is None."""
    size = units.DEGREE_PER_HOUR**2
    gyros: dict[str, dict[str, Any]] = {}
    for place, (name, estimate) in enumerate(found.angle_random_walk.items()):
        ends = {"density": found.density, "low": found.low, "high": found.high}
        densities = {key: (each[place] / size).tolist() for key, each in ends.items()}
        gain = float(found.gains[place])
        gyros[name] = {"angle_random_walk": _estimate(estimate), "gain": gain, **densities}
    shared = {"frequency_hz": found.frequency.tolist(), "motion": (found.motion / size).tolist()}
    return {"self_noise": finite({"unit": "(deg/h)^2/Hz", **shared, "gyros": gyros})}


def to_json(document: Mapping[str, Any]) -> str:
    """The document as text that strict readers accept: no NaN, no infinity."""
    # Numbers of numpy's that stand in the settings.
    own = methodcaller("item")
    return json.dumps(document, allow_nan=False, ensure_ascii=False, indent=1, default=own)


def _beside(analysis: Analysis, *, gyros: bool = True) -> dict[str, Any]:
    """The document of each gyro that was taken alone beside others; the accelerometers, and why
    there is no analysis of a channel. What there is none of is left out.
    """
    alone = {name: analysis_document(one) for name, one in analysis.gyros.items() if gyros}
    forces = {name: finite(_force_data(one)) for name, one in analysis.accelerometers.items()}
    refused = {name: error_text(why) for name, why in analysis.refused.items()}
    beside = {"gyros": alone, "accelerometers": forces, "refused": refused}
    return {key: each for key, each in beside.items() if each}


def _force_data(analysis: Analysis) -> dict[str, Any]:
    curve, unit = analysis.curve_before, units.UNITS[units.SENSED["accelerometer"].rate_unit]
    return {
        "velocity_random_walk": _estimate(analysis.angle_random_walk),
        "coefficients": _coefficients(result.answer_coefficients(analysis)),
        "source": analysis.source,
        "curve": {"estimator": curve.estimator, "unit": unit.name, **_points(curve, unit)},
        **_of_sensor(analysis),
        "lines": [
            {
                "frequency_hz": line.frequency,
                "velocity_amplitude_m_per_s": line.amplitude,
                "significance": line.significance,
            }
            for line in analysis.lines
        ],
        "findings": findings_data(analysis.findings),
        "notes": [note_text(note) for note in analysis.notes],
    }


def _of_sensor(analysis: Analysis) -> dict[str, Any]:
    """Spread of the coefficients, and traits of a gyro or an accelerometer."""
    return {
        "covariance": json_data.covariance_data(analysis),
        **json_data.low_pass_data(analysis),
        **json_data.readout_data(analysis),
        **json_data.slow_noise_data(analysis),
    }


def _points(curve: StabilityCurve, unit: Unit, deviation: str = "deviation") -> dict[str, Any]:
    """The points of a curve; its deviation goes by that name."""
    columns = quantities.curve_columns(curve, unit)
    others = {name: columns[name] for name in ("low", "high", "edf", *_COUNTS)}
    return {"tau_s": columns["tau"], deviation: columns["deviation"], **others}


def _input(analysis: Analysis) -> dict[str, Any]:
    rate = analysis.table_rate
    recording, read = analysis.recording, analysis.recording.provenance
    return {
        **{name: getattr(read, name, None) for name in ("path", "sha256", "format")},
        "slice_s": list(read.span_s) if read and read.span_s else None,
        "samples": recording.samples,
        "kind": recording.gyro(analysis.settings.gyros[0]).kind,
        "sample_rate_hz": recording.sample_rate,
        "duration_s": recording.duration,
        "gyros": list(analysis.settings.gyros),
        "table_rate_deg_per_s": None if rate is None else rate / units.DEGREE,
    }


def _family(analysis: Analysis) -> dict[str, Any]:
    """The curves asked for and their spectrum; nothing if none was."""
    if not analysis.family:
        return {}
    density = quantities.shown_density(analysis)
    curves = [
        {
            "estimator": curve.estimator,
            "unit": quantities.curve_unit(curve.estimator).name,
            "confidence": curve.confidence,
            **_points(curve, quantities.curve_unit(curve.estimator)),
            "notes": [note_text(note) for note in curve.notes],
        }
        for curve in analysis.family
    ]
    points = {"frequency_hz": density.frequency.tolist(), "density": density.density.tolist()}
    spectrum = {"estimator": "multitaper", "unit": "(deg/h)^2/Hz", **points}
    return {"curves": curves, "spectrum": spectrum}


def _coefficients(estimates: Mapping[CoefficientName, Estimate]) -> dict[str, Any]:
    there = {name: estimates[name] for name in COEFFICIENT_NAMES if name in estimates}
    return {units.SENSED[one.sensor].keys[name]: _estimate(one) for name, one in there.items()}


def _estimate(estimate: Estimate) -> dict[str, Any]:
    units = {
        unit: {end: getattr(estimate, end) / size for end in _ENDS}
        for unit, size in estimate.units.items()
    }
    unit = next(iter(units))
    stated = {"confidence": estimate.confidence, "unit": unit, "status": estimate.status}
    return {**units[unit], **stated, "units": units}


# ---- stored ------------------------------------------------------------------------

Document = Mapping[str, Any]


def read_analysis(path: str | Path) -> Analysis:
    """The analysis that a document holds, a file's or the text itself.

    Raises
    ------
    RecordingError
        If the file cannot be read, is no document of one analysis, or states what cannot be.
    """
    is_text = isinstance(path, str) and path.lstrip().startswith("{")
    document = read_one_analysis(path if is_text else path_of("path", path))
    try:
        return analysis_from(document)
    except (ValueError, KeyError, TypeError) as error:
        why = f": {error}" if type(error) in (ValueError, ArgumentError) else ""
        where, problem = "text" if is_text else str(path), f"states what cannot be{why}"
        raise RecordingError(problem, path=where, remedy=AS_WRITTEN) from None


def analysis_from(document: Document, channel: str = "", of: Document | None = None) -> Analysis:
    """The analysis that a document of schema ``sagnac.analysis/1`` states, in SI.

    Parameters
    ----------
    document
        As `sagnac.report.document.analysis_document` makes it; or what it holds of an
        accelerometer.
    channel, of
        Of an accelerometer: its name, and the document of its gyros.

    Raises
    ------
    ValueError, KeyError, TypeError
        If it breaks its schema.
    """
    sensor: Sensor = "gyro" if of is None else "accelerometer"
    whole, settled = of or document, (of or document)["settings"]
    facts, stated = whole["input"], document[units.SENSED[sensor].keys["angle_random_walk"]]
    channel = channel or document["channel"]
    rate = facts.get("table_rate_deg_per_s") if of is None else None
    forces = document.get("accelerometers") or {}
    fits, walks = (document.get(key, {}).items() for key in ("estimates", "per_gyro"))
    family = tuple(_curve(one, sensor, whole) for one in document.get("curves") or ())
    return Analysis.of_fields(
        stored=document,
        settings=Settings(
            gyros=tuple(facts["gyros"]) if of is None else (channel,),
            method=settled["method"],
            interval=settled.get("interval_s"),
            confidence=settled["confidence"],
            estimators=tuple(curve.estimator for curve in family),
            covariates=tuple(settled.get("covariates", ())),
        ),
        channel=channel,
        table_rate=None if rate is None else rate * units.DEGREE,
        angle_random_walk=_stored_estimate("angle_random_walk", stated, sensor),
        source=stated["source"] if of is None else document["source"],
        average=_average(stated),
        coefficients=_stored_coefficients(document["coefficients"], sensor),
        covariance=_covariance(document.get("covariance")) if of is None else None,
        fits={name: Fit(method=name, coefficients=_stored_coefficients(one)) for name, one in fits},
        per_gyro={name: _stored_estimate("angle_random_walk", one) for name, one in walks},
        parts=tuple(map(_part, document.get("parts") or ())),
        lines=tuple(_stored_line(one, channel) for one in document["lines"]),
        curve=_curve(document["curve"], sensor, whole),
        family=family,
        notes=_notes(document),
        seconds=dict(document.get("seconds", {})),
        gyros={name: analysis_from(one) for name, one in document.get("gyros", {}).items()},
        accelerometers={name: analysis_from(one, name, document) for name, one in forces.items()},
        refused={name: RecordingError(why) for name, why in document.get("refused", {}).items()},
    )


def _number(stated: float | None, size: float = 1.0) -> float:
    """A number in SI; NaN for the None of JSON."""
    return math.nan if stated is None else float(stated) * size


def _numbers(stated: Sequence[float | None], size: float = 1.0) -> arrays.FloatArray:
    """Numbers in SI; NaN for each None."""
    return size * np.array([_number(one) for one in stated])


def _ends(stated: Document, size: float) -> dict[str, float]:
    """Value and interval in SI."""
    return {end: _number(stated[end], size) for end in _ENDS}


def _stored_estimate(name: CoefficientName, stated: Document, sensor: Sensor = "gyro") -> Estimate:
    ends = _ends(stated, units.SENSED[sensor].coefficients[name][stated["unit"]])
    status, confidence = stated["status"], stated["confidence"]
    return Estimate(**ends, confidence=confidence, status=status, name=name, sensor=sensor)


Coefficients = dict[CoefficientName, Estimate]


def _stored_coefficients(stated: Document, sensor: Sensor = "gyro") -> Coefficients:
    keys = units.SENSED[sensor].keys
    there = [name for name in COEFFICIENT_NAMES if keys[name] in stated]
    return {name: _stored_estimate(name, stated[keys[name]], sensor) for name in there}


def _covariance(stated: Document | None) -> result.Covariance | None:
    if stated is None:
        return None
    sizes = [units.field_unit(name).size for name in stated["names"]]
    matrix = np.array(list(map(_numbers, stated["matrix"]))) * np.outer(sizes, sizes)
    return result.Covariance(names=tuple(stated["names"]), matrix=matrix)


def _average(stated: Document) -> model_average.ModelChoice | None:
    if "band_hz" not in stated:
        return None
    low, high = map(_number, stated["band_hz"])
    others = {name: stated[name] for name in ("share", "member", "slow_terms") if name in stated}
    return model_average.ModelChoice(band_hz=(low, high), terms=tuple(stated["terms"]), **others)


def _part(stated: Document) -> result.Part:
    ends = _ends(stated, units.field_unit("angle_random_walk").size)
    return result.Part(start_s=stated["start_s"], stop_s=stated["stop_s"], **ends)


def _stored_line(stated: Document, channel: str) -> Line:
    """A line; of an accelerometer the document states no phase and no errors."""

    def read(key: str, size: float = 1.0) -> float:
        return _number(stated.get(key), size)

    scale, of_force = stated.get("scale", "time"), "velocity_amplitude_m_per_s"
    kind, unit = tables.LINE_PLACES[scale]
    figures = {field: read(key, size) for key, (field, size) in tables.LINE_FIGURES.items()}
    if of_force in stated:
        figures["amplitude"] = read(of_force)
    return Line(
        scale=scale,
        frequency=read(f"{kind}{unit}"),
        frequency_error=read(f"{kind}_error{unit}"),
        **figures,
        significance=read("significance"),
        channel=stated.get("channel", channel),
        name=stated.get("name", ""),
    )


def _curve(stated: Document, sensor: Sensor, document: Document) -> StabilityCurve:
    """A curve, per gyro. Terms and noise types are 0 if an older document does not state them."""
    size = units.UNITS[stated.get("unit", units.SENSED[sensor].rate_unit)].size
    tau = _numbers(stated["tau_s"])
    return StabilityCurve(
        tau=tau,
        deviation=_numbers(stated[_DEVIATION if _DEVIATION in stated else "deviation"], size),
        edf=_numbers(stated.get("edf", [None] * tau.size)),
        low=_numbers(stated["low"], size),
        high=_numbers(stated["high"], size),
        **{name: np.array(stated.get(name, [0] * tau.size), np.int64) for name in _COUNTS},
        estimator=stated.get("estimator", "oadev"),
        kind="angle",
        sample_rate=document["input"]["sample_rate_hz"],
        confidence=stated.get("confidence", document["settings"]["confidence"]),
        samples=document["input"]["samples"],
        notes=tuple(Note(text=text) for text in stated.get("notes", ())),
    )


def _notes(document: Document) -> tuple[Note, ...]:
    """Notes by their texts; those that are findings have their names again."""
    findings = [Note(**one) for one in document.get("findings", ())]
    named = {f"{one.channel}: {one.text}" if one.channel else one.text: one for one in findings}
    return tuple(named.get(text, Note(text=text)) for text in document["notes"])
