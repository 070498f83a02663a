"""The simulated rig: gyro triad on a turning table, with the truth beside the recording.

The rate each gyro senses, Eq. 4, is integrated sample by sample along a table motion with
jitter, wander, ripple and wobble. Nothing here uses the closed forms the estimators fit.
Configurations are in the field's units, named in every key; see ``docs/simulate.md``.
"""

import json
import math
import os
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self, get_args, get_origin, get_type_hints

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from sagnac import _kernels, formats
from sagnac.formats import parquet
from sagnac.formats.source import replacing
from sagnac.frames import earth_rate, shares_from_deviations, table_to_gyro_matrix
from sagnac.recording import Channel, FloatArray, Recording
from sagnac.ring_laser import Dither, RingLaser, angle_random_walk, mean_rate
from sagnac.units import (
    ARCSECOND,
    DEGREE,
    DEGREE_PER_HOUR,
    DEGREE_PER_HOUR_PER_HOUR,
    DEGREE_PER_HOUR_PER_ROOT_HOUR,
    DEGREE_PER_ROOT_HOUR,
)

Triple = tuple[float, float, float]
Pairs = tuple[tuple[float, float], ...]
Progress = Callable[[float], None]
GyroMode = Literal["ideal", "still", "dithered", "rate-biased"]

GYRO_NAMES: Final = ("x", "y", "z")
_PAIRS: Final = (("x", "z"), ("x", "y"), ("y", "z"))
BLOCK_SAMPLES: Final = 65_536
TRUTH_SCHEMA: Final = "sagnac.truth/1"

# Between nodes the integrand cos(alpha) is taken by Simpson's rule, whose error is
# turn^4/2880 of the Earth-rate harmonic (15 arcsec): below 1e-6 arcsec at this turn.
_LARGEST_TURN_PER_STEP = 0.02  # rad
_LARGEST_JITTER_STEP = 0.5  # step times natural frequency of the servo
_MARKOV_STEP = 0.02  # s, grid of bias instability and rate random walk
_MARKOV_RATIO = 3.0  # between neighbouring correlation times
_LONGEST_CORRELATION = 10.0  # of the duration
_NULL_MARGIN = 8.0  # null errors a passage keeps clear
_CLEAR_OF_LOCK_IN = 10.0  # lock-in rates that the bias must exceed, so that jitter never locks


@dataclass(frozen=True, slots=True)
class Key:
    """What a configuration key may hold and what it means."""

    low: float
    high: float
    meaning: str


@dataclass(frozen=True, slots=True)
class PairsKey:
    """A key that holds a list of pairs: what each half is and its range."""

    first: tuple[str, float, float]
    second: tuple[str, float, float]
    meaning: str


@dataclass(frozen=True, slots=True)
class ChoiceKey:
    """A key that holds one of a few words."""

    choices: tuple[str, ...]
    meaning: str


