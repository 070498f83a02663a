"""An analysis as JSON (schema ``sagnac.analysis/1``) and as tables."""

import csv
import io
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.ndimage import median_filter
from scipy.stats import gamma

from sagnac import __version__
from sagnac.analysis.result import Analysis
from sagnac.analysis.spectra import Spectrum
from sagnac.coefficients.estimates import Estimate, Fit, in_units
from sagnac.coefficients.laws import COEFFICIENT_NAMES, CoefficientName
from sagnac.formats.source import replacing
from sagnac.lines.model import Line
from sagnac.recording.difference import per_gyro
from sagnac.report.wording import FIELD_UNITS, in_field_unit
from sagnac.stability.curve import StabilityCurve
from sagnac.stability.estimators import Estimator
from sagnac.units import ARCSECOND, DEGREE, DEGREE_PER_HOUR

SCHEMA: Final = "sagnac.analysis/1"
MANY_SCHEMA: Final = "sagnac.analyses/1"
COMPARISON_SCHEMA: Final = "sagnac.comparison/1"

_NEIGHBOURS: Final = 51


def analysis_document(analysis: Analysis) -> dict[str, Any]:
    """Everything a program may want to know of an analysis, in field units.

    Returns
    -------
    dict
        Of schema ``sagnac.analysis/1``: strings, finite numbers, None, lists and
        mappings only. What is not a number (a coefficient that cannot be observed) is None.
        Coefficients and curve are per gyro; lines are of the channel they name.
    """
    headline = headline_fit(analysis)
    curve = per_gyro_curve(analysis.curve, analysis.gyros_differenced)
    answer = _estimate("angle_random_walk", analysis.angle_random_walk)
    document = {
        "schema": SCHEMA,
        "version": __version__,
        "input": _input(analysis),
        "settings": {
            "method": analysis.settings.method,
            "interval_s": analysis.settings.interval,
            "confidence": analysis.settings.confidence,
        },
        "channel": analysis.channel,
        "gyros_differenced": analysis.gyros_differenced,
        "angle_random_walk": {**answer, "source": analysis.source},
        "coefficients": _coefficients(headline) if headline else {},
        "estimates": {name: _coefficients(fit) for name, fit in analysis.fits.items()},
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
        "notes": list(analysis.notes),
        "seconds": dict(analysis.seconds),
    }
    cleaned: dict[str, Any] = _finite(document)
    return cleaned


