"""ROS 1 bags, ROS 2 bags and MCAP: the topics of ``sensor_msgs/Imu``.

The message ends in 37 doubles: orientation (4) and its covariance (9), angular velocity (3, rad/s)
and its covariance (9), linear acceleration (3, m/s²) and its covariance (9). So the numbers lie at
the same distance from the end whatever the header before them holds. The first message of a topic
is set beside what the library makes of it before any is read so.
"""

import os
import shutil
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, Final

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from sagnac.core import errors, whole_files
from sagnac.core.arrays import AnyArray, blocks
from sagnac.formats.source import MADE, Column, Outgoing, Source
from sagnac.formats.statement import Statement, of_rates

# ---- rosbag ------------------------------------------------------------------------

_TYPES: Final = ("sensor_msgs/msg/Imu", "sensor_msgs/Imu")
_DOUBLES: Final = 37
_STAMP_AT: Final = 4
_GYRO_AT: Final = 13
_ACCELEROMETER_AT: Final = 25
# Place of the first number of a covariance; it is -1 if the quantity is not measured.
_ACCELERATION_SPREAD_AT: Final = 28
_NOT_MEASURED: Final = -1.0
_BLOCK: Final = 1 << 15
_MOST_LISTED: Final = 8
_STAMP: Final = "stamp"
_RECEIVED: Final = "received"
_NUMBERS: Final = "numbers"
_AXES: Final = tuple(enumerate("xyz"))
# Column -> place among the doubles, and unit.
_FIELDS: Final = {
    **{f"angular_velocity.{axis}": (_GYRO_AT + i, "rad/s") for i, axis in _AXES},
    **{f"linear_acceleration.{axis}": (_ACCELEROMETER_AT + i, "m/s^2") for i, axis in _AXES},
}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Topic:
    """One topic of IMU messages.

    `order` is the byte order of its messages; `has_forces` is whether they state an acceleration.
    """

    name: str
    messages: int
    order: str
    is_stamped: bool
    has_forces: bool


def open_source(path: Path) -> Source:
    """The IMU topics of a bag; gyros are ``x``, ``y``, ``z`` if there is one topic.

    Raises
    ------
    RecordingError
        If it holds no IMU.
    ValueError
        If it is no bag, or is cut off.
    """
    with _reader(path) as bag:
        every = [(name, one.msgtype, one.msgcount) for name, one in bag.topics.items()]
        found = (_topic(bag, name) for name, kind, _ in every if kind in _TYPES)
        topics = [topic for topic in found if topic is not None]
    if not topics:
        listed = [f"{name} ({kind}, {count})" for name, kind, count in every[:_MOST_LISTED]]
        more = " ..." if len(every) > _MOST_LISTED else ""
        problem = f"holds no sensor_msgs/Imu; its topics are {', '.join(listed) or 'none'}{more}"
        raise errors.RecordingError(problem, remedy="give a bag with such a topic")
    keys = {
        field if len(topics) == 1 else f"{topic.name}/{field}": (topic, field)
        for topic in topics
        for field in (_STAMP, _RECEIVED, *_FIELDS)
    }

    def load(wanted: Sequence[str]) -> dict[str, AnyArray]:
        arrays: dict[str, AnyArray] = {}
        with _reader(path) as bag:
            for topic in topics:
                fields = {key: keys[key][1] for key in wanted if keys[key][0] is topic}
                if fields:
                    arrays.update(_read(bag, topic, fields))
        return arrays

    names = ", ".join(topic.name for topic in topics)
    problem = f"the IMU topics are {names}; name the columns of one with {{columns}}"
    stated = Statement(kind="rate")
    if len(topics) == 1:
        problem = f"gyros are those of topic {names}"
        forces = tuple(_FIELDS)[3:] if topics[0].has_forces else ()
        stated = of_rates(tuple(_FIELDS)[:3], forces, _STAMP if topics[0].is_stamped else _RECEIVED)
    units = {key: _FIELDS[name][1] if name in _FIELDS else "ns" for key, (_, name) in keys.items()}
    columns = tuple(Column(key=key, name=key, unit=unit) for key, unit in units.items())
    return Source(columns=columns, stated=stated, load=load, notes=(errors.Note(text=problem),))


def _reader(path: Path) -> AnyReader:
    """The reader of a file or folder."""
    # Bags of ROS 2 before Iron hold no definitions; the message is the same in all.
    return AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE))


def _topic(bag: AnyReader, name: str) -> _Topic | None:
    """A topic by its first message; None if it has none.

    Raises
    ------
    ValueError
        If its messages are laid out otherwise.
    """
    connections = [one for one in bag.connections if one.topic == name]
    found = next(bag.messages(connections=connections), None)
    if found is None:
        return None
    connection, _, raw = found
    # ROS 2 puts four bytes before a message, the second of which says the order; ROS 1 counts it.
    order = ">" if bag.is2 and raw[1] % 2 == 0 else "<"
    message: Any = bag.deserialize(raw, connection.msgtype)
    stamp, rate, force = message.header.stamp, message.angular_velocity, message.linear_acceleration
    expected = [rate.x, rate.y, rate.z, force.x, force.y, force.z]
    first = _numbers(name, order, [bytes(raw)])
    doubles = first[_NUMBERS][0]
    ours = [doubles[place] for place, _ in _FIELDS.values()]
    seconds = int(stamp.sec) * 10**9 + int(stamp.nanosec)
    if not np.array_equal(ours, expected, equal_nan=True) or first[_STAMP][0] != seconds:
        raise ValueError(f"messages of {name} are not those of sensor_msgs/Imu")
    count, is_stamped = sum(one.msgcount for one in connections), seconds != 0
    forces = bool(doubles[_ACCELERATION_SPREAD_AT] != _NOT_MEASURED)
    return _Topic(name=name, messages=count, order=order, is_stamped=is_stamped, has_forces=forces)


