"""Tools whose settings are written: how each defines its noise parameters, and which it lacks."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

ToolName = Literal[
    "kalibr", "allan-variance-ros", "openvins", "gtsam", "robot-localization", "ros-imu",
    "imu-tools", "px4", "kf-gins", "psins", "imu-sensor", "gazebo", "gnss-ins-sim", "toml", "json",
]  # fmt: skip
"""Whose settings are written."""

Axes = Literal["one", "three", "any"]
"""How many noises a tool takes: one for all axes, one for each of x, y and z, or any number."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Definition:
    """How a tool defines its parameters.

    Attributes
    ----------
    tool
        Its name.
    reference
        The document that defines them.
    text
        The definition, one line.
    axes
        How many noises it takes.
    unused
        Option of an export (``rate``, ``topic``, ``markov``, ``accelerometer``) that the tool
        cannot use -> why.
    """

    tool: str
    reference: str
    text: str
    axes: Axes
    unused: Mapping[str, str] = field(default_factory=dict)


_CONTINUOUS: Final = (
    "noise density sigma_g and random walk sigma_bg of the continuous-time model, two-sided; at a "
    "step of dt sigma_g/sqrt(dt) and sigma_bg sqrt(dt)"
)
_TOPIC: Final = {"topic": "it names no topic"}
_CONTINUOUS_RATE: Final = {"rate": "its noise is continuous, and it takes the time step itself"}
_WALK: Final = {"markov": "its bias is a random walk"}
_NO_BIAS: Final = {"markov": "it has no bias in its noise"}
_GYRO_ALONE: Final = {
    "accelerometer": "its gain weighs the gyro alone; it has no noise of accelerometers"
}
_MARKOV: Final = {"markov": "its bias is one Markov process for each sensor, no more and no less"}

