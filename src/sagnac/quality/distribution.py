"""Noise that is not distributed as noise is: spikes, bumps, a soft limit, steps, changing power."""

import math
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.fft import rfft
from scipy.special import gammainccinv, gammaincinv, ndtr, ndtri, stdtrit

from sagnac.core import arrays
from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray, blocks
from sagnac.core.errors import Level, Note, rounded
from sagnac.core.marks import marked_steps, number_of, stretches
from sagnac.core.units import DEGREE
from sagnac.quality import _kernels
from sagnac.quality.effects import STRETCH, effect_words, remedy_without, seen
from sagnac.quality.lattice import ROUNDING
from sagnac.quality.profile import LOOKED_AT, Notes, Profile
from sagnac.quality.whitening import EDGE, alternating, whitened, without_lines
from sagnac.recording.model import Recording, second_of

# ---- spikes ------------------------------------------------------------------------

# More of the samples than this are no spikes, but the noise.
_MANY: Final = 0.01
# Samples looked at around each for its neighbourhood.
_AROUND: Final = 2
# Far samples no farther apart than this are a run.
_APART: Final = 8
# A limit is this much above that of chance: the scatter of a block is not known better. A heavy
# tail of the noise goes on below the limit, from this part of it on.
_MARGIN: Final = 1.15
_BELOW: Final = 0.6
# Fewest samples in which spikes are looked for.
LEAST_FOR_SPIKES: Final = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Spikes:
    """Samples far off their neighbours.

    Attributes
    ----------
    index
        (count,) where.
    height
        (count,) how far each lies from its neighbours, rad.
    added_walk
        What they add to N, rad/sqrt(s): ``N^2`` grows by its square, the sum of the squared
        heights over the duration.
    many
        Whether more than one in a hundred samples lie so far off, whether the angle keeps what they
        add or not: that is the noise, and none is listed.
    tail
        Whether they are the end of a heavy tail: that is the noise as well, and none is listed.
    """

    index: IntegerArray
    height: FloatArray
    added_walk: float
    many: bool = False
    tail: bool = False


def find_spikes(
    increments: FloatArray, *, sample_rate: float, among: BooleanArray | None = None
) -> Spikes:
    """Find single samples that lie farther from their neighbours than chance puts them.

    Each sample less the median of the four around it, against the scatter of such differences
    in its block of 65,536 samples (by their quartiles).

    Parameters
    ----------
    increments
        (samples,), rad.
    sample_rate
        Samples per second.
    among
        (samples,) which of them are looked at; all unless given.

    Returns
    -------
    Spikes
        None are listed if more than one in a hundred samples lie so far off, or if they are the
        end of a heavy tail that goes on below them: that is the noise.
    """
    # Noise without spikes shows one in a thousand records.
    limit = -float(ndtri(0.5 * 1e-3 / increments.size))
    among = np.broadcast_to(np.True_, increments.shape) if among is None else among
    looked_at = number_of(among)
    parts = [_far_in(increments, among, block, limit) for block in blocks(increments.size, 2**16)]
    beyond = sum(far.place.size for far in parts)
    many = beyond > _MANY * looked_at
    # Each is looked at alone: not where all are the noise, and are tens of thousands.
    kept = [slice(0) if many else _kept_by_angle(increments, far) for far in parts]
    index = np.concatenate([far.place[some] for far, some in zip(parts, kept, strict=True)])
    height = np.concatenate([far.off[some] for far, some in zip(parts, kept, strict=True)])
    by_chance = 2.0 * looked_at * float(ndtr(-_BELOW * _MARGIN * limit))
    # A tail that falls as x^-3 has 3.6 times as many from 0.6 of the limit up to it as beyond it,
    # one as x^-6 20 times; spikes whose heights are spread evenly have fewer than one.
    tail = index.size > 0 and sum(far.below for far in parts) - by_chance > 2.0 * beyond
    if tail:
        index, height = index[:0], height[:0]
    added = math.sqrt(float(height @ height) * sample_rate / increments.size)
    return Spikes(index=index, height=height, added_walk=added, many=many, tail=tail)


