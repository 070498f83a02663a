"""The simulated rig: a gyro triad on a turning table, with the truth beside the recording.

The rate that each gyro senses, Eq. 4, is integrated sample by sample along a table motion with
jitter, wander, ripple and wobble. Nothing here uses the closed forms that the estimators fit.
"""

import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagnac import formats
from sagnac.core import errors, whole_files
from sagnac.core.arrays import FloatArray
from sagnac.core.units import DEGREE_PER_ROOT_HOUR, SENSORS, STANDARD_GRAVITY, Sensor
from sagnac.formats import arrow, csv, read_write, registry, source
from sagnac.recording.channel import PICKOFF, Pickoff
from sagnac.recording.columns import ACCELEROMETER_NAMES, GYRO_NAMES, NULL_PULSE_NAME
from sagnac.recording.encoder_readings import table_of_readings, with_lost_readings
from sagnac.recording.model import Channel, Recording
from sagnac.rig.config import RigConfig
from sagnac.rig.encoder import Encoder, NullPulse, within_turn
from sagnac.rig.gyro import Gyro, SensorErrors
from sagnac.rig.own_motion import Disturbances, DitherMotion, Nutation
from sagnac.rig.sections import SENSOR_NAMES
from sagnac.rig.table import Differences, Motion, RandomStreams, Table, fastest_rate
from sagnac.rig.truth import Truth, truth_of

# Units of angles and increments, and of rates.
_SHOWN_IN: Final = (("arcsec", "m/s"), ("deg/h", "m/s^2"))

Progress = Callable[[float], None] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulation:
    """A simulated recording and what it was made from."""

    recording: Recording
    truth: Truth


# Samples by name: gyros, accelerometers, table (unwrapped), null pulse and pick-offs.
Columns = dict[str, NDArray[Any]]


class Rig:
    """Everything that moves or adds, with its state and stream; made one sample before."""

    def __init__(self, config: RigConfig) -> None:
        streams, axes = RandomStreams(config.seed), range(len(GYRO_NAMES))
        self._config, self._steps = config, {sensor: Differences() for sensor in SENSORS}
        self._table = table = Table(config, streams)
        self._encoder = self._null_pulse = self._nutation = None
        if config.turning:
            if config.motion.nutation_rms_arcsec > 0.0:
                self._nutation = Nutation(config.motion, table, streams.nutation)
            self._encoder = Encoder(config, table.before, streams)
            way = fastest_rate(config.table, config.command) * config.duration_s
            self._null_pulse = NullPulse(config.encoder, table.origin, way, streams)
        self._disturbances = Disturbances(config.disturbances, streams.disturbances)
        self._gyros = [Gyro(config, "gyro", axis, streams, table) for axis in axes]
        dithered = axes if config.dither.is_left else ()
        self._dithers = [DitherMotion(config, axis, streams.dither[axis]) for axis in dithered]
        felt = axes if config.accelerometer.mode == "triad" else ()
        self._forces = [Gyro(config, "accelerometer", axis, streams, table) for axis in felt]

    def advance(self, first: int, count: int) -> tuple[Columns, FloatArray]:
        """The next `count` samples from number `first`, and the true table angle, rad."""
        motion = self._table.advance(first, count)
        if self._nutation is not None:
            motion = self._nutation.added_to(motion)
        angles = self._disturbances.advance(first, motion.angle, self._table.interval)
        dithered = zip(self._dithers, angles, strict=bool(self._dithers))
        shown = [dither.advance(first, angle) for dither, angle in dithered]
        for gyro, angle in zip(self._gyros, angles, strict=True):
            gyro.advance(first, motion, angle)
        columns: Columns = dict(zip(GYRO_NAMES, self._of_kind("gyro", angles), strict=True))
        if self._forces:
            velocities = self._of_kind("accelerometer", self._velocities(first, motion))
            columns |= zip(ACCELEROMETER_NAMES, velocities, strict=True)
        if self._encoder is not None and self._null_pulse is not None:
            columns["table"] = self._encoder.read(first, motion.angle)
            columns[NULL_PULSE_NAME] = self._null_pulse.advance(motion.angle)
        columns |= {PICKOFF + name: one for name, one in zip(GYRO_NAMES, shown, strict=False)}
        return columns, motion.angle

    def _of_kind(self, sensor: Sensor, values: FloatArray) -> FloatArray:
        if self._config.kind == "angle":
            return values
        scale = self._config.sample_rate_hz if self._config.kind == "rate" else 1.0
        return self._steps[sensor].of(values) * scale

    def _velocities(self, first: int, motion: Motion) -> FloatArray:
        """Gravity as the accelerometers sense it, which a level table does not turn."""
        count = motion.angle.size
        felt = np.zeros((3, count))
        felt[2] = -STANDARD_GRAVITY * self._table.interval * (first + 1.0 + np.arange(count))
        level = Motion(angle=np.zeros(count), turned=felt, moving=motion.moving)
        velocities = np.zeros((3, count))
        for accelerometer, velocity in zip(self._forces, velocities, strict=True):
            accelerometer.advance(first, level, velocity)
        return velocities


def blocks(
    config: RigConfig, block_samples: int = 65_536, progress: Progress = None
) -> Iterator[tuple[Columns, FloatArray]]:
    """The recording block by block, with the true table angle, rad.

    The samples do not depend on `block_samples`. Memory is that of one block, however long the
    recording.
    """
    rig = Rig(config)
    for start in range(0, config.samples, block_samples):
        stop = min(start + block_samples, config.samples)
        yield rig.advance(start, stop - start)
        if progress is not None:
            progress(stop / config.samples)


