"""Each gyro of a triad alone."""

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from typing import Final

import numpy as np

from sagnac.analysis.averaged import Headline, levels_of
from sagnac.analysis.encoder import FOR_COHERENCE, unlike_motion
from sagnac.analysis.evidence import Bands, Evidence, Points
from sagnac.analysis.measurement import Remainder
from sagnac.core.arrays import FloatArray, differences, every
from sagnac.core.errors import Note, RecordingError
from sagnac.noise.band_models import BandModel
from sagnac.noise.estimates import Fit, rooted, unobserved
from sagnac.noise.model_average import average
from sagnac.noise.three_cornered_hat import Separation, three_cornered_hat
from sagnac.noise.whole_band import describes
from sagnac.recording.channel import PAIR_SIZE

# Probability that a true law fails each of the two tests of `describes`, as for the whole band.
_CHANCE: Final = 0.02


def each_alone(evidence: Evidence, headline: Headline) -> Separation:
    """Each gyro's own N by the first of three ways that the data bear out.

    1. Three-cornered hat of every sample, if the headline is a fit of them all;
    2. that of the angles of the likelihood fit, in its band;
    3. averages over bands and terms of the differences of each two.

    Five terms have to describe the spectrum of each difference in 1 and 2. If no levels can be
    made of the spectrum, or the averages of a difference show no N, 2 stands as it is.

    Parameters
    ----------
    evidence
        Of any recording. Unless it is of a triad whose searches for lines came to an end, no gyro
        is told apart.
    headline
        The candidate that the data bear out.

    Returns
    -------
    Separation
        By gyro. Empty if there is no triad to tell apart; not observable, with a warning, if a
        difference holds more than the noise of its two gyros.
    """
    fine, spectrum = evidence.fine, headline.spectrum
    left, second = _pairs(evidence)
    # A gyro that does not count in its pair is not told apart.
    are_apart = second is not left and all(left.weights) and all(second.weights)
    if not are_apart or evidence.readout.every is None or left.once_a_turn:
        return Separation(angle_random_walk={})
    doubt = next(_doubts(evidence, headline), None)
    if doubt is not None:
        channel, why = doubt
        unseen = unobserved("angle_random_walk", evidence.settings.confidence)
        text = f"no angle random walk of each gyro alone: {why}"
        note = Note(channel=channel, level="warning", text=text)
        own = dict.fromkeys(evidence.settings.gyros, unseen)
        return Separation(angle_random_walk=own, notes=(note,))
    is_finer = spectrum is not None and spectrum.points.rate > fine.rate
    if spectrum is not None and is_finer and spectrum.average.rests_on.member == "whole band":
        finest = _hat_of(evidence, spectrum.points, spectrum.likelihood)
        if _describes_each(finest, evidence, spectrum.points.rate):
            return _of_gyros(finest, evidence)
    usual = _hat_of(evidence, fine, evidence.fits["likelihood"])
    if spectrum is None or _describes_each(usual, evidence, fine.rate):
        return _of_gyros(usual, evidence)
    return _of_gyros(_by_averages(evidence, spectrum.points.rate) or usual, evidence)


def _doubts(evidence: Evidence, headline: Headline) -> Iterator[tuple[str, str]]:
    """Differences that hold more than noise of their two gyros: name of the channel, and why."""
    first, *others = evidence.settings.gyros
    pairs = _pairs(evidence)
    for pair, other in zip(pairs, reversed(others), strict=True):
        if not pair.is_finished:
            why = "the search for the lines of their difference did not come to an end"
            yield f"{first}-{other}", why
    found: list[Note] = []
    if headline.spectrum is not None:
        found += unlike_motion(evidence, headline.spectrum.average.rests_on.band_hz)
    increments = differences(pairs[1].removal.residual[:FOR_COHERENCE])
    levels = levels_of(increments, pairs[1].rate, _masked(evidence))
    if levels is not None:
        found += unlike_motion(evidence, average(levels).rests_on.band_hz, number=1)
    yield from ((note.channel, note.text) for note in found)


def _pairs(evidence: Evidence) -> tuple[Remainder, Remainder]:
    """The first gyro and the last, and the first and the one between."""
    return evidence.left, evidence.remainders[-1]


def _masked(evidence: Evidence) -> Bands:
    """(low, high) bands, Hz, whose noise went with the lines of either pair."""
    left, second = _pairs(evidence)
    return left.removal.masked + second.removal.masked