@dataclass(frozen=True, slots=True, kw_only=True)
class TableConfig:
    """The turntable: commanded motion and what its servo and bearing add."""

    rate_deg_per_s: Annotated[
        float, Key(-400.0, 400.0, "commanded rate; the sign is the direction")
    ] = 40.0
    start_deg: Annotated[
        float, Key(-360.0, 360.0, "commanded table angle at the first sample, from the null")
    ] = 0.0
    reversal_interval_s: Annotated[float, Key(0.0, 1e6, "time between reversals, 0 for none")] = 0.0
    acceleration_deg_per_s2: Annotated[float, Key(0.1, 1e4, "acceleration of a reversal")] = 100.0
    profile: Annotated[
        Pairs,
        PairsKey(
            ("time s", 0.0, 1e7),
            ("rate deg/s", -400.0, 400.0),
            "commanded rate at given times, straight between; replaces rate and reversals",
        ),
    ] = ()
    jitter_rms_deg_per_s: Annotated[float, Key(0.0, 10.0, "rms rate jitter of the servo")] = 0.0
    jitter_bandwidth_hz: Annotated[float, Key(0.01, 1000.0, "natural frequency of the jitter")] = (
        8.0
    )
    jitter_damping: Annotated[
        float, Key(0.01, 10.0, "damping ratio of the servo, with `position`")
    ] = 0.5
    jitter_spectrum: Annotated[
        Literal["position", "rate"],
        ChoiceKey(
            ("position", "rate"),
            "`position`: the servo holds the angle; `rate`: it holds the rate and the angle walks",
        ),
    ] = "position"
    wander_fraction: Annotated[
        float, Key(0.0, 0.2, "rms slow wander of the rate, as a part of it")
    ] = 0.0
    wander_time_s: Annotated[float, Key(1.0, 1e6, "correlation time of the wander")] = 300.0
    ripple: Annotated[
        Pairs,
        PairsKey(
            ("order", 0.01, 1000.0),
            ("fraction", 0.0, 0.2),
            "ripple of the rate at orders of the drive angle, as a part of the rate",
        ),
    ] = ()
    wobble: Annotated[
        Pairs,
        PairsKey(
            ("order", 0.01, 100.0),
            ("arcsec", 0.0, 3600.0),
            "tilt of the shaft, turning with orders of the table angle",
        ),
    ] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class EncoderConfig:
    """The angle encoder and its null pulse."""

    lines: Annotated[int, Key(4, 2**31, "steps per turn")] = 7_200_000
    periodic_error: Annotated[
        Pairs,
        PairsKey(
            ("order", 0.01, 1000.0),
            ("arcsec", 0.0, 3600.0),
            "graduation error at orders of the table angle",
        ),
    ] = ()
    null_accuracy_arcsec: Annotated[float, Key(0.0, 600.0, "rms error of one null passage")] = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PlatformConfig:
    """How the triad sits on the table and where the table stands."""

    share_deviation: Annotated[
        Triple,
        Key(-0.05, 0.05, "of e_x, e_y, e_z from 1/sqrt(3); the three are scaled to unit length"),
    ] = (0.0, 0.0, 0.0)
    latitude_deg: Annotated[float, Key(-90.0, 90.0, "north positive")] = 28.2
    heading_deg: Annotated[float, Key(-360.0, 360.0, "of the null pulse, from north")] = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class GyroConfig:
    """The three gyros: one number for all of them, or a list for x, y, z."""

    mode: Annotated[
        GyroMode,
        ChoiceKey(
            ("ideal", "still", "dithered", "rate-biased"),
            "`ideal`: no lock-in; the others are a ring laser: at rest without dither, "
            "dithered, or held above lock-in by the table",
        ),
    ] = "ideal"
    arw_deg_per_sqrt_h: Annotated[
        Triple, Key(0.0, 10.0, "angle random walk N; of a ring laser its quantum limit")
    ] = (2.5e-5, 2.5e-5, 2.5e-5)
    quantization_step_arcsec: Annotated[
        Triple, Key(0.0, 3600.0, "readout step, 0 for none; Q is the step over sqrt(12)")
    ] = (0.001, 0.001, 0.001)
    bias_deg_per_h: Annotated[Triple, Key(-1e5, 1e5, "constant bias")] = (0.0, 0.0, 0.0)
    bias_instability_deg_per_h: Annotated[
        Triple, Key(0.0, 1e4, "bias instability B: flicker of the rate, below 25 Hz")
    ] = (0.0, 0.0, 0.0)
    rate_random_walk_deg_per_h_per_sqrt_h: Annotated[
        Triple, Key(0.0, 1e4, "rate random walk K")
    ] = (0.0, 0.0, 0.0)
    rate_ramp_deg_per_h_per_h: Annotated[Triple, Key(-1e4, 1e4, "rate ramp R")] = (0.0, 0.0, 0.0)
    temperature_coefficient_deg_per_h_per_k: Annotated[
        Triple, Key(-1e3, 1e3, "bias per kelvin of warming up")
    ] = (0.0, 0.0, 0.0)
    warm_up_k: Annotated[float, Key(-100.0, 100.0, "temperature rise after a long time")] = 0.0
    warm_up_time_s: Annotated[float, Key(1.0, 1e6, "time constant of the rise")] = 1800.0
    lock_in_deg_per_h: Annotated[Triple, Key(0.001, 1e5, "lock-in rate of the ring laser")] = (
        24.0,
        26.0,
        28.0,
    )
    fringe_arcsec: Annotated[float, Key(0.01, 100.0, "input angle per beat of the ring laser")] = (
        1.5
    )
    backscatter_diffusion_rad2_per_s: Annotated[
        float, Key(0.0, 1e6, "D of the backscatter phase, whose variance grows by 2 D t")
    ] = 150.0
    dither_frequency_hz: Annotated[float, Key(1.0, 1e4, "frequency of the dither")] = 400.0
    dither_rate_deg_per_s: Annotated[float, Key(0.1, 1e4, "peak rate of the dither")] = 100.0
    dither_amplitude_noise: Annotated[
        float, Key(0.0, 0.5, "rms of the peak rate from swing to swing, as a part of it")
    ] = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class DisturbanceConfig:
    """Periodic disturbances of the gyro angles, Eqs. 10 and 11.

    Each gyro takes between half and all of each amplitude, at a phase of its own.
    """

    angle: Annotated[
        Pairs,
        PairsKey(
            ("order", 0.01, 1000.0), ("arcsec", 0.0, 3600.0), "harmonics of the table angle, Eq. 10"
        ),
    ] = ()
    time: Annotated[
        Pairs,
        PairsKey(("frequency Hz", 1e-6, 1e5), ("arcsec", 0.0, 3600.0), "lines in time, Eq. 11"),
    ] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class RigConfig:
    """Everything the simulated recording is made from."""

    duration_s: Annotated[float, Key(0.01, 1e7, "length of the recording")] = 7200.0
    sample_rate_hz: Annotated[float, Key(0.1, 1e5, "samples per second")] = 500.0
    seed: Annotated[int, Key(0, 2**32 - 1, "of every random stream")] = 1
    table: TableConfig = TableConfig()
    encoder: EncoderConfig = EncoderConfig()
    platform: PlatformConfig = PlatformConfig()
    gyro: GyroConfig = GyroConfig()
    disturbances: DisturbanceConfig = DisturbanceConfig()

    def __post_init__(self) -> None:
        """Check every key, and those that depend on one another.

        Raises
        ------
        ValueError
            One line: the key, its value, and what is allowed.
        """
        _check_section(self, "")
        nyquist = self.sample_rate_hz / 2.0
        for frequency, _ in self.disturbances.time:
            if frequency > nyquist:
                raise ValueError(
                    f"disturbances.time: {frequency:g} Hz is above {nyquist:g} Hz, half of "
                    "sample_rate_hz; give the frequency it folds to"
                )
        times = [time for time, _ in self.table.profile]
        if any(later <= earlier for earlier, later in pairwise(times)):
            raise ValueError(f"table.profile: times {times} do not increase; sort them")
        if self.samples < 1:
            raise ValueError(
                f"duration_s {self.duration_s:g} holds no sample at {self.sample_rate_hz:g} Hz; "
                "make it longer"
            )
        turn_round = 2.0 * abs(self.table.rate_deg_per_s) / self.table.acceleration_deg_per_s2
        if 0.0 < self.table.reversal_interval_s <= turn_round and not self.table.profile:
            raise ValueError(
                f"table.reversal_interval_s {self.table.reversal_interval_s:g} leaves no time to "
                f"turn round in {turn_round:g} s; raise it or table.acceleration_deg_per_s2"
            )
        ripple = sum(fraction for _, fraction in self.table.ripple)
        if ripple >= 1.0:
            raise ValueError(
                f"table.ripple: fractions add up to {ripple:g}; keep them below 1 so that the "
                "table keeps its direction"
            )
        _check_ring_laser(self)

    @property
    def samples(self) -> int:
        """Samples in the recording."""
        return round(self.duration_s * self.sample_rate_hz)

    @property
    def turning(self) -> bool:
        """Whether the table is commanded to move at all."""
        if self.table.profile:
            return any(rate != 0.0 for _, rate in self.table.profile)
        return self.table.rate_deg_per_s != 0.0

    @classmethod
    def from_toml(cls, path: str | os.PathLike[str]) -> Self:
        """Read a configuration; ``preset = "paper"`` at the top names what it starts from.

        Raises
        ------
        ValueError
            One line with the file, the key, its value, and what is allowed.
        """
        try:
            with open(path, "rb") as file:
                return cls.from_mapping(tomllib.load(file))
        except FileNotFoundError:
            raise ValueError(f"{path}: no such file; give a TOML configuration") from None
        except OSError as error:
            raise ValueError(
                f"{path}: cannot be opened ({error.strerror}); give a TOML configuration"
            ) from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise ValueError(f"{path}: not TOML ({error}); correct it there") from None
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None

    @classmethod
    def from_mapping(cls, mapping: Mapping[str, Any]) -> Self:
        """Configuration from nested tables, as a TOML file holds them.

        Raises
        ------
        ValueError
            One line with the key, its value, and what is allowed.
        """
        values = dict(mapping)
        name = values.pop("preset", None)
        base = RigConfig() if name is None else preset(name)
        changed: Self = _overlay(base, values, "")
        return changed


