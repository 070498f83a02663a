"""Joint least squares of periodic components in table angle and in time.

Everything is fitted to the *increments* of an angle: there the angle random walk is
white, so that plain least squares neither follows the walk nor leaks from it. The normal
equations of sinusoids need no pass over the samples for each pair of them: those of two
tones have a closed form, those of two whole orders are non-uniform Fourier sums of the
table angle, made once for all orders, and an order and a tone meet only where their
frequencies do. What is left of the data enters by its sums at each component alone, and
exactly; the Gauss-Newton step moves all amplitudes and frequencies at once, and the
inverse of its matrix gives their covariance.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.linalg
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from sagnac import _kernels, series, spectrum
from sagnac._kernels import ComplexArray
from sagnac.recording import FloatArray

# Whole orders that count as the table's own and go by Fourier sums; a higher one is a line in time
# until the table's unsteadiness shows otherwise.
MOST_ORDERS: Final = 128
# Eigenvalues below this share of the largest (of the scaled normal matrix) are directions that
# the data do not distinguish; nothing is fitted along them. Products of an order and a tone are
# good to a tenth of it.
_COLLINEAR: Final = 1e-5
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
    """

    orders: FloatArray
    free: NDArray[np.bool_]
    frequencies: FloatArray
    center: float
    cosine: FloatArray
    sine: FloatArray

    @property
    def size(self) -> int:
        """Number of components."""
        return self.orders.size + self.frequencies.size

    @property
    def amplitude(self) -> FloatArray:
        """(components,) rad."""
        return np.asarray(np.hypot(self.cosine, self.sine))

    def select(self, keep: NDArray[np.bool_]) -> "Components":
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
    """The empty set, for a record of `samples` angles."""
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
    angle: FloatArray, table: FloatArray | None, components: Components, span: slice
) -> FloatArray:
    """`angle`, rad, over a span of the samples, without the components.

    Parameters
    ----------
    angle
        (span,) rad.
    table
        (samples,) table angle of the whole record, rad; None if there are no orders.
    components
        What to take away.
    span
        Which samples `angle` is.
    """
    rest = angle.copy()
    angles = components.orders.size
    if angles and table is not None:
        alpha = table[span]
        multiples = _multiples(components)
        if multiples.any():
            chosen = np.flatnonzero(multiples)
            orders = components.orders[chosen].astype(np.int64)
            sums = np.zeros(int(orders[-1]) + 1, dtype=np.complex128)
            np.add.at(sums, orders, components.cosine[chosen] - 1j * components.sine[chosen])
            rest -= spectrum.angle_series(alpha, sums)
        for index in np.flatnonzero(~multiples):
            phase = components.orders[index] * alpha
            rest -= components.cosine[index] * np.cos(phase)
            rest -= components.sine[index] * np.sin(phase)
    if components.frequencies.size:
        rest -= spectrum.tones(
            span.start,
            rest.size,
            components.center,
            components.frequencies,
            cosine=components.cosine[angles:],
            sine=components.sine[angles:],
        )
    return rest


def _multiples(components: Components) -> NDArray[np.bool_]:
    """(angle components,) which are whole orders that go by Fourier sums."""
    orders = components.orders
    return np.asarray(
        ~components.free & (orders == np.rint(orders)) & (orders <= MOST_ORDERS), dtype=np.bool_
    )


# --- sampling ----------------------------------------------------------------------------------


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
        return spectrum.angle_sums(middle, columns, highest).conj()

    sums = np.zeros((degree + 1, highest + 1), dtype=np.complex128)
    for part in series.each(sums_over, table.size - 1, release_of=(table,)):
        sums += part
    return np.asarray(expansion), sums


# --- fit -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class ComponentFit:
    """A fitted set.

    Attributes
    ----------
    components
        With refined amplitudes, frequencies and free orders.
    covariance
        (components, 3, 3) of cosine, sine and frequency (or order), for increments of
        unit variance: multiply by the noise floor at the component's own frequency. The
        third row is 0 where nothing was fitted there.
    collinear
        Directions in which the data do not tell the components apart.
    """

    components: Components
    covariance: FloatArray
    collinear: int


