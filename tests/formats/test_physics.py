"""Recordings that physics contradicts, each made on purpose, and its sound twin beside it.

Gravity, Earth rate, time stamps, counters and the table tell each of them.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.formats import read
from sagnac.formats.statement import Statement
from sagnac.quality.check import check, judged
from tests.instruments import GRAVITY, Floats, bench, turntable

STILL = bench(1, seconds=100.0, sample_rate=100.0, walk=0.003, bias=0.0, forces=True)
TURNING = turntable(2, seconds=100.0, sample_rate=100.0, table_rate=20.0)
RATE = {"kind": "rate", "unit": "deg/s", "sample_rate": 100.0}
ANGLE = {"kind": "angle", "unit": "arcsec", "sample_rate": 100.0, "table": "alpha:deg"}
COUNT = np.arange(STILL.times.size, dtype=float)


def table(**more: Floats) -> dict[str, Floats]:
    return {**TURNING.angles, "alpha": TURNING.encoder, **more}


def turning_rates() -> dict[str, Floats]:
    """Rates, arcsec/s, beside the encoder."""
    rates = {name: np.diff(one, prepend=one[0]) * 100.0 for name, one in TURNING.angles.items()}
    for one in rates.values():
        one[0] = one[1]
    return {**rates, "alpha": TURNING.encoder}


def said(folder: Path, held: Mapping[str, Floats], **stated: Any) -> list[str]:
    """Every warning and error of a file read so."""
    path = folder / "run.npz"
    np.savez(path, **held)
    try:
        recording = read(path, **stated)
    except RecordingError as error:
        return [str(error)]
    notes = (*recording.notes, *judged(recording), *check(recording))
    return list(dict.fromkeys(str(note) for note in notes if note.level != "remark"))


FORCES = {"columns": {}, "accelerometers": ("ax", "ay", "az")}
# Columns, what is wrongly stated, what is rightly stated instead, and what has to be named.
STATED: dict[str, tuple[dict[str, Floats], dict[str, Any], dict[str, Any], tuple[str, ...]]] = {
    "a rate that stamps contradict, still": (
        {"t": STILL.times, **STILL.rates},
        {**RATE, "sample_rate": 500.0},
        RATE,
        ("100 Hz in s", "500 Hz is stated", "rate=100"),
    ),
    "a rate that stamps in ms contradict, still": (
        {"stamp": 1e3 * STILL.times + 7e8, **STILL.rates},
        {**RATE, "sample_rate": 50.0},
        RATE,
        ("100 Hz in ms", "50 Hz is stated"),
    ),
    "a rate that stamps contradict, turning": (
        {"timestamp": 1e6 * TURNING.times, **table()},
        {**ANGLE, "sample_rate": 50.0},
        ANGLE,
        ("100 Hz in us", "50 Hz is stated"),
    ),
    "seconds called milliseconds, still": (
        {"t": STILL.times, **STILL.rates},
        {"kind": "rate", "unit": "deg/s", "time": "t:ms"},
        {"kind": "rate", "unit": "deg/s", "time": "t:s"},
        ("the unit ms looks wrong", "time=t:s"),
    ),
    "seconds called milliseconds, turning": (
        {"t": TURNING.times, **table()},
        {"kind": "angle", "unit": "arcsec", "table": "alpha:deg", "time": "t:ms"},
        {"kind": "angle", "unit": "arcsec", "table": "alpha:deg", "time": "t:s"},
        ("the unit ms looks wrong", "time=t:s"),
    ),
    "fractions of a day, as of a spreadsheet, called seconds, still": (
        {"t": 0.25 + STILL.times / 86_400.0, **STILL.rates},
        {"kind": "rate", "unit": "deg/s", "time": "t:s"},
        {"kind": "rate", "unit": "deg/s", "time": "t:d"},
        ("the unit s looks wrong", "in d", "those of 100 Hz", "time=t:d"),
    ),
    "milliseconds called seconds, still": (
        {"t": 1e3 * STILL.times, **STILL.rates},
        {"kind": "rate", "unit": "deg/s", "time": "t:s"},
        {"kind": "rate", "unit": "deg/s", "time": "t:ms"},
        ("1000 times too large", "those of 100 Hz", "time=COLUMN:ms"),
    ),
    "0.1 Hz for 100 Hz, still": (
        STILL.rates,
        {**RATE, "sample_rate": 0.1},
        RATE,
        ("1000 times too large", "rate=100"),
    ),
    "milliseconds called seconds, turning": (
        {"t": 1e3 * TURNING.times, **table()},
        {"kind": "angle", "unit": "arcsec", "table": "alpha:deg", "time": "t:s"},
        {"kind": "angle", "unit": "arcsec", "table": "alpha:deg", "time": "t:ms"},
        ("of Earth rate across a table", "1000 times", "rate=100"),
    ),
    "rates, milliseconds called seconds, turning": (
        {"t": 1e3 * TURNING.times, **turning_rates()},
        {"kind": "rate", "unit": "arcsec/s", "table": "alpha:deg", "time": "t:s"},
        {"kind": "rate", "unit": "arcsec/s", "table": "alpha:deg", "time": "t:ms"},
        ("1000 times too large", "does not follow gyro"),
    ),
    "deg called arcsec, turning": (
        table(**{name: one / 3600.0 for name, one in TURNING.angles.items()}),
        ANGLE,
        {**ANGLE, "unit": "deg"},
        ("in deg it would sense 57.7 %", "unit=deg"),
    ),
    "rad called deg, turning": (
        table(**{name: one / 206264.8 for name, one in TURNING.angles.items()}),
        {**ANGLE, "unit": "deg"},
        {**ANGLE, "unit": "rad"},
        ("in rad it would sense 57.7 %", "unit=rad"),
    ),
    "deg called rad, turning": (
        table(**{name: one / 3600.0 for name, one in TURNING.angles.items()}),
        {**ANGLE, "unit": "rad"},
        {**ANGLE, "unit": "deg"},
        ("times as fast as the table", "in deg it would sense 57.7 %", "unit=deg"),
    ),
    "deg/s called rad/s": (
        STILL.rates,
        {**RATE, "unit": "rad/s"},
        RATE,
        ("that of the Earth", "unit=deg/s"),
    ),
    "deg/h called deg/s": (
        {name: 3600.0 * one for name, one in STILL.rates.items()},
        RATE,
        {**RATE, "unit": "deg/h"},
        ("that of the Earth", "unit=deg/h"),
    ),
    "deg/s called deg/h": (
        STILL.rates,
        {**RATE, "unit": "deg/h"},
        RATE,
        ("that of the Earth", "unit=deg/s"),
    ),
    "rad/s called deg/s": (
        {name: np.radians(one) for name, one in STILL.rates.items()},
        RATE,
        {**RATE, "unit": "rad/s"},
        ("that of the Earth", "unit=rad/s"),
    ),
    "accelerometers in g called m/s^2": (
        {**STILL.rates, **{name: one / GRAVITY for name, one in STILL.forces.items()}},
        {**RATE, "unit": {**dict.fromkeys("xyz", "deg/s"), "accelerometers": "m/s^2"}, **FORCES},
        {**RATE, "unit": {**dict.fromkeys("xyz", "deg/s"), "accelerometers": "g"}, **FORCES},
        ("in g it would be gravity", "accelerometers=g"),
    ),
    "increments of velocity read as m/s^2": (
        {**STILL.rates, **{name: one / 100.0 for name, one in STILL.forces.items()}},
        {**RATE, "unit": {**dict.fromkeys("xyz", "deg/s"), "accelerometers": "m/s^2"}, **FORCES},
        {
            **RATE,
            "kind": {**dict.fromkeys("xyz", "rate"), "accelerometers": "increment"},
            "unit": {**dict.fromkeys("xyz", "deg/s"), "accelerometers": "m/s"},
            **FORCES,
        },
        ("as increments in m/s it would be gravity", "accelerometers=increment"),
    ),
    "forces in m/s^2 read as increments of velocity": (
        {**STILL.rates, **STILL.forces},
        {
            **RATE,
            "kind": {**dict.fromkeys("xyz", "rate"), "accelerometers": "increment"},
            "unit": {**dict.fromkeys("xyz", "deg/s"), "accelerometers": "m/s"},
            **FORCES,
        },
        {**RATE, "unit": {**dict.fromkeys("xyz", "deg/s"), "accelerometers": "m/s^2"}, **FORCES},
        ("as rates in m/s^2 it would be gravity", "accelerometers=rate"),
    ),
    "accelerometers in m/s^2 read as gyros": (
        {**STILL.rates, **STILL.forces},
        {**RATE, "columns": {"x": "ax", "y": "ay", "z": "az"}},
        RATE,
        ("which is gravity in m/s^2", "accelerometers"),
    ),
    "an encoder in degrees called rad": (
        table(),
        {**ANGLE, "table": "alpha:rad"},
        ANGLE,
        ("table=alpha:1deg",),
    ),
    "an unwrapped encoder in degrees called rad": (
        table(alpha=20.0 * TURNING.times),
        {**ANGLE, "table": "alpha:rad"},
        ANGLE,
        ("if the encoder were in degrees", ":deg"),
    ),
}


@pytest.mark.parametrize("case", STATED)
def test_what_is_stated_wrongly_is_named_with_what_would_be_right(tmp_path, case):
    columns, wrong, right, words = STATED[case]
    found = said(tmp_path, columns, **wrong)
    assert found
    assert all(any(word in one for one in found) for word in words), found
    assert said(tmp_path, columns, **right) == []


@pytest.mark.parametrize(
    "case", ["deg called arcsec, turning", "milliseconds called seconds, turning"]
)
def test_a_unit_that_the_table_contradicts_leaves_no_figure(tmp_path, case):
    columns, wrong, *_ = STATED[case]
    said(tmp_path, columns, **wrong)
    found = judged(read(tmp_path / "run.npz", **wrong))
    assert {note.level for note in found if note.channel in "xyz"} == {"error"}
    # One gyro across the axis beside one that senses the table is no such case.
    made = turntable(3, seconds=100.0, sample_rate=100.0, shares={"x": 1.6e-4, "z": 0.98})
    said(tmp_path, {**made.angles, "alpha": made.encoder}, **ANGLE)
    found = judged(read(tmp_path / "run.npz", **ANGLE))
    assert {note.level for note in found} == {"warning"}


def test_slow_readings_of_a_day_and_a_few_days_at_a_hertz_are_sound(tmp_path):
    stated = {"kind": "rate", "unit": "deg/h"}
    random = np.random.default_rng(6)
    for apart, samples in ((10.0, 8640), (1.0, 3 * 86_400), (0.2, 86_400)):
        columns = {"t": apart * np.arange(samples), "x": 2.0 + random.standard_normal(samples)}
        assert said(tmp_path, columns, **stated, time="t:s") == []


def test_accelerometers_in_g_read_as_gyros_are_named(tmp_path):
    forces = {name: one / GRAVITY / 1.003 for name, one in STILL.forces.items()}
    columns = {"x": "ax", "y": "ay", "z": "az"}
    found = said(tmp_path, forces, **RATE, columns=columns)
    assert any("which is gravity in g" in one for one in found)


def test_the_wrong_axis_beside_an_encoder_is_named_with_the_right_one(tmp_path):
    made = turntable(3, seconds=100.0, sample_rate=100.0, shares={"x": 0.002, "z": 0.98})
    columns = {**made.angles, "alpha": made.encoder}
    found = said(tmp_path, columns, **ANGLE, gyros=("x", "z"))
    assert len(found) == 1
    assert "x: senses 0.2 % of the table rate" in found[0]
    assert "gyro z senses 98 %" in found[0]
    assert said(tmp_path, columns, **ANGLE, gyros=("z",)) == []


def hand_turned() -> Floats:
    """Now still, now turned by hand at up to some 300 deg/s."""
    random = np.random.default_rng(5)
    slow = np.convolve(random.standard_normal(STILL.times.size), np.hanning(200), "same")
    turned = np.where(STILL.times > 30.0, 120.0 * slow / slow.std(), 0.0)
    return STILL.rates["x"] + turned


def test_a_unit_turned_by_hand_is_no_bench(tmp_path):
    found = said(tmp_path, {"x": hand_turned()}, **RATE)
    assert any("no still bench" in one and "span=" in one for one in found)
    # The stretch that it names is sound.
    start, stop = found[0].split("span=(")[1].split(")")[0].split(", ")
    span = (float(start), float(stop))
    assert span[1] - span[0] > 25.0
    assert said(tmp_path, {"x": hand_turned()}, **RATE, span=span) == []
    # A large bias of a gyro that is as noisy is no motion.
    cheap = bench(3, seconds=100.0, sample_rate=100.0, walk=0.3, bias=0.0)
    assert said(tmp_path, {"x": cheap.rates["x"] + 12.0}, **RATE) == []


def test_a_table_without_its_encoder_is_no_bench(tmp_path):
    steady = {**ANGLE, "table": "none", "gyros": ("x",)}
    fast = turntable(4, seconds=100.0, sample_rate=100.0, table_rate=60.0)
    found = said(tmp_path, {**fast.angles, "alpha": fast.encoder}, **steady)
    assert any("turns steadily at 34.6" in one and "table" in one for one in found)
    # Slower than the bias of the cheapest gyros, which are a hundred times as noisy.
    slow = turntable(4, seconds=100.0, sample_rate=100.0, table_rate=30.0)
    columns = {**slow.angles, "alpha": slow.encoder}
    assert any("turns steadily at 17.3" in one for one in said(tmp_path, columns, **steady))
    wrong = {**ANGLE, "table": "alpha:arcsec", "gyros": ("x",)}
    found = said(tmp_path, columns, **wrong)
    assert any(
        "the encoder that is named does not: name its column and unit" in one for one in found
    )
    # No bias of such a gyro: no figure may rest on it.
    found = [note for note in check(read(tmp_path / "run.npz", **wrong)) if note.name == "motion"]
    assert [note.level for note in found] == ["error"]
    assert said(tmp_path, columns, **{**ANGLE, "gyros": ("x",)}) == []
    swinging = turntable(4, seconds=100.0, sample_rate=100.0, motion="reversing")
    columns = {**swinging.angles, "alpha": swinging.encoder}
    assert any("no still bench" in one for one in said(tmp_path, columns, **steady))
    assert said(tmp_path, columns, **{**ANGLE, "gyros": ("x",)}) == []
    # An encoder that died is named, and is what has to be looked at.
    dead = {**columns, "alpha": np.full(10_000, 0.5)}
    (found,) = (one for one in said(tmp_path, dead, **wrong) if "no still bench" in one)
    assert "the encoder that is named does not: name its column and unit" in found


@pytest.mark.parametrize("sensors", [2, 3])
def test_sensors_that_take_turns_in_a_column_are_told_apart(tmp_path, sensors):
    made = [bench(n, seconds=100.0, sample_rate=100.0, walk=0.3, bias=0.3) for n in range(sensors)]
    mixed = np.stack([one.rates["x"] for one in made], axis=1).ravel()
    found = said(tmp_path, {"x": mixed}, **RATE)
    assert any(f"{sensors} sensors" in one and "column of its own" in one for one in found)
    assert said(tmp_path, {"x": made[0].rates["x"]}, **RATE) == []
    # Mains at a quarter of the sample rate are none.
    mains = made[0].rates["x"] + 0.3 * np.sin(50.0 * np.pi * STILL.times + 0.3)
    assert said(tmp_path, {"x": mains}, **RATE) == []


def test_sensors_of_one_bias_that_take_turns_are_told_apart_by_their_noise(tmp_path):
    quiet, loud = (
        bench(n, seconds=100.0, sample_rate=100.0, walk=walk, bias=0.0).rates["x"]
        for n, walk in ((1, 0.3), (2, 0.6))
    )
    mixed = np.stack([quiet, loud], axis=1).ravel()
    assert any("2 sensors" in one for one in said(tmp_path, {"x": mixed}, **RATE))
    # Tables that reverse at once or end faster, beside mains at a quarter of the sample rate.
    seconds = np.arange(mixed.size) / 100.0
    mains = 3e-5 * np.sin(50.0 * np.pi * seconds)
    stated = {**RATE, "table": "table:deg", "gyros": ("x",)}
    for turning in (np.where(seconds // 17.0 % 2.0, -20.0, 20.0), 5.0 + 0.1 * seconds):
        table = {"table": np.cumsum(turning) / 100.0}
        for noise, sensors in ((mixed, True), (np.concatenate([quiet, quiet[::-1]]), False)):
            found = said(tmp_path, {"x": turning + mains + 1e-4 * noise, **table}, **stated)
            assert any("2 sensors" in one for one in found) == sensors


def test_sensors_that_take_turns_on_a_table_are_told_apart(tmp_path):
    x, z = (np.diff(TURNING.angles[name], prepend=np.nan)[1:] for name in "xz")
    mixed = np.stack([x, 1.1 * z], axis=1).ravel()[: x.size]
    stated = {"kind": "increment", "unit": "arcsec", "sample_rate": 100.0, "table": "alpha:deg"}
    columns = {"x": mixed, "alpha": TURNING.encoder[1:]}
    assert any("2 sensors" in one for one in said(tmp_path, columns, **stated))
    assert said(tmp_path, {**columns, "x": x}, **stated) == []


def lost(columns: Mapping[str, Floats], samples: int = 10) -> dict[str, Floats]:
    """Rows lost at three places."""
    at = np.concatenate([[4000, 4001], [5000], 7000 + np.arange(samples - 3)])
    return {name: np.delete(one, at) for name, one in columns.items()}


@pytest.mark.parametrize(
    ("name", "modulus"),
    [("counter", None), ("seq", 256.0), ("frame_no", 1000.0), ("Sample", 65536.0)],
)
def test_samples_that_a_counter_shows_to_be_lost_are_counted(tmp_path, name, modulus):
    count = COUNT + 300.0 if modulus is None else np.mod(COUNT + 300.0, modulus)
    columns = {name: count, **STILL.rates}
    (found,) = said(tmp_path, lost(columns), **RATE)
    assert "10 samples that are not there, at 3 places, the first at 40.000 s" in found
    assert said(tmp_path, columns, **RATE) == []
    on_table = table(**{name: count})
    found = said(tmp_path, lost(on_table), **ANGLE)
    assert any("10 samples that are not there" in one for one in found)
    assert said(tmp_path, on_table, **ANGLE) == []


def test_a_column_that_is_no_counter_says_nothing(tmp_path):
    random = np.random.default_rng(9)
    for column in (
        random.integers(0, 9, COUNT.size).astype(float),
        np.repeat(np.arange(COUNT.size / 10), 10),
        20.0 + 0.001 * random.standard_normal(COUNT.size),
    ):
        assert said(tmp_path, {"count": column, **STILL.rates}, **RATE) == []


def test_stamps_may_be_left_out_knowingly(tmp_path):
    columns = {"t": STILL.times, **STILL.rates}
    assert said(tmp_path, columns, **{**RATE, "sample_rate": 500.0}, time="none") == []


@pytest.mark.parametrize(
    "number", [*range(4), *(pytest.param(n, marks=pytest.mark.statistics) for n in range(4, 12))]
)
def test_a_sound_bench_of_any_bias_is_accepted(tmp_path, number):
    made = bench(
        number + 40, seconds=60.0, sample_rate=100.0, walk=0.3, bias=0.3, low_pass=40.0, forces=True
    )
    unit = {**dict.fromkeys("xyz", "deg/s"), "accelerometers": "m/s^2"}
    columns = {"t": made.times, "count": np.mod(COUNT[:6000], 256), **made.rates, **made.forces}
    assert said(tmp_path, columns, **{**RATE, "unit": unit}, **FORCES) == []


def test_a_clock_too_coarse_for_times_names_what_reads_the_file(tmp_path):
    columns = {"t[s]": np.floor(STILL.times), **STILL.rates}
    stated = {"kind": "rate", "unit": "deg/s"}
    (found,) = said(tmp_path, columns, **stated)
    assert "time=none" in found
    rate = float(found.split("rate=")[1].split()[0])
    assert rate == pytest.approx(100.0, rel=0.02)
    # With what it names, it is read.
    assert said(tmp_path, columns, **stated, time="none", sample_rate=rate) == []


def test_a_counter_that_starts_over_is_the_one_finding_of_its_gyro(tmp_path):
    counts = {name: np.rint(TURNING.angles[name] / 0.1) for name in "xz"}
    stated = {**ANGLE, "unit": "counts", "scale": "0.1arcsec"}
    columns = table(**{name: np.mod(one, 65536.0) for name, one in counts.items()})
    del columns["y"]
    found = said(tmp_path, columns, **stated)
    assert len(found) == 2
    assert all("counter_bits=16" in one for one in found)
    notes = judged(read(tmp_path / "run.npz", **stated))
    assert {(note.name, note.level) for note in notes} == {("wraps", "error")}
    assert said(tmp_path, columns, **stated, counter_bits=16) == []


def test_a_column_of_an_accelerometer_that_is_read_as_a_gyro_is_in_doubt(tmp_path):
    noise = np.random.default_rng(3).standard_normal((2, 2000))
    path = tmp_path / "run.csv"
    lines = (f"{one:.6f},{other:.6f}" for one, other in noise.T)
    path.write_text("\n".join(["gx,ax", *lines]) + "\n")

    def doubts(**columns):
        stated = {"kind": "rate", "unit": "deg/s", "sample_rate": 100.0, "time": "none"}
        recording = read(path, Statement(**stated, columns=columns))
        return [
            note for note in recording.notes if "named as that of an accelerometer" in note.text
        ]

    (doubt,) = doubts(x="ax")
    assert (doubt.name, doubt.level, doubt.channel) == ("units", "warning", "x")
    assert not doubts(x="gx")
