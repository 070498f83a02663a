"""Files as instruments write them, and what has to be stated to read each.

The same noise, rad/s at 200 Hz, stands in every file. What a case states is all that the reader is
told; one that states nothing needs no option. If `missing`, which ``sagnac check`` prints, suggests
just that, it is checked, too.
"""

import datetime
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np
import pyarrow as pa
import pyarrow.feather
import pytest

from sagnac.formats import missing, read
from tests.formats.instruments import EPOCH, RATE, axes, bag, mseed, tdms, ulog

pytestmark = pytest.mark.usefixtures("trusted_hdf5")

VALUES = axes(samples=500)
X, _, Z = VALUES.gyros.T
DEGREES = np.rad2deg(VALUES.gyros)
SECONDS = np.arange(500) / RATE
COUNT = 1e-7  # rad/s


def german(number: float, decimals: int = 9) -> str:
    return f"{number:.{decimals}f}".replace(".", ",")


def written(path: Path, lines: list[str], encoding: str = "utf-8", end: str = "\n") -> Path:
    path.write_bytes((end.join(lines) + end).encode(encoding))
    return path


def german_labview(path: Path) -> Path:
    head = ["Messplatz 3", "Prüfer;Müller", "", "Zeit [s];Kreisel X [°/s];Kreisel Z [°/s]"]
    rows = [";".join(map(german, row)) for row in zip(SECONDS, *DEGREES.T[[0, 2]], strict=True)]
    return written(path / "messung.txt", head + rows, "cp1252", "\r\n")


LVM = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t,\n"
    "Multi_Headings\tNo\nX_Columns\t{}\nTime_Pref\tAbsolute\nDate\t2024/03/05\n"
    "***End_of_Header***\t\n\t\nChannels\t2\t\nSamples\t500\t500\t\nY_Unit_Label\tdeg/s\tdeg/s\t\n"
    "X_Dimension\tTime\tTime\t\nX0\t0,0\t0,0\t\nDelta_X\t0,005000\t0,005000\t\n"
    "***End_of_Header***\t\t\t\n"
)


def lvm(path: Path) -> Path:
    rows = ["\t".join(map(german, row)) for row in zip(SECONDS, *DEGREES.T[[0, 2]], strict=True)]
    return written(path / "run.lvm", [LVM.format("One") + "X_Value\tx\tz\tComment", *rows])


def lvm_without_times(path: Path) -> Path:
    rows = ["\t" + "\t".join(map(german, row)) for row in DEGREES[:, [0, 2]]]
    return written(path / "run.lvm", [LVM.format("No") + "X_Value\tx\tz\tComment", *rows])


def euroc(path: Path) -> Path:
    names = [f"w_RS_S_{axis} [rad s^-1]" for axis in "xyz"]
    names += [f"a_RS_S_{axis} [m s^-2]" for axis in "xyz"]
    rows = [
        f"{stamp}," + ",".join(map(repr, (*map(float, gyro), *map(float, force))))
        for stamp, gyro, force in zip(
            VALUES.stamps, VALUES.gyros, VALUES.accelerometers, strict=True
        )
    ]
    return written(path / "data.csv", ["#timestamp [ns]," + ",".join(names), *rows])


def kalibr(path: Path) -> Path:
    text = euroc(path).read_text().partition("\n")[2]
    names = [f"{kind}_{axis}" for kind in ("omega", "alpha") for axis in "xyz"]
    return written(path / "imu0.csv", ["timestamp," + ",".join(names), text.rstrip("\n")])


def echoed(path: Path) -> Path:
    names = ["%time", "field.header.seq", "field.header.stamp", "field.header.frame_id"]
    names += [f"field.angular_velocity.{axis}" for axis in "xyz"]
    rows = [
        f"{stamp},{n},{stamp},imu_link," + ",".join(map(repr, map(float, gyro)))
        for n, (stamp, gyro) in enumerate(zip(VALUES.stamps, VALUES.gyros, strict=True))
    ]
    return written(path / "imu.csv", [",".join(names), *rows])


def stamped(path: Path) -> Path:
    rows = [f"{s},{float(x)!r},{float(z)!r}" for s, x, z in zip(VALUES.stamps, X, Z, strict=True)]
    return written(path / "log.csv", ["time_stamp,gyro_x,gyro_z", *rows])


def sixteen(path: Path) -> Path:
    rows = [f"{german(x)}\t{german(z)}" for x, _, z in DEGREES]
    return written(path / "export.txt", ["x (°/s)\tz (°/s)", *rows], "utf-16")


