"""Least squares in increments of averages, beside noise of each reading and an angle that walks.

The two noises are told from the spectrum of what is left, and the fit weighs frequencies by them
(Whittle's likelihood), those at which lines stand less. Errors are those of leaving out one group
of frequencies at a time.
"""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.fft import fft
from scipy.linalg import solve_triangular
from scipy.optimize import nnls

from sagnac.core.arrays import FloatArray, IntegerArray, median

# Times that an ordinate may stand above the noise; one that stands higher counts for less, as under
# a distribution with long tails: it is of a line that no column holds.
_LINE: Final = 10.0
# Times that noise and coefficients are fitted, each beside the other.
_ROUNDS: Final = 6
# Share of a record at either end over which a fit fades. With a hundredth to a seventh the walk
# beside a strong line is as well known.
_END: Final = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Whitened:
    """Least squares in increments, beside noise of each reading and an angle that walks.

    Attributes
    ----------
    of_groups, rights
        (groups, columns, columns) and (groups, columns) of the normal equations, group of
        frequencies by group, for the columns divided by `scale`.
    normal
        Sum of the first, with the prior's ridge.
    scale
        (columns,).
    readings, walk
        Variance of the noise of an average, rad^2, and of a step of the walk.
    deviance
        -2 log likelihood of what is left, except for a constant.
    """

    of_groups: FloatArray
    rights: FloatArray
    normal: FloatArray
    scale: FloatArray
    readings: float
    walk: float
    deviance: float

    @property
    def values(self) -> FloatArray:
        """(columns,) coefficients."""
        return np.asarray(np.linalg.solve(self.normal, self.rights.sum(axis=0)) / self.scale)

    @property
    def freedom(self) -> float:
        """Coefficients that the data, not the prior, decide."""
        return float(np.trace(np.linalg.solve(self.normal, self.of_groups.sum(axis=0))))

    @property
    def covariance(self) -> FloatArray:
        """(columns, columns), that of leaving out two neighbours at a time with that of the noise.

        A line that no column holds, at an order at which the table's rate has its ripple, looks
        like a delay as long as that frequency is in (delete-a-group jackknife). It may stand on the
        edge of two groups; each is left out twice.
        """
        pairs, rights = (both[1:] + both[:-1] for both in (self.of_groups, self.rights))
        left = (self.rights.sum(axis=0) - rights)[..., np.newaxis]
        apart = np.linalg.solve(self.normal - pairs, left)[..., 0] - self.values * self.scale
        jackknife = (0.5 - 1.0 / self.rights.shape[0]) * (apart.T @ apart)
        scales = np.outer(self.scale, self.scale)
        return np.asarray((jackknife + np.linalg.inv(self.normal)) / scales)


