"""How far the encoder of a turning table decides an answer.

A pair whose weights are unlike holds no table motion, but is not the plain mean of the two.

One gyro: nothing but the encoder tells the motion of the table from its noise, so the encoder's own
wander counts as the gyro's. A second gyro on the table gives it away: both show the same. And the
two together, each weighted by the other's share, hold no table at all: what is left bounds the
noise of either.

What is measured holds the encoder's noise by its share of the table. It is white noise of the
angle, a Q, and hides N from some frequency on. What the spectrum tells of N with that Q and without
it (Whittle's information) says what a better latch would bring.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from sagnac.analysis.averaged import Averaged
from sagnac.analysis.common_noise import shared_walk
from sagnac.analysis.headline import Headline
from sagnac.analysis.measurement import Measurement
from sagnac.analysis.table_angle import ALIKE, TurningTable
from sagnac.core.arrays import FloatArray, blocks
from sagnac.core.errors import Note, rounded
from sagnac.noise.estimates import Estimate
from sagnac.noise.lowest_ordinates import LEAST_AVERAGES, highest_walk
from sagnac.quality.encoder_faults import LEAST_SHARE, table_share
from sagnac.recording.channel import PAIR_SIZE
from sagnac.recording.model import Recording
from sagnac.table.kinematics import averages_of
from sagnac.table.turns import mean_rate

# Standard errors beyond which nothing lies.
_FAR: Final = 20.0


def of_both_alike(measured: Measurement, read: Headline) -> Headline:
    """The answer of a pair of which each gyro has a weight, with an interval for the plain mean.

    The square of what is read is the mean of N^2 of the two gyros by the squares of their weights,
    so that N of the pair lies between what is read over the larger weight and over the smaller. An
    interval that holds any value between the two at the confidence asked for is that of Imbens and
    Manski (Econometrica 72, 1845, 2004): on either side c standard errors, with
    ``Phi(c + d) - Phi(-c)`` the confidence and d the distance of the two in standard errors.

    Parameters
    ----------
    measured
        As `followed` gives it.
    read
        The answer.
    """
    least, most = sorted(abs(weight) for weight in measured.weights)
    estimate = read.estimate
    if least == most or estimate.status == "not observable":
        return read
    notes = read.notes
    if not (ALIKE[0] < least and most < ALIKE[1]):
        first, second = measured.gyros
        note = Note(
            channel=measured.channel,
            text=f"{first} counts {abs(measured.weights[0]):.2f} times and {second} "
            f"{abs(measured.weights[1]):.2f} times, so that the two take the table out; the "
            "interval holds their plain mean whichever of the two has the noise",
        )
        notes = (*notes, note)
    if estimate.status != "estimated":
        high = estimate.high / least
        return replace(read, estimate=replace(estimate, value=high, high=high), notes=notes)
    part = _part_of_errors(estimate, math.log(most / least))
    low = estimate.value / most * (estimate.low / estimate.value) ** part
    high = estimate.value / least * (estimate.high / estimate.value) ** part
    return replace(read, estimate=replace(estimate, low=low, high=high), notes=notes)


def _part_of_errors(estimate: Estimate, apart: float) -> float:
    """Part of an interval's reach on either side of two values `apart` in ln N that holds both."""
    usual = float(ndtri(0.5 + 0.5 * estimate.confidence))
    if estimate.low <= 0.0 or estimate.low == estimate.high:
        return 1.0
    distance = apart * 2.0 * usual / math.log(estimate.high / estimate.low)

    def beyond(deviations: float) -> float:
        return float(ndtr(deviations + distance) - ndtr(-deviations)) - estimate.confidence

    return max(0.0, float(brentq(beyond, -_FAR, _FAR))) / usual


# Rms s by which the time of an encoder's readings may wander unseen in half an hour.
_WANDERS: Final = 100e-6

WANDER: Final = _WANDERS / math.sqrt(1800.0)
"""Random walk that the time of an encoder's readings may have unseen, s/sqrt(s)."""

# Part of N that it may make up in an estimate.
_UNSEEN: Final = 0.3


