"""Every unit, once: the one module that converts between the field's units and SI.

Inside the package every angle is in rad, every rate in rad/s and every time in s.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal, get_args

from sagnac.core.errors import quoted, refusal, require_choice

EARTH_RATE: Final = 7.292115e-5
"""Earth rate, rad/s, sidereal (WGS 84)."""

Sensor = Literal["gyro", "accelerometer"]
SENSORS: Final[tuple[Sensor, ...]] = get_args(Sensor)

ARCSECOND: Final = math.pi / 648_000.0
DEGREE: Final = math.pi / 180.0
HOUR: Final = 3600.0
STANDARD_GRAVITY: Final = 9.80665  # m/s^2 in one g, by definition (CGPM 1901)
_MILLI_G: Final = 1e-3 * STANDARD_GRAVITY

# Size of one field unit in SI. A coefficient in SI divided by this is the field's figure.
DEGREE_PER_ROOT_HOUR: Final = DEGREE / math.sqrt(HOUR)  # angle random walk, rad/sqrt(s)
DEGREE_PER_HOUR: Final = DEGREE / HOUR  # bias instability, Allan deviation, rad/s
DEGREE_PER_HOUR_PER_ROOT_HERTZ: Final = DEGREE / HOUR  # rate noise density, rad/s/sqrt(Hz)
DEGREE_PER_HOUR_PER_ROOT_HOUR: Final = DEGREE / HOUR / math.sqrt(HOUR)  # rate random walk
DEGREE_PER_HOUR_PER_HOUR: Final = DEGREE / HOUR / HOUR  # rate ramp, rad/s^2


Quantity = str
"""What a unit is of: one of `QUANTITIES`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """One unit.

    Attributes
    ----------
    name
        As a program writes it: ``deg/sqrt(h)``.
    symbol
        As a person reads it: ``°/√h``.
    quantity
        What it is a unit of: one of `QUANTITIES`.
    size
        SI size of one.

    Raises
    ------
    ValueError
        If the quantity is none of these or the size is not a finite number above zero.
    """

    name: str
    symbol: str
    quantity: Quantity
    size: float

    def __post_init__(self) -> None:
        require_choice("quantity", self.quantity, QUANTITIES)
        if not (math.isfinite(self.size) and self.size > 0.0):
            raise refusal("size", f"is {quoted(self.size)}; give a finite number above zero")

    def __str__(self) -> str:
        return self.name


# Quantity -> size of each of its units in SI, the usual one first.
_SIZES: Final[Mapping[Quantity, Mapping[str, float]]] = {
    "angle": {
        "rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": DEGREE, "arcmin": 60.0 * ARCSECOND,
        "arcsec": ARCSECOND, "mas": 1e-3 * ARCSECOND, "rev": 2.0 * math.pi,
        "gon": math.pi / 200.0,
    },
    "rate": {
        "rad/s": 1.0, "deg/s": DEGREE, "deg/h": DEGREE_PER_HOUR, "arcsec/s": ARCSECOND,
        "mdeg/s": 1e-3 * DEGREE, "mrad/s": 1e-3, "urad/s": 1e-6,
    },
    "time": {
        "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9,
        "min": 60.0, "h": HOUR, "d": 24.0 * HOUR,
    },
    "angle random walk": {
        "deg/sqrt(h)": DEGREE_PER_ROOT_HOUR, "deg/h/sqrt(Hz)": DEGREE_PER_HOUR_PER_ROOT_HERTZ,
        "deg/s/sqrt(Hz)": DEGREE, "mdeg/s/sqrt(Hz)": 1e-3 * DEGREE,
        "rad/s/sqrt(Hz)": 1.0, "rad/sqrt(s)": 1.0,
    },
    "rate random walk": {
        "deg/h/sqrt(h)": DEGREE_PER_HOUR_PER_ROOT_HOUR, "deg/s/sqrt(s)": DEGREE,
        "rad/s/sqrt(s)": 1.0, "rad/s^2/sqrt(Hz)": 1.0,
    },
    "rate ramp": {"deg/h/h": DEGREE_PER_HOUR_PER_HOUR, "rad/s^2": 1.0},
    "velocity": {"m/s": 1.0, "mm/s": 1e-3, "um/s": 1e-6, "ug*s": 1e-6 * STANDARD_GRAVITY},
    "acceleration": {
        "m/s^2": 1.0, "g": STANDARD_GRAVITY, "mg": _MILLI_G, "ug": 1e-6 * STANDARD_GRAVITY,
    },
    "velocity random walk": {
        "m/s/sqrt(h)": 1.0 / math.sqrt(HOUR), "ug/sqrt(Hz)": 1e-6 * STANDARD_GRAVITY,
        "mg/sqrt(Hz)": _MILLI_G, "m/s^2/sqrt(Hz)": 1.0,
    },
    "acceleration random walk": {"mg/sqrt(h)": _MILLI_G / math.sqrt(HOUR), "m/s^2/sqrt(s)": 1.0},
    "acceleration ramp": {"mg/h": _MILLI_G / HOUR, "m/s^3": 1.0},
}  # fmt: skip
QUANTITIES: Final = tuple(_SIZES)
# How a person writes a part of a unit's name.
_MARKS: Final = {"arcsec": "″", "arcmin": "′", "deg": "°", "^2": "²", "^3": "³", "*": "·"}


