"""The encoder reads what it says, and the null pulse marks each turn."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sagnac.formats import read
from sagnac.rig.encoder import Encoder, NullPulse, within_turn
from sagnac.rig.sections import EncoderConfig, TableConfig
from sagnac.rig.simulate import blocks, simulate, write
from sagnac.rig.table import RandomStreams
from sagnac.table.frames import table_to_gyro_matrix
from tests.rig.rigs import ARCSEC, AT_REST, DEG, configured, from_first, geometry, true_table_angle


def test_encoder_reads_the_true_angle_with_its_error():
    config = configured(
        table=TableConfig(jitter_rms_deg_per_s=0.01),
        encoder=EncoderConfig(periodic_error=((1.0, 1.0), (3.0, 0.4))),
    )
    alpha = true_table_angle(config)
    table = simulate(config).recording.table
    assert table is not None
    line = 2 * math.pi / 7_200_000
    np.testing.assert_allclose(table.values / line, np.rint(table.values / line), atol=1e-6)
    error = (table.values - alpha) / ARCSEC
    terms = np.array([f(k * alpha) for k in (1, 3) for f in (np.cos, np.sin)]).T
    fitted, *_ = np.linalg.lstsq(terms, error, rcond=None)
    assert math.hypot(*fitted[:2]) == pytest.approx(1.0, abs=0.01)
    assert math.hypot(*fitted[2:]) == pytest.approx(0.4, abs=0.01)
    left = error - terms @ fitted
    assert np.abs(left).max() < 0.5 * 0.18 + 0.01
    assert left.std() == pytest.approx(0.18 / math.sqrt(12), rel=0.03)


@pytest.mark.parametrize("rate", [40.0, -40.0, 0.05])
def test_null_pulse_marks_each_turn(rate):
    start = -0.25 if abs(rate) < 1 else 100.0
    duration = 20.0 if abs(rate) < 1 else 95.0
    config = configured(
        duration_s=duration,
        table=TableConfig(rate_deg_per_s=rate, start_deg=start, jitter_rms_deg_per_s=1e-4),
        encoder=EncoderConfig(null_accuracy_arcsec=2.0),
    )
    recording = simulate(config).recording
    assert recording.null_pulse is not None
    alpha = true_table_angle(config)
    pulses = np.flatnonzero(recording.null_pulse)
    nulls = 2 * math.pi * np.arange(-20, 20)
    passed = np.sum((nulls > alpha.min()) & (nulls < alpha.max()))
    assert pulses.size == passed > 0
    off = (alpha[pulses] - 2 * math.pi * np.rint(alpha[pulses] / (2 * math.pi))) / ARCSEC
    per_sample = abs(rate) * 3600 / 500.0
    assert np.all(np.abs(off) < per_sample + 5 * 2.0)


def test_null_errors_have_the_accuracy_stated():
    """At a slow crossing per sample the pulse is off by its own error: 2 arcsec rms."""
    table = TableConfig(rate_deg_per_s=360.0, reversal_interval_s=0.0)
    config = configured(
        duration_s=400.0,
        sample_rate_hz=2000.0,
        table=table,
        encoder=EncoderConfig(null_accuracy_arcsec=600.0),
    )
    recording = simulate(config).recording
    assert recording.null_pulse is not None
    alpha = true_table_angle(config)[recording.null_pulse]
    off = (alpha - 2 * math.pi * np.rint(alpha / (2 * math.pi))) / ARCSEC
    per_sample = 360.0 * 3600 / 2000.0
    assert off.mean() == pytest.approx(per_sample / 2, abs=4 * 600 / math.sqrt(400))
    expected = math.hypot(600.0, per_sample / math.sqrt(12))
    assert off.std() == pytest.approx(expected, rel=4 / math.sqrt(800))


def test_a_table_at_rest_has_no_encoder_columns():
    recording = simulate(configured(table=AT_REST)).recording
    assert recording.table is None
    assert recording.null_pulse is None
    # Earth rate alone: C_b^s eta t.
    shares, eta = geometry(configured())
    rate = table_to_gyro_matrix(*shares) @ eta
    expected = rate[:, None] * np.arange(recording.samples) / 500.0
    measured = np.array([gyro.values for gyro in recording.gyros])
    np.testing.assert_allclose(from_first(measured), expected, atol=1e-13)


def test_an_encoder_without_error_rounds_to_its_lines():
    config = configured(duration_s=1.0, encoder=EncoderConfig(lines=4))
    encoder = Encoder(config, np.zeros_like, RandomStreams(0))
    quarter = math.pi / 2.0
    np.testing.assert_allclose(
        encoder.read(0, np.array([0.1, 0.8, 7.0]) * quarter), np.array([0, 1, 7]) * quarter
    )
    reading = np.array([-1.0, 3.0, 4.0, 9.0]) * quarter
    np.testing.assert_allclose(within_turn(reading, 4), np.array([3, 3, 0, 1]) * quarter)


def test_jitter_about_a_null_fires_it_once():
    config = EncoderConfig(null_accuracy_arcsec=600.0)
    pulse = NullPulse(config, -0.1, 1.0, RandomStreams(0))
    assert pulse.errors.size == 1024 + 2
    there = np.concatenate(
        [np.linspace(-0.1, 0.02, 13), [-0.01, 0.01] * 5, np.linspace(0.02, 0.2, 5)]
    )
    fired = np.concatenate([pulse.advance(part) for part in np.split(there, [5, 14])])
    assert fired.sum() == 1


# --- when readings are taken ------------------------------------------------------------------

_FINE = 2**31  # lines whose step, 0.0006 arcsec, hides nothing


def table_of(encoder, rate=40.0, **changes):
    """Readings of an encoder without steps on a table that turns evenly."""
    config = configured(
        table=TableConfig(rate_deg_per_s=rate), encoder=replace(encoder, lines=_FINE), **changes
    )
    return readings_of(config), np.arange(config.samples) / 500.0


def readings_of(config):
    """Readings as they are taken, before anything is made of them."""
    return np.concatenate([columns["table"] for columns, _ in blocks(config)])


@pytest.mark.parametrize(
    ("keys", "delay"),
    [
        ({"latency_s": 0.0052}, lambda t: 0.0052 + 0 * t),
        ({"latency_drift_s": 0.005}, lambda t: 0.005 * t / 40.0),
        ({"latency_s": 0.01, "latency_drift_s": -0.004}, lambda t: 0.01 - 1e-4 * t),
        ({"clock_ppm": 1000.0}, lambda t: t - t / 1.001),
        ({"latency_s": 0.1, "clock_ppm": -500.0}, lambda t: 0.1 + t - t / 0.9995),
    ],
    ids=["latency", "drift", "drift back", "fast clock", "slow clock"],
)
@pytest.mark.parametrize("rate", [40.0, -15.0])
def test_a_late_reading_is_the_angle_before(keys, delay, rate):
    table, time = table_of(EncoderConfig(**keys), rate)
    expected = rate * DEG * (time - delay(time))
    assert np.abs(table - expected).max() < 0.001 * ARCSEC


def test_a_late_reading_follows_ripple_and_ramps():
    """Beside the motion of the same rig on a grid eight times finer."""
    table = TableConfig(
        rate_deg_per_s=30.0,
        ripple=((36.0, 0.01),),
        profile=((0.0, 30.0), (5.0, 30.0), (6.0, -30.0), (12.0, -30.0)),
    )
    encoder = EncoderConfig(lines=_FINE, latency_s=0.0105)
    config = configured(duration_s=12.0, table=table, encoder=encoder)
    late = simulate(config).recording.table.values
    fine = true_table_angle(replace(config, sample_rate_hz=4000.0, encoder=EncoderConfig()))
    # 10.5 ms are 42 of the finer samples.
    expected = fine[np.arange(8, config.samples) * 8 - 42]
    off = np.abs(late[8:] - expected) / ARCSEC
    # A parabola over a corner of the ramps, 60 deg/s^2, is off by up to an eighth of 0.86 arcsec.
    corners = off > 0.005
    assert corners.sum() <= 4
    assert off.max() < 0.11


def test_a_delay_walks_by_what_is_stated():
    """Steps of the delay over 0.1 s scatter by the walk's rms after half an hour, by the root."""
    table, time = table_of(EncoderConfig(latency_walk_s=1e-3), duration_s=400.0)
    delay = time - table / (40.0 * DEG)
    # A reading's own step hides 1e-10 s beside 7e-6 s; 4000 steps scatter by 1.1 %.
    steps = np.diff(delay[::50])
    assert steps.std() == pytest.approx(1e-3 * math.sqrt(0.1 / 1800.0), rel=0.05)
    assert abs(np.corrcoef(steps[:-1], steps[1:])[0, 1]) < 0.05


