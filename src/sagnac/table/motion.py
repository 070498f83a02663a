"""Table motion in a gyro: its share, drift and Earth rate, fitted and taken out."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.linalg

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.constants import EARTH_RATE
from sagnac.table.kinematics import (
    KINEMATIC_RATE,
    Kinematics,
    averaged,
    highest_harmonic,
    kinematics,
    sine_cosine_integrals,
)
from sagnac.table.turns import FEW_TURNS, full_turns

_NUISANCE_ORDERS: Final = 128
# Averages whose columns are held at a time.
_AT_ONCE: Final = 8192
# Prior standard deviation of an Earth-rate coefficient. At constant table rate the Earth terms
# coincide with sin and cos of the table angle, and what is left of them is encoder noise; nothing
# but their size is known then, and this is it.
_EARTH_PRIOR: Final = 2.0 * EARTH_RATE  # rad/s
# Rate variation, over averages of 1 s, above which drift and share are told apart by it. At a
# steadier table only jitter would, and encoder noise in it makes the share too small by as much as
# jitter then stays in the residual; taking the share from the mean rate instead puts the drift
# into it: 0.01 deg/h at 40 deg/s is 1e-7.
_WANDERING: Final = 1e-3
# A time shift between gyro and encoder shows only where the rate strays by this share from a
# straight line.
_VARYING: Final = 0.2
# A shift is found when it moves by less than this, in samples.
_SAME_LAG: Final = 1e-4
# Gauss-Newton steps towards it, at most.
_LAG_STEPS: Final = 8
# Half the time, s, over which the table rate is smoothed in its derivative.
_SMOOTHED: Final = 1.0
# No recorder stamps its encoder that far from its gyros, s.
_LONGEST_LAG: Final = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TableMotion:
    """What of a gyro angle, or of a difference of two, is table motion and Earth rate.

    Attributes
    ----------
    share
        e of the gyro (e_x - e_z of a difference): rad per rad of table angle.
    drift
        Constant rate, rad/s: bias and the Earth's vertical share; 0 at a steady table, where
        it is in `share`.
    earth
        Coefficients of the integrals of cos and sin of table angle, rad/s.
    kinematics
        Of the table angle as the gyro saw it.
    orders, cosine, sine
        (harmonics,) of table angle that were fitted beside it, and are left in, rad.
    """

    share: float
    drift: float
    earth: tuple[float, float]
    kinematics: Kinematics
    orders: FloatArray
    cosine: FloatArray
    sine: FloatArray

    def over(self, span: slice) -> FloatArray:
        """The motion, rad, over a span that starts where a piece of `Kinematics.length` does."""
        of = self.kinematics
        alpha = of.table[span]
        dt = 1.0 / of.sample_rate
        motion = self.share * alpha
        motion += (self.drift * dt) * np.arange(span.start, span.start + alpha.size)
        starts = of.starts[span.start // of.length]
        for factor, start, integral in zip(
            self.earth, starts, sine_cosine_integrals(alpha, dt), strict=True
        ):
            motion += factor * (integral + start)
        return motion

    @property
    def averages(self) -> FloatArray:
        """(averages,) of the motion, rad, but for a constant."""
        of = self.kinematics
        time = np.arange(of.angle.size) * (of.block / of.sample_rate)
        motion = self.share * of.angle + self.drift * time
        return np.asarray(motion + self.earth[0] * of.cosine + self.earth[1] * of.sine)


def follow_table(
    averages: FloatArray,
    encoder: FloatArray,
    kinematic: Kinematics,
    *,
    harmonics: FloatArray | None = None,
    cosine: FloatArray | None = None,
    sine: FloatArray | None = None,
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
    encoder
        (samples,) unwrapped table angle as recorded, rad.
    kinematic
        `kinematics` of the encoder at the lag known so far.
    harmonics
        Orders present in the angle; None where that is not known: all are allowed for. Those
        above `highest_harmonic` are not fitted: take them out before.
    cosine, sine
        (harmonics,) rad of each, taken out of the angle already; None if nothing was.
    """
    if full_turns(encoder) < FEW_TURNS:
        # Over part of a turn harmonics can make the table angle itself: share and drift first.
        harmonics, cosine, sine = np.empty(0), None, None
    # The average of a harmonic over a block is smaller than the harmonic.
    turn = float(np.median(np.abs(np.diff(kinematic.angle)))) / kinematic.block

    def smaller(orders: FloatArray) -> FloatArray:
        half = np.maximum(0.5 * orders * turn, 1e-12)
        return np.asarray(np.sin(kinematic.block * half) / (kinematic.block * np.sin(half)))

    rates = np.diff(averaged(kinematic.angle, max(1, round(KINEMATIC_RATE))))
    variation = float(np.std(rates)) / max(float(np.sqrt(np.mean(rates**2))), 1e-300)
    drifting = variation > _WANDERING
    # Of a rate that grows evenly a shift is only another drift.
    number = np.arange(rates.size) - 0.5 * (rates.size - 1)
    uneven = rates - rates.mean()
    uneven -= number * float(number @ uneven) / max(float(number @ number), 1e-300)
    unevenness = float(np.std(uneven)) / max(float(np.sqrt(np.mean(rates**2))), 1e-300)
    carried: tuple[FloatArray, FloatArray] | None = None
    if harmonics is not None and cosine is not None and sine is not None:
        fitted = harmonics <= highest_harmonic(kinematic)
        harmonics, cosine, sine = harmonics[fitted], cosine[fitted], sine[fitted]
        carried = cosine, sine
        if unevenness > _VARYING:
            # Back in, at the angle that they were taken out at: a shift of the table shifts them.
            carried = None
            size = smaller(harmonics)
            averages = averages + _harmonic_sum(
                kinematic.angle, harmonics, cosine * size, sine * size
            )
    unshifted = kinematic
    solution, orders = _kinematic_fit(averages, kinematic, harmonics, with_drift=drifting)
    if unevenness > _VARYING:
        # Gauss-Newton in the shift: its derivative is the rate of all that goes with the table, of
        # which harmonics may be the larger part.
        for _ in range(_LAG_STEPS):
            shifted, orders = _kinematic_fit(
                averages,
                kinematic,
                harmonics,
                with_drift=True,
                lag_column=-_rate_with_table(kinematic, solution, orders),
            )
            step = float(shifted[4])
            if not abs(kinematic.lag + step) < _LONGEST_LAG:
                # Of a gyro that hardly senses the table a shift is noise over nothing.
                kinematic = unshifted
                break
            if abs(step) * kinematic.sample_rate < _SAME_LAG:
                break
            solution = np.delete(shifted, 4)
            kinematic = kinematics(encoder, kinematic.sample_rate, kinematic.lag + step)
        solution, orders = _kinematic_fit(averages, kinematic, harmonics, with_drift=drifting)
    left = smaller(orders)
    of_cosine, of_sine = solution[4::2] / left, solution[5::2] / left
    if carried is not None:
        of_cosine, of_sine = of_cosine + carried[0], of_sine + carried[1]
    return TableMotion(
        share=float(solution[0]),
        drift=float(solution[1]),
        earth=(float(solution[2]), float(solution[3])),
        kinematics=kinematic,
        orders=orders,
        cosine=of_cosine,
        sine=of_sine,
    )


