"""Compiled loops of the rig: arrays and named states in, arrays and states out; no validation."""

# Compiled loops take their arguments by position.
# ruff: noqa: PLR0917

from typing import NamedTuple

import numpy as np

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.core.kernels import compiled


class Orders(NamedTuple):
    """Terms at orders of an angle: ascending orders, sizes and phases in rad, each (terms,)."""

    order: FloatArray
    size: FloatArray
    phase: FloatArray


class MotionState(NamedTuple):
    """Table at the last node: drive and its rate, Earth rate in b, and its integral in b."""

    drive: float
    rate: float
    earth: tuple[float, float, float]
    turned: tuple[float, float, float]


# ---- table ---------------------------------------------------------------------------


@compiled()
def earth_in_table(alpha: float, earth: FloatArray, wobble: Orders) -> tuple[float, float, float]:
    """Earth rate along b when the shaft is tilted by the wobble at this table angle."""
    tilt_x = 0.0
    tilt_y = 0.0
    for j in range(wobble.order.size):
        tilt_x += wobble.size[j] * np.cos(wobble.order[j] * alpha + wobble.phase[j])
        tilt_y += wobble.size[j] * np.sin(wobble.order[j] * alpha + wobble.phase[j])
    first = earth[0] - tilt_y * earth[2]
    second = earth[1] + tilt_x * earth[2]
    third = earth[2] - tilt_x * earth[1] + tilt_y * earth[0]
    cosine = np.cos(alpha)
    sine = np.sin(alpha)
    return cosine * first + sine * second, cosine * second - sine * first, third


@compiled()
def table_angle(drive: float, ripple: Orders) -> float:
    """Table angle at a drive angle: ripple of the rate at orders of the drive."""
    angle = drive
    for j in range(ripple.order.size):
        angle += (
            ripple.size[j] / ripple.order[j] * np.sin(ripple.order[j] * drive + ripple.phase[j])
        )
    return angle


@compiled()
def with_tilt(alpha: float, wobble: Orders, along_x: float, along_y: float) -> tuple[float, float]:
    """Angles along the two level axes of b, with what the shaft's own tilting adds to them.

    It adds, in closed form, the integral of i m a exp(i((m - 1) alpha + p)) over alpha.
    """
    for j in range(wobble.order.size):
        relative = wobble.order[j] - 1.0
        scale = wobble.order[j] * wobble.size[j]
        if relative == 0.0:
            along_x -= scale * alpha * np.sin(wobble.phase[j])
            along_y += scale * alpha * np.cos(wobble.phase[j])
        else:
            argument = relative * alpha + wobble.phase[j]
            along_x += scale / relative * np.cos(argument)
            along_y += scale / relative * np.sin(argument)
    return along_x, along_y


@compiled()
def motion(
    drive: FloatArray,
    rate: FloatArray,
    step: float,
    substeps: int,
    ripple: Orders,
    earth: FloatArray,
    wobble: Orders,
    state: MotionState,
    alpha: FloatArray,
    turned: FloatArray,
) -> MotionState:
    """Integrate the rate along b over the nodes; keep every `substeps`-th.

    `drive` and `rate` are node values after each step; between nodes the drive is the
    cubic through both ends' angles and rates, and each integral is Simpson's. `turned` (3, n)
    takes the Earth's part of the angle along b, with the wobble's in 0 and 1.
    """
    drive_before, rate_before, begin, integral = state
    turned_x, turned_y, turned_z = integral
    for n in range(drive.size):
        middle_drive = 0.5 * (drive_before + drive[n]) + 0.125 * step * (rate_before - rate[n])
        end_angle = table_angle(drive[n], ripple)
        middle = earth_in_table(table_angle(middle_drive, ripple), earth, wobble)
        end = earth_in_table(end_angle, earth, wobble)
        turned_x += step / 6.0 * (begin[0] + 4.0 * middle[0] + end[0])
        turned_y += step / 6.0 * (begin[1] + 4.0 * middle[1] + end[1])
        turned_z += step / 6.0 * (begin[2] + 4.0 * middle[2] + end[2])
        drive_before, rate_before, begin = drive[n], rate[n], end
        if (n + 1) % substeps == 0:
            k = n // substeps
            alpha[k] = end_angle
            turned[0, k], turned[1, k] = with_tilt(end_angle, wobble, turned_x, turned_y)
            turned[2, k] = turned_z
    return MotionState(drive_before, rate_before, begin, (turned_x, turned_y, turned_z))


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
def slow_drift(
    normals: FloatArray,
    decay: FloatArray,
    spread: FloatArray,
    before: FloatArray,
    after: FloatArray,
    levels: FloatArray,
    out: FloatArray,
) -> None:
    """Add independent first-order Markov processes, each at the last step and at this one.

    `normals` (n, processes); the others (processes,), weights `before` and `after`; `levels` holds
    the processes' state and is changed.
    """
    for n in range(out.size):
        total = 0.0
        for j in range(decay.size):
            level = decay[j] * levels[j] + spread[j] * normals[n, j]
            total += before[j] * levels[j] + after[j] * level
            levels[j] = level
        out[n] += total
