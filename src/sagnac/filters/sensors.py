"""The sensors of an analysis as its document, ``analysis.json``, states them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.documents import documents_of, read_analyses
from sagnac.errors import RecordingError
from sagnac.units import (
    ARCSECOND,
    COEFFICIENT_UNITS,
    DEGREE_PER_HOUR,
    FORCE_COEFFICIENT_UNITS,
    UNITS,
)
from sagnac.units import Sensor as SensorKind

_FORCE: Final = FORCE_COEFFICIENT_UNITS


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
    try:
        return [one for document in read_analyses(path) for one in sensors_of(document)]
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
    gyros = document.get("gyros", {}).values() or [document]
    forces = (document.get("accelerometers") or {}).items()
    return [
        *(sensor for one in gyros for sensor in _gyros(one)),
        *(_accelerometer(name, stated, document) for name, stated in forces),
    ]


def _gyros(document: Mapping[str, Any]) -> list[Sensor]:
    curve, answer = document["curve"], document["angle_random_walk"]
    tau = np.asarray(curve["tau_s"], dtype=np.float64)
    deviation = DEGREE_PER_HOUR * np.asarray(curve["deviation_deg_per_h"], dtype=np.float64)
    quantization = document["coefficients"].get("quantization", {})
    seen = quantization.get("status") == "estimated"
    common: dict[str, Any] = {
        "tau": tau,
        "edf": np.asarray(curve["edf"], dtype=np.float64),
        "angle": ARCSECOND * quantization["value"] if seen else 0.0,
        "covariance": document.get("covariance"),
        **_origin(document),
    }
    white, high = _walk(answer)
    whole = Sensor(
        name=document["channel"], deviation=deviation, white=white, white_high=high, **common
    )
    return [_own(whole, name, own) for name, own in document["per_gyro"].items()] or [whole]


def _origin(document: Mapping[str, Any]) -> dict[str, Any]:
    """Sample rate and source."""
    read = document["input"]
    return {
        "sample_rate": float(read["sample_rate_hz"]),
        "source": f"{read['path'] or 'a recording in memory'}, SHA-256 {read['sha256'] or 'none'}",
    }


def _accelerometer(name: str, stated: Mapping[str, Any], document: Mapping[str, Any]) -> Sensor:
    """An accelerometer of a document that holds it."""
    curve = stated["curve"]
    if "edf" not in curve:
        raise RecordingError(
            "states no degrees of freedom of its curve",
            channel=name,
            remedy="analyze the recording again",
        )
    white, high = _walk(stated["velocity_random_walk"], _FORCE["angle_random_walk"])
    quantization = stated["coefficients"].get("velocity_quantization", {})
    seen = quantization.get("status") == "estimated"
    return Sensor(
        name=name,
        kind="accelerometer",
        tau=np.asarray(curve["tau_s"], dtype=np.float64),
        deviation=UNITS[curve["unit"]].size * np.asarray(curve["deviation"], dtype=np.float64),
        edf=np.asarray(curve["edf"], dtype=np.float64),
        white=white,
        white_high=high,
        angle=_FORCE["quantization"][quantization["unit"]] * quantization["value"] if seen else 0.0,
        covariance=stated.get("covariance"),
        **_origin(document),
    )


def _own(pair: Sensor, name: str, stated: Mapping[str, Any]) -> Sensor:
    """One gyro of a triad: its own N in the curve that two of them share.

    The square of N is told apart by the three-cornered hat; what lies beside it in the curve is
    taken to be the same for all.
    """
    white, high = _walk(stated)
    if math.isnan(high) or math.isnan(pair.white):
        own = pair.deviation
    else:
        square = high if math.isnan(white) else white
        variance = pair.deviation**2 + (square**2 - pair.white**2) / pair.tau
        own = np.sqrt(np.maximum(variance, square**2 / pair.tau))
    return Sensor(
        name=name,
        tau=pair.tau,
        deviation=own,
        edf=pair.edf,
        white=white,
        white_high=high,
        angle=pair.angle,
        sample_rate=pair.sample_rate,
        source=pair.source,
        covariance=pair.covariance,
    )


def _walk(
    stated: Mapping[str, Any], sizes: Mapping[str, float] = COEFFICIENT_UNITS["angle_random_walk"]
) -> tuple[float, float]:
    """N and its upper limit, rad/sqrt(s) or m/s/sqrt(s)."""
    if stated["status"] == "not observable":
        return math.nan, math.nan
    size = sizes[stated["unit"]]
    if stated["status"] == "upper bound":
        return math.nan, size * stated["high"]
    return size * stated["value"], size * stated["high"]
