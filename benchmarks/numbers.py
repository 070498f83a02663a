"""Every number that the program gives: recorded with one version, compared with another.

``python -m benchmarks.numbers record FILE.json`` runs the command line on simulated recordings
(and on real ones, with ``--data``) and `sagnac.stability_curve` on published points, and keeps
every number and text that comes out. ``python -m benchmarks.numbers compare BEFORE AFTER`` lists
what is not the same in two such records.

Only the command line and that one call are used, both in processes of their own, so that the
two versions may differ in everything else. Times taken, versions and the paths and hashes of
files are left out.
"""

import argparse
import csv
import hashlib
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, Final

import numpy as np

Value = float | str | bool | None
Numbers = dict[str, Value]
Record = dict[str, Numbers]
Keywords = dict[str, Any]

TOLERANCE: Final = 1e-9
# Tables hold nine digits: a change too small to matter may still turn the last one.
PRINTED_TOLERANCE: Final = 1e-8
PRINTED: Final = "printed"
# Below this a number is zero: what a subnormal or an underflow leaves.
NOTHING: Final = 1e-290
LEFT_OUT: Final = frozenset({"seconds", "version", "path", "sha256"})
# Sentences: a change of them is listed and is no failure.
WORDING: Final = ("notes", "source", "problem", "message", "refused")
# What stands before the name of a file.
FOLDERS: Final = re.compile(r"(?<![^\s\"])(?:/[^\s/]+)+/")
# Hash of the bytes of a column: a change is listed; the numbers beside it decide.
DIGEST: Final = "digest"
SAMPLES_KEPT: Final = 33
MOST_LISTED: Final = 400

ESTIMATORS: Final = (
    "adev",
    "oadev",
    "mdev",
    "tdev",
    "hdev",
    "ohdev",
    "totdev",
    "mtotdev",
    "theo1",
    "theoh",
    "haar",
)
FAMILY: Final = ("--estimator", ",".join(ESTIMATORS))
# Those that a record with samples missing allows.
WITH_GAPS: Final = ("--estimator", "adev,oadev,mdev,tdev,hdev,ohdev,haar")
PAIR: Final = ("--gyros", "x,z")
# What the numbers of a file are.
ARCSECONDS: Final = ("--unit", "arcsec", "--rate", "100")
SPEEDS: Final = ("--kind", "rate", "--unit", "deg/h", "--rate", "100")

# --- what is simulated ------------------------------------------------------------------------

ANGLE_LINES: Final = [[1, 0.5], [2, 0.2], [5, 0.1], [24, 0.05]]
TIME_LINES: Final = [[0.7, 0.05], [7.3, 0.02], [33.1, 0.1]]
# The preset has lines up to near 100 Hz: slower samples take these in their place.
SLOW: Final = {"time": TIME_LINES}
BIASED: Final = {"mode": "rate-biased", "arw_deg_per_sqrt_h": 1e-5}