def answer_of_one(
    headline: Headline,
    measured: Measurement,
    recording: Recording,
    table: TurningTable,
    *,
    masked: Sequence[tuple[float, float]],
    levels: Estimate | None,
    residual: FloatArray | None,
    pair: Callable[[str], Estimate],
    doubted: bool = False,
) -> Headline:
    """The answer of one gyro with what its encoder may have added.

    Parameters
    ----------
    headline
        Of the gyro with the encoder's readings taken off.
    measured, recording, table
        The gyro, its recording and the table.
    masked
        (low, high) bands of its lines, Hz.
    levels
        What the levels of its spectrum say of it; None if they are not to be trusted.
    residual
        (samples,) rad that removal left of it; None if it is not to be trusted.
    pair
        Angle random walk per gyro of this gyro and another one, by that one's name.
    doubted
        Whether a finding says that the encoder errs by more than noise.
    """
    other = _other(measured, recording)
    two = None if other is None else pair(other)
    if other is None or two is None or two.status == "not observable":
        answer = _lone(headline, measured, table, levels, doubted=doubted)
        return _lowered(answer, measured, table, residual, masked)
    own, shown = headline.estimate, PAIR_SIZE * two.high
    shared = shared_walk(
        recording, (measured.gyros[0], other), table, masked=masked, confidence=own.confidence
    )
    if own.status == "estimated" and own.low < shown and shared and not shared.is_present:
        low = math.sqrt(max(own.low**2 - max(shared.high, 0.0), 0.0))
        if low > 0.0:
            return replace(headline, estimate=replace(own, low=low))
    # All of what the two hold may be the noise of one, whose weight is one within their shares.
    high = shown if own.status == "not observable" else min(shown, own.high)
    bound = replace(own, value=high, low=0.0, high=high, status="upper bound")
    name = measured.gyros[0]
    seen = shared is not None and shared.low > 0.0
    why = f"{other} shows the same wander" if seen else "it hides the gyro's noise"
    note = Note(
        channel=name,
        level="warning",
        text=f"the encoder decides what {name} alone can show: {why}; the "
        f"bound is of {name} and {other} together, which take the table out by "
        "themselves (name both with {gyros})",
    )
    source = f"{name} and {other} together, all of whose noise may be that of {name}"
    return Headline(estimate=bound, source=source, notes=(*headline.notes, note), by_encoder=True)


def _other(measured: Measurement, recording: Recording) -> str | None:
    """Another gyro that senses the table, the first there is."""
    for gyro in recording.gyros:
        if gyro.name not in measured.gyros and abs(table_share(recording, gyro)) > LEAST_SHARE:
            return gyro.name
    return None


def _lone(
    headline: Headline,
    measured: Measurement,
    table: TurningTable,
    levels: Estimate | None,
    *,
    doubted: bool,
) -> Headline:
    """Without a second gyro: the wander that no one sees is part of the answer."""
    own = headline.estimate
    lowest = levels if levels is not None and levels.status == "upper bound" else own
    if own.status == "upper bound" and lowest.value < own.value:
        # The curve is of points, in each of which the noise of a reading stands in full.
        source = f"the spectrum of {measured.channel} below its roll-off"
        headline = replace(headline, estimate=lowest, source=source)
    own, name = headline.estimate, measured.gyros[0]
    known, estimate = table.known, table.estimate
    if known is None or estimate is None:
        return headline
    if own.status != "estimated":
        if not estimate.smoothed:
            return headline
        note = Note(
            channel=name,
            level="warning",
            text=f"the encoder decides what {name} can show: its noise lies above the gyro's, and "
            "no second gyro on the table takes it out; record one, or latch the encoder with the "
            "gyros",
        )
        return replace(headline, notes=(*headline.notes, note), by_encoder=True)
    if doubted:
        bound = replace(own, value=own.high, low=0.0, status="upper bound")
        return replace(headline, estimate=bound, by_encoder=True)
    unseen = abs(table.shares[name] * mean_rate(known, measured.sample_rate)) * WANDER
    if unseen < _UNSEEN * own.low:
        low = math.sqrt(own.low**2 - unseen**2)
        return replace(headline, estimate=replace(own, low=low))
    bound = replace(own, value=own.high, low=0.0, status="upper bound")
    note = Note(
        channel=name,
        level="warning",
        text=f"what {name} shows beside the encoder may be the encoder's: readings whose time "
        f"wanders by {1e6 * _WANDERS:g} us in half an hour make as much, and no second gyro on the "
        "table tells; "
        f"only an upper bound is given (if the encoder adds nothing, {name} has "
        f"{own.to('deg/sqrt(h)')})",
    )
    return replace(headline, estimate=bound, notes=(*headline.notes, note), by_encoder=True)


# Averages of a record: enough for its lowest ordinates, and few in a record of any length.
_AVERAGES: Final = 2 * LEAST_AVERAGES


def _lowered(
    answer: Headline,
    measured: Measurement,
    table: TurningTable,
    residual: FloatArray | None,
    masked: Sequence[tuple[float, float]],
) -> Headline:
    """The answer, its bound lowered to what the lowest frequencies allow.

    The encoder's noise is least there. Beside N and white noise of the readings the residual may
    hold a drift, a part of the table's motion by an error of the share, and a part of its rate by a
    delay and a change of it.
    """
    own, readings = answer.estimate, table.readings
    if own.status == "estimated" or residual is None or readings is None:
        return answer
    block = residual.size // _AVERAGES
    if block == 0:
        return answer
    averages, angle = averages_of(residual, block), averages_of(readings, block)
    rate = np.gradient(angle)
    interval = block / measured.sample_rate
    highest = highest_walk(
        averages,
        np.stack([angle, rate, rate * np.linspace(-1.0, 1.0, rate.size)]),
        interval=interval,
        masked=masked,
        confidence=own.confidence,
    )
    if not highest < (own.value if own.status == "upper bound" else math.inf):
        return answer
    bound = replace(own, value=highest, low=0.0, high=highest, status="upper bound")
    source = f"the lowest frequencies of the spectrum of {measured.channel}"
    return replace(answer, estimate=bound, source=source)


