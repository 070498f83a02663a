"""Estimates of Q, N, B, K and R: value, interval, status and units."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from html import escape
from numbers import Real
from typing import Any, Final, Literal

from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from sagnac.core import errors
from sagnac.core.errors import Note, per_cent, quoted, refusal, require_choice
from sagnac.core.units import SENSED, Sensor, canonical
from sagnac.noise.laws import CoefficientName
from sagnac.noise.slow_laws import SlowLaws

Status = Literal["estimated", "upper bound", "not observable"]
FitName = Literal["paper", "weighted", "likelihood"]
USUAL_CONFIDENCE: Final = 0.95
"""Models and laws are chosen at this one, whatever the confidence of the interval."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """A value and the ends of its interval."""

    value: float
    low: float
    high: float

    def __post_init__(self) -> None:
        for name in ("value", "low", "high"):
            errors.require_type(name, getattr(self, name), Real, "give a number")
        if not self.low <= self.value <= self.high:
            outside = f"value {self.value:g} lies outside {self.low:g} to {self.high:g}"
            raise ValueError(f"{outside}; give low <= value <= high")


@dataclass(frozen=True, slots=True, kw_only=True)
class ConvertedEstimate:
    """Three figures of an `Estimate` in `unit`, and its status; ``float`` of it is the value."""

    value: float
    low: float
    high: float
    unit: str
    status: Status = "estimated"

    def __float__(self) -> float:
        return self.value

    def __format__(self, spec: str) -> str:
        if spec.endswith("%"):
            raise ValueError(f"format {spec!r} is that of a share; give one such as .4g")
        spec = spec or ".4g"
        if self.status == "not observable":
            return self.status
        high = format(self.high, spec)
        if self.status == "upper bound":
            return f"below {high} {self.unit}"
        return f"{format(self.value, spec)} ({format(self.low, spec)} to {high}) {self.unit}"

    def __str__(self) -> str:
        return format(self)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, eq=False)
class Estimate(Interval):
    """One coefficient in SI.

    Attributes
    ----------
    value, low, high
        ``estimated``: `value` within [`low`, `high`] at `confidence`. ``upper bound``:
        `value` and `high` are the bound, `low` is 0. ``not observable``: all three are NaN.
    confidence
        Probability content of the interval, or of being below the bound.
    status
        Which of the three.
    name
        Of the coefficient, by which `to` knows its units; None if it is not known.
    sensor
        ``gyro``, or ``accelerometer``: then SI has m where a gyro has rad.

    Raises
    ------
    ValueError
        If the figures are not what the status says, or a choice is not known.

    Examples
    --------
    >>> from math import pi
    >>> walk = pi / 180.0 / 60.0  # 1 deg/sqrt(h) in rad/sqrt(s)
    >>> estimate = Estimate(
    ...     name="angle_random_walk", value=2e-3 * walk, low=1.9e-3 * walk, high=2.2e-3 * walk,
    ...     confidence=0.95, status="estimated",
    ... )
    >>> estimate
    <angle_random_walk 0.002 (0.0019 to 0.0022) deg/sqrt(h), 95 %>
    >>> print(estimate.to("deg/h/sqrt(Hz)"))
    0.12 (0.114 to 0.132) deg/h/sqrt(Hz)
    >>> f"{estimate:.1e}"
    '2.0e-03 (1.9e-03 to 2.2e-03) deg/sqrt(h)'
    """

    confidence: float
    status: Status
    name: CoefficientName | None = None
    sensor: Sensor = "gyro"

    def __post_init__(self) -> None:
        require_choice("status", self.status, Status)
        require_choice("sensor", self.sensor, Sensor)
        errors.require_confidence(self.confidence)
        if self.name is not None:
            require_choice("name", self.name, CoefficientName)
        figures = (self.value, self.low, self.high)
        if self.status != "not observable":
            Interval.__post_init__(self)
            if self.low < 0.0:
                raise refusal("low", f"is {self.low:g}; give zero or more")
        elif not all(map(math.isnan, figures)):
            raise ValueError(f"{figures}: what is not observable has NaN for all three")

    def _key(self) -> tuple[object, ...]:
        """Fields that make two estimates equal; NaN, which equals nothing, goes by the status."""
        figures = () if self.status == "not observable" else (self.value, self.low, self.high)
        return (*figures, self.confidence, self.status, self.name, self.sensor)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Estimate) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    @property
    def units(self) -> Mapping[str, float]:
        """Units that the coefficient is written in, the field's first: the size of one in SI.

        Raises
        ------
        ValueError
            If the coefficient is not known.
        """
        if self.name is None:
            raise ValueError("the estimate has no name, so that its units are not known")
        return SENSED[self.sensor].coefficients[self.name]

    def to(self, unit: str) -> ConvertedEstimate:
        """The figures in a unit of the field.

        Parameters
        ----------
        unit
            Any that the coefficient is written in: ``deg/sqrt(h)``, ``deg/h/sqrt(Hz)``,
            ``rad/s/sqrt(Hz)`` or ``rad/sqrt(s)`` for angle random walk; as it is written here,
            or otherwise: ``°/√h``.

        Raises
        ------
        ValueError
            If the coefficient is not known, or not written in that unit.
        """
        units = self.units
        unit = canonical(unit) if isinstance(unit, str) else unit
        if unit not in units:
            known = ", ".join(units)
            raise ValueError(f"unit {unit!r} is not one of {self.name}; use one of {known}")
        return self._converted(unit, units[unit])

    def _converted(self, unit: str, size: float) -> ConvertedEstimate:
        value, low, high = self.value / size, self.low / size, self.high / size
        return ConvertedEstimate(value=value, low=low, high=high, unit=unit, status=self.status)

    def bounded(self, high: float) -> "Estimate":
        """An upper bound in the place of this."""
        return replace(self, value=high, low=0.0, high=high, status="upper bound")

    def in_field_unit(self) -> ConvertedEstimate:
        """The figures in the field's unit, SI if the coefficient is not known."""
        if self.name is None:
            return self._converted("SI", 1.0)
        return self.to(next(iter(self.units)))

    def __format__(self, spec: str) -> str:
        return format(self.in_field_unit(), spec) if spec else str(self)

    def _worded(self) -> str:
        if self.status == "not observable":
            return "not observable"
        return f"{self.in_field_unit()}, {per_cent(self.confidence)}"

    def __repr__(self) -> str:
        return f"<{self.name or 'estimate'} {self._worded()}>"

    def _repr_html_(self) -> str:
        name = (self.name or "estimate").replace("_", " ")
        return f"<span><b>{escape(name)}</b> {escape(self._worded())}</span>"