class _Far(NamedTuple):
    """Samples of a block that lie far off their neighbours, and how far, rad.

    `scale` is the scatter of such differences in the block, `below` how many lie somewhat below the
    limit.
    """

    place: IntegerArray
    off: FloatArray
    scale: float = 0.0
    below: int = 0


def _far_in(values: FloatArray, among: BooleanArray, block: slice, limit: float) -> _Far:
    """Samples of one block that lie far off, whether the angle keeps what they add or not."""
    before, behind = max(0, _AROUND - block.start), max(0, block.stop + _AROUND - values.size)
    some = values[max(0, block.start - _AROUND) : block.stop + _AROUND]
    padded = np.pad(some, (before, behind), mode="reflect")
    off = np.empty(block.stop - block.start)
    _kernels.off_neighbours(padded, off)
    # A strong line or a table may rise at an end: a sample that goes on evenly from the two beside
    # it is no spike, nor is the next, which lies midway between its neighbours.
    for end, inwards, is_end in ((0, 1, before), (-1, -1, behind)):
        if is_end and some.size > 2:
            bend = some[end] - 2.0 * some[end + inwards] + some[end + 2 * inwards]
            for place, lies_off in ((end, bend), (end + inwards, -0.5 * bend))[: off.size]:
                off[place] = min(off[place], lies_off, key=abs)
    off = np.where(among[block], off, math.nan)
    some = off[among[block]]
    if not some.size:
        return _Far(np.empty(0, dtype=np.int64), np.empty(0))
    some = some[:: arrays.distance_between(2**13, some.size)]
    low, high = np.quantile(some, (0.25, 0.75))
    # Coarse steps have quartiles of a step or none: the root mean square of the inner part.
    inner = some[np.abs(some) <= np.quantile(np.abs(some), 0.95)]
    scale = max((high - low) / 1.349, 1.3 * math.sqrt(float(inner @ inner) / inner.size))
    # A gyro that stands still in a block shows no scatter: nothing lies off there.
    size, reach = np.abs(off), _MARGIN * limit * scale if scale > 0.0 else math.inf
    far = np.flatnonzero(size > reach)
    below = number_of(size > _BELOW * reach) - far.size
    return _Far(far + block.start, off[far], scale, below)


def _kept_by_angle(values: FloatArray, far: _Far) -> BooleanArray:
    """(far,) which far samples add to the angle for good.

    If the samples beside one take it back, the angle alone was off for a moment: that adds nothing
    to N, but a replaced sample would. At the end of the record nothing can take it back. Parts of a
    swing, as where a line begins, are none either: the whole run of far samples has to add what is
    replaced, to half of that or three standard deviations.
    """
    kept = np.array([_net_change(values, one, one) for one in far.place]) / far.off > 0.5
    starts = np.flatnonzero(np.diff(far.place, prepend=-math.inf) > _APART)
    for run in map(slice, starts, [*starts[1:], far.place.size]):
        first, last = far.place[run][[0, -1]]
        taken = float(far.off[run][kept[run]].sum())
        by_chance = 3.0 * far.scale * math.sqrt(last - first + 5)
        missing = abs(taken - _net_change(values, first, last))
        kept[run] &= missing < max(0.5 * abs(taken), by_chance)
    return kept


def _net_change(values: FloatArray, first: int, last: int) -> float:
    """What samples, with those beside them, add to the angle beyond what is typical around them."""
    reach = 8 + last - first
    typical = arrays.median(values[max(0, first - reach) : last + reach + 1])
    return float((values[max(0, first - _AROUND) : last + _AROUND + 1] - typical).sum())


def without_spikes(increments: FloatArray, spikes: Spikes) -> FloatArray:
    """Increments with each spike replaced by the median of its neighbours.

    Parameters
    ----------
    increments
        (samples,), rad.
    spikes
        Of `find_spikes`.
    """
    cleaned = arrays.elementwise(np.add, increments, 0.0)
    cleaned[spikes.index] -= spikes.height
    return cleaned