def keys(section: type = RigConfig, prefix: str = "") -> dict[str, Key | PairsKey | ChoiceKey]:
    """Every configuration key by its dotted name, with what it may hold."""
    found: dict[str, Key | PairsKey | ChoiceKey] = {}
    for name, hint in get_type_hints(section, include_extras=True).items():
        if get_origin(hint) is Annotated:
            found[prefix + name] = get_args(hint)[1]
        else:
            found |= keys(hint, f"{prefix}{name}.")
    return found


def _overlay(base: Any, values: Mapping[str, Any], section: str) -> Any:
    known = [f.name for f in fields(base)]
    changes: dict[str, Any] = {}
    for key, value in values.items():
        name = f"{section}{key}"
        if key not in known:
            raise ValueError(f"unknown key {name!r}; known here: {', '.join(known)}")
        current = getattr(base, key)
        if is_dataclass(current):
            if not isinstance(value, Mapping):
                raise ValueError(f"{name} is {value!r}; it is a table, write [{name}]")
            changes[key] = _overlay(current, value, f"{name}.")
        elif isinstance(value, list):
            changes[key] = tuple(tuple(v) if isinstance(v, list) else v for v in value)
        elif _is_triple(current) and not isinstance(value, str):
            changes[key] = (value, value, value)
        else:
            changes[key] = value
    return replace(base, **changes)


