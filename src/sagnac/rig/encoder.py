"""The angle encoder of the rig and its null pulse."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.core.units import ARCSECOND
from sagnac.rig import _kernels
from sagnac.rig.sections import EncoderConfig
from sagnac.rig.table import RandomStreams, drawn_orders

_TURN: Final = 2.0 * math.pi
_NULL_MARGIN: Final = 8.0  # null errors that a passage keeps clear
_MOST_NULL_ERRORS: Final = 1_000_000  # then they come round again
_WALK_TIME: Final = 1800.0  # s, after which a walk of the delay has the rms that is stated
_WALK_LIMIT: Final = 10.0  # rms that no walk of the delay goes beyond
_AROUND: Final = 4  # samples that an angle between them is taken from, and one to spare
_AT_ONCE: Final = 1e-6  # readings by which one may come late, as rounding has it


@dataclass(slots=True, kw_only=True)
class Delay:
    """Time by which the encoder's readings are late: latency, its drift and walk, another clock.

    Gyro samples and readings are put together by their number. Reading k of a clock that runs fast
    by a part c was taken at k/(1 + c) readings' time, so that it is late by t c/(1 + c) at t.

    Attributes
    ----------
    start
        At the first sample, s.
    growth
        Of drift and clock together, s a second.
    step
        Rms of one step of the walk from sample to sample, s.
    random
        Its stream.
    walked
        Where the walk has got to, s.
    """

    start: float
    growth: float
    step: float
    random: np.random.Generator
    walked: float = 0.0

    @property
    def changes(self) -> bool:
        """Whether readings are late at any time."""
        return self.start != 0.0 or self.growth != 0.0 or self.step > 0.0

    def longest(self, duration: float, interval: float) -> float:
        """Delay that a recording keeps below, s."""
        walk = _WALK_LIMIT * self.step * math.sqrt(duration / interval)
        return max(self.start, self.start + self.growth * duration) + walk

    def at(self, time: FloatArray) -> FloatArray:
        """(n,) s, of the readings that belong to the times of the next samples, (n,) s."""
        steps = self.step * self.random.standard_normal(time.size)
        steps[0] += self.walked
        walk = np.cumsum(steps)
        self.walked = float(walk[-1])
        return np.asarray(self.start + self.growth * time + walk)


def delay_growth(config: EncoderConfig, duration: float) -> float:
    """Growth of the delay by drift and clock, s a second."""
    fast = 1e-6 * config.clock_ppm
    return config.latency_drift_s / duration + fast / (1.0 + fast)


def delay_walk(config: EncoderConfig, time: float) -> float:
    """Rms that the walk of the delay gains in `time`, both in s."""
    return config.latency_walk_s * math.sqrt(time / _WALK_TIME)


@dataclass(slots=True, kw_only=True)
class Readings:
    """Which samples hold a reading of their own; the others repeat the one before.

    Attributes
    ----------
    per_sample
        Readings a sample, 0 for one at each.
    lost_fraction
        Part of the readings that are lost.
    random
        Stream of the losses.
    newest
        Number of the reading at the last sample.
    """

    per_sample: float
    lost_fraction: float
    random: np.random.Generator
    newest: float = -1.0

    def advance(self, first: int, count: int) -> tuple[FloatArray, BooleanArray]:
        """Age of the readings that are new at the next samples, and which samples have one.

        Both (count,); the age is in sample intervals, below 1, and 0 without a new reading.
        """
        number = first + np.arange(count, dtype=np.float64)
        age, new = np.zeros(count), np.ones(count, dtype=np.bool_)
        if self.per_sample > 0.0:
            reading = np.floor(number * self.per_sample + _AT_ONCE)
            new = np.diff(reading, prepend=self.newest) > 0.0
            age[new] = np.maximum(number - reading / self.per_sample, 0.0)[new]
            self.newest = float(reading[-1])
        if self.lost_fraction > 0.0:
            lost = self.random.random(count) < self.lost_fraction
            new &= ~lost | (number == 0.0)
        return age, new


@dataclass(slots=True, kw_only=True)
class Encoder:
    """The encoder: the true angle with graduation errors, rounded to its lines.

    Attributes
    ----------
    lines
        Steps in a turn.
    order
        (terms,) orders of the graduation error.
    in_phase, quadrature
        (1, terms) coefficients of its cosines and sines, rad.
    latch_jitter
        Rms time between its sample and the gyros', in sample intervals.
    interval
        Between samples, s.
    delay, readings
        When a reading was taken, and which samples repeat the one before.
    past
        True table angles up to the last sample, as many as the delay reaches back, rad.
    held
        Last reading, rad.
    random
        Stream of the latch.
    """

    lines: int
    order: FloatArray
    in_phase: FloatArray
    quadrature: FloatArray
    latch_jitter: float
    interval: float
    delay: Delay
    readings: Readings
    past: FloatArray
    random: np.random.Generator
    held: float = 0.0

    @classmethod
    def drawn(
        cls,
        config: EncoderConfig,
        past: Callable[[FloatArray], FloatArray],
        *,
        duration: float,
        interval: float,
        streams: RandomStreams,
    ) -> Self:
        """An encoder whose graduation errors have drawn phases.

        Parameters
        ----------
        config
            Of the encoder.
        past
            Time, s, up to one sample before the first, to true table angle, rad.
        duration, interval
            Of the recording, and between its samples, s.
        streams
            Of the recording.
        """
        error = drawn_orders(config.periodic_error, streams.phases)
        delay = Delay(
            start=config.latency_s,
            growth=delay_growth(config, duration),
            step=delay_walk(config, interval),
            random=streams.delay,
        )
        back = math.ceil(delay.longest(duration, interval) / interval) + _AROUND
        return cls(
            lines=config.lines,
            order=error.order,
            in_phase=(error.size * np.cos(error.phase) * ARCSECOND)[np.newaxis],
            quadrature=(-error.size * np.sin(error.phase) * ARCSECOND)[np.newaxis],
            latch_jitter=config.latch_jitter_s / interval,
            interval=interval,
            delay=delay,
            readings=Readings(
                per_sample=config.reading_rate_hz * interval,
                lost_fraction=config.lost_fraction,
                random=streams.lost,
            ),
            past=past(-interval * np.arange(back, 0.0, -1.0)),
            random=streams.latch,
        )

    def read(self, first: int, alpha: FloatArray) -> FloatArray:
        """Reading at the true table angles of the next samples, unwrapped, rad.

        `first` is the number of the first of these.
        """
        age, new = self.readings.advance(first, alpha.size)
        known = np.concatenate([self.past, alpha])
        newest = self.past.size + np.arange(alpha.size)
        self.past = known[alpha.size :]
        angle = alpha
        if self.delay.changes or age.any():
            time = (first + np.arange(alpha.size) - age) * self.interval
            back = self.delay.at(time) / self.interval + age
            whole = np.maximum(np.floor(back), 0.0).astype(np.int64)
            newest -= whole
            angle = _before(known, newest, back - whole)
        if self.latch_jitter > 0.0:
            late = self.latch_jitter * self.random.standard_normal(alpha.size)
            angle = angle + (known[newest] - known[newest - 1]) * late
        graduation = np.zeros((1, alpha.size))
        _kernels.harmonics(angle, self.order, self.in_phase, self.quadrature, graduation)
        line = _TURN / self.lines
        reading = np.rint((angle + graduation[0]) / line) * line
        if not new.all():
            # Before a block's first new reading the one before it holds on.
            last = np.maximum.accumulate(np.where(new, np.arange(new.size), -1))
            reading = np.where(last < 0, self.held, reading[last])
        self.held = float(reading[-1])
        return np.asarray(reading)


def _before(angle: FloatArray, place: NDArray[np.int64], back: FloatArray) -> FloatArray:
    """Angles `back` samples before each `place`, by the parabola of the three up to it.

    If `back` is negative, the parabola goes on beyond the newest sample.
    """
    slope = angle[place] - angle[place - 1]
    bend = slope - (angle[place - 1] - angle[place - 2])
    return np.asarray(angle[place] - back * slope - 0.5 * back * (1.0 - back) * bend)


@dataclass(slots=True, kw_only=True)
class NullPulse:
    """The null pulse: each passage of the null has an error of its own.

    Attributes
    ----------
    errors
        (passages,) rad.
    missing
        (passages,) whether the pulse is missing.
    margin
        How far from a null just passed the table is away from it, rad.
    state
        Of the last sample.
    """

    errors: FloatArray
    missing: BooleanArray
    margin: float
    state: _kernels.NullState

    @classmethod
    def drawn(
        cls, config: EncoderConfig, origin: float, turned: float, streams: RandomStreams
    ) -> Self:
        """The null pulse at table angle `origin`, with errors for a way of `turned`, rad."""
        accuracy = config.null_accuracy_arcsec * ARCSECOND
        passages = min(1024 + 2 * math.ceil(turned / _TURN), _MOST_NULL_ERRORS)
        return cls(
            errors=accuracy * streams.null.standard_normal(passages),
            missing=streams.missing.random(passages) < config.missing_null_fraction,
            margin=_NULL_MARGIN * accuracy,
            state=_kernels.NullState(float(math.floor(origin / _TURN)), 0, math.nan),
        )

    def advance(self, alpha: FloatArray) -> BooleanArray:
        """The pulse at the next samples: true at the first one past each null."""
        pulse = np.empty(alpha.size, dtype=np.bool_)
        before = self.state.passages
        self.state = _kernels.null_pulse(alpha, self.errors, self.margin, self.state, pulse)
        passed = np.flatnonzero(pulse)
        numbers = before + np.arange(passed.size)
        pulse[passed] = ~self.missing[numbers % self.missing.size]
        return pulse


def within_turn(reading: FloatArray, lines: int) -> FloatArray:
    """Encoder reading within one turn, [0, 2 pi), by its line count."""
    line = _TURN / lines
    return np.asarray(np.mod(np.rint(reading / line), lines) * line)