def _harmonic_sum(
    angle: FloatArray, orders: FloatArray, cosine: FloatArray, sine: FloatArray
) -> FloatArray:
    """Sum over the orders of ``cosine * cos(order * angle) + sine * sin(order * angle)``."""
    total = np.zeros(angle.size)
    for order, a, b in zip(orders, cosine, sine, strict=True):
        total += a * np.cos(order * angle) + b * np.sin(order * angle)
    return total


def _rate_with_table(kinematic: Kinematics, solution: FloatArray, orders: FloatArray) -> FloatArray:
    """Rate, rad/s, of what goes with the table in a `_kinematic_fit`: all but the drift."""
    interval = kinematic.block / kinematic.sample_rate
    turning = np.gradient(kinematic.angle, interval)
    if orders.size:
        # Without its ripple, which goes with harmonics that are too high to be fitted here. Over
        # part of a turn a shift hardly differs from Earth rate, and nothing may blur that.
        window = np.hanning(2 * round(_SMOOTHED / interval) + 1)[1:-1]
        half = window.size // 2
        turning = np.pad(turning, half, "reflect", reflect_type="odd")
        turning = np.convolve(turning, window / window.sum(), "valid")
    rate = solution[0] + _harmonic_sum(
        kinematic.angle, orders, orders * solution[5::2], -orders * solution[4::2]
    )
    earth = solution[2] * np.gradient(kinematic.cosine, interval)
    earth += solution[3] * np.gradient(kinematic.sine, interval)
    return np.asarray(rate * turning + earth)


