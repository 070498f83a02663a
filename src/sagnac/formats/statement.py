"""What a caller, a TOML beside the file, or the file itself states about its columns.

All three speak one vocabulary, that of `Statement`; `sagnac.formats.assemble` decides
which of them is heard.
"""

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Final, cast, get_args

from sagnac.errors import RecordingError
from sagnac.recording.model import Kind
from sagnac.units import ANGLE_UNITS, RATE_UNITS, canonical

KINDS: Final[tuple[Kind, ...]] = get_args(Kind)
COUNTER_BITS: Final = (16, 24, 32)

_COUNTS: Final = frozenset({"count", "counts", "lsb", "pulse", "pulses"})
_FACTOR: Final = re.compile(r"\s*(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)\s*(\S.*)$")
_HEADER: Final = re.compile(r"\s*(.*?)\s*\[([^\[\]]*)\]\s*$")


@dataclass(frozen=True, slots=True, kw_only=True)
class Statement:
    """What is known about a recording from outside its numbers. Nothing has a default.

    Attributes
    ----------
    gyros
        Names of the gyros wanted, or None for all that are there.
    kind
        ``angle``, ``increment`` or ``rate``; one for all gyros, or by gyro name.
    unit
        Unit of the gyros, or unit by name (``table`` and ``time`` may stand there too).
        ``counts`` asks for `scale`; ``0.1arcsec`` states both at once.
    scale
        Size of one count: ``0.1arcsec``.
    sample_rate
        Samples per second. Where there are time stamps they rule, and this has to agree.
    time
        ``COLUMN`` or ``COLUMN:UNIT`` of the time stamps; ``none`` ignores those there are.
    table
        ``COLUMN`` or ``COLUMN:UNIT`` of the table angle; ``none`` ignores the one there is.
    columns
        Name wanted -> name in the file.
    span
        Start and stop to take, s from the first sample; either may be None.
    counter_bits
        Width of gyro counters that roll over (kind ``angle``): 16, 24 or 32.
    null_pulse
        Column that is nonzero at the null pulse.

    Raises
    ------
    ValueError
        If a value cannot be; the message names the option.
    """

    gyros: tuple[str, ...] | None = None
    kind: str | Mapping[str, str] | None = None
    unit: str | Mapping[str, str] | None = None
    scale: str | None = None
    sample_rate: float | None = None
    time: str | None = None
    table: str | None = None
    columns: Mapping[str, str] = field(default_factory=dict)
    span: tuple[float | None, float | None] | None = None
    counter_bits: int | None = None
    null_pulse: str | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot be, before any file is touched."""
        for kind in _values(self.kind):
            if kind not in KINDS:
                raise ValueError(f"kind {kind!r} is none of {', '.join(KINDS)} (--kind)")
        for unit in _values(self.unit):
            if not is_unit(unit):
                raise ValueError(f"unit {unit!r} is not known; {_known_units()} (--unit)")
        if self.scale is not None and (
            not is_unit(self.scale) or canonical(self.scale).lower() in _COUNTS
        ):
            raise ValueError(
                f"scale {self.scale!r} is not a size of one count such as 0.1arcsec (--scale)"
            )
        if self.sample_rate is not None and not (
            math.isfinite(self.sample_rate) and self.sample_rate > 0.0
        ):
            raise ValueError(f"sample rate {self.sample_rate!r} is not a positive Hz (--rate)")
        if self.counter_bits is not None and self.counter_bits not in COUNTER_BITS:
            raise ValueError(
                f"counter width {self.counter_bits!r} is none of 16, 24, 32 (--counter-bits)"
            )
        if self.gyros is not None and (
            not self.gyros or len(set(self.gyros)) < len(self.gyros) or "" in self.gyros
        ):
            raise ValueError(f"gyros {self.gyros!r} must be one or more different names (--gyros)")
        if self.span is not None:
            start, stop = self.span
            for limit in (start, stop):
                if limit is not None and not (math.isfinite(limit) and limit >= 0.0):
                    raise ValueError(f"slice limit {limit!r} is not a time in s (--slice)")
            if stop is not None and stop <= (start or 0.0):
                raise ValueError(
                    f"slice {start or 0.0:g}:{stop:g} is empty; START must be below STOP (--slice)"
                )


def _values(stated: str | Mapping[str, str] | None) -> tuple[str, ...]:
    if stated is None:
        return ()
    return (stated,) if isinstance(stated, str) else tuple(stated.values())


def _known_units() -> str:
    return f"use one of {', '.join((*ANGLE_UNITS, *RATE_UNITS))} or counts"


def of_name(stated: str | Mapping[str, str] | None, name: str) -> str | None:
    """What a statement says for gyro `name`: its own entry, or the one for all."""
    if stated is None or isinstance(stated, str):
        return stated
    return stated.get(name)


def split_factor(unit: str) -> tuple[float, str]:
    """``0.1arcsec`` -> (0.1, ``arcsec``); without a number the factor is 1."""
    match = _FACTOR.match(unit)
    if match is None:
        return 1.0, canonical(unit)
    return float(match.group(1)), canonical(match.group(2))


def is_counts(unit: str) -> bool:
    """Whether `unit` says counts without saying their size."""
    return canonical(unit).lower() in _COUNTS


def is_unit(unit: str) -> bool:
    """Whether `unit` is one of angle, rate or counts, with or without a factor."""
    factor, name = split_factor(unit)
    if name.lower() in _COUNTS:
        return factor == 1.0
    return factor > 0.0 and (
        name in ANGLE_UNITS or name in RATE_UNITS or name in ("s", "ms", "us", "ns", "min", "h")
    )


def split_header(header: str) -> tuple[str, str | None]:
    """``x[arcsec]`` -> (``x``, ``arcsec``); without brackets the unit is None."""
    match = _HEADER.match(header)
    if match is None or not match.group(1):
        return header.strip(), None
    return match.group(1), match.group(2).strip() or None


def beside(path: Path) -> tuple[Statement, tuple[str, ...]]:
    """The statement in ``FILE.toml`` (``run.csv.toml``, else ``run.toml``) and its notes.

    ``run.toml`` may be something else altogether, the simulation that made the file for
    one: it counts only where all its keys are those of a statement, and is noted where not.

    Raises
    ------
    RecordingError
        If the TOML cannot be read or states what cannot be.
    """
    for candidate in (path.with_name(path.name + ".toml"), path.with_suffix(".toml")):
        if candidate == path or not candidate.is_file():
            continue
        try:
            content = tomllib.loads(candidate.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            why = " ".join(str(error).split())
            raise RecordingError(f"{candidate}: not TOML: {why}; correct or remove it") from None
        unknown = sorted(set(content) - _vocabulary())
        if unknown and candidate.name != path.name + ".toml":
            return Statement(), (
                f"{candidate.name} is not about this file ({unknown[0]}): ignored",
            )
        return from_mapping(content, str(candidate)), ()
    return Statement(), ()


def _vocabulary() -> set[str]:
    return {item.name for item in fields(Statement)} - {"span"}


def from_mapping(content: Mapping[str, Any], source: str) -> Statement:
    """A statement from TOML keys or file attributes.

    Text stands for lists and mappings where attributes are flat: ``x,z`` and
    ``x=arcsec,table=deg``.

    Raises
    ------
    RecordingError
        If a key is not of the vocabulary or a value cannot be; the message names `source`.
    """
    unknown = sorted(set(content) - _vocabulary())
    if unknown:
        known = ", ".join(sorted(_vocabulary()))
        raise RecordingError(f"{source}: {unknown[0]!r} is not known; use {known}")
    values: dict[str, Any] = dict(content)
    try:
        for key in ("kind", "unit", "columns"):
            if isinstance(values.get(key), str) and "=" in values[key]:
                values[key] = dict(
                    [part.strip() for part in item.split("=", 1)] for item in values[key].split(",")
                )
        if isinstance(values.get("gyros"), str):
            values["gyros"] = [name.strip() for name in values["gyros"].split(",")]
        if "gyros" in values:
            values["gyros"] = tuple(values["gyros"])
        if "sample_rate" in values:
            values["sample_rate"] = float(values["sample_rate"])
        for key in ("time", "table", "null_pulse", "scale"):
            if key in values and not isinstance(values[key], str):
                raise TypeError(f"{key} {values[key]!r} is not text")
        if "counter_bits" in values:
            values["counter_bits"] = int(values["counter_bits"])
        return Statement(**values)
    except (TypeError, ValueError) as error:
        why = " ".join(str(error).split())
        raise RecordingError(f"{source}: {why}; correct it there or state the option") from None


def as_kind(text: str) -> Kind:
    """`text`, which a `Statement` has checked, as a `Kind`."""
    return cast(Kind, text)
