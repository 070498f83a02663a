"""Time shift between encoder and gyro, found from a table whose rate varies."""

from typing import Final

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.table.kinematic_fit import KinematicFit, kinematic_fit
from sagnac.table.kinematics import Kinematics, harmonic_sum, kinematics

# A shift is found when it moves by less than this, in samples.
_SAME_LAG: Final = 1e-4
# Gauss-Newton steps towards it, at most.
_LAG_STEPS: Final = 8
# Half the time, s, over which the table rate is smoothed in its derivative.
_SMOOTHED: Final = 1.0
# No recorder stamps its encoder that far from its gyros, s.
_LONGEST_LAG: Final = 1.0


def shifted_kinematics(
    averages: FloatArray,
    encoder: FloatArray,
    kinematic: Kinematics,
    harmonics: FloatArray | None,
    found: KinematicFit,
) -> Kinematics:
    """Kinematics at the shift in time at which the table explains the gyro best.

    Gauss-Newton in the shift: its derivative is the rate of all that goes with the table, of which
    harmonics may be the larger part.

    Parameters
    ----------
    averages
        (averages,) of the gyro angle, rad.
    encoder
        (samples,) unwrapped table angle as recorded, rad.
    kinematic
        `kinematics` of the encoder at the lag known so far.
    harmonics
        Orders present in the angle; None if that is not known.
    found
        Fit at the lag known so far.

    Returns
    -------
    Kinematics
        The one given if the shift runs away: in a gyro that hardly senses the table a shift is
        noise over nothing.
    """
    now = kinematic
    for _ in range(_LAG_STEPS):
        moved = kinematic_fit(
            averages, now, harmonics, with_drift=True, shift=-rate_with_table(now, found)
        )
        if not abs(now.lag + moved.shift) < _LONGEST_LAG:
            return kinematic
        if abs(moved.shift) * now.sample_rate < _SAME_LAG:
            break
        found = moved
        now = kinematics(encoder, now.sample_rate, now.lag + moved.shift)
    return now


def rate_with_table(kinematic: Kinematics, found: KinematicFit) -> FloatArray:
    """(averages,) rate, rad/s, of what goes with the table in a fit: all except the drift."""
    interval = kinematic.interval
    turning = np.gradient(kinematic.angle, interval)
    if found.orders.size:
        # Without its ripple, which goes with harmonics that are too high to be fitted here. Over
        # part of a turn a shift hardly differs from Earth rate, and nothing may blur that.
        window = np.hanning(2 * round(_SMOOTHED / interval) + 1)[1:-1]
        half = window.size // 2
        turning = np.pad(turning, half, "reflect", reflect_type="odd")
        turning = np.convolve(turning, window / window.sum(), "valid")
    rate = found.share + harmonic_sum(
        kinematic.angle, found.orders, found.orders * found.sine, -found.orders * found.cosine
    )
    earth = found.earth[0] * np.gradient(kinematic.cosine, interval)
    earth += found.earth[1] * np.gradient(kinematic.sine, interval)
    return np.asarray(rate * turning + earth)
