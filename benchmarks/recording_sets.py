"""Two sets of simulated recordings, drawn by number: a plain one, and one with more switched on."""

import hashlib
import json
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, Final, get_args

import numpy as np
from scipy.signal import lfilter

from sagnac.analysis.settings import Method
from sagnac.core.arrays import FloatArray
from sagnac.core.units import ARCSECOND
from sagnac.recording.channel import angle_of
from sagnac.recording.model import Channel
from sagnac.rig.config import RigConfig, preset
from sagnac.rig.own_motion import dither_frequency
from sagnac.rig.ring_laser import folded
from sagnac.rig.sections import (
    GYRO_NAMES,
    DisturbancesConfig,
    DitherConfig,
    EncoderConfig,
    MotionConfig,
    Pairs,
    TableConfig,
    Triple,
)
from sagnac.rig.simulate import Simulation, simulate
from sagnac.rig.truth import truth_of

SEED: Final = 20130227
# What is drawn, each evenly in its logarithm.
TABLE_RATES: Final = (10.0, 80.0)  # deg/s
AMPLITUDES: Final = (0.005, 1.0)  # arcsec
RANDOM_WALKS: Final = (1e-5, 1e-4)  # deg/sqrt(h)
JITTERS: Final = (0.001, 0.01)  # deg/s
LOWEST_CYCLES: Final = 20  # a record, of a line in time
# And evenly: how many lines on each scale, of which orders; deviation of the shares.
ORDERS: Final = (3, 20)
MOST_ORDER: Final = 64
TONES: Final = (2, 12)
SHARES: Final = 0.002
# What the disturbed set has besides, each evenly in its logarithm.
LOCK_IN: Final = (10.0, 30.0)  # deg/h
DIFFUSION: Final = (50.0, 300.0)  # rad^2/s
BIAS_INSTABILITIES: Final = (2e-5, 2e-4)  # deg/h
RATE_WALKS: Final = (2e-5, 2e-4)  # deg/h/sqrt(h)
WARM_UPS: Final = (1.0, 5.0)  # K
WARM_UP_TIMES: Final = (600.0, 3600.0)  # s
PER_KELVIN: Final = (3e-5, 3e-4)  # deg/h/K
RESIDUES: Final = (1e-3, 1e-2)  # of the dither
# Of its encoder, evenly: jitter and latency. Each of the others is there in a part of the
# recordings, evenly in its logarithm.
LATCH_JITTERS: Final = (0.0, 2e-4)  # s
LATENCIES: Final = (0.0, 5e-3)  # s
WITH_FAULT: Final = 0.25
LATENCY_DRIFTS: Final = (2e-4, 5e-3)  # s from start to end
LATENCY_WALKS: Final = (5e-6, 1e-4)  # s in half an hour
CLOCKS: Final = (1.0, 20.0)  # ppm
READING_RATES: Final = (20.0, 200.0)  # Hz
STEPS: Final = (1.0, 36.0)  # arcsec
LOST: Final = (1e-4, 1e-2)
MISSING_NULLS: Final = (1e-3, 1e-1)
# And of the motion: a servo that hunts, and mounts that resonate.
HUNTINGS: Final = (0.001, 0.01)  # deg/s
HUNTING_FREQUENCIES: Final = (1.0, 6.0)  # Hz
MOUNTS: Final = (0.01, 0.1)  # arcsec
RESONANCES: Final = (5.0, 100.0)  # Hz
QUALITIES: Final = (10.0, 50.0)
WANDERING: Final = (0.005, 0.1)  # arcsec
CARRIERS: Final = (1.0, 200.0)  # Hz
# A wandering line: rms of its frequency and of its amplitude, each as a part of it, and the time
# over which either changes.
FREQUENCY_WANDER: Final = 2e-4
AMPLITUDE_WANDER: Final = 0.1
WANDER_TIMES: Final = (100.0, 1000.0)  # s
MOST_WANDERING: Final = 2
# Widths of a resonance within which a mount's band is looked for.
_WIDTHS: Final = 3.0
# Standard deviations of its frequency within which a wandering line is looked for, and the width
# of what a dither leaves behind its pick-off, Hz.
_WITHIN: Final = 5.0
_DITHER_WIDTH: Final = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingSet:
    """A set of recordings.

    Attributes
    ----------
    name
        Of ``--set``, its folder and its page.
    config_of
        The rig of a number.
    simulation_of
        The recording of a number, with the truth.
    bands_of
        (low, high), Hz, in which lines of a number are found that are not in the rig's truth.
    extras_of
        What a recording of a number has that its rig does not say.
    switched_on
        What the page says of the set besides what is drawn of both.
    methods
        That are run unless stated.
    """

    name: str
    config_of: Callable[[int], RigConfig]
    simulation_of: Callable[[int], Simulation]
    bands_of: Callable[[int], list[tuple[float, float]]]
    extras_of: Callable[[int], tuple[object, ...]]
    switched_on: str
    methods: tuple[Method, ...] = get_args(Method)

    def digest_of(self, number: int) -> str:
        """Digest of everything that the recording of a number is made from."""
        text = json.dumps(asdict(self.config_of(number)), sort_keys=True)
        if extras := self.extras_of(number):
            text += repr(extras)
        return hashlib.sha256(text.encode()).hexdigest()[:12]


