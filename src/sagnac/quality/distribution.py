"""Noise that is not distributed as noise is: spikes, a soft limit, power that changes, steps."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri, stdtrit

from sagnac.core.arrays import FloatArray, IntegerArray, blocks, elementwise
from sagnac.core.errors import Level, Note, counted
from sagnac.core.units import DEGREE
from sagnac.quality import _kernels
from sagnac.quality.effects import effect_words, finding
from sagnac.quality.profile import EDGE, Notes, Profile, remedy_without, some_steps, whitened
from sagnac.recording.channel import Channel, marked_steps, number_of
from sagnac.recording.model import Recording, second_of

# ---- spikes ------------------------------------------------------------------------

# Chance that noise without spikes shows one.
_SPIKE_CHANCE: Final = 1e-3
# More of the samples than this are no spikes, but the noise.
_MANY: Final = 0.01
# A heavy tail of the noise goes on below the limit: from 0.6 of the limit up to it lie more than
# twice as many samples as beyond it. A tail that falls as x^-3 has 3.6 times as many there, one as
# x^-6 20 times; spikes whose heights are spread evenly have fewer than one.
_TAIL: Final = 2.0
_BELOW: Final = 0.6
# Samples looked at around each for its neighbourhood.
_AROUND: Final = 2
# Samples whose median is the level that a spike stands on, and share of it that has to stay.
_WIDE: Final = 8
_KEPT: Final = 0.5
# A limit is this much above that of chance: the scatter of a block is not known better.
_MARGIN: Final = 1.15
_BLOCK: Final = 2**16
# Samples of a block that tell its scatter, about.
_TELL: Final = 2**13
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


def find_spikes(increments: ArrayLike, *, sample_rate: float) -> Spikes:
    """Find single samples that lie farther from their neighbours than chance puts them.

    Each sample less the median of the four around it, against the scatter of such differences
    in its block of 65,536 samples (by their quartiles).

    Parameters
    ----------
    increments
        (samples,), rad.
    sample_rate
        Samples per second.

    Returns
    -------
    Spikes
        None are listed if more than one in a hundred samples lie so far off, or if they are the
        end of a heavy tail that goes on below them: that is the noise.
    """
    values = np.asarray(increments, dtype=np.float64)
    # Beyond this many scatters lies one sample in a record by chance.
    limit = -float(ndtri(0.5 * _SPIKE_CHANCE / values.size))
    far = [_spikes_in(values, block, limit) for block in blocks(values.size, _BLOCK)]
    indices, heights, counts, lower = zip(*far, strict=True)
    index, height, beyond = np.concatenate(indices), np.concatenate(heights), sum(counts)
    many = beyond > _MANY * values.size
    by_chance = 2.0 * values.size * float(ndtr(-_BELOW * _MARGIN * limit))
    tail = not many and index.size > 0 and sum(lower) - by_chance > _TAIL * beyond
    if many or tail:
        index, height = index[:0], height[:0]
    added = math.sqrt(float(height @ height) * sample_rate / values.size)
    return Spikes(index=index, height=height, added_walk=added, many=many, tail=tail)


def _spikes_in(
    values: FloatArray, block: slice, limit: float
) -> tuple[IntegerArray, FloatArray, int, int]:
    """Samples of one block that lie far off their neighbours, and how far.

    Besides how many lie beyond the limit, whether the angle keeps them or not, and how many lie
    somewhat below it.
    """
    first, last = max(0, block.start - _AROUND), min(values.size, block.stop + _AROUND)
    off = np.empty(last - first)
    _kernels.off_neighbours(np.pad(values[first:last], _AROUND, mode="reflect"), off)
    off = off[block.start - first : block.stop - first]
    some = np.sort(off[:: max(1, off.size // _TELL)])
    quartiles = _quantile(some, 0.75) - _quantile(some, 0.25)
    # Coarse steps have quartiles of a step or none: the root mean square of the inner part.
    sizes = np.sort(np.abs(some))
    inner = sizes[sizes <= _quantile(sizes, 0.95)]
    scale = max(quartiles / 1.349, 1.3 * math.sqrt(float(inner @ inner) / inner.size))
    # A gyro that stands still in a block shows no scatter: nothing lies off there.
    size, reach = np.abs(off), _MARGIN * limit * scale if scale > 0.0 else math.inf
    found = np.flatnonzero(size > reach)
    below = number_of(size > _BELOW * reach) - found.size
    stays = [one for one in found.tolist() if _stays(values, block.start + one, float(off[one]))]
    index = np.array(stays, dtype=np.int64)
    return index + block.start, off[index], found.size, below


def _quantile(ascending: FloatArray, share: float) -> float:
    """As ``numpy.quantile``, of values that are sorted once for all quantiles."""
    place = share * (ascending.size - 1)
    below = ascending[int(place)]
    return float(below + (place % 1.0) * (ascending[math.ceil(place)] - below))


def _stays(values: FloatArray, place: int, height: float) -> bool:
    """Whether the angle keeps what a sample adds.

    If its neighbours take it back, the angle alone was off for a moment: that adds nothing to N,
    and to replace one of them would.
    """
    if not _AROUND <= place < values.size - _AROUND:
        return False
    typical = np.median(values[max(0, place - _WIDE) : place + _WIDE + 1])
    net = float((values[place - _AROUND : place + _AROUND + 1] - typical).sum())
    return net / height > _KEPT


def without_spikes(increments: ArrayLike, spikes: Spikes) -> FloatArray:
    """Increments with each spike replaced by the median of its neighbours.

    Parameters
    ----------
    increments
        (samples,), rad.
    spikes
        Of `find_spikes`.
    """
    values = np.asarray(increments, dtype=np.float64)
    cleaned = elementwise(np.add, values, 0.0)
    cleaned[spikes.index] -= spikes.height
    return cleaned


def spike_notes(recording: Recording, profile: Profile) -> Notes:
    """Single samples far off, a warning, for the answer goes without them; else single jumps."""
    if profile.changes.size < LEAST_FOR_SPIKES:
        return jump_notes(recording, profile)
    found = find_spikes(profile.changes, sample_rate=1.0)
    level: Level = "warning"
    effect = None
    if found.many and not profile.is_coarse:
        text = (
            f"more than one sample in {round(1.0 / _MANY)} lies far off its neighbours: it is no "
            "even noise, and its angle random walk contains them"
        )
    elif found.tail and profile.standing:
        # On a bench alone the end of a heavy tail is the noise's: a table that sweeps has one.
        level = "remark"
        text = (
            "some samples lie far off their neighbours, as the end of a heavy tail of the noise "
            "that goes on below them: the angle random walk contains them"
        )
    elif found.index.size:
        inside = profile.scale
        effect = math.hypot(1.0, found.added_walk / inside) if inside > 0.0 else None
        text = (
            f"{counted(found.index.size, 'sample')} far off their neighbours (spikes), the first "
            f"at {second_of(recording, int(found.index[0])):.3f} s: an answer goes without them; "
            f"left in, {effect_words(effect)}"
        )
    else:
        return jump_notes(recording, profile)
    return (Note(name="spikes", channel=profile.name, text=text, level=level, effect=effect),)


# ---- jumps -------------------------------------------------------------------------

# Steps that tell what is usual, and times its 99 % quantile, or 50 sigma of noise, of a jump.
_LOOKED_AT: Final = 20_000
_TIMES: Final = 20.0
# Jumps from which on they may be steps of a readout, how large these may be, and how near to a
# whole number of steps.
_OFTEN: Final = 3
_COARSEST: Final = 0.1 * DEGREE
_WHOLE: Final = 0.05


def jump_notes(recording: Recording, profile: Profile) -> Notes:
    """Steps of over 20 times the 99 % quantile of all: a warning.

    Small ones that are all whole numbers of the smallest are no jumps: a motion that is all but
    steady meets the steps of a readout so.
    """
    values = profile.channel.values
    steps = some_steps(values, _LOOKED_AT)
    middle = float(np.median(steps))
    limit = _TIMES * float(np.quantile(np.abs(steps - middle), 0.99))
    found = profile.survey
    if limit <= 0.0 or max(found.rise - middle, middle - found.fall) <= limit:
        return ()
    jumps = marked_steps(values, lambda steps: np.abs(steps - middle) > limit)
    places = np.flatnonzero(jumps)
    sizes = np.abs(values[places] - values[places - 1] - middle)
    parts = sizes / sizes.min()
    whole = np.all(np.abs(parts - np.rint(parts)) < _WHOLE)
    if places.size >= _OFTEN and sizes.max() < _COARSEST and whole:
        return ()
    text = (
        f"{counted(places.size, 'jump')} of over {_TIMES:g} times the usual step, the first at "
        f"{second_of(recording, int(places[0])):.3f} s; "
        f"{remedy_without(recording, jumps)}"
    )
    return (Note(name="steps", level="warning", channel=profile.name, text=text),)


# ---- distribution ------------------------------------------------------------------

# Samples looked at, the most and the least.
_CHANGES_LOOKED_AT: Final = 2**15
_LEAST_CHANGES: Final = 2**12
# Steps of the readout shape the distribution if what each sample adds strays over fewer of them: at
# two the excess kurtosis of counted noise is 0.001, at one 0.01, at half 0.1.
_FINE_STEPS: Final = 2.0
# Standard errors, and least size, of an excess kurtosis below zero, and of a skewness or a
# kurtosis above it, that are said. Noise of N that a soft limit lowers by 5 % has one of -0.4.
_SIGMAS: Final = 6.0
_FLAT: Final = 0.2
_SKEW: Final = 0.3
_HEAVY: Final = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """Distribution of white numbers; a normal one has zeros.

    Attributes
    ----------
    skewness, kurtosis
        Third cumulant and fourth (excess kurtosis), of unit variance.
    innovation
        Standard deviation of what each change adds to those before, in their unit.
    samples
        How many numbers.
    """

    skewness: float
    kurtosis: float
    innovation: float
    samples: int

    @property
    def is_flat(self) -> bool:
        """Whether large numbers are missing."""
        return self.kurtosis < -max(_FLAT, _SIGMAS * math.sqrt(24.0 / self.samples))

    @property
    def is_heavy(self) -> bool:
        """Whether there are too many of them, or more on one side."""
        return abs(self.skewness) > _SKEW or self.kurtosis > _HEAVY


def shape_of(changes: FloatArray) -> Shape:
    """Distribution of what samples turned, made white first, with lines cut down to the noise.

    A sine is flat as a soft limit makes noise, and slow noise has few independent samples. So each
    frequency is divided by the level around it.

    Parameters
    ----------
    changes
        (samples,)
    """
    found = whitened(changes)
    white = (found.values - found.values.mean()) / found.values.std()
    squares = white * white
    return Shape(
        skewness=float(squares @ white) / white.size,
        kurtosis=float(squares @ squares) / white.size - 3.0,
        innovation=found.innovation,
        samples=white.size,
    )


def _shape_in(profile: Profile) -> Shape | None:
    """The distribution of a gyro's noise; None if there are too few samples or coarse steps."""
    changes = profile.changes[:_CHANGES_LOOKED_AT]
    if changes.size < _LEAST_CHANGES:
        return None
    shape = shape_of(changes)
    return None if _FINE_STEPS * profile.step > shape.innovation else shape


