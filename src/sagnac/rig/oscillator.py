"""A damped oscillator driven by white noise: servos, structures and bearings that ring."""

import math
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
import scipy.linalg

from sagnac.arrays import BooleanArray, FloatArray
from sagnac.rig import _kernels

_LONG_STEP: Final = 0.1  # part of the ring-down


@dataclass(slots=True, kw_only=True)
class Oscillator:
    """Angle of a damped oscillator driven by white noise, stepped exactly.

    It obeys ``x'' + 2 zeta w x' + w^2 x = noise``. Its angle has the two-sided density
    ``4 zeta w^3 s^2 / ((w^2 - v^2)^2 + (2 zeta w v)^2)`` at the angular frequency v, s being its
    rms angle.

    Attributes
    ----------
    transition, spread
        (2, 2) step of angle and rate, and the factor of the noise added to it.
    state
        At the last step.
    random
        Its stream.
    """

    transition: FloatArray
    spread: FloatArray
    state: _kernels.OscillatorState
    random: np.random.Generator

    @classmethod
    def stationary(
        cls,
        *,
        frequency: float,
        damping: float,
        rms_rate: float,
        step: float,
        random: np.random.Generator,
    ) -> Self:
        """The oscillator in its stationary state.

        Parameters
        ----------
        frequency
            Natural, Hz.
        damping
            Ratio zeta; 1/(2 Q) by quality.
        rms_rate
            rad/s.
        step
            Between the instants at which it is asked for, s.
        random
            Its stream.
        """
        natural = 2.0 * math.pi * frequency
        slope = np.array([[0.0, 1.0], [-natural * natural, -2.0 * damping * natural]])
        angle, rate = np.array([rms_rate / natural, rms_rate]) * random.standard_normal(2)
        return cls(
            transition=np.asarray(scipy.linalg.expm(slope * step)),
            spread=_noise_factor(natural * step, damping) * rms_rate * np.array([[step], [1.0]]),
            state=_kernels.OscillatorState(float(angle), float(rate)),
            random=random,
        )

    def stop(self) -> None:
        """Bring it to rest."""
        self.state = _kernels.OscillatorState(0.0, 0.0)

    def begin(self, drive: float, rate: float) -> tuple[float, float]:
        """Drive and rate one sample before the first, with the oscillator's part added."""
        return drive + self.state.angle, rate + self.state.rate

    def advance(self, commanded: FloatArray, drive: FloatArray, rate: FloatArray) -> None:
        """Add the next steps to drive and rate, whatever is commanded (`table.Mover`)."""
        self._add(self.random.standard_normal((commanded.size, 2)), drive, rate)

    def angles(self, driven: BooleanArray) -> FloatArray:
        """(n,) angle at the next steps, rad; it rings down where it is not `driven`, (n,)."""
        normals = self.random.standard_normal((driven.size, 2))
        normals[~driven] = 0.0
        angle = np.zeros(driven.size)
        self._add(normals, angle, np.zeros(driven.size))
        return angle

    def _add(self, normals: FloatArray, angle: FloatArray, rate: FloatArray) -> None:
        self.state = _kernels.oscillator(
            normals, self.transition, self.spread, self.state, angle, rate
        )


def _noise_factor(turn: float, damping: float) -> FloatArray:
    """Factor of the covariance that a step adds, rate of variance 1, angle in rates times steps.

    It is the stationary covariance less what a step leaves of it. If the step is a small part of
    the ring-down, that difference loses all its digits, and Van Loan's integral (IEEE Trans.
    Automatic Control 23, 395, 1978) is taken, whose exponential grows with long steps.

    `turn` is the natural angular frequency times the step.
    """
    slope = np.array([[0.0, 1.0], [-turn * turn, -2.0 * damping * turn]])
    if damping * turn < _LONG_STEP:
        block = np.zeros((4, 4))
        block[:2, :2], block[2:, 2:] = -slope, slope.T
        block[1, 3] = 4.0 * damping * turn
        ahead = np.asarray(scipy.linalg.expm(block))
        added = ahead[2:, 2:].T @ ahead[:2, 2:]
    else:
        stationary = np.diag([turn**-2.0, 1.0])
        left = np.asarray(scipy.linalg.expm(slope))
        added = stationary - left @ stationary @ left.T
    return np.asarray(np.linalg.cholesky(0.5 * (added + added.T)))
