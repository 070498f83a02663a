"""The file formats there are, one entry each. Nothing heavy is imported here."""

from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass
from importlib.metadata import entry_points
from typing import Final

from sagnac.core.errors import refusal


@dataclass(frozen=True, slots=True)
class Format:
    """One file format; what not every one has is stated by name.

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
    _: KW_ONLY
    writes: bool = True
    beginning: bytes = b""
    also: tuple[str, ...] = ()
    extra: str = ""
    rates_of: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        wrong = [one for one in self.suffixes if not one.startswith(".") or one != one.lower()]
        if wrong or not self.suffixes:
            raise refusal("suffixes", f"is {self.suffixes!r}; give one or more such as .csv")


CSV: Final = Format("CSV", (".csv", ".tsv", ".txt", ".lvm", ".dat", ".log", ".asc"), "csv")
PARQUET: Final = Format("Parquet", (".parquet", ".pq"), "arrow", beginning=b"PAR1")
FEATHER: Final = Format("Feather", (".feather", ".arrow"), "arrow", beginning=b"ARROW1")
MATLAB: Final = Format("MATLAB", (".mat",), "matlab", beginning=b"MATLAB 5")
NPZ: Final = Format("NumPy npz", (".npz",), "npz", beginning=b"PK\x03\x04")
NPY: Final = Format("NumPy npy", (".npy",), "npz", writes=False, beginning=b"\x93NUMPY")
PSINS: Final = Format("PSINS imu", (".imu",), "psins", writes=False)
_HDF: Final = b"\x89HDF\r\n\x1a\n"
HDF5: Final = Format("HDF5", (".h5", ".hdf5", ".he5"), "hdf5", also=MATLAB.suffixes, beginning=_HDF)
# Version 7.3 is HDF5 behind a header of MATLAB's.
MATLAB_7_3: Final = Format(
    "MATLAB", MATLAB.suffixes, "hdf5", writes=False, also=HDF5.suffixes, beginning=b"MATLAB 7.3"
)
# NetCDF 4 is HDF5 within.
NETCDF: Final = Format("NetCDF", (".nc", ".nc4"), "hdf5", writes=False, beginning=_HDF)
ROSBAG: Final = Format("ROS bag", (".bag", ".mcap", ".db3"), "rosbag", extra="ros", rates_of=(3, 6))
EUROC: Final = Format("EuRoC", (".euroc",), "csv", rates_of=(6,))
# Where a folder of EuRoC holds the samples of its IMU, and what it states of it.
EUROC_DATA: Final = "mav0/imu0/data.csv"
EUROC_SENSOR: Final = "mav0/imu0/sensor.yaml"
TDMS: Final = Format("TDMS", (".tdms",), "tdms", writes=False, beginning=b"TDSm", extra="tdms")
ULOG: Final = Format(
    "ULog", (".ulg", ".ulog"), "ulog", writes=False, extra="ulog", beginning=b"ULog\x01\x125"
)
_SEED: Final = (".mseed", ".miniseed", ".ms", ".msd")
MINISEED: Final = Format("miniSEED", _SEED, "miniseed", writes=False, extra="miniseed")
BINARY: Final = Format("binary", (".bin", ".ins", ".raw"), "binary", writes=False)

# A suffix that several have is that of the first.
_TABLES: Final = (CSV, PARQUET, MATLAB, NPZ, NPY, PSINS, HDF5, MATLAB_7_3, FEATHER, NETCDF)
FORMATS: Final = (*_TABLES, ROSBAG, EUROC, TDMS, ULOG, MINISEED, BINARY)
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
