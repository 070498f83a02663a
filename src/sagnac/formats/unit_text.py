"""Units as people and files write them, counts among them: ``0.1arcsec``, ``counts``."""

from dataclasses import dataclass
from typing import Final

from sagnac.units import (
    ACCELERATION_UNITS,
    ANGLE_UNITS,
    RATE_UNITS,
    TIME_UNITS,
    VELOCITY_UNITS,
    split_factor,
)

KNOWN_UNITS: Final = (
    f"use one of {', '.join((*ANGLE_UNITS, *RATE_UNITS))} or counts; of accelerometers "
    f"{', '.join((*ACCELERATION_UNITS, *VELOCITY_UNITS))}"
)

_COUNTS: Final = frozenset(
    {"count", "counts", "lsb", "pulse", "pulses", "digit", "digits", "tick", "ticks", "zähler"}
)


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitText:
    """A unit with the number before it.

    Attributes
    ----------
    factor
        The number, 1 where none is written.
    name
        Of the unit, as this package writes it; one that is not known stays as it is.
    """

    factor: float
    name: str

    @property
    def is_plain(self) -> bool:
        """Whether no number stands before the unit."""
        return self.factor == 1.0

    @property
    def is_counts(self) -> bool:
        """Whether the unit is one count, its size not stated."""
        return self.name.lower() in _COUNTS

    @property
    def is_angle(self) -> bool:
        """Whether it is a positive number of units of angle."""
        return self.factor > 0.0 and self.name in ANGLE_UNITS

    @property
    def is_known(self) -> bool:
        """Whether it is a unit of a gyro, an accelerometer or time, or one count."""
        if self.is_counts:
            return self.is_plain
        return self.factor > 0.0 and (self.name in TIME_UNITS or self.is_sensed)

    @property
    def is_sensed(self) -> bool:
        """Whether it is a unit that a gyro or an accelerometer is read in."""
        tables = (ANGLE_UNITS, RATE_UNITS, VELOCITY_UNITS, ACCELERATION_UNITS)
        return any(self.name in table for table in tables)


def parsed_unit(text: str) -> UnitText:
    """`text` taken apart.

    Examples
    --------
    >>> parsed_unit("0.1arcsec")
    UnitText(factor=0.1, name='arcsec')
    """
    factor, name = split_factor(text)
    return UnitText(factor=factor, name=name)
