"""Noise that goes with lines when they are removed, given back to the curve."""

import numpy as np
import pytest

from sagnac.lines.taken_noise import with_noise_restored
from sagnac.stability.curve import stability_curve

RATES = np.random.default_rng(4).standard_normal(1000)


def test_variance_that_lines_took_is_added_and_said():
    curve = stability_curve(RATES, kind="rate", sample_rate=1.0, taus=[1, 10, 100])
    taken = np.array([0.0, 0.25, 1.0]) * curve.deviation**2
    restored = with_noise_restored(curve, taken, 12)
    assert restored.deviation**2 == pytest.approx(curve.deviation**2 + taken)
    factor = np.sqrt([1.0, 1.25, 2.0])
    assert restored.low == pytest.approx(curve.low * factor)
    assert restored.high == pytest.approx(curve.high * factor)
    assert restored.edf == pytest.approx(curve.edf)
    assert restored.notes[-1].text == (
        "removal of 12 lines took up to 50 % of the noise variance (at tau = 100 s); "
        "it is added back"
    )
    assert with_noise_restored(curve, 1e-5 * taken, 1).notes == curve.notes


def test_variance_that_lines_took_belongs_to_an_allan_deviation():
    curve = stability_curve(RATES, kind="rate", sample_rate=1.0, estimator="hdev")
    with pytest.raises(ValueError, match="give adev or oadev"):
        with_noise_restored(curve, np.zeros(curve.tau.size), 1)
    curve = stability_curve(RATES, kind="rate", sample_rate=1.0)
    for wrong in (np.zeros(1), np.full(curve.tau.size, np.nan)):
        with pytest.raises(ValueError, match="give one variance, zero or more"):
            with_noise_restored(curve, wrong, 1)
