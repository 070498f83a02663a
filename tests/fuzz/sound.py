"""A sound file of each format, small, for the fuzz tests to damage."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Final

import h5netcdf
import h5py
import numpy as np

from sagnac.formats import write
from sagnac.recording.model import Recording
from tests.formats.instruments import EPOCH, RATE, axes, bag, mseed, tdms, ulog
from tests.formats.test_binary import records
from tests.formats.test_instruments import euroc, kalibr, lvm
from tests.formats.test_netcdf import classic

IMU: Final = "% PSINS log\n1 2 3 0 0 0\n34 108 400 0 5.0 0\n0.1 0.2 0.4 1 1 1\n"
COUNTS: Final = np.random.default_rng(6).integers(-500, 500, 2000)
LINES: Final = 180
VALUES: Final = axes(samples=150)


def psins(path: Path) -> None:
    rows = np.random.default_rng(1).integers(-20, 20, (400, 6))
    path.write_text(IMU + "\n".join(" ".join(map(str, row)) for row in rows.tolist()) + "\n")


def written(path: Path) -> None:
    """By this package."""
    random = np.random.default_rng(1)
    seconds = np.arange(400) / 100.0
    recording = Recording.from_arrays(
        x=10.0 + random.normal(size=400),
        z=11.0 + random.normal(size=400),
        kind="rate",
        unit="deg/s",
        times=seconds + 1e-4 * random.uniform(-1.0, 1.0, 400),
        table=40.0 * seconds,
    )
    write(recording, path)


def bag_of_ros_2(path: Path) -> None:
    """The file of a bag that is a folder."""
    with tempfile.TemporaryDirectory() as folder:
        made = bag(Path(folder) / f"run{path.suffix}", VALUES)
        next(made.glob(f"*{path.suffix}")).rename(path)


def as_text(writer: Callable[[Path], Path]) -> Callable[[Path], None]:
    """What writes the first lines of a text under another name into a folder."""

    def save(path: Path) -> None:
        with tempfile.TemporaryDirectory() as folder:
            lines = writer(Path(folder)).read_bytes().splitlines(keepends=True)
            path.write_bytes(b"".join(lines[:LINES]))

    return save


def netcdf(path: Path) -> None:
    with h5netcdf.File(path, "w") as file:
        file.dimensions = {"time": None}
        file.resize_dimension("time", 150)
        stamps = (VALUES.stamps - EPOCH) * 1e-9
        time = file.create_variable("time", ("time",), data=stamps, chunks=(64,))
        time.attrs["units"] = "seconds since 2024-03-05 14:03:00"
        for axis, column in zip("xz", VALUES.gyros.T, strict=False):
            gyro = file.create_variable(axis, ("time",), data=column, chunks=(64,))
            gyro.attrs["units"] = "rad/s"
        file.attrs["kind"] = "rate"


def classic_netcdf(path: Path) -> None:
    counts = np.random.default_rng(3).integers(-3000, 3000, 301).astype(np.int16)
    classic(path, counts, 1, None, scale_factor=np.float64(0.01), add_offset=1.5)


def matlab_7_3(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        for axis, column in zip("xz", VALUES.gyros.T, strict=False):
            file.create_dataset(axis, data=column[np.newaxis])
        kind = file.create_dataset("kind", data=np.frombuffer(b"rate", np.uint8).astype("u2"))
        kind.attrs["MATLAB_class"] = np.bytes_("char")
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")


def telegrams(path: Path) -> None:
    """Sync bytes, a number, counts and a checksum in each record."""
    counts = np.random.default_rng(2).integers(-70_000, 70_000, 400)
    path.write_bytes(b"HEADER" + b"".join(records(counts, "crc32")))


def seven_doubles(path: Path) -> None:
    seconds = np.arange(150) / RATE
    np.column_stack([seconds, VALUES.gyros, VALUES.accelerometers]).astype("<f8").tofile(path)


def array(path: Path) -> None:
    np.save(path, np.column_stack([VALUES.gyros[:, 0], VALUES.gyros[:, 2]]).astype("<f4"))


# Name of the file behind "sound." -> what writes it.
WRITERS: Final[dict[str, Callable[[Path], object]]] = {
    **dict.fromkeys(("csv", "npz", "mat", "h5", "parquet", "feather"), written),
    "imu": psins,
    "npy": array,
    "bag": lambda path: bag(path, VALUES),
    "mcap": bag_of_ros_2,
    "db3": bag_of_ros_2,
    "tdms": lambda path: tdms(path, VALUES),
    "ulg": lambda path: ulog(path, VALUES, dropout_ms=20),
    "mseed": lambda path: mseed(path, COUNTS, gap=300),
    "v2.mseed": lambda path: mseed(path, COUNTS, gap=300, format_version=2, max_record_length=512),
    "nc": netcdf,
    "classic.nc": classic_netcdf,
    "v73.mat": matlab_7_3,
    "bin": telegrams,
    "ins": seven_doubles,
    "lvm": as_text(lvm),
    "euroc.csv": as_text(euroc),
    "kalibr.csv": as_text(kalibr),
}


def sound(folder: Path, ending: str) -> None:
    """Write the sound file of that ending into a folder."""
    WRITERS[ending](folder / f"sound.{ending}")
