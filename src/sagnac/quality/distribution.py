"""Noise that is not distributed as noise is: bent by a soft limit, full of spikes, changing.

Samples that were lost and stand as zeros, and several sensors in one channel by turns.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import stdtrit

from sagnac.core.arrays import FloatArray, blocks, every, mean
from sagnac.core.errors import Level, Note, counted
from sagnac.quality.effects import finding
from sagnac.quality.profile import EDGE, Profile, profile_of, rounding_of, whitened
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording, second_of
from sagnac.recording.stamps import Places, Tally

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


def flat_notes(recording: Recording, profile: Profile) -> tuple[Note, ...]:
    """A soft limit, with what it does to N."""
    shape = _shape_in(profile)
    if shape is None or not shape.is_flat:
        return ()
    text = (
        f"large deviations are missing (excess kurtosis {shape.kurtosis:.2g}), as if it came "
        "near the end of its range: a soft saturation; take a wider range"
    )
    effect = _bent_scatter(shape.kurtosis)
    return (finding("clipping", profile.channel.name, text, effect=effect),)


def _bent_scatter(kurtosis: float) -> float:
    """Standard deviation behind a soft limit, of a normal number's of 1, by its excess kurtosis.

    That of x - a x^3 is 1 - 3 a and its excess kurtosis -24 a. The next order is that of a
    hyperbolic tangent; for an arc tangent and x / sqrt(1 + x^2) it is good to 0.01 up to a limit at
    2.5 standard deviations.
    """
    return 1.0 + kurtosis / 8.0 - 0.075 * kurtosis**2


def heavy_notes(recording: Recording, profile: Profile) -> tuple[Note, ...]:
    """Noise that is full of spikes: a warning."""
    shape = _shape_in(profile)
    if shape is None or not shape.is_heavy:
        return ()
    text = (
        f"its noise is no even noise (skewness {shape.skewness:.2g}, excess kurtosis "
        f"{shape.kurtosis:.2g}): spikes or bursts are a part of it, and of its angle random "
        "walk"
    )
    return (Note(name="spikes", channel=profile.channel.name, text=text, level="warning"),)


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
_KEPT: Final = 3.0
# Blocks for which a rate stays before and behind a step.
_STAYS: Final = 3
# Usual changes, by their upper quartile, that a step exceeds: chance makes five.
_STEP: Final = 10.0


def unsteady_notes(recording: Recording, profile: Profile) -> tuple[Note, ...]:
    """Blocks whose noise is far above that of the quiet ones, or grows: a warning."""
    power = profile.typical
    if power.size < _FEWEST_BLOCKS or profile.is_coarse:
        return ()
    found = _loud(recording, profile) or _growing(profile)
    if not found or not 2 * EDGE < profile.changes.size <= _MOST:
        return found
    # Lines and resonances come and go by right: the noise between them tells.
    white = np.pad(whitened(profile.changes, bands=_BANDS, kept=_KEPT).values, EDGE, mode="reflect")
    gyro = profile.channel
    between = profile_of(
        Channel(name=gyro.name, kind="increment", values=white, sensor=gyro.sensor)
    )
    return _loud(recording, between) or _growing(between)


def _loud(recording: Recording, profile: Profile) -> tuple[Note, ...]:
    power = profile.typical
    quiet = float(np.quantile(power, 0.25))
    highest = float(power.max())
    chance = 1.0 + _UNSTEADY_SIGMAS * math.sqrt(_POWER_VARIANCE / profile.block)
    if quiet <= 0.0 or highest <= max(chance, _LEAST_FACTOR**2) * quiet:
        return ()
    at = int(np.argmax(power))
    effect = math.sqrt(float(power.mean()) / quiet)
    text = (
        f"its noise changes: the loudest {profile.block / recording.sample_rate:.3g} s, at "
        f"{second_of(recording, at * profile.block):.6g} s, have {math.sqrt(highest / quiet):.3g} "
        "times the scatter of the quiet quarter; take an even stretch with {slice}"
    )
    return (_changing(profile.channel.name, text, effect),)


def _growing(profile: Profile) -> tuple[Note, ...]:
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
    grown = np.exp(np.abs(slope) * (along + 0.5))
    effect = math.sqrt(float(grown.mean()))
    if abs(slope) <= reach * error or effect < 1.0 + _GROWS:
        return ()
    text = (
        f"its noise {'grows' if slope > 0.0 else 'falls'} in the course of the record, to "
        f"{math.exp(0.5 * slope):.3g} times its scatter; take an even stretch with {{slice}}"
    )
    return (_changing(profile.channel.name, text, effect),)


def _changing(channel: str, text: str, effect: float) -> Note:
    """Noise of which the mean is `effect` times the quietest: no one N is that of the record."""
    said = f"{text}; the angle random walk of all of it is about {effect:.3g} times the least"
    level: Level = "error" if effect > _SPOILS else "warning"
    return Note(
        name="unsteady", channel=channel, text=said, effect=float(f"{effect:.4g}"), level=level
    )


def step_notes(recording: Recording, profile: Profile) -> tuple[Note, ...]:
    """A rate that steps from one block to the next, and stays there: a warning."""
    level = profile.level
    if level.size <= _FEWEST_BLOCKS:
        return ()
    changes = np.abs(np.diff(level))
    # The median of counts moves by steps of the readout, or not at all.
    usual = max(float(np.quantile(changes, 0.75)), profile.step)
    # The median of one block of a dithered gyro may lie anywhere; that of three does not.
    stays = np.median(np.stack([level[:-2], level[1:-1], level[2:]]), axis=0)
    steps = stays[_STAYS:] - stays[:-_STAYS]
    at = int(np.argmax(np.abs(steps)))
    if abs(steps[at]) <= _STEP * usual or usual <= 0.0:
        return ()
    first = at + 2 + int(np.argmax(changes[at + 1 : at + 1 + _STAYS]))
    size = f"{abs(steps[at]) / usual:.3g}"
    period = f"{profile.block / recording.sample_rate:.3g} s"
    of_what = (
        f"{size} steps of the readout from one {period} to the next"
        if usual == profile.step
        else f"{size} times what it usually changes over {period}"
    )
    text = (
        f"its rate steps by {of_what}, at "
        f"{second_of(recording, first * profile.block):.6g} s; take a stretch without with "
        "{slice}"
    )
    return (Note(name="steps", channel=profile.channel.name, text=text, level="warning"),)


# ---- dropouts ----------------------------------------------------------------------

# Zeros that are dropouts are this many, and this many times as many as the values next to zero.
_LEAST_OFTEN: Final = 10
_OFTENER: Final = 3
# Steps of the readout that noise strays over if a sample is 0 by chance alone; and standard
# deviations of the noise by which 0 lies off the rest, however coarse the steps.
_FINE: Final = 20.0
_AWAY: Final = 4.0
# An angle falls to zero by this many of its usual steps.
_FALL: Final = 50.0
_NONE: Final = Tally(count=0, first=-1)


def dropout_notes(recording: Recording, profile: Profile) -> tuple[Note, ...]:
    """Zeros far more often than the values beside zero; of an angle, zeros that it falls to."""
    gyro = profile.channel
    if gyro.kind == "angle":
        zeros, effect = _falls(profile), None
    else:
        # A gyro that counts coarsely, and turns little, counts 0 most of the time.
        fine = profile.scale > _FINE * profile.step
        away = abs(float(np.median(profile.level))) > _AWAY * profile.scale
        zeros = _zeros(gyro) if fine or away else _NONE
        effect = _effect(gyro, zeros.count)
    if zeros.count == 0:
        return ()
    text = (
        f"{counted(zeros.count, 'sample')} of exactly zero, the first at "
        f"{second_of(recording, zeros.first):.3f} s, as if readings were lost (dropouts); mark "
        "lost samples as NaN"
    )
    return (finding("dropouts", gyro.name, text, effect=effect),)


def _zeros(gyro: Channel) -> Tally:
    """Zeros of a rate or of increments, if they are too many."""
    values = gyro.values
    zeros = Places(values=values, test=lambda some: some == 0.0).tally()
    if zeros.count < _LEAST_OFTEN:
        return _NONE
    next_up, next_down = math.inf, -math.inf
    for block in blocks(values.size):
        part = values[block]
        next_up = float(part[part > 0.0].min(initial=next_up))
        next_down = float(part[part < 0.0].max(initial=next_down))
    ups = Places(values=values, test=lambda some: some == next_up).tally().count
    downs = Places(values=values, test=lambda some: some == next_down).tally().count
    return zeros if zeros.count > _OFTENER * max(ups, downs) else _NONE


def _falls(profile: Profile) -> Tally:
    """Zeros that an angle falls to from far away."""
    values = profile.channel.values
    steps = every(profile.changes, max(1, profile.changes.size // 100_000))
    fall = _FALL * float(np.median(np.abs(steps)))
    if not fall:
        return _NONE
    falls = Places(
        values=values, test=lambda some: (some[1:] == 0.0) & (np.abs(some[:-1]) > fall), following=1
    ).tally()
    return Tally(count=falls.count, first=falls.first + 1)


def _effect(gyro: Channel, zeros: int) -> float | None:
    """Scatter of all samples over that without the zeros."""
    values = gyro.values
    left = values.size - zeros
    if not 0 < zeros < values.size - 1:
        return None
    usual = mean(values) * values.size / left
    squares = 0.0
    for block in blocks(values.size):
        part = values[block]
        part = part[part != 0.0] - usual
        squares += float(part @ part)
    inside = squares / left
    # Zeros lie by the mean off the rest.
    share = zeros / values.size
    whole = (1.0 - share) * inside + share * (1.0 - share) * usual * usual
    return math.sqrt(whole / inside) if inside > 0.0 else None


# ---- interleaved -------------------------------------------------------------------

# How many sensors may take turns. Of four, a line at a quarter of the sample rate (mains at 200 Hz)
# looks alike.
_ORDINALS: Final = {2: "second", 3: "third"}
# Samples looked at, the most and the least, and parts of them that all have to show it.
_TURNS_LOOKED_AT: Final = 2**17
_PARTS: Final = 4
_LEAST_SAMPLES: Final = 4096
# Standard errors by which the means of the turns differ, and least difference, in scatters of one
# sensor; ratio of their scatters.
_TURN_SIGMAS: Final = 8.0
_LEAST_SHARE: Final = 0.5
_RATIO: Final = 1.3
# Scatters beyond which a sample counts as if it were there.
_FAR: Final = 5.0
# Median of the size of the difference of two standard normal numbers.
_MEDIAN_STEP: Final = 0.9539


def interleaved_notes(recording: Recording, profile: Profile) -> tuple[Note, ...]:
    """Every second sample, or every third, has a mean or a scatter of its own: an error.

    One sensor has that only of a line at exactly half its sample rate, or a third.
    """
    channel = profile.channel
    rounding = rounding_of(channel)
    for sensors in _ORDINALS:
        if _take_turns(profile, sensors, rounding):
            text = (
                f"every {_ORDINALS[sensors]} sample is of another kind: {sensors} sensors seem to "
                "stand in this column by turns; write each into a column of its own"
            )
            return (Note(name="interleaved", level="error", channel=channel.name, text=text),)
    return ()


def _take_turns(profile: Profile, sensors: int, rounding: float) -> bool:
    """Whether samples `sensors` apart are alike and those between are not, all along."""
    changes = profile.changes[:_TURNS_LOOKED_AT]
    if changes.size < _LEAST_SAMPLES:
        return False
    turns = _turns(changes, sensors)
    typical = float(np.median(_scatters(turns)))
    if not typical > rounding:
        return False
    # Motion is taken off by the mean of each round, and single samples far off shift no mean.
    off = turns - turns.mean(axis=2, keepdims=True)
    middle = np.median(off, axis=1)
    reach = _FAR * typical
    means = middle + np.clip(off - middle[:, np.newaxis], -reach, reach).mean(axis=1)
    least = max(_TURN_SIGMAS * typical / math.sqrt(turns.shape[1]), _LEAST_SHARE * typical)
    # The same one in every part, on the same side.
    apart = np.all(np.abs(means) > least, axis=0)
    if (apart & (np.abs(np.sign(means).sum(axis=0)) == _PARTS)).any():
        return True
    # Some turns see more of a line at a part of the sample rate: the noise between lines tells.
    white = whitened(changes)
    if not white.innovation > rounding:
        return False
    scatters = _scatters(_turns(white.values, sensors))
    order = np.argsort(scatters, axis=1)
    louder = scatters.max(axis=1) > _RATIO * scatters.min(axis=1)
    return bool(louder.all() and (order == order[0]).all())


def _turns(values: FloatArray, sensors: int) -> FloatArray:
    """(parts, rounds, sensors)"""
    length = values.size // _PARTS // sensors
    return values[: _PARTS * length * sensors].reshape(_PARTS, length, sensors)


def _scatters(turns: FloatArray) -> FloatArray:
    """(parts, sensors) by the median of the steps from each sample to the next of its own turn."""
    return np.asarray(np.median(np.abs(np.diff(turns, axis=1)), axis=1) / _MEDIAN_STEP)
