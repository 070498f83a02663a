"""A counter of the angle, read out as a rate, adds no noise to N; steps of a rate do."""

import numpy as np
import pytest
from scipy import signal

from sagnac import Recording, analyze, check

RATE, SAMPLES = 100.0, 60_000
STEP = 1e-4  # deg of a counter of the angle, deg/s of a rate


def still(values):
    return Recording.from_arrays(x=values, kind="rate", unit="deg/s", sample_rate=RATE)


def names(values):
    return {note.name for note in check(still(values)) if note.level != "remark"}


def of_counter(sigma, turn, rng):
    """deg/s by what a counter advanced; noise and turn of a sample in counts."""
    angle = np.cumsum(sigma * rng.standard_normal(SAMPLES) + turn)
    return np.diff(np.floor(angle), prepend=0.0) * STEP * RATE


@pytest.mark.parametrize("turn", [0.013, 3.31])
@pytest.mark.parametrize("sigma", [0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0, 1.3])
def test_counts_of_an_angle_are_no_coarse_rate(sigma, turn):
    assert not names(of_counter(sigma, turn, np.random.default_rng(2)))


@pytest.mark.parametrize("draws", [1, pytest.param(3, marks=pytest.mark.statistics)])
@pytest.mark.parametrize("sigma", [0.2, 0.45, 0.8, 1.3])
def test_an_answer_by_counts_of_an_angle_is_divided_by_nothing(sigma, draws):
    """N came out 3 to 7 % low within 2 to 4 %, and was refused below 0.7 counts of noise."""
    truth = sigma * STEP * np.sqrt(RATE) * 60.0
    ratios, held = [], 0
    for seed in range(draws):
        walk = analyze(still(of_counter(sigma, 0.37, np.random.default_rng([seed, 5]))))
        estimate = walk.angle_random_walk.to("deg/sqrt(h)")
        assert estimate.status == "estimated"
        ratios.append(estimate.value / truth)
        held += estimate.low <= truth <= estimate.high
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.02)
    assert held >= max(draws - 1, 1)


@pytest.mark.parametrize("sigma", [1.6, 2.0])
def test_fine_counts_of_a_rate_are_taken_off(sigma):
    """Sheppard: steps add a twelfth of their square. It raised N by 1 to 2 % without a word."""
    rng = np.random.default_rng([3, int(10 * sigma)])
    samples = 4 * SAMPLES
    found = check(still(STEP * np.rint(0.3 + sigma * rng.standard_normal(samples))))
    (note,) = (note for note in found if note.name == "resolution")
    assert note.level == "remark"
    assert note.effect == pytest.approx(np.sqrt(1.0 + 1.0 / (12.0 * sigma**2)), abs=0.002)
    assert not [
        note for note in check(still(of_counter(sigma, 0.37, rng))) if note.name == "resolution"
    ]


@pytest.mark.parametrize("draws", [2, pytest.param(20, marks=pytest.mark.statistics)])
def test_an_answer_by_fine_counts_of_a_rate_holds(draws):
    """Of 12 intervals none held N, which was 1.7 % high."""
    sigma, samples = 1.6, 4 * SAMPLES
    truth = sigma * STEP / np.sqrt(RATE) * 60.0
    ratios, held = [], 0
    for seed in range(draws):
        rng = np.random.default_rng([seed, 15])
        rate = still(STEP * np.rint(0.3 + sigma * rng.standard_normal(samples)))
        estimate = analyze(rate).angle_random_walk.to("deg/sqrt(h)")
        knowing = analyze(rate, accepted=("resolution",)).angle_random_walk
        assert estimate.value < 0.99 * knowing.to("deg/sqrt(h)").value
        ratios.append(estimate.value / truth)
        held += estimate.low <= truth <= estimate.high
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.012 / np.sqrt(draws))
    assert held >= 0.9 * draws


def hum(seconds):
    return 0.3 * np.sin(2.0 * np.pi * 31.7 * seconds)


