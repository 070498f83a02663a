"""Noise that changes in the course of a record."""

import math
from typing import Final

import numpy as np

from sagnac.errors import Note
from sagnac.recording.channel import Channel
from sagnac.recording.effects import finding
from sagnac.recording.model import Recording, second_of
from sagnac.recording.profile import Profile

# Scatters of a block's power by which the loudest exceeds the quiet ones, and least factor.
_SIGMAS: Final = 7.0
_LEAST_FACTOR: Final = 1.2
# Variance of the mean of n squares of differences of neighbouring normal numbers, in units of its
# square and of 1/n: 2 for independent ones, and half as much again since neighbours share one.
_POWER_VARIANCE: Final = 3.0
_FEWEST_BLOCKS: Final = 8
# Blocks for which a rate stays before and behind a step.
_STAYS: Final = 3
# Usual changes, by their upper quartile, that a step exceeds: chance makes five.
_STEP: Final = 10.0


def unsteady_notes(recording: Recording, gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """Blocks whose noise is far above that of the quiet ones: a warning."""
    power = profile.typical
    if power.size < _FEWEST_BLOCKS or profile.is_coarse:
        return ()
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
    return (finding("unsteady", gyro.name, text, effect=effect, level="warning"),)


def step_notes(recording: Recording, gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """A rate that steps from one block to the next, and stays there: a warning."""
    level = profile.level
    if level.size <= _FEWEST_BLOCKS:
        return ()
    changes = np.abs(np.diff(level))
    usual = float(np.quantile(changes, 0.75))
    # The median of one block of a dithered gyro may lie anywhere; that of three does not.
    stays = np.median(np.stack([level[:-2], level[1:-1], level[2:]]), axis=0)
    steps = stays[_STAYS:] - stays[:-_STAYS]
    at = int(np.argmax(np.abs(steps)))
    if abs(steps[at]) <= _STEP * usual or usual <= 0.0:
        return ()
    first = at + 2 + int(np.argmax(changes[at + 1 : at + 1 + _STAYS]))
    text = (
        f"its rate steps by {abs(steps[at]) / usual:.3g} times what it usually changes over "
        f"{profile.block / recording.sample_rate:.3g} s, at "
        f"{second_of(recording, first * profile.block):.6g} s; take a stretch without with "
        "{slice}"
    )
    return (Note(name="steps", channel=gyro.name, text=text, level="warning"),)
