"""An analysis read back from its document, ``analysis.json``.

A document holds the answer and what it rests on, not the recording: `recording`, the spectra, the
curve before removal and the residual are not set, and asking for one of them says so.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sagnac.analysis.parts import Part
from sagnac.analysis.result import Analysis, Covariance
from sagnac.analysis.settings import Settings
from sagnac.coefficients.estimates import Estimate, Fit, FitName, OptionalName, estimate_units
from sagnac.coefficients.laws import COEFFICIENT_NAMES, CoefficientName
from sagnac.coefficients.model_average import Resting
from sagnac.documents import read_analyses
from sagnac.errors import Note, RecordingError
from sagnac.lines.model import Line
from sagnac.stability.curve import StabilityCurve
from sagnac.units import ARCSECOND, DEGREE, SENSED, UNITS, Sensor, field_unit

Document = Mapping[str, Any]


def read_analysis(path: str | Path) -> Analysis:
    """The analysis that a document holds.

    Raises
    ------
    RecordingError
        If the file cannot be read, is no document of one analysis, or states what cannot be.
    """
    documents = read_analyses(Path(path))
    if len(documents) > 1:
        raise RecordingError(
            f"holds {len(documents)} analyses", path=str(path), remedy="give the document of one"
        )
    try:
        return analysis_from(documents[0])
    except (ValueError, KeyError, TypeError) as error:
        raise RecordingError(
            f"states what cannot be: {error}",
            path=str(path),
            remedy="give the analysis.json that an analysis wrote, as it wrote it",
        ) from None


def analysis_from(document: Document) -> Analysis:
    """The analysis that a document of schema ``sagnac.analysis/1`` states, in SI.

    Parameters
    ----------
    document
        As `sagnac.report.document.analysis_document` makes it.

    Raises
    ------
    ValueError, KeyError, TypeError
        If it breaks its schema.
    """
    said, settings = document["input"], document["settings"]
    rate = said.get("table_rate_deg_per_s")
    stated = document["angle_random_walk"]
    alone = {name: analysis_from(one) for name, one in document.get("gyros", {}).items()}
    return Analysis.of_fields(
        stored=document,
        settings=Settings(
            gyros=tuple(said["gyros"]),
            method=settings["method"],
            interval=settings.get("interval_s"),
            confidence=settings["confidence"],
        ),
        channel=document["channel"],
        gyros_differenced=document["gyros_differenced"],
        table_rate=None if rate is None else rate * DEGREE,
        angle_random_walk=_estimate("angle_random_walk", stated),
        source=stated["source"],
        average=_average(stated),
        coefficients=_coefficients(document["coefficients"]),
        covariance=_covariance(document.get("covariance")),
        fits={name: _fit(name, found) for name, found in document["estimates"].items()},
        per_gyro={
            name: _estimate("angle_random_walk", one)
            for name, one in document.get("per_gyro", {}).items()
        },
        parts=tuple(map(_part, document.get("parts") or ())),
        lines=tuple(map(_line, document["lines"])),
        curve=_curve(document["curve"], "deviation_deg_per_h", "gyro", document),
        notes=_notes(document),
        seconds=dict(document["seconds"]),
        gyros=alone,
        accelerometers={
            name: _force(name, one, document)
            for name, one in (document.get("accelerometers") or {}).items()
        },
        refused={name: RecordingError(why) for name, why in document.get("refused", {}).items()},
    )


def _force(channel: str, stated: Document, document: Document) -> Analysis:
    """An accelerometer of the document of its gyros."""
    titles = SENSED["accelerometer"].titles
    keys = {name: titles[name].replace(" ", "_") for name in COEFFICIENT_NAMES}
    walk = _estimate("angle_random_walk", stated["velocity_random_walk"], "accelerometer")
    settings = document["settings"]
    return Analysis.of_fields(
        stored=stated,
        settings=Settings(
            gyros=(channel,),
            method=settings["method"],
            interval=settings.get("interval_s"),
            confidence=walk.confidence,
        ),
        channel=channel,
        gyros_differenced=1,
        table_rate=None,
        angle_random_walk=walk,
        source=stated["source"],
        coefficients={
            name: _estimate(name, stated["coefficients"][key], "accelerometer")
            for name, key in keys.items()
            if key in stated["coefficients"]
        },
        fits={},
        per_gyro={},
        lines=tuple(
            _time_line(one["frequency_hz"], one["velocity_amplitude_m_per_s"], one, channel)
            for one in stated["lines"]
        ),
        curve=_curve(stated["curve"], "deviation", "accelerometer", document),
        notes=tuple(Note(text=text) for text in stated["notes"]),
        seconds={},
    )


def _number(value: float | None) -> float:
    """A number, or NaN for the None of JSON."""
    return math.nan if value is None else float(value)


def _estimate(
    name: CoefficientName | OptionalName, stated: Document, sensor: Sensor = "gyro"
) -> Estimate:
    size = estimate_units(name, sensor)[stated["unit"]]
    return Estimate(
        value=_number(stated["value"]) * size,
        low=_number(stated["low"]) * size,
        high=_number(stated["high"]) * size,
        confidence=stated["confidence"],
        status=stated["status"],
        name=name,
        sensor=sensor,
    )


def _coefficients(stated: Document) -> dict[CoefficientName, Estimate]:
    return {name: _estimate(name, stated[name]) for name in COEFFICIENT_NAMES if name in stated}


def _fit(name: FitName, stated: Document) -> Fit:
    return Fit(method=name, coefficients=_coefficients(stated))


def _covariance(stated: Document | None) -> Covariance | None:
    if stated is None:
        return None
    sizes = np.array([field_unit(name).size for name in stated["names"]])
    matrix = np.array([[_number(one) for one in row] for row in stated["matrix"]], dtype=float)
    return Covariance(names=tuple(stated["names"]), matrix=matrix * np.outer(sizes, sizes))


def _average(stated: Document) -> Resting | None:
    if "band_hz" not in stated:
        return None
    low, high = map(_number, stated["band_hz"])
    return Resting(
        band_hz=(low, high),
        terms=tuple(stated["terms"]),
        share=stated.get("share", 0.0),
        member=stated.get("member", "average"),
        slow_terms=stated.get("slow_terms", "average"),
    )


def _part(stated: Document) -> Part:
    size = field_unit("angle_random_walk").size
    return Part(
        start_s=stated["start_s"],
        stop_s=stated["stop_s"],
        value=_number(stated["value"]) * size,
        low=_number(stated["low"]) * size,
        high=_number(stated["high"]) * size,
    )


def _line(stated: Document) -> Line:
    kind = "order" if stated["scale"] == "angle" else "frequency"
    unit = "" if kind == "order" else "_hz"
    return Line(
        scale=stated["scale"],
        frequency=_number(stated[f"{kind}{unit}"]),
        frequency_error=_number(stated[f"{kind}_error{unit}"]),
        amplitude=_number(stated["amplitude_arcsec"]) * ARCSECOND,
        amplitude_error=_number(stated["amplitude_error_arcsec"]) * ARCSECOND,
        phase=_number(stated["phase_deg"]) * DEGREE,
        phase_error=_number(stated["phase_error_deg"]) * DEGREE,
        significance=_number(stated["significance"]),
        channel=stated["channel"],
        name=stated["name"],
    )


def _time_line(frequency: float, amplitude: float, stated: Document, channel: str) -> Line:
    """A line of which the document states no phase and no errors."""
    return Line(
        scale="time",
        frequency=_number(frequency),
        frequency_error=math.nan,
        amplitude=_number(amplitude),
        amplitude_error=math.nan,
        phase=math.nan,
        phase_error=math.nan,
        significance=_number(stated["significance"]),
        channel=channel,
    )


def _curve(stated: Document, of: str, sensor: Sensor, document: Document) -> StabilityCurve:
    """The curve, per gyro. A document states neither terms nor noise types: both are 0."""
    size = UNITS[stated.get("unit", SENSED[sensor].rate_unit)].size
    tau = np.array(stated["tau_s"], dtype=float)
    low, high = (np.array([_number(one) for one in stated[end]]) for end in ("low", "high"))
    return StabilityCurve(
        tau=tau,
        deviation=np.array([_number(one) for one in stated[of]]) * size,
        terms=np.zeros(tau.size, dtype=np.int64),
        edf=np.array(stated.get("edf", np.full(tau.size, np.nan)), dtype=float),
        low=low * size,
        high=high * size,
        noise_type=np.zeros(tau.size, dtype=np.int64),
        estimator=stated.get("estimator", "oadev"),
        kind="angle",
        sample_rate=document["input"]["sample_rate_hz"],
        confidence=document["settings"]["confidence"],
        samples=document["input"]["samples"],
    )


def _notes(document: Document) -> tuple[Note, ...]:
    """Notes by their texts; those that are findings have their names again."""
    found = {
        f"{one['channel']}: {one['text']}" if one["channel"] else one["text"]: Note(**one)
        for one in document.get("findings", ())
    }
    return tuple(found.get(text, Note(text=text)) for text in document["notes"])
