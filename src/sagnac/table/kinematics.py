"""Kinematics of the table: its angle, the integrals of its sine and cosine, and Earth rate."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac.core.arrays import BooleanArray, ComplexArray, FloatArray, block_length, blocks
from sagnac.core.units import EARTH_RATE
from sagnac.spectrum.sums import COSINE, HIGHEST, angle_series
from sagnac.table import _kernels

# ---- earth -------------------------------------------------------------------------

# Bound of an Earth-rate coefficient of a gyro or of a difference of two, rad/s. At a constant table
# rate the Earth terms coincide with the sine and cosine of the table angle, and what is left of
# them is encoder noise. Nothing but their size is known then: this bound serves as the standard
# deviation of their prior, and a fit under that prior may not exceed it (`bounded_by_earth`).
LARGEST_EARTH_RATE: Final = 2.0 * EARTH_RATE


def bounded_by_earth(
    solve: Callable[[FloatArray], FloatArray], penalty: FloatArray, earth: slice
) -> FloatArray:
    """Solution of a ridge regression whose Earth-rate coefficients stay within the bound.

    Parameters
    ----------
    solve
        Gives the (coefficients,) solution for a (coefficients,) penalty.
    penalty
        (coefficients,) noise over prior standard deviation; 0 without a prior.
    earth
        Which coefficients are Earth rate, rad/s.

    Returns
    -------
    FloatArray
        (coefficients,) the first solution within the bound as the prior is tightened; the plain
        one if Earth rate has no penalty, so that no prior could hold it.
    """
    solution, held = solve(penalty), bool(np.all(penalty[earth] > 0.0))
    while held and np.abs(solution[earth]).max() > LARGEST_EARTH_RATE:
        # Encoder error speaks here, not noise, and no amount of it makes the Earth turn faster.
        # The first solution within the bound is taken, not the one on it: a root would be no better
        # known.
        penalty = 1.3 * penalty
        solution = solve(penalty)
    return solution


# ---- kinematics --------------------------------------------------------------------

# Rate, Hz, of the averages that kinematic terms are fitted to. Readout quantization and encoder
# noise rule 500 Hz increments; they average out, and table motion does not.
KINEMATIC_RATE: Final = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Kinematics:
    """Terms of table motion and Earth rate in a gyro angle; `kinematics` gives them.

    Attributes
    ----------
    table
        (samples,) unwrapped table angle, rad.
    sample_rate
        Hz.
    block
        Samples in each of the averages that are fitted.
    angle, cosine, sine
        (averages,) of the table angle, rad, and of the integrals of its cosine and sine, s.
    starts, length
        Both integrals at the start of each piece of `length` samples, (pieces + 1, 2), s.
    """

    table: FloatArray
    sample_rate: float
    block: int
    angle: FloatArray
    cosine: FloatArray
    sine: FloatArray
    starts: FloatArray
    length: int

    @property
    def interval(self) -> float:
        """Time between averages, s."""
        return self.block / self.sample_rate


def kinematics(
    table: FloatArray, sample_rate: float, *, rate: float = KINEMATIC_RATE
) -> Kinematics:
    """Kinematics of a table angle, in one pass over it.

    Parameters
    ----------
    table
        (samples,) unwrapped table angle, rad.
    sample_rate
        Hz.
    rate
        Averages a second, about: each is of a whole number of samples.
    """
    dt, block = 1.0 / sample_rate, max(1, round(sample_rate / rate))
    length = block_length(block)
    rows, begun = [], [np.zeros(2)]
    for piece in blocks(table.size, length):
        # Each piece ends on the first sample of the next: integrals join there.
        here, inside = table[piece.start : piece.stop + 1], piece.stop - piece.start
        cosine, sine = sine_cosine_integrals(here, dt)
        means = [averaged(part[:inside], block) for part in (here, cosine, sine)]
        rows.append(means + np.append(0.0, begun[-1])[:, np.newaxis])
        begun.append(begun[-1] + (cosine[-1], sine[-1]))
    averages, starts = np.concatenate(rows, axis=1), np.array(begun)
    averages.flags.writeable = starts.flags.writeable = False
    angle, cosine, sine = averages
    return Kinematics(
        table=table,
        sample_rate=sample_rate,
        block=block,
        angle=angle,
        cosine=cosine,
        sine=sine,
        starts=starts,
        length=length,
    )


def sine_cosine_integrals(table: FloatArray, dt: float) -> tuple[FloatArray, FloatArray]:
    """Integrals of cosine and of sine of a table angle, (samples,) s each, from its first sample.

    Parameters
    ----------
    table
        (samples,) rad.
    dt
        Time between samples, s.
    """
    of_cosine, of_sine = np.empty(table.size), np.empty(table.size)
    _kernels.sine_cosine_integrals(table, dt, of_cosine, of_sine)
    return of_cosine, of_sine


def highest_harmonic(kinematic: Kinematics) -> float:
    """Highest order that can be fitted to the averages beside table motion.

    Harmonics above 0.4 of the averages' rate are averaged away, and those that are not, alias. The
    speed is that of 95 % of the way, not of the time: a table that stops turns in few averages.
    """
    step = np.sort(np.abs(np.diff(kinematic.angle)))
    way = np.cumsum(step)
    fastest = float(step[np.searchsorted(way, 0.95 * way[-1])]) if step.size else np.inf
    return 0.4 * 2.0 * np.pi / max(fastest, 1e-12)


def rate_variation(kinematic: Kinematics) -> float:
    """Standard deviation of the rate over averages of 1 s, as a share of its root mean square.

    0 of a record that is too short to show any.
    """
    rates = np.diff(averaged(kinematic.angle, max(1, round(KINEMATIC_RATE))))
    if rates.size == 0:
        return 0.0
    return float(np.std(rates)) / max(float(np.sqrt(np.mean(rates**2))), 1e-300)


def tells_drift(kinematic: Kinematics) -> bool:
    """Whether the rate varies enough to tell drift and share apart.

    At a steadier table only jitter would tell them apart, and encoder noise in it makes the
    share too small by as much as jitter then stays in the residual. The share taken from the
    mean rate instead holds the drift as well: 0.01 deg/h at 40 deg/s is 7e-8.
    """
    return rate_variation(kinematic) > 1e-3


def block_gain(kinematic: Kinematics, orders: FloatArray) -> FloatArray:
    """(orders,) size of the averages of each harmonic over that of the harmonic itself."""
    step = float(np.median(np.abs(np.diff(kinematic.angle)))) / kinematic.block
    half = np.maximum(0.5 * orders * step, 1e-12)
    return np.asarray(np.sin(kinematic.block * half) / (kinematic.block * np.sin(half)))


def harmonic_sum(angle: FloatArray, orders: FloatArray, phasor: ComplexArray) -> FloatArray:
    """Sum of ``cosine * cos(order * angle) + sine * sin(order * angle)`` over the orders.

    `phasor` is (orders,) ``cosine + 1j * sine``.
    """
    whole = are_whole(orders)
    total = np.zeros(angle.size)
    if whole.any():
        places = orders[whole].astype(np.int64)
        sums = np.zeros(int(places.max()) + 1, dtype=np.complex128)
        np.add.at(sums, places, phasor[whole].conj())
        total += angle_series(angle, sums)
    for order, own in zip(orders[~whole], phasor[~whole], strict=True):
        total += np.abs(own) * angle_series(order * angle - np.angle(own), COSINE)
    return total


def are_whole(orders: FloatArray) -> BooleanArray:
    """(orders,) which are whole numbers of no great size: those go by products of one wave."""
    return np.asarray((orders >= 0.0) & (orders <= HIGHEST) & (orders == np.rint(orders)))


def harmonics_of(angle: FloatArray, highest: int) -> ComplexArray:
    """(highest + 1, samples) values of ``exp(1j * k * angle)`` for k = 0 ... `highest`.

    Each is a product of two lower ones. That takes a fifth of the time of a sine and a cosine,
    and does not round a phase of many turns.
    """
    waves = np.empty((highest + 1, angle.size), dtype=np.complex128)
    waves[0] = 1.0
    if highest:
        waves[1].real, waves[1].imag = np.cos(angle), np.sin(angle)
    filled = 2
    while filled <= highest:
        more = min(filled - 1, highest + 1 - filled)
        np.multiply(waves[1 : 1 + more], waves[filled - 1], out=waves[filled : filled + more])
        filled += more
    return waves


def averaged(angle: FloatArray, block: int) -> FloatArray:
    """Means of `angle`, in its unit, over its whole blocks of `block` samples."""
    whole = angle.size // block
    return np.asarray(angle[: whole * block].reshape(whole, block).mean(axis=1))


def averages_of(angle: FloatArray, block: int) -> FloatArray:
    """(averages,) of a long (samples,) angle over its whole blocks of `block` samples."""
    parts = [averaged(angle[some], block) for some in blocks(angle.size, multiple=block)]
    return np.concatenate(parts)
