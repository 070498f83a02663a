"""Whether the noise stood still: N over parts of a record, by one band and the same terms.

A part fits its own N and other terms, which few bins tell apart poorly: two such values may differ
twofold by chance. Whether the spectrum is the same in each of the parts shows far more sharply, in
the change of N that would explain it with all other terms as they are. It does not say which term
changes.
"""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.special import chdtri, ndtri

from sagnac.core.arrays import FloatArray
from sagnac.noise.band_models import FALL, FLOOR, WALK, bin_shapes, models_of_one_band
from sagnac.noise.estimates import Interval
from sagnac.noise.laws import level_laws
from sagnac.noise.model_average import RULED, ModelChoice, mixture
from sagnac.spectrum.levels import Levels

# Chance at which each test says of parts that agree that they do not.
CHANCE: Final = 0.01
# Parts that a record is cut into, or the fewer ones if these do not show N.
COUNTS: Final = (4, 2)
_UNSEEN: Final = {"value": math.nan, "low": math.nan, "high": math.nan}


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """N of a part of the record.

    Attributes
    ----------
    start_s, stop_s
        Of the part, s.
    value, low, high
        N, rad/sqrt(s); NaN if the part does not show it.
    """

    start_s: float
    stop_s: float
    value: float
    low: float
    high: float

    def __post_init__(self) -> None:
        if not self.start_s < self.stop_s:
            raise ValueError(f"start_s is {self.start_s} and stop_s {self.stop_s}; give them so")
        if self.shows and not self.low <= self.value <= self.high:
            raise ValueError(f"value {self.value} must lie within [{self.low}, {self.high}]")

    @property
    def shows(self) -> bool:
        """Whether the part shows N."""
        return not math.isnan(self.value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """Estimate by the spectrum of a part.

    Attributes
    ----------
    walk
        N by a fit of its own, rad/sqrt(s).
    change, error
        Logarithm of N squared of the part over that of the law of the whole, if all other terms
        stood still, and the standard error allowed: chance, and what each fit allows a bin.
    """

    walk: Interval
    change: float
    error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """N over parts, and whether chance explains how they differ.

    Attributes
    ----------
    parts
        In order of time.
    walks_agree
        Whether chance explains how far the values lie apart, and their mean from the whole; True
        with fewer than two parts.
    spectra_agree
        Whether chance explains how the spectra differ; True with fewer than two parts.
    spread
        Largest over smallest N that would make the spectra differ as they do.
    """

    parts: tuple[Part, ...]
    walks_agree: bool = True
    spectra_agree: bool = True
    spread: float = 1.0

    @property
    def agree(self) -> bool:
        """Whether the noise stood still, as far as can be seen."""
        return self.walks_agree and self.spectra_agree

    @property
    def seen(self) -> tuple[Part, ...]:
        """Parts that show N."""
        return tuple(part for part in self.parts if part.shows)

    @property
    def smallest(self) -> float:
        """Lowest value of a part, rad/sqrt(s)."""
        return min(part.value for part in self.seen)

    @property
    def largest(self) -> float:
        """Highest value of a part, rad/sqrt(s)."""
        return max(part.value for part in self.seen)


def reading_in_band(levels: Levels, choice: ModelChoice, confidence: float) -> Reading | None:
    """Estimate by the levels of a part over the band and with the terms of an average.

    With share s of N in the law of the whole, N squared larger by a factor exp(c) lifts the
    logarithm of a level by about s c: c is the mean of the logarithms of level over law, each
    divided by s, weighted by s^2 and the shapes of the bins.

    Parameters
    ----------
    levels
        Of a part.
    choice
        Of the whole.
    confidence
        Of the interval.

    Returns
    -------
    Reading or None
        None if the levels do not show N.
    """
    walk = walk_in_band(levels, choice, confidence)
    if walk is None or choice.law is None:
        return None
    terms = level_laws(levels) * np.array(choice.law.squares)[:FALL]
    means = terms.sum(axis=1)
    share = terms[:, WALK] / means
    means = means / choice.law.divisor(levels.frequency)
    low, high = choice.band_hz
    inside = (levels.frequency >= low) & (levels.frequency <= high)
    weight = (bin_shapes(levels, FLOOR) * share)[inside]
    information = float(weight @ share[inside])
    higher = np.log(levels.level / means)[inside]
    return Reading(
        walk=walk,
        change=float(weight @ higher) / information,
        error=1.0 / math.sqrt(information),
    )


def walk_in_band(levels: Levels, choice: ModelChoice, confidence: float) -> Interval | None:
    """N of some levels over the band and with the terms that an average rests on.

    Terms that come out at zero are left out. A part has too few bins to show their error: it is
    the one that the fits allow for.

    Parameters
    ----------
    levels
        Of a part, or of the whole.
    choice
        Band and terms.
    confidence
        Of the interval.

    Returns
    -------
    Interval or None
        None if too few bins lie in the band, or they do not show N.
    """
    models = models_of_one_band(levels, choice.band_hz, choice.mask).heaviest()
    # A short part may not reach down to where N rules: what is fitted there is not seen.
    if models.count == 0 or models.ruled[0] < RULED:
        return None
    return mixture(models, WALK, confidence)


def over_parts(
    increments: FloatArray,
    *,
    sample_rate: float,
    read: Callable[[FloatArray], Reading | None],
    whole: Interval,
    confidence: float = 0.95,
) -> Parts:
    """N over quarters of the record, or halves, against each other and against the whole.

    Parameters
    ----------
    increments
        (samples,), rad.
    sample_rate
        Samples per second.
    read
        What some increments say, over the same band and with the same terms; None if they do not
        show N.
    whole
        N of the whole: the answer that the parts have to bear out.
    confidence
        Of all intervals.

    Returns
    -------
    Parts
        Of the first count all of whose parts show N: if some of them do, they are those in which
        chance made it high. If there is none, of the first of which two show it.
    """
    tried = []
    for count in COUNTS:
        edges = [number * increments.size // count for number in range(count + 1)]
        readings = [read(increments[start:stop]) for start, stop in pairwise(edges)]
        spans = [(start / sample_rate, stop / sample_rate) for start, stop in pairwise(edges)]
        tried.append(_compared(spans, readings, whole, confidence))
        if len(tried[-1].seen) == count:
            return tried[-1]
    return next((one for one in tried if len(one.seen) > 1), tried[-1])


def _compared(
    spans: list[tuple[float, float]],
    readings: list[Reading | None],
    whole: Interval,
    confidence: float,
) -> Parts:
    """Readings of spans (start and stop, s), and whether chance explains how they differ."""
    walks = [_UNSEEN if one is None else asdict(one.walk) for one in readings]
    parts = tuple(
        Part(start_s=start, stop_s=stop, **walk)
        for (start, stop), walk in zip(spans, walks, strict=True)
    )
    seen = [one for one in readings if one is not None]
    if len(seen) < 2:
        return Parts(parts=parts)
    mean, chi_square = _weighted([one.walk for one in seen], confidence)
    most = float(chdtri(len(seen) - 1, CHANCE))
    apart = _weighted([mean, whole], confidence)[1]
    change = np.array([one.change for one in seen])
    weight = np.array([one.error for one in seen]) ** -2.0
    of_changes = float(weight @ (change - weight @ change / weight.sum()) ** 2)
    return Parts(
        parts=parts,
        walks_agree=chi_square <= most and apart <= float(chdtri(1, CHANCE)),
        spectra_agree=of_changes <= most,
        spread=math.exp(0.5 * float(change.max() - change.min())),
    )


def _weighted(seen: list[Interval], confidence: float) -> tuple[Interval, float]:
    """Mean of the logarithms and their chi-square, each in the error on its side of the mean."""
    reach = float(ndtri(0.5 + 0.5 * confidence))
    height = np.log([one.value for one in seen])
    up = np.array([math.log(one.high / one.value) for one in seen]) / reach
    down = np.array([math.log(one.value / max(one.low, 1e-3 * one.value)) for one in seen]) / reach
    up, down = np.maximum(up, 1e-6), np.maximum(down, 1e-6)
    error = 0.5 * (up + down)
    mean = 0.0
    for _ in range(20):
        weight = error**-2.0
        mean = float((height * weight).sum() / weight.sum())
        error = np.where(height < mean, up, down)
    chi_square = float((((height - mean) / error) ** 2).sum())
    own = reach / math.sqrt(float((error**-2.0).sum()))
    interval = Interval(value=math.exp(mean), low=math.exp(mean - own), high=math.exp(mean + own))
    return interval, chi_square
