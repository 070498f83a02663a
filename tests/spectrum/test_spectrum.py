"""Periodograms, sums over table angle, and the noise floor, against sums and laws."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.fft import idct

from sagnac import series
from sagnac.spectrum import sums
from sagnac.spectrum.floor import _median, floor_scatter, noise_floor
from sagnac.spectrum.periodogram import bin_sums, density, periodogram, smoothed
from sagnac.spectrum.sums import angle_series, angle_sums, tone_sums
from sagnac.spectrum.tapers import multitaper
from sagnac.spectrum.transforms import cosine_length, cosine_transform, transform_length

SAMPLES = 40_000


def fractional_noise(exponent, samples, generator):
    """Gaussian noise of density f^-exponent: white noise shaped on eight times the length."""
    frequency = np.fft.rfftfreq(8 * samples)
    frequency[0] = frequency[1]
    parts = generator.standard_normal((2, frequency.size))
    shaped = (parts[0] + 1j * parts[1]) * frequency ** (-exponent / 2.0)
    return np.fft.irfft(shaped)[:samples]


def angle_random_walk(generator):
    return generator.standard_normal(SAMPLES)


def quantization(generator):
    return np.diff(generator.standard_normal(SAMPLES + 1))


def rate_random_walk(generator):
    steps = np.cumsum(generator.standard_normal(SAMPLES))
    return steps - steps.mean()


def flicker(generator):
    steps = fractional_noise(1.0, SAMPLES, generator)
    return steps - steps.mean()


def everything(generator):
    steps = (
        generator.standard_normal(SAMPLES)
        + 3.0 * np.diff(generator.standard_normal(SAMPLES + 1))
        + 0.01 * np.cumsum(generator.standard_normal(SAMPLES))
    )
    return steps - steps.mean()


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
    assert noise_floor(1e-18 * power) == pytest.approx(1e-18 * floor, rel=1e-6)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(1, 6000),
    st.sampled_from(["exponential", "ties", "rising", "every eighth"]),
    st.integers(0, 2**32 - 1),
)
def test_the_median_is_the_middle_value(size, kind, seed):
    values = np.random.default_rng(seed).exponential(size=size)
    if kind == "ties":
        values = np.floor(2.0 * values)
    elif kind == "rising":
        values = np.sort(values)
    elif kind == "every eighth":
        values[::8] = 1e3
    ordered = np.sort(values)
    middle = 0.5 * (ordered[(size - 1) // 2] + ordered[size // 2])
    assert _median(values) == middle


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
    # White noise has a law that is level; the floor is then the running median alone.
    monkeypatch.setattr("sagnac.spectrum.floor._power_laws", lambda power: np.ones_like)
    if mapped:
        monkeypatch.setattr(series, "IN_MEMORY", 1000)
        monkeypatch.setattr(series, "SPAN", 7000)
    floor = noise_floor(as_series(power)[::step])
    assert series.is_mapped(floor) == mapped
    part = power[::step]
    np.testing.assert_allclose(floor[1:], naive_floor(part, np.ones(part.size - 1)), rtol=1e-12)
    assert floor[0] == floor[1]


@pytest.mark.parametrize("samples", [4, 20, 60, 70, 200])
def test_floor_of_a_short_record_is_finite_and_positive(samples):
    power = periodogram(np.random.default_rng(samples).standard_normal(samples))
    floor = noise_floor(power)
    assert floor.shape == power.shape
    assert np.all(np.isfinite(floor))
    assert np.all(floor > 0.0)


@settings(deadline=None)
@given(st.integers(2, 3_000_000))
def test_transform_length_is_even_and_long_enough(samples):
    length = transform_length(samples)
    assert length % 2 == 0
    assert samples <= length <= 1.1 * samples + 8


@settings(max_examples=40, deadline=None)
@given(st.integers(2, 60), st.integers(1, 3), st.integers(0, 2**32 - 1))
def test_periodogram_is_the_square_of_the_fourier_sum(samples, padding, seed):
    steps = np.random.default_rng(seed).standard_normal(samples)
    power = periodogram(steps, padding)
    length = padding * transform_length(samples)
    number = np.arange(samples)
    direct = [
        np.sum(steps * np.exp(-2j * np.pi * bin_ * number / length)) for bin_ in range(power.size)
    ]
    assert power.size == length // 2 + 1
    assert power == pytest.approx(np.abs(direct) ** 2 / samples, abs=1e-11)


def as_series(values):
    copy = series.empty(values.size)
    copy[:] = values
    return copy


@pytest.mark.parametrize("mapped", [False, True])
@pytest.mark.parametrize(
    ("samples", "padding"), [(131_072, 1), (150_001, 1), (140_003, 2), (65_537, 2), (90_000, 3)]
)
def test_a_long_periodogram_is_that_of_one_transform(monkeypatch, samples, padding, mapped):
    steps = np.random.default_rng(samples).standard_normal(samples)
    if mapped:
        monkeypatch.setattr(series, "IN_MEMORY", 1000)
        monkeypatch.setattr(series, "SPAN", 7000)
    power = periodogram(as_series(steps), padding)
    assert series.is_mapped(power) == mapped
    length = padding * transform_length(samples)
    expected = np.abs(np.fft.rfft(steps, length)) ** 2 / samples
    assert power.size == length // 2 + 1
    np.testing.assert_allclose(power, expected, rtol=1e-11, atol=1e-12)


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 3000), st.integers(1, 3), st.integers(2, 60), st.integers(0, 2**32 - 1))
def test_a_factored_transform_of_any_length(samples, padding, columns, seed):
    steps = np.random.default_rng(seed).standard_normal(samples)
    length = padding * transform_length(samples)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sagnac.spectrum.transforms._FACTORED", 0)
        patch.setattr("sagnac.spectrum.transforms._COLUMNS", columns)
        patch.setattr("sagnac.spectrum.transforms._COMBINED", 16)
        power = periodogram(steps, padding)
    expected = np.abs(np.fft.rfft(steps, length)) ** 2 / samples
    np.testing.assert_allclose(power, expected, rtol=1e-9, atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 3000), st.integers(2, 60), st.booleans(), st.integers(0, 2**32 - 1))
def test_cosine_transform_is_the_direct_sum(samples, columns, mapped, seed):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sagnac.spectrum.transforms._FACTORED", 500)
        patch.setattr("sagnac.spectrum.transforms._COLUMNS", columns)
        patch.setattr("sagnac.spectrum.transforms._COMBINED", 16)
        if mapped:
            patch.setattr(series, "IN_MEMORY", 100)
            patch.setattr(series, "SPAN", 700)
        length = cosine_length(samples)
        values = np.random.default_rng(seed).standard_normal(length)
        transform = cosine_transform(as_series(values))
    assert samples - 2 * columns < length <= samples
    place = np.pi * np.outer(np.arange(length), np.arange(length) + 0.5) / length
    expected = np.sqrt(2.0 / length) * (np.cos(place) @ values)
    expected[0] /= np.sqrt(2.0)
    np.testing.assert_allclose(transform, expected, atol=1e-10)


@pytest.mark.parametrize("mapped", [False, True])
@pytest.mark.parametrize("samples", [131_072, 131_101, 200_003, 262_147])
def test_a_long_cosine_transform_turns_back_into_its_values(monkeypatch, samples, mapped):
    if mapped:
        monkeypatch.setattr(series, "IN_MEMORY", 1000)
        monkeypatch.setattr(series, "SPAN", 7000)
    length = cosine_length(samples)
    assert samples - 10 < length <= samples
    values = np.random.default_rng(samples).standard_normal(length)
    transform = cosine_transform(as_series(values))
    assert series.is_mapped(transform) == mapped
    np.testing.assert_allclose(idct(transform, type=2, norm="ortho"), values, atol=1e-12)


def test_bin_sums_by_spans_are_those_of_the_whole(monkeypatch):
    monkeypatch.setattr(series, "SPAN", 100)
    values = np.random.default_rng(0).standard_normal(1000)
    edges = np.array([3, 4, 10, 99, 100, 101, 350, 500, 997])
    expected = [values[one:other].sum() for one, other in pairwise(edges)]
    found = bin_sums(lambda span: values[span], edges)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_periodogram_keeps_the_variance():
    # Parseval: twice the power of all bins but the first and the last is the sum of squares.
    steps = np.random.default_rng(2).standard_normal(1000)
    power = periodogram(steps)
    length = transform_length(steps.size)
    total = power[0] + power[-1] + 2.0 * power[1:-1].sum()
    assert total * steps.size / length == pytest.approx(np.sum(steps**2), rel=1e-12)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 40), st.integers(1, 30), st.integers(0, 2**32 - 1))
def test_angle_sums_are_the_direct_sums(samples, orders, seed):
    generator = np.random.default_rng(seed)
    # Any number of turns, in either direction.
    phase = generator.uniform(-300.0, 300.0, samples)
    strengths = generator.standard_normal(samples)
    sums = angle_sums(phase, strengths, orders)
    direct = [np.sum(strengths * np.exp(-1j * k * phase)) for k in range(orders + 1)]
    # The transform is good to 1e-9 of the strengths' sum.
    assert sums == pytest.approx(np.array(direct), abs=3e-9 * np.abs(strengths).sum())


@pytest.mark.parametrize("several", [1, 2, 5])
def test_angle_sums_of_several_strengths(several):
    generator = np.random.default_rng(several)
    phase = generator.uniform(-30.0, 30.0, 200)
    strengths = generator.standard_normal((several, 200))
    direct = strengths @ np.exp(-1j * np.outer(phase, np.arange(41)))
    sums = angle_sums(phase, strengths, 40)
    assert sums.shape == (several, 41)
    np.testing.assert_allclose(sums, direct, atol=2e-7)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 40), st.integers(0, 30), st.integers(0, 2**32 - 1))
def test_angle_series_is_the_direct_series(samples, orders, seed):
    generator = np.random.default_rng(seed)
    phase = generator.uniform(-300.0, 300.0, samples)
    sums = generator.standard_normal(orders + 1) + 1j * generator.standard_normal(orders + 1)
    direct = sum((c * np.exp(1j * k * phase)).real for k, c in enumerate(sums))
    total = np.abs(sums).sum()
    made = angle_series(phase, sums)
    assert made == pytest.approx(direct, abs=3e-9 * total)
    finer = angle_series(phase, sums, tolerance=1e-13)
    assert finer == pytest.approx(direct, abs=3e-11 * total)


def exact_phase(frequency, numbers, center):
    """2 pi f (n - center) without whole turns; fractions do not round."""
    cycles = (Fraction(frequency) * (Fraction(int(n)) - Fraction(center)) for n in numbers)
    return 2.0 * np.pi * np.array([float(turns - round(turns)) for turns in cycles])


def naive_tone_sums(values, frequencies, center, lag_unit):
    numbers = np.arange(values.size)
    sums = np.empty((2, len(frequencies)), dtype=complex)
    for index, frequency in enumerate(frequencies):
        waved = values * np.exp(1j * exact_phase(frequency, numbers, center))
        sums[:, index] = waved.sum(), (waved * (numbers - center) * lag_unit).sum()
    return sums


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 1400), st.integers(0, 5), st.integers(0, 2**32 - 1))
def test_tone_sums_are_the_direct_sums(samples, tones, seed):
    generator = np.random.default_rng(seed)
    values = generator.standard_normal(samples)
    frequencies = generator.uniform(-0.5, 0.5, tones)
    center = 0.5 * generator.integers(-1000, 2 * samples)
    sums = tone_sums(values, frequencies, center, lag_unit=1.0 / samples)
    reach = 1.0 + abs(center) / samples
    np.testing.assert_allclose(
        sums,
        naive_tone_sums(values, frequencies, center, 1.0 / samples),
        atol=1e-14 * reach * np.abs(values).sum(),
    )


def test_tone_sums_by_spans_and_of_a_mapped_series(monkeypatch):
    generator = np.random.default_rng(5)
    values = generator.standard_normal(9000)
    frequencies = generator.uniform(0.0, 0.5, 40)
    monkeypatch.setattr(series, "IN_MEMORY", 100)
    monkeypatch.setattr(series, "SPAN", 1500)
    monkeypatch.setattr("sagnac.spectrum.sums._TONES_AT_ONCE", 16)
    sums = tone_sums(as_series(values), frequencies, 4499.5, lag_unit=1e-4)
    np.testing.assert_allclose(sums, naive_tone_sums(values, frequencies, 4499.5, 1e-4), atol=1e-10)


@pytest.mark.parametrize(("start", "count"), [(0, 1), (0, 700), (43_000_001, 1100)])
@pytest.mark.parametrize("tones", [0, 1, 30])
def test_tones_are_the_direct_sum(monkeypatch, start, count, tones):
    monkeypatch.setattr("sagnac.spectrum.sums._TONES_AT_ONCE", 16)
    generator = np.random.default_rng(tones)
    frequencies = generator.uniform(-0.5, 0.5, tones)
    cosine, sine = generator.standard_normal((2, tones))
    center = 21_599_999.5
    made = sums.tones(start, count, center, frequencies, cosine=cosine, sine=sine)
    direct = np.zeros(count)
    for frequency, c, s in zip(frequencies, cosine, sine, strict=True):
        phase = exact_phase(frequency, range(start, start + count), center)
        direct += c * np.cos(phase) + s * np.sin(phase)
    np.testing.assert_allclose(made, direct, rtol=0.0, atol=1e-14 * np.hypot(cosine, sine).sum())


def test_density_of_white_rate_noise_is_one_sided():
    # Angle increments of a rate with density N^2 (two-sided) have variance N^2 / rate; the
    # one-sided density is twice N^2.
    n, rate = 2.5e-9, 250.0
    assert density(np.array([n**2 / rate]), rate)[0] == pytest.approx(2.0 * n**2)


def test_smoothed_keeps_power_and_peaks():
    power = np.ones(SAMPLES // 2 + 1)
    power[12_345] = 1e6
    frequency, mean = smoothed(power)
    assert np.all(np.diff(frequency) > 0.0)
    assert frequency.size <= 2000
    at = np.argmax(mean)
    assert frequency[at] == pytest.approx(12_345 / SAMPLES, rel=5e-3)
    assert np.delete(mean, at) == pytest.approx(1.0)
    # Narrow at the low end: the first bins are the periodogram's own.
    assert frequency[:5] * SAMPLES == pytest.approx([1, 2, 3, 4, 5])


def test_smoothed_power_by_spans_is_the_mean_over_each_bin(monkeypatch):
    monkeypatch.setattr(series, "IN_MEMORY", 1000)
    monkeypatch.setattr(series, "SPAN", 700)
    power = np.random.default_rng(6).exponential(size=9000)
    frequency, mean = smoothed(as_series(power), 300)
    edges = np.unique(np.floor(np.geomspace(1, power.size, 301)).astype(int))
    means = [power[low:high].mean() for low, high in pairwise(edges)]
    centers = [np.mean(np.arange(low, high)) for low, high in pairwise(edges)]
    np.testing.assert_allclose(mean, means, rtol=1e-12)
    np.testing.assert_allclose(frequency, np.array(centers) / (2 * (power.size - 1)), rtol=1e-12)


def test_multitaper_is_the_mean_over_orthonormal_tapers():
    values = np.random.default_rng(11).standard_normal(90)
    size = values.size
    length = transform_length(size)
    n, frequency = np.arange(size), np.arange(length // 2 + 1) / length
    wave = np.exp(-2j * np.pi * np.outer(frequency, n))
    tapers = [
        np.sqrt(2.0 / (size + 1)) * np.sin(np.pi * k * (n + 1) / (size + 1)) for k in (1, 2, 3)
    ]
    np.testing.assert_allclose(np.array(tapers) @ np.array(tapers).T, np.eye(3), atol=1e-12)
    expected = np.mean([np.abs(wave @ (taper * values)) ** 2 for taper in tapers], axis=0)
    np.testing.assert_allclose(multitaper(values, 3), expected, rtol=1e-9)


def test_multitaper_of_a_mapped_series(monkeypatch):
    values = np.random.default_rng(13).standard_normal(135_000)
    monkeypatch.setattr(series, "IN_MEMORY", 1000)
    monkeypatch.setattr(series, "SPAN", 7000)
    power = multitaper(as_series(values), 2)
    assert series.is_mapped(power)
    size = values.size
    place = np.pi * np.arange(1, size + 1) / (size + 1)
    expected = sum(
        np.abs(np.fft.rfft(values * np.sin(k * place), transform_length(size))) ** 2 for k in (1, 2)
    ) / (size + 1)
    np.testing.assert_allclose(power, expected, rtol=1e-9, atol=1e-12)


def test_multitaper_of_a_walk_has_no_leakage_where_a_periodogram_has():
    generator = np.random.default_rng(12)
    frequency = np.fft.rfftfreq(transform_length(SAMPLES))
    law = 1.0 / (4.0 * np.sin(np.pi * frequency[200:]) ** 2)
    ratios = {"multitaper": [], "periodogram": []}
    for _ in range(20):
        walk = np.cumsum(generator.standard_normal(SAMPLES))
        for name, ratio in ratios.items():
            ratio.append(
                np.mean(
                    {"multitaper": multitaper, "periodogram": periodogram}[name](
                        walk - walk.mean()
                    )[200:]
                    / law
                )
            )
    assert np.mean(ratios["multitaper"]) == pytest.approx(1.0, abs=0.01)
    assert np.mean(ratios["periodogram"]) > 1.3
