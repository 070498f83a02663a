"""From samples to the angle: kinds, gaps, and records out of memory."""

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.stability.curve import stability_curve
from tests import naive_stability as naive
from tests.stability.examples import ESTIMATORS, WITH_GAPS


@pytest.mark.parametrize("kind", ["rate", "increment", "angle"])
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_record_out_of_memory_has_the_same_curve(monkeypatch, estimator, kind):
    values = np.random.default_rng(9).standard_normal(2_251)
    inside = stability_curve(values, kind=kind, sample_rate=10.0, estimator=estimator)
    monkeypatch.setattr(arrays, "IN_MEMORY", 250)
    monkeypatch.setattr("sagnac.stability.sums.STARTS", 1024)
    mapped = arrays.empty(values.size)
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
    monkeypatch.setattr(arrays, "IN_MEMORY", 1000)
    monkeypatch.setattr(arrays, "BLOCK", 700)
    monkeypatch.setattr("sagnac.stability.sums.STARTS", 4096)
    mapped = arrays.empty(values.size)
    mapped[:] = values
    outside = stability_curve(mapped, kind=kind, sample_rate=10.0, estimator=estimator, gaps="omit")
    _assert_same(inside, outside)


def _assert_same(inside, outside):
    assert inside.notes == outside.notes
    for name in ("tau", "terms", "noise_type"):
        assert np.array_equal(getattr(inside, name), getattr(outside, name))
    for name in ("deviation", "edf", "low", "high"):
        assert getattr(outside, name) == pytest.approx(getattr(inside, name), rel=1e-12)


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
