"""The simulated rig: gyro triad on a turning table, with the truth beside the recording.

The rate each gyro senses, Eq. 4, is integrated sample by sample along a table motion with
jitter, wander, ripple and wobble. Nothing here uses the closed forms the estimators fit.
Configurations are in the field's units, named in every key; see ``docs/simulate.md``.
"""

import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagnac import formats
from sagnac.arrays import FloatArray
from sagnac.formats import parquet
from sagnac.formats.source import replacing
from sagnac.recording.model import Channel, Recording
from sagnac.rig import _kernels
from sagnac.rig.config import RigConfig
from sagnac.rig.gyro import gyro_drift, ring_lasers_of
from sagnac.rig.ring_laser import angle_random_walk, mean_rate
from sagnac.rig.sections import GYRO_NAMES, Pairs, Progress
from sagnac.rig.streams import disturbance_of, random_streams
from sagnac.rig.table import jitter_step, table_command
from sagnac.rig.truth import Truth, truth_of
from sagnac.table.earth import earth_rate
from sagnac.table.frames import shares_from_deviations, table_to_gyro_matrix
from sagnac.units import (
    ARCSECOND,
    DEGREE,
    DEGREE_PER_HOUR,
    DEGREE_PER_HOUR_PER_HOUR,
    DEGREE_PER_ROOT_HOUR,
)

BLOCK_SAMPLES: Final = 65_536
# Between nodes the integrand cos(alpha) is taken by Simpson's rule, whose error is
# turn^4/2880 of the Earth-rate harmonic (15 arcsec): below 1e-6 arcsec at this turn.
_LARGEST_TURN_PER_STEP = 0.02  # rad
_LARGEST_JITTER_STEP = 0.5  # step times natural frequency of the servo
_MARKOV_STEP = 0.02  # s, grid of bias instability and rate random walk
_NULL_MARGIN = 8.0  # null errors a passage keeps clear


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulation:
    """A simulated recording and what it was made from."""

    recording: Recording
    truth: Truth


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """Consecutive samples of the recording.

    Attributes
    ----------
    first
        Number of the first sample.
    angles
        (3, n) measured angles of x, y, z, rad.
    table
        (n,) encoder reading, unwrapped, rad, or None at rest.
    null_pulse
        (n,) bool, or None at rest.
    table_angle
        (n,) true table angle, rad (truth, not measured).
    """

    first: int
    angles: FloatArray
    table: FloatArray | None
    null_pulse: NDArray[np.bool_] | None
    table_angle: FloatArray