def _between(random: np.random.Generator, ends: tuple[float, float], size: Any = None) -> Any:
    return np.exp(random.uniform(*np.log(ends), size))


def _triple(random: np.random.Generator, ends: tuple[float, float]) -> Triple:
    first, second, third = _between(random, ends, 3).tolist()
    return first, second, third


def plain_config(number: int) -> RigConfig:
    """The rig of the paper, with what varies drawn."""
    random = np.random.default_rng([SEED, number])
    base = preset("paper")
    rate = float(_between(random, TABLE_RATES))
    orders = random.choice(MOST_ORDER, random.integers(*ORDERS, endpoint=True), replace=False) + 1.0
    tones = int(random.integers(*TONES, endpoint=True))
    band = (LOWEST_CYCLES / base.duration_s, 0.5 * base.sample_rate_hz)
    return replace(
        base,
        seed=number,
        table=replace(
            base.table,
            rate_deg_per_s=rate,
            start_deg=float(random.uniform(-180.0, 180.0)),
            jitter_rms_deg_per_s=float(_between(random, JITTERS)),
        ),
        platform=replace(
            base.platform,
            share_deviation=tuple(random.uniform(-SHARES, SHARES, 3).tolist()),
            heading_deg=float(random.uniform(-180.0, 180.0)),
        ),
        gyro=replace(base.gyro, arw_deg_per_sqrt_h=_triple(random, RANDOM_WALKS)),
        disturbances=DisturbancesConfig(
            angle=_pairs(orders, _between(random, AMPLITUDES, orders.size)),
            time=_pairs(_between(random, band, tones), _between(random, AMPLITUDES, tones)),
        ),
    )


def _pairs(positions: Any, amplitudes: Any) -> Pairs:
    return tuple(sorted(zip(positions.tolist(), amplitudes.tolist(), strict=True)))


# --- the disturbed set ------------------------------------------------------------------------


