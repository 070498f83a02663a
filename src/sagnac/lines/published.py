"""Lines removed as the paper removes them: Steps 1 and 2, and what Step 3 is left with."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from sagnac.core.arrays import FloatArray, IntegerArray
from sagnac.core.errors import Note, refusal, require_count
from sagnac.lines import orthogonal_search
from sagnac.lines.grid_search import grid_fit, grid_search, grid_sinusoids
from sagnac.lines.model import Line, Removal, Scale, lines_of
from sagnac.lines.naming import TAKEN_BINS
from sagnac.lines.orthogonal_search import OrthogonalSearch, Stop
from sagnac.spectrum import periodogram
from sagnac.spectrum.power_laws import noise_floor
from sagnac.table.kinematics import harmonic_sum, sine_cosine_integrals
from sagnac.table.turns import is_turning

# Lowest frequency of the search in time, cycles a record: 18.9. The Allan deviation of a line, 2 A
# sin^2(pi f tau) / tau, is highest at tau = 0.371 / f, and the paper's cut at 10 % ends the curve
# at a 51st of the record (1/sqrt(2 (N/n - 1))). A line of this frequency is highest there. A slower
# one only rises as tau within the curve, as does the rate ramp among the five terms. Below it lies
# most of the mean square of a walk's angle, which is no line.
SLOWEST_CYCLES: Final = 1.1655612 / math.pi * 51.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedSearch:
    """How Steps 1 and 2 are run. The paper states none of it; the defaults are a fair reading.

    Parameters
    ----------
    cells
        Candidate frequencies in time for each cycle a record: 4 is a grid of 1/(4T). A grid
        finer than the Fourier transform's is what the search is used for (McGaughey et al. 2003).
    orders
        Candidates in angle are the whole orders up to this one.
    most_orders, most_lines
        Pairs of cosine and sine chosen at most, in angle and in time. A line between two
        frequencies of the grid takes two or three pairs.
    slowest
        Lowest frequency of the search in time, cycles a record. Above zero the rule
        ``false-alarm`` holds in a walk's noise, too (`grid_search`): without it nearly all terms go
        to the slow wander of the walk.
    stop, false_alarm
        The rule by which a search stops before that, as `fast_orthogonal_search` takes it.
    difference_first
        Step 3 before Steps 1 and 2: the lines of a pair are searched for in its difference. The
        gyros are then taken in such parts that the table's motion cancels, as their shares e_x and
        e_z are fitted, and Earth rate is taken out by the integrals of which Eq. 6 is the closed
        form on a steady table. False is the paper's order, with the plain difference of Eq. 21:
        on a table whose rate wanders, the wander hides the lines of each gyro, and
        (e_x - e_z) alpha stays in the difference.

    Raises
    ------
    ValueError
        If a number is out of range or the rule is not known.

    References
    ----------
    McGaughey et al., Ann. Biomed. Eng. 31 (2003) 741; Eqs. 17-22 of Yu et al. 2013.
    """

    cells: int = 4
    orders: int = 64
    most_orders: int = 64
    most_lines: int = 60
    slowest: float = SLOWEST_CYCLES
    stop: Stop = "false-alarm"
    false_alarm: float = 0.05
    difference_first: bool = True

    def __post_init__(self) -> None:
        for name in ("cells", "orders"):
            require_count(name, getattr(self, name), 1)
        if not 0.0 <= self.slowest < math.inf:
            raise refusal("slowest", f"is {self.slowest!r}; give cycles a record, zero or more")
        for most in (self.most_orders, self.most_lines):
            orthogonal_search.require_rule(self.stop, self.false_alarm, most)


# As someone who knows the search would run it.
FAIR: Final = PublishedSearch()

# The steps in the paper's order, with the difference as Eq. 21 has it, and no lowest frequency.
AS_PRINTED: Final = PublishedSearch(slowest=0.0, difference_first=False)

# On the frequencies of the Fourier transform, with Korenberg's bound for one candidate.
LITERAL: Final = PublishedSearch(
    cells=1, most_orders=40, most_lines=40, slowest=0.0, stop="korenberg", difference_first=False
)


def remove_lines_as_published(
    angles: Mapping[str, FloatArray],
    table: FloatArray | None,
    sample_rate: float,
    *,
    search: PublishedSearch = FAIR,
    progress: Callable[[float], None] | None = None,
) -> Removal:
    """Steps 1 to 3 of the paper: orders, lines in time, and the difference of two gyros.

    Step 1 searches the whole orders of table angle, Step 2 an even grid of frequencies in time.
    Both fit a constant and a slope along with the sinusoids, and only the sinusoids are removed.
    The difference comes first unless `search` says otherwise. In the paper's order both searches
    are of each gyro, and what it senses of the table and the Earth, e_x (eta_3 t + alpha), stays in
    for Step 3 (Eq. 20). Eq. 22 sums over the same frequencies for both gyros, so that each gyro
    is fitted with those that either search chose. The jitter of the table that is chosen as if it
    were a line then goes out of both, and its rest cancels as before.

    Parameters
    ----------
    angles
        (samples,) rad by name: of one gyro, or of two, the second of which is taken off the first.
        One alone has no Step 3, so that the fitted e_x alpha goes with Step 1. Of two gyros, the
        squares of the parts in which they are taken add up to two, as in a plain difference.
    table
        (samples,) unwrapped table angle, rad; None at rest.
    sample_rate
        Hz.
    search
        Grid, orders, terms and rule.
    progress
        Told the share that is done.

    References
    ----------
    Eqs. 17-22 of Yu et al. 2013.
    """
    report = progress or (lambda _: None)
    turning = table if table is not None and is_turning(table) else None
    alone, rule = len(angles) == 1, {"stop": search.stop, "false_alarm": search.false_alarm}
    if len(angles) == 2 and search.difference_first:
        angles = {"-".join(angles): _difference(list(angles.values()), turning, sample_rate)}
    left: list[FloatArray] = []
    in_angle: list[Line] = []
    in_time: list[Line] = []
    chosen: dict[str, IntegerArray] = {}
    for number, (name, angle) in enumerate(angles.items()):
        rest = angle
        if turning is not None:
            how: dict[str, Any] = {**rule, "spacing": 1.0, "most_terms": search.most_orders}
            how["candidates"] = search.orders
            found = orthogonal_search.fast_orthogonal_search(turning, angle, **how)
            rest = angle - harmonic_sum(turning, found.frequencies, found.cosine + 1j * found.sine)
            # Alone, a gyro loses what it senses of the table as well.
            rest = rest - found.slope * turning if alone else rest
            in_angle += _lines(found, "angle", 1.0, name)
        report((number + 0.3) / (len(angles) + 1))
        # Step 2.
        half = (search.cells * rest.size - 1) // 2
        lowest = min(max(1, math.ceil(search.slowest * search.cells)), half)
        how = {**rule, "cells": search.cells, "lowest": lowest, "most_terms": search.most_lines}
        found = grid_search(rest, **how)
        in_time += _lines(found, "time", sample_rate / (2.0 * np.pi), name)
        chosen[name] = found.chosen
        left.append(rest)
        report((number + 1) / (len(angles) + 1))
    # The same fit of either gyro and then their difference, or the fit of their difference: least
    # squares is linear.
    rest = left[0] if len(left) == 1 else left[0] - left[1]
    together = list(dict.fromkeys(np.concatenate(list(chosen.values())).tolist()))
    fitted = grid_fit(rest, np.array(together, dtype=np.int64), cells=search.cells)
    rest = rest - grid_sinusoids(fitted, rest.size)
    frequency = fitted.frequencies * sample_rate / (2.0 * np.pi)
    width = TAKEN_BINS * sample_rate / rest.size
    full = [name for name, own in chosen.items() if own.size >= max(search.most_lines, 1)]
    ended = f"ended at its {search.most_lines} terms in time, not by its rule"
    text = f"the orthogonal search of {', '.join(full)} {ended}: the last of them may be noise"
    report(1.0)
    return Removal(
        residual=rest,
        lines=(*in_angle, *in_time),
        masked=tuple((float(place - width), float(place + width)) for place in frequency),
        taken=_noise_taken(np.sort(frequency), rest, sample_rate),
        notes=(Note(text=text),) if full else (),
    )


def _difference(pair: list[FloatArray], table: FloatArray | None, sample_rate: float) -> FloatArray:
    """Step 3: the first gyro less the second, without table motion and Earth rate.

    On a turning table each gyro is fitted with e alpha and with what Earth rate makes of it, the
    integrals of cos alpha and sin alpha. The parts of the gyros are in the inverse ratio of their
    shares e, so that e alpha cancels without the encoder and its noise. A constant drift is not
    fitted: on a steady table it could not be told from a share.
    """
    first, second = pair
    if table is None:
        return first - second
    earth = sine_cosine_integrals(table, 1.0 / sample_rate)
    columns = (np.ones(table.size), table, *earth)
    sizes = np.array([max(float(np.linalg.norm(column)), 1e-300) for column in columns])
    gram = np.array([[one @ other for other in columns] for one in columns])
    data = np.array([[column @ own for own in pair] for column in columns])
    scaled = gram / np.outer(sizes, sizes), data / sizes[:, np.newaxis]
    fitted = np.linalg.lstsq(*scaled, rcond=1e-13)[0] / sizes[:, np.newaxis]
    shares = fitted[1]
    parts = math.sqrt(2.0) * shares[::-1] / max(float(np.hypot(*shares)), 1e-300)
    sensed = (fitted @ (parts * np.array([1.0, -1.0])))[2:]
    difference = parts[0] * first - parts[1] * second
    return np.asarray(difference - (sensed[0] * earth[0] + sensed[1] * earth[1]))


def _lines(search: OrthogonalSearch, scale: Scale, cycles: float, channel: str) -> list[Line]:
    """Terms of an orthogonal search as lines; it has no noise model, so no errors either.

    Parameters
    ----------
    found
        The search.
    scale
        Of its phase.
    cycles
        Turns the search's frequencies into cycles per turn, or into Hz.
    channel
        Name of the gyro.
    """
    drops = -np.diff(search.mean_square) / np.maximum(search.mean_square[1:], np.finfo(float).tiny)
    return lines_of(
        [scale] * search.chosen.size,
        channel,
        frequency=search.frequencies * cycles,
        frequency_error=math.nan,
        amplitude=np.hypot(search.cosine, search.sine),
        amplitude_error=math.nan,
        phase=np.arctan2(-search.sine, search.cosine),
        phase_error=math.nan,
        significance=drops,
    )


def _noise_taken(frequency: FloatArray, residual: FloatArray, sample_rate: float) -> FloatArray:
    """`taken` of `Removal` for pairs at ascending frequencies, Hz.

    A pair takes the noise of one cycle a record around its frequency; pairs closer to each other
    share it. How strong the noise is there is read from the floor of what is left; if most of the
    neighbouring bins went, too, that floor is up to a fifth low.
    """
    increments = np.diff(residual)
    # What is left of the table's rate would leak through the zeros that follow in the transform.
    increments -= increments.mean()
    floor = noise_floor(periodogram.periodogram(increments))
    apart = np.diff(frequency, prepend=-np.inf, append=np.inf)
    gaps = np.minimum(apart, sample_rate / residual.size)
    density = periodogram.density_at(frequency, floor, sample_rate)
    return np.stack([frequency, 0.5 * (gaps[1:] + gaps[:-1]), density])