def flat_notes(recording: Recording, profile: Profile) -> Notes:
    """A soft limit, with what it does to N."""
    shape = _shape_in(profile)
    if shape is None or not shape.is_flat:
        return ()
    text = (
        f"large deviations are missing (excess kurtosis {shape.kurtosis:.2g}), as if it came "
        "near the end of its range: a soft saturation; take a wider range"
    )
    # Standard deviation behind a soft limit, of a normal number's of 1. That of x - a x^3 is
    # 1 - 3 a and its excess kurtosis -24 a. The next order is that of a hyperbolic tangent; for an
    # arc tangent and x / sqrt(1 + x^2) it is good to 0.01 up to a limit at 2.5 deviations.
    effect = 1.0 + shape.kurtosis / 8.0 - 0.075 * shape.kurtosis**2
    return (finding("clipping", profile.name, text, effect=effect),)


def heavy_notes(recording: Recording, profile: Profile) -> Notes:
    """Noise that is full of spikes, on a bench, for motion may make large deviations: a warning."""
    shape = _shape_in(profile) if profile.standing else None
    if shape is None or not shape.is_heavy:
        return ()
    text = (
        f"its noise is no even noise (skewness {shape.skewness:.2g}, excess kurtosis "
        f"{shape.kurtosis:.2g}): spikes or bursts are a part of it, and of its angle random "
        "walk"
    )
    return (Note(name="spikes", channel=profile.name, text=text, level="warning"),)


