"""The file formats there are, one entry each. Nothing heavy is imported here."""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Final

from sagnac.core.errors import refusal


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """One file format.

    Attributes
    ----------
    name
        As people call it; stands in messages.
    suffixes
        Of its files, lower case, with the dot. The first is the one to recommend.
    module
        In this package, or the full name of one elsewhere: has ``open_source(path) -> Source``
        and, where `writes`, ``write(path, outgoing)``. Imported when a file is opened, and its
        library with it.
    writes
        Whether it can be written.
    beginning
        First bytes of every such file; empty where there are none to tell it by.
    also
        Suffixes that its files may have as well, although they are another format's.
    extra
        The extra of this package that brings the library, empty if none is needed.
    rates_of
        How many channels its files may hold if these are the rates of three gyros and of
        accelerometers, and nothing else; empty if they hold whatever a recording has.

    Raises
    ------
    ValueError
        If there is no suffix, or one is not lower case after a dot.
    """

    name: str
    suffixes: tuple[str, ...]
    module: str
    writes: bool = True
    beginning: bytes = b""
    also: tuple[str, ...] = ()
    extra: str = ""
    rates_of: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        wrong = [one for one in self.suffixes if not one.startswith(".") or one != one.lower()]
        if wrong or not self.suffixes:
            raise refusal("suffixes", f"is {self.suffixes!r}; give one or more such as .csv")


CSV: Final = Format(
    name="CSV", suffixes=(".csv", ".tsv", ".txt", ".lvm", ".dat", ".log", ".asc"), module="csv"
)
PARQUET: Final = Format(
    name="Parquet", suffixes=(".parquet", ".pq"), module="arrow", beginning=b"PAR1"
)
FEATHER: Final = Format(
    name="Feather", suffixes=(".feather", ".arrow"), module="arrow", beginning=b"ARROW1"
)
MATLAB: Final = Format(name="MATLAB", suffixes=(".mat",), module="matlab", beginning=b"MATLAB 5")
NPZ: Final = Format(name="NumPy npz", suffixes=(".npz",), module="npz", beginning=b"PK\x03\x04")
NPY: Final = Format(
    name="NumPy npy", suffixes=(".npy",), module="npz", writes=False, beginning=b"\x93NUMPY"
)
PSINS: Final = Format(name="PSINS imu", suffixes=(".imu",), module="psins", writes=False)
HDF5: Final = Format(
    name="HDF5", suffixes=(".h5", ".hdf5", ".he5"), module="hdf5", also=MATLAB.suffixes,
    beginning=b"\x89HDF\r\n\x1a\n",
)  # fmt: skip
# Version 7.3 is HDF5 behind a header of MATLAB's.
MATLAB_7_3: Final = Format(
    name="MATLAB", suffixes=MATLAB.suffixes, module="hdf5", writes=False, also=HDF5.suffixes,
    beginning=b"MATLAB 7.3",
)  # fmt: skip
# NetCDF 4 is HDF5 within.
NETCDF: Final = Format(
    name="NetCDF", suffixes=(".nc", ".nc4"), module="hdf5", writes=False, beginning=HDF5.beginning
)
ROSBAG: Final = Format(
    name="ROS bag", suffixes=(".bag", ".mcap", ".db3"), module="rosbag", extra="ros",
    rates_of=(3, 6),
)  # fmt: skip
EUROC: Final = Format(name="EuRoC", suffixes=(".euroc",), module="csv", rates_of=(6,))
# Where a folder of EuRoC holds the samples of its IMU, and what it states of it.
EUROC_DATA: Final = "mav0/imu0/data.csv"
EUROC_SENSOR: Final = "mav0/imu0/sensor.yaml"
TDMS: Final = Format(
    name="TDMS", suffixes=(".tdms",), module="tdms", writes=False, beginning=b"TDSm", extra="tdms"
)
ULOG: Final = Format(
    name="ULog", suffixes=(".ulg", ".ulog"), module="ulog", writes=False, extra="ulog",
    beginning=b"ULog\x01\x125",
)  # fmt: skip
MINISEED: Final = Format(
    name="miniSEED", suffixes=(".mseed", ".miniseed", ".ms", ".msd"), module="miniseed",
    writes=False, extra="miniseed",
)  # fmt: skip
BINARY: Final = Format(
    name="binary", suffixes=(".bin", ".ins", ".raw"), module="binary", writes=False
)

# A suffix that several have is that of the first.
FORMATS: Final = (
    CSV, PARQUET, MATLAB, NPZ, NPY, PSINS, HDF5, MATLAB_7_3, FEATHER, NETCDF, ROSBAG, EUROC, TDMS,
    ULOG, MINISEED, BINARY,
)  # fmt: skip
# Entry points of this group name a `Format` that another package reads.
GROUP: Final = "sagnac.formats"


def formats() -> Iterator[Format]:
    """The formats of this package, then those that others add by entry points of `GROUP`.

    The others are looked for, which takes a while, only by who goes on to them.

    Raises
    ------
    TypeError
        If an entry point names something else.
    """
    yield from FORMATS
    for point in entry_points(group=GROUP):
        added = point.load()
        if not isinstance(added, Format):
            raise TypeError(f"entry point {point.name} of {GROUP} is {added!r}; name a Format")
        yield added
