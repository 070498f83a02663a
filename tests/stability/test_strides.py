"""Windows that are skipped."""

import numpy as np
import pytest

from sagnac.stability.curve import stability_curve
from sagnac.stability.sums import stride_notes, window_stride


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
    assert window_stride(1000, 100, 80) == 1
    assert window_stride(10**6, 3000, 10**4) == 100
    assert window_stride(10**9, 3000, 80) == 10
    assert window_stride(10**9, 3000, 4) == 1
    assert stride_notes("theo1", [1, 1], np.array([10, 20])) == ()