def fit(
    steps: FloatArray,
    sampled: Sampling,
    components: Components,
    *,
    absent: NDArray[np.bool_] | None = None,
) -> ComponentFit:
    """One Gauss-Newton step of all amplitudes and frequencies jointly.

    Parameters
    ----------
    steps
        (samples - 1,) increments of the angle, rad, with the components already taken out.
    sampled
        `sampling` of the record.
    components
        As they were taken out. Their amplitudes must be near the solution, since the
        derivative in frequency is proportional to them.
    absent
        (components,) bool: those that were not taken out, whose amplitudes are only where to
        start. None if all were.

    References
    ----------
    The joint step is the cyclic refinement of NOMP (arXiv:1509.01942) done at once.
    """
    angles = components.orders.size
    tunable = np.concatenate([components.free, np.ones(components.frequencies.size, dtype=bool)])
    tuned = np.flatnonzero(tunable)
    both = np.concatenate([np.repeat(np.arange(components.size), 2), components.size + tuned])
    # Every row is the real part of a factor times a component's phasor or its derivative.
    factor = np.concatenate(
        [
            np.tile([1.0, -1.0j], components.size),
            components.sine[tuned] + 1j * components.cosine[tuned],
        ]
    )
    straight, mirrored = _products(sampled, components)
    normal = (
        0.5
        * (
            np.outer(factor, factor.conj()) * straight[np.ix_(both, both)]
            + np.outer(factor, factor) * mirrored[np.ix_(both, both)]
        ).real
    )
    right = (factor * _data_sums(steps, sampled, components)[both]).real
    inverse, collinear = _inverse(normal)
    solution = inverse @ right
    kept = np.ones(components.size) if absent is None else 1.0 - absent
    cosine = solution[0 : 2 * components.size : 2] + kept * components.cosine
    sine = solution[1 : 2 * components.size : 2] + kept * components.sine
    orders, frequencies = components.orders.copy(), components.frequencies.copy()
    middle, span = _range(sampled)
    covariance = np.zeros((components.size, 3, 3))
    for index in range(components.size):
        pair = slice(2 * index, 2 * index + 2)
        covariance[index, :2, :2] = inverse[pair, pair]
    for row, index in enumerate(tuned.tolist(), start=2 * components.size):
        unit = 1.0 / span if index < angles else 1.0 / sampled.samples
        step = float(np.clip(solution[row], -1.0, 1.0)) * unit
        if index < angles:
            # The phase origin of an angle component is alpha = 0, not mid-record.
            orders[index] += step
            cosine[index], sine[index] = _turned(cosine[index], sine[index], step * middle)
        else:
            frequencies[index - angles] += step
        members = np.array([2 * index, 2 * index + 1, row])
        scale = np.array([1.0, 1.0, unit])
        covariance[index] = inverse[np.ix_(members, members)] * np.outer(scale, scale)
        if index < angles:
            # And the order's error moves that origin's phase with it.
            c, s = np.cos(step * middle), np.sin(step * middle)
            moved = np.array(
                [[c, -s, -middle * sine[index]], [s, c, middle * cosine[index]], [0.0, 0.0, 1.0]]
            )
            covariance[index] = moved @ covariance[index] @ moved.T
    return ComponentFit(
        components=replace(
            components, orders=orders, frequencies=frequencies, cosine=cosine, sine=sine
        ),
        covariance=covariance,
        collinear=collinear,
    )


def _turned(cosine: float, sine: float, angle: float) -> tuple[float, float]:
    """Amplitudes that keep the component's phase where the order's change would shift it."""
    c, s = np.cos(angle), np.sin(angle)
    return cosine * c - sine * s, sine * c + cosine * s


def _inverse(normal: FloatArray) -> tuple[FloatArray, int]:
    """Inverse of the normal matrix, and how many directions were left out of it."""
    scale = np.sqrt(np.maximum(np.diag(normal), 0.0))
    scale[scale == 0.0] = 1.0
    eigenvalues, vectors = scipy.linalg.eigh(normal / np.outer(scale, scale))
    keep = eigenvalues > _COLLINEAR * eigenvalues[-1] if eigenvalues.size else eigenvalues > 0
    used = vectors[:, keep]
    inverse = (used / eigenvalues[keep]) @ used.T
    return inverse / np.outer(scale, scale), int((~keep).sum())


def _range(sampled: Sampling) -> tuple[float, float]:
    """Middle of the table's range, and the range itself or 1 rad, the larger."""
    if sampled.table is None:
        return 0.0, 1.0
    low, high = float(sampled.angle.min()), float(sampled.angle.max())
    return 0.5 * (low + high), max(high - low, 1.0)


# --- sums over the record --------------------------------------------------------------------


