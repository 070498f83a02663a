"""Motion that gyros on one table do not share: mounts, nutation, disturbances and their dither.

Mounts that resonate and a shaft that nutates are random and there only while the table turns: the
part of ``n_alpha`` in Eqs. 12 to 17 that is no multiple of the table's rate. What two gyros sense
of it differs by more than their shares. Disturbances are periodic in table angle, Eq. 10, or in
time, Eq. 11.
"""

import cmath
import math
from dataclasses import replace

import numpy as np
from numpy.random import Generator
from scipy.signal import lfilter

from sagnac.core.arrays import FloatArray
from sagnac.core.units import ARCSECOND, DEGREE
from sagnac.recording.columns import GYRO_NAMES
from sagnac.rig.config import RigConfig
from sagnac.rig.sections import DisturbancesConfig, MotionConfig, Pairs
from sagnac.rig.table import Differences, LineSet, Motion, Oscillator, Sums, Table

# ---- own motion --------------------------------------------------------------------


def _ringing(band: tuple[float, float], rms: float, table: Table, random: Generator) -> Oscillator:
    """An oscillator by frequency, Hz, and quality, and its rms angle, arcsec, at every sample.

    It rests if the table is not moving yet.
    """
    frequency, quality = band
    rate = 2.0 * math.pi * frequency * rms * ARCSECOND
    made = Oscillator(frequency, 0.5 / quality, rate, table.interval, random)
    if not table.moving:
        made.state[:] = 0.0
    return made


def mount_of(config: MotionConfig, gyro: int, table: Table, random: Generator) -> Oscillator | None:
    """The mount of one gyro: a structure that the turning table shakes about the input axis.

    The gyro turns with it, by an angle that comes back: it adds to the density of the rate a peak
    at the resonance, f^2 below it, and nothing to N. None if the mount is rigid.
    """
    rms = config.resonance_rms_arcsec[gyro]
    band = config.resonance_hz[gyro], config.resonance_quality
    return _ringing(band, rms, table, random) if rms > 0.0 else None


class Nutation:
    """Random tilting of the shaft, which the turning table makes and the gyros sense.

    The shaft tilts by the small angles p = (p1, p2) about the level axes of b0, two oscillators
    that know nothing of each other. Along the axes of b, turned by alpha, the tilting is the rate::

        w1 = cos(alpha) p1' + sin(alpha) p2',   w2 = -sin(alpha) p1' + cos(alpha) p2'

    and a gyro whose input axis has the level part m in b senses ``m . w``. The level parts of three
    input axes point 120 deg apart and add up to almost nothing. So no multiple of one gyro takes
    the tilting out of another, while the sum of three is free of it.

    Integrated by parts, C(alpha) being the turn by alpha and Omega the table's rate, the angle is::

        m . C(alpha) p - m . integral of Omega C'(alpha) p dt

    The first term comes back. The second walks: turning brings what p holds at the table's own
    frequency down to zero. If S is the two-sided density of p1 and p2, the rate sensed there is
    white, with::

        N^2 = |m|^2 Omega^2 S(Omega)

    A gyro on a table that turns evenly cannot tell it from its own N. It differs from N by going
    with the rate of the table, and by what three gyros share of it.

    The Earth's rate, tipped by the tilt, is left out: 1 arcsec of it is 7e-5 deg/h.

    Attributes
    ----------
    tilts
        Of the two axes.
    """

    def __init__(self, config: MotionConfig, table: Table, random: Generator) -> None:
        band, rms = (config.nutation_hz, config.nutation_quality), config.nutation_rms_arcsec
        self.tilts = [_ringing(band, rms, table, one) for one in random.spawn(2)]
        self._turned, self._level = Differences(table.origin), Sums()
        self._tilted = Differences(np.array([[tilt.state[0]] for tilt in self.tilts]))

    def added_to(self, motion: Motion) -> Motion:
        """The table's motion over the next samples with the shaft's tilting in it."""
        first, second = self._tilted.of(np.array([one.angles(motion.moving) for one in self.tilts]))
        # The tilting of a sample interval is taken at the middle of it.
        middle = motion.angle - 0.5 * self._turned.of(motion.angle)
        cosine, sine = np.cos(middle), np.sin(middle)
        along = np.array([cosine * first + sine * second, cosine * second - sine * first])
        turned = motion.turned.copy()
        turned[:2] += self._level.of(along)
        return replace(motion, turned=turned)


def nutation_walk(config: MotionConfig, rate: float) -> float:
    """N that nutation adds to a gyro with its input axis in the table's plane, rad/sqrt(s).

    `rate`, rad/s, is the table's. See `Nutation` for the law.
    """
    natural, damping = 2.0 * math.pi * config.nutation_hz, 0.5 / config.nutation_quality
    variance = (config.nutation_rms_arcsec * ARCSECOND) ** 2
    apart = (natural**2 - rate**2) ** 2 + (2.0 * damping * natural * rate) ** 2
    return abs(rate) * math.sqrt(4.0 * damping * natural**3 * variance / apart)


