"""Field units at the edges: the one module that converts.

Inside the package every angle is in rad, every rate in rad/s and every time in s.
"""

import math
from typing import Final

ARCSECOND: Final = math.pi / 648_000.0
DEGREE: Final = math.pi / 180.0
HOUR: Final = 3600.0

ANGLE_UNITS: Final[dict[str, float]] = {
    "rad": 1.0,
    "mrad": 1e-3,
    "urad": 1e-6,
    "deg": DEGREE,
    "arcmin": 60.0 * ARCSECOND,
    "arcsec": ARCSECOND,
    "mas": 1e-3 * ARCSECOND,
    "rev": 2.0 * math.pi,
}
RATE_UNITS: Final[dict[str, float]] = {
    "rad/s": 1.0,
    "deg/s": DEGREE,
    "deg/h": DEGREE / HOUR,
    "arcsec/s": ARCSECOND,
    "mrad/s": 1e-3,
    "urad/s": 1e-6,
}
TIME_UNITS: Final[dict[str, float]] = {
    "s": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
    "ns": 1e-9,
    "min": 60.0,
    "h": HOUR,
}

# Size of one field unit in SI. A coefficient in SI divided by this is the field's figure.
DEGREE_PER_ROOT_HOUR: Final = DEGREE / math.sqrt(HOUR)  # angle random walk, rad/sqrt(s)
DEGREE_PER_HOUR: Final = DEGREE / HOUR  # bias instability, Allan deviation, rad/s
DEGREE_PER_HOUR_PER_ROOT_HERTZ: Final = DEGREE / HOUR  # rate noise density, rad/s/sqrt(Hz)
DEGREE_PER_HOUR_PER_ROOT_HOUR: Final = DEGREE / HOUR / math.sqrt(HOUR)  # rate random walk
DEGREE_PER_HOUR_PER_HOUR: Final = DEGREE / HOUR / HOUR  # rate ramp, rad/s^2

# Every unit a coefficient is written in, the field's own first: the size of one in SI.
COEFFICIENT_UNITS: Final[dict[str, dict[str, float]]] = {
    "quantization": {"arcsec": ARCSECOND, "deg": DEGREE, "rad": 1.0},
    "angle_random_walk": {
        "deg/sqrt(h)": DEGREE_PER_ROOT_HOUR,
        "deg/h/sqrt(Hz)": DEGREE_PER_HOUR_PER_ROOT_HERTZ,
        "rad/s/sqrt(Hz)": 1.0,
        "rad/sqrt(s)": 1.0,
    },
    "bias_instability": {"deg/h": DEGREE_PER_HOUR, "rad/s": 1.0},
    "rate_random_walk": {
        "deg/h/sqrt(h)": DEGREE_PER_HOUR_PER_ROOT_HOUR,
        "rad/s/sqrt(s)": 1.0,
    },
    "rate_ramp": {"deg/h/h": DEGREE_PER_HOUR_PER_HOUR, "rad/s^2": 1.0},
}

_ALIASES: Final[dict[str, str]] = {
    "″": "arcsec",
    '"': "arcsec",
    "as": "arcsec",
    "arcseconds": "arcsec",
    "°": "deg",
    "degree": "deg",
    "degrees": "deg",
    "radian": "rad",
    "radians": "rad",
    "dps": "deg/s",
    "°/s": "deg/s",
    "°/h": "deg/h",
    "deg/hr": "deg/h",
    "dph": "deg/h",
    "sec": "s",
    "seconds": "s",
    "turn": "rev",
    "hr": "h",
}


def canonical(unit: str) -> str:
    """Name of `unit` as this package writes it; unknown names come back unchanged."""
    stripped = unit.strip()
    return _ALIASES.get(stripped, _ALIASES.get(stripped.lower(), stripped))


def angle_scale(unit: str) -> float:
    """Radians in one `unit` of angle.

    Raises
    ------
    ValueError
        If `unit` is not an angle unit.
    """
    return _look_up(unit, ANGLE_UNITS, "angle")


def rate_scale(unit: str) -> float:
    """Radians per second in one `unit` of rate.

    Raises
    ------
    ValueError
        If `unit` is not a rate unit.
    """
    return _look_up(unit, RATE_UNITS, "rate")


def time_scale(unit: str) -> float:
    """Seconds in one `unit` of time.

    Raises
    ------
    ValueError
        If `unit` is not a time unit.
    """
    return _look_up(unit, TIME_UNITS, "time")


def _look_up(unit: str, table: dict[str, float], quantity: str) -> float:
    try:
        return table[canonical(unit)]
    except KeyError:
        known = ", ".join(table)
        raise ValueError(f"unit {unit!r} is not a unit of {quantity}; use one of {known}") from None