def spike_notes(recording: Recording, profile: Profile) -> Notes:
    """Single samples far off, a warning, for the answer goes without them; else single jumps."""
    if profile.changes.size < LEAST_FOR_SPIKES:
        return jump_notes(recording, profile)
    among = profile.even[-profile.changes.size :].copy()
    # No answer has the first rate or increment: the angle begins behind it.
    among[0] &= profile.changes.size < recording.samples
    spikes = find_spikes(profile.changes, sample_rate=1.0, among=among)
    if spikes.many and not profile.standing:
        # Beside a table that stands still now and then, its jitter is no tail of the noise.
        among &= profile.turning[-among.size :]
        spikes = find_spikes(profile.changes, sample_rate=1.0, among=among)
    level: Level = "warning"
    effect = None
    if spikes.many and not profile.is_coarse:
        problem = f"more than one sample in {round(1.0 / _MANY)} lies far off its neighbours"
        text = f"{problem}: it is no even noise, and its angle random walk contains them"
    elif spikes.tail and profile.standing:
        # On a bench alone the end of a heavy tail is the noise's: a table that sweeps has one.
        level = "remark"
        tail = "the end of a heavy tail of the noise that goes on below them"
        text = f"some samples lie far off their neighbours, as {tail}"
        text += ": the angle random walk contains them"
    elif spikes.index.size:
        inside = profile.scale
        effect = math.hypot(1.0, spikes.added_walk / inside) if inside > 0.0 else None
        far = seen(recording, spikes.index, "sample", "far off those beside (spikes)")
        text = f"{far}: an answer goes without; left in, {effect_words(effect)}"
        highest = ROUNDING * float(np.abs(spikes.height).max())
        if profile.channel.kind != "angle" and highest > 0.05 * inside:
            lost = "so far that the angle behind has no digits left for the noise"
            remedy = remedy_without(recording, spikes.index)
            text = f"{far}, {lost}; put what lies beside in its place, or {remedy}"
            level, effect = "error", None
    else:
        return jump_notes(recording, profile)
    return (Note(name="spikes", channel=profile.name, text=text, level=level, effect=effect),)


# ---- bumps -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Bumps:
    """Moments in which a gyro at rest was moved.

    Attributes
    ----------
    stretches
        Samples of each, a second before and behind included.
    turned
        (bumps,) by how much the angle turned in the second of each that it turned most in, rad.
    scatter
        Standard deviation of what it turns in other seconds, rad.
    added
        What they make of the scatter of all seconds, as a factor.
    """

    stretches: tuple[slice, ...]
    turned: FloatArray
    scatter: float
    added: float

    def note(self, recording: Recording, sample_rate: float, channel: str = "") -> Note:
        """The finding, a warning: of samples at a rate, which may be fewer than were recorded."""
        apart = round(recording.sample_rate / sample_rate)
        places = apart * np.array([one.start for one in self.stretches])
        most = float(self.turned.max())
        within = _samples_of_a_second(sample_rate) / sample_rate
        problem = seen(recording, places, "moment", "in which it was moved")
        turns = f"it turns by {rounded(most / DEGREE)} deg within {within:.3g} s"
        turns += f", {rounded(most / self.scatter)} times its noise"
        text = f"{problem}: {turns}; an answer goes without; left in, {effect_words(self.added)}"
        added = float(f"{self.added:.4g}")
        return Note(name="moved", level="warning", channel=channel, text=text, effect=added)


def _samples_of_a_second(sample_rate: float) -> int:
    """Samples of a second; below 8 Hz eight of them."""
    return max(8, round(sample_rate))


