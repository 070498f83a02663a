"""What two gyros share."""

import math

import numpy as np
import pytest

from sagnac.coefficients.common_noise import band_moments, common_noise
from sagnac.rig.gallery import Gyro, common_pair

RATE = 100.0


def test_common_part_is_seen_by_the_cross_spectrum():
    one, other = common_pair(np.random.default_rng(17), 20_000, RATE, gyro=Gyro(), share=0.4)
    moments = band_moments(
        np.stack([one.increments, other.increments]), sample_rate=RATE, band_hz=(0.5, 40.0)
    )
    found = common_noise(moments)
    assert found.present
    assert found.low <= 0.4 <= found.high
    difference = (one.increments - other.increments).std() * math.sqrt(RATE / 2.0)
    assert found.differenced == pytest.approx(difference, rel=0.03)


def test_a_line_on_both_is_left_out():
    one, other = common_pair(np.random.default_rng(25), 20_000, RATE, gyro=Gyro(), share=0.0)
    line = 0.5 * np.sin(2.0 * np.pi * 7.3 * np.arange(20_000) / RATE)
    both = np.stack([one.increments + line, other.increments + line])
    moments = band_moments(both, sample_rate=RATE, band_hz=(0.5, 40.0), masked=[(7.29, 7.31)])
    assert abs(common_noise(moments).correlation) < 0.05
