"""Compiled loops of the rig: arrays in, arrays out; no validation, no files."""

# Compiled loops take their arrays by position.
# ruff: noqa: PLR0917

import numba
import numpy as np

from sagnac.arrays import BooleanArray, FloatArray


@numba.njit(cache=True)
def rig_earth_in_table(
    alpha: float,
    earth: FloatArray,
    order: FloatArray,
    amplitude: FloatArray,
    phase: FloatArray,
) -> tuple[float, float, float]:
    """Earth rate along b when the shaft is tilted by the wobble at this angle."""
    tilt_x = 0.0
    tilt_y = 0.0
    for j in range(order.size):
        tilt_x += amplitude[j] * np.cos(order[j] * alpha + phase[j])
        tilt_y += amplitude[j] * np.sin(order[j] * alpha + phase[j])
    first = earth[0] - tilt_y * earth[2]
    second = earth[1] + tilt_x * earth[2]
    third = earth[2] - tilt_x * earth[1] + tilt_y * earth[0]
    cosine = np.cos(alpha)
    sine = np.sin(alpha)
    return cosine * first + sine * second, cosine * second - sine * first, third


@numba.njit(cache=True)
def rig_table_angle(
    drive: float,
    order: FloatArray,
    fraction: FloatArray,
    phase: FloatArray,
) -> float:
    """Table angle at a drive angle: ripple of the rate at orders of the drive."""
    angle = drive
    for j in range(order.size):
        angle += fraction[j] / order[j] * np.sin(order[j] * drive + phase[j])
    return angle


@numba.njit(cache=True)
def rig_motion(
    drive: FloatArray,
    rate: FloatArray,
    step: float,
    substeps: int,
    ripple_order: FloatArray,
    ripple_fraction: FloatArray,
    ripple_phase: FloatArray,
    earth: FloatArray,
    wobble_order: FloatArray,
    wobble_amplitude: FloatArray,
    wobble_phase: FloatArray,
    state: FloatArray,
    alpha: FloatArray,
    turned: FloatArray,
) -> None:
    """Integrate the rate along b over the nodes; keep every `substeps`-th.

    `drive` and `rate` are node values after each step; between nodes the drive is the
    cubic through both ends' angles and rates, and each integral is Simpson's. `state`
    carries drive, rate and integrand of the last node and the three integrals.
    `turned[k]` is the Earth's part of the angle along b, with the wobble's in 0 and 1.
    """
    for n in range(drive.size):
        middle_drive = 0.5 * (state[0] + drive[n]) + 0.125 * step * (state[1] - rate[n])
        middle = rig_table_angle(middle_drive, ripple_order, ripple_fraction, ripple_phase)
        end = rig_table_angle(drive[n], ripple_order, ripple_fraction, ripple_phase)
        middle_1, middle_2, middle_3 = rig_earth_in_table(
            middle, earth, wobble_order, wobble_amplitude, wobble_phase
        )
        end_1, end_2, end_3 = rig_earth_in_table(
            end, earth, wobble_order, wobble_amplitude, wobble_phase
        )
        state[5] += step / 6.0 * (state[2] + 4.0 * middle_1 + end_1)
        state[6] += step / 6.0 * (state[3] + 4.0 * middle_2 + end_2)
        state[7] += step / 6.0 * (state[4] + 4.0 * middle_3 + end_3)
        state[0] = drive[n]
        state[1] = rate[n]
        state[2] = end_1
        state[3] = end_2
        state[4] = end_3
        if (n + 1) % substeps == 0:
            k = n // substeps
            alpha[k] = end
            turned[0, k] = state[5]
            turned[1, k] = state[6]
            turned[2, k] = state[7]
            # The shaft's own tilting rate seen from the turning table, in closed form:
            # the integral of i m a exp(i((m - 1) alpha + p)) over alpha.
            for j in range(wobble_order.size):
                relative = wobble_order[j] - 1.0
                scale = wobble_order[j] * wobble_amplitude[j]
                if relative == 0.0:
                    turned[0, k] -= scale * end * np.sin(wobble_phase[j])
                    turned[1, k] += scale * end * np.cos(wobble_phase[j])
                else:
                    argument = relative * end + wobble_phase[j]
                    turned[0, k] += scale / relative * np.cos(argument)
                    turned[1, k] += scale / relative * np.sin(argument)


