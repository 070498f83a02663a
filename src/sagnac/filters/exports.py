"""The files of other tools, as text: each with its units and the definition it follows."""

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac.errors import RecordingError, one_line, quoted
from sagnac.filters.definitions import definition_of
from sagnac.filters.models import FilterModel, common_time
from sagnac.filters.settings import FilterSetting, by_name, plain, worst
from sagnac.texts import toml_tables
from sagnac.units import (
    DEGREE_PER_HOUR,
    DEGREE_PER_ROOT_HOUR,
    FORCE_COEFFICIENT_UNITS,
    HOUR,
    STANDARD_GRAVITY,
    Sensor,
)

# Rate of the delta angles that update the filter of PX4, Hz, unless another is stated.
PX4_RATE: Final = 100.0
_PX4_FLOAT: Final = 9
_MICRO_G: Final = 1e-6 * STANDARD_GRAVITY
_MILLIGAL: Final = 1e-5  # m/s^2
_MADGWICK: Final = 0.75**0.5
# Names that ROS allows.
_ROS_NAME: Final = re.compile(r"[A-Za-z~/][A-Za-z0-9_/~]*")


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """Contents of a file.

    Attributes
    ----------
    settings
        One for each gyro.
    accelerometers
        One for each accelerometer; none if they are not known.
    each
        A block for each sensor instead of the worst alone.
    rate
        Of the filter or of the samples, Hz; None for that of the recording.
    topic
        ROS topic of the IMU.
    version
        Of this package.
    """

    settings: tuple[FilterSetting, ...]
    accelerometers: tuple[FilterSetting, ...] = ()
    each: bool = False
    rate: float | None = None
    topic: str = "/imu0"
    version: str = ""

    def __post_init__(self) -> None:
        if not self.settings:
            raise ValueError("settings is empty; give one gyro or more")
        for kind, group in (("gyro", self.settings), ("accelerometer", self.accelerometers)):
            if any(one.kind != kind for one in group):
                raise ValueError(f"a setting among those of {kind}s is of another sensor")
        if self.rate is not None and not self.rate > 0.0:
            raise ValueError(f"rate is {quoted(self.rate)}; give Hz above zero")
        if not _ROS_NAME.fullmatch(self.topic):
            raise ValueError(f"topic is {quoted(self.topic)}; give a name of ROS such as /imu0")

    @property
    def chosen(self) -> tuple[FilterSetting, ...]:
        """Every gyro, or one that covers them all."""
        return by_name(self.settings) if self.each else (worst(self.settings),)

    @property
    def forces(self) -> tuple[FilterSetting, ...]:
        """Every accelerometer, or one that covers them all; none if there is none."""
        if self.each or not self.accelerometers:
            return by_name(self.accelerometers)
        return (worst(self.accelerometers),)

    @property
    def known_rate(self) -> float | None:
        """Hz, if the export or a recording states it."""
        return self.rate or self.settings[0].sample_rate

    @property
    def update_rate(self) -> float:
        """Hz.

        Raises
        ------
        RecordingError
            If neither the export nor a recording states it.
        """
        rate = self.known_rate
        if rate is None:
            raise RecordingError(
                "no recording states the sample rate", remedy="state it with {rate}"
            )
        return rate


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
    definition = definition_of(format_name)
    if wanted.each and definition.axes == "one" and len(wanted.chosen) > 1:
        raise RecordingError(
            f"{definition.tool} has one gyro noise for all axes",
            remedy="take the worst of them ({axes worst})",
        )
    return FORMATS[format_name](format_name, wanted)


def settings_in(format_name: str, wanted: Wanted) -> tuple[FilterSetting, ...]:
    """The models as the file of a tool has them: of gyros, then of accelerometers it takes."""
    holds = "accelerometer" not in definition_of(format_name).unused
    shown = (*wanted.chosen, *(wanted.forces if holds else ()))
    if format_name not in _COMMON_TIME:
        return shown
    return tuple(one.as_markov(_markov_times(format_name, wanted)[one.kind]) for one in shown)


