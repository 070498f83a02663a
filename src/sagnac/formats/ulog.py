"""PX4 logs (ULog): gyros and accelerometers of ``sensor_gyro`` or ``sensor_combined``."""

import io
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any, Final

import numpy as np
from pyulog import ULog

from sagnac.core.errors import Note, RecordingError, counted
from sagnac.formats.source import Column, Source
from sagnac.formats.statement import Statement, of_rates
from sagnac.recording.columns import GYRO_NAMES

# Message -> field -> unit, as PX4's message definitions state them.
_FIELDS: Final = {
    "sensor_gyro": dict.fromkeys(GYRO_NAMES, "rad/s"),
    "sensor_accel": dict.fromkeys(GYRO_NAMES, "m/s^2"),
    "sensor_combined": {
        **{f"gyro_rad[{i}]": "rad/s" for i in range(3)},
        **{f"accelerometer_m_s2[{i}]": "m/s^2" for i in range(3)},
    },
}
_TIMES: Final = ("timestamp_sample", "timestamp")


class _Stream(io.BufferedReader):
    """A file that tells how many bytes of the last message are not there.

    The library ends at a message that is not whole as it does at the end of a log.
    """

    lacking = 0

    def read(self, size: int | None = -1, /) -> bytes:
        content = super().read(size)
        # Three bytes of a message say its length and type.
        is_end = not content and size == 3
        self.lacking = 0 if is_end or size is None else max(size - len(content), 0)
        return content


def open_source(path: Path) -> Source:
    """Fields of the sensors' messages; those of a second sensor have its number.

    Gyros are ``x``, ``y``, ``z`` of ``sensor_gyro`` if there is one, else of ``sensor_combined``.
    A log that ends within a message is read as far as it goes, with a note.

    Raises
    ------
    RecordingError
        If the file is not ULog or is damaged, or logs no gyro.
    """
    # The library leaves a file open that it opened itself and cannot read; what it prints of a
    # damaged one is refused here.
    with io.FileIO(path) as raw, _Stream(raw) as stream, redirect_stdout(io.StringIO()):
        log = ULog(stream, list(_FIELDS), disable_str_exceptions=True)
    if log.file_corruption:
        raise ValueError("messages are damaged")
    sets = {f"{one.name}.{one.multi_id}".removesuffix(".0"): one for one in log.data_list}
    columns, arrays = [], {}
    for prefix, one in sets.items():
        for name, unit in {**_FIELDS[one.name], **dict.fromkeys(_TIMES, "us")}.items():
            if name in one.data:
                key = f"{prefix}.{name}"
                arrays[key] = one.data[name]
                columns.append(Column(key=key, name=key, unit=unit))
    if not any(one.unit == "rad/s" for one in columns):
        remedy = "log sensor_gyro at full rate"
        raise RecordingError(f"logs none of {', '.join(_FIELDS)}", remedy=remedy)
    texts = []
    if log.dropouts:
        lost, times = sum(one.duration for one in log.dropouts), len(log.dropouts)
        texts.append(f"the logger dropped out {counted(times, 'time')}, {lost} ms in all")
    if stream.lacking:
        problem = f"{counted(stream.lacking, 'byte')} of the last message are missing"
        texts.append(f"{problem}: the log was cut off, or is damaged there")
    return Source(
        columns=tuple(columns),
        # The library holds the log whole; what is taken becomes an array of its own.
        load=lambda keys: {key: np.ascontiguousarray(arrays[key]) for key in keys},
        stated=_stated(sets),
        notes=tuple(Note(text=text, level="warning", channel="time") for text in texts),
    )


def _stated(sets: dict[str, Any]) -> Statement:
    """The gyros of the only `sensor_gyro`, else of `sensor_combined`; none if several may be."""
    gyros = [prefix for prefix, one in sets.items() if one.name == "sensor_gyro"]
    prefix = gyros[0] if len(gyros) == 1 else "sensor_combined"
    if prefix not in sets:
        return Statement(kind="rate")
    # The forces of sensor_combined are sampled with the gyros; sensor_accel has times of its own.
    names = [f"{prefix}.{name}" for name in _FIELDS[sets[prefix].name]]
    time = next((f"{prefix}.{name}" for name in _TIMES if name in sets[prefix].data), None)
    return of_rates(names[:3], names[3:], time)
