"""Joint least squares of periodic components in table angle and in time.

Everything is fitted to the *increments* of an angle: there the angle random walk is
white, so that plain least squares neither follows the walk nor leaks from it. The normal
equations of sinusoids need no pass over the samples for each pair of them: those of two
tones have a closed form, those of two whole orders are non-uniform Fourier sums of the
table angle, made once for all orders, and an order and a tone meet only where their
frequencies do. The data enter by their sums at each component alone, and exactly. The
Gauss-Newton step moves all amplitudes and frequencies at once, and the inverse of its
matrix gives their covariance.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.linalg

from sagnac.core import arrays
from sagnac.core.arrays import BooleanArray, ComplexArray, FloatArray, IntegerArray
from sagnac.lines import _kernels
from sagnac.lines.components import Components
from sagnac.lines.sampling import MOST_ORDERS, Sampling, mean_square_step, speeds
from sagnac.spectrum.sums import COSINE, SINE, angle_series, angle_sums, tone_sums
from sagnac.table.kinematics import LARGEST_EARTH_RATE
from sagnac.table.turns import mean_rate

# ---- inner products ----------------------------------------------------------------

# Two components whose frequencies come no closer than this, in Hz times seconds of record or
# cycles over the whole range, are orthogonal to within a third of a per cent.
_APART: Final = 100.0


def inner_products(sampled: Sampling, components: Components) -> tuple[ComplexArray, ComplexArray]:
    """Inner products of all components and their derivatives, without a pass over the samples.

    They are sums of the products of increments of phasors and of their derivatives.

    Returns
    -------
    straight
        (2 components, 2 components) of every one with the conjugate of every other: phasors
        first, then derivatives.
    mirrored
        The same of every one with the other itself.
    """
    size = components.size
    straight, mirrored = np.zeros((2, 2 * size, 2 * size), dtype=np.complex128)
    multiples = np.flatnonzero(components.multiples)
    orders = components.orders[multiples].astype(np.int64)
    # What mirrors a component is the conjugate of one whose phase runs backwards.
    for products, way in ((straight, 1), (mirrored, -1)):
        if orders.size:
            products[np.ix_(multiples, multiples)] = _order_products(sampled, orders, way * orders)
        _add_tones(products, components.frequencies, way, sampled.samples)
    _add_pairs(straight, mirrored, sampled, components)
    return straight, mirrored


def _order_products(sampled: Sampling, orders: IntegerArray, others: IntegerArray) -> ComplexArray:
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
    apart = 2.0 * np.pi * (frequencies[:, np.newaxis] - way * frequencies)
    zero, one, two = _moments(apart, samples)
    products[plain, plain] = a * b * zero
    products[tilted, plain] = a * b * one - 1j * c * b * zero
    products[plain, tilted] = a * b * one + 1j * a * d * zero
    products[tilted, tilted] = a * b * two + c * d * zero + 1j * (a * d - b * c) * one


def _moments(frequency: FloatArray, samples: int) -> tuple[FloatArray, ComplexArray, FloatArray]:
    """Sums over the steps of lag^r exp(1j w x), r = 0, 1, 2, for angular frequencies `w`.

    The first is ``D(w) = sin(M w / 2) / sin(w / 2)`` with M steps, the others its
    derivatives; lag is 2 pi x / samples.
    """
    steps, turn = samples - 1, 2.0 * np.pi / samples
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
    second = -(steps**2) * zero - 2.0 * steps * cosine * tangent / half_sine
    second = 0.25 * (second + zero * (1.0 + 2.0 * tangent**2))
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
    # Radians of phase for one of table angle, or for one sample.
    rates = np.concatenate([components.orders, 2.0 * np.pi * components.frequencies])
    in_angle = np.arange(size) < components.orders.size
    along = *sampled.blocks, *sampled.phase_range, 2.0 * np.pi / sampled.samples
    plus, minus = _kernels.paired_sums(rates, in_angle, first, second, *along)
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
    # All of few pairs times blocks count: leaving some out would gain nothing.
    everything = possible * sampled.blocks.length.size <= 2_000_000
    turns = sampled.phase_range[1] / (2.0 * np.pi)
    apart = np.minimum(np.abs(orders[:, np.newaxis] - orders), orders[:, np.newaxis] + orders)
    near = loose[:, np.newaxis] & (everything | (apart * turns < _APART))
    # If both are loose, the pair counts once.
    near &= ~(np.tril(np.ones(near.shape, dtype=bool), -1) & loose)
    steps = np.sort(sampled.blocks.step)
    reach, rates = 2.0 * np.pi * _APART / sampled.samples, 2.0 * np.pi * components.frequencies
    share = np.zeros((orders.size, rates.size))
    # The table may turn either way.
    for sign in (1.0, -1.0):
        low = np.searchsorted(steps, (sign * rates - reach) / orders[:, np.newaxis])
        high = np.searchsorted(steps, (sign * rates + reach) / orders[:, np.newaxis])
        share += (high - low) / steps.size
    # An order that comes that close to a tone on less of the record does not count.
    first, second = np.nonzero(np.hstack([near, everything | (share > 1e-2)]))
    return first, second


def pairs_summed(sampled: Sampling, components: Components) -> float:
    """Passes over all samples that `inner_products` takes: one for each pair that meets."""
    return _meeting(sampled, components)[0].size * sampled.blocks.length.size / sampled.samples


def tone_factors(frequencies: FloatArray, samples: int) -> tuple[FloatArray, FloatArray]:
    """Size of a tone's increment over its phasor at mid-step, and of the slope's, (tones,) each.

    The increment of ``exp(1j w n)`` is ``1j size exp(1j w x)``, and that of
    ``lag exp(1j w n)`` is ``(1j size lag + slope) exp(1j w x)``.
    """
    half = np.pi * frequencies
    return 2.0 * np.sin(half), (2.0 * np.pi / samples) * np.cos(half)


# ---- joint fit ---------------------------------------------------------------------


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
    absent: BooleanArray | None = None,
    known_sums: ComplexArray | None = None,
) -> ComponentFit:
    """One Gauss-Newton step of all amplitudes and frequencies jointly.

    Parameters
    ----------
    steps
        (samples - 1,) increments of the angle, rad, with the components already taken out.
    sampled
        How the record was sampled.
    components
        As they were taken out. Their amplitudes must be near the solution, since the
        derivative in frequency is proportional to them.
    absent
        (components,) bool: those that were not taken out, whose amplitudes are only where to
        start. None if all were.
    known_sums
        (orders + 1,) `order_sums` of `steps`, if they are known; made here if not, or if they end
        below the highest whole order.

    References
    ----------
    The joint step is the cyclic refinement of NOMP (arXiv:1509.01942) done at once.
    """
    tunable = np.concatenate([components.free, np.ones(components.frequencies.size, dtype=bool)])
    tuned = np.flatnonzero(tunable)
    # Every column of the regression is the real part of a factor times the increments of a
    # component's phasor, or of the phasor's derivative in frequency.
    phasor = np.concatenate([np.repeat(np.arange(components.size), 2), components.size + tuned])
    slope = 1j * components.phasor[tuned].conj()
    factor = np.concatenate([np.tile([1.0, -1.0j], components.size), slope])
    straight, mirrored = inner_products(sampled, components)
    places = np.ix_(phasor, phasor)
    normal = np.outer(factor, factor.conj()) * straight[places]
    normal += np.outer(factor, factor) * mirrored[places]
    inverse, collinear = _inverse(np.asarray(0.5 * normal.real))
    solution = inverse @ (factor * _data_sums(steps, sampled, components, known_sums)[phasor]).real
    kept = 1.0 if absent is None else 1.0 - absent
    amplitudes = solution[: 2 * components.size].view(np.complex128)
    started = replace(components, phasor=amplitudes + kept * components.phasor)
    moved, covariance = _moved(started, tuned, sampled, solution[2 * components.size :], inverse)
    covariance.flags.writeable = False
    return ComponentFit(components=moved, covariance=covariance, collinear=collinear)


def _moved(
    given: Components, tuned: IntegerArray, sampled: Sampling, step: FloatArray, inverse: FloatArray
) -> tuple[Components, FloatArray]:
    """The components with the `tuned` frequencies and free orders moved, and `covariance`.

    The derivative in an order is about the middle of the table's range, and that in a frequency
    about mid-record, where it is uncorrelated with the phase. The phase origin of an angle
    component is alpha = 0, so that a move of its order turns its amplitudes, and an error of its
    order is one of its phase.
    """
    size, angles = given.size, given.orders.size
    middle, width = sampled.phase_range
    in_angle = tuned < angles
    unit = np.where(in_angle, 1.0 / width, 1.0 / sampled.samples)
    # A frequency moves by no more than 1 rad of phase at the record's ends in one step.
    step = np.clip(step, -1.0, 1.0) * unit
    covariance = np.zeros((size, 3, 3))
    pairs = 2 * np.arange(size)[:, np.newaxis] + np.arange(2)
    covariance[:, :2, :2] = inverse[pairs[:, :, np.newaxis], pairs[:, np.newaxis, :]]
    members = np.column_stack([pairs[tuned], 2 * size + np.arange(tuned.size)])
    own = inverse[members[:, :, np.newaxis], members[:, np.newaxis, :]]
    own[:, 2, :] *= unit[:, np.newaxis]
    own[:, :, 2] *= unit[:, np.newaxis]
    covariance[tuned] = own
    places = np.concatenate([given.orders, given.frequencies])
    places[tuned] += step
    phasor = given.phasor.copy()
    for index, move in zip(tuned[in_angle], step[in_angle], strict=True):
        c, s = np.cos(move * middle), np.sin(move * middle)
        phasor[index] *= c + 1j * s
        lever = 1j * middle * phasor[index]
        turn = np.array([[c, -s, lever.real], [s, c, lever.imag], [0.0, 0.0, 1.0]])
        covariance[index] = turn @ covariance[index] @ turn.T
    orders, frequencies = np.split(places, [angles])
    return replace(given, orders=orders, frequencies=frequencies, phasor=phasor), covariance


def _inverse(normal: FloatArray) -> tuple[FloatArray, int]:
    """Inverse of the normal matrix, and the number of directions that were left out of it."""
    scale = np.sqrt(np.maximum(np.diag(normal), 0.0))
    scale[scale == 0.0] = 1.0
    eigenvalues, vectors = scipy.linalg.eigh(normal / np.outer(scale, scale))
    # Eigenvalues below this share of the largest are directions that the data do not distinguish;
    # nothing is fitted along them. Products of an order and a tone are good to a tenth of it.
    keep = eigenvalues > 1e-5 * eigenvalues[-1] if eigenvalues.size else eigenvalues > 0
    used = vectors[:, keep]
    return (used / eigenvalues[keep]) @ used.T / np.outer(scale, scale), int((~keep).sum())


def order_sums(steps: FloatArray, table: FloatArray, highest: int) -> ComplexArray:
    """Inner products of `steps` and the increments of exp(1j k alpha), k = 0 … `highest`.

    Summed by parts: increments of the exponential against the data are the exponential
    itself against the data's differences.
    """
    sums = np.zeros(highest + 1, dtype=np.complex128)
    # Long blocks: what a block costs besides its samples is that of a hundred thousand of them.
    for block in arrays.blocks(table.size, 4 * arrays.BLOCK):
        sums += angle_sums(table[block], _differences(steps, block), highest).conj()
    return sums


def sums_at_orders(steps: FloatArray, sampled: Sampling, orders: FloatArray) -> ComplexArray:
    """As `order_sums` at any orders, and times the table's place in its range besides, (2, orders).

    The place is counted from the middle, as a share of the range (in rad if that is below 1 rad).
    One pass serves all orders, each with exponentials of its own.
    """
    sums = np.zeros((2, orders.size), dtype=np.complex128)
    table = sampled.table
    if table is None or orders.size == 0:
        return sums
    middle, width = sampled.phase_range
    for block in arrays.blocks(table.size):
        alpha = table[block]
        weights = _differences(steps, block) * np.stack([np.ones(alpha.size), alpha - middle])
        for at, order in enumerate(orders):
            phase = order * alpha
            sums[:, at] += weights @ angle_series(phase, COSINE)
            sums[:, at] += 1j * (weights @ angle_series(phase, SINE))
    return np.asarray(sums / np.array([[1.0], [width]]))


def _differences(steps: FloatArray, samples: slice) -> FloatArray:
    """Each step less the next, at the sample between them; outside the record there are none."""
    beyond = int(samples.start == 0), int(samples.stop > steps.size)
    around = np.pad(steps[max(samples.start - 1, 0) : samples.stop], beyond)
    return np.asarray(around[:-1] - around[1:])


def _data_sums(
    steps: FloatArray, sampled: Sampling, components: Components, known_sums: ComplexArray | None
) -> ComplexArray:
    """(2 components,) of the steps and each component's phasor, then its derivative."""
    angles = components.orders.size
    sums = np.zeros(2 * components.size, dtype=np.complex128)
    table, multiples = sampled.table, components.multiples
    if table is not None and multiples.any():
        orders = components.orders[multiples].astype(np.int64)
        if known_sums is None or orders[-1] >= known_sums.size:
            known_sums = order_sums(steps, table, int(orders[-1]))
        sums[:angles][multiples] = known_sums[orders]
    loose = np.flatnonzero(~multiples)
    of_loose = sums_at_orders(steps, sampled, components.orders[loose])
    sums[loose], sums[components.size + loose] = of_loose
    if components.frequencies.size:
        plain, tilted = tone_sums(steps, components.frequencies)
        size, slope = tone_factors(components.frequencies, sampled.samples)
        sums[angles : components.size] = 1j * size * plain
        sums[components.size + angles :] = 1j * size * tilted + slope * plain
    return sums


