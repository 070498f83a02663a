"""The table of the rig: the motion commanded, what servo and bearing make of it, what it turns.

The table stands one sample before the first when it is made, and `Table.advance` takes it on.
Servos, structures and bearings ring: damped oscillators driven by white noise. Each thing that
draws has a random stream of its own.
"""

import math
from dataclasses import dataclass, fields, replace
from itertools import islice
from typing import Any, Final, Protocol, Self

import numpy as np
import scipy.linalg

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.core.units import ARCSECOND, DEGREE
from sagnac.rig import _kernels
from sagnac.rig.sections import Pairs, TableConfig

# ---- streams -----------------------------------------------------------------------

_STREAMS = 35


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomStreams:
    """Independent random streams of one seed, one for each thing that draws.

    `white` and `slow` hold one for each gyro. The others belong to the table's jitter and
    wander, the null passages, the encoder's latch, the phases of table and encoder, and the
    disturbances. `dither` and `mount` hold one for each gyro, too. Then come the table's hunting
    and nutation, and of the encoder the walk of its delay, the readings lost and the null pulses
    that are missing. `readout` holds one for each gyro, for the noise of its sampled angle, and the
    three of `force_…` one for each accelerometer. The fields stand in the order in which they
    are spawned: new ones are appended, so that a seed keeps its numbers.
    """

    jitter: np.random.Generator
    wander: np.random.Generator
    null: np.random.Generator
    phases: np.random.Generator
    disturbances: np.random.Generator
    white: tuple[np.random.Generator, ...]
    slow: tuple[np.random.Generator, ...]
    latch: np.random.Generator
    dither: tuple[np.random.Generator, ...]
    mount: tuple[np.random.Generator, ...]
    hunting: np.random.Generator
    nutation: np.random.Generator
    delay: np.random.Generator
    lost: np.random.Generator
    missing: np.random.Generator
    readout: tuple[np.random.Generator, ...]
    force_white: tuple[np.random.Generator, ...]
    force_slow: tuple[np.random.Generator, ...]
    force_readout: tuple[np.random.Generator, ...]


def random_streams(seed: int) -> RandomStreams:
    """The streams of one seed; what one of them gives does not depend on the others."""
    generators = map(np.random.default_rng, np.random.SeedSequence(seed).spawn(_STREAMS))
    drawn: dict[str, Any] = {
        field.name: next(generators)
        if field.type is np.random.Generator
        else tuple(islice(generators, 3))
        for field in fields(RandomStreams)
    }
    return RandomStreams(**drawn)


# ---- oscillator --------------------------------------------------------------------

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


# ---- table -------------------------------------------------------------------------

# Between nodes the integrand cos(alpha) is taken by Simpson's rule, whose error is
# turn^4/2880 of the Earth-rate harmonic (15 arcsec): below 1e-6 arcsec at this turn.
_LARGEST_TURN_PER_STEP = 0.02  # rad
_LARGEST_JITTER_STEP = 0.5  # step times natural frequency of the servo


# ---- what is commanded ---------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class TableCommand:
    """Commanded table motion: rate at knots, straight between, constant outside.

    Attributes
    ----------
    time, rate, angle
        (knots,) s, rad/s and rad.
    """

    time: FloatArray
    rate: FloatArray
    angle: FloatArray

    def rate_at(self, time: FloatArray) -> FloatArray:
        """Commanded rate, rad/s."""
        return np.interp(time, self.time, self.rate)

    def angle_at(self, time: FloatArray) -> FloatArray:
        """Commanded angle, rad."""
        index = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, self.time.size - 1)
        since = time - self.time[index]
        rate = self.rate_at(time)
        # Mean of the rates at both ends of a straight piece; outside the knots they agree.
        return np.asarray(self.angle[index] + 0.5 * (self.rate[index] + rate) * since)


def table_command(config: TableConfig, duration: float) -> TableCommand:
    """The motion that the configuration commands in `duration` seconds."""
    knots = config.profile or _reversals(config, duration)
    time = np.array([time for time, _ in knots], dtype=np.float64)
    rate = np.array([rate for _, rate in knots]) * DEGREE
    pieces = 0.5 * (rate[1:] + rate[:-1]) * np.diff(time)
    angle = np.concatenate([[0.0], np.cumsum(pieces)])
    command = TableCommand(time=time, rate=rate, angle=angle)
    start = config.start_deg * DEGREE - float(command.angle_at(np.zeros(1))[0])
    return replace(command, angle=angle + start)


