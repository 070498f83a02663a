"""Step 4 answers where our interval would not."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.analysis.allan_fit import step_4
from sagnac.coefficients.curve_fit import paper_fit
from sagnac.coefficients.estimates import Estimate
from sagnac.stability.curve import stability_curve

NAN = float("nan")


def curve_of(seed, samples=1800):
    walk = np.cumsum(1e-8 * np.random.default_rng(seed).standard_normal(samples))
    return stability_curve(walk, kind="angle", sample_rate=1.0)


def test_an_estimate_of_the_fit_is_the_answer():
    curve = curve_of(1, 20_000)
    fitted = paper_fit(curve).coefficients["angle_random_walk"]
    assert fitted.status == "estimated"
    assert step_4(curve, fitted, 1) == fitted


def test_where_our_interval_sees_nothing_the_squares_still_answer():
    unseen = Estimate(
        value=NAN, low=NAN, high=NAN, confidence=0.95, status="not observable",
        name="angle_random_walk",
    )  # fmt: skip
    values = []
    for seed in range(20):
        answer = step_4(curve_of(seed), unseen, 1)
        assert answer.status in {"estimated", "not observable"}
        if answer.status == "estimated":
            assert answer.low == 0.0
            assert answer.high >= answer.value
            values.append(answer.value)
    # Half an hour of white rate: five terms share it, so that N comes out low and scatters.
    assert len(values) > 15
    assert 0.7e-8 < np.median(values) < 1.1e-8
    pair = step_4(replace(curve_of(2)), unseen, 2)
    assert pair.value == pytest.approx(step_4(curve_of(2), unseen, 1).value / np.sqrt(2.0))
