"""Windows that are skipped."""

import numpy as np
import pytest

from sagnac.stability.curve import stability_curve
from sagnac.stability.sums import stride_of


@pytest.mark.parametrize(("estimator", "tau"), [("mtotdev", 64), ("theo1", 160), ("theoh", 600)])
def test_skipped_windows_are_stated_and_cost_little(monkeypatch, estimator, tau):
    rates = np.random.default_rng(50).standard_normal(2000)
    options = {"kind": "rate", "sample_rate": 1.0, "estimator": estimator, "taus": [tau]}
    whole = stability_curve(rates, **options)
    monkeypatch.setattr("sagnac.stability.sums.LARGEST_WORK", 1e4)
    skipped = stability_curve(rates, **options)
    assert not any("every k-th" in note.text for note in whole.notes)
    assert any("every k-th window" in note.text for note in skipped.notes)
    assert skipped.terms[0] < whole.terms[0]
    assert skipped.deviation == pytest.approx(whole.deviation, rel=0.02)
    assert skipped.edf == pytest.approx(whole.edf)


def test_a_stride_bounds_the_work_and_never_an_eighth_of_the_cluster():
    windows, squares = np.array([1000, 10**6, 10**9, 10**9]), np.array([100, 3000, 3000, 3000])
    clusters = np.array([80, 10**4, 80, 4])
    assert stride_of(windows, squares, clusters).tolist() == [1, 100, 10, 1]
