"""How long to record for a wanted interval, by what a short recording shows.

The information on the squares of Q, N, B and K in the spectrum of a record of length T,

    I_ij = T int s_i(f) s_j(f) / S(f)^2 df  over 1/(2 T) <= f <= f_high,

with S the sum of the terms as estimated (Whittle), says how wide the interval of N is after T. If
the answer is of the likelihood of the whole band, that is the width.

An average over bands gives no bin more than the weight of its relative error of 3 %
(`noise.model_average`), so that it gains less from the many cells of high frequency, and its
robust levels keep six tenths of what cells tell. Its variance is that of one fit of all four terms,
and a tenth more since the models differ, or half as much more if a low-pass of the sensor is in
sight. If the interval of the short recording is far wider than
that, there is another reason, noise that changes say, and a longer one is taken to have it, too.

What is left out for a line is as many cells of 1/T wide at any T: a longer record loses less. What
unlike weights of a pair leave open stays open at any T.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import bisect
from scipy.special import ndtri

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import refusal
from sagnac.noise.band_models import FLOOR
from sagnac.noise.estimates import part_of_errors
from sagnac.noise.laws import STOCHASTIC_NAMES, CoefficientName, rate_density_basis
from sagnac.spectrum.levels import BINS_A_DECADE

# Longest recording that is planned, s: a year.
LONGEST: Final = 365.25 * 86_400.0
# Bins of the spectrum that are summed one by one; those above are integrated.
_SINGLE: Final = 512
_NODES: Final = 2048
# The lowest bin goes with the slope, which is fitted besides.
_FIRST: Final = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class LeftOut:
    """Frequencies that say nothing of N: a line that was removed, or a band of vibration.

    Attributes
    ----------
    low, high
        Of the line (equal) or band, Hz.
    cells
        Left out on either side besides, in units of one over the duration.
    """

    low: float
    high: float
    cells: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ShortRecording:
    """A short recording: what it shows of N, and so what a longer one may be expected to.

    Attributes
    ----------
    value, low, high
        N and its interval, rad/sqrt(s).
    confidence
        Of the interval.
    coefficients
        Q, N, B and K as far as they are estimated, SI.
    terms
        Terms that were fitted; N among them.
    duration
        Of the recording, s.
    highest
        Highest frequency that the answer rests on, Hz.
    interval
        Between the angles of which quantization is white, s.
    efficient
        Whether a longer recording's answer is taken to be the likelihood of the whole band, else an
        average over bands. That of this one may be the other.
    left_out
        What lines and vibration take.
    falls
        Whether the answer leaves open where the beginning of a low-pass lies.
    apart
        Logarithm of the ratio of the weights of a pair: so far N of their mean is left open.

    Raises
    ------
    ValueError
        If N is not an estimate with an interval, or is not among the terms.
    """

    value: float
    low: float
    high: float
    confidence: float
    coefficients: Mapping[CoefficientName, float]
    terms: tuple[CoefficientName, ...]
    duration: float
    highest: float
    interval: float
    efficient: bool = False
    left_out: tuple[LeftOut, ...] = ()
    falls: bool = False
    apart: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 < self.low < self.value < self.high:
            raise ValueError(f"value {self.value} must lie within ({self.low}, {self.high})")
        if "angle_random_walk" not in self.terms:
            raise refusal("terms", "lacks angle_random_walk")
        if not self.highest * self.duration > 1.0:
            raise ValueError(f"{self.duration} s hold no period of {self.highest} Hz")

    @property
    def half_width(self) -> float:
        """Half of the width of the interval, of the logarithm of N."""
        return 0.5 * math.log(self.high / self.low)

    def expected(self, duration: float) -> float:
        """Half width that a recording of `duration` s may be expected to have, relative."""
        width = self._by_information(duration)
        if not self.efficient:
            # Chance alone makes a short recording's interval half as wide again as expected.
            usual = self._of_mean(1.5 * self._by_information(self.duration))
            width *= max(1.0, self.half_width / usual)
        return self._of_mean(width)

    def _of_mean(self, width: float) -> float:
        """Half width of the plain mean of a pair, of that of the weighted one."""
        return 0.5 * self.apart + width * part_of_errors(self.apart, width, self.confidence)

    @property
    def _reach(self) -> float:
        """Half width in standard errors."""
        return float(ndtri(0.5 + 0.5 * self.confidence))

    def _by_information(self, duration: float) -> float:
        return 0.5 * self._reach * math.sqrt(_variance_of_walk(self, duration))

    def duration_for(self, half_width: float) -> float:
        """Duration, s, for a relative half width of the interval; infinite beyond a year.

        It is no longer than the short recording if the interval of that is narrow enough, and no
        shorter if it is not, whatever was to be expected of that recording.
        """

        def excess(logarithm: float) -> float:
            return self.expected(math.exp(logarithm)) - half_width

        shortest, longest = math.log(4.0 / self.highest), math.log(LONGEST)
        if excess(longest) > 0.0:
            return math.inf
        crossed = bisect(excess, shortest, longest) if excess(shortest) > 0.0 else shortest
        if half_width >= self.half_width:
            return min(math.exp(crossed), self.duration)
        return max(math.exp(crossed), self.duration)

    def duration_to_decide(self, limit: float) -> float:
        """Duration, s, after which the interval leaves a limit of N, rad/sqrt(s), to one side.

        It does with a probability of nine tenths if N is what the short recording says. The
        duration is infinite if N lies so close to the limit that a year is too short.
        """
        distance, reach = abs(math.log(limit / self.value)), self._reach
        # The interval's half width is reach standard errors; the value itself scatters by one.
        return self.duration_for(distance * reach / (reach + float(ndtri(0.9))))


def _variance_of_walk(short: ShortRecording, duration: float) -> float:
    """Variance of N^2 over N^4 by the information of a record."""
    frequency, weight = _bins(duration, short.highest, short.left_out)
    columns = [STOCHASTIC_NAMES.index(name) for name in short.terms]
    squares = np.array([short.coefficients.get(name, 0.0) ** 2 for name in STOCHASTIC_NAMES])
    laws = rate_density_basis(frequency, short.interval)
    relative = laws / (laws @ squares)[:, np.newaxis]
    if weight.sum() < 4.0 * len(columns):
        return math.inf
    # In units of N^2, so that nothing is small or large.
    relative = relative[:, columns] * short.value**2
    scale = np.sqrt((relative**2 * weight[:, np.newaxis]).sum(axis=0))
    scaled = relative / scale
    # An ordinate of the cosine transform is chi-square of one degree of freedom.
    shape = 0.5 * weight
    heeded, wider = np.ones(shape.size), 1.0
    if not short.efficient:
        # A level keeps so much of what many cells tell (`spectrum.levels` heeds the lower half):
        # 0.59 of ten thousand samples, 0.69 of millions.
        shape *= 0.62
        # An average has a tenth more variance than one fit of all terms (`benchmarks.planning`).
        # If a low-pass is in sight, fits with its beginning, and those of bands below it, share the
        # weight, and their means scatter (`tests/verdict/test_statistics.py`).
        heeded, wider = _heeded(frequency, shape), 1.5 if short.falls else 1.1
    inverse = np.linalg.pinv(scaled.T @ (scaled * (heeded * shape)[:, np.newaxis]))
    scatter = scaled.T @ (scaled * (heeded**2 * shape)[:, np.newaxis])
    walk = short.terms.index("angle_random_walk")
    return wider * float((inverse @ scatter @ inverse)[walk, walk]) / float(scale[walk]) ** 2


def _heeded(frequency: FloatArray, shape: FloatArray) -> FloatArray:
    """(points,) part of the information that is left of each under an error of each bin."""
    number = np.floor(BINS_A_DECADE * np.log10(frequency)).astype(int)
    number -= int(number.min(initial=0))
    together = np.bincount(number, weights=shape)[number]
    return np.asarray(1.0 / (1.0 + FLOOR**2 * together))


def _bins(
    duration: float, highest: float, left_out: tuple[LeftOut, ...]
) -> tuple[FloatArray, FloatArray]:
    """Frequencies k/(2 T), Hz, and how many bins each stands for."""
    count = max(_FIRST, int(2.0 * duration * highest))
    edges = np.arange(_FIRST, min(count, _SINGLE + _NODES) + 2.0) - 0.5
    if count > _SINGLE + _NODES:
        grouped = np.geomspace(_SINGLE + 0.5, count + 0.5, _NODES + 1)
        edges = np.concatenate([np.arange(_FIRST, _SINGLE + 1.0) - 0.5, grouped])
    edges /= 2.0 * duration
    frequency = 0.5 * (edges[1:] + edges[:-1])
    lost = np.zeros(frequency.size)
    for one in left_out:
        low, high = one.low - one.cells / duration, one.high + one.cells / duration
        lost += np.clip(np.minimum(edges[1:], high) - np.maximum(edges[:-1], low), 0.0, None)
    return frequency, 2.0 * duration * np.maximum(np.diff(edges) - lost, 0.0)
