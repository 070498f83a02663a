"""Kinematics of the table: its angle and the integrals of its sine and cosine."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.integrate import cumulative_trapezoid

from sagnac import series
from sagnac.arrays import FloatArray

# Kinematic terms are fitted to averages this often: readout quantization and encoder noise, which
# rule 500 Hz increments, average out, and table motion does not.
KINEMATIC_RATE: Final = 10.0  # Hz


@dataclass(frozen=True, slots=True, kw_only=True)
class Kinematics:
    """What table motion and Earth rate make of a table angle; `kinematics` gives it.

    Attributes
    ----------
    table
        (samples,) table angle as the gyro saw it, rad: shifted by `lag`.
    sample_rate
        Hz.
    lag
        Time by which the encoder leads the gyro, s.
    block
        Samples in each of the averages that are fitted.
    angle, cosine, sine
        (averages,) of the table angle, rad, and of the integrals of its cosine and sine, s.
    starts, length
        Both integrals where each piece of `length` samples starts, (pieces + 1, 2), s.
    """

    table: FloatArray
    sample_rate: float
    lag: float
    block: int
    angle: FloatArray
    cosine: FloatArray
    sine: FloatArray
    starts: FloatArray
    length: int


def kinematics(table: FloatArray, sample_rate: float, lag: float = 0.0) -> Kinematics:
    """`Kinematics` of an encoder's angle, (samples,) rad, that leads the gyro by `lag` seconds."""
    dt = 1.0 / sample_rate
    block = max(1, round(sample_rate / KINEMATIC_RATE))
    length = block * max(1, series.SPAN // block)
    shifted = table if lag == 0.0 else shifted_series(table, lag * sample_rate)
    whole = table.size // block
    averages = np.empty((3, whole))

    def over(span: slice) -> tuple[float, float]:
        # Each span ends on the first sample of the next: integrals join there.
        here = shifted[span.start : span.stop + 1]
        parts = (here, *sine_cosine_integrals(here, dt))
        first = span.start // block
        for row, part in zip(averages, parts, strict=True):
            own = averaged(part[: span.stop - span.start], block)
            row[first : first + own.size] = own
        return float(parts[1][-1]), float(parts[2][-1])

    gains = list(series.each(over, table.size, length, release_of=(table, shifted)))
    starts = np.concatenate([np.zeros((1, 2)), np.cumsum(gains, axis=0)])
    for number, begin in enumerate(range(0, whole, length // block)):
        averages[1:, begin : begin + length // block] += starts[number][:, np.newaxis]
    return Kinematics(
        table=shifted,
        sample_rate=sample_rate,
        lag=lag,
        block=block,
        angle=averages[0],
        cosine=averages[1],
        sine=averages[2],
        starts=starts,
        length=length,
    )


def sine_cosine_integrals(table: FloatArray, dt: float) -> tuple[FloatArray, FloatArray]:
    """Integrals of cosine and sine of table angle from its first sample on, s."""
    cosine = cumulative_trapezoid(np.cos(table), dx=dt, initial=0.0)
    return cosine, cumulative_trapezoid(np.sin(table), dx=dt, initial=0.0)


def highest_harmonic(kinematic: Kinematics) -> float:
    """Highest order that `follow_table` can fit beside table motion.

    Above 0.4 of the averages' rate harmonics are averaged away, and alias where they are not.
    """
    step = np.abs(np.diff(kinematic.angle))
    if step.size == 0:
        return 0.0
    return 0.4 * 2.0 * np.pi / max(float(np.percentile(step, 95)), 1e-12)


def averaged(angle: FloatArray, block: int) -> FloatArray:
    """Means of an angle, rad, over its whole blocks of so many samples."""
    whole = angle.size // block
    return np.asarray(angle[: whole * block].reshape(whole, block).mean(axis=1))


def shifted_series(values: FloatArray, samples: float) -> FloatArray:
    """`values` read `samples` earlier, by linear interpolation, held at the ends: a new series."""
    result = series.empty(values.size)
    whole = int(np.floor(-samples))
    fraction = -samples - whole

    def fill(span: slice) -> None:
        at = np.clip(np.arange(span.start, span.stop + 1) + whole, 0, values.size - 1)
        here = values[at[0] : at[-1] + 1][at - at[0]]
        result[span] = here[:-1] + fraction * (here[1:] - here[:-1])

    list(series.each(fill, values.size, release_of=(values, result)))
    return result
