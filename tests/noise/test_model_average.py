"""The average over bands and terms on noise that is known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.gallery import Gyro, five_terms, low_passed
from scipy.signal import butter, iirpeak, lfilter

from sagnac.noise import model_average
from sagnac.noise.band_models import BandModels
from sagnac.noise.estimates import Estimate, Fit, FitBand
from sagnac.noise.fit import likelihood_fit
from sagnac.noise.laws import COEFFICIENT_NAMES
from sagnac.noise.model_average import average
from sagnac.noise.whole_band import with_slow_terms, with_whole_band
from sagnac.spectrum.levels import robust_levels
from sagnac.spectrum.tapered import tapered_spectrum

RATE = 100.0


def levels_of(increments, every=1):
    """Levels of the increments between every n-th angle."""
    whole = increments[: increments.size // every * every]
    steps = whole.reshape(-1, every).sum(axis=1)
    return robust_levels(tapered_spectrum(steps, sample_rate=RATE / every))


def whole_band(value, low, high):
    unseen = {"value": math.nan, "low": math.nan, "high": math.nan, "status": "not observable"}
    found = {"value": value, "low": low, "high": high, "status": "estimated"}
    return Fit(
        method="likelihood",
        coefficients={
            name: Estimate(
                name=name, confidence=0.95, **(found if name == "angle_random_walk" else unseen)
            )
            for name in COEFFICIENT_NAMES
        },
        band=FitBand(low=0.0, high=50.0, interval=0.01),
    )


def test_white_walk_is_found_and_named():
    gyro = five_terms(np.random.default_rng(10), 40_000, RATE, gyro=Gyro(quantization=0.05))
    result = average(levels_of(gyro.increments))
    walk = result.angle_random_walk
    assert walk.status == "estimated"
    assert walk.low <= 1.0 <= walk.high
    assert result.coefficients["quantization"].status == "estimated"
    assert result.coefficients["quantization"].value == pytest.approx(0.05, rel=0.1)
    assert np.all(np.linalg.eigvalsh(result.covariance) > 0.0)
    assert result.rests_on.band_hz[0] < 1.0 < result.rests_on.band_hz[1]


@pytest.mark.parametrize("floor", [0.1, 0.3])
def test_the_floor_of_a_converter_is_no_walk_if_a_low_pass_lies_far_below(floor):
    held = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        behind = lfilter(*butter(2, 2.0, fs=500.0), rng.standard_normal(150_000))
        increments = (behind + floor * rng.standard_normal(150_000)) / math.sqrt(500.0)
        levels = robust_levels(tapered_spectrum(increments, sample_rate=500.0))
        walk = average(levels).angle_random_walk
        # Below the low-pass the floor adds to it.
        held += walk.low <= math.hypot(1.0, floor) <= walk.high
    assert held == 8


def test_narrow_bands_that_chance_makes_high_do_not_widen_an_interval():
    # N = 1 and flicker that crosses it at 0.044 Hz, behind a low-pass of 20 Hz, for 100 minutes.
    random, samples = np.random.default_rng(8), 600_000
    frequency = np.fft.rfftfreq(2 * samples, 1.0 / RATE)[1:]
    law = np.append(0.0, np.sqrt(0.0442 / frequency))
    flicker = np.fft.irfft(law * np.fft.rfft(random.standard_normal(2 * samples)))[:samples]
    noise = random.standard_normal(samples) + flicker
    increments = lfilter(*butter(2, 20.0, fs=RATE), noise) / math.sqrt(RATE)
    walk = average(levels_of(increments)).angle_random_walk
    assert walk.low < 1.0 < walk.high
    # An interval of 95 % from 10 Hz of it is 1.96 / sqrt(6000 s x 10 Hz) = 0.8 % wide.
    assert walk.high - walk.low < 0.03


def test_the_law_named_is_of_the_band_that_is_named():
    others = 0
    for seed in range(5):
        behind = lfilter(*butter(2, 0.2), np.random.default_rng(seed).standard_normal(100_000))
        levels = levels_of(behind)
        result = average(levels)
        choice, models = result.rests_on, result.relied
        bands = zip(levels.low[models.first], levels.high[models.last - 1], strict=True)
        heaviest = list(bands).index(choice.band_hz)
        assert choice.law == models.law(heaviest, levels.spectrum.interval)
        assert (choice.terms, choice.mask) == (models.terms(heaviest), models.mask[heaviest])
        others += heaviest > 0
    # The bands that several models share outweigh that of the heaviest model in some.
    assert others >= 2


def flicker_of(random, samples, slope):
    """Noise of a density of one at half the sample rate, that of white noise of variance one."""
    law = np.append(0.0, (np.fft.rfftfreq(2 * samples)[1:] / 0.5) ** (0.5 * slope))
    return np.fft.irfft(law * np.fft.rfft(random.standard_normal(2 * samples)))[:samples]


@pytest.mark.parametrize(("slope", "widest"), [(-0.7, 0.5), (-1.0, 0.1)])
def test_slow_noise_of_any_slope_behind_a_low_pass_leaves_n(slope, widest):
    """Twenty minutes of white noise and slow noise that cross at 0.3 Hz, behind 10 Hz, order 4.

    Without a law less steep than 1/f none of the first eight held: N came out 7 to 35 % high.
    """
    random, held, widths = np.random.default_rng(17), 0, []
    for _ in range(8):
        slow = flicker_of(random, 120_000, slope) * 0.006 ** (-0.5 * slope)
        noise = random.standard_normal(120_000) + slow
        behind = lfilter(*butter(4, 10.0, fs=RATE), noise) / math.sqrt(RATE)
        walk = average(levels_of(behind)).angle_random_walk
        assert walk.status == "estimated"
        held += walk.low <= 1.0 <= walk.high
        widths.append(walk.high - walk.low)
    assert held >= 7
    assert np.median(widths) < widest


@pytest.mark.parametrize(("slope", "most"), [(-1.0, 12), (-0.7, 26)])
def test_where_slow_noise_explains_a_short_record_as_well_nothing_is_estimated(slope, most):
    """Five minutes at 1 Hz of slow noise ten times the density of N at half the sample rate.

    Each of 40 was an estimate, four times N.
    """
    above = 0
    for seed in range(40):
        random = np.random.default_rng(seed)
        noise = np.sqrt(10.0) * flicker_of(random, 300, slope) + random.standard_normal(300)
        walk = average(levels_of(noise / math.sqrt(RATE))).angle_random_walk
        assert walk.high >= 1.0
        above += walk.status == "estimated" and walk.low > 1.0
    assert above <= most


def test_a_short_record_that_shows_white_noise_is_an_estimate():
    """Flicker crosses it at a twentieth of the sample rate; two of forty are bounds."""
    held = estimated = 0
    for seed in range(40):
        random = np.random.default_rng(seed)
        noise = np.sqrt(0.1) * flicker_of(random, 300, -1.0) + random.standard_normal(300)
        walk = average(levels_of(noise / math.sqrt(RATE))).angle_random_walk
        estimated += walk.status == "estimated"
        held += (walk.low if walk.status == "estimated" else 0.0) <= 1.0 <= walk.high
    assert held >= 38
    assert estimated >= 36


def test_no_walk_gives_a_bound():
    rng = np.random.default_rng(11)
    increments = 0.5 * np.diff(rng.standard_normal(20_001))
    walk = average(levels_of(increments + 1e-6 * rng.standard_normal(20_000))).angle_random_walk
    assert walk.status == "upper bound"
    assert walk.high > 1e-5


def test_whole_band_wins_only_if_the_levels_bear_it_out():
    gyro = five_terms(np.random.default_rng(12), 40_000, RATE, gyro=Gyro())
    levels = levels_of(gyro.increments)
    right = whole_band(1.0, 0.99, 1.01)
    assert with_whole_band(levels, average(levels), right).rests_on.member == "whole band"
    filtered = low_passed(
        np.random.default_rng(12), 40_000, RATE, gyro=Gyro(), corner=0.05, order=2
    )
    levels = levels_of(filtered.increments)
    assert with_whole_band(levels, average(levels), right).rests_on.member == "average"


def test_a_fit_that_is_a_little_off_the_average_has_an_interval_of_their_mixture():
    gyro = five_terms(np.random.default_rng(12), 40_000, RATE, gyro=Gyro())
    levels = levels_of(gyro.increments)
    alone = average(levels)
    walk = alone.angle_random_walk
    # 1.96 standard errors above the average lies its end.
    value = walk.value * (walk.high / walk.value) ** (1.7 / 1.96)
    narrow = whole_band(value, 0.999 * value, 1.02 * walk.high)
    result = with_whole_band(levels, alone, narrow)
    both = result.angle_random_walk
    assert result.rests_on.member == "both"
    assert both.value == value
    # Half of the chances from either, each side of a value with an error of its own.
    normal = np.sort(np.random.default_rng(1).standard_normal(400_000)) / 1.959964
    mixed = np.concatenate(
        [
            one.value * np.where(normal < 0.0, one.value / one.low, one.high / one.value) ** normal
            for one in (walk, narrow.coefficients["angle_random_walk"])
        ]
    )
    assert (both.low, both.high) == pytest.approx(np.quantile(mixed, [0.025, 0.975]), rel=1e-3)
    place = result.names.index("angle_random_walk")
    deviation = (both.high - both.low) / (2.0 * 1.959964)
    assert result.covariance[place, place] == pytest.approx(deviation**2, rel=1e-6)
    before, after = (
        one.covariance / np.sqrt(np.outer(np.diag(one.covariance), np.diag(one.covariance)))
        for one in (alone, result)
    )
    np.testing.assert_allclose(after, before, atol=1e-12)
    beyond = walk.value * (walk.high / walk.value) ** (4.5 / 1.96)
    far = with_whole_band(levels, alone, whole_band(beyond, 0.999 * beyond, 1.001 * beyond))
    assert far.rests_on.member == "average"
    assert far.angle_random_walk == walk


def test_slow_terms_are_of_a_fit_to_the_lowest_frequencies():
    gyro = five_terms(
        np.random.default_rng(30), 40_000, RATE, gyro=Gyro(quantization=0.05, rate_walk=2.0)
    )
    alone = average(levels_of(gyro.increments))
    sums = gyro.increments.reshape(-1, 10).sum(axis=1)
    fit = likelihood_fit(sums, kind="increment", sample_rate=0.1 * RATE, band=(0.0, 2.0))
    beside = with_slow_terms(alone, fit)
    for name in COEFFICIENT_NAMES:
        source = fit if name in ("bias_instability", "rate_random_walk") else alone
        np.testing.assert_equal(beside.coefficients[name], source.coefficients[name])
    assert beside.names == ("quantization", "angle_random_walk", "rate_random_walk")
    # Q and N as every sample has them together, K as fewer angles have it.
    np.testing.assert_array_equal(beside.covariance[:2, :2], alone.covariance[:2, :2])
    assert alone.covariance[0, 1] != 0.0
    slow = fit.coefficients["rate_random_walk"]
    deviation = (slow.high - slow.low) / (2.0 * 1.959964)
    assert beside.covariance[2, 2] == pytest.approx(deviation**2, rel=1e-6)
    np.testing.assert_array_equal(beside.covariance[:2, 2], [0.0, 0.0])
    assert beside.rests_on == replace(alone.rests_on, slow_terms="low band", low_band_hz=2.0)


@pytest.mark.parametrize("seed", [0, 3])
def test_a_second_level_band_that_reads_another_walk_is_told_of(seed):
    """White noise of 1 with mild resonances, and slow noise of 7 below 0.04 Hz."""
    rate, generator = 10.0, np.random.default_rng(seed)
    white, slow = generator.standard_normal((2, 15_000))
    memory = math.exp(-2.0 * math.pi * 0.04 / rate)
    smooth = 7.0 * (1.0 - memory) * lfilter([1.0], [1.0, -memory], slow)
    clear = white + smooth
    for frequency in (0.5, 1.2, 2.2, 3.5):
        clear += 0.5 * lfilter(*iirpeak(frequency, 3.0, fs=rate), white)
    levels = robust_levels(tapered_spectrum(clear / math.sqrt(rate), sample_rate=rate))
    result = average(levels)
    told = result.rests_on.elsewhere
    assert told is not None
    assert told.high < 0.1
    assert 4.0 < told.walk < 10.0
    assert result.angle_random_walk.high > told.walk > 2.0 * result.angle_random_walk.value
    plain = robust_levels(tapered_spectrum((white + smooth) / math.sqrt(rate), sample_rate=rate))
    assert average(plain).rests_on.elsewhere is None


def test_a_share_that_rounds_to_more_than_one_is_all():
    # Twenty equal weights add up to a rounding error more than one.
    count = 20
    squares = np.ones((count, 6))
    squares[::2, 1] = 1e4
    models = BandModels(
        first=np.zeros(count, int),
        last=np.ones(count, int),
        mask=np.full(count, 2),
        ruled=np.full(count, 3),
        deviance=np.zeros(count),
        squares=squares,
        covariance=np.zeros((count, 6, 6)),
        logarithm=np.zeros(count),
    )
    assert models.weights.sum() > 1.0
    told = model_average.other_walk(models, levels_of(np.random.default_rng(24).normal(size=4000)))
    assert told.share == 1.0
    assert told.walk in (1.0, pytest.approx(100.0))
