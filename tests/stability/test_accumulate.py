"""From samples to the angle: kinds, gaps, and records out of memory."""

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.stability.curve import stability_curve
from tests import naive_stability as naive
from tests.stability.examples import ESTIMATORS, WITH_GAPS


@pytest.mark.parametrize("kind", ["rate", "increment", "angle"])
@pytest.mark.parametrize(
    ("estimator", "gaps"),
    [*((name, "reject") for name in ESTIMATORS), *((name, "omit") for name in WITH_GAPS)],
)
def test_a_record_out_of_memory_has_the_same_curve(monkeypatch, estimator, gaps, kind):
    values = np.random.default_rng(9).standard_normal(12_345 if gaps == "omit" else 2_251)
    starts = 1024
    if gaps == "omit":
        values[[0, 700, 701, 5000, 12_344]] = values[1000:1100:7] = np.nan
        monkeypatch.setattr(arrays, "BLOCK", 700)
        starts = 4096
    how = {"kind": kind, "sample_rate": 10.0, "estimator": estimator, "gaps": gaps}
    inside = stability_curve(values, **how)
    monkeypatch.setattr(arrays, "IN_MEMORY", 250)
    monkeypatch.setattr("sagnac.stability.sums.STARTS", starts)
    mapped = arrays.empty(values.size)
    mapped[:] = values
    outside = stability_curve(mapped, **how)
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
