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

from sagnac.core.arrays import (
    BLOCK,
    BooleanArray,
    ComplexArray,
    FloatArray,
    IntegerArray,
    blocks,
    elementwise,
    every,
)
from sagnac.lines.components import Components
from sagnac.lines.products import inner_products, tone_factors
from sagnac.lines.sampling import MOST_ORDERS, Sampling, mean_square_step, speeds
from sagnac.spectrum.sums import angle_sums, tone_sums
from sagnac.table.kinematics import LARGEST_EARTH_RATE
from sagnac.table.turns import mean_rate

# ---- joint fit ---------------------------------------------------------------------

# Eigenvalues below this share of the largest (of the scaled normal matrix) are directions that
# the data do not distinguish; nothing is fitted along them. Products of an order and a tone are
# good to a tenth of it.
_COLLINEAR: Final = 1e-5
# A frequency moves by no more than this in one step, in radians of phase at the record's ends.
_LONGEST_STEP: Final = 1.0
# Samples in a block of sums at whole orders.
_LONG_BLOCK: Final = 4 * BLOCK


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

    Raises
    ------
    ValueError
        If there is not one covariance a component.
    """

    components: Components
    covariance: FloatArray
    collinear: int

    def __post_init__(self) -> None:
        if self.covariance.shape != (self.components.size, 3, 3):
            raise ValueError(
                f"covariance has shape {self.covariance.shape}; give ({self.components.size}, 3, 3)"
            )


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

    Raises
    ------
    ValueError
        If the sizes do not agree.

    References
    ----------
    The joint step is the cyclic refinement of NOMP (arXiv:1509.01942) done at once.
    """
    if steps.shape != (sampled.samples - 1,):
        raise ValueError(
            f"steps have shape {steps.shape}; {sampled.samples} samples have {sampled.samples - 1}"
        )
    if absent is not None and absent.shape != (components.size,):
        raise ValueError(f"absent has shape {absent.shape}; give ({components.size},)")
    tunable = np.concatenate([components.free, np.ones(components.frequencies.size, dtype=bool)])
    tuned = np.flatnonzero(tunable)
    # Every column of the regression is the real part of a factor times the increments of a
    # component's phasor, or of the phasor's derivative in frequency.
    phasor = np.concatenate([np.repeat(np.arange(components.size), 2), components.size + tuned])
    slope = 1j * components.phasor[tuned].conj()
    factor = np.concatenate([np.tile([1.0, -1.0j], components.size), slope])
    products = inner_products(sampled, components)
    places = np.ix_(phasor, phasor)
    normal = np.outer(factor, factor.conj()) * products.straight[places]
    normal += np.outer(factor, factor) * products.mirrored[places]
    inverse, collinear = _inverse(np.asarray(0.5 * normal.real))
    sums = _data_sums(steps, sampled, components, known_sums)
    solution = inverse @ (factor * sums[phasor]).real
    kept = 1.0 if absent is None else 1.0 - absent
    amplitudes = solution[: 2 * components.size].view(np.complex128)
    started = replace(components, phasor=amplitudes + kept * components.phasor)
    moved, covariance = _moved(started, tuned, sampled, solution[2 * components.size :], inverse)
    covariance.flags.writeable = False
    return ComponentFit(components=moved, covariance=covariance, collinear=collinear)


def _moved(
    started: Components,
    tuned: IntegerArray,
    sampled: Sampling,
    solution: FloatArray,
    inverse: FloatArray,
) -> tuple[Components, FloatArray]:
    """The components with the `tuned` frequencies and free orders moved, and `covariance`.

    The derivative in an order is about the middle of the table's range, and that in a frequency
    about mid-record, where it is uncorrelated with the phase. The phase origin of an angle
    component is alpha = 0, so that a move of its order turns its amplitudes, and an error of its
    order is one of its phase.
    """
    size, angles = started.size, started.orders.size
    middle, width = sampled.phase_range
    in_angle = tuned < angles
    unit = np.where(in_angle, 1.0 / width, 1.0 / sampled.samples)
    step = np.clip(solution, -_LONGEST_STEP, _LONGEST_STEP) * unit
    covariance = np.zeros((size, 3, 3))
    pairs = 2 * np.arange(size)[:, np.newaxis] + np.arange(2)
    covariance[:, :2, :2] = inverse[pairs[:, :, np.newaxis], pairs[:, np.newaxis, :]]
    members = np.column_stack([pairs[tuned], 2 * size + np.arange(tuned.size)])
    own = inverse[members[:, :, np.newaxis], members[:, np.newaxis, :]]
    own[:, 2, :] *= unit[:, np.newaxis]
    own[:, :, 2] *= unit[:, np.newaxis]
    covariance[tuned] = own
    places = np.concatenate([started.orders, started.frequencies])
    places[tuned] += step
    phasor = started.phasor.copy()
    for index, move in zip(tuned[in_angle], step[in_angle], strict=True):
        c, s = np.cos(move * middle), np.sin(move * middle)
        phasor[index] *= c + 1j * s
        lever = 1j * middle * phasor[index]
        turn = np.array([[c, -s, lever.real], [s, c, lever.imag], [0.0, 0.0, 1.0]])
        covariance[index] = turn @ covariance[index] @ turn.T
    orders, frequencies = np.split(places, [angles])
    return replace(started, orders=orders, frequencies=frequencies, phasor=phasor), covariance