def blocks(config: RigConfig, block_samples: int = BLOCK_SAMPLES) -> Iterator[Block]:
    """The recording block by block; the samples do not depend on `block_samples`.

    Memory is that of one block, however long the recording.

    Raises
    ------
    ValueError
        If `block_samples` is below 1.
    """
    if block_samples < 1:
        raise ValueError(f"block_samples is {block_samples}; give at least 1")
    streams = random_streams(config.seed)
    table = config.table
    encoder = config.encoder
    gyro = config.gyro
    interval = 1.0 / config.sample_rate_hz
    command = table_command(config)
    turning = config.turning

    fastest = float(np.abs(command.rate).max()) * (1.0 + sum(f for _, f in table.ripple))
    natural = 2.0 * math.pi * table.jitter_bandwidth_hz
    jittery = turning and table.jitter_rms_deg_per_s > 0.0
    substeps = max(
        1,
        math.ceil(fastest * interval / _LARGEST_TURN_PER_STEP),
        math.ceil(natural * interval / _LARGEST_JITTER_STEP) if jittery else 1,
    )
    step = interval / substeps

    ripple_order, ripple_fraction = _columns(table.ripple)
    wobble_order, wobble_amplitude = _columns(table.wobble)
    error_order, error_amplitude = _columns(encoder.periodic_error)
    ripple_phase = streams.phases.uniform(-np.pi, np.pi, ripple_order.size)
    wobble_phase = streams.phases.uniform(-np.pi, np.pi, wobble_order.size)
    error_phase = streams.phases.uniform(-np.pi, np.pi, error_order.size)
    angle_lines, time_lines = disturbance_of(config, streams.disturbances)
    offset = -angle_lines.phasor.real.sum(axis=1) - time_lines.phasor.real.sum(axis=1)

    # Jitter and wander start in their stationary state, one sample before the first.
    position_jitter = jittery and table.jitter_spectrum == "position"
    rate_jitter = jittery and table.jitter_spectrum == "rate"
    jitter_state = np.zeros(3)
    if position_jitter:
        transition, jitter_factor, spread = jitter_step(config, step)
        jitter_state[:2] = spread * streams.jitter.standard_normal(2)
    if rate_jitter:
        jitter_state[0] = streams.jitter.standard_normal()
    jitter_decay = math.exp(-natural * step)
    wander = turning and table.wander_fraction > 0.0
    wander_state = np.zeros(3)
    wander_state[0] = streams.wander.standard_normal()
    wander_decay = math.exp(-step / table.wander_time_s)

    start: FloatArray = np.array([-interval])
    start_drive = float(command.angle_at(start)[0])
    start_rate = float(command.rate_at(start)[0])
    if position_jitter:
        start_drive += jitter_state[0]
        start_rate += jitter_state[1]
    if rate_jitter:
        jitter_state[1] = table.jitter_rms_deg_per_s * DEGREE * jitter_state[0]
        start_rate += jitter_state[1]
    if wander:
        wander_state[1] = table.wander_fraction * start_rate * wander_state[0]
        start_rate += wander_state[1]
    origin = float(
        _kernels.rig_table_angle(start_drive, ripple_order, ripple_fraction, ripple_phase)
    )
    earth = earth_rate(config.platform.latitude_deg * DEGREE, config.platform.heading_deg * DEGREE)
    wobble = wobble_amplitude * ARCSECOND
    motion_state = np.array([start_drive, start_rate, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    motion_state[2:5] = _kernels.rig_earth_in_table(
        origin, earth, wobble_order, wobble, wobble_phase
    )

    line = 2.0 * math.pi / encoder.lines
    null_error = encoder.null_accuracy_arcsec * ARCSECOND
    passages = 1024 + 2 * math.ceil(fastest * config.duration_s / (2.0 * math.pi))
    null_errors = null_error * streams.null.standard_normal(min(passages, 1_000_000))
    null_state = np.array([math.floor(origin / (2.0 * math.pi)), 0.0, np.nan])

    matrix = table_to_gyro_matrix(*shares_from_deviations(config.platform.share_deviation))
    grid = max(1, round(_MARKOV_STEP * config.sample_rate_hz))
    drifts = [gyro_drift(config, g, grid * interval, streams.slow[g]) for g in range(3)]
    held = np.zeros(3)
    walks = np.zeros((3, 1))
    last_true = np.zeros(3)
    lasers, dither = ring_lasers_of(config)

    for first in range(0, config.samples, block_samples):
        count = min(block_samples, config.samples - first)
        nodes = count * substeps
        begin = first * substeps + 1
        time = np.arange(begin, begin + nodes, dtype=np.float64) * step - interval
        drive = command.angle_at(time)
        commanded = command.rate_at(time)
        rate = commanded.copy()
        if position_jitter:
            _kernels.rig_jitter(
                streams.jitter.standard_normal((nodes, 2)),
                transition,
                jitter_factor,
                jitter_state,
                drive,
                rate,
            )
        if rate_jitter:
            _kernels.rig_wander(
                streams.jitter.standard_normal(nodes),
                jitter_decay,
                math.sqrt(1.0 - jitter_decay**2),
                np.full(nodes, table.jitter_rms_deg_per_s * DEGREE),
                step,
                jitter_state,
                drive,
                rate,
            )
        if wander:
            _kernels.rig_wander(
                streams.wander.standard_normal(nodes),
                wander_decay,
                math.sqrt(1.0 - wander_decay**2),
                table.wander_fraction * commanded,
                step,
                wander_state,
                drive,
                rate,
            )
        alpha = np.empty(count)
        turned = np.empty((3, count))
        _kernels.rig_motion(
            drive,
            rate,
            step,
            substeps,
            ripple_order,
            ripple_fraction,
            ripple_phase,
            earth,
            wobble_order,
            wobble,
            wobble_phase,
            motion_state,
            alpha,
            turned,
        )

        angles = np.repeat(offset[:, np.newaxis], count, axis=1)
        _kernels.rig_harmonics(
            alpha,
            angle_lines.position,
            np.ascontiguousarray(angle_lines.phasor.real),
            np.ascontiguousarray(-angle_lines.phasor.imag),
            angles,
        )
        _kernels.rig_time_lines(
            first,
            time_lines.position * interval,
            np.ascontiguousarray(time_lines.phasor.real),
            np.ascontiguousarray(-time_lines.phasor.imag),
            angles,
        )
        seconds = (first + np.arange(count) - 0.5) * interval
        warming = gyro.warm_up_k * -np.expm1(-np.maximum(seconds, 0.0) / gyro.warm_up_time_s)
        begun = -(-first // grid)
        ended = -(-(first + count) // grid)
        for g in range(3):
            # One drift value holds for `grid` samples; the last of a block carries over.
            steps = np.concatenate([held[g : g + 1], drifts[g].advance(ended - begun)])
            held[g] = steps[-1]
            drift = steps[(first + np.arange(count)) // grid - begun + 1]
            drift += gyro.bias_deg_per_h[g] * DEGREE_PER_HOUR
            drift += gyro.rate_ramp_deg_per_h_per_h[g] * DEGREE_PER_HOUR_PER_HOUR * seconds
            drift += gyro.temperature_coefficient_deg_per_h_per_k[g] * DEGREE_PER_HOUR * warming
            true = matrix[g] @ turned + matrix[g, 2] * (alpha - origin)
            strength: FloatArray | float = gyro.arw_deg_per_sqrt_h[g] * DEGREE_PER_ROOT_HOUR
            if lasers:
                sensed = np.diff(true, prepend=last_true[g]) / interval
                drift += mean_rate(lasers[g], sensed, dither) - sensed
                strength = angle_random_walk(lasers[g], sensed, dither)
                last_true[g] = true[-1]
            _kernels.rig_readout(
                true,
                strength * math.sqrt(interval) * streams.white[g].standard_normal(count),
                drift,
                interval,
                gyro.quantization_step_arcsec[g] * ARCSECOND,
                walks[g],
                angles[g],
            )

        reading = None
        pulse = None
        if turning:
            graduation = np.zeros((1, count))
            _kernels.rig_harmonics(
                alpha,
                error_order,
                (error_amplitude * np.cos(error_phase) * ARCSECOND)[np.newaxis],
                (-error_amplitude * np.sin(error_phase) * ARCSECOND)[np.newaxis],
                graduation,
            )
            reading = np.rint((alpha + graduation[0]) / line) * line
            pulse = np.empty(count, dtype=np.bool_)
            _kernels.rig_null_pulse(
                alpha, null_errors, _NULL_MARGIN * null_error, null_state, pulse
            )
        yield Block(first=first, angles=angles, table=reading, null_pulse=pulse, table_angle=alpha)


def _columns(pairs: Pairs) -> tuple[FloatArray, FloatArray]:
    ordered = sorted(pairs)
    return np.array([p for p, _ in ordered], float), np.array([v for _, v in ordered], float)


def simulate(config: RigConfig, progress: Progress | None = None) -> Simulation:
    """The whole recording in memory, with the truth.

    Parameters
    ----------
    config
        What to simulate.
    progress
        Called with the finished part, 0 to 1.
    """
    angles = np.empty((3, config.samples))
    table = np.empty(config.samples) if config.turning else None
    pulse = np.empty(config.samples, dtype=np.bool_) if config.turning else None
    for block in blocks(config):
        span = slice(block.first, block.first + block.angles.shape[1])
        angles[:, span] = block.angles
        if table is not None and pulse is not None:
            table[span] = block.table
            pulse[span] = block.null_pulse
        if progress is not None:
            progress(span.stop / config.samples)
    recording = Recording(
        gyros=tuple(
            Channel(name=name, kind="angle", unit="arcsec", values=angles[g])
            for g, name in enumerate(GYRO_NAMES)
        ),
        sample_rate=config.sample_rate_hz,
        table=None
        if table is None
        else Channel(name="table", kind="angle", unit="deg", values=table),
        null_pulse=pulse,
    )
    return Simulation(recording=recording, truth=truth_of(config))


def write(
    config: RigConfig, path: Path | str, progress: Progress | None = None
) -> tuple[Path, Path]:
    """Simulate into a file, its truth beside it as ``FILE.truth.json``.

    Angles are in arcsec, the table in deg from 0 to 360 as its encoder reads. Parquet is
    written block by block, so that the recording is never whole in memory; every other
    format that `sagnac.formats` writes is made in memory first.

    Parameters
    ----------
    config
        What to simulate.
    path
        The file; its suffix says the format.
    progress
        Called with the finished part, 0 to 1.

    Returns
    -------
    recording, truth
        Paths of the two files; each appears only when it is whole.

    Raises
    ------
    RecordingError
        If no format has the suffix or the folder cannot be written.
    """
    path = Path(path)
    truth_path = path.with_name(path.name + ".truth.json")
    with replacing(truth_path) as temporary:
        temporary.write_text(
            json.dumps(asdict(truth_of(config)), indent=1, allow_nan=False) + "\n",
            encoding="utf-8",
        )
        if path.suffix.lower() in parquet.SUFFIXES:
            _write_parquet(config, path, progress)
        else:
            recording = simulate(config, progress).recording
            if recording.table is not None:
                wrapped = _wrapped(recording.table.values, config.encoder.lines)
                recording = replace(recording, table=replace(recording.table, values=wrapped))
            formats.write(recording, path)
    return path, truth_path


def _write_parquet(config: RigConfig, path: Path, progress: Progress | None) -> None:
    with parquet.Writer(
        path,
        kinds=dict.fromkeys(GYRO_NAMES, "angle"),
        sample_rate=config.sample_rate_hz,
        table=config.turning,
        null_pulse=config.turning,
    ) as out:
        for block in blocks(config):
            columns: dict[str, NDArray[Any]] = dict(zip(GYRO_NAMES, block.angles, strict=True))
            if block.table is not None and block.null_pulse is not None:
                columns["table"] = _wrapped(block.table, config.encoder.lines)
                columns["null_pulse"] = block.null_pulse
            out.append(columns)
            if progress is not None:
                progress((block.first + block.angles.shape[1]) / config.samples)


def _wrapped(reading: FloatArray, lines: int) -> FloatArray:
    """Encoder reading within one turn, [0, 2 pi), by its line count."""
    line = 2.0 * math.pi / lines
    return np.asarray(np.mod(np.rint(reading / line), lines) * line)
