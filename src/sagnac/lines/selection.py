"""What stands above the noise floor, and what does not."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import brentq

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.lines.components import Components
from sagnac.lines.joint_fit import ComponentFit
from sagnac.lines.products import Sampling
from sagnac.spectrum.floor import floor_scatter, noise_floor
from sagnac.spectrum.periodogram import periodogram
from sagnac.table.turns import full_turns

# Below this many cycles a record nothing can be told from the random walk.
LOWEST_CYCLES: Final = 4
# Samples over which a table speed is taken.
_SPEED_SPAN: Final = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Residue:
    """Increments of an angle in which lines are looked for.

    Attributes
    ----------
    steps
        (samples - 1,) increments, rad, without their mean.
    sampled
        When, and at which table angles, the angle was sampled.
    threshold
        Ratio of power to floor that a line exceeds.
    power
        (2 bins - 1,) periodogram at whole and half bins, rad^2.
    floor
        (bins,) noise floor at the whole bins, rad^2.
    """

    steps: FloatArray
    sampled: Sampling
    threshold: float
    power: FloatArray
    floor: FloatArray


def residue(steps: FloatArray, sampled: Sampling, threshold: float) -> Residue:
    """`Residue` of increments, (samples - 1,) rad."""
    power = periodogram(steps, padding=2)
    return Residue(
        steps=steps,
        sampled=sampled,
        threshold=threshold,
        power=power,
        floor=noise_floor(power[::2]),
    )


def detection_threshold(bins: int, false_alarm: float) -> float:
    """Ratio of power to floor that noise exceeds anywhere with probability `false_alarm`.

    The maximum of a periodogram over continuous frequency, not over its bins alone:
    ``bins * sqrt(pi p / 3) * exp(-p) = false_alarm``, the mean number of upcrossings of
    level p by a chi-square field of two degrees of freedom (Rice's formula). Where the floor
    is only known with a relative error s, as `spectrum.noise_floor` knows it, exp(-p)
    averages to exp(-p + (s p)^2 / 2), which for a few thousand bins is a third more.

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


def speeds(alpha: FloatArray) -> FloatArray:
    """Table speeds, rad a sample, at a few hundred evenly spaced ranks."""
    apart = max(1, alpha.size // 4000)
    # Over many samples a swing of the table would average out.
    span = min(apart, _SPEED_SPAN)
    places = np.arange(0, alpha.size - span, apart)
    speed = np.sort(np.abs(series.at(alpha, places + span) - series.at(alpha, places))) / span
    return speed[np.linspace(0, speed.size - 1, min(200, speed.size)).astype(np.int64)]


def mean_square_step(orders: FloatArray, speed: FloatArray) -> FloatArray:
    """Mean square increment of exp(i k alpha), for each order."""
    return np.asarray((4.0 * np.sin(np.outer(orders, speed) / 2.0) ** 2).mean(axis=1))


def floor_of_orders(orders: FloatArray, speed: FloatArray, floor: FloatArray) -> FloatArray:
    """Noise floor that each order meets: over the frequencies it sweeps, weighted by power."""
    frequency = np.outer(orders, speed) / (2.0 * np.pi)
    weight = np.sin(np.pi * frequency) ** 2
    bins = np.minimum(frequency * (2.0 * (floor.size - 1)), floor.size - 1).astype(np.int64)
    total = weight.sum(axis=1)
    total[total == 0.0] = 1.0
    return np.asarray((floor[bins] * weight).sum(axis=1) / total)


def floors(components: Components, alpha: FloatArray | None, floor: FloatArray) -> FloatArray:
    """(components,) noise floor at each component's own frequency."""
    bins = np.rint(components.frequencies * (2.0 * (floor.size - 1))).astype(np.int64)
    in_time = floor[np.clip(bins, 0, floor.size - 1)]
    if alpha is None or components.orders.size == 0:
        return in_time
    return np.concatenate([floor_of_orders(components.orders, speeds(alpha), floor), in_time])


def significances(fit: ComponentFit, levels: FloatArray) -> FloatArray:
    """(components,) Wald statistic of each pair of amplitudes, chi-square with 2 dof."""
    pair = np.stack([fit.components.cosine, fit.components.sine], axis=1)
    block = fit.covariance[:, :2, :2]
    # A pseudo-inverse: of two components that coincide, each direction counts once.
    precision = np.linalg.pinv(block, rcond=1e-9, hermitian=True)
    return np.asarray(np.einsum("ni,nij,nj->n", pair, precision, pair) / levels)


def significant(
    fit: ComponentFit, alpha: FloatArray | None, floor: FloatArray, threshold: float
) -> Components:
    """The components that stand above the floor with all others fitted beside them."""
    levels = floors(fit.components, alpha, floor)
    lowest = LOWEST_CYCLES / (2.0 * (floor.size - 1))
    significance = significances(fit, levels)
    keep = significance > 2.0 * threshold
    in_time = slice(fit.components.orders.size, None)
    frequencies = fit.components.frequencies
    keep[in_time] &= (frequencies >= 0.75 * lowest) & (frequencies < 0.5)
    # Two that moved to one place share one line between them, with amplitudes that mean nothing:
    # the stronger takes it.
    turns = 0.0 if alpha is None else full_turns(alpha)
    angles = fit.components.orders.size
    for places, begin in (
        (fit.components.orders * turns, 0),
        (frequencies * (2.0 * fit.components.center), angles),
    ):
        ascending = np.argsort(places)
        close = np.flatnonzero(np.diff(places[ascending]) < 0.5)
        for first, second in zip(ascending[close], ascending[close + 1], strict=True):
            pair = (begin + int(first), begin + int(second))
            keep[min(pair, key=lambda index: float(significance[index]))] = False
    return fit.components.select(keep)