def _is_triple(value: Any) -> bool:
    return isinstance(value, tuple) and len(value) == 3 and isinstance(value[0], float)


def _check_section(config: Any, section: str) -> None:
    for key, hint in get_type_hints(type(config), include_extras=True).items():
        name = f"{section}{key}"
        value = getattr(config, key)
        if get_origin(hint) is not Annotated:
            _check_section(value, f"{name}.")
            continue
        kind, rule = get_args(hint)
        if isinstance(rule, ChoiceKey):
            if value not in rule.choices:
                raise ValueError(f"{name} is {value!r}; use one of {', '.join(rule.choices)}")
        elif isinstance(rule, PairsKey):
            _check_pairs(name, value, rule)
        elif kind is Triple:
            if not isinstance(value, tuple) or len(value) != 3:
                raise ValueError(f"{name} is {value!r}; it must be a number or a list of three")
            for item in value:
                _check_number(name, item, rule.low, rule.high)
        else:
            if kind is int and not isinstance(value, int):
                raise ValueError(f"{name} is {value!r}; it must be a whole number")
            _check_number(name, value, rule.low, rule.high)


def _check_pairs(name: str, value: Any, rule: PairsKey) -> None:
    expected = f"it must be a list of pairs [{rule.first[0]}, {rule.second[0]}]"
    if not isinstance(value, tuple):
        raise ValueError(f"{name} is {value!r}; {expected}")
    for pair in value:
        if not isinstance(pair, tuple) or len(pair) != 2:
            raise ValueError(f"{name} holds {pair!r}; {expected}")
        for number, (what, low, high) in zip(pair, (rule.first, rule.second), strict=True):
            _check_number(f"{name} ({what})", number, low, high)


def _check_number(name: str, value: Any, low: float, high: float) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{name} is {value!r}; it must be a number from {low:g} to {high:g}")
    if not low <= value <= high:
        raise ValueError(f"{name} is {value!r}; it must lie from {low:g} to {high:g}")


def preset(name: str) -> RigConfig:
    """The configuration called `name`: ``quiet``, ``paper`` or ``harsh``.

    Raises
    ------
    ValueError
        If there is none of that name.
    """
    if name not in PRESETS:
        raise ValueError(f"preset {name!r} does not exist; use one of {', '.join(PRESETS)}")
    return PRESETS[name]


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseTruth:
    """Coefficients put in: of one gyro, or of a pair per gyro as Eq. 3 averages them.

    A pair's are means of squares; its ramp is the difference of the two over sqrt(2),
    since ramps are no random terms and cancel where they are equal.
    """

    quantization_arcsec: float
    arw_deg_per_sqrt_h: float
    bias_instability_deg_per_h: float
    rate_random_walk_deg_per_h_per_sqrt_h: float
    rate_ramp_deg_per_h_per_h: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LineTruth:
    """A periodic disturbance as put in.

    ``amplitude * cos(2 pi f t + phase)`` with t from the first sample, or
    ``amplitude * cos(order alpha + phase)``, for each gyro; the constant of Eqs. 10 and
    11 that makes it zero at the start is left out. `difference_amplitude_arcsec` is what
    is left in each difference of two.
    """

    scale: Literal["angle", "time"]
    order: float | None
    frequency_hz: float | None
    amplitude_arcsec: Mapping[str, float]
    phase_rad: Mapping[str, float]
    difference_amplitude_arcsec: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """What the recording was made from; ``dataclasses.asdict`` of it is the JSON."""

    schema: str
    seed: int
    samples: int
    sample_rate_hz: float
    table_rate_deg_per_s: float
    table_jitter_rms_deg_per_s: float
    shares: Mapping[str, float]
    earth_rate_b0_deg_per_h: Triple
    gyros: Mapping[str, NoiseTruth]
    pairs: Mapping[str, NoiseTruth]
    lines: tuple[LineTruth, ...]
    earth_rate_order_one: LineTruth | None
    config: Mapping[str, Any]


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


