"""The ring laser gyro: a fast model of what the lock-in equation does.

The beat phase psi between the two waves, 2 pi for every `fringe` of input angle, obeys

    d(psi)/dt = w - w_L sin(psi + beta) + quantum noise,        w = 2 pi rate / fringe

(Aronowitz, in *Laser Applications* vol. 1, 1971). Backscatter couples the waves with a
phase beta. That beta wanders, as a random walk with variance 2 D t, is an assumption: the
scatterers' optical paths would have to move by a wavelength in 1/D seconds (a hundredth of a
second at the rig's 150 rad^2/s), faster than mirrors warm or creep, so that vibration or the
discharge would have to do it. No source gives a D.
`mean_rate` and `angle_random_walk` are its slow behaviour, derived below and tested against the
equation integrated step by step:

At constant rate
    The beat runs at sqrt(w^2 - w_L^2), or stands still below w_L. Quantum noise is passed
    on with (w^2 + w_L^2/2)/(w^2 - w_L^2) times its power, the weak-noise diffusion
    v^3 <1/f^3> along f(psi) = w - w_L sin(psi). The term w_L sin(wt + beta) itself has,
    at zero frequency, the density w_L^2 D/(w^2 + D^2): the tail of a line at the beat
    frequency broadened by the wandering phase. So, if it does wander, N falls as 1/rate.
Dithered
    Twice a cycle the rate passes zero. There psi = psi_0 + a t^2/2, with a the rate of
    change of w, and the phase is kicked by w_L sqrt(2 pi/a) sin(psi_0 +- pi/4), of mean
    square pi w_L^2/a. When the dither's amplitude is noisy enough that psi_0 is random,
    kicks are independent, and 2 f pi w_L^2/a = w_L^2/W with W the dither's peak rate. In
    angle N = rate_L sqrt(fringe/(2 pi peak)), the known law. At an input rate the zero
    lies off the dither's steepest point and the peak becomes sqrt(peak^2 - rate^2). The
    mean of the lock-in term is zero to second order: the scale factor is 1.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagnac.core.arrays import FloatArray
from sagnac.core.units import ARCSECOND, DEGREE, DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR
from sagnac.rig.sections import GyroConfig

# Kicks one swing apart are correlated by exp(-s^2/2) where s is the rms phase between them.
_RANDOM_ENOUGH: Final = 3.0  # rad: a correlation of 1 %


@dataclass(frozen=True, slots=True, kw_only=True)
class RingLaser:
    """A ring laser.

    Attributes
    ----------
    lock_in
        Input rate below which the undithered beat stands still, rad/s.
    fringe
        Input angle per beat, rad.
    quantum_noise
        Angle random walk of spontaneous emission, rad/sqrt(s).
    backscatter_diffusion
        D of the backscatter phase, rad^2/s; its variance grows by 2 D t.
    """

    lock_in: float
    fringe: float
    quantum_noise: float = 0.0
    backscatter_diffusion: float = 0.0

    @property
    def phase_per_angle(self) -> float:
        """Beat phase per input angle."""
        return 2.0 * math.pi / self.fringe


@dataclass(frozen=True, slots=True, kw_only=True)
class Dither:
    """Sinusoidal rate dither whose random amplitude makes turn-arounds independent.

    Attributes
    ----------
    frequency
        Hz.
    rate
        Peak rate, rad/s.
    amplitude_noise
        Standard deviation of the peak rate, as a part of it.
    """

    frequency: float
    rate: float
    amplitude_noise: float


def mean_rate(laser: RingLaser, rate: ArrayLike, dither: Dither | None = None) -> FloatArray:
    """Rate that the beat shows at a constant input rate, rad/s, in the shape of `rate`.

    Without dither sqrt(rate^2 - lock_in^2) with the sign of `rate`, which is
    rate (1 - (lock_in/rate)^2/2 - ...) well above lock-in, and 0 below it. With dither the
    rate itself.

    Raises
    ------
    ValueError
        If the dither is too weak or too regular for the model (see `angle_random_walk`).
    """
    rates = np.asarray(rate, dtype=np.float64)
    if dither is not None:
        _check_dither(laser, dither, rates)
        return rates.copy()
    size = np.abs(rates)
    beat = np.sqrt(np.maximum(size - laser.lock_in, 0.0) * (size + laser.lock_in))
    return np.asarray(np.copysign(beat, rates))


def angle_random_walk(
    laser: RingLaser, rate: ArrayLike, dither: Dither | None = None
) -> FloatArray:
    """Angle random walk N at a constant input rate, rad/sqrt(s), in the shape of `rate`.

    Quantum noise, and beside it the kicks of the dither's turn-arounds or, without dither,
    the wandering backscatter phase. A beat that stands still has none.

    Raises
    ------
    ValueError
        If `rate` reaches the dither's peak rate, so that turn-arounds cease, or if the
        dither's noise leaves less than 3 rad rms between successive turn-arounds, so that
        kicks are correlated.
    """
    rates = np.asarray(rate, dtype=np.float64)
    quantum = laser.quantum_noise**2
    if dither is not None:
        _check_dither(laser, dither, rates)
        steepest = np.sqrt((dither.rate - rates) * (dither.rate + rates))
        kicks = laser.lock_in**2 * laser.fringe / (2.0 * np.pi * steepest)
        return np.asarray(np.sqrt(quantum + kicks))
    size = np.abs(rates)
    moving = size > laser.lock_in
    beat_square = np.where(moving, (size - laser.lock_in) * (size + laser.lock_in), 1.0)
    passed = quantum * (size**2 + 0.5 * laser.lock_in**2) / beat_square
    width = laser.backscatter_diffusion / laser.phase_per_angle
    scatter = laser.lock_in**2 * width / laser.phase_per_angle / (beat_square + width**2)
    return np.asarray(np.where(moving, np.sqrt(passed + scatter), 0.0))


def _check_dither(laser: RingLaser, dither: Dither, rates: FloatArray) -> None:
    fastest = float(np.max(np.abs(rates), initial=0.0))
    if fastest >= dither.rate:
        peak = f"the dither's peak {dither.rate:.6g} rad/s, so the rate never turns round"
        problem = f"input rate {fastest:.6g} rad/s is not below {peak}"
        raise ValueError(f"{problem}; raise the dither's rate")
    swing = 2.0 * dither.rate * laser.phase_per_angle / (2.0 * np.pi * dither.frequency)
    spread = swing * dither.amplitude_noise
    if spread < _RANDOM_ENOUGH:
        phase = f"the phase by {spread:.3g} rad between turn-arounds"
        problem = f"amplitude_noise {dither.amplitude_noise:g} spreads {phase}"
        problem += ", so their kicks are correlated"
        raise ValueError(f"{problem}; give at least {_RANDOM_ENOUGH / swing:.3g}")


# ---- lasers and dither of a configuration ----------------------------------------------


def ring_lasers_of(config: GyroConfig) -> tuple[RingLaser, ...]:
    """The three lasers, or none in mode ``ideal``."""
    if config.mode == "ideal":
        return ()
    fringe, diffusion = config.fringe_arcsec * ARCSECOND, config.backscatter_diffusion_rad2_per_s
    common = RingLaser(lock_in=0.0, fringe=fringe, backscatter_diffusion=diffusion)
    lock_ins = [one * DEGREE_PER_HOUR for one in config.lock_in_deg_per_h]
    walks = [one * DEGREE_PER_ROOT_HOUR for one in config.arw_deg_per_sqrt_h]
    own = zip(lock_ins, walks, strict=True)
    return tuple(replace(common, lock_in=lock_in, quantum_noise=walk) for lock_in, walk in own)


def dither_of(config: GyroConfig) -> Dither | None:
    """The dither of the lasers, or None in the other modes."""
    if config.mode != "dithered":
        return None
    rate, noise = config.dither_rate_deg_per_s * DEGREE, config.dither_amplitude_noise
    return Dither(frequency=config.dither_frequency_hz, rate=rate, amplitude_noise=noise)


def folded(frequency: float, sample_rate: float) -> float:
    """Where sampling shows a frequency, Hz.

    Examples
    --------
    >>> folded(400.0, 500.0)
    100.0
    """
    return abs(frequency - sample_rate * round(frequency / sample_rate))