def stamps_from(*start: int) -> list[datetime.datetime]:
    first = datetime.datetime(*start)
    return [first + datetime.timedelta(milliseconds=5 * n) for n in range(500)]


def clocked(path: Path) -> Path:
    rows = [
        f"{stamp:%H:%M:%S}.{stamp.microsecond // 1000:03d};{x:.9f};{z:.9f}"
        for stamp, (x, _, z) in zip(stamps_from(2024, 3, 5, 23, 59, 59), DEGREES, strict=True)
    ]
    return written(path / "night.csv", ["Uhrzeit;x[deg/s];z[deg/s]", *rows])


def dated(path: Path) -> Path:
    rows = [
        f"{stamp:%d.%m.%Y %H:%M:%S},{stamp.microsecond // 1000:03d}\t{german(x)}\t{german(z)}\tOK"
        for stamp, (x, _, z) in zip(stamps_from(2024, 2, 29, 23, 59, 59), DEGREES, strict=True)
    ]
    return written(path / "dated.dat", ["Zeit\tx[°/s]\tz[°/s]\tStatus", *rows], "cp1252")


def seven_doubles(path: Path) -> Path:
    rows = np.column_stack([1e5 + SECONDS, DEGREES, VALUES.accelerometers])
    rows.astype("<f8").tofile(path / "unit.ins")
    return path / "unit.ins"


LAYOUT = """kind = "rate"
sample_rate = 200.0
[layout]
fields = [["n", "u2"], ["x", "f4", "rad/s"], ["", "pad4"], ["z", "f4", "rad/s"]]
byte_order = "big"
sync = "AA55"
checksum = "sum8"
"""


def telegrams(path: Path) -> Path:
    content = b""
    for n, row in enumerate(VALUES.gyros.astype(">f4")):
        body = n.to_bytes(2, "big") + row.tobytes()
        content += b"\xaa\x55" + body + bytes([sum(body) % 256])
    (path / "serial.bin").write_bytes(content)
    (path / "serial.bin.toml").write_text(LAYOUT)
    return path / "serial.bin"


def aligned(path: Path) -> Path:
    rows = [
        f"  {second:16.9e}" + "".join(f" {value:17.10e}" for value in row)
        for second, row in zip(254_500 + SECONDS, VALUES.gyros, strict=True)
    ]
    return written(path / "columns.txt", rows, end="\r\n")


def netcdf(path: Path) -> Path:
    with h5netcdf.File(path / "run.nc", "w") as file:
        file.dimensions = {"time": 500}
        file.create_variable("time", ("time",), data=np.arange(500) * 5).attrs["units"] = (
            "milliseconds since 2024-03-05"
        )
        for name, column in (("x", DEGREES[:, 0]), ("z", DEGREES[:, 2])):
            file.create_variable(name, ("time",), data=column / 0.5).attrs["units"] = "deg/s"
            file[name].attrs["scale_factor"] = 0.5
    return path / "run.nc"


def feather(path: Path) -> Path:
    stamps = pa.array(VALUES.stamps, pa.timestamp("ns"))
    table = pa.table({"time": stamps, "gyro_x": X, "gyro_z": Z})
    pyarrow.feather.write_feather(table, path / "frame.feather")
    return path / "frame.feather"


def quoted(path: Path) -> Path:
    rows = [f'"{1e6 * x:,.6f}","{1e6 * z:,.6f}"' for x, _, z in VALUES.gyros]
    return written(path / "excel.csv", ['"x [urad/s]","z [urad/s]"', *rows])


def unit_row(path: Path) -> Path:
    rows = [f"{s:.3f}|{x:.9f}|{z:.9f}" for s, (x, _, z) in zip(SECONDS, DEGREES, strict=True)]
    return written(path / "diadem.asc", ["Time|x|z", "s|deg/s|deg/s", *rows])


def ring(path: Path) -> Path:
    return mseed(path / "ring.mseed", np.rint(X / COUNT).astype(np.int64))


def mcap(path: Path) -> Path:
    (found,) = bag(path / "run.mcap", VALUES).glob("*.mcap")
    return found


@dataclass(frozen=True, kw_only=True)
class Case:
    """How a file is written, what is stated, and how far its digits go, rad/s."""

    write: Callable[[Path], Path]
    stated: dict[str, Any] = field(default_factory=dict)
    suggested: bool = True
    digits: float = 1e-15
    gyros: tuple[str, ...] = ("x", "z")


