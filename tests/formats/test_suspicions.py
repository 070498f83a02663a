"""Statements that a file's numbers speak against."""

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from sagnac.formats import Statement, read
from sagnac.formats.source import column
from sagnac.formats.suspicions import (
    counter_notes,
    increment_notes,
    rate_notes,
    roll_overs,
    stamp_unit_notes,
    table_counter_notes,
)
from tests.formats.examples import save, walk


@pytest.mark.parametrize("unit", ["deg/s", "°/s", "rad/s"])
def test_raw_counts_that_are_called_a_rate_are_told(tmp_path, unit):
    """Counts of 131 to 1 deg/s gave 131 times N without a word, where 0.15 deg/sqrt(h) is true."""
    random = np.random.default_rng(4)
    rates = 0.05 + 0.15 / 60.0 * 10.0 * random.standard_normal(20_000)
    counts = np.rint(131.0 * rates)
    (note,) = counter_notes("x", counts, "rate", unit)
    assert (note.name, note.level) == ("units", "warning")
    assert "if they are counts, state {unit counts} and {scale}" in note.text
    np.save(tmp_path / "run.npy", counts)
    stated = Statement(columns={"x": "1"}, kind="rate", unit=unit, sample_rate=100.0)
    assert note in read(tmp_path / "run.npy", stated).notes
    # Rates with decimals, whole ones in small units, counts with a size, and a dead channel.
    assert counter_notes("x", np.round(rates, 3), "rate", unit) == ()
    for fine in ("deg/h", "mdeg/s", "arcsec/s", "0.0076deg/s"):
        assert counter_notes("x", counts, "rate", fine) == ()
    assert counter_notes("x", 0.0 * counts, "rate", unit) == ()


@pytest.mark.parametrize("bits", [14, 16, 24, 32])
@pytest.mark.parametrize("start", [0, 1])
def test_a_counter_that_rolls_over_is_named(bits, start):
    angle = np.rint(np.arange(20_000) * 2.0**bits / 3000 + walk(samples=20_000))
    raw = angle % 2**bits - start * 2 ** (bits - 1)
    (note,) = counter_notes("x", raw, "angle", "arcsec")
    assert note.level == "warning"
    wraps = np.count_nonzero(np.diff(raw) < 0 if bits > 16 else np.abs(np.diff(raw)) > 2**15)
    assert f"a {bits} bit counter" in note.text
    assert f"{{counter-bits {bits}}}" in note.text
    if bits > 16:
        assert f"{wraps} times" in note.text
    assert counter_notes("x", angle, "angle", "arcsec") == ()


@pytest.mark.parametrize("modulus", [36_000, 360_000])
def test_a_counter_of_any_modulus_is_named(modulus):
    angle = np.rint(np.arange(20_000) * modulus / 3000 + walk(samples=20_000))
    (note,) = counter_notes("x", angle % modulus, "angle", "arcsec")
    assert f"about {modulus:.7g} counts" in note.text
    assert counter_notes("x", angle, "angle", "arcsec") == ()
    assert counter_notes("x", angle % modulus, "rate", "deg/h") == ()


def test_noise_that_fills_its_range_is_no_counter():
    noise = np.random.default_rng(2).integers(0, 65536, 5000).astype(float)
    assert counter_notes("x", noise, "angle", "arcsec") == ()
    assert roll_overs(np.zeros(10), 0.0) is None


def test_an_encoder_in_counts_that_is_called_degrees():
    counts = (np.arange(5000) * 23.0) % 16384
    (note,) = table_counter_notes("enc", counts, "deg")
    assert "starts over at 16384 deg" in note.text
    assert f"{{table enc:{360 / 16384:.12g}deg}}" in note.text
    assert table_counter_notes("enc", np.arange(5000.0) % 360.0, "deg") == ()
    assert table_counter_notes("enc", np.arange(5000.0), "deg") == ()


