"""Noise as a data sheet states it, for a filter of a unit that nobody recorded."""

import math
import re
from typing import Final

from sagnac.errors import quoted
from sagnac.filters.settings import FilterSetting
from sagnac.filters.state_space import FilterModel, Markov
from sagnac.units import SENSED, SENSORS, TIME_UNITS, Sensor, sizes, split_factor

FORM: Final = "such as N=0.004deg/s/sqrt(Hz),B=2deg/h@100s,bandwidth=40Hz,range=450deg/s"
_KEYS: Final = ("N", "B", "bandwidth", "range")
_DIGITS: Final = frozenset(".0123456789")
_TIME: Final = re.compile(r"\s*([0-9.eE+-]+)\s*([a-z]+)\s*")


def datasheet_setting(text: str, *, source: str = "a data sheet") -> FilterSetting:
    """The models of one kind of sensor from the numbers that its data sheet states.

    N is taken as it stands, a density per root hertz as a two-sided one (a one-sided density of the
    same number is an N smaller by the root of two). B is the lowest Allan deviation, at the cluster
    time that stands with it: the walk of the simple model, ``K = B sqrt(3/tau)``, has that Allan
    deviation at that time, and so has the Markov rate of the full model, whose own is highest
    there.

    Parameters
    ----------
    text
        ``N=…,B=…@TIME`` with their units, which say whether it is a gyro or an accelerometer, and
        ``bandwidth=…Hz`` and ``range=…``, which no model holds and the file repeats.
    source
        Who states it.

    Raises
    ------
    ValueError
        If a number, its unit or its time is missing or wrong.

    Examples
    --------
    >>> stated = datasheet_setting("N=0.15deg/sqrt(h),B=3deg/h@100s")
    >>> stated.kind, stated.limit is None, round(stated.simple.white * 1e6, 3)
    ('gyro', True, 43.633)
    """
    parts = _parts(text)
    if "N" not in parts or "B" not in parts:
        raise _wrong(text, "N and B are needed, since a filter takes a noise and a bias")
    level, at, time = parts["B"].partition("@")
    match = _TIME.fullmatch(time)
    if not at or match is None or match[2] not in TIME_UNITS:
        raise _wrong(text, "B has no cluster time at which the Allan deviation is lowest")
    tau = _above_zero(text, match[1]) * TIME_UNITS[match[2]]
    kind, white = _in_si(text, parts["N"], "angle_random_walk")
    other, lowest = _in_si(text, level, "bias_instability")
    if kind != other:
        raise _wrong(text, f"N is of a {kind} and B of a {other}; state one sensor at a time")
    return FilterSetting(
        name=kind,
        kind=kind,
        simple=FilterModel(white=white, walk=lowest * math.sqrt(3.0 / tau)),
        full=FilterModel(white=white, markov=(Markov.of_peak(tau, lowest),)),
        source=f"{source}: {text} (stated, not measured)",
        stated={key: parts[key] for key in ("bandwidth", "range") if key in parts},
    )


def _parts(text: str) -> dict[str, str]:
    parts: dict[str, str] = {}
    for part in text.split(","):
        key, equals, value = (one.strip() for one in part.partition("="))
        if not equals or not value or key not in _KEYS:
            raise _wrong(text, f"{quoted(part.strip())} is none of {', '.join(_KEYS)} with a value")
        if key in parts:
            raise _wrong(text, f"{key} stands there twice")
        parts[key] = value
    if "bandwidth" in parts:
        _in(text, parts["bandwidth"], {"Hz": 1.0, "kHz": 1e3})
    if "range" in parts:
        _in(text, parts["range"], sizes("rate") | sizes("acceleration"))
    return parts


def _in_si(text: str, stated: str, coefficient: str) -> tuple[Sensor, float]:
    """The kind of sensor whose unit it is, and the number in SI."""
    known = {kind: _units(kind, coefficient) for kind in SENSORS}
    for kind, units in known.items():
        if split_factor(stated)[1] in units:
            return kind, _in(text, stated, units)
    every = [unit for units in known.values() for unit in units]
    raise _wrong(text, f"{quoted(stated)} has none of the units {', '.join(every)}")


def _units(kind: Sensor, coefficient: str) -> dict[str, float]:
    if coefficient == "bias_instability":
        return sizes(SENSED[kind].rate)
    return dict(SENSED[kind].coefficients[coefficient])


def _in(text: str, stated: str, units: dict[str, float]) -> float:
    factor, unit = split_factor(stated)
    if unit not in units or stated[:1] not in _DIGITS:
        raise _wrong(text, f"{quoted(stated)} is no number with one of {', '.join(units)}")
    return _above_zero(text, str(factor)) * units[unit]


def _above_zero(text: str, stated: str) -> float:
    try:
        value = float(stated)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise _wrong(text, f"{quoted(stated)} is no number above zero")
    return value


def _wrong(text: str, problem: str) -> ValueError:
    return ValueError(f"data sheet {quoted(text)}: {problem}; state it {FORM}")
