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
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.constants import Planck, speed_of_light

from sagnac.arrays import FloatArray

# Kicks one swing apart are correlated by exp(-s^2/2) where s is the rms phase between them.
_RANDOM_ENOUGH: Final = 3.0  # rad: a correlation of 1 %
_HELIUM_NEON: Final = 632.8e-9  # m


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

    Raises
    ------
    ValueError
        If the fringe is not positive or another value is negative.
    """

    lock_in: float
    fringe: float
    quantum_noise: float = 0.0
    backscatter_diffusion: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.fringe) and self.fringe > 0.0):
            raise ValueError(f"fringe is {self.fringe!r}; it must be a positive angle, rad")
        for name in ("lock_in", "quantum_noise", "backscatter_diffusion"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} is {value!r}; it must not be negative")

    @property
    def phase_per_angle(self) -> float:
        """Beat phase per input angle."""
        return 2.0 * math.pi / self.fringe


@dataclass(frozen=True, slots=True, kw_only=True)
class Dither:
    """Sinusoidal rate dither whose amplitude is drawn anew for each half cycle.

    Attributes
    ----------
    frequency
        Hz.
    rate
        Peak rate, rad/s.
    amplitude_noise
        Standard deviation of the peak rate, as a part of it.

    Raises
    ------
    ValueError
        If frequency or rate are not positive, or the noise is not from 0 to 0.5.
    """

    frequency: float
    rate: float
    amplitude_noise: float

    def __post_init__(self) -> None:
        for name in ("frequency", "rate"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"dither {name} is {value!r}; it must be positive")
        if not 0.0 <= self.amplitude_noise <= 0.5:
            raise ValueError(f"amplitude_noise is {self.amplitude_noise!r}; give 0 to 0.5")


def quantum_limit(
    *,
    perimeter: float,
    area: float,
    loss: float,
    power: float,
    wavelength: float = _HELIUM_NEON,
) -> float:
    """Angle random walk of spontaneous emission, rad/sqrt(s).

    ``N = c L / (4 A Q) sqrt(h f / P)``, with the quality factor ``Q = 2 pi f L / (c loss)``: a
    larger ring of better mirrors and more power is quieter.

    Parameters
    ----------
    perimeter, area
        L and A of the ring, m and m^2.
    loss
        Part of the power lost in one round trip.
    power
        P that each beam loses, W.
    wavelength
        m; of the red line of helium and neon unless given.

    Raises
    ------
    ValueError
        If a value is not above zero.

    References
    ----------
    Schreiber and Wells, Rev. Sci. Instrum. 84 (2013) 041101; Dorschner, Haus, Holz, Smith and
    Statz, IEEE J. Quantum Electron. 16 (1980) 1376.

    Examples
    --------
    A triangle of 28 cm whose mirrors lose 100 ppm, at 10 uW, in deg/sqrt(h):

    >>> from sagnac.units import DEGREE_PER_ROOT_HOUR
    >>> limit = quantum_limit(perimeter=0.28, area=3.77e-3, loss=1e-4, power=1e-5)
    >>> round(limit / DEGREE_PER_ROOT_HOUR, 6)
    0.000122
    """
    given = {
        "perimeter": perimeter,
        "area": area,
        "loss": loss,
        "power": power,
        "wavelength": wavelength,
    }
    for name, value in given.items():
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} is {value!r}; it must be above zero")
    frequency = speed_of_light / wavelength
    quality = 2.0 * math.pi * frequency * perimeter / (speed_of_light * loss)
    size = speed_of_light * perimeter / (4.0 * area * quality)
    return float(size * math.sqrt(Planck * frequency / power))


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


def _check_dither(laser: RingLaser, dither: Dither, rates: NDArray[np.float64]) -> None:
    fastest = float(np.max(np.abs(rates), initial=0.0))
    if fastest >= dither.rate:
        raise ValueError(
            f"input rate {fastest:.6g} rad/s is not below the dither's peak {dither.rate:.6g} "
            "rad/s, so the rate never turns round; raise the dither's rate"
        )
    swing = 2.0 * dither.rate * laser.phase_per_angle / (2.0 * np.pi * dither.frequency)
    spread = swing * dither.amplitude_noise
    if spread < _RANDOM_ENOUGH:
        raise ValueError(
            f"amplitude_noise {dither.amplitude_noise:g} spreads the phase by {spread:.3g} rad "
            "between turn-arounds, so their kicks are correlated; give at least "
            f"{_RANDOM_ENOUGH / swing:.3g}"
        )
