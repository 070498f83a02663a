"""The table of the rig: what servo and bearing make of the commanded motion, what it turns.

The table stands one sample before the first when it is made, and `Table.advance` takes it on.
Servos, structures and bearings ring: damped oscillators driven by white noise. Each thing that
draws has a random stream of its own.
"""

import math
from dataclasses import dataclass
from itertools import islice
from typing import Final

import numpy as np
import scipy.linalg
from numpy.random import Generator
from scipy.signal import lfilter

from sagnac.core.arrays import BooleanArray, ComplexArray, FloatArray
from sagnac.core.units import ARCSECOND, DEGREE, Sensor
from sagnac.rig import _kernels
from sagnac.rig.config import RigConfig, TableCommand
from sagnac.rig.sections import Pairs, TableConfig

# ---- streams -----------------------------------------------------------------------


class RandomStreams:
    """Independent random streams of one seed, one for each thing that draws.

    What one of them gives does not depend on the others. `white` and `slow` hold one for each gyro.
    The others belong to the table's jitter and wander, the null passages, the encoder's latch, the
    phases of table and encoder, and the disturbances. `dither` and `mount` hold one for each gyro,
    too. Then come the table's hunting and nutation, and of the encoder the walk of its delay, the
    readings lost and the null pulses that are missing. `readout` holds one for each gyro, for the
    noise of its sampled angle, and the three of `force_…` one for each accelerometer.
    """

    def __init__(self, seed: int) -> None:
        spawned = map(np.random.default_rng, np.random.SeedSequence(seed).spawn(35))

        def three() -> tuple[Generator, ...]:
            return tuple(islice(spawned, 3))

        # In the order in which they are spawned: new ones come last, so that a seed keeps its
        # numbers.
        self.jitter, self.wander, self.null, self.phases = islice(spawned, 4)
        self.disturbances, self.white, self.slow = next(spawned), three(), three()
        self.latch, self.dither, self.mount = next(spawned), three(), three()
        self.hunting, self.nutation, self.delay, self.lost, self.missing = islice(spawned, 5)
        self.readout = three()
        self.force_white, self.force_slow, self.force_readout = three(), three(), three()

    def of_sensor(self, sensor: Sensor, axis: int) -> tuple[Generator, ...]:
        """Those of one gyro or accelerometer: of its random walk, slow errors and readout."""
        streams = (self.white, self.slow, self.readout)
        if sensor == "accelerometer":
            streams = (self.force_white, self.force_slow, self.force_readout)
        return tuple(each[axis] for each in streams)


# ---- series that come in blocks ----------------------------------------------------------


class Differences:
    """Steps of a series, (…, n), from each sample to the next, whatever the blocks it comes in.

    `before` is its value one sample before the first.
    """

    def __init__(self, before: FloatArray | float = 0.0) -> None:
        self._before = before

    def of(self, values: FloatArray) -> FloatArray:
        """The steps to the next samples."""
        steps = np.diff(values, prepend=self._before)
        self._before = values[..., -1:].copy()
        return steps


class Sums:
    """Running sums of a series of steps, (…, n), in one order, whatever the blocks it comes in."""

    def __init__(self) -> None:
        self._sum: FloatArray | float = 0.0

    def of(self, steps: FloatArray) -> FloatArray:
        """The sums at the next samples; `steps` is overwritten."""
        steps[..., :1] += self._sum
        sums = np.cumsum(steps, axis=-1, out=steps)
        self._sum = sums[..., -1:].copy()
        return sums


# ---- what rings and what wanders -----------------------------------------------------