# ---- disturbances ------------------------------------------------------------------


class Disturbances:
    """All periodic disturbances of one recording: those in table angle, then those in time.

    Attributes
    ----------
    angle, time
        As they were drawn.
    """

    def __init__(self, config: DisturbancesConfig, random: Generator) -> None:
        self.angle, self.time = _drawn(config.angle, random), _drawn(config.time, random)

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
        offset = self.angle.phasor.real.sum(axis=1) + self.time.phasor.real.sum(axis=1)
        in_time = self.time.at_samples(first, alpha.size, interval)
        return np.asarray(self.angle.at(alpha) + in_time - offset[:, np.newaxis])


def _drawn(pairs: Pairs, random: Generator) -> LineSet:
    position, amplitude = np.array(pairs, dtype=np.float64).reshape(-1, 2).T
    shape = (len(GYRO_NAMES), len(pairs))
    amplitudes = amplitude * ARCSECOND * random.uniform(0.5, 1.0, shape)
    phases = random.uniform(-np.pi, np.pi, shape)
    order = np.argsort(position, kind="stable")
    return LineSet(position=position[order], phasor=(amplitudes * np.exp(1j * phases))[:, order])


# ---- dither that is left -------------------------------------------------------------


def dither_frequency(config: RigConfig, axis: int) -> float:
    """Frequency of the dither of the gyro x, y or z, Hz."""
    return config.gyro.dither_frequency_hz + config.dither.detuning_hz[axis]


def dither_amplitude(config: RigConfig, axis: int) -> float:
    """Amplitude of that dither, rad."""
    turned = 2.0 * math.pi * dither_frequency(config, axis)
    return config.gyro.dither_rate_deg_per_s * DEGREE / turned


def left_of(config: RigConfig, axis: int) -> complex:
    """Part of the dither that is left in the angle: 1 less the gain, delayed, of the stripping."""
    late = 2.0 * math.pi * dither_frequency(config, axis) * config.dither.delay_s[axis]
    return 1.0 - (1.0 - config.dither.residue[axis]) * cmath.exp(-1j * late)


class DitherMotion:
    """The dither of one gyro in its stationary state.

    A dither is a resonator kept swinging by an even drive and shaken by a random one, so that the
    random part of its complex amplitude decays with the resonator's ring-down::

        p(t) = Re[(1 + u(t)) A exp(i (2 pi f t + phi))],   A = peak rate / (2 pi f)

    with u a complex Ornstein-Uhlenbeck process. The gyro turns with its body, and its readout takes
    off what the pick-off says, at a slightly wrong gain and a little late. Sampling folds what is
    left, since f lies above half the sample rate as a rule.

    Parameters
    ----------
    config
        Of the rig.
    axis
        0, 1 or 2 of the gyro x, y or z.
    random
        Its stream.
    """

    def __init__(self, config: RigConfig, axis: int, random: Generator) -> None:
        noise, dither = config.gyro.dither_amplitude_noise, config.dither
        self._amplitude = dither_amplitude(config, axis)
        self._left = self._amplitude * left_of(config, axis)
        self._cycles = dither_frequency(config, axis) / config.sample_rate_hz
        self._phase = float(random.uniform(-np.pi, np.pi))
        # The random part has two components, in parts of the amplitude. From sample to sample each
        # keeps `_decay` of itself and gains noise of `_spread`; `_shaken` holds the last two.
        self._decay = math.exp(-1.0 / (config.sample_rate_hz * dither.ring_down_s))
        self._spread = noise * math.sqrt(1.0 - self._decay**2)
        self._shaken = noise * random.standard_normal((1, 2))
        self._noise = dither.pickoff_noise_arcsec * ARCSECOND
        self._random = random

    def advance(self, first: int, angle: FloatArray) -> FloatArray:
        """Add what is left at the next samples to the gyro's angle.

        Parameters
        ----------
        first
            Number of the first sample.
        angle
            (n,) rad.

        Returns
        -------
        FloatArray
            (n,) what the pick-off shows, arcsec.
        """
        drawn = self._random.standard_normal((angle.size, 3))
        begun = self._decay * self._shaken
        shaken, _ = lfilter([self._spread], [1.0, -self._decay], drawn[:, :2], axis=0, zi=begun)
        self._shaken = shaken[-1:]
        cycles = (first + np.arange(angle.size)) * self._cycles
        even = np.exp(1j * (2.0 * np.pi * (cycles - np.floor(cycles)) + self._phase))
        swing = (1.0 + shaken[:, 0] + 1j * shaken[:, 1]) * even
        angle += (self._left * swing).real
        return np.asarray((self._amplitude * swing.real + self._noise * drawn[:, 2]) / ARCSECOND)
