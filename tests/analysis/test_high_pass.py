"""An output that takes off its own bias at rest: its spectrum falls towards low frequencies."""

import numpy as np
import pytest
from scipy.signal import lfilter

from sagnac import Recording, analyze, judge

RATE, SAMPLES = 100.0, 60_000
# deg/sqrt(h); a limit that it breaks.
WALK, LIMIT = 0.15, "0.12deg/sqrt(h)"


def white(seed):
    return WALK / 60.0 * np.sqrt(RATE) * np.random.default_rng(seed).standard_normal(SAMPLES)


def tracked(rate, corner):
    """A rate less its bias, which follows it with a first-order low-pass of a corner in Hz."""
    kept = np.exp(-2.0 * np.pi * corner / RATE)
    return rate - lfilter([1.0 - kept], [1.0, -kept], rate)


def centred(rate, corner):
    """A rate less its mean over every period of a frequency in Hz."""
    rows = rate.reshape(-1, round(RATE / corner))
    return (rows - rows.mean(axis=1)[:, np.newaxis]).ravel()


def analysis_of(rate):
    still = Recording.from_arrays(x=rate, kind="rate", unit="deg/s", sample_rate=RATE)
    return analyze(still)


@pytest.mark.parametrize(
    ("output", "corner"),
    [
        (tracked, 0.1),
        pytest.param(tracked, 0.3, marks=pytest.mark.statistics),
        (tracked, 1.0),
        (centred, 0.5),
        pytest.param(centred, 1.0, marks=pytest.mark.statistics),
    ],
)
def test_an_interval_reaches_to_the_noise_behind_a_high_pass(output, corner):
    analysis = analysis_of(output(white(round(100 * corner)), corner))
    (found,) = [note for note in analysis.findings if note.name == "high-pass"]
    assert found.level == "warning"
    walk = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert walk.low < WALK < walk.high
    # N as it is read beside the level above the corner.
    assert f"{WALK:.2f}"[:3] in found.text
    assert judge(analysis, LIMIT).decision == "undecided"


@pytest.mark.parametrize("added", ["nothing", "quantization", "walk", "low-pass", "line"])
def test_sound_noise_is_behind_no_high_pass(added):
    rng, rate = np.random.default_rng(8), white(7)
    if added == "quantization":
        # A few arcseconds of the angle, which is 4 (pi f)^2 in the spectrum of the rate.
        rate += np.diff(rng.standard_normal(SAMPLES + 1)) * 5.0 / 3600.0 * RATE
    if added == "walk":
        rate += np.cumsum(rng.standard_normal(SAMPLES)) * 2e-4
    if added == "low-pass":
        kept = np.exp(-2.0 * np.pi * 2.0 / RATE)
        rate = lfilter([1.0 - kept], [1.0, -kept], rate)
    if added == "line":
        rate += 0.05 * np.sin(2.0 * np.pi * 7.3 * np.arange(SAMPLES) / RATE)
    analysis = analysis_of(rate)
    assert "high-pass" not in {note.name for note in analysis.findings}
    walk = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert walk.status == "estimated"
    assert walk.low < WALK < walk.high


@pytest.mark.parametrize(
    "seed", [1, 2, *(pytest.param(seed, marks=pytest.mark.statistics) for seed in (3, 4, 5))]
)
def test_flicker_that_is_sampled_slowly_is_behind_no_high_pass(seed):
    # An hour at 1 Hz, of which flicker rules all but the last octaves: means of eight samples of
    # noise whose two-sided density is N^2 + B^2/(2 pi f).
    rng, samples = np.random.default_rng(seed), 3600
    frequency = np.fft.rfftfreq(64 * samples, 1.0 / 8.0)[1:]
    flicker = np.radians(6.0 / 3600.0) ** 2 / (2.0 * np.pi * frequency)
    parts = rng.standard_normal((2, frequency.size)) * np.sqrt(flicker * 64 * samples * 8.0 / 2.0)
    rate = np.fft.irfft(np.append(0.0, parts[0] + 1j * parts[1]))[: 8 * samples]
    rate = rate.reshape(samples, 8).mean(axis=1)
    rate += np.radians(0.2 / 60.0) * rng.standard_normal(samples)
    still = Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=1.0)
    assert "high-pass" not in {note.name for note in analyze(still).findings}
