"""A series at any zoom: lowest and highest value of blocks, of blocks of blocks, and so on."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# Samples in a block of the lowest layer, and blocks of one layer in a block of the next.
BLOCK: Final = 64
STEP: Final = 4
# Samples that are worked on at once: a megabyte, which stays in the cache.
_AT_ONCE: Final = 2**17


@dataclass(frozen=True, slots=True, kw_only=True)
class Extremes:
    """Lowest and highest value of neighbouring blocks.

    Attributes
    ----------
    first
        (blocks,) number of the first sample of each.
    low, high
        (blocks,); NaN if a block holds no number.
    """

    first: NDArray[np.int64]
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pyramid:
    """A series of which any stretch is drawn in time that does not depend on its length.

    Attributes
    ----------
    values
        (samples,) as they are.
    factor
        What a value is multiplied with.
    differenced
        Whether a sample stands for what the value grew by since the sample before; the first
        stands for what the second does.
    layers
        Lowest and highest values of blocks of 64, 256, 1024 … samples: (2, blocks) each.
    mean, deviation
        Of all numbers, as they are drawn; NaN if there is none.
    """

    values: FloatArray
    factor: float
    differenced: bool
    layers: tuple[FloatArray, ...] = ()
    mean: float = math.nan
    deviation: float = math.nan

    @classmethod
    def of(cls, values: FloatArray, *, factor: float = 1.0, differenced: bool = False) -> "Pyramid":
        """The pyramid of a series.

        ValueError if there is no sample.
        """
        if values.ndim != 1 or not values.size:
            raise ValueError(f"values have shape {values.shape}; give one sample or more")
        bare = cls(values=values, factor=factor, differenced=differenced)
        parts, moments = [], []
        for start in range(0, values.size, _AT_ONCE):
            drawn = bare.samples(start, min(start + _AT_ONCE, values.size))
            parts.append(_extremes(drawn, BLOCK))
            moments.append(_moments(drawn))
        layers = [np.concatenate(parts, axis=1)]
        while layers[-1].shape[1] > STEP:
            low, high = layers[-1]
            layers.append(np.stack([_extremes(low, STEP)[0], _extremes(high, STEP)[1]]))
        mean, deviation = _joined(np.array(moments))
        return replace(bare, layers=tuple(layers), mean=mean, deviation=deviation)

    def times(self, size: float) -> "Pyramid":
        """The same in another unit."""
        return replace(
            self,
            factor=size * self.factor,
            layers=tuple(size * one for one in self.layers),
            mean=size * self.mean,
            deviation=size * self.deviation,
        )

    def samples(self, start: int, stop: int) -> FloatArray:
        """The values of some samples, as they are drawn."""
        if not self.differenced:
            return self.factor * np.asarray(self.values[start:stop])
        steps = np.diff(self.values[max(start - 1, 0) : max(stop, 2)])
        if start == 0:
            steps = np.concatenate([steps[:1], steps])[:stop] if steps.size else np.zeros(1)
        return np.multiply(steps, self.factor, out=steps)

    def window(self, start: int, stop: int, most: int) -> Extremes:
        """Lowest and highest values between two samples.

        Parameters
        ----------
        start, stop
            First sample and the one after the last; what lies outside the series is left out.
        most
            Blocks at most, about: blocks that lie only partly inside are given whole.

        ValueError if no sample lies inside, or no block is asked for.
        """
        start, stop = max(start, 0), min(stop, self.values.size)
        if not start < stop or most < 1:
            raise ValueError(f"no sample of {self.values.size} lies in {start}:{stop}")
        if stop - start <= most:
            values = self.samples(start, stop)
            return Extremes(first=np.arange(start, stop), low=values, high=values)
        wanted = (stop - start) / most
        if wanted < BLOCK:
            size = int(np.ceil(wanted))
            first = start // size * size
            low, high = _extremes(self.samples(first, stop), size)
            return Extremes(first=first + size * np.arange(low.size), low=low, high=high)
        layer = min(int(np.log(wanted / BLOCK) / np.log(STEP)), len(self.layers) - 1)
        size = BLOCK * STEP**layer
        blocks = slice(start // size, -(-stop // size))
        several = max(1, round(wanted / size))
        low = _extremes(self.layers[layer][0, blocks], several)[0]
        high = _extremes(self.layers[layer][1, blocks], several)[1]
        first = size * (blocks.start + several * np.arange(low.size))
        return Extremes(first=first, low=low, high=high)


def _extremes(values: FloatArray, size: int) -> FloatArray:
    """(2, blocks) lowest and highest number of each block of `size` values; the last is shorter."""
    whole = values.size // size * size
    rows = values[:whole].reshape(-1, size)
    rest = values[whole:]
    found = [
        np.append(rule.reduce(rows, axis=1), rule.reduce(rest) if rest.size else [])
        for rule in (np.fmin, np.fmax)
    ]
    return np.stack(found)


def _moments(values: FloatArray) -> tuple[float, float, float]:
    """Count, mean and sum of squares about the mean of those that are numbers."""
    finite = np.isfinite(values)
    values = values if finite.all() else values[finite]
    if not values.size:
        return 0.0, 0.0, 0.0
    mean = float(values.mean())
    away = values - mean
    # No product of the linear algebra, whose threads would wait for one another.
    return float(values.size), mean, float(np.einsum("i,i", away, away))


def _joined(moments: FloatArray) -> tuple[float, float]:
    """Mean and standard deviation of the whole, from (parts, 3) `_moments`."""
    count, means, squares = moments.T
    if not count.any():
        return math.nan, math.nan
    mean = float(np.average(means, weights=count))
    return mean, math.sqrt(float(squares.sum() + count @ (means - mean) ** 2) / count.sum())