@dataclass(frozen=True, slots=True, kw_only=True)
class _Lines:
    """One scale's periodic disturbances: (lines,) positions, (3, lines) phasors in rad."""

    position: FloatArray
    phasor: NDArray[np.complex128]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Streams:
    """Independent random streams, one for each thing that draws."""

    jitter: np.random.Generator
    wander: np.random.Generator
    null: np.random.Generator
    phases: np.random.Generator
    disturbances: np.random.Generator
    white: tuple[np.random.Generator, ...]
    slow: tuple[np.random.Generator, ...]


def _streams(seed: int) -> _Streams:
    generators = [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(11)]
    return _Streams(
        jitter=generators[0],
        wander=generators[1],
        null=generators[2],
        phases=generators[3],
        disturbances=generators[4],
        white=tuple(generators[5:8]),
        slow=tuple(generators[8:11]),
    )


def _draw_lines(pairs: Pairs, random: np.random.Generator) -> _Lines:
    position = np.array([position for position, _ in pairs])
    amplitude = np.array([amplitude for _, amplitude in pairs]) * ARCSECOND
    shape = (len(GYRO_NAMES), len(pairs))
    amplitudes = amplitude * random.uniform(0.5, 1.0, shape)
    phases = random.uniform(-np.pi, np.pi, shape)
    order = np.argsort(position, kind="stable")
    return _Lines(position=position[order], phasor=(amplitudes * np.exp(1j * phases))[:, order])


@dataclass(frozen=True, slots=True, kw_only=True)
class _Command:
    """Commanded table motion: rate at knots, straight between, constant outside."""

    time: FloatArray
    rate: FloatArray
    angle: FloatArray

    def rate_at(self, time: FloatArray) -> FloatArray:
        return np.interp(time, self.time, self.rate)

    def angle_at(self, time: FloatArray) -> FloatArray:
        index = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, self.time.size - 1)
        since = time - self.time[index]
        rate = self.rate_at(time)
        # Mean of the rates at both ends of a straight piece; outside the knots they agree.
        return np.asarray(self.angle[index] + 0.5 * (self.rate[index] + rate) * since)


def _command(config: RigConfig) -> _Command:
    table = config.table
    if table.profile:
        knots = list(table.profile)
    else:
        knots = [(0.0, table.rate_deg_per_s)]
        interval = table.reversal_interval_s
        if interval > 0.0 and table.rate_deg_per_s != 0.0:
            half_ramp = abs(table.rate_deg_per_s) / table.acceleration_deg_per_s2
            sign = 1.0
            turn_round = interval
            while turn_round < config.duration_s:
                knots.append((turn_round - half_ramp, sign * table.rate_deg_per_s))
                sign = -sign
                knots.append((turn_round + half_ramp, sign * table.rate_deg_per_s))
                turn_round += interval
    time = np.array([time for time, _ in knots])
    rate = np.array([rate for _, rate in knots]) * DEGREE
    pieces = 0.5 * (rate[1:] + rate[:-1]) * np.diff(time)
    angle = np.concatenate([[0.0], np.cumsum(pieces)])
    command = _Command(time=time, rate=rate, angle=angle)
    start = table.start_deg * DEGREE - float(command.angle_at(np.zeros(1))[0])
    return replace(command, angle=angle + start)