def simulate(config: RigConfig, progress: Progress = None) -> Simulation:
    """The whole recording in memory, with the truth.

    The table angle is what is made of the encoder's readings when they are read from a file:
    a spline goes through those that are held, and lost ones are interpolated.

    Parameters
    ----------
    config
        What to simulate.
    progress
        Called with the finished part, 0 to 1.

    Raises
    ------
    TypeError
        If `config` is not a `RigConfig`.

    Examples
    --------
    >>> from sagnac.rig.config import RigConfig
    >>> from sagnac.rig.simulate import simulate
    >>> simulation = simulate(RigConfig(duration_s=10.0, seed=7))
    >>> simulation.recording.samples
    5000
    >>> simulation.truth.pairs["x-z"].arw_deg_per_sqrt_h
    2.5e-05
    """
    _require(config, progress)
    recording = _as_recorded(config, progress)
    if recording.table is not None:
        read = table_of_readings(recording.table.values, "rad")
        known = with_lost_readings(read, recording.gyros, recording.sample_rate)
        table = replace(known.channel, shown_in=recording.table.shown_in)
        recording = replace(recording, table=table, notes=known.notes)
    return Simulation(recording=recording, truth=truth_of(config))


def _as_recorded(config: RigConfig, progress: Progress) -> Recording:
    """The whole recording, its table angle as the encoder reads, unwrapped."""
    parts: dict[str, list[NDArray[Any]]] = {}
    for columns, _ in blocks(config, progress=progress):
        for name, part in columns.items():
            parts.setdefault(name, []).append(part)
    # One after the other, so that no more than one is in memory twice.
    return _recording_of(config, {name: np.concatenate(parts.pop(name)) for name in list(parts)})


def _recording_of(config: RigConfig, columns: Mapping[str, NDArray[Any]]) -> Recording:
    """Columns of any length as a recording."""
    gyros, forces = (
        tuple(
            Channel(name=name, kind=config.kind, shown_in=unit, values=columns[name], sensor=sensor)
            for name in SENSOR_NAMES[sensor]
            if name in columns
        )
        for sensor, unit in zip(SENSORS, _SHOWN_IN[config.kind == "rate"], strict=True)
    )
    dithered = [name for name in GYRO_NAMES if PICKOFF + name in columns]
    table = None
    if config.turning:
        table = Channel(name="table", kind="angle", shown_in="deg", values=columns["table"])
    return Recording(
        gyros=gyros,
        accelerometers=forces,
        sample_rate=config.sample_rate_hz,
        table=table,
        null_pulse=columns.get(NULL_PULSE_NAME),
        pickoffs=tuple(Pickoff(gyro=name, values=columns[PICKOFF + name]) for name in dithered),
    )


def write(config: RigConfig, path: Path | str, progress: Progress = None) -> tuple[Path, Path]:
    """Simulate into a file, its truth beside it as ``FILE.truth.json``.

    Angles and pick-offs are in arcsec, the table in deg from 0 to 360 as its encoder reads.
    Parquet is written block by block, so that the recording is never whole in memory; every other
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
        If no format has the suffix, it cannot hold the recording, or the folder cannot be written.
    TypeError
        If `config` is not a `RigConfig`.
    """
    _require(config, progress)
    path = errors.path_of("path", path)
    truth_path = path.with_name(path.name + ".truth.json")
    # The heading is that of one sample alone.
    heading = source.outgoing(_recording_of(config, next(blocks(config, block_samples=1))[0]))
    known = read_write.format_to_write(path, heading)
    with whole_files.replacing_set(path) as folder:
        temporary = folder / path.name
        stated = json.dumps(asdict(truth_of(config)), indent=1, allow_nan=False)
        (folder / truth_path.name).write_text(f"{stated}\n", encoding="utf-8")
        if known is registry.PARQUET:
            with arrow.writer(temporary, heading) as append:
                for columns, _ in blocks(config, progress=progress):
                    if "table" in columns:
                        columns["table"] = within_turn(columns["table"], config.encoder.lines)
                    append(heading.in_units(columns))
        else:
            recording = _as_recorded(config, progress)
            if recording.table is not None:
                wrapped = within_turn(recording.table.values, config.encoder.lines)
                recording = replace(recording, table=replace(recording.table, values=wrapped))
            if known is registry.EUROC:
                csv.write_euroc(temporary, source.outgoing(recording), _densities(config))
            else:
                formats.write(recording, temporary)
    return path, truth_path


def _densities(config: RigConfig) -> dict[Sensor, tuple[float, float]]:
    """Largest white noise of a rate, that of its steps with it, and largest K, SI."""
    densities: dict[Sensor, tuple[float, float]] = {}
    for sensor in SENSORS:
        own = [SensorErrors.of(getattr(config, sensor), axis) for axis in range(len(GYRO_NAMES))]
        walks = [one.random_walk for one in own]
        if sensor == "gyro":
            # Lock-in makes more of the random walk that a ring laser begins with.
            truths = truth_of(config).gyros.values()
            walks = [one.arw_deg_per_sqrt_h * DEGREE_PER_ROOT_HOUR for one in truths]
        steps = [one.rate_quantum / math.sqrt(12.0 * config.sample_rate_hz) for one in own]
        densities[sensor] = (max(map(math.hypot, walks, steps)), max(one.rate_walk for one in own))
    return densities


def _require(config: object, progress: Progress) -> None:
    remedy = "give a RigConfig, for one RigConfig() or sagnac.rig.config.preset('paper')"
    errors.require_type("config", config, RigConfig, remedy)
    errors.require_progress(progress)