# Name: what differs from the defaults, as the keys of the configuration.
RECORDINGS: Final[dict[str, dict[str, Any]]] = {
    "quiet-40": {"preset": "quiet", "duration_s": 900, "sample_rate_hz": 100},
    "paper-01": {
        "preset": "paper",
        "duration_s": 1800,
        "sample_rate_hz": 50,
        "table": {"rate_deg_per_s": 1},
        "disturbances": {"time": TIME_LINES[:2]},
    },
    "paper-10": {
        "preset": "paper",
        "duration_s": 1200,
        "sample_rate_hz": 125,
        "disturbances": SLOW,
        "table": {"rate_deg_per_s": 10},
    },
    "paper-20": {
        "preset": "paper",
        "duration_s": 900,
        "sample_rate_hz": 125,
        "disturbances": SLOW,
        "table": {"rate_deg_per_s": 20},
    },
    "paper-40": {"preset": "paper", "duration_s": 300, "sample_rate_hz": 500, "seed": 5},
    "paper-60": {
        "preset": "paper",
        "duration_s": 900,
        "sample_rate_hz": 125,
        "disturbances": SLOW,
        "table": {"rate_deg_per_s": 60},
    },
    "paper-80": {
        "preset": "paper",
        "duration_s": 500,
        "sample_rate_hz": 200,
        "table": {"rate_deg_per_s": 80},
    },
    "paper-rest": {
        "preset": "paper",
        "duration_s": 900,
        "sample_rate_hz": 125,
        "disturbances": SLOW,
        "table": {"rate_deg_per_s": 0},
    },
    "paper-two-hours": {
        "preset": "paper",
        "duration_s": 7200,
        "sample_rate_hz": 20,
        "seed": 11,
        "disturbances": {"time": TIME_LINES[:2]},
    },
    "harsh-40": {
        "preset": "harsh",
        "duration_s": 1300,
        "sample_rate_hz": 100,
        "disturbances": {"time": TIME_LINES[:2]},
    },
    "reversing-20": {
        "preset": "harsh",
        "duration_s": 900,
        "sample_rate_hz": 100,
        "table": {"rate_deg_per_s": 20, "reversal_interval_s": 250},
        "disturbances": {"time": TIME_LINES[:2]},
    },
    "dithered-rest": {
        "duration_s": 600,
        "sample_rate_hz": 100,
        "table": {"rate_deg_per_s": 0},
        "gyro": {"mode": "dithered"},
        "disturbances": {"time": TIME_LINES[:2]},
    },
    "dithered-20": {
        "preset": "paper",
        "duration_s": 600,
        "sample_rate_hz": 100,
        "table": {"rate_deg_per_s": 20},
        "gyro": {"mode": "dithered"},
        "disturbances": {"time": TIME_LINES[:2]},
    },
    "biased-40": {"duration_s": 900, "sample_rate_hz": 100, "gyro": BIASED},
    "biased-80": {
        "preset": "paper",
        "duration_s": 600,
        "sample_rate_hz": 125,
        "disturbances": SLOW,
        "table": {"rate_deg_per_s": 80},
        "gyro": BIASED,
    },
    "still-rest": {
        "duration_s": 600,
        "sample_rate_hz": 100,
        "table": {"rate_deg_per_s": 0},
        "gyro": {"mode": "still"},
    },
    "backward-20": {
        "duration_s": 900,
        "sample_rate_hz": 100,
        "seed": 3,
        "table": {"rate_deg_per_s": -20, "start_deg": 90},
        "platform": {"latitude_deg": -35, "heading_deg": 77},
        "disturbances": {"angle": ANGLE_LINES, "time": TIME_LINES[:2]},
    },
    "profile": {
        "duration_s": 900,
        "sample_rate_hz": 100,
        "table": {"profile": [[0, 10], [200, 40], [500, 40], [900, 60]], "ripple": [[12, 0.001]]},
        "disturbances": {"angle": ANGLE_LINES},
    },
    "wandering-40": {
        "duration_s": 900,
        "sample_rate_hz": 100,
        "table": {
            "wander_fraction": 0.02,
            "jitter_rms_deg_per_s": 0.01,
            "jitter_spectrum": "rate",
            "wobble": [[1, 5], [2, 1]],
        },
        "encoder": {
            "lines": 36000,
            "periodic_error": [[1, 1], [64, 0.2]],
            "null_accuracy_arcsec": 5,
        },
        "disturbances": {"angle": ANGLE_LINES, "time": TIME_LINES},
    },
    "drifting-rest": {
        "duration_s": 1000,
        "sample_rate_hz": 100,
        "table": {"rate_deg_per_s": 0},
        "gyro": {
            "arw_deg_per_sqrt_h": 1e-3,
            "quantization_step_arcsec": 0.1,
            "bias_deg_per_h": 3,
            "bias_instability_deg_per_h": 0.01,
            "rate_random_walk_deg_per_h_per_sqrt_h": 0.05,
            "rate_ramp_deg_per_h_per_h": 0.02,
            "temperature_coefficient_deg_per_h_per_k": 0.01,
            "warm_up_k": 2,
        },
    },
    "unequal-30": {
        "duration_s": 900,
        "sample_rate_hz": 100,
        "seed": 7,
        "table": {"rate_deg_per_s": 30, "jitter_rms_deg_per_s": 0.003},
        "platform": {"share_deviation": [0.001, -0.002, 0.0015]},
        "gyro": {
            "arw_deg_per_sqrt_h": [2.5e-5, 8e-5, 1e-5],
            "quantization_step_arcsec": 0,
            "bias_deg_per_h": [0.1, -0.2, 0.05],
        },
        "disturbances": {"angle": ANGLE_LINES[:2], "time": TIME_LINES[:1]},
    },
}
# Simulated from the options alone.
BY_OPTIONS: Final = {
    "options-40": ("--preset", "quiet", "--seed", "9", "--duration", "60s"),
    "options-rest": ("--table-rate", "0", "--duration", "1min", "--seed", "4"),
}


def toml_of(configuration: Mapping[str, Any]) -> str:
    """The configuration as TOML, whose numbers, strings and lists are written as in JSON."""
    lines = []
    tables = []
    for key, value in configuration.items():
        if isinstance(value, dict):
            tables.append(f"\n[{key}]")
            tables += [f"{name} = {json.dumps(inner)}" for name, inner in value.items()]
        else:
            lines.append(f"{key} = {json.dumps(value)}")
    return "\n".join((*lines, *tables)) + "\n"


# --- what is made from the simulated recordings -----------------------------------------------


