"""Counters, encoder and null pulse."""

import math

import numpy as np
import pytest

from sagnac.errors import RecordingError
from sagnac.formats import Statement, read
from sagnac.formats.channels import (
    extent,
    gyro_channel,
    largest_step,
    missing_filled,
    missing_marked,
    null_pulses,
    rolled_over,
    table_channel,
    table_period,
    table_unwrapped,
)
from sagnac.formats.scales import Scale
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


@pytest.mark.parametrize("bits", [16, 24, 32])
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


DEGREES = Scale(kind="angle", unit="deg", factor=np.deg2rad(1.0))


def test_a_gyro_without_a_counter_is_its_numbers_in_si():
    made = gyro_channel("x", np.array([1.0, np.nan, 3.0]), DEGREES, None)
    np.testing.assert_allclose(made.channel.values, np.deg2rad([1.0, np.nan, 3.0]))
    assert (made.channel.name, made.channel.kind, made.channel.shown_in) == ("x", "angle", "deg")
    assert made.notes == ()


def test_a_counter_that_rolls_over_is_continuous_and_no_wider_than_its_bits():
    counts = np.arange(0.0, 2e5, 5e3)
    readings = rolled_over("x", counts % 2**16, 16)
    np.testing.assert_array_equal(readings.values, counts)
    (note,) = readings.notes
    assert str(note) == "x: the 16 bit counter rolled over 2 times: unwrapped"
    assert rolled_over("x", np.arange(9.0), 16).notes == ()
    with pytest.raises(RecordingError, match="x: it spans 195000 counts, more than 16 bits hold"):
        rolled_over("x", counts, 16)


@pytest.mark.parametrize(
    ("reach", "unit", "bits", "period"),
    [
        (359.9, "deg", None, 360.0),
        (360.0, "deg", 16, 360.0),
        (5000.0, "deg", 16, math.inf),
        (50_000.0, "0.01deg", 16, 2.0**16),
        (70_000.0, "0.01deg", 16, math.inf),
        (50_000.0, "0.01deg", None, math.inf),
    ],
)
def test_where_a_table_starts_over(reach, unit, bits, period):
    scale = Scale(kind="angle", unit=unit, factor=np.deg2rad(0.01 if unit[0] == "0" else 1.0))
    assert table_period(reach, scale, bits) == pytest.approx(period)


def test_readings_off_the_path_are_marked_and_interpolated():
    path = np.arange(3000) * 0.25
    values = path % 360.0
    values[[700, 1500]] = -1.0
    notes = missing_marked(values, DEGREES)
    assert [str(n) for n in notes] == [
        "table: 2 samples off its path, all reading -1 deg: taken as missing"
    ]
    assert np.array_equal(np.flatnonzero(np.isnan(values)), [700, 1500])
    notes = missing_filled(values, 360.0, DEGREES)
    assert "2 missing samples, at most 1 in a row, interpolated" in notes[0].text
    np.testing.assert_allclose(values, path % 360.0, atol=1e-9)


def test_a_table_that_moves_far_between_samples_is_in_doubt():
    quiet = table_unwrapped(np.arange(100) * 20.0 % 360.0, 360.0)
    assert [note.level for note in quiet.notes] == ["remark"]
    np.testing.assert_allclose(quiet.values, np.arange(100) * 20.0)
    fast = table_unwrapped(np.arange(100) * 170.0 % 360.0, 360.0)
    assert fast.notes[-1].level == "warning"
    assert "0.47 of its range between samples" in fast.notes[-1].text
    running = np.arange(100) * 170.0
    assert table_unwrapped(running, math.inf).notes == ()


def test_a_table_goes_through_all_of_it():
    path = np.arange(3000) * 0.25
    made = table_channel(path % 360.0, DEGREES, None)
    np.testing.assert_allclose(made.channel.values, np.deg2rad(path), atol=1e-9)
    assert [str(n) for n in made.notes] == ["table: unwrapped where it starts over, 2 times"]


def test_extent_and_steps_pass_over_what_is_not_finite():
    values = np.array([1.0, np.nan, 5.0, 4.0, np.inf, -2.0])
    assert extent(values) == 7.0
    assert extent(np.full(3, np.nan)) == extent(np.empty(0)) == 0.0
    assert largest_step(np.array([1.0, np.nan, 5.0, 2.5])) == 2.5
    assert largest_step(np.array([np.nan, np.nan])) == largest_step(np.empty(0)) == 0.0


def test_pulses_rise_once():
    pulses = null_pulses("p", np.array([0.0, 1.0, 1.0, 0.0, 1.0]))
    np.testing.assert_array_equal(pulses.rising, [False, True, False, False, True])
    assert [str(n) for n in pulses.notes] == [
        "null_pulse: stays up for more than a sample; its first is taken"
    ]
    assert null_pulses("p", np.array([0.0, 5.0, 0.0])).notes == ()
    for wrong in ([0.0, 1.0, 2.0], [0.0, np.nan]):
        with pytest.raises(RecordingError, match="column p takes more than two values"):
            null_pulses("p", np.array(wrong))
