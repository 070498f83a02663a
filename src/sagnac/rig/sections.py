"""Sections of the rig's configuration: what each key holds, its range and its meaning.

A key is a field of a frozen dataclass. Its annotation is the rule that its value keeps, and the
docstring says what it means; the documentation quotes both::

    rate_deg_per_s: Annotated[float, Number(-400.0, 400.0)] = 40.0

A key holds one of a few words, a number (whole if it is an ``int``), three numbers, of x, y and z,
for which a single one may stand, or a list of pairs, each half of which has its own bounds.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from difflib import get_close_matches
from functools import cache
from typing import Annotated, Any, Final, Literal, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import ArrayLike

from sagnac.core import errors, units
from sagnac.core.arrays import FloatArray
from sagnac.recording.columns import ACCELEROMETER_NAMES, GYRO_NAMES
from sagnac.table.frames import earth_rate, shares_from_deviations, table_to_gyro_matrix

# ---- validation --------------------------------------------------------------------

Triple = tuple[float, float, float]
Pairs = tuple[tuple[float, float], ...]


class ConfigurationError(errors.RecordingError):
    """A key holds what it must not: the key and its value (`problem`), what to do (`remedy`)."""


class Number(NamedTuple):
    """Bounds of a number; in a pair it has a name and a unit."""

    low: float
    high: float
    name: str = ""


def allowed(rule: Any) -> str:
    """Values that a key with this annotation may hold, in words."""
    if get_origin(rule) is Literal:
        return ", ".join(f'`"{choice}"`' for choice in get_args(rule))
    form, *bounds = get_args(rule)
    shown = "" if form is int else "g"
    ranges = [f"{one.low:{shown}} to {one.high:{shown}}" for one in bounds]
    if form != Pairs:
        return ranges[0]
    halves = (f"{one.name} {span}" for one, span in zip(bounds, ranges, strict=True))
    return f"list of [{', '.join(halves)}]"


@cache
def rules_of(section: type, prefix: str = "") -> dict[str, Any]:
    """Annotation of each key of a section, and of the sections in it, by the key's dotted name."""
    rules: dict[str, Any] = {}
    for name, hint in get_type_hints(section, include_extras=True).items():
        if isinstance(hint, type) and is_dataclass(hint):
            rules |= rules_of(hint, f"{prefix}{name}.")
        else:
            rules[prefix + name] = hint
    return rules


def check(section: Any, prefix: str = "") -> None:
    """Check each key of a section in its ``__post_init__``, and store lists as tuples.

    `prefix` begins the keys' dotted names. Sections within the section check themselves.

    Raises
    ------
    ConfigurationError
        If a key holds what its rule does not allow.
    """
    rules = rules_of(section.__class__)
    for field in fields(section):
        value, name = getattr(section, field.name), prefix + field.name
        if field.name in rules:
            object.__setattr__(section, field.name, _checked(rules[field.name], name, value))
        else:
            problem = f"{name} is {errors.quoted(value)}"
            require(is_dataclass(value), problem, f"it is a table, write [{name}]")


def overlaid(base: Any, values: Mapping[str, Any], prefix: str = "") -> Any:
    """`base` with what nested tables state instead; `ConfigurationError` as by `check`."""
    known = [field.name for field in fields(base)]
    changes: dict[str, Any] = {}
    for key, value in values.items():
        near = [*get_close_matches(key, known), *(name for name in known if key in name)]
        meant = f"did you mean {prefix}{near[0]}? " if near else ""
        remedy = f"{meant}known here: {', '.join(known)}"
        require(key in known, f"unknown key {prefix + key!r}", remedy)
        section = isinstance(value, Mapping) and is_dataclass(getattr(base, key))
        changes[key] = overlaid(getattr(base, key), value, f"{key}.") if section else value
    return replace(base, **changes)


