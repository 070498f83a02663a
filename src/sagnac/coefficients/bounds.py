"""Where a low-pass begins, and what bounds N below it.

Every other noise lies on top of N, so that N lies below the spectrum and below the Allan curve,
if no filter of the sensor lowers them. A filter shows as a spectrum that is flat or rises and
then falls: it bends down. Bias instability and walks bend the other way: they fall and then
flatten. What falls behind a hump of vibration bends down too; leaving it out costs tightness,
never truth.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import gammaincinv

from sagnac.arrays import FloatArray
from sagnac.coefficients.estimates import require_confidence
from sagnac.spectrum.levels import Levels

# Bins on either side of a bend, half a decade.
_SIDE: Final = 5
# Least change of slope of the density against frequency, and its significance.
_BEND: Final = 0.6
_SIGNIFICANT: Final = 4.0
# Slope behind a bend from which on it is a fall.
_FALLS: Final = -0.3
# Relative error of a level beside its chance.
_FLOOR: Final = 0.03
# Cluster times shorter than this many periods of the roll-off are lowered by more than 2.5 % by a
# first-order low-pass: its Allan variance is N^2/tau (1 - 3/(2 r)), r = 2 pi f tau.
PERIODS: Final = 5.0
# Fewest bins below the roll-off for a bound.
_LEAST: Final = 2

# Shape of a level that is good to a sixth; a hump is twice as high as N, and behind it the spectrum
# is at two thirds of N or below.
_SURE: Final = 36.0
_HUMP: Final = 2.0
_LESS: Final = 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class RollOff:
    """Where the spectrum begins to be lowered.

    Attributes
    ----------
    frequency
        Highest frequency that no low-pass lowers, Hz; infinite if the spectrum shows none.
    half
        Where the density has fallen to half of what it is there, Hz; infinite if it does not.

    Raises
    ------
    ValueError
        If the frequency is not above zero.
    """

    frequency: float = math.inf
    half: float = math.inf

    def __post_init__(self) -> None:
        if not self.frequency > 0.0:
            raise ValueError(f"frequency is {self.frequency}; give Hz above zero")

    @property
    def is_there(self) -> bool:
        """Whether the spectrum shows one."""
        return math.isfinite(self.frequency)

    def cluster_time(self) -> float:
        """Shortest cluster time that the low-pass does not lower, s; 0 without one."""
        return PERIODS / self.frequency


def roll_off(levels: Levels) -> RollOff:
    """Find the first bend down of a spectrum.

    Two straight lines over half a decade on either side of each bin; the bend is where the
    slope falls by 0.6 or more, to below -0.3, and by four standard errors.

    Parameters
    ----------
    levels
        Robust levels.

    Returns
    -------
    RollOff
        The bin where the fall begins, less what is lowered before it is seen.
    """
    place, height = np.log(levels.frequency), np.log(levels.level)
    error = np.sqrt(1.0 / levels.shape + _FLOOR**2)
    for middle in range(2, place.size - 2):
        before = slice(max(0, middle - _SIDE), middle + 1)
        behind = slice(middle, min(place.size, middle + _SIDE + 1))
        rise, of_rise = _slope(place[before], height[before], error[before])
        fall, of_fall = _slope(place[behind], height[behind], error[behind])
        change, scatter = fall - rise, math.hypot(of_fall, of_rise)
        if change < -_BEND and fall < _FALLS and change < -_SIGNIFICANT * scatter:
            # Half a decade of bins averages the bend: the fall begins up to a third of it before.
            first = max(0, middle - 2)
            return RollOff(
                frequency=float(levels.frequency[first]),
                half=_half_of(place[first:], height[first:]),
            )
    return RollOff()


def _half_of(place: FloatArray, height: FloatArray) -> float:
    """Frequency at which a spectrum first falls to half of where it begins, between two bins."""
    below = np.flatnonzero(height < height[0] - math.log(2.0))
    if below.size == 0:
        return math.inf
    behind = int(below[0])
    ends = slice(behind - 1, behind + 1)
    fallen = np.interp(math.log(2.0), height[0] - height[ends], place[ends])
    return math.exp(float(fallen))


def _slope(place: FloatArray, height: FloatArray, error: FloatArray) -> tuple[float, float]:
    """Weighted slope of a run of levels, and its error."""
    weight = error**-2
    centred = place - weight @ place / weight.sum()
    total = float(weight @ centred**2)
    return float((weight * centred) @ height) / total, 1.0 / math.sqrt(total)


def highest_coefficient(levels: Levels, law: FloatArray, confidence: float) -> float:
    """Largest coefficient that the levels below the roll-off allow.

    Parameters
    ----------
    levels
        Robust levels.
    law
        (bins,) of the term at one, as the levels show it.
    confidence
        That the coefficient lies below; shared by the bins (Bonferroni).

    Returns
    -------
    float
        SI; NaN if fewer than two bins lie below the roll-off.
    """
    require_confidence(confidence)
    below = levels.frequency <= roll_off(levels).frequency
    if np.count_nonzero(below) < _LEAST:
        return math.nan
    shape = levels.shape[below]
    chance = (1.0 - confidence) / shape.size
    highest = levels.level[below] * shape / gammaincinv(shape, chance)
    return math.sqrt(float((highest / law[below]).min()))


@dataclass(frozen=True, slots=True, kw_only=True)
class Hump:
    """A hump above the band of N behind which the spectrum lies below N.

    A low-pass of the sensor makes no hump. So what makes it may reach down into the band.

    Attributes
    ----------
    frequency, walk
        Of its top, Hz, and the N that would have its level, rad/sqrt(s).
    behind, least
        Of the lowest level behind it.
    """

    frequency: float
    walk: float
    behind: float
    least: float

    def __post_init__(self) -> None:
        if not (self.frequency < self.behind and self.least < self.walk):
            raise ValueError(f"{self} does not fall behind its top")


def hump_above(levels: Levels, band_hz: tuple[float, float], walk: float) -> Hump | None:
    """The hump above a band in which N was read, if the spectrum falls below N behind it.

    Parameters
    ----------
    levels
        Robust levels of the spectrum.
    band_hz
        In which N was read.
    walk
        N, rad/sqrt(s).
    """
    above = np.flatnonzero((levels.low >= band_hz[1] * (1.0 - 1e-9)) & (levels.shape > _SURE))
    if above.size < 2:
        return None
    walks = np.sqrt(0.5 * levels.level[above])
    top = int(np.argmax(walks[:-1]))
    least = top + 1 + int(np.argmin(walks[top + 1 :]))
    if walks[top] < _HUMP * walk or walks[least] > walk / _LESS:
        return None
    return Hump(
        frequency=float(levels.frequency[above[top]]),
        walk=float(walks[top]),
        behind=float(levels.frequency[above[least]]),
        least=float(walks[least]),
    )