class Oscillator:
    """Angle of a damped oscillator driven by white noise, stepped exactly.

    It obeys ``x'' + 2 zeta w x' + w^2 x = noise``. Its angle has the two-sided density
    ``4 zeta w^3 s^2 / ((w^2 - v^2)^2 + (2 zeta w v)^2)`` at the angular frequency v, s being its
    rms angle. It begins in its stationary state.

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

    Attributes
    ----------
    transition, spread
        (2, 2) step of angle and rate, and the factor of the noise added to it.
    state
        (2,) angle and rate at the last step.
    """

    def __init__(
        self, frequency: float, damping: float, rms_rate: float, step: float, random: Generator
    ) -> None:
        natural = 2.0 * math.pi * frequency
        slope = np.array([[0.0, 1.0], [-natural * natural, -2.0 * damping * natural]])
        self.state = np.array([rms_rate / natural, rms_rate]) * random.standard_normal(2)
        self.transition = np.asarray(scipy.linalg.expm(slope * step))
        self.spread = _noise_factor(natural * step, damping) * rms_rate * [[step], [1.0]]
        self._random = random

    def begin(self, drive: float, rate: float) -> tuple[float, float]:
        """Drive and rate one sample before the first, with the oscillator's part added."""
        return drive + float(self.state[0]), rate + float(self.state[1])

    def advance(self, commanded: FloatArray, drive: FloatArray, rate: FloatArray) -> None:
        """Add the next steps to drive and rate, whatever is commanded (as `RateNoise`)."""
        self._add(self._random.standard_normal((commanded.size, 2)), drive, rate)

    def angles(self, driven: BooleanArray) -> FloatArray:
        """(n,) angle at the next steps, rad; it rings down where it is not `driven`, (n,)."""
        normals = self._random.standard_normal((driven.size, 2))
        normals[~driven] = 0.0
        angle = np.zeros(driven.size)
        self._add(normals, angle, np.zeros(driven.size))
        return angle

    def _add(self, normals: FloatArray, angle: FloatArray, rate: FloatArray) -> None:
        _kernels.oscillator(normals, self.transition, self.spread, self.state, angle, rate)


def _noise_factor(turn: float, damping: float) -> FloatArray:
    """Factor of the covariance that a step adds, rate of variance 1, angle in rates times steps.

    It is the stationary covariance less what a step leaves of it. If the step is a small part of
    the ring-down, that difference loses all its digits, and Van Loan's integral (IEEE Trans.
    Automatic Control 23, 395, 1978) is taken, whose exponential grows with long steps.

    `turn` is the natural angular frequency times the step.
    """
    slope = np.array([[0.0, 1.0], [-turn * turn, -2.0 * damping * turn]])
    if damping * turn < 0.1:
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


class RateNoise:
    """First-order Markov noise of the rate, whose angle walks: rate jitter, or slow wander.

    Its rms, rad/s, is `rms` and a `share` of the commanded rate; `decay` is its correlation from
    one node to the next, `step` s apart.
    """

    def __init__(
        self, rms: float, share: float, decay: float, step: float, random: Generator
    ) -> None:
        self._rms, self._share, self._decay, self._step = rms, share, decay, step
        self._random, self._angle = random, Sums()
        # Of variance one.
        self.level = float(random.standard_normal())
        self._before = 0.0

    def begin(self, drive: float, rate: float) -> tuple[float, float]:
        """Drive and rate one sample before the first, with this noise added."""
        self._before = (self._rms + self._share * rate) * self.level
        return drive, rate + self._before

    def advance(self, commanded: FloatArray, drive: FloatArray, rate: FloatArray) -> None:
        """Add it to drive and rate at the next nodes.

        `commanded`, `drive` and `rate` are (nodes,), in rad/s, rad and rad/s.
        """
        normals = self._random.standard_normal(commanded.size)
        spread = math.sqrt(1.0 - self._decay**2)
        levels, _ = lfilter([spread], [1.0, -self._decay], normals, zi=[self._decay * self.level])
        own = (self._rms + self._share * commanded) * levels
        before = np.concatenate([[self._before], own[:-1]])
        self.level, self._before = float(levels[-1]), float(own[-1])
        drive += self._angle.of(0.5 * self._step * (before + own))
        rate += own


# Something that moves the table's drive beside the command.
Mover = Oscillator | RateNoise