def _inverse(normal: FloatArray) -> tuple[FloatArray, int]:
    """Inverse of the normal matrix, and the number of directions that were left out of it."""
    scale = np.sqrt(np.maximum(np.diag(normal), 0.0))
    scale[scale == 0.0] = 1.0
    eigenvalues, vectors = scipy.linalg.eigh(normal / np.outer(scale, scale))
    keep = eigenvalues > _COLLINEAR * eigenvalues[-1] if eigenvalues.size else eigenvalues > 0
    used = vectors[:, keep]
    inverse = (used / eigenvalues[keep]) @ used.T
    return inverse / np.outer(scale, scale), int((~keep).sum())


def order_sums(steps: FloatArray, table: FloatArray, highest: int) -> ComplexArray:
    """Inner products of `steps` and the increments of exp(1j k alpha), k = 0 … `highest`.

    Summed by parts: increments of the exponential against the data are the exponential
    itself against the data's differences.
    """
    sums = np.zeros(highest + 1, dtype=np.complex128)
    # Long blocks: what a block costs besides its samples is that of a hundred thousand of them.
    for block in blocks(table.size, _LONG_BLOCK):
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
    for block in blocks(table.size):
        alpha = table[block]
        weights = _differences(steps, block) * np.stack([np.ones(alpha.size), alpha - middle])
        for at, order in enumerate(orders):
            sums[:, at] += weights @ np.exp(1j * order * alpha)
    return np.asarray(sums / np.array([[1.0], [width]]))


def _differences(steps: FloatArray, samples: slice) -> FloatArray:
    """Each step less the next, at the sample between them; outside the record there are none."""
    beyond = int(samples.start == 0), int(samples.stop > steps.size)
    around = np.pad(steps[max(samples.start - 1, 0) : samples.stop], beyond)
    return np.asarray(around[:-1] - around[1:])


def _data_sums(
    steps: FloatArray,
    sampled: Sampling,
    components: Components,
    known_sums: ComplexArray | None,
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
    sums[loose], sums[components.size + loose] = sums_at_orders(
        steps, sampled, components.orders[loose]
    )
    if components.frequencies.size:
        plain, tilted = tone_sums(steps, components.frequencies)
        size, slope = tone_factors(components.frequencies, sampled.samples)
        sums[angles : components.size] = 1j * size * plain
        sums[components.size + angles :] = 1j * size * tilted + slope * plain
    return sums


# ---- earth orders ------------------------------------------------------------------

# Angles that are kept at the least.
_FEWEST_ANGLES: Final = 10_000


def earth_amplitudes(sampled: Sampling) -> FloatArray | None:
    """(orders,) largest amplitude, rad, that Earth rate on an unsteady table puts into each order.

    0 for order 1, in which Earth rate and the harmonic are one at a steady table (Eq. 16): what a
    steady table would make of it is taken out first, since with ripple in the rate neighbouring
    orders are not orthogonal to it and would not show beside it. None at rest.
    """
    if sampled.table is None:
        return None
    orders = np.arange(1.0, MOST_ORDERS + 1.0)
    # The table turns slowly beside the samples.
    stride = max(1, int(1.0 / (MOST_ORDERS * sampled.fastest + 1e-9)))
    stride = min(stride, max(1, sampled.samples // _FEWEST_ANGLES))
    angle, rate = every(sampled.table, stride), sampled.sample_rate / stride
    length = angle.size * mean_square_step(orders, speeds(angle)) / 2.0
    net = float(angle[-1] - angle[0]) / (angle.size - 1) * rate
    # Seconds in which the table turns by 1 rad on its way, if it does not go back and forth.
    steady = 1.0 / net if abs(net) > 0.5 * abs(mean_rate(angle, rate)) else 0.0

    def step(integrand: FloatArray, later: FloatArray, here: FloatArray, of: float) -> FloatArray:
        return integrand / rate - of * (later - here)

    largest = np.zeros(MOST_ORDERS)
    cosine, sine = elementwise(np.cos, angle), elementwise(np.sin, angle)
    for integrand, whole, times in ((cosine, sine, steady), (sine, cosine, -steady)):
        steps = elementwise(step, integrand[1:], whole[1:], whole[:-1], times)
        sums = order_sums(steps, angle, MOST_ORDERS)[1:]
        largest = np.maximum(largest, np.abs(sums) / np.maximum(length, np.finfo(float).tiny))
    largest[0] = 0.0
    return LARGEST_EARTH_RATE * largest