def _reversals(config: TableConfig, duration: float) -> Pairs:
    rate = config.rate_deg_per_s
    knots = [(0.0, rate)]
    interval = config.reversal_interval_s
    if interval == 0.0 or rate == 0.0:
        return tuple(knots)
    ramp, stand = abs(rate) / config.acceleration_deg_per_s2, 0.5 * config.dwell_s
    onward = config.after_dwell == "onward"
    middle = interval
    while middle < duration:
        knots.append((middle - stand - ramp, rate))
        if stand > 0.0:
            knots.append((middle - stand, 0.0))
        if stand > 0.0 or onward:
            knots.append((middle + stand, 0.0))
        rate = rate if onward else -rate
        knots.append((middle + stand + ramp, rate))
        middle += interval
    return tuple(knots)


# ---- what the servo adds -------------------------------------------------------------


class Mover(Protocol):
    """Something that moves the table's drive beside the command."""

    def begin(self, drive: float, rate: float) -> tuple[float, float]:
        """Drive and rate one sample before the first, with this mover's part added."""

    def advance(self, commanded: FloatArray, drive: FloatArray, rate: FloatArray) -> None:
        """Add this mover's part to drive and rate at the next nodes.

        `commanded`, `drive` and `rate` are (nodes,), in rad/s, rad and rad/s.
        """


@dataclass(slots=True, kw_only=True)
class RateNoise:
    """First-order Markov noise of the rate, whose angle walks: rate jitter, or slow wander.

    Attributes
    ----------
    rms, share
        Its rms, rad/s, is `rms` and that share of the commanded rate.
    decay
        Correlation from one node to the next.
    step
        Between nodes, s.
    state
        Of the last node.
    random
        Its stream.
    """

    rms: float
    share: float
    decay: float
    step: float
    state: _kernels.RateNoiseState
    random: np.random.Generator

    @classmethod
    def stationary(
        cls, rms: float, share: float, decay: float, step: float, random: np.random.Generator
    ) -> Self:
        """The noise in its stationary state; see the class."""
        state = _kernels.RateNoiseState(float(random.standard_normal()), 0.0, 0.0)
        return cls(rms=rms, share=share, decay=decay, step=step, state=state, random=random)

    def begin(self, drive: float, rate: float) -> tuple[float, float]:
        """See `Mover`."""
        own = (self.rms + self.share * rate) * self.state.level
        self.state = self.state._replace(rate=own)
        return drive, rate + own

    def advance(self, commanded: FloatArray, drive: FloatArray, rate: FloatArray) -> None:
        """See `Mover`."""
        normals = self.random.standard_normal(commanded.size)
        spread = math.sqrt(1.0 - self.decay**2)
        scale = self.rms + self.share * commanded
        self.state = _kernels.rate_noise(
            normals, self.decay, spread, scale, self.step, self.state, drive, rate
        )


def movers_of(config: TableConfig, step: float, streams: RandomStreams) -> tuple[Mover, ...]:
    """Jitter, wander and hunting of a servo, to be stepped by `step` seconds.

    A servo that holds the angle jitters as an oscillator; one that holds the rate lets the angle
    walk. The wander is in proportion to the rate that is commanded.
    """
    movers: list[Mover] = []
    if not config.turning:
        return ()
    jitter, hunting = config.jitter_rms_deg_per_s * DEGREE, config.hunting_rms_deg_per_s * DEGREE
    if jitter > 0.0 and config.jitter_spectrum == "position":
        held = Oscillator.stationary(
            frequency=config.jitter_bandwidth_hz,
            damping=config.jitter_damping,
            rms_rate=jitter,
            step=step,
            random=streams.jitter,
        )
        movers.append(held)
    elif jitter > 0.0:
        decay = math.exp(-2.0 * math.pi * config.jitter_bandwidth_hz * step)
        movers.append(RateNoise.stationary(jitter, 0.0, decay, step, streams.jitter))
    if config.wander_fraction > 0.0:
        decay = math.exp(-step / config.wander_time_s)
        share = config.wander_fraction
        movers.append(RateNoise.stationary(0.0, share, decay, step, streams.wander))
    if hunting > 0.0:
        hunted = Oscillator.stationary(
            frequency=config.hunting_hz,
            damping=0.5 / config.hunting_quality,
            rms_rate=hunting,
            step=step,
            random=streams.hunting,
        )
        movers.append(hunted)
    return tuple(movers)


# ---- what the bearing makes of it ----------------------------------------------------