def movers_of(config: TableConfig, step: float, streams: RandomStreams) -> tuple[Mover, ...]:
    """Jitter, wander and hunting of a servo, to be stepped by `step` seconds.

    A servo that holds the angle jitters as an oscillator; one that holds the rate lets the angle
    walk. The wander is in proportion to the rate that is commanded.
    """
    if not config.turning:
        return ()

    jitter, hertz = config.jitter_rms_deg_per_s * DEGREE, config.jitter_bandwidth_hz
    hunting, damping = config.hunting_rms_deg_per_s * DEGREE, 0.5 / config.hunting_quality
    movers: list[Mover] = []
    if jitter > 0.0 and config.jitter_spectrum == "position":
        movers.append(Oscillator(hertz, config.jitter_damping, jitter, step, streams.jitter))
    elif jitter > 0.0:
        decay = math.exp(-2.0 * math.pi * hertz * step)
        movers.append(RateNoise(jitter, 0.0, decay, step, streams.jitter))
    if config.wander_fraction > 0.0:
        decay = math.exp(-step / config.wander_time_s)
        movers.append(RateNoise(0.0, config.wander_fraction, decay, step, streams.wander))
    if hunting > 0.0:
        movers.append(Oscillator(config.hunting_hz, damping, hunting, step, streams.hunting))
    return tuple(movers)


# ---- table -----------------------------------------------------------------------------

_TOGETHER: Final = 256  # samples of a line that begin at a phase of their own


@dataclass(frozen=True, slots=True, kw_only=True)
class LineSet:
    """Periodic terms of one scale, each in several channels.

    Attributes
    ----------
    position
        (lines,) orders or frequencies in Hz, ascending.
    phasor
        (channels, lines) amplitude and phase, rad: the line is Re(phasor exp(i k alpha)).
    """

    position: FloatArray
    phasor: ComplexArray

    def at(self, angle: FloatArray) -> FloatArray:
        """(channels, n) their sum at angles, (n,) rad."""
        turn = np.cos(angle) + 1j * np.sin(angle)
        power, to_power, waves = 0, np.ones_like(turn), []
        for order in self.position.tolist():
            # Products are ten times as fast as exponentials.
            while power < order and order.is_integer():
                power, to_power = power + 1, to_power * turn
            waves.append(to_power if order.is_integer() else np.exp(1j * order * angle))
        return self._sum(waves, angle.size)

    def at_samples(self, first: int, count: int, interval: float) -> FloatArray:
        """(channels, count) their sum from sample `first` on; samples are `interval` s apart."""
        waves = []
        for cycles in (self.position * interval).tolist():
            begun = cycles * (first + np.arange(0, count, _TOGETHER))
            within = np.exp(2j * np.pi * cycles * np.arange(_TOGETHER))
            wave = np.outer(np.exp(2j * np.pi * (begun - np.floor(begun))), within)
            waves.append(wave.ravel()[:count])
        return self._sum(waves, count)

    def _sum(self, waves: list[ComplexArray], count: int) -> FloatArray:
        return np.asarray((self.phasor @ np.reshape(waves, (-1, count))).real)


def drawn_orders(pairs: Pairs, random: Generator, unit: float) -> FloatArray:
    """(terms, 3) ascending orders, their sizes times `unit`, and phases that are drawn, rad."""
    order, size = np.reshape(sorted(pairs), (-1, 2)).T
    return np.column_stack([order, size * unit, random.uniform(-np.pi, np.pi, order.size)])


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


