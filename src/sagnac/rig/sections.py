"""Sections of the rig's configuration: what each key holds, its range and its meaning."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal, get_args, get_origin, get_type_hints

Triple = tuple[float, float, float]
Pairs = tuple[tuple[float, float], ...]
Progress = Callable[[float], None]
GyroMode = Literal["ideal", "still", "dithered", "rate-biased"]
GYRO_NAMES: Final = ("x", "y", "z")


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


def is_triple(value: Any) -> bool:
    """Whether a value is one number for each gyro."""
    return isinstance(value, tuple) and len(value) == 3 and isinstance(value[0], float)


def check_section(config: Any, section: str) -> None:
    """Refuse a section with a value out of its range."""
    for key, hint in get_type_hints(type(config), include_extras=True).items():
        name = f"{section}{key}"
        value = getattr(config, key)
        if get_origin(hint) is not Annotated:
            check_section(value, f"{name}.")
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
