"""The readout of a gyro: its step, what dithers it, steps that are coarse, its range, a counter."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.fft import rfft
from scipy.special import ndtr, ndtri

from sagnac.core.arrays import (
    BooleanArray,
    FloatArray,
    blocks,
    differences,
    elementwise,
    every,
    extent,
    square,
)
from sagnac.core.errors import Level, Note, counted
from sagnac.core.units import ARCSECOND, UNITS, split_factor
from sagnac.quality.effects import finding
from sagnac.quality.profile import Notes, Profile, count_step, rounding_in
from sagnac.recording.channel import (
    PAIR_SIZE,
    Channel,
    angle_of,
    by_blocks,
    first_of,
    marked,
    marked_steps,
    number_of,
    require_rate,
)
from sagnac.recording.model import Recording, second_of

# ---- readout -----------------------------------------------------------------------

# Steps of angle, in readout steps squared, at which the error of a readout is white noise: a
# quarter that the angle turns about its mean (the error's correlation is below 1 % from there on),
# and twice the error's own variance, 1/12. A steady rate alone makes at most a quarter.
_DITHERED: Final = 0.25 + 2.0 / 12.0
# Steps of angle over which a rate counts as steady: the variance of this many is about their mean.
_STEADY: Final = 8
# Steps of angle fewer than these have no variance to speak of.
_LEAST_STEPS: Final = 32
# Share of the stretches of `_STEADY` steps that count, those of least variance: the others hold the
# reversals of a table, which dither nothing between them.
_COUNT: Final = 0.99
# Angles that a readout step has to leave for a fit. If there are fewer, five terms are not told
# apart: even with white readout noise nine intervals in ten hold N, and what is estimated lies
# half an error high.
LEAST_DITHERED: Final = 320
# A table that covers less than this, rad, stands still.
_TURNS: Final = math.radians(1.0)
# Variance of the error of an encoder's steps, of the variance of what a gyro turns from one angle
# to the next, below which it moves N by less than 2 % however slow it is.
_MATTERS: Final = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class Readout:
    """The step of a readout, and from where on its error is white noise of the angle.

    Attributes
    ----------
    step
        rad. For an angle that is dithered from sample to sample, the smallest change there is.
    every
        The error is white if one in `every` samples is taken, a power of two: 1 if the angle is
        dithered as it is. None if too few samples are left before that.
    """

    step: float
    every: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class JointReadout:
    """Clusters that the readouts of several gyros together allow.

    Attributes
    ----------
    step
        Sum of their steps, rad; per gyro of a difference.
    every
        The readouts are dithered if one in `every` angles is taken. None if too few angles are
        left for a fit.
    time
        Time between angles so taken, s; 0 if all are, infinite if they are dithered at no time.
    notes
        What a reader of the figures has to know of it.
    """

    step: float = 0.0
    every: int | None = 1
    time: float = 0.0
    notes: tuple[Note, ...] = ()


def readout_of(angle: ArrayLike) -> Readout:
    """Whether what an angle does dithers the steps it is read out in.

    A walk over a readout step Delta leaves an error e that is uniform, of variance Delta^2/12,
    and uncorrelated with every increment of the walk (from any place within a step the average
    over places is zero). Its autocovariance over a time in which the angle strays by
    sigma about a steady turn is ``sum_m Delta^2/(2 pi^2 m^2) exp(-2 pi^2 m^2 sigma^2/Delta^2)``
    times a cosine of the turn (Widrow and Kollár, Quantization Noise, 2008, characteristic
    functions). The error is therefore white noise, as quantization is taken to be, only if angles
    are taken far enough apart for sigma to be half a step or more. If they are taken closer, it is
    a slow error of many samples, which a fit would call angle random walk.

    Parameters
    ----------
    angle
        (samples,) as read out, before anything is taken off.

    Returns
    -------
    Readout
        If the angle never leaves one steady turn, the step is 0 and `every` is 1.
    """
    taken, apart = np.asarray(angle, dtype=np.float64), 1
    step = count_step(differences(taken), rounding_in(taken))
    if not math.isfinite(step):
        return Readout(step=0.0, every=1)
    while taken.size > _LEAST_STEPS:
        if _variance_of_steps(taken) >= _DITHERED * step**2:
            return Readout(step=step, every=apart)
        taken, apart = every(taken, 2), 2 * apart
    return Readout(step=step, every=None)


def joint_readout(
    recording: Recording, gyros: Sequence[str], angle_rate: float, *, with_encoder: bool = True
) -> JointReadout:
    """Clusters that the readouts of gyros allow, differenced or used side by side.

    For one gyro alone on a turning table the steps of its encoder count as well, times the share
    of the table rate that it senses, unless they are small beside its noise.

    Parameters
    ----------
    recording
        That holds the gyros.
    gyros
        Names of those that are used.
    angle_rate
        Angles per second that are used: the sample rate, or a whole part of it.
    with_encoder
        Whether the steps of the encoder count.

    Raises
    ------
    RecordingError
        If one of the gyros is not there.
    ValueError
        If the rate makes no sense.
    """
    require_rate(angle_rate)
    taken = round(recording.sample_rate / angle_rate)
    readouts = {}
    for name in gyros:
        angle = angle_of(recording.gyro(name), recording.sample_rate)
        readouts[name] = readout_of(angle if taken == 1 else every(angle, taken))
    encoder = _encoder_readout(recording, gyros, taken) if with_encoder else None
    if encoder is not None:
        readouts[f"the encoder, as {gyros[0]} senses the table"] = encoder
    step = sum(readout.step for readout in readouts.values())
    if len(gyros) > 1:
        step /= PAIR_SIZE
    undithered = {name: readout for name, readout in readouts.items() if readout.every != 1}
    if not undithered:
        return JointReadout(step=step)
    largest = max(readout.step for readout in undithered.values()) / ARCSECOND
    what = f"the readout step of {', '.join(undithered)} ({largest:.3g} arcsec)"
    counts = [readout.every for readout in undithered.values() if readout.every is not None]
    apart = max(counts) / angle_rate if len(counts) == len(undithered) else math.inf
    if not recording.duration / apart >= LEAST_DITHERED:
        text = (
            f"{recording.duration:.4g} s dither {what} too few times for a fit to tell angle "
            "random walk from it, and no fit is an estimate of it; record longer, or read out "
            "finer"
        )
        note = Note(text=text, level="warning")
        return JointReadout(step=step, every=None, time=apart, notes=(note,))
    text = (
        f"nothing dithers {what} in less than {apart:.4g} s: coefficients are of angles that far "
        "apart, and the curve at shorter cluster times shows the readout"
    )
    return JointReadout(step=step, every=max(counts), time=apart, notes=(Note(text=text),))


def _encoder_readout(recording: Recording, gyros: Sequence[str], taken: int) -> Readout | None:
    """The steps of an encoder as one gyro senses them; None if they do not matter.

    What is taken off a gyro as table motion is its share of the encoder's reading, the error of
    its steps included. A difference of two gyros holds next to nothing of it.
    """
    if len(gyros) > 1 or recording.table is None:
        return None
    lowest, highest = extent(recording.table.values)
    if highest - lowest < _TURNS:
        return None
    gyro = angle_of(recording.gyro(gyros[0]), recording.sample_rate)
    table = recording.table.values
    if taken > 1:
        gyro, table = every(gyro, taken), every(table, taken)
    readout = readout_of(table)
    # Share of the table's steps that the gyro senses, by least squares.
    turned, sensed = differences(table), differences(gyro)
    own = square(turned)
    share = float(by_blocks(np.dot, sensed, turned).sum()) / own if own > 0.0 else 0.0
    # The gyro's steps beside table motion, and their variance if they are white.
    beside = elementwise(lambda one, other: one - share * other, sensed, turned, out=sensed)
    changes = differences(beside)
    step = abs(share) * readout.step
    if not step**2 / 12.0 > _MATTERS * 0.5 * square(changes) / changes.size:
        return None
    return Readout(step=step, every=readout.every)


def _variance_of_steps(values: FloatArray) -> float:
    """Mean variance of `_STEADY` steps in a row, the largest hundredth of them left out."""
    count = (values.size - 1) // _STEADY
    found, mean = np.empty(count), np.full(_STEADY, 1.0 / _STEADY)
    for block in blocks(count * _STEADY, multiple=_STEADY):
        steps = np.diff(values[block.start : block.stop + 1])
        # What all of them share is no variance, and would leave it to rounding.
        steps -= steps.mean()
        rows = steps.reshape(-1, _STEADY)
        # As numpy's var, which takes three times as long over so few.
        off = rows - (rows @ mean)[:, np.newaxis]
        squares = np.einsum("ij,ij->i", off, off) / (_STEADY - 1)
        found[block.start // _STEADY : block.stop // _STEADY] = squares
    kept = max(1, math.ceil(_COUNT * count))
    if kept < count:
        found.partition(kept - 1)
    return float(found[:kept].mean())


# ---- resolution --------------------------------------------------------------------

# Steps of single precision, in scatters of the noise, that are said and that spoil an answer.
_SEEN: Final = 0.1
_SPOILS: Final = 0.5
# Half the mean square of what a rate changes by from sample to sample, in steps squared, from which
# on the error of its steps is white: its correlation is below 1 % (Widrow and Kollár, Quantization
# Noise, 2008), and the error's own variance, 1/12, is in it.
_WHITE: Final = 0.125 + 1.0 / 12.0
# Change of N that is worth a word.
_WORTH: Final = 0.02
# N is looked for in octaves: the highest ends at this part of the sample rate, the lowest at no
# fewer frequencies than these. No more samples than these are looked at.
_HIGHEST: Final = 0.05
_LEAST_FREQUENCIES: Final = 16
_MOST: Final = 2**17
# Samples that tell whether all values are of single precision.
_LOOKED_AT: Final = 4096
# Part of a value that its conversion to SI and back may move it by.
_ROUNDING: Final = 1e-15
# Changes of counted samples lie this near to whole steps, in steps, and this share of them does.
_NEAR: Final = 0.05
_COUNTED: Final = 0.98


def step_shown(channel: Channel) -> float:
    """The step that the samples of a channel are counted in, as its beginning shows it.

    In SI, of the samples themselves: of the rate of a rate. 0 if their changes are no whole
    numbers of one step, as if the step is far finer than their noise or there is none.
    """
    values = channel.values[:_MOST]
    values = values[np.isfinite(values)]
    counted = np.diff(values) if channel.kind == "angle" else values
    # Second differences of an angle hold little of the turn of a table, many steps a sample.
    changes = np.diff(counted)
    step = count_step(counted, rounding_in(values)) if values.size else math.inf
    if not math.isfinite(step) or step <= 2.0 * single_precision_step(channel):
        return 0.0
    numbers = np.rint(changes / step)
    if numbers.any():
        # Many steps are known better than one.
        step = float(changes @ numbers) / float(numbers @ numbers)
    off = np.abs(changes / step - np.rint(changes / step))
    return step if float(np.mean(off < _NEAR)) > _COUNTED else 0.0


def resolution_notes(recording: Recording, profile: Profile) -> Notes:
    """Single precision, or coarse counts, if the noise does not cover its steps."""
    gyro = profile.channel
    step = single_precision_step(gyro)
    # The step follows the size of an angle; where that is largest the noise is compared with it.
    scatter = math.sqrt(2.0) * profile.scale
    if step > _SEEN * scatter:
        text = (
            "is stored in single precision (float32): its steps grow to "
            f"{_shown(gyro, step)}, beside a scatter of {_shown(gyro, scatter)} from sample to "
            "sample; store it in double precision"
        )
        level: Level = "error" if step > _SPOILS * scatter else "warning"
        return (finding("resolution", gyro.name, text, effect=None, level=level),)
    # Counts of an angle lose nothing from one sample to the next; those of a rate do.
    return _coarse(recording, profile) if gyro.kind == "rate" else ()


def single_precision_step(gyro: Channel) -> float:
    """Largest step of a channel of which all values are of single precision; else 0.

    In the unit of its values. They count as such in the unit that they came in, or in that unit
    without the number before it.
    """
    values = gyro.values
    some = every(values, max(1, values.size // _LOOKED_AT))
    factor, name = split_factor(gyro.shown_in)
    for size in {UNITS[name].size, factor * UNITS[name].size}:
        stored = some / size
        rounded = stored.astype(np.float32).astype(np.float64)
        whole = rounded == np.rint(rounded)
        alike = np.abs(stored - rounded) <= _ROUNDING * np.abs(rounded)
        # Whole numbers below 2^24 are the same in both precisions and tell nothing.
        tells = ~whole | (np.abs(rounded) > 2.0**24)
        if alike.all() and tells.any():
            largest = max(map(abs, extent(values)))
            return size * float(np.spacing(np.float32(largest / size)))
    return 0.0


def _coarse(recording: Recording, profile: Profile) -> Notes:
    """Counts of a rate whose error is a part of its angle random walk."""
    gyro, step = profile.channel, profile.step
    variance = float(np.median(profile.power))
    if not math.isfinite(step):
        return ()
    effect = None
    if variance > _WHITE * step**2:
        # The error of white steps is spread evenly to half the sample rate. A sensor's own low-pass
        # leaves less noise, but no less of it where N is read. If less is read there than the steps
        # of a rate would make, an angle was counted, whose steps do not add up.
        read = _quiet_density(profile.changes, recording.sample_rate)
        added = step * step / 6.0 / recording.sample_rate
        effect = math.sqrt(read / (read - added)) if read > added else 1.0
        if effect < 1.0 + _WORTH:
            return ()
    text = (
        f"is read out in steps of {_shown(gyro, step)}, beside a scatter of "
        f"{_shown(gyro, math.sqrt(variance))}: what is read is in part the steps"
    )
    return (finding("resolution", gyro.name, text, effect=effect),)


def _quiet_density(rates: FloatArray, sample_rate: float) -> float:
    """One-sided density of a rate where its angle random walk is: the median over octaves.

    Lines and slow noise rule few of them.
    """
    some = rates[:_MOST]
    taper = np.hanning(some.size)
    transform = rfft((some - some.mean()) * taper)
    power = (transform.real**2 + transform.imag**2) * 2.0 / sample_rate / float(taper @ taper)
    highest = max(int(_HIGHEST * some.size), _LEAST_FREQUENCIES)
    levels = []
    while highest >= _LEAST_FREQUENCIES:
        levels.append(float(np.median(power[highest // 2 : highest])) / math.log(2.0))
        highest //= 2
    return float(np.median(levels))


def _shown(gyro: Channel, value: float) -> str:
    unit = gyro.plain_unit
    return f"{value / unit.size:.3g} {unit.name}"


# ---- saturation --------------------------------------------------------------------

# A limit is taken this often at least, and this many times as often as the next value inwards.
# Noise takes an extreme value less often than the next one.
_LEAST_OFTEN: Final = 10
_OFTENER: Final = 3
# Few levels say nothing: a quiet gyro may count only 0 and 1.
_FEW_LEVELS: Final = 8
# Values this near, in steps of the readout, are one count: a file's own rounding parts them.
_ONE_COUNT: Final = 0.25
# A clipped value has others right beside it; one that lies this many standard deviations beyond
# the next is no limit of the range.
_APART: Final = 0.5


def saturation_notes(recording: Recording, profile: Profile) -> Notes:
    """An extreme value taken far more often than the next one inwards.

    Looked for in what each sample turned, so that an angle made of clipped increments counts.
    """
    changes = profile.changes
    levels = np.unique(every(changes, max(1, changes.size // 10_000)))
    if levels.size <= _FEW_LEVELS:
        return ()
    slack = max(profile.rounding, _ONE_COUNT * profile.step)

    def at(level: float) -> BooleanArray:
        return marked(lambda some: np.abs(some - level) <= slack, changes)

    shares, where = {}, []
    for side, limit in zip(("lower", "upper"), profile.ends, strict=True):
        at_limit = at(limit)
        number = number_of(at_limit)
        if number < _LEAST_OFTEN:
            continue
        inner = next_inwards(changes, at_limit, side)
        is_pile = number > _OFTENER * number_of(at(inner))
        if is_pile and abs(limit - inner) <= _APART * profile.scale:
            shares[side] = number / changes.size
            where.append(
                f"{number} samples are at its {side} limit, the first at "
                f"{second_of(recording, first_of(at_limit)):.3f} s"
            )
    if not where:
        return ()
    effect = clipped_scatter(shares.get("lower", 0.0), shares.get("upper", 0.0))
    # The upper limit comes first.
    text = f"is saturated: {' and '.join(where[::-1])}; take a stretch without with {{slice}}"
    return (finding("clipping", profile.name, text, effect=effect),)


def next_inwards(values: FloatArray, at_limit: BooleanArray, side: str) -> float:
    """The value next to an extreme one; infinite, away from it, if there is none."""
    if side == "upper":
        return float(values.max(where=~at_limit, initial=-math.inf))
    return float(values.min(where=~at_limit, initial=math.inf))


def clipped_scatter(below: float, above: float) -> float:
    """Standard deviation of a clipped normal number, of one that is not clipped: 1 if none is.

    Parameters
    ----------
    below, above
        Shares of the numbers at the lower and at the upper limit.

    Examples
    --------
    A limit at one standard deviation on either side:

    >>> round(clipped_scatter(0.1587, 0.1587), 3)
    0.718
    """
    low, high = float(ndtri(below)), float(ndtri(1.0 - above))
    at_low, at_high = _density(low), _density(high)
    inside = float(ndtr(high) - ndtr(low))
    ends = [(low, below), (high, above)]
    mean = at_low - at_high + sum(end * share for end, share in ends if share)
    edges = (low * at_low if at_low else 0.0) - (high * at_high if at_high else 0.0)
    square = inside + edges + sum(end * end * share for end, share in ends if share)
    return math.sqrt(max(square - mean * mean, 0.0))


def _density(place: float) -> float:
    return math.exp(-0.5 * place * place) / math.sqrt(2.0 * math.pi)


# ---- counts that start over ----------------------------------------------------------

_BINS: Final = 64
# Share of the range that is empty between the values near its two ends.
_EMPTY: Final = 0.5
# Delays, in samples, at which the ends must differ as often as chance makes them, and how nearly:
# neither a line nor a motion does that.
_DELAYS: Final = (1, 2, 3)
_BY_CHANCE: Final = 0.1
# Share of the samples at either end below which a spike makes it as well.
_LEAST_END: Final = 0.01
# Widths of counters, and how near to one the range has to lie.
_BITS: Final = (8, 12, 16, 18, 20, 24, 32)
_NEAR_BITS: Final = 0.02
# An angle falls by this part of all that it covers, which is this many usual steps or more; it
# covers half of that between two falls, and falls are rare.
_FALL: Final = 0.8
_FALL_STEPS: Final = 50.0
_COVERS: Final = 0.5
_MOST_FALLS: Final = 0.1
_STEPS_LOOKED_AT: Final = 20_000


def wrap_notes(recording: Recording, profile: Profile) -> Notes:
    """A counter that starts over, which reading saw already or the samples show: an error."""
    seen = tuple(
        replace(note, level="error")
        for note in recording.notes
        if note.name == "wraps" and note.channel == profile.name
    )
    if seen:
        return seen
    if profile.channel.kind == "angle":
        return _falls_of_an_angle(recording, profile)
    return _ends_of_a_range(profile)


def _falls_of_an_angle(recording: Recording, profile: Profile) -> Notes:
    """Steps of an angle, all against its motion, by nearly all that it ever covers."""
    values, found = profile.channel.values, profile.survey
    covered, usual = found.highest - found.lowest, profile.changes[:_STEPS_LOOKED_AT]
    if max(found.rise, -found.fall) <= _FALL * covered:
        return ()
    if covered <= _FALL_STEPS * float(np.median(np.abs(usual))):
        return ()
    falls = marked_steps(values, lambda steps: np.abs(steps) > _FALL * covered)
    number = number_of(falls)
    if not 0 < number <= _MOST_FALLS * values.size:
        return ()
    at = np.flatnonzero(falls)
    steps = values[at] - values[at - 1]
    motion = float(values[-1] - values[0] - steps.sum())
    if not (np.all(steps * motion < 0.0) and abs(motion) > _COVERS * number * covered):
        return ()
    text = (
        f"{counted(number, 'fall')} by all of the angle that it covers, the first at "
        f"{second_of(recording, int(at[0])):.3f} s, as of a counter that starts over; state "
        "the width of the counter with {counter-bits}, or make the angle continuous"
    )
    return (finding("wraps", profile.name, text, effect=None),)


def _ends_of_a_range(profile: Profile) -> Notes:
    """Values at the two ends of a range, and an empty half or more between them."""
    values, lowest, highest = profile.channel.values, *profile.ends
    if not highest > lowest:
        return ()
    edges = np.linspace(lowest, highest, _BINS + 1)
    counts = by_blocks(lambda some: np.histogram(some, edges)[0], values).sum(axis=0)
    filled = np.flatnonzero(counts)
    gaps = np.diff(filled) - 1
    if gaps.max(initial=0) < _EMPTY * _BINS:
        return ()
    at = first_of(gaps)
    middle = 0.5 * float(edges[filled[at] + 1] + edges[filled[at + 1]])
    # Width of a counter whose range the values fill, in counts of the unit they came in.
    factor, name = split_factor(profile.channel.shown_in)
    range_in_counts = (highest - lowest) / (factor * UNITS[name].size)
    near = [bits for bits in _BITS if abs(range_in_counts / 2.0**bits - 1.0) < _NEAR_BITS]
    if not near and (_is_one_value(values, middle) or not _is_by_chance(values, middle)):
        return ()
    width = f"a counter of {near[0]} bits has" if near else "a counter has"
    text = (
        f"takes values at the two ends of its range and none between, as {width} if signed counts "
        "are read as unsigned; read them as signed, or state the width with {counter-bits}"
    )
    effect = _scatter_of_halves(values, middle)
    return (finding("wraps", profile.name, text, effect=effect, level="error"),)


def _is_one_value(values: FloatArray, middle: float) -> bool:
    """Whether all samples at one end are equal, as those are that a logger wrote for lost ones."""
    return any(
        values.min(where=end, initial=math.inf) == values.max(where=end, initial=-math.inf)
        for end in (values < middle, values > middle)
    )


def _is_by_chance(values: FloatArray, middle: float) -> bool:
    """Whether samples lie at either end independently of those before."""
    high = marked(lambda some: some > middle, values)
    size = values.size - max(_DELAYS)
    above = number_of(high[:size]) / size
    if not _LEAST_END < above < 1.0 - _LEAST_END:
        return False
    expected = 2.0 * above * (1.0 - above)
    differ = [number_of(high[:size] != high[delay : delay + size]) / size for delay in _DELAYS]
    return all(abs(share - expected) < _BY_CHANCE * expected for share in differ)


def _scatter_of_halves(values: FloatArray, middle: float) -> float | None:
    """Scatter of all values over that with the upper end brought down beside the lower."""

    def sums(some: FloatArray) -> list[float]:
        low, high = some[some <= middle], some[some > middle]
        return [low.size, low.sum(), low @ low, high.size, high.sum(), high @ high]

    n, s, q, m, t, r = by_blocks(sums, values).sum(axis=0)
    inside = (q - s * s / n + r - t * t / m) / (n + m)
    whole = (q + r) / (n + m) - ((s + t) / (n + m)) ** 2
    # Two halves of one bell: together they are about 1/(1 - 2/pi) as scattered as each.
    together = inside / (1.0 - 2.0 / math.pi)
    return math.sqrt(whole / together) if together > 0.0 else None
