"""Bands of vibration."""

import numpy as np
import pytest
from benchmarks.gallery import Gyro, shaken

from sagnac.lines.candidates import bands_of_peaks, crowded_bands, plain_peaks
from sagnac.lines.components import components_of
from sagnac.lines.detection import Peaks, joined_bands, wandering_bands
from sagnac.lines.search import remove_lines

BINS = 50_001


def peaks_at(frequencies):
    """Peaks at frequencies, cycles a sample."""
    place = np.asarray(frequencies) * 4.0 * (BINS - 1)
    return Peaks(place=place, height=np.ones(place.size))


def bands_of(frequencies):
    return crowded_bands(peaks_at(frequencies), components_of(2 * BINS), BINS)


def test_leakage_of_a_high_peak_is_no_peak():
    peaks = Peaks(place=np.array([1000.0, 1010.0, 3000.0]), height=np.array([1e4, 5.0, 5.0]))
    assert plain_peaks(peaks).place.tolist() == [1000.0, 3000.0]


def test_peaks_that_crowd_are_a_band():
    (band,) = bands_of(np.linspace(0.106, 0.112, 60))
    assert band[0] <= 0.106
    assert band[1] >= 0.112
    assert band[1] / band[0] < 1.2


def test_few_lines_are_no_band():
    assert bands_of(0.01 * np.arange(1, 40)) == ()


def test_peaks_about_one_line_that_drifts_are_no_band():
    assert bands_of(0.1 + np.linspace(-4e-4, 4e-4, 45)) == ()


def test_lines_that_drift_side_by_side_are_a_band():
    near = tuple((0.1 + 1e-4 * k, 0.1001 + 1e-4 * k) for k in range(3))
    (band,) = wandering_bands((*near, (0.3, 0.301)))
    assert band[0] < 0.1
    assert 0.1003 < band[1] < 0.11
    assert wandering_bands(((0.1, 0.1001), (0.11, 0.1101), (0.3, 0.301))) == ()


def test_bands_that_touch_are_one():
    assert joined_bands(((0.2, 0.3), (0.1, 0.2))) == ((0.1, 0.3),)


def test_what_stands_in_the_end_is_of_bands():
    (band,) = bands_of_peaks(peaks_at([0.2]), BINS)
    assert band[0] < 0.2 < band[1]


def test_a_motor_shaft_is_a_band_with_a_name():
    gyro = shaken(
        np.random.default_rng(3),
        60_000,
        100.0,
        gyro=Gyro(),
        first=1.7,
        count=28,
        amplitude=20.0,
        wander=0.01,
    )
    angle = np.concatenate([[0.0], np.cumsum(gyro.increments)])
    removal = remove_lines(angle, None, 100.0, channel="x")
    assert removal.unfinished is None
    assert any("vibration at" in note.text for note in removal.notes)
    assert any(low < 17.0 < high for low, high in removal.masked)
    assert removal.residual.size == angle.size


def test_bands_and_peaks_are_of_one_unit():
    (band,) = bands_of_peaks(peaks_at([0.25]), BINS)
    assert np.sqrt(band[0] * band[1]) == pytest.approx(0.25)
