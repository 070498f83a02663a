"""Places in a record: the samples for which something holds, and the stretches between them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sagnac import series
from sagnac.arrays import BooleanArray, FloatArray, IntegerArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Tally:
    """How many places there are, and the first; -1 if there is none."""

    count: int
    first: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """Samples from `first` up to, and not including, `after`."""

    first: int
    after: int

    @property
    def samples(self) -> int:
        """How many there are."""
        return self.after - self.first


@dataclass(frozen=True, slots=True, kw_only=True)
class Places:
    """The samples of a series for which a test holds.

    They are found anew at each pass, and none are kept: in a bad record there are as many as it
    has samples.

    Attributes
    ----------
    values
        (samples,) of any length.
    test
        Given the values of a block and of `following` samples more, says of each sample of the
        block whether it is such a place.
    following
        Samples after one that `test` looks at to judge it.
    """

    values: FloatArray
    test: Callable[[FloatArray], BooleanArray]
    following: int = 0

    @property
    def _size(self) -> int:
        return int(self.values.size) - self.following

    def _within(self, block: slice) -> IntegerArray:
        here = self.test(self.values[block.start : block.stop + self.following])
        return np.asarray(block.start + np.flatnonzero(here))

    def all(self) -> IntegerArray:
        """All of them, ascending."""
        found = series.map(self._within, self._size, self.values)
        return np.concatenate([np.empty(0, dtype=np.int64), *found])

    def tally(self) -> Tally:
        """Count them."""

        def add(so_far: Tally, block: slice) -> Tally:
            here = self._within(block)
            first = int(here[0]) if so_far.count == 0 and here.size else so_far.first
            return Tally(count=so_far.count + here.size, first=first)

        return series.reduce(add, Tally(count=0, first=-1), self._size, self.values)

    def longest_between(self, samples: int, *, later: int = 0) -> Stretch:
        """The longest stretch of `samples` without any of them, the first if two are as long.

        Parameters
        ----------
        samples
            Length of the record.
        later
            By how many samples the record's bad sample lies behind the place: 1 for steps.
        """

        def add(so_far: "_Between", block: slice) -> "_Between":
            return so_far.and_then(self._within(block) + later)

        start = _Between(longest=Stretch(first=0, after=-1), edge=-1)
        between = series.reduce(add, start, self._size, self.values)
        return between.and_then(np.array([samples])).longest


@dataclass(frozen=True, slots=True, kw_only=True)
class _Between:
    """The longest stretch so far, and the last place before which it was looked for."""

    longest: Stretch
    edge: int

    def and_then(self, places: IntegerArray) -> "_Between":
        edges = np.concatenate(([self.edge], places))
        lengths = np.diff(edges) - 1
        if lengths.size == 0:
            return self
        at = int(np.argmax(lengths))
        longest = self.longest
        if lengths[at] > longest.samples:
            longest = Stretch(first=int(edges[at]) + 1, after=int(edges[at + 1]))
        return _Between(longest=longest, edge=int(edges[-1]))


def longest_between(samples: int, places: IntegerArray) -> Stretch:
    """The longest stretch of `samples` without one of `places`, which ascend."""
    start = _Between(longest=Stretch(first=0, after=-1), edge=-1)
    return start.and_then(places).and_then(np.array([samples])).longest


def is_not_finite(values: FloatArray) -> BooleanArray:
    """Whether values are NaN or infinite."""
    return ~np.isfinite(values)