def _steps(evidence: Evidence, one: str, other: str, rate: float) -> FloatArray:
    """Increments of one gyro less another, of angles at a rate, Hz.

    A pair of weights v and w, divided by v, is the first gyro less -w/v times the other. So each
    of the others is scaled here to the table's motion in the first.
    """
    left, second = _pairs(evidence)
    first, _, last = evidence.settings.gyros
    if first not in (one, other):
        return _steps(evidence, one, first, rate) + _steps(evidence, first, other, rate)
    pair = left if last in (one, other) else second
    size = PAIR_SIZE / pair.weights[0] * (1.0 if one == first else -1.0)
    step = max(1, round(left.rate / rate))
    steps = differences(every(pair.removal.residual, step))
    steps *= size
    return steps


def _hat_of(evidence: Evidence, points: Points, fit: Fit) -> Separation:
    """The three-cornered hat of angles, in the band of a fit of them."""
    first, middle, last = evidence.settings.gyros
    pairs = ((middle, first), (first, last))
    try:
        return three_cornered_hat(
            (middle, first, last),
            [_steps(evidence, *pair, points.rate) for pair in pairs],
            sample_rate=points.rate,
            confidence=evidence.settings.confidence,
            masked=_masked(evidence),
            band=(0.0, 0.0 if fit.band is None else fit.band.high),
        )
    except RecordingError as error:
        # Vibration in either difference may leave no band to both.
        note = Note(text=f"no angle random walk of each gyro alone: {error}", level="warning")
        return Separation(angle_random_walk={}, notes=(note,))


def _describes_each(hat: Separation, evidence: Evidence, rate: float) -> bool:
    """Whether the laws of each two gyros describe the levels of their difference."""
    for one, other in combinations(hat.squares, 2):
        levels = levels_of(_steps(evidence, one, other, rate), rate, _masked(evidence))
        if levels is None:
            return False
        squares = hat.squares[one] + hat.squares[other]
        law = BandModel(squares=tuple(squares.tolist()), interval=1.0 / rate)
        if not describes(levels.shape, law.over(levels), levels.level.size - squares.size, _CHANCE):
            return False
    return bool(hat.squares)


def _by_averages(evidence: Evidence, rate: float) -> Separation | None:
    """Each gyro's N from the averages of the three differences; None if one of them shows no N.

    The difference of x and y shows N_xy^2 = N_x^2 + N_y^2, so that 2 N_x^2 is
    N_xy^2 + N_xz^2 - N_yz^2. The errors of the three are added as if they were independent. Two
    differences share a gyro, which makes the error of N_x^2 smaller than that.
    """
    ends: dict[frozenset[str], FloatArray] = {}
    confidence, gyros = evidence.settings.confidence, evidence.settings.gyros
    for one, other in combinations(gyros, 2):
        levels = levels_of(_steps(evidence, one, other, rate), rate, _masked(evidence))
        walk = None if levels is None else average(levels, confidence=confidence).angle_random_walk
        if walk is None or walk.status != "estimated":
            return None
        ends[frozenset((one, other))] = np.array([walk.value, walk.low, walk.high]) ** 2
    own = {}
    for name in gyros:
        value, lower, upper = 0.0, 0.0, 0.0
        for pair, (square, low, high) in ends.items():
            below, above = (square - low, high - square)[:: 1 if name in pair else -1]
            value += 0.5 * (square if name in pair else -square)
            lower, upper = math.hypot(lower, 0.5 * below), math.hypot(upper, 0.5 * above)
        own[name] = rooted("angle_random_walk", confidence, value, value - lower, value + upper)
    return Separation(angle_random_walk=own)


def _of_gyros(hat: Separation, evidence: Evidence) -> Separation:
    """N of the gyros themselves, in their order, without the scale of `_steps`."""
    left, second = _pairs(evidence)
    first, middle, last = evidence.settings.gyros
    weights = {first: (1.0, 1.0), middle: second.weights, last: left.weights}
    own = {}
    for name in weights if hat.angle_random_walk else ():
        one, size = hat.angle_random_walk[name], abs(weights[name][0] / weights[name][1])
        value, low, high = (size * end for end in (one.value, one.low, one.high))
        own[name] = replace(one, value=value, low=low, high=high)
    return replace(hat, angle_random_walk=own)
