"""A unit at rest that is moved for a moment: the answer goes without, and says so."""

import numpy as np
import pytest
from scipy.signal import lfilter

from sagnac import Recording, analyze, check
from sagnac.quality.distribution import find_bumps, without_bumps

RATE, SAMPLES = 100.0, 60_000
WALK = 0.1  # deg/sqrt(h)
SIGMA = WALK / 60.0 * np.sqrt(RATE)  # deg/s


def recording(rate):
    return Recording.from_arrays(x=rate, kind="rate", unit="deg/s", sample_rate=RATE)


def noise(seed=1):
    return SIGMA * np.random.default_rng(seed).standard_normal(SAMPLES)


def bump(seconds, height):
    return height * SIGMA * np.hanning(round(seconds * RATE))


@pytest.mark.parametrize(("seconds", "height"), [(0.3, 40.0), (1.0, 10.0), (3.0, 40.0)])
def test_a_nudge_is_found_and_the_answer_goes_without(seconds, height):
    """A turn of 0.02 to 1 deg: N was up to forty times too large."""
    moved = noise()
    shape = bump(seconds, height)
    moved[31_000 : 31_000 + shape.size] += shape
    (found,) = [note for note in check(recording(moved)) if note.name == "moved"]
    assert found.level == "warning"
    assert "the first at 3" in found.text
    analysis = analyze(recording(moved))
    walk = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert walk.status == "estimated"
    assert walk.low <= WALK <= walk.high
    assert walk.high < 1.03 * WALK
    assert [note.channel for note in analysis.findings if note.name == "moved"] == ["x"]


def flicker(rng):
    """A sum of Markov processes over four decades, as large as the noise of a second."""
    total = np.zeros(SAMPLES)
    for time in np.geomspace(0.1, 1000.0, 9):
        kept = np.exp(-1.0 / (RATE * time))
        steps = np.sqrt(1.0 - kept**2) * rng.standard_normal(SAMPLES)
        total += lfilter([1.0], [1.0, -kept], steps)
    return total / total.std()


def telegraph(rng):
    """Two levels, which change every twenty seconds on average."""
    return np.where(np.cumsum(rng.random(SAMPLES) < 1.0 / (20.0 * RATE)) % 2 == 0, 0.5, -0.5)


def bursts(rng):
    """Moments of ten times the noise, a few in a minute: they are the noise."""
    louder = rng.random(SAMPLES // 50) < 0.02
    return 3.0 * np.repeat(louder, 50) * rng.standard_normal(SAMPLES)


SOUND = {
    "white": lambda rng: 0.0,
    "flicker": flicker,
    "walk": lambda rng: np.cumsum(rng.standard_normal(SAMPLES)) / 100.0,
    "telegraph": telegraph,
    "bursts": bursts,
    "student": lambda rng: rng.standard_t(3.0, SAMPLES),
    "hum": lambda rng: 3.0 * np.sin(2.0 * np.pi * 0.7 * np.arange(SAMPLES) / RATE),
    "warm-up": lambda rng: 30.0 * np.exp(-np.arange(SAMPLES) / RATE / 100.0),
    "coarse": lambda rng: np.rint(5.0 * rng.standard_normal(SAMPLES)),
}


@pytest.mark.parametrize("draws", [1, pytest.param(3, marks=pytest.mark.statistics)])
@pytest.mark.parametrize("name", SOUND)
def test_noise_of_a_gyro_that_nobody_moved_is_no_bump(name, draws):
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        rate = noise(seed) + SIGMA * SOUND[name](rng)
        assert "moved" not in {note.name for note in check(recording(rate))}


def test_spikes_elsewhere_hide_no_nudge():
    moved = noise()
    moved[31_000:31_100] += bump(1.0, 40.0)
    moved[[5000, 17_000, 41_000, 52_000]] += 900.0 * SIGMA
    assert {"moved", "spikes"} <= {note.name for note in check(recording(moved))}
    walk = analyze(recording(moved)).angle_random_walk.to("deg/sqrt(h)")
    assert walk.low <= WALK <= walk.high
    assert walk.high < 1.05 * WALK


def test_a_slow_recording_names_the_time_that_was_looked_at():
    slow = 0.02 * np.random.default_rng(2).standard_normal(2000)
    slow[1000:1008] += 1.0
    still = Recording.from_arrays(x=slow, kind="rate", unit="deg/h", sample_rate=2.0)
    (found,) = [note for note in check(still) if note.name == "moved"]
    assert "within 4 s" in found.text


def test_an_accelerometer_is_told_nothing_of_degrees():
    force = 9.81 + 1e-3 * np.random.default_rng(3).standard_normal(SAMPLES)
    force[31_000:31_100] += 0.04 * np.hanning(100)
    axis = Recording.from_arrays(az=force, kind="rate", unit="m/s^2", sample_rate=RATE)
    assert "moved" not in {note.name for note in analyze(axis).findings}


def test_a_nudge_is_replaced_by_noise_and_by_no_other_nudge():
    noise = 1e-6 * np.random.default_rng(12).standard_normal(60_000)
    pushed = noise.copy()
    for second in (1, 5):
        pushed[100 * second : 100 * second + 100] += 1e-4
    found = find_bumps(pushed, sample_rate=100.0)
    cleaned = without_bumps(pushed, found)
    assert len(found.stretches) == 2
    assert np.abs(cleaned).max() < 6e-6
    assert cleaned[:800].std() == pytest.approx(1e-6, rel=0.1)


@pytest.mark.parametrize("kind", ["rate", "increment", "angle"])
def test_a_nudge_turns_by_as_much_whatever_a_sample_is(kind):
    """The note on a rate at 100 Hz named a turn a hundred times as large."""
    moved = noise()
    moved[31_000:31_100] += 0.3  # deg/s, for a second
    values = {"rate": moved, "increment": moved / RATE, "angle": np.cumsum(moved) / RATE}[kind]
    unit = "deg/s" if kind == "rate" else "deg"
    still = Recording.from_arrays(x=values, kind=kind, unit=unit, sample_rate=RATE)
    (found,) = [note for note in check(still) if note.name == "moved"]
    assert "turns by 0.3 deg within 1 s" in found.text


def test_an_answer_that_keeps_nudges_does_not_say_that_it_goes_without():
    """The check finds six loud seconds of 600, the answer too many of 599 and keeps them."""
    rng = np.random.default_rng([1, 2])
    moved = noise(1)
    for place, height in zip(range(6030, 54_030, 6000), [12.0] * 6 + [9.0] * 2, strict=True):
        moved[place : place + 100] += height * SIGMA * rng.choice([-1, 1]) * 0.9 ** np.arange(100)
    assert "moved" in {note.name for note in check(recording(moved))}
    analysis = analyze(recording(moved))
    walk = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert walk.low < WALK < walk.high
    assert "moved" not in {note.name for note in analysis.findings}
