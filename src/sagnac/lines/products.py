"""Inner products of components without a pass over the samples."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac.core.arrays import ComplexArray, FloatArray, IntegerArray
from sagnac.lines import _kernels
from sagnac.lines.components import Components
from sagnac.lines.sampling import Sampling

# Two components whose frequencies come no closer than this, in Hz times seconds of record or
# cycles over the whole range, are orthogonal to within a third of a per cent.
_APART: Final = 100.0
# An order that comes that close to a tone on less than this share of the record does not count.
_LEAST_MEETING: Final = 1e-2
# If there are fewer pairs times blocks than this, all count: leaving some out would gain nothing.
_FEW: Final = 2_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class InnerProducts:
    """Sums of the products of increments of phasors and of their derivatives.

    Attributes
    ----------
    straight
        (2 components, 2 components) of every one with the conjugate of every other: phasors
        first, then derivatives.
    mirrored
        The same of every one with the other itself.
    """

    straight: ComplexArray
    mirrored: ComplexArray


def inner_products(sampled: Sampling, components: Components) -> InnerProducts:
    """Inner products of all components and their derivatives over a record."""
    size = components.size
    straight = np.zeros((2 * size, 2 * size), dtype=np.complex128)
    mirrored = np.zeros((2 * size, 2 * size), dtype=np.complex128)
    multiples = np.flatnonzero(components.multiples)
    orders = components.orders[multiples].astype(np.int64)
    # What mirrors a component is the conjugate of one whose phase runs backwards.
    for products, way in ((straight, 1), (mirrored, -1)):
        if orders.size:
            own = _products_of_orders(sampled, orders, way * orders)
            products[np.ix_(multiples, multiples)] = own
        _add_tones(products, components.frequencies, way, sampled.samples)
    if components.orders.size:
        _add_pairs(straight, mirrored, sampled, components)
    return InnerProducts(straight=straight, mirrored=mirrored)


def _products_of_orders(
    sampled: Sampling, orders: IntegerArray, others: IntegerArray
) -> ComplexArray:
    """Products of whole orders with the conjugates of others, by the Fourier sums of all."""
    expansion, all_sums = sampled.order_products
    difference = orders[:, np.newaxis] - others
    apart, total = np.abs(difference), np.abs(orders[:, np.newaxis] + others)
    sums = all_sums[:, apart]
    sums = np.where(difference < 0, sums.conj(), sums)
    return np.asarray(2.0 * ((expansion[:, apart] - expansion[:, total]) * sums).sum(axis=0))


def _add_tones(products: ComplexArray, frequencies: FloatArray, way: int, samples: int) -> None:
    """Products of two tones, the second run forwards or backwards (`way`), in closed form."""
    size, slope = tone_factors(frequencies, samples)
    a, b = size[:, np.newaxis], way * size
    c, d = slope[:, np.newaxis], slope
    total = products.shape[0] // 2
    plain = slice(total - frequencies.size, total)
    tilted = slice(2 * total - frequencies.size, 2 * total)
    apart = frequencies[:, np.newaxis] - way * frequencies
    zero, one, two = _moments(2.0 * np.pi * apart, samples)
    products[plain, plain] = a * b * zero
    products[tilted, plain] = a * b * one - 1j * c * b * zero
    products[plain, tilted] = a * b * one + 1j * a * d * zero
    products[tilted, tilted] = a * b * two + c * d * zero + 1j * (a * d - b * c) * one


def _moments(frequency: FloatArray, samples: int) -> tuple[FloatArray, ComplexArray, FloatArray]:
    """Sums over the steps of lag^r exp(1j w x), r = 0, 1, 2, for angular frequencies `w`.

    The first is ``D(w) = sin(M w / 2) / sin(w / 2)`` with M steps, the others its
    derivatives; lag is 2 pi x / samples.
    """
    steps = samples - 1
    turn = 2.0 * np.pi / samples
    # One period: D repeats at 2 pi except for its sign, which changes if the steps are even.
    whole = np.rint(frequency / (2.0 * np.pi))
    w = frequency - 2.0 * np.pi * whole
    sign = np.where((whole % 2 != 0) & (steps % 2 == 0), -1.0, 1.0)
    near = np.abs(w) * steps < 1e-2
    safe = np.where(near, 1.0, w)
    half_sine, half_cosine = np.sin(0.5 * safe), np.cos(0.5 * safe)
    tangent = half_cosine / half_sine
    sine, cosine = np.sin(0.5 * steps * safe), np.cos(0.5 * steps * safe)
    zero = sine / half_sine
    first = 0.5 * (steps * cosine / half_sine - tangent * zero)
    second = 0.25 * (
        -(steps**2) * zero
        - 2.0 * steps * cosine * tangent / half_sine
        + zero * (1.0 + 2.0 * tangent**2)
    )
    # At the middle: sums of even powers of x, in a Taylor series.
    squares = steps * (steps**2 - 1.0) / 12.0
    fourths = steps * (steps**2 - 1.0) * (3.0 * steps**2 - 7.0) / 240.0
    zero = np.where(near, steps - 0.5 * squares * w**2, zero)
    first = np.where(near, -squares * w + fourths * w**3 / 6.0, first)
    second = np.where(near, -squares + 0.5 * fourths * w**2, second)
    return sign * zero, -1j * turn * sign * first, -(turn**2) * sign * second


def _add_pairs(
    straight: ComplexArray, mirrored: ComplexArray, sampled: Sampling, components: Components
) -> None:
    """Products in which an order meets a tone, or an order that is not whole meets any other."""
    first, second = _meeting(sampled, components)
    if first.size == 0:
        return
    size = components.size
    plus, minus = _kernels.paired_sums(
        # Radians of phase for one of table angle, or for one sample.
        np.concatenate([components.orders, 2.0 * np.pi * components.frequencies]),
        np.arange(size) < components.orders.size,
        first,
        second,
        *sampled.blocks,
        *sampled.phase_range,
        2.0 * np.pi / sampled.samples,
    )
    for kind, (rows, columns) in enumerate(((0, 0), (1, 0), (0, 1), (1, 1))):
        here, there = first + rows * size, second + columns * size
        straight[here, there] = plus[:, kind]
        straight[there, here] = plus[:, kind].conj()
        mirrored[here, there] = mirrored[there, here] = minus[:, kind]


def _meeting(sampled: Sampling, components: Components) -> tuple[IntegerArray, IntegerArray]:
    """Pairs of components, each once, whose products are not negligible or known already.

    An order that Fourier sums do not cover meets every order near it; any order meets every tone
    whose frequency the table makes of it long enough.
    """
    orders, loose = components.orders, ~components.multiples
    possible = (np.count_nonzero(loose) + components.frequencies.size) * orders.size
    everything = possible * sampled.blocks.length.size <= _FEW
    turns = sampled.phase_range[1] / (2.0 * np.pi)
    apart = np.minimum(np.abs(orders[:, np.newaxis] - orders), orders[:, np.newaxis] + orders)
    near = loose[:, np.newaxis] & (everything | (apart * turns < _APART))
    # Of two loose ones the first meets the second.
    near &= ~(np.tril(np.ones(near.shape, dtype=bool), -1) & loose)
    steps = np.sort(sampled.blocks.step)
    reach, rates = 2.0 * np.pi * _APART / sampled.samples, 2.0 * np.pi * components.frequencies
    share = np.zeros((orders.size, rates.size))
    # The table may turn either way.
    for sign in (1.0, -1.0):
        low = np.searchsorted(steps, (sign * rates - reach) / orders[:, np.newaxis])
        high = np.searchsorted(steps, (sign * rates + reach) / orders[:, np.newaxis])
        share += (high - low) / steps.size
    first, second = np.nonzero(np.hstack([near, everything | (share > _LEAST_MEETING)]))
    return first, second


def pairs_summed(sampled: Sampling, components: Components) -> float:
    """Passes over all samples that `inner_products` takes: one for each pair that meets."""
    if components.orders.size == 0:
        return 0.0
    return _meeting(sampled, components)[0].size * sampled.blocks.length.size / sampled.samples


def tone_factors(frequencies: FloatArray, samples: int) -> tuple[FloatArray, FloatArray]:
    """Size of a tone's increment over its phasor at mid-step, and of the slope's, (tones,) each.

    The increment of ``exp(1j w n)`` is ``1j size exp(1j w x)``, and that of
    ``lag exp(1j w n)`` is ``(1j size lag + slope) exp(1j w x)``.
    """
    half = np.pi * frequencies
    return 2.0 * np.sin(half), (2.0 * np.pi / samples) * np.cos(half)
