"""What the levels of a spectrum and the Allan curve allow of Q, N, B, K and R.

Every noise lies on top of the others, so that no term can make more than the spectrum or the curve
shows anywhere. N is lowered by a filter of the sensor, which shows as a spectrum that is flat or
rises and then falls: it bends down. Bias instability and walks bend the other way: they fall and
then flatten. What falls behind a hump of vibration bends down too; leaving it out costs tightness,
never truth. A fit of a spectrum that its terms do not describe may ask for more than the curve
shows, and the curve may show slow noise that no term has.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from scipy.special import gammaincinv

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.noise.band_models import FLOOR
from sagnac.noise.estimates import Coefficients
from sagnac.noise.laws import COEFFICIENT_NAMES, SLOW_NAMES, CoefficientName, allan_variance_basis
from sagnac.quality.readout import Readout
from sagnac.spectrum.levels import Levels
from sagnac.stability.curve import StabilityCurve
from sagnac.stability.noise_type import equivalent_degrees_of_freedom

# Bins on either side of a bend, half a decade.
_SIDE: Final = 5
# Cluster times shorter than this many periods of the roll-off are lowered by more than 2.5 % by a
# first-order low-pass: its Allan variance is N^2/tau (1 - 3/(2 r)), r = 2 pi f tau.
PERIODS: Final = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RollOff:
    """Where the spectrum begins to be lowered.

    Attributes
    ----------
    frequency
        Highest frequency that no low-pass lowers, Hz; infinite if the spectrum shows none.
    half
        Where the density has fallen to half of what it is there, Hz; infinite if it does not.
    """

    frequency: float = math.inf
    half: float = math.inf

    def cluster_time(self) -> float:
        """Shortest cluster time that the low-pass does not lower, s; 0 without one."""
        return PERIODS / self.frequency


def roll_off(levels: Levels, *, above: float = 0.0) -> RollOff:
    """Find the first bend down of a spectrum, above a frequency.

    Two straight lines over half a decade on either side of each bin; the bend is where the
    slope falls by 0.6 or more, to below -0.3, and by four standard errors.

    Parameters
    ----------
    levels
        Robust levels.
    above
        Where the fall begins at the lowest, Hz.

    Returns
    -------
    RollOff
        The bin where the fall begins, less what is lowered before it is seen.
    """
    place, height = np.log(levels.frequency), np.log(levels.level)
    error = np.sqrt(1.0 / levels.shape + FLOOR**2)
    for middle in range(2 + int(np.searchsorted(levels.frequency, above)), place.size - 2):
        before = slice(max(0, middle - _SIDE), middle + 1)
        behind = slice(middle, min(place.size, middle + _SIDE + 1))
        rise, of_rise = _slope(place[before], height[before], error[before])
        fall, of_fall = _slope(place[behind], height[behind], error[behind])
        if fall - rise < -max(0.6, 4.0 * math.hypot(of_fall, of_rise)) and fall < -0.3:
            # Half a decade of bins averages the bend: the fall begins up to a third of it before.
            first = middle - 2
            half = _half_of(place[first:], height[first:])
            return RollOff(frequency=float(levels.frequency[first]), half=half)
    return RollOff()


def _half_of(place: FloatArray, height: FloatArray) -> float:
    """Frequency at which a spectrum first falls to half of where it begins, between two bins."""
    below = np.flatnonzero(height < height[0] - math.log(2.0))
    if below.size == 0:
        return math.inf
    ends = slice(below[0] - 1, below[0] + 1)
    return math.exp(float(np.interp(math.log(2.0), height[0] - height[ends], place[ends])))


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
    below = levels.frequency <= roll_off(levels).frequency
    if np.count_nonzero(below) < 2:
        return math.nan
    freedom = 2.0 * levels.shape[below]
    highest = levels.level[below] * _limit_of_variance(freedom, (1.0 - confidence) / freedom.size)
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
    # Levels that are good to a sixth.
    above = np.flatnonzero((levels.low >= band_hz[1] * (1.0 - 1e-9)) & (levels.shape > 36.0))
    if above.size < 2:
        return None
    walks = np.sqrt(0.5 * levels.level[above])
    top = int(np.argmax(walks[:-1]))
    least = top + 1 + int(np.argmin(walks[top + 1 :]))
    # A hump is twice as high as N, and behind it the spectrum is at two thirds of N or below.
    if walks[top] < 2.0 * walk or walks[least] > walk / 1.5:
        return None
    place, behind = levels.frequency[above[[top, least]]].tolist()
    return Hump(frequency=place, walk=float(walks[top]), behind=behind, least=float(walks[least]))


def longest_shelf(levels: Levels) -> tuple[float, float, float] | None:
    """The longest stretch whose levels differ as by chance, if the spectrum is lower below it.

    None if none reaches over a decade. The foot of flicker is as level by chance, since its bins
    have few degrees of freedom, but lies higher below.

    Parameters
    ----------
    levels
        Robust levels.

    Returns
    -------
    low, high
        Ends of it, Hz.
    walk
        The N that has its level, rad/sqrt(s).
    """
    height, reach = np.log(levels.level), levels.high / levels.low[:, np.newaxis]
    error = np.sqrt(1.0 / levels.shape + FLOOR**2)
    ends = np.argwhere(reach >= 10.0)
    # The longest first.
    for first, last in ends[np.argsort(-reach[reach >= 10.0], kind="stable")]:
        here = slice(int(first), int(last) + 1)
        weight = error[here] ** -2
        middle = float(weight @ height[here]) / float(weight.sum())
        # Three standard errors of each bin; a spectrum that rises or falls is beyond at both ends.
        if np.all(np.abs(height[here] - middle) < 3.0 * error[here]):
            if first == 0 or height[first - 1] > middle:
                return None
            walk = math.sqrt(0.5 * math.exp(middle))
            return float(levels.low[first]), float(levels.high[last]), walk
    return None


# ---- by the curve -----------------------------------------------------------------------

# Power of frequency of the rate noise of each term; a ramp, which does not fluctuate, has no fewer
# degrees of freedom than the steepest noise.
_NOISE_TYPES: Final = dict(zip(COEFFICIENT_NAMES, (2, 0, -1, -2, -2), strict=True))


def highest_walk(
    curve: StabilityCurve, readout: Readout, *, chance: float, used: BooleanArray
) -> tuple[float, float]:
    """Largest N that a curve allows, rad/sqrt(s), and the cluster time of it, s.

    Every other term only adds to N^2 / tau, so N lies below the curve at every point. If nothing
    dithers the readout within a cluster, its steps hide up to two steps of each second difference:
    the deviation is raised by the root of their mean square. If something does, a mean of few may
    still come out as zero: the deviation is raised by half a step in square.

    Parameters
    ----------
    curve
        Allan deviation.
    readout
        Of what the curve is of.
    chance
        That N lies above, shared by the points (Bonferroni).
    used
        (points,) those that no low-pass of the sensor lowers.

    Returns
    -------
    tuple of float
        Infinite and NaN if no point is used.
    """
    if not used.any():
        return math.inf, math.nan
    step = readout.step / (np.sqrt(2.0) * curve.tau)
    dithered = np.hypot(curve.deviation, 0.5 * step)
    raised = np.where(curve.tau < readout.time, curve.deviation + 2.0 * step, dithered)
    # The point asks what N could be if it ruled there, so the degrees of freedom are those of
    # white rate, whatever noise was identified.
    factor = _limit_of_variance(_freedom(curve, 0), chance / curve.tau.size)
    highest = np.where(used, raised * np.sqrt(factor * curve.tau), np.inf)
    index = int(np.nanargmin(highest))
    return float(highest[index]), float(curve.tau[index])


def highest_terms(
    curve: StabilityCurve, *, confidence: float, shortest: float, flicker_end: float
) -> dict[CoefficientName, float]:
    """Largest Q, B, K and R that a curve allows, SI.

    Parameters
    ----------
    curve
        Plain or overlapping Allan deviation.
    confidence
        That each lies below, shared by the points (Bonferroni).
    shortest
        Cluster times below it, s, are lowered by a low-pass or a readout.
    flicker_end
        Frequency above which flicker may be less than 1/f, Hz.

    Returns
    -------
    dict
        Without those for which no cluster time is left.
    """
    basis, highest = allan_variance_basis(curve.tau).T, dict[CoefficientName, float]()
    for law, (name, noise_type) in zip(basis, _NOISE_TYPES.items(), strict=True):
        # From a dozen of its shortest relaxation times on, flicker is nearly all there.
        used = curve.tau >= max(shortest, 2.0 / flicker_end if name == "bias_instability" else 0.0)
        if name == "angle_random_walk" or not used.any():
            continue
        share = (1.0 - confidence) / np.count_nonzero(used)
        high = curve.deviation**2 * _limit_of_variance(_freedom(curve, noise_type), share)
        highest[name] = math.sqrt(float((high / law)[used].min()))
    return highest


def _freedom(curve: StabilityCurve, noise_type: int) -> FloatArray:
    """(points,) degrees of freedom, were the noise of a type."""
    angles = curve.samples + (curve.kind != "angle")
    clusters = np.rint(curve.tau * curve.sample_rate).astype(np.int64).tolist()
    freedom = partial(equivalent_degrees_of_freedom, curve.estimator, noise_type, samples=angles)
    return np.array([freedom(cluster) for cluster in clusters])


def _limit_of_variance(freedom: FloatArray, chance: float) -> FloatArray:
    """(points,) factor on a variance that it exceeds with a chance, by its chi-square law."""
    # Importing scipy.stats for it would take a second.
    return np.asarray(freedom / (2.0 * gammaincinv(0.5 * freedom, chance)))


def within_curve(estimates: Coefficients, highest: Mapping[CoefficientName, float]) -> Coefficients:
    """Estimates that ask for no more than a curve allows.

    An interval ends at what the curve allows; if the value lies above that it is no estimate, and
    what the curve allows is the bound.

    Parameters
    ----------
    estimates
        By coefficient.
    highest
        Of `highest_terms`.
    """
    limited = dict(estimates)
    for name, most in highest.items():
        # NaN of what is not observable is not above anything.
        if name not in estimates or not estimates[name].high > most:
            continue
        one = estimates[name]
        is_estimate = one.status == "estimated" and one.value < most
        limited[name] = replace(one, high=most) if is_estimate else one.bounded(most)
    return limited


def slow_noise(curve: StabilityCurve, estimates: Coefficients) -> tuple[float, float] | None:
    """A rise of a curve behind its lowest point that the estimated terms do not make.

    Parameters
    ----------
    curve
        Plain or overlapping Allan deviation.
    estimates
        By coefficient.

    Returns
    -------
    tau
        Cluster time at which it stands out most, s; None in place of both if chance explains what
        there is.
    ratio
        Deviation there over that of the terms.
    """
    squares = np.zeros(len(COEFFICIENT_NAMES))
    for column, name in enumerate(COEFFICIENT_NAMES):
        status = estimates[name].status if name in estimates else "not observable"
        # A slow term that is no more than bounded need not be there.
        if status == "estimated" or (status == "upper bound" and name not in SLOW_NAMES):
            squares[column] = estimates[name].high ** 2
    terms = allan_variance_basis(curve.tau) @ squares
    freedom = _freedom(curve, min(_NOISE_TYPES.values()))
    # Where few clusters make the curve, its lowest point is chance, and lies behind many a rise.
    lowest = np.argmin(np.where(freedom >= 4.0, curve.deviation, np.inf))
    behind = (curve.tau > curve.tau[lowest]) & (freedom >= 2.0)
    if not behind.any() or not squares.any():
        return None
    # Chance alone is called slow noise in one of a hundred; slow noise is 1.2 times the terms.
    low = curve.deviation**2 * _limit_of_variance(freedom, 1.0 - 0.01 / np.count_nonzero(behind))
    excess = np.where(behind, low / terms, 0.0)
    most = int(np.argmax(excess))
    if excess[most] < 1.2**2:
        return None
    return float(curve.tau[most]), math.sqrt(float(curve.deviation[most] ** 2 / terms[most]))
