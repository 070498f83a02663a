"""The files of other tools, as text: each with its units and the definition it follows."""

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from sagnac.errors import RecordingError, one_line, quoted
from sagnac.filters.definitions import DEFINITIONS
from sagnac.filters.overbound import Overbound
from sagnac.filters.settings import FilterSetting, worst
from sagnac.units import DEGREE_PER_HOUR_PER_ROOT_HOUR, DEGREE_PER_ROOT_HOUR

# Rate of the delta angles that update the filter of PX4, Hz, unless another is stated.
PX4_RATE: Final = 100.0
# Ranges that PX4's parameter reference states.
_PX4_RANGES: Final = {"EKF2_GYR_NOISE": (1e-4, 0.1), "EKF2_GYR_B_NOISE": (0.0, 0.01)}
_PX4_FLOAT: Final = 9
# Names that ROS allows, and those that TOML takes without quotes.
_ROS_NAME: Final = re.compile(r"[A-Za-z~/][A-Za-z0-9_/~]*")
_BARE: Final = re.compile(r"[A-Za-z0-9_-]+")


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """What a file is to hold.

    Attributes
    ----------
    settings
        One for each gyro.
    each
        A block for each gyro instead of the worst alone.
    rate
        Of the filter or of the samples, Hz; None for that of the recording.
    topic
        ROS topic of the IMU.
    accelerometer
        Noise density (m/s^2/sqrt(Hz)) and random walk (m/s^3/sqrt(Hz)), if they are known.
    version
        Of this package.
    """

    settings: tuple[FilterSetting, ...]
    each: bool = False
    rate: float | None = None
    topic: str = "/imu0"
    accelerometer: tuple[float, float] | None = None
    version: str = ""

    def __post_init__(self) -> None:
        if not self.settings:
            raise ValueError("settings is empty; give one gyro or more")
        if self.rate is not None and not self.rate > 0.0:
            raise ValueError(f"rate is {quoted(self.rate)}; give Hz above zero")
        if not _ROS_NAME.fullmatch(self.topic):
            raise ValueError(f"topic is {quoted(self.topic)}; give a name of ROS such as /imu0")

    @property
    def chosen(self) -> tuple[FilterSetting, ...]:
        """Every gyro, or the worst."""
        return self.settings if self.each else (worst(self.settings),)

    @property
    def update_rate(self) -> float:
        """Hz."""
        return self.rate or self.settings[0].sensor.sample_rate


def exported(format_name: str, wanted: Wanted) -> str:
    """The file of a tool.

    Parameters
    ----------
    format_name
        One of `FORMATS`.
    wanted
        What it is to hold.

    Raises
    ------
    ValueError
        If there is no such format.
    RecordingError
        If the tool cannot hold what is wanted.
    """
    if format_name not in FORMATS:
        raise ValueError(f"format is {quoted(format_name)}; use one of {', '.join(FORMATS)}")
    return FORMATS[format_name](wanted)


# ---- what the files share ------------------------------------------------------------


def _heading(name: str, wanted: Wanted) -> list[str]:
    definition = DEFINITIONS[name]
    limit = wanted.settings[0].simple.limit
    lines = [
        f"{definition.tool}: noise of {', '.join(one.sensor.name for one in wanted.chosen)}, "
        f"made by sagnac {wanted.version}",
        f"Definition: {definition.text}.",
        f"Reference: {definition.reference}.",
        f"The model lies above the Allan deviation at {100.0 * limit.confidence:g} % from "
        f"{limit.tau[0]:.4g} to {limit.tau[-1]:.4g} s.",
    ]
    if len(wanted.settings) > 1 and not wanted.each:
        names = ", ".join(one.sensor.name for one in wanted.settings)
        lines.append(f"The worst of {names}.")
    return lines + list(dict.fromkeys(f"From {one.sensor.source}" for one in wanted.chosen))


def _comment(lines: list[str]) -> str:
    """Lines that every format passes over; names of files and gyros in them end none of them."""
    return "".join(f"# {one_line(line)}\n" for line in lines)


def _one_only(wanted: Wanted, name: str) -> FilterSetting:
    if wanted.each and len(wanted.settings) > 1:
        raise RecordingError(
            f"{DEFINITIONS[name].tool} has one gyro noise for all axes",
            remedy="take the worst of them ({axes worst})",
        )
    return wanted.chosen[0]


