"""The noise floor against the laws that the noise was made by."""

from itertools import pairwise

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.spectrum import power_laws as floors
from sagnac.spectrum.periodogram import periodogram
from sagnac.spectrum.power_laws import (
    PowerLaws,
    floor_scatter,
    floor_windows,
    multiply,
    noise_floor,
)
from tests.spectrum.examples import (
    SAMPLES,
    angle_random_walk,
    as_series,
    everything,
    flicker,
    quantization,
    rate_random_walk,
)

NOISES = (angle_random_walk, quantization, rate_random_walk, flicker, everything)


def mean_ratios(noise, added, seeds=6):
    """Mean of power over floor in four octave-wide bands and over all, averaged over seeds."""
    edges = np.array([8, 200, 1000, 5000, SAMPLES // 2])
    total = np.zeros(edges.size)
    for seed in range(seeds):
        clean = noise(np.random.default_rng([seed, 7]))
        floor = noise_floor(periodogram(clean + added))
        ratio = periodogram(clean) / floor
        bands = [ratio[low:high].mean() for low, high in pairwise(edges)]
        total += [*bands, ratio[8:].mean()]
    return total / seeds


@pytest.mark.parametrize("noise", NOISES)
def test_floor_is_the_expected_power(noise):
    *bands, whole = mean_ratios(noise, 0.0)
    # The median of 513 ordinates scatters by 6 %; six records and several windows a band.
    assert bands == pytest.approx(np.ones(4), abs=0.08)
    # The jump between the ends of a random walk leaks into every bin with the same phase; those
    # ordinates are no longer exponential, and their mean is not their median over ln 2.
    assert whole == pytest.approx(1.0, abs=0.05 if noise is rate_random_walk else 0.02)


@pytest.mark.parametrize("noise", [angle_random_walk, everything])
def test_strong_lines_do_not_lift_the_floor(noise):
    number = np.arange(SAMPLES)
    # 40 dB above white noise, between bins and on them.
    lines = sum(
        np.cos(2.0 * np.pi * (bin_ / SAMPLES) * number + 1.0)
        for bin_ in (60.25, 1284.5, 4000.0, 10_000.3)
    )
    *_, whole = mean_ratios(noise, lines)
    # Sidelobes, (pi bins)^-2 of a line, stand above noise for some thirty bins beside each.
    assert whole == pytest.approx(1.0, abs=0.03)


def test_floor_scatter_is_what_white_noise_shows():
    floors = [
        noise_floor(periodogram(angle_random_walk(np.random.default_rng(seed))))
        for seed in range(40)
    ]
    middle = np.array(floors)[:, 8000:12_000:200]
    # Between two windows the floor is their mean: a little better than one window.
    assert np.sqrt(np.mean((middle - 1.0) ** 2)) == pytest.approx(
        floor_scatter(floors[0].size), rel=0.35
    )


def test_a_level_that_no_power_law_follows_is_followed():
    # A resonance a tenth of the band wide.
    generator = np.random.default_rng(3)
    frequency = np.fft.rfftfreq(SAMPLES)
    gain = 1.0 + 8.0 / (1.0 + ((frequency - 0.2) / 0.03) ** 2)
    steps = np.fft.irfft(np.fft.rfft(generator.standard_normal(SAMPLES)) * np.sqrt(gain), SAMPLES)
    power = periodogram(steps)
    truth = 1.0 + 8.0 / (1.0 + ((np.arange(power.size) / SAMPLES - 0.2) / 0.03) ** 2)
    floor = noise_floor(power)
    assert np.mean(floor[8:] / truth[8:]) == pytest.approx(1.0, abs=0.03)
    assert np.std(floor[8:] / truth[8:]) < 0.1


@pytest.mark.parametrize("corner", [90, 200, 1000])
@pytest.mark.parametrize("samples", [3000, 30_000])
def test_the_plateau_ahead_of_a_low_pass_is_reached(samples, corner):
    # A low-pass of sixth order, whose plateau is narrower than a window of the median.
    bins = np.arange(samples // 2 + 1)
    truth = 1.0 / (1.0 + (bins / corner) ** 12.0) + 1e-7
    power = truth * np.random.default_rng(corner).exponential(size=bins.size)
    held = noise_floor(power)[20 : corner * 3 // 4]
    assert held.min() > 0.4


def test_a_hump_above_the_lowest_bins_lifts_no_floor():
    bins = np.arange(3001)
    truth = 1.0 + 100.0 * np.exp(-(((bins - 150.0) / 15.0) ** 2))
    power = truth * np.random.default_rng(2).exponential(size=bins.size)
    assert noise_floor(power)[100:200].max() < 4.0


@pytest.mark.parametrize("quantized", [3.0, 10.0])
def test_a_law_that_rules_few_bins_is_seen(quantized):
    # Readout noise rules all but the lowest bins, where the angle random walk does; a floor that
    # fell on as f^2 there would call all of it lines.
    bins = np.arange(8, 200)
    ratio = []
    for seed in range(10):
        generator = np.random.default_rng([seed, 9])
        steps = generator.standard_normal(SAMPLES)
        steps += quantized * np.diff(generator.standard_normal(SAMPLES + 1))
        floor = noise_floor(periodogram(steps))
        ratio.append(floor[bins] / (1.0 + (2.0 * quantized * np.sin(np.pi * bins / SAMPLES)) ** 2))
    assert np.mean(ratio) == pytest.approx(1.0, abs=0.1)
    assert np.min(ratio) > 0.6


def test_floor_scales_with_the_power():
    power = periodogram(everything(np.random.default_rng(0)))
    floor = noise_floor(power)
    assert noise_floor(1e-18 * power) == pytest.approx(1e-18 * floor, rel=1e-6, abs=0.0)


def naive_floor(power, law):
    """Running median over a law, window by window; `law` at bins 1, 2, ...."""
    middles, ratios, start = [], [], 1
    while start < power.size:
        half = int(np.clip(0.1 * start, 256, 4096))
        stop = min(start + 2 * half, power.size)
        if stop - start < half and middles:
            break
        middles.append((start + stop) / 2)
        ratios.append(np.median(power[start:stop] / law[start - 1 : stop - 1]) / np.log(2.0))
        start += half
    number = np.arange(1.0, power.size)
    return law * np.interp(number, middles, ratios)


@pytest.mark.parametrize("mapped", [False, True])
@pytest.mark.parametrize("step", [1, 2])
def test_floor_by_spans_of_a_series_or_every_other_bin_of_one(monkeypatch, mapped, step):
    power = np.random.default_rng(4).exponential(size=90_000)
    bins = power[::step].size - 1
    law = PowerLaws(coefficients=np.array([1e-8, 1e-4, 1.0, 2.0]), level=3e-18, bins=bins)
    monkeypatch.setattr(floors, "fit_power_laws", lambda _: law)
    if mapped:
        monkeypatch.setattr(arrays, "IN_MEMORY", 1000)
        monkeypatch.setattr(arrays, "BLOCK", 7000)
    floor = noise_floor(as_series(power)[::step])
    assert arrays.is_mapped(floor) == mapped
    levels = np.interp(np.arange(1.0, bins + 1.0), law.points, law.at(law.points))
    np.testing.assert_allclose(floor[1:], naive_floor(power[::step], levels), rtol=1e-12)
    assert floor[0] == floor[1]


@pytest.mark.parametrize("samples", [4, 20, 60, 70, 200])
def test_floor_of_a_short_record_is_finite_and_positive(samples):
    power = periodogram(np.random.default_rng(samples).standard_normal(samples))
    floor = noise_floor(power)
    assert floor.shape == power.shape
    assert np.all(np.isfinite(floor))
    assert np.all(floor > 0.0)


@pytest.mark.parametrize("bins", [1, 32, 300, 513, 700, 5000, 100_001])
def test_windows_overlap_by_half_and_cover_all_bins(bins):
    windows = floor_windows(bins)
    covered = np.zeros(bins, dtype=int)
    for window in windows:
        covered[window] += 1
    assert covered[0] == 0
    assert np.all(covered[1 : windows[-1].stop if windows else 1] >= 1)
    # What is left at the end is less than half a window, whose middle it follows.
    assert not windows or bins - windows[-1].stop < 0.5 * (windows[-1].stop - windows[-1].start)
    assert all(
        later.start == pytest.approx((one.start + one.stop) / 2, abs=1)
        for one, later in pairwise(windows)
        if one.stop < bins
    )


def test_a_law_between_its_points_is_the_law():
    law = PowerLaws(coefficients=np.array([1e-8, 1e-4, 1.0, 2.0]), level=3e-18, bins=200_000)
    table = np.ones(200_001)
    multiply(table, law.points, law.at(law.points))
    number = np.arange(1.0, 200_001.0)
    np.testing.assert_allclose(table[1:], law.at(number), rtol=2e-5)
    np.testing.assert_allclose(table[1:400], law.at(number[:399]), rtol=1e-12)
    assert table[0] == table[1]


@pytest.mark.parametrize("block", [7, 1000])
def test_between_points_the_level_is_linear_and_beyond_them_that_of_the_last(monkeypatch, block):
    monkeypatch.setattr(arrays, "BLOCK", block)
    points = np.array([1.0, 2.0, 3.0, 3.5, 7.0, 20.25, 40.0])
    levels = np.array([5.0, 3.0, 3.0, 9.0, 1.0, 2.0, 0.5])
    series = np.random.default_rng(1).uniform(1.0, 2.0, 60)
    expected = series * np.interp(np.arange(60), points, levels)
    multiply(series, points, levels)
    assert series == pytest.approx(expected, rel=1e-13)
