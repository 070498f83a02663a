"""The errors of one simulated sensor in SI, from the section of its configuration.

An accelerometer has the errors of a gyro in m where that has rad: what adds to an angle of a gyro
adds to its velocity.
"""

import math
from dataclasses import dataclass
from typing import Self

from sagnac.rig.sections import AccelerometerConfig, GyroConfig
from sagnac.units import (
    ARCSECOND,
    DEGREE_PER_HOUR,
    DEGREE_PER_HOUR_PER_HOUR,
    DEGREE_PER_HOUR_PER_ROOT_HOUR,
    DEGREE_PER_ROOT_HOUR,
    FORCE_COEFFICIENT_UNITS,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorErrors:
    """Errors of a gyro; of an accelerometer with m for rad.

    Attributes
    ----------
    random_walk
        N, rad/sqrt(s).
    angle_noise, quantum
        White noise of the sampled angle (Q) and readout step, rad, 0 for none.
    instability, rate_walk
        B, rad/s, and K, rad/s/sqrt(s).
    markov_deviation, markov_time
        Standard deviation, rad/s, and correlation time, s, of a Markov rate.
    bias, ramp
        rad/s and rad/s^2.
    per_kelvin, warm_up, warm_up_time
        rad/s per kelvin; rise of temperature, K, and its time constant, s.
    corner, order
        Of the low-pass, Hz, 0 for none.

    Raises
    ------
    ValueError
        If a figure is not finite.
    """

    random_walk: float
    angle_noise: float
    quantum: float
    instability: float
    rate_walk: float
    markov_deviation: float
    markov_time: float
    bias: float
    ramp: float
    corner: float
    order: int
    per_kelvin: float = 0.0
    warm_up: float = 0.0
    warm_up_time: float = 1.0

    def __post_init__(self) -> None:
        for name in self.__slots__:
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"{name} is {getattr(self, name)}; give a finite number")

    @classmethod
    def of_gyro(cls, config: GyroConfig, axis: int) -> Self:
        """Errors of the gyro x, y or z."""
        return cls(
            random_walk=config.arw_deg_per_sqrt_h[axis] * DEGREE_PER_ROOT_HOUR,
            angle_noise=config.angle_noise_arcsec[axis] * ARCSECOND,
            quantum=config.quantization_step_arcsec[axis] * ARCSECOND,
            instability=config.bias_instability_deg_per_h[axis] * DEGREE_PER_HOUR,
            rate_walk=config.rate_random_walk_deg_per_h_per_sqrt_h[axis]
            * DEGREE_PER_HOUR_PER_ROOT_HOUR,
            markov_deviation=config.markov_deviation_deg_per_h[axis] * DEGREE_PER_HOUR,
            markov_time=config.markov_time_s[axis],
            bias=config.bias_deg_per_h[axis] * DEGREE_PER_HOUR,
            ramp=config.rate_ramp_deg_per_h_per_h[axis] * DEGREE_PER_HOUR_PER_HOUR,
            per_kelvin=config.temperature_coefficient_deg_per_h_per_k[axis] * DEGREE_PER_HOUR,
            warm_up=config.warm_up_k,
            warm_up_time=config.warm_up_time_s,
            corner=config.low_pass_hz[axis],
            order=config.low_pass_order,
        )

    @classmethod
    def of_accelerometer(cls, config: AccelerometerConfig, axis: int) -> Self:
        """Errors of the accelerometer ax, ay or az."""
        size = {name: next(iter(units.values())) for name, units in FORCE_COEFFICIENT_UNITS.items()}
        return cls(
            random_walk=config.vrw_m_per_s_per_sqrt_h[axis] * size["angle_random_walk"],
            angle_noise=config.velocity_noise_mm_per_s[axis] * size["quantization"],
            quantum=config.quantization_step_mm_per_s[axis] * size["quantization"],
            instability=config.bias_instability_mg[axis] * size["bias_instability"],
            rate_walk=config.acceleration_random_walk_mg_per_sqrt_h[axis]
            * size["rate_random_walk"],
            markov_deviation=config.markov_deviation_mg[axis] * size["bias_instability"],
            markov_time=config.markov_time_s[axis],
            bias=config.bias_mg[axis] * size["bias_instability"],
            ramp=config.acceleration_ramp_mg_per_h[axis] * size["rate_ramp"],
            corner=config.low_pass_hz[axis],
            order=config.low_pass_order,
        )
