"""Files of other formats, written by the libraries that others write them with."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from nptdms import ChannelObject, RootObject, TdmsWriter
from pymseed import DataEncoding, MS3TraceList
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

EPOCH = 1_700_000_000_123_456_789
RATE = 200.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Axes:
    """Six axes, (samples, 3) each, rad/s and m/s², and their stamps, ns."""

    gyros: np.ndarray
    accelerometers: np.ndarray
    stamps: np.ndarray = field(repr=False)


def axes(samples: int = 600, lost: int = 0, seed: int = 11) -> Axes:
    generator = np.random.default_rng(seed)
    kept = np.ones(samples, dtype=bool)
    kept[generator.choice(np.arange(1, samples - 1), lost, replace=False)] = False
    stamps = EPOCH + np.rint(np.arange(samples) * 1e9 / RATE).astype(np.int64)
    return Axes(
        gyros=1e-3 * generator.normal(size=(samples, 3))[kept],
        accelerometers=np.array([0.0, 0.0, 9.81])
        + 1e-2 * generator.normal(size=(samples, 3))[kept],
        stamps=stamps[kept],
    )


def _message(store, values: Axes, n: int, *, ros1: bool):
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](
        sec=int(values.stamps[n] // 10**9), nanosec=int(values.stamps[n] % 10**9)
    )
    numbered = {"seq": n} if ros1 else {}
    vector = types["geometry_msgs/msg/Vector3"]
    return types["sensor_msgs/msg/Imu"](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="imu_link", **numbered),
        orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
        orientation_covariance=np.zeros(9),
        angular_velocity=vector(*map(float, values.gyros[n])),
        angular_velocity_covariance=np.zeros(9),
        linear_acceleration=vector(*map(float, values.accelerometers[n])),
        linear_acceleration_covariance=np.zeros(9),
    )


def bag(path: Path, values: Axes, topics: tuple[str, ...] = ("/imu",)) -> Path:
    """A bag of ROS 1 (``.bag``) or 2 (``.mcap``, ``.db3``, written as a folder)."""
    ros1 = path.suffix == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    serialize = store.serialize_ros1 if ros1 else store.serialize_cdr
    if ros1:
        writer = Writer1(path)
    else:
        kind = StoragePlugin.MCAP if path.suffix == ".mcap" else StoragePlugin.SQLITE3
        writer = Writer2(path.with_suffix(""), version=9, storage_plugin=kind)
    kind = "sensor_msgs/msg/Imu"
    with writer:
        made = [writer.add_connection(topic, kind, typestore=store) for topic in topics]
        for n, stamp in enumerate(values.stamps):
            raw = serialize(_message(store, values, n, ros1=ros1), kind)
            for connection in made:
                writer.write(connection, int(stamp) + 2_000_000, raw)
    return path if ros1 else path.with_suffix("")


def tdms(path: Path, values: Axes, **properties) -> Path:
    """Three channels of gyros, deg/s, as LabVIEW's waveforms have them."""
    waveform = {"wf_increment": 1.0 / RATE, "unit_string": "deg/s", "wf_start_offset": 0.0}
    channels = [
        ChannelObject("Kreisel", name, np.rad2deg(column), {**waveform, **properties})
        for name, column in zip("xyz", values.gyros.T, strict=True)
    ]
    with TdmsWriter(path) as writer:
        half = values.stamps.size // 2
        for part in (slice(0, half), slice(half, None)):
            writer.write_segment(
                [RootObject({"Operator": "Labor"})]
                + [
                    ChannelObject("Kreisel", c.channel, c.data[part], c.properties)
                    for c in channels
                ]
            )
    return path


def mseed(path: Path, counts: np.ndarray, gap: int = 0, **options) -> Path:
    """One source of counts; `gap` of its samples are missing in the middle."""
    with MS3TraceList() as traces:
        half = counts.size // 2
        for part, after in ((counts[:half], 0), (counts[half:], half + gap)):
            traces.add_data(
                "FDSN:BW_RLAS__B_J_Z",
                part.astype(np.int32).tolist(),
                "i",
                RATE,
                starttime=EPOCH // 1000 * 1000 + round(after * 1e9 / RATE),
            )
        traces.to_file(path, encoding=DataEncoding.STEIM2, **options)
    return path


def ulog(path: Path, values: Axes, dropout_ms: int = 0) -> Path:
    """A PX4 log by hand, after the format's specification: definitions, then data."""

    def message(kind: bytes, content: bytes) -> bytes:
        return len(content).to_bytes(2, "little") + kind + content

    parts = [b"ULog\x01\x12\x35\x01" + (0).to_bytes(8, "little")]
    parts.append(message(b"B", bytes(40)))
    layout = "uint64_t timestamp;float x;float y;float z;"
    names = ("sensor_gyro", "sensor_accel")
    parts += [message(b"F", f"{name}:{layout}".encode()) for name in names]
    for number, name in enumerate(names):
        parts.append(message(b"A", b"\0" + number.to_bytes(2, "little") + name.encode()))
    for n, stamp in enumerate(values.stamps):
        micro = int(stamp // 1000 - EPOCH // 1000 + 1_000_000).to_bytes(8, "little")
        for number, rows in enumerate((values.gyros, values.accelerometers)):
            content = number.to_bytes(2, "little") + micro + rows[n].astype("<f4").tobytes()
            parts.append(message(b"D", content))
    if dropout_ms:
        parts.append(message(b"O", dropout_ms.to_bytes(2, "little")))
    path.write_bytes(b"".join(parts))
    return path