def many_document(analyses: Iterable[Analysis]) -> dict[str, Any]:
    """One document of several analyses (several files, or several gyros of one)."""
    return {
        "schema": MANY_SCHEMA,
        "version": __version__,
        "analyses": [analysis_document(analysis) for analysis in analyses],
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


def headline_fit(analysis: Analysis) -> Fit | None:
    """The fit that the answer rests on, or None where the answer is of no fit."""
    for fit in analysis.fits.values():
        if fit.coefficients.get("angle_random_walk") == analysis.angle_random_walk:
            return fit
    return None


def shown_estimates(analysis: Analysis) -> dict[CoefficientName, Estimate]:
    """What was estimated or bounded: by the fit the answer rests on, else the answer alone."""
    fit = headline_fit(analysis)
    estimates: Mapping[CoefficientName, Estimate] = (
        {"angle_random_walk": analysis.angle_random_walk} if fit is None else fit.coefficients
    )
    return {
        name: estimates[name]
        for name in COEFFICIENT_NAMES
        if name in estimates and estimates[name].status != "not observable"
    }


def per_gyro_curve(curve: StabilityCurve, gyros_differenced: int) -> StabilityCurve:
    """The curve of one gyro, in root mean square, where `curve` is of a difference."""
    size = per_gyro(1.0, gyros_differenced)
    return replace(
        curve, deviation=size * curve.deviation, low=size * curve.low, high=size * curve.high
    )


def per_gyro_density(analysis: Analysis) -> Spectrum:
    """Frequency (Hz) and one-sided rate density of one gyro, (deg/h)^2/Hz."""
    measured = analysis.density
    if measured is None:
        return Spectrum(frequency=np.empty(0), density=np.empty(0))
    size = (per_gyro(1.0, analysis.gyros_differenced) / DEGREE_PER_HOUR) ** 2
    return Spectrum(frequency=measured.frequency, density=size * measured.density)


def coarser(spectrum: Spectrum, most: int) -> Spectrum:
    """The spectrum in `most` log-spaced bins at most, each the mean of those it takes."""
    if spectrum.frequency.size <= most:
        return spectrum
    edges = np.geomspace(spectrum.frequency[0], spectrum.frequency[-1], most + 1)[:-1]
    starts = np.unique(np.searchsorted(spectrum.frequency, edges))
    # Bins that were log-spaced before are wider at high frequency and count by their width.
    width = np.gradient(spectrum.frequency)
    total = np.add.reduceat(width, starts)
    return Spectrum(
        frequency=np.add.reduceat(width * spectrum.frequency, starts) / total,
        density=np.add.reduceat(width * spectrum.density, starts) / total,
    )


def curve_unit(estimator: Estimator) -> tuple[float, str, str]:
    """Unit that a curve is shown in: its size in SI, for a machine, for a person."""
    if estimator == "tdev":
        return ARCSECOND, "arcsec", "″"
    return DEGREE_PER_HOUR, "deg/h", "°/h"


def residual_peaks(analysis: Analysis, false_alarm: float = 1e-3) -> int:
    """How many peaks the spectrum after removal still has.

    A bin is one of a peak where it stands above the median of the bins around it by
    more than noise does once in `false_alarm` over the whole spectrum; bins that touch
    are one peak. Bins are means of `n` exponential ordinates, Gamma of shape `n`.
    """
    frequency, density = analysis.spectrum.frequency, analysis.spectrum.density
    if density.size < _NEIGHBOURS:
        return 0
    shape = np.maximum(np.round(np.gradient(frequency) * analysis.recording.duration), 1.0)
    threshold = gamma.isf(false_alarm / density.size, shape) / gamma.median(shape)
    above = density > threshold * median_filter(density, _NEIGHBOURS, mode="nearest")
    return int(np.count_nonzero(above[1:] & ~above[:-1]) + above[0])


def to_json(document: Mapping[str, Any]) -> str:
    """The document as text that strict readers accept: no NaN, no infinity."""
    return json.dumps(document, allow_nan=False, ensure_ascii=False, indent=1)


def stability_table(analysis: Analysis) -> str:
    """CSV of the curve, per gyro, after and before removal; units stand in the header."""
    columns = {
        f"{prefix}{name}": values
        for prefix, measured in (("", analysis.curve), ("before_", analysis.curve_before))
        for curve in (per_gyro_curve(measured, analysis.gyros_differenced),)
        for name, values in (
            ("tau[s]", curve.tau),
            ("deviation[deg/h]", curve.deviation / DEGREE_PER_HOUR),
            ("low[deg/h]", curve.low / DEGREE_PER_HOUR),
            ("high[deg/h]", curve.high / DEGREE_PER_HOUR),
            ("edf", curve.edf),
            ("terms", curve.terms),
            ("noise_type", curve.noise_type),
        )
    }
    longest = max(len(values) for values in columns.values())
    rows = [
        [
            _cell(values[index]) if index < len(values) else ""
            for values in (column.tolist() for column in columns.values())
        ]
        for index in range(longest)
    ]
    return _csv(list(columns), rows)


def family_table(analysis: Analysis) -> str:
    """CSV of every curve asked for, per gyro, one below the other."""
    rows = []
    for measured in analysis.family:
        curve = per_gyro_curve(measured, analysis.gyros_differenced)
        size, unit, _ = curve_unit(curve.estimator)
        columns = (
            curve.tau,
            curve.deviation / size,
            curve.low / size,
            curve.high / size,
            curve.edf,
            curve.terms,
            curve.noise_type,
        )
        rows += [
            [curve.estimator, unit, *(_cell(value) for value in row)]
            for row in zip(*(column.tolist() for column in columns), strict=True)
        ]
    header = ("estimator", "unit", "tau[s]", "deviation", "low", "high", "edf", "terms")
    return _csv((*header, "noise_type"), rows)


def density_table(analysis: Analysis) -> str:
    """CSV of the multitaper rate spectrum, per gyro, one-sided."""
    shown = per_gyro_density(analysis)
    rows = zip(shown.frequency.tolist(), shown.density.tolist(), strict=True)
    return _csv(
        ("frequency[Hz]", "density[(deg/h)^2/Hz]"), ([_cell(cell) for cell in row] for row in rows)
    )


def line_table(analysis: Analysis) -> str:
    """CSV of the lines, strongest first; units stand in the header."""
    header = (
        "scale",
        "order",
        "order_error",
        "frequency[Hz]",
        "frequency_error[Hz]",
        "amplitude[arcsec]",
        "amplitude_error[arcsec]",
        "phase[deg]",
        "phase_error[deg]",
        "significance",
        "channel",
        "name",
    )
    rows = []
    for line in analysis.lines:
        position = [_cell(line.frequency), _cell(line.frequency_error)]
        rows.append(
            [
                line.scale,
                *(position if line.scale == "angle" else ["", ""]),
                *(position if line.scale == "time" else ["", ""]),
                _cell(line.amplitude / ARCSECOND),
                _cell(line.amplitude_error / ARCSECOND),
                _cell(line.phase / DEGREE),
                _cell(line.phase_error / DEGREE),
                _cell(line.significance),
                line.channel,
                line.name,
            ]
        )
    return _csv(header, rows)


def write_text(path: Path, text: str) -> None:
    """Write a file whole or not at all.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _input(analysis: Analysis) -> dict[str, Any]:
    recording = analysis.recording
    provenance = recording.provenance
    return {
        "path": provenance.path if provenance else None,
        "sha256": provenance.sha256 if provenance else None,
        "format": provenance.format if provenance else None,
        "slice_s": list(provenance.span_s) if provenance and provenance.span_s else None,
        "samples": recording.samples,
        "sample_rate_hz": recording.sample_rate,
        "duration_s": recording.duration,
        "gyros": list(analysis.settings.gyros),
        "table_rate_deg_per_s": (
            None if analysis.table_rate is None else analysis.table_rate / DEGREE
        ),
    }


def _family(analysis: Analysis) -> dict[str, Any]:
    """The curves asked for and their spectrum; nothing where none was."""
    if not analysis.family:
        return {}
    curves = []
    for measured in analysis.family:
        curve = per_gyro_curve(measured, analysis.gyros_differenced)
        size, unit, _ = curve_unit(curve.estimator)
        curves.append(
            {
                "estimator": curve.estimator,
                "unit": unit,
                "confidence": curve.confidence,
                "tau_s": curve.tau.tolist(),
                "deviation": (curve.deviation / size).tolist(),
                "low": (curve.low / size).tolist(),
                "high": (curve.high / size).tolist(),
                "edf": curve.edf.tolist(),
                "terms": curve.terms.tolist(),
                "noise_type": curve.noise_type.tolist(),
                "notes": [str(note) for note in curve.notes],
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


def _coefficients(fit: Fit) -> dict[str, Any]:
    return {
        name: _estimate(name, fit.coefficients[name])
        for name in COEFFICIENT_NAMES
        if name in fit.coefficients
    }


def _estimate(name: CoefficientName, estimate: Estimate) -> dict[str, Any]:
    shown = in_field_unit(name, estimate)
    return {
        "value": shown.value,
        "low": shown.low,
        "high": shown.high,
        "confidence": shown.confidence,
        "unit": FIELD_UNITS[name][1],
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


def _cell(value: float) -> str:
    return f"{value:.9g}" if math.isfinite(value) else ""


def _csv(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()
