"""Each effect that is announced, measured: the recording with the fault beside the one without."""

from collections.abc import Callable
from functools import cache, partial

import numpy as np
import pytest

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.noise.estimates import Estimate
from sagnac.recording.model import Recording
from tests.instruments import Bench, Floats, Readout, bench
from tests.quality.pathologies import with_held

SCATTER = 0.3 / 60.0 * np.sqrt(200.0)  # deg/s


def recorded(made: Bench) -> Recording:
    return Recording.from_arrays(
        kind="rate", unit="deg/s", sample_rate=made.sample_rate, x=made.rates["x"]
    )


def rounded(step: float) -> Callable[[Floats], Floats]:
    return lambda rate: step * SCATTER * np.rint(rate / (step * SCATTER))


def bent(limit: float) -> Callable[[Floats], Floats]:
    """A soft limit, in scatters, about the mean."""
    size = limit * SCATTER
    return lambda rate: rate.mean() + size * np.tanh((rate - rate.mean()) / size)


def clipped(limit: float) -> Callable[[Floats], Floats]:
    return lambda rate: np.clip(rate, rate.mean() - limit * SCATTER, rate.mean() + limit * SCATTER)


def lost(share: float, offset: float) -> Callable[[Floats], Floats]:
    """Zeros in the place of readings about `offset`, in scatters."""

    def change(rate: Floats) -> Floats:
        read = rate - rate.mean() + offset * SCATTER
        return np.where(np.random.default_rng(3).random(rate.size) < share, 0.0, read)

    return change


def filled(share: float) -> Callable[[Floats], Floats]:
    """Samples here and there that are lost and filled by straight lines."""

    def change(rate: Floats) -> Floats:
        place = np.arange(rate.size)
        there = np.random.default_rng(3).random(rate.size) >= share
        return np.interp(place, place[there], rate[there])

    return change


# Name of the finding, low-pass of the sensor in Hz, and the fault.
FAULTS: dict[str, tuple[str, float | None, Callable[[Floats], Floats]]] = {
    "counts of white noise": ("resolution", None, rounded(1.2)),
    "counts behind a low-pass": ("resolution", 40.0, rounded(1.0)),
    "soft limit": ("short-tails", None, bent(3.0)),
    "hard limit": ("clipping", None, clipped(1.7)),
    "held samples": ("repeats", None, partial(with_held, share=0.05)),
    "gaps filled by straight lines": ("repeats", None, filled(0.08)),
    "many gaps filled by straight lines": ("repeats", None, filled(0.25)),
    "zeros in white noise": ("dropouts", None, lost(0.05, 1.5)),
    "zeros behind a low-pass": ("dropouts", 20.0, lost(0.1, 0.2)),
}


@cache
def sound(low_pass: float | None) -> tuple[Bench, Estimate]:
    """A bench without a fault, and its answer."""
    made = bench(5, seconds=300.0, walk=0.3, bias=0.02, low_pass=low_pass, names="x")
    return made, analyze(recorded(made)).angle_random_walk


@pytest.mark.parametrize("case", FAULTS)
def test_an_announced_effect_is_what_the_fault_does(case):
    name, low_pass, fault = FAULTS[case]
    made, clean = sound(low_pass)
    spoilt = recorded(made.changed(fault))
    whole = analyze(spoilt)
    found = [note for note in whole.notes if note.name == name]
    assert len(found) == 1
    read = analyze(spoilt, Settings(accepted=(name,))).angle_random_walk
    assert found[0].effect == pytest.approx(read.value / clean.value, abs=0.015)
    assert abs(found[0].effect - 1.0) > 0.015
    answer = whole.angle_random_walk
    if name == "short-tails":
        # The samples do not tell whether it is a limit: the interval holds N of both.
        assert answer.value == read.value
        assert answer.low == read.low
        assert answer.low < clean.value < answer.high < 1.07 * read.high / found[0].effect
    elif found[0].level == "warning":
        # Divided by it, the answer is that of the recording without the fault.
        assert answer.status == "estimated"
        assert answer.value == pytest.approx(clean.value, rel=0.015)
        assert answer.low < clean.value < answer.high
        assert answer.high / answer.low > read.high / read.low
    else:
        assert answer.status != "estimated"


def quantized(random: np.random.Generator, samples: int) -> Floats:
    """Noise beside a uniform error of the angle, of which Q is 0.3 times N in root seconds."""
    errors = 0.3 * np.sqrt(12.0) * (random.random(samples + 1) - 0.5)
    return random.standard_normal(samples) + np.diff(errors) * np.sqrt(200.0)


def triangular(random: np.random.Generator, samples: int) -> Floats:
    return np.sqrt(6.0) * (random.random(samples) - random.random(samples))


@pytest.mark.parametrize("seeds", [(1,), pytest.param((1, 2), marks=pytest.mark.statistics)])
@pytest.mark.parametrize("made", [quantized, triangular])
def test_the_interval_of_sound_noise_with_short_tails_holds_its_walk(made, seeds):
    for seed in seeds:
        rate = SCATTER * made(np.random.default_rng(seed), 60_000)
        recording = Recording.from_arrays(kind="rate", unit="deg/s", sample_rate=200.0, x=rate)
        analysis = analyze(recording, Settings(method="none"))
        walk = analysis.angle_random_walk.to("deg/sqrt(h)")
        assert walk.low < 0.3 < walk.high
        assert walk.value == pytest.approx(0.3, rel=0.02)
        # Only white noise of such a distribution could be that of a gyro near its limit.
        assert (walk.high > 1.08 * walk.value) == (made is triangular)
        assert ("for findings" in analysis.source) == (made is triangular)


def test_counts_whose_error_is_slow_have_no_known_effect():
    made = bench(5, walk=0.3, bias=0.02, low_pass=20.0, names="x").changed(rounded(0.9))
    analysis = analyze(recorded(made))
    (found,) = [note for note in analysis.notes if note.name == "resolution"]
    assert found.effect is None
    assert analysis.angle_random_walk.status != "estimated"


def test_counts_behind_a_low_pass_move_less_than_their_share_of_the_scatter():
    # 16 bits of 250 deg/s behind 40 Hz: the steps add to every frequency up to half the rate.
    made = bench(6, walk=0.15, low_pass=40.0, names="x", readout=Readout(step=1.0 / 131.0))
    analysis = analyze(recorded(made))
    assert [note.text for note in analysis.notes if note.name == "resolution"] == []
    (falls,) = [note.text for note in analysis.notes if "as behind a low-pass" in note.text]
    assert 36.0 < float(falls.split("half at ")[1].split(" Hz")[0]) < 44.0