# ---- what the files share ------------------------------------------------------------


def _heading(name: str, wanted: Wanted, *, in_words: bool = True, mark: str = "#") -> str:
    """Comment on what is in the file, by what definition, and from what."""
    definition = definition_of(name)
    shown = settings_in(name, wanted)
    lines = [
        f"{definition.tool}: noise of {', '.join(one.name for one in shown)}, "
        f"made by sagnac {wanted.version}",
        f"Definition: {definition.text}.",
        f"Reference: {definition.reference}.",
    ]
    limit = next((one.limit for one in shown if one.limit is not None), None)
    if limit is not None:
        lines.append(
            f"The model lies above the Allan deviation at {100.0 * limit.confidence:g} % from "
            f"{limit.tau[0]:.4g} to {limit.tau[-1]:.4g} s."
        )
    if any(one.limit is None for one in shown):
        lines.append("What is stated was not measured, and is not inflated.")
    lines += dict.fromkeys(f"From {one.source}" for one in shown)
    return _comment(lines + ([one.in_words() for one in shown] if in_words else []), mark)


def _comment(lines: Sequence[str], mark: str = "#") -> str:
    """Lines that every format passes over; names of files and gyros in them end none of them."""
    return "".join(f"{mark} {one_line(line)}\n" for line in lines)


def _axes(
    settings: tuple[FilterSetting, ...], names: str, *, each: bool
) -> tuple[FilterSetting, FilterSetting, FilterSetting]:
    """One for x, y and z: each its own if the sensors are those, else one that covers them all."""
    named = {one.name: one for one in by_name(settings)}
    order = names.split(",")
    if each and len(named) == 3:
        first, second, third = (
            [named[name] for name in order] if set(named) == set(order) else named.values()
        )
        return first, second, third
    one = worst(settings)
    return one, one, one


def _three(wanted: Wanted) -> dict[Sensor, tuple[FilterSetting, FilterSetting, FilterSetting]]:
    """About x, y and z, of each kind of sensor that there is."""
    found: dict[Sensor, tuple[FilterSetting, FilterSetting, FilterSetting]] = {
        "gyro": _axes(wanted.settings, "x,y,z", each=wanted.each)
    }
    if wanted.accelerometers:
        found["accelerometer"] = _axes(wanted.accelerometers, "ax,ay,az", each=wanted.each)
    return found


def _listed(values: Sequence[float]) -> str:
    return "[" + ", ".join(f"{value:.6e}" for value in values) + "]"


# ---- one function a tool -------------------------------------------------------------

# Prefix of the keys, and units of N and K.
_KALIBR: Final[Mapping[Sensor, tuple[str, str, str]]] = {
    "gyro": ("gyroscope", "rad/s/sqrt(Hz)", "rad/s^2/sqrt(Hz)"),
    "accelerometer": ("accelerometer", "m/s^2/sqrt(Hz)", "m/s^3/sqrt(Hz)"),
}


def _kalibr_keys(
    gyro: FilterSetting, accelerometer: FilterSetting | None, wanted: Wanted
) -> list[str]:
    # The noise is continuous: a rate that nothing states is left to the reader.
    rate = wanted.known_rate
    known = "# update_rate:  # Hz: no recording states it, add it" if rate is None else ""
    lines = [f"rostopic: {wanted.topic}", known or f"update_rate: {rate:.9g}  # Hz"]
    of_kind: dict[Sensor, FilterSetting | None] = {"gyro": gyro, "accelerometer": accelerometer}
    for kind, setting in of_kind.items():
        prefix, white, walk = _KALIBR[kind]
        keys = (f"{prefix}_noise_density", white), (f"{prefix}_random_walk", walk)
        if setting is None:
            lines += [f"# {key}:  # {unit}, continuous: not measured, add it" for key, unit in keys]
            continue
        model, sample = setting.simple, white.partition("/sqrt")[0]
        said = "" if setting.limit is not None else "; stated, not measured"
        lines += [
            f"{key}: {value:.6e}  # {unit}, continuous{said}"
            for (key, unit), value in zip(keys, (model.white, model.walk), strict=True)
        ]
        if rate is None:
            continue
        lines.append(
            f"# discrete, at {rate:.9g} Hz: {model.white_per_sample(1.0 / rate):.6e} {sample} "
            f"white, {model.walk_per_sample(1.0 / rate):.6e} {sample} per step of the bias"
        )
    return lines


