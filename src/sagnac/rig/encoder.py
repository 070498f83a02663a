"""The angle encoder of the rig and its null pulse."""

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray
from sagnac.core.units import ARCSECOND
from sagnac.rig import _kernels, sections
from sagnac.rig.config import RigConfig
from sagnac.rig.table import LineSet, RandomStreams, Sums, drawn_orders

_TURN: Final = 2.0 * math.pi


class Encoder:
    """The encoder: the true angle with graduation errors, rounded to its lines.

    Gyro samples and readings are put together by their number. Readings are late by latency, its
    drift and walk, and by another clock. A sample without a reading of its own repeats the one
    before.

    Parameters
    ----------
    config
        Of the rig.
    past
        Time, s, up to one sample before the first, to true table angle, rad.
    streams
        Of the recording.
    """

    def __init__(
        self, config: RigConfig, past: Callable[[FloatArray], FloatArray], streams: RandomStreams
    ) -> None:
        own, interval, duration = config.encoder, 1.0 / config.sample_rate_hz, config.duration_s
        self._config, self._interval, self._duration = own, interval, duration
        self._latch, self._lost, self._delay = streams.latch, streams.lost, streams.delay
        order, size, phase = drawn_orders(own.periodic_error, streams.phases, ARCSECOND).T
        self._graduation = LineSet(position=order, phasor=(size * np.exp(1j * phase))[np.newaxis])
        # The walk of the delay, and the largest delay that a recording keeps below.
        self._walk_step, self._walk = own.delay_walk(interval), Sums()
        ends = own.delay_at([0.0, duration], duration)
        # No walk of the delay goes beyond ten times its rms.
        walk = 10.0 * self._walk_step * math.sqrt(duration / interval)
        # True table angles up to the last sample, as many as the delay reaches back.
        # An angle between samples is taken from three, and one is to spare.
        back = math.ceil((float(ends.max()) + walk) / interval) + 4
        self._past = past(-interval * np.arange(back, 0.0, -1.0))
        # Number of the reading at the last sample, and that reading.
        self._newest, self._held = -1.0, 0.0

    def read(self, first: int, alpha: FloatArray) -> FloatArray:
        """Reading at the true table angles of the next samples, unwrapped, rad.

        `first` is the number of the first of these.
        """
        number = first + np.arange(alpha.size, dtype=np.float64)
        age, new = self._new_readings(number)
        known = np.concatenate([self._past, alpha])
        newest = self._past.size + np.arange(alpha.size)
        self._past = known[alpha.size :]
        walk = self._walk.of(self._walk_step * self._delay.standard_normal(alpha.size))
        delays = self._config.delay_at((number - age) * self._interval, self._duration) + walk
        back = delays / self._interval + age
        whole = np.maximum(np.floor(back), 0.0).astype(np.int64)
        newest -= whole
        angle = _before(known, newest, back - whole)
        if self._config.latch_jitter_s > 0.0:
            jitter = self._config.latch_jitter_s / self._interval
            late = jitter * self._latch.standard_normal(alpha.size)
            angle = angle + (known[newest] - known[newest - 1]) * late
        line = _TURN / self._config.lines
        reading = np.rint((angle + self._graduation.at(angle)[0]) / line) * line
        if not new.all():
            # Before a block's first new reading the one before it holds on.
            last = np.maximum.accumulate(np.where(new, np.arange(new.size), -1))
            reading = np.where(last < 0, self._held, reading[last])
        self._held = float(reading[-1])
        return np.asarray(reading)

    def _new_readings(self, number: FloatArray) -> tuple[FloatArray, BooleanArray]:
        """Age of the readings that are new at samples of a number, and which samples have one.

        All (n,); the age is in sample intervals, below 1, and 0 without a new reading.
        """
        age, new = np.zeros(number.size), np.ones(number.size, dtype=np.bool_)
        per_sample = self._config.reading_rate_hz * self._interval
        if per_sample > 0.0:
            # A reading may come late by rounding.
            reading = np.floor(number * per_sample + 1e-6)
            new = np.diff(reading, prepend=self._newest) > 0.0
            age[new] = np.maximum(number - reading / per_sample, 0.0)[new]
            self._newest = float(reading[-1])
        if self._config.lost_fraction > 0.0:
            new &= (self._lost.random(number.size) >= self._config.lost_fraction) | (number == 0.0)
        return age, new


def _before(angle: FloatArray, place: IntegerArray, back: FloatArray) -> FloatArray:
    """Angles `back` samples before each `place`, by the parabola of the three up to it.

    If `back` is negative, the parabola goes on beyond the newest sample.
    """
    slope = angle[place] - angle[place - 1]
    bend = slope - (angle[place - 1] - angle[place - 2])
    return np.asarray(angle[place] - back * slope - 0.5 * back * (1.0 - back) * bend)


class NullPulse:
    """The null pulse: each passage of the null has an error of its own, and some are missing.

    Parameters
    ----------
    config
        Of the encoder.
    origin
        Table angle one sample before the first, rad.
    turned
        Way that the errors are drawn for, rad.
    streams
        Of the recording.

    Attributes
    ----------
    errors
        (passages,) rad.
    """

    def __init__(
        self, config: sections.EncoderConfig, origin: float, turned: float, streams: RandomStreams
    ) -> None:
        accuracy = config.null_accuracy_arcsec * ARCSECOND
        # Errors come round again after a million.
        passages = min(1024 + 2 * math.ceil(turned / _TURN), 1_000_000)
        self.errors = accuracy * streams.null.standard_normal(passages)
        self._missing = streams.missing.random(passages) < config.missing_null_fraction
        # How far from a null just passed the table is away from it.
        self._margin = 8.0 * accuracy
        self._state = np.array([math.floor(origin / _TURN), 0.0, math.nan])

    def advance(self, alpha: FloatArray) -> BooleanArray:
        """The pulse at the next samples: true at the first one past each null."""
        pulse = np.zeros(alpha.size, dtype=np.bool_)
        _kernels.null_pulse(alpha, self.errors, self._missing, self._margin, self._state, pulse)
        return pulse


def within_turn(reading: FloatArray, lines: int) -> FloatArray:
    """Encoder reading within one turn, [0, 2 pi), by its line count."""
    line = _TURN / lines
    return np.asarray(np.mod(np.rint(reading / line), lines) * line)