# ---- unsteady ----------------------------------------------------------------------

# Scatters of a block's power by which the loudest exceeds the quiet ones, and least factor.
_UNSTEADY_SIGMAS: Final = 7.0
_LEAST_FACTOR: Final = 1.2
# Variance of the mean of n squares of differences of neighbouring normal numbers, in units of its
# square and of 1/n: 2 for independent ones, and half as much again since neighbours share one.
_POWER_VARIANCE: Final = 3.0
_FEWEST_BLOCKS: Final = 8
# Chance at which noise that stands still is said to grow or fall, fewest blocks that tell, and
# least change of N: twice that at which an answer moves by 1 %.
_CHANCE: Final = 1e-4
_FEWEST_TO_GROW: Final = 16
_GROWS: Final = 0.02
# Noise of all of a record, in that of its quietest part, from which on it has no one N. Up to there
# the interval of an answer reaches as far as that.
_SPOILS: Final = 1.5
# Samples of which the noise between lines is looked at alone, the most.
_MOST: Final = 2**23
# Bands with a level each, since a dither wanders by a hundredth of the rate, and times that level
# that its skirts keep.
_BANDS: Final = 24
_KEPT_LINES: Final = 3.0


def unsteady_notes(recording: Recording, profile: Profile) -> Notes:
    """Blocks whose noise is far above that of the quiet ones, or noise that grows: a warning.

    On a bench: a table that starts and stops changes noise by right.
    """
    if not profile.standing or profile.typical.size < _FEWEST_BLOCKS or profile.is_coarse:
        return ()
    found = _loud(recording, profile) or _growing(profile)
    if not found or not 2 * EDGE < profile.changes.size <= _MOST:
        return found
    # Lines and resonances come and go by right: the noise between them tells.
    white = whitened(profile.changes, bands=_BANDS, kept=_KEPT_LINES).values
    channel = profile.channel
    between = Profile(
        channel=Channel(
            name=channel.name,
            kind="increment",
            values=np.pad(white, EDGE, mode="reflect"),
            sensor=channel.sensor,
        ),
        sample_rate=profile.sample_rate,
    )
    return _loud(recording, between) or _growing(between)


