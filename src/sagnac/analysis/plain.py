"""Basis of the answer as plain data, in the units of the field."""

from typing import Any

import numpy as np

from sagnac.analysis.result import Analysis
from sagnac.analysis.shares import Interval
from sagnac.units import DEGREE, DEGREE_PER_HOUR, SENSED, field_unit


def resting_data(analysis: Analysis) -> dict[str, Any]:
    """Basis of the answer.

    ``band_hz`` [low, high], ``terms``, ``share``, ``member`` and ``slow_terms``. If the member is
    ``both``, the value is of the likelihood of the whole band, and band, terms and share are of the
    average that the interval holds as well. `slow_terms` says what B and K are of:
    ``average``, ``whole band``, or ``low band``: a likelihood fit to the lowest frequencies.

    Returns
    -------
    dict
        Empty if the answer is of no average, or no band shows it.
    """
    resting = analysis.average
    if resting is None or not resting.terms:
        return {}
    return {
        "band_hz": list(resting.band_hz),
        "terms": list(resting.terms),
        "share": resting.share,
        "member": resting.member,
        "slow_terms": resting.slow_terms,
    }


def parts_data(analysis: Analysis) -> list[dict[str, Any]]:
    """The answer over parts: ``start_s``, ``stop_s``, and ``value``, ``low``, ``high``.

    Returns
    -------
    list of dict
        In order of time, angle random walk in the unit of the field; NaN if a part does not show
        it.
    """
    size = field_unit("angle_random_walk").size
    return [
        {
            "start_s": part.start_s,
            "stop_s": part.stop_s,
            "value": part.value / size,
            "low": part.low / size,
            "high": part.high / size,
        }
        for part in analysis.parts
    ]


def shares_data(analysis: Analysis) -> dict[str, Any]:
    """Share of each gyro in the table's rate: ``share``, ``bias_deg_per_h``, ``asymmetry``.

    Returns
    -------
    dict
        By gyro, each with ``value``, ``low`` and ``high``, or None where it cannot be told.
    """
    return {
        name: {
            "share": _ends(one.share),
            "bias_deg_per_h": _ends(one.bias, DEGREE_PER_HOUR),
            "asymmetry": _ends(one.asymmetry),
            "confidence": one.confidence,
        }
        for name, one in analysis.shares.items()
    }


def triad_data(analysis: Analysis) -> dict[str, Any] | None:
    """Scale factor and axes of three gyros on a turning table.

    Returns
    -------
    dict or None
        ``scale``, and ``angles_deg`` between each gyro's axis and the table's, by gyro, each with
        ``value``, ``low`` and ``high``.
    """
    triad = analysis.triad
    if triad is None:
        return None
    return {
        "scale": _ends(triad.scale),
        "angles_deg": {name: _ends(one, DEGREE) for name, one in triad.angles.items()},
    }


def _ends(interval: Interval | None, size: float = 1.0) -> dict[str, float] | None:
    if interval is None:
        return None
    return {
        "value": interval.value / size,
        "low": interval.low / size,
        "high": interval.high / size,
    }


def covariance_data(analysis: Analysis) -> dict[str, Any] | None:
    """Joint covariance of the estimated coefficients: ``names``, ``units`` and ``matrix``.

    Returns
    -------
    dict or None
        Each entry of the matrix in the product of the units of its row and column; None if there
        is no average.
    """
    covariance = analysis.covariance
    if covariance is None:
        return None
    sensor = analysis.sensor
    titles = SENSED[sensor].titles
    units = [field_unit(name, sensor) for name in covariance.names]
    sizes = np.array([unit.size for unit in units])
    return {
        "names": [titles[name].replace(" ", "_") for name in covariance.names],
        "units": [unit.name for unit in units],
        "matrix": (covariance.matrix / sizes / sizes[:, np.newaxis]).tolist(),
    }
