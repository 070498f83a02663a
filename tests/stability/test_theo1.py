"""Theo1 and its bias-removed hybrid."""

import math

import numpy as np
import pytest

from sagnac.stability.curve import stability_curve
from tests import naive_stability as naive
from tests.stability.examples import THOUSAND_POINTS


def test_theo1_tau_is_three_quarters_of_its_span():
    curve = stability_curve(
        THOUSAND_POINTS, kind="rate", sample_rate=2.0, estimator="theo1", taus=[5, 50]
    )
    assert curve.tau.tolist() == [3.75, 37.5]


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
