"""Inner products of components without a pass over the samples."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import ComplexArray, FloatArray
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
# Of few pairs and blocks all do, for no gain in leaving them out.
_FEW: Final = 2_000_000
_LEAST_MEETING: Final = 1e-2
_EXPANSION: Final = 1e-9
_HIGHEST_DEGREE: Final = 24


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampling:
    """What the normal equations need to know of when and at which table angle was sampled.

    An increment of ``exp(1j k alpha)`` is ``2j sin(k step / 2) exp(1j k middle)``, with the
    step of the table and the angle in its middle. The product of two has
    ``cos((k - m) step / 2) - cos((k + m) step / 2)`` for its size: with these expanded in
    Chebyshev polynomials of the squared step, Fourier sums of the polynomials give the
    products of all pairs of orders.

    Attributes
    ----------
    samples
        Of the angle.
    table
        (samples,) table angle, rad, or None.
    expansion
        (degree + 1, orders) coefficients of ``cos(s * step / 2)`` for s = 0, 1, ….
    sums
        (degree + 1, orders) sums of each polynomial times ``exp(1j * s * middle)``.
    block
        Steps in each block on which the table is taken to turn evenly.
    angle, step, lag, count
        (blocks,) of each block: mean table angle, rad; mean step, rad; its middle in
        samples from mid-record; number of its steps.
    """

    samples: int
    table: FloatArray | None
    expansion: FloatArray
    sums: ComplexArray
    block: int
    angle: FloatArray
    step: FloatArray
    lag: FloatArray
    count: FloatArray


def sampling(samples: int, table: FloatArray | None) -> Sampling:
    """`Sampling` of a record: two passes over the table angle."""
    if table is None:
        none = np.empty(0)
        return Sampling(
            samples=samples,
            table=None,
            expansion=np.empty((1, 1)),
            sums=np.empty((1, 1), dtype=np.complex128),
            block=1,
            angle=none,
            step=none,
            lag=none,
            count=none,
        )
    block, angle, step, lag, count = _blocks(table)
    expansion, sums = _order_products(table, float(np.abs(step).max()))
    return Sampling(
        samples=samples,
        table=table,
        expansion=expansion,
        sums=sums,
        block=block,
        angle=angle,
        step=step,
        lag=lag,
        count=count,
    )


def _blocks(table: FloatArray) -> tuple[int, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Blocks of steps as long as the table turns evenly on them."""
    block = _LONGEST_BLOCK
    coarse = np.diff(series.every(table, block)) / block
    # Half as long, the straight line is four times better kept.
    while block > 1:
        bend = float(np.sqrt(np.mean(np.diff(coarse) ** 2))) if coarse.size > 1 else np.inf
        if MOST_ORDERS * bend * block / 8.0 < _BLOCK_PHASE:
            break
        block //= 2
        coarse = np.diff(series.every(table, block)) / block
    steps = table.size - 1
    starts = np.arange(0, steps, block)
    ends = np.minimum(starts + block, steps)
    count = (ends - starts).astype(np.float64)
    angle = np.empty(starts.size)

    def middles(span: slice) -> None:
        here = table[span.start : span.stop + 1]
        middle = 0.5 * (here[1:] + here[:-1])
        first = span.start // block
        own = np.add.reduceat(middle, np.arange(0, middle.size, block))
        angle[first : first + own.size] = own
        angle[first : first + own.size] /= count[first : first + own.size]

    length = block * max(1, series.SPAN // block)
    list(series.each(middles, steps, length, release_of=(table,)))
    step = (series.at(table, ends) - series.at(table, starts)) / count
    lag = 0.5 * (starts + ends - steps)
    return block, angle, np.asarray(step), np.asarray(lag), count


def _order_products(table: FloatArray, fastest: float) -> tuple[FloatArray, ComplexArray]:
    """`expansion` and `sums` of `Sampling`.

    A single wild step of the encoder is no rate: steps count up to half above the fastest
    block.
    """
    highest = 2 * MOST_ORDERS
    limit = (1.5 * fastest) ** 2

    def extremes(span: slice) -> tuple[float, float]:
        squares = np.diff(table[span.start : span.stop + 1]) ** 2
        return float(squares.min()), min(float(squares.max()), limit)

    found = list(series.each(extremes, table.size - 1, release_of=(table,)))
    low, high = min(pair[0] for pair in found), max(pair[1] for pair in found)
    low = min(low, high)
    orders = np.arange(highest + 1.0)
    # Beyond its Nyquist frequency an order is no candidate, and need not be expanded well.
    reach = np.minimum(orders, 2.0 * np.pi / max(fastest, 1e-12))

    def half_cosines(squares: FloatArray) -> FloatArray:
        return np.cos(0.5 * np.outer(np.sqrt(np.maximum(squares, 0.0)), reach))

    check = np.linspace(low, high, 33)
    width = max(high - low, 1e-300)
    for degree in range(1, _HIGHEST_DEGREE + 1):
        nodes = chebyshev.chebpts1(degree + 1)
        expansion = np.linalg.solve(
            chebyshev.chebvander(nodes, degree),
            half_cosines(low + 0.5 * (nodes + 1.0) * (high - low)),
        )
        values = chebyshev.chebvander(2.0 * (check - low) / width - 1.0, degree) @ expansion
        if np.abs(values - half_cosines(check)).max() < _EXPANSION:
            break

    def sums_over(span: slice) -> ComplexArray:
        here = table[span.start : span.stop + 1]
        squares = np.minimum(np.diff(here) ** 2, high)
        middle = 0.5 * (here[1:] + here[:-1])
        polynomials = chebyshev.chebvander(2.0 * (squares - low) / width - 1.0, degree)
        columns = np.ascontiguousarray(polynomials.T, dtype=np.float64)
        return angle_sums(middle, columns, highest).conj()

    sums = np.zeros((degree + 1, highest + 1), dtype=np.complex128)
    for part in series.each(sums_over, table.size - 1, release_of=(table,)):
        sums += part
    return np.asarray(expansion), sums


def inner_products(sampled: Sampling, components: Components) -> tuple[ComplexArray, ComplexArray]:
    """Sums of the products of all phasors and derivatives, (2 components, 2 components) each.

    Of every increment with the conjugate of every other, and with the other itself.
    """
    size, angles = components.size, components.orders.size
    straight = np.zeros((2 * size, 2 * size), dtype=np.complex128)
    mirrored = np.zeros((2 * size, 2 * size), dtype=np.complex128)
    multiples = np.flatnonzero(phase_multiples(components))
    if multiples.size:
        orders = components.orders[multiples].astype(np.int64)
        difference = orders[:, None] - orders[None, :]
        total = orders[:, None] + orders[None, :]
        apart = np.abs(difference)
        shape = sampled.expansion[:, apart] - sampled.expansion[:, total]
        sums = np.where(difference < 0, sampled.sums[:, apart].conj(), sampled.sums[:, apart])
        places = np.ix_(multiples, multiples)
        straight[places] = 2.0 * (shape * sums).sum(axis=0)
        mirrored[places] = -2.0 * (shape * sampled.sums[:, total]).sum(axis=0)
    if components.frequencies.size:
        _add_tones(straight, mirrored, components.frequencies, sampled.samples)
    if angles:
        _add_pairs(straight, mirrored, sampled, components)
    return straight, mirrored


def _add_tones(
    straight: ComplexArray, mirrored: ComplexArray, frequencies: FloatArray, samples: int
) -> None:
    """Products of two tones, by the closed forms of sums over even samples."""
    size, slope = tone_factors(frequencies, samples)
    a, b = size[:, None], size[None, :]
    c, d = slope[:, None], slope[None, :]
    total = straight.shape[0] // 2
    plain = slice(total - frequencies.size, total)
    tilted = slice(2 * total - frequencies.size, 2 * total)
    zero, one, two = _moments(2.0 * np.pi * (frequencies[:, None] - frequencies[None, :]), samples)
    straight[plain, plain] = a * b * zero
    straight[tilted, plain] = a * b * one - 1j * c * b * zero
    straight[plain, tilted] = a * b * one + 1j * a * d * zero
    straight[tilted, tilted] = a * b * two + c * d * zero + 1j * (a * d - b * c) * one
    zero, one, two = _moments(2.0 * np.pi * (frequencies[:, None] + frequencies[None, :]), samples)
    mirrored[plain, plain] = -a * b * zero
    mirrored[tilted, plain] = -a * b * one + 1j * c * b * zero
    mirrored[plain, tilted] = -a * b * one + 1j * a * d * zero
    mirrored[tilted, tilted] = -a * b * two + c * d * zero + 1j * (a * d + b * c) * one


def _moments(frequency: FloatArray, samples: int) -> tuple[FloatArray, ComplexArray, FloatArray]:
    """Sums over the steps of lag^r exp(1j w x), r = 0, 1, 2, for angular frequencies `w`.

    The first is ``D(w) = sin(M w / 2) / sin(w / 2)`` with M steps, the others its
    derivatives; lag is 2 pi x / samples.
    """
    steps = samples - 1
    turn = 2.0 * np.pi / samples
    # One period: D repeats at 2 pi but for its sign, which steps and samples between share.
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
    size, angles = components.size, components.orders.size
    middle, span = phase_range(sampled)
    in_angle = np.zeros(size, dtype=bool)
    in_angle[:angles] = True
    # Radians of phase for one of table angle, or for one sample.
    rate = np.concatenate([components.orders, 2.0 * np.pi * components.frequencies])

    def over(part: slice) -> tuple[ComplexArray, ComplexArray]:
        return _kernels.paired_sums(
            rate,
            in_angle,
            first[part],
            second[part],
            sampled.angle,
            sampled.step,
            sampled.lag,
            sampled.count,
            middle,
            span,
            2.0 * np.pi / sampled.samples,
        )

    length = max(1, -(-first.size // (2 * series.THREADS)))
    parts = list(series.each(over, first.size, length))
    plus = np.concatenate([part[0] for part in parts])
    minus = np.concatenate([part[1] for part in parts])
    for kind, (rows, columns) in enumerate(((0, 0), (1, 0), (0, 1), (1, 1))):
        here, there = first + rows * size, second + columns * size
        straight[here, there] = plus[:, kind]
        straight[there, here] = plus[:, kind].conj()
        mirrored[here, there] = minus[:, kind]
        mirrored[there, here] = minus[:, kind]


def _meeting(
    sampled: Sampling, components: Components
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of components, each once, whose products are not negligible or known already."""
    angles = components.orders.size
    loose = np.flatnonzero(~phase_multiples(components))
    turns = phase_range(sampled)[1] / (2.0 * np.pi)
    possible = (loose.size + components.frequencies.size) * angles
    everything = possible * sampled.angle.size <= _FEW
    pairs: list[tuple[int, int]] = []
    for index in loose.tolist():
        others = components.orders
        near = np.abs(others - components.orders[index]) * turns < _APART
        near |= (others + components.orders[index]) * turns < _APART
        near |= everything
        pairs += [
            (index, other)
            for other in np.flatnonzero(near).tolist()
            if other not in loose or other >= index
        ]
    if components.frequencies.size:
        steps = np.sort(sampled.step)
        reach = 2.0 * np.pi * _APART / sampled.samples
        rates = 2.0 * np.pi * components.frequencies
        for index, order in enumerate(components.orders):
            # The table may turn either way.
            share = np.zeros(rates.size)
            for sign in (1.0, -1.0):
                low = np.searchsorted(steps, (sign * rates - reach) / order)
                high = np.searchsorted(steps, (sign * rates + reach) / order)
                share += (high - low) / steps.size
            met = everything | (share > _LEAST_MEETING)
            pairs += [(index, angles + at) for at in np.flatnonzero(met).tolist()]
    if not pairs:
        none = np.empty(0, dtype=np.int64)
        return none, none
    first, second = np.array(pairs, dtype=np.int64).T
    return first, second


def phase_range(sampled: Sampling) -> tuple[float, float]:
    """Middle of the table's range, and the range itself or 1 rad, the larger."""
    if sampled.table is None:
        return 0.0, 1.0
    low, high = float(sampled.angle.min()), float(sampled.angle.max())
    return 0.5 * (low + high), max(high - low, 1.0)


def tone_factors(frequencies: FloatArray, samples: int) -> tuple[FloatArray, FloatArray]:
    """Of an increment of a tone, over its phasor at mid-step: its size, and that of its slope.

    The increment of ``exp(1j w n)`` is ``1j size exp(1j w x)``, and that of
    ``lag exp(1j w n)`` is ``(1j size lag + slope) exp(1j w x)``.
    """
    half = np.pi * frequencies
    return 2.0 * np.sin(half), (2.0 * np.pi / samples) * np.cos(half)
