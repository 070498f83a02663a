"""Which runs share a unit, a day or a rate, and which of these the runs can tell apart."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagnac.arrays import FloatArray

# Share of a squared length that rounding leaves of a direction that others already span.
_NOTHING: Final = 1e-10


@dataclass(frozen=True, kw_only=True, eq=False)
class Design:
    """Runs, and the labels that they share.

    Parameters
    ----------
    values
        (runs,) what was measured, on the scale on which effects add.
    factors
        By name of the factor, such as ``unit``, the label of each run. Equal labels are the same
        unit (day, rate). If the third day of one unit has nothing to do with that of another,
        give the two days two labels.
    variances
        (runs,) known variance of each value; zeros if nothing is known.

    Raises
    ------
    ValueError
        If lengths differ, a value is not finite, a variance is negative, or there are fewer than
        two runs.
    """

    values: FloatArray
    factors: Mapping[str, tuple[str, ...]]
    variances: FloatArray

    def __post_init__(self) -> None:
        count = self.values.size
        if self.values.ndim != 1 or count < 2:
            raise ValueError(f"values has shape {self.values.shape}; give two runs or more")
        if not np.all(np.isfinite(self.values)):
            raise ValueError("values holds a number that is not finite; leave such runs out")
        if self.variances.shape != (count,) or not np.all(self.variances >= 0.0):
            raise ValueError(f"variances must be {count} numbers that are zero or more")
        for name, labels in self.factors.items():
            if len(labels) != count:
                raise ValueError(f"factors: {name} has {len(labels)} labels for {count} values")

    @classmethod
    def of(
        cls,
        values: ArrayLike,
        factors: Mapping[str, tuple[str, ...]],
        variances: ArrayLike | None = None,
    ) -> "Design":
        """A design of anything that numpy takes for numbers; see the class."""
        numbers = np.asarray(values, dtype=np.float64)
        known = np.zeros(numbers.shape) if variances is None else np.asarray(variances, float)
        return cls(values=numbers, factors=dict(factors), variances=known)

    @cached_property
    def seen(self) -> tuple[str, ...]:
        """Factors whose variance the runs can tell from that of the others."""
        return tuple(name for name in self.factors if self.contrasts(name).shape[1] > 0)

    @cached_property
    def hidden(self) -> Mapping[str, str]:
        """The other factors, and why."""
        reasons = {}
        for name, labels in self.factors.items():
            if name in self.seen:
                continue
            levels = len(set(labels))
            if levels < 2:
                reasons[name] = f"all runs are of one {name}"
            elif levels == len(labels):
                reasons[name] = f"no two runs share a {name}, so that it cannot be told from runs"
            else:
                reasons[name] = f"its {levels} levels change only together with the other factors"
        return reasons

    def levels(self, name: str) -> tuple[str, ...]:
        """Labels of a factor, in order of appearance."""
        return tuple(dict.fromkeys(self.factors[name]))

    def incidence(self, name: str) -> FloatArray:
        """(runs, levels) 1 where a run is of a level."""
        levels = self.levels(name)
        labels = np.array([levels.index(label) for label in self.factors[name]])
        return np.asarray(labels[:, np.newaxis] == np.arange(len(levels)), dtype=np.float64)

    def contrasts(self, name: str) -> FloatArray:
        """(runs, degrees of freedom) orthonormal contrasts of a factor, free of all others.

        They span what the factor explains beside the mean and the other factors, the space of
        Henderson's third sum of squares.
        """
        others = [self.incidence(other) for other in self.factors if other != name]
        rest = _orthonormal(np.hstack([self._ones, *others]))
        own = self.incidence(name)
        left = _orthonormal(own - rest @ (rest.T @ own))
        if left.shape[1] + rest.shape[1] >= self.values.size and not np.any(self.variances):
            # Nothing is left to tell the factor from the scatter of single runs.
            return left[:, :0]
        return left

    @cached_property
    def residual_contrasts(self) -> FloatArray:
        """(runs, degrees of freedom) orthonormal contrasts free of the mean and all factors."""
        spanned = _orthonormal(
            np.hstack([self._ones, *(self.incidence(name) for name in self.factors)])
        )
        complete = np.linalg.qr(spanned, mode="complete")[0]
        return np.asarray(complete[:, spanned.shape[1] :])

    @property
    def _ones(self) -> FloatArray:
        return np.ones((self.values.size, 1))

    @property
    def typical_variance(self) -> float:
        """Median of the known variances."""
        return float(np.median(self.variances))

    @property
    def spread(self) -> float:
        """Standard deviation of the values, 1 if they are all equal."""
        found = float(np.std(self.values, ddof=1))
        return found if found > 0.0 and math.isfinite(found) else 1.0


def _orthonormal(columns: FloatArray) -> FloatArray:
    """Orthonormal basis of what some columns span."""
    left, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    kept = sizes**2 > _NOTHING * max(columns.shape[0], 1)
    return np.asarray(left[:, kept])
