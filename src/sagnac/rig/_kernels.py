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


class OscillatorState(NamedTuple):
    """Angle and rate of the servo's oscillator, rad and rad/s."""

    angle: float
    rate: float


class RateNoiseState(NamedTuple):
    """Markov process of unit variance, the rate it makes, and the angle of that rate."""

    level: float
    rate: float
    angle: float


class NullState(NamedTuple):
    """Null pulse: turns completed, passages so far, and the null just passed.

    The null just passed is NaN once the table is away from it, so that jitter fires no null twice.
    """

    turns: float
    passages: int
    passed: float


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
    state: OscillatorState,
    angle: FloatArray,
    rate: FloatArray,
) -> OscillatorState:
    """Add a damped oscillator driven by white noise, stepped exactly, to `angle` and `rate`.

    `normals` (n, 2); `transition` and `spread`, the noise factor, (2, 2).
    """
    held_angle, held_rate = state
    for n in range(normals.shape[0]):
        free_angle = transition[0, 0] * held_angle + transition[0, 1] * held_rate
        free_rate = transition[1, 0] * held_angle + transition[1, 1] * held_rate
        held_angle = free_angle + spread[0, 0] * normals[n, 0]
        held_rate = free_rate + spread[1, 0] * normals[n, 0] + spread[1, 1] * normals[n, 1]
        angle[n] += held_angle
        rate[n] += held_rate
    return OscillatorState(held_angle, held_rate)


@compiled()
def rate_noise(
    normals: FloatArray,
    decay: float,
    spread: float,
    scale: FloatArray,
    step: float,
    state: RateNoiseState,
    angle: FloatArray,
    rate: FloatArray,
) -> RateNoiseState:
    """Add first-order Markov noise of the rate, integrated by trapezoids.

    `scale` (n,) is the rms rate at each node.
    """
    level, before, turned = state
    for n in range(normals.size):
        level = decay * level + spread * normals[n]
        now = scale[n] * level
        turned += 0.5 * step * (before + now)
        before = now
        angle[n] += turned
        rate[n] += now
    return RateNoiseState(level, before, turned)


# ---- disturbances --------------------------------------------------------------------


@compiled()
def _to_power(
    power: int,
    order: float,
    cosine: FloatArray,
    sine: FloatArray,
    real: FloatArray,
    imaginary: FloatArray,
) -> int:
    # From exp(i power alpha) to exp(i order alpha), one factor at a time.
    while power < order:
        power += 1
        for n in range(real.size):
            product = real[n] * cosine[n] - imaginary[n] * sine[n]
            imaginary[n] = real[n] * sine[n] + imaginary[n] * cosine[n]
            real[n] = product
    return power


@compiled()
def harmonics(
    alpha: FloatArray,
    orders: FloatArray,
    in_phase: FloatArray,
    quadrature: FloatArray,
    out: FloatArray,
) -> None:
    """Add ``in_phase * cos(k alpha) + quadrature * sin(k alpha)`` per channel, ascending k.

    `in_phase` and `quadrature` (channels, terms), `out` (channels, n).
    """
    length = 1024
    for start in range(0, alpha.size, length):
        part = alpha[start : start + length]
        cosine = np.cos(part)
        sine = np.sin(part)
        real = np.ones(part.size)
        imaginary = np.zeros(part.size)
        power = 0
        for j in range(orders.size):
            whole = orders[j] == np.floor(orders[j])
            if whole:
                power = _to_power(power, orders[j], cosine, sine, real, imaginary)
            for c in range(out.shape[0]):
                a = in_phase[c, j]
                b = quadrature[c, j]
                if whole:
                    for n in range(part.size):
                        out[c, start + n] += a * real[n] + b * imaginary[n]
                else:
                    for n in range(part.size):
                        argument = orders[j] * part[n]
                        out[c, start + n] += a * np.cos(argument) + b * np.sin(argument)


@compiled()
def lines_in_time(
    first: int,
    cycles_per_sample: FloatArray,
    in_phase: FloatArray,
    quadrature: FloatArray,
    out: FloatArray,
) -> None:
    """Add ``in_phase * cos(2 pi f n) + quadrature * sin(2 pi f n)`` per channel.

    `first` is the number n of the first sample in `out` (channels, n).
    """
    length = 256
    for j in range(cycles_per_sample.size):
        rotate_real = np.cos(2.0 * np.pi * cycles_per_sample[j])
        rotate_imaginary = np.sin(2.0 * np.pi * cycles_per_sample[j])
        for start in range(0, out.shape[1], length):
            cycles = cycles_per_sample[j] * (first + start)
            cycles -= np.floor(cycles)
            real = np.cos(2.0 * np.pi * cycles)
            imaginary = np.sin(2.0 * np.pi * cycles)
            for n in range(start, min(start + length, out.shape[1])):
                for c in range(out.shape[0]):
                    out[c, n] += in_phase[c, j] * real + quadrature[c, j] * imaginary
                product = real * rotate_real - imaginary * rotate_imaginary
                imaginary = real * rotate_imaginary + imaginary * rotate_real
                real = product


# ---- encoder and gyros ---------------------------------------------------------------


@compiled()
def null_pulse(
    alpha: FloatArray,
    errors: FloatArray,
    margin: float,
    state: NullState,
    pulse: BooleanArray,
) -> NullState:
    """Mark the first sample past each null, each passage with its own error.

    `margin` is how far from a null just passed the table counts as away from it, rad.
    """
    turn = 2.0 * np.pi
    turns, passages, passed = state
    for n in range(alpha.size):
        pulse[n] = False
        if abs(alpha[n] - passed) <= margin:
            continue
        error = errors[passages % errors.size]
        if alpha[n] >= turn * (turns + 1.0) + error:
            turns += 1.0
            passages += 1
            passed = turn * turns
            pulse[n] = True
        elif alpha[n] < turn * turns + error:
            passed = turn * turns
            turns -= 1.0
            passages += 1
            pulse[n] = True
        else:
            passed = np.nan
    return NullState(turns, passages, passed)


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


@compiled()
def readout(
    true: FloatArray,
    noise: FloatArray,
    drift: FloatArray,
    step: float,
    quantum: float,
    walked: float,
    out: FloatArray,
) -> float:
    """Add true angle and walk to the disturbances in `out`, round, return where the walk got to.

    `noise` and `drift` are a sample's random angle and its slow rate; `quantum` is the readout
    step, 0 for none.
    """
    for n in range(true.size):
        walked += noise[n] + drift[n] * step
        angle = true[n] + walked + out[n]
        if quantum > 0.0:
            angle = np.rint(angle / quantum) * quantum
        out[n] = angle
    return walked


@compiled()
def dither_swing(
    first: int,
    cycles: float,
    phase: float,
    shaken: FloatArray,
    left: tuple[float, float],
    angle: FloatArray,
    shown: FloatArray,
) -> None:
    """Add ``Re(left z)`` to `angle` and ``Re(z)`` to `shown`, both (n,).

    ``z = (1 + shaken[:, 0] + i shaken[:, 1]) exp(i (2 pi cycles n + phase))``, with `first` the
    number n of the first sample.
    """
    for n in range(angle.size):
        turns = (first + n) * cycles
        argument = 2.0 * np.pi * (turns - np.floor(turns)) + phase
        cosine, sine = np.cos(argument), np.sin(argument)
        real = (1.0 + shaken[n, 0]) * cosine - shaken[n, 1] * sine
        imaginary = (1.0 + shaken[n, 0]) * sine + shaken[n, 1] * cosine
        angle[n] += left[0] * real - left[1] * imaginary
        shown[n] += real
