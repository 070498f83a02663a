"""Step 4 by each of its readings."""

from functools import cache

import numpy as np
import pytest

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.noise.readings import READINGS
from sagnac.recording.model import Recording


@cache
def read_by(name):
    """A still gyro with three lines."""
    time = np.arange(90_000) / 50.0
    walk = np.cumsum(1e-8 * np.random.default_rng(4).standard_normal(time.size))
    angle = walk + sum(1e-6 * np.cos(2.0 * np.pi * place * time) for place in (0.02, 0.05, 0.11))
    recording = Recording.from_arrays(x=angle, kind="angle", unit="rad", sample_rate=50.0)
    return analyze(recording, Settings(method="fos-paper", step_4=READINGS[name]))


@pytest.mark.parametrize("name", list(READINGS))
def test_the_source_says_which_reading_and_the_curve_obeys_it(name):
    """With the noise put back the curve is higher, else as it is left."""
    found, left = read_by(name), read_by(name.removesuffix("-restored"))
    assert READINGS[name].in_words in found.source
    assert found.angle_random_walk.status == "estimated"
    assert found.angle_random_walk.value == pytest.approx(1e-8 * np.sqrt(50.0), rel=0.15)
    back = " ".join(note.text for note in found.notes)
    ratio = found.curve.deviation / left.curve.deviation
    if name.endswith("-restored"):
        assert "; it is added back" in back
        assert ratio.max() > 1.01
    else:
        assert "it is not added back, as in the paper" in back
        assert np.all(ratio == 1.0)


def test_a_fit_that_shows_no_walk_gives_a_bound_and_says_so():
    """Readout noise of 3 urad hides the walk from the fit; the curve bounds it all the same."""
    time = np.arange(6000) / 10.0
    random = np.random.default_rng(6)
    walk = np.cumsum(1e-8 * random.standard_normal(time.size))
    angle = walk + 3e-6 * random.standard_normal(time.size)
    recording = Recording.from_arrays(x=angle, kind="angle", unit="rad", sample_rate=10.0)
    found = analyze(recording, Settings(method="fos-paper"))
    answer = found.angle_random_walk
    assert answer.status == "upper bound"
    assert answer.low == 0.0
    assert answer.value > 1e-8 * np.sqrt(10.0)
    assert any(
        "shows no angle random walk of x: only an upper bound" in n.text for n in found.notes
    )


def bounded(seed, tone=0.0, **choices):
    """A minute at 10 Hz of 1e-6 rad/sqrt(s), too short for Step 4, without tones or with three."""
    time, random = np.arange(600) / 10.0, np.random.default_rng(seed)
    rate = 1e-6 * np.sqrt(10.0) * random.standard_normal(time.size)
    rate += tone * sum(np.cos(2.0 * np.pi * place * time + 1.0) for place in (0.25, 0.35, 0.55))
    recording = Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=10.0)
    found = analyze(recording, Settings(**choices))
    assert found.angle_random_walk.status == "upper bound"
    return found


def test_a_bound_does_not_lack_the_noise_that_went_as_lines():
    """All forty lines of Korenberg's search are noise, a third of all pairs that there are."""
    found = [bounded(seed, method="fos-korenberg") for seed in range(12)]
    assert all(len(one.lines) == 40 for one in found)
    assert sum(one.angle_random_walk.high > 1e-6 for one in found) >= 11


def test_a_line_that_is_one_stays_out_of_the_bound():
    """With the tones in, no cluster time allows less than 2.5 times N; without, they do."""
    found = bounded(5, tone=2e-5, method="fos-paper")
    with_tones = found.curve_before
    used = with_tones.tau >= 1.0
    assert min(with_tones.deviation[used] * np.sqrt(with_tones.tau[used])) > 2.5e-6
    assert 1e-6 < found.angle_random_walk.high < 2e-6
