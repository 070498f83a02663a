"""What two gyros share."""

import numpy as np
from benchmarks.gallery import Gyro, common_pair

from sagnac.noise.cross_spectra import band_cells

RATE = 100.0


def correlation(increments, **more):
    _, matrices = band_cells(increments, sample_rate=RATE, band_hz=(0.5, 40.0), **more)
    matrix = matrices.mean(axis=2)
    return matrix[0, 1] / np.sqrt(matrix[0, 0] * matrix[1, 1])


def test_common_part_is_seen_by_the_cross_spectrum():
    one, other = common_pair(np.random.default_rng(17), 20_000, RATE, gyro=Gyro(), share=0.4)
    both = np.stack([one.increments, other.increments])
    # White noise: the correlation of the samples is that of every frequency.
    assert abs(correlation(both) - np.corrcoef(both)[0, 1]) < 0.02
    assert abs(correlation(both) - 0.4) < 0.03


def test_a_line_on_both_is_left_out():
    one, other = common_pair(np.random.default_rng(25), 20_000, RATE, gyro=Gyro(), share=0.0)
    line = 0.5 * np.sin(2.0 * np.pi * 7.3 * np.arange(20_000) / RATE)
    both = np.stack([one.increments + line, other.increments + line])
    assert abs(correlation(both, masked=[(7.29, 7.31)])) < 0.05