def _symbol(name: str) -> str:
    """Symbol of a unit: ``°/√h`` of ``deg/sqrt(h)``."""
    for part, mark in _MARKS.items():
        name = name.replace(part, mark)
    return re.sub(r"\bu(?=rad|s|m|g)", "µ", re.sub(r"sqrt\((\w+)\)", r"√\1", name))


UNITS: Final[dict[str, Unit]] = {
    name: Unit(name=name, symbol=_symbol(name), quantity=quantity, size=size)
    for quantity, sizes_of in _SIZES.items()
    for name, size in sizes_of.items()
}


def sizes(quantity: Quantity) -> dict[str, float]:
    """Name -> SI size of every unit of a quantity.

    Raises
    ------
    ValueError
        If `quantity` is none of `QUANTITIES`.
    """
    require_choice("quantity", quantity, QUANTITIES)
    return dict(_SIZES[quantity])


ANGLE_UNITS: Final = sizes("angle")
RATE_UNITS: Final = sizes("rate")
TIME_UNITS: Final = sizes("time")
VELOCITY_UNITS: Final = sizes("velocity")
ACCELERATION_UNITS: Final = sizes("acceleration")


def _sized(*names: str) -> dict[str, float]:
    return {name: UNITS[name].size for name in names}


# Every unit a coefficient is written in, the field's own first: the size of one in SI.
COEFFICIENT_UNITS: Final = {
    "quantization": _sized("arcsec", "deg", "rad"),
    "angle_random_walk": sizes("angle random walk"),
    "bias_instability": _sized("deg/h", "deg/s", "rad/s"),
    "rate_random_walk": sizes("rate random walk"),
    "rate_ramp": sizes("rate ramp"),
}
# The same of an accelerometer: what is an angle of a gyro is a velocity of it.
FORCE_COEFFICIENT_UNITS: Final = {
    "quantization": _sized("mm/s", "m/s"),
    "angle_random_walk": sizes("velocity random walk"),
    "bias_instability": _sized("mg", "ug", "m/s^2"),
    "rate_random_walk": sizes("acceleration random walk"),
    "rate_ramp": sizes("acceleration ramp"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensed:
    """Quantity that a kind of sensor measures, names and units of its coefficients.

    Attributes
    ----------
    rate, integral
        Quantity of one sample of kind ``rate``, and of its integral over time.
    rate_unit, integral_unit
        The field's unit of each.
    coefficients
        Coefficient, by the name that a gyro's has -> unit -> its size; the field's own first.
    titles
        The same -> name that the coefficient has.
    """

    rate: Quantity
    integral: Quantity
    rate_unit: str
    integral_unit: str
    coefficients: Mapping[str, Mapping[str, float]]
    titles: Mapping[str, str]

    @property
    def keys(self) -> dict[str, str]:
        """Coefficient -> its title as a key of a document."""
        return {name: title.replace(" ", "_") for name, title in self.titles.items()}


_TITLES: Final = {name: name.replace("_", " ") for name in COEFFICIENT_UNITS}
_FORCE_TITLES: Final = {
    name: title.replace("angle", "velocity").replace("rate", "acceleration")
    for name, title in _TITLES.items()
}
SENSED: Final[Mapping[Sensor, Sensed]] = {
    "gyro": Sensed(
        rate="rate",
        integral="angle",
        rate_unit="deg/h",
        integral_unit="arcsec",
        coefficients=COEFFICIENT_UNITS,
        titles=_TITLES,
    ),
    "accelerometer": Sensed(
        rate="acceleration",
        integral="velocity",
        rate_unit="mg",
        integral_unit="m/s",
        coefficients=FORCE_COEFFICIENT_UNITS,
        titles={**_FORCE_TITLES, "quantization": "velocity quantization"},
    ),
}

# Name of a unit -> how else it is written, besides its symbol and what `_PLAIN` makes plain.
_SPELLINGS: Final = {
    "arcsec": ('"', "as", "arcseconds"),
    "rev": ("turn",),
    "deg/s": ("grad/s",),
    "m/s^2": ("m s^-2", "m/s2", "m/s**2", "m/s/s", "m*s^-2"),
    "mg": ("milli-g",),
    "ug": ("micro-g",),
    "ms": ("msec", "milliseconds"),
    "us": ("usec", "microseconds", "μs"),
    "ns": ("nsec", "nanoseconds"),
    "min": ("minutes",),
    "d": ("day", "days"),
    # One over a root hertz is a root second.
    "deg/s/sqrt(Hz)": ("deg/sqrt(s)",),
    "mdeg/s/sqrt(Hz)": ("mdeg/sqrt(s)",),
    "deg/h/sqrt(h)": ("deg/h^1.5",),
    "deg/h/h": ("deg/h^2",),
}
_ALIASES: Final = {
    **{one: name for name, spellings in _SPELLINGS.items() for one in spellings},
    **{unit.symbol: unit.name for unit in UNITS.values() if unit.symbol != unit.name},
}
# What may stand in a unit, in small letters -> what takes its place, one rule after the other.
_PLAIN: Final = tuple(
    (re.compile(pattern), plain)
    for pattern, plain in (
        (r"º|°|degrees?|degs\b", "deg"), (r"radians?", "rad"), (r"[µμ]", "u"), (r"⁻¹", "^-1"),
        (r"dps\b", "deg/s"), (r"dph\b", "deg/h"),
        (r"\b(?:hours?|hr)\b", "h"), (r"\b(?:seconds?|sec|sek)\b", "s"),
        # A root: √h, √(h), sqrt(h), sqrt h, rt-hr, root-hour, h^0.5, h^1/2.
        (r"(?:√|sqrt|root|rt)[\s-]*\(?\s*(hours?|hr|hz|h|s)\s*\)?", r"sqrt(\1)"),
        (r"\b(h|s|hz)\^(?:0?\.5|\(?1/2\)?)", r"sqrt(\1)"), (r"sqrt\((?:hours?|hr)\)", "sqrt(h)"),
        # A ratio in parentheses, and a negative power: (deg/h)/sqrt(Hz), deg s^-1.
        (r"\(([^()]*/[^()]*)\)", r"\1"), (r"[\s.*·]*(?:\b|(?<=deg)|(?<=rad))(h|s)\^?-1\b", r"/\1"),
        (r"\s*/\s*", "/"),
    )
)  # fmt: skip
_BY_SMALL: Final = {name.lower(): name for name in UNITS}
_FACTOR: Final = re.compile(r"\s*(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)\s*(\S.*)$")
_HEADER: Final = re.compile(r"\s*(.*?)\s*\[([^\[\]]*)\]\s*$")
_IN_PARENTHESES: Final = re.compile(r"\s*(.*?)\s*\(([^()]*)\)\s*$")


def canonical(unit: str) -> str:
    """Name of `unit` as this package writes it; unknown names come back unchanged.

    Examples
    --------
    >>> canonical("°/hr"), canonical("Deg/Sec"), canonical("mdps/√Hz"), canonical("(deg/h)/rt-Hz")
    ('deg/h', 'deg/s', 'mdeg/s/sqrt(Hz)', 'deg/h/sqrt(Hz)')
    """
    stripped = unit.strip()
    small = stripped.lower()
    for name in (stripped, small):
        if name in _ALIASES or name in UNITS:
            return _ALIASES.get(name, name)
    plain = small
    for pattern, made in _PLAIN:
        plain = pattern.sub(made, plain)
    return _ALIASES.get(plain, _BY_SMALL.get(plain, stripped))


def split_factor(unit: str) -> tuple[float, str]:
    """Number before a unit, 1 if there is none, and the unit's name.

    Examples
    --------
    >>> split_factor("0.1arcsec")
    (0.1, 'arcsec')
    >>> split_factor("°/s")
    (1.0, 'deg/s')
    """
    if not isinstance(unit, str):
        raise refusal("unit", f"is {quoted(unit)}; give the name of a unit")
    match = _FACTOR.match(unit)
    if match is None:
        return 1.0, canonical(unit)
    return float(match.group(1)), canonical(match.group(2))


def split_header(header: str) -> tuple[str, str | None]:
    """Name of a column and the unit in brackets after it, None if there are none.

    Parentheses count if a unit stands in them.

    Examples
    --------
    >>> split_header("rate (deg/s)"), split_header("rate (left)")
    (('rate', 'deg/s'), ('rate (left)', None))
    >>> split_header("x[arcsec]")
    ('x', 'arcsec')
    >>> split_header("x")
    ('x', None)
    """
    match = _HEADER.match(header)
    if match is None and (other := _IN_PARENTHESES.match(header)) is not None:
        match = other if split_factor(other.group(2))[1] in UNITS else None
    if match is None or not match.group(1):
        return header.strip(), None
    return match.group(1), match.group(2).strip() or None


def unit_of(text: str, quantity: Quantity, argument: str = "unit") -> Unit:
    """The unit of a quantity that a text names, a number before it included.

    Parameters
    ----------
    text
        ``deg/s``, ``°/s``, ``0.1arcsec``.
    quantity
        What it has to be a unit of.
    argument
        That states it, for the message.

    Raises
    ------
    ValueError
        If it is none; the message lists those there are.

    Examples
    --------
    >>> unit_of("dps", "rate").name
    'deg/s'
    >>> unit_of("0.5deg", "angle").size == 0.5 * DEGREE
    True
    """
    factor, name = split_factor(text)
    known = sizes(quantity)
    if name not in known or not factor > 0.0:
        problem = f"{text!r} is not a unit of {quantity}; use one of {', '.join(known)}"
        raise refusal(argument, problem)
    unit, size = UNITS[name], factor * known[name]
    if factor == 1.0:
        return unit
    return replace(unit, name=f"{factor:g}{name}", symbol=f"{factor:g} {unit.symbol}", size=size)


def sensor_of(unit: str) -> Sensor:
    """The kind of sensor that a unit is of: ``accelerometer`` for velocities and accelerations.

    Examples
    --------
    >>> sensor_of("m/s^2"), sensor_of("0.5mg"), sensor_of("deg/s")
    ('accelerometer', 'accelerometer', 'gyro')
    """
    is_force = split_factor(unit)[1] in (*VELOCITY_UNITS, *ACCELERATION_UNITS)
    return "accelerometer" if is_force else "gyro"


def field_unit(coefficient: str, sensor: Sensor = "gyro") -> Unit:
    """The unit that the field writes a coefficient in.

    Raises
    ------
    ValueError
        If there is no coefficient or sensor of that name.

    Examples
    --------
    >>> field_unit("angle_random_walk").symbol
    '°/√h'
    >>> field_unit("angle_random_walk", "accelerometer").symbol
    'm/s/√h'
    """
    require_choice("sensor", sensor, SENSORS)
    units = SENSED[sensor].coefficients
    require_choice("coefficient", coefficient, units)
    return UNITS[next(iter(units[coefficient]))]
