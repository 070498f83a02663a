"""Noise that changes in the course of a record."""

import math
from typing import Final

import numpy as np
from scipy.special import stdtrit

from sagnac.errors import Level, Note
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording, second_of
from sagnac.recording.profile import Profile, profile_of
from sagnac.recording.white import EDGE, whitened

# Scatters of a block's power by which the loudest exceeds the quiet ones, and least factor.
_SIGMAS: Final = 7.0
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


def unsteady_notes(recording: Recording, gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """Blocks whose noise is far above that of the quiet ones, or grows: a warning."""
    power = profile.typical
    if power.size < _FEWEST_BLOCKS or profile.is_coarse:
        return ()
    if not (_loud(recording, gyro, profile) or _growing(gyro, profile)):
        return ()
    if not 2 * EDGE < profile.changes.size <= _MOST:
        return _loud(recording, gyro, profile) or _growing(gyro, profile)
    # Lines and resonances come and go by right: the noise between them tells.
    white = np.pad(whitened(profile.changes, bands=_BANDS, kept=_KEPT).values, EDGE, mode="reflect")
    between = Channel(name=gyro.name, kind="increment", values=white, sensor=gyro.sensor)
    profile = profile_of(between)
    return _loud(recording, between, profile) or _growing(between, profile)


def _loud(recording: Recording, gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    power = profile.typical
    quiet = float(np.quantile(power, 0.25))
    highest = float(power.max())
    chance = 1.0 + _SIGMAS * math.sqrt(_POWER_VARIANCE / profile.block)
    if quiet <= 0.0 or highest <= max(chance, _LEAST_FACTOR**2) * quiet:
        return ()
    at = int(np.argmax(power))
    effect = math.sqrt(float(power.mean()) / quiet)
    text = (
        f"its noise changes: the loudest {profile.block / recording.sample_rate:.3g} s, at "
        f"{second_of(recording, at * profile.block):.6g} s, have {math.sqrt(highest / quiet):.3g} "
        "times the scatter of the quiet quarter; take an even stretch with {slice}"
    )
    return (_changing(gyro, text, effect),)


def _growing(gyro: Channel, profile: Profile) -> tuple[Note, ...]:
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
    return (_changing(gyro, text, effect),)


def _changing(gyro: Channel, text: str, effect: float) -> Note:
    """Noise of which the mean is `effect` times the quietest: no one N is that of the record."""
    said = f"{text}; the angle random walk of all of it is about {effect:.3g} times the least"
    level: Level = "error" if effect > _SPOILS else "warning"
    return Note(
        name="unsteady", channel=gyro.name, text=said, effect=float(f"{effect:.4g}"), level=level
    )


def step_notes(recording: Recording, gyro: Channel, profile: Profile) -> tuple[Note, ...]:
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
    return (Note(name="steps", channel=gyro.name, text=text, level="warning"),)