def _accelerometer(wanted: Wanted) -> list[str]:
    names = ("accelerometer_noise_density", "accelerometer_random_walk")
    units = ("m/s^2/sqrt(Hz), continuous", "m/s^3/sqrt(Hz), continuous")
    if wanted.accelerometer is None:
        return [
            f"# {name}:  # {unit}: not measured, add it"
            for name, unit in zip(names, units, strict=True)
        ]
    return [
        f"{name}: {value:.6e}  # {unit}, as stated"
        for name, value, unit in zip(names, wanted.accelerometer, units, strict=True)
    ]


def _kalibr_keys(setting: FilterSetting, wanted: Wanted) -> list[str]:
    model, rate = setting.simple.model, wanted.update_rate
    return [
        f"rostopic: {wanted.topic}",
        f"update_rate: {rate:.9g}  # Hz",
        f"gyroscope_noise_density: {model.white:.6e}  # rad/s/sqrt(Hz), continuous",
        f"gyroscope_random_walk: {model.walk:.6e}  # rad/s^2/sqrt(Hz), continuous",
        f"# discrete, at {rate:.9g} Hz: {model.white_per_sample(1.0 / rate):.6e} rad/s white, "
        f"{model.walk_per_sample(1.0 / rate):.6e} rad/s per step of the bias",
        *_accelerometer(wanted),
    ]


# ---- one function a tool -------------------------------------------------------------


def _flat_yaml(name: str) -> Callable[[Wanted], str]:
    def write(wanted: Wanted) -> str:
        setting = _one_only(wanted, name)
        heading = [*_heading(name, wanted), setting.in_words()]
        return _comment(heading) + "\n".join(_kalibr_keys(setting, wanted)) + "\n"

    return write


def _openvins(wanted: Wanted) -> str:
    heading = _heading("openvins", wanted)
    heading.append("Keep T_i_b and the intrinsics of your own kalibr_imu_chain.yaml.")
    text = "%YAML:1.0\n" + _comment(heading)
    for index, setting in enumerate(wanted.chosen):
        keys = [*_kalibr_keys(setting, wanted), "time_offset: 0.0  # s"]
        text += f"\nimu{index}:\n  {_comment([setting.in_words()])}"
        text += "".join(f"  {key}\n" for key in keys)
    return text


def _axes(wanted: Wanted) -> tuple[FilterSetting, FilterSetting, FilterSetting]:
    """One for x, y and z: each its own if the gyros are those, else the worst for all."""
    named = {one.sensor.name: one for one in wanted.settings}
    if wanted.each and set(named) == {"x", "y", "z"}:
        return named["x"], named["y"], named["z"]
    if wanted.each and len(named) == 3:
        first, second, third = wanted.settings
        return first, second, third
    one = worst(wanted.settings)
    return one, one, one


def _gtsam(wanted: Wanted) -> str:
    axes = _axes(wanted)
    white = ", ".join(f"{one.simple.model.white**2:.6e}" for one in axes)
    walk = ", ".join(f"{one.simple.model.walk**2:.6e}" for one in axes)
    heading = _heading("gtsam", wanted)
    heading += [one.in_words() for one in dict.fromkeys(axes)]
    return (
        _comment(heading)
        + f"""
import numpy

# Diagonals for x, y and z.
GYROSCOPE_COVARIANCE = numpy.diag([{white}])  # (rad/s)^2/Hz
BIAS_OMEGA_COVARIANCE = numpy.diag([{walk}])  # (rad/s^2)^2/Hz


def set_gyroscope(parameters):
    \"\"\"Set gtsam.PreintegrationParams, or PreintegrationCombinedParams with the bias.\"\"\"
    parameters.setGyroscopeCovariance(GYROSCOPE_COVARIANCE)
    if hasattr(parameters, "setBiasOmegaCovariance"):
        parameters.setBiasOmegaCovariance(BIAS_OMEGA_COVARIANCE)
"""
    )


def _robot_localization(wanted: Wanted) -> str:
    axes, rate = _axes(wanted), wanted.update_rate
    variances = [f"{one.simple.model.white_per_sample(1.0 / rate) ** 2:.6e}" for one in axes]
    rows = [["0.0"] * 3 for _ in range(3)]
    for index, variance in enumerate(variances):
        rows[index][index] = variance
    heading = _heading("robot-localization", wanted)
    heading += [one.in_words() for one in dict.fromkeys(axes)]
    matrix = ",\n    ".join(", ".join(row) for row in rows)
    angles = ", ".join(f"{one.simple.model.white**2:.6e}" for one in axes)
    return (
        _comment(heading)
        + f"imu:\n  # (rad/s)^2 of one sample at {rate:.9g} Hz, row by row about x, y, z\n"
        + f"  angular_velocity_covariance: [\n    {matrix}]\n"
        + "# What these gyros alone add to roll, pitch and yaw of process_noise_covariance,\n"
        + f"# rad^2/s: {angles}\n"
    )