@pytest.mark.parametrize("sigma", [0.2, 0.3, 0.45, 0.8, 1.0])
def test_steps_of_a_rate_are_found(sigma):
    rng = np.random.default_rng(4)
    noise = 0.3 + sigma * rng.standard_normal(SAMPLES)
    assert names(STEP * np.rint(noise)) == {"resolution"}
    assert "resolution" in names(STEP * np.rint(noise + hum(np.arange(SAMPLES) / RATE)))


@pytest.mark.parametrize("sigma", [0.2, 0.7])
def test_steps_of_a_rate_of_rising_noise_are_found(sigma):
    """Noise of the angle of 0.3 to 0.5 steps alone passes for the errors of a counter."""
    rng = np.random.default_rng(6)
    blue = sigma / np.sqrt(2.0) * np.diff(rng.standard_normal(SAMPLES + 1))
    rate = STEP * np.rint(0.3 + blue + 0.05 * rng.standard_normal(SAMPLES))
    assert "resolution" in names(rate)


def behind_a_low_pass(order, cut, sigma, rng):
    """Noise in steps behind a Butterworth filter, cut in sample rates, and what N of it is."""
    taps = signal.butter(order, cut, fs=1.0)
    noise = signal.lfilter(*taps, rng.standard_normal(SAMPLES + 2000))[2000:]
    return sigma / noise.std() * noise, sigma / noise.std()


@pytest.mark.parametrize("draws", [1, pytest.param(10, marks=pytest.mark.statistics)])
@pytest.mark.parametrize(
    ("order", "cut", "sigma"), [(2, 0.05, 1.0), (2, 0.05, 0.67), (1, 0.03, 1.0), (2, 0.1, 0.8)]
)
def test_noise_behind_a_low_pass_dithers_steps(order, cut, sigma, draws):
    """It changes by less than a step from sample to sample, and had no answer."""
    held = 0
    for seed in range(draws):
        noise, size = behind_a_low_pass(order, cut, sigma, np.random.default_rng([seed, order]))
        rate = still(STEP * np.rint(0.3 + noise))
        effects = [note.effect for note in check(rate) if note.name == "resolution"]
        # What steps add where the filter lets all through, by the transform of their errors.
        errors, alone = (
            np.sum(np.abs(np.fft.rfft(each)[10 : SAMPLES // 200]) ** 2)
            for each in (np.rint(0.3 + noise) - noise, noise)
        )
        added = np.sqrt(1.0 + errors / alone)
        assert added - 0.003 < max(effects, default=1.0) < 1.05
        estimate = analyze(rate).angle_random_walk.to("deg/sqrt(h)")
        truth = size * STEP / np.sqrt(RATE) * 60.0
        assert estimate.status == "estimated"
        assert estimate.value == pytest.approx(truth, rel=0.15)
        held += estimate.low <= truth <= estimate.high
    assert held >= 0.9 * draws


def markov(seconds, sigma, rng):
    kept = np.exp(-1.0 / (seconds * RATE))
    steps = sigma * np.sqrt(1.0 - kept**2) * rng.standard_normal(SAMPLES)
    return signal.lfilter([1.0], [1.0, -kept], steps)


@pytest.mark.parametrize("seconds", [1.0, 10.0])
def test_slow_noise_that_dithers_steps_hides_a_quiet_gyro(seconds):
    """What is level is then the white noise of steps: it would be read as N, six times too high."""
    rng = np.random.default_rng(7)
    quiet = 0.05 * rng.standard_normal(SAMPLES)
    assert "resolution" in names(STEP * np.rint(quiet + markov(seconds, 2.0, rng)))


@pytest.mark.parametrize(("order", "cut"), [(1, 0.03), (2, 0.04), (1, 0.06)])
@pytest.mark.parametrize("sigma", [0.1, 0.2, 0.3, 0.4])
def test_noise_of_two_counts_behind_a_low_pass_is_coarse(order, cut, sigma):
    noise, _ = behind_a_low_pass(order, cut, sigma, np.random.default_rng(8))
    (found,) = (
        note for note in check(still(STEP * np.rint(0.5 + noise))) if note.name == "resolution"
    )
    assert (found.level, found.effect) == ("error", None)
