"""Periodic disturbances of the gyro angles: in table angle, Eq. 10, and in time, Eq. 11."""

from dataclasses import dataclass

import numpy as np

from sagnac.arrays import ComplexArray, FloatArray
from sagnac.rig import _kernels
from sagnac.rig.sections import GYRO_NAMES, DisturbanceConfig, Pairs
from sagnac.units import ARCSECOND


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnLines:
    """Periodic disturbances of one scale, with the amplitudes and phases drawn for each gyro.

    Attributes
    ----------
    position
        (lines,) orders or frequencies in Hz, ascending.
    phasor
        (3, lines) amplitude and phase in each gyro, rad: the line is Re(phasor exp(i k alpha)).
    """

    position: FloatArray
    phasor: ComplexArray

    def __post_init__(self) -> None:
        expected = (len(GYRO_NAMES), self.position.size)
        if self.phasor.shape != expected:
            raise ValueError(f"phasor has shape {self.phasor.shape}; give {expected}")
        if np.any(np.diff(self.position) < 0.0):
            raise ValueError(f"position is {self.position.tolist()}; give it ascending")

    @property
    def in_phase(self) -> FloatArray:
        """(3, lines) coefficients of the cosine, rad."""
        return np.ascontiguousarray(self.phasor.real)

    @property
    def quadrature(self) -> FloatArray:
        """(3, lines) coefficients of the sine, rad."""
        return np.ascontiguousarray(-self.phasor.imag)


@dataclass(frozen=True, slots=True, kw_only=True)
class Disturbances:
    """All periodic disturbances of one recording."""

    angle: DrawnLines
    time: DrawnLines

    @classmethod
    def drawn(cls, config: DisturbanceConfig, random: np.random.Generator) -> "Disturbances":
        """Draw them once for a recording: those in table angle, then those in time."""
        angle = _drawn(config.angle, random)
        return cls(angle=angle, time=_drawn(config.time, random))

    def advance(self, first: int, alpha: FloatArray, interval: float) -> FloatArray:
        """Their sum in the gyro angles, zero if angle and time are zero.

        Parameters
        ----------
        first
            Number of the first sample.
        alpha
            (n,) table angle, rad.
        interval
            Between samples, s.

        Returns
        -------
        FloatArray
            (3, n) rad.
        """
        offset = -self.angle.phasor.real.sum(axis=1) - self.time.phasor.real.sum(axis=1)
        angles = np.repeat(offset[:, np.newaxis], alpha.size, axis=1)
        lines = self.angle
        _kernels.harmonics(alpha, lines.position, lines.in_phase, lines.quadrature, angles)
        lines = self.time
        cycles = lines.position * interval
        _kernels.lines_in_time(first, cycles, lines.in_phase, lines.quadrature, angles)
        return angles


def _drawn(pairs: Pairs, random: np.random.Generator) -> DrawnLines:
    position = np.array([position for position, _ in pairs], dtype=np.float64)
    amplitude = np.array([amplitude for _, amplitude in pairs], dtype=np.float64) * ARCSECOND
    shape = (len(GYRO_NAMES), len(pairs))
    amplitudes = amplitude * random.uniform(0.5, 1.0, shape)
    phases = random.uniform(-np.pi, np.pi, shape)
    order = np.argsort(position, kind="stable")
    return DrawnLines(position=position[order], phasor=(amplitudes * np.exp(1j * phases))[:, order])
