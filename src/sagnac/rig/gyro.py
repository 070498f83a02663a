"""The gyros of the rig: what they sense, what lock-in takes, what they add, how they read.

An accelerometer has the errors of a gyro in m where that has rad: what adds to an angle of a gyro
adds to its velocity.
"""

import math
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from scipy.signal import butter, sosfilt, sosfilt_zi

from sagnac.core.arrays import FloatArray
from sagnac.core.units import (
    ARCSECOND,
    DEGREE,
    DEGREE_PER_HOUR,
    DEGREE_PER_ROOT_HOUR,
    SENSORS,
    Sensor,
    field_unit,
)
from sagnac.rig import _kernels
from sagnac.rig.own_motion import Mount
from sagnac.rig.ring_laser import Dither, RingLaser, angle_random_walk, mean_rate
from sagnac.rig.sections import GYRO_NAMES, AccelerometerConfig, GyroConfig
from sagnac.rig.table import Motion

# ---- sensor errors -----------------------------------------------------------------


# Error, the coefficient whose unit it has, its key of a gyro and its key of an accelerometer.
SENSOR_KEYS: Final = (
    ("random_walk", "angle_random_walk", "arw_deg_per_sqrt_h", "vrw_m_per_s_per_sqrt_h"),
    ("angle_noise", "quantization", "angle_noise_arcsec", "velocity_noise_mm_per_s"),
    ("quantum", "quantization", "quantization_step_arcsec", "quantization_step_mm_per_s"),
    ("instability", "bias_instability", "bias_instability_deg_per_h", "bias_instability_mg"),
    (
        "rate_walk",
        "rate_random_walk",
        "rate_random_walk_deg_per_h_per_sqrt_h",
        "acceleration_random_walk_mg_per_sqrt_h",
    ),
    ("markov_deviation", "bias_instability", "markov_deviation_deg_per_h", "markov_deviation_mg"),
    (
        "second_markov_deviation",
        "bias_instability",
        "second_markov_deviation_deg_per_h",
        "second_markov_deviation_mg",
    ),
    ("bias", "bias_instability", "bias_deg_per_h", "bias_mg"),
    ("rate_quantum", "bias_instability", "rate_step_deg_per_h", "acceleration_step_mg"),
    ("full_scale", "bias_instability", "range_deg_per_h", "range_mg"),
    ("ramp", "rate_ramp", "rate_ramp_deg_per_h_per_h", "acceleration_ramp_mg_per_h"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorErrors:
    """Errors of a gyro; of an accelerometer with m for rad.

    Attributes
    ----------
    random_walk
        N, rad/sqrt(s).
    angle_noise, quantum
        White noise of the sampled angle (Q) and readout step, rad, 0 for none.
    instability, rate_walk
        B, rad/s, and K, rad/s/sqrt(s).
    markov_deviation, markov_time
        Standard deviation, rad/s, and correlation time, s, of a Markov rate.
    second_markov_deviation, second_markov_time
        Of a second one.
    bias, ramp
        rad/s and rad/s^2.
    rate_quantum, full_scale
        Readout step of the rate, and the largest rate that it shows, rad/s, 0 for none.
    per_kelvin, warm_up, warm_up_time
        rad/s per kelvin; rise of temperature, K, and its time constant, s.
    corner, order
        Of the low-pass, Hz, 0 for none.
    """

    random_walk: float
    angle_noise: float
    quantum: float
    instability: float
    rate_walk: float
    markov_deviation: float
    markov_time: float
    bias: float
    ramp: float
    corner: float
    order: int
    second_markov_deviation: float = 0.0
    second_markov_time: float = 1.0
    rate_quantum: float = 0.0
    full_scale: float = 0.0
    per_kelvin: float = 0.0
    warm_up: float = 0.0
    warm_up_time: float = 1.0

    @classmethod
    def of(cls, config: GyroConfig | AccelerometerConfig, axis: int) -> Self:
        """Errors of the gyro x, y or z, or of the accelerometer ax, ay or az."""
        sensor: Sensor = "gyro" if isinstance(config, GyroConfig) else "accelerometer"
        place = SENSORS.index(sensor)
        sized = {
            name: getattr(config, keys[place])[axis] * field_unit(coefficient, sensor).size
            for name, coefficient, *keys in SENSOR_KEYS
        }
        warming = {}
        if isinstance(config, GyroConfig):
            warming = {
                "per_kelvin": config.temperature_coefficient_deg_per_h_per_k[axis]
                * DEGREE_PER_HOUR,
                "warm_up": config.warm_up_k,
                "warm_up_time": config.warm_up_time_s,
            }
        return cls(
            **sized,
            **warming,
            markov_time=config.markov_time_s[axis],
            second_markov_time=config.second_markov_time_s[axis],
            corner=config.low_pass_hz[axis],
            order=config.low_pass_order,
        )

    @property
    def markov(self) -> tuple[tuple[float, float], ...]:
        """Standard deviation and correlation time of each Markov rate that there is."""
        rates = (
            (self.markov_deviation, self.markov_time),
            (self.second_markov_deviation, self.second_markov_time),
        )
        return tuple(one for one in rates if one[0] > 0.0)

    def add_trend(self, drift: FloatArray, seconds: FloatArray) -> None:
        """Add bias, ramp and warming up at `seconds` from the first sample, (n,), to `drift`.

        A rate, rad/s.
        """
        warmed = self.warm_up * -np.expm1(-np.maximum(seconds, 0.0) / self.warm_up_time)
        drift += self.bias
        drift += self.ramp * seconds
        drift += self.per_kelvin * warmed


# ---- gyro --------------------------------------------------------------------------

_MARKOV_RATIO: Final = 3.0  # between neighbouring correlation times
_LONGEST_CORRELATION: Final = 10.0  # of the duration
_SHORTEST_CORRELATION: Final = 1.0 / 9.0  # of a sample; what is shorter is white there
_HELD_STEP: Final = 0.02  # s, for which slow errors are held where nobody sees it
# Part of the white noise below which slow errors lie at half the rate of held values.
_UNSEEN: Final = 3e-3


# ---- lock-in -------------------------------------------------------------------------


def ring_lasers_of(config: GyroConfig) -> tuple[RingLaser, ...]:
    """The three lasers, or none in mode ``ideal``."""
    if config.mode == "ideal":
        return ()
    return tuple(
        RingLaser(
            lock_in=config.lock_in_deg_per_h[g] * DEGREE_PER_HOUR,
            fringe=config.fringe_arcsec * ARCSECOND,
            quantum_noise=config.arw_deg_per_sqrt_h[g] * DEGREE_PER_ROOT_HOUR,
            backscatter_diffusion=config.backscatter_diffusion_rad2_per_s,
        )
        for g in range(len(GYRO_NAMES))
    )


def dither_of(config: GyroConfig) -> Dither | None:
    """The dither of the lasers, or None in the other modes."""
    if config.mode != "dithered":
        return None
    return Dither(
        frequency=config.dither_frequency_hz,
        rate=config.dither_rate_deg_per_s * DEGREE,
        amplitude_noise=config.dither_amplitude_noise,
    )


@dataclass(slots=True, kw_only=True)
class LockIn:
    """Rate that one ring laser with lock-in senses.

    Attributes
    ----------
    laser, dither
        By whose model.
    interval
        Between samples, s.
    before
        True angle at the last sample, rad.
    """

    laser: RingLaser
    dither: Dither | None
    interval: float
    before: float = 0.0

    def advance(self, true: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rate shown less rate sensed, rad/s, and angle random walk, rad/sqrt(s), each (n,).

        `true` (n,) is the true angle at the next samples, rad.
        """
        sensed = np.diff(true, prepend=self.before) / self.interval
        self.before = float(true[-1])
        lost = mean_rate(self.laser, sensed, self.dither) - sensed
        return lost, angle_random_walk(self.laser, sensed, self.dither)


# ---- slow errors ---------------------------------------------------------------------


@dataclass(slots=True, kw_only=True)
class SlowDrift:
    """Bias instability, rate random walk and Markov rate of one gyro.

    Bias instability is flicker rate noise, made as a sum of Markov processes. Processes of
    variance s^2 at correlation times a ratio r apart have the two-sided density
    s^2 / (2 f ln r); bias instability has B^2 / (2 pi f). A Markov rate of the sensor's own is one
    process more, and the walk one that forgets nothing.

    A sample is the mean rate since the one before. Given a process at both ends of a sample of k
    correlation times, its mean is tanh(k/2)/k times the sum of both and white noise of variance
    2 s^2 (k - 2 tanh(k/2)) / k^2. Slow errors that lie far below the white noise at half the rate
    of held values are values of every 0.02 s instead, held between.

    Attributes
    ----------
    hold
        Samples that one value holds for.
    decay, spread
        (processes,) correlation from one value to the next, and rms of the noise added; the walk
        and the white noise of means are the last.
    before, after
        (processes,) weights of a process at the last value and at this one.
    levels
        (processes,) their state, rad/s.
    held
        The last value, rad/s.
    random
        Its stream.
    """

    hold: int
    decay: FloatArray
    spread: FloatArray
    before: FloatArray
    after: FloatArray
    levels: FloatArray
    random: np.random.Generator
    held: float = 0.0

    @classmethod
    def stationary(
        cls,
        errors: SensorErrors,
        *,
        sample_rate: float,
        duration: float,
        random: np.random.Generator,
    ) -> Self:
        """The processes of one sensor in their stationary state, for a recording of `duration`."""
        hold = max(1, round(_HELD_STEP * sample_rate))
        step = hold * (1.0 / sample_rate)
        unseen = _slow_density(errors, 0.5 / step) <= _UNSEEN * errors.random_walk**2
        shortest = step
        if not unseen:
            hold, step = 1, 1.0 / sample_rate
            shortest = _SHORTEST_CORRELATION * step
        count = 0
        if errors.instability > 0.0:
            longest = max(_LONGEST_CORRELATION * duration, 10.0 * step)
            count = 1 + math.ceil(math.log(longest / shortest) / math.log(_MARKOV_RATIO))
        correlation = shortest * _MARKOV_RATIO ** np.arange(count)
        deviation = np.full(
            count, errors.instability * math.sqrt(math.log(_MARKOV_RATIO) / math.pi)
        )
        for size, time in errors.markov:
            correlation = np.append(correlation, time)
            deviation = np.append(deviation, size)
        decay = np.exp(-step / correlation)
        spread = deviation * np.sqrt(1.0 - decay**2)
        levels = deviation * random.standard_normal(deviation.size)
        # The walk is last.
        decay, levels = np.append(decay, 1.0), np.append(levels, 0.0)
        spread = np.append(spread, errors.rate_walk * math.sqrt(step))
        before, after = np.zeros(decay.size), np.ones(decay.size)
        if not unseen:
            weight, remainder = _mean_of_ends(np.asarray(step / correlation))
            before = after = np.append(weight, 0.5)
            white = float(remainder @ deviation**2) + errors.rate_walk**2 * step / 12.0
            if count:
                # Of all that are shorter than the shortest.
                white += 2.0 * deviation[0] ** 2 * (shortest / step) / (_MARKOV_RATIO - 1.0)
            decay, levels = np.append(decay, 0.0), np.append(levels, 0.0)
            spread = np.append(spread, math.sqrt(white))
            before, after = np.append(before, 0.0), np.append(after, 1.0)
        return cls(
            hold=hold,
            decay=decay,
            spread=spread,
            before=before,
            after=after,
            levels=levels,
            random=random,
        )

    def advance(self, first: int, count: int) -> FloatArray:
        """(count,) rates of the next samples, the first of which has number `first`, rad/s."""
        begun = -(-first // self.hold)
        ended = -(-(first + count) // self.hold)
        values = np.zeros(ended - begun)
        normals = self.random.standard_normal((values.size, self.decay.size))
        _kernels.slow_drift(
            normals, self.decay, self.spread, self.before, self.after, self.levels, values
        )
        # The last value of a block holds on into the next.
        held = np.concatenate([[self.held], values])
        self.held = float(held[-1])
        return np.asarray(held[(first + np.arange(count)) // self.hold - begun + 1])


def _slow_density(errors: SensorErrors, frequency: float) -> float:
    """Two-sided density of the slow errors at a frequency in Hz, (rad/s)^2/Hz."""
    angular = 2.0 * math.pi * frequency
    markov = sum(
        2.0 * size**2 * time / (1.0 + (angular * time) ** 2) for size, time in errors.markov
    )
    return errors.instability**2 / angular + (errors.rate_walk / angular) ** 2 + markov


def _mean_of_ends(steps: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of Markov processes of variance one over `steps` (processes,) correlation times.

    Returns
    -------
    weight, remainder
        (processes,) of the values at both ends, and variance of what they do not tell.
    """
    half = np.tanh(0.5 * steps)
    remainder = 2.0 * (steps - 2.0 * half) / steps**2
    # Without the cancellation that short steps bring.
    return half / steps, np.where(steps < 0.01, steps / 6.0, remainder)


# ---- the sensor's own low-pass --------------------------------------------------------


@dataclass(slots=True, kw_only=True)
class LowPass:
    """A Butterworth low-pass of the rate that a gyro shows.

    Attributes
    ----------
    sections
        (sections, 6) of second order.
    state
        (sections, 2) of the filter; None before the first sample.
    """

    sections: FloatArray
    state: FloatArray | None = None

    @classmethod
    def of(cls, errors: SensorErrors, sample_rate: float) -> Self | None:
        """The low-pass of one sensor; None if it has none."""
        if errors.corner == 0.0:
            return None
        return cls(sections=butter(errors.order, errors.corner, fs=sample_rate, output="sos"))

    def advance(self, steps: FloatArray, steady: float) -> FloatArray:
        """(n,) increments behind the filter, rad, of those before it.

        Before the first sample the gyro turned by `steady`, rad, in every sample.
        """
        if self.state is None:
            self.state = sosfilt_zi(self.sections) * steady
        filtered, self.state = sosfilt(self.sections, steps, zi=self.state)
        return np.asarray(filtered)


# ---- the readout of a rate -------------------------------------------------------------


@dataclass(slots=True, kw_only=True)
class RateReadout:
    """A readout that shows the mean rate of each sample, in steps and within a range.

    Unlike with steps of the angle, what a sample loses is lost.

    Attributes
    ----------
    step, full_scale
        Turn of a sample, rad, that is one step and that is the largest; 0 for none.
    before, shown
        Angle at the last sample before the readout, rad, and behind it: in steps if there are any.
    """

    step: float
    full_scale: float
    before: float = 0.0
    shown: float = 0.0

    @classmethod
    def of(cls, errors: SensorErrors, interval: float) -> Self | None:
        """The readout of one sensor; None if it shows every rate as it is."""
        if errors.rate_quantum == errors.full_scale == 0.0:
            return None
        return cls(step=errors.rate_quantum * interval, full_scale=errors.full_scale * interval)

    def advance(self, angles: FloatArray) -> None:
        """Let the next angles, (n,), rad, be the sums of what is shown."""
        turned = np.diff(angles, prepend=self.before)
        self.before = float(angles[-1])
        if self.full_scale > 0.0:
            np.clip(turned, -self.full_scale, self.full_scale, out=turned)
        if self.step > 0.0:
            np.rint(turned / self.step, out=turned)
        # The sum of all samples in one order, whatever the blocks.
        turned[0] += self.shown
        np.cumsum(turned, out=turned)
        self.shown = float(turned[-1])
        np.multiply(turned, self.step or 1.0, out=angles)


# ---- the whole gyro ------------------------------------------------------------------


@dataclass(slots=True, kw_only=True)
class Gyro:
    """One gyro of the triad.

    Attributes
    ----------
    direction
        (3,) its input axis in b, a row of C_b^s.
    origin
        Table angle one sample before the first, rad.
    interval
        Between samples, s.
    slow
        Bias instability and rate random walk.
    errors
        What else is wrong with it; N is the quantum limit with lock-in, which the laser's model
        counts in.
    lock_in
        Of a ring laser, or None.
    low_pass
        Of the sensor, or None.
    mount
        Of the gyro, or None if it is rigid.
    readout
        Stream of the white noise of the sampled angle.
    rates
        Readout of the rate, or None.
    random
        Stream of the angle random walk.
    walked
        Error of the angle so far, rad; with a low-pass the angle behind it.
    before
        True angle at the last sample, rad.
    """

    direction: FloatArray
    origin: float
    interval: float
    slow: SlowDrift
    errors: SensorErrors
    random: np.random.Generator
    readout: np.random.Generator
    lock_in: LockIn | None = None
    low_pass: LowPass | None = None
    mount: Mount | None = None
    rates: RateReadout | None = None
    walked: float = 0.0
    before: float = 0.0

    def advance(self, first: int, motion: Motion, angles: FloatArray) -> None:
        """Read the gyro at the next samples, the first of which has number `first`.

        Parameters
        ----------
        first
            Number of the first sample.
        motion
            Of the table over these samples.
        angles
            (n,) disturbances of the angle, rad; holds the measured angle afterwards.
        """
        count = motion.angle.size
        errors = self.errors
        if errors.angle_noise > 0.0:
            angles += errors.angle_noise * self.readout.standard_normal(count)
        own = self.direction[2] * (motion.angle - self.origin)
        true = self.direction @ motion.turned + own
        if self.mount is not None:
            true += self.mount.advance(motion.moving)
        drift = self.slow.advance(first, count)
        # A sample's drift is that of the middle of the interval before it.
        seconds: FloatArray = (first + np.arange(count, dtype=np.float64) - 0.5) * self.interval
        errors.add_trend(drift, seconds)
        strength: FloatArray | float = errors.random_walk
        if self.lock_in is not None:
            lost, strength = self.lock_in.advance(true)
            drift += lost
        noise = strength * math.sqrt(self.interval) * self.random.standard_normal(count)
        if self.low_pass is not None:
            noise += drift * self.interval
            behind, nothing = self._behind_low_pass(self.low_pass, true, noise), np.zeros(count)
            _kernels.readout(behind, nothing, nothing, self.interval, errors.quantum, 0.0, angles)
        else:
            self.walked = _kernels.readout(
                true, noise, drift, self.interval, errors.quantum, self.walked, angles
            )
        if self.rates is not None:
            self.rates.advance(angles)

    def _behind_low_pass(
        self, low_pass: LowPass, true: FloatArray, errors: FloatArray
    ) -> FloatArray:
        """(n,) angle, rad, behind the low-pass, of true angles and the increments of errors."""
        steps = np.diff(true, prepend=self.before)
        self.before = float(true[-1])
        steady = float(steps[0])
        steps += errors
        steps = low_pass.advance(steps, steady)
        # The sum of all samples in one order, whatever the blocks.
        steps[0] += self.walked
        angle = np.cumsum(steps)
        self.walked = float(angle[-1])
        return angle
