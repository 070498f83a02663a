"""Three gyros told apart."""

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from tests.noise.examples import told_apart, white


def test_three_gyros_that_turn_together_are_told_apart():
    truths = {"x": 1.0, "y": 2.0, "z": 4.0}
    common = 50.0 * np.cumsum(white(20_000, 20))
    gyros = {
        name: common + truth * white(20_000, seed)
        for seed, (name, truth) in enumerate(truths.items())
    }
    separation = told_apart(gyros)
    assert separation.notes == ()
    for name, truth in truths.items():
        estimate = separation.angle_random_walk[name]
        assert estimate.status == "estimated"
        assert estimate.low < truth < estimate.high
        assert estimate.value == pytest.approx(truth, rel=0.15)


def test_a_gyro_far_quieter_than_the_others_gets_a_bound_and_a_note():
    generator = np.random.default_rng(3)
    truths = {"x": 0.01, "y": 1.0, "z": 1.0}
    negative = 0
    for _ in range(10):
        gyros = {name: truth * generator.standard_normal(3000) for name, truth in truths.items()}
        separation = told_apart(gyros)
        estimate = separation.angle_random_walk["x"]
        assert estimate.status == "upper bound"
        assert estimate.high > truths["x"]
        assert separation.notes[0].text.startswith("the squared angle random walk of x alone")
        negative += "negative" in separation.notes[0].text
    assert 1 <= negative <= 9


@pytest.mark.statistics
@pytest.mark.parametrize(("samples", "truths"), [(60, (1, 1, 1)), (500, (1, 2, 4))])
def test_intervals_and_bounds_of_three_gyros_hold(samples, truths):
    """Estimates and bounds together, with few and with more degrees of freedom."""
    held, runs = np.zeros(3), 200
    for seed in range(runs):
        generator = np.random.default_rng(seed)
        gyros = {
            name: truth * generator.standard_normal(samples)
            for name, truth in zip("xyz", truths, strict=True)
        }
        separation = told_apart(gyros)
        walks = separation.angle_random_walk.values()
        held += [walk.low <= truth <= walk.high for walk, truth in zip(walks, truths, strict=True)]
    assert held.min() >= 0.9 * runs


def test_a_gyro_that_stands_twice_is_refused():
    gyros = {"x": white(500, 1), "y": white(500, 1), "z": white(500, 3)}
    with pytest.raises(RecordingError, match="the same"):
        told_apart(gyros)
