"""The truth beside the recording."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sagnac.rig.sections import EncoderConfig, GyroConfig
from sagnac.rig.truth import truth_of
from tests.rig.rigs import ARCSEC, AT_REST, configured, triad, true_table_angle


def test_earth_rate_harmonic_of_the_truth():
    config = configured()
    order_one = truth_of(config).earth_rate_order_one
    assert order_one is not None
    alpha = true_table_angle(config)
    for g, gyro in enumerate(triad(config) / ARCSEC):
        terms = np.array([np.cos(alpha), np.sin(alpha), alpha, np.ones(alpha.size)]).T
        cosine, sine = np.linalg.lstsq(terms, gyro, rcond=None)[0][:2]
        name = "xyz"[g]
        assert math.hypot(cosine, sine) == pytest.approx(order_one.amplitude_arcsec[name], rel=1e-6)
        assert math.atan2(-sine, cosine) == pytest.approx(order_one.phase_rad[name], abs=1e-6)
    assert truth_of(configured(table=AT_REST)).earth_rate_order_one is None


def test_a_pair_has_means_of_squares_and_the_difference_of_ramps():
    config = configured(
        gyro=GyroConfig(
            arw_deg_per_sqrt_h=[3.0, 0.0, 4.0], rate_ramp_deg_per_h_per_h=[1.0, 0.0, -1.0]
        )
    )
    pair = truth_of(config).pairs["x-z"]
    assert pair.arw_deg_per_sqrt_h == pytest.approx(math.sqrt(12.5))
    assert pair.rate_ramp_deg_per_h_per_h == pytest.approx(math.sqrt(2.0))


def test_the_truth_names_what_the_encoder_does():
    encoder = EncoderConfig(
        lines=129_600,
        latch_jitter_s=2e-5,
        latency_s=0.002,
        latency_drift_s=0.001,
        latency_walk_s=1e-5,
        clock_ppm=20.0,
        lost_fraction=1e-3,
        missing_null_fraction=0.01,
    )
    config = configured(duration_s=7200.0, encoder=encoder)
    truth = truth_of(config).encoder
    assert truth is not None
    assert truth["step_arcsec"] == pytest.approx(10.0)
    assert truth["latch_jitter_s"] == 2e-5
    assert truth["delay_start_s"] == 0.002
    assert truth["delay_end_s"] == pytest.approx(0.003 + 7200.0 * 20e-6, rel=1e-4)
    assert truth["delay_walk_end_s"] == pytest.approx(2e-5)
    assert (truth["lost_fraction"], truth["missing_null_fraction"]) == (1e-3, 0.01)
    assert (truth["reading_rate_hz"], truth["clock_ppm"]) == (500.0, 20.0)
    held = replace(config, encoder=replace(encoder, reading_rate_hz=20.0))
    assert truth_of(held).encoder["reading_rate_hz"] == 20.0
    assert truth_of(replace(config, table=AT_REST)).encoder is None