def _ring_lasers(config: RigConfig) -> tuple[tuple[RingLaser, ...], Dither | None]:
    """The three lasers (none in mode ``ideal``) and their dither."""
    gyro = config.gyro
    if gyro.mode == "ideal":
        return (), None
    lasers = tuple(
        RingLaser(
            lock_in=gyro.lock_in_deg_per_h[g] * DEGREE_PER_HOUR,
            fringe=gyro.fringe_arcsec * ARCSECOND,
            quantum_noise=gyro.arw_deg_per_sqrt_h[g] * DEGREE_PER_ROOT_HOUR,
            backscatter_diffusion=gyro.backscatter_diffusion_rad2_per_s,
        )
        for g in range(len(GYRO_NAMES))
    )
    if gyro.mode != "dithered":
        return lasers, None
    return lasers, Dither(
        frequency=gyro.dither_frequency_hz,
        rate=gyro.dither_rate_deg_per_s * DEGREE,
        amplitude_noise=gyro.dither_amplitude_noise,
    )


def _sensed_rates(config: RigConfig) -> tuple[FloatArray, FloatArray]:
    """Least and greatest rate each gyro is commanded to sense, without sign, rad/s, (3,)."""
    shares = np.abs(shares_from_deviations(config.platform.share_deviation))
    rate = _command(config).rate
    reverses = bool(np.any(rate > 0.0) and np.any(rate < 0.0))
    slowest = 0.0 if reverses else float(np.abs(rate).min())
    return slowest * shares, float(np.abs(rate).max()) * shares


def _check_ring_laser(config: RigConfig) -> None:
    gyro = config.gyro
    if gyro.mode == "still" and config.turning:
        raise ValueError(
            "gyro.mode is 'still' on a turning table; set table.rate_deg_per_s = 0, or mode "
            "rate-biased or dithered"
        )
    slowest, fastest = _sensed_rates(config)
    if gyro.mode == "rate-biased":
        for g, name in enumerate(GYRO_NAMES):
            needed = _CLEAR_OF_LOCK_IN * gyro.lock_in_deg_per_h[g] * DEGREE_PER_HOUR
            if slowest[g] < needed:
                raise ValueError(
                    f"gyro.mode is 'rate-biased' but gyro {name} comes down to "
                    f"{slowest[g] / DEGREE:.3g} deg/s; the table must turn one way and give it "
                    f"{needed / DEGREE:.3g} deg/s, {_CLEAR_OF_LOCK_IN:g} times its lock-in"
                )
    lasers, dither = _ring_lasers(config)
    if dither is not None:
        for laser, rate in zip(lasers, fastest, strict=True):
            try:
                angle_random_walk(laser, 1.1 * rate, dither)
            except ValueError as error:
                raise ValueError(f"gyro.mode 'dithered': {error}") from None


