"""Peaks above the noise floor."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import brentq

from sagnac.arrays import BooleanArray, ComplexArray, FloatArray
from sagnac.lines.components import Components
from sagnac.lines.joint_fit import ComponentFit
from sagnac.lines.products import Sampling
from sagnac.lines.turning import Turning
from sagnac.spectrum.floor import floor_scatter, noise_floor
from sagnac.spectrum.periodogram import periodogram

# Below this many cycles a record nothing can be told from the random walk.
LOWEST_CYCLES: Final = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spectrum:
    """Power of increments of an angle, and its noise floor.

    Attributes
    ----------
    power
        (2 bins - 1,) periodogram at whole and half bins, rad^2.
    floor
        (bins,) noise floor at the whole bins, rad^2.
    """

    power: FloatArray
    floor: FloatArray


def spectrum(steps: FloatArray) -> Spectrum:
    """`Spectrum` of increments, (samples - 1,) rad."""
    power = periodogram(steps, padding=2)
    return Spectrum(power=power, floor=noise_floor(power[::2]))


def floor_of(steps: FloatArray) -> FloatArray:
    """(bins,) `floor` of the `Spectrum` of increments, (samples - 1,) rad, and nothing else of it.

    The whole bins by themselves are half the transform.
    """
    return noise_floor(periodogram(steps))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Residue:
    """Increments of an angle in which lines are looked for.

    Attributes
    ----------
    steps
        (samples - 1,) increments, rad, without their mean.
    sampled
        When, and at which table angles, the angle was sampled.
    turning
        How the table turns; None at rest.
    threshold
        Ratio of power to floor that a line exceeds.
    spectrum
        Power of the increments and its floor.
    order_sums
        (orders + 1,) complex: inner products of the increments with those of exp(1j k alpha),
        k = 0 … `MOST_ORDERS`, as `joint_fit.order_sums` gives them; None at rest.
    """

    steps: FloatArray
    sampled: Sampling
    turning: Turning | None
    threshold: float
    spectrum: Spectrum
    order_sums: ComplexArray | None


def detection_threshold(bins: int, false_alarm: float) -> float:
    """Ratio of power to floor that noise exceeds anywhere with probability `false_alarm`.

    The maximum of a periodogram over continuous frequency, not over its bins alone:
    ``bins * sqrt(pi p / 3) * exp(-p) = false_alarm``, the mean number of upcrossings of
    level p by a chi-square field of two degrees of freedom (Rice's formula). The floor is only
    known with a relative error s (`spectrum.floor_scatter`): exp(-p) then averages to
    exp(-p + (s p)^2 / 2), which for a few thousand bins is a third more.

    Raises
    ------
    ValueError
        If `false_alarm` is not above zero.
    """
    if not false_alarm > 0.0:
        raise ValueError(f"false_alarm is {false_alarm}; give a probability above zero")
    scatter = floor_scatter(bins)
    return float(
        brentq(
            lambda p: (
                np.log(bins)
                + 0.5 * np.log(np.pi * p / 3.0)
                - p
                + 0.5 * (scatter * p) ** 2
                - np.log(false_alarm)
            ),
            1.0,
            100.0,
        )
    )


def floor_of_orders(orders: FloatArray, speed: FloatArray, floor: FloatArray) -> FloatArray:
    """(orders,) noise floor that each meets over the frequencies that it sweeps, by power.

    Parameters
    ----------
    orders
        Of table angle.
    speed
        (ranks,) speeds of the table, rad a sample.
    floor
        (bins,) noise floor, rad^2.
    """
    frequency = np.outer(orders, speed) / (2.0 * np.pi)
    weight = np.sin(np.pi * frequency) ** 2
    bins = np.minimum(frequency * (2.0 * (floor.size - 1)), floor.size - 1).astype(np.int64)
    total = weight.sum(axis=1)
    total[total == 0.0] = 1.0
    return np.asarray((floor[bins] * weight).sum(axis=1) / total)


def floors(components: Components, turns: Turning | None, floor: FloatArray) -> FloatArray:
    """(components,) noise floor at each component's own frequency, rad^2."""
    bins = np.rint(components.frequencies * (2.0 * (floor.size - 1))).astype(np.int64)
    in_time = floor[np.clip(bins, 0, floor.size - 1)]
    if turns is None or components.orders.size == 0:
        return in_time
    return np.concatenate([floor_of_orders(components.orders, turns.speeds, floor), in_time])


def significances(fit: ComponentFit, levels: FloatArray) -> FloatArray:
    """(components,) Wald statistic of each pair of amplitudes, chi-square with 2 dof.

    Parameters
    ----------
    fit
        The joint fit of all components.
    levels
        (components,) noise floor of each, rad^2.
    """
    pair = np.stack([fit.components.cosine, fit.components.sine], axis=1)
    block = fit.covariance[:, :2, :2]
    # A pseudo-inverse: if two components coincide, each direction counts once.
    precision = np.linalg.pinv(block, rcond=1e-9, hermitian=True)
    return np.asarray(np.einsum("ni,nij,nj->n", pair, precision, pair) / levels)


def significant(
    fit: ComponentFit, turns: Turning | None, floor: FloatArray, threshold: float
) -> Components:
    """The components that stand above the floor with all others fitted beside them.

    If two have moved to one place, the stronger one takes the line: it is one, and their
    amplitudes mean nothing.
    """
    significance = significances(fit, floors(fit.components, turns, floor))
    keep = significance > 2.0 * threshold
    keep &= _within_reach(fit.components, floor.size)
    keep &= ~_doubled(fit.components, significance, 0.0 if turns is None else turns.turns)
    return fit.components.select(keep)


def _within_reach(components: Components, bins: int) -> BooleanArray:
    """(components,) which lie where lines are looked for: below half a cycle, and not too low."""
    lowest = LOWEST_CYCLES / (2.0 * (bins - 1))
    frequencies = components.frequencies
    reach = np.ones(components.size, dtype=bool)
    reach[components.orders.size :] = (frequencies >= 0.75 * lowest) & (frequencies < 0.5)
    return reach


def _doubled(components: Components, significance: FloatArray, turns: float) -> BooleanArray:
    """(components,) which share their place, to half a cycle, with a stronger neighbour."""
    doubled = np.zeros(components.size, dtype=bool)
    angles = components.orders.size
    for places, begin in (
        (components.orders * turns, 0),
        (components.frequencies * (2.0 * components.center), angles),
    ):
        ascending = np.argsort(places)
        close = np.flatnonzero(np.diff(places[ascending]) < 0.5)
        for first, second in zip(ascending[close], ascending[close + 1], strict=True):
            pair = (begin + int(first), begin + int(second))
            doubled[min(pair, key=lambda index: float(significance[index]))] = True
    return doubled
