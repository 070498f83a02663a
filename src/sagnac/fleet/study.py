"""How N scatters over a campaign, which runs are outliers, and what a run not yet made will give.

The prediction is by Student's t with Satterthwaite's degrees of freedom.

Any sum of weights on the runs has a variance that is linear in the variances of the effects. Each
of these is a difference of two mean squares, so the variance is a sum of mean squares, and its
degrees of freedom are Satterthwaite's (*Biometrics Bulletin* 2, 110, 1946). If one factor rules,
with three levels say, the interval is that of t with two degrees of freedom, as it must be.

Satterthwaite's sum is ``1/f = sum of p_k^2/f_k`` over the shares p_k of the variance. If a factor
of two degrees of freedom happens to come out small, its share does, too, and the interval is too
short just then: with a new day alone it held 92 to 94 times in 100. The power of the shares is
therefore 1 for a run with one new factor, which rules, and 1.6 and 1.8 with two and three.
Intervals of 95 % then hold 93 to 97 times in simulations in which each factor scatters by 2 to
30 %.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import date
from functools import cached_property
from typing import Final, Literal

import numpy as np
from scipy.special import ndtri, stdtr, stdtrit

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import RecordingError, counted, quoted, refusal, require_confidence
from sagnac.fleet import design as designs
from sagnac.fleet.design import Components, Design
from sagnac.noise.estimates import Interval

# ---- prediction --------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Forecast:
    """A value with the standard deviation of its error and the degrees of freedom of that."""

    value: float
    error: float
    freedom: float

    def reach(self, confidence: float) -> float:
        """Half the width of the interval."""
        return float(stdtrit(self.freedom, 0.5 + 0.5 * confidence)) * self.error


@dataclass(frozen=True, slots=True, kw_only=True)
class MeanSquare:
    """Mean square of the contrasts of a factor, or of the residual.

    Attributes
    ----------
    value
        Mean square.
    per_variance
        What it gains in the mean for each unit of the variance of the factor, and of those
        within it.
    known
        What it gains in the mean from the known variances of the runs.
    freedom
        Number of contrasts.
    """

    value: float
    per_variance: Mapping[str, float]
    known: float
    freedom: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Outlook:
    """Prediction by the runs of a design: of their mean and of further runs.

    Parameters
    ----------
    design
        The runs, with a residual degree of freedom or more.
    components
        Variances by which the runs are weighed.
    """

    design: Design
    components: Components

    @cached_property
    def mean(self) -> Forecast:
        """Generalized least-squares mean."""
        return self._located(self._mean_weights, {}, further=0.0)

    def further_run(self, known: Mapping[str, str]) -> Forecast:
        """One more run, measured as well as the others are.

        Parameters
        ----------
        known
            By factor, the level that the run shares with earlier ones; it is of a new level of
            every factor that is left out.

        Returns
        -------
        Forecast
            Best linear unbiased prediction and the standard deviation of its error.
        """
        shared = np.zeros(self.design.values.size)
        for name, level in known.items():
            same = np.array(self.design.factors[name]) == level
            shared += self.components.get(name, 0.0) * same
        weights = self._inverse @ shared
        weights += (1.0 - weights.sum()) * self._mean_weights
        return self._located(weights, known, further=1.0)

    @cached_property
    def _inverse(self) -> FloatArray:
        return np.asarray(np.linalg.inv(designs.covariance_of(self.design, self.components)))

    @cached_property
    def _mean_weights(self) -> FloatArray:
        row = self._inverse.sum(axis=0)
        return np.asarray(row / row.sum())

    def _located(self, weights: FloatArray, known: Mapping[str, str], further: float) -> Forecast:
        """Error of a sum of weights on the runs; of a `further` run (1) or of the mean (0)."""
        design, squares = self.design, self.mean_squares
        run = squares["run"]
        run_share = further + float(weights @ weights)
        # No less than what is known of the runs themselves.
        least = further * design.typical_variance + float(design.variances @ weights**2)
        fixed = least - run_share * run.known
        shares = dict.fromkeys(design.seen, 0.0)
        for name in reversed(shares):
            square, taken = squares[name], weights @ design.incidence(name)
            if name in known:
                taken[design.levels(name).index(known[name])] -= 1.0
            shares[name] += further * (name not in known) + float(taken @ taken)
            shares[name] /= square.per_variance[name]
            for inner in set(shares).intersection(square.per_variance) - {name}:
                # The mean square of the outer factor holds this much of the inner one already.
                shares[inner] -= shares[name] * square.per_variance[inner]
            run_share -= shares[name]
            fixed -= shares[name] * (square.known - run.known)
        shares["run"] = run_share
        parts = {name: share * squares[name].value for name, share in shares.items()}
        variance = max(fixed + sum(parts.values()), least, 1e-24 * design.spread**2)
        new = sum(name not in known for name in design.seen)
        # Power of the shares of the variance: of a further run by how many factors are new.
        power = (1.0, 1.0, 1.6, 1.8)[min(new, 3)] if further else 2.0
        weighed = {name: abs(part / variance) ** power for name, part in parts.items()}
        scatter = sum(one / squares[name].freedom for name, one in weighed.items())
        lowest = min(square.freedom for square in squares.values())
        freedom = min(max(1.0 / scatter if scatter > 0.0 else math.inf, float(lowest)), 1e6)
        value = float(weights @ design.values)
        return Forecast(value=value, error=math.sqrt(variance), freedom=freedom)

    @cached_property
    def mean_squares(self) -> Mapping[str, MeanSquare]:
        """By factor, and of ``run``; none below what the known variances and runs put into it."""
        design, squares, variances = self.design, {}, {"run": 0.0}
        covariance = designs.covariance_of(design, self.components)
        for name in ("run", *design.seen):
            contrasts = design.contrasts(name)
            freedom = contrasts.shape[1]
            # Each counts by how well it is known, or a few wide intervals make up all of `known`.
            root = np.linalg.cholesky(contrasts.T @ covariance @ contrasts)
            contrasts = np.linalg.solve(root, contrasts.T).T
            contrasts *= math.sqrt(freedom) / float(np.linalg.norm(contrasts))
            mean = float(np.sum((contrasts.T @ design.values) ** 2)) / freedom
            known = float(design.variances @ np.sum(contrasts**2, axis=1)) / freedom
            per = {
                one: float(np.sum((contrasts.T @ design.incidence(one)) ** 2)) / freedom
                for one in (name, *design.within(name))
            }
            # What is within comes first, and is 0 if the runs do not show it.
            made = sum(variances.get(one, 0.0) * each for one, each in per.items())
            least = known + variances["run"] + made
            variances[name] = max(mean - least, 0.0) / per[name]
            own = MeanSquare(value=max(mean, least), per_variance=per, known=known, freedom=freedom)
            squares[name] = own
        return squares


# ---- outliers ----------------------------------------------------------------------

# Chance, over all runs together, at which a run is called an outlier.
CHANCE: Final = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Outlier:
    """A run that the others do not bear out.

    Attributes
    ----------
    index
        Of the run, as given.
    foretold
        Value that the others give for it.
    deviations
        Standard deviations that it lies off, of the logarithm.
    mean_without
        Mean without it.
    """

    index: int
    foretold: float
    deviations: float
    mean_without: float


def departures(design: Design, components: Components) -> tuple[Outlier, ...]:
    """Runs off what the others foretell by more than chance, the farthest first.

    With the metric P of the restricted likelihood, the value that the others foretell of run i
    lies ``(P y)_i / P_ii`` off it, and the variance of that is ``1 / P_ii``. The run itself has
    raised the variances; Student's deleted residual takes that back.

    Parameters
    ----------
    design
        The runs.
    components
        Variances of the effects.
    """
    covariance = designs.covariance_of(design, components)
    metric = designs.residual_metric(covariance)
    weighted, weight = metric @ design.values, np.diag(metric)
    standard, off = weighted / np.sqrt(weight), weighted / weight
    freedom = float(design.contrasts("run").shape[1])
    if freedom < 2.0:
        return ()
    # The variances make the squares of all runs sum to one less than their number.
    total = design.values.size - 1.0
    # What a run's own interval leaves open is known, and stays without it.
    left = np.maximum(total - standard**2, (total - 1.0) * design.variances * weight)
    deleted = standard * np.sqrt((total - 1.0) / np.maximum(left, 1e-9))
    chance = 2.0 * stdtr(freedom - 1.0, -np.abs(deleted)) * design.values.size
    # A run that lies where the others foretell it leaves their mean as it is.
    row = np.linalg.inv(covariance).sum(axis=0)
    mean_without = (row @ design.values - row * off) / row.sum()
    rows = [
        Outlier(
            index=index,
            foretold=float(design.values[index] - off[index]),
            deviations=float(deleted[index]),
            mean_without=float(mean_without[index]),
        )
        for index in np.flatnonzero(chance < CHANCE).tolist()
    ]
    return tuple(sorted(rows, key=lambda one: -abs(one.deviations)))


def slope_of_days(outlook: Outlook, labels: Sequence[str], *, confidence: float) -> Interval | None:
    """Change of the values for each day.

    All runs of a day share its effect, so that the contrasts of days, not the runs, are what a
    slope is fitted to: three days leave one degree of freedom. They are free of the unit, so that
    units measured one after another make no drift.

    Parameters
    ----------
    outlook
        The runs, and the variances by which the contrasts are weighed.
    labels
        (runs,) day of each run.
    confidence
        Of the interval.

    Returns
    -------
    Interval or None
        None if days have neither dates nor numbers, are fewer than three, or cannot be told from
        the other factors.
    """
    days, design = _dates(labels), outlook.design
    # Days of one run each are no factor of the design: the contrasts of runs are theirs.
    contrasts = design.contrasts("day" if "day" in design.seen else "run")
    freedom = contrasts.shape[1] - 1
    if days is None or freedom < 1 or not np.ptp(contrasts.T @ days) > 1e-9 * np.ptp(days):
        return None
    covariance = designs.covariance_of(design, outlook.components)
    root = np.linalg.cholesky(contrasts.T @ covariance @ contrasts)
    along, values = np.linalg.solve(root, contrasts.T @ np.column_stack([days, design.values])).T
    size = float(along @ along)
    slope = float(along @ values) / size
    error = float(np.linalg.norm(values - slope * along)) / math.sqrt(size * freedom)
    reach = float(stdtrit(freedom, 0.5 + 0.5 * confidence)) * error
    return Interval(value=slope, low=slope - reach, high=slope + reach)


def _dates(labels: Sequence[str]) -> FloatArray | None:
    """Days from the middle of all; None if the labels are neither numbers nor dates."""
    for of_label in (float, lambda label: float(date.fromisoformat(label).toordinal())):
        with suppress(ValueError):
            days = np.array([of_label(label) for label in labels])
            return np.asarray(days - days.mean()) if np.all(np.isfinite(days)) else None
    return None


# ---- study -------------------------------------------------------------------------

FACTORS: Final = ("unit", "day", "rate")


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """N of one recording.

    Attributes
    ----------
    value, low, high
        N and its interval, in any one unit for all runs, such as rad/sqrt(s); without an interval
        both limits are NaN.
    confidence
        Of the interval.
    labels
        By factor (``unit``, ``day``, ``rate``): what it was a run of; empty if that is not known.

    Raises
    ------
    ValueError
        If N is not above zero or not within its interval.
    """

    value: float
    low: float = math.nan
    high: float = math.nan
    confidence: float = 0.95
    labels: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (self.value > 0.0 and math.isfinite(self.value)):
            raise refusal("value", f"is {quoted(self.value)}; give N above zero")
        if not math.isnan(self.low + self.high) and not self.low <= self.value <= self.high:
            raise ValueError(f"value {self.value} must lie within [{self.low}, {self.high}]")
        require_confidence(self.confidence)

    @property
    def relative_variance(self) -> float:
        """Variance of the logarithm of N that the interval stands for; 0 without one."""
        if not (self.low > 0.0 and math.isfinite(self.high)):
            return 0.0
        reach = float(ndtri(0.5 + 0.5 * self.confidence))
        return (math.log(self.high / self.low) / (2.0 * reach)) ** 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Deviation:
    """A standard deviation of ln N with its limits.

    Attributes
    ----------
    value, low, high
        Of an upper bound `value` is `high`, and `low` is zero.
    status
        A scatter that did not show is an upper bound, never zero.
    """

    value: float
    low: float
    high: float
    status: Literal["estimated", "upper bound"] = "estimated"


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeatability:
    """How N scatters.

    Attributes
    ----------
    mean
        N of the middle of the population (geometric mean), in the unit of the runs.
    deviations
        By factor and ``run``: standard deviation of ln N that it makes, so that 0.2 is some 20 %,
        with its interval. ``run`` is what is left between runs of one unit, day and rate beyond
        their own intervals.
    within
        Standard deviation of ln N that the interval of a typical run stands for; 0 if runs have
        none.
    hidden
        Factors, and ``run``, whose scatter the runs cannot show, and why.
    next_unit
        N that one run of a unit not measured yet will give, on a new day, at a new rate; None
        unless the runs show how units scatter, as they do with one run of each.
    next_day
        By unit: N that its next run will give, on a new day, at a new rate; empty unless the runs
        show how days scatter.
    drift
        Relative change of N for each day; None if days have no dates, or no unit has three.
    outliers
        The farthest first.
    runs, confidence
        Their number, and of all intervals.
    """

    mean: Interval
    deviations: Mapping[str, Deviation]
    within: float
    hidden: Mapping[str, str]
    next_unit: Interval | None
    next_day: Mapping[str, Interval]
    drift: Interval | None
    outliers: tuple[Outlier, ...]
    runs: int
    confidence: float


def repeatability(runs: Sequence[Run], *, confidence: float = 0.95) -> Repeatability:
    """How N scatters over units, days, rates and runs.

    The model is ``ln N = mean + unit + day + rate + run``, each effect normal, beside the known
    error of each run. Variances are by restricted likelihood, with fiducial intervals.

    Parameters
    ----------
    runs
        Those that show N; leave bounds out.
    confidence
        Of every interval.

    Raises
    ------
    RecordingError
        If the runs are too few to tell the scatter of runs from that of units, days and rates.
    ValueError
        If `confidence` is not between 0 and 1.
    """
    require_confidence(confidence)
    labels, twins = dict[str, tuple[str, ...]](), dict[str, str]()
    partitions = {tuple(range(len(runs))): "run"}
    for name in (name for name in FACTORS if any(run.labels.get(name) for run in runs)):
        # A run without a label, if others have one, is a level of its own.
        own = tuple(run.labels.get(name) or f"run {index}" for index, run in enumerate(runs))
        twin = partitions.setdefault(tuple(map(own.index, own)), name)
        alone = twin == name or len(set(own)) == 1
        labels |= {name: own} if alone else {}
        twins |= {} if alone else {name: twin}
    variances = np.array([run.relative_variance for run in runs])
    design = Design(values=np.log([run.value for run in runs]), factors=labels, variances=variances)
    if len(runs) < 3 or design.contrasts("run").shape[1] < 1:
        which = "the scatter of runs from that of units, days and rates"
        why = f"{counted(len(runs), 'run')} cannot tell {which}"
        raise RecordingError(why, remedy="add runs, or repeat some at the same unit, day and rate")
    components = designs.restricted_components(design)
    outlook = Outlook(design=design, components=components)
    unseen = _unseen(design, components, confidence)
    deviations = _deviations(design, components, set(unseen), confidence)
    why = "each {1} has its own {0}, so that its scatter is that of {1}s"
    hidden = {name: why.format(name, twin) for name, twin in twins.items()}
    # What has one run a level scatters with the runs, which foretell one more of it.
    shown = {*design.seen, *(name for name, twin in twins.items() if twin == "run")}
    units = design.levels("unit") if "unit" in labels and "day" in shown else ()
    days = [run.labels.get("day", "") for run in runs]

    def next_run(known: Mapping[str, str]) -> Interval:
        return _of_logarithm(outlook.further_run(known), confidence)

    return Repeatability(
        mean=_of_logarithm(outlook.mean, confidence),
        deviations=deviations,
        within=math.sqrt(design.typical_variance),
        hidden={**hidden, **design.hidden, **unseen},
        next_unit=next_run({}) if "unit" in shown else None,
        next_day={unit: next_run({"unit": unit}) for unit in units},
        drift=slope_of_days(outlook, days, confidence=confidence),
        outliers=tuple(
            replace(one, foretold=math.exp(one.foretold), mean_without=math.exp(one.mean_without))
            for one in departures(design, components)
        ),
        runs=len(runs),
        confidence=confidence,
    )


def _unseen(design: Design, components: Components, confidence: float) -> dict[str, str]:
    """Components that runs too close together cannot show, and why."""
    if np.ptp(design.values) == 0.0 and not np.any(design.variances):
        return dict.fromkeys((*design.seen, "run"), "the runs do not differ")
    too_close = designs.chance_of_less(design) < 0.5 - 0.5 * confidence
    why = "the runs differ by less than their own intervals explain"
    too_wide = {"run": f"{why}, which are too wide to show it"}
    return too_wide if components["run"] == 0.0 and too_close else {}


def _deviations(
    design: Design, components: Components, unseen: Collection[str], confidence: float
) -> dict[str, Deviation]:
    """By factor and ``run``; a scatter that does not show is an upper bound."""
    tail = 0.5 - 0.5 * confidence
    draws = designs.draws_of(design)
    seen = {}
    for name in (name for name in components if name not in unseen):
        low, high = np.sqrt(np.quantile(draws[name], [tail, 1.0 - tail])).tolist()
        value = math.sqrt(components[name])
        # Draws that are nearly all zero allow no more than a bound either.
        if high > value > 0.0:
            seen[name] = Deviation(value=value, low=low, high=high)
        else:
            bounded = designs.draws_of(design, bounded=name)[name]
            bound = math.sqrt(float(np.quantile(bounded, 1.0 - tail)))
            seen[name] = Deviation(value=bound, low=0.0, high=bound, status="upper bound")
    return seen


def _of_logarithm(located: Forecast, confidence: float) -> Interval:
    reach = located.reach(confidence)
    # Three runs may leave an interval of hundreds of e-folds; exp must not overflow on it.
    low, high = located.value - min(reach, 300.0), min(located.value + reach, 300.0)
    return Interval(value=math.exp(located.value), low=math.exp(low), high=math.exp(high))