Coefficients = Mapping[CoefficientName, Estimate]
Change = Callable[[Estimate], Estimate]


def each_changed(coefficients: Coefficients, changed: Change) -> dict[CoefficientName, Estimate]:
    """The coefficients, each changed."""
    return {name: changed(one) for name, one in coefficients.items()}


def unobserved(name: CoefficientName | None, confidence: float) -> Estimate:
    """A coefficient of which nothing is known."""
    nothing: dict[str, Any] = dict.fromkeys(("value", "low", "high"), math.nan)
    return Estimate(**nothing, confidence=confidence, status="not observable", name=name)


def rooted(
    name: CoefficientName, confidence: float, value: float, low: float, high: float
) -> Estimate:
    """A coefficient by its square and the ends of that; a bound if these begin at zero.

    It is not observable if the square is NaN.
    """
    nothing = unobserved(name, confidence)
    if math.isnan(value):
        return nothing
    if not low > 0.0:
        return nothing.bounded(math.sqrt(high))
    value, low, high = math.sqrt(value), math.sqrt(low), math.sqrt(high)
    return replace(nothing, value=value, low=low, high=high, status="estimated")


def part_of_errors(apart: float, half_width: float, confidence: float) -> float:
    """Part of an interval's reach that, on either side of two values, holds what lies between them.

    On either side are c standard errors, with ``Phi(c + d) - Phi(-c)`` the confidence and d the
    distance of the two in standard errors (Imbens and Manski, *Econometrica* 72, 1845, 2004).

    Parameters
    ----------
    apart
        Distance of the two.
    half_width
        Of the interval of each.
    confidence
        Of the interval.
    """
    if not half_width > 0.0:
        return 1.0
    usual = float(ndtri(0.5 + 0.5 * confidence))
    distance = apart * usual / half_width

    def beyond(deviations: float) -> float:
        return float(ndtr(deviations + distance) - ndtr(-deviations)) - confidence

    # Nothing lies beyond 20 standard errors.
    return max(0.0, float(brentq(beyond, -20.0, 20.0))) / usual


@dataclass(frozen=True, slots=True, kw_only=True)
class FitBand:
    """The frequencies that a fit of a spectrum used.

    Attributes
    ----------
    low, high
        Lowest and highest, Hz.
    interval
        Between the angles of the spectrum, s.
    masked
        Bands (low, high) within it that were left out for lines, Hz.
    """

    low: float
    high: float
    interval: float
    masked: tuple[tuple[float, float], ...] = ()

    @property
    def is_whole(self) -> bool:
        """Whether nothing above the band is left out, to rounding."""
        return self.high * self.interval >= 0.5 * (1.0 - 1e-9)


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """All coefficients by one method.

    Attributes
    ----------
    method
        ``paper``: least squares on Eq. 3. ``weighted``: non-negative generalized least
        squares on the curve. ``likelihood``: Whittle on the spectrum.
    coefficients
        By name.
    notes
        What was noticed.
    departure
        Of a likelihood fit: relative departure of the spectrum from the terms that chance does
        not explain, 1 or more if bins had to be left out; 0 if the terms suffice.
    band
        Of a likelihood fit: the frequencies it used; else None.
    squares
        Of a likelihood fit: the most likely squares of Q, N, B and K, SI, which together describe
        its spectrum; one that is not there may be negative.
    slow
        Of a likelihood fit that sees slow noise: what other laws of it make of the spectrum; else
        None.
    of_other_law
        Of a likelihood fit whose spectrum departs from the terms in the first band asked for, but
        not from another law of slow noise: the fit of that band, with no allowance; else None.

    Raises
    ------
    ValueError
        If the method or a coefficient is not known, or `departure` is negative.

    Examples
    --------
    >>> import numpy as np
    >>> from sagnac import fit_coefficients, stability_curve
    >>> rate = np.random.default_rng(1).standard_normal(3000)
    >>> curve = stability_curve(rate, kind="rate", sample_rate=1.0)
    >>> fit = fit_coefficients(curve, method="weighted")
    >>> fit.method, fit.coefficients["angle_random_walk"].status
    ('weighted', 'estimated')
    """

    method: FitName
    coefficients: Coefficients
    notes: tuple[Note, ...] = ()
    departure: float = 0.0
    band: FitBand | None = None
    squares: Mapping[CoefficientName, float] = field(default_factory=dict)
    slow: SlowLaws | None = field(default=None, repr=False, compare=False)
    of_other_law: "Fit | None" = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        require_choice("method", self.method, FitName)
        for name in self.coefficients:
            require_choice("coefficients: name", name, CoefficientName)
        if not self.departure >= 0.0:
            raise refusal("departure", f"is {quoted(self.departure)}; give zero or more")

    def with_each(self, changed: Change) -> "Fit":
        """The same with each coefficient changed."""
        return replace(self, coefficients=each_changed(self.coefficients, changed))
