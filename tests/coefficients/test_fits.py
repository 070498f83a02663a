"""Fits of Q, N, B, K, R: exact on laws, honest on noise, one line on refusal."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.fft import dct, idct
from scipy.signal import lfilter

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.coefficients.curve_fit import paper_fit, weighted_fit
from sagnac.coefficients.estimates import in_units
from sagnac.coefficients.spectrum_fit import likelihood_fit
from sagnac.coefficients.three_cornered_hat import three_cornered_hat
from sagnac.errors import RecordingError
from sagnac.recording.model import Channel, Recording
from sagnac.recording.readout import readout_of
from sagnac.stability.curve import StabilityCurve, stability_curve

NAMES = (
    "quantization",
    "angle_random_walk",
    "bias_instability",
    "rate_random_walk",
    "rate_ramp",
)
# Five terms, each of which rules some part of the curve from 1 s to a quarter of 2e6 s.
TRUTH = dict(zip(NAMES, (3.0, 0.2, 0.01, 1e-4, 1e-6), strict=True))


def law_curve(truth, *, samples, taus, gyros=1):
    """A curve that is Eq. 3 exactly."""
    variance = gyros * (
        3.0 * truth["quantization"] ** 2 / taus**2
        + truth["angle_random_walk"] ** 2 / taus
        + 2.0 * math.log(2.0) / math.pi * truth["bias_instability"] ** 2
        + truth["rate_random_walk"] ** 2 * taus / 3.0
        + truth["rate_ramp"] ** 2 * taus**2 / 2.0
    )
    deviation = np.sqrt(variance)
    return StabilityCurve(
        tau=taus,
        deviation=deviation,
        terms=(samples + 1 - 2 * taus).astype(np.int64),
        edf=np.full(taus.size, 10.0),
        low=deviation,
        high=deviation,
        noise_type=np.zeros(taus.size, dtype=np.int64),
        estimator="oadev",
        kind="rate",
        sample_rate=1.0,
        confidence=0.95,
        samples=samples,
    )


def log_taus(samples, points=40, share=4):
    return np.unique(np.round(np.geomspace(1.0, samples / share, points)))


@pytest.mark.parametrize("gyros", [1, 2])
@pytest.mark.parametrize("fit", [paper_fit, weighted_fit])
def test_curve_fits_recover_the_law_exactly(fit, gyros):
    samples = 2_000_000
    curve = law_curve(TRUTH, samples=samples, taus=log_taus(samples, 60), gyros=gyros)
    result = fit(curve, gyros_differenced=gyros)
    assert tuple(result.coefficients) == NAMES
    for name, estimate in result.coefficients.items():
        if fit is paper_fit and name in ("rate_random_walk", "rate_ramp"):
            # Within the paper's cut at N/51 the ramp and the walk rule no part of the curve.
            assert estimate.status != "estimated" or estimate.low <= TRUTH[name] <= estimate.high
            continue
        assert estimate.status == "estimated", name
        assert estimate.value == pytest.approx(TRUTH[name], rel=1e-3)
        assert estimate.low < TRUTH[name] < estimate.high


def test_paper_fit_leaves_out_what_its_ten_percent_cut_leaves_out():
    samples = 7200
    taus = log_taus(samples)
    curve = law_curve(TRUTH | {"quantization": 0.1}, samples=samples, taus=taus)
    # 1/sqrt(2 (N/n - 1)) is 10 % at N/n = 51: what lies beyond must not matter.
    spoiled = np.where(samples / taus < 51.0, 100.0 * curve.deviation, curve.deviation)
    other = StabilityCurve(
        **{
            field: getattr(curve, field)
            for field in StabilityCurve.__dataclass_fields__
            if field != "deviation"
        },
        deviation=spoiled,
    )
    assert paper_fit(other) == paper_fit(curve)
    assert weighted_fit(other).coefficients != weighted_fit(curve).coefficients


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


def white(samples, seed, size=1.0):
    return size * np.random.default_rng(seed).standard_normal(samples)


@pytest.mark.parametrize("seed", range(4))
def test_white_noise_shows_nothing_else_and_no_zero(seed):
    rate = white(7200, seed)
    curve = stability_curve(rate, kind="rate", sample_rate=1.0)
    for fit in (
        likelihood_fit(rate, kind="rate", sample_rate=1.0),
        weighted_fit(curve),
        paper_fit(curve),
    ):
        assert fit.notes == ()
        for name, estimate in fit.coefficients.items():
            if name == "angle_random_walk":
                assert estimate.status == "estimated"
                assert 0.0 < estimate.low <= estimate.value <= estimate.high
                assert estimate.value == pytest.approx(1.0, abs=0.1)
            else:
                assert estimate.status == "upper bound"
                assert estimate.value == estimate.high > 0.0
                assert estimate.low == 0.0


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
        assert scaled[name].value == pytest.approx(1e-9 * reference[name].value, rel=1e-3)


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


@pytest.mark.parametrize("gyros", [1, 2])
def test_the_difference_of_two_is_per_gyro(gyros):
    rate = white(4000, 9)
    one = likelihood_fit(rate, kind="rate", sample_rate=1.0).coefficients
    other = likelihood_fit(rate, kind="rate", sample_rate=1.0, gyros_differenced=gyros).coefficients
    for name in NAMES:
        for field in ("value", "low", "high"):
            expected = getattr(one[name], field) / math.sqrt(gyros)
            assert getattr(other[name], field) == pytest.approx(expected)


def test_masked_bands_do_not_bias():
    # The noise in the bands is gone, as after a removal; masked, N is what it was.
    samples, rate_hz = 20_000, 10.0
    bands = [(0.1, 0.14), (0.9, 1.4), (3.0, 3.6)]
    values, spoiled = [], []
    for seed in range(30):
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
        assert "departs from the fitted terms" in odd.notes[-1]
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
    assert "stand far above the fitted terms" in odd.notes[0]
    assert len(odd.notes) == 1
    estimate = odd.coefficients["angle_random_walk"]
    assert estimate.low < 1.0 < estimate.high
    assert estimate.high - estimate.low < 0.03


def test_a_curve_unlike_eq_3_widens_the_interval_and_says_so():
    rate = white(20_000, 12)
    clean = weighted_fit(stability_curve(rate, kind="rate", sample_rate=1.0))
    wave = rate + 0.3 * np.sin(2.0 * np.pi * np.arange(rate.size) / 40.0)
    fit = weighted_fit(stability_curve(wave, kind="rate", sample_rate=1.0))
    assert clean.notes == ()
    assert "departs from the fitted terms" in fit.notes[0]
    estimate, reference = (result.coefficients["angle_random_walk"] for result in (fit, clean))
    assert estimate.high - estimate.low > 2.0 * (reference.high - reference.low)


def test_confidence_widens_every_interval():
    rate = white(5000, 13)
    curve = stability_curve(rate, kind="rate", sample_rate=1.0)

    def widths(confidence):
        for fit in (
            likelihood_fit(rate, kind="rate", sample_rate=1.0, confidence=confidence),
            weighted_fit(curve, confidence=confidence),
            paper_fit(curve, confidence=confidence),
        ):
            for estimate in fit.coefficients.values():
                assert estimate.confidence == confidence
                yield estimate.high - estimate.low

    for narrow, wide in zip(widths(0.683), widths(0.99), strict=True):
        # A bound may be lost altogether where few degrees of freedom stand behind it.
        assert math.isnan(wide) or narrow < wide


def test_plain_allan_curve_for_the_paper_only():
    rate = white(7200, 14)
    plain = stability_curve(rate, kind="rate", sample_rate=1.0, estimator="adev")
    estimate = paper_fit(plain).coefficients["angle_random_walk"]
    assert estimate.low < 1.0 < estimate.high
    with pytest.raises(ValueError, match="takes oadev"):
        weighted_fit(plain)
    with pytest.raises(ValueError, match="takes oadev or adev"):
        paper_fit(stability_curve(rate, kind="rate", sample_rate=1.0, estimator="mdev"))


def test_a_curve_of_few_points_gives_what_it_can():
    rate = white(400, 15)
    curve = stability_curve(rate, kind="rate", sample_rate=1.0, taus=[1.0, 2.0, 4.0])
    fit = paper_fit(curve)
    assert "enough for quantization, angle_random_walk only" in fit.notes[0]
    assert fit.coefficients["angle_random_walk"].status == "estimated"
    assert fit.coefficients["rate_ramp"].status == "not observable"
    with pytest.raises(RecordingError, match="record longer"):
        paper_fit(stability_curve(white(60, 1), kind="rate", sample_rate=1.0, taus=[1.0, 5.0]))


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"confidence": 1.0}, ValueError, "between 0 and 1"),
        ({"gyros_differenced": 3}, ValueError, "use 1"),
        ({"band": (2.0, 1.0)}, ValueError, "low below high"),
        ({"masked": [(2.0, 1.0)]}, ValueError, "pairs"),
        ({"terms": ()}, ValueError, "is not a choice of"),
        ({"terms": ("drift",)}, ValueError, "is not a choice of"),
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


def test_three_gyros_that_turn_together_are_told_apart():
    truths = {"x": 1.0, "y": 2.0, "z": 4.0}
    common = 50.0 * np.cumsum(white(20_000, 20))
    gyros = {
        name: common + truth * white(20_000, seed)
        for seed, (name, truth) in enumerate(truths.items())
    }
    separation = three_cornered_hat(gyros, kind="rate", sample_rate=1.0)
    assert separation.notes == ()
    for name, truth in truths.items():
        estimate = separation.angle_random_walk[name]
        assert estimate.status == "estimated"
        assert estimate.low < truth < estimate.high
        assert estimate.value == pytest.approx(truth, rel=0.15)


def test_a_gyro_far_quieter_than_the_others_gets_a_bound_and_a_note():
    generator = np.random.default_rng(3)
    truths = {"x": 0.01, "y": 1.0, "z": 1.0}
    negative = 0
    for _ in range(10):
        gyros = {name: truth * generator.standard_normal(3000) for name, truth in truths.items()}
        separation = three_cornered_hat(gyros, kind="rate", sample_rate=1.0)
        estimate = separation.angle_random_walk["x"]
        assert estimate.status == "upper bound"
        assert estimate.high > truths["x"]
        assert separation.notes[0].startswith("the squared angle random walk of x alone")
        negative += "negative" in separation.notes[0]
    assert 1 <= negative <= 9


@pytest.mark.parametrize(
    ("gyros", "error", "message"),
    [
        ({"x": np.ones(50), "y": np.ones(50)}, ValueError, "takes three"),
        ({"x": white(50, 1), "y": white(50, 2), "z": white(49, 3)}, ValueError, "one span"),
        ({"x": white(500, 1), "y": white(500, 1), "z": white(500, 3)}, RecordingError, "the same"),
    ],
)
def test_three_cornered_hat_refusals(gyros, error, message):
    with pytest.raises(error, match=message):
        three_cornered_hat(gyros, kind="rate", sample_rate=1.0)


def test_units_of_every_coefficient():
    walk = in_units("angle_random_walk", math.pi / 180.0 / 60.0)
    assert walk["deg/sqrt(h)"] == pytest.approx(1.0)
    assert walk["deg/h/sqrt(Hz)"] == pytest.approx(60.0)
    assert walk["rad/s/sqrt(Hz)"] == walk["rad/sqrt(s)"] == math.pi / 10800.0
    assert in_units("quantization", 1.0)["arcsec"] == pytest.approx(206264.806, rel=1e-8)
    assert in_units("bias_instability", math.pi / 180.0)["deg/h"] == pytest.approx(3600.0)
    assert in_units("rate_random_walk", math.pi / 180.0)["deg/h/sqrt(h)"] == pytest.approx(
        3600.0 * 60.0
    )
    assert in_units("rate_ramp", math.pi / 180.0)["deg/h/h"] == pytest.approx(3600.0**2)
    assert [next(iter(in_units(name, 1.0))) for name in NAMES] == [
        "arcsec",
        "deg/sqrt(h)",
        "deg/h",
        "deg/h/sqrt(h)",
        "deg/h/h",
    ]


def markov_rates(samples, driving, correlation, generator):
    """Means over 1 s of a Markov rate stepped ten times as fast."""
    decay = math.exp(-0.1 / correlation)
    size = driving * math.sqrt(0.5 * correlation)
    steps = size * math.sqrt(1.0 - decay**2) * generator.standard_normal(10 * samples)
    steps[0] = size * generator.standard_normal()
    return lfilter([1.0], [1.0, -decay], steps).reshape(samples, 10).mean(axis=1)


def test_markov_and_sinusoid_are_found_where_they_are():
    generator = np.random.default_rng(21)
    time = np.arange(20_000)
    rate = 0.3 * generator.standard_normal(time.size)
    rate += markov_rates(time.size, 0.05, 60.0, generator)
    rate += 0.1 * np.cos(2.0 * np.pi * 0.0731 * time + 1.0)
    truths = {
        "markov_driving_noise": 0.05,
        "markov_correlation_time": 60.0,
        "sinusoid_amplitude": 0.1,
    }
    taus = np.unique(np.round(np.geomspace(1.0, 5000.0, 30)))
    curve = stability_curve(rate, kind="rate", sample_rate=1.0, taus=taus)
    for fit in (
        likelihood_fit(rate, kind="rate", sample_rate=1.0, markov=True, sinusoid=0.0731),
        weighted_fit(curve, markov=True, sinusoid=0.0731),
    ):
        assert set(fit.optional) == set(truths)
        for name, truth in truths.items():
            estimate = fit.optional[name]
            assert estimate.status == "estimated", (fit.method, name)
            # 99.9 %: three intervals of two fits at once.
            assert truth * (estimate.low / estimate.value) ** 1.7 < estimate.value
            assert estimate.value < truth * (estimate.high / estimate.value) ** 1.7
        walk = fit.coefficients["angle_random_walk"]
        assert 0.9 * walk.low < 0.3 < 1.1 * walk.high


def test_markov_and_sinusoid_are_not_invented():
    rate = white(5000, 22)
    fit = likelihood_fit(rate, kind="rate", sample_rate=1.0, markov=True, sinusoid=0.21)
    assert fit.optional["markov_driving_noise"].status == "not observable"
    assert fit.optional["markov_correlation_time"].status == "not observable"
    assert fit.optional["sinusoid_amplitude"].status == "upper bound"
    assert fit.optional["sinusoid_amplitude"].high < 0.1
    plain = likelihood_fit(rate, kind="rate", sample_rate=1.0)
    assert plain.optional == {}
    assert fit.coefficients["angle_random_walk"].value == pytest.approx(
        plain.coefficients["angle_random_walk"].value, rel=2e-3
    )


def test_sinusoid_intervals_hold_the_truth():
    generator = np.random.default_rng(23)
    inside = 0
    for _ in range(200):
        rate = generator.standard_normal(500)
        rate += 0.3 * np.cos(1.3 * np.arange(500) + generator.uniform(0.0, 6.0))
        estimate = likelihood_fit(
            rate,
            kind="rate",
            sample_rate=1.0,
            terms=("angle_random_walk",),
            sinusoid=1.3 / (2.0 * np.pi),
        ).optional["sinusoid_amplitude"]
        # The averaging over an interval takes sinc off; 0.3 is after it.
        truth = 0.3 / np.sinc(1.3 / (2.0 * np.pi))
        inside += estimate.low <= truth <= estimate.high
    assert 181 <= inside <= 198


@pytest.mark.parametrize("frequency", [0.0, 0.5, -1.0])
def test_a_sinusoid_out_of_range_is_refused(frequency):
    with pytest.raises(ValueError, match="below one half"):
        likelihood_fit(white(100, 1), kind="rate", sample_rate=1.0, sinusoid=frequency)


def read_out(walk, samples, seed, *, rate=0.0, white=0.0):
    """An angle that walks, turns steadily and shakes, in readout steps: as it is, and rounded."""
    generator = np.random.default_rng(seed)
    angle = generator.random() + np.cumsum(walk * generator.standard_normal(samples))
    angle += rate * np.arange(samples) + white * generator.standard_normal(samples)
    return angle, np.round(angle)


@pytest.mark.parametrize("rate", [0.0, 0.5, 1.0, 0.0137, 1000.0, 12.3456])
def test_a_readout_is_white_of_angles_half_a_step_apart(rate):
    # (0.1 step)^2 a sample: half a step after 25 samples.
    angle, reading = read_out(0.1, 200_000, 3, rate=rate)
    found = readout_of(1e-8 * reading)
    assert found.step == pytest.approx(1e-8, rel=1e-6)
    assert found.every in (16, 32)
    error = reading - angle
    close, apart = error, error[:: found.every]
    assert apart.var() == pytest.approx(1.0 / 12.0, rel=0.05)
    assert abs(np.corrcoef(apart[1:], apart[:-1])[0, 1]) < 0.1
    assert np.cos(2.0 * np.pi * rate) < 0.0 or np.corrcoef(close[1:], close[:-1])[0, 1] > 0.5


def test_a_readout_that_is_dithered_is_taken_as_it_is():
    assert readout_of(read_out(0.7, 10_000, 4)[1]).every == 1
    assert readout_of(read_out(0.01, 10_000, 5, white=0.5)[1]).every == 1
    unrounded, _ = read_out(0.01, 10_000, 6)
    assert readout_of(unrounded).every == 1


def test_a_readout_step_shows_through_the_rounding_of_a_file():
    _, reading = read_out(0.1, 50_000, 7)
    rounding = 1e-3 * np.random.default_rng(8).uniform(-1.0, 1.0, reading.size)
    assert readout_of(reading + rounding).step == pytest.approx(1.0, abs=5e-3)
    assert readout_of(reading + rounding).every == readout_of(reading).every


def test_a_readout_that_moves_a_few_times_is_never_dithered():
    reading = np.repeat([0.0, 1.0, 0.0, 1.0, 2.0], [3000, 1, 2000, 5000, 999])
    assert readout_of(reading).every is None
    assert readout_of(np.zeros(5000)).step == 0.0


def bench(walk, samples, seed, *, step, rate=10.0):
    """A still gyro read out in steps; `walk` in rad/sqrt(s), `step` in rad."""
    _, reading = read_out(walk / math.sqrt(rate) / step, samples, seed)
    gyro = Channel(name="x", kind="angle", shown_in="rad", values=step * reading)
    return Recording(gyros=(gyro,), sample_rate=rate)


def test_a_coarse_readout_on_a_still_bench_does_not_shorten_the_interval():
    # 1e-5 deg/sqrt(h) and 0.001 arcsec: a fifth of a step between the angles of a fit.
    step, walk = math.radians(0.001 / 3600.0), math.radians(1e-5) / 60.0
    errors = []
    for seed in range(16):
        result = analyze(
            bench(walk, 12_000, seed, step=step), Settings(gyros=("x",), method="none")
        )
        answer = result.angle_random_walk
        assert answer.status == "estimated"
        assert [note for note in result.notes if "readout step of x (0.001 arcsec)" in note]
        errors.append((answer.value - walk) / ((answer.high - answer.low) / (2.0 * 1.96)))
    # Of 16 independent errors of unit variance.
    assert abs(np.mean(errors)) < 3.0 / math.sqrt(16.0)
    assert np.sum(np.square(errors)) < 39.3  # chi-square of 16: exceeded once in a thousand


@pytest.mark.parametrize("walk", [5e-6, 1e-5])
def test_a_readout_that_hides_the_walk_leaves_a_bound(walk):
    step, walk = math.radians(0.01 / 3600.0), math.radians(walk) / 60.0
    for seed in range(10):
        result = analyze(
            bench(walk, 12_000, seed, step=step), Settings(gyros=("x",), method="none")
        )
        answer = result.angle_random_walk
        assert answer.status == "upper bound"
        assert walk < answer.high < 30.0 * walk
        assert [note for note in result.notes if "too few times" in note]
        fit = result.fits["likelihood"].coefficients["angle_random_walk"]
        assert fit.status == "not observable"
