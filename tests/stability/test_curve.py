"""Stability curves against published numbers, naive definitions, laws and simulated truth."""

import inspect
import math
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2

import sagnac
from sagnac import series
from sagnac.errors import RecordingError
from sagnac.stability import _kernels
from sagnac.stability.curve import stability_curve
from sagnac.stability.degrees_of_freedom import equivalent_degrees_of_freedom, ieee_relative_error
from sagnac.stability.estimators import Estimator
from tests import naive_stability as naive

ESTIMATORS = get_args(Estimator)
WITH_GAPS = ("adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "haar")
WHOLE_ONLY = ("totdev", "mtotdev", "theo1", "theoh")


def nbs14(count):
    numbers = [1234567890]
    while len(numbers) < count:
        numbers.append(16807 * numbers[-1] % 2147483647)
    return np.array(numbers) / 2147483647


TEN_POINTS = np.array([892.0, 809, 823, 798, 671, 644, 883, 903, 677])
THOUSAND_POINTS = nbs14(1000)


# --- published numbers ---------------------------------------------------------------------


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


def test_published_intervals_of_the_thousand_points():
    curve = stability_curve(
        THOUSAND_POINTS, kind="rate", sample_rate=1.0, taus=[1, 8, 32, 128], noise_type=0
    )
    assert curve.low == pytest.approx([0.28515, 0.10038, 0.043654, 0.023045], rel=1e-3)
    assert curve.high == pytest.approx([0.29987, 0.11198, 0.054202, 0.037027], rel=1e-3)
    identified = stability_curve(
        THOUSAND_POINTS, kind="rate", sample_rate=1.0, taus=[1, 8, 32, 128]
    )
    assert identified.noise_type.tolist() == [0, 0, 0, 0]
    assert identified.low == pytest.approx(curve.low)


def test_theo1_tau_is_three_quarters_of_its_span():
    curve = stability_curve(
        THOUSAND_POINTS, kind="rate", sample_rate=2.0, estimator="theo1", taus=[5, 50]
    )
    assert curve.tau.tolist() == [3.75, 37.5]


def test_ieee_error_of_the_ten_percent_cut():
    assert ieee_relative_error(51 * 7, 7) == pytest.approx(0.1)
    with pytest.raises(ValueError, match="under two clusters"):
        ieee_relative_error(10, 6)


# --- naive definitions ---------------------------------------------------------------------


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


def test_theoh_is_oadev_then_theo1_less_its_bias():
    rates = np.random.default_rng(1).standard_normal(240)
    x = naive.angle(rates)
    curve = stability_curve(
        rates, kind="rate", sample_rate=1.0, estimator="theoh", taus=[1, 20, 48, 60, 90]
    )
    assert curve.tau.tolist() == [1.0, 20.0, 48.0, 60.0, 90.0]
    expected = [naive.oadev(x, m)[0] for m in (1, 20, 48)]
    expected += [naive.theo1_bias_removed(x, m) for m in (80, 120)]
    assert curve.deviation == pytest.approx(np.sqrt(expected), rel=1e-10)


@pytest.mark.parametrize("estimator", WITH_GAPS)
@pytest.mark.parametrize("kind", ["rate", "angle"])
def test_omitted_gaps_are_brute_force(estimator, kind):
    generator = np.random.default_rng(7)
    rates = generator.standard_normal(160)
    lost = np.zeros(160, dtype=bool)
    lost[[0, 31, 32, 33, 90, 159]] = True
    if kind == "rate":
        values = np.where(lost, np.nan, rates)
        x, broken = naive.angle(np.where(lost, 0.0, rates)), np.append(lost, False)
    else:
        values = np.where(lost, np.nan, np.cumsum(rates))
        x, broken = values, None
    clusters = [1, 2, 5, 8, 16]
    curve = stability_curve(
        values, kind=kind, sample_rate=1.0, estimator=estimator, taus=clusters, gaps="omit"
    )
    for k, m in enumerate(clusters):
        variance, terms = getattr(naive, estimator)(x, m, broken)
        assert curve.deviation[k] == pytest.approx(math.sqrt(variance), rel=1e-10)
        assert curve.terms[k] == terms
    assert curve.notes[0] == "6 of 160 samples are missing"
    assert "gaps left out" in curve.notes[1]


def test_taus_that_gaps_leave_without_a_term_are_noted():
    values = np.random.default_rng(2).standard_normal(101)
    values[50] = np.nan
    curve = stability_curve(values, kind="rate", sample_rate=1.0, taus=[5, 40], gaps="omit")
    assert curve.tau.tolist() == [5.0]
    assert any("no term free of gaps" in note for note in curve.notes)
    with pytest.raises(RecordingError, match="leave no term"):
        stability_curve(values, kind="rate", sample_rate=1.0, taus=[40], gaps="omit")


# --- compiled and interpreted --------------------------------------------------------------

_WALK = np.cumsum(np.random.default_rng(3).standard_normal(601))
_LAGS = np.array([1, 2, 7, 60, 190], dtype=np.int64)
_STRETCHES = (np.array([0, 120, 300]), np.array([100, 30, 301]))
_GAPPED = np.where(np.isin(np.arange(601), [0, 100, 101, 300]), np.nan, _WALK)
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


@pytest.mark.parametrize(
    ("kernel", "arguments"),
    [
        ("accumulate_deviations", (_WALK, 0.3, 2.0, np.empty(601))),
        ("subtract_ramp", (_WALK, 0.25, 1.5, 300, np.empty(601))),
        ("sum_squared_second_differences", (_WALK, _LAGS, 0, 601, np.ones(5))),
        ("sum_squared_third_differences", (_WALK, _LAGS, 0, 601, np.ones(5))),
        ("window_difference", (_WALK, 60, 3, 63, 2.0)),
        ("sum_squared_differences_in_stretches", (_WALK, *_STRETCHES, _LAGS, 2)),
        ("sum_squared_differences_in_stretches", (_WALK, *_STRETCHES, _LAGS, 3)),
        ("sum_squared_window_differences_in_stretches", (_WALK, *_STRETCHES, _LAGS)),
        ("sum_squared_differences_with_gaps", (_GAPPED, 7, 2, 0, 500)),
        ("sum_squared_differences_with_gaps", (_GAPPED, 7, 3, 9, 601)),
        ("sum_squared_arms", (_WALK[:9], _WALK[9:18], _WALK[18:27], 2.0, -1.0, 1.0)),
        ("sum_modified_total_terms", (_WALK, 9, 2)),
        ("sum_modified_total_terms", (_WALK, 10, 1)),
        ("sum_theo1_terms", (_WALK, _WALK[::-1].copy(), 24, 3)),
        ("lag_one_order", (_WALK, np.array([0, 300]), np.array([60, 50]), 5, 2)),
        ("difference_covariance", (0.7, 12.0, -1, 3)),
        ("difference_covariance", (0.0, math.inf, -2, 2)),
        ("inverse_degrees_of_freedom", (900, 300, 300.0, 1, 2, _NODES, _WEIGHTS)),
    ],
)
def test_compiled_kernels_do_what_their_source_says(kernel, arguments):
    compiled = getattr(_kernels, kernel)
    assert compiled(*arguments) == pytest.approx(compiled.py_func(*arguments), rel=1e-11)


def test_compiled_windows_do_what_their_source_says():
    compiled = _kernels.sum_squared_window_differences
    arguments = (_WALK, _LAGS, 0, 601, np.ones(5), np.arange(5.0))
    for one, other in zip(compiled(*arguments), compiled.py_func(*arguments), strict=True):
        assert one == pytest.approx(other, rel=1e-11)


@pytest.mark.parametrize("mapped", [False, True])
def test_blocks_do_not_show(monkeypatch, mapped):
    """A record of many blocks, and clusters on both sides of a block, against plain sums."""
    if mapped:
        monkeypatch.setattr(series, "IN_MEMORY", 1000)
        monkeypatch.setattr(series, "SPAN", 3000)
        monkeypatch.setattr("sagnac.stability.sums._STARTS", 4096)
    rate = np.random.default_rng(4).standard_normal(20_000)
    x = np.concatenate([[0.0], np.cumsum(rate - rate.mean())])
    lags = np.array([1, 3, 4095, 4096, 6000])
    # Reflected in its ends, at whose values it turns about.
    longer = np.concatenate([2.0 * x[0] - x[:0:-1], x, 2.0 * x[-1] - x[-2::-1]])

    def variance_of(estimator):
        return (
            stability_curve(
                rate, kind="rate", sample_rate=1.0, estimator=estimator, taus=lags
            ).deviation
            ** 2
        )

    second = [np.mean((x[2 * m :] - 2 * x[m:-m] + x[: -2 * m]) ** 2) for m in lags]
    assert variance_of("oadev") == pytest.approx(second / (2.0 * lags**2), rel=1e-11)
    third = [
        np.mean((x[3 * m :] - 3 * x[2 * m : -m] + 3 * x[m : -2 * m] - x[: -3 * m]) ** 2)
        for m in lags
    ]
    assert variance_of("ohdev") == pytest.approx(third / (6.0 * lags**2), rel=1e-11)
    window, total, plain = [], [], []
    inner = np.arange(x.size, 2 * x.size - 2)
    for m in lags:
        difference = x[2 * m :] - 2 * x[m:-m] + x[: -2 * m]
        window.append(np.mean(np.convolve(difference, np.ones(m), "valid") ** 2))
        reflected = longer[inner - m] - 2.0 * longer[inner] + longer[inner + m]
        total.append(np.mean(reflected**2))
        plain.append(np.mean(np.diff(x[::m], n=2) ** 2))
    assert variance_of("mdev") == pytest.approx(window / (2.0 * lags**4.0), rel=1e-10)
    assert variance_of("totdev") == pytest.approx(total / (2.0 * lags**2), rel=1e-11)
    assert variance_of("adev") == pytest.approx(plain / (2.0 * lags**2), rel=1e-11)


@pytest.mark.parametrize("kind", ["rate", "increment", "angle"])
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_record_out_of_memory_has_the_same_curve(monkeypatch, estimator, kind):
    values = np.random.default_rng(9).standard_normal(9_001)
    inside = stability_curve(values, kind=kind, sample_rate=10.0, estimator=estimator)
    monkeypatch.setattr(series, "IN_MEMORY", 1000)
    monkeypatch.setattr("sagnac.stability.sums._STARTS", 4096)
    mapped = series.empty(values.size)
    mapped[:] = values
    outside = stability_curve(mapped, kind=kind, sample_rate=10.0, estimator=estimator)
    _assert_same(inside, outside)


@pytest.mark.parametrize("kind", ["rate", "angle"])
@pytest.mark.parametrize("estimator", WITH_GAPS)
def test_a_record_out_of_memory_with_gaps_has_the_same_curve(monkeypatch, estimator, kind):
    values = np.random.default_rng(10).standard_normal(12_345)
    values[[0, 700, 701, 5000, 12_344]] = np.nan
    values[1000:1100:7] = np.nan
    inside = stability_curve(values, kind=kind, sample_rate=10.0, estimator=estimator, gaps="omit")
    monkeypatch.setattr(series, "IN_MEMORY", 1000)
    monkeypatch.setattr(series, "SPAN", 700)
    monkeypatch.setattr("sagnac.stability.sums._STARTS", 4096)
    mapped = series.empty(values.size)
    mapped[:] = values
    outside = stability_curve(mapped, kind=kind, sample_rate=10.0, estimator=estimator, gaps="omit")
    _assert_same(inside, outside)


def _assert_same(inside, outside):
    assert inside.notes == outside.notes
    for name in ("tau", "terms", "noise_type"):
        assert np.array_equal(getattr(inside, name), getattr(outside, name))
    for name in ("deviation", "edf", "low", "high"):
        assert getattr(outside, name) == pytest.approx(getattr(inside, name), rel=1e-12)


# --- laws ----------------------------------------------------------------------------------


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


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_the_kinds_agree(estimator):
    sample_rate = 4.0
    rates = np.random.default_rng(6).standard_normal(300)
    increments = rates / sample_rate
    angles = naive.angle(increments)
    curves = [
        stability_curve(values, kind=kind, sample_rate=sample_rate, estimator=estimator)
        for kind, values in (("rate", rates), ("increment", increments), ("angle", angles))
    ]
    for curve in curves[1:]:
        assert curve.tau == pytest.approx(curves[0].tau)
        assert curve.deviation == pytest.approx(curves[0].deviation, rel=1e-9)
        assert curve.edf == pytest.approx(curves[0].edf)
        assert curve.noise_type.tolist() == curves[0].noise_type.tolist()


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


@pytest.mark.parametrize("estimator", ["oadev", "mdev", "ohdev", "totdev"])
def test_a_turning_table_costs_no_digits(estimator):
    """1e9 arcsec of rotation under noise of 0.01 arcsec, known to the quantum of the data."""
    noise = 0.01 * np.random.default_rng(9).standard_normal(20_001)
    turned = 1e9 / 7200.0 * np.arange(20_001) + noise
    exact = turned - 1e9 / 7200.0 * np.arange(20_001)  # what float64 kept of the noise
    still = stability_curve(
        exact, kind="angle", sample_rate=1.0, estimator=estimator, taus=[1, 30, 300]
    )
    curve = stability_curve(
        turned, kind="angle", sample_rate=1.0, estimator=estimator, taus=[1, 30, 300]
    )
    assert curve.deviation == pytest.approx(still.deviation, rel=1e-5)


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


def test_theoh_removes_the_bias_of_theo1():
    """Mean Theo1H variance at the end of the record, against sigma^2/tau and K^2 tau/3."""
    generator = np.random.default_rng(13)
    white, walk, raw = [], [], []
    for _ in range(150):
        rates = generator.standard_normal(600)
        for values, into in ((rates, white), (np.cumsum(rates), walk)):
            curve = stability_curve(
                values, kind="rate", sample_rate=1.0, estimator="theoh", taus=[150]
            )
            into.append(curve.deviation[0] ** 2)
        curve = stability_curve(
            np.cumsum(rates), kind="rate", sample_rate=1.0, estimator="theo1", taus=[200]
        )
        raw.append(curve.deviation[0] ** 2)
    for found, truth in ((white, 1 / 150), (walk, 150 / 3)):
        standard_error = np.std(found) / math.sqrt(len(found))
        assert abs(np.mean(found) - truth) < max(4.0 * standard_error, 0.05 * truth)
    assert abs(np.mean(walk) - 50.0) < abs(np.mean(raw) - 50.0)


# --- noise types ---------------------------------------------------------------------------


@pytest.mark.parametrize("alpha", [2, 1, 0, -1, -2])
def test_noise_types_are_identified(alpha):
    rates = naive.power_law_rates(np.random.default_rng(20), 16_384, alpha)
    # Angles taken a cluster apart alias; flicker angle turns white when they are far apart.
    taus = [1, 4, 16] if alpha == 1 else [1, 4, 16, 64]
    curve = stability_curve(rates, kind="rate", sample_rate=1.0, taus=taus)
    assert curve.noise_type.tolist() == [alpha] * len(taus)


@pytest.mark.parametrize("alpha", [-3, -4])
def test_hadamard_identifies_steeper_noise(alpha):
    rates = naive.power_law_rates(np.random.default_rng(21), 16_384, alpha)
    curve = stability_curve(rates, kind="rate", sample_rate=1.0, estimator="ohdev", taus=[1, 8, 32])
    assert curve.noise_type.tolist() == [alpha] * 3


@pytest.mark.parametrize("walks", [0, 1, 2, 3])
@pytest.mark.parametrize(("cluster", "counts"), [(1, [400]), (3, [90, 60])])
def test_lag_one_order_is_its_definition(walks, cluster, counts):
    """Riley and Greenhall: less a parabola, differenced until r1/(1 + r1) < 1/4."""
    angle = np.random.default_rng(26).standard_normal(500)
    for _ in range(walks):
        angle = np.cumsum(angle)
    starts, total = np.array([7, 300])[: len(counts)], sum(counts)
    stretches = []
    for start, count in zip(starts, counts, strict=True):
        taken = angle[start : start + cluster * count : cluster]
        place = np.linspace(-1.0, 1.0, count)
        stretches.append(taken - np.polyval(np.polyfit(place, taken, 2), place))
    expected = None
    for order in range(4):
        centred = [stretch - stretch.mean() for stretch in stretches]
        r1 = sum(part[:-1] @ part[1:] for part in centred) / sum(part @ part for part in centred)
        # The parabola's parameters that differencing has not undone pull r1 down.
        r1 += max(3 - order, 1) / (total / len(counts))
        expected = order + r1 / (1.0 + r1)
        if expected - order < 0.25:
            break
        stretches = [np.diff(stretch) for stretch in stretches]
    found = _kernels.lag_one_order(angle, starts, np.array(counts), cluster, 3)
    assert found == pytest.approx(expected, rel=1e-6)


def test_noise_is_mostly_identified_from_thirty_clusters():
    generator = np.random.default_rng(22)
    right = 0
    for _ in range(200):
        curve = stability_curve(
            generator.standard_normal(330), kind="rate", sample_rate=1.0, taus=[11]
        )
        right += abs(int(curve.noise_type[0])) <= 1
    assert right > 190


def test_noise_type_is_carried_to_the_longest_taus():
    rates = np.cumsum(np.random.default_rng(23).standard_normal(1000))
    curve = stability_curve(rates, kind="rate", sample_rate=1.0, taus=[1, 20, 100, 300])
    assert curve.noise_type.tolist() == [-2, -2, -2, -2]
    assert any("noise type of the 2 longest taus" in note for note in curve.notes)
    lone = stability_curve(rates, kind="rate", sample_rate=1.0, taus=[300])
    assert lone.noise_type.tolist() == [-2]


def test_noise_type_of_a_gapped_record_comes_from_its_stretches():
    rates = np.cumsum(np.random.default_rng(24).standard_normal(4000))
    rates[[1000, 2500]] = np.nan
    curve = stability_curve(rates, kind="rate", sample_rate=1.0, taus=[1, 10], gaps="omit")
    assert curve.noise_type.tolist() == [-2, -2]
    angles = np.random.default_rng(25).standard_normal(4000)
    angles[[0, 1000, 1001, 3999]] = np.nan
    curve = stability_curve(angles, kind="angle", sample_rate=1.0, taus=[1, 10], gaps="omit")
    assert curve.noise_type.tolist() == [2, 2]


def test_a_silent_gyro_has_no_noise_type():
    curve = stability_curve(np.full(100, 3.0), kind="rate", sample_rate=1.0, taus=[1, 10])
    assert curve.deviation.tolist() == [0.0, 0.0]
    assert any("noise type taken as 0" in note for note in curve.notes)


# --- degrees of freedom --------------------------------------------------------------------


@pytest.mark.parametrize("m", [1, 2, 7, 20])
@pytest.mark.parametrize("alpha", [2, 1, 0, -1, -2])
@pytest.mark.parametrize("estimator", ["adev", "oadev", "mdev", "hdev", "ohdev"])
def test_degrees_of_freedom_are_the_greenhall_riley_sum(estimator, alpha, m):
    order = 3 if estimator in ("hdev", "ohdev") else 2
    expected = naive.greenhall_riley(
        alpha,
        order,
        m,
        400,
        modified=estimator == "mdev",
        overlapping=estimator not in ("adev", "hdev"),
    )
    found = equivalent_degrees_of_freedom(estimator, alpha, m, 400)
    assert found == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("alpha", [-3, -4])
def test_hadamard_degrees_of_freedom_for_steep_noise(alpha):
    expected = naive.greenhall_riley(alpha, 3, 9, 300, modified=False, overlapping=True)
    assert equivalent_degrees_of_freedom("ohdev", alpha, 9, 300) == pytest.approx(
        expected, rel=1e-6
    )


@pytest.mark.parametrize("samples", [2400, 6000])
@pytest.mark.parametrize(
    ("estimator", "alpha"),
    [
        *(("oadev", alpha) for alpha in (1, 0, -1, -2)),
        *(("mdev", alpha) for alpha in (2, 1, 0, -2)),
        *(("ohdev", alpha) for alpha in (-1, -3, -4)),
    ],
)
def test_long_clusters_by_panels_are_the_sum_over_every_lag(estimator, alpha, samples):
    m = 700
    order = 3 if estimator == "ohdev" else 2
    expected = naive.greenhall_riley(
        alpha,
        order,
        m,
        samples,
        modified=estimator == "mdev",
        overlapping=True,
        long_filter=estimator != "mdev" and alpha <= 0,
    )
    found = equivalent_degrees_of_freedom(estimator, alpha, m, samples)
    assert found == pytest.approx(expected, rel=2e-4)


@pytest.mark.parametrize("m", [50, 128, 400])
def test_long_clusters_of_white_rate_noise_are_exact(m):
    """Sampled white rates, whose covariance is that of the filter itself."""
    samples = 4001
    weights = np.concatenate((np.ones(m), -np.ones(m)))
    exact = naive.filter_degrees_of_freedom(weights, samples - 2 * m)
    found = equivalent_degrees_of_freedom("oadev", 0, m, samples)
    assert found == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize("m", [1, 5, 300])
def test_white_angle_noise_is_exact(m):
    weights = np.zeros(2 * m + 1)
    weights[[0, m, 2 * m]] = 1, -2, 1
    exact = naive.filter_degrees_of_freedom(weights, 4001 - 2 * m)
    found = equivalent_degrees_of_freedom("oadev", 2, m, 4001)
    assert found == pytest.approx(exact, rel=1e-9)


def test_a_million_sample_cluster_costs_no_digits():
    for alpha in (2, 1, 0, -1, -2):
        long = equivalent_degrees_of_freedom("oadev", alpha, 1_000_000, 5_000_001)
        short = equivalent_degrees_of_freedom("oadev", alpha, 1000, 5001)
        # Rate noise knows only N/m; angle noise gains terms with m.
        if alpha <= 0:
            assert long == pytest.approx(short, rel=5e-3)
        else:
            assert long > short
    assert equivalent_degrees_of_freedom("mdev", 2, 1_000_000, 5_000_001) == pytest.approx(
        equivalent_degrees_of_freedom("mdev", 2, 1000, 5001), rel=5e-3
    )


@pytest.mark.parametrize(
    ("estimator", "alpha", "expected"),
    [
        ("totdev", 0, 1.5 * 100 * 400 / 405),
        ("totdev", -1, 1.17 * 100 - 0.22),
        ("totdev", -2, 0.93 * 100 - 0.36),
        ("mtotdev", 2, 1.9 * 100 - 2.1),
        ("mtotdev", 0, 1.1 * 100 - 1.2),
        ("mtotdev", -2, 0.75 * 100 - 0.31),
    ],
)
def test_total_degrees_of_freedom_of_sp1065(estimator, alpha, expected):
    assert equivalent_degrees_of_freedom(estimator, alpha, 10, 1001) == pytest.approx(expected)


@pytest.mark.parametrize("alpha", [2, 0, -2])
def test_degrees_of_freedom_are_those_of_simulated_variances(alpha):
    """2 (mean)^2 / variance over runs, for the families that go by fitted formulas."""
    generator = np.random.default_rng(30)
    samples, runs = 256, 600
    cases = {"totdev": 32, "mtotdev": 16, "theo1": 64}
    found = {name: [] for name in cases}
    for _ in range(runs):
        rates = naive.power_law_rates(generator, samples, alpha)
        for name, m in cases.items():
            curve = stability_curve(
                rates, kind="rate", sample_rate=1.0, estimator=name, taus=[m], noise_type=alpha
            )
            found[name].append(curve.deviation[0] ** 2)
    for name, m in cases.items():
        simulated = 2.0 * np.mean(found[name]) ** 2 / np.var(found[name])
        stated = equivalent_degrees_of_freedom(name, alpha, m, samples + 1)
        assert simulated == pytest.approx(stated, rel=0.3)


@pytest.mark.parametrize("m", [1, 4, 30, 99, 180, 250])
def test_total_variance_of_white_angle_noise(m):
    """(tr Q)^2 / tr Q^2 of the matrix of the total variance itself."""
    samples, last = 300, 299
    matrix = np.zeros((samples - 2, samples))
    for row, i in zip(matrix, range(1, last), strict=True):
        row[i] -= 2
        if i >= m:
            row[i - m] += 1
        else:
            row[0] += 2
            row[m - i] -= 1
        if i + m <= last:
            row[i + m] += 1
        else:
            row[last] += 2
            row[2 * last - i - m] -= 1
    gram = matrix @ matrix.T
    exact = np.trace(gram) ** 2 / np.sum(gram**2)
    assert equivalent_degrees_of_freedom("totdev", 2, m, samples) == pytest.approx(exact, rel=0.06)


def test_intervals_are_chi_squared_at_any_confidence():
    for confidence in (0.5, 0.683, 0.95, 0.999):
        curve = stability_curve(
            THOUSAND_POINTS, kind="rate", sample_rate=1.0, taus=[1, 50], confidence=confidence
        )
        tail = 0.5 * (1.0 - confidence)
        for k in range(2):
            upper, lower = chi2.ppf([1.0 - tail, tail], curve.edf[k])
            assert curve.low[k] == pytest.approx(
                curve.deviation[k] * math.sqrt(curve.edf[k] / upper)
            )
            assert curve.high[k] == pytest.approx(
                curve.deviation[k] * math.sqrt(curve.edf[k] / lower)
            )


@pytest.mark.statistics
@pytest.mark.parametrize("estimator", ["oadev", "mdev", "ohdev", "totdev"])
@pytest.mark.parametrize("alpha", [2, 0, -2])
def test_intervals_cover_the_truth(estimator, alpha, capsys):
    """95 % intervals over 1000 records of 10 000 samples; the truth is the mean over all.

    Seed 40. Clusters start at 2: at one sample the published degrees of freedom suppose
    band-limited noise, and sampled white rates have 15 % fewer.
    """
    generator = np.random.default_rng(40)
    clusters = np.array([2, 8, 32, 128, 512, 1024])
    runs = 1000
    curves = []
    for _ in range(runs):
        rates = naive.power_law_rates(generator, 10_000, alpha)
        curves.append(
            stability_curve(
                rates,
                kind="rate",
                sample_rate=1.0,
                estimator=estimator,
                taus=clusters,
                confidence=0.95,
            )
        )
    truth = np.sqrt(np.mean([curve.deviation**2 for curve in curves], axis=0))
    inside = [(curve.low <= truth) & (truth <= curve.high) for curve in curves]
    coverage = np.mean(inside, axis=0)
    with capsys.disabled():
        cells = " | ".join(f"{100.0 * share:.1f} %" for share in coverage)
        print(f"\n| {estimator} | {alpha:+d} | {cells} |", end="")
    assert np.all((coverage >= 0.93) & (coverage <= 0.97))


# --- strides, grids and refusals -----------------------------------------------------------


@pytest.mark.parametrize(("estimator", "tau"), [("mtotdev", 64), ("theo1", 160), ("theoh", 600)])
def test_skipped_windows_are_stated_and_cost_little(monkeypatch, estimator, tau):
    rates = np.random.default_rng(50).standard_normal(2000)
    options = {"kind": "rate", "sample_rate": 1.0, "estimator": estimator, "taus": [tau]}
    whole = stability_curve(rates, **options)
    monkeypatch.setattr("sagnac.stability.sums._LARGEST_WORK", 1e4)
    skipped = stability_curve(rates, **options)
    assert not any("every k-th" in note for note in whole.notes)
    assert any("every k-th window" in note for note in skipped.notes)
    assert skipped.terms[0] < whole.terms[0]
    assert skipped.deviation == pytest.approx(whole.deviation, rel=0.02)
    assert skipped.edf == pytest.approx(whole.edf)


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


def test_taus_are_rounded_merged_and_told():
    curve = stability_curve(
        THOUSAND_POINTS, kind="rate", sample_rate=10.0, taus=[0.1, 0.1000000001, 1.04]
    )
    assert curve.tau == pytest.approx([0.1, 1.0])
    assert "1 of 3 taus rounded to a multiple of the sample interval" in curve.notes
    assert "1 of 3 taus coincide and are merged" in curve.notes


def test_signature_is_the_contract():
    parameters = inspect.signature(sagnac.stability_curve).parameters
    assert list(parameters)[:7] == [
        "values",
        "kind",
        "sample_rate",
        "estimator",
        "taus",
        "confidence",
        "gaps",
    ]
    assert parameters["kind"].default is inspect.Parameter.empty
    with pytest.raises(TypeError, match="kind"):
        stability_curve(THOUSAND_POINTS, sample_rate=1.0)


GAPPED = np.where(np.arange(100) == 42, np.nan, np.arange(100) % 7)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "phase"}, "kind 'phase' is not known; use one of angle, increment, rate"),
        ({"estimator": "allan"}, "estimator 'allan' is not known"),
        ({"gaps": "fill"}, "gaps 'fill' is not known; use one of reject, omit"),
        ({"sample_rate": 0.0}, "sample_rate 0.0 is not a positive"),
        ({"sample_rate": math.nan}, "sample_rate nan is not a positive"),
        ({"confidence": 95.0}, "give 0.95 for 95 %"),
        ({"noise_type": -3}, "noise_type -3 is out of range for oadev; use -2 to 2"),
        ({"taus": [1e4]}, "10000 s is out of range for oadev; use 0.5 s to 25 s"),
        ({"taus": [0.0]}, "0 s is out of range"),
        ({"taus": []}, "give one or more"),
        ({"taus": [math.nan]}, "not finite"),
        ({"values": np.ones((3, 3))}, "give one channel"),
        ({"values": [1.0]}, "has 1 samples; an Allan variance takes 2 or more"),
        ({"values": np.arange(5.0), "estimator": "theo1"}, "too few for theo1"),
        ({"values": np.arange(50.0), "estimator": "theoh"}, "too few for theoh"),
        ({"values": GAPPED}, r"sample 42 \(21 s\) is missing, 1 in all; use gaps='omit'"),
        ({"values": [1.0, math.inf, 2.0], "gaps": "omit"}, r"sample 1 \(0.5 s\) is infinite"),
        ({"values": [1.0, math.inf, -math.inf]}, r"sample 1 \(0.5 s\) is infinite, 2 in all"),
        ({"values": [1.0, math.nan, math.nan], "gaps": "omit"}, "1 of 3 samples are present"),
        *(
            ({"values": GAPPED, "gaps": "omit", "estimator": name}, f"{name} needs a whole record")
            for name in WHOLE_ONLY
        ),
    ],
)
def test_every_refusal_is_one_line(change, words):
    arguments = {"values": np.arange(100.0) % 7, "kind": "rate", "sample_rate": 2.0} | change
    with pytest.raises(ValueError, match=words) as refusal:
        stability_curve(arguments.pop("values"), **arguments)
    assert "\n" not in str(refusal.value)


def test_cluster_out_of_range_is_refused():
    with pytest.raises(ValueError, match="cluster 600 is out of range for oadev; use 1 to 500"):
        equivalent_degrees_of_freedom("oadev", 0, 600, 1001)
