"""An analysis as JSON, schema ``sagnac.analysis/1``."""

import json
import math
from collections.abc import Iterable, Mapping
from typing import Any, Final

from sagnac.analysis.headline_coefficients import headline_coefficients
from sagnac.analysis.judgement import verdict_of
from sagnac.analysis.low_pass import low_pass_data
from sagnac.analysis.plain import (
    covariance_data,
    parts_data,
    resting_data,
    shares_data,
    triad_data,
)
from sagnac.analysis.result import Analysis
from sagnac.coefficients.estimates import Estimate, in_units
from sagnac.coefficients.laws import COEFFICIENT_NAMES, CoefficientName
from sagnac.documents import ANALYSES, ANALYSIS
from sagnac.lines.model import Line
from sagnac.report.command_line import error_text, findings_data, note_text
from sagnac.report.forces import forces_data
from sagnac.report.quantities import curve_unit, in_field_unit
from sagnac.report.spectra import per_gyro_density
from sagnac.report.verdicts import overall_decision, verdict_data
from sagnac.units import ARCSECOND, DEGREE, DEGREE_PER_HOUR, field_unit
from sagnac.version import __version__

COMPARISON_SCHEMA: Final = "sagnac.comparison/1"


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
    curve = analysis.curve.per_gyro()
    answer = _estimate("angle_random_walk", analysis.angle_random_walk)
    document = {
        "schema": ANALYSIS,
        "version": __version__,
        "input": _input(analysis),
        "settings": {
            "method": analysis.settings.method,
            "interval_s": analysis.settings.interval,
            "confidence": analysis.settings.confidence,
        },
        "channel": analysis.channel,
        "gyros_differenced": analysis.gyros_differenced,
        "angle_random_walk": {**answer, "source": analysis.source, **resting_data(analysis)},
        "coefficients": _coefficients(headline_coefficients(analysis)),
        "covariance": covariance_data(analysis),
        **low_pass_data(analysis),
        **_verdict(analysis),
        "parts": parts_data(analysis),
        "shares": shares_data(analysis),
        "triad": triad_data(analysis),
        "estimates": {name: _coefficients(fit.coefficients) for name, fit in analysis.fits.items()},
        "per_gyro": {
            name: _estimate("angle_random_walk", estimate)
            for name, estimate in analysis.per_gyro.items()
        },
        "lines": [_line(line) for line in analysis.lines],
        "curve": {
            "estimator": curve.estimator,
            "tau_s": curve.tau.tolist(),
            "deviation_deg_per_h": (curve.deviation / DEGREE_PER_HOUR).tolist(),
            "low": (curve.low / DEGREE_PER_HOUR).tolist(),
            "high": (curve.high / DEGREE_PER_HOUR).tolist(),
            "edf": curve.edf.tolist(),
        },
        **_family(analysis),
        "findings": findings_data(analysis.findings),
        **_gyros(analysis),
        **_forces(analysis),
        **_refused(analysis),
        "notes": [note_text(note) for note in analysis.notes],
        "seconds": dict(analysis.seconds),
    }
    cleaned: dict[str, Any] = _finite(document)
    return cleaned


def many_document(analyses: Iterable[Analysis], unit: Analysis | None = None) -> dict[str, Any]:
    """One document of several analyses (several files, or several gyros of one).

    Parameters
    ----------
    analyses
        In their order.
    unit
        Of which they are the gyros: its accelerometers, and what was refused, stand beside them.
    """
    analyses = list(analyses)
    decision = overall_decision(analyses)
    return {
        "schema": ANALYSES,
        "version": __version__,
        **({} if decision is None else {"verdict": {"overall": decision}}),
        "analyses": [analysis_document(analysis) for analysis in analyses],
        **({} if unit is None else {**_forces(unit), **_refused(unit)}),
    }


def comparison_document(
    analyses: Mapping[str, Analysis], refused: Mapping[str, str]
) -> dict[str, Any]:
    """One document of several methods on one recording.

    Parameters
    ----------
    analyses
        By method.
    refused
        Why, of each method that this recording does not allow.
    """
    return {
        "schema": COMPARISON_SCHEMA,
        "version": __version__,
        "methods": {method: analysis_document(analysis) for method, analysis in analyses.items()},
        "refused": dict(refused),
    }