def find_bumps(
    increments: FloatArray, *, sample_rate: float, with_spikes: bool = False
) -> Bumps | None:
    """Find the few seconds in which a unit at rest turns farther than its noise does.

    A nudge that lasts a second hides among samples, of which none lies far off, and raises the
    spectrum below a hertz. The turns of single seconds, each less the median of the nine around it,
    are held against their scatter (by the median of how far neighbours differ).

    Parameters
    ----------
    increments
        (samples,), rad.
    sample_rate
        Samples per second.
    with_spikes
        Whether a second that turns far in a single sample counts, too.

    Returns
    -------
    Bumps or None
        None if nothing stands out, or so much that it is the noise: more than one second in a
        hundred (three in any case), or the end of a tail that goes on below.
    """
    length = _samples_of_a_second(sample_rate)
    count = increments.size // length
    # Fewer stretches do not tell their scatter.
    if count < 60:
        return None
    turns = np.add.reduceat(increments[: count * length], np.arange(0, count * length, length))
    around = np.median(sliding_window_view(np.pad(turns, 4, mode="reflect"), 9), axis=1)
    off = turns - around
    scatter = float(np.median(np.abs(np.diff(turns)))) / float(ndtri(0.75)) / math.sqrt(2.0)
    # A rate that steps or drifts by as much from time to time is the gyro's own.
    wander = float(np.quantile(np.abs(around[9:] - around[:-9]), 0.99))
    if scatter == 0.0:
        return None
    # From ten standard deviations on the turn of a second is none of the noise; a heavy tail goes
    # on below, from six on.
    far = np.abs(off) > max(10.0 * scatter, 2.0 * wander)
    below = number_of(np.abs(off) > 6.0 * scatter) - number_of(far)
    for place in [] if with_spikes else np.flatnonzero(far).tolist():
        own = increments[place * length : (place + 1) * length]
        far[place] = np.abs(own - np.median(own)).max() < 0.5 * abs(off[place])
    if not 0 < number_of(far) <= max(3.0, _MANY * count) or below > 2 * number_of(far):
        return None
    # A second before and behind, in which it begins and ends.
    wide = np.convolve(far, np.ones(3), mode="same") > 0.0
    pairs = np.transpose(stretches(wide)).tolist()
    moved = tuple(slice(first * length, last * length) for first, last in pairs)
    turned = np.array([np.abs(off[first:last]).max() for first, last in pairs])
    added = math.hypot(1.0, float(np.linalg.norm(off[far])) / scatter / math.sqrt(count))
    return Bumps(stretches=moved, turned=turned, scatter=scatter, added=added)


def without_bumps(increments: FloatArray, bumps: Bumps) -> FloatArray:
    """Increments with each bump replaced by as many samples before it, or behind, backwards.

    Noise of its own level stands there then, and no gap.

    Parameters
    ----------
    increments
        (samples,), rad.
    bumps
        Of `find_bumps`.
    """
    cleaned = increments.copy()
    bumped = np.zeros(cleaned.size, dtype=np.bool_)
    for one in bumps.stretches:
        bumped[one] = True
    free = np.flatnonzero(~bumped)
    for one in bumps.stretches:
        size, place = one.stop - one.start, int(np.searchsorted(free, one.start))
        beside = free[place - size : place] if place >= size else free[place : place + size]
        cleaned[one] = cleaned[beside][::-1]
    return cleaned


def bump_notes(recording: Recording, profile: Profile) -> Notes:
    """Seconds in which a gyro on a bench was moved, a warning: the answer goes without them."""
    if not profile.standing or profile.channel.sensor != "gyro":
        return ()
    rate = recording.sample_rate
    bumps = find_bumps(profile.changes, sample_rate=rate)
    if bumps is None:
        return ()
    if profile.channel.kind == "rate":
        # Sums of rates are angles times the sample rate.
        bumps = replace(bumps, turned=bumps.turned / rate, scatter=bumps.scatter / rate)
    return (bumps.note(recording, rate, profile.name),)


# ---- jumps -------------------------------------------------------------------------

# Times the 99 % quantile of steps, or 50 sigma of noise, of a jump.
_TIMES: Final = 20.0


def jump_notes(recording: Recording, profile: Profile) -> Notes:
    """Steps of over 20 times the 99 % quantile of all: a warning.

    Small ones that are all whole numbers of the smallest are no jumps: a motion that is all but
    steady meets the steps of a readout so.
    """
    values = profile.channel.values
    steps = arrays.some_steps(values, 20_000)
    middle = float(np.median(steps))
    limit = _TIMES * float(np.quantile(np.abs(steps - middle), 0.99))
    survey = profile.survey
    if limit <= 0.0 or max(survey.rise - middle, middle - survey.fall) <= limit:
        return ()
    jumps = marked_steps(values, lambda steps: np.abs(steps - middle) > limit)
    places = np.flatnonzero(jumps & profile.even)
    if not places.size:
        return ()
    sizes = np.abs(values[places] - values[places - 1] - middle)
    parts = sizes / sizes.min()
    whole = np.all(np.abs(parts - np.rint(parts)) < 0.05)
    if places.size >= 3 and sizes.max() < 0.1 * DEGREE and whole:
        return ()
    problem = seen(recording, places, "jump", f"of over {_TIMES:g} times the usual step")
    text = f"{problem}; {remedy_without(recording, places)}"
    return (Note(name="steps", level="warning", channel=profile.name, text=text),)