@pytest.mark.parametrize("reading_rate", [20.0, 30.0, 100.0, 499.0, 700.0])
def test_readings_are_held_between_their_own_instants(reading_rate):
    table, time = table_of(EncoderConfig(reading_rate_hz=reading_rate, latency_s=0.003))
    # In whole numbers: the newest reading k/rate at or before sample n/500.
    number = np.arange(time.size) * int(reading_rate) // 500
    expected = 40.0 * DEG * (number / reading_rate - 0.003)
    assert np.abs(table - expected).max() < 0.001 * ARCSEC


def test_lost_readings_repeat_the_one_before():
    encoder = EncoderConfig(lost_fraction=0.02)
    whole, _ = table_of(EncoderConfig(), duration_s=100.0)
    table, _ = table_of(encoder, duration_s=100.0)
    lost = table != whole
    # Binomial of 50,000: four standard deviations are 0.25 %.
    assert lost.mean() == pytest.approx(0.02, abs=0.0025)
    np.testing.assert_array_equal(table[lost], table[np.flatnonzero(lost) - 1])
    # Readings that are held are lost as a whole.
    held, _ = table_of(EncoderConfig(lost_fraction=0.2, reading_rate_hz=50.0), duration_s=100.0)
    kept, _ = table_of(EncoderConfig(reading_rate_hz=50.0), duration_s=100.0)
    lost = (held != kept).reshape(-1, 10)
    assert np.all(lost.all(axis=1) | ~lost.any(axis=1))
    assert lost[:, 0].mean() == pytest.approx(0.2, abs=0.025)


