"""Periodic components as a fit holds them: a complex amplitude over a phase."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sagnac.core.arrays import BooleanArray, ComplexArray, FloatArray, blocks
from sagnac.core.errors import require_shape
from sagnac.lines.sampling import MIX_BLOCK, MOST_ORDERS
from sagnac.spectrum import sums
from sagnac.table.kinematics import harmonic_sum


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
    phasor
        (components,) ``cosine + 1j * sine`` in rad; angle components first.

    Raises
    ------
    ValueError
        If the sizes do not agree.
    """

    orders: FloatArray
    free: BooleanArray
    frequencies: FloatArray
    center: float
    phasor: ComplexArray

    def __post_init__(self) -> None:
        require_shape("free", self.free.shape, self.orders.shape)
        require_shape("phasor", self.phasor.shape, (self.size,))

    @property
    def size(self) -> int:
        """Number of components."""
        return self.orders.size + self.frequencies.size

    @property
    def amplitude(self) -> FloatArray:
        """(components,) rad."""
        return np.abs(self.phasor)

    @property
    def multiples(self) -> BooleanArray:
        """(angle components,) bool: whole orders that go by Fourier sums."""
        whole = (self.orders == np.rint(self.orders)) & (self.orders <= MOST_ORDERS)
        return np.asarray(~self.free & whole)

    def select(self, keep: BooleanArray) -> "Components":
        """The components where `keep`, (components,) bool, is true."""
        angle, time = np.split(keep, [self.orders.size])
        orders, free, frequencies = self.orders[angle], self.free[angle], self.frequencies[time]
        phasor = self.phasor[keep]
        return replace(self, orders=orders, free=free, frequencies=frequencies, phasor=phasor)


def components_of(
    samples: int,
    *,
    orders: FloatArray | None = None,
    free: BooleanArray | None = None,
    frequencies: FloatArray | None = None,
    phasor: ComplexArray | None = None,
) -> Components:
    """Components for a record of `samples` angles; none of what is not given, no order free."""
    orders = np.empty(0) if orders is None else orders
    free = np.zeros(orders.size, dtype=bool) if free is None else free
    tones = np.empty(0) if frequencies is None else frequencies
    phasor = np.empty(0, dtype=np.complex128) if phasor is None else phasor
    center = 0.5 * (samples - 1)
    return Components(orders=orders, free=free, frequencies=tones, center=center, phasor=phasor)


def joined(first: Components, second: Components) -> Components:
    """Both sets as one, orders ascending."""
    orders = np.concatenate([first.orders, second.orders])
    ascending = np.argsort(orders, kind="stable")
    parts = [np.split(one.phasor, [one.orders.size]) for one in (first, second)]
    in_angle, in_time = (np.concatenate(both) for both in zip(*parts, strict=True))
    free = np.concatenate([first.free, second.free])[ascending]
    tones = np.concatenate([first.frequencies, second.frequencies])
    phasor = np.concatenate([in_angle[ascending], in_time])
    return replace(first, orders=orders[ascending], free=free, frequencies=tones, phasor=phasor)


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
    """
    rest = angle.copy()
    orders = components.orders
    in_angle, in_time = np.split(components.phasor, [orders.size])
    if table is not None and orders.size:
        rest -= harmonic_sum(table, orders, in_angle)
    if in_time.size:
        rest -= sums.tones(start, rest.size, components.center, components.frequencies, in_time)
    return rest


def mixed_down(
    values: FloatArray,
    frequencies: FloatArray,
    center: float,
    length: int = MIX_BLOCK,
    taken: Callable[[int, int], FloatArray] | None = None,
) -> ComplexArray:
    """Means over some samples at a time of ``values * exp(-2j pi frequency (n - center))``.

    Parameters
    ----------
    values
        (samples,) in any unit, in memory or mapped.
    frequencies
        (frequencies,) cycles per sample.
    center
        Sample number at which the phase is zero.
    length
        Samples in each mean.
    taken
        Gives a series whose increments are taken away first, for a first sample and a number of
        samples.

    Returns
    -------
    (samples // `length`, frequencies) in the unit of the values.
    """
    waves = np.exp(-2j * np.pi * np.outer(np.arange(length), frequencies)) / length
    means = []
    for block in blocks(values.size, multiple=length):
        rest = values[block]
        if taken is not None:
            rest = rest - np.diff(taken(block.start, rest.size + 1))
        rows = rest.size // length
        mixed = rest[: rows * length].reshape(rows, length) @ waves.view(np.float64)
        turns = np.outer(block.start + np.arange(rows) * length - center, frequencies)
        means.append(mixed.view(np.complex128) * np.exp(-2j * np.pi * (turns % 1.0)))
    return np.concatenate(means)