# ---- distribution ------------------------------------------------------------------


class Shape(NamedTuple):
    """Distribution of white numbers; a normal one has zeros.

    Attributes
    ----------
    skewness, kurtosis
        Third cumulant and fourth (excess kurtosis), of unit variance.
    samples
        How many numbers.
    """

    skewness: float
    kurtosis: float
    samples: int


def shape_of(white: FloatArray) -> Shape:
    """Distribution of (samples,) what samples turned, made white first (`whitening.whitened`).

    A sine is flat as a soft limit makes noise, and slow noise has few independent samples. So each
    frequency is divided by the level around it, and lines are cut down to the noise.
    """
    white = (white - white.mean()) / white.std()
    squares = white * white
    kurtosis = float(squares @ squares) / white.size - 3.0
    return Shape(float(squares @ white) / white.size, kurtosis, white.size)


def _shape_in(profile: Profile) -> Shape | None:
    """The distribution of a gyro's noise; None if there are too few samples or coarse steps."""
    changes = profile.changes[: 2**15]
    if changes.size < 2**12:
        return None
    white = whitened(changes)
    # Steps of the readout shape the distribution if what each sample adds strays over fewer of
    # them: at two the excess kurtosis of counted noise is 0.001, at one 0.01, at half 0.1.
    return None if 2.0 * profile.step > white.innovation else shape_of(white.values)


# Standard errors within which a kurtosis is the one expected.
_LIKE: Final = 4.0


def flat_notes(recording: Recording, profile: Profile) -> Notes:
    """Large deviations that are missing, which a soft limit takes and other noise never had.

    A limit lowers N and sound noise of that distribution has the N that is read. White samples do
    not tell the two apart, so an interval holds N of both.
    """
    shape = _shape_in(profile)
    # Six standard errors, and half of what a soft limit that lowers N by 5 % has.
    if shape is None or shape.kurtosis >= -max(0.2, 6.0 * math.sqrt(24.0 / shape.samples)):
        return ()
    if has_uniform_errors(profile.changes[:LOOKED_AT]):
        return ()
    # Standard deviation behind a soft limit, of a normal number's of 1. That of x - a x^3 is
    # 1 - 3 a and its excess kurtosis -24 a. The next order is that of a hyperbolic tangent.
    effect = float(f"{1.0 + shape.kurtosis / 8.0 - 0.075 * shape.kurtosis**2:.4g}")
    # Down to this excess kurtosis the effect is known to 0.005, whether the limit is a hyperbolic
    # tangent, an arc tangent or x / sqrt(1 + x^2).
    level: Level = "error" if shape.kurtosis < -0.64 else "warning"
    near = "it comes near the end of its range (a soft saturation)"
    why = f"either {near}, or its noise is a sum of few errors, which is sound"
    problem = f"large deviations are missing (excess kurtosis {shape.kurtosis:.2g}): {why}"
    text = f"{problem}; take a wider range to tell; if it saturates, {effect_words(effect)}"
    if level == "warning":
        text = f"{text}, and an interval reaches up to N divided by that"
    return (Note(name="short-tails", channel=profile.name, text=text, level=level, effect=effect),)