def test_null_pulses_are_missing():
    config = configured(
        duration_s=400.0, sample_rate_hz=50.0, table=TableConfig(rate_deg_per_s=360)
    )
    every = np.flatnonzero(simulate(config).recording.null_pulse)
    some = replace(config, encoder=EncoderConfig(missing_null_fraction=0.3))
    left = np.flatnonzero(simulate(some).recording.null_pulse)
    assert every.size in (399, 400)
    assert set(left) < set(every)
    # Binomial of 400: four standard deviations are 37.
    assert abs(left.size - 280) < 37


@pytest.mark.parametrize("block_samples", [1, 77, 1000])
def test_late_and_held_readings_do_not_depend_on_the_blocks(block_samples):
    encoder = EncoderConfig(
        latch_jitter_s=1e-4,
        latency_s=0.05,
        latency_drift_s=0.01,
        latency_walk_s=1e-3,
        clock_ppm=50.0,
        reading_rate_hz=70.0,
        lost_fraction=0.1,
        missing_null_fraction=0.5,
    )
    table = TableConfig(rate_deg_per_s=300.0, jitter_rms_deg_per_s=0.1)
    config = configured(duration_s=2.5, encoder=encoder, table=table)
    parts = [columns for columns, _ in blocks(config, block_samples)]
    joined = np.concatenate([part["table"] for part in parts])
    np.testing.assert_array_equal(joined, readings_of(config))
    pulses = np.concatenate([part["null_pulse"] for part in parts])
    np.testing.assert_array_equal(pulses, simulate(config).recording.null_pulse)


@pytest.mark.parametrize(
    "encoder",
    [
        EncoderConfig(reading_rate_hz=30.0, lost_fraction=0.005),
        EncoderConfig(lost_fraction=0.01),
        EncoderConfig(),
    ],
    ids=["held", "lost", "sound"],
)
def test_a_table_in_memory_is_what_a_file_of_it_gives(tmp_path, encoder):
    config = configured(duration_s=60.0, table=TableConfig(rate_deg_per_s=40.0), encoder=encoder)
    path, _ = write(config, tmp_path / "rig.parquet")
    in_file, in_memory = read(path), simulate(config).recording
    turns = np.rint((in_file.table.values[0] - in_memory.table.values[0]) / (2.0 * math.pi))
    off = in_file.table.values - in_memory.table.values - 2.0 * math.pi * turns
    assert np.abs(off).max() < 1e-9
    said = [note.text.split(" (")[0] for note in in_file.notes if "starts over" not in note.text]
    assert [note.text.split(" (")[0] for note in in_memory.notes] == said
    assert bool(said) == (encoder != EncoderConfig())


def test_another_key_of_the_encoder_leaves_the_latch_as_it_was():
    """Each draws from a stream of its own: with and without losses the jitter is the same."""
    jittered, _ = table_of(EncoderConfig(latch_jitter_s=1e-4))
    both, _ = table_of(EncoderConfig(latch_jitter_s=1e-4, lost_fraction=0.1))
    assert 0.88 < np.mean(jittered == both) < 0.92
    late, _ = table_of(EncoderConfig(latch_jitter_s=1e-4, latency_s=0.004))
    np.testing.assert_allclose(jittered - late, 40.0 * DEG * 0.004, atol=0.002 * ARCSEC)
