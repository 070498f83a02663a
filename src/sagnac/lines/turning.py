"""Range and speeds of a table, computed once because the line search needs them repeatedly."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.table.turns import mean_rate

# Samples over which a table speed is taken.
_SPEED_SPAN: Final = 32
# Ranks kept at most, and samples at which speeds are measured, about.
_RANKS: Final = 200
_SPEEDS: Final = 4000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Turning:
    """Range and speeds of a table angle, taken from it once.

    Attributes
    ----------
    table
        (samples,) table angle, rad.
    sample_rate
        Hz.
    low, high
        Ends of the table's range, rad.
    mean_rate
        Mean speed, rad/s, signed by the net direction where there is one.
    speeds
        (ranks,) speeds at evenly spaced ranks, ascending, rad a sample.
    """

    table: FloatArray
    sample_rate: float
    low: float
    high: float
    mean_rate: float
    speeds: FloatArray

    @property
    def turns(self) -> float:
        """Turns between the lowest and the highest table angle."""
        return (self.high - self.low) / (2.0 * np.pi)

    @property
    def fastest(self) -> float:
        """Highest speed, rad a sample."""
        return float(self.speeds[-1])


def turning(table: FloatArray, sample_rate: float) -> Turning:
    """`Turning` of a table angle, (samples,) rad, at a sample rate in Hz."""
    low, high = series.extent(table)
    return Turning(
        table=table,
        sample_rate=sample_rate,
        low=low,
        high=high,
        mean_rate=mean_rate(table, sample_rate),
        speeds=speeds(table),
    )


def speeds(table: FloatArray) -> FloatArray:
    """Speeds of a table angle, rad a sample, at up to 200 evenly spaced ranks, ascending."""
    apart = max(1, table.size // _SPEEDS)
    # Short, since a long span would average out a swing of the table.
    span = min(apart, _SPEED_SPAN)
    places = np.arange(0, table.size - span, apart)
    speed = np.sort(np.abs(series.at(table, places + span) - series.at(table, places))) / span
    return speed[np.linspace(0, speed.size - 1, min(_RANKS, speed.size)).astype(np.int64)]


def mean_square_step(orders: FloatArray, speed: FloatArray) -> FloatArray:
    """(orders,) mean square increment of exp(i k alpha) at the table's speeds, rad a sample."""
    return np.asarray((4.0 * np.sin(np.outer(orders, speed) / 2.0) ** 2).mean(axis=1))