def _kinematic_fit(
    averages: FloatArray,
    kinematic: Kinematics,
    harmonics: FloatArray | None,
    *,
    with_drift: bool,
    lag_column: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Ridge regression on increments of averages.

    Returns
    -------
    solution, orders
        share, drift, cosine, sine, the coefficient of `lag_column` if there is one, then the
        cosine and sine of each of the orders.
    """
    interval = kinematic.block / kinematic.sample_rate
    time = np.arange(kinematic.angle.size) * interval
    columns = [
        kinematic.angle,
        time if with_drift else np.zeros_like(time),
        kinematic.cosine,
        kinematic.sine,
    ]
    if lag_column is not None:
        columns.append(lag_column)
    prior = [np.inf, np.inf, _EARTH_PRIOR, _EARTH_PRIOR, np.inf][: len(columns)]
    highest = highest_harmonic(kinematic)
    orders = np.arange(1.0, _NUISANCE_ORDERS + 1.0) if harmonics is None else harmonics
    orders = orders[orders <= highest]
    prior += [np.inf] * (2 * orders.size)

    def design(span: slice) -> FloatArray:
        """(columns, span) increments."""
        here = slice(span.start, span.stop + 1)
        phase = np.outer(orders, kinematic.angle[here])
        rows = np.empty((len(prior), phase.shape[1]))
        for row, column in zip(rows, columns, strict=False):
            row[:] = column[here]
        rows[len(columns) :: 2] = np.cos(phase)
        rows[len(columns) + 1 :: 2] = np.sin(phase)
        return np.diff(rows, axis=1)

    target = np.diff(averages)
    # Orthogonal triangles, not the normal equations: the parts of these columns that tell
    # them apart can be 1e-7 of their size, which squared is below rounding.
    triangle = np.empty((0, len(prior) + 1))
    for span in series.spans(target.size, _AT_ONCE):
        stacked = np.vstack([triangle, np.vstack([design(span), target[span]]).T])
        triangle = scipy.linalg.qr(stacked, mode="r", overwrite_a=True)[0][: len(prior) + 1]
    scale = np.sqrt(np.einsum("ij,ij->j", triangle, triangle))[:-1]
    scale[scale == 0.0] = 1.0
    factor, right = triangle[: scale.size, :-1] / scale, triangle[: scale.size, -1]

    def solve(penalty: FloatArray) -> FloatArray:
        stacked = np.vstack([factor, np.diag(penalty)])
        target = np.concatenate([right, np.zeros(scale.size)])
        return np.asarray(scipy.linalg.lstsq(stacked, target, cond=1e-11)[0] / scale)

    free = solve(np.zeros(scale.size))
    leftover = np.concatenate(
        [target[span] - free @ design(span) for span in series.spans(target.size, _AT_ONCE)]
    )
    if harmonics is None or harmonics.size == 0:
        # Lines in time are still in and count as noise: they would otherwise buy any Earth rate
        # that lowers them a little.
        noise = float(np.sqrt(np.mean(leftover**2)))
    else:
        power = np.abs(np.fft.rfft(leftover)[1:]) ** 2 / leftover.size
        noise = float(np.sqrt(np.median(power) / np.log(2.0)))
    penalty = noise / (np.array(prior) * scale)
    solution = solve(penalty)
    while np.abs(solution[2:4]).max() > _EARTH_PRIOR:
        # Not noise but encoder error speaks here, and no amount of it makes the Earth turn faster.
        penalty *= 1.3
        solution = solve(penalty)
    return solution, orders
