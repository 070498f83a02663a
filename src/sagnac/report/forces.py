"""Accelerometers on page, terminal and in JSON: their coefficients and curves in their units."""

import math
from collections.abc import Sequence
from typing import Any, Final

from matplotlib.figure import Figure

from sagnac.analysis.headline_coefficients import answer_coefficients
from sagnac.analysis.low_pass import low_pass_data
from sagnac.analysis.plain import covariance_data
from sagnac.analysis.result import Analysis
from sagnac.coefficients.estimates import Estimate
from sagnac.coefficients.laws import COEFFICIENT_NAMES, SYMBOLS
from sagnac.report.command_line import note_text
from sagnac.report.figures import curves_figure
from sagnac.report.quantities import figures, number
from sagnac.units import SENSED, UNITS, field_unit

_SENSED: Final = SENSED["accelerometer"]


def force_rows(analyses: Sequence[Analysis]) -> list[tuple[str, str, tuple[str, ...]]]:
    """The coefficients of accelerometers: symbol and title, unit, and a reading of each.

    Parameters
    ----------
    analyses
        Of accelerometers.
    """
    rows = []
    for name in COEFFICIENT_NAMES:
        unit = field_unit(name, "accelerometer")
        readings = [_reading(answer_coefficients(one).get(name), unit.size) for one in analyses]
        rows.append((f"{SYMBOLS[name]} {_SENSED.titles[name]}", unit.symbol, tuple(readings)))
    return rows


def _reading(estimate: Estimate | None, size: float) -> str:
    if estimate is None:
        return "not fitted"
    shown = estimate.times(1.0 / size)
    if shown.status == "not observable":
        return shown.status
    if shown.status == "upper bound":
        return f"< {number(shown.high, plain=True)}"
    value, interval = figures(shown, plain=True)
    return f"{value} [{interval.replace(' … ', ', ')}]"


def force_figure(analyses: Sequence[Analysis]) -> Figure:
    """Allan deviation of accelerometers against cluster time, as recorded."""
    return curves_figure(analyses, UNITS[_SENSED.rate_unit])


def force_notes(analyses: Sequence[Analysis]) -> tuple[str, ...]:
    """Notes on accelerometers that do not stand among those of the recording."""
    read = [note for one in analyses for note in one.recording.notes]
    return tuple(
        dict.fromkeys(note_text(note) for one in analyses for note in one.notes if note not in read)
    )


def forces_data(analyses: Sequence[Analysis]) -> dict[str, Any]:
    """The accelerometers for JSON: name -> coefficients, curve, lines and notes.

    Returns
    -------
    dict
        ``{}`` if there are none, else ``accelerometers``. A figure that is not finite is None.
    """
    if not analyses:
        return {}
    return {"accelerometers": {one.channel: _force_data(one) for one in analyses}}


def _force_data(analysis: Analysis) -> dict[str, Any]:
    unit = UNITS[_SENSED.rate_unit]
    curve = analysis.curve_before
    estimates = answer_coefficients(analysis)
    return {
        "velocity_random_walk": _data("angle_random_walk", analysis.angle_random_walk),
        "coefficients": {
            _SENSED.titles[name].replace(" ", "_"): _data(name, estimates[name])
            for name in COEFFICIENT_NAMES
            if name in estimates
        },
        "source": analysis.source,
        "curve": {
            "estimator": curve.estimator,
            "unit": unit.name,
            "tau_s": curve.tau.tolist(),
            "deviation": (curve.deviation / unit.size).tolist(),
            "low": (curve.low / unit.size).tolist(),
            "high": (curve.high / unit.size).tolist(),
            "edf": curve.edf.tolist(),
        },
        "covariance": covariance_data(analysis),
        **low_pass_data(analysis),
        "lines": [
            {
                "frequency_hz": line.frequency,
                "velocity_amplitude_m_per_s": line.amplitude,
                "significance": line.significance,
            }
            for line in analysis.lines
        ],
        "notes": [note_text(note) for note in analysis.notes],
    }


def _data(name: str, estimate: Estimate) -> dict[str, Any]:
    units = _SENSED.coefficients[name]

    def plain(value: float) -> float | None:
        return value if math.isfinite(value) else None

    def limits(size: float) -> dict[str, float | None]:
        shown = estimate.times(1.0 / size)
        return {"value": plain(shown.value), "low": plain(shown.low), "high": plain(shown.high)}

    return {
        **limits(next(iter(units.values()))),
        "confidence": estimate.confidence,
        "unit": next(iter(units)),
        "status": estimate.status,
        "units": {unit: limits(size) for unit, size in units.items()},
    }