def _flat_yaml(name: str, wanted: Wanted) -> str:
    (gyro,) = wanted.chosen
    force = worst(wanted.accelerometers) if wanted.accelerometers else None
    return _heading(name, wanted) + "\n".join(_kalibr_keys(gyro, force, wanted)) + "\n"


def _openvins(name: str, wanted: Wanted) -> str:
    text = "%YAML:1.0\n" + _heading(name, wanted, in_words=False)
    text += _comment(["Keep T_i_b and the intrinsics of your own kalibr_imu_chain.yaml."])
    force = worst(wanted.accelerometers) if wanted.accelerometers else None
    for index, gyro in enumerate(wanted.chosen):
        keys = [*_kalibr_keys(gyro, force, wanted), "time_offset: 0.0  # s"]
        said = [one.in_words() for one in (gyro, force) if one is not None]
        text += f"\nimu{index}:\n" + "".join(f"  {_comment([words])}" for words in said)
        text += "".join(f"  {key}\n" for key in keys)
    return text


# Names, and the unit of N^2, of what GTSAM is set to.
_GTSAM: Final[Mapping[Sensor, tuple[str, str, str, str, str]]] = {
    "gyro": ("GYROSCOPE", "Gyroscope", "BIAS_OMEGA", "BiasOmega", "rad/s"),
    "accelerometer": ("ACCELEROMETER", "Accelerometer", "BIAS_ACC", "BiasAcc", "m/s^2"),
}


def _gtsam(name: str, wanted: Wanted) -> str:
    values, functions = "", ""
    for kind, axes in _three(wanted).items():
        upper, camel, bias, bias_camel, unit = _GTSAM[kind]
        white = _listed([one.simple.white**2 for one in axes])
        walk = _listed([one.simple.walk**2 for one in axes])
        values += f"{upper}_COVARIANCE = numpy.diag({white})  # ({unit})^2/Hz\n"
        values += f"{bias}_COVARIANCE = numpy.diag({walk})  # ({unit}/s)^2/Hz\n"
        functions += f'''

def set_{camel.lower()}(parameters):
    """Set gtsam.PreintegrationParams, or PreintegrationCombinedParams with the bias."""
    parameters.set{camel}Covariance({upper}_COVARIANCE)
    if hasattr(parameters, "set{bias_camel}Covariance"):
        parameters.set{bias_camel}Covariance({bias}_COVARIANCE)
'''
    head = _heading(name, wanted)
    return f"{head}\nimport numpy\n\n# Diagonals for x, y and z.\n{values}{functions}"


_MATRICES: Final[Mapping[Sensor, tuple[str, str]]] = {
    "gyro": ("angular_velocity_covariance", "(rad/s)^2"),
    "accelerometer": ("linear_acceleration_covariance", "(m/s^2)^2"),
}


def _imu_message(name: str, wanted: Wanted) -> str:
    rate, three = wanted.update_rate, _three(wanted)
    text = _heading(name, wanted)
    text += f"imu:\n  # variance of one sample at {rate:.9g} Hz, row by row about x, y, z\n"
    for kind, (key, unit) in _MATRICES.items():
        if kind not in three:
            text += f"  # {key}:  # {unit}: not measured, add it\n"
            continue
        matrix = np.diag([one.simple.white_per_sample(1.0 / rate) ** 2 for one in three[kind]])
        rows = ",\n    ".join(", ".join(f"{value:.6e}" for value in row) for row in matrix)
        text += f"  # {unit}\n  {key}: [\n    {rows}]\n"
    return text


