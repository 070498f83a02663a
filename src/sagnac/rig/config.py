"""The simulated rig as a user configures it: all sections together, and the presets."""

import json
import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Final, Self

import numpy as np

from sagnac.core import documents, errors, units
from sagnac.core.arrays import FloatArray
from sagnac.recording.channel import Kind
from sagnac.recording.columns import GYRO_NAMES
from sagnac.rig import measured, sections
from sagnac.rig.ring_laser import angle_random_walk, dither_of, ring_lasers_of
from sagnac.rig.sections import ConfigurationError, require

# ---- what is commanded -------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class TableCommand:
    """Commanded table motion: rate at knots, straight between, constant outside.

    Attributes
    ----------
    time, rate, angle
        (knots,) s, rad/s and rad.
    """

    time: FloatArray
    rate: FloatArray
    angle: FloatArray

    def rate_at(self, time: FloatArray) -> FloatArray:
        """Commanded rate, rad/s."""
        return np.interp(time, self.time, self.rate)

    def angle_at(self, time: FloatArray) -> FloatArray:
        """Commanded angle, rad."""
        index = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, self.time.size - 1)
        since = time - self.time[index]
        # Mean of the rates at both ends of a straight piece; outside the knots they agree.
        return np.asarray(self.angle[index] + 0.5 * (self.rate[index] + self.rate_at(time)) * since)


def table_command(config: sections.TableConfig, duration: float) -> TableCommand:
    """The motion that the configuration commands in `duration` seconds."""
    knots = config.profile or _reversals(config, duration)
    time, rate = np.array(knots, dtype=np.float64).T * [[1.0], [units.DEGREE]]
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))])
    command = TableCommand(time=time, rate=rate, angle=angle)
    start = config.start_deg * units.DEGREE - float(command.angle_at(np.zeros(1))[0])
    return replace(command, angle=angle + start)


def _reversals(config: sections.TableConfig, duration: float) -> sections.Pairs:
    rate = config.rate_deg_per_s
    knots, interval = [(0.0, rate)], config.reversal_interval_s
    if interval == 0.0 or rate == 0.0:
        return tuple(knots)
    ramp, stand = abs(rate) / config.acceleration_deg_per_s2, 0.5 * config.dwell_s
    onward = config.after_dwell == "onward"
    middle = interval
    while middle < duration:
        knots.append((middle - stand - ramp, rate))
        if stand > 0.0:
            knots.append((middle - stand, 0.0))
        if stand > 0.0 or onward:
            knots.append((middle + stand, 0.0))
        rate = rate if onward else -rate
        knots.append((middle + stand + ramp, rate))
        middle += interval
    return tuple(knots)


