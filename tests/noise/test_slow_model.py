"""Slow noise as the levels of a spectrum show it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from sagnac import Recording, analyze
from sagnac.noise.estimates import Estimate
from sagnac.noise.laws import markov_density
from sagnac.noise.model_average import ModelChoice
from sagnac.noise.slow_model import slow_model, untold
from sagnac.spectrum.levels import robust_levels
from sagnac.spectrum.tapered import tapered_spectrum
from tests.navigation.strapdown import coloured

RATE = 10.0
SAMPLES = 72_000


def markov(random, deviation, time):
    """Mean rates over samples of a tenth of a second, of twenty values in each."""
    fine = 20
    decay = np.exp(-1.0 / (RATE * fine * time))
    steps = deviation * np.sqrt(1.0 - decay**2) * random.standard_normal(SAMPLES * fine)
    steps[0] = deviation * random.standard_normal()
    return lfilter([1.0], [1.0, -decay], steps).reshape(SAMPLES, fine).mean(axis=1)


def levels_of(rates):
    return robust_levels(tapered_spectrum(rates / RATE, sample_rate=RATE))


def test_the_density_of_a_markov_rate_is_that_of_its_means_folded():
    frequency, interval, time = np.array([0.001, 0.1, 1.0, 3.0, 4.9]), 0.1, 0.3
    every = frequency[:, np.newaxis] + np.arange(-3000, 3001) / interval
    density = 2.0 * time**2 / (1.0 + (2.0 * np.pi * every * time) ** 2)
    folded = np.sum(density * np.sinc(every * interval) ** 2, axis=1)
    assert markov_density(frequency, interval, time) / folded == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize(("deviation", "time"), [(1.0, 3.0), (1.0, 30.0)])
def test_a_markov_rate_beside_white_noise_is_told(deviation, time):
    random = np.random.default_rng(3)
    rates = np.sqrt(RATE) * random.standard_normal(SAMPLES) + markov(random, deviation, time)
    (found,) = slow_model(levels_of(rates), highest=0.5 * RATE).rates
    assert found.deviation.low < deviation < found.deviation.high
    assert found.correlation_time.low < time < found.correlation_time.high
    assert found.deviation.high / found.deviation.low < 1.3
    assert found.correlation_time.high / found.correlation_time.low < 2.0


HOURS = 8


def sampled(random, rates):
    """Levels of eight hours at 2 Hz of white noise of one and Markov rates, each at its samples."""
    count = HOURS * 7200
    values = np.sqrt(2.0) * random.standard_normal(count)
    for deviation, time in rates:
        decay = np.exp(-0.5 / time)
        steps = deviation * np.sqrt(1.0 - decay**2) * random.standard_normal(count)
        steps[0] = deviation * random.standard_normal()
        values += lfilter([1.0], [1.0, -decay], steps)
    return robust_levels(tapered_spectrum(values / 2.0, sample_rate=2.0))


TWO = ((3.0, 4.0), (5.0, 100.0))


@pytest.mark.parametrize("seed", [1, 2])
def test_two_markov_rates_are_told_apart(seed):
    found = slow_model(sampled(np.random.default_rng(seed), TWO), highest=0.45)
    assert (found.bias_instability, found.rate_random_walk) == (0.0, 0.0)
    for one, (deviation, time) in zip(found.rates, TWO, strict=True):
        assert one.deviation.value == pytest.approx(deviation, rel=0.1)
        assert one.correlation_time.value == pytest.approx(time, rel=0.25)


@pytest.mark.statistics
@pytest.mark.parametrize("truth", [TWO, TWO[1:], ((3.0, 30.0),)])
def test_as_many_markov_rates_are_found_as_there_are(truth):
    """Hundred times eight hours: a second is seldom given to one, and intervals hold."""
    counts, held = [], []
    for seed in range(100):
        found = slow_model(sampled(np.random.default_rng(seed), truth), highest=0.45)
        counts.append(len(found.rates))
        if len(found.rates) == len(truth):
            for one, (deviation, time) in zip(found.rates, truth, strict=True):
                held.append(one.deviation.low < deviation < one.deviation.high)
                held.append(one.correlation_time.low < time < one.correlation_time.high)
    print(truth, np.bincount(counts), f"{len(held)} intervals hold {np.mean(held):.3f}")
    assert np.mean(np.array(counts) == len(truth)) >= 0.95
    assert np.mean(held) > 0.9


@pytest.mark.parametrize(("flicker", "walk"), [(0.0, 0.0), (1.0, 0.0), (0.0, 0.03), (0.5, 0.01)])
def test_noise_of_the_five_terms_has_no_markov_rate(flicker, walk):
    random = np.random.default_rng(4)
    noise = {"white": 1.0, "flicker": flicker, "walk": walk}
    (rates,) = coloured(random, 1, 7200, **noise)
    found = slow_model(robust_levels(tapered_spectrum(rates[:, 0], sample_rate=1.0)), highest=0.5)
    if not flicker and not walk:
        assert found is None
        return
    assert not found.rates
    if not walk:
        assert found.bias_instability == pytest.approx(flicker, rel=0.25)
    if not flicker:
        assert found.rate_random_walk == pytest.approx(walk, rel=0.25)


def test_it_is_asked_only_where_b_and_k_are_bounds_and_keeps_within_these():
    (rates,) = coloured(np.random.default_rng(4), 1, 7200, white=1.0, flicker=0.0, walk=0.03)
    levels = robust_levels(tapered_spectrum(rates[:, 0], sample_rate=1.0))
    choice = ModelChoice(band_hz=(0.0, 0.5))
    walk = estimate("angle_random_walk", 1.0)
    bound = estimate("rate_random_walk", 0.02, status="upper bound", low=0.0)
    loose = replace(bound, value=0.2, high=0.2)
    names = ("angle_random_walk", "rate_random_walk")

    def found(*estimates):
        return untold(levels, choice, dict(zip(names, estimates, strict=True)))

    assert found(walk, loose).rate_random_walk == pytest.approx(0.03, rel=0.25)
    assert found(walk, bound).rate_random_walk == 0.02
    assert found(walk, replace(loose, status="estimated", low=0.02)) is None
    assert found(replace(walk, status="upper bound"), loose) is None
    assert untold(None, choice, {}) is None


def test_noise_faster_than_the_band_of_n_is_a_part_of_n_and_no_slow_noise_beside_it():
    """A Markov rate of 3 over 0.1 s beside white noise of 1 is level at 1.67 up to 1 Hz."""
    random = np.random.default_rng(3)
    rates = np.sqrt(RATE) * random.standard_normal(SAMPLES) + markov(random, 3.0, 0.1)
    levels, choice = levels_of(rates), ModelChoice(band_hz=(0.0, 0.5 * RATE))
    foot = estimate("angle_random_walk", 1.7)
    top = replace(foot, value=1.0, low=0.9)
    assert untold(levels, choice, {"angle_random_walk": top}).rates
    assert not untold(levels, choice, {"angle_random_walk": foot}).rates


def estimate(name, value, *, status="estimated", low=None):
    low = 0.9 * value if low is None else low
    return Estimate(name=name, value=value, low=low, high=value, confidence=0.95, status=status)


@pytest.mark.parametrize("seed", [5, 7, 8])
def test_k_is_that_of_the_rise_where_the_curve_alone_shows_slow_noise(seed):
    """The note told of it, and what was foretold after ten minutes was a third of the truth."""
    random, rate = np.random.default_rng([11, seed]), 5.0
    walk, slow = np.deg2rad(0.2) / 60.0, np.deg2rad(6.0) / 3600.0 / 60.0
    white, steps = random.standard_normal(36_000), random.standard_normal(36_000)
    rates = walk * np.sqrt(rate) * white + np.cumsum(slow / np.sqrt(rate) * steps)
    recording = Recording.from_arrays(x=rates, kind="rate", unit="rad/s", sample_rate=rate)
    analysis = analyze(recording)
    assert analysis.coefficients["rate_random_walk"].status == "upper bound"
    assert any("slow noise, K or R or B" in note.text for note in analysis.notes)
    stated = json.loads(analysis.to_json())["slow_noise"]["rate_random_walk"]
    assert stated["unit"] == "deg/h/sqrt(h)"
    assert 3.0 < stated["value"] < 12.0


def behind_a_low_pass(seed, walk):
    """`slow_noise` of white noise of one, and a walk of the rate, behind 15 Hz at 100 Hz.

    The low-pass is of first order and analogue, and a sample its mean.
    """
    random, rate, fine, samples = np.random.default_rng(seed), 100.0, 8, 120_000
    decay = np.exp(-2.0 * np.pi * 15.0 / (rate * fine))
    white = np.sqrt(rate * fine) * random.standard_normal(samples * fine)
    passed = lfilter([1.0 - decay], [1.0, -decay], white).reshape(samples, fine).mean(axis=1)
    slow = np.cumsum(walk / np.sqrt(rate) * random.standard_normal(samples))
    recording = Recording.from_arrays(x=passed + slow, kind="rate", unit="deg/h", sample_rate=rate)
    analysis = analyze(recording, method="none")
    told = any(note.text.startswith("slow noise") for note in analysis.notes)
    return told, json.loads(analysis.to_json()).get("slow_noise")


def test_the_fall_of_a_low_pass_is_no_slow_noise():
    """It was taken for B, and `simulate --like` put that in."""
    assert behind_a_low_pass(1, 0.0) == (False, None)


def test_a_walk_behind_a_low_pass_is_no_flicker():
    told, slow = behind_a_low_pass(3, 0.05)
    assert told
    assert slow["bias_instability"]["value"] == 0.0
    # deg/h/sqrt(s); a square root of an hour has sixty of these.
    assert slow["rate_random_walk"]["value"] == pytest.approx(60.0 * 0.05, rel=0.3)
