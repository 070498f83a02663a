"""Compiled loops of the rig: arrays and states in, arrays and states out; no validation."""

# Compiled loops take their arguments by position.
# ruff: noqa: PLR0917

import numpy as np

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.core.kernels import compiled


@compiled()
def oscillator(
    normals: FloatArray,
    transition: FloatArray,
    spread: FloatArray,
    state: FloatArray,
    angle: FloatArray,
    rate: FloatArray,
) -> None:
    """Add a damped oscillator driven by white noise, stepped exactly, to `angle` and `rate`.

    `normals` (n, 2); `transition` and `spread`, the noise factor, (2, 2); `state` (2,) holds angle
    and rate at the last step and is changed.
    """
    held_angle, held_rate = state
    for n in range(normals.shape[0]):
        free_angle = transition[0, 0] * held_angle + transition[0, 1] * held_rate
        free_rate = transition[1, 0] * held_angle + transition[1, 1] * held_rate
        held_angle = free_angle + spread[0, 0] * normals[n, 0]
        held_rate = free_rate + spread[1, 0] * normals[n, 0] + spread[1, 1] * normals[n, 1]
        angle[n] += held_angle
        rate[n] += held_rate
    state[0], state[1] = held_angle, held_rate


# ---- encoder and gyros ---------------------------------------------------------------


@compiled()
def null_pulse(
    alpha: FloatArray,
    errors: FloatArray,
    missing: BooleanArray,
    margin: float,
    state: FloatArray,
    pulse: BooleanArray,
) -> None:
    """Mark the first sample past each null that is not `missing`, each with its own error.

    `margin` is how far from a null just passed the table counts as away from it, rad. `state` (3,)
    is changed: turns completed, passages so far, and the angle of the null just passed. That is NaN
    once the table is away from it, so that jitter fires no null twice.
    """
    turn = 2.0 * np.pi
    turns, passages, passed = state
    for n in range(alpha.size):
        if abs(alpha[n] - passed) <= margin:
            continue
        passage = int(passages) % errors.size
        if alpha[n] >= turn * (turns + 1.0) + errors[passage]:
            turns += 1.0
            passed = turn * turns
        elif alpha[n] < turn * turns + errors[passage]:
            passed = turn * turns
            turns -= 1.0
        else:
            passed = np.nan
            continue
        passages += 1.0
        pulse[n] = not missing[passage]
    state[0], state[1], state[2] = turns, passages, passed


@compiled()
def slow_drift(normals: FloatArray, processes: FloatArray, out: FloatArray) -> None:
    """Add independent first-order Markov processes, each at the last step and at this one.

    `normals` (n, processes). Rows of `processes` (5, processes): decay, spread, the weights before
    and after a step, and the state, which is changed.
    """
    decay, spread, before, after, levels = processes
    for n in range(out.size):
        total = 0.0
        for j in range(decay.size):
            level = decay[j] * levels[j] + spread[j] * normals[n, j]
            total += before[j] * levels[j] + after[j] * level
            levels[j] = level
        out[n] += total
