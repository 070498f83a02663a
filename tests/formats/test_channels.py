"""Counters, encoder and null pulse."""

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.formats import Statement, read
from sagnac.recording.columns import gyro_of
from sagnac.recording.encoder_readings import table_of_readings
from tests.formats.examples import (
    ARCSECOND,
    SAMPLES,
    refused,
    save,
    text,
    walk,
)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_encoder_is_unwrapped_either_way_and_reversing(tmp_path, sign):
    angle = sign * 900.0 * np.sin(np.linspace(0.0, 6.0, SAMPLES))
    content = text("time[s],x[deg],table[deg]", np.arange(SAMPLES) / 100, walk(), angle % 360.0)
    table = read(save(tmp_path / "run.csv", content), Statement(kind="angle")).table
    np.testing.assert_allclose(np.rad2deg(table.values - table.values[0]), angle, atol=1e-9)


@pytest.mark.parametrize("bits", [14, 16, 24, 32])
def test_counters_that_roll_over(tmp_path, bits):
    counts = np.rint(np.linspace(0.0, 5.3 * 2**bits, SAMPLES)) + np.rint(10.0 * walk())
    rolled = (counts + 2 ** (bits - 1)) % 2**bits - 2 ** (bits - 1)
    path = save(tmp_path / "run.csv", text("time[s],x", np.arange(SAMPLES) / 100, rolled))
    stated = Statement(kind="angle", unit="counts", scale="1arcsec", counter_bits=bits)
    values = read(path, stated).gyros[0].values / ARCSECOND
    np.testing.assert_allclose(values - values[0], counts - counts[0], atol=1e-3)
    refused(
        path,
        "x:",
        "--counter-bits",
        statement=Statement(kind="increment", unit="counts", scale="1arcsec", counter_bits=bits),
    )


@pytest.mark.parametrize("bits", [20, 24])
def test_a_counter_of_the_encoder_beside_gyros_that_are_none(tmp_path, bits):
    turned = np.rint(np.linspace(0.0, 5.3 * 2**bits, SAMPLES))
    content = text("time[s],x[deg/s],table", np.arange(SAMPLES) / 100, walk(), turned % 2**bits)
    stated = Statement(kind="rate", table="table:arcsec", counter_bits=bits)
    table = read(save(tmp_path / "run.csv", content), stated, verify=False).table
    np.testing.assert_allclose((table.values - table.values[0]) / ARCSECOND, turned, atol=1e-3)


def test_a_counter_of_any_modulus(tmp_path):
    counts = np.rint(np.linspace(0.0, 5.3 * 36_000, SAMPLES)) + np.rint(10.0 * walk())
    content = text("time[s],x", np.arange(SAMPLES) / 100, counts % 36_000)
    path = save(tmp_path / "run.csv", content)
    stated = {"kind": "angle", "unit": "counts", "scale": "36arcsec"}
    (warning,) = [note for note in read(path, **stated, verify=False).notes if "leaps" in note.text]
    assert "{counter-period 36000}" in warning.text
    recording = read(path, **stated, counter_period=36_000)
    values = recording.gyros[0].values / (36.0 * ARCSECOND)
    np.testing.assert_allclose(values - values[0], counts - counts[0], atol=1e-3)
    (said,) = [str(note) for note in recording.notes if "rolled over" in note.text]
    assert said == "x: the counter of 36000 rolled over 5 times: unwrapped"
    (tmp_path / "run.csv.toml").write_text("counter_period = 36000\n")
    beside = read(path, **stated).gyros[0].values
    np.testing.assert_array_equal(beside, recording.gyros[0].values)
    with pytest.raises(ValueError, match="both given"):
        read(path, **stated, counter_period=36_000, counter_bits=16)
    for wrong in (1, 0.5, float("nan"), True, "1e4"):
        with pytest.raises(ValueError, match="counter_period is"):
            read(path, **stated, counter_period=wrong)


def test_null_pulse_is_its_first_sample(tmp_path):
    pulse = (np.arange(SAMPLES) % 100 >= 97).astype(float)
    content = text("time[s],x[deg],null", np.arange(SAMPLES) / 100, walk(), pulse)
    path = save(tmp_path / "run.csv", content)
    recording = read(path, Statement(kind="angle", null_pulse="null"))
    np.testing.assert_array_equal(np.flatnonzero(recording.null_pulse), np.arange(97, 600, 100))
    stated = Statement(kind="angle", null_pulse="x")
    refused(path, "null_pulse", "--null-pulse", statement=Statement(kind="angle", null_pulse="off"))
    with pytest.raises(RecordingError, match="two channels"):
        read(path, stated)


def test_a_gyro_without_a_counter_is_its_numbers_in_si():
    raw = np.array([1.0, np.nan, 3.0])
    made = gyro_of("x", raw, kind="angle", unit="deg", out=raw)
    np.testing.assert_allclose(made.channel.values, np.deg2rad([1.0, np.nan, 3.0]))
    assert made.channel.values is raw
    assert (made.channel.name, made.channel.kind, made.channel.shown_in) == ("x", "angle", "deg")
    assert made.notes == ()


COUNTS = {"kind": "angle", "unit": "2rad", "period": 2.0**16}


def test_a_counter_that_rolls_over_is_continuous_and_no_wider_than_its_bits():
    counts = np.arange(0.0, 2e5, 5e3)
    made = gyro_of("x", counts % 2**16, **COUNTS)
    np.testing.assert_array_equal(made.channel.values, 2.0 * counts)
    (note,) = made.notes
    assert str(note) == "x: the 16 bit counter rolled over 2 times: unwrapped"
    assert gyro_of("x", np.arange(9.0), **COUNTS).notes == ()
    with pytest.raises(RecordingError, match="spans 195000, more than a counter of 65536 holds"):
        gyro_of("x", counts, **COUNTS)


@pytest.mark.parametrize(
    ("reach", "unit", "bits", "period"),
    [
        (359.9, "deg", None, 360.0),
        (360.0, "deg", 16, 360.0),
        (5000.0, "deg", 16, None),
        (50_000.0, "0.01deg", 16, 2.0**16),
        (70_000.0, "0.01deg", 16, None),
        (50_000.0, "0.01deg", None, None),
    ],
)
def test_where_a_table_starts_over(reach, unit, bits, period):
    size = 0.01 if unit[0] == "0" else 1.0
    readings = np.concatenate([np.linspace(0.0, reach, 2000), np.linspace(0.0, 0.1 * reach, 200)])
    made = table_of_readings(readings.copy(), unit, counter_period=bits and 2.0**bits)
    angle = np.degrees(made.channel.values) / size
    later = readings[2000:] + (period or 0.0)
    np.testing.assert_allclose(angle[2000:], later, rtol=1e-9, atol=1e-9)


def test_readings_off_the_path_are_noted_in_the_unit_as_stated():
    path = np.arange(3000) * 0.25
    readings = path % 360.0
    readings[[700, 1500]] = -1.0
    made = table_of_readings(readings, "1 degree")
    off, filled, _ = (str(note) for note in made.notes)
    assert off == "table: 2 samples off its path, all reading -1 1 degree: taken as missing"
    assert "2 missing samples, at most 1 in a row, interpolated" in filled
    np.testing.assert_allclose(made.channel.values, np.deg2rad(path), atol=1e-9)
