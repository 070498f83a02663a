"""The lock-in equation, integrated step by step."""

import math
from typing import NamedTuple

import numpy as np

from sagnac.core import arrays
from sagnac.core.arrays import FloatArray
from sagnac.core.kernels import compiled
from sagnac.rig.ring_laser import Dither, RingLaser

CHUNK_STEPS = 1 << 20


class LockInSteps(NamedTuple):
    """Lock-in equation in steps: rates in rad/s of beat phase, kicks in rad rms per step.

    A stretch is one half cycle of dither (without dither, just a stretch) of `steps` steps.
    The excess is kept every `stretches` of them.
    """

    lock_in: float
    rate: float
    step: float
    steps: int
    stretches: int
    quantum_kick: float
    backscatter_kick: float


class BeatState(NamedTuple):
    """Beat phase in excess of the input's, input phase, and backscatter phase, rad."""

    excess: float
    input: float
    backscatter: float


@compiled()
def input_phase(time: float, rate: float, swing: float, bend: float, start: float) -> float:
    return float(start + rate * time + swing * (1.0 - np.cos(bend * time)))


@compiled()
def lock_in_steps(
    equation: LockInSteps,
    peaks: FloatArray,
    normals: FloatArray,
    state: BeatState,
    excess: FloatArray,
) -> BeatState:
    """Runge-Kutta steps of the lock-in equation for the phase in excess of the input's.

    `peaks` holds the peak rate of each stretch, 0 without dither; `normals` (steps, 2), or
    (0, 2) without noise; `excess` takes the phase at the end of each sample.
    """
    lock_in, rate, step, steps, stretches, quantum_kick, backscatter_kick = equation
    ahead, entered, backscatter = state
    bend = np.pi / (steps * step)
    for k in range(peaks.size):
        swing = peaks[k] / bend
        for n in range(steps):
            time = n * step
            origin = entered + backscatter
            start = input_phase(time, rate, swing, bend, origin)
            time += 0.5 * step
            middle = input_phase(time, rate, swing, bend, origin)
            time += 0.5 * step
            end = input_phase(time, rate, swing, bend, origin)
            slope_1 = -lock_in * np.sin(start + ahead)
            slope_2 = -lock_in * np.sin(middle + ahead + 0.5 * step * slope_1)
            slope_3 = -lock_in * np.sin(middle + ahead + 0.5 * step * slope_2)
            slope_4 = -lock_in * np.sin(end + ahead + step * slope_3)
            ahead += step / 6.0 * (slope_1 + 2.0 * slope_2 + 2.0 * slope_3 + slope_4)
            if normals.shape[0] > 0:
                ahead += quantum_kick * normals[k * steps + n, 0]
                backscatter += backscatter_kick * normals[k * steps + n, 1]
        # Whole turns of the input are left out: the sine keeps its digits.
        entered += rate * steps * step + 2.0 * swing
        entered -= 2.0 * np.pi * np.floor(entered / (2.0 * np.pi))
        if (k + 1) % stretches == 0:
            excess[k // stretches] = ahead
    return BeatState(ahead, entered, backscatter)


def integrate(
    laser: RingLaser,
    rate: float,
    samples: int,
    interval: float,
    *,
    dither: Dither | None = None,
    seed: int = 0,
    phase_step: float = 0.2,
) -> FloatArray:
    """Integrate the lock-in equation from zero phase.

    The lock-in term takes fourth-order Runge-Kutta steps along the known input angle; quantum
    noise and backscatter phase take a random step after each.

    Parameters
    ----------
    laser
        What is integrated.
    rate
        Constant input rate, rad/s.
    samples, interval
        Samples to return, and s between them; with a dither a whole number of its cycles.
    dither
        Added to `rate`, starting at zero rate.
    seed
        Of quantum noise, backscatter phase and dither amplitude.
    phase_step
        Largest advance of the phase in a step, rad.

    Returns
    -------
    FloatArray
        (samples,) measured less true input angle at the end of each interval, rad.

    Raises
    ------
    ValueError
        If an argument is out of range.
    """
    if samples < 1 or not interval > 0.0 or not phase_step > 0.0:
        raise ValueError(
            f"samples {samples}, interval {interval:g} and phase_step {phase_step:g} must be "
            "positive"
        )
    equation = equation_of(laser, rate, interval, dither, phase_step)
    stretches, steps = equation.stretches, equation.steps
    quantum, backscatter, amplitude = (
        np.random.default_rng(sequence) for sequence in np.random.SeedSequence(seed).spawn(3)
    )
    noisy = equation.quantum_kick > 0.0 or equation.backscatter_kick > 0.0
    excess = np.empty(samples)
    state = BeatState(0.0, 0.0, 0.0)
    for part in arrays.blocks(samples, max(1, CHUNK_STEPS // (stretches * steps))):
        halves = (part.stop - part.start) * stretches
        normals = np.empty((halves * steps if noisy else 0, 2))
        normals[:, 0] = quantum.standard_normal(len(normals))
        normals[:, 1] = backscatter.standard_normal(len(normals))
        peaks = dither_peaks(laser, dither, halves, amplitude)
        state = lock_in_steps(equation, peaks, normals, state, excess[part])
    return excess / laser.phase_per_angle


def equation_of(
    laser: RingLaser, rate: float, interval: float, dither: Dither | None, phase_step: float
) -> LockInSteps:
    """The equation in steps that advance the phase by no more than `phase_step`."""
    scale = laser.phase_per_angle
    peak = abs(rate)
    stretches = 1
    if dither is not None:
        cycles = interval * dither.frequency
        if round(cycles) < 1 or abs(cycles - round(cycles)) > 1e-9 * cycles:
            raise ValueError(
                f"interval {interval:g} s is {cycles:g} dither cycles; give a whole number"
            )
        stretches = 2 * round(cycles)
        peak += dither.rate * (1.0 + 4.0 * dither.amplitude_noise)
    steps = max(1, math.ceil(interval / stretches * scale * (peak + laser.lock_in) / phase_step))
    step = interval / (stretches * steps)
    return LockInSteps(
        lock_in=laser.lock_in * scale,
        rate=rate * scale,
        step=step,
        steps=steps,
        stretches=stretches,
        quantum_kick=laser.quantum_noise * scale * math.sqrt(step),
        backscatter_kick=math.sqrt(2.0 * laser.backscatter_diffusion * step),
    )


def dither_peaks(
    laser: RingLaser, dither: Dither | None, halves: int, random: np.random.Generator
) -> FloatArray:
    """Peak rate of each half cycle of dither, rad/s of beat phase, or zeros without dither."""
    if dither is None:
        return np.zeros(halves)
    drawn = 1.0 + dither.amplitude_noise * random.standard_normal(halves)
    peaks = dither.rate * laser.phase_per_angle * drawn
    peaks[1::2] *= -1.0
    return np.asarray(peaks)
