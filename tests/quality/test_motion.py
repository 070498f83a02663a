"""Units that a hand turns between stretches at rest, as for a calibration: no still bench."""

import re

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from sagnac import Recording, analyze, check

RATE, SAMPLES = 100.0, 16_000
# A turn by hand of 30 deg/s that lasts about a second, deg/s.
TURN = 30.0 * np.exp(-((np.arange(-150, 151) / 60.0) ** 2))


def trembling(random, samples):
    """What a hand does besides, to 10 Hz, deg/s."""
    return lfilter(*butter(2, 10.0, fs=RATE), 40.0 * random.standard_normal(samples))


def turned_by_hand(seed=1):
    """Rates of x and y, deg/s: noise, a turn every 2 s from 10 to 110 s, six slow ones after."""
    random = np.random.default_rng(seed)
    rates = 0.05 * random.standard_normal((2, SAMPLES))
    for middle in range(1000, 11_000, 200):
        sizes = random.uniform(1.0, 3.0, 2) * random.choice([-1.0, 1.0], 2)
        rates[:, middle - 150 : middle + 151] += np.outer(sizes, TURN)
    rates[:, 1000:10_850] += [trembling(random, 9850) for _ in "xy"]
    for middle in range(13_000, 14_200, 200):
        rates[:, middle - 150 : middle + 151] += TURN / 5.0
    return rates


def recorded(rates, start=0, stop=None):
    x, y = rates[:, start:stop]
    return Recording.from_arrays(x=x, y=y, kind="rate", unit="deg/s", sample_rate=RATE)


@pytest.mark.parametrize("seed", range(5))
def test_the_stretch_that_is_called_sound_is_sound(seed):
    """Turns that do not stand out beside those of the most of the record are none of it either."""
    rates = turned_by_hand(seed)
    found = [note for note in check(recorded(rates)) if note.name == "motion"]
    assert [note.channel for note in found] == ["x", "y"]
    for note in found:
        start, stop = re.search(r"\{slice ([\d.]+):([\d.]*)\}", note.text).groups()
        first, after = round(float(start) * RATE), round(float(stop or SAMPLES / RATE) * RATE)
        # Between the fast turns and the slow ones, or after these.
        assert 1500 < after - first < 2500
        names = [one.name for one in check(recorded(rates, first, after))]
        assert "motion" not in names


def test_a_recording_without_rest_names_no_stretch():
    time = np.arange(SAMPLES) / RATE
    rates = np.stack([30.0 * np.sin(2.0 * np.pi * 0.8 * time), 20.0 * np.sin(0.9 * time)])
    rates += 0.05 * np.random.default_rng(1).standard_normal(rates.shape)
    found = [note for note in check(recorded(rates)) if note.name == "motion"]
    assert found
    assert all(note.text.endswith("or record at rest") for note in found)


@pytest.mark.parametrize("seed", range(5))
def test_axes_that_a_hand_turns_together_are_no_copies(seed):
    """A hand turns y 40 ms after x, as about an oblique axis, and is never still."""
    hand = trembling(np.random.default_rng(seed), SAMPLES + 4)
    rates = np.stack([hand[4:], 0.5 * hand[:-4]]) + turned_by_hand(seed)
    assert {note.name for note in check(recorded(rates)) if note.level != "remark"} == {"motion"}


def test_nothing_is_said_of_a_walk_that_is_not_given():
    """Neither that it is steady nor how slow noise lies beside it, nor that axes are copies."""
    hand = trembling(np.random.default_rng(1), SAMPLES + 4)
    rates = np.stack([hand[4:], 0.5 * hand[:-4]]) + turned_by_hand()
    analysis = analyze(recorded(rates))
    assert {one.status for one in analysis.per_gyro.values()} == {"not observable"}
    for one in analysis.gyros.values():
        assert {note.name for note in one.findings if note.level != "remark"} == {"motion"}
        said = " ".join(note.text for note in one.notes)
        assert not re.search("angle random walk|slow noise|falls to half", said), said


@pytest.mark.parametrize(
    ("walk", "bias", "rate", "corner"),
    [(0.2, 3.0, 1000.0, 10.0), (0.2, -4.0, 1000.0, 10.0), (0.3, 12.0, 100.0, 5.0)],
)
def test_a_bias_behind_a_low_pass_costs_no_answer(walk, bias, rate, corner):
    """Steps between samples are a twelfth of the noise there, and told of a table."""
    white = walk / 60.0 * np.sqrt(rate) * np.random.default_rng(3).standard_normal(int(122 * rate))
    still = lfilter(*butter(2, corner, fs=rate), white)[int(2 * rate) :] + bias
    made = Recording.from_arrays(x=still, kind="rate", unit="deg/s", sample_rate=rate)
    assert [one.level for one in check(made) if one.name == "motion"] == ["warning"]
    answer = analyze(made).angle_random_walk.to("deg/sqrt(h)")
    assert answer.status == "estimated"
    assert answer.low < walk < answer.high
    # A fibre gyro of a twentieth of the noise has no such bias, filtered or not.
    for values in (still, white):
        quiet = 0.05 * (values - np.mean(values)) + bias
        made = Recording.from_arrays(x=quiet, kind="rate", unit="deg/s", sample_rate=rate)
        assert [one.level for one in check(made) if one.name == "motion"] == ["error"]
