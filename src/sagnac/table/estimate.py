"""The table's angle as gyros and encoder together know it.

An encoder is read some microseconds beside the gyros, at instants that jitter, drift and come
late; its steps and its graduation add to that. The gyros sense the same motion at their own
instants, and from a fraction of a hertz on with less noise; below that their bias drifts. So the
angle is taken from the gyros, and led by the encoder below the frequency at which the two know it
equally well, which is the corner of Wiener's filter for white noise of readings and an angle that
walks.

Where the table's rate varies, a delay of the encoder shows as well: it is fitted with its errors,
a change with time included (a clock that runs fast), and taken out.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple, Self

import numpy as np
from scipy.fft import dst, idst, rfft

from sagnac.core import arrays
from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray
from sagnac.core.units import ARCSECOND
from sagnac.table import kinematics
from sagnac.table.turns import FEW_TURNS, full_turns
from sagnac.table.whitened import Whitened, whitened

# Orders of the table angle that gyros and encoder differ by.
_ORDERS: Final = 4
# Orders above these at which the table's rate varies most, as many as are fitted, and the highest.
_RIPPLES: Final = 4
_HIGHEST: Final = 36
# Straight pieces of a gyro's drift.
_PIECES: Final = 8
# Standard errors from which on a delay is one.
SEEN: Final = 6.0
# Shortest delay, or change of one, that is named, s: averages of a motion that starts and stops
# leave a quarter of it.
SHORTEST_DELAY: Final = 2e-6
# Hz, lowest corner. With 0.002 one of two recordings with delays that walk gained, the other lost.
_LOWEST_CORNER: Final = 0.01
# Times that a slow tone stands above the noise of readings and gyros: of thousands of ordinates of
# noise none does.
_TONE: Final = 25.0
# Most of them; recording 97 of the plain hundred has three.
_MOST_TONES: Final = 6
# Most steps of the fit of a delay, or of a drift.
_STEPS: Final = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Delay:
    """Time by which an encoder is read after the gyros.

    Attributes
    ----------
    mean, mean_error
        At mid-record, and its standard error, s.
    change, change_error
        From the first sample to the last, evenly, s.
    duration
        Of the record, s.
    """

    mean: float
    mean_error: float
    change: float
    change_error: float
    duration: float

    @property
    def values(self) -> FloatArray:
        """Mean and change, s."""
        return np.array([self.mean, self.change])

    @property
    def errors(self) -> FloatArray:
        """Their standard errors, s."""
        return np.array([self.mean_error, self.change_error])

    @property
    def is_seen(self) -> bool:
        """Whether it differs from none by more than chance."""
        return bool((np.abs(self.values) > np.maximum(SEEN * self.errors, SHORTEST_DELAY)).any())

    def at(self, seconds: FloatArray) -> FloatArray:
        """Delay at times, s."""
        return np.asarray(self.mean + self.change * (seconds / self.duration - 0.5))


class Shift(NamedTuple):
    """A shift, in time or in angle, and its standard error in the same unit."""

    value: float
    error: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EstimatedTable:
    """Estimate of a table by gyros and encoder together.

    Attributes
    ----------
    angle
        (samples,) table angle at the gyros' instants, rad.
    readings
        (samples,) the encoder's angle with its delay taken out, rad; not smoothed.
    shares
        (gyros,) of the table's rate that each gyro senses.
    alike
        Rms of the motion that only one of the gyros shows, in that of all: 0 for one gyro, or if
        it is lost in the rounding of that.
    noise
        Rms of the readings about the angle, sample by sample, rad.
    corner
        Hz above which the angle is the gyros'; inf if it is the encoder's throughout.
    delay
        None if none is seen.
    """

    angle: FloatArray
    readings: FloatArray
    shares: FloatArray
    alike: float
    noise: float = 0.0
    corner: float = math.inf
    delay: Delay | None = None

    def with_drift(self, drift: Shift) -> Self:
        """The same table with a drift from end to end, rad, added to its angle."""
        last = max(self.angle.size - 1, 1)
        angle = arrays.less(self.angle, lambda number: drift.value * (0.5 - number / last))
        return replace(self, angle=angle)

    @property
    def smoothed(self) -> bool:
        """Whether the gyros know more of the angle than the encoder from some frequency on."""
        return math.isfinite(self.corner)


def estimated_table(
    gyros: Sequence[FloatArray], encoder: FloatArray, sample_rate: float
) -> EstimatedTable:
    """The table angle from gyros and encoder.

    Parameters
    ----------
    gyros
        (samples,) angle of each gyro, rad. One is enough.
    encoder
        (samples,) unwrapped table angle as read, rad.
    sample_rate
        Hz.

    Returns
    -------
    EstimatedTable
        The readings as they are if the gyros do not sense the table, or know less of it.
    """
    block = max(1, round(sample_rate / kinematics.KINEMATIC_RATE))
    coarse = np.stack([kinematics.averages_of(angle, block) for angle in gyros])
    read = kinematics.averages_of(encoder, block)
    # Rates over a second tell the shares.
    shares, alike = shares_of_table(coarse, read, max(1, round(sample_rate / block)))
    strength = float(shares @ shares)
    plain = EstimatedTable(angle=encoder, readings=encoder, shares=shares, alike=alike)
    if not strength > 0.0 or read.size < 4 * _PIECES:
        return plain
    sensed = shares @ coarse / strength
    interval = block / sample_rate
    fit = _Fit.of(read, sensed, interval)
    # First with a change of the delay, then without.
    both = (np.array([True, change]) for change in (True, False))
    tried = (_delay_taken_out(encoder, sensed, fit, sample_rate, free) for free in both)
    readings, delay = next((taken for taken in tried if taken is not None), (encoder, None))
    if delay is not None:
        fit = _Fit.of(kinematics.averages_of(readings, block), sensed, interval)
    gyro = arrays.elementwise(lambda *here: shares / strength @ np.stack(here), *gyros)
    noise = _noise(gyro, encoder, delay, sample_rate)
    corner = fit.corner(_own_walk(coarse, shares))
    # From a quarter of the rate of averages on a corner leaves the readings as they are.
    corner = math.inf if corner > 0.25 / interval else corner
    if math.isfinite(corner):
        angle = _without_hum(_led(gyro, fit.guide(corner), block), readings, block)
    else:
        angle = readings
    return replace(plain, angle=angle, readings=readings, noise=noise, corner=corner, delay=delay)


def _delay_taken_out(
    encoder: FloatArray, sensed: FloatArray, fit: "_Fit", sample_rate: float, free: BooleanArray
) -> tuple[FloatArray, Delay | None] | None:
    """The encoder's angle without a delay, and the delay; None if it comes back, and so is none.

    Orders that no column holds can look like a change of the delay, however much is taken out.

    Parameters
    ----------
    encoder
        (samples,) as read, rad.
    sensed, fit
        Averages of the gyros, and the fit to those of the encoder.
    sample_rate
        Hz.
    free
        (2,) whether the delay at mid-record and its change may be other than zero.
    """
    readings, delay, first = encoder, None, np.zeros(2)
    for number in range(_STEPS):
        moved = fit.delay(delay, free)
        if moved is None:
            break
        known = moved.values - (0.0 if delay is None else delay.values)
        if (known * np.sign(first) > np.maximum(0.5 * np.abs(first), SEEN * moved.errors)).any():
            return None
        first = first if number else known
        delay, readings = moved, _undelayed(encoder, moved, sample_rate)
        if number == _STEPS - 1 or (number and abs(known[0]) < 1e-7):
            break
        averages = kinematics.averages_of(readings, round(fit.interval * sample_rate))
        fit = _Fit.of(averages, sensed, fit.interval)
    return (encoder, None) if delay is None or not delay.is_seen else (readings, delay)


def order_drift(
    table: EstimatedTable, angle: FloatArray, sample_rate: float, *, share: float
) -> Shift | None:
    """By how much the table angle runs off against what repeats with it in a gyro angle.

    On a table that turns evenly, a delay that grows is a rate of its own: neither encoder nor
    gyros know. What repeats with the angle does.

    Parameters
    ----------
    table
        As `estimated_table` gives it.
    angle
        (samples,) of a gyro, or of two that take the table out, rad.
    sample_rate
        Hz.
    share
        Of the table's own motion, which `angle` holds besides: a table that dwells or swings
        would hide by it what repeats.

    Returns
    -------
    Shift or None
        None if the orders keep their phases, or the table does not turn evenly from stretch to
        stretch.
    """
    block = max(1, round(sample_rate / kinematics.KINEMATIC_RATE))
    known = kinematics.averages_of(table.angle, block)
    shown = kinematics.averages_of(angle, block) - share * known
    turned = abs(float(known[-1] - known[0])) / (2.0 * np.pi)
    # Averages show orders up to about a third of their rate.
    highest = min(_HIGHEST, math.floor(0.35 * known.size / max(turned, 1e-12)))
    orders = np.arange(1.0, highest + 1.0)
    # The phases of orders are followed over stretches of four turns or more.
    stretches = min(24, math.floor(turned / 4.0))
    if stretches < 8 or orders.size < 2:
        return None
    ends = np.linspace(0, known.size - 1, stretches + 1).astype(np.int64)
    # Each stretch of a table that turns evenly has half of the usual turns or more.
    each = np.abs(np.diff(known[ends])) / (turned * 2.0 * np.pi / stretches)
    if each.min() < 0.5:
        # Where the table stands, orders have no phase that would go on.
        return None
    # Earth rate makes the less of order 1 the faster the table turns, which turns its phase.
    orders = orders[int(np.ptp(each) > 0.05) :]
    place = (np.arange(known.size) + 0.5) / known.size - 0.5
    # A delay that was seen has an error of its own, which the orders mend.
    seen = SEEN if table.delay is None else 2.0
    value, error = 0.0, math.inf
    for _ in range(_STEPS):
        moved = _phase_drift(shown, known + value * place, orders, stretches)
        if abs(moved.value) < seen * moved.error:
            break
        value, error = value + moved.value, moved.error
    return None if value == 0.0 else Shift(value, error)


def _phase_drift(shown: FloatArray, known: FloatArray, orders: FloatArray, stretches: int) -> Shift:
    """Rate of the table angle by the phases of orders in averages of a gyro angle.

    Each order by itself gives a drift, whose error is that of its phases about a straight line, so
    that a line in time beside it counts as noise; their weighted mean is taken, its error raised by
    what they disagree.
    """
    length = (known.size - 1) // stretches
    window = np.hanning(length + 2)[1:-1]
    steps = np.diff(shown)
    steps = (steps - steps.mean())[: length * stretches].reshape(stretches, length) * window
    middle = 0.5 * (known[1:] + known[:-1])[: length * stretches].reshape(stretches, length)
    parts = (np.arange(stretches) + 0.5) / stretches - 0.5
    values, weights = [], []
    turn = np.exp(-1j * middle)
    turned = steps * turn ** (orders[0] - 1.0)
    for order in orders:
        # Orders follow one another: a product is a tenth of an exponential.
        turned *= turn
        phasor = turned.sum(axis=1)
        usual = phasor.mean()
        phase = np.imag(phasor * np.conj(usual)) / max(abs(usual) ** 2, 1e-300) / order
        slope = float(parts @ phase) / float(parts @ parts)
        left = phase - phase.mean() - slope * parts
        variance = float(left @ left) / (stretches - 2) / float(parts @ parts)
        scatter = float(np.sum(np.abs(phasor - usual) ** 2)) / (stretches - 1)
        # A phase is one if the power of the order stands twice above its scatter.
        if abs(usual) ** 2 > 2.0 * scatter and variance > 0.0:
            values.append(slope)
            weights.append(1.0 / variance)
    if not values:
        return Shift(0.0, math.inf)
    slopes, weight = np.array(values), np.array(weights)
    value = float(weight @ slopes) / float(weight.sum())
    excess = float(weight @ (slopes - value) ** 2) / max(slopes.size - 1, 1)
    return Shift(value, math.sqrt(max(1.0, excess) / float(weight.sum())))


def shares_of_table(coarse: FloatArray, read: FloatArray, step: int) -> tuple[FloatArray, float]:
    """(gyros,) share of each, and how much of their motion is not common.

    The direction is that of the gyros' motion among one another, which no error of the encoder
    bends; the encoder gives the scale.
    """
    turned, table = np.diff(coarse[:, ::step]), np.diff(read[::step])
    size = float(table @ table)
    if not size > 0.0:
        return np.zeros(coarse.shape[0]), 0.0
    values, vectors = np.linalg.eigh(turned @ turned.T)
    common = vectors[:, -1]
    shares = common * float(common @ turned @ table) / size
    return shares, math.sqrt(max(float(values[:-1].sum()), 0.0) / max(float(values[-1]), 1e-300))


def _own_walk(coarse: FloatArray, shares: FloatArray) -> float:
    """Variance of a step of the gyros' own walk in the angle that they sense together, rad^2.

    Told from how they differ once the table is taken out; inf for one gyro, which nothing tells.
    """
    if shares.size == 1:
        return math.inf
    strength = float(shares @ shares)
    sensed = (shares @ coarse)[np.newaxis] / strength
    without_table = np.linalg.svd(shares[np.newaxis])[2][1:]
    faded = full_turns(sensed[0]) >= FEW_TURNS
    fits = [whitened(row @ coarse, sensed.copy(), math.inf, faded=faded) for row in without_table]
    return float(np.mean([fit.walk for fit in fits])) / strength


def _noise(gyro: FloatArray, encoder: FloatArray, delay: Delay | None, sample_rate: float) -> float:
    """Rms of readings about the gyros at the instants of the encoder, sample by sample, rad.

    Readings that are shifted by a delay have less noise than those that were made.
    """
    if delay is not None:
        gyro = _undelayed(gyro, replace(delay, mean=-delay.mean, change=-delay.change), sample_rate)
    steps = arrays.differences(arrays.elementwise(np.subtract, encoder, gyro))
    return math.sqrt(0.5 * max(arrays.square(steps) / steps.size - arrays.mean(steps) ** 2, 0.0))


def _led(led: FloatArray, guide: FloatArray, block: int) -> FloatArray:
    """The gyros' angle, changed in place: led by a guide that is known in the middle of blocks."""
    ends = guide[[0, -1]] + np.array([-0.5, 0.5]) * (guide[[1, -1]] - guide[[0, -2]])
    known = np.concatenate([ends[:1], guide, ends[1:]])
    middles = np.arange(-1.0, guide.size + 1.0) * block + 0.5 * (block - 1)
    middles[[0, -1]] += np.array([0.5, -0.5]) * block
    slope = (known[-1] - known[-2]) / (middles[-1] - middles[-2])
    for piece in arrays.blocks(led.size):
        place = np.arange(piece.start, piece.stop, dtype=np.float64)
        beyond = np.maximum(place - middles[-1], 0.0) * slope
        led[piece] += np.interp(place, middles, known) + beyond
    return led


