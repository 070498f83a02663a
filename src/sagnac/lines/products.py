"""Inner products of components without a pass over the samples."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.polynomial import chebyshev

from sagnac.core.arrays import (
    BLOCK,
    ComplexArray,
    FloatArray,
    IntegerArray,
    blocks,
    every,
    extent,
)
from sagnac.lines import _kernels
from sagnac.lines.components import MOST_ORDERS, Components, phase_multiples
from sagnac.spectrum.sums import angle_sums

# Phase by which the table may stray from a straight line within a block of `Sampling`, at the
# highest order, rms over the record: products of an order and a tone are then good to its square.
_BLOCK_PHASE: Final = 1e-3
_LONGEST_BLOCK: Final = 256
# Two components whose frequencies come no closer than this, in Hz times seconds of record or
# cycles over the whole range, are orthogonal to within a third of a per cent.
_APART: Final = 100.0
# An order that comes that close to a tone on less than this share of the record does not count.
_LEAST_MEETING: Final = 1e-2
# If there are fewer pairs times blocks than this, all count: leaving some out would gain nothing.
_FEW: Final = 2_000_000
# Error of an expansion in Chebyshev polynomials, and the highest degree that is tried.
_EXPANSION: Final = 1e-9
_HIGHEST_DEGREE: Final = 24


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampling:
    """Sampling as the normal equations need it: times and table angles.

    On blocks of steps the table is taken to turn evenly. Products of whole orders need no blocks:
    an increment of ``exp(1j k alpha)`` is ``2j sin(k step / 2) exp(1j k middle)``, with the step of
    the table and the angle in its middle. The product of two has
    ``cos((k - m) step / 2) - cos((k + m) step / 2)`` for its size: with these expanded in Chebyshev
    polynomials of the squared step, Fourier sums of the polynomials give the products of all pairs
    of orders.

    Attributes
    ----------
    samples
        Of the angle.
    table
        (samples,) table angle, rad, or None.
    angle, step, lag, count
        (blocks,) mean table angle, rad; mean step, rad; middle of the block in samples from
        mid-record; number of its steps. None at rest.
    expansion
        (degree + 1, orders) coefficients of ``cos(s * step / 2)`` for s = 0, 1, ….
    order_sums
        (degree + 1, orders) sums of each polynomial times ``exp(1j * s * middle)``.
    """

    samples: int
    table: FloatArray | None
    angle: FloatArray
    step: FloatArray
    lag: FloatArray
    count: FloatArray
    expansion: FloatArray
    order_sums: ComplexArray


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


def sampling(samples: int, table: FloatArray | None) -> Sampling:
    """`Sampling` of a record: a few passes over the table angle.

    Parameters
    ----------
    samples
        Of the angle.
    table
        (samples,) table angle, rad; None at rest.

    Raises
    ------
    ValueError
        If the table has another number of samples, or fewer than two.
    """
    if table is None:
        none = np.empty(0)
        return Sampling(
            samples=samples,
            table=None,
            angle=none,
            step=none,
            lag=none,
            count=none,
            expansion=np.empty((0, 0)),
            order_sums=np.empty((0, 0), dtype=np.complex128),
        )
    if table.shape != (samples,) or samples < 2:
        raise ValueError(f"table has shape {table.shape}; give one angle a sample, 2 or more")
    steps, length = samples - 1, _block_length(table)
    starts = np.arange(0, steps, length)
    ends = np.minimum(starts + length, steps)
    count = (ends - starts).astype(np.float64)
    step = np.diff(np.append(every(table[:-1], length), table[-1])) / count
    angle = np.empty(starts.size)
    for some in blocks(steps, multiple=length):
        here = table[some.start : some.stop + 1]
        middle = 0.5 * (here[1:] + here[:-1])
        own = np.add.reduceat(middle, np.arange(0, middle.size, length))
        angle[some.start // length :][: own.size] = own
    expansion, sums = _order_products(table, float(np.abs(step).max()))
    return Sampling(
        samples=samples,
        table=table,
        angle=angle / count,
        step=step,
        lag=np.asarray(0.5 * (starts + ends - steps)),
        count=count,
        expansion=expansion,
        order_sums=sums,
    )


def _block_length(table: FloatArray) -> int:
    """Steps in the longest block on which the table turns evenly: a power of 2."""
    block = _LONGEST_BLOCK
    # Half as long, the straight line is four times better kept.
    while block > 1:
        coarse = np.diff(every(table, block)) / block
        bend = float(np.sqrt(np.mean(np.diff(coarse) ** 2))) if coarse.size > 1 else np.inf
        if MOST_ORDERS * bend * block / 8.0 < _BLOCK_PHASE:
            break
        block //= 2
    return block


def _order_products(table: FloatArray, fastest: float) -> tuple[FloatArray, ComplexArray]:
    """`Sampling.expansion` and `Sampling.order_sums` of a table angle, (samples,) rad.

    `fastest` is the largest mean step of a block, rad. A single wild step of the encoder is no
    rate: steps count up to half above the fastest block.
    """
    highest, limit = 2 * MOST_ORDERS, (1.5 * fastest) ** 2
    ends = [extent(np.diff(table[some.start : some.stop + 1]) ** 2) for some in _long(table)]
    high = max(min(largest, limit) for _, largest in ends)
    low = min([smallest for smallest, _ in ends] + [high])
    # Beyond its Nyquist frequency an order is no candidate, and need not be expanded well.
    reach = np.minimum(np.arange(highest + 1.0), 2.0 * np.pi / max(fastest, 1e-12))
    expansion = _half_cosines_expanded(low, high, reach)
    sums = np.zeros((expansion.shape[0], highest + 1), dtype=np.complex128)
    for some in _long(table):
        here = table[some.start : some.stop + 1]
        squares = np.minimum(np.diff(here) ** 2, high)
        place = 2.0 * (squares - low) / max(high - low, 1e-300) - 1.0
        polynomials = chebyshev.chebvander(place, expansion.shape[0] - 1)
        columns = np.ascontiguousarray(polynomials.T, dtype=np.float64)
        sums += angle_sums(0.5 * (here[1:] + here[:-1]), columns, highest).conj()
    return expansion, sums


def _long(table: FloatArray) -> Iterator[slice]:
    """Long blocks of steps: what a block costs besides is that of a hundred thousand of them."""
    return blocks(table.size - 1, 4 * BLOCK)


def _half_cosines_expanded(low: float, high: float, reach: FloatArray) -> FloatArray:
    """(degree + 1, orders) coefficients of ``cos(reach * step / 2)`` in the squared step.

    The degree is the lowest that is good to 1e-9, 24 at most.
    """

    def half_cosines(place: FloatArray) -> FloatArray:
        squares = np.maximum(low + 0.5 * (place + 1.0) * (high - low), 0.0)
        return np.cos(0.5 * np.outer(np.sqrt(squares), reach))

    check = np.linspace(-1.0, 1.0, 33)
    for degree in range(1, _HIGHEST_DEGREE + 1):
        nodes = chebyshev.chebpts1(degree + 1)
        expansion = np.linalg.solve(chebyshev.chebvander(nodes, degree), half_cosines(nodes))
        values = chebyshev.chebvander(check, degree) @ expansion
        if np.abs(values - half_cosines(check)).max() < _EXPANSION:
            break
    return np.asarray(expansion)


def inner_products(sampled: Sampling, components: Components) -> InnerProducts:
    """Inner products of all components and their derivatives over a record."""
    size = components.size
    straight = np.zeros((2 * size, 2 * size), dtype=np.complex128)
    mirrored = np.zeros((2 * size, 2 * size), dtype=np.complex128)
    multiples = np.flatnonzero(phase_multiples(components))
    orders = components.orders[multiples].astype(np.int64)
    # What mirrors a component is the conjugate of one whose phase runs backwards.
    for products, way in ((straight, 1), (mirrored, -1)):
        products[np.ix_(multiples, multiples)] = _products_of_orders(sampled, orders, way * orders)
        _add_tones(products, components.frequencies, way, sampled.samples)
    if components.orders.size:
        _add_pairs(straight, mirrored, sampled, components)
    return InnerProducts(straight=straight, mirrored=mirrored)


def _products_of_orders(
    sampled: Sampling, orders: IntegerArray, others: IntegerArray
) -> ComplexArray:
    """Products of whole orders with the conjugates of others, by the Fourier sums of all."""
    difference = orders[:, np.newaxis] - others
    apart, total = np.abs(difference), np.abs(orders[:, np.newaxis] + others)
    shape = sampled.expansion[:, apart] - sampled.expansion[:, total]
    sums = sampled.order_sums[:, apart]
    return np.asarray(2.0 * (shape * np.where(difference < 0, sums.conj(), sums)).sum(axis=0))


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
    middle, span = phase_range(sampled)
    plus, minus = _kernels.paired_sums(
        # Radians of phase for one of table angle, or for one sample.
        np.concatenate([components.orders, 2.0 * np.pi * components.frequencies]),
        np.arange(size) < components.orders.size,
        first,
        second,
        sampled.angle,
        sampled.step,
        sampled.lag,
        sampled.count,
        middle,
        span,
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
    orders, loose = components.orders, ~phase_multiples(components)
    possible = (np.count_nonzero(loose) + components.frequencies.size) * orders.size
    everything = possible * sampled.angle.size <= _FEW
    turns = phase_range(sampled)[1] / (2.0 * np.pi)
    apart = np.minimum(np.abs(orders[:, np.newaxis] - orders), orders[:, np.newaxis] + orders)
    near = loose[:, np.newaxis] & (everything | (apart * turns < _APART))
    # Of two loose ones the first meets the second.
    near &= ~(np.tril(np.ones(near.shape, dtype=bool), -1) & loose)
    steps = np.sort(sampled.step)
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
    return _meeting(sampled, components)[0].size * sampled.angle.size / sampled.samples


def phase_range(sampled: Sampling) -> tuple[float, float]:
    """Middle of the table's range, and the range itself or 1 rad, the larger."""
    if sampled.table is None:
        return 0.0, 1.0
    low, high = float(sampled.angle.min()), float(sampled.angle.max())
    return 0.5 * (low + high), max(high - low, 1.0)


def tone_factors(frequencies: FloatArray, samples: int) -> tuple[FloatArray, FloatArray]:
    """Size of a tone's increment over its phasor at mid-step, and of the slope's, (tones,) each.

    The increment of ``exp(1j w n)`` is ``1j size exp(1j w x)``, and that of
    ``lag exp(1j w n)`` is ``(1j size lag + slope) exp(1j w x)``.
    """
    half = np.pi * frequencies
    return 2.0 * np.sin(half), (2.0 * np.pi / samples) * np.cos(half)
