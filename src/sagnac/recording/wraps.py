"""Signed counts that were read as unsigned."""

import math
from typing import Final

import numpy as np

from sagnac.arrays import FloatArray, blocks, extent
from sagnac.errors import Note, counted
from sagnac.recording.channel import Channel
from sagnac.recording.effects import finding
from sagnac.recording.model import Recording, second_of
from sagnac.recording.profile import Profile
from sagnac.recording.stamps import Places
from sagnac.units import UNITS, split_factor

_BINS: Final = 64
# Share of the range that is empty between the values near its two ends.
_EMPTY: Final = 0.5
# Delays, in samples, at which the ends must differ as often as chance makes them, and how nearly:
# neither a line nor a motion does that.
_DELAYS: Final = (1, 2, 3)
_BY_CHANCE: Final = 0.1
# Share of the samples at either end below which a spike makes it as well.
_LEAST_SHARE: Final = 0.01
# Widths of counters, and how near to one the range has to lie.
_BITS: Final = (8, 12, 16, 18, 20, 24, 32)
_NEAR: Final = 0.02
# An angle falls by this part of all that it covers, which is this many usual steps or more; it
# covers half of that between two falls, and falls are rare.
_FALL: Final = 0.8
_FALL_STEPS: Final = 50.0
_COVERS: Final = 0.5
_MOST_FALLS: Final = 0.1
_LOOKED_AT: Final = 20_000


def wrap_notes(recording: Recording, profile: Profile) -> tuple[Note, ...]:
    """Values at the two ends of a counter's range and none between; an angle that falls by it."""
    gyro = profile.channel
    if gyro.kind == "angle":
        return _falls_of_an_angle(recording, gyro)
    values = gyro.values
    lowest, highest = extent(values)
    middle = _middle_of_gap(values, lowest, highest)
    if middle is None:
        return ()
    bits = _counter_bits(gyro, highest - lowest)
    if bits is None and (_is_one_value(values, middle) or not _is_by_chance(values, middle)):
        return ()
    width = f"a counter of {bits} bits has" if bits else "a counter has"
    text = (
        f"takes values at the two ends of its range and none between, as {width} if signed counts "
        "are read as unsigned; read them as signed, or state the width with {counter-bits}"
    )
    return (finding("wraps", gyro.name, text, effect=_effect(values, middle), level="error"),)


def _falls_of_an_angle(recording: Recording, gyro: Channel) -> tuple[Note, ...]:
    """Steps of an angle, all against its motion, by nearly all that it ever covers."""
    values = gyro.values
    lowest, highest = extent(values)
    covered = highest - lowest
    usual = np.diff(values[: _LOOKED_AT + 1])
    if covered <= _FALL_STEPS * float(np.median(np.abs(usual))):
        return ()
    falls = Places(
        values=values, test=lambda some: np.abs(np.diff(some)) > _FALL * covered, following=1
    )
    found = falls.tally()
    if not 0 < found.count <= _MOST_FALLS * values.size:
        return ()
    at = falls.all()
    steps = values[at + 1] - values[at]
    motion = float(values[-1] - values[0] - steps.sum())
    if not (np.all(steps * motion < 0.0) and abs(motion) > _COVERS * found.count * covered):
        return ()
    text = (
        f"{counted(found.count, 'fall')} by all of the angle that it covers, the first at "
        f"{second_of(recording, found.first + 1):.3f} s, as of a counter that starts over; state "
        "the width of the counter with {counter-bits}, or make the angle continuous"
    )
    return (finding("wraps", gyro.name, text, effect=None),)


def _middle_of_gap(values: FloatArray, lowest: float, highest: float) -> float | None:
    """The middle of an empty half of the range that has many values at both ends."""
    if not highest > lowest:
        return None
    edges = np.linspace(lowest, highest, _BINS + 1)
    counts = np.zeros(_BINS, dtype=np.int64)
    for block in blocks(values.size):
        counts += np.histogram(values[block], edges)[0]
    filled = np.flatnonzero(counts)
    gaps = np.diff(filled) - 1
    if gaps.size == 0 or gaps.max() < _EMPTY * _BINS:
        return None
    at = int(np.argmax(gaps))
    return 0.5 * float(edges[filled[at] + 1] + edges[filled[at + 1]])


def _is_one_value(values: FloatArray, middle: float) -> bool:
    """Whether all samples at one end are equal, as those are that a logger wrote for lost ones."""
    ends: list[FloatArray] = []
    for block in blocks(values.size):
        low, high = values[block][values[block] < middle], values[block][values[block] > middle]
        # Largest and smallest of either end.
        ends.append(np.array([part.max(initial=-math.inf) for part in (low, -low, high, -high)]))
    most = np.max(ends, axis=0)
    return bool(most[0] == -most[1] or most[2] == -most[3])


def _is_by_chance(values: FloatArray, middle: float) -> bool:
    """Whether samples lie at either end independently of those before."""
    longest = max(_DELAYS)
    size = values.size - longest
    counts = np.zeros(1 + len(_DELAYS))
    for block in blocks(size):
        high = values[block.start : block.stop + longest] > middle
        here = high[: block.stop - block.start]
        counts[0] += np.count_nonzero(here)
        for number, delay in enumerate(_DELAYS, start=1):
            counts[number] += np.count_nonzero(here != high[delay : delay + here.size])
    above, *shares = counts / size
    expected = 2.0 * above * (1.0 - above)
    if not _LEAST_SHARE < above < 1.0 - _LEAST_SHARE:
        return False
    return bool(np.all(np.abs(np.array(shares) - expected) < _BY_CHANCE * expected))


def _counter_bits(gyro: Channel, extent: float) -> int | None:
    """Width of a counter whose range the values fill, in counts of the unit they came in."""
    factor, name = split_factor(gyro.shown_in)
    counts = extent / (factor * UNITS[name].size)
    near = [bits for bits in _BITS if abs(counts / 2.0**bits - 1.0) < _NEAR]
    return near[0] if near else None


def _effect(values: FloatArray, middle: float) -> float | None:
    """Scatter of all values over that with the upper end brought down beside the lower."""
    moments = np.zeros(6)
    for block in blocks(values.size):
        part = values[block]
        low, high = part[part <= middle], part[part > middle]
        moments += [low.size, low.sum(), low @ low, high.size, high.sum(), high @ high]
    n, s, q, m, t, r = moments
    inside = (q - s * s / n + r - t * t / m) / (n + m)
    whole = (q + r) / (n + m) - ((s + t) / (n + m)) ** 2
    # Two halves of one bell: together they are about 1/(1 - 2/pi) as scattered as each.
    together = inside / (1.0 - 2.0 / math.pi)
    return math.sqrt(whole / together) if together > 0.0 else None
