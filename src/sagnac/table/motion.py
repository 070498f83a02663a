"""Table motion in a gyro: its share, drift and Earth rate, fitted and taken out.

Ridge regression of a gyro's averages on the kinematics of the table.

The columns are the table angle (the share), time (the drift), the integrals of its cosine and sine
(Earth rate), and the cosine and sine of each order beside them.
All are fitted in increments, in which the angle random walk is white.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.linalg
import scipy.linalg.lapack

from sagnac.core.arrays import ComplexArray, FloatArray, blocks, empty
from sagnac.core.units import EARTH_RATE
from sagnac.table import _kernels, kinematics
from sagnac.table.kinematics import LARGEST_EARTH_RATE, Kinematics
from sagnac.table.turns import FEW_TURNS, full_turns, mean_rate

# Averages whose columns are held at a time.
_AT_ONCE: Final = 2048
_NONE: Final[FloatArray] = np.empty(0)
# Columns of a `Design` before its orders, and those of Earth rate among them.
_PLAIN: Final = 4
_EARTH: Final = slice(2, 4)
# Singular values below this share of the largest are directions that the data do not distinguish.
_COLLINEAR: Final = 1e-11


@dataclass(frozen=True, slots=True, kw_only=True)
class TableMotion:
    """Table motion and Earth rate in a gyro angle, or in a difference of two.

    Attributes
    ----------
    share
        e of the gyro (e_x - e_z of a difference): rad per rad of table angle.
    drift
        Constant rate, rad/s: bias and the Earth's vertical share. 0 at a steady table, whose
        `share` holds it.
    earth, earth_error
        Coefficients of the integrals of cos and sin of table angle, and the larger of their
        standard errors if the noise of the averages' increments were white, rad/s.
    noise
        Standard deviation of these increments, rad.
    kinematics
        Of the table angle.
    orders, phasor
        (harmonics,) of table angle that were fitted beside it and are left in, and
        ``cosine + 1j * sine`` of each, rad.
    """

    share: float
    drift: float
    earth: tuple[float, float]
    earth_error: float
    noise: float
    kinematics: Kinematics
    orders: FloatArray
    phasor: ComplexArray

    def off_by_earth(self, level: float) -> float:
        """Standard error, rad, that Earth rate brings into order 1.

        At a steady table the two are one: what is off in one is off in the other. The ridge leaves
        a part of Earth rate out, all of it where nothing tells it from order 1.

        Parameters
        ----------
        level
            Of the noise at the table rate, as the variance of white increments of samples, rad^2.
        """
        of = self.kinematics
        kept = 1.0 - min(self.earth_error / LARGEST_EARTH_RATE, 1.0) ** 2
        ratio = level * of.block / self.noise**2 if self.noise > 0.0 else 0.0
        error = math.hypot(math.sqrt(ratio * kept) * self.earth_error, (1.0 - kept) * EARTH_RATE)
        return error / abs(mean_rate(of.table, of.sample_rate))

    def over(self, start: int, stop: int) -> FloatArray:
        """The motion, rad, over samples from a piece's start on (a multiple of its length)."""
        of, motion = self.kinematics, np.empty(stop - start)
        dt, begin = 1.0 / of.sample_rate, float(of.starts[start // of.length] @ self.earth)
        _kernels.table_motion(of.table[start:stop], self.share, dt, self.earth, begin, motion)
        if self.drift:
            motion += self.drift * dt * np.arange(start, stop)
        return motion

    def less(self, angle: FloatArray) -> FloatArray:
        """(samples,) an angle without the motion, rad: a new array."""
        rest = empty(angle.size)
        for block in blocks(angle.size, self.kinematics.length):
            np.subtract(angle[block], self.over(block.start, block.stop), out=rest[block])
        return rest

    @property
    def averages(self) -> FloatArray:
        """(averages,) of the motion, rad, except for a constant."""
        of = self.kinematics
        motion = self.share * of.angle + self.drift * (np.arange(of.angle.size) * of.interval)
        return np.asarray(motion + self.earth[0] * of.cosine + self.earth[1] * of.sine)


@dataclass(frozen=True, slots=True, kw_only=True)
class Design:
    """Columns of the regression, made some averages at a time.

    Attributes
    ----------
    kinematic
        Of the table.
    orders
        (orders,) whose cosine and sine stand last, after the `_PLAIN` columns: table angle in rad,
        time in s, the integrals of cosine and sine in s.
    with_drift
        Whether time counts; else its column is of zeros.
    shared
        (averages,) the angle of which a share is fitted, rad; that of the table if None.
    """

    kinematic: Kinematics
    orders: FloatArray
    with_drift: bool
    shared: FloatArray | None = None

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return _PLAIN + 2 * self.orders.size

    def increments(self, start: int, stop: int) -> FloatArray:
        """(coefficients, stop - start) increments of every column."""
        of, here = self.kinematic, slice(start, stop + 1)
        rows, whole = np.empty((self.size, stop - start)), kinematics.are_whole(self.orders)
        rows[1] = np.diff(of.interval * np.arange(start, stop + 1.0)) * self.with_drift
        angle = of.angle if self.shared is None else self.shared
        for row, column in ((0, angle), (2, of.cosine), (3, of.sine)):
            rows[row] = np.diff(column[here])
        waves = kinematics.harmonics_of(of.angle[here], int(self.orders[whole].max(initial=0.0)))
        for row, order in enumerate(self.orders):
            wave = waves[int(order)] if whole[row] else np.exp(1j * order * of.angle[here])
            cosine, sine = rows[_PLAIN + 2 * row :][:2]
            np.subtract(wave.real[1:], wave.real[:-1], out=cosine)
            np.subtract(wave.imag[1:], wave.imag[:-1], out=sine)
        return rows


def follow_table_together(
    averages: FloatArray,
    kinematic: Kinematics,
    harmonics: FloatArray | None = None,
    *,
    beside: FloatArray = _NONE,
    shared: FloatArray | None = None,
) -> tuple[TableMotion, ...]:
    """`follow_table` of several gyros on one table.

    The columns are made, and made orthogonal, once. Least squares on increments of averages, Earth
    rate held by its prior.

    Parameters
    ----------
    averages
        (gyros, averages) of the gyro angles, rad; each is fitted by itself.
    kinematic
        Of the table.
    harmonics
        Orders present in the angles; None if that is not known: all are allowed for, up to 128.
    beside
        Orders that are not whole, such as of a bearing, allowed for as well.
    shared
        As `Design` has it.
    """
    # Orders allowed for while nobody knows which there are.
    orders = np.append(np.arange(1.0, 129.0) if harmonics is None else harmonics, beside)
    orders = orders[orders <= kinematics.highest_harmonic(kinematic)]
    # Harmonics are known only after a search, which takes lines in time out as well. If these are
    # still in, they count as noise: they would otherwise buy any Earth rate that lowers them.
    lines_taken = harmonics is not None and harmonics.size > 0
    if full_turns(kinematic.table) < FEW_TURNS:
        # Over part of a turn harmonics can make the table angle itself: share and drift first.
        orders, lines_taken = np.empty(0), False
    drifts = kinematics.tells_drift(kinematic)
    columns = Design(kinematic=kinematic, orders=orders, with_drift=drifts, shared=shared)
    targets = np.diff(averages)
    rows = triangle(columns, targets)
    gain = np.repeat(kinematics.block_gain(kinematic, orders), 2)
    motions = []
    for number, target in enumerate(targets):
        reduced = Triangle.of(rows, columns.size, number)
        free = reduced.solution(np.zeros(columns.size))
        noise = reduced.deviation(free, target.size)
        if lines_taken:
            noise = noise_beside_lines(columns, target, free)
        penalty = np.zeros(columns.size)
        penalty[_EARTH] = noise / (LARGEST_EARTH_RATE * reduced.scale[_EARTH])
        solution = kinematics.bounded_by_earth(reduced.solution, penalty, _EARTH)
        share, drift, *earth = solution[:_PLAIN].tolist()
        motion = TableMotion(
            share=share,
            drift=drift,
            earth=(earth[0], earth[1]),
            earth_error=noise * float(reduced.deviations(penalty)[_EARTH].max()),
            noise=noise,
            kinematics=kinematic,
            orders=orders,
            phasor=(solution[_PLAIN:] / gain).view(np.complex128),
        )
        motions.append(motion)
    return tuple(motions)


def triangle(columns: Design, targets: FloatArray) -> FloatArray:
    """Triangular factor of the columns beside the targets, (rows, coefficients + targets).

    Orthogonal triangles, not the normal equations: the parts of these columns that tell them apart
    can be 1e-7 of their size, which squared is below rounding.
    """
    size, width = columns.size, columns.size + targets.shape[0]
    upper = np.zeros((width, width), order="F")
    for block in blocks(targets.shape[1], _AT_ONCE):
        # Columns of the regression are rows here, as LAPACK wants them.
        rows = np.empty((width, block.stop - block.start))
        rows[:size] = columns.increments(block.start, block.stop)
        rows[size:] = targets[:, block]
        # Twelve columns at once: `dgeqrf` takes fewer than 128 one by one and thrice the time.
        upper, *_ = scipy.linalg.lapack.dtpqrt(
            0, min(12, width), upper, rows.T, overwrite_a=True, overwrite_b=True
        )
    return np.triu(upper)


@dataclass(frozen=True, slots=True, kw_only=True)
class Triangle:
    """Least squares reduced to a triangle, its columns scaled to unit length.

    Attributes
    ----------
    factor
        (rows, coefficients).
    right
        (rows,) what it has to give.
    scale
        (coefficients,) length of each column; 1 for a column of zeros.
    beyond
        Sum of squares of the target that no columns can give, rad^2.
    """

    factor: FloatArray
    right: FloatArray
    scale: FloatArray
    beyond: float

    @classmethod
    def of(cls, rows: FloatArray, size: int, number: int = 0) -> "Triangle":
        """The triangle of one target, from the rows that `triangle` makes of `size` columns."""
        factor, target = rows[:size, :size], rows[:, size + number]
        scale = np.sqrt(np.einsum("ij,ij->j", factor, factor))
        scale[scale == 0.0] = 1.0
        beyond = float(target[size:] @ target[size:])
        return cls(factor=factor / scale, right=target[:size], scale=scale, beyond=beyond)

    def solution(self, penalty: FloatArray) -> FloatArray:
        """(coefficients,) of the ridge regression with a penalty on each scaled coefficient."""
        stacked = np.vstack([self.factor, np.diag(penalty)])
        target = np.concatenate([self.right, np.zeros(self.scale.size)])
        scaled = scipy.linalg.lstsq(stacked, target, cond=_COLLINEAR)[0]
        return np.asarray(scaled / self.scale, dtype=np.float64)

    def deviations(self, penalty: FloatArray) -> FloatArray:
        """(coefficients,) standard errors of `solution` in those of the target; 0 for no column."""
        used = np.flatnonzero(self.factor.any(axis=0))
        # What the data do not distinguish at all keeps a finite error.
        stacked = np.vstack([self.factor[:, used], np.diag(penalty + _COLLINEAR)[:, used]])
        upper = scipy.linalg.qr(stacked, mode="r", check_finite=False)[0][: used.size]
        errors = np.zeros(self.scale.size)
        inverse = scipy.linalg.solve_triangular(upper, np.eye(used.size), check_finite=False)
        errors[used] = np.sqrt(np.einsum("ij,ij->i", inverse, inverse))
        return errors / self.scale

    def deviation(self, solution: FloatArray, count: int) -> float:
        """Root mean square of what a solution leaves of `count` increments, rad."""
        left = self.right - self.factor @ (solution * self.scale)
        return float(np.sqrt((left @ left + self.beyond) / count))


def noise_beside_lines(columns: Design, target: FloatArray, solution: FloatArray) -> float:
    """Standard deviation, rad, of white noise in what a solution leaves, whatever orders it has."""
    left = empty(target.size)
    for block in blocks(target.size, _AT_ONCE):
        left[block] = target[block] - solution @ columns.increments(block.start, block.stop)
    power = np.abs(np.fft.rfft(left)[1:]) ** 2 / left.size
    # The median of a chi-square of two degrees of freedom is ln 2 of its mean.
    return float(np.sqrt(np.median(power) / np.log(2.0)))


def follow_table(
    averages: FloatArray,
    kinematic: Kinematics,
    *,
    harmonics: FloatArray | None = None,
    phasor: ComplexArray | None = None,
    shared: FloatArray | None = None,
) -> TableMotion:
    """Fit table motion and Earth rate by the integrated kinematics.

    The model is ``share * alpha + drift * t + c1 * int cos(alpha) dt + c2 * int sin(alpha)
    dt``: Eq. 6 without its assumption that the rate is constant. Harmonics of table angle
    are fitted beside it, so that they do not bend it, and left in. Fitting more of them than
    there are costs something: ripple of the table beats with Earth rate into neighbouring
    orders, and a harmonic there hides the only sign of Earth rate at a steady table.

    Parameters
    ----------
    averages
        Of the gyro angle over the blocks of `kinematic`, rad.
    kinematic
        `kinematics` of the table angle.
    harmonics
        Orders present in the angle; None if that is not known: all are allowed for. Those
        above `highest_harmonic` are not fitted: take them out before.
    phasor
        (harmonics,) ``cosine + 1j * sine`` of each, rad, taken out of the angle already; None if
        nothing was.
    shared
        (averages,) the angle of which a share is fitted, rad; that of the table if None.
    """
    (motion,) = follow_table_together(averages[np.newaxis], kinematic, harmonics, shared=shared)
    if harmonics is None or phasor is None:
        return motion
    fitted = harmonics <= kinematics.highest_harmonic(kinematic)
    # No order is fitted over less than a few turns.
    return replace(motion, phasor=motion.phasor + phasor[fitted]) if motion.orders.size else motion
