"""Every estimator against published numbers, its naive definition and theory."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sagnac.stability import estimators as properties
from sagnac.stability.curve import stability_curve
from sagnac.stability.sums import accumulated_track
from tests import naive_stability as naive
from tests.stability.examples import ESTIMATORS, THOUSAND_POINTS

TEN_POINTS = np.array([892.0, 809, 823, 798, 671, 644, 883, 903, 677])


@pytest.mark.parametrize(
    ("estimator", "at_1", "at_2", "tolerance"),
    [
        ("adev", 91.22945, 115.8082, 5e-7),
        ("oadev", 91.22945, 85.95287, 5e-7),
        ("mdev", 91.22945, 74.78849, 5e-7),
        ("tdev", 52.67135, 86.35831, 5e-7),
        ("hdev", 70.80608, 116.7980, 5e-7),
        ("ohdev", 70.80607, 85.61487, 5e-7),
        ("totdev", 91.22945, 93.90379, 5e-7),
        ("mtotdev", 64.509, 64.794, 0.5e-3 / 64.5),
    ],
)
def test_ten_points_of_sp1065(estimator, at_1, at_2, tolerance):
    curve = stability_curve(
        TEN_POINTS, kind="rate", sample_rate=1.0, estimator=estimator, taus=[1, 2]
    )
    assert curve.tau.tolist() == [1.0, 2.0]
    assert curve.deviation == pytest.approx([at_1, at_2], rel=tolerance)


@pytest.mark.parametrize(
    ("estimator", "expected"),
    [
        ("adev", (0.2922319, 0.09965736, 0.03897804)),
        ("oadev", (0.2922319, 0.09159953, 0.03241343)),
        ("mdev", (0.2922319, 0.06172376, 0.02170921)),
        ("tdev", (0.1687202, 0.3563623, 1.253382)),
        ("hdev", (0.2943883, 0.1052754, 0.03910860)),
        ("ohdev", (0.2943883, 0.09581083, 0.03237638)),
        ("totdev", (0.2922319, 0.09134743, 0.03406530)),
    ],
)
def test_thousand_points_of_sp1065(estimator, expected):
    curve = stability_curve(
        THOUSAND_POINTS, kind="rate", sample_rate=1.0, estimator=estimator, taus=[1, 10, 100]
    )
    assert curve.deviation == pytest.approx(expected, rel=5e-7)


@pytest.mark.parametrize(
    ("estimator", "taus", "printed"),
    [
        ("mtotdev", (1, 10, 100), ("0.20664", "0.055529", "0.019547")),
        ("theo1", (10, 100, 1000), ("0.10757", "0.031789", "0.0050524")),
    ],
)
def test_thousand_points_to_the_printed_digits(estimator, taus, printed):
    curve = stability_curve(
        THOUSAND_POINTS, kind="rate", sample_rate=1.0, estimator=estimator, taus=taus
    )
    for value, text in zip(curve.deviation, printed, strict=True):
        assert f"{value:.{len(text) - 2}f}" == text


def largest_cluster(estimator, samples):
    return {
        "adev": (samples - 1) // 2,
        "oadev": (samples - 1) // 2,
        "haar": (samples - 1) // 2,
        "mdev": samples // 3,
        "tdev": samples // 3,
        "mtotdev": samples // 3,
        "hdev": (samples - 1) // 3,
        "ohdev": (samples - 1) // 3,
        "totdev": samples - 1,
        "theo1": (samples - 1) // 2 * 2,
    }[estimator]


@pytest.mark.parametrize("estimator", [e for e in ESTIMATORS if e != "theoh"])
@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_every_estimator_is_its_naive_definition(estimator, data):
    size = data.draw(st.integers(12, 70), label="rates")
    values = data.draw(
        st.lists(st.floats(-1e3, 1e3, width=32), min_size=size, max_size=size), label="values"
    )
    rates = np.array(values) + np.sin(np.arange(size))  # never all alike
    x = naive.angle(rates)
    smallest = 10 if estimator == "theo1" else 1
    m = data.draw(st.integers(smallest, largest_cluster(estimator, size + 1)), label="cluster")
    m -= m % 2 if estimator == "theo1" else 0
    expected, terms = getattr(naive, estimator)(x, m)
    curve = stability_curve(rates, kind="rate", sample_rate=1.0, estimator=estimator, taus=[m])
    # A variance far below the square of the rates is known no better than their rounding.
    floor = 1e-12 * float(np.abs(rates - rates.mean()).max())
    assert curve.deviation[0] == pytest.approx(math.sqrt(expected), rel=1e-9, abs=floor)
    assert curve.terms[0] == terms


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_scaling_and_bias(estimator):
    rates = np.random.default_rng(5).standard_normal(400)
    plain = stability_curve(rates, kind="rate", sample_rate=10.0, estimator=estimator)
    scaled = stability_curve(1e-5 * rates, kind="rate", sample_rate=10.0, estimator=estimator)
    biased = stability_curve(rates + 64.0, kind="rate", sample_rate=10.0, estimator=estimator)
    for name in ("deviation", "low", "high"):
        assert getattr(scaled, name) == pytest.approx(1e-5 * getattr(plain, name), rel=1e-10)
        assert getattr(biased, name) == pytest.approx(getattr(plain, name), rel=1e-9)
    assert np.all(plain.low < plain.deviation)
    assert np.all(plain.deviation < plain.high)


@pytest.mark.parametrize(
    ("estimator", "response"),
    [("adev", 1.0), ("oadev", 1.0), ("mdev", 1.0), ("haar", 1 / math.sqrt(2.0))],
)
def test_a_ramp_of_rate(estimator, response):
    """R t gives R tau / sqrt 2, IEEE Std 952 Annex C."""
    ramp, sample_rate = 3e-4, 5.0
    rates = ramp * np.arange(2000) / sample_rate
    curve = stability_curve(rates, kind="rate", sample_rate=sample_rate, estimator=estimator)
    assert curve.deviation == pytest.approx(response * ramp * curve.tau / math.sqrt(2.0), rel=1e-9)


@pytest.mark.parametrize("estimator", ["hdev", "ohdev"])
def test_hadamard_does_not_see_a_ramp(estimator):
    rates = np.random.default_rng(8).standard_normal(500)
    ramped = rates + 0.5 * np.arange(500)
    taus = [1, 5, 40]
    plain = stability_curve(rates, kind="rate", sample_rate=1.0, estimator=estimator, taus=taus)
    curve = stability_curve(ramped, kind="rate", sample_rate=1.0, estimator=estimator, taus=taus)
    assert curve.deviation == pytest.approx(plain.deviation, rel=1e-8)


@pytest.mark.parametrize("estimator", [e for e in ESTIMATORS if e not in ("mtotdev", "theo1")])
def test_white_rate_noise_has_its_theoretical_deviation(estimator):
    generator = np.random.default_rng(10)
    density, sample_rate, samples = 0.02, 50.0, 40_000
    rates = density * math.sqrt(sample_rate) * generator.standard_normal(samples)
    m = np.array([16, 64, 256])
    curve = stability_curve(
        rates, kind="rate", sample_rate=sample_rate, estimator=estimator, taus=m / sample_rate
    )
    variance = density**2 / curve.tau
    if estimator in ("mdev", "tdev"):
        variance *= 0.5 + 1 / (2.0 * m**2)  # MVAR/AVAR of white rate noise
    if estimator == "tdev":
        variance *= curve.tau**2 / 3.0
    if estimator == "haar":
        variance /= 2.0
    error = np.abs(curve.deviation / np.sqrt(variance) - 1.0)
    assert np.all(error < 4.0 / np.sqrt(2.0 * curve.edf))


@pytest.mark.parametrize(("estimator", "factor"), [("oadev", 1 / 3), ("totdev", 1 / 3)])
def test_rate_random_walk_has_its_theoretical_deviation(estimator, factor):
    generator = np.random.default_rng(11)
    step, samples = 1e-3, 100_000
    rates = step * np.cumsum(generator.standard_normal(samples))
    curve = stability_curve(
        rates, kind="rate", sample_rate=1.0, estimator=estimator, taus=[30, 100, 300]
    )
    truth = step * np.sqrt(factor * curve.tau)  # K sqrt(tau/3)
    assert curve.noise_type.tolist() == [-2, -2, -2]
    assert np.all(np.abs(curve.deviation / truth - 1.0) < 4.0 / np.sqrt(2.0 * curve.edf))


def test_white_angle_noise_has_its_theoretical_deviation():
    """sqrt(3) q / tau, and MDEV falls as tau^(-3/2)."""
    q, samples = 0.1, 50_000
    angles = q * np.random.default_rng(12).standard_normal(samples)
    m = np.array([4, 16, 64])
    plain = stability_curve(angles, kind="angle", sample_rate=1.0, taus=m)
    assert plain.deviation == pytest.approx(math.sqrt(3.0) * q / m, rel=0.03)
    modified = stability_curve(angles, kind="angle", sample_rate=1.0, estimator="mdev", taus=m)
    assert modified.deviation == pytest.approx(math.sqrt(3.0) * q / m**1.5, rel=0.05)
    assert plain.noise_type.tolist() == [2, 2, 2]


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_the_default_grid_reaches_the_longest_tau(estimator):
    rates = np.random.default_rng(51).standard_normal(1000)
    curve = stability_curve(rates, kind="rate", sample_rate=100.0, estimator=estimator)
    assert np.all(np.diff(curve.tau) > 0)
    longest = {
        "theo1": 0.75 * 1000,
        "theoh": 0.75 * 1000,
        "haar": 256,
        "totdev": 1000,
        "adev": 500,
        "oadev": 500,
    }.get(estimator, 333)
    assert curve.tau[-1] == pytest.approx(longest / 100.0)
    assert curve.samples == 1000
    assert curve.estimator == estimator


# --- the table -----------------------------------------------------------------------------


def test_the_table_has_a_row_for_each_name():
    assert tuple(properties.ESTIMATORS) == (
        *("adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "totdev", "mtotdev"),
        *("theo1", "theoh", "haar"),
    )
    assert set(properties.ESTIMATORS) == set(ESTIMATORS)
    for name, row in properties.ESTIMATORS.items():
        assert row.name == name
        assert f"{name} " in properties.__doc__
        # The longest cluster of a record has one window at least.
        assert row.windows(row.longest(1000), 1000) >= 1
        assert row.freedom(0, row.longest(1000), 1000, 1) > 0.0


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_row_counts_the_windows_that_its_sums_take(estimator):
    row = properties.properties_of(estimator)
    rates = np.random.default_rng(61).standard_normal(120)
    track = accumulated_track(rates, "rate", 1.0, "reject", None)
    cluster = np.array([12])
    points = row.points(track, cluster)
    if estimator != "theoh":  # whose clusters up to a fifth of the record are of oadev
        assert points.rules == (estimator,)
        assert points.windows[0] == row.windows(12, track.angle.size)


@pytest.mark.parametrize(("estimator", "lowest"), [("oadev", -2), ("theo1", -2), ("ohdev", -4)])
def test_the_steepest_noise_follows_from_the_order(estimator, lowest):
    assert properties.properties_of(estimator).lowest_exponent == lowest
