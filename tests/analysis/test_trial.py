"""A trial against the analysis of what it stands for: lines never removed, a band never there."""

from dataclasses import replace

import numpy as np
import pytest

import sagnac

RATE = 100.0
WALK = 1e-6  # rad/sqrt(s)


def noise(samples=60_000, seed=5):
    return WALK * np.sqrt(RATE) * np.random.default_rng(seed).standard_normal(samples)


def analyzed(rate, **choices):
    recording = sagnac.Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=RATE)
    return sagnac.analyze(recording, **choices)


@pytest.fixture(scope="module")
def recorded():
    time = np.arange(60_000) / RATE
    return noise() + 2e-5 * np.cos(2 * np.pi * 7.03 * time) + 1e-5 * np.cos(2 * np.pi * 0.4 * time)


@pytest.fixture(scope="module")
def analysis(recorded):
    found = analyzed(recorded)
    assert sorted(round(line.frequency, 2) for line in found.lines) == [0.4, 7.03]
    return found


def test_nothing_changed_is_what_was_before_and_is_taken_by_a_later_trial(analysis):
    tried = sagnac.trial(analysis)
    again = sagnac.trial(analysis, masked=[(20.0, 30.0)], before=tried.before)
    assert again.before is tried.before
    alone = sagnac.trial(analysis, masked=[(20.0, 30.0)])
    assert again.angle_random_walk == alone.angle_random_walk
    assert tried.angle_random_walk.value == tried.before.value
    assert tried.before.low < WALK < tried.before.high
    np.testing.assert_array_equal(tried.curve.deviation, analysis.curve.deviation)
    np.testing.assert_array_equal(tried.spectrum.density, analysis.spectrum.density)


def test_with_all_lines_back_curve_and_spectrum_are_those_of_the_recording(analysis, recorded):
    tried = sagnac.trial(analysis, left_in=analysis.lines)
    left = analyzed(recorded, method="none")
    short = left.curve.tau < 20.0
    # Noise and line are correlated by chance, by about their ratio over the root of the samples.
    np.testing.assert_allclose(tried.curve.deviation[short], left.curve.deviation[short], rtol=0.03)
    assert tried.curve.deviation.max() > 5.0 * analysis.curve.deviation[short].min()
    power = np.trapezoid(tried.spectrum.density, tried.spectrum.frequency)
    before = np.trapezoid(analysis.spectrum_before.density, analysis.spectrum_before.frequency)
    assert power == pytest.approx(before, rel=0.1)
    assert 0.9 < tried.angle_random_walk.value / WALK < 1.15


def test_one_line_back_leaves_the_other_out(analysis):
    slow = min(analysis.lines, key=lambda line: line.frequency)
    tried = sagnac.trial(analysis, left_in=[slow])
    grown = tried.spectrum.frequency[tried.spectrum.density != analysis.spectrum.density]
    assert grown == pytest.approx([0.4], abs=0.01)


def test_a_masked_band_does_not_count():
    # Half of the band shows twice the noise: masked, the other half decides.
    more = np.fft.rfft(noise(seed=6))
    more[: more.size // 2] = 0.0
    found = analyzed(noise() + 3.0 * np.fft.irfft(more, 60_000), method="none")
    masked = sagnac.trial(found, masked=[(24.0, 50.0)])
    assert masked.angle_random_walk.low < WALK < masked.angle_random_walk.high
    upper = sagnac.trial(found, masked=[(0.0, 26.0)])
    louder = upper.angle_random_walk
    assert louder.low < np.sqrt(10.0) * WALK < louder.high


def test_what_makes_no_sense_is_refused(analysis, recorded):
    with pytest.raises(ValueError, match="none of x"):
        sagnac.trial(analysis, left_in=[replace(analysis.lines[0], amplitude=1.0)])
    with pytest.raises(ValueError, match="low, high"):
        sagnac.trial(analysis, masked=[(3.0, 2.0)])
    with pytest.raises(sagnac.RecordingError, match="no cell"):
        sagnac.trial(analysis, masked=[(0.0, 60.0)])
    with pytest.raises(sagnac.RecordingError, match="no levels"):
        sagnac.trial(analyzed(recorded[:6000], method="fos-korenberg"))


def test_a_caller_who_lets_numpy_raise_errors_gets_the_same_answer(analysis, recorded):
    tried = sagnac.trial(analysis, masked=[(20.0, 30.0)])
    with np.errstate(all="raise"):
        again = analyzed(recorded)
        masked = sagnac.trial(again, masked=[(20.0, 30.0)])
    assert again.angle_random_walk == analysis.angle_random_walk
    assert masked.angle_random_walk == tried.angle_random_walk
