"""A second simulator of gyros on a turning table, for tests: numpy alone, nothing of the package.

It shares no code and no habit with `sagnac.rig`: the table's motion is made of its rate on the grid
of the samples, the encoder reads that motion at instants of its own, and every error of the
encoder is a function of those instants or of the angle.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ARCSECOND = np.pi / 648_000.0
DEGREE = np.pi / 180.0
EARTH_RATE = 7.292115e-5
DEGREE_PER_ROOT_HOUR = DEGREE / 60.0


@dataclass(frozen=True, kw_only=True)
class Bench:
    """What is simulated; angles in degrees or arcsec as named, times in s.

    Attributes
    ----------
    motion
        ``steady``, ``reversing`` (every `cycle` s, with ramps), ``dwelling`` (turns and stands,
        `cycle` s each) or ``swinging`` (sine of `swing` degrees, a period of `cycle` s).
    hunting
        Rms rate of a servo that hunts at `hunting_hz`, deg/s.
    wander
        Rms of the slow wander of the rate, as a part of it.
    shares
        Of the table's rate, gyro by gyro.
    walks
        Angle random walk of each gyro, deg/sqrt(h).
    orders, tones
        (order or Hz, arcsec) of every gyro, each at an amplitude and a phase of its own.
    jitter, latency, latency_drift, latency_walk
        Rms s from reading to reading; s at the start; s from start to end; rms s that a random
        walk has gained at the end.
    clock
        Parts by which the encoder's clock runs fast.
    held_hz
        Readings of the encoder a second, each held to the next; 0 for one a sample.
    step
        Of the encoder, arcsec.
    periodic
        (order, arcsec) of the encoder's error.
    lost
        Part of the readings that repeat the one before.
    own_motion
        Rms arcsec of each gyro's own resonance at 17 Hz, which the others do not share.
    """

    rate: float = 40.0
    seconds: float = 1800.0
    sample_rate: float = 500.0
    motion: str = "steady"
    cycle: float = 60.0
    swing: float = 90.0
    hunting: float = 0.004
    hunting_hz: float = 3.0
    wander: float = 3e-4
    ripple: Sequence[tuple[float, float]] = ((12.0, 3e-4),)
    shares: Sequence[float] = (0.5784, 0.5773, 0.5764)
    walks: Sequence[float] = (2.5e-5, 2.5e-5, 2.5e-5)
    readout: float = 0.001
    orders: Sequence[tuple[float, float]] = (
        (1.0, 0.7), (2.0, 0.5), (3.0, 0.2), (7.0, 0.1), (12.0, 0.06), (31.0, 0.03),
    )  # fmt: skip
    tones: Sequence[tuple[float, float]] = (
        (0.031, 0.06),
        (3.21, 0.03),
        (33.0, 0.02),
        (118.0, 0.01),
    )
    latitude: float = 47.0
    jitter: float = 0.0
    latency: float = 0.0
    latency_drift: float = 0.0
    latency_walk: float = 0.0
    clock: float = 0.0
    held_hz: float = 0.0
    step: float = 0.1
    periodic: Sequence[tuple[float, float]] = ((1.0, 0.8), (2.0, 0.3))
    lost: float = 0.0
    own_motion: float = 0.0
    seed: int = 1
    names: Sequence[str] = ("x", "y", "z")
    extra: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Simulated:
    """Arrays of one recording, rad; the truth is `Bench.walks`."""

    angles: dict[str, Array]
    table: Array
    true_table: Array
    sample_rate: float


def simulate(bench: Bench) -> Simulated:
    """The recording of a bench."""
    random = np.random.default_rng([20_130_227, bench.seed])
    dt = 1.0 / bench.sample_rate
    samples = round(bench.seconds * bench.sample_rate)
    time = np.arange(samples) * dt
    alpha = _table(bench, time, dt, random)
    table = _encoder(bench, time, alpha, random)
    angles = {
        name: _gyro(bench, number, time, alpha, random) for number, name in enumerate(bench.names)
    }
    return Simulated(angles=angles, table=table, true_table=alpha, sample_rate=bench.sample_rate)


def _table(bench: Bench, time: Array, dt: float, random: np.random.Generator) -> Array:
    rate = _commanded(bench, time)
    slow = _low_pass(random.standard_normal(time.size), 1.0 / 200.0, dt)
    rate = rate * (1.0 + bench.wander * slow / max(float(slow.std()), 1e-12))
    if bench.hunting > 0.0:
        hunting = _resonance(random.standard_normal(time.size), bench.hunting_hz, 3.0, dt)
        rate += bench.hunting * hunting / hunting.std()
    drive = np.cumsum(rate) * dt * DEGREE
    alpha = drive.copy()
    for order, part in bench.ripple:
        alpha += part / order * np.sin(order * drive + random.uniform(0.0, 2.0 * np.pi))
    return alpha + random.uniform(0.0, 2.0 * np.pi)


def _commanded(bench: Bench, time: Array) -> Array:
    phase = (time % (2.0 * bench.cycle)) / bench.cycle
    if bench.motion == "steady":
        return np.full(time.size, bench.rate)
    if bench.motion == "swinging":
        turning = 2.0 * np.pi / bench.cycle
        return bench.swing * turning * np.cos(turning * time)
    # Ramps take a twentieth of a cycle.
    triangle = np.where(phase < 1.0, 0.5 - np.abs(phase - 0.5), -0.5 + np.abs(phase - 1.5))
    square = np.clip(triangle * 20.0, -1.0, 1.0)
    if bench.motion == "reversing":
        return bench.rate * square
    if bench.motion == "dwelling":
        return bench.rate * np.clip(square, 0.0, 1.0)
    raise ValueError(bench.motion)


def _encoder(bench: Bench, time: Array, alpha: Array, random: np.random.Generator) -> Array:
    end = time[-1]
    latency = bench.latency + bench.latency_drift * time / end
    latency = latency + bench.clock * time
    if bench.latency_walk > 0.0:
        walk = np.cumsum(random.standard_normal(time.size))
        latency = latency + bench.latency_walk * walk / np.sqrt(time.size)
    # A reading that is late stands for an instant before its sample.
    instant = time - latency + bench.jitter * random.standard_normal(time.size)
    if bench.held_hz > 0.0:
        instant = np.floor(time * bench.held_hz + 1e-9) / bench.held_hz - latency
    read = _at(instant, time, alpha)
    for order, size in bench.periodic:
        read = read + size * ARCSECOND * np.sin(order * read + random.uniform(0.0, 2.0 * np.pi))
    step = bench.step * ARCSECOND
    if step > 0.0:
        read = np.floor(read / step) * step
    if bench.lost > 0.0:
        gone = np.flatnonzero(random.uniform(size=time.size) < bench.lost)
        gone = gone[gone > 0]
        for place in gone:
            read[place] = read[place - 1]
    return read


def _at(instant: Array, time: Array, alpha: Array) -> Array:
    """The motion at any instant, its rate held beyond the ends."""
    dt = time[1] - time[0]
    read = np.interp(instant, time, alpha)
    read += np.minimum(instant - time[0], 0.0) * (alpha[1] - alpha[0]) / dt
    read += np.maximum(instant - time[-1], 0.0) * (alpha[-1] - alpha[-2]) / dt
    return np.asarray(read)


def _gyro(
    bench: Bench, number: int, time: Array, alpha: Array, random: np.random.Generator
) -> Array:
    dt = time[1] - time[0]
    share = bench.shares[number]
    level = np.sqrt(max(1.0 - share**2, 0.0)) * EARTH_RATE * np.cos(bench.latitude * DEGREE)
    upright = share * EARTH_RATE * np.sin(bench.latitude * DEGREE)
    angle = share * alpha + upright * time
    earth = level * np.cos(alpha + 2.0 * np.pi * number / 3.0)
    angle[1:] += np.cumsum(0.5 * (earth[1:] + earth[:-1])) * dt
    for scale, lines in ((alpha, bench.orders), (2.0 * np.pi * time, bench.tones)):
        for frequency, size in lines:
            own = size * ARCSECOND * random.uniform(0.5, 1.0)
            angle += own * np.cos(frequency * scale + random.uniform(0.0, 2.0 * np.pi))
    walk = bench.walks[number] * DEGREE_PER_ROOT_HOUR
    angle += np.cumsum(random.standard_normal(time.size)) * walk * np.sqrt(dt)
    if bench.own_motion > 0.0:
        shake = _resonance(random.standard_normal(time.size), 17.0, 20.0, dt)
        angle += bench.own_motion * ARCSECOND * shake / shake.std()
    step = bench.readout * ARCSECOND
    return np.asarray(np.rint(angle / step) * step) if step > 0.0 else angle


def _filtered(values: Array, gain: Array) -> Array:
    return np.asarray(np.fft.irfft(np.fft.rfft(values) * gain, values.size))


def _low_pass(values: Array, corner: float, dt: float) -> Array:
    frequency = np.fft.rfftfreq(values.size, dt)
    return _filtered(values, 1.0 / (1.0 + (frequency / corner) ** 2))


def _resonance(values: Array, center: float, quality: float, dt: float) -> Array:
    frequency = np.fft.rfftfreq(values.size, dt)
    ratio = frequency / center
    gain = 1.0 / np.sqrt((1.0 - ratio**2) ** 2 + (ratio / quality) ** 2)
    gain[0] = 0.0
    return _filtered(values, gain * (ratio < 8.0))