def derive(folder: Path) -> None:
    """Files of other kinds and with faults, from the recordings that are in the folder."""
    with np.load(folder / "drifting-rest.npz") as recording:
        angle = {name: recording[name] for name in "xyz"}
    rate = 100.0
    turned = {name: np.diff(values, prepend=0.0) for name, values in angle.items()}
    speed = {name: values * rate for name, values in turned.items()}
    save(folder / "increments.npz", turned)
    save(folder / "speeds.npz", speed)

    missing = {name: values.copy() for name, values in speed.items()}
    for name, start, stop in (("x", 500, 530), ("x", 70_000, 70_900), ("z", 20_000, 20_001)):
        missing[name][start:stop] = np.nan
    save(folder / "missing.npz", missing)
    without_angles = {name: values.copy() for name, values in angle.items()}
    for values in without_angles.values():
        values[10_000:10_400] = np.nan
        values[90_000] = np.nan
    save(folder / "missing-angles.npz", without_angles)

    stamps = np.arange(60_000) / rate
    kept = np.ones(stamps.size, dtype=bool)
    kept[12_000:12_350] = False
    kept[41_234] = False
    table = {"t": stamps, **{name: values[: stamps.size] for name, values in speed.items()}}
    write_csv(folder / "stamped.csv", {name: values[:30_000] for name, values in table.items()})
    write_csv(folder / "jumping.csv", {name: values[kept] for name, values in table.items()})

    faulty = {name: values[:60_000].copy() for name, values in speed.items()}
    faulty["x"][20_000:24_000] = faulty["x"][20_000]
    faulty["y"][30_000] += 1e4
    faulty["z"] = np.zeros(60_000)
    save(folder / "faulty.npz", faulty)
    counted = {name: np.floor(values[:60_000] / 0.1) % 65536 for name, values in angle.items()}
    save(folder / "counted.npz", counted)


def save(path: Path, columns: Mapping[str, Any]) -> None:
    if not path.exists():
        np.savez(path, **columns)


def write_csv(path: Path, columns: Mapping[str, Any]) -> None:
    if not path.exists():
        rows = np.column_stack(list(columns.values()))
        np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.17g")