# ---- earth orders ------------------------------------------------------------------


def earth_amplitudes(sampled: Sampling) -> FloatArray | None:
    """(orders,) largest amplitude, rad, that Earth rate on an unsteady table puts into each order.

    0 for order 1, in which Earth rate and the harmonic are one at a steady table (Eq. 16): what a
    steady table would make of it is taken out first, since with ripple in the rate neighbouring
    orders are not orthogonal to it and would not show beside it. None at rest.
    """
    if sampled.table is None:
        return None
    orders = np.arange(1.0, MOST_ORDERS + 1.0)
    # The table turns slowly beside the samples: some are enough, ten thousand at the least.
    stride = max(1, int(1.0 / (MOST_ORDERS * sampled.fastest + 1e-9)))
    stride = min(stride, max(1, sampled.samples // 10_000))
    angle, rate = arrays.every(sampled.table, stride), sampled.sample_rate / stride
    length = angle.size * mean_square_step(orders, speeds(angle)) / 2.0
    net = float(angle[-1] - angle[0]) / (angle.size - 1) * rate
    # Seconds in which the table turns by 1 rad on its way, if it does not go back and forth.
    steady = 1.0 / net if abs(net) > 0.5 * abs(mean_rate(angle, rate)) else 0.0

    def step(integrand: FloatArray, later: FloatArray, here: FloatArray, of: float) -> FloatArray:
        return integrand / rate - of * (later - here)

    largest = np.zeros(MOST_ORDERS)
    cosine, sine = arrays.elementwise(np.cos, angle), arrays.elementwise(np.sin, angle)
    for integrand, whole, times in ((cosine, sine, steady), (sine, cosine, -steady)):
        steps = arrays.elementwise(step, integrand[1:], whole[1:], whole[:-1], times)
        sums = order_sums(steps, angle, MOST_ORDERS)[1:]
        largest = np.maximum(largest, np.abs(sums) / np.maximum(length, np.finfo(float).tiny))
    largest[0] = 0.0
    return LARGEST_EARTH_RATE * largest
