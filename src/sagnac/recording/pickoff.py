"""The pick-off of a dither, recorded beside the gyro that is dithered."""

from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.recording.channel import same_values

PICKOFF: Final = "pickoff_"
"""First letters of a pick-off's column; the name of the gyro follows."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pickoff:
    """The dither of one gyro as its pick-off shows it.

    Attributes
    ----------
    gyro
        Name of the gyro that is dithered.
    values
        (samples,) in any unit, proportional to the angle of the dither and sampled with the gyro.

    Raises
    ------
    ValueError
        If the values are no series of float64.
    """

    gyro: str
    values: FloatArray

    def __post_init__(self) -> None:
        values = self.values
        if not isinstance(values, np.ndarray) or values.dtype != np.float64 or values.ndim != 1:
            raise ValueError(f"pick-off of gyro {self.gyro}: give a series of float64")

    @property
    def column(self) -> str:
        """Name of its column in a file."""
        return PICKOFF + self.gyro

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Pickoff):
            return NotImplemented
        return self.gyro == other.gyro and same_values(self.values, other.values)

    # Equal pick-offs may be changed in place, sample by sample.
    __hash__: ClassVar[None] = None  # type: ignore[assignment]