def _loud(recording: Recording, profile: Profile) -> Notes:
    power = profile.typical
    quiet, at = float(np.quantile(power, 0.25)), int(np.argmax(power))
    chance = 1.0 + _UNSTEADY_SIGMAS * math.sqrt(_POWER_VARIANCE / profile.block)
    if quiet <= 0.0 or power[at] <= max(chance, _LEAST_FACTOR**2) * quiet:
        return ()
    text = (
        f"its noise changes: the loudest {profile.block / recording.sample_rate:.3g} s, at "
        f"{second_of(recording, at * profile.block):.6g} s, have {math.sqrt(power[at] / quiet):.3g}"
        " times the scatter of the quiet quarter; take an even stretch with {slice}"
    )
    return _changing(profile.name, text, math.sqrt(float(power.mean()) / quiet))


def _growing(profile: Profile) -> Notes:
    """Noise that grows or falls from one end to the other."""
    power = profile.spread
    if power.size < _FEWEST_TO_GROW or not np.all(power > 0.0):
        return ()
    height = np.log(power)
    along = np.linspace(-0.5, 0.5, power.size)
    slope = float(along @ height / (along @ along))
    rest = height - height.mean() - slope * along
    # Neighbours tell the scatter of a block; noise that wanders slowly is in the rest alone.
    own = max(float(np.mean(np.diff(height) ** 2)) / 2.0, float(np.mean(rest**2)))
    error = math.sqrt(own / float(along @ along))
    reach = float(stdtrit(power.size - 2, 1.0 - 0.5 * _CHANCE))
    effect = math.sqrt(float(np.exp(np.abs(slope) * (along + 0.5)).mean()))
    if abs(slope) <= reach * error or effect < 1.0 + _GROWS:
        return ()
    text = (
        f"its noise {'grows' if slope > 0.0 else 'falls'} in the course of the record, to "
        f"{math.exp(0.5 * slope):.3g} times its scatter; take an even stretch with {{slice}}"
    )
    return _changing(profile.name, text, effect)


def _changing(channel: str, text: str, effect: float) -> Notes:
    """Noise of which the mean is `effect` times the quietest: no one N is that of the record."""
    text = f"{text}; the angle random walk of all of it is about {effect:.3g} times the least"
    level: Level = "error" if effect > _SPOILS else "warning"
    known = float(f"{effect:.4g}")
    return (Note(name="unsteady", channel=channel, text=text, effect=known, level=level),)


# ---- steps of the rate -------------------------------------------------------------

# Blocks for which a rate stays before and behind a step.
_STAYS: Final = 3
# Usual changes, by their upper quartile, that a step exceeds: chance makes five.
_STEP: Final = 10.0


def step_notes(recording: Recording, profile: Profile) -> Notes:
    """A rate that steps from one block to the next, and stays there, on a bench: a warning."""
    if not profile.standing or profile.level.size <= _FEWEST_BLOCKS:
        return ()
    level = profile.level
    changes = np.abs(np.diff(level))
    # The median of counts moves by steps of the readout, or not at all.
    usual = max(float(np.quantile(changes, 0.75)), profile.step)
    # The median of one block of a dithered gyro may lie anywhere; that of three does not.
    stays = np.median(np.stack([level[:-2], level[1:-1], level[2:]]), axis=0)
    steps = np.abs(stays[_STAYS:] - stays[:-_STAYS])
    at = int(np.argmax(steps))
    if steps[at] <= _STEP * usual or usual <= 0.0:
        return ()
    first = at + 2 + int(np.argmax(changes[at + 1 : at + 1 + _STAYS]))
    size = f"{steps[at] / usual:.3g}"
    period = f"{profile.block / recording.sample_rate:.3g} s"
    of_what = (
        f"{size} steps of the readout from one {period} to the next"
        if usual == profile.step
        else f"{size} times what it usually changes over {period}"
    )
    text = (
        f"its rate steps by {of_what}, at {second_of(recording, first * profile.block):.6g} s; "
        "take a stretch without with {slice}"
    )
    return (Note(name="steps", channel=profile.name, text=text, level="warning"),)