# ---- configuration -------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class RigConfig:
    """Everything that a simulated recording is made from, in the field's units.

    ``docs/simulate.md`` lists every key with its default, its range and its meaning.

    Attributes
    ----------
    duration_s
        length of the recording
    sample_rate_hz
        samples per second
    seed
        of every random stream
    kind
        of the samples of gyros and accelerometers

    Raises
    ------
    ConfigurationError
        A ValueError of one line: the key, its value, and what is allowed.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from sagnac.rig.config import RigConfig, preset
    >>> from sagnac.rig.sections import GyroConfig, TableConfig
    >>> RigConfig(duration_s=60.0, table=TableConfig(rate_deg_per_s=20.0))
    RigConfig(60 s at 500 Hz, table at 20 deg/s, gyros ideal, seed 1)
    >>> replace(preset("paper"), seed=7).samples
    3600000
    >>> GyroConfig(warm_up_k=200.0)
    Traceback (most recent call last):
    ...
    sagnac.rig.sections.ConfigurationError: gyro.warm_up_k is 200.0; it must lie from -100 to 100
    """

    duration_s: Annotated[float, sections.Number(0.01, 1e7)] = 7200.0
    sample_rate_hz: Annotated[float, sections.Number(0.1, 1e5)] = 500.0
    seed: Annotated[int, sections.Number(0, 2**32 - 1)] = 1
    kind: Kind = "angle"
    table: sections.TableConfig = sections.TableConfig()
    encoder: sections.EncoderConfig = sections.EncoderConfig()
    motion: sections.MotionConfig = sections.MotionConfig()
    platform: sections.PlatformConfig = sections.PlatformConfig()
    gyro: sections.GyroConfig = sections.GyroConfig()
    accelerometer: sections.AccelerometerConfig = sections.AccelerometerConfig()
    dither: sections.DitherConfig = sections.DitherConfig()
    disturbances: sections.DisturbancesConfig = sections.DisturbancesConfig()

    def __post_init__(self) -> None:
        sections.check(self)
        _check_sampling(self)
        _check_table(self.table)
        _check_delay(self.encoder, self.duration_s)
        _check_modes(self)

    def __repr__(self) -> str:
        motion = f"at {self.table.rate_deg_per_s:g} deg/s" if self.turning else "at rest"
        if self.table.profile:
            motion = f"on a profile of {len(self.table.profile)} knots"
        samples = f"{self.duration_s:g} s at {self.sample_rate_hz:g} Hz"
        return f"RigConfig({samples}, table {motion}, gyros {self.gyro.mode}, seed {self.seed})"

    @property
    def samples(self) -> int:
        """Samples in the recording."""
        return round(self.duration_s * self.sample_rate_hz)

    @property
    def turning(self) -> bool:
        """Whether the table is commanded to move at all."""
        return self.table.turning

    @property
    def command(self) -> TableCommand:
        """The table motion that is commanded."""
        return table_command(self.table, self.duration_s)

    @classmethod
    def from_analysis(cls, analysis: Any) -> Self:
        """A rig whose gyros and accelerometers have the Q, N, B, K and R that were measured.

        Sample rate, length and table rate are those of the recording. What was not estimated is
        zero (`sagnac.rig.measured.Measured.left_out` names it), except slow noise that is neither B
        nor K for certain: it is its most likely law. A single gyro stands for all three.

        Parameters
        ----------
        analysis
            The `Analysis` that `analyze` returned, or the content of an ``analysis.json``.

        Raises
        ------
        ConfigurationError
            If a value is out of the range of its key.
        """
        # The rig imports nothing of what estimates: an analysis is what its document states.
        remedy = "give what analyze(recording) returns"
        errors.require_type("analysis", analysis, (Mapping, documents.Documented), remedy)
        document = analysis if isinstance(analysis, Mapping) else json.loads(analysis.to_json())
        return cls.from_mapping(measured.Measured.of_document(document).keys())

    @classmethod
    def from_toml(cls, path: str | os.PathLike[str], base: "RigConfig | None" = None) -> Self:
        """Read a configuration; ``preset = "paper"`` at the top names what it starts from.

        Parameters
        ----------
        path
            The TOML.
        base
            What it starts from instead of the defaults; the TOML names no preset then.

        Raises
        ------
        RecordingError
            One line with the file, the key, its value, and what is allowed.
        """
        where, remedy = os.fspath(path), "give a TOML configuration"
        try:
            return cls.from_mapping(documents.read_toml(Path(path)), base)
        except OSError as error:
            is_missing = isinstance(error, FileNotFoundError)
            problem = "no such file" if is_missing else f"cannot be opened ({error.strerror})"
            raise errors.RecordingError(problem, path=where, remedy=remedy) from None
        except errors.RecordingError as error:
            raise error.at(where) from None
        except ValueError as error:
            raise errors.RecordingError(str(error), path=where, remedy="correct it there") from None

    @classmethod
    def from_mapping(cls, mapping: Mapping[str, Any], base: "RigConfig | None" = None) -> Self:
        """Configuration from nested tables, as a TOML file holds them, over `base`.

        Raises
        ------
        ConfigurationError
            One line with the key, its value, and what is allowed.

        Examples
        --------
        >>> RigConfig.from_mapping({"preset": "quiet", "table": {"rate_deg_per_s": 0}})
        RigConfig(7200 s at 500 Hz, table at rest, gyros ideal, seed 1)
        """
        values = dict(mapping)
        name = values.pop("preset", None)
        if name is not None and base is not None:
            problem = f"preset is {errors.quoted(name)}, but the unit is like one that was measured"
            raise ConfigurationError(problem, remedy="remove preset")
        begun = base or (RigConfig() if name is None else preset(name))
        changed: Self = sections.overlaid(begun, values)
        return changed


# ---- keys that depend on one another -------------------------------------------------


def _check_sampling(config: RigConfig) -> None:
    nyquist = config.sample_rate_hz / 2.0
    for frequency, _ in config.disturbances.time:
        fact = f"{frequency:g} Hz is above {nyquist:g} Hz, half of sample_rate_hz"
        remedy = "give the frequency it folds to"
        require(frequency <= nyquist, f"disturbances.time: {fact}", remedy)
    nutation = config.motion.nutation_hz
    fact = f"{nutation:g} is above {0.5 * nyquist:g} Hz, a quarter of sample_rate_hz"
    is_slow = config.motion.nutation_rms_arcsec == 0.0 or nutation <= 0.5 * nyquist
    require(is_slow, f"motion.nutation_hz {fact}", "lower it, or raise sample_rate_hz")
    for section, own in (("gyro", config.gyro), ("accelerometer", config.accelerometer)):
        highest = max(own.low_pass_hz)
        fact = f"{highest:g} is not below {nyquist:g} Hz, half of sample_rate_hz"
        remedy = "lower it, or give 0 for no low-pass"
        require(highest < nyquist, f"{section}.low_pass_hz {fact}", remedy)
    problem = f"duration_s {config.duration_s:g} holds no sample at {config.sample_rate_hz:g} Hz"
    require(config.samples >= 1, problem, "make it longer")