@numba.njit(cache=True)
def rig_jitter(
    normals: FloatArray,
    transition: FloatArray,
    spread: FloatArray,
    state: FloatArray,
    angle: FloatArray,
    rate: FloatArray,
) -> None:
    """Position-servo jitter: a damped oscillator driven by white noise, stepped exactly."""
    for n in range(normals.shape[0]):
        x = transition[0, 0] * state[0] + transition[0, 1] * state[1]
        v = transition[1, 0] * state[0] + transition[1, 1] * state[1]
        state[0] = x + spread[0, 0] * normals[n, 0]
        state[1] = v + spread[1, 0] * normals[n, 0] + spread[1, 1] * normals[n, 1]
        angle[n] += state[0]
        rate[n] += state[1]


@numba.njit(cache=True)
def rig_wander(
    normals: FloatArray,
    decay: float,
    spread: float,
    scale: FloatArray,
    step: float,
    state: FloatArray,
    angle: FloatArray,
    rate: FloatArray,
) -> None:
    """Slow relative wander of the rate: first-order Markov, integrated by trapezoids."""
    for n in range(normals.size):
        state[0] = decay * state[0] + spread * normals[n]
        now = scale[n] * state[0]
        state[2] += 0.5 * step * (state[1] + now)
        state[1] = now
        angle[n] += state[2]
        rate[n] += now


@numba.njit(cache=True)
def rig_markov(
    normals: FloatArray,
    decay: FloatArray,
    spread: FloatArray,
    weight: float,
    state: FloatArray,
    out: FloatArray,
) -> None:
    """Sum of independent first-order Markov processes plus a random walk (the last column)."""
    terms = decay.size
    for n in range(out.size):
        total = 0.0
        for j in range(terms):
            state[j] = decay[j] * state[j] + spread[j] * normals[n, j]
            total += state[j]
        state[terms] += weight * normals[n, terms]
        out[n] += total + state[terms]


@numba.njit(cache=True)
def rig_harmonics(
    alpha: FloatArray,
    orders: FloatArray,
    in_phase: FloatArray,
    quadrature: FloatArray,
    out: FloatArray,
) -> None:
    """Add ``in_phase * cos(k alpha) + quadrature * sin(k alpha)`` per channel, ascending k."""
    length = 1024
    cosine = np.empty(length)
    sine = np.empty(length)
    real = np.empty(length)
    imaginary = np.empty(length)
    for start in range(0, alpha.size, length):
        count = min(length, alpha.size - start)
        for n in range(count):
            cosine[n] = np.cos(alpha[start + n])
            sine[n] = np.sin(alpha[start + n])
            real[n] = 1.0
            imaginary[n] = 0.0
        power = 0
        for j in range(orders.size):
            whole = orders[j] == np.floor(orders[j])
            if whole:
                while power < orders[j]:
                    power += 1
                    for n in range(count):
                        product = real[n] * cosine[n] - imaginary[n] * sine[n]
                        imaginary[n] = real[n] * sine[n] + imaginary[n] * cosine[n]
                        real[n] = product
            for c in range(out.shape[0]):
                a = in_phase[c, j]
                b = quadrature[c, j]
                if whole:
                    for n in range(count):
                        out[c, start + n] += a * real[n] + b * imaginary[n]
                else:
                    for n in range(count):
                        argument = orders[j] * alpha[start + n]
                        out[c, start + n] += a * np.cos(argument) + b * np.sin(argument)


