"""Periodic components as a fit holds them: cosine and sine over a phase.

Range and speeds of a table stand here, computed once because the line search needs them repeatedly.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac.core.arrays import BooleanArray, ComplexArray, FloatArray, every, extent
from sagnac.spectrum.sums import angle_series, tones
from sagnac.table.turns import mean_rate

# ---- components --------------------------------------------------------------------

MOST_ORDERS: Final = 128
"""Highest whole order that counts as the table's own and goes by Fourier sums.

A higher one is a line in time until the table's unsteadiness shows otherwise.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Components:
    """Periodic components: ``cosine * cos(c) + sine * sin(c)`` of a phase c.

    The phase is ``order * alpha`` on the angle scale and
    ``2 pi * frequency * (n - center)`` on the time scale, n the sample number: with its
    origin at mid-record a frequency and its phase are uncorrelated.

    Attributes
    ----------
    orders
        (angle components,) ascending.
    free
        (angle components,) bool; whether the order is fitted too.
    frequencies
        (time components,) cycles per sample.
    center
        Sample number of the phase origin in time.
    cosine, sine
        (components,) amplitudes in rad; angle components first.

    Raises
    ------
    ValueError
        If the sizes do not agree.
    """

    orders: FloatArray
    free: BooleanArray
    frequencies: FloatArray
    center: float
    cosine: FloatArray
    sine: FloatArray

    def __post_init__(self) -> None:
        if self.free.shape != self.orders.shape:
            raise ValueError(
                f"free has shape {self.free.shape} and orders {self.orders.shape}; give one of "
                "each an angle component"
            )
        if not self.cosine.shape == self.sine.shape == (self.size,):
            raise ValueError(
                f"cosine and sine have shapes {self.cosine.shape} and {self.sine.shape}; "
                f"{self.size} components have one of each"
            )

    @property
    def size(self) -> int:
        """Number of components."""
        return self.orders.size + self.frequencies.size

    @property
    def amplitude(self) -> FloatArray:
        """(components,) rad."""
        return np.asarray(np.hypot(self.cosine, self.sine))

    def select(self, keep: BooleanArray) -> "Components":
        """The components where `keep`, (components,) bool, is true."""
        angle = keep[: self.orders.size]
        return replace(
            self,
            orders=self.orders[angle],
            free=self.free[angle],
            frequencies=self.frequencies[keep[self.orders.size :]],
            cosine=self.cosine[keep],
            sine=self.sine[keep],
        )


def no_components(samples: int) -> Components:
    """No components, for a record of `samples` angles."""
    empty = np.empty(0)
    return Components(
        orders=empty,
        free=np.empty(0, dtype=bool),
        frequencies=empty,
        center=0.5 * (samples - 1),
        cosine=empty,
        sine=empty,
    )


def joined(first: Components, second: Components) -> Components:
    """Both sets as one, orders ascending."""
    orders = np.concatenate([first.orders, second.orders])
    ascending = np.argsort(orders, kind="stable")

    def both(a: FloatArray, b: FloatArray) -> FloatArray:
        angle = np.concatenate([a[: first.orders.size], b[: second.orders.size]])[ascending]
        return np.concatenate([angle, a[first.orders.size :], b[second.orders.size :]])

    return replace(
        first,
        orders=orders[ascending],
        free=np.concatenate([first.free, second.free])[ascending],
        frequencies=np.concatenate([first.frequencies, second.frequencies]),
        cosine=both(first.cosine, second.cosine),
        sine=both(first.sine, second.sine),
    )


def removed(
    angle: FloatArray, table: FloatArray | None, components: Components, *, start: int = 0
) -> FloatArray:
    """An angle without the components; a copy.

    Parameters
    ----------
    angle
        (samples,) rad.
    table
        (samples,) table angle, rad; None if there are no orders.
    components
        What to take away.
    start
        Place of the first sample in the record.

    Raises
    ------
    ValueError
        If there are orders and no table.
    """
    rest = angle.copy()
    angles = components.orders.size
    if angles and table is None:
        raise ValueError(f"{angles} orders of table angle, and table is None; give the table angle")
    if angles and table is not None:
        multiples = phase_multiples(components)
        if multiples.any():
            chosen = np.flatnonzero(multiples)
            orders = components.orders[chosen].astype(np.int64)
            sums = np.zeros(int(orders[-1]) + 1, dtype=np.complex128)
            np.add.at(sums, orders, components.cosine[chosen] - 1j * components.sine[chosen])
            rest -= angle_series(table, sums)
        for index in np.flatnonzero(~multiples):
            phase = components.orders[index] * table
            rest -= components.cosine[index] * np.cos(phase)
            rest -= components.sine[index] * np.sin(phase)
    if components.frequencies.size:
        rest -= tones(
            start,
            rest.size,
            components.center,
            components.frequencies,
            cosine=components.cosine[angles:],
            sine=components.sine[angles:],
        )
    return rest


def phase_multiples(components: Components) -> BooleanArray:
    """(angle components,) bool: whole orders that go by Fourier sums."""
    orders = components.orders
    return np.asarray(~components.free & (orders == np.rint(orders)) & (orders <= MOST_ORDERS))


# ---- turning -----------------------------------------------------------------------

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
    low, high = extent(table)
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
    speed = np.sort(np.abs(every(table[span:], apart) - every(table[:-span], apart))) / span
    return speed[np.linspace(0, speed.size - 1, min(_RANKS, speed.size)).astype(np.int64)]


def mean_square_step(orders: FloatArray, speed: FloatArray) -> FloatArray:
    """(orders,) mean square increment of exp(i k alpha) at the table's speeds, rad a sample."""
    return np.asarray((4.0 * np.sin(np.outer(orders, speed) / 2.0) ** 2).mean(axis=1))


# ---- mixing ------------------------------------------------------------------------

MIX_BLOCK: Final = 50
"""Samples in each mean of `mixed_down`."""


def mixed_down(
    values: FloatArray, frequencies: FloatArray, center: float, length: int = MIX_BLOCK
) -> ComplexArray:
    """Means over blocks of ``values * exp(-2j pi frequency (n - center))``.

    Parameters
    ----------
    values
        (samples,) in any unit.
    frequencies
        (frequencies,) cycles per sample.
    center
        Sample number at which the phase is zero.
    length
        Samples in each mean.

    Returns
    -------
    (samples // `length`, frequencies) in the unit of the values.
    """
    blocks = values.size // length
    waves = np.exp(-2j * np.pi * np.outer(np.arange(length), frequencies)) / length
    means = values[: blocks * length].reshape(blocks, length) @ waves.view(np.float64)
    turns = np.outer(np.arange(blocks) * length - center, frequencies)
    return np.asarray(means.view(np.complex128) * np.exp(-2j * np.pi * (turns % 1.0)))