def _without_hum(led: FloatArray, readings: FloatArray, block: int) -> FloatArray:
    """(samples,) the angle, smooth where the table stands: a gyro's own hum is no motion there.

    Beside a hum that is searched for lines it would make a product that stands still. So does a hum
    of a five hundredth of what the table turns: the angle is then smooth over a fiftieth of a
    second everywhere. What the readings show as well is the table's motion, and stays.
    """
    steps = np.abs(np.gradient(kinematics.averages_of(led, block)))
    # Below a hundredth of the rms rate the table stands.
    led = _smooth(led, readings, block, steps < 0.01 * math.sqrt(float(np.mean(steps**2))))
    block, humming = max(1, block // 5), []
    for piece in arrays.blocks(led.size - 1, multiple=block):
        turned = np.diff(led[piece.start : piece.stop + 1])
        turned = turned[: turned.size // block * block].reshape(-1, block)
        mean = turned.mean(axis=1) ** 2
        humming.append(np.mean(turned**2, axis=1) - mean > 0.002**2 * mean)
    hums = np.concatenate(humming)
    if not np.mean(hums) > 0.5:
        return led
    # The outer blocks stay: beyond the middle of the last mean there is none to go on to.
    inner = np.ones(hums.size, dtype=np.bool_)
    inner[[0, -1]] = False
    return _smooth(led, readings, block, inner)


def _smooth(led: FloatArray, readings: FloatArray, block: int, blocks: BooleanArray) -> FloatArray:
    """(samples,) the angle, changed in place: straight between its means, in some blocks.

    The angle stays as it is if, in most of these blocks, the readings show more than half of what
    this would take off: a servo that hunts moves the table, a hum does not.
    """
    coarse = kinematics.averages_of(led, block)
    middles = np.arange(coarse.size) * block + 0.5 * (block - 1)

    def straight() -> Iterator[tuple[IntegerArray, FloatArray]]:
        for piece in arrays.blocks(blocks.size if blocks.any() else 0):
            first = block * (piece.start + np.flatnonzero(blocks[piece]))
            place = first[:, np.newaxis] + np.arange(block)
            yield place, np.interp(place, middles, coarse)

    shown = count = 0
    for place, line in straight():
        off = led[place] - line
        beyond_half = np.sum(off * (readings[place] - line - 0.5 * off), axis=1) > 0.0
        shown, count = shown + int(np.count_nonzero(beyond_half)), count + beyond_half.size
    # By more than chance: two standard errors.
    if shown <= 0.5 * count + math.sqrt(count):
        for place, line in straight():
            led[place] = line
    return led


def _undelayed(encoder: FloatArray, delay: Delay, sample_rate: float) -> FloatArray:
    """(samples,) the encoder as it would have been read with the gyros.

    By a cubic through the four readings around: a straight line between two of them cuts the
    corners of a table that speeds up. Beyond its ends the table goes on at the rate that it has
    there: held, it would jump.
    """
    # The rate at an end of the record is taken over 0.1 s.
    beside = max(1, min(round(0.1 * sample_rate), encoder.size - 1))
    first_two, last_two = encoder[[0, beside]], encoder[[-1 - beside, -1]]
    rates = np.array([np.diff(first_two)[0], np.diff(last_two)[0]]) / beside
    reach = math.ceil((abs(delay.mean) + abs(delay.change)) * sample_rate) + 3
    result = arrays.empty(encoder.size)
    for block in arrays.blocks(encoder.size):
        first, last = max(0, block.start - reach), min(encoder.size, block.stop + reach)
        near = encoder[first:last]
        place = np.arange(block.start, block.stop, dtype=np.float64)
        place += sample_rate * delay.at(place / sample_rate) - first
        inside = np.clip(place, 0.0, near.size - 1.0)
        beyond = np.array([np.minimum(place - inside, 0.0), np.maximum(place - inside, 0.0)])
        place = inside
        before = np.clip(np.floor(place).astype(np.int64), 1, max(near.size - 3, 1))
        part = place - before
        weights = (
            -part * (part - 1.0) * (part - 2.0) / 6.0,
            (part + 1.0) * (part - 1.0) * (part - 2.0) / 2.0,
            -(part + 1.0) * part * (part - 2.0) / 2.0,
            (part + 1.0) * part * (part - 1.0) / 6.0,
        )
        result[block] = rates @ beyond
        for offset, weight in enumerate(weights, start=-1):
            result[block] += weight * near[before + offset]
    return result


# --- what the readings differ by --------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Fit:
    """Difference of readings and gyros, in averages.

    Attributes
    ----------
    read, sensed
        (averages,) rad.
    interval
        Between averages, s.
    fit
        Coefficients of the columns in the difference, and the two noises.
    """

    read: FloatArray
    sensed: FloatArray
    interval: float
    fit: Whitened

    @classmethod
    def of(cls, read: FloatArray, sensed: FloatArray, interval: float) -> "_Fit":
        """Scale, drift, orders, Earth rate, a delay and its change, beside noise."""
        columns, prior = columns_beside_delay(read, sensed, interval)
        # On a table that swings or moves in part of a turn no order is a line in time.
        faded = full_turns(sensed) >= FEW_TURNS
        # The rates at both ends are one-sided differences, which do not follow a ripple.
        fit = whitened((read - sensed)[1:-1], columns[:, 1:-1], prior, faded=faded)
        return cls(read=read, sensed=sensed, interval=interval, fit=fit)

    def corner(self, own: float) -> float:
        """Hz at which readings and gyros know the angle equally well, inf if readings always do.

        What walks and is not the gyros' `own` (rad^2 a step) is the encoder's.
        """
        # A corner has eight cycles in the record at least.
        lowest = max(_LOWEST_CORNER, 8.0 / (self.read.size * self.interval))
        own = min(own, self.fit.walk)
        more, readings = own - (self.fit.walk - own), 4.0 * self.fit.readings
        if self.fit.walk + readings == 0.0 or (more > 0.0 and more >= readings):
            return math.inf
        share = math.sqrt(more / readings) if more > 0.0 else 0.0
        return max(math.asin(share) / (math.pi * self.interval), lowest)

    def guide(self, corner: float) -> FloatArray:
        """(averages,) what leads the gyros to the readings: orders as fitted, the rest smoothed.

        Slow tones are left to the readings, too: in the angle those of a gyro would make products
        with every order, which crowd about the strong ones.
        """
        # The share's error goes with the motion, which no corner may smooth.
        plain = self.fit.values.copy()
        plain[1:_FIRST_ORDER] = plain[_FIRST_RIPPLE:] = 0.0
        columns = columns_beside_delay(self.read, self.sensed, self.interval)[0]
        fitted = plain @ columns
        # Of drift: where the rate changes it is large and bends, and would look like tones.
        drift = (self.fit.values - plain) @ columns
        del columns  # those of a day take 0.2 GB
        left = self.read - self.sensed - fitted
        # Where the table turns back, what repeats with it looks like tones.
        turns = abs(float(self.sensed[-1] - self.sensed[0])) / (2.0 * np.pi)
        if turns >= FEW_TURNS:
            # Slower ones pass the filter, and faster ones may be orders that are not fitted.
            cycles = (0.5 * corner * self.interval * left.size, (_ORDERS + 0.5) * turns)
            tones = slow_tones(left - drift, self.fit.readings, self.fit.walk, cycles)
            fitted, left = fitted + tones, left - tones
        return smoothed(left, corner * self.interval) + fitted

    def delay(self, known: Delay | None, free: BooleanArray) -> Delay | None:
        """The delay with what is known of it already; None if none is seen."""
        own = slice(FIRST_DELAY, None)
        error = np.sqrt(np.diag(self.fit.covariance)[own])
        # What the readings lead by is a negative delay.
        moved = np.where(free, -self.fit.values[own], 0.0)
        if known is None:
            seen = np.abs(moved) > np.maximum(SEEN * error, SHORTEST_DELAY)
            if not seen.any():
                return None
            moved = np.where(seen, moved, 0.0)
        mean, change = (0.0, 0.0) if known is None else (known.mean, known.change)
        return Delay(
            mean=mean + float(moved[0]),
            mean_error=float(error[0]),
            change=change + float(moved[1]),
            change_error=float(error[1]),
            duration=self.read.size * self.interval,
        )


def smoothed(values: FloatArray, corner: float) -> FloatArray:
    """Values behind a Butterworth low-pass of second order, there and back.

    Beyond both ends they go on point by point reflected: less the line from end to end, they are
    a sum of sines, each of which the filter multiplies by ``1 / (1 + (tan pi f / tan pi fc)^4)``.

    Parameters
    ----------
    values
        (samples,), three or more.
    corner
        fc, cycles a sample.
    """
    line = np.linspace(values[0], values[-1], values.size)
    frequency = np.arange(1, values.size - 1) / (2.0 * (values.size - 1))
    # A higher corner, in cycles a sample, would let everything through.
    ratio = np.tan(np.pi * frequency) / math.tan(math.pi * min(corner, 0.495))
    line[1:-1] += idst(dst((values - line)[1:-1], type=1) / (1.0 + ratio**4), type=1)
    return line


def slow_tones(
    values: FloatArray, readings: float, walk: float, between: tuple[float, float]
) -> FloatArray:
    """(samples,) the strongest tones in values beside noise of readings and a walk, rad.

    Each is the highest peak of the spectrum under a Hann window. After each one all that were found
    are fitted together, with amplitudes and phases that change evenly.

    Parameters
    ----------
    values
        (samples,) rad.
    readings, walk
        As `Whitened` has them, rad^2.
    between
        Lowest and highest number of cycles in the record.
    """
    count, columns = values.size, np.empty((0, values.size))
    values = left = values - np.linspace(values[0], values[-1], count)
    # Of fewer than four cycles they are drift.
    cycles = np.arange(max(4, math.ceil(between[0])), math.floor(min(between[1], 0.25 * count)))
    window = np.hanning(count)
    noise = readings + walk / (2.0 * np.sin(np.pi * cycles / count)) ** 2
    noise *= float(np.sum(window**2))
    part = (np.arange(count) + 0.5) / count - 0.5
    while cycles.size > 2 and columns.shape[0] < 4 * _MOST_TONES:
        size = np.abs(rfft(window * left)[: cycles[-1] + 2])
        peak = int(np.argmax(size[cycles] ** 2 / noise)) + cycles[0]
        if not size[peak] ** 2 > _TONE * noise[peak - cycles[0]]:
            break
        # The ratio of two neighbours under the window tells what lies between them.
        side = 1 if size[peak + 1] > size[peak - 1] else -1
        ratio = size[peak + side] / size[peak]
        wave = 2.0 * np.pi * (peak + side * (2.0 * ratio - 1.0) / (1.0 + ratio)) * part
        pair = np.stack([np.cos(wave), np.sin(wave)])
        columns = np.concatenate([columns, pair, pair * part])
        weighed = columns * window
        normal, right = weighed @ weighed.T, weighed @ (window * values)
        left = values - np.linalg.lstsq(normal, right)[0] @ columns
    return values - left


def columns_beside_delay(
    read: FloatArray, sensed: FloatArray, interval: float
) -> tuple[FloatArray, FloatArray]:
    """(columns, averages) and the standard deviation of the prior of each, inf for none.

    The angle itself, slow drift, orders, Earth rate; from `_FIRST_RIPPLE` on the orders of the
    ripple that the gyros sense; then from `FIRST_DELAY` on the delay: the rate, and the rate times
    the time.
    """
    time = np.arange(sensed.size) * interval
    part = np.asarray((time + 0.5 * interval) / (sensed.size * interval), dtype=np.float64)
    # Straight pieces that go up to 1 and down: drift of a gyro's bias looks like a delay that
    # walks, except where the rate varies.
    knots = np.arange(1.0, _PIECES)[:, np.newaxis]
    columns = np.empty((FIRST_DELAY + 2, sensed.size))
    columns[0] = sensed
    columns[1:_FIRST_ORDER] = np.maximum(1.0 - np.abs(part * _PIECES - knots), 0.0)
    # What goes with the angle goes with the encoder's: the gyros' drifts by degrees an hour.
    waves = kinematics.harmonics_of(read, _ORDERS)[1:]
    columns[_FIRST_ORDER : _FIRST_ORDER + _ORDERS] = waves.real
    columns[_FIRST_ORDER + _ORDERS : _FIRST_ORDER + 2 * _ORDERS] = waves.imag
    columns[_FIRST_RIPPLE - 2 : _FIRST_RIPPLE] = kinematics.sine_cosine_integrals(read, interval)
    # What a gyro shows at an order of the ripple would be taken for a delay, which moves the
    # ripple.
    columns[_FIRST_RIPPLE:FIRST_DELAY] = 0.0
    for place, order in enumerate(_orders_of_ripple(sensed), start=_FIRST_RIPPLE):
        columns[place], columns[place + _RIPPLES] = np.cos(order * read), np.sin(order * read)
    columns[FIRST_DELAY] = np.gradient(sensed, interval)
    columns[FIRST_DELAY + 1] = columns[FIRST_DELAY] * (part - 0.5)
    prior = np.full(columns.shape[0], math.inf)
    # Without a prior of the shares, the gyros' noise would explain itself at a table that turns
    # evenly.
    prior[0] = 0.01
    prior[_FIRST_ORDER:FIRST_DELAY] = 30.0 * ARCSECOND
    prior[_FIRST_RIPPLE - 2 : _FIRST_RIPPLE] = kinematics.LARGEST_EARTH_RATE
    prior[FIRST_DELAY:] = 1.0
    return columns, prior


_FIRST_ORDER: Final = _PIECES
_FIRST_RIPPLE: Final = _FIRST_ORDER + 2 * _ORDERS + 2
FIRST_DELAY: Final = _FIRST_RIPPLE + 2 * _RIPPLES


def _orders_of_ripple(angle: FloatArray) -> IntegerArray:
    """(`_RIPPLES`,) whole orders above `_ORDERS` at which the rate of averages varies most.

    By the Fourier coefficients of the rate over the angle, under a window in time. None over so few
    turns that orders are not told apart.
    """
    if full_turns(angle) < FEW_TURNS:
        return np.empty(0, dtype=np.int64)
    steps, turn = np.diff(angle), np.exp(-0.5j * (angle[1:] + angle[:-1]))
    # The rate is integrated over the angle, whose step is the rate itself.
    turned = np.hanning(steps.size) * steps**2 * turn**_ORDERS
    # Averages show orders up to about a third of their rate.
    shown = 0.35 * 2.0 * np.pi / max(float(np.abs(steps).mean()), 1e-12)
    highest = max(_ORDERS + _RIPPLES, min(_HIGHEST, math.floor(shown)))
    size = np.zeros(highest - _ORDERS)
    for place in range(size.size):
        turned *= turn
        size[place] = abs(turned.sum())
    return np.sort(np.argsort(size)[-_RIPPLES:]) + _ORDERS + 1