def _px4(wanted: Wanted) -> str:
    setting, rate = _one_only(wanted, "px4"), wanted.rate or PX4_RATE
    model = setting.simple.model
    values = {
        "EKF2_GYR_NOISE": (model.white * rate**0.5, "rad/s"),
        "EKF2_GYR_B_NOISE": (model.walk * rate**0.5, "rad/s^2"),
    }
    text = _comment([*_heading("px4", wanted), setting.in_words()])
    text += f"# discrete, at an update rate of {rate:.9g} Hz\n"
    for name, (value, unit) in values.items():
        low, high = _PX4_RANGES[name]
        text += f"# {name} in {unit}"
        if not low <= value <= high:
            text += f"; outside the range of {low:g} to {high:g} that PX4 states"
        text += f"\n1\t1\t{name}\t{value:.9e}\t{_PX4_FLOAT}\n"
    return text


def _plain(wanted: Wanted) -> dict[str, Any]:
    limit, definition = wanted.settings[0].full.limit, DEFINITIONS["toml"]
    return {
        "schema": "sagnac.filter/1",
        "version": wanted.version,
        "definition": definition.text,
        "reference": definition.reference,
        "confidence": limit.confidence,
        "tau_s": [float(limit.tau[0]), float(limit.tau[-1])],
        "update_rate_hz": wanted.update_rate,
        "sensors": {one.sensor.name: _sensor(one, wanted.update_rate) for one in wanted.chosen},
    }


def _sensor(setting: FilterSetting, rate: float) -> dict[str, Any]:
    covariance = setting.sensor.covariance
    return {
        "source": setting.sensor.source,
        "simple": _model(setting.simple, rate),
        "full": _model(setting.full, rate),
        **({} if covariance is None else {"covariance": dict(covariance)}),
    }


def _model(bound: Overbound, rate: float) -> dict[str, Any]:
    model, step = bound.model, 1.0 / rate
    return {
        "inflation": bound.inflation,
        "continuous": {
            "white_rad_per_s_per_sqrt_hz": model.white,
            "white_deg_per_sqrt_h": model.white / DEGREE_PER_ROOT_HOUR,
            "walk_rad_per_s2_per_sqrt_hz": model.walk,
            "walk_deg_per_h_per_sqrt_h": model.walk / DEGREE_PER_HOUR_PER_ROOT_HOUR,
            "angle_rad": model.angle,
            "markov": [
                {
                    "driving_noise_rad_per_s_per_sqrt_s": one.driving_noise,
                    "correlation_time_s": one.correlation_time,
                    "deviation_rad_per_s": one.deviation,
                }
                for one in model.markov
            ],
        },
        "discrete": {
            "white_rad_per_s": model.white_per_sample(step),
            "walk_rad_per_s": model.walk_per_sample(step),
            "markov": [
                {"decay": one.decay(step), "step_rad_per_s": one.step(step)} for one in model.markov
            ],
        },
    }


def _json(wanted: Wanted) -> str:
    return json.dumps(_plain(wanted), allow_nan=False, indent=1) + "\n"


def _toml(wanted: Wanted) -> str:
    return _comment(_heading("toml", wanted)) + _toml_table(_plain(wanted))


def _toml_table(table: Mapping[str, Any], path: str = "") -> str:
    """Plain values first, then the tables below them."""
    text = "".join(
        f"{_toml_key(key)} = {_toml_value(value)}\n"
        for key, value in table.items()
        if not isinstance(value, Mapping)
    )
    for key, value in table.items():
        if isinstance(value, Mapping):
            below = f"{path}{_toml_key(key)}."
            text += f"\n[{below[:-1]}]\n{_toml_table(value, below)}"
    return text


def _toml_key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _toml_value(key)


def _toml_value(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_toml_value(item) for item in value)}]"
    if isinstance(value, Mapping):
        items = (f"{_toml_key(key)} = {_toml_value(item)}" for key, item in value.items())
        return "{" + ", ".join(items) + "}"
    if isinstance(value, str):
        # TOML escapes as JSON does, and the delete character as well.
        return json.dumps(one_line(value), ensure_ascii=False)
    return json.dumps(value)


FORMATS: Final[Mapping[str, Callable[[Wanted], str]]] = {
    "kalibr": _flat_yaml("kalibr"),
    "allan-variance-ros": _flat_yaml("allan-variance-ros"),
    "openvins": _openvins,
    "gtsam": _gtsam,
    "robot-localization": _robot_localization,
    "px4": _px4,
    "toml": _toml,
    "json": _json,
}