# --- what is run ------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One command whose numbers are kept.

    `weight` is about how long it takes, s: long ones start first. `tables` has the command
    write its folder too, and the tables in it are read.
    """

    name: str
    arguments: tuple[str, ...]
    weight: float = 3.0
    tables: bool = False


def cases_of_simulations() -> Iterator[Case]:
    """Every command on the simulated recordings and on what is made of them."""
    yield from _analyses_by_fos()
    yield from _analyses_by_other_methods()
    yield from _lines_and_comparisons()
    yield from _curves_at_rest()
    yield from _rates_and_increments()
    yield from _curves_with_gaps()
    yield from _faults()
    yield from _tables()


def simulated(command: str, file: str, *options: str, **keywords: Any) -> Case:
    """A command on a simulated recording, or on what is made of one; both give its name."""
    name = " ".join((command, file, *options, *(["-o"] if keywords.get("tables") else [])))
    return Case(name=name, arguments=(command, file, *options, "--json"), **keywords)


def _analyses_by_fos() -> Iterator[Case]:
    for name in RECORDINGS:
        # A wandering table spreads every line, and the search for what is left takes minutes.
        part = ("--slice", "0:200") if name == "wandering-40" else ()
        yield simulated("analyze", f"{name}.npz", *PAIR, *part, weight=8.0)
        yield simulated("check", f"{name}.npz", weight=1.0)
    for name in BY_OPTIONS:
        yield simulated("analyze", f"{name}.npz")
    for name in ("paper-20", "backward-20", "unequal-30"):
        yield simulated("analyze", f"{name}.npz", "--gyros", "x", weight=6.0)
    for name in ("quiet-40", "unequal-30", "drifting-rest", "biased-40"):
        yield simulated("analyze", f"{name}.npz", "--gyros", "x,y,z", weight=12.0)
    yield simulated("analyze", "backward-20.npz", *PAIR, "--interval", "100ms", weight=6.0)
    yield simulated(
        "analyze", "backward-20.npz", "--gyros", "z,y", "--confidence", "0.683", weight=6.0
    )
    yield simulated("analyze", "harsh-40.npz", *PAIR, "--slice", "300:900", weight=6.0)
    yield simulated(
        "analyze", "drifting-rest.npz", *PAIR, "--interval", "2s", "--confidence", "0.99"
    )
    yield simulated("analyze", "quiet-40.npz", "biased-40.npz", "--method", "none", *PAIR)


def _analyses_by_other_methods() -> Iterator[Case]:
    for name, method in product(
        ("paper-20", "harsh-40", "reversing-20", "dithered-20", "backward-20", "unequal-30"),
        ("fris", "none"),
    ):
        yield simulated("analyze", f"{name}.npz", *PAIR, "--method", method)
    for name in ("paper-rest", "profile"):
        yield simulated("analyze", f"{name}.npz", *PAIR, "--method", "fris")
    for name, span in (
        ("paper-20", "0:300"),
        ("paper-80", "0:200"),
        ("backward-20", "100:400"),
        ("dithered-rest", "0:300"),
    ):
        options = (*PAIR, "--method", "fos-paper", "--slice", span)
        yield simulated("analyze", f"{name}.npz", *options, weight=8.0)


def _lines_and_comparisons() -> Iterator[Case]:
    yield simulated("compare", "backward-20.npz", *PAIR, "--slice", "0:300", weight=12.0)
    yield simulated("compare", "dithered-rest.npz", *PAIR, "--slice", "0:300", weight=10.0)
    for name, gyros in (("backward-20", "x,z"), ("paper-rest", "x"), ("unequal-30", "y,z")):
        yield simulated("lines", f"{name}.npz", "--gyros", gyros, weight=6.0)
    yield simulated(
        "lines", "dithered-rest.npz", "--gyros", "x", "--method", "fos-paper", weight=6.0
    )


def _curves_at_rest() -> Iterator[Case]:
    yield simulated("avar", "dithered-rest.npz", *FAMILY, "--gyros", "x", weight=15.0)
    yield simulated("avar", "dithered-rest.npz", weight=12.0)
    for interval in ("1s", "100ms"):
        options = (*FAMILY, "--interval", interval, "--confidence", "0.683")
        yield simulated("avar", "paper-rest.npz", *options, "--gyros", "x", weight=10.0)
        yield simulated("avar", "drifting-rest.npz", *options, "--gyros", "y", weight=10.0)
    yield simulated("avar", "still-rest.npz", "--gyros", "z")
    yield simulated("avar", "dithered-rest.npz", "--gyros", "y", "--method", "fos", weight=6.0)
    yield simulated("avar", "biased-40.npz", "--gyros", "x", "--interval", "1s")


def _rates_and_increments() -> Iterator[Case]:
    speed = ("--kind", "rate", "--unit", "arcsec/s", "--rate", "100")
    for estimators in (FAMILY, ()):
        options = ("--kind", "increment", *ARCSECONDS, *estimators, "--interval", "1s")
        yield simulated("avar", "increments.npz", *options, "--gyros", "x", weight=8.0)
    yield simulated("analyze", "speeds.npz", *SPEEDS, *PAIR)
    yield simulated("check", "speeds.npz", *speed)
    yield simulated("analyze", "increments.npz", "--kind", "increment", *ARCSECONDS, *PAIR)
    yield simulated(
        "analyze", "increments.npz", "--kind", "x=increment,z=increment", *ARCSECONDS, *PAIR
    )


def _curves_with_gaps() -> Iterator[Case]:
    for interval in ((), ("--interval", "1s")):
        options = (*WITH_GAPS, *interval, "--gaps", "omit")
        yield simulated("avar", "missing.npz", *SPEEDS, *options, "--gyros", "x", weight=12.0)
    for gaps in ("omit", "reject"):
        yield simulated(
            "avar", "missing.npz", *SPEEDS, "--gaps", gaps, "--interval", "1s", weight=8.0
        )
        for family in (FAMILY, WITH_GAPS):
            options = ("--kind", "angle", *ARCSECONDS, *family, "--gaps", gaps, "--interval", "1s")
            yield simulated("avar", "missing-angles.npz", *options, "--gyros", "z")
        options = ("--kind", "rate", "--unit", "deg/h", "--time", "t:s", "--gaps", gaps)
        yield simulated("avar", "jumping.csv", *options, "--gyros", "x", weight=5.0)


def _faults() -> Iterator[Case]:
    yield simulated("check", "missing.npz", *SPEEDS)
    yield simulated("check", "jumping.csv", "--kind", "rate", "--unit", "deg/h", "--time", "t:s")
    stamped = ("--kind", "rate", "--unit", "deg/h", "--time", "t:s")
    yield simulated("avar", "stamped.csv", *stamped, "--gyros", "y")
    yield simulated("analyze", "jumping.csv", *stamped, *PAIR)
    yield simulated("check", "faulty.npz", *SPEEDS)
    yield simulated("analyze", "faulty.npz", *SPEEDS, *PAIR)
    counts = ("--kind", "angle", "--unit", "counts", "--scale", "0.1arcsec", "--rate", "100")
    for options in (counts, (*counts, "--counter-bits", "16")):
        yield simulated("check", "counted.npz", *options)
        yield simulated("analyze", "counted.npz", *options, *PAIR)


def _tables() -> Iterator[Case]:
    yield simulated("analyze", "dithered-20.npz", *PAIR, tables=True, weight=12.0)
    options = (*FAMILY, "--interval", "1s", "--gyros", "x")
    yield simulated("avar", "dithered-rest.npz", *options, tables=True, weight=12.0)


def cases_of_data(data: Path, folder: Path) -> Iterator[Case]:
    """Commands on the real recordings, those without a reader written as CSV first."""

    def case(label: str, command: str, file: Path, *options: str, weight: float = 5.0) -> Case:
        arguments = (command, str(file), *options, "--json")
        return Case(
            name=f"{label} {command} {' '.join(options)}", arguments=arguments, weight=weight
        )

    counts = data / "psins_lasergyro" / "lasergyro.imu"
    quiet = ("--slice", "630:930")
    yield case("lasergyro", "avar", counts, *quiet, "--gyros", "x", weight=12.0)
    for gyro in "xyz":
        options = (*quiet, *FAMILY, "--gyros", gyro, "--interval", "100ms")
        yield case("lasergyro", "avar", counts, *options, weight=12.0)
    yield case("lasergyro", "lines", counts, *quiet, "--gyros", "y")
    yield case("lasergyro", "analyze", counts, *quiet, *PAIR, weight=8.0)
    yield case("lasergyro", "check", counts)

    shaft = data / "turntable_mpu6050" / "raw_yaw_slow.mat"
    rest = ("--gyros", "z", "--kind", "rate", "--unit", "deg/s", "--time", "all_time:s")
    turning = ("--columns", "z=all_gyro_2_z", *rest, "--table", "all_encoder:deg")
    for method, weight in (("fos", 70.0), ("fos-paper", 8.0), ("fris", 3.0), ("none", 8.0)):
        yield case("shaft", "analyze", shaft, *turning, "--method", method, weight=weight)
    yield case("shaft", "check", shaft, *turning)
    still = ("--columns", "z=all_gyro_1_z", *rest)
    yield case("shaft", "avar", shaft, *still, weight=15.0)
    yield case("shaft", "avar", shaft, *still, *FAMILY, "--interval", "1s", weight=15.0)

    structure = folder / "ln100.csv"
    records = np.fromfile(data / "calibration_ln100_adi" / "x_LN100_up.ins", dtype="<f8")
    named = dict(zip("txyz", records.reshape(-1, 7).T, strict=False))
    write_csv(structure, named)
    stated = ("--kind", "rate", "--unit", "deg/s", "--time", "t:s")
    yield case("ring laser", "avar", structure, *stated, weight=15.0)
    yield case("ring laser", "avar", structure, *stated, *FAMILY, "--gyros", "x", weight=12.0)
    yield case("ring laser", "analyze", structure, *stated, *PAIR, weight=8.0)
    yield case("ring laser", "check", structure, *stated)

    sensor = folder / "adi.csv"
    text = np.loadtxt(data / "calibration_ln100_adi" / "x_adi_up.txt")
    write_csv(sensor, dict(zip("txyz", text.T, strict=False)))
    stated = ("--kind", "rate", "--unit", "rad/s", "--rate", "100", "--time", "none")
    yield case("low pass", "avar", sensor, *stated)
    yield case("low pass", "avar", sensor, *stated, *FAMILY, "--gyros", "z")
    yield case("low pass", "analyze", sensor, *stated, *PAIR)
    yield case("low pass", "check", sensor, *stated)


# --- running it -------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """Where things are: the program, the recordings, and a folder for what is written."""

    program: str
    python: str
    recordings: Path
    scratch: Path

    def run(self, *arguments: str) -> tuple[dict[str, Value], str]:
        """Exit status, with the message of a failure, and standard output."""
        ended = subprocess.run(
            [self.program, *arguments],
            cwd=self.recordings,
            capture_output=True,
            text=True,
            encoding="utf-8",
            check=False,
        )
        status: dict[str, Value] = {"exit": ended.returncode}
        if ended.returncode != 0:
            said = [line for line in ended.stderr.splitlines() if not line.startswith("[")]
            status["message"] = sentences(" ".join(said))
        return status, ended.stdout

    def made(self, case: Case) -> Numbers:
        """What one command gives."""
        arguments = list(case.arguments)
        folder = self.scratch / hashlib.sha256(case.name.encode()).hexdigest()[:12]
        if case.tables:
            arguments += ["-o", str(folder)]
        status, output = self.run(*arguments)
        numbers: Numbers = dict(status)
        if output.strip():
            numbers |= flattened(json.loads(output))
        if case.tables:
            for path in sorted(folder.rglob("*.csv")):
                name = f"{PRINTED}/{path.relative_to(folder).as_posix()}"
                numbers |= flattened(table_of(path), name)
        return numbers

    def simulated(self, name: str, arguments: Sequence[str], folder: Path) -> Numbers:
        """One recording made, its columns and its truth described."""
        path = folder / f"{name}.npz"
        numbers, _ = self.run("simulate", *arguments, "-o", str(path))
        if numbers["exit"] == 0:
            truth = json.loads(path.with_name(f"{path.name}.truth.json").read_text("utf-8"))
            numbers |= flattened({"columns": columns_of(path), "truth": truth})
        return numbers

    def converted(self, source: str, suffix: str, options: Sequence[str] = ()) -> Numbers:
        """A recording written in another format and back, and what came back."""
        stem = f"{Path(source).stem}-{suffix}"
        there, back = self.scratch / f"{stem}.{suffix}", self.scratch / f"{stem}-back.npz"
        numbers, _ = self.run("convert", source, str(there), *options)
        if numbers["exit"] == 0:
            status, _ = self.run("convert", str(there), str(back))
            numbers |= {f"back/{key}": value for key, value in status.items()}
        if numbers.get("back/exit") == 0:
            numbers |= flattened({"columns": columns_of(back)})
        return numbers


def columns_of(path: Path) -> dict[str, Any]:
    """Samples of every column here and there, sums that show any change, and a hash."""
    described: dict[str, Any] = {}
    with np.load(path, allow_pickle=False) as archive:
        for name in archive.files:
            column = archive[name]
            if column.ndim == 0:
                described[name] = column.item()
                continue
            values = column.astype(np.float64)
            places = np.linspace(0, values.size - 1, SAMPLES_KEPT).astype(int)
            described[name] = {
                "type": str(column.dtype),
                "samples": values.size,
                "missing": int(np.isnan(values).sum()),
                "sum": float(np.nansum(values)),
                "size": float(np.sqrt(np.nanmean(values**2))),
                "bend": float(np.sqrt(np.nanmean(np.diff(values, 2) ** 2))),
                "least": float(np.nanmin(values)),
                "most": float(np.nanmax(values)),
                "at": values[places].tolist(),
                DIGEST: hashlib.sha256(np.ascontiguousarray(column).tobytes()).hexdigest(),
            }
    return described


def table_of(path: Path) -> list[dict[str, Value]]:
    """The rows of a table, numbers as numbers."""
    with path.open(encoding="utf-8", newline="") as stream:
        return [
            {key: number_or_text(cell) for key, cell in row.items()}
            for row in csv.DictReader(stream)
        ]


def number_or_text(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell


def flattened(value: Any, path: str = "") -> Numbers:
    """Every number and text of a document by its path, lists of sentences as one text."""
    numbers: Numbers = {}
    if isinstance(value, Mapping):
        for key, item in value.items():
            if key in LEFT_OUT:
                continue
            inner = f"{path}/{key}" if path else str(key)
            if key in WORDING and not isinstance(item, Mapping):
                numbers[inner] = sentences(item)
            else:
                numbers |= flattened(item, inner)
    elif isinstance(value, list | tuple):
        numbers[f"{path}/count"] = len(value)
        for index, item in enumerate(value):
            numbers |= flattened(item, f"{path}/{index}")
    elif isinstance(value, float) and not math.isfinite(value):
        numbers[path] = str(value)
    else:
        numbers[path] = value
    return numbers


def sentences(value: Any) -> str:
    """As one text, with files by their names alone."""
    text = (
        value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, sort_keys=True)
    )
    return FOLDERS.sub("", text)


# --- the call from Python ---------------------------------------------------------------------

NINE: Final = (892.0, 809.0, 823.0, 798.0, 671.0, 644.0, 883.0, 903.0, 677.0)
FIELDS: Final = ("tau", "deviation", "low", "high", "edf", "terms", "noise_type", "notes")
# Runs in the Python whose sagnac is asked for.
CALLS: Final = """
import json, sys
import numpy as np
import sagnac