def _ros_imu(name: str, wanted: Wanted) -> str:
    none = "  # no orientation is measured\n  orientation_covariance: [-1, 0, 0, 0, 0, 0, 0, 0, 0]"
    return f"{_imu_message(name, wanted)}{none}\n"


def _robot_localization(name: str, wanted: Wanted) -> str:
    text = _imu_message(name, wanted)
    said: Mapping[Sensor, str] = {
        "gyro": "these gyros alone add to roll, pitch and yaw of process_noise_covariance,\n"
        "# rad^2/s",
        "accelerometer": "these accelerometers alone add to vx, vy and vz of it, (m/s)^2/s",
    }
    for kind, axes in _three(wanted).items():
        text += f"# What {said[kind]}: {_listed([one.simple.white**2 for one in axes])[1:-1]}\n"
    return text


def _imu_tools(name: str, wanted: Wanted) -> str:
    (gyro,), rate = wanted.chosen, wanted.update_rate
    gain = _MADGWICK * gyro.simple.white_per_sample(1.0 / rate)
    zeta = _MADGWICK * gyro.simple.walk * rate**0.5
    return (
        _heading(name, wanted)
        + "imu_filter_madgwick:\n  ros__parameters:\n"
        + f"    gain: {gain:.9e}  # rad/s, at {rate:.9g} Hz\n    zeta: {zeta:.9e}  # rad/s^2\n"
    )


# Parameter of N and of K with the range that PX4's reference states, and the unit of N's.
_PX4: Final[Mapping[Sensor, tuple[tuple[str, float, float], tuple[str, float, float], str]]] = {
    "gyro": (("EKF2_GYR_NOISE", 1e-4, 0.1), ("EKF2_GYR_B_NOISE", 0.0, 0.01), "rad/s"),
    "accelerometer": (("EKF2_ACC_NOISE", 0.01, 1.0), ("EKF2_ACC_B_NOISE", 0.0, 0.01), "m/s^2"),
}


def _px4(name: str, wanted: Wanted) -> str:
    rate = wanted.rate or PX4_RATE
    text = _heading(name, wanted) + f"# discrete, at an update rate of {rate:.9g} Hz\n"
    for setting in (*wanted.chosen, *wanted.forces):
        white, walk, unit = _PX4[setting.kind]
        model = setting.simple
        values = (model.white * rate**0.5, model.walk * rate**0.5)
        for (key, low, high), value, per in zip((white, walk), values, ("", "/s"), strict=True):
            text += f"# {key} in {unit}{per}"
            if not low <= value <= high:
                text += f"; outside the range of {low:g} to {high:g} that PX4 states"
            text += f"\n1\t1\t{key}\t{value:.9e}\t{_PX4_FLOAT}\n"
    return text


# Tools of Markov biases, and whether gyros and accelerometers have one correlation time.
_COMMON_TIME: Final[Mapping[str, bool]] = {
    "kf-gins": True,
    "psins": False,
    "gazebo": False,
    "gnss-ins-sim": False,
}


def _markov_times(name: str, wanted: Wanted) -> dict[Sensor, float]:
    """The correlation time that serves the sensors of each kind best, s."""
    three = _three(wanted)
    every = tuple(one for axes in three.values() for one in axes)
    return {
        kind: _markov_time(wanted, every if _COMMON_TIME[name] else axes)
        for kind, axes in three.items()
    }


def _markov_time(wanted: Wanted, settings: Sequence[FilterSetting]) -> float:
    limits = [one.limit for one in settings if one.limit is not None]
    stated = [rate.correlation_time for one in wanted.settings for rate in one.full.markov]
    return common_time(limits) if limits or not stated else stated[0]


