"""By how much a better latch of the encoder would narrow an interval.

What is measured holds the encoder's noise by its share of the table: all of it for one gyro, the
difference of the shares for two that do not take the table out. It is white noise of the angle, a
Q, and hides N from some frequency on. What the spectrum tells of N with that Q and without it
(Whittle's information) says what the encoder costs.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from sagnac import series
from sagnac.analysis.averaged import Averaged
from sagnac.analysis.headline import Headline
from sagnac.analysis.measurement import Measurement
from sagnac.analysis.table_angle import TurningTable
from sagnac.arrays import FloatArray
from sagnac.coefficients.estimates import Estimate
from sagnac.errors import Note, rounded

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
        What is measured, as it is and without the table.
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
    gyros = math.sqrt(followed.gyros_differenced)
    of_encoder = _share(followed, table) * readings / gyros
    quantization = found.average.coefficients["quantization"]
    in_all = quantization.value if quantization.status == "estimated" else of_encoder
    own = math.sqrt(max(in_all**2 - of_encoder**2, 0.0))
    own = min(own, white_noise(measured.angle) / gyros)
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

    def sums(block: slice) -> float:
        thirds = np.diff(angle[block.start : block.stop + 3], n=3)
        return float(thirds @ thirds)

    size = angle.size - 3
    return math.sqrt(series.total(sums, size, angle) / size / _THIRD)


def _share(followed: Measurement, table: TurningTable) -> float:
    """Share of the table's rate that the measured channel senses."""
    shares = [table.shares.get(name, 0.0) for name in followed.gyros]
    if len(shares) == 1:
        return abs(shares[0])
    first, second = followed.weights
    return abs(first * shares[0] - second * shares[1])