class Table:
    """The table on its way, and the rate along b integrated on it (Eq. 4 without the shares).

    Attributes
    ----------
    interval
        Between samples, s.
    origin
        Table angle one sample before the first, rad.
    moving
        Whether the table is commanded to move then.
    """

    def __init__(self, config: RigConfig, streams: RandomStreams) -> None:
        self._command, self._earth = config.command, config.platform.earth
        self.interval = 1.0 / config.sample_rate_hz
        self._substeps = substeps_of(config.table, self._command, self.interval)
        self._movers = movers_of(config.table, self.interval / self._substeps, streams)
        # Phases of the ripple are drawn before those of the wobble.
        self._ripple = drawn_orders(config.table.ripple, streams.phases, 1.0)
        self._wobble = drawn_orders(config.table.wobble, streams.phases, ARCSECOND)
        start: FloatArray = np.array([-self.interval])
        drive = float(self._command.angle_at(start)[0])
        rate = float(self._command.rate_at(start)[0])
        self.moving = rate != 0.0
        for mover in self._movers:
            drive, rate = mover.begin(drive, rate)
        self._drive, self._rate, self._turned = np.array([drive]), np.array([rate]), Sums()
        self.origin = float(self._angle(self._drive)[0])

    def _angle(self, drive: FloatArray) -> FloatArray:
        """(n,) table angle at angles of the drive, with the ripple, rad."""
        each = (size / order * np.sin(order * drive + p) for order, size, p in self._ripple)
        return sum(each, start=drive)

    def _earth_along(self, angle: FloatArray) -> FloatArray:
        """(3, n) Earth rate along b at table angles, at which the wobble tilts the shaft."""
        x, y, z = self._earth
        tilt_x, tilt_y = (
            sum((size * wave(order * angle + p) for order, size, p in self._wobble), 0.0 * angle)
            for wave in (np.cos, np.sin)
        )
        first, second = x - tilt_y * z, y + tilt_x * z
        cosine, sine = np.cos(angle), np.sin(angle)
        third = z - tilt_x * y + tilt_y * x
        return np.array([cosine * first + sine * second, cosine * second - sine * first, third])

    def before(self, time: FloatArray) -> FloatArray:
        """Angle before the recording, rad: as commanded, up to where the table is made.

        `time`, s, is at most one sample before the first.
        """
        made = self._command.angle_at(np.array([-self.interval]))
        return np.asarray(self.origin + self._command.angle_at(time) - made)

    def advance(self, first: int, count: int) -> Motion:
        """The motion over the next `count` samples, the first of which has number `first`.

        Between nodes the drive is the cubic through both ends' angles and rates, and the integral
        of the rate along b is Simpson's.
        """
        step, nodes = self.interval / self._substeps, count * self._substeps
        begin = first * self._substeps + 1
        time = np.arange(begin, begin + nodes, dtype=np.float64) * step - self.interval
        drive, commanded = self._command.angle_at(time), self._command.rate_at(time)
        rate = commanded.copy()
        for mover in self._movers:
            mover.advance(commanded, drive, rate)
        drives, rates = np.append(self._drive, drive), np.append(self._rate, rate)
        self._drive, self._rate = drives[-1:], rates[-1:]
        middles = 0.5 * (drives[:-1] + drives[1:]) + 0.125 * step * (rates[:-1] - rates[1:])
        ends = self._angle(drives)
        earth, between = self._earth_along(ends), self._earth_along(self._angle(middles))
        turned = self._turned.of(step / 6.0 * (earth[:, :-1] + 4.0 * between + earth[:, 1:]))
        samples = slice(self._substeps - 1, None, self._substeps)
        angle, turned = ends[1:][samples], turned[:, samples].copy()
        for order, size, phase in self._wobble:
            # What the tilting of the shaft turns: i m a exp(i((m - 1) alpha + p)) over alpha.
            relative = order - 1.0
            integral = np.exp(1j * relative * angle) / relative if relative else 1j * angle
            tilted = order * size * np.exp(1j * phase) * integral
            turned[:2] += tilted.real, tilted.imag
        return Motion(angle=angle, turned=turned, moving=commanded[samples] != 0.0)


def fastest_rate(config: TableConfig, command: TableCommand) -> float:
    """Largest rate with its ripple, rad/s."""
    ripple = sum(fraction for _, fraction in config.ripple)
    return float(np.abs(command.rate).max()) * (1.0 + ripple)


def substeps_of(config: TableConfig, command: TableCommand, interval: float) -> int:
    """Nodes in a sample interval, close enough for Simpson's rule and for the servo's jitter."""
    # Between nodes the integrand cos(alpha) is taken by Simpson's rule, whose error is turn^4/2880
    # of the Earth-rate harmonic (15 arcsec): below 1e-6 arcsec at a turn of 0.02 rad.
    needed = [1, math.ceil(fastest_rate(config, command) * interval / 0.02)]
    jitter = config.jitter_rms_deg_per_s, config.jitter_bandwidth_hz
    for rms, frequency in (jitter, (config.hunting_rms_deg_per_s, config.hunting_hz)):
        if config.turning and rms > 0.0:
            # A step is half of the servo's natural period over 2 pi at the most.
            needed.append(math.ceil(2.0 * math.pi * frequency * interval / 0.5))
    return max(needed)
