"""The simulated rig as a user configures it."""

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import pairwise
from typing import Annotated, Any, Final, Self, get_args, get_origin, get_type_hints

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.rig.gyro import ring_lasers_of
from sagnac.rig.ring_laser import angle_random_walk
from sagnac.rig.sections import (
    GYRO_NAMES,
    ChoiceKey,
    DisturbanceConfig,
    EncoderConfig,
    GyroConfig,
    Key,
    PairsKey,
    PlatformConfig,
    TableConfig,
    check_section,
    is_triple,
)
from sagnac.rig.table import table_command
from sagnac.table.frames import shares_from_deviations
from sagnac.units import DEGREE, DEGREE_PER_HOUR

_CLEAR_OF_LOCK_IN = 10.0  # lock-in rates that the bias must exceed, so that jitter never locks


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
        check_section(self, "")
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
        elif is_triple(current) and not isinstance(value, str):
            changes[key] = (value, value, value)
        else:
            changes[key] = value
    return replace(base, **changes)


def _sensed_rates(config: RigConfig) -> tuple[FloatArray, FloatArray]:
    """Least and greatest rate each gyro is commanded to sense, without sign, rad/s, (3,)."""
    shares = np.abs(shares_from_deviations(config.platform.share_deviation))
    rate = table_command(config).rate
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
    lasers, dither = ring_lasers_of(config)
    if dither is not None:
        for laser, rate in zip(lasers, fastest, strict=True):
            try:
                angle_random_walk(laser, 1.1 * rate, dither)
            except ValueError as error:
                raise ValueError(f"gyro.mode 'dithered': {error}") from None


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
