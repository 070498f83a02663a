"""Gyros beside each other: one that copies another, and units that do not go together."""

import math
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from sagnac.arrays import FloatArray
from sagnac.errors import Note, counted
from sagnac.recording.effects import finding
from sagnac.recording.model import Recording
from sagnac.recording.profile import Profile

# Samples by which one gyro may be late, and samples looked at.
_LATEST: Final = 1024
_LOOKED_AT: Final = 2**15
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


def pair_notes(recording: Recording, profiles: dict[str, Profile]) -> tuple[Note, ...]:
    """Findings of every two gyros on each other.

    Parameters
    ----------
    recording
        It names the gyros.
    profiles
        Of two or more of them, by name.
    """
    del recording
    notes: list[Note] = []
    # Of hundreds of gyros there are tens of thousands of pairs: what one gyro brings is made once.
    size = min(one.changes.size for one in profiles.values())
    phases = {name: phases_of(one.changes[:size]) for name, one in profiles.items()}
    scales = {name: one.scale for name, one in profiles.items()}
    for first, second in combinations(profiles, 2):
        notes += _copied(first, second, profiles, phases)
        notes += _unequal(first, second, scales)
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
    """

    factors: NDArray[np.complex64]
    size: int
    latest: int

    @property
    def length(self) -> int:
        """Padded by the delays that are looked at, so that nothing comes round."""
        return _padded(self.size, self.latest)


def phases_of(values: FloatArray) -> Phases:
    """The phases of (samples,) what each sample turned."""
    size = min(values.size, _LOOKED_AT) // _PARTS
    latest = min(_LATEST, size // 2)
    parts = values[: _PARTS * size].reshape(_PARTS, size)
    tapered = (parts - parts.mean(axis=1, keepdims=True)) * np.hanning(size)
    found = rfft(tapered, _padded(size, latest))
    power = np.abs(found)
    unit = np.divide(found, power, out=np.zeros_like(found), where=power > 0.0)
    return Phases(factors=unit.astype(np.complex64), size=size, latest=latest)


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


def _padded(size: int, latest: int) -> int:
    return int(next_fast_len(size + latest, real=True))


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
    some, more = np.diff(one[:_LOOKED_AT]), np.diff(other[:_LOOKED_AT])
    size = min(some.size, more.size)
    some, more = some[:size], more[:size]
    rest = more - some * float(some @ more) / float(some @ some)
    return float(rest @ rest) < _DIFFER**2 * float(more @ more)


def _unequal(first: str, second: str, scales: dict[str, float]) -> list[Note]:
    quiet, loud = sorted((first, second), key=lambda name: scales[name])
    if not 0.0 < _UNEQUAL * scales[quiet] < scales[loud]:
        return []
    ratio = scales[loud] / scales[quiet]
    near = [size for size in _RATIOS if 0.5 < ratio / size < 2.0]
    hint = f", about a unit's {near[0]:.4g}" if near else ""
    text = (
        f"its noise is {ratio:.4g} times below that of gyro {loud}{hint}: a unit may be wrong "
        "({unit}), and their difference is of one gyro alone; see each alone ({gyros})"
    )
    return [finding("units", quiet, text, effect=math.sqrt(0.5))]
