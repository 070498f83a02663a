"""How long to record: a forecast from the analysis of a short recording."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from sagnac.analysis.averaged import reaches
from sagnac.analysis.pipeline import analyze
from sagnac.analysis.result import Analysis, headline_coefficients, require_analysis, require_gyro
from sagnac.core.arrays import pandas_for
from sagnac.core.errors import RecordingError, as_several, is_finite, quoted, refusal, require_type
from sagnac.lines.naming import WIDEST_BINS
from sagnac.noise.laws import STOCHASTIC_NAMES
from sagnac.recording.model import Recording
from sagnac.verdict.forecast import LeftOut, ShortRecording
from sagnac.verdict.limits import Limit, Specification, specification_of


def short_recording(analysis: Analysis) -> ShortRecording:
    """N of an analysis with its interval, and what a longer recording's answer will rest on.

    That is the likelihood of the whole band or the average over bands, whichever is narrower after
    ten times as long: the likelihood leaves every line out with up to forty cells of 1/duration,
    and may use fewer angles than there are samples.

    Raises
    ------
    RecordingError
        If the recording does not estimate N.
    """
    walk, choice = analysis.angle_random_walk, analysis.average
    duration = analysis.recording.duration
    if walk.status != "estimated" or walk.low <= 0.0:
        problem = f"N is {walk.status} after {duration:.4g} s, so that no interval can be forecast"
        # No length of recording makes up for what spoils the data.
        spoilt = [f"mend this first: {note}" for note in analysis.notes if note.level == "error"]
        remedy = "".join(spoilt[:1]) or "record four times as long and ask again"
        raise RecordingError(problem, channel=analysis.channel, remedy=remedy)
    if choice is None or not choice.terms:
        problem, remedy = "the answer rests on no band of the spectrum", "record longer"
        raise RecordingError(problem, channel=analysis.channel, remedy=remedy)
    fit = analysis.fits.get("likelihood")
    band = None if fit is None else fit.band
    average = ShortRecording(
        value=walk.value,
        low=walk.low,
        high=walk.high,
        confidence=walk.confidence,
        coefficients={
            name: estimate.value
            for name, estimate in headline_coefficients(analysis).items()
            if estimate.status == "estimated" and name in STOCHASTIC_NAMES
        },
        terms=STOCHASTIC_NAMES,
        falls=choice.falls > 0.1,
        duration=duration,
        highest=choice.band_hz[1],
        interval=1.0 / analysis.recording.sample_rate,
        left_out=() if band is None else tuple(_left_out(*one, duration) for one in band.masked),
        apart=_apart(analysis),
    )
    # The likelihood of the whole band is the answer, stands beside the average, or nothing speaks
    # against it but that so little of the band is left beside the lines.
    if fit is None or band is None or not band.is_whole:
        return average
    if choice.member == "average" and (fit.departure != 0.0 or not reaches(choice, band.high)):
        return average
    whole_band = replace(average, highest=band.high, interval=band.interval, efficient=True)
    # What the answer of a recording ten times as long will rest on.
    return min((whole_band, average), key=lambda one: one.expected(10.0 * duration))


def _apart(analysis: Analysis) -> float:
    """Logarithm of the ratio of the weights of a pair: each gyro counts by the other's share."""
    ends = analysis.settings.gyros[:1] + analysis.settings.gyros[-1:]
    if not analysis.is_pair or not all(name in analysis.shares for name in ends):
        return 0.0
    first, last = (abs(analysis.shares[name].share.value) for name in ends)
    return abs(math.log(first / last)) if first > 0.0 and last > 0.0 else 0.0