def whitened(
    target: FloatArray,
    columns: FloatArray,
    prior: FloatArray | float,
    noises: tuple[float, float] | None = None,
    *,
    groups: int = 16,
    crowded: bool = False,
    faded: bool = False,
) -> Whitened:
    """Coefficients of columns in a target, both taken as increments about their mean.

    What grows evenly with time is left out, and needs no column.

    Parameters
    ----------
    target
        (averages,) rad.
    columns
        (columns, averages); their memory is used for their transforms, so that they are lost.
    prior
        (columns,) standard deviation of each coefficient about zero, inf for none.
    noises
        `Whitened.readings` and `Whitened.walk` if they are known: fits that are compared need the
        same.
    groups
        A decade of frequency, for `Whitened.covariance`; 0 without it.
    crowded
        Whether columns may be so many that they take most of the noise of some ordinates. The noise
        of these is then told from what is left of it.
    faded
        Whether the ends count less. Lines that no column holds leak to every frequency where a
        record is cut off: over two hours with strong orders the walk was read a thousand times too
        large, and delays up to ten times less precisely. What is at the ends alone is not known.
    """
    count = target.size - 1
    # By what varies: beside its mean step the angle of a steady table hardly does. Two columns at
    # a time: those of a day, and all that is made of them on the way, take half a gigabyte.
    scale, ready = np.ones(columns.shape[0]), columns[:, : count // 2 * 2]
    for first in range(0, scale.size, 2):
        own = slice(first, first + 2)
        steps = np.diff(columns[own])
        steps = _faded(steps) if faded else steps
        spread = np.std(steps, axis=1)
        scale[own] = np.where(spread > 0.0, spread, 1.0)
        ready[own] = _ordinates(steps / scale[own, np.newaxis])
    steps = np.diff(target)[np.newaxis]
    wanted = _ordinates(_faded(steps) if faded else steps)[0]
    # Spectra of increments of averages: white noise, and a walk, of unit size. Averages of a walk,
    # taken over all the time between them, move less than the walk at the highest frequencies.
    white = 4.0 * np.sin(np.pi * np.fft.rfftfreq(count)[1:]) ** 2
    laws = np.stack([white, 1.0 - white / 6.0])
    left, kept = wanted, np.ones(white.size)
    # Noise and coefficients are fitted in turn.
    for number in range(_ROUNDS):
        power = _squares(left) / count
        readings, walk = noises or _two_noises(power, laws, kept, has_lines=faded)
        expected = np.maximum(np.array([readings, walk]) @ laws, 1e-300)
        # Each ordinate but the mean's stands for two.
        weight = 2.0 / (expected * count) / (1.0 + power / expected / _LINE)
        of_groups, rights = _normal_equations(ready, wanted, weight, groups)
        normal = of_groups.sum(axis=0)
        # A column that lives in one group alone is undetermined without the ridge.
        normal += np.diag(1.0 / (prior * scale) ** 2 + 1e-9 * np.diag(normal))
        left = wanted - np.linalg.solve(normal, rights.sum(axis=0)) @ ready
        if crowded and noises is None and number < _ROUNDS - 1:
            root = np.linalg.cholesky(normal)
            taken = np.square(solve_triangular(root, ready, lower=True)).sum(axis=0)
            kept = 1.0 - 0.5 * weight * taken.reshape(-1, 2).sum(axis=1)
    over = _squares(left) / count / expected / _LINE
    return Whitened(
        of_groups=of_groups,
        rights=rights,
        normal=normal,
        scale=scale,
        readings=readings,
        walk=walk,
        deviance=2.0 * float(np.sum(np.log(expected) + _LINE * np.log1p(over))),
    )


def _faded(steps: FloatArray) -> FloatArray:
    """(rows, steps) about their mean, under a cosine at both ends."""
    place = (np.arange(steps.shape[1]) + 0.5) / steps.shape[1]
    window = np.sin(0.5 * np.pi * np.minimum(np.minimum(place, 1.0 - place) / _END, 1.0)) ** 2
    steps -= steps.mean(axis=1, keepdims=True)
    return np.asarray(steps * (window / math.sqrt(float(np.mean(window**2)))))


def _ordinates(rows: FloatArray) -> FloatArray:
    """(rows, ordinates) of one or two rows about their mean, their complex parts side by side.

    Two go into one transform as real and imaginary part: it takes long if their length is a prime.
    """
    half = rows.shape[1] // 2
    packed = fft(rows[0] + 1j * rows[-1])
    ahead, behind = packed[1 : half + 1], packed[: -half - 1 : -1].conj()
    first, last = 0.5 * (ahead + behind), -0.5j * (ahead - behind)
    return np.stack([first, last])[: rows.shape[0]].view(np.float64)


def _squares(ordinates: FloatArray) -> FloatArray:
    """(ordinates,) squares of complex ordinates, their parts side by side."""
    return np.asarray(np.square(ordinates).reshape(-1, 2).sum(axis=1))


def _normal_equations(
    columns: FloatArray, target: FloatArray, weight: FloatArray, groups: int
) -> tuple[FloatArray, FloatArray]:
    """`Whitened.of_groups` and `Whitened.rights` of real coefficients.

    Complex ordinates have their parts side by side, since no more than the real part of their
    products counts: (columns, 2 ordinates) and (2 ordinates,), and (ordinates,) of weight.
    """
    normals, rights = [], []
    root = np.sqrt(np.repeat(weight, 2))
    for low, high in pairwise(2 * _edges(target.size // 2, groups)):
        own = columns[:, low:high] * root[low:high]
        normals.append(own @ own.T)
        rights.append(own @ (target[low:high] * root[low:high]))
    return np.stack(normals), np.stack(rights)


def _edges(size: int, parts_a_decade: int) -> IntegerArray:
    """Ends of groups of ordinates that grow with frequency."""
    count = max(2, round(parts_a_decade * math.log10(size + 1)))
    return np.unique(np.geomspace(1, size + 1, count).astype(np.int64)) - 1


def _two_noises(
    power: FloatArray, laws: FloatArray, kept: FloatArray, *, has_lines: bool
) -> tuple[float, float]:
    """Levels of noise of each reading and of an angle that walks, from medians of bins.

    By the gamma likelihood, with as much weight to a bin as it has ordinates, up to thirty: the
    coefficients of a fit take most of the power of the few lowest ordinates with them, and a level
    that is too low there must not count for more than those that are right. (ordinates,) `kept` is
    the part of the noise that many coefficients leave; an ordinate counts by it. If orders are
    lines in time, their skirts may fill bins, which count less the higher they stand.
    """
    # Eight bins a decade tell the two noises.
    pairs = list(pairwise(_edges(power.size, 8)))
    # The median of a chi-square of two degrees of freedom is ln 2 of its mean.
    level = np.array([median(power[low:high]) for low, high in pairs]) / math.log(2.0)
    means = np.stack([(laws * kept)[:, low:high].mean(axis=1) for low, high in pairs])
    level = np.maximum(level, 1e-300)
    sizes = np.array([kept[low:high].sum() for low, high in pairs])
    # From some thirty ordinates on a bin counts no more.
    weight = np.sqrt(sizes / (1.0 + sizes / 30.0))
    noises, expected = np.zeros(2), level
    for _ in range(12):
        scale = weight / expected
        if has_lines:
            scale /= np.sqrt(1.0 + level / expected / _LINE)
        noises = nnls(means * scale[:, np.newaxis], level * scale)[0]
        expected = np.maximum(means @ noises, 1e-300)
    return float(noises[0]), float(noises[1])
