"""The model of a filter against the processes that it stands for."""

import numpy as np
import pytest

from sagnac.navigation.models import FilterModel, Markov


def test_a_markov_rate_in_steps_is_stationary():
    one = Markov(driving_noise=0.3, correlation_time=20.0)
    for interval in (0.01, 1.0, 300.0):
        decay, step = one.decay(interval), one.step(interval)
        assert decay**2 * one.deviation**2 + step**2 == pytest.approx(one.deviation**2)
    # A short step adds the driving noise alone.
    assert one.step(1e-4) == pytest.approx(0.3 * 1e-2, rel=1e-4)


def test_the_deviation_is_that_of_the_steps():
    # Independent of the laws: the mean Allan variance of rates made step by step, a thousand times.
    model = FilterModel(
        white=0.5, walk=0.05, markov=(Markov(driving_noise=0.2, correlation_time=8.0),)
    )
    random = np.random.default_rng(4)
    runs, steps = 4000, 96
    (one,) = model.markov
    rate = np.empty((runs, steps))
    slow = one.deviation * random.standard_normal(runs)
    bias = np.zeros(runs)
    for step in range(steps):
        slow = one.decay(1.0) * slow + one.step(1.0) * random.standard_normal(runs)
        bias += model.walk_per_sample(1.0) * random.standard_normal(runs)
        rate[:, step] = slow + bias + model.white_per_sample(1.0) * random.standard_normal(runs)
    for factor in (8, 32):
        means = rate[:, : steps // factor * factor].reshape(runs, -1, factor).mean(axis=2)
        measured = np.sqrt(0.5 * np.mean(np.diff(means, axis=1) ** 2))
        (law,) = model.allan_deviation(np.array([float(factor)]))
        # Rates held over a step differ a little from those that vary within it.
        assert measured == pytest.approx(law, rel=0.03)


def test_figures_are_checked():
    with pytest.raises(ValueError, match="white"):
        FilterModel(white=-1.0)
    with pytest.raises(ValueError, match="correlation_time"):
        Markov(driving_noise=1.0, correlation_time=0.0)
