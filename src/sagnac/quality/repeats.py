"""Samples that repeat the one before, blocks that stand twice, and gyros that copy another."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray, blocks, every
from sagnac.core.errors import Note, counted
from sagnac.quality import _kernels
from sagnac.quality.effects import finding
from sagnac.quality.profile import Profile, count_step
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording, second_of
from sagnac.recording.stamps import Places, changes

# ---- repeats -----------------------------------------------------------------------

# Repeats are this many, and this many times as many as the smallest changes there are. Noise
# repeats itself half as often as it makes one of the two smallest changes, if it is read out in
# steps of a third of its scatter or finer.
_LEAST_OFTEN: Final = 10
_OFTENER: Final = 3
_FINE: Final = 3.0
# Samples whose values are counted.
_LOOKED_AT: Final = 20_000
# Changes below this part of the scatter are rounding.
_ROUNDING: Final = 1e-9
# Runs of this many samples are a channel that sticks; shorter ones are samples that are held.
_STICKS: Final = 8
# Share of held samples from which on they are how the recorder works: it is faster than the gyro.
_ALL_HELD: Final = 0.45


def repeat_notes(recording: Recording, profile: Profile) -> tuple[Note, ...]:
    """Repeats that no readout step explains."""
    gyro = profile.channel
    if not _is_unexplained(gyro, profile):
        return ()
    count, first, in_runs = repeats_of(gyro)
    samples = gyro.values.size
    share = count / samples
    held = (count - in_runs) / samples
    text = (
        f"{counted(count, 'sample')} repeat the one before, the first at "
        f"{second_of(recording, first):.3f} s"
    )
    if in_runs > held * samples:
        text = f"sticks again and again: {text}; take a stretch without with {{slice}}"
        # That of the noise as far as the runs are long; what they make of slower noise is open.
        effect = math.sqrt(1.0 - in_runs / samples)
        return (finding("repeats", gyro.name, text, effect=effect, level="error"),)
    if share > _ALL_HELD:
        text = f"{text}: it is sampled faster than it measures"
        return (Note(name="repeats", channel=gyro.name, text=text, level="warning"),)
    # Runs of held samples have lengths L, and slow noise grows by <L^2>/<L>: (1 + p)/(1 - p).
    effect = math.sqrt((1.0 + held) / (1.0 - held))
    return (finding("repeats", gyro.name, text, effect=effect),)


def _is_unexplained(gyro: Channel, profile: Profile) -> bool:
    """Whether values repeat more often than their steps make them."""
    values = gyro.values
    rounding = _ROUNDING * profile.scale
    zeros = _count(values, lambda steps: steps == 0.0)
    if zeros < _LEAST_OFTEN:
        return False
    step = count_step(values, rounding) if gyro.kind == "angle" else profile.step
    if step * _FINE > math.sqrt(2.0) * profile.scale or not math.isfinite(step):
        return False
    by_steps = 0.5 * _count(
        values, lambda steps: (np.abs(steps) > rounding) & (np.abs(steps) < 1.5 * step)
    )
    return zeros > _OFTENER * max(by_steps, _by_levels(values))


def _count(values: FloatArray, test: Callable[[FloatArray], BooleanArray]) -> int:
    """How many steps from a sample to the next pass a test."""
    return Places(values=values, test=lambda some: test(np.diff(some)), following=1).tally().count


def _by_levels(values: FloatArray) -> float:
    """Repeats of samples that take the same few values in any order."""
    some = every(values, max(1, values.size // _LOOKED_AT))
    counts = np.unique(some, return_counts=True)[1].astype(np.float64)
    return values.size * float(counts @ (counts - 1.0)) / (some.size * (some.size - 1.0))


def repeats_of(gyro: Channel) -> tuple[int, int, int]:
    """How many samples of a channel equal the one before, the first, and how many stick.

    Those stick that are in runs of eight or more.
    """
    count, first, in_runs = 0, -1, 0
    for edges in Places(values=gyro.values, test=changes, following=1).edges():
        lengths = np.diff(edges)
        repeated = np.flatnonzero(lengths > 1)
        first = int(edges[repeated[0]]) + 2 if first < 0 and repeated.size else first
        count += int((lengths - 1).sum())
        in_runs += int((lengths[lengths >= _STICKS] - 1).sum())
    return count, first, in_runs


# ---- twice -------------------------------------------------------------------------

# Samples of a window by which a block is known again, odd numbers that mix their bits, and part of
# all windows that is kept: that whose mixed bits begin with this many zeros, in either block.
_WINDOW: Final = 8
_MIXED_BY: Final = 0x9E3779B97F4A7C15
_ZEROS: Final = 4
# A block is this long at least, and takes this many values: what few steps of a readout make comes
# about by chance.
_LEAST: Final = 64
_VALUES: Final = 16
# Distances between two windows alike that are looked at, the most frequent.
_DISTANCES: Final = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Repetition:
    """A block and its repetition.

    Attributes
    ----------
    first, again
        First sample of either.
    samples
        In the block.
    """

    first: int
    again: int
    samples: int


def twice_notes(recording: Recording, profile: Profile) -> tuple[Note, ...]:
    """The longest block that stands in the record twice: a warning."""
    found = longest_twice(profile.channel.values)
    if found is None:
        return ()
    text = (
        f"{found.samples} samples from {second_of(recording, found.first):.3f} s on are there "
        f"again from {second_of(recording, found.again):.3f} s on: an interval counts them twice; "
        "take a stretch without with {slice}"
    )
    return (finding("repeats", profile.channel.name, text, effect=1.0),)


def longest_twice(values: FloatArray) -> Repetition | None:
    """The longest block that stands in a series twice, value by value; None if there is none.

    Parameters
    ----------
    values
        (samples,)
    """
    if values.size < 2 * _LEAST:
        return None
    parts = [
        _windows(values[block.start : block.stop + _WINDOW - 1], block.start)
        for block in blocks(values.size - _WINDOW + 1)
    ]
    places = np.concatenate([part[0] for part in parts])
    mixed = np.concatenate([part[1] for part in parts])
    # Told by a sort of the numbers alone, in most records, which takes a tenth of that of places.
    ascending = np.sort(mixed)
    if not (ascending[1:] == ascending[:-1]).any():
        return None
    order = np.argsort(mixed, kind="stable")
    alike = np.flatnonzero(ascending[1:] == ascending[:-1])
    apart = places[order[alike + 1]] - places[order[alike]]
    distances, counts = np.unique(apart[apart >= _LEAST], return_counts=True)
    found = [
        block
        for distance in distances[np.argsort(-counts, kind="stable")[:_DISTANCES]].tolist()
        if (block := _at_distance(values, distance)) is not None
    ]
    return max(found, key=lambda block: block.samples, default=None)


def _windows(values: FloatArray, start: int) -> tuple[IntegerArray, IntegerArray]:
    """Places and mixed bits of the windows that are kept."""
    bits = np.ascontiguousarray(values).view(np.uint64)
    mixed = np.empty(bits.size - _WINDOW + 1, dtype=np.uint64)
    # Uncompiled, numpy would warn of the products that wrap around.
    with np.errstate(over="ignore"):
        _kernels.mixed_windows(bits, np.uint64(_MIXED_BY), _WINDOW, mixed)
    kept = np.flatnonzero(mixed >> np.uint64(64 - _ZEROS) == 0)
    return start + kept, mixed[kept].view(np.int64)


def _at_distance(values: FloatArray, distance: int) -> Repetition | None:
    """The longest run of samples that equal those a fixed number of samples later."""
    differs = Places(
        values=values, test=lambda some: some[:-distance] != some[distance:], following=distance
    )
    longest = differs.longest_between(values.size - distance)
    first = longest.first
    # A block that reaches into its repetition is a channel that goes round.
    length = min(longest.samples, distance)
    if length < _LEAST or np.unique(values[first : first + length]).size < _VALUES:
        return None
    return Repetition(first=first, again=first + distance, samples=length)


# ---- pairs -------------------------------------------------------------------------

# Samples by which one gyro may be late, and samples looked at.
_LATEST: Final = 1024
_PAIRS_LOOKED_AT: Final = 2**15
# Correlation from which on one gyro is said to copy another: least, and in units of what chance
# makes; and how many times that without delay, which two gyros on one table have.
_COPIES: Final = 0.05
_SIGMAS: Final = 7.0
_MORE: Final = 2.0
# Parts of the record that have to show the copy, each this share of the correlation or more: lines
# that happen to lie together do not last.
_PARTS: Final = 4
_LASTS: Final = 0.5
# Correlation from which on two gyros may be one, and part of the noise that two differ by.
_ALL_ALIKE: Final = 0.99
_DIFFER: Final = 1e-6
# Ratio of the noise of two gyros from which on their difference is of one of them.
_UNEQUAL: Final = 30.0
# Between the units that angles and rates are written in.
_RATIOS: Final = (180.0 / math.pi, 60.0, 3600.0, 648_000.0 / math.pi)


@dataclass(frozen=True, slots=True, kw_only=True)
class Likeness:
    """How far the noise of one gyro is that of another.

    Attributes
    ----------
    delay
        Samples by which the second comes after the first at the highest correlation.
    correlation
        The highest, at that delay.
    together
        Without delay.
    samples
        How many were compared.
    """

    delay: int
    correlation: float
    together: float
    samples: int


def pair_notes(
    profiles: dict[str, Profile], sense_alike: Callable[[str, str], bool] = lambda *_: False
) -> tuple[Note, ...]:
    """Findings of every two gyros on each other.

    Parameters
    ----------
    profiles
        Of two or more of them, by name.
    sense_alike
        Whether two of them are known to sense the same rate alike: their units are then right.
    """
    notes: list[Note] = []
    # Of hundreds of gyros there are tens of thousands of pairs: what one gyro brings is made once.
    size = min(one.changes.size for one in profiles.values())
    phases = {name: phases_of(one.changes[:size]) for name, one in profiles.items()}
    scales = {name: one.scale for name, one in profiles.items()}
    for first, second in combinations(profiles, 2):
        notes += _copied(first, second, profiles, phases)
        notes += _unequal(first, second, scales, sense_alike)
    return tuple(notes)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Phases:
    """A gyro as it is compared with others.

    Attributes
    ----------
    factors
        (parts, frequencies) of each part of the record: its Fourier transform under a Hann taper,
        with every amplitude 1.
    size
        Samples of a part.
    latest
        Longest delay looked at, samples.
    length
        Of the transforms, padded by these delays, so that nothing comes round.
    """

    factors: NDArray[np.complex64]
    size: int
    latest: int
    length: int


def phases_of(values: FloatArray) -> Phases:
    """The phases of (samples,) what each sample turned."""
    size = min(values.size, _PAIRS_LOOKED_AT) // _PARTS
    latest = min(_LATEST, size // 2)
    parts = values[: _PARTS * size].reshape(_PARTS, size)
    tapered = (parts - parts.mean(axis=1, keepdims=True)) * np.hanning(size)
    length = int(next_fast_len(size + latest, real=True))
    found = rfft(tapered, length)
    power = np.abs(found)
    unit = np.divide(found, power, out=np.zeros_like(found), where=power > 0.0)
    factors = unit.astype(np.complex64)
    return Phases(factors=factors, size=size, latest=latest, length=length)


def likeness(first: Phases, second: Phases) -> Likeness:
    """How far the changes of two gyros are the same at any delay up to 1024 samples.

    Every frequency counts alike, whatever its power: the mean cosine of the phase between the two
    (phase transform of Knapp and Carter, 1976). So lines and sway that both sense weigh as little
    as they are wide; a Hann taper keeps them so. The correlation is the mean over four parts of
    the record; if one of them shows less than half of it, there is none.

    Parameters
    ----------
    first, second
        Of records of one length.
    """
    cross = np.conj(first.factors) * second.factors
    delays = np.arange(-first.latest, first.latest + 1)
    mean = irfft(cross.mean(axis=0), first.length)[delays]
    best, correlation = first.latest, 0.0
    # Four transforms more only if there is something to confirm.
    if np.abs(mean).max() >= _COPIES:
        parts = irfft(cross, first.length)[:, delays]
        lasts = np.all(parts * np.sign(mean) >= _LASTS * np.abs(mean), axis=0)
        best = int(np.argmax(np.abs(mean) * lasts))
        correlation = float(mean[best] * lasts[best])
    return Likeness(
        delay=best - first.latest,
        correlation=correlation,
        together=float(mean[first.latest]),
        samples=_PARTS * first.size,
    )


def _copied(
    first: str, second: str, profiles: dict[str, Profile], phases: dict[str, Phases]
) -> list[Note]:
    one, other = profiles[first].changes, profiles[second].changes
    found = likeness(phases[first], phases[second])
    if found.delay:
        alike = abs(found.correlation)
        least = max(_COPIES, _SIGMAS / math.sqrt(found.samples), _MORE * abs(found.together))
        if alike < least:
            return []
        late, early = (second, first) if found.delay > 0 else (first, second)
        text = (
            f"repeats gyro {early} {counted(abs(found.delay), 'sample')} later (correlation "
            f"{found.correlation:+.3g}): the two share their noise, which their difference hides; "
            "name another gyro ({gyros})"
        )
        return [finding("copy", late, text, effect=math.sqrt(max(1.0 - alike, 0.0)))]
    if found.together < _ALL_ALIKE or not _is_same(one, other):
        return []
    text = f"is a copy of gyro {first}; name another gyro ({{gyros}})"
    return [finding("copy", second, text, effect=0.0 if found.correlation > 0.0 else None)]


def _is_same(one: FloatArray, other: FloatArray) -> bool:
    """Whether one gyro is the other times a number, to a millionth of the noise."""
    some, more = np.diff(one[:_PAIRS_LOOKED_AT]), np.diff(other[:_PAIRS_LOOKED_AT])
    size = min(some.size, more.size)
    some, more = some[:size], more[:size]
    rest = more - some * float(some @ more) / float(some @ some)
    return float(rest @ rest) < _DIFFER**2 * float(more @ more)


def _unequal(
    first: str, second: str, scales: dict[str, float], sense_alike: Callable[[str, str], bool]
) -> list[Note]:
    quiet, loud = sorted((first, second), key=lambda name: scales[name])
    if not 0.0 < _UNEQUAL * scales[quiet] < scales[loud]:
        return []
    ratio = scales[loud] / scales[quiet]
    if sense_alike(quiet, loud):
        text = (
            f"its noise is {ratio:.4g} times below that of gyro {loud}, though both sense the "
            f"table alike: {loud} or its mount may vibrate; see each alone ({{gyros}})"
        )
        return [finding("units", quiet, text, effect=1.0)]
    near = [size for size in _RATIOS if 0.5 < ratio / size < 2.0]
    hint = f", about a unit's {near[0]:.4g}" if near else ""
    text = (
        f"its noise is {ratio:.4g} times below that of gyro {loud}{hint}: a unit may be wrong "
        "({unit}), and their difference is of one gyro alone; see each alone ({gyros})"
    )
    return [finding("units", quiet, text, effect=math.sqrt(0.5))]