def _left_out(low: float, high: float, duration: float) -> LeftOut:
    """Cells that a line or a band of vibration takes; a line takes as many at any duration."""
    cells = min(0.5 * (high - low) * duration, WIDEST_BINS)
    beside = cells / duration
    # A fit leaves out one more cell on either side of what is masked.
    middle = 0.5 * (low + high)
    ends = min(low + beside, middle), max(high - beside, middle)
    return LeftOut(low=ends[0], high=ends[1], cells=cells + 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRow:
    """One width or limit that is wanted, and how long it takes.

    Attributes
    ----------
    half_width
        Of the interval of N, relative; None if a limit is to be decided.
    limit
        That N is to be decided against, 90 % sure; None if a width is wanted.
    hours
        None if it takes over a year.
    """

    half_width: float | None = None
    limit: Limit | None = None
    hours: float | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """A forecast of how long to record one gyro.

    Attributes
    ----------
    analysis
        Of the short recording.
    shown
        What it shows of N.
    rows
        Widths, then limits.
    """

    analysis: Analysis
    shown: ShortRecording
    rows: tuple[PlanRow, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plans:
    """Forecasts of how long to record.

    Attributes
    ----------
    plans
        One for each gyro that was taken alone, or for the pair; one or more.
    refused
        Why there is none of a gyro, by name.

    Examples
    --------
    >>> import numpy as np
    >>> rate = np.random.default_rng(1).standard_normal(6000)
    >>> short = Recording.from_arrays(x=rate, kind="rate", unit="deg/h", sample_rate=10.0)
    >>> answer = plan(short, within=0.01)
    >>> answer.to_frame().half_width.tolist(), dict(answer.refused)
    ([0.01], {})
    """

    plans: tuple[Plan, ...]
    refused: Mapping[str, RecordingError]

    def to_frame(self) -> Any:
        """A pandas frame with a row for each gyro and each width or limit (rad/sqrt(s)).

        Raises
        ------
        MissingExtra
            If pandas is not installed.
        """
        columns = ["channel", "half_width", "limit_rad_per_sqrt_s", "hours"]
        rows = [
            (one.analysis.channel, row.half_width, row.limit and row.limit.value, row.hours)
            for one in self.plans
            for row in one.rows
        ]
        frame = pandas_for("a plan as a data frame").DataFrame(rows, columns=columns)
        # A column of nothing but None would be no numbers.
        return frame.astype(dict.fromkeys(columns[1:], float))


def plan(
    source: Analysis | Recording,
    *,
    within: float | Sequence[float] = (0.1, 0.05, 0.02, 0.01),
    specification: Specification | str | None = None,
) -> Plans:
    """Forecast from a short recording how long to record for an interval of N or to decide a limit.

    Parameters
    ----------
    source
        A short recording, or its analysis.
    within
        Half widths of the interval that are wanted, relative.
    specification
        Limits of N to decide; those of the analysis unless stated.

    Raises
    ------
    RecordingError
        If no gyro shows N with an interval.
    ValueError
        If a width is not between 0 and 1, there is neither a width nor a limit, a limit is of
        another coefficient than N, or the analysis was read from a file.

    Examples
    --------
    >>> import numpy as np
    >>> rate = np.random.default_rng(1).standard_normal(6000)
    >>> short = Recording.from_arrays(x=rate, kind="rate", unit="deg/h", sample_rate=10.0)
    >>> wide, narrow = plan(short, within=[0.02, 0.01]).plans[0].rows
    >>> 3.0 < narrow.hours / wide.hours < 6.0
    True
    """
    within = as_several(within)
    for width in within:
        if not (is_finite(width) and 0.0 < width < 1.0):
            raise refusal("within", f"is {quoted(width)}; give a half width such as 0.01")
    if specification is not None:
        specification = specification_of(specification)
    require_type("source", source, (Analysis, Recording), "give a recording, or its analysis")
    analysis = source if isinstance(source, Analysis) else analyze(source)
    require_analysis(analysis, recorded=True)
    specification = specification or analysis.settings.specification
    limits = specification.limits if specification else ()
    if not within and not limits:
        raise refusal("within", "is empty, and there is no limit; give a half width such as 0.01")
    if limits:
        require_gyro(analysis)
    for limit in limits:
        if limit.coefficient != "angle_random_walk":
            problem = f"has a limit of {limit.letter}; only an interval of N is forecast"
            raise refusal("specification", problem)
    plans: list[Plan] = []
    refused = dict(analysis.refused)
    for name, one in (analysis.gyros or {analysis.channel: analysis}).items():
        try:
            short = short_recording(one)
        except RecordingError as error:
            refused[name] = error
            continue
        rows = [PlanRow(half_width=each, hours=_hours(short.duration_for(each))) for each in within]
        for limit in limits:
            rows.append(PlanRow(limit=limit, hours=_hours(short.duration_to_decide(limit.value))))
        plans.append(Plan(analysis=one, shown=short, rows=tuple(rows)))
    if not plans:
        raise next(iter(refused.values()))
    return Plans(plans=tuple(plans), refused=refused)


def _hours(duration: float) -> float | None:
    """A forecast duration in hours; None if a year is too short."""
    return duration / 3600.0 if math.isfinite(duration) else None
