"""The noise of one sensor as a filter models it, above the upper confidence limit of its curve.

A model has a white rate, Markov rates and a random walk; that of an accelerometer has m where a
gyro's has rad.

The inflation is what the recording leaves open, no factor: the smallest model of some terms that
lies above the limit at every cluster time. The limit is that of each point alone: a model of few
terms has to reach the highest of many points, so that it lies above the whole curve about as often
as each limit does above its point. The idea, to bound a sensor's error by a model above its
Allan variance, is that of NAVIGATION, doi:10.33012/navi.563; the limit and the choice of the model
are as described here.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final, Self

import numpy as np
from scipy.optimize import linprog
from scipy.special import gammaincinv

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import RecordingError, is_finite, quoted, refusal
from sagnac.noise.laws import allan_variance_basis, markov_allan_variance


def require_numbers(of: object, names: Iterable[str], *, above_zero: bool = False) -> None:
    """Refuse attributes of an object that are no finite numbers of zero or more, or above zero.

    Raises
    ------
    ValueError
        If one is negative or not finite, or zero if that is refused.
    """
    allowed = "a finite number above zero" if above_zero else "zero or more, and finite"
    for name in names:
        value = getattr(of, name)
        if not (is_finite(value) and (value > 0.0 or (value == 0.0 and not above_zero))):
            raise refusal(name, f"is {quoted(value)}; give {allowed}")


# ---- model -------------------------------------------------------------------------

# The Allan deviation of a Markov rate is highest at 1.89 T, with 0.437 q sqrt(T) (IEEE Std
# 952-1997, C.1.6).
_PEAK_TAU: Final = 1.892
_PEAK: Final = 0.4365


@dataclass(frozen=True, slots=True, kw_only=True)
class Markov:
    """A first-order Markov rate, ``db/dt = -b/T + q w``.

    Attributes
    ----------
    driving_noise
        q, rad/s/sqrt(s).
    correlation_time
        T, s.
    error
        Relative standard error of the variance that it makes; 0 if it is exact.

    Raises
    ------
    ValueError
        If one is not a finite number above zero, or the error is negative.
    """

    driving_noise: float
    correlation_time: float
    error: float = 0.0

    def __post_init__(self) -> None:
        require_numbers(self, ("driving_noise", "correlation_time"), above_zero=True)
        require_numbers(self, ("error",))

    @property
    def deviation(self) -> float:
        """Standard deviation of the rate once it is stationary, rad/s."""
        return self.driving_noise * math.sqrt(0.5 * self.correlation_time)

    @classmethod
    def of_deviation(cls, deviation: float, time: float, *, error: float = 0.0) -> Self:
        """The Markov rate of a stationary standard deviation, rad/s, and correlation time, s."""
        driving = deviation / math.sqrt(0.5 * time)
        return cls(driving_noise=driving, correlation_time=time, error=error)

    @classmethod
    def of_peak(cls, tau: float, deviation: float) -> Self:
        """The Markov rate whose Allan deviation is highest at `tau` s, with `deviation` rad/s."""
        time = tau / _PEAK_TAU
        return cls(driving_noise=deviation / (_PEAK * math.sqrt(time)), correlation_time=time)

    def slowed_to(self, time: float) -> "Markov":
        """One of another correlation time, s, and the same Allan deviation where this is highest.

        A longer time forgets less.
        """
        peak = np.array([_PEAK_TAU * self.correlation_time])
        highest = _PEAK * self.driving_noise * math.sqrt(self.correlation_time)
        at_one = float(markov_allan_variance(peak, 1.0, time)[0])
        return Markov(driving_noise=highest / math.sqrt(at_one), correlation_time=time)

    def decay(self, interval: float) -> float:
        """Fraction of the rate that is left after a step of `interval` s."""
        return math.exp(-interval / self.correlation_time)

    def step(self, interval: float) -> float:
        """Standard deviation of what a step of `interval` s adds, rad/s."""
        return self.deviation * math.sqrt(-math.expm1(-2.0 * interval / self.correlation_time))


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterModel:
    """White rate noise, Markov rates, and a rate that walks; white angle noise besides.

    Attributes
    ----------
    white
        N, rad/sqrt(s), which is rad/s/sqrt(Hz).
    walk
        K, rad/s/sqrt(s), which is rad/s^2/sqrt(Hz).
    markov
        None, one or several.
    angle
        White noise of the sampled angle (quantization Q), rad.

    Raises
    ------
    ValueError
        If a figure is negative or not finite.
    """

    white: float
    walk: float = 0.0
    markov: tuple[Markov, ...] = ()
    angle: float = 0.0

    def __post_init__(self) -> None:
        require_numbers(self, ("white", "walk", "angle"))

    def allan_deviation(self, tau: FloatArray) -> FloatArray:
        """Allan deviation that the model has, rad/s.

        Parameters
        ----------
        tau
            (points,), s.
        """
        figures = np.array([self.angle, self.white, 0.0, self.walk, 0.0])
        variance = allan_variance_basis(tau) @ figures**2
        for one in self.markov:
            variance += markov_allan_variance(tau, one.driving_noise, one.correlation_time)
        return np.asarray(np.sqrt(variance))

    def white_per_sample(self, interval: float) -> float:
        """Standard deviation of the white noise of a mean rate over `interval` s, rad/s."""
        return self.white / math.sqrt(interval)

    def walk_per_sample(self, interval: float) -> float:
        """Standard deviation of what the walk adds in `interval` s, rad/s."""
        return self.walk * math.sqrt(interval)


# ---- overbound ---------------------------------------------------------------------

# Fewest degrees of freedom of a point that bounds the model. At ten the limit is 1.6 of the curve,
# and white noise and a walk above it lie far above the rest.
LEAST_FREEDOM: Final = 20.0
# Share of the variance at the shortest and the longest cluster time that white noise and a walk
# make if they have to be there.
_LEAST_SHARE: Final = 0.02


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UpperLimit:
    """Bound on an Allan deviation, at each of its cluster times.

    Attributes
    ----------
    tau
        (points,), s.
    deviation
        As measured, rad/s.
    limit
        Upper limit, rad/s.
    confidence
        Probability that the curve lies below, at each of them.
    beyond
        (2, points): longer cluster times, s, and the deviation that was measured there, rad/s. A
        model has to reach it. It has no limit of its own, since it may be several times too large.
    """

    tau: FloatArray
    deviation: FloatArray
    limit: FloatArray
    confidence: float
    beyond: FloatArray = field(default_factory=lambda: np.empty((2, 0)))

    def short_of(self, model: FilterModel) -> tuple[FloatArray, FloatArray]:
        """Longer cluster times, s, and the variance that a model lacks there."""
        tau, deviation = self.beyond
        return tau, np.maximum(deviation**2 - model.allan_deviation(tau) ** 2, 0.0)

    def inflation(self, model: FilterModel) -> float:
        """Median over the cluster times of the deviation of a model over the measured one."""
        return float(np.median(model.allan_deviation(self.tau) / self.deviation))


def upper_limit(
    tau: FloatArray, deviation: FloatArray, edf: FloatArray, *, confidence: float = 0.95
) -> UpperLimit:
    """Upper confidence limit of a curve.

    Parameters
    ----------
    tau, deviation, edf
        (points,): s, rad/s, and equivalent degrees of freedom of the variance.
    confidence
        That the curve lies below, at each cluster time of twenty degrees of freedom or more.
        Longer ones count by their value alone (`UpperLimit.beyond`).

    Raises
    ------
    RecordingError
        If fewer than two points are left.
    """
    sound = np.isfinite(deviation) & (deviation > 0.0) & (edf >= LEAST_FREEDOM)
    if sound.sum() < 2:
        problem = f"{sound.sum()} cluster times have {LEAST_FREEDOM:g} degrees of freedom or more"
        raise RecordingError(f"{problem}, too few for a filter's model", remedy="record longer")
    # The value alone of a point that bounds nothing has to be reached, too.
    far = np.isfinite(deviation) & (edf >= 2.0) & (tau > tau[sound].max())
    beyond = np.stack([tau[far], deviation[far]])
    tau, deviation, edf = tau[sound], deviation[sound], edf[sound]
    limit = deviation * np.sqrt(edf / (2.0 * gammaincinv(0.5 * edf, 1.0 - confidence)))
    curve = {"tau": tau, "deviation": deviation, "limit": limit}
    return UpperLimit(**curve, confidence=confidence, beyond=beyond)


def overbound(
    limit: UpperLimit,
    *,
    most_markov: int = 2,
    least_white: float = 0.0,
    angle: bool = False,
    walks: bool = False,
) -> FilterModel:
    """The smallest model of some terms above an upper limit.

    With Markov rates the mean excess of the variance is the least. White noise and a walk alone
    have to rise above a flat part on both sides of it; there the mean logarithm of the deviation is
    the least, the inflation itself, so that a large excess at one end does not raise all the rest.
    The walk is then raised to what was measured beyond the limit.

    Vibration and a readout raise the curve at short cluster times as white angle noise does. White
    noise that covers them lies above a slow term at all cluster times that have a limit, so that
    the slow terms are those of a model with angle noise, whether or not it may keep that.

    Parameters
    ----------
    limit
        Of the curve.
    most_markov
        Markov rates that it may have at most: 0, 1 or 2. A further one has to be worth it.
    least_white
        White noise that it has at least, rad/sqrt(s): a sensor's low-pass may hide some.
    angle
        Whether it may keep white angle noise; if not, its white noise covers that.
    walks
        Whether it has to have white noise and a random walk, as some tools want: two per cent of
        the variance at the shortest and at the longest cluster time, if nothing asks for more.
    """
    ends = _LEAST_SHARE * walks * limit.limit[[0, -1]] ** 2
    white = max(least_white**2, float(ends[0] * limit.tau[0]))
    least = (white, float(3.0 * ends[1] / limit.tau[-1]))
    if most_markov == 0 and not angle:
        white, walk = _white_and_slow(limit, limit.tau / 3.0, least)
        return _reaching(FilterModel(white=white, walk=walk), limit)
    excess, best = _smallest(limit, (), least)
    chosen: tuple[float, ...] = ()
    for _ in range(most_markov):
        further = [time for time in _correlation_times(limit.tau) if time not in chosen]
        tried = {(*chosen, time): _smallest(limit, (*chosen, time), least) for time in further}
        times = min(tried, key=lambda each: tried[each][0])
        # A further Markov rate has to lower the mean excess by 5 %.
        if tried[times][0] > 0.95 * excess:
            break
        chosen, (excess, best) = times, tried[times]
    return _reaching(best if angle else _without_angle(best, limit), limit)


def _without_angle(model: FilterModel, limit: UpperLimit) -> FilterModel:
    """A model whose white noise covers what its angle noise did; its slow terms are the same."""
    slow = replace(model, white=0.0, angle=0.0).allan_deviation(limit.tau)
    short = np.maximum(limit.limit**2 - slow**2, 0.0) * limit.tau
    return replace(model, white=max(model.white, math.sqrt(float(short.max()))), angle=0.0)


def _reaching(model: FilterModel, limit: UpperLimit) -> FilterModel:
    """A model whose walk is raised until it reaches what was measured beyond the limit."""
    tau, short = limit.short_of(model)
    more = math.sqrt(float((3.0 * short / tau).max(initial=0.0)))
    return replace(model, walk=math.hypot(model.walk, more))


def white_and_markov(limit: UpperLimit, time: float, *, least_white: float = 0.0) -> FilterModel:
    """White noise and one Markov rate of a given time above an upper limit, least inflated.

    Parameters
    ----------
    limit
        Of the curve.
    time
        Correlation time, s.
    least_white
        White noise that it has at least, rad/sqrt(s).
    """
    slow = markov_allan_variance(limit.tau, 1.0, time)
    floor = _LEAST_SHARE * limit.limit[-1] ** 2 / float(slow[-1])
    white, driving = _white_and_slow(limit, slow, (least_white**2, floor))
    rate = Markov(driving_noise=driving, correlation_time=time)
    tau, short = limit.short_of(FilterModel(white=white, markov=(rate,)))
    more = float((short / markov_allan_variance(tau, 1.0, time)).max(initial=0.0))
    rate = replace(rate, driving_noise=math.hypot(driving, math.sqrt(more)))
    return FilterModel(white=white, markov=(rate,))


def common_time(limits: Sequence[UpperLimit]) -> float:
    """Correlation time, s, of the Markov rates that stand for the walks of several sensors.

    Ten times the longest cluster time that was measured, with a limit or without: as good as a
    walk. A shorter time lies no closer to the curves, and promises of what was not measured that a
    bias is forgotten.
    """
    return 10.0 * max(float(np.append(limit.tau, limit.beyond[0]).max()) for limit in limits)


def common_span(limits: Sequence[UpperLimit]) -> tuple[float, float]:
    """First and last cluster time, s, at which all of them have a limit."""
    first, last = (np.array([limit.tau[end] for limit in limits]) for end in (0, -1))
    return float(first.max()), float(last.min())


def envelope(limits: Sequence[UpperLimit]) -> UpperLimit:
    """The upper limit of several curves together, each counted at the cluster times it spans."""
    tau = np.unique(np.concatenate([limit.tau for limit in limits]))
    at = partial(np.interp, np.log(tau), left=-np.inf, right=-np.inf)
    logarithms = [
        [at(np.log(one.tau), np.log(curve)) for curve in (one.deviation, one.limit)]
        for one in limits
    ]
    deviation, limit = np.exp(np.max(logarithms, axis=0))
    least = min(one.confidence for one in limits)
    beyond = np.concatenate([one.beyond for one in limits], axis=1)
    return UpperLimit(tau=tau, deviation=deviation, limit=limit, confidence=least, beyond=beyond)


def _correlation_times(tau: FloatArray) -> tuple[float, ...]:
    """Markov times, s, from the first cluster time to the last, even in the logarithm."""
    # Two a decade.
    count = max(2, 1 + round(2 * float(np.log10(tau[-1] / tau[0]))))
    return tuple(np.geomspace(tau[0], tau[-1], count).tolist())


# White noise, and a slow term.
_Two = tuple[float, float]


def _white_and_slow(limit: UpperLimit, slow: FloatArray, least: _Two) -> _Two:
    """White noise and a slow term, of the least mean logarithm above the limit.

    The logarithm of a sum is concave in its terms, so that the best pair is a corner of what the
    limit and the least squares allow: every corner is tried. `slow` (points,) is the Allan variance
    of that term at one, `least` are the smallest squares. Where the smallest model has white angle
    noise, the slow term is no smaller than beside that (`overbound`).
    """
    laws = np.stack([1.0 / limit.tau, slow], axis=-1) / limit.limit[:, np.newaxis] ** 2
    angle_law = allan_variance_basis(limit.tau)[:, 0] / limit.limit**2
    _, (_, beside, angle) = _least_sum(np.column_stack([laws, angle_law]), (*least, 0.0))
    if angle > 0.0:
        least = (least[0], max(least[1], float(beside)))
    scale = laws.max(axis=0)
    laws = laws / scale
    bounds = np.concatenate([laws, np.eye(2)])
    floors = np.concatenate([np.ones(limit.tau.size), np.array(least) * scale])
    first, second = np.triu_indices(floors.size, 1)
    pairs = np.stack([bounds[first], bounds[second]], axis=1)
    # Laws, scaled to one, of a smaller determinant do not cross.
    crossing = np.abs(np.linalg.det(pairs)) > 1e-12
    wanted = np.stack([floors[first], floors[second]], axis=1)[crossing]
    corners = np.linalg.solve(pairs[crossing], wanted[..., np.newaxis])[..., 0]
    # A corner may lie below the limit by rounding before it is scaled up.
    corners = np.maximum(corners[np.all(corners @ bounds.T >= floors - 1e-9, axis=1)], 0.0)
    best = corners[np.argmin(np.log(corners @ laws.T).mean(axis=1))]
    # Above means above.
    white, size = np.sqrt(best * max(1.0, 1.0 / float((laws @ best).min())) / scale)
    return float(white), float(size)


def _smallest(limit: UpperLimit, times: Sequence[float], least: _Two) -> tuple[float, FilterModel]:
    """Least mean of the variance over the squared limit, and its model with angle noise.

    `least` are the smallest squares of the white noise and of the walk.
    """
    basis = allan_variance_basis(limit.tau)
    columns = [basis[:, 1], basis[:, 3], basis[:, 0]]
    columns += [markov_allan_variance(limit.tau, 1.0, time) for time in times]
    laws = np.stack(columns, axis=-1) / limit.limit[:, np.newaxis] ** 2
    excess, squares = _least_sum(laws, (*least, *np.zeros(len(columns) - 2)))
    white, walk, angle, *others = np.sqrt(squares).tolist()
    sizes = zip(others, times, strict=True)
    rates = [Markov(driving_noise=one, correlation_time=time) for one, time in sizes if one > 0.0]
    return excess, FilterModel(white=white, walk=walk, angle=angle, markov=tuple(rates))


def _least_sum(laws: FloatArray, least: Sequence[float]) -> tuple[float, FloatArray]:
    """Least mean of a sum of terms that is one or more everywhere; the squares of the terms.

    `laws` (points, terms) is each at one, `least` the smallest squares. It is a linear program.
    """
    scale = laws.max(axis=0)
    relative = laws / scale
    bounds = [(low, None) for low in np.array(least) * scale]
    result = linprog(relative.mean(axis=0), -relative, -np.ones(len(laws)), bounds=bounds)
    if result.x is None:
        raise ArithmeticError(f"no model above the limit was found: {result.message}")
    # Smaller terms are left out.
    solved = np.where(result.x > 1e-9, result.x, 0.0)
    # What the solver takes for zero is none: above means above.
    solved = solved * max(1.0, 1.0 / float((relative @ solved).min()))
    return float((relative @ solved).mean()), solved / scale
