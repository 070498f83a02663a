"""Text tables known by their headers, which state nothing of kind and unit themselves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from sagnac.formats.statement import Statement
from sagnac.recording.frames import ACCELEROMETER_NAMES, GYRO_NAMES


@dataclass(frozen=True, slots=True, kw_only=True)
class Preset:
    """A table that a known program writes.

    Attributes
    ----------
    name
        Of the program or the data set.
    gyros
        Gyro -> name of its column.
    unit
        Of the gyros, which are rates.
    time
        Name and unit of the column of times.
    accelerometers
        Accelerometer -> name of its column, m/s²; they may be missing.
    """

    name: str
    gyros: Mapping[str, str]
    unit: str
    time: tuple[str, str]
    accelerometers: Mapping[str, str]

    def is_of(self, names: Sequence[str]) -> bool:
        """Whether a table with these columns is of this kind."""
        return {self.time[0], *self.gyros.values()} <= set(names)

    @property
    def units(self) -> dict[str, str]:
        """Units of the columns that it names."""
        name, unit = self.time
        return {
            **dict.fromkeys(self.gyros.values(), self.unit),
            **dict.fromkeys(self.accelerometers.values(), "m/s^2"),
            name: unit,
        }

    def statement(self, names: Sequence[str]) -> Statement:
        """Statements of a table with these columns."""
        has_all = set(self.accelerometers.values()) <= set(names)
        accelerometers = self.accelerometers if has_all else {}
        return Statement(
            kind="rate",
            columns={**self.gyros, **accelerometers},
            gyros=tuple(self.gyros),
            accelerometers=tuple(accelerometers) or None,
            time=self.time[0],
        )


def _axes(pattern: str, axes: str = "xyz") -> dict[str, str]:
    return {name: pattern.format(axis) for name, axis in zip(GYRO_NAMES, axes, strict=True)}


def _forces(pattern: str, axes: str = "xyz") -> dict[str, str]:
    names = zip(ACCELEROMETER_NAMES, axes, strict=True)
    return {name: pattern.format(axis) for name, axis in names}


PRESETS: Final = (
    # The data sets' own descriptions: "EuRoC MAV" (ASL format), which TUM-VI follows.
    Preset(
        name="EuRoC or TUM-VI",
        gyros=_axes("w_RS_S_{} [rad s^-1]"),
        accelerometers=_forces("a_RS_S_{} [m s^-2]"),
        unit="rad/s",
        time=("timestamp [ns]", "ns"),
    ),
    # Kalibr, kalibr_bagextractor and kalibr_bagcreater: imu0.csv.
    Preset(
        name="Kalibr",
        gyros=_axes("omega_{}"),
        accelerometers=_forces("alpha_{}"),
        unit="rad/s",
        time=("timestamp", "ns"),
    ),
    # ROS, rostopic echo -p: of a sensor_msgs/Imu, in SI.
    Preset(
        name="rostopic echo",
        gyros=_axes("field.angular_velocity.{}"),
        accelerometers=_forces("field.linear_acceleration.{}"),
        unit="rad/s",
        time=("field.header.stamp", "ns"),
    ),
    # PX4, ulog2csv: sensor_combined.
    Preset(
        name="ulog2csv",
        gyros=_axes("gyro_rad[{}]", "012"),
        accelerometers=_forces("accelerometer_m_s2[{}]", "012"),
        unit="rad/s",
        time=("timestamp", "us"),
    ),
)


def preset_of(names: Sequence[str]) -> Preset | None:
    """The preset that a table with these columns is of, None if it is of none.

    Examples
    --------
    >>> preset_of(["timestamp", "omega_x", "omega_y", "omega_z", "alpha_x"]).name
    'Kalibr'
    """
    return next((preset for preset in PRESETS if preset.is_of(names)), None)