def _markov_models(name: str, wanted: Wanted) -> dict[Sensor, tuple[float, list[FilterModel]]]:
    """The correlation time, s, of each kind of sensor, and the models of its x, y and z."""
    times = _markov_times(name, wanted)
    return {
        kind: (times[kind], [one.as_markov(times[kind]).simple for one in axes])
        for kind, axes in _three(wanted).items()
    }


def _kf_gins(name: str, wanted: Wanted) -> str:
    found = _markov_models(name, wanted)
    keys: Mapping[Sensor, tuple[tuple[str, float, str], tuple[str, float, str]]] = {
        "gyro": (
            ("arw", DEGREE_PER_ROOT_HOUR, "deg/sqrt(hr)"),
            ("gbstd", DEGREE_PER_HOUR, "deg/hr"),
        ),
        "accelerometer": (("vrw", _VELOCITY_WALK, "m/s/sqrt(hr)"), ("abstd", _MILLIGAL, "mGal")),
    }
    text = _heading(name, wanted) + "imunoise:\n"
    for kind, units in keys.items():
        if kind not in found:
            text += "".join(
                f"  # {key}:  # {unit}: not measured, add it\n" for key, _, unit in units
            )
            continue
        _, models = found[kind]
        numbers = [one.white for one in models], [one.markov[0].deviation for one in models]
        for (key, size, unit), values in zip(units, numbers, strict=True):
            text += f"  {key}: {_listed([value / size for value in values])}  # {unit}\n"
    text += f"  corrtime: {found['gyro'][0] / HOUR:.6e}  # hr\n"
    return text + "  # gsstd, asstd:  # ppm: not measured here, keep your own\n"


def _psins(name: str, wanted: Wanted) -> str:
    found = _markov_models(name, wanted)
    units: Mapping[Sensor, tuple[str, str, str, float, float]] = {
        "gyro": ("web", "sqrtR0G", "TauG", DEGREE_PER_ROOT_HOUR, DEGREE_PER_HOUR),
        "accelerometer": ("wdb", "sqrtR0A", "TauA", _MICRO_G, _MICRO_G),
    }
    text = _heading(name, wanted, mark="%")
    text += "% web deg/sqrt(h), wdb ug/sqrt(Hz), sqrtR0G deg/h, sqrtR0A ug, TauG and TauA s\n"
    text += "eb = 0; db = 0;  % constant biases, which no noise tells\n"
    for kind, (white, deviation, tau, size, rate_size) in units.items():
        if kind not in found:
            text += f"{white} = 0; {deviation} = 0; {tau} = 1;  % not measured, set them\n"
            continue
        time, models = found[kind]
        for key, values in (
            (white, [one.white / size for one in models]),
            (deviation, [one.markov[0].deviation / rate_size for one in models]),
        ):
            text += f"{key} = [{'; '.join(f'{value:.6e}' for value in values)}];\n"
        text += f"{tau} = {time:.6e};\n"
    return text + "imuerr = imuerrset(eb, db, web, wdb, sqrtR0G, TauG, sqrtR0A, TauA);\n"


def _imu_sensor(name: str, wanted: Wanted) -> str:
    text = _heading(name, wanted, mark="%") + "imu = imuSensor('accel-gyro');\n"
    if (rate := wanted.known_rate) is not None:
        text += f"imu.SampleRate = {rate:.9g};  % Hz\n"
    for kind, axes in _three(wanted).items():
        prefix = "gyro" if kind == "gyro" else "accel"
        white, walk = (
            _listed(values)
            for values in ([one.simple.white for one in axes], [one.simple.walk for one in axes])
        )
        text += (
            f"imu.{'Gyroscope' if kind == 'gyro' else 'Accelerometer'} = {prefix}params("
            f"'NoiseType', 'single-sided', ...\n    'NoiseDensity', {white}, ...\n"
            f"    'RandomWalk', {walk});\n"
        )
    return text


