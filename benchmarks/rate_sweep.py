"""The quantum limit of a rig and its lock-in, from recordings at several table rates.

A rate-biased ring laser shows N^2 = N_q^2 + (c/rate)^2: the quantum limit, and what lock-in adds
if the phase of its backscatter wanders. Here the law is fitted to what recordings showed.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.constants import Planck, speed_of_light
from scipy.special import ndtri

from sagnac.analysis.result import Analysis
from sagnac.core.arrays import FloatArray
from sagnac.core.errors import require_confidence
from sagnac.noise.estimates import Estimate, Interval

_HELIUM_NEON: Final = 632.8e-9  # m
_ROUNDS: Final = 20
_FEWEST: Final = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class RateSweep:
    """Fit of a sweep of table rates.

    Attributes
    ----------
    quantum
        N_q, rad/sqrt(s).
    falling
        c, rad^2/s^(3/2): the part that falls is c over the table rate.
    adequate
        Table rate, rad/s, from which on N is within `excess` of N_q.
    excess
        Relative.
    misfit
        Weighted squares of the residuals over their degrees of freedom: near 1 if the law holds.
    confidence
        Of every interval.
    """

    quantum: Interval
    falling: Interval
    adequate: Interval
    excess: float
    misfit: float
    confidence: float


def sweep_of(
    analyses: Sequence[Analysis], *, excess: float = 0.1, confidence: float = 0.95
) -> RateSweep:
    """The law fitted to analyses of recordings at several table rates.

    Those that give only an upper bound are left out.

    Raises
    ------
    ValueError
        If an analysis is of a table at rest, or estimates are left at fewer than three rates.
    """
    at_rest = [one.channel for one in analyses if one.table_rate is None]
    if at_rest:
        raise ValueError(f"{len(at_rest)} analyses are of a table at rest; leave these out")
    kept = [one for one in analyses if one.angle_random_walk.status == "estimated"]
    return fit_rate_sweep(
        [abs(one.table_rate or 0.0) for one in kept],
        [one.angle_random_walk for one in kept],
        excess=excess,
        confidence=confidence,
    )


def fit_rate_sweep(
    rates: ArrayLike,
    estimates: Sequence[Estimate],
    *,
    excess: float = 0.1,
    confidence: float = 0.95,
) -> RateSweep:
    """Weighted least squares of N^2 = N_q^2 + (c/rate)^2.

    An estimate's relative error is taken from its interval and applied to the fitted N, in rounds,
    so that an estimate that came out low by chance gets no weight for it. The interval of the
    adequate rate is of the ratio of the two squares (Fieller's theorem); its end is infinite if
    the quantum limit is not told from zero, its begin zero if the falling part is not.

    Parameters
    ----------
    rates
        (recordings,) table rates, rad/s, above zero.
    estimates
        Angle random walk at each, ``estimated``.
    excess
        Relative; above zero.
    confidence
        Of every interval.

    Raises
    ------
    ValueError
        If the sizes differ, rates or estimates make no sense, or there are fewer than three rates.
    """
    speeds = np.asarray(rates, dtype=np.float64)
    _check(speeds, estimates, excess)
    require_confidence(confidence)
    values = np.array([one.value for one in estimates])
    spans = np.array([one.high - one.low for one in estimates])
    widths = np.array([2.0 * float(ndtri(0.5 + 0.5 * one.confidence)) for one in estimates])
    relative = spans / widths / values
    # Scaled, so that both columns are of the same size.
    unit = float(np.median(speeds))
    design = np.stack([np.ones_like(speeds), (unit / speeds) ** 2], axis=1)
    squares, covariance, misfit = _fitted(design, values**2, relative)
    reach = float(ndtri(0.5 + 0.5 * confidence))
    errors = np.sqrt(np.diag(covariance))
    quantum, falling = (
        _root(float(square), reach * float(error))
        for square, error in zip(squares, errors, strict=True)
    )
    scale = unit / math.sqrt((1.0 + excess) ** 2 - 1.0)
    return RateSweep(
        quantum=quantum,
        falling=_times(falling, unit),
        adequate=_times(_ratio_root(squares, covariance, reach), scale),
        excess=excess,
        misfit=misfit,
        confidence=confidence,
    )


def _check(rates: FloatArray, estimates: Sequence[Estimate], excess: float) -> None:
    """Refuse rates and estimates that make no sense."""
    if rates.shape != (len(estimates),):
        raise ValueError(f"rates has shape {rates.shape} for {len(estimates)} estimates")
    if not (np.isfinite(rates).all() and np.all(rates > 0.0)):
        raise ValueError("rates must be finite and above zero, rad/s")
    if np.unique(rates).size < _FEWEST:
        raise ValueError(f"{np.unique(rates).size} table rates; the law needs {_FEWEST} or more")
    for one in estimates:
        if one.status != "estimated":
            raise ValueError(f"an angle random walk is {one.status!r}; give estimates alone")
    if not excess > 0.0:
        raise ValueError(f"excess is {excess!r}; give a number above zero")


def _fitted(
    design: FloatArray, observed: FloatArray, relative: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Squares at the two columns, their covariance, and the reduced misfit."""
    model = observed
    solution: FloatArray = np.zeros(2)
    covariance: FloatArray = np.eye(2)
    for _ in range(_ROUNDS):
        error = 2.0 * relative * model
        weighted = design / error[:, np.newaxis]
        covariance = np.asarray(np.linalg.inv(weighted.T @ weighted), dtype=np.float64)
        solution = covariance @ (weighted.T @ (observed / error))
        model = np.maximum(design @ solution, 0.1 * observed)
    residual = (observed - design @ solution) / (2.0 * relative * model)
    return solution, covariance, float(residual @ residual) / max(observed.size - 2, 1)


def _root(square: float, reach: float) -> Interval:
    """The root of a square with its interval, none of them below zero."""
    low, middle, high = (
        math.sqrt(max(value, 0.0)) for value in (square - reach, square, square + reach)
    )
    return Interval(value=middle, low=low, high=high)


def _ratio_root(squares: FloatArray, covariance: FloatArray, reach: float) -> Interval:
    """Root of the second square over the first, by Fieller's theorem."""
    below, above = float(squares[0]), float(squares[1])
    first, second, cross = (reach**2 * float(covariance[i, j]) for i, j in ((0, 0), (1, 1), (0, 1)))
    a, b, c = below**2 - first, below * above - cross, above**2 - second
    value = math.sqrt(max(above, 0.0) / below) if below > 0.0 else math.inf
    inside = b**2 - a * c
    if a <= 0.0 or inside < 0.0:
        # The quantum limit may be zero: no rate is known to be enough.
        return Interval(value=value, low=0.0, high=math.inf)
    low, high = ((b + sign * math.sqrt(inside)) / a for sign in (-1.0, 1.0))
    return Interval(
        value=value,
        low=min(math.sqrt(max(low, 0.0)), value),
        high=max(math.sqrt(max(high, 0.0)), value),
    )


def _times(reading: Interval, factor: float) -> Interval:
    return Interval(
        value=factor * reading.value, low=factor * reading.low, high=factor * reading.high
    )


def quantum_limit(
    *,
    perimeter: float,
    area: float,
    loss: float,
    power: float,
    wavelength: float = _HELIUM_NEON,
) -> float:
    """Angle random walk of spontaneous emission, rad/sqrt(s).

    ``N = c L / (4 A Q) sqrt(h f / P)``, with the quality factor ``Q = 2 pi f L / (c loss)``: a
    larger ring of better mirrors and more power is quieter.

    Parameters
    ----------
    perimeter, area
        L and A of the ring, m and m^2.
    loss
        Part of the power lost in one round trip.
    power
        P that each beam loses, W.
    wavelength
        m; of the red line of helium and neon unless given.

    Raises
    ------
    ValueError
        If a value is not above zero.

    References
    ----------
    Schreiber and Wells, Rev. Sci. Instrum. 84 (2013) 041101; Dorschner, Haus, Holz, Smith and
    Statz, IEEE J. Quantum Electron. 16 (1980) 1376.

    Examples
    --------
    A triangle of 28 cm whose mirrors lose 100 ppm, at 10 uW, in deg/sqrt(h):

    >>> from sagnac.core.units import DEGREE_PER_ROOT_HOUR
    >>> limit = quantum_limit(perimeter=0.28, area=3.77e-3, loss=1e-4, power=1e-5)
    >>> round(limit / DEGREE_PER_ROOT_HOUR, 6)
    0.000122
    """
    given = {
        "perimeter": perimeter,
        "area": area,
        "loss": loss,
        "power": power,
        "wavelength": wavelength,
    }
    for name, value in given.items():
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} is {value!r}; it must be above zero")
    frequency = speed_of_light / wavelength
    quality = 2.0 * math.pi * frequency * perimeter / (speed_of_light * loss)
    size = speed_of_light * perimeter / (4.0 * area * quality)
    return float(size * math.sqrt(Planck * frequency / power))
