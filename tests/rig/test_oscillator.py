"""The damped oscillator keeps its variance at every step, and rings down when it is not driven."""

import math

import numpy as np
import pytest

from sagnac.rig.table import Oscillator


def oscillator(step, frequency=17.0, quality=20.0, seed=0):
    return Oscillator(
        frequency=frequency,
        damping=0.5 / quality,
        rms_rate=1.0,
        step=step,
        random=np.random.default_rng(seed),
    )


@pytest.mark.parametrize("step", [1e-6, 1e-3, 0.02, 5.0])
@pytest.mark.parametrize("quality", [0.5, 20.0, 1000.0])
def test_a_step_leaves_the_stationary_covariance(step, quality):
    """What a step keeps and what it adds make up the covariance, from short steps to long."""
    made = oscillator(step, quality=quality)
    natural = 2 * math.pi * 17.0
    stationary = np.diag([natural**-2, 1.0])
    after = made.transition @ stationary @ made.transition.T + made.spread @ made.spread.T
    scale = np.sqrt(np.outer(np.diag(stationary), np.diag(stationary)))
    np.testing.assert_allclose(after / scale, np.eye(2), atol=1e-9)


def test_many_short_steps_add_what_one_long_step_adds():
    """Two ways to one covariance: the integral of short steps, the difference of a long one."""
    short, long = oscillator(1e-4), oscillator(0.1)
    added = np.zeros((2, 2))
    for _ in range(1000):
        added = short.transition @ added @ short.transition.T + short.spread @ short.spread.T
    np.testing.assert_allclose(added, long.spread @ long.spread.T, rtol=1e-8, atol=1e-14)


def test_it_rings_down_by_its_quality():
    made = oscillator(1e-3)
    angle = made.angles(np.zeros(4000, dtype=bool))
    peaks = np.abs(angle)
    # Amplitude falls as exp(-pi f t / Q): by 2.67 a second at 17 Hz and a quality of 20.
    first, later = peaks[:200].max(), peaks[1000:1200].max()
    assert math.log(first / later) == pytest.approx(math.pi * 17.0 / 20.0, rel=0.02)
