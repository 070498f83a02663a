"""Sums of differences: by blocks, and with gaps, against plain ones."""

import math

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.core.errors import RecordingError
from sagnac.stability.curve import stability_curve
from tests import naive_stability as naive
from tests.stability.examples import WITH_GAPS


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
    assert curve.notes[0].text == "6 of 160 samples are missing"
    assert "gaps left out" in curve.notes[1].text


def test_taus_that_gaps_leave_without_a_term_are_noted():
    values = np.random.default_rng(2).standard_normal(101)
    values[50] = np.nan
    curve = stability_curve(values, kind="rate", sample_rate=1.0, taus=[5, 40], gaps="omit")
    assert curve.tau.tolist() == [5.0]
    assert any("no term free of gaps" in note.text for note in curve.notes)
    with pytest.raises(RecordingError, match="leave no term"):
        stability_curve(values, kind="rate", sample_rate=1.0, taus=[40], gaps="omit")


@pytest.mark.parametrize("mapped", [False, True])
def test_blocks_do_not_show(monkeypatch, mapped):
    """A record of many blocks, and clusters on both sides of a block, against plain sums."""
    if mapped:
        monkeypatch.setattr(arrays, "IN_MEMORY", 1000)
        monkeypatch.setattr(arrays, "BLOCK", 3000)
        monkeypatch.setattr("sagnac.stability.sums.STARTS", 4096)
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
