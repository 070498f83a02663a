"""What each tool means by its noise parameters, and where it says so."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final


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
    """

    tool: str
    reference: str
    text: str


_CONTINUOUS: Final = (
    "noise density sigma_g and random walk sigma_bg of the continuous-time model, two-sided; at a "
    "step of dt sigma_g/sqrt(dt) and sigma_bg sqrt(dt)"
)

DEFINITIONS: Final[Mapping[str, Definition]] = {
    "kalibr": Definition(
        tool="Kalibr",
        reference="Kalibr wiki, 'IMU Noise Model' and 'YAML formats'",
        text=_CONTINUOUS,
    ),
    "allan-variance-ros": Definition(
        tool="allan_variance_ros",
        reference="allan_variance_ros, README and scripts/analysis.py (imu.yaml for Kalibr)",
        text="as Kalibr: the Allan deviation on the slope -1/2 at 1 s, and on +1/2 at 3 s",
    ),
    "openvins": Definition(
        tool="OpenVINS",
        reference="OpenVINS, 'IMU Propagation Derivations' and kalibr_imu_chain.yaml",
        text=_CONTINUOUS,
    ),
    "gtsam": Definition(
        tool="GTSAM",
        reference="GTSAM, PreintegratedRotationParams::gyroscopeCovariance and "
        "PreintegrationCombinedParams::biasOmegaCovariance",
        text="covariances of the continuous-time white noises, N^2 and K^2; GTSAM divides by and "
        "multiplies with the time step itself",
    ),
    "robot-localization": Definition(
        tool="robot_localization",
        reference="sensor_msgs/Imu, angular_velocity_covariance; robot_localization, "
        "'Preparing Your Data' and ekf.cpp (the process noise is multiplied by the time step)",
        text="variance of one rate sample, N^2 times the sample rate, (rad/s)^2; there is no "
        "state for a gyro's bias",
    ),
    "px4": Definition(
        tool="PX4 EKF2",
        reference="PX4 parameter reference, EKF2_GYR_NOISE and EKF2_GYR_B_NOISE; "
        "EKF/covariance.cpp",
        text="per update of the filter: a delta angle varies by (dt GYR_NOISE)^2 and a bias by "
        "(dt GYR_B_NOISE)^2, so that they are N/sqrt(dt) and K/sqrt(dt)",
    ),
    "toml": Definition(
        tool="sagnac",
        reference="IEEE Std 952-1997, Annex C; IEEE Std 647-2006, Annex C",
        text="continuous: two-sided spectral densities N^2 and K^2/(2 pi f)^2, Markov rates "
        "db/dt = -b/T + q w; discrete: standard deviations per sample",
    ),
}