def disturbed_config(number: int) -> RigConfig:
    """The plain rig of that number with lock-in, dither of odd numbers, B, K and warm-up.

    Its encoder is late and noisy, its servo may hunt and its mounts may resonate.
    """
    random = np.random.default_rng([SEED, 1, number])
    base = plain_config(number)
    dithered = number % 2 == 1
    gyro = replace(
        base.gyro,
        mode="dithered" if dithered else "rate-biased",
        lock_in_deg_per_h=_triple(random, LOCK_IN),
        backscatter_diffusion_rad2_per_s=float(_between(random, DIFFUSION)),
        bias_instability_deg_per_h=_triple(random, BIAS_INSTABILITIES),
        rate_random_walk_deg_per_h_per_sqrt_h=_triple(random, RATE_WALKS),
        temperature_coefficient_deg_per_h_per_k=_triple(random, PER_KELVIN),
        warm_up_k=float(_between(random, WARM_UPS)),
        warm_up_time_s=float(_between(random, WARM_UP_TIMES)),
    )
    residue = _triple(random, RESIDUES)
    left = DitherConfig(residue=residue, delay_s=(1e-6, -2e-6, 3e-6)) if dithered else base.dither
    table, encoder, motion = _faults(base, np.random.default_rng([SEED, 3, number]))
    return replace(base, gyro=gyro, dither=left, table=table, encoder=encoder, motion=motion)


def _faults(
    base: RigConfig, random: np.random.Generator
) -> tuple[TableConfig, EncoderConfig, MotionConfig]:
    """What is wrong with table, encoder and mounts; every draw is made, used or not."""

    def sometimes(ends: tuple[float, float], without: float = 0.0) -> float:
        drawn, there = float(_between(random, ends)), random.random() < WITH_FAULT
        return drawn if there else without

    finest = 360.0 * 3600.0 / base.encoder.lines
    encoder = replace(
        base.encoder,
        latch_jitter_s=float(random.uniform(*LATCH_JITTERS)),
        latency_s=float(random.uniform(*LATENCIES)),
        latency_drift_s=sometimes(LATENCY_DRIFTS),
        latency_walk_s=sometimes(LATENCY_WALKS),
        clock_ppm=sometimes(CLOCKS),
        reading_rate_hz=sometimes(READING_RATES),
        lines=round(360.0 * 3600.0 / sometimes(STEPS, finest)),
        lost_fraction=sometimes(LOST),
        missing_null_fraction=sometimes(MISSING_NULLS),
    )
    table = replace(
        base.table,
        hunting_rms_deg_per_s=sometimes(HUNTINGS),
        hunting_hz=float(_between(random, HUNTING_FREQUENCIES)),
    )
    shaken = random.random() < WITH_FAULT
    sizes = _triple(random, MOUNTS)
    motion = MotionConfig(
        resonance_rms_arcsec=sizes if shaken else (0.0, 0.0, 0.0),
        resonance_hz=_triple(random, RESONANCES),
        resonance_quality=float(_between(random, QUALITIES)),
    )
    return table, encoder, motion


@dataclass(frozen=True, slots=True, kw_only=True)
class WanderingLine:
    """A line in time whose frequency and amplitude wander.

    Attributes
    ----------
    frequency
        Mean, Hz.
    amplitudes
        Gyro -> mean amplitude, arcsec.
    phases
        Gyro -> at the first sample, rad.
    time
        Correlation time of both wanders, s.
    """

    frequency: float
    amplitudes: dict[str, float]
    phases: dict[str, float]
    time: float


def wandering_lines(number: int) -> tuple[tuple[WanderingLine, ...], np.random.Generator]:
    """The wandering lines of a recording, and the generator of how they wander."""
    random = np.random.default_rng([SEED, 2, number])
    lines = []
    for _ in range(int(random.integers(1, MOST_WANDERING, endpoint=True))):
        amplitude = float(_between(random, WANDERING))
        parts, phases = random.uniform(0.5, 1.0, 3), random.uniform(-np.pi, np.pi, 3)
        lines.append(
            WanderingLine(
                frequency=float(_between(random, CARRIERS)),
                amplitudes=dict(zip(GYRO_NAMES, (amplitude * parts).tolist(), strict=True)),
                phases=dict(zip(GYRO_NAMES, phases.tolist(), strict=True)),
                time=float(_between(random, WANDER_TIMES)),
            )
        )
    return tuple(lines), random


