"""When, and at which table angles, an angle was sampled, and what a search needs of that.

Each property is made when it is first asked for: the search needs it again and again.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from sagnac.core.arrays import BLOCK, ComplexArray, FloatArray, blocks, every, extent
from sagnac.spectrum.sums import angle_sums
from sagnac.table import kinematics, turns

# Highest whole order that counts as the table's own and goes by Fourier sums. A higher one is a
# line in time until the table's unsteadiness shows otherwise.
MOST_ORDERS: Final = 128

# Samples in each mean of what is mixed down to zero frequency, and of `Wander`.
MIX_BLOCK: Final = 50


class Blocks(NamedTuple):
    """Blocks of steps on which the table is taken to turn evenly.

    Attributes
    ----------
    angle, step, lag, length
        (blocks,) mean table angle, rad; mean step, rad; middle of the block in samples from
        mid-record; number of its steps.
    """

    angle: FloatArray
    step: FloatArray
    lag: FloatArray
    length: FloatArray


class Wander(NamedTuple):
    """How the table strays from a steady rate, mean by mean of `MIX_BLOCK` samples.

    Attributes
    ----------
    rate
        Mean rate of the table, rad a sample.
    middles
        (means,) middle of each, in samples from mid-record.
    phase
        (means,) mean table angle less that of a steady rate, rad.
    origin
        That of a steady rate in mid-record, rad.
    """

    rate: float
    middles: FloatArray
    phase: FloatArray
    origin: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Sampling:
    """When, and at which table angles, an angle was sampled.

    Attributes
    ----------
    samples
        Of the angle.
    table
        (samples,) angle of a table that turns, rad; None at rest.
    sample_rate
        Hz.
    """

    samples: int
    table: FloatArray | None
    sample_rate: float

    @cached_property
    def ends(self) -> tuple[float, float]:
        """Ends of the table's range, rad; 0 at rest."""
        return (0.0, 0.0) if self.table is None else extent(self.table)

    @property
    def turns(self) -> float:
        """Turns between the lowest and the highest table angle; 0 at rest."""
        return (self.ends[1] - self.ends[0]) / (2.0 * np.pi)

    @property
    def phase_range(self) -> tuple[float, float]:
        """Middle of the range of the blocks, and the range itself or 1 rad, the larger."""
        angle = self.blocks.angle
        low, high = (float(angle.min()), float(angle.max())) if angle.size else (0.0, 0.0)
        return 0.5 * (low + high), max(high - low, 1.0)

    @cached_property
    def mean_rate(self) -> float:
        """Mean speed, rad/s, signed by the net direction if there is one; 0 at rest."""
        return 0.0 if self.table is None else turns.mean_rate(self.table, self.sample_rate)

    @cached_property
    def speeds(self) -> FloatArray:
        """(ranks,) speeds at evenly spaced ranks, ascending, rad a sample; 0 at rest."""
        return np.zeros(1) if self.table is None else speeds(self.table)

    @property
    def fastest(self) -> float:
        """Highest speed, rad a sample."""
        return float(self.speeds[-1])

    @cached_property
    def blocks(self) -> Blocks:
        """Blocks of steps on which the table turns evenly; none at rest."""
        table = self.table
        if table is None:
            return Blocks(*np.empty((4, 0)))
        steps, length = self.samples - 1, _block_length(table)
        starts = np.arange(0, steps, length)
        ends = np.minimum(starts + length, steps)
        count = (ends - starts).astype(np.float64)
        angle = np.empty(starts.size)
        for some in blocks(steps, multiple=length):
            here = table[some.start : some.stop + 1]
            middle = 0.5 * (here[1:] + here[:-1])
            own = np.add.reduceat(middle, np.arange(0, middle.size, length))
            angle[some.start // length :][: own.size] = own
        step = np.diff(np.append(every(table[:-1], length), table[-1])) / count
        lag = np.asarray(0.5 * (starts + ends - steps))
        return Blocks(angle=angle / count, step=step, lag=lag, length=count)

    @cached_property
    def order_products(self) -> tuple[FloatArray, ComplexArray]:
        """Sums from which the products of all pairs of whole orders up to `MOST_ORDERS` follow.

        An increment of ``exp(1j k alpha)`` is ``2j sin(k step / 2) exp(1j k middle)``, with the
        step of the table and the angle in its middle. The product of two has
        ``cos((k - m) step / 2) - cos((k + m) step / 2)`` for its size, which is expanded in
        Chebyshev polynomials of the squared step. A single wild step of the encoder is no rate:
        steps count up to half above the fastest block.

        Returns
        -------
        expansion
            (degree + 1, orders) coefficients of ``cos(s * step / 2)`` for s = 0, 1, ….
        sums
            (degree + 1, orders) sums of each polynomial times ``exp(1j * s * middle)``.
        """
        table = self.table
        if table is None:
            raise ValueError("order_products of a record at rest; there are no orders")
        fastest, highest = float(np.abs(self.blocks.step).max()), 2 * MOST_ORDERS
        # Long blocks: what a block costs besides its steps is that of a hundred thousand of them.
        long = self.samples - 1, 2 * BLOCK
        ends = [extent(np.diff(table[some.start : some.stop + 1]) ** 2) for some in blocks(*long)]
        high = max(min(largest, (1.5 * fastest) ** 2) for _, largest in ends)
        low = min([smallest for smallest, _ in ends] + [high])
        # Beyond its Nyquist frequency an order is no candidate, and need not be expanded well.
        reach = np.minimum(np.arange(highest + 1.0), 2.0 * np.pi / max(fastest, 1e-12))
        expansion = _half_cosines_expanded(low, high, reach)
        sums = np.zeros((expansion.shape[0], highest + 1), dtype=np.complex128)
        for some in blocks(*long):
            here = table[some.start : some.stop + 1]
            squares = np.minimum(np.diff(here) ** 2, high)
            place = 2.0 * (squares - low) / max(high - low, 1e-300) - 1.0
            polynomials = chebyshev.chebvander(place, expansion.shape[0] - 1)
            columns = np.ascontiguousarray(polynomials.T, dtype=np.float64)
            sums += angle_sums(0.5 * (here[1:] + here[:-1]), columns, highest).conj()
        return expansion, sums

    @cached_property
    def wander(self) -> Wander | None:
        """How the table strays from a steady rate.

        None at rest, if it goes back and forth, or if the record is too short to tell: such a table
        has no rate that a tone could be an order of.
        """
        steps = self.samples - 1
        if self.table is None or steps < 24 * MIX_BLOCK:
            return None
        angle = kinematics.averages_of(self.table[:steps], MIX_BLOCK)
        middles = np.arange(float(angle.size)) * MIX_BLOCK + (0.5 * (MIX_BLOCK - 1) - 0.5 * steps)
        number = middles - float(middles.mean())
        rate = float(number @ angle) / float(number @ number)
        # A net rate below half of the mean speed is of a table that goes back and forth.
        if abs(rate) < 0.5 * abs(self.mean_rate) / self.sample_rate:
            return None
        phase, origin = angle - angle.mean() - rate * number, angle.mean() - rate * middles.mean()
        return Wander(rate=rate, middles=middles, phase=phase, origin=float(origin))


def speeds(table: FloatArray) -> FloatArray:
    """Speeds of a table angle, rad a sample, at up to 200 evenly spaced ranks, ascending."""
    # Measured at some four thousand samples.
    apart = max(1, table.size // 4000)
    # Short, since a long span would average out a swing of the table.
    span = min(apart, 32)
    speed = np.sort(np.abs(every(table[span:], apart) - every(table[:-span], apart))) / span
    return speed[np.linspace(0, speed.size - 1, min(200, speed.size)).astype(np.int64)]


def mean_square_step(orders: FloatArray, speed: FloatArray) -> FloatArray:
    """(orders,) mean square increment of exp(i k alpha) at the table's speeds, rad a sample."""
    return np.asarray((4.0 * np.sin(np.outer(orders, speed) / 2.0) ** 2).mean(axis=1))


def _block_length(table: FloatArray) -> int:
    """Steps in the longest block on which the table turns evenly: a power of 2, 256 at most.

    At the highest order the table strays from a straight line within a block by 1e-3 rad rms over
    the record: products of an order and a tone are then good to the square of that.
    """
    block = 256
    # Half as long, the straight line is four times better kept.
    while block > 1:
        coarse = np.diff(every(table, block)) / block
        bend = float(np.sqrt(np.mean(np.diff(coarse) ** 2))) if coarse.size > 1 else np.inf
        if MOST_ORDERS * bend * block / 8.0 < 1e-3:
            break
        block //= 2
    return block


def _half_cosines_expanded(low: float, high: float, reach: FloatArray) -> FloatArray:
    """(degree + 1, orders) coefficients of ``cos(reach * step / 2)`` in the squared step.

    The degree is the lowest that is good to 1e-9, 24 at most.
    """

    def half_cosines(place: FloatArray) -> FloatArray:
        squares = np.maximum(low + 0.5 * (place + 1.0) * (high - low), 0.0)
        return np.cos(0.5 * np.outer(np.sqrt(squares), reach))

    check = np.linspace(-1.0, 1.0, 33)
    for degree in range(1, 25):
        nodes = chebyshev.chebpts1(degree + 1)
        expansion = np.linalg.solve(chebyshev.chebvander(nodes, degree), half_cosines(nodes))
        values = chebyshev.chebvander(check, degree) @ expansion
        if np.abs(values - half_cosines(check)).max() < 1e-9:
            break
    return np.asarray(expansion)