NINE = 1.1e-9 * np.pi / 180.0
BOTH = {"columns": {"x": "gyro_x", "z": "gyro_z"}, "kind": "rate", "unit": "rad/s"}
CASES = {
    "German text of LabVIEW": Case(
        write=german_labview,
        stated={"columns": {"x": "Kreisel X [°/s]", "z": "Kreisel Z [°/s]"}, "kind": "rate"},
        digits=NINE,
    ),
    ".lvm": Case(write=lvm, stated={"kind": "rate"}, digits=NINE),
    ".lvm without times": Case(write=lvm_without_times, stated={"kind": "rate"}, digits=NINE),
    "TDMS": Case(write=lambda path: tdms(path / "run.tdms", VALUES), stated={"kind": "rate"}),
    "bag of ROS 1": Case(write=lambda path: bag(path / "run.bag", VALUES)),
    "bag of ROS 2": Case(write=lambda path: bag(path / "run.db3", VALUES)),
    "MCAP": Case(write=mcap),
    "PX4 ULog": Case(write=lambda path: ulog(path / "run.ulg", VALUES), digits=1e-9),
    "EuRoC, TUM-VI": Case(write=euroc),
    "Kalibr": Case(write=kalibr),
    "rostopic echo -p": Case(write=echoed),
    "stamps in ns": Case(write=stamped, stated={**BOTH, "time": "time_stamp:ns"}, suggested=False),
    "UTF-16": Case(
        write=sixteen, stated={"kind": "rate", "sample_rate": RATE}, suggested=False, digits=NINE
    ),
    "times of the clock": Case(write=clocked, stated={"kind": "rate"}, digits=NINE),
    "German dates, Windows-1252": Case(write=dated, stated={"kind": "rate"}, digits=NINE),
    "seven doubles": Case(
        write=seven_doubles, stated={"layout": "imu7-deg"}, suggested=False, gyros=("x", "y", "z")
    ),
    "telegrams with checksums": Case(write=telegrams, digits=1e-9),
    "aligned columns by number": Case(
        write=aligned,
        stated={
            "columns": {"x": "2", "y": "3", "z": "4"},
            "kind": "rate",
            "unit": "rad/s",
            "time": "1:s",
        },
        suggested=False,
        digits=1e-12,
        gyros=("x", "y", "z"),
    ),
    "NetCDF": Case(write=netcdf, stated={"kind": "rate"}),
    "Feather of pandas": Case(write=feather, stated=BOTH, suggested=False),
    "quoted, commas between thousands": Case(
        write=quoted, stated={"kind": "rate", "sample_rate": RATE}, suggested=False, digits=1e-12
    ),
    "a line of units": Case(write=unit_row, stated={"kind": "rate"}, digits=NINE),
    "miniSEED": Case(
        write=ring,
        stated={"columns": {"x": "BW_RLAS__B_J_Z"}, "kind": "rate", "scale": f"{COUNT}rad/s"},
        suggested=False,
        digits=0.51 * COUNT,
        gyros=("x",),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_the_same_samples_come_out_of_every_file(tmp_path, name):
    case = CASES[name]
    path = case.write(tmp_path)
    if case.suggested:
        as_typed = {
            key: ",".join(f"{one}={column}" for one, column in value.items())
            if isinstance(value, dict)
            else value
            for key, value in case.stated.items()
        }
        assert missing(path) == as_typed
    recording = read(path, **case.stated)
    assert recording.sample_rate == pytest.approx(RATE, rel=1e-6)
    assert not any(note.level == "warning" for note in recording.notes)
    for gyro in recording.gyros:
        if gyro.name in case.gyros:
            expected = VALUES.gyros[:, "xyz".index(gyro.name)]
            np.testing.assert_allclose(gyro.values, expected, rtol=1e-14, atol=case.digits)
    assert set(case.gyros) <= {gyro.name for gyro in recording.gyros}


def test_stamps_in_ns_that_are_called_seconds_are_noticed(tmp_path):
    recording = read(stamped(tmp_path), **BOTH, time="time_stamp:s", verify=False)
    assert any("in ns they would be those of 200 Hz" in note.text for note in recording.notes)
    offered = read(stamped(tmp_path), **BOTH, sample_rate=RATE).notes
    assert any("column time_stamp looks like time stamps" in note.text for note in offered)
    assert EPOCH > 10**18