def order_sums(steps: FloatArray, table: FloatArray, highest: int) -> ComplexArray:
    """Inner products of `steps` and the increments of exp(1j k alpha), k = 0 … `highest`.

    Summed by parts: increments of the exponential against the data are the exponential
    itself against the data's differences.
    """

    def sums_over(span: slice) -> ComplexArray:
        return spectrum.angle_sums(table[span], _differences(steps, span), highest).conj()

    sums = np.zeros(highest + 1, dtype=np.complex128)
    for part in series.each(sums_over, table.size, release_of=(steps, table)):
        sums += part
    return sums


def sums_at_orders(steps: FloatArray, sampled: Sampling, orders: FloatArray) -> ComplexArray:
    """As `order_sums` at any orders, and times the table's place in its range besides, (2, orders).

    The place is from the middle, as a share of the range (in rad where that is below 1 rad). A
    pass for each order.
    """
    table = sampled.table
    sums = np.zeros((2, orders.size), dtype=np.complex128)
    if table is None:
        return sums
    middle, range_ = _range(sampled)

    def sums_over(span: slice) -> ComplexArray:
        strengths, alpha = _differences(steps, span), table[span]
        lagged = strengths * ((alpha - middle) / range_)
        found = np.empty_like(sums)
        for at, order in enumerate(orders):
            phasor = np.exp(1j * order * alpha)
            found[:, at] = strengths @ phasor, lagged @ phasor
        return found

    for part in series.each(sums_over, table.size, release_of=(steps, table)):
        sums += part
    return sums


def tone_sums(steps: FloatArray, frequencies: FloatArray) -> ComplexArray:
    """Sums of `steps` times exp(2j pi f x), and times 2 pi x / samples besides, (2, tones).

    x is the middle of each step, in samples from mid-record.
    """
    samples = steps.size + 1
    return spectrum.tone_sums(
        steps, frequencies, 0.5 * (steps.size - 1), lag_unit=2.0 * np.pi / samples
    )


def _differences(steps: FloatArray, span: slice) -> FloatArray:
    """Each step less the next, at the sample between them; outside the record there are none."""
    before = steps[max(span.start - 1, 0) : span.stop - 1]
    after = steps[span.start : span.stop]
    if span.start == 0:
        before = np.concatenate([[0.0], before])
    if after.size < before.size:
        after = np.append(after, 0.0)
    return before - after


def _data_sums(steps: FloatArray, sampled: Sampling, components: Components) -> ComplexArray:
    """(2 components,) of the steps and each component's phasor, then its derivative."""
    angles = components.orders.size
    sums = np.zeros(2 * components.size, dtype=np.complex128)
    table = sampled.table
    if angles and table is not None:
        multiples = _multiples(components)
        if multiples.any():
            chosen = np.flatnonzero(multiples)
            orders = components.orders[chosen].astype(np.int64)
            sums[chosen] = order_sums(steps, table, int(orders[-1]))[orders]
        loose = np.flatnonzero(~multiples)
        if loose.size:
            plain, tilted = sums_at_orders(steps, sampled, components.orders[loose])
            sums[loose], sums[components.size + loose] = plain, tilted
    if components.frequencies.size:
        plain, tilted = tone_sums(steps, components.frequencies)
        size, slope = _tone_factors(components.frequencies, sampled.samples)
        sums[angles : components.size] = 1j * size * plain
        sums[components.size + angles :] = 1j * size * tilted + slope * plain
    return sums


def _tone_factors(frequencies: FloatArray, samples: int) -> tuple[FloatArray, FloatArray]:
    """Of an increment of a tone, over its phasor at mid-step: its size, and that of its slope.

    The increment of ``exp(1j w n)`` is ``1j size exp(1j w x)``, and that of
    ``lag exp(1j w n)`` is ``(1j size lag + slope) exp(1j w x)``.
    """
    half = np.pi * frequencies
    return 2.0 * np.sin(half), (2.0 * np.pi / samples) * np.cos(half)


def _products(sampled: Sampling, components: Components) -> tuple[ComplexArray, ComplexArray]:
    """Sums of the products of all phasors and derivatives, (2 components, 2 components) each.

    Of every increment with the conjugate of every other, and with the other itself.
    """
    size, angles = components.size, components.orders.size
    straight = np.zeros((2 * size, 2 * size), dtype=np.complex128)
    mirrored = np.zeros((2 * size, 2 * size), dtype=np.complex128)
    multiples = np.flatnonzero(_multiples(components))
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
    size, slope = _tone_factors(frequencies, samples)
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
    middle, span = _range(sampled)
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
    loose = np.flatnonzero(~_multiples(components))
    turns = _range(sampled)[1] / (2.0 * np.pi)
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
