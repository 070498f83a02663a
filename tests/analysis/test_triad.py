"""Each gyro of a triad alone, by every sample of their differences."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt
from scipy.stats import binom

from sagnac.analysis import measurement
from sagnac.analysis.pipeline import analyze
from sagnac.analysis.verdict import judge
from sagnac.core.errors import RecordingError
from sagnac.core.units import DEGREE_PER_ROOT_HOUR
from sagnac.recording.model import Recording
from tests.instruments import Readout, turntable

WALK = 1e-3  # deg/sqrt(h)
RATE = 100.0


def triad(seed: int, *, hum: float = 0.0) -> Recording:
    """Ten minutes read out in steps coarser than what the noise moves from sample to sample.

    Gyro y hums about 20 Hz by so many arcsec rms, which no law of the noise describes.
    """
    made = turntable(seed, sample_rate=RATE, walk=WALK, readout=Readout(step=0.02), jitter=0.01)
    angles = dict(made.angles)
    white = np.random.default_rng(seed + 1000).standard_normal(angles["y"].size)
    humming = sosfilt(butter(2, (15.0, 25.0), "bandpass", fs=RATE, output="sos"), white)
    angles["y"] = angles["y"] + hum * humming / np.std(humming)
    return Recording.from_arrays(
        **angles, table=made.encoder, kind="angle", unit="arcsec", sample_rate=RATE
    )


@pytest.mark.parametrize("draws", [3, pytest.param(20, marks=pytest.mark.statistics)])
def test_each_gyro_is_known_nearly_as_well_as_a_pair(draws):
    """Of white noise and steps in all three, sqrt(5/2) times the error of a pair by Fisher."""
    wider, held = [], []
    for seed in range(draws):
        found = analyze(triad(seed))
        pair = found.angle_random_walk
        for own in found.per_gyro.values():
            low, high = own.low / DEGREE_PER_ROOT_HOUR, own.high / DEGREE_PER_ROOT_HOUR
            held.append(low < WALK < high)
            wider.append((own.high - own.low) / (pair.high - pair.low))
    # Fewer hold once in a thousand times at 95 %.
    assert sum(held) >= binom.ppf(1e-3, len(held), 0.95)
    assert np.median(wider) < 1.2 * np.sqrt(2.5)


def test_noise_of_one_that_no_law_describes_is_not_fitted():
    ratios = []
    for seed in range(3):
        own = analyze(triad(seed, hum=0.05)).per_gyro["y"]
        assert own.low / DEGREE_PER_ROOT_HOUR < WALK < own.high / DEGREE_PER_ROOT_HOUR
        ratios.append(own.value / DEGREE_PER_ROOT_HOUR / WALK)
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.1)


def test_a_triad_does_not_pass_by_the_pair_of_two_of_its_gyros():
    """Where its gyros were not told apart, it passed if the first and the last did."""
    found, limit = analyze(triad(0)), "0.002deg/sqrt(h)"
    assert judge(found, limit).by_gyro == dict.fromkeys("xyz", "pass")
    together = judge(replace(found, per_gyro={}), limit)
    assert together.by_gyro == {"x-z": "pass", "y": "undecided"}
    assert together.decision == "undecided"
    pair = analyze(triad(0), gyros=("x", "z"))
    assert judge(pair, limit).by_gyro == {"x-z": "pass"}


@pytest.mark.parametrize(
    ("copy", "of", "said"), [("y", "x", "x-y: holds no noise"), ("z", "x", "x-z: holds no noise")]
)
def test_a_gyro_that_is_the_first_again_is_refused(copy, of, said):
    sound = triad(0)
    values = {one.name: one.values for one in sound.gyros}
    values[copy] = values[of]
    twice = Recording.from_arrays(
        **values,
        table=sound.table.values,
        table_unit="rad",
        kind="angle",
        unit="rad",
        sample_rate=RATE,
    )
    with pytest.raises(RecordingError, match=said):
        analyze(twice)


def test_a_triad_one_of_whose_searches_does_not_end_says_why_no_gyro_is_told_apart(monkeypatch):
    whole = measurement.remainder_of

    def stopped(measured, *beside):
        left = whole(measured, *beside)
        if measured.channel == "x-y":
            unfinished = replace(left.removal, unfinished=left.removal.residual)
            left = replace(left, removal=unfinished)
        return left

    monkeypatch.setattr(measurement, "remainder_of", stopped)
    found = analyze(triad(0))
    assert found.angle_random_walk.status == "estimated"
    assert {own.status for own in found.per_gyro.values()} == {"not observable"}
    (note,) = [note for note in found.notes if "of each gyro alone" in note.text]
    assert note.channel == "x-y"
    assert "did not come to an end" in note.text