# Part of the interval that a better latch has to leave at the most to be worth a note.
_WORTH: Final = 0.8
# Times the bound from which on something else than white noise decides the interval.
_ELSE: Final = 3.0
# Variance of a third difference of white noise, in that of the noise.
_THIRD: Final = 20.0
# Points of the sum over frequencies.
_POINTS: Final = 2000


def with_latch_note(
    answer: Headline,
    read: Estimate,
    found: Averaged | None,
    *,
    measured: Measurement,
    followed: Measurement,
    table: TurningTable,
) -> Headline:
    """An answer with a note if the encoder decides its interval.

    Parameters
    ----------
    answer
        Of one gyro.
    read
        The same without what unlike weights of a pair leave open.
    found
        The average that it rests on.
    measured, followed
        What is measured, per gyro, and without the table.
    table
        As the analysis uses it.
    """
    estimate = answer.estimate
    if estimate.status != "estimated" or found is None or table.angle is None:
        return answer
    half, narrowed = _half(estimate), _half(read)
    if narrowed > _WORTH * half:
        bound, without = _bounds(estimate.value, found, measured, followed, table)
        narrowed = half * without / bound if half < _ELSE * bound else half
    # Else two gyros have unlike shares, and their difference would need the encoder.
    if narrowed > _WORTH * half:
        return answer
    note = Note(
        channel=followed.channel,
        text="the noise of the encoder decides the interval: latched with the gyros, it would "
        f"narrow it from ± {rounded(100.0 * half)} % to about ± {rounded(100.0 * narrowed)} %",
    )
    return replace(answer, notes=(*answer.notes, note))


def _bounds(
    walk: float,
    found: Averaged,
    measured: Measurement,
    followed: Measurement,
    table: TurningTable,
) -> tuple[float, float]:
    """Half intervals that no estimate beats, with the noise of the encoder and without it."""
    readings = white_noise(table.angle) if table.angle is not None else 0.0
    rate, seconds = followed.sample_rate, followed.angle.size / followed.sample_rate
    of_encoder = abs(followed.share(table.shares)) * readings
    if followed.is_pair:
        of_encoder /= PAIR_SIZE
    quantization = found.average.coefficients["quantization"]
    in_all = quantization.value if quantization.status == "estimated" else of_encoder
    own = math.sqrt(max(in_all**2 - of_encoder**2, 0.0))
    own = min(own, white_noise(measured.angle))
    with_encoder, without = (
        half_interval(walk, white, sample_rate=rate, seconds=seconds) for white in (in_all, own)
    )
    return with_encoder, without


def _half(answer: Estimate) -> float:
    """Half interval, as a part of N."""
    return 0.5 * (answer.high - answer.low) / answer.value


def half_interval(walk: float, white: float, *, sample_rate: float, seconds: float) -> float:
    """Half interval of 95 %, as a part of N, that no estimate without bias beats.

    Of all ordinates of the spectrum N^2 + Q^2 (2 r sin(pi f/r))^2 / r, with Q unknown, too.

    Parameters
    ----------
    walk, white
        N, rad/sqrt(s), and Q, rad: white noise of each sample.
    sample_rate, seconds
        r, Hz, and the length of the record.
    """
    edges = np.geomspace(1.0 / seconds, 0.5 * sample_rate, _POINTS)
    frequency, count = np.sqrt(edges[1:] * edges[:-1]), np.diff(edges) * seconds
    shape = (2.0 * sample_rate * np.sin(np.pi * frequency / sample_rate)) ** 2 / sample_rate
    slopes = np.stack([np.ones_like(shape), shape]) / (walk**2 + white**2 * shape)
    information = (slopes * count) @ slopes.T
    square = 1.0 / (information[0, 0] - information[0, 1] ** 2 / information[1, 1])
    return 1.96 * math.sqrt(square) / (2.0 * walk**2)


def white_noise(angle: FloatArray) -> float:
    """Rms of the noise from reading to reading, rad, by third differences, which leave no motion.

    Parameters
    ----------
    angle
        (samples,) rad.
    """
    size, square = angle.size - 3, 0.0
    for block in blocks(size):
        thirds = np.diff(angle[block.start : block.stop + 3], n=3)
        square += float(thirds @ thirds)
    return math.sqrt(square / size / _THIRD)
