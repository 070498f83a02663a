"""Whether noise is distributed as noise is: sums of known cumulants, and noise of other spectra."""

import numpy as np
import pytest
from scipy.signal import lfilter

from sagnac.quality.check import judged
from sagnac.quality.distribution import has_uniform_errors, shape_of
from sagnac.quality.whitening import whitened
from tests.quality.pathologies import MEAN, RATE, SAMPLES, SIGMA, bent, of_rate, still

WHITE = np.random.default_rng(7).standard_normal(SAMPLES)
SECONDS = np.arange(SAMPLES) / 100.0


def test_cumulants_of_white_numbers_are_their_own():
    random = np.random.default_rng(8)
    # Uniform, exponential and Laplace numbers: skewness and excess kurtosis by their definition.
    for values, skewness, kurtosis in (
        (random.uniform(size=SAMPLES), 0.0, -1.2),
        (random.exponential(size=SAMPLES), 2.0, 6.0),
        (random.laplace(size=SAMPLES), 0.0, 3.0),
    ):
        shape = shape_of(whitened(values).values)
        assert shape.skewness == pytest.approx(skewness, abs=0.15)
        assert shape.kurtosis == pytest.approx(kurtosis, rel=0.12)


@pytest.mark.parametrize(
    "values",
    [
        WHITE,
        np.cumsum(WHITE),
        np.diff(WHITE),
        lfilter([0.05], [1.0, -0.95], WHITE),
        WHITE + 30.0 * np.sin(2.0 * np.pi * 29.9 * SECONDS),
        WHITE + 0.01 * np.arange(SAMPLES),
    ],
    ids=["white", "walk", "differences", "low-pass", "dither", "ramp"],
)
def test_no_spectrum_bends_normal_noise(values):
    shape = shape_of(whitened(values).values)
    assert abs(shape.skewness) < 0.1
    assert abs(shape.kurtosis) < 0.2


def test_a_soft_limit_is_said_before_it_moves_the_walk_by_five_per_cent():
    # At 4 sigma the scatter is 5.5 % low, at 5 sigma 3.7 %.
    (found,) = judged(bent(5.0))
    assert (found.name, found.level) == ("short-tails", "warning")
    assert found.effect == pytest.approx(0.963, abs=0.01)
    assert judged(bent(20.0)) == ()


def test_lopsided_noise_is_not_called_spikes():
    # A gamma law of shape a has the skewness 2 / sqrt(a) and the excess kurtosis 6 / a.
    random = np.random.default_rng(9)
    for shape, words in ((25.0, "lopsided"), (4.0, "spikes or bursts")):
        (found,) = judged(of_rate(MEAN + SIGMA * random.gamma(shape, size=SAMPLES)))
        assert (found.name, found.level) == ("spikes", "warning")
        assert words in found.text


def quantized(size: float, seed: int) -> np.ndarray:
    """Noise beside a uniform error of the angle, Q being `size` times N in root seconds; deg/h."""
    random = np.random.default_rng([seed, 3])
    errors = size * np.sqrt(12.0) * (random.random(SAMPLES + 1) - 0.5)
    # N is SIGMA over the root of the rate, and a change of angle over a period is a rate.
    return SIGMA * (random.standard_normal(SAMPLES) + np.diff(errors) * np.sqrt(RATE))


@pytest.mark.parametrize("size", [0.2, 0.3, 0.5, 1.0])
@pytest.mark.parametrize("slow", [0.0, 0.02])
def test_quantization_of_the_angle_is_no_soft_limit(size, slow):
    """Its samples lack large deviations, too: up to as many as a difference of uniform numbers."""
    for seed in range(3):
        noise = quantized(size, seed)
        walk = slow * SIGMA * np.cumsum(np.random.default_rng([seed, 4]).standard_normal(SAMPLES))
        assert shape_of(noise).kurtosis < -0.4
        assert judged(of_rate(MEAN + noise + walk)) == ()


@pytest.mark.parametrize(
    "noise",
    [
        # Behind a soft limit each.
        2.0 * np.tanh(WHITE / 2.0),
        4.0 * np.tanh(quantized(0.3, 1) / np.std(quantized(0.3, 1)) / 4.0),
        4.0 * np.tanh(np.diff(WHITE) / 4.0),
        # Sound, but white: nothing tells it from a limit.
        np.random.default_rng(9).triangular(-1.0, 0.0, 1.0, SAMPLES),
    ],
    ids=["white", "quantized", "differences", "triangular"],
)
def test_no_quantization_explains_a_soft_limit(noise):
    assert not has_uniform_errors(noise)
    (found,) = judged(of_rate(MEAN + SIGMA * noise / noise.std()))
    assert found.name == "short-tails"
    assert "soft saturation" in found.text
    assert "which is sound" in found.text


def test_counts_are_said_before_they_move_the_walk_by_five_per_cent():
    (found,) = judged(of_rate(SIGMA * np.rint(still() / SIGMA)))
    assert (found.name, found.level) == ("resolution", "warning")
    # Sheppard: steps of one sigma add a twelfth to the variance.
    assert found.effect == pytest.approx(np.sqrt(1.0 + 1.0 / 12.0), rel=0.01)
    assert judged(of_rate(0.3 * SIGMA * np.rint(still() / (0.3 * SIGMA)))) == ()


def test_a_median_that_jumps_for_one_block_is_no_step():
    values = still()
    block = SAMPLES // 64
    values[20 * block : 21 * block] = np.where(
        np.arange(block) % 2, MEAN + 1.0 * SIGMA, MEAN - 1.1 * SIGMA
    )
    assert "steps" not in [note.name for note in judged(of_rate(values))]


def test_a_median_of_counts_that_moves_by_one_step_of_the_readout_is_no_step():
    # The mean passes the middle between two counts: the medians of its blocks lie on either.
    step = 0.4 * SIGMA
    drifting = still() - MEAN + np.linspace(0.0, 1.0, SAMPLES) * step
    counts = step * np.rint(drifting / step)
    level = np.median(counts[: SAMPLES // 64 * 64].reshape(64, -1), axis=1)
    assert np.count_nonzero(np.diff(level)) < 16
    assert "steps" not in [note.name for note in judged(of_rate(counts))]
    stepping = counts + np.where(np.arange(SAMPLES) < SAMPLES // 2, 0.0, 12.0 * step)
    assert "steps" in [note.name for note in judged(of_rate(stepping))]
