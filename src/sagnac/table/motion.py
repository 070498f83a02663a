"""Table motion in a gyro: its share, drift and Earth rate, fitted and taken out."""

from dataclasses import dataclass

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.table.kinematic_fit import KinematicFit, kinematic_fit, kinematic_fits
from sagnac.table.kinematics import (
    Kinematics,
    block_gain,
    harmonic_sum,
    highest_harmonic,
    sine_cosine_integrals,
    tells_drift,
)
from sagnac.table.turns import FEW_TURNS, full_turns


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
    earth
        Coefficients of the integrals of cos and sin of table angle, rad/s.
    kinematics
        Of the table angle.
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

    def over(self, start: int, stop: int) -> FloatArray:
        """The motion, rad, over samples from a piece's start on (a multiple of its length)."""
        of = self.kinematics
        alpha, dt = of.table[start:stop], 1.0 / of.sample_rate
        motion = self.share * alpha + self.drift * dt * np.arange(start, stop)
        begins = of.starts[start // of.length]
        integrals = sine_cosine_integrals(alpha, dt)
        for rate, begin, integral in zip(self.earth, begins, integrals, strict=True):
            motion += rate * (begin + integral)
        return motion

    @property
    def averages(self) -> FloatArray:
        """(averages,) of the motion, rad, except for a constant."""
        of = self.kinematics
        time = np.arange(of.angle.size) * of.interval
        motion = self.share * of.angle + self.drift * time
        return np.asarray(motion + self.earth[0] * of.cosine + self.earth[1] * of.sine)


def follow_table(
    averages: FloatArray,
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
    kinematic
        `kinematics` of the table angle.
    harmonics
        Orders present in the angle; None if that is not known: all are allowed for. Those
        above `highest_harmonic` are not fitted: take them out before.
    cosine, sine
        (harmonics,) rad of each, taken out of the angle already; None if nothing was.
    """
    taken = None
    if harmonics is not None and cosine is not None and sine is not None:
        taken = _Harmonics(orders=harmonics, cosine=cosine, sine=sine)
    if full_turns(kinematic.table) < FEW_TURNS:
        # Over part of a turn harmonics can make the table angle itself: share and drift first.
        harmonics, taken = np.empty(0), None
    elif taken is not None:
        taken = taken.up_to(highest_harmonic(kinematic))
        harmonics = taken.orders
    found = kinematic_fit(averages, kinematic, harmonics, with_drift=tells_drift(kinematic))
    return _motion(found, kinematic, taken)


def follow_table_together(averages: FloatArray, kinematic: Kinematics) -> tuple[TableMotion, ...]:
    """`follow_table` of several gyros, (gyros, averages) rad, whose harmonics nobody knows.

    They are fitted in one pass.
    """
    harmonics = np.empty(0) if full_turns(kinematic.table) < FEW_TURNS else None
    fits = kinematic_fits(averages, kinematic, harmonics, with_drift=tells_drift(kinematic))
    return tuple(_motion(found, kinematic, None) for found in fits)


def _motion(found: KinematicFit, kinematic: Kinematics, taken: "_Harmonics | None") -> TableMotion:
    """The motion, its harmonics those of the angle, those that were taken out among them."""
    gain = block_gain(kinematic, found.orders)
    of_cosine, of_sine = found.cosine / gain, found.sine / gain
    if taken is not None:
        of_cosine, of_sine = of_cosine + taken.cosine, of_sine + taken.sine
    of_cosine.flags.writeable = of_sine.flags.writeable = False
    return TableMotion(
        share=found.share,
        drift=found.drift,
        earth=found.earth,
        kinematics=kinematic,
        orders=found.orders,
        cosine=of_cosine,
        sine=of_sine,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Harmonics:
    """Harmonics that were taken out of an angle: (orders,) each, amplitudes in rad."""

    orders: FloatArray
    cosine: FloatArray
    sine: FloatArray

    def up_to(self, highest: float) -> "_Harmonics":
        """Those of no higher order."""
        low = self.orders <= highest
        return _Harmonics(orders=self.orders[low], cosine=self.cosine[low], sine=self.sine[low])

    def averages(self, kinematic: Kinematics) -> FloatArray:
        """(averages,) of their sum, rad."""
        size = block_gain(kinematic, self.orders)
        return harmonic_sum(kinematic.angle, self.orders, self.cosine * size, self.sine * size)
