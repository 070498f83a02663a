"""The noise of one sensor as a filter models it: white rate, Markov rates and a random walk.

An accelerometer has m where a gyro has rad.
"""

import math
from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.coefficients.laws import allan_variance, markov_allan_variance
from sagnac.errors import quoted

# The Allan deviation of a Markov rate is highest at 1.89 T, with 0.437 q sqrt(T) (IEEE Std
# 952-1997, C.1.6).
_PEAK_TAU: Final = 1.892
_PEAK: Final = 0.4365


@dataclass(frozen=True, slots=True, kw_only=True)
class Markov:
    """A first-order Markov rate, ``db/dt = -b/T + q w``.

    Attributes
    ----------
    driving_noise
        q, rad/s/sqrt(s).
    correlation_time
        T, s.

    Raises
    ------
    ValueError
        If one is not a finite number above zero.
    """

    driving_noise: float
    correlation_time: float

    def __post_init__(self) -> None:
        for name in ("driving_noise", "correlation_time"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} is {quoted(value)}; give a finite number above zero")

    @property
    def deviation(self) -> float:
        """Standard deviation of the rate once it is stationary, rad/s."""
        return self.driving_noise * math.sqrt(0.5 * self.correlation_time)

    @property
    def peak_tau(self) -> float:
        """Cluster time at which its Allan deviation is highest, s."""
        return _PEAK_TAU * self.correlation_time

    @property
    def peak_deviation(self) -> float:
        """Its Allan deviation there, rad/s."""
        return _PEAK * self.driving_noise * math.sqrt(self.correlation_time)

    @classmethod
    def of_peak(cls, tau: float, deviation: float) -> Self:
        """The Markov rate whose Allan deviation is highest at `tau` s, with `deviation` rad/s."""
        time = tau / _PEAK_TAU
        return cls(driving_noise=deviation / (_PEAK * math.sqrt(time)), correlation_time=time)

    def decay(self, interval: float) -> float:
        """Fraction of the rate that is left after a step of `interval` s."""
        return math.exp(-interval / self.correlation_time)

    def step(self, interval: float) -> float:
        """Standard deviation of what a step of `interval` s adds, rad/s."""
        return self.deviation * math.sqrt(-math.expm1(-2.0 * interval / self.correlation_time))


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterModel:
    """White rate noise, Markov rates, and a rate that walks; white angle noise besides.

    Attributes
    ----------
    white
        N, rad/sqrt(s), which is rad/s/sqrt(Hz).
    walk
        K, rad/s/sqrt(s), which is rad/s^2/sqrt(Hz).
    markov
        None, one or several.
    angle
        White noise of the sampled angle (quantization Q), rad.

    Raises
    ------
    ValueError
        If a figure is negative or not finite.
    """

    white: float
    walk: float = 0.0
    markov: tuple[Markov, ...] = ()
    angle: float = 0.0

    def __post_init__(self) -> None:
        for name in ("white", "walk", "angle"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} is {quoted(value)}; give zero or more")

    def allan_deviation(self, tau: FloatArray) -> FloatArray:
        """Allan deviation that the model has, rad/s.

        Parameters
        ----------
        tau
            (points,), s.
        """
        variance = allan_variance(
            tau,
            {
                "quantization": self.angle,
                "angle_random_walk": self.white,
                "rate_random_walk": self.walk,
            },
        )
        for one in self.markov:
            variance = variance + markov_allan_variance(
                tau, one.driving_noise, one.correlation_time
            )
        return np.sqrt(variance)

    def white_per_sample(self, interval: float) -> float:
        """Standard deviation of the white noise of a mean rate over `interval` s, rad/s."""
        return self.white / math.sqrt(interval)

    def walk_per_sample(self, interval: float) -> float:
        """Standard deviation of what the walk adds in `interval` s, rad/s."""
        return self.walk * math.sqrt(interval)
