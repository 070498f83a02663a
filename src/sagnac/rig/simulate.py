"""The simulated rig: a gyro triad on a turning table, with the truth beside the recording.

The rate that each gyro senses, Eq. 4, is integrated sample by sample along a table motion with
jitter, wander, ripple and wobble. Nothing here uses the closed forms that the estimators fit.
"""

import json
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from sagnac import formats
from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.core.errors import quoted
from sagnac.core.units import DEGREE_PER_ROOT_HOUR, STANDARD_GRAVITY, UNITS, Sensor, Unit, unit_of
from sagnac.core.whole_files import replacing_set
from sagnac.formats import arrow
from sagnac.formats.csv import write_euroc
from sagnac.formats.read_write import format_to_write
from sagnac.formats.registry import EUROC, PARQUET
from sagnac.formats.source import in_units, outgoing
from sagnac.recording.channel import PICKOFF, Pickoff
from sagnac.recording.columns import NULL_PULSE_NAME, Conversion, with_lost_readings
from sagnac.recording.encoder_readings import angle_of_readings
from sagnac.recording.model import Channel, Kind, Recording
from sagnac.rig.config import RigConfig
from sagnac.rig.encoder import Encoder, NullPulse, within_turn
from sagnac.rig.gyro import (
    Gyro,
    LockIn,
    LowPass,
    RateReadout,
    SensorErrors,
    SlowDrift,
    dither_of,
    ring_lasers_of,
)
from sagnac.rig.own_motion import Disturbances, Mount, Nutation
from sagnac.rig.ring_laser import DitherMotion
from sagnac.rig.sections import ACCELEROMETER_NAMES, GYRO_NAMES, AccelerometerConfig, GyroConfig
from sagnac.rig.table import Motion, Table, fastest_rate, random_streams, table_command
from sagnac.rig.truth import Truth, truth_of

BLOCK_SAMPLES: Final = 65_536

