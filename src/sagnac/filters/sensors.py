"""The gyros of an analysis as its document, ``analysis.json``, states them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.documents import read_analyses
from sagnac.errors import RecordingError
from sagnac.units import ARCSECOND, DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sensor:
    """What an analysis says of one gyro.

    Attributes
    ----------
    name
        ``x``, or ``x-z`` for what two gyros make per gyro.
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
    """Every gyro in an ``analysis.json``, or in a document of several analyses.

    Raises
    ------
    RecordingError
        If the file is no such document.
    """
    try:
        alone = [
            one for each in read_analyses(path) for one in each.get("gyros", {}).values() or [each]
        ]
        return tuple(sensor for each in alone for sensor in _sensors(each))
    except RecordingError as error:
        raise error.at(str(path)) from None
    except ValueError as error:
        raise RecordingError(
            str(error), path=str(path), remedy="give the analysis.json as it was written"
        ) from None


def _sensors(document: Mapping[str, Any]) -> list[Sensor]:
    curve, answer = document["curve"], document["angle_random_walk"]
    tau = np.asarray(curve["tau_s"], dtype=np.float64)
    deviation = DEGREE_PER_HOUR * np.asarray(curve["deviation_deg_per_h"], dtype=np.float64)
    quantization = document["coefficients"].get("quantization", {})
    seen = quantization.get("status") == "estimated"
    read = document["input"]
    common: dict[str, Any] = {
        "tau": tau,
        "edf": np.asarray(curve["edf"], dtype=np.float64),
        "angle": ARCSECOND * quantization["value"] if seen else 0.0,
        "sample_rate": float(read["sample_rate_hz"]),
        "source": f"{read['path'] or 'a recording in memory'}, SHA-256 {read['sha256'] or 'none'}",
        "covariance": document.get("covariance"),
    }
    white, high = _walk(answer)
    whole = Sensor(
        name=document["channel"], deviation=deviation, white=white, white_high=high, **common
    )
    return [_own(whole, name, own) for name, own in document["per_gyro"].items()] or [whole]


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


def _walk(stated: Mapping[str, Any]) -> tuple[float, float]:
    """N and its upper limit, rad/sqrt(s)."""
    if stated["status"] == "not observable":
        return math.nan, math.nan
    high = DEGREE_PER_ROOT_HOUR * stated["high"]
    if stated["status"] == "upper bound":
        return math.nan, high
    return DEGREE_PER_ROOT_HOUR * stated["value"], high