asked = json.load(sys.stdin)
answers = {}
for name, values, keywords in asked["calls"]:
    try:
        curve = sagnac.stability_curve(np.array(asked["values"][values]), **keywords)
    except Exception as error:
        answers[name] = {"status": "refused", "problem": str(error)}
        continue
    answer = {"status": "done"}
    for field in asked["fields"]:
        if hasattr(curve, field):
            one = getattr(curve, field)
            answer[field] = one.tolist() if hasattr(one, "tolist") else [str(item) for item in one]
    answers[name] = answer
json.dump(answers, sys.stdout)
"""


def points_of_test(samples: int) -> Any:
    """Points of NIST SP 1065, p. 108, between 0 and 1."""
    number, points = 1234567890, []
    for _ in range(samples):
        points.append(number / 2147483647)
        number = 16807 * number % 2147483647
    return np.array(points)


def calls() -> tuple[dict[str, list[float]], list[tuple[str, str, Keywords]]]:
    """Sets of values, and the calls: a name, the set and the keywords of each."""
    nine, thousand = np.array(NINE), points_of_test(1000)
    with_gaps = thousand.copy()
    with_gaps[[*range(100, 105), 333, *range(700, 720)]] = np.nan
    nine_with_gap = nine.copy()
    nine_with_gap[3] = np.nan
    white = points_of_test(3000) - 0.5
    phase_with_gaps = np.cumsum(white[:1500])
    phase_with_gaps[[0, 77, *range(400, 430)]] = np.nan
    sets = {
        "nine": nine,
        "ten angles": np.concatenate(([0.0], np.cumsum(nine))),
        "nine, one missing": nine_with_gap,
        "thousand": thousand,
        "thousand angles": np.concatenate(([0.0], np.cumsum(thousand - thousand.mean()))),
        "thousand, some missing": with_gaps,
        "angles, some missing": phase_with_gaps,
        "walk": np.cumsum(white),
        "white angle": np.diff(white),
        "run": np.cumsum(np.cumsum(white[:800])),
    }
    asked: list[tuple[str, str, Keywords]] = []

    def call(values: str, **keywords: Any) -> None:
        told = ", ".join(f"{key}={value}" for key, value in keywords.items())
        asked.append((f"stability_curve({values}, {told})", values, keywords))

    for values, estimator, kind, gaps in product(
        sets, ESTIMATORS, ("rate", "increment", "angle"), ("reject", "omit")
    ):
        keywords = {"kind": kind, "estimator": estimator, "gaps": gaps}
        call(values, sample_rate=1.0, taus=None, confidence=0.683, **keywords)
    for values, estimator, kind in product(
        ("nine", "thousand", "thousand, some missing"), ESTIMATORS, ("rate", "angle")
    ):
        keywords = {"kind": kind, "estimator": estimator, "gaps": "omit"}
        call(values, sample_rate=1.0, taus=[1.0, 2.0, 10.0, 100.0], confidence=0.683, **keywords)
        call(values, sample_rate=50.0, taus=[0.02, 0.1, 0.13, 1.0], confidence=0.95, **keywords)
    call("thousand", sample_rate=1.0, kind="rate", estimator="oadev", taus=[5000.0])
    call("thousand", sample_rate=1.0, kind="rate", estimator="none")
    call("thousand", sample_rate=1.0, kind="speed", estimator="oadev")
    call("thousand", sample_rate=0.0, kind="rate", estimator="oadev")
    call("thousand", sample_rate=1.0, kind="rate", estimator="oadev", confidence=1.5)
    call("thousand", sample_rate=1.0, kind="rate", estimator="oadev", gaps="fill")
    return {name: values.tolist() for name, values in sets.items()}, asked


def called(python: str) -> Record:
    """What `stability_curve` of that Python answers."""
    values, asked = calls()
    question = json.dumps({"values": values, "calls": asked, "fields": FIELDS})
    ended = subprocess.run(
        [python, "-c", CALLS], input=question, capture_output=True, text=True, check=True
    )
    answers = json.loads(ended.stdout)
    return {name: flattened(answer) for name, answer in answers.items()}


# --- recording --------------------------------------------------------------------------------


def record(
    *,
    program: str,
    python: str,
    recordings: Path,
    reuse: Path | None,
    data: Path | None,
    workers: int,
) -> Record:
    """Everything, by the name of its case.

    Parameters
    ----------
    program, python
        The command line and the Python of the version to record.
    recordings
        Folder that the simulated recordings are put into.
    reuse
        Folder of recordings made before, which are analyzed in place of those made now.
    data
        Folder of real recordings, None for none.
    workers
        Commands at a time.
    """
    recordings.mkdir(parents=True, exist_ok=True)
    configurations = recordings / "configurations"
    configurations.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        bench = Bench(
            program=program,
            python=python,
            recordings=(reuse or recordings).resolve(),
            scratch=Path(scratch).resolve(),
        )
        arguments: dict[str, Sequence[str]] = dict(BY_OPTIONS)
        for name, configuration in RECORDINGS.items():
            path = (configurations / f"{name}.toml").resolve()
            path.write_text(toml_of(configuration), encoding="utf-8")
            arguments[name] = (str(path),)
        folder = recordings.resolve()
        jobs: list[tuple[str, Callable[[], Numbers]]] = [
            (f"simulate {name}", lambda n=name, w=words: bench.simulated(n, w, folder))
            for name, words in arguments.items()
        ]
        found = together(jobs, workers)
        derive(bench.recordings)

        cases = list(cases_of_simulations())
        if data is not None:
            cases += cases_of_data(data.resolve(), bench.recordings)
        cases.sort(key=lambda case: -case.weight)
        jobs = [(case.name, lambda c=case: bench.made(c)) for case in cases]
        jobs += [
            (
                f"convert backward-20.npz {suffix}",
                lambda s=suffix: bench.converted("backward-20.npz", s),
            )
            for suffix in ("npz", "csv", "tsv", "parquet", "h5", "mat")
        ]
        stated = ("--kind", "rate", "--unit", "deg/h", "--rate", "100")
        jobs.append(("convert speeds.npz", lambda: bench.converted("speeds.npz", "csv", stated)))
        if len({name for name, _ in jobs}) < len(jobs):
            raise ValueError("two cases have the same name; name them apart")
        found |= together(jobs, workers)
    print("stability_curve", file=sys.stderr, flush=True)
    return found | called(python)


def together(jobs: Sequence[tuple[str, Callable[[], Numbers]]], workers: int) -> Record:
    """All jobs, several at a time, told on standard error."""
    began = time.monotonic()
    found: Record = {}
    with ThreadPoolExecutor(workers) as pool:
        pending = [(name, pool.submit(job)) for name, job in jobs]
        for count, (name, job) in enumerate(pending, start=1):
            found[name] = job.result()
            spent = time.monotonic() - began
            end = "" if found[name]["exit"] == 0 else f": exit {found[name]['exit']}"
            print(f"[{spent:6.1f} s] {count}/{len(jobs)} {name}{end}", file=sys.stderr, flush=True)
    return found


# --- comparing --------------------------------------------------------------------------------


def is_number(value: Value) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def relative_difference(one: float, other: float) -> float:
    """Difference relative to the larger of the two; zero if both are below `NOTHING`."""
    size = max(abs(one), abs(other))
    if one == other or size < NOTHING:
        return 0.0
    return abs(one - other) / size


def is_wording(path: str) -> bool:
    return not set(WORDING).isdisjoint(path.split("/"))


def compare(before: Record, after: Record) -> bool:
    """Print what differs; whether nothing does that must not."""
    numbers = exact = texts = new = 0
    largest, where = 0.0, "nowhere"
    failures: list[str] = []
    reworded: list[str] = []
    bytes_differ: list[str] = []
    for name, expected in before.items():
        found = after.get(name)
        if found is None:
            failures.append(f"{name}: case is missing")
            continue
        new += len(found.keys() - expected.keys())
        scales = largest_of_each(expected)
        for path, value in expected.items():
            place = f"{name}: {path}"
            if path not in found:
                failures.append(f"{place}: missing, was {shown(value)}")
                continue
            other = found[path]
            if is_number(value) and is_number(other):
                difference = relative_difference(value, other)
                numbers += 1
                exact += value == other
                if difference > largest:
                    largest, where = difference, place
                if difference > (PRINTED_TOLERANCE if path.startswith(PRINTED) else TOLERANCE):
                    beside = abs(value - other) / max(scales[group_of(path)], NOTHING)
                    failures.append(
                        f"{place}: {value!r} is now {other!r}, relative {difference:.2e}, "
                        f"{beside:.1e} of the largest beside it"
                    )
                continue
            texts += 1
            if value == other:
                continue
            change = f"{place}: {shown(value)} is now {shown(other)}"
            if is_wording(path):
                reworded.append(change)
            elif path.endswith(f"/{DIGEST}"):
                bytes_differ.append(place)
            else:
                failures.append(change)

    print(
        f"cases: {len(before)} before, {len(after)} after, {len(after.keys() - before.keys())} new"
    )
    print(f"numbers compared: {numbers}, equal exactly: {exact}")
    print(f"largest relative difference: {largest:.3e}, {where}")
    print(f"texts compared: {texts}; keys that are new: {new}")
    listed("columns whose bytes differ (the numbers beside them decide)", bytes_differ)
    listed("sentences that differ (no failure)", reworded)
    listed(f"differences (more than {TOLERANCE:g}, texts, missing)", failures)
    return not failures


def group_of(path: str) -> str:
    return path.rpartition("/")[0]


def largest_of_each(numbers: Numbers) -> dict[str, float]:
    """The largest number of each list or mapping, by the path of it."""
    scales: dict[str, float] = {}
    for path, value in numbers.items():
        if isinstance(value, int | float):
            group = group_of(path)
            scales[group] = max(scales.get(group, 0.0), abs(value))
    return scales


def shown(value: Value) -> str:
    text = repr(value)
    return text if len(text) <= 300 else f"{text[:300]}…"


def listed(title: str, lines: Sequence[str]) -> None:
    print(f"\n{title}: {len(lines)}")
    for line in lines[:MOST_LISTED]:
        print(f"  {line}")
    if len(lines) > MOST_LISTED:
        print(f"  and {len(lines) - MOST_LISTED} more")


# --- from the command line --------------------------------------------------------------------


def load(path: Path) -> Record:
    loaded: Record = json.loads(path.read_text(encoding="utf-8"))
    return loaded


def main(arguments: Sequence[str]) -> int:
    """Run `record` or `compare`; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.numbers", description=__doc__)
    # What all benchmarks are given: there is no table to write here.
    parser.add_argument("--write", action="store_true", help=argparse.SUPPRESS)
    commands = parser.add_subparsers(dest="command")
    recorder = commands.add_parser("record", help="every number into a file")
    recorder.add_argument("file", type=Path)
    here = Path(sys.executable)
    recorder.add_argument("--program", default=str(here.with_name("sagnac")))
    recorder.add_argument("--python", default=str(here))
    recorder.add_argument("--data", type=Path, help="folder of the real recordings")
    recorder.add_argument("--recordings", type=Path, help="folder for the simulated recordings")
    recorder.add_argument("--reuse", type=Path, help="analyze those in this folder instead")
    recorder.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    comparer = commands.add_parser("compare", help="what differs between two records")
    comparer.add_argument("before", type=Path)
    comparer.add_argument("after", type=Path)
    stated = parser.parse_args(arguments)
    if stated.command is None:
        print("numbers: give record FILE.json or compare BEFORE AFTER")
        return 0
    if stated.command == "compare":
        return 0 if compare(load(stated.before), load(stated.after)) else 1
    began = time.monotonic()
    folder = stated.recordings or stated.file.with_suffix("")
    found = record(
        program=stated.program,
        python=stated.python,
        recordings=folder,
        reuse=stated.reuse,
        data=stated.data,
        workers=stated.workers,
    )
    stated.file.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps(found, ensure_ascii=False, indent=0, allow_nan=False)
    stated.file.write_text(text + "\n", encoding="utf-8")
    values = sum(len(numbers) for numbers in found.values())
    spent = time.monotonic() - began
    print(f"{len(found)} cases, {values} values, {spent:.0f} s, into {stated.file}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
