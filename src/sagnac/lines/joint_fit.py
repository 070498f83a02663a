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
    empty,
    every,
)
from sagnac.lines.components import (
    MOST_ORDERS,
    Components,
    Turning,
    mean_square_step,
    phase_multiples,
    speeds,
)
from sagnac.lines.products import Sampling, inner_products, phase_range, tone_factors
from sagnac.spectrum.sums import angle_sums
from sagnac.spectrum.sums import tone_sums as sums_of_tones
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
        `sampling` of the record.
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
    unknowns = unknowns_of(components)
    inverse, collinear = _inverse(normal_matrix(sampled, components, unknowns))
    sums = _data_sums(steps, sampled, components, known_sums)
    solution = inverse @ (unknowns.factor * sums[unknowns.phasor]).real
    kept = np.ones(components.size) if absent is None else 1.0 - absent
    amplitudes = solution[: 2 * components.size].reshape(-1, 2)
    started = replace(
        components,
        cosine=amplitudes[:, 0] + kept * components.cosine,
        sine=amplitudes[:, 1] + kept * components.sine,
    )
    return _moved(
        started,
        unknowns,
        sampled,
        solution=solution,
        inverse=inverse,
        collinear=collinear,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Unknowns:
    """Unknowns of a joint step: the cosine and sine of every component, then what is tuned.

    Every column of the regression is the real part of a factor times the increments of a
    component's phasor, or of the phasor's derivative in frequency.

    Attributes
    ----------
    tuned
        (tuned,) components whose frequency or order is fitted.
    phasor
        (unknowns,) which of the phasors and derivatives of `InnerProducts` each one goes with.
    factor
        (unknowns,) what that is multiplied by.
    """

    tuned: IntegerArray
    phasor: IntegerArray
    factor: ComplexArray


def unknowns_of(components: Components) -> Unknowns:
    """The unknowns of a joint step of these components."""
    tunable = np.concatenate([components.free, np.ones(components.frequencies.size, dtype=bool)])
    tuned = np.flatnonzero(tunable)
    return Unknowns(
        tuned=tuned,
        phasor=np.concatenate([np.repeat(np.arange(components.size), 2), components.size + tuned]),
        factor=np.concatenate(
            [
                np.tile([1.0, -1.0j], components.size),
                components.sine[tuned] + 1j * components.cosine[tuned],
            ]
        ),
    )


def normal_matrix(sampled: Sampling, components: Components, unknowns: Unknowns) -> FloatArray:
    """(unknowns, unknowns) inner products of the columns of a joint step."""
    products = inner_products(sampled, components)
    places = np.ix_(unknowns.phasor, unknowns.phasor)
    factor = unknowns.factor
    total = (
        np.outer(factor, factor.conj()) * products.straight[places]
        + np.outer(factor, factor) * products.mirrored[places]
    )
    return np.asarray(0.5 * total.real)


def _moved(
    started: Components,
    unknowns: Unknowns,
    sampled: Sampling,
    *,
    solution: FloatArray,
    inverse: FloatArray,
    collinear: int,
) -> ComponentFit:
    """The fit with its frequencies and free orders moved by the solution.

    The derivative in an order is about the middle of the table's range (`phase_range`), and that in
    a frequency about mid-record, where it is uncorrelated with the phase. The phase origin of an
    angle component is alpha = 0, so that a move of its order turns its amplitudes, and an error of
    its order is one of its phase.
    """
    angles = started.orders.size
    orders, frequencies = started.orders.copy(), started.frequencies.copy()
    cosine, sine = started.cosine.copy(), started.sine.copy()
    middle, width = phase_range(sampled)
    covariance = np.zeros((started.size, 3, 3))
    for index in range(started.size):
        pair = slice(2 * index, 2 * index + 2)
        covariance[index, :2, :2] = inverse[pair, pair]
    for row, index in enumerate(unknowns.tuned.tolist(), start=2 * started.size):
        in_angle = index < angles
        unit = 1.0 / (width if in_angle else sampled.samples)
        step = float(np.clip(solution[row], -_LONGEST_STEP, _LONGEST_STEP)) * unit
        members = np.array([2 * index, 2 * index + 1, row])
        scale = np.array([1.0, 1.0, unit])
        own = inverse[np.ix_(members, members)] * np.outer(scale, scale)
        if in_angle:
            orders[index] += step
            c, s = np.cos(step * middle), np.sin(step * middle)
            a, b = cosine[index], sine[index]
            cosine[index], sine[index] = a * c - b * s, b * c + a * s
            turn = np.array(
                [[c, -s, -middle * sine[index]], [s, c, middle * cosine[index]], [0.0, 0.0, 1.0]]
            )
            own = turn @ own @ turn.T
        else:
            frequencies[index - angles] += step
        covariance[index] = own
    covariance.flags.writeable = False
    return ComponentFit(
        components=replace(
            started, orders=orders, frequencies=frequencies, cosine=cosine, sine=sine
        ),
        covariance=covariance,
        collinear=collinear,
    )


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
        strengths = _differences(steps, block.start, block.stop)
        sums += angle_sums(table[block], strengths, highest).conj()
    return sums


def sums_at_orders(steps: FloatArray, sampled: Sampling, orders: FloatArray) -> ComplexArray:
    """As `order_sums` at any orders, and times the table's place in its range besides, (2, orders).

    The place is counted from the middle, as a share of the range (in rad if that is below 1 rad).
    One pass serves all orders, each with exponentials of its own.
    """
    table = sampled.table
    if table is None:
        return np.zeros((2, orders.size), dtype=np.complex128)
    middle, range_ = phase_range(sampled)
    sums = np.zeros((2, orders.size), dtype=np.complex128)
    for block in blocks(table.size):
        strengths, alpha = _differences(steps, block.start, block.stop), table[block]
        lagged = strengths * ((alpha - middle) / range_)
        for at, order in enumerate(orders):
            phasor = np.exp(1j * order * alpha)
            sums[:, at] += strengths @ phasor, lagged @ phasor
    return sums


def tone_sums(steps: FloatArray, frequencies: FloatArray) -> ComplexArray:
    """Sums of `steps` times exp(2j pi f x), and times 2 pi x / samples besides, (2, tones).

    x is the middle of each step, in samples from mid-record.
    """
    samples = steps.size + 1
    return sums_of_tones(steps, frequencies, 0.5 * (steps.size - 1), lag_unit=2.0 * np.pi / samples)


def _differences(steps: FloatArray, start: int, stop: int) -> FloatArray:
    """Each step less the next, at the sample between them; outside the record there are none."""
    before = steps[max(start - 1, 0) : stop - 1]
    after = steps[start:stop]
    if start == 0:
        before = np.concatenate([[0.0], before])
    if after.size < before.size:
        after = np.append(after, 0.0)
    return before - after


def _data_sums(
    steps: FloatArray,
    sampled: Sampling,
    components: Components,
    known_sums: ComplexArray | None,
) -> ComplexArray:
    """(2 components,) of the steps and each component's phasor, then its derivative."""
    angles = components.orders.size
    sums = np.zeros(2 * components.size, dtype=np.complex128)
    table = sampled.table
    if angles and table is not None:
        multiples = phase_multiples(components)
        if multiples.any():
            chosen = np.flatnonzero(multiples)
            orders = components.orders[chosen].astype(np.int64)
            if known_sums is None or orders[-1] >= known_sums.size:
                known_sums = order_sums(steps, table, int(orders[-1]))
            sums[chosen] = known_sums[orders]
        loose = np.flatnonzero(~multiples)
        if loose.size:
            plain, tilted = sums_at_orders(steps, sampled, components.orders[loose])
            sums[loose], sums[components.size + loose] = plain, tilted
    if components.frequencies.size:
        plain, tilted = tone_sums(steps, components.frequencies)
        size, slope = tone_factors(components.frequencies, sampled.samples)
        sums[angles : components.size] = 1j * size * plain
        sums[components.size + angles :] = 1j * size * tilted + slope * plain
    return sums


# ---- earth orders ------------------------------------------------------------------

# Angles that are kept at the least.
_FEWEST_ANGLES: Final = 10_000


def earth_amplitudes(turns: Turning) -> FloatArray:
    """(orders,) largest amplitude, rad, that Earth rate on an unsteady table puts into each order.

    0 for order 1, in which Earth rate and the harmonic are one at a steady table (Eq. 16).
    """
    orders = np.arange(1.0, MOST_ORDERS + 1.0)
    angle, rate = _thinned(turns)
    length = angle.size * mean_square_step(orders, speeds(angle)) / 2.0
    steady = _steady_time(angle, rate)
    largest = np.zeros(MOST_ORDERS)
    for function, whole, sign in ((np.cos, np.sin, 1.0), (np.sin, np.cos, -1.0)):
        steps = empty(angle.size - 1)
        for block in blocks(steps.size):
            here = angle[block.start : block.stop + 1]
            steps[block] = function(here[1:]) / rate - sign * steady * np.diff(whole(here))
        sums = order_sums(steps, angle, MOST_ORDERS)[1:]
        largest = np.maximum(largest, np.abs(sums) / np.maximum(length, np.finfo(float).tiny))
    largest[0] = 0.0
    return LARGEST_EARTH_RATE * largest


def _thinned(turns: Turning) -> tuple[FloatArray, float]:
    """Table angles, rad, at a lower rate, Hz: the table turns slowly beside the samples."""
    stride = max(1, int(1.0 / (MOST_ORDERS * turns.fastest + 1e-9)))
    stride = min(stride, max(1, turns.table.size // _FEWEST_ANGLES))
    return every(turns.table, stride), turns.sample_rate / stride


def _steady_time(table: FloatArray, rate: float) -> float:
    """Seconds in which the table turns by 1 rad on its way; 0 if it goes back and forth.

    Order 1 is what a steady table would make of Earth rate. It is taken out first: with ripple in
    the rate neighbouring orders are not orthogonal to it and would not show beside it.
    """
    net = float(table[-1] - table[0]) / (table.size - 1) * rate
    return 1.0 / net if abs(net) > 0.5 * abs(mean_rate(table, rate)) else 0.0