# Format, tool, noises, what it cannot use, reference, and definition.
_TABLE: Final[tuple[tuple[str, str, Axes, Mapping[str, str], str, str], ...]] = (
    ("kalibr", "Kalibr", "one", _WALK,
     "Kalibr wiki, 'IMU Noise Model' and 'YAML formats'",
     _CONTINUOUS),
    ("allan-variance-ros", "allan_variance_ros", "one", _WALK,
     "allan_variance_ros, README and scripts/analysis.py (imu.yaml for Kalibr)",
     "as Kalibr: the Allan deviation on the slope -1/2 at 1 s, and on +1/2 at 3 s"),
    ("openvins", "OpenVINS", "any", _WALK,
     "OpenVINS, 'IMU Propagation Derivations' and kalibr_imu_chain.yaml",
     _CONTINUOUS),
    ("gtsam", "GTSAM", "three", _TOPIC | _CONTINUOUS_RATE | _WALK,
     "GTSAM, PreintegratedRotationParams::gyroscopeCovariance, "
     "PreintegrationParams::accelerometerCovariance, and biasOmegaCovariance and "
     "biasAccCovariance of PreintegrationCombinedParams",
     "covariances of the continuous-time white noises, N^2 and K^2; GTSAM divides by and "
     "multiplies with the time step itself"),
    ("robot-localization", "robot_localization", "three", _TOPIC | _NO_BIAS,
     "sensor_msgs/Imu, angular_velocity_covariance and linear_acceleration_covariance; "
     "robot_localization, 'Preparing Your Data' and ekf.cpp (the process noise is multiplied "
     "by the time step)",
     "variance of one sample, N^2 times the sample rate, (rad/s)^2 and (m/s^2)^2; there is "
     "no state for a bias"),
    ("ros-imu", "sensor_msgs/Imu", "three", _TOPIC | _NO_BIAS,
     "sensor_msgs/Imu.msg, angular_velocity_covariance and linear_acceleration_covariance, "
     "row major about x, y, z",
     "variance of one sample, N^2 times the sample rate, (rad/s)^2 and (m/s^2)^2; -1 first "
     "in a matrix that has no estimate"),
    ("imu-tools", "imu_tools, imu_filter_madgwick", "one", _TOPIC | _WALK | _GYRO_ALONE,
     "imu_filter_madgwick, parameters gain (0 to 1) and zeta (-1 to 1, rad/s); S. Madgwick, "
     "'An efficient orientation filter for inertial and inertial/magnetic sensor arrays', "
     "2010, Eqs. 49 and 50",
     "gain = sqrt(3/4) of the gyro's error, rad/s, and zeta = sqrt(3/4) of the rate of its "
     "drift, rad/s^2, here N sqrt(rate) and K sqrt(rate) of a sample"),
    ("px4", "PX4 EKF2", "one", _TOPIC | _WALK,
     "PX4 parameter reference, EKF2_GYR_NOISE, EKF2_GYR_B_NOISE, EKF2_ACC_NOISE and "
     "EKF2_ACC_B_NOISE; EKF/covariance.cpp",
     "per update of the filter: a delta angle varies by (dt GYR_NOISE)^2 and a bias by (dt "
     "GYR_B_NOISE)^2, so that they are N/sqrt(dt) and K/sqrt(dt); accelerometers alike"),
    ("kf-gins", "KF-GINS", "three", _TOPIC | _CONTINUOUS_RATE | _MARKOV,
     "KF-GINS, kf-gins.yaml, imunoise",
     "arw and vrw are N^2 as spectral density; a bias is a first-order Markov process of "
     "deviation gbstd or abstd and correlation time corrtime, one for all, driven by 2 "
     "gbstd^2/corrtime"),
    ("psins", "PSINS", "three", _TOPIC | _CONTINUOUS_RATE | _MARKOV,
     "PSINS, imuerrset.m",
     "web and wdb are N; sqrtR0G, TauG, sqrtR0A and TauA are deviation and correlation "
     "time of first-order Markov biases; eb and db are constant biases"),
    ("imu-sensor", "imuSensor of MATLAB", "three", _TOPIC | _CONTINUOUS_RATE | _WALK,
     "MathWorks, imuSensor (Algorithms), gyroparams and accelparams, NoiseType of R2023b and "
     "later; example 'Inertial Sensor Noise Analysis Using Allan Variance'",
     "single-sided: a sample has NoiseDensity sqrt(Fs) of white noise, and a step of the "
     "drift RandomWalk/sqrt(Fs), so that they are N and K"),
    ("gazebo", "Gazebo, SDF", "three", _TOPIC | _MARKOV,
     "SDFormat, sensor/imu, noise; gz-sensors, GaussianNoiseModel.cc",
     "stddev of a sample; a bias decays by exp(-dt/T) at a step and is given s sqrt(T/2 (1 "
     "- exp(-2 dt/T))), where s is dynamic_bias_stddev and T its correlation time"),
    ("gnss-ins-sim", "gnss-ins-sim", "three", _TOPIC | _CONTINUOUS_RATE | _MARKOV,
     "gnss-ins-sim, imu_model.py and pathgen.py (gyro_gen, acc_gen, bias_drift)",
     "arw and vrw are N; b_stability and b_corr are deviation and correlation time of a "
     "first-order Markov bias"),
    ("toml", "sagnac", "any", _TOPIC,
     "IEEE Std 952-1997, Annex C; IEEE Std 647-2006, Annex C",
     "continuous: two-sided spectral densities N^2 and K^2/(2 pi f)^2, Markov rates db/dt "
     "= -b/T + q w; discrete: standard deviations per sample"),
)  # fmt: skip
DEFINITIONS: Final[Mapping[str, Definition]] = {
    name: Definition(tool=tool, axes=axes, unused=unused, reference=reference, text=text)
    for name, tool, axes, unused, reference, text in _TABLE
}
"""By format; ``json`` holds what ``toml`` does."""


def definition_of(format_name: str) -> Definition:
    """The definition of a format of `sagnac.filters.exports`."""
    return DEFINITIONS["toml" if format_name == "json" else format_name]