def has_uniform_errors(changes: FloatArray) -> bool:
    """Whether quantization of the angle explains that large deviations are missing.

    Uniform errors of the angle, of variance q, are in two neighbouring samples with opposite signs.
    They set the covariance of neighbours (-q) and the fourth cumulant both of samples and of
    sums of two neighbours: -2.4 q^2. N is that of the normal noise beside them. A soft limit of
    normal noise x, to first order x - a x^3, leaves sums of two another fourth cumulant.

    Parameters
    ----------
    changes
        (samples,) what each sample turned, more than 1024.
    """
    values = without_lines(changes)
    size = values.size
    variance = float(values @ values) / size
    one_apart = float(values[1:] @ values[:-1]) / size
    error, _ = alternating(values)
    if error <= 0.0:
        return False
    sums = values[1:] + values[:-1]
    together = 2.0 * (variance + one_apart)
    kurtosis, of_sums = shape_of(values).kurtosis, shape_of(sums).kurtosis
    # Standard errors of normal noise; two neighbouring sums share a sample.
    own, of_two = math.sqrt(24.0 / size), math.sqrt(48.0 / size)
    by_errors = -2.4 * (error / together) ** 2
    by_limit = kurtosis * together / (4.0 * variance)
    alike = abs(kurtosis + 2.4 * (error / variance) ** 2) < _LIKE * own
    alike = alike and abs(of_sums - by_errors) < _LIKE * of_two
    # Beyond three standard errors it is another.
    return alike and of_sums < by_limit - 3.0 * of_two


def heavy_notes(recording: Recording, profile: Profile) -> Notes:
    """Noise that is full of spikes, on a bench, for motion may make large deviations: a warning."""
    shape = _shape_in(profile) if profile.standing else None
    if shape is None or not (abs(shape.skewness) > 0.3 or shape.kurtosis > 1.0):
        return ()
    # Spikes of one size and sign make a kurtosis of that size, in deviations, times the skewness.
    why = "spikes or bursts are a part of it, and of its angle random walk"
    if shape.kurtosis <= 1.0:
        ends = "the range ends near by on one side (take a wider range to tell)"
        why = f"it is lopsided: either {ends}, or this gyro's noise has that shape, which is sound"
    shown = f"skewness {shape.skewness:.2g}, excess kurtosis {shape.kurtosis:.2g}"
    text = f"its noise is no even noise ({shown}): {why}"
    return (Note(name="spikes", channel=profile.name, text=text, level="warning"),)


# ---- unsteady ----------------------------------------------------------------------

# Fewest blocks.
_FEWEST: Final = 8


def unsteady_notes(recording: Recording, profile: Profile) -> Notes:
    """Blocks whose noise is far above that of the quiet ones, or noise that grows: a warning.

    On a bench: a table that starts and stops changes noise by right.
    """
    if not profile.standing or profile.typical.size < _FEWEST or profile.is_coarse:
        return ()
    change = _loud(recording, profile) or _growing(profile)
    if not change or profile.changes.size > 2**23:
        return change
    if profile.changes.size <= 2 * EDGE:
        return _loud(recording, profile, _together(profile.changes)) or _growing(profile)
    # Lines and resonances come and go by right: the noise between them tells. A dither wanders by a
    # hundredth of the rate, within one of the bands.
    white = whitened(profile.changes, bands=24, kept=3.0).values
    values = np.pad(white, EDGE, mode="reflect")
    channel = replace(profile.channel, kind="increment", shown_in="", values=values)
    between = Profile(channel=channel, sample_rate=profile.sample_rate)
    return _loud(recording, between, _together(white)) or _growing(between)


# `_together` of white noise: its differences of neighbours are correlated by -1/2.
_WHITE_TOGETHER: Final = 1.5


