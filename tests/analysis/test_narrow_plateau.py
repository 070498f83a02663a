"""White noise behind a low-pass far below half the sample rate, in short records."""

import numpy as np
import pytest
from scipy.signal import butter, firwin, lfilter, sosfilt

from sagnac.analysis.pipeline import analyze
from sagnac.quality.check import judged
from sagnac.recording.model import Recording

RATE, WALK, RUN_IN = 100.0, 3e-6, 2000
FILTERS = {
    "FIR at a twentieth": lambda white: lfilter(firwin(61, 0.05, fs=1.0), 1.0, white),
    "FIR at a seventh": lambda white: lfilter(firwin(61, 0.15, fs=1.0), 1.0, white),
    "Butterworth at a fiftieth": lambda white: sosfilt(
        butter(4, 0.02, fs=1.0, output="sos"), white
    ),
}


def behind(name, seed, samples):
    white = np.random.default_rng(seed).standard_normal(samples + RUN_IN)
    values = WALK * np.sqrt(RATE) * FILTERS[name](white)[RUN_IN:]
    return Recording.from_arrays(x=values, kind="rate", unit="rad/s", sample_rate=RATE)


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.statistics) for seed in (1, 2))]
)
def test_a_plateau_of_few_bins_is_read_and_no_vibration(name, seed):
    found = analyze(behind(name, seed, 3000))
    walk = found.angle_random_walk
    assert walk.status == "estimated"
    assert walk.low < WALK < walk.high
    assert [note.text for note in found.notes if note.level != "remark"] == []


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("samples", [1000, 3000, 10_000])
def test_noise_behind_a_low_pass_is_steady(name, samples):
    for seed in range(4):
        found = judged(behind(name, seed, samples))
        assert "unsteady" not in {note.name for note in found}


@pytest.mark.parametrize("name", FILTERS)
def test_noise_behind_a_low_pass_that_grows_loud_is_not(name):
    # A fifth of it is three times as loud.
    for seed in range(4):
        sound = behind(name, seed, 30_000)
        values = sound["x"].values.copy()
        values[12_000:18_000] *= 3.0
        loud = Recording.from_arrays(x=values, kind="rate", unit="rad/s", sample_rate=RATE)
        assert "unsteady" in {note.name for note in judged(loud)}