@numba.njit(cache=True)
def rig_time_lines(
    first: int,
    cycles_per_sample: FloatArray,
    in_phase: FloatArray,
    quadrature: FloatArray,
    out: FloatArray,
) -> None:
    """Add ``in_phase * cos(2 pi f n) + quadrature * sin(2 pi f n)`` per channel."""
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


@numba.njit(cache=True)
def rig_null_pulse(
    alpha: FloatArray,
    errors: FloatArray,
    margin: float,
    state: FloatArray,
    pulse: BooleanArray,
) -> None:
    """Mark the first sample past each null, each passage with its own error.

    `state`: turns completed, passages so far (both whole numbers), the null just passed
    (NaN once the table is `margin` away from it, so that jitter fires no null twice).
    """
    turn = 2.0 * np.pi
    for n in range(alpha.size):
        pulse[n] = False
        if abs(alpha[n] - state[2]) <= margin:
            continue
        error = errors[int(state[1]) % errors.size]
        if alpha[n] >= turn * (state[0] + 1.0) + error:
            state[0] += 1.0
            state[1] += 1.0
            state[2] = turn * state[0]
            pulse[n] = True
        elif alpha[n] < turn * state[0] + error:
            state[2] = turn * state[0]
            state[0] -= 1.0
            state[1] += 1.0
            pulse[n] = True
        else:
            state[2] = np.nan


@numba.njit(cache=True)
def rig_readout(
    true: FloatArray,
    noise: FloatArray,
    drift: FloatArray,
    step: float,
    quantum: float,
    state: FloatArray,
    out: FloatArray,
) -> None:
    """Add true angle and walk to the disturbances in `out`, and round to the readout step.

    `noise` and `drift` are a sample's random angle and its slow rate; `state` the walk.
    """
    for n in range(true.size):
        state[0] += noise[n] + drift[n] * step
        angle = true[n] + state[0] + out[n]
        if quantum > 0.0:
            angle = np.rint(angle / quantum) * quantum
        out[n] = angle


@numba.njit(cache=True)
def lock_in_steps(
    lock_in: float,
    rate: float,
    peaks: FloatArray,
    steps: int,
    halves: int,
    step: float,
    strength: FloatArray,
    normals: FloatArray,
    state: FloatArray,
    excess: FloatArray,
) -> None:
    """Runge-Kutta steps of the lock-in equation for the phase in excess of the input's.

    Each entry of `peaks` is one half cycle of dither (or, at zero, just a stretch) of
    `steps` steps; `excess` is kept every `halves` of them. `state`: excess, input phase at
    the start of the stretch, backscatter phase.
    """
    bend = np.pi / (steps * step)
    for k in range(peaks.size):
        swing = peaks[k] / bend
        for n in range(steps):
            time = n * step
            start = state[1] + state[2] + rate * time + swing * (1.0 - np.cos(bend * time))
            time += 0.5 * step
            middle = state[1] + state[2] + rate * time + swing * (1.0 - np.cos(bend * time))
            time += 0.5 * step
            end = state[1] + state[2] + rate * time + swing * (1.0 - np.cos(bend * time))
            slope_1 = -lock_in * np.sin(start + state[0])
            slope_2 = -lock_in * np.sin(middle + state[0] + 0.5 * step * slope_1)
            slope_3 = -lock_in * np.sin(middle + state[0] + 0.5 * step * slope_2)
            slope_4 = -lock_in * np.sin(end + state[0] + step * slope_3)
            state[0] += step / 6.0 * (slope_1 + 2.0 * slope_2 + 2.0 * slope_3 + slope_4)
            if normals.shape[0] > 0:
                state[0] += strength[0] * normals[k * steps + n, 0]
                state[2] += strength[1] * normals[k * steps + n, 1]
        # Whole turns of the input are left out: the sine keeps its digits.
        state[1] += rate * steps * step + 2.0 * swing
        state[1] -= 2.0 * np.pi * np.floor(state[1] / (2.0 * np.pi))
        if (k + 1) % halves == 0:
            excess[k // halves] = state[0]