def _check_table(table: sections.TableConfig) -> None:
    times = [time for time, _ in table.profile]
    rising = all(earlier < later for earlier, later in pairwise(times))
    require(rising, f"table.profile: times {times} do not increase", "sort them")
    turn_round = 2.0 * abs(table.rate_deg_per_s) / table.acceleration_deg_per_s2 + table.dwell_s
    fact = f"{table.reversal_interval_s:g} leaves no time to turn round in {turn_round:g} s"
    in_time = not 0.0 < table.reversal_interval_s <= turn_round or bool(table.profile)
    remedy = "raise it or table.acceleration_deg_per_s2"
    require(in_time, f"table.reversal_interval_s {fact}", remedy)
    known = table.dwell_s == 0.0 or (not table.profile and table.reversal_interval_s > 0.0)
    problem = f"table.dwell_s is {table.dwell_s:g}, but nothing says when the table stands"
    require(known, problem, "give table.reversal_interval_s, and no table.profile")
    ripple = sum(fraction for _, fraction in table.ripple)
    problem = f"table.ripple: fractions add up to {ripple:g}"
    require(ripple < 1.0, problem, "keep them below 1 so that the table keeps its direction")


def _check_delay(encoder: sections.EncoderConfig, duration: float) -> None:
    end = float(encoder.delay_at(duration, duration))
    # The difference of drift and clock may leave a rounding below zero.
    most, fact = sections.LONGEST_DELAY_S, f"{end:g} s late after {duration:g} s"
    problem = f"encoder.latency_s, latency_drift_s and clock_ppm put readings {fact}"
    remedy = f"keep it from 0 to {most:g} s; a clock that runs slow needs a latency to begin with"
    require(-1e-12 <= end <= most, problem, remedy)


def _check_modes(config: RigConfig) -> None:
    gyro, detuning = config.gyro, min(config.dither.detuning_hz)
    problem = "gyro.mode is 'still' on a turning table"
    remedy = "set table.rate_deg_per_s = 0, or mode rate-biased or dithered"
    require(gyro.mode != "still" or not config.turning, problem, remedy)
    dithered, mode = gyro.mode == "dithered" or not config.dither.is_left, "mode 'dithered'"
    problem = f"dither.residue and dither.delay_s are of {mode}; gyro.mode is {gyro.mode!r}"
    require(dithered, problem, "set gyro.mode to 'dithered', or both to 0")
    problem = f"dither.detuning_hz {detuning:g} leaves no frequency"
    remedy = "keep it above -gyro.dither_frequency_hz"
    require(gyro.dither_frequency_hz + detuning > 0.0, problem, remedy)
    # Each gyro must sense a rate well above its lock-in all the time.
    rate, dither = config.command.rate, dither_of(gyro)
    slowest = 0.0 if rate.min() < 0.0 < rate.max() else float(np.abs(rate).min())
    sensed = zip(GYRO_NAMES, ring_lasers_of(gyro), np.abs(config.platform.shares), strict=False)
    for name, laser, share in sensed:
        # Jitter never locks at a bias of ten lock-in rates.
        needed = 10.0 * laser.lock_in
        is_clear = gyro.mode != "rate-biased" or share * slowest >= needed
        slow = f"gyro {name} comes down to {share * slowest / units.DEGREE:.3g} deg/s"
        wanted = f"{needed / units.DEGREE:.3g} deg/s, 10 times its lock-in"
        remedy = f"the table must turn one way and give it {wanted}"
        require(is_clear, f"gyro.mode is 'rate-biased' but {slow}", remedy)
        try:
            angle_random_walk(laser, 1.1 * share * float(np.abs(rate).max()), dither)
        except ValueError as error:
            problem, _, remedy = str(error).partition("; ")
            problem = f"gyro.mode {gyro.mode!r}: {problem}"
            raise ConfigurationError(problem, remedy=remedy) from None


# ---- presets -------------------------------------------------------------------------


def preset(name: str) -> RigConfig:
    """The configuration called `name`: ``quiet``, ``paper``, ``dithered`` or ``harsh``.

    Raises
    ------
    ConfigurationError
        If there is none of that name.

    Examples
    --------
    >>> preset("paper")
    RigConfig(7200 s at 500 Hz, table at 40 deg/s, gyros ideal, seed 1)
    """
    if name not in PRESETS:
        remedy = f"use one of {', '.join(PRESETS)}"
        raise ConfigurationError(f"preset {name!r} does not exist", remedy=remedy)
    return PRESETS[name]


# The presets by name, from ``presets.toml``; one may start from another before it.
PRESETS: Final[dict[str, RigConfig]] = {}
_text = files("sagnac.rig").joinpath("presets.toml").read_text("utf-8")
for _name, _tables in tomllib.loads(_text).items():
    PRESETS[_name] = RigConfig.from_mapping(_tables)