def _checked(rule: Any, name: str, value: Any) -> Any:
    problem, several = f"{name} is {errors.quoted(value)}", isinstance(value, list | tuple)
    if get_origin(rule) is Literal:
        require(value in get_args(rule), problem, f"use one of {', '.join(get_args(rule))}")
        return value
    form, *bounds = get_args(rule)
    each = [Annotated[float, one] for one in bounds]
    if form == Pairs:
        expected = f"it must be a list of pairs [{', '.join(one.name for one in bounds)}]"
        require(several, problem, expected)
        for pair in value:
            whole = isinstance(pair, list | tuple) and len(pair) == len(bounds)
            require(whole, f"{name} holds {errors.quoted(pair)}", expected)
        names = [f"{name} ({one.name})" for one in bounds]
        return tuple(tuple(map(_checked, each, names, pair)) for pair in value)
    is_number = isinstance(value, int | float)
    if form == Triple:
        three = value if several else (value,) * 3
        whole = (several or is_number) and len(three) == 3
        require(whole, problem, "it must be a number or a list of three")
        return tuple(_checked(each[0], name, one) for one in three)
    require(form is float or isinstance(value, int), problem, "it must be a whole number")
    is_number = is_number and not isinstance(value, bool)
    require(is_number, problem, f"it must be a number from {allowed(rule)}")
    require(bounds[0].low <= value <= bounds[0].high, problem, f"it must lie from {allowed(rule)}")
    return value


def require(true: bool, problem: str, remedy: str) -> None:
    """Raise `ConfigurationError` unless something is true."""
    if not true:
        raise ConfigurationError(problem, remedy=remedy)


# ---- sections ----------------------------------------------------------------------

GyroMode = Literal["ideal", "still", "dithered", "rate-biased"]
Accelerometers = Literal["none", "triad"]
SENSOR_NAMES: Final = {"gyro": GYRO_NAMES, "accelerometer": ACCELEROMETER_NAMES}
_ORDER: Final = Number(0.01, 1000.0, "order")
LONGEST_DELAY_S: Final = 2.0
_NONE: Final = (0.0, 0.0, 0.0)
_ARCSECONDS: Final = Number(0.0, 3600.0, "arcsec")


class Section:
    """A table of the configuration, which checks its keys when it is made (see `check`)."""

    __slots__ = ()

    def __post_init__(self) -> None:
        check(self, f"{self.__class__.__name__.removesuffix('Config').lower()}.")


