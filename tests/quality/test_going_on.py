"""What no gyro at rest does: values that add up, a dead band, a record that goes round."""

import numpy as np
import pytest
from scipy.signal import lfilter

from sagnac import Recording, analyze, check, judge

RATE, SAMPLES = 100.0, 30_000
# White noise of 0.15 deg/sqrt(h), deg/s.
SIGMA = 0.15 / 60.0 * np.sqrt(RATE)


def white(seed=1, samples=SAMPLES):
    return SIGMA * np.random.default_rng(seed).standard_normal(samples)


def still(values, kind="rate", unit="deg/s"):
    return Recording.from_arrays(x=values, kind=kind, unit=unit, sample_rate=RATE)


def findings(values, name, **stated):
    return [note for note in check(still(values, **stated)) if note.name == name]


def decided(values):
    """Beside a limit that noise of 0.15 deg/sqrt(h) breaks."""
    return judge(analyze(still(values)), "0.12deg/sqrt(h)").decision


def test_an_angle_that_is_called_a_rate_passes_no_limit():
    angle = np.cumsum(white()) / RATE
    (found,) = findings(angle, "units")
    assert "as an angle does" in found.text
    assert decided(angle) == "undecided"
    assert not findings(angle, "units", kind="angle", unit="deg")


@pytest.mark.parametrize("walk", [0.0, 0.02])
@pytest.mark.parametrize("corner", [None, 1.0, 0.2])
def test_a_rate_is_no_angle(walk, corner):
    """White, or behind a low-pass (Hz), on a rate that walks as far as cheap ones do, deg/s/√s."""
    steps = walk / np.sqrt(RATE) * np.random.default_rng(2).standard_normal(SAMPLES)
    rate = white() + np.cumsum(steps)
    if corner is not None:
        kept = np.exp(-2.0 * np.pi * corner / RATE)
        rate = lfilter([1.0 - kept], [1.0, -kept], rate)
    if not (walk and corner):
        assert not findings(rate, "units")


@pytest.mark.parametrize("rounded", [0.0, SIGMA / 20.0])
@pytest.mark.parametrize("width", [0.5, 1.0, 2.0, 3.0])
def test_a_dead_band_of_any_width_is_found(width, rounded):
    rate = np.where(np.abs(white()) < width * SIGMA, 0.0, white())
    if rounded:
        rate = rounded * np.rint(rate / rounded)
    (found,) = findings(rate, "dropouts")
    assert "dead band" in found.text
    # Without the zeros the samples scatter as much more as there are fewer of them; of the widest
    # band eighty are left, whose mean is good to a tenth of that.
    assert found.effect == pytest.approx(np.sqrt(np.mean(rate != 0.0)), rel=0.05)
    assert found.level == "error"


@pytest.mark.parametrize("width", [0.5, 3.0])
def test_a_dead_band_passes_no_limit(width):
    assert decided(np.where(np.abs(white()) < width * SIGMA, 0.0, white())) == "undecided"


@pytest.mark.parametrize("sigma", [0.2, 0.3, 0.5, 1.0, 5.0])
def test_coarse_counts_are_no_dead_band(sigma):
    counts = np.rint(sigma * np.random.default_rng(3).standard_normal(SAMPLES))
    assert not findings(counts, "dropouts")


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("sigma", [0.3, 0.6, 1.0, 2.0, 3.0, 30.0, 100.0])
def test_counts_of_an_angle_made_a_rate_are_no_dead_band(sigma, seed):
    """Rounding makes many values of what was one count."""
    walk = np.cumsum(sigma * np.random.default_rng(seed).standard_normal(SAMPLES + 1))
    assert not findings(np.diff(np.rint(walk) * 2e-4) * RATE, "dropouts")


@pytest.mark.parametrize("size", [2.2, 7.0 / 3.0, 2.6])
def test_counts_of_pulses_are_no_dead_band(size):
    """A ring laser adds up pulses of some counts each; few samples lie a single count from zero."""
    rng = np.random.default_rng(4)
    pulses = np.rint(3.0 * rng.standard_normal(SAMPLES)) * (rng.random(SAMPLES) > 0.4)
    angle = np.rint(size * np.cumsum(pulses) + 0.1 * rng.standard_normal(SAMPLES))
    assert not findings(np.diff(angle), "dropouts")