# Elements of SDF.
_SDF: Final[Mapping[Sensor, str]] = {
    "gyro": "angular_velocity",
    "accelerometer": "linear_acceleration",
}


def _gazebo(name: str, wanted: Wanted) -> str:
    rate = wanted.update_rate
    # A comment of XML holds no two hyphens.
    said = _heading(name, wanted, mark=" ").replace("--", "- -")
    text = f"<!--\n{said}-->\n<sensor name='imu' type='imu'>\n  <update_rate>{rate:.9g}"
    text += "</update_rate>\n  <imu>\n"
    for kind, (time, models) in _markov_models(name, wanted).items():
        text += f"    <{_SDF[kind]}>\n"
        for axis, model in zip("xyz", models, strict=True):
            noise = {
                "mean": 0.0,
                "stddev": model.white_per_sample(1.0 / rate),
                "dynamic_bias_stddev": model.markov[0].driving_noise,
                "dynamic_bias_correlation_time": time,
            }
            inside = "".join(f"<{key}>{value:.9e}</{key}>" for key, value in noise.items())
            text += f"      <{axis}><noise type='gaussian'>{inside}</noise></{axis}>\n"
        text += f"    </{_SDF[kind]}>\n"
    return f"{text}  </imu>\n</sensor>\n"


def _gnss_ins_sim(name: str, wanted: Wanted) -> str:
    found = _markov_models(name, wanted)
    units: Mapping[Sensor, tuple[str, str, float, float]] = {
        "gyro": ("gyro", "arw", DEGREE_PER_ROOT_HOUR, DEGREE_PER_HOUR),
        "accelerometer": ("accel", "vrw", _VELOCITY_WALK, 1.0),
    }
    text = _heading(name, wanted) + "\nimport numpy\n\n"
    text += "# deg/h, deg/sqrt(h), m/s^2, m/s/sqrt(h) and s; of x, y and z\nimu_err = {\n"
    for kind, (sensor, walk, white_size, bias_size) in units.items():
        values = {"b": [0.0] * 3, walk: [0.0] * 3, "b_stability": [0.0] * 3, "b_corr": [1.0] * 3}
        if kind in found:
            time, models = found[kind]
            values[walk] = [one.white / white_size for one in models]
            values["b_stability"] = [one.markov[0].deviation / bias_size for one in models]
            values["b_corr"] = [time] * 3
        said = "" if kind in found else "  # not measured, set it"
        text += "".join(
            f'    "{sensor}_{key}": numpy.array({_listed(value)}),{said}\n'
            for key, value in values.items()
        )
    return text + "}\n"


def _json(name: str, wanted: Wanted) -> str:
    del name
    return json.dumps(_plain(wanted), allow_nan=False, indent=1) + "\n"


def _toml(name: str, wanted: Wanted) -> str:
    return _heading(name, wanted, in_words=False) + toml_tables(_plain(wanted))


def _plain(wanted: Wanted) -> dict[str, object]:
    return plain(wanted.chosen, wanted.forces, rate=wanted.update_rate, version=wanted.version)


_VELOCITY_WALK: Final = FORCE_COEFFICIENT_UNITS["angle_random_walk"]["m/s/sqrt(h)"]

FORMATS: Final[Mapping[str, Callable[[str, Wanted], str]]] = {
    "kalibr": _flat_yaml,
    "allan-variance-ros": _flat_yaml,
    "openvins": _openvins,
    "gtsam": _gtsam,
    "robot-localization": _robot_localization,
    "ros-imu": _ros_imu,
    "imu-tools": _imu_tools,
    "px4": _px4,
    "kf-gins": _kf_gins,
    "psins": _psins,
    "imu-sensor": _imu_sensor,
    "gazebo": _gazebo,
    "gnss-ins-sim": _gnss_ins_sim,
    "toml": _toml,
    "json": _json,
}
