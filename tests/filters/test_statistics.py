"""How often the model of a filter lies above the true Allan deviation, and by how much."""

import numpy as np
import pytest
from scipy.signal import lfilter

from sagnac.coefficients.laws import markov_allan_variance
from sagnac.filters.overbound import overbound, upper_limit
from sagnac.stability.curve import stability_curve

RUNS = 250
SECONDS = 7200


def markov(random, driving_noise, time):
    decay = np.exp(-1.0 / time)
    deviation = driving_noise * np.sqrt(0.5 * time)
    steps = deviation * np.sqrt(1.0 - decay**2) * random.standard_normal(SECONDS)
    steps[0] = deviation * random.standard_normal()
    return lfilter([1.0], [1.0, -decay], steps)


def noise(random, walk, driving_noise, time):
    rate = random.standard_normal(SECONDS)
    rate += walk * np.cumsum(random.standard_normal(SECONDS))
    return rate + markov(random, driving_noise, time)


# Four kinds of 250 recordings each: a thousand. Walk, driving noise and time of a Markov rate.
KINDS = {
    "white": (0.0, 0.0, 1.0),
    "walk": (0.01, 0.0, 1.0),
    "Markov": (0.0, 0.03, 100.0),
    "both": (0.002, 0.03, 30.0),
}


@pytest.mark.statistics
def test_the_model_lies_above_the_truth_and_not_far_above():
    random = np.random.default_rng(7)
    above, inflations = {}, {}
    for kind, (walk, driving_noise, time) in KINDS.items():
        held, inflated = 0, []
        for _ in range(RUNS):
            curve = stability_curve(
                noise(random, walk, driving_noise, time), kind="rate", sample_rate=1.0
            )
            bound = overbound(upper_limit(curve.tau, curve.deviation, curve.edf))
            tau = bound.limit.tau
            truth = 1.0 / tau + walk**2 * tau / 3.0
            truth = truth + markov_allan_variance(tau, driving_noise, time)
            ratio = bound.model.allan_deviation(tau) / np.sqrt(truth)
            held += bool(ratio.min() >= 1.0)
            inflated.append(float(np.median(ratio)))
        above[kind], inflations[kind] = held / RUNS, float(np.median(inflated))
        print(f"{kind}: above in {100.0 * above[kind]:.1f} %, inflation {inflations[kind]:.3f}")
    assert np.mean(list(above.values())) >= 0.95
    # Each kind alone, with three standard errors of its 250.
    assert min(above.values()) > 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / RUNS)
    assert max(inflations.values()) <= 1.3
