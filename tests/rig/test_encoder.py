"""The encoder reads what it says, and the null pulse marks each turn."""

import math

import numpy as np
import pytest

from sagnac.rig.encoder import Encoder, NullPulse, within_turn
from sagnac.rig.sections import EncoderConfig, TableConfig
from sagnac.rig.simulate import simulate
from sagnac.rig.streams import random_streams
from sagnac.table.frames import table_to_gyro_matrix
from tests.rig.rigs import ARCSEC, AT_REST, configured, from_first, geometry, true_table_angle


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
    encoder = Encoder.drawn(EncoderConfig(lines=4), 0.0, 0.01, random_streams(0))
    quarter = math.pi / 2.0
    np.testing.assert_allclose(
        encoder.read(np.array([0.1, 0.8, 7.0]) * quarter), np.array([0, 1, 7]) * quarter
    )
    reading = np.array([-1.0, 3.0, 4.0, 9.0]) * quarter
    np.testing.assert_allclose(within_turn(reading, 4), np.array([3, 3, 0, 1]) * quarter)


def test_jitter_about_a_null_fires_it_once():
    config = EncoderConfig(null_accuracy_arcsec=600.0)
    pulse = NullPulse.drawn(config, -0.1, 1.0, np.random.default_rng(0))
    assert pulse.errors.size == 1024 + 2
    there = np.concatenate(
        [np.linspace(-0.1, 0.02, 13), [-0.01, 0.01] * 5, np.linspace(0.02, 0.2, 5)]
    )
    fired = np.concatenate([pulse.advance(part) for part in np.split(there, [5, 14])])
    assert fired.sum() == 1