@pytest.mark.parametrize("bits", [20, 24])
def test_an_encoder_whose_counter_starts_over_beside_a_turn(bits):
    counts = (np.arange(5000) * 2.0**bits / 700.0).round() % 2**bits
    (note,) = table_counter_notes("enc", counts, "arcsec")
    assert note.text.endswith(f"if arcsec is right, state {{counter-bits {bits}}}")
    # A turn is a turn, whatever number of arc seconds the readings reach; a swing leaps nowhere.
    assert table_counter_notes("enc", (np.arange(5000) * 7001.0) % 1_296_000, "arcsec") == ()
    assert table_counter_notes("enc", np.rint(5e5 * np.sin(np.arange(5e3) / 300)), "arcsec") == ()


@pytest.mark.parametrize(("unit", "likely"), [("ns", "ns"), ("us", "us"), ("ms", "ms")])
def test_stamps_in_a_small_unit_called_seconds(unit, likely):
    rate = 20.0 * {"ns": 1e-9, "us": 1e-6, "ms": 1e-3}[unit]
    notes = stamp_unit_notes(column("t[s]"), rate)
    if unit == "ms":
        # A sample every 50 s may be meant.
        assert notes == ()
        return
    assert f"{{time t:{likely}}}" in notes[0].text
    assert "20 Hz" in notes[0].text
    assert stamp_unit_notes(column(f"t[{unit}]"), 20.0) == ()


def test_a_rate_called_an_angle_is_noticed_and_an_angle_is_not():
    generator = np.random.default_rng(4)
    noise = generator.normal(size=20_000)
    (note,) = rate_notes("x", 3.0 + noise)
    assert "{kind rate}" in note.text
    assert rate_notes("x", np.cumsum(noise)) == ()
    seconds = np.arange(20_000) / 100.0
    # A still ring laser: its quantization is white, and the Earth adds up.
    assert rate_notes("x", 15.0 * seconds + noise) == ()
    # A table that swings to and fro.
    assert rate_notes("x", 90.0 * np.sin(seconds) + 0.01 * noise) == ()


@pytest.mark.parametrize("corner", [10.0, 40.0])
def test_a_rate_behind_a_low_pass_is_none_the_less_a_rate(corner):
    """Samples at 200 Hz that go on from one to the next, and yet do not add up."""
    generator = np.random.default_rng(5)
    rate = lfilter(*butter(2, corner / 100.0), generator.normal(size=120_000))
    (note,) = rate_notes("x", 3.0 + rate)
    assert "{kind rate}" in note.text
    assert rate_notes("x", np.cumsum(rate)) == ()
    seconds = np.arange(rate.size) / 200.0
    for swing in (np.sin(seconds), np.sin(20.0 * seconds), np.sin(100.0 * seconds)):
        assert rate_notes("x", 90.0 * swing + 1e-3 * np.cumsum(rate)) == ()


@pytest.mark.parametrize("corner", [None, 40.0])
def test_rates_called_increments_are_louder_than_any_gyro(corner):
    """A sensor of 0.2 deg/sqrt(h) at 200 Hz; a loud one of 6 deg/sqrt(h) in increments."""
    walk = np.deg2rad(0.2) / 60.0
    rate = walk * np.sqrt(200.0) * np.random.default_rng(6).normal(size=120_000)
    if corner is not None:
        rate = lfilter(*butter(2, corner / 100.0), rate)
    (note,) = increment_notes("x", rate, 200.0)
    said = float(note.text.partition("would be ")[2].partition(" ")[0])
    assert said == pytest.approx(0.2 * 200.0, rel=0.1)
    assert increment_notes("x", 30.0 * rate / 200.0, 200.0) == ()


def test_what_is_noticed_stands_in_the_recording(tmp_path):
    counter = np.rint(np.arange(3000) * 97.0) % 65536
    epoch = 1_700_000_000_000_000_000
    rows = "".join(f"{epoch + 10**7 * n},{count:.0f}\n" for n, count in enumerate(counter))
    path = save(tmp_path / "run.csv", "t,x\n" + rows)
    stated = Statement(kind="angle", unit="counts", scale="1arcsec", time="t:s")
    notes = [str(note) for note in read(path, stated).notes]
    assert any("16 bit counter" in note for note in notes)
    assert any("in ns they would be those of 100 Hz" in note for note in notes)
    stated = Statement(kind="angle", unit="counts", scale="1arcsec", sample_rate=100.0)
    assert any("takes it" in str(note) for note in read(path, stated).notes)