def _together(changes: FloatArray) -> float:
    """The number of differences of neighbours that are worth one independent number.

    It is the sum of the squares of their correlations: mean S^2 / (mean S)^2 of their spectrum S.
    """
    transform = rfft(np.diff(changes))
    power = transform.real**2 + transform.imag**2
    # Eight ordinates together, which scatter by little whatever their distribution.
    level = power[: power.size // 8 * 8].reshape(-1, 8).mean(axis=1)
    mean = float(level.mean())
    return max(_WHITE_TOGETHER, float(np.mean(level**2)) / mean**2) if mean > 0.0 else math.inf


def _loud(recording: Recording, profile: Profile, together: float = _WHITE_TOGETHER) -> Notes:
    power = profile.typical
    quiet, at = float(np.quantile(power, 0.25)), int(np.argmax(power))
    # The mean square of n independent normal numbers follows a gamma law of shape n/2. Behind a
    # low-pass few of them are independent.
    shape = profile.block / (2.0 * together)
    # The power of one block of steady noise is as high with a chance of 1e-7.
    chance = float(gammainccinv(shape, 1e-7) / gammaincinv(shape, 0.25))
    if quiet <= 0.0 or power[at] <= max(chance, 1.2**2) * quiet:
        return ()
    when = f"{second_of(recording, at * profile.block):.6g} s"
    louder = f"{math.sqrt(power[at] / quiet):.3g} times the scatter of the quiet quarter"
    problem = f"the loudest {profile.block / recording.sample_rate:.3g} s, at {when}, have {louder}"
    effect = math.sqrt(float(power.mean()) / quiet)
    return _changing(profile.name, f"its noise changes: {problem}", effect)


def _growing(profile: Profile) -> Notes:
    """Noise that grows or falls from one end to the other."""
    power = profile.spread
    if power.size < 2 * _FEWEST or not np.all(power > 0.0):
        return ()
    height = np.log(power)
    along = np.linspace(-0.5, 0.5, power.size)
    slope = float(along @ height / (along @ along))
    rest = height - height.mean() - slope * along
    # Neighbours tell the scatter of a block; noise that wanders slowly is in the rest alone.
    own = max(float(np.mean(np.diff(height) ** 2)) / 2.0, float(np.mean(rest**2)))
    error = math.sqrt(own / float(along @ along))
    reach = float(stdtrit(power.size - 2, 1.0 - 0.5 * 1e-4))
    effect = math.sqrt(float(np.exp(np.abs(slope) * (along + 0.5)).mean()))
    # Twice the change at which an answer moves by 1 %.
    if abs(slope) <= reach * error or effect < 1.02:
        return ()
    problem = f"its noise {'grows' if slope > 0.0 else 'falls'} in the course of the record"
    ratio = f"{math.exp(0.5 * slope):.3g} times its scatter"
    return _changing(profile.name, f"{problem}, to {ratio}", effect)


def _changing(channel: str, said: str, effect: float) -> Notes:
    """Noise of which the mean is `effect` times the quietest: no one N is that of the record."""
    walk = f"the angle random walk of all of it is about {effect:.3g} times the least"
    text = f"{said}; take an even stretch with {{slice}}; {walk}"
    # The interval of an answer reaches as far as that.
    level: Level = "error" if effect > 1.5 else "warning"
    known = float(f"{effect:.4g}")
    return (Note(name="unsteady", channel=channel, text=text, effect=known, level=level),)


# ---- steps of the rate -------------------------------------------------------------


def step_notes(recording: Recording, profile: Profile) -> Notes:
    """A rate that steps from one block to the next, and stays there, on a bench: a warning."""
    if not profile.standing or profile.level.size <= _FEWEST:
        return ()
    level = profile.level
    changes = np.abs(np.diff(level))
    # The median of counts moves by steps of the readout, or not at all.
    usual = max(float(np.quantile(changes, 0.75)), profile.step)
    # The median of one block of a dithered gyro may lie anywhere; that of three does not.
    stays = np.median(np.stack([level[:-2], level[1:-1], level[2:]]), axis=0)
    steps = np.abs(stays[3:] - stays[:-3])
    at = int(np.argmax(steps))
    # Chance makes five.
    if steps[at] <= 10.0 * usual or usual <= 0.0:
        return ()
    first = at + 2 + int(np.argmax(changes[at + 1 : at + 4]))
    size = f"{steps[at] / usual:.3g}"
    period = f"{profile.block / recording.sample_rate:.3g} s"
    of_what = f"{size} times what it usually changes over {period}"
    if usual == profile.step:
        of_what = f"{size} steps of the readout from one {period} to the next"
    problem = f"its rate steps by {of_what}, at {second_of(recording, first * profile.block):.6g} s"
    text = f"{problem}; {STRETCH}"
    return (Note(name="steps", channel=profile.name, text=text, level="warning"),)