def _numbers(topic: str, order: str, raw: Sequence[bytes]) -> dict[str, AnyArray]:
    """Stamps, ns, and the doubles of some messages, (messages, 37)."""
    if any(len(message) < _STAMP_AT + 8 + 8 * _DOUBLES for message in raw):
        raise ValueError(f"a message of {topic} is cut off")
    ends = b"".join(message[-8 * _DOUBLES :] for message in raw)
    begin = b"".join(message[_STAMP_AT : _STAMP_AT + 8] for message in raw)
    doubles = np.frombuffer(ends, f"{order}f8").reshape(-1, _DOUBLES)
    seconds, nano = np.frombuffer(begin, f"{order}u4").reshape(-1, 2).T.astype(np.int64)
    return {_STAMP: seconds * 10**9 + nano, _NUMBERS: doubles}


def _read(bag: AnyReader, topic: _Topic, fields: dict[str, str]) -> dict[str, AnyArray]:
    """Columns of one topic: key -> values."""
    arrays: dict[str, AnyArray] = {
        key: np.empty(topic.messages, np.float64 if field in _FIELDS else np.int64)
        for key, field in fields.items()
    }
    messages = bag.messages(connections=[one for one in bag.connections if one.topic == topic.name])
    done = 0
    while some := list(islice(messages, _BLOCK)):
        block = slice(done, done + len(some))
        numbers = _numbers(topic.name, topic.order, [bytes(raw) for _, _, raw in some])
        numbers[_RECEIVED] = np.array([when for _, when, _ in some], dtype=np.int64)
        for key, field in fields.items():
            shown = numbers[_NUMBERS][:, _FIELDS[field][0]] if field in _FIELDS else numbers[field]
            arrays[key][block] = shown
        done = block.stop
    if done != topic.messages:
        raise ValueError(f"it holds {done} of {topic.messages} messages of {topic.name}")
    return arrays


# ---- write -------------------------------------------------------------------------

_WRITTEN: Final = "/imu"


def write(path: Path, out: Outgoing) -> None:
    """A bag of ROS 1 (``.bag``) or 2, of which one file is all: rates in SI on the topic ``/imu``.

    A covariance is zero, which says that it is not known, or begins with -1 of what is not there:
    the orientation, and the acceleration without accelerometers.
    """
    plugin = {".mcap": StoragePlugin.MCAP, ".db3": StoragePlugin.SQLITE3}.get(path.suffix.lower())
    store = get_typestore(Stores.ROS1_NOETIC if plugin is None else Stores.ROS2_HUMBLE)
    with whole_files.replacing_set(path) as folder:
        if plugin is None:
            with Writer1(folder / path.name) as bag:
                to = bag.add_connection(_WRITTEN, _TYPES[0], typestore=store, callerid=MADE)
                _write_messages(bag, to, b"\3\0\0\0imu", out)
            return
        whole = folder / "bag"
        try:
            with Writer2(whole, version=9, storage_plugin=plugin) as made:
                made.set_custom_data("remark", MADE)
                link = made.add_connection(_WRITTEN, _TYPES[0], typestore=store)
                _write_messages(made, link, b"\4\0\0\0imu\0", out)
        except sqlite3.Error as error:
            # Its database says so of a disk that is full.
            raise OSError(str(error)) from error
        os.replace(next(whole.glob(f"*{path.suffix.lower()}")), folder / path.name)
        shutil.rmtree(whole)


def _write_messages(bag: Writer1 | Writer2, to: Any, frame: bytes, out: Outgoing) -> None:
    """All samples as messages, in the named frame: its length, and its name as a string."""
    numbers = [("stamp", "<u4", 2), ("frame", f"V{len(frame)}"), ("doubles", "<f8", _DOUBLES)]
    message = np.dtype([("start", "<u4"), *numbers])
    sensors = ((_GYRO_AT, out.gyros), (_ACCELEROMETER_AT, out.accelerometers))
    for block in blocks(out.samples, _BLOCK):
        stamps = out.stamps(block)
        made = np.zeros(stamps.size, message)
        # ROS 1 begins with the number of a message, ROS 2 with the order of bytes, lowest first.
        made["start"] = np.arange(block.start, block.stop) if isinstance(bag, Writer1) else 0x100
        made["stamp"] = np.stack(np.divmod(stamps, 10**9), axis=1)
        made["frame"] = np.void(frame)
        # The real part of an orientation, and the first number of its covariance.
        made["doubles"][:, 3] = 1.0
        made["doubles"][:, 4] = _NOT_MEASURED
        if not out.accelerometers:
            made["doubles"][:, _ACCELERATION_SPREAD_AT] = _NOT_MEASURED
        for at, names in sensors:
            for place, name in enumerate(names, start=at):
                made["doubles"][:, place] = out.columns[name][block]
        content, whole = made.tobytes(), message.itemsize
        for n, stamp in enumerate(stamps.tolist()):
            bag.write(to, stamp, content[n * whole : (n + 1) * whole])
