"""Fits to a spectrum: exact on laws, honest on noise."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.fft import dct, idct

from sagnac.core.errors import RecordingError
from sagnac.noise.fit import fit_coefficients, likelihood_fit
from sagnac.stability.curve import stability_curve
from tests.noise.examples import NAMES, white


def test_likelihood_fit_recovers_an_exact_spectrum():
    # Increments whose cosine transform has exactly the expected squares.
    samples = 4096
    index = np.arange(1, samples)
    angle = np.pi * index / samples
    squares = 0.09 * (4.0 * np.sin(angle / 2.0) ** 2 + 4.0 / samples * np.cos(angle / 2.0) ** 2)
    squares += 1.0 + 0.05**2 * (0.25 / np.sin(angle / 2.0) ** 2 - 1.0 / 6.0)
    transform = np.concatenate([[0.0], np.sqrt(squares)])
    result = likelihood_fit(
        idct(transform, type=2, norm="ortho"),
        kind="rate",
        sample_rate=1.0,
        terms=("quantization", "angle_random_walk", "rate_random_walk"),
    ).coefficients
    assert result["quantization"].value == pytest.approx(0.3, rel=1e-3)
    assert result["angle_random_walk"].value == pytest.approx(1.0, rel=1e-3)
    assert result["rate_random_walk"].value == pytest.approx(0.05, rel=1e-3)
    assert result["bias_instability"].status == "not observable"
    assert math.isnan(result["bias_instability"].value)


def test_every_term_of_a_strong_mixture_is_seen_by_the_likelihood():
    samples = 200_000
    generator = np.random.default_rng(8)
    rate = generator.standard_normal(samples)
    rate += 2.0 * np.diff(generator.standard_normal(samples + 1))
    rate += 1e-3 * np.cumsum(generator.standard_normal(samples))
    rate += 1e-4 * np.arange(samples)
    result = likelihood_fit(rate, kind="rate", sample_rate=1.0).coefficients
    for name, truth in (
        ("quantization", 2.0),
        ("angle_random_walk", 1.0),
        ("rate_random_walk", 1e-3),
        ("rate_ramp", 1e-4),
    ):
        assert result[name].status == "estimated", name
        assert result[name].low < truth < result[name].high


def test_kinds_and_scale_do_not_change_the_answer():
    rate = white(3000, 5) + 0.2 * np.diff(white(3001, 6))
    reference = likelihood_fit(rate, kind="rate", sample_rate=4.0).coefficients
    increments = rate / 4.0
    for kind, values in (
        ("increment", increments),
        ("angle", np.concatenate([[0.0], np.cumsum(increments)])),
    ):
        other = likelihood_fit(values, kind=kind, sample_rate=4.0).coefficients
        for name in NAMES:
            assert other[name].value == pytest.approx(reference[name].value, rel=1e-3)
    scaled = likelihood_fit(1e-9 * rate, kind="rate", sample_rate=4.0).coefficients
    for name in NAMES:
        assert scaled[name].status == reference[name].status
        assert scaled[name].value == pytest.approx(1e-9 * reference[name].value, rel=1e-3, abs=0.0)


def test_a_constant_rate_and_a_ramp_cost_nothing():
    rate = white(3000, 7)
    reference = likelihood_fit(rate, kind="rate", sample_rate=1.0).coefficients
    moved = likelihood_fit(
        rate + 700.0 + 0.5 * np.arange(3000), kind="rate", sample_rate=1.0
    ).coefficients
    assert moved["angle_random_walk"].value == pytest.approx(
        reference["angle_random_walk"].value, rel=1e-4
    )
    assert moved["rate_ramp"].status == "estimated"
    assert moved["rate_ramp"].low < 0.5 < moved["rate_ramp"].high
    assert reference["rate_ramp"].status == "upper bound"


@pytest.mark.parametrize("draws", [10, pytest.param(30, marks=pytest.mark.statistics)])
def test_masked_bands_do_not_bias(draws):
    # The noise in the bands is gone, as after a removal; masked, N is what it was.
    samples, rate_hz = 20_000, 10.0
    bands = [(0.1, 0.14), (0.9, 1.4), (3.0, 3.6)]
    values, spoiled = [], []
    for seed in range(draws):
        transform = dct(white(samples, seed), type=2, norm="ortho")
        frequency = np.arange(samples) * rate_hz / (2.0 * samples)
        for low, high in bands:
            transform[(frequency >= low) & (frequency <= high)] *= 1e-3
        rate = idct(transform, type=2, norm="ortho")
        settings = {"kind": "rate", "sample_rate": rate_hz}
        truth = 1.0 / math.sqrt(rate_hz)
        masked = likelihood_fit(rate, masked=bands, **settings).coefficients["angle_random_walk"]
        values.append(masked.value / truth)
        bare = likelihood_fit(rate, terms=("angle_random_walk",), **settings)
        spoiled.append(bare.coefficients["angle_random_walk"].value / truth)
    error = np.std(values) / math.sqrt(len(values))
    assert abs(np.mean(values) - 1.0) < 3.5 * error
    assert np.mean(spoiled) < 0.9


def test_a_band_takes_only_what_is_inside():
    rate = white(20_000, 3)
    transform = dct(rate, type=2, norm="ortho")
    # A filter closes above 0.3 Hz: within the band nothing of it is seen.
    transform[12_000:] *= np.geomspace(1.0, 1e-3, 8000)
    closed = idct(transform, type=2, norm="ortho")
    settings = {"kind": "rate", "sample_rate": 1.0, "band": (0.0, 0.29)}
    assert likelihood_fit(closed, **settings).coefficients[
        "angle_random_walk"
    ].value == pytest.approx(
        likelihood_fit(rate, **settings).coefficients["angle_random_walk"].value, rel=1e-6
    )


def test_a_spectrum_unlike_the_terms_widens_the_interval_and_says_so():
    inside = 0
    for seed in range(20):
        generator = np.random.default_rng([7, seed])
        rate = generator.standard_normal(100_000)
        transform = dct(rate, type=2, norm="ortho")
        # Stretches of 2 % of their frequency, each up or down by a fifth of its power.
        for start, stop in pairwise(np.unique(np.geomspace(50, rate.size, 400).astype(int))):
            transform[start:stop] *= math.sqrt(generator.uniform(0.65, 1.35))
        odd = likelihood_fit(idct(transform, type=2, norm="ortho"), kind="rate", sample_rate=1.0)
        assert "departs from the fitted terms" in odd.notes[-1].text
        estimate = odd.coefficients["angle_random_walk"]
        # Of white noise alone it would be 0.015 wide.
        assert 0.025 < estimate.high - estimate.low < 0.05
        inside += estimate.low < 1.0 < estimate.high
    assert inside >= 17


def test_a_line_or_a_resonance_that_is_left_is_left_out_and_named():
    rate = white(100_000, 11)
    transform = dct(rate, type=2, norm="ortho")
    transform[20_000:30_000] *= 2.0
    wave = 0.3 * np.cos(0.8 * np.arange(rate.size))
    odd = likelihood_fit(idct(transform, type=2, norm="ortho") + wave, kind="rate", sample_rate=1.0)
    assert "stand far above the fitted terms" in odd.notes[0].text
    assert len(odd.notes) == 1
    estimate = odd.coefficients["angle_random_walk"]
    assert estimate.low < 1.0 < estimate.high
    assert estimate.high - estimate.low < 0.03


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"confidence": 1.0}, ValueError, "between 0 and 1"),
        ({"masked": [(0.0, 0.5)]}, RecordingError, "too few frequencies"),
    ],
)
def test_likelihood_refusals_are_one_line(settings, error, message):
    with pytest.raises(error, match=message) as caught:
        likelihood_fit(white(100, 1), kind="rate", sample_rate=1.0, **settings)
    assert "\n" not in str(caught.value)


def test_a_dead_channel_and_a_short_one_are_refused():
    with pytest.raises(RecordingError, match="do not vary"):
        likelihood_fit(np.zeros(100), kind="rate", sample_rate=1.0)
    with pytest.raises(RecordingError, match="too few"):
        likelihood_fit(white(5, 1), kind="rate", sample_rate=1.0)


def test_a_fit_states_the_band_that_it_used() -> None:
    rates = np.random.default_rng(3).standard_normal(4000)
    whole = likelihood_fit(rates, kind="rate", sample_rate=10.0, masked=[(1.0, 1.1)]).band
    assert whole is not None
    assert (whole.low, whole.high, whole.interval) == (0.0, 5.0, 0.1)
    assert whole.masked == ((1.0, 1.1),)
    assert whole.is_whole
    part = likelihood_fit(rates, kind="rate", sample_rate=10.0, band=(0.1, 2.5)).band
    assert part is not None
    assert (part.low, part.high, part.is_whole) == (0.1, 2.5, False)


def of_samples(values, kind):
    return fit_coefficients(values, kind=kind, sample_rate=100.0)


def of_the_curve(values, kind):
    return fit_coefficients(
        stability_curve(values, kind=kind, sample_rate=100.0), method="weighted"
    )


TIME = np.arange(6000) / 100.0


@pytest.mark.parametrize("fitted", [of_samples, of_the_curve])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize(
    ("even", "kind"),
    [
        (np.full(6000, 2.0), "rate"),
        (np.full(6000, np.radians(2.0) / 3600.0), "rate"),
        (np.full(6000, 0.3), "increment"),
        (2.0 * TIME, "angle"),
        (np.radians(0.3 * TIME - 7.0), "angle"),
    ],
)
def test_rounding_of_a_constant_rate_is_no_noise(fitted, dtype, even, kind):
    """Its N was 1e-20 deg/sqrt(h), estimated; of a ramp in single precision 5e-3."""
    with pytest.raises(RecordingError):
        fitted(even.astype(dtype), kind)


@pytest.mark.parametrize("fitted", [of_samples, of_the_curve])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_quiet_gyro_on_a_large_constant_rate_is_answered(fitted, dtype):
    """Noise of 30 last places of the rate, a hundred times the deviation of rounding."""
    deviation = 30.0 * float(np.spacing(dtype(2.0)))
    rates = (2.0 + deviation * np.random.default_rng(8).standard_normal(6000)).astype(dtype)
    walk = fitted(rates, "rate").coefficients["angle_random_walk"]
    assert walk.status == "estimated"
    assert walk.low < deviation / 10.0 < walk.high


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_quiet_angle_on_a_ramp_is_answered(dtype):
    """Angles that wander by 30 last places and more from a line."""
    step = 0.3 * float(np.spacing(dtype(120.0)))
    walk = np.cumsum(step * np.random.default_rng(9).standard_normal(6000))
    found = of_samples((2.0 * TIME + walk).astype(dtype), "angle").coefficients
    assert found["angle_random_walk"].low < 10.0 * step < found["angle_random_walk"].high