Progress = Callable[[float], None]
Streams = tuple[np.random.Generator, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulation:
    """A simulated recording and what it was made from."""

    recording: Recording
    truth: Truth


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """Consecutive samples of the recording; its arrays are read-only.

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
    pickoffs
        (3, n) dither of x, y, z as the pick-offs show it, arcsec, or None if no dither is left.
    velocities
        (3, n) integrals of what ax, ay and az measure, m/s, or None without accelerometers.
    """

    first: int
    angles: FloatArray
    table: FloatArray | None
    null_pulse: BooleanArray | None
    table_angle: FloatArray
    pickoffs: FloatArray | None = None
    velocities: FloatArray | None = None

    def __post_init__(self) -> None:
        arrays = (self.angles, self.table, self.null_pulse, self.table_angle, self.pickoffs)
        for array in (*arrays, self.velocities):
            if array is not None:
                array.flags.writeable = False

    @property
    def span(self) -> slice:
        """Where the block lies in the recording."""
        return slice(self.first, self.first + self.table_angle.size)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rig:
    """The rig at one moment: everything that moves or adds, each with its state and stream.

    `encoder` and `null_pulse` are None on a table that is not commanded to move.
    """

    table: Table
    disturbances: Disturbances
    gyros: tuple[Gyro, ...]
    encoder: Encoder | None
    null_pulse: NullPulse | None
    nutation: Nutation | None = None
    dithers: tuple[DitherMotion, ...] = ()
    accelerometers: tuple[Gyro, ...] = ()

    @classmethod
    def before_first(cls, config: RigConfig) -> Self:
        """The rig one sample before the first."""
        streams = random_streams(config.seed)
        command = table_command(config.table, config.duration_s)
        interval = 1.0 / config.sample_rate_hz
        moving = bool(command.rate_at(np.array([-interval]))[0] != 0.0)
        table = Table.before_first(config.table, command, config.platform.earth, interval, streams)
        encoder = null_pulse = nutation = None
        if config.turning:
            nutation = Nutation.drawn(
                config.motion,
                table.origin,
                moving=moving,
                interval=interval,
                random=streams.nutation,
            )
            way = fastest_rate(config.table, command) * config.duration_s
            encoder = Encoder.drawn(
                config.encoder,
                table.before,
                duration=config.duration_s,
                interval=interval,
                streams=streams,
            )
            null_pulse = NullPulse.drawn(config.encoder, table.origin, way, streams)
        dither, rate, force = dither_of(config.gyro), config.sample_rate_hz, config.accelerometer
        lock_ins: list[LockIn | None] = [
            LockIn(laser=laser, dither=dither, interval=interval)
            for laser in ring_lasers_of(config.gyro)
        ]
        sensors = _sensors(config, config.gyro, streams.white, streams.slow, streams.readout)
        axes = range(len(sensors))
        mounts = [
            Mount.drawn(config.motion, g, moving=moving, interval=interval, random=streams.mount[g])
            for g in axes
        ]
        dithers = [
            DitherMotion.drawn(
                config.gyro, config.dither, g, sample_rate=rate, random=streams.dither[g]
            )
            for g in axes
        ]
        accelerometers = _sensors(
            config, force, streams.force_white, streams.force_slow, streams.force_readout
        )
        return cls(
            table=table,
            disturbances=Disturbances.drawn(config.disturbances, streams.disturbances),
            gyros=tuple(
                replace(sensor, origin=table.origin, lock_in=lock_in, mount=mount)
                for sensor, lock_in, mount in zip(
                    sensors, lock_ins or [None] * len(sensors), mounts, strict=True
                )
            ),
            encoder=encoder,
            null_pulse=null_pulse,
            nutation=nutation,
            dithers=tuple(dithers) if config.dither.is_left else (),
            accelerometers=accelerometers if force.mode == "triad" else (),
        )

    def advance(self, first: int, count: int) -> Block:
        """The next `count` samples, the first of which has number `first`."""
        motion = self.table.advance(first, count)
        if self.nutation is not None:
            motion = self.nutation.added_to(motion)
        angles = self.disturbances.advance(first, motion.angle, self.table.interval)
        shown = [
            dither.advance(first, measured)
            for dither, measured in zip(self.dithers, angles, strict=bool(self.dithers))
        ]
        for gyro, measured in zip(self.gyros, angles, strict=True):
            gyro.advance(first, motion, measured)
        return Block(
            first=first,
            angles=angles,
            table=None if self.encoder is None else self.encoder.read(first, motion.angle),
            null_pulse=None if self.null_pulse is None else self.null_pulse.advance(motion.angle),
            table_angle=motion.angle,
            pickoffs=np.array(shown) if shown else None,
            velocities=self._velocities(first, motion) if self.accelerometers else None,
        )

    def _velocities(self, first: int, motion: Motion) -> FloatArray:
        """Gravity as the accelerometers sense it, which a level table does not turn."""
        count = motion.angle.size
        felt = np.zeros((3, count))
        felt[2] = -STANDARD_GRAVITY * self.table.interval * (first + 1.0 + np.arange(count))
        level = Motion(angle=np.zeros(count), turned=felt, moving=motion.moving)
        velocities = np.zeros((len(self.accelerometers), count))
        for accelerometer, measured in zip(self.accelerometers, velocities, strict=True):
            accelerometer.advance(first, level, measured)
        return velocities


def _sensors(
    config: RigConfig,
    own: GyroConfig | AccelerometerConfig,
    white: Streams,
    slow: Streams,
    readout: Streams,
) -> tuple[Gyro, ...]:
    """Three gyros without lock-in and mount, or accelerometers, whose table does not turn them."""
    rate, interval = config.sample_rate_hz, 1.0 / config.sample_rate_hz
    sensors = []
    for axis, direction in enumerate(config.platform.matrix):
        errors = SensorErrors.of(own, axis)
        drift = SlowDrift.stationary(
            errors, sample_rate=rate, duration=config.duration_s, random=slow[axis]
        )
        sensor = Gyro(
            direction=direction,
            origin=0.0,
            interval=interval,
            slow=drift,
            errors=errors,
            random=white[axis],
            readout=readout[axis],
            low_pass=LowPass.of(errors, rate),
            rates=RateReadout.of(errors, interval),
        )
        sensors.append(sensor)
    return tuple(sensors)


def _as_kind(
    values: FloatArray, before: FloatArray | None, kind: Kind, sample_rate: float
) -> FloatArray:
    """(3, n) angles as samples of a kind; `before` (3,) are those of the sample before, or none."""
    if kind == "angle":
        return values
    begun = np.zeros(len(values)) if before is None else before
    steps = np.diff(values, prepend=begun[:, np.newaxis])
    return steps if kind == "increment" else steps * sample_rate


def blocks(config: RigConfig, block_samples: int = BLOCK_SAMPLES) -> Iterator[Block]:
    """The recording block by block; the samples do not depend on `block_samples`.

    Memory is that of one block, however long the recording.
    """
    rig = Rig.before_first(config)
    for start in range(0, config.samples, block_samples):
        yield rig.advance(start, min(block_samples, config.samples - start))


def simulate(config: RigConfig, progress: Progress | None = None) -> Simulation:
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
    _require_config(config)
    recording = _as_recorded(config, progress)
    if recording.table is not None:
        taken = angle_of_readings(recording.table.values, unit_of("rad", "angle"))
        table = replace(recording.table, values=taken.angle)
        known = with_lost_readings(
            Conversion(channel=table, notes=taken.notes),
            recording.gyros,
            recording.sample_rate,
        )
        recording = replace(recording, table=known.channel, notes=known.notes)
    return Simulation(recording=recording, truth=truth_of(config))


def _as_recorded(config: RigConfig, progress: Progress | None) -> Recording:
    """The whole recording, its table angle as the encoder reads, unwrapped."""
    whole: dict[str, NDArray[Any]] = {}
    for span, columns in _columns(config, progress):
        for name, part in columns.items():
            if name not in whole:
                whole[name] = np.empty(config.samples, part.dtype)
            whole[name][span] = part
    sensors: dict[Sensor, tuple[Channel, ...]] = {
        sensor: tuple(
            Channel(name=name, kind=config.kind, shown_in=unit, values=whole[name], sensor=sensor)
            for name, unit in units.items()
        )
        for sensor, units in _units(config).items()
    }
    pickoffs = [name for name in GYRO_NAMES if PICKOFF + name in whole]
    table = None
    if config.turning:
        table = Channel(name="table", kind="angle", shown_in="deg", values=whole["table"])
    return Recording(
        gyros=sensors["gyro"],
        accelerometers=sensors["accelerometer"],
        sample_rate=config.sample_rate_hz,
        table=table,
        null_pulse=whole.get(NULL_PULSE_NAME),
        pickoffs=tuple(Pickoff(gyro=name, values=whole[PICKOFF + name]) for name in pickoffs),
    )


def _columns(
    config: RigConfig, progress: Progress | None
) -> Iterator[tuple[slice, dict[str, NDArray[Any]]]]:
    """Columns of each block, the table unwrapped, and where they lie in the recording."""
    before: dict[Sensor, FloatArray] = {}
    units, pickoffs = _units(config), [PICKOFF + name for name in GYRO_NAMES]
    for block in blocks(config):
        columns: dict[str, NDArray[Any]] = {}
        measured: dict[Sensor, FloatArray | None] = {
            "gyro": block.angles,
            "accelerometer": block.velocities,
        }
        for sensor, values in measured.items():
            if values is not None:
                shown = _as_kind(values, before.get(sensor), config.kind, config.sample_rate_hz)
                columns.update(zip(units[sensor], shown, strict=True))
                before[sensor] = values[:, -1]
        if block.table is not None and block.null_pulse is not None:
            columns |= {"table": block.table, NULL_PULSE_NAME: block.null_pulse}
        if block.pickoffs is not None:
            columns.update(zip(pickoffs, block.pickoffs, strict=True))
        yield block.span, columns
        if progress is not None:
            progress(block.span.stop / config.samples)


def _units(config: RigConfig) -> dict[Sensor, dict[str, str]]:
    """Units of gyros and of accelerometers in a file, by name."""
    of_gyro, of_force = ("deg/h", "m/s^2") if config.kind == "rate" else ("arcsec", "m/s")
    forces = ACCELEROMETER_NAMES if config.accelerometer.mode == "triad" else ()
    return {
        "gyro": dict.fromkeys(GYRO_NAMES, of_gyro),
        "accelerometer": dict.fromkeys(forces, of_force),
    }


def write(
    config: RigConfig, path: Path | str, progress: Progress | None = None
) -> tuple[Path, Path]:
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
    _require_config(config)
    path = Path(path)
    truth_path = path.with_name(path.name + ".truth.json")
    forces = tuple(_units(config)["accelerometer"])
    known = format_to_write(
        path,
        dict.fromkeys((*GYRO_NAMES, *forces), config.kind),
        accelerometers=forces,
        beside=[
            *(("table", NULL_PULSE_NAME) if config.turning else ()),
            *((PICKOFF + name for name in GYRO_NAMES) if config.dither.is_left else ()),
        ],
    )
    with replacing_set(path) as folder:
        temporary = folder / path.name
        (folder / truth_path.name).write_text(
            json.dumps(asdict(truth_of(config)), indent=1, allow_nan=False) + "\n", encoding="utf-8"
        )
        if known is PARQUET:
            _write_parquet(config, temporary, progress)
        else:
            recording = _as_recorded(config, progress)
            if recording.table is not None:
                wrapped = within_turn(recording.table.values, config.encoder.lines)
                recording = replace(recording, table=replace(recording.table, values=wrapped))
            if known is EUROC:
                write_euroc(temporary, outgoing(recording), _densities(config))
            else:
                formats.write(recording, temporary)
    return path, truth_path


def _densities(config: RigConfig) -> dict[Sensor, tuple[float, float]]:
    """Largest white noise of a rate, that of its steps with it, and largest K, SI."""
    rates = math.sqrt(12.0 * config.sample_rate_hz)

    def largest(
        own: GyroConfig | AccelerometerConfig, walks: Iterable[float] | None = None
    ) -> tuple[float, float]:
        errors = [SensorErrors.of(own, axis) for axis in range(len(GYRO_NAMES))]
        noises = walks or [one.random_walk for one in errors]
        white = (
            math.hypot(noise, one.rate_quantum / rates)
            for noise, one in zip(noises, errors, strict=True)
        )
        return max(white), max(one.rate_walk for one in errors)

    # Lock-in makes more of the random walk that a ring laser begins with.
    walks = [
        one.arw_deg_per_sqrt_h * DEGREE_PER_ROOT_HOUR for one in truth_of(config).gyros.values()
    ]
    return {"gyro": largest(config.gyro, walks), "accelerometer": largest(config.accelerometer)}


def _write_parquet(config: RigConfig, path: Path, progress: Progress | None) -> None:
    units = _units(config)
    names = {**units["gyro"], **units["accelerometer"]}
    written_in: dict[str, Unit | None] = {
        **{name: UNITS[unit] for name, unit in names.items()},
        **({"table": UNITS["deg"], NULL_PULSE_NAME: None} if config.turning else {}),
        **({PICKOFF + name: None for name in GYRO_NAMES} if config.dither.is_left else {}),
    }
    with arrow.writer(
        path,
        written_in,
        kinds=dict.fromkeys(names, config.kind),
        accelerometers=tuple(units["accelerometer"]),
        sample_rate=config.sample_rate_hz,
    ) as append:
        for _, columns in _columns(config, progress):
            if "table" in columns:
                columns["table"] = within_turn(columns["table"], config.encoder.lines)
            append(in_units(columns, written_in))


def _require_config(config: object) -> None:
    if not isinstance(config, RigConfig):
        raise TypeError(
            f"config is {quoted(config)}; give a RigConfig, for one RigConfig() or "
            "sagnac.rig.config.preset('paper')"
        )