def drawn_orders(pairs: Pairs, random: np.random.Generator, unit: float = 1.0) -> _kernels.Orders:
    """Terms at ascending orders, their sizes times `unit`, at phases that are drawn."""
    ordered = sorted(pairs)
    order = np.array([order for order, _ in ordered], dtype=np.float64)
    size = np.array([size for _, size in ordered], dtype=np.float64) * unit
    return _kernels.Orders(order, size, random.uniform(-np.pi, np.pi, order.size))


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """True motion of the table over consecutive samples.

    Attributes
    ----------
    angle
        (n,) table angle, rad.
    turned
        (3, n) angle turned along b since one sample before the first, without the table's own:
        the Earth's, and on the level axes the wobble's and the nutation's, rad.
    moving
        (n,) whether the table is commanded to move.
    """

    angle: FloatArray
    turned: FloatArray
    moving: BooleanArray


@dataclass(slots=True, kw_only=True)
class Table:
    """The table on its way, and the rate along b integrated on it (Eq. 4 without the shares).

    Attributes
    ----------
    command
        What is commanded.
    movers
        What the servo adds, in the order in which it is added.
    ripple, wobble
        Of the bearing.
    earth
        (3,) Earth rate in b0, rad/s.
    interval, substeps
        Between samples, s; nodes in it.
    state
        Of the last node.
    origin
        Table angle one sample before the first, rad.
    """

    command: TableCommand
    movers: tuple[Mover, ...]
    ripple: _kernels.Orders
    wobble: _kernels.Orders
    earth: FloatArray
    interval: float
    substeps: int
    state: _kernels.MotionState
    origin: float

    @classmethod
    def before_first(
        cls,
        config: TableConfig,
        command: TableCommand,
        earth: FloatArray,
        interval: float,
        streams: RandomStreams,
    ) -> Self:
        """The table one sample before the first; ripple phases are drawn before wobble's."""
        substeps = substeps_of(config, command, interval)
        movers = movers_of(config, interval / substeps, streams)
        ripple = drawn_orders(config.ripple, streams.phases)
        wobble = drawn_orders(config.wobble, streams.phases, ARCSECOND)
        start: FloatArray = np.array([-interval])
        drive, rate = float(command.angle_at(start)[0]), float(command.rate_at(start)[0])
        for mover in movers:
            drive, rate = mover.begin(drive, rate)
        origin = float(_kernels.table_angle(drive, ripple))
        sensed = _kernels.earth_in_table(origin, earth, wobble)
        return cls(
            command=command,
            movers=movers,
            ripple=ripple,
            wobble=wobble,
            earth=earth,
            interval=interval,
            substeps=substeps,
            state=_kernels.MotionState(drive, rate, sensed, (0.0, 0.0, 0.0)),
            origin=origin,
        )

    def before(self, time: FloatArray) -> FloatArray:
        """Angle before the recording, rad: as commanded, up to where the table is made.

        `time`, s, is at most one sample before the first.
        """
        made = self.command.angle_at(np.array([-self.interval]))
        return np.asarray(self.origin + self.command.angle_at(time) - made)

    def advance(self, first: int, count: int) -> Motion:
        """The motion over the next `count` samples, the first of which has number `first`."""
        step = self.interval / self.substeps
        nodes = count * self.substeps
        begin = first * self.substeps + 1
        time = np.arange(begin, begin + nodes, dtype=np.float64) * step - self.interval
        drive = self.command.angle_at(time)
        commanded = self.command.rate_at(time)
        rate = commanded.copy()
        for mover in self.movers:
            mover.advance(commanded, drive, rate)
        angle = np.empty(count)
        turned = np.empty((3, count))
        self.state = _kernels.motion(
            drive,
            rate,
            step,
            self.substeps,
            self.ripple,
            self.earth,
            self.wobble,
            self.state,
            angle,
            turned,
        )
        moving = commanded[self.substeps - 1 :: self.substeps] != 0.0
        return Motion(angle=angle, turned=turned, moving=moving)


def fastest_rate(config: TableConfig, command: TableCommand) -> float:
    """Largest rate with its ripple, rad/s."""
    ripple = sum(fraction for _, fraction in config.ripple)
    return float(np.abs(command.rate).max()) * (1.0 + ripple)


def substeps_of(config: TableConfig, command: TableCommand, interval: float) -> int:
    """Nodes in a sample interval, close enough for Simpson's rule and for the servo's jitter."""
    needed = [1, math.ceil(fastest_rate(config, command) * interval / _LARGEST_TURN_PER_STEP)]
    for rms, frequency in (
        (config.jitter_rms_deg_per_s, config.jitter_bandwidth_hz),
        (config.hunting_rms_deg_per_s, config.hunting_hz),
    ):
        if config.turning and rms > 0.0:
            natural = 2.0 * math.pi * frequency
            needed.append(math.ceil(natural * interval / _LARGEST_JITTER_STEP))
    return max(needed)