@dataclass(frozen=True, slots=True, kw_only=True)
class TableConfig(Section):
    """The turntable: commanded motion and what its servo and bearing add.

    Attributes
    ----------
    rate_deg_per_s
        commanded rate; the sign is the direction
    start_deg
        commanded table angle at the first sample, from the null
    reversal_interval_s
        time between reversals or dwells, 0 for none
    dwell_s
        time for which the table stands at each
    after_dwell
        whether the table then turns back, or onward as it did before
    acceleration_deg_per_s2
        acceleration of a reversal, and at a dwell
    profile
        commanded rate at given times, straight between; replaces rate and reversals
    jitter_rms_deg_per_s
        rms rate jitter of the servo
    jitter_bandwidth_hz
        natural frequency of the jitter
    jitter_damping
        damping ratio of the servo, with `position`
    jitter_spectrum
        `position`: the servo holds the angle; `rate`: it holds the rate and the angle walks
    wander_fraction
        rms slow wander of the rate, as a part of it
    wander_time_s
        correlation time of the wander
    hunting_rms_deg_per_s
        rms rate of a servo that hunts about one frequency
    hunting_hz
        that frequency
    hunting_quality
        that frequency over the width of the hunting's band
    ripple
        ripple of the rate at orders of the drive angle, as a part of the rate
    wobble
        tilt of the shaft, turning with orders of the table angle

    Raises
    ------
    ConfigurationError
        If a key holds what it must not, here and in every section.
    """

    rate_deg_per_s: Annotated[float, Number(-400.0, 400.0)] = 40.0
    start_deg: Annotated[float, Number(-360.0, 360.0)] = 0.0
    reversal_interval_s: Annotated[float, Number(0.0, 1e6)] = 0.0
    dwell_s: Annotated[float, Number(0.0, 1e6)] = 0.0
    after_dwell: Literal["back", "onward"] = "back"
    acceleration_deg_per_s2: Annotated[float, Number(0.1, 1e4)] = 100.0
    profile: Annotated[Pairs, Number(0.0, 1e7, "time s"), Number(-400.0, 400.0, "rate deg/s")] = ()
    jitter_rms_deg_per_s: Annotated[float, Number(0.0, 10.0)] = 0.0
    jitter_bandwidth_hz: Annotated[float, Number(0.01, 1000.0)] = 8.0
    jitter_damping: Annotated[float, Number(0.01, 10.0)] = 0.5
    jitter_spectrum: Literal["position", "rate"] = "position"
    wander_fraction: Annotated[float, Number(0.0, 0.2)] = 0.0
    wander_time_s: Annotated[float, Number(1.0, 1e6)] = 300.0
    hunting_rms_deg_per_s: Annotated[float, Number(0.0, 10.0)] = 0.0
    hunting_hz: Annotated[float, Number(0.1, 100.0)] = 3.0
    hunting_quality: Annotated[float, Number(0.5, 1000.0)] = 10.0
    ripple: Annotated[Pairs, _ORDER, Number(0.0, 0.2, "fraction")] = ()
    wobble: Annotated[Pairs, Number(0.01, 100.0, "order"), _ARCSECONDS] = ()

    @property
    def turning(self) -> bool:
        """Whether the table is commanded to move at all."""
        if self.profile:
            return any(rate != 0.0 for _, rate in self.profile)
        return self.rate_deg_per_s != 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class EncoderConfig(Section):
    """The angle encoder and its null pulse.

    Attributes
    ----------
    lines
        steps per turn
    periodic_error
        graduation error at orders of the table angle
    null_accuracy_arcsec
        rms error of one null passage
    latch_jitter_s
        rms time between the encoder's sample and the gyros'
    latency_s
        time by which a reading is late at the start
    latency_drift_s
        what the latency has gained at the end; with clock_ppm it keeps to the same limits
    latency_walk_s
        rms of a random walk of the latency after half an hour
    clock_ppm
        by which its clock runs fast, so that readings fall behind
    reading_rate_hz
        readings a second, each held to the next; 0 for one a sample
    lost_fraction
        part of the readings that repeat the one before
    missing_null_fraction
        part of the null pulses that are missing
    """

    lines: Annotated[int, Number(4, 2**31)] = 7_200_000
    periodic_error: Annotated[Pairs, _ORDER, _ARCSECONDS] = ()
    null_accuracy_arcsec: Annotated[float, Number(0.0, 600.0)] = 2.0
    latch_jitter_s: Annotated[float, Number(0.0, 0.01)] = 0.0
    latency_s: Annotated[float, Number(0.0, LONGEST_DELAY_S)] = 0.0
    latency_drift_s: Annotated[float, Number(-LONGEST_DELAY_S, LONGEST_DELAY_S)] = 0.0
    latency_walk_s: Annotated[float, Number(0.0, 1e-3)] = 0.0
    clock_ppm: Annotated[float, Number(-1000.0, 1000.0)] = 0.0
    reading_rate_hz: Annotated[float, Number(0.0, 1e5)] = 0.0
    lost_fraction: Annotated[float, Number(0.0, 0.9)] = 0.0
    missing_null_fraction: Annotated[float, Number(0.0, 1.0)] = 0.0

    def delay_at(self, time: ArrayLike, duration: float) -> FloatArray:
        """Delay of the readings by latency, drift and clock at `time` of a recording, s.

        Reading k of a clock that runs fast by a part c is taken at k/(1 + c) readings' time, so
        that it is late by t c/(1 + c) at t.
        """
        fast = 1e-6 * self.clock_ppm
        growth = self.latency_drift_s / duration + fast / (1.0 + fast)
        return self.latency_s + growth * np.asarray(time, dtype=np.float64)

    def delay_walk(self, time: float) -> float:
        """Rms that the walk of the delay gains in `time`, both in s."""
        # The walk of the delay has the rms that is stated after half an hour.
        return self.latency_walk_s * math.sqrt(time / 1800.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionConfig(Section):
    """Random motion that gyros do not share, while the table turns (`sagnac.rig.own_motion`).

    Attributes
    ----------
    resonance_rms_arcsec
        rms angle by which each gyro's mount shakes about the input axis
    resonance_hz
        resonance of each mount
    resonance_quality
        resonance of a mount over its width
    nutation_rms_arcsec
        rms random tilt of the shaft about each level axis
    nutation_hz
        frequency of that tilting, to a quarter of sample_rate_hz
    nutation_quality
        that frequency over the width of its band
    """

    resonance_rms_arcsec: Annotated[Triple, Number(0.0, 3600.0)] = _NONE
    resonance_hz: Annotated[Triple, Number(0.1, 1e4)] = (17.0, 17.0, 17.0)
    resonance_quality: Annotated[float, Number(0.5, 1000.0)] = 20.0
    nutation_rms_arcsec: Annotated[float, Number(0.0, 60.0)] = 0.0
    nutation_hz: Annotated[float, Number(0.1, 1e4)] = 10.0
    nutation_quality: Annotated[float, Number(0.5, 1000.0)] = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PlatformConfig(Section):
    """How the triad sits on the table and where the table stands.

    Attributes
    ----------
    share_deviation
        of e_x, e_y, e_z from 1/sqrt(3); the three are scaled to unit length
    latitude_deg
        north positive
    heading_deg
        of the null pulse, from north
    """

    share_deviation: Annotated[Triple, Number(-0.05, 0.05)] = _NONE
    latitude_deg: Annotated[float, Number(-90.0, 90.0)] = 28.2
    heading_deg: Annotated[float, Number(-360.0, 360.0)] = 0.0

    @property
    def shares(self) -> FloatArray:
        """(3,) shares of the table's rate that the gyros sense."""
        return shares_from_deviations(self.share_deviation)

    @property
    def matrix(self) -> FloatArray:
        """(3, 3) input axes of the gyros in b, C_b^s."""
        return table_to_gyro_matrix(*self.shares)

    @property
    def earth(self) -> FloatArray:
        """(3,) Earth rate in b0, rad/s."""
        return earth_rate(self.latitude_deg * units.DEGREE, self.heading_deg * units.DEGREE)


@dataclass(frozen=True, slots=True, kw_only=True)
class GyroConfig(Section):
    """The three gyros: one number for all of them, or a list for x, y, z.

    Attributes
    ----------
    mode
        `ideal`: no lock-in; the others are a ring laser: at rest without dither, dithered, or held
        above lock-in by the table
    arw_deg_per_sqrt_h
        angle random walk N; of a ring laser its quantum limit
    quantization_step_arcsec
        readout step, 0 for none; Q is the step over sqrt(12)
    angle_noise_arcsec
        white noise of the sampled angle: Q without a readout step
    rate_step_deg_per_h
        readout step of the mean rate of a sample, 0 for none; adds step/sqrt(12 sample_rate) to N
        as a root of squares
    range_deg_per_h
        largest rate that is shown, 0 for any
    bias_deg_per_h
        constant bias
    bias_instability_deg_per_h
        bias instability B: flicker of the rate
    rate_random_walk_deg_per_h_per_sqrt_h
        rate random walk K
    markov_deviation_deg_per_h
        standard deviation of a first-order Markov rate
    markov_time_s
        its correlation time
    second_markov_deviation_deg_per_h
        standard deviation of a second one
    second_markov_time_s
        its correlation time
    rate_ramp_deg_per_h_per_h
        rate ramp R
    temperature_coefficient_deg_per_h_per_k
        bias per kelvin of warming up
    warm_up_k
        temperature rise after a long time
    warm_up_time_s
        time constant of the rise
    lock_in_deg_per_h
        lock-in rate of the ring laser
    fringe_arcsec
        input angle per beat of the ring laser
    backscatter_diffusion_rad2_per_s
        D of the backscatter phase, whose variance grows by 2 D t; assumed
    dither_frequency_hz
        frequency of the dither
    dither_rate_deg_per_s
        peak rate of the dither
    dither_amplitude_noise
        rms of the random part of the peak rate, as a part of it; it lasts `dither.ring_down_s`
    low_pass_hz
        corner (-3 dB) of the sensor's own low-pass, 0 for none
    low_pass_order
        of that low-pass, a Butterworth filter
    """

    mode: GyroMode = "ideal"
    arw_deg_per_sqrt_h: Annotated[Triple, Number(0.0, 10.0)] = (2.5e-5, 2.5e-5, 2.5e-5)
    quantization_step_arcsec: Annotated[Triple, Number(0.0, 3600.0)] = (0.001, 0.001, 0.001)
    angle_noise_arcsec: Annotated[Triple, Number(0.0, 3600.0)] = _NONE
    rate_step_deg_per_h: Annotated[Triple, Number(0.0, 1e7)] = _NONE
    range_deg_per_h: Annotated[Triple, Number(0.0, 1e9)] = _NONE
    bias_deg_per_h: Annotated[Triple, Number(-1e5, 1e5)] = _NONE
    bias_instability_deg_per_h: Annotated[Triple, Number(0.0, 1e4)] = _NONE
    rate_random_walk_deg_per_h_per_sqrt_h: Annotated[Triple, Number(0.0, 1e4)] = _NONE
    markov_deviation_deg_per_h: Annotated[Triple, Number(0.0, 1e5)] = _NONE
    markov_time_s: Annotated[Triple, Number(1e-4, 1e6)] = (100.0, 100.0, 100.0)
    second_markov_deviation_deg_per_h: Annotated[Triple, Number(0.0, 1e5)] = _NONE
    second_markov_time_s: Annotated[Triple, Number(1e-4, 1e6)] = (100.0, 100.0, 100.0)
    rate_ramp_deg_per_h_per_h: Annotated[Triple, Number(-1e4, 1e4)] = _NONE
    temperature_coefficient_deg_per_h_per_k: Annotated[Triple, Number(-1e3, 1e3)] = _NONE
    warm_up_k: Annotated[float, Number(-100.0, 100.0)] = 0.0
    warm_up_time_s: Annotated[float, Number(1.0, 1e6)] = 1800.0
    lock_in_deg_per_h: Annotated[Triple, Number(0.001, 1e5)] = (24.0, 26.0, 28.0)
    fringe_arcsec: Annotated[float, Number(0.01, 100.0)] = 1.5
    backscatter_diffusion_rad2_per_s: Annotated[float, Number(0.0, 1e6)] = 150.0
    dither_frequency_hz: Annotated[float, Number(1.0, 1e4)] = 400.0
    dither_rate_deg_per_s: Annotated[float, Number(0.1, 1e4)] = 100.0
    dither_amplitude_noise: Annotated[float, Number(0.0, 0.5)] = 0.02
    low_pass_hz: Annotated[Triple, Number(0.0, 1e5)] = _NONE
    low_pass_order: Annotated[int, Number(1, 2)] = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class AccelerometerConfig(Section):
    """Three accelerometers along the axes of the gyros, with gravity: one number, or three.

    Attributes
    ----------
    mode
        whether there are ax, ay and az
    vrw_m_per_s_per_sqrt_h
        velocity random walk N
    velocity_noise_mm_per_s
        white noise of the sampled velocity: Q without a readout step
    quantization_step_mm_per_s
        readout step, 0 for none
    acceleration_step_mg
        readout step of the mean acceleration of a sample, 0 for none
    range_mg
        largest acceleration that is shown, 0 for any
    bias_mg
        constant bias
    bias_instability_mg
        bias instability B
    acceleration_random_walk_mg_per_sqrt_h
        acceleration random walk K
    markov_deviation_mg
        standard deviation of a first-order Markov acceleration
    markov_time_s
        its correlation time
    second_markov_deviation_mg
        standard deviation of a second one
    second_markov_time_s
        its correlation time
    acceleration_ramp_mg_per_h
        acceleration ramp R
    low_pass_hz
        corner (-3 dB) of the sensor's own low-pass, 0 for none
    low_pass_order
        of that low-pass, a Butterworth filter
    """

    mode: Accelerometers = "none"
    vrw_m_per_s_per_sqrt_h: Annotated[Triple, Number(0.0, 100.0)] = _NONE
    velocity_noise_mm_per_s: Annotated[Triple, Number(0.0, 1e4)] = _NONE
    quantization_step_mm_per_s: Annotated[Triple, Number(0.0, 1e4)] = _NONE
    acceleration_step_mg: Annotated[Triple, Number(0.0, 1e6)] = _NONE
    range_mg: Annotated[Triple, Number(0.0, 1e9)] = _NONE
    bias_mg: Annotated[Triple, Number(-1e3, 1e3)] = _NONE
    bias_instability_mg: Annotated[Triple, Number(0.0, 1e3)] = _NONE
    acceleration_random_walk_mg_per_sqrt_h: Annotated[Triple, Number(0.0, 1e3)] = _NONE
    markov_deviation_mg: Annotated[Triple, Number(0.0, 1e3)] = _NONE
    markov_time_s: Annotated[Triple, Number(1e-4, 1e6)] = (100.0, 100.0, 100.0)
    second_markov_deviation_mg: Annotated[Triple, Number(0.0, 1e3)] = _NONE
    second_markov_time_s: Annotated[Triple, Number(1e-4, 1e6)] = (100.0, 100.0, 100.0)
    acceleration_ramp_mg_per_h: Annotated[Triple, Number(-1e3, 1e3)] = _NONE
    low_pass_hz: Annotated[Triple, Number(0.0, 1e5)] = _NONE
    low_pass_order: Annotated[int, Number(1, 2)] = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class DitherConfig(Section):
    """Dither left in the angles of a dithered gyro, and how its pick-off shows it.

    Its frequency, rate and randomisation stand in `GyroConfig`. With nothing left there is no
    pick-off in the recording either.

    Attributes
    ----------
    residue
        part of the dither that the gyro's own stripping leaves
    delay_s
        time by which the gyro's own stripping is late
    detuning_hz
        of each gyro's dither from gyro.dither_frequency_hz
    ring_down_s
        correlation time of the dither's random amplitude and phase
    pickoff_noise_arcsec
        rms noise of a pick-off from sample to sample
    """

    residue: Annotated[Triple, Number(0.0, 1.0)] = _NONE
    delay_s: Annotated[Triple, Number(-1e-3, 1e-3)] = _NONE
    detuning_hz: Annotated[Triple, Number(-100.0, 100.0)] = (-12.7, 0.0, 11.3)
    ring_down_s: Annotated[float, Number(0.01, 1e4)] = 0.5
    pickoff_noise_arcsec: Annotated[float, Number(0.0, 3600.0)] = 0.01

    @property
    def is_left(self) -> bool:
        """Whether any gyro has dither in its angle."""
        return any(self.residue) or any(self.delay_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class DisturbancesConfig(Section):
    """Periodic disturbances of the gyro angles, Eqs. 10 and 11.

    Each gyro takes between half and all of each amplitude, at a phase of its own.

    Attributes
    ----------
    angle
        harmonics of the table angle, Eq. 10
    time
        lines in time, Eq. 11
    """

    angle: Annotated[Pairs, _ORDER, _ARCSECONDS] = ()
    time: Annotated[Pairs, Number(1e-6, 1e5, "frequency Hz"), _ARCSECONDS] = ()


# ---- keys of a sensor ----------------------------------------------------------------

# Error, the coefficient whose unit it has, its key of a gyro and of an accelerometer.
SENSOR_KEYS: Final = (
    ("random_walk", "angle_random_walk", "arw_deg_per_sqrt_h", "vrw_m_per_s_per_sqrt_h"),
    ("angle_noise", "quantization", "angle_noise_arcsec", "velocity_noise_mm_per_s"),
    ("quantum", "quantization", "quantization_step_arcsec", "quantization_step_mm_per_s"),
    ("instability", "bias_instability", "bias_instability_deg_per_h", "bias_instability_mg"),
    ("rate_walk", "rate_random_walk", "rate_random_walk_deg_per_h_per_sqrt_h",
     "acceleration_random_walk_mg_per_sqrt_h"),
    ("markov_deviation", "bias_instability", "markov_deviation_deg_per_h", "markov_deviation_mg"),
    ("second_markov_deviation", "bias_instability", "second_markov_deviation_deg_per_h",
     "second_markov_deviation_mg"),
    ("bias", "bias_instability", "bias_deg_per_h", "bias_mg"),
    ("rate_quantum", "bias_instability", "rate_step_deg_per_h", "acceleration_step_mg"),
    ("full_scale", "bias_instability", "range_deg_per_h", "range_mg"),
    ("ramp", "rate_ramp", "rate_ramp_deg_per_h_per_h", "acceleration_ramp_mg_per_h"),
)  # fmt: skip
