"""The fit that the answer rests on."""

import dataclasses

from sagnac.analysis.result import headline_estimates, headline_fit
from tests.handmade import N, analysis, estimate


def test_the_headline_is_of_the_fit_that_gave_it():
    fit = headline_fit(analysis())
    assert fit is not None
    assert fit.method == "likelihood"
    assert list(headline_estimates(analysis())) == [
        "quantization", "angle_random_walk", "bias_instability", "rate_random_walk",
    ]  # fmt: skip


def test_an_answer_of_no_fit_stands_alone():
    other = dataclasses.replace(analysis(), angle_random_walk=estimate(7 * N))
    assert headline_fit(other) is None
    assert headline_estimates(other) == {"angle_random_walk": estimate(7 * N)}