def _jitter_step(config: RigConfig, step: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Exact transition, noise factor and starting spread of the servo's oscillator."""
    natural = 2.0 * math.pi * config.table.jitter_bandwidth_hz
    rms = config.table.jitter_rms_deg_per_s * DEGREE
    damping = config.table.jitter_damping
    stationary = np.diag([(rms / natural) ** 2, rms**2])
    slope = np.array([[0.0, 1.0], [-natural * natural, -2.0 * damping * natural]])
    transition = np.asarray(scipy.linalg.expm(slope * step))
    added = stationary - transition @ stationary @ transition.T
    return transition, np.linalg.cholesky(added), np.sqrt(np.diag(stationary))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Drift:
    """Slow rate of one gyro on a coarse grid: its processes and their state."""

    decay: FloatArray
    spread: FloatArray
    walk: float
    state: FloatArray
    random: np.random.Generator

    def advance(self, points: int) -> FloatArray:
        out = np.zeros(points)
        normals = self.random.standard_normal((points, self.decay.size + 1))
        _kernels.rig_markov(normals, self.decay, self.spread, self.walk, self.state, out)
        return out


def _drift(config: RigConfig, gyro: int, step: float, random: np.random.Generator) -> _Drift:
    """Flicker rate noise as a sum of Markov processes, rate random walk beside it.

    Processes of variance s^2 at correlation times a ratio r apart have the two-sided
    density s^2 / (2 f ln r); bias instability has B^2 / (2 pi f).
    """
    instability = config.gyro.bias_instability_deg_per_h[gyro] * DEGREE_PER_HOUR
    walk = config.gyro.rate_random_walk_deg_per_h_per_sqrt_h[gyro] * DEGREE_PER_HOUR_PER_ROOT_HOUR
    count = 0
    if instability > 0.0:
        longest = max(_LONGEST_CORRELATION * config.duration_s, 10.0 * step)
        count = 1 + math.ceil(math.log(longest / step) / math.log(_MARKOV_RATIO))
    correlation = step * _MARKOV_RATIO ** np.arange(count)
    deviation = instability * math.sqrt(math.log(_MARKOV_RATIO) / math.pi)
    decay = np.exp(-step / correlation)
    state = np.zeros(count + 1)
    state[:count] = deviation * random.standard_normal(count)
    return _Drift(
        decay=decay,
        spread=deviation * np.sqrt(1.0 - decay**2),
        walk=walk * math.sqrt(step),
        state=state,
        random=random,
    )


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
    streams = _streams(config.seed)
    table = config.table
    encoder = config.encoder
    gyro = config.gyro
    interval = 1.0 / config.sample_rate_hz
    command = _command(config)
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
    angle_lines, time_lines = _disturbances(config, streams.disturbances)
    offset = -angle_lines.phasor.real.sum(axis=1) - time_lines.phasor.real.sum(axis=1)

    # Jitter and wander start in their stationary state, one sample before the first.
    position_jitter = jittery and table.jitter_spectrum == "position"
    rate_jitter = jittery and table.jitter_spectrum == "rate"
    jitter_state = np.zeros(3)
    if position_jitter:
        transition, jitter_factor, spread = _jitter_step(config, step)
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
    drifts = [_drift(config, g, grid * interval, streams.slow[g]) for g in range(3)]
    held = np.zeros(3)
    walks = np.zeros((3, 1))
    last_true = np.zeros(3)
    lasers, dither = _ring_lasers(config)

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


def _disturbances(config: RigConfig, random: np.random.Generator) -> tuple[_Lines, _Lines]:
    angle = _draw_lines(config.disturbances.angle, random)
    return angle, _draw_lines(config.disturbances.time, random)


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


def truth_of(config: RigConfig) -> Truth:
    """What a recording of this configuration is made from, without making it."""
    gyro = config.gyro
    shares = shares_from_deviations(config.platform.share_deviation)
    earth = earth_rate(config.platform.latitude_deg * DEGREE, config.platform.heading_deg * DEGREE)
    command = _command(config)
    mean_rate_of_table = float(
        (command.angle_at(np.array([config.duration_s])) - command.angle_at(np.zeros(1)))[0]
        / config.duration_s
    )
    noise = _angle_random_walk(config, mean_rate_of_table)
    gyros = {
        name: NoiseTruth(
            quantization_arcsec=gyro.quantization_step_arcsec[g] / math.sqrt(12.0),
            arw_deg_per_sqrt_h=noise[g],
            bias_instability_deg_per_h=gyro.bias_instability_deg_per_h[g],
            rate_random_walk_deg_per_h_per_sqrt_h=gyro.rate_random_walk_deg_per_h_per_sqrt_h[g],
            rate_ramp_deg_per_h_per_h=gyro.rate_ramp_deg_per_h_per_h[g],
        )
        for g, name in enumerate(GYRO_NAMES)
    }
    angle_lines, time_lines = _disturbances(config, _streams(config.seed).disturbances)
    lines = [
        _line_truth("angle", float(position), angle_lines.phasor[:, j])
        for j, position in enumerate(angle_lines.position)
    ] + [
        _line_truth("time", float(position), time_lines.phasor[:, j])
        for j, position in enumerate(time_lines.position)
    ]
    order_one = None
    if command.rate.size == 1 and command.rate[0] != 0.0:
        # k1 sin(alpha) - k2 cos(alpha) of Eq. 6, over the rate, as one phasor.
        matrix = table_to_gyro_matrix(*shares)
        k1 = matrix[:, 0] * earth[0] + matrix[:, 1] * earth[1]
        k2 = matrix[:, 0] * earth[1] - matrix[:, 1] * earth[0]
        order_one = _line_truth("angle", 1.0, (-k2 - 1j * k1) / command.rate[0])
    return Truth(
        schema=TRUTH_SCHEMA,
        seed=config.seed,
        samples=config.samples,
        sample_rate_hz=config.sample_rate_hz,
        table_rate_deg_per_s=mean_rate_of_table / DEGREE,
        table_jitter_rms_deg_per_s=config.table.jitter_rms_deg_per_s,
        shares=dict(zip(GYRO_NAMES, shares.tolist(), strict=True)),
        earth_rate_b0_deg_per_h=tuple((earth / DEGREE_PER_HOUR).tolist()),
        gyros=gyros,
        pairs={f"{a}-{b}": _pair_truth(gyros[a], gyros[b]) for a, b in _PAIRS},
        lines=tuple(lines),
        earth_rate_order_one=order_one,
        config=asdict(config),
    )


def _angle_random_walk(config: RigConfig, table_rate: float) -> list[float]:
    """N of each gyro at the mean of what it senses, deg/sqrt(h)."""
    lasers, dither = _ring_lasers(config)
    if not lasers:
        return list(config.gyro.arw_deg_per_sqrt_h)
    platform = config.platform
    matrix = table_to_gyro_matrix(*shares_from_deviations(platform.share_deviation))
    earth = earth_rate(platform.latitude_deg * DEGREE, platform.heading_deg * DEGREE)
    # On a turning table the Earth's horizontal part averages out.
    still = matrix @ earth
    turning = matrix[:, 2] * (table_rate + earth[2])
    sensed = turning if config.turning else still
    return [
        float(angle_random_walk(laser, rate, dither)) / DEGREE_PER_ROOT_HOUR
        for laser, rate in zip(lasers, sensed, strict=True)
    ]


def _pair_truth(first: NoiseTruth, second: NoiseTruth) -> NoiseTruth:
    mean_square = {
        f.name: math.sqrt((getattr(first, f.name) ** 2 + getattr(second, f.name) ** 2) / 2.0)
        for f in fields(NoiseTruth)
    }
    mean_square["rate_ramp_deg_per_h_per_h"] = abs(
        first.rate_ramp_deg_per_h_per_h - second.rate_ramp_deg_per_h_per_h
    ) / math.sqrt(2.0)
    return NoiseTruth(**mean_square)


def _line_truth(
    scale: Literal["angle", "time"], position: float, phasor: NDArray[np.complex128]
) -> LineTruth:
    arcsec = dict(zip(GYRO_NAMES, phasor / ARCSECOND, strict=True))
    return LineTruth(
        scale=scale,
        order=position if scale == "angle" else None,
        frequency_hz=position if scale == "time" else None,
        amplitude_arcsec={name: float(abs(value)) for name, value in arcsec.items()},
        phase_rad={name: float(np.angle(value)) for name, value in arcsec.items()},
        difference_amplitude_arcsec={
            f"{a}-{b}": float(abs(arcsec[a] - arcsec[b])) for a, b in _PAIRS
        },
    )


_PAPER = RigConfig(
    table=TableConfig(
        jitter_rms_deg_per_s=0.004,
        ripple=((12.0, 5e-4), (36.0, 2e-4)),
    ),
    encoder=EncoderConfig(periodic_error=((1.0, 1.0),)),
    platform=PlatformConfig(share_deviation=(0.001, 0.0, -0.001)),
    disturbances=DisturbanceConfig(
        angle=(
            (1.0, 0.6),
            (2.0, 0.45),
            (3.0, 0.3),
            (4.0, 0.25),
            (5.0, 0.2),
            (6.0, 0.15),
            (8.0, 0.12),
            (9.0, 0.1),
            (12.0, 0.08),
            (18.0, 0.06),
            (24.0, 0.04),
            (36.0, 0.03),
        ),
        time=((0.0137, 0.08), (1.37, 0.05), (7.3, 0.03), (50.0, 0.02), (100.0, 0.01)),
    ),
)
PRESETS: Final[Mapping[str, RigConfig]] = {
    "quiet": RigConfig(
        platform=PlatformConfig(share_deviation=(0.0005, 0.0, -0.0005)),
        table=TableConfig(jitter_rms_deg_per_s=0.001),
    ),
    "paper": _PAPER,
    "harsh": replace(
        _PAPER,
        table=TableConfig(
            jitter_rms_deg_per_s=0.02,
            wander_fraction=0.02,
            ripple=((1.0, 2e-4), (12.0, 2e-3), (36.0, 1e-3)),
            wobble=((1.0, 2.0), (2.0, 1.0)),
            reversal_interval_s=1200.0,
        ),
        encoder=EncoderConfig(periodic_error=((1.0, 2.0), (2.0, 1.0), (4.0, 0.5))),
        platform=PlatformConfig(share_deviation=(0.002, -0.0005, -0.0015)),
        gyro=GyroConfig(
            bias_instability_deg_per_h=(2e-4, 2e-4, 2e-4),
            rate_random_walk_deg_per_h_per_sqrt_h=(2e-4, 2e-4, 2e-4),
            temperature_coefficient_deg_per_h_per_k=(1e-4, 1.5e-4, 0.5e-4),
            warm_up_k=5.0,
        ),
    ),
}