def wander(random: np.random.Generator, samples: int, interval: float, time: float) -> FloatArray:
    """(samples,) Ornstein-Uhlenbeck process of variance one."""
    kept = math.exp(-interval / time)
    shocks = math.sqrt(1.0 - kept**2) * random.standard_normal(samples)
    shocks[0] = random.standard_normal()
    return np.asarray(lfilter([1.0], [1.0, -kept], shocks))


def disturbed_simulation(number: int) -> Simulation:
    """The recording of that number, wandering lines put on its angles before they are read out.

    The readout rounds once, as a gyro does. If the rounded angles were rounded again with the
    lines added, the second error would depend on the lines alone: harmonics, not white noise.
    """
    config = disturbed_config(number)
    steps = dict(zip(GYRO_NAMES, config.gyro.quantization_step_arcsec, strict=True))
    finer = replace(config.gyro, quantization_step_arcsec=(0.0, 0.0, 0.0))
    made = simulate(replace(config, gyro=finer))
    lines, random = wandering_lines(number)
    interval = 1.0 / config.sample_rate_hz
    recording = made.recording
    added = {name: np.zeros(config.samples) for name in GYRO_NAMES}
    for line in lines:
        frequency = 1.0 + FREQUENCY_WANDER * wander(random, config.samples, interval, line.time)
        phase = 2.0 * np.pi * line.frequency * interval * np.cumsum(frequency)
        size = 1.0 + AMPLITUDE_WANDER * wander(random, config.samples, interval, line.time)
        for name in GYRO_NAMES:
            added[name] += line.amplitudes[name] * size * np.cos(phase + line.phases[name])
    gyros = tuple(
        _read_out(
            channel,
            angle_of(channel, recording.sample_rate) / ARCSECOND + added[channel.name],
            steps[channel.name],
        )
        for channel in recording.gyros
    )
    return Simulation(recording=replace(recording, gyros=gyros), truth=truth_of(config))


def _read_out(channel: Channel, angle: FloatArray, step: float) -> Channel:
    """A gyro of this angle, arcsec, in whole steps of its readout."""
    values = step * np.rint(angle / step) if step > 0.0 else angle
    return replace(channel, kind="angle", values=values * ARCSECOND)


def disturbed_bands(number: int) -> list[tuple[float, float]]:
    """Bands of wandering lines, of resonances, and of what a dither leaves behind its pick-off."""
    config = disturbed_config(number)
    lines, _ = wandering_lines(number)
    bands = [
        (
            line.frequency * (1.0 - _WITHIN * FREQUENCY_WANDER) - _WITHIN / line.time,
            line.frequency * (1.0 + _WITHIN * FREQUENCY_WANDER) + _WITHIN / line.time,
        )
        for line in lines
    ]
    motion = config.motion
    for rms, middle in zip(motion.resonance_rms_arcsec, motion.resonance_hz, strict=True):
        if rms > 0.0:
            width = _WIDTHS * middle / motion.resonance_quality
            bands.append((middle - width, middle + width))
    if config.dither.is_left:
        for gyro in range(len(GYRO_NAMES)):
            frequency = dither_frequency(config, gyro)
            middle = folded(frequency, config.sample_rate_hz)
            bands.append((middle - _DITHER_WIDTH, middle + _DITHER_WIDTH))
    return bands


