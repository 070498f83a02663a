"""The readout of a gyro: its step, what dithers it, steps that are coarse, its range, a counter."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.fft import rfft
from scipy.special import ndtr, ndtri

from sagnac.core import arrays
from sagnac.core.arrays import FloatArray
from sagnac.core.errors import Level, Note
from sagnac.core.marks import first_of, marked, marked_steps, number_of, stretches
from sagnac.core.units import ARCSECOND, UNITS, split_factor
from sagnac.quality.effects import STRETCH, finding, seen
from sagnac.quality.lattice import LEAST_OFTEN, OFTENER, count_step, rounding_in
from sagnac.quality.profile import Notes, Profile, turned
from sagnac.quality.whitening import alternating, without_lines
from sagnac.recording.channel import PAIR_SIZE, Channel, angle_of, require_rate
from sagnac.recording.model import Recording, second_of

# ---- readout -----------------------------------------------------------------------

# Steps of angle over which a rate counts as steady: the variance of this many is about their mean.
_STEADY: Final = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Readout:
    """The step of a readout, or of several together, and from where on its error is white noise.

    Attributes
    ----------
    step
        rad. If the noise crosses several steps from sample to sample, the smallest change there is.
        Of several readouts the sum of their steps; per gyro of a difference.
    every
        The error is white if one in `every` angles is taken, a power of two: 1 if the angle is
        dithered as it is. None if too few angles are left before that, or for a fit.
    time
        Time between angles so taken, s; 0 if all are, infinite if they are dithered at no time.
    notes
        What a reader of the figures has to know of it.
    """

    step: float = 0.0
    every: int | None = 1
    time: float = 0.0
    notes: tuple[Note, ...] = ()


def readout_of(angle: FloatArray) -> Readout:
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
    taken, apart = angle, 1
    step = count_step(arrays.differences(taken), rounding_in(taken))
    if not math.isfinite(step):
        return Readout()
    # Fewer steps have no variance to speak of.
    while taken.size > 32:
        # The error is white from a quarter that the angle turns about its mean (its correlation is
        # below 1 % from there on) and twice its own variance, 1/12. A steady rate alone makes at
        # most 2/7.
        if _variance_of_steps(taken) >= (0.25 + 2.0 / 12.0) * step**2:
            return Readout(step=step, every=apart)
        taken, apart = arrays.every(taken, 2), 2 * apart
    return Readout(step=step, every=None)


def joint_readout(
    recording: Recording, gyros: Sequence[str], angle_rate: float, *, with_encoder: bool = True
) -> Readout:
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
        readouts[name] = readout_of(angle if taken == 1 else arrays.every(angle, taken))
    encoder = _encoder_readout(recording, gyros, taken) if with_encoder else None
    if encoder is not None:
        readouts[f"the encoder, as {gyros[0]} senses the table"] = encoder
    step = sum(readout.step for readout in readouts.values())
    if len(gyros) > 1:
        step /= PAIR_SIZE
    undithered = {name: readout for name, readout in readouts.items() if readout.every != 1}
    if not undithered:
        return Readout(step=step)
    largest = max(readout.step for readout in undithered.values()) / ARCSECOND
    what = f"the readout step of {', '.join(undithered)} ({largest:.3g} arcsec)"
    counts = [readout.every for readout in undithered.values() if readout.every is not None]
    apart = max(counts) / angle_rate if len(counts) == len(undithered) else math.inf
    # If the step leaves fewer angles, five terms are not told apart: even with white readout noise
    # nine intervals in ten hold N, and what is estimated lies half an error high.
    if not recording.duration / apart >= 320:
        problem = f"{recording.duration:.4g} s dither {what} too few times"
        why = "for a fit to tell angle random walk from it, and no fit is an estimate of it"
        text = f"{problem} {why}; record longer, or read out finer"
        return Readout(step=step, every=None, time=apart, notes=(Note(text=text, level="warning"),))
    problem = f"nothing dithers {what} in less than {apart:.4g} s"
    why = "coefficients are of angles that far apart"
    text = f"{problem}: {why}, and the curve at shorter cluster times shows the readout"
    return Readout(step=step, every=max(counts), time=apart, notes=(Note(text=text),))


def _encoder_readout(recording: Recording, gyros: Sequence[str], taken: int) -> Readout | None:
    """The steps of an encoder as one gyro senses them; None if they do not matter.

    What is taken off a gyro as table motion is its share of the encoder's reading, the error of
    its steps included. A difference of two gyros holds next to nothing of it.
    """
    if len(gyros) > 1 or recording.table is None or not turned(recording.table):
        return None
    gyro = angle_of(recording.gyro(gyros[0]), recording.sample_rate)
    table = recording.table.values
    if taken > 1:
        gyro, table = arrays.every(gyro, taken), arrays.every(table, taken)
    readout = readout_of(table)
    if readout.step == 0.0:
        # A table that turns by whole steps from angle to angle dithers none: samples show the step.
        readout = replace(readout_of(recording.table.values), every=None)
    # While a table rests, the error of a step stays as it is, whatever the time between angles. One
    # rest before a start and one after a stop do no harm; three of three seconds do.
    moves = np.flatnonzero(np.abs(arrays.differences(table)) > 0.5 * readout.step)
    if number_of(np.diff(moves) * taken > 3.0 * recording.sample_rate) >= 3:
        readout = replace(readout, every=None)
    # Share of the table's steps that the gyro senses, by least squares.
    steps, sensed = arrays.differences(table), arrays.differences(gyro)
    own = arrays.square(steps)
    share = float(arrays.by_blocks(np.dot, sensed, steps).sum()) / own if own > 0.0 else 0.0
    # The gyro's steps beside table motion, and their variance if they are white.
    beside = arrays.elementwise(lambda one, other: one - share * other, sensed, steps, out=sensed)
    changes = arrays.differences(beside)
    step = abs(share) * readout.step
    # Below a fiftieth of that variance it moves N by less than 2 % however slow it is.
    if not step**2 / 12.0 > 0.02 * 0.5 * arrays.square(changes) / changes.size:
        return None
    return Readout(step=step, every=readout.every)


def _variance_of_steps(values: FloatArray) -> float:
    """Mean variance of `_STEADY` steps in a row, the largest hundredth of them left out."""
    count = (values.size - 1) // _STEADY
    variances, mean = np.empty(count), np.full(_STEADY, 1.0 / _STEADY)
    for block in arrays.blocks(count * _STEADY, multiple=_STEADY):
        steps = np.diff(values[block.start : block.stop + 1])
        # What all of them share is no variance, and would leave it to rounding.
        steps -= steps.mean()
        rows = steps.reshape(-1, _STEADY)
        # As numpy's var, which takes three times as long over so few.
        off = rows - (rows @ mean)[:, np.newaxis]
        squares = np.einsum("ij,ij->i", off, off) / (_STEADY - 1)
        variances[block.start // _STEADY : block.stop // _STEADY] = squares
    # The others hold the reversals of a table, which dither nothing between them.
    kept = max(1, math.ceil(0.99 * count))
    if kept < count:
        variances.partition(kept - 1)
    return float(variances[:kept].mean())


# ---- resolution --------------------------------------------------------------------

# No more samples than these are looked at.
_MOST: Final = 2**17


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
    return step if float(np.mean(off < 0.05)) > 0.98 else 0.0


def resolution_notes(recording: Recording, profile: Profile) -> Notes:
    """Single precision, or coarse counts, if the noise does not cover its steps."""
    gyro = profile.channel
    step = single_precision_step(gyro)
    # The step follows the size of an angle; where that is largest the noise is compared with it.
    scatter = math.sqrt(2.0) * profile.scale
    if step > 0.1 * scatter:
        shown = f"{_shown(gyro, step)}, beside a scatter of {_shown(gyro, scatter)}"
        problem = f"is stored in single precision (float32): its steps grow to {shown}"
        text = f"{problem} from sample to sample; store it in double precision"
        single: Level = "error" if step > 0.5 * scatter else "warning"
        return (finding("resolution", gyro.name, text, effect=None, level=single),)
    # Counts of an angle lose nothing from one sample to the next; those of a rate do.
    return _coarse(recording, profile) if gyro.kind == "rate" else ()


def single_precision_step(gyro: Channel) -> float:
    """Largest step of a channel of which all values are of single precision; else 0.

    In the unit of its values. They count as such in the unit that they came in, or in that unit
    without the number before it.
    """
    values = gyro.values
    some = arrays.every(values, arrays.distance_between(4096, values.size))
    factor, name = split_factor(gyro.shown_in)
    for size in {UNITS[name].size, factor * UNITS[name].size}:
        stored = some / size
        rounded = stored.astype(np.float32).astype(np.float64)
        whole = rounded == np.rint(rounded)
        # Conversion to SI and back may move a value by this part of it.
        alike = np.abs(stored - rounded) <= 1e-15 * np.abs(rounded)
        # Whole numbers below 2^24 are the same in both precisions and tell nothing.
        tells = ~whole | (np.abs(rounded) > 2.0**24)
        if alike.all() and tells.any():
            largest = max(map(abs, arrays.extent(values)))
            return size * float(np.spacing(np.float32(largest / size)))
    return 0.0


def _coarse(recording: Recording, profile: Profile) -> Notes:
    """Counts of a rate whose error is a part of its angle random walk."""
    gyro, step = profile.channel, profile.step
    variance = float(np.median(profile.power))
    if not math.isfinite(step):
        return ()
    effect: float | None = None
    level: Level | None = None
    read, upper, high = _quiet_density(profile.changes, recording.sample_rate)
    # White steps of a rate add as much at every frequency. A sensor's own low-pass leaves less
    # noise, but no less of it where N is read.
    added = step * step / 6.0 / recording.sample_rate
    # From an eighth on the error of steps is white: its correlation is below 1 % (Widrow and
    # Kollár, Quantization Noise, 2008), and its own variance, 1/12, is in it.
    is_dithered = variance > (0.125 + 1.0 / 12.0) * step**2
    # A low-pass makes noise that is alike from sample to sample and dithers them; it is level where
    # N is read, as slow noise that hides N is not. Steps that take two values move N by over 5 %.
    if not is_dithered and upper > 0.25 * read:
        slow = added * _slowness(profile.changes[:_MOST], step)
        if is_dithered := slow < (1.0 - 1.05**-2) * read:
            added = slow
    if is_dithered:
        effect = math.sqrt(read / (read - added)) if read > added else 1.0
        # Fine steps are usual. They are small beside the noise, so that more samples are needed to
        # tell those of a rate from those of a counter.
        is_fine = effect < 1.02
        changes = profile.changes[: 8 * _MOST if is_fine else _MOST]
        if effect < 1.003 or not _counts_a_rate(changes, step, surely=is_fine):
            return ()
        level = "remark" if is_fine else None
    elif read < min(added, 0.5 * high):
        # Slow steps of an angle: little of them is left where N is read, and more above.
        return ()
    steps, scatter = (_shown(gyro, each) for each in (step, math.sqrt(variance)))
    problem = f"is read out in steps of {steps}, beside a scatter of {scatter}"
    text = f"{problem}: what is read is in part the steps"
    return (finding("resolution", gyro.name, text, effect=effect, level=level),)


def _slowness(rates: FloatArray, step: float) -> float:
    """Largest ratio of the density that errors of steps add where N is read to that of white ones.

    If rates differ by sigma rms after some samples, the errors are still correlated by
    ``exp(-2 pi^2 sigma^2/step^2)`` at the most (see `readout_of`). The ratio is infinite if a
    correlation of 1 % is left after 19 samples, since N may be read at such a period.
    """
    lags = range(1, min(20, rates.size - 1))
    # A sixth of a squared step of that variance may be the two errors themselves.
    strayed = np.array([np.var(rates[lag:] - rates[:-lag]) for lag in lags]) / step**2 - 1.0 / 6.0
    alike = np.exp(-2.0 * math.pi**2 * np.maximum(strayed, 0.0))
    return 1.0 + 2.0 * float(alike.sum()) if alike[-1] < 0.01 else math.inf


def _counts_a_rate(changes: FloatArray, step: float, *, surely: bool) -> bool:
    """Whether rates (samples,) are counted themselves, and are not what a counter of the angle did.

    Each error of a counter's step, of variance step^2/12, is in two neighbouring samples with
    opposite signs, so that the errors do not add up. `surely` asks for a variance that would show
    at two and a half standard errors, and less than half of it seen.
    """
    # Fewer samples do not show it.
    if changes.size < 2**12:
        return not surely
    error, doubt = alternating(without_lines(changes))
    expected = step**2 / 12.0
    if surely:
        return doubt < 0.4 * expected and error < 0.5 * expected
    return not max(3.0 * doubt, 0.5 * expected) < error < 1.5 * expected


def _quiet_density(rates: FloatArray, sample_rate: float) -> tuple[float, float, float]:
    """One-sided densities of a rate: where N is read, at the upper end of that, in the top octave.

    The first is the median over octaves, of which lines and slow noise rule few.
    """
    some = rates[:_MOST]
    taper = np.hanning(some.size)
    transform = rfft((some - some.mean()) * taper)
    power = (transform.real**2 + transform.imag**2) * 2.0 / sample_rate / float(taper @ taper)
    # The highest octave ends at a twentieth of the sample rate, the lowest at 16 frequencies.
    highest, levels = max(int(0.05 * some.size), 16), []
    while highest >= 16:
        levels.append(float(np.median(power[highest // 2 : highest])) / math.log(2.0))
        highest //= 2
    top = float(np.median(power[power.size // 2 :])) / math.log(2.0)
    return float(np.median(levels)), levels[0], top


def _shown(gyro: Channel, value: float) -> str:
    unit = gyro.plain_unit
    return f"{value / unit.size:.3g} {unit.name}"


# ---- saturation --------------------------------------------------------------------


def saturation_notes(recording: Recording, profile: Profile) -> Notes:
    """An extreme value taken far more often than the next one inwards.

    Looked for in what each sample turned, so that an angle made of clipped increments counts.
    """
    changes = profile.changes
    # Few levels say nothing: a quiet gyro may count only 0 and 1.
    if np.unique(arrays.every(changes, arrays.distance_between(10_000, changes.size))).size <= 8:
        return ()
    # A quarter of a step apart is one count: a file's own rounding parts them.
    slack = max(profile.rounding, 0.25 * profile.step)

    low, high = profile.ends
    shares, problem = {"upper": 0.0, "lower": 0.0}, []
    for side, limit, is_there in (
        ("upper", high, lambda some: some >= high - slack),
        ("lower", low, lambda some: some <= low + slack),
    ):
        at_limit = marked(is_there, changes)
        number = often = number_of(at_limit)
        # If samples stick at any value, some stretch is at the largest by chance: it counts once.
        if profile.survey.repeats > OFTENER * number:
            often = stretches(at_limit)[0].size
        if often < LEAST_OFTEN:
            continue
        inside = arrays.elementwise(np.subtract, changes, limit)
        np.abs(inside, out=inside)
        inner = float(inside.min(where=~at_limit, initial=math.inf))
        # Noise takes an extreme value less often than the next one. A clipped value has others
        # right beside it; what lies half a standard deviation beyond is no limit of the range.
        beside = number_of((inside >= inner - slack) & (inside <= inner + slack))
        if inner <= 0.5 * profile.scale and often > OFTENER * beside:
            shares[side] = number / changes.size
            when = second_of(recording, first_of(at_limit))
            problem.append(f"{number} samples are at its {side} limit, the first at {when:.3f} s")
    if not problem:
        return ()
    effect = clipped_scatter(shares["lower"], shares["upper"])
    text = f"is saturated: {' and '.join(problem)}; {STRETCH}"
    return (finding("clipping", profile.name, text, effect=effect),)


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
    # No number is forty standard deviations off.
    low, high = max(float(ndtri(below)), -40.0), min(float(ndtri(1.0 - above)), 40.0)
    at_low, at_high = (math.exp(-0.5 * one**2) / math.sqrt(2.0 * math.pi) for one in (low, high))
    inside = float(ndtr(high) - ndtr(low)) + low * at_low - high * at_high
    mean = at_low - at_high + low * below + high * above
    return math.sqrt(max(inside + low**2 * below + high**2 * above - mean**2, 0.0))


# ---- counts that start over ----------------------------------------------------------

_BINS: Final = 64
# An angle falls by this part of all that it covers.
_FALL: Final = 0.8


def wrap_notes(recording: Recording, profile: Profile) -> Notes:
    """A counter that starts over, which reading saw already or the samples show: an error."""
    noticed = (note for note in recording.notes if note.name == "wraps")
    if known := [note for note in noticed if note.channel == profile.name]:
        return tuple(replace(note, level="error") for note in known)
    if profile.channel.kind == "angle":
        return _falls_of_an_angle(recording, profile)
    return _ends_of_a_range(profile)


def _falls_of_an_angle(recording: Recording, profile: Profile) -> Notes:
    """Steps of an angle, all against its motion, by nearly all that it ever covers."""
    values, survey = profile.channel.values, profile.survey
    covered, usual = survey.highest - survey.lowest, profile.changes[:20_000]
    is_fall = max(survey.rise, -survey.fall) > _FALL * covered
    if not (is_fall and covered > 50.0 * float(np.median(np.abs(usual)))):
        return ()
    at = np.flatnonzero(marked_steps(values, lambda steps: np.abs(steps) > _FALL * covered))
    steps = values[at] - values[at - 1]
    motion = float(values[-1] - values[0] - steps.sum())
    # Falls are rare, and between two of them it covers half of all or more.
    rare, covers = at.size <= 0.1 * values.size, abs(motion) > 0.5 * at.size * covered
    if not (at.size and rare and covers and np.all(steps * motion < 0.0)):
        return ()
    problem = seen(recording, at, "fall", "by all of the angle that it covers")
    remedy = "state the width of the counter with {counter-bits}, or make the angle continuous"
    text = f"{problem}, as of a counter that starts over; {remedy}"
    return (finding("wraps", profile.name, text, effect=None),)


def _ends_of_a_range(profile: Profile) -> Notes:
    """Values at the two ends of a range, and an empty half or more between them."""
    values, lowest, highest = profile.channel.values, *profile.ends
    edges = np.linspace(lowest, highest, _BINS + 1)
    counts = arrays.by_blocks(lambda some: np.histogram(some, edges)[0], values).sum(axis=0)
    filled = np.flatnonzero(counts)
    gaps = np.diff(filled) - 1
    # Half of the range is empty.
    if gaps.max(initial=0) < 0.5 * _BINS:
        return ()
    at = first_of(gaps)
    middle = 0.5 * float(edges[filled[at] + 1] + edges[filled[at + 1]])
    # Width of a counter whose range the values fill, in counts of the unit they came in.
    factor, name = split_factor(profile.channel.shown_in)
    range_in_counts = (highest - lowest) / (factor * UNITS[name].size)
    widths = (8, 12, 16, 18, 20, 24, 32)
    near = [bits for bits in widths if abs(range_in_counts / 2.0**bits - 1.0) < 0.02]
    if not near and (_is_one_value(values, middle) or not _is_by_chance(values, middle)):
        return ()
    width = f"a counter of {near[0]} bits has" if near else "a counter has"
    problem = f"takes values at the two ends of its range and none between, as {width}"
    remedy = "write them as signed, or state the width of an angle's with {counter-bits}"
    text = f"{problem} if signed counts are read as unsigned; {remedy}"
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
    # Neither a line nor a motion differs after one, two and three samples as chance does.
    size = values.size - 3
    above = number_of(high[:size]) / size
    expected = 2.0 * above * (1.0 - above)
    differ = [number_of(high[:size] != high[delay : delay + size]) / size for delay in (1, 2, 3)]
    # A spike makes a smaller end as well.
    return 0.01 < above < 0.99 and all(abs(one - expected) < 0.1 * expected for one in differ)


def _scatter_of_halves(values: FloatArray, middle: float) -> float | None:
    """Scatter of all values over that with the upper end brought down beside the lower."""

    def sums(some: FloatArray) -> list[float]:
        low, high = some[some <= middle], some[some > middle]
        return [low.size, low.sum(), low @ low, high.size, high.sum(), high @ high]

    n, s, q, m, t, r = arrays.by_blocks(sums, values).sum(axis=0)
    inside = (q - s * s / n + r - t * t / m) / (n + m)
    whole = (q + r) / (n + m) - ((s + t) / (n + m)) ** 2
    # Two halves of one bell: together they are about 1/(1 - 2/pi) as scattered as each.
    together = inside / (1.0 - 2.0 / math.pi)
    return math.sqrt(whole / together) if together > 0.0 else None