def to_json(document: Mapping[str, Any]) -> str:
    """The document as text that strict readers accept: no NaN, no infinity."""
    return json.dumps(document, allow_nan=False, ensure_ascii=False, indent=1)


def _gyros(analysis: Analysis) -> dict[str, Any]:
    """The document of each gyro that was taken alone beside others."""
    if not analysis.gyros:
        return {}
    return {"gyros": {name: analysis_document(one) for name, one in analysis.gyros.items()}}


def _forces(analysis: Analysis) -> dict[str, Any]:
    return forces_data(list(analysis.accelerometers.values()))


def _refused(analysis: Analysis) -> dict[str, Any]:
    """Why there is no analysis of a channel."""
    if not analysis.refused:
        return {}
    return {"refused": {name: error_text(why) for name, why in analysis.refused.items()}}


def _verdict(analysis: Analysis) -> dict[str, Any]:
    """The verdict, if a specification was stated."""
    verdict = verdict_of(analysis)
    return {} if verdict is None else {"verdict": verdict_data(verdict)}


def _input(analysis: Analysis) -> dict[str, Any]:
    recording = analysis.recording
    provenance = recording.provenance
    return {
        "path": provenance.path if provenance else None,
        "sha256": provenance.sha256 if provenance else None,
        "format": provenance.format if provenance else None,
        "slice_s": list(provenance.span_s) if provenance and provenance.span_s else None,
        "samples": recording.samples,
        "kind": recording.gyro(analysis.settings.gyros[0]).kind,
        "sample_rate_hz": recording.sample_rate,
        "duration_s": recording.duration,
        "gyros": list(analysis.settings.gyros),
        "table_rate_deg_per_s": (
            None if analysis.table_rate is None else analysis.table_rate / DEGREE
        ),
    }


def _family(analysis: Analysis) -> dict[str, Any]:
    """The curves asked for and their spectrum; nothing if none was."""
    if not analysis.family:
        return {}
    curves = []
    for measured in analysis.family:
        curve = measured.per_gyro()
        unit = curve_unit(curve.estimator)
        curves.append(
            {
                "estimator": curve.estimator,
                "unit": unit.name,
                "confidence": curve.confidence,
                "tau_s": curve.tau.tolist(),
                "deviation": (curve.deviation / unit.size).tolist(),
                "low": (curve.low / unit.size).tolist(),
                "high": (curve.high / unit.size).tolist(),
                "edf": curve.edf.tolist(),
                "terms": curve.terms.tolist(),
                "noise_type": curve.noise_type.tolist(),
                "notes": [note_text(note) for note in curve.notes],
            }
        )
    density = per_gyro_density(analysis)
    return {
        "curves": curves,
        "spectrum": {
            "estimator": "multitaper",
            "unit": "(deg/h)^2/Hz",
            "frequency_hz": density.frequency.tolist(),
            "density": density.density.tolist(),
        },
    }


def _coefficients(estimates: Mapping[CoefficientName, Estimate]) -> dict[str, Any]:
    return {
        name: _estimate(name, estimates[name]) for name in COEFFICIENT_NAMES if name in estimates
    }


def _estimate(name: CoefficientName, estimate: Estimate) -> dict[str, Any]:
    shown = in_field_unit(name, estimate)
    return {
        "value": shown.value,
        "low": shown.low,
        "high": shown.high,
        "confidence": shown.confidence,
        "unit": field_unit(name).name,
        "status": shown.status,
        "units": {
            unit: {"value": value, "low": low, "high": high}
            for (unit, value), low, high in zip(
                in_units(name, estimate.value).items(),
                in_units(name, estimate.low).values(),
                in_units(name, estimate.high).values(),
                strict=True,
            )
        },
    }


def _line(line: Line) -> dict[str, Any]:
    position = (
        {"order": line.frequency, "order_error": line.frequency_error}
        if line.scale == "angle"
        else {"frequency_hz": line.frequency, "frequency_error_hz": line.frequency_error}
    )
    return {
        "scale": line.scale,
        **position,
        "amplitude_arcsec": line.amplitude / ARCSECOND,
        "amplitude_error_arcsec": line.amplitude_error / ARCSECOND,
        "phase_deg": line.phase / DEGREE,
        "phase_error_deg": line.phase_error / DEGREE,
        "channel": line.channel,
        "significance": line.significance,
        "name": line.name,
    }


def _finite(value: Any) -> Any:
    """The same tree with None for every NaN and infinity (JSON has neither)."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return value