PLAIN: Final = RecordingSet(
    name="plain",
    config_of=plain_config,
    simulation_of=lambda number: simulate(plain_config(number)),
    bands_of=lambda _: [],
    extras_of=lambda _: (),
    switched_on="Switched off, and so not tested here: bias instability and rate random walk "
    "(B = K = 0), lock-in (gyros `ideal`), lines that wander, and what an encoder does besides a "
    f"latch that jitters by {1e6 * preset('paper').encoder.latch_jitter_s:g} µs rms: it comes "
    "late, drifts, stands, loses readings. The disturbed hundred (`--set disturbed`) has all of "
    "these.",
)
DISTURBED: Final = RecordingSet(
    name="disturbed",
    config_of=disturbed_config,
    simulation_of=disturbed_simulation,
    bands_of=disturbed_bands,
    extras_of=lambda number: (
        "rounded once",
        FREQUENCY_WANDER,
        AMPLITUDE_WANDER,
        *wandering_lines(number)[0],
    ),
    switched_on="Switched on besides: gyros of odd numbers are dithered, with "
    f"{100.0 * RESIDUES[0]:g} to {100.0 * RESIDUES[1]:g} % of the dither left in their angles and "
    "the pick-offs recorded; those of even numbers are rate-biased. Lock-in is "
    f"{LOCK_IN[0]:g} to {LOCK_IN[1]:g} °/h in each gyro, diffusion of the backscatter phase "
    f"{DIFFUSION[0]:g} to {DIFFUSION[1]:g} rad²/s, B {BIAS_INSTABILITIES[0]:g} to "
    f"{BIAS_INSTABILITIES[1]:g} °/h, K {RATE_WALKS[0]:g} to {RATE_WALKS[1]:g} °/h/√h. They warm "
    f"up by {WARM_UPS[0]:g} to {WARM_UPS[1]:g} K at {PER_KELVIN[0]:g} to {PER_KELVIN[1]:g} °/h/K, "
    f"with a time constant of {WARM_UP_TIMES[0]:g} to {WARM_UP_TIMES[1]:g} s. One or two lines in "
    f"time wander, {CARRIERS[0]:g} to {CARRIERS[1]:g} Hz, {WANDERING[0]:g} to {WANDERING[1]:g}″: "
    f"their frequency by {1e4 * FREQUENCY_WANDER:g}·10⁻⁴ rms of it, their amplitude by "
    f"{100.0 * AMPLITUDE_WANDER:g} % rms, over {WANDER_TIMES[0]:g} to {WANDER_TIMES[1]:g} s. What "
    "was drawn above as N of a gyro is its quantum limit here; lock-in adds to it, and the truth "
    "is the rig's own. Drawn of the encoder, evenly: latch jitter "
    f"{1e6 * LATCH_JITTERS[0]:g} to {1e6 * LATCH_JITTERS[1]:g} µs and latency "
    f"{1e3 * LATENCIES[0]:g} to {1e3 * LATENCIES[1]:g} ms. Each of the following is there in one "
    f"recording of {1.0 / WITH_FAULT:g}: a latency that drifts by {1e3 * LATENCY_DRIFTS[0]:g} to "
    f"{1e3 * LATENCY_DRIFTS[1]:g} ms from start to end; one that walks by "
    f"{1e6 * LATENCY_WALKS[0]:g} to {1e6 * LATENCY_WALKS[1]:g} µs in half an hour; a clock "
    f"{CLOCKS[0]:g} to {CLOCKS[1]:g} ppm fast; readings at {READING_RATES[0]:g} to "
    f"{READING_RATES[1]:g} Hz, held between; steps of {STEPS[0]:g} to {STEPS[1]:g}″ instead of "
    f"0.18″; {100.0 * LOST[0]:g} to {100.0 * LOST[1]:g} % of the readings lost and "
    f"{100.0 * MISSING_NULLS[0]:g} to {100.0 * MISSING_NULLS[1]:g} % of the null pulses missing; a "
    f"servo that hunts at {HUNTING_FREQUENCIES[0]:g} to {HUNTING_FREQUENCIES[1]:g} Hz, "
    f"{HUNTINGS[0]:g} to {HUNTINGS[1]:g} °/s rms; and mounts that resonate, each at "
    f"{RESONANCES[0]:g} to {RESONANCES[1]:g} Hz by {MOUNTS[0]:g} to {MOUNTS[1]:g}″ rms. Switched "
    "off: nutation of the shaft, which no pair tells from N, and reversals.",
    methods=("fos", "fos-paper"),
)
SETS: Final = {one.name: one for one in (PLAIN, DISTURBED)}
