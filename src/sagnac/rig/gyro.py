"""The gyros of the rig: what they sense, what lock-in takes, what they add, how they read.

An accelerometer has the errors of a gyro in m where that has rad: what adds to an angle of a gyro
adds to its velocity.
"""

import math
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.random import Generator
from scipy.signal import butter, sosfilt, sosfilt_zi

from sagnac.core.arrays import FloatArray
from sagnac.core.units import DEGREE_PER_HOUR, Sensor, field_unit
from sagnac.rig import _kernels, own_motion, sections
from sagnac.rig.config import RigConfig
from sagnac.rig.ring_laser import angle_random_walk, dither_of, mean_rate, ring_lasers_of
from sagnac.rig.table import Differences, Motion, RandomStreams, Sums, Table

# ---- sensor errors -----------------------------------------------------------------


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
    markov
        Standard deviation, rad/s, and correlation time, s, of each Markov rate that there is.
    bias, ramp
        rad/s and rad/s^2.
    rate_quantum, full_scale
        Readout step of the rate, and the largest rate that it shows, rad/s, 0 for none.
    per_kelvin, warm_up, warm_up_time
        rad/s per kelvin; rise of temperature, K, and its time constant, s.
    corner, order
        Of the low-pass, Hz, 0 for none.
    """

    random_walk: float = 0.0
    angle_noise: float = 0.0
    quantum: float = 0.0
    instability: float = 0.0
    rate_walk: float = 0.0
    markov: tuple[tuple[float, float], ...] = ()
    bias: float = 0.0
    ramp: float = 0.0
    rate_quantum: float = 0.0
    full_scale: float = 0.0
    per_kelvin: float = 0.0
    warm_up: float = 0.0
    warm_up_time: float = 1.0
    corner: float = 0.0
    order: int = 1

    @classmethod
    def of(cls, config: sections.GyroConfig | sections.AccelerometerConfig, axis: int) -> Self:
        """Errors of the gyro x, y or z, or of the accelerometer ax, ay or az."""
        sensor: Sensor = "gyro" if isinstance(config, sections.GyroConfig) else "accelerometer"
        sized: dict[str, float] = {}
        for name, coefficient, own, force in sections.SENSOR_KEYS:
            stated = getattr(config, own if sensor == "gyro" else force)[axis]
            sized[name] = stated * field_unit(coefficient, sensor).size
        if isinstance(config, sections.GyroConfig):
            per_kelvin = config.temperature_coefficient_deg_per_h_per_k[axis]
            sized["per_kelvin"] = per_kelvin * DEGREE_PER_HOUR
            sized["warm_up"], sized["warm_up_time"] = config.warm_up_k, config.warm_up_time_s
        deviations = sized.pop("markov_deviation"), sized.pop("second_markov_deviation")
        times = config.markov_time_s[axis], config.second_markov_time_s[axis]
        markov = tuple(rate for rate in zip(deviations, times, strict=True) if rate[0] > 0.0)
        corner, order = config.low_pass_hz[axis], config.low_pass_order
        return cls(**sized, markov=markov, corner=corner, order=order)

    def trend(self, seconds: FloatArray) -> FloatArray:
        """(n,) rate of bias, ramp and warming up at `seconds` from the first sample, rad/s."""
        rate = self.bias + self.ramp * seconds
        if self.warm_up != 0.0:
            warmed = -np.expm1(-np.maximum(seconds, 0.0) / self.warm_up_time)
            rate += self.per_kelvin * self.warm_up * warmed
        return rate


# ---- slow errors -------------------------------------------------------------------

_MARKOV_RATIO: Final = 3.0  # between neighbouring correlation times


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

    Parameters
    ----------
    errors
        Of the sensor.
    config
        Of the rig.
    random
        Its stream.

    Attributes
    ----------
    hold
        Samples that one value holds for.
    """

    def __init__(self, errors: SensorErrors, config: RigConfig, random: Generator) -> None:
        interval = 1.0 / config.sample_rate_hz
        # Slow errors are held for 0.02 s if nobody sees it.
        hold = max(1, round(0.02 * config.sample_rate_hz))
        step = hold * interval
        unseen = _slow_density(errors, 0.5 / step) <= 3e-3 * errors.random_walk**2
        shortest = step
        if not unseen:
            hold, step = 1, interval
            # What is shorter than a ninth of a sample is white there.
            shortest = 1.0 / 9.0 * step
        count = 0
        if errors.instability > 0.0:
            longest = 10.0 * max(config.duration_s, step)
            count = 1 + math.ceil(math.log(longest / shortest) / math.log(_MARKOV_RATIO))
        flicker = errors.instability * math.sqrt(math.log(_MARKOV_RATIO) / math.pi)
        own = np.array(errors.markov).reshape(-1, 2)
        correlation = np.append(shortest * _MARKOV_RATIO ** np.arange(count), own[:, 1])
        deviation = np.append(np.full(count, flicker), own[:, 0])
        decay = np.exp(-step / correlation)
        # By process: correlation from one value to the next, rms of the noise added, weights at the
        # last value and at this one, and its state. The walk comes after the Markov processes.
        spread = np.append(deviation * np.sqrt(1.0 - decay**2), errors.rate_walk * math.sqrt(step))
        processes = [np.append(decay, 1.0), spread, np.zeros(spread.size), np.ones(spread.size)]
        processes.append(np.append(deviation * random.standard_normal(deviation.size), 0.0))
        if not unseen:
            weight, remainder = _mean_of_ends(np.asarray(step / correlation))
            white = float(remainder @ deviation**2) + errors.rate_walk**2 * step / 12.0
            if count:
                # Of all that are shorter than the shortest.
                white += 2.0 * deviation[0] ** 2 * (shortest / step) / (_MARKOV_RATIO - 1.0)
            processes[2] = processes[3] = np.append(weight, 0.5)
            # The white noise of means is last, a process that forgets all.
            last = (0.0, math.sqrt(white), 0.0, 1.0, 0.0)
            processes = [np.append(each, one) for each, one in zip(processes, last, strict=True)]
        self.hold = hold
        self._processes, self._random, self._held = np.array(processes), random, 0.0

    def advance(self, first: int, count: int) -> FloatArray:
        """(count,) rates of the next samples, the first of which has number `first`, rad/s."""
        begun, ended = -(-first // self.hold), -(-(first + count) // self.hold)
        values = np.zeros(ended - begun)
        normals = self._random.standard_normal((values.size, self._processes.shape[1]))
        _kernels.slow_drift(normals, self._processes, values)
        # The last value of a block holds on into the next.
        held = np.concatenate([[self._held], values])
        self._held = float(held[-1])
        return np.asarray(held[(first + np.arange(count)) // self.hold - begun + 1])


def _slow_density(errors: SensorErrors, frequency: float) -> float:
    """Two-sided density of the slow errors at a frequency in Hz, (rad/s)^2/Hz."""
    angular = 2.0 * math.pi * frequency
    each = (2.0 * size**2 * time / (1.0 + (angular * time) ** 2) for size, time in errors.markov)
    return errors.instability**2 / angular + (errors.rate_walk / angular) ** 2 + sum(each)


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


# ---- the whole gyro ------------------------------------------------------------------


class Gyro:
    """One gyro of the triad, or one accelerometer, with its lock-in, low-pass and readout.

    Steps of the angle lose nothing. A readout that shows the mean rate of each sample, in steps
    and within a range, shows sums of what is left: what a sample loses is lost.

    Parameters
    ----------
    config, sensor
        Of the rig, and whether it is one of its gyros or of its accelerometers.
    axis
        0, 1 or 2 of x, y and z.
    streams
        Those of the rig.
    table
        That it stands on, one sample before the first: an accelerometer is not turned by it.
    """

    def __init__(
        self, config: RigConfig, sensor: Sensor, axis: int, streams: RandomStreams, table: Table
    ) -> None:
        self._direction, self._interval = config.platform.matrix[axis], 1.0 / config.sample_rate_hz
        self._white, slow, self._readout = streams.of_sensor(sensor, axis)
        self._errors = errors = SensorErrors.of(getattr(config, sensor), axis)
        self._slow = SlowDrift(errors, config, slow)
        self._origin, self._laser, self._dither, mount = 0.0, None, None, None
        if sensor == "gyro":
            lasers = ring_lasers_of(config.gyro)
            self._laser, self._dither = lasers[axis] if lasers else None, dither_of(config.gyro)
            self._origin = table.origin
            mount = own_motion.mount_of(config.motion, axis, table, streams.mount[axis])
        self._low_pass, self._passing = None, None
        if errors.corner > 0.0:
            rate = config.sample_rate_hz
            self._low_pass = butter(errors.order, errors.corner, fs=rate, output="sos")
        self._mount, self._mounted = mount, 0.0 if mount is None else float(mount.state[0])
        self._turned, self._walk = Differences(), Sums()
        self._steps, self._shown = Differences(), Sums()

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
        errors, interval, count = self._errors, self._interval, motion.angle.size
        if errors.angle_noise > 0.0:
            angles += errors.angle_noise * self._readout.standard_normal(count)
        true = self._direction @ motion.turned + self._direction[2] * (motion.angle - self._origin)
        if self._mount is not None:
            true += self._mount.angles(motion.moving) - self._mounted
        # A sample's drift is that of the middle of the interval before it.
        seconds: FloatArray = (first + np.arange(count, dtype=np.float64) - 0.5) * interval
        drift = self._slow.advance(first, count) + errors.trend(seconds)
        strength: FloatArray | float = errors.random_walk
        turned = self._turned.of(true)
        if self._laser is not None:
            sensed = turned / interval
            drift += mean_rate(self._laser, sensed, self._dither) - sensed
            strength = angle_random_walk(self._laser, sensed, self._dither)
        noise = strength * math.sqrt(interval) * self._white.standard_normal(count)
        noise += drift * interval
        if self._low_pass is None:
            angles += true + self._walk.of(noise)
        else:
            if self._passing is None:
                # Before the first sample the gyro turned by as much in every sample.
                self._passing = sosfilt_zi(self._low_pass) * turned[0]
            passed, self._passing = sosfilt(self._low_pass, turned + noise, zi=self._passing)
            angles += self._walk.of(passed)
        if errors.quantum > 0.0:
            angles[:] = np.rint(angles / errors.quantum) * errors.quantum
        if errors.rate_quantum > 0.0 or errors.full_scale > 0.0:
            angles[:] = self._shown_rates(self._steps.of(angles))

    def _shown_rates(self, turned: FloatArray) -> FloatArray:
        """(n,) sums of the steps of the angle, rad, as a readout of the rate shows them."""
        step = self._errors.rate_quantum * self._interval
        if self._errors.full_scale > 0.0:
            end = self._errors.full_scale * self._interval
            np.clip(turned, -end, end, out=turned)
        if step > 0.0:
            np.rint(turned / step, out=turned)
        return self._shown.of(turned) * (step or 1.0)