def going_round(times):
    return np.tile(white(samples=SAMPLES // times), times)


@pytest.mark.parametrize("decimals", [None, 3, 4, 6])
@pytest.mark.parametrize("corner", [None, 10.0, 2.0])
def test_no_sample_of_sound_noise_is_filled(corner, decimals):
    kept = 0.0 if corner is None else np.exp(-2.0 * np.pi * corner / RATE)
    for seed in range(5):
        rate = lfilter([1.0 - kept], [1.0, -kept], white(seed))
        rate = rate if decimals is None else np.round(rate, decimals)
        assert not findings(rate, "repeats")
        assert not findings(rate.astype(np.float32).astype(float), "repeats")


def test_gaps_that_are_filled_behind_a_low_pass_are_named_and_move_nothing():
    kept = np.exp(-2.0 * np.pi * 10.0 / RATE)
    rate, place = lfilter([1.0 - kept], [1.0, -kept], white()), np.arange(SAMPLES)
    there = np.random.default_rng(2).random(SAMPLES) > 0.02
    (found,) = findings(np.interp(place, place[there], rate[there]), "repeats")
    assert "straight line" in found.text
    assert found.level == "warning"
    assert found.effect == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("decimals", [None, 5])
@pytest.mark.parametrize("times", [2, 3])
def test_a_rate_that_was_raised_by_straight_lines_is_of_one_sensor_and_keeps_n(times, decimals):
    slow = white(samples=SAMPLES // times + 1) / np.sqrt(times)
    values = np.interp(np.arange(SAMPLES) / times, np.arange(slow.size), slow)
    values = values if decimals is None else np.round(values, decimals)
    assert not findings(values, "interleaved")
    (found,) = findings(values, "repeats")
    assert "faster than it measures" in found.text
    answer = analyze(still(values)).angle_random_walk.to("deg/sqrt(h)")
    assert answer.low < 0.15 < answer.high


@pytest.mark.parametrize("times", [2, 3.4, 4, 5, 8, 9.3, 25])
def test_a_rate_of_which_each_sample_is_held_is_told_so_and_keeps_n(times):
    slow = white(samples=int(SAMPLES / times) + 2) / np.sqrt(times)
    values = slow[(np.arange(SAMPLES) / times).astype(int)]
    (found,) = findings(values, "repeats")
    assert "faster than it measures" in found.text
    assert found.level == "warning"
    answer = analyze(still(values)).angle_random_walk.to("deg/sqrt(h)")
    assert answer.low < 0.15 < answer.high


@pytest.mark.parametrize("dithered", [0.0, 0.02])
@pytest.mark.parametrize("kind", ["rate", "angle"])
def test_counts_that_stay_the_same_for_some_samples_are_not_held(kind, dithered):
    """A drift that coarse counts follow: each value stands for five samples or about as many."""
    ramp = 0.2 * np.arange(SAMPLES) + dithered * white() / SIGMA
    values = np.rint(ramp if kind == "angle" else ramp**2 / 1e6)
    unit = "arcsec" if kind == "angle" else "deg/h"
    assert not findings(values, "repeats", kind=kind, unit=unit)


def test_a_rate_that_sticks_at_its_extreme_by_chance_too_is_not_at_a_limit():
    """One stretch in two sticks for 20 samples, one of them at the largest value there is."""
    values, sticks = white(), np.random.default_rng(6).random(SAMPLES // 20) < 0.5
    rows = values.reshape(-1, 20)
    rows[sticks] = rows[sticks, :1]
    rows[values.argmin() // 20] = values.min()
    (found,) = findings(values, "repeats")
    assert "sticks" in found.text
    assert found.level == "error"
    assert not findings(values, "clipping")


@pytest.mark.parametrize("step", [0.0, 0.1 * SIGMA])
def test_a_rate_that_is_clipped_is_at_a_limit(step):
    """Counts repeat themselves as well, and more often than they are at the limit."""
    values = np.minimum(white(), 2.5 * SIGMA)
    (found,) = findings(np.round(values / step) * step if step else values, "clipping")
    assert "upper limit" in found.text


def test_samples_of_two_sensors_by_turns_are_found():
    values = white()
    values[::2] *= 0.6
    (found,) = findings(values, "interleaved")
    assert found.level == "error"


@pytest.mark.parametrize("times", [2, 5, 10])
def test_a_record_that_goes_round_is_found(times):
    (found,) = [n for n in findings(going_round(times), "repeats") if "there again" in n.text]
    assert found.level == "error"


@pytest.mark.parametrize(
    "times", [2, *(pytest.param(times, marks=pytest.mark.statistics) for times in (5, 10))]
)
def test_a_record_that_goes_round_gives_no_estimate(times):
    assert decided(going_round(times)) == "undecided"


def test_a_short_block_twice_moves_the_answer_by_little():
    values = white()
    values[-3000:] = values[:3000]
    (found,) = [note for note in findings(values, "repeats") if "there again" in note.text]
    assert found.level == "warning"
    assert decided(values) == "fail"


@pytest.mark.parametrize(("middle", "says"), [(32_768, True), (32_429, True), (25_000, False)])
def test_counts_from_half_of_their_range_are_let_in(middle, says):
    """As an analog-to-digital converter writes them: 0 deg/s is 32768 of 16 bits, and a bias."""
    counts = np.rint(20.0 * white() / SIGMA) + middle
    (found,) = findings(counts, "motion", unit=f"{SIGMA / 20.0}deg/s")
    assert ("half of a range of 16 bits" in found.text) == says
    accepted = analyze(still(counts, unit=f"{SIGMA / 20.0}deg/s"), accepted=("motion",))
    # Of these very samples.
    walk = 60.0 * np.std(white()) / np.sqrt(RATE)
    assert accepted.angle_random_walk.to("deg/sqrt(h)").value == pytest.approx(walk, rel=0.01)
