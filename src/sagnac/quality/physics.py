"""Gravity, Earth rate and what gyros are like, which tell a wrong unit; gyros beside each other.

Rates that no gyro has tell of a wrong unit, noises that differ, and rates of sampling that nobody
uses; gyros that move while nothing tells how stand on no bench, and one may be a copy of another.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from sagnac.core.arrays import FloatArray, every
from sagnac.core.errors import Level, Note, counted
from sagnac.core.units import (
    ACCELERATION_UNITS,
    DEGREE,
    DEGREE_PER_HOUR,
    DEGREE_PER_ROOT_HOUR,
    EARTH_RATE,
    STANDARD_GRAVITY,
    UNITS,
    split_factor,
)
from sagnac.quality.effects import finding
from sagnac.quality.encoder import LEAST_SHARE, TURNING_RATE
from sagnac.quality.profile import Notes, Profile, remedy_of
from sagnac.recording.channel import Channel, angle_of, first_of, longest_unmarked, number_of
from sagnac.recording.model import Recording, second_of

# ---- wrong unit --------------------------------------------------------------------

# No gyro turns at 5000 deg/s for long, and none is stable to 1e-6 deg/h from sample to sample.
FASTEST_RATE: Final = 5000.0 * DEGREE
SLOWEST_RATE: Final = 1e-6 * DEGREE_PER_HOUR
# Ten times the random walk of the noisiest gyros on sale.
STRONGEST_WALK: Final = 60.0 * DEGREE_PER_ROOT_HOUR
# Gyros are read at 1 Hz and faster. Means over longer times are recorded for a day; at 1 Hz a few
# days are usual. If a recording is slower than the first number, Hz, and longer than the second, s,
# its stamps may be ms that were taken as s.
_SLOW_FOR_LONG: Final = ((1.0, 86_400.0), (2.5, 10.0 * 86_400.0))
# Factors between units of time; a usual rate lies between these, most often near the last, Hz.
_TIMES_FINER: Final = {1e3: "ms", 1e6: "us", 1e9: "ns"}
_USUAL: Final = (5.0, 2e4)
_COMMON: Final = 200.0


def _doubt(channel: str, text: str, level: Level = "warning") -> Notes:
    """The note that a unit may be wrong; none without a text."""
    return (Note(name="units", level=level, channel=channel, text=text),) if text else ()


def rate_notes(recording: Recording, profile: Profile) -> Notes:
    """A gyro that turns too fast, or scatters too little or too much for one: a warning.

    Motion scatters as it likes; on a bench it is noise that does, from sample to sample as from
    second to second.
    """
    rates, text = profile.rates, ""
    typical = float(np.median(np.abs(rates)))
    scatter = float(np.sqrt(np.mean(np.square(np.diff(rates))))) if rates.size > 1 else typical
    is_bench = profile.standing and profile.channel.sensor == "gyro"
    walk = min(scatter * math.sqrt(0.5 * recording.duration / rates.size), profile.walk)
    if typical > FASTEST_RATE:
        text = (
            f"turns at {typical / DEGREE:.3g} deg/s: the unit, kind or rate looks wrong "
            "({unit}, {kind}, {rate})"
        )
    elif scatter < SLOWEST_RATE:
        text = (
            f"scatters by only {scatter / DEGREE_PER_HOUR:.2g} deg/h from second to second: "
            "the unit or kind looks wrong ({unit}, {kind})"
        )
    elif is_bench and walk > STRONGEST_WALK:
        text = (
            f"scatters like an angle random walk of {walk / DEGREE_PER_ROOT_HOUR:.3g} deg/sqrt(h), "
            "over ten times that of the noisiest: the unit or kind looks wrong ({unit}, {kind})"
        )
    return _doubt(profile.name, text)


def time_notes(recording: Recording, profile: Profile) -> Notes:
    """A recording sampled more slowly, and for longer, than gyros are: a warning."""
    factor = likely_time_factor(recording)
    if factor is None:
        return ()
    rate = recording.sample_rate
    text = (
        f"samples stand {1.0 / rate:.4g} s apart, for {recording.duration / 86_400.0:.3g} days, as "
        f"no gyro is read: the unit of time looks {factor:.0f} times too large; if they are those "
        f"of {rate * factor:.6g} Hz, state {{time COLUMN:{_TIMES_FINER[factor]}}} or "
        f"{{rate {rate * factor:.6g}}}"
    )
    return _doubt("time", text)


def likely_time_factor(recording: Recording) -> float | None:
    """By how many times a unit of time too large makes the sample rate unusually slow, if any."""
    rate = recording.sample_rate
    if not any(rate < slow and recording.duration > long for slow, long in _SLOW_FOR_LONG):
        return None
    usual = [one for one in _TIMES_FINER if _USUAL[0] <= rate * one <= _USUAL[1]]
    return min(usual, key=lambda one: abs(math.log(rate * one / _COMMON)), default=None)


# ---- physics -----------------------------------------------------------------------

# Three accelerometers show gravity this well: it differs by 0.5 % over the Earth, and cheap sensors
# have biases of a few hundredths of it.
_GRAVITY: Final = 0.05
# A mean that is Earth's rate to this in another unit than its own is hardly chance: the biases of
# one unit in a hundred make it. A ring laser unit at rest is known to show 14.76 deg/h of 15.04.
_EARTH: Final = 0.025
# Earth's rate with biases: up to this many times more or less is no sign of another unit.
_BIASED: Final = 3.0
# Gravity in numbers called rates, to this.
_AS_RATES: Final = 0.01
_TRIAD: Final = 3
# Blocks of a record whose means tell that it stands still, and their scatter, of the mean.
_PARTS: Final = 8
_STEADY: Final = 0.02
# Units that a rate is taken in by mistake, and those of an angle.
_RATES: Final = ("deg/s", "rad/s", "deg/h")
_ANGLES: Final = ("arcsec", "deg", "rad")
# Earth rate across a table's axis, of Earth's: least and most of it that a table shows. Below lie
# only the poles of the Earth, and tables whose axis points there.
_ACROSS: Final = (0.02, 1.2)
# Share from which on a gyro lies too near the axis to sense what is across it.
_ALONG: Final = 0.9
_TURNS: Final = 4.0
_FITTED: Final = 20_000


def gravity_notes(recording: Recording, profile: Profile) -> Notes:
    """Accelerometers at rest whose mean is no gravity, but is in another unit: a warning."""
    forces = recording.accelerometers
    if not forces:
        return ()
    size = _steady_mean(Profile.of(recording, one) for one in forces)
    factor, stated = split_factor(forces[0].shown_in)
    is_gravity = _is_near(size, STANDARD_GRAVITY, _GRAVITY)
    if not size > 0.0 or is_gravity or stated not in ACCELERATION_UNITS or factor != 1.0:
        return ()
    number = size / ACCELERATION_UNITS[stated]
    likely = [
        unit
        for unit, one in ACCELERATION_UNITS.items()
        if unit != stated and _is_near(number * one, STANDARD_GRAVITY, _GRAVITY)
    ]
    if not likely:
        return ()
    text = (
        f"their mean is {number:.4g} {stated}, and gravity is "
        f"{STANDARD_GRAVITY / ACCELERATION_UNITS[stated]:.4g} {stated}: in {likely[0]} it would be "
        f"gravity; state {{unit accelerometers={likely[0]}}}"
    )
    return _doubt(", ".join(one.name for one in forces), text)


def earth_notes(recording: Recording, profile: Profile) -> Notes:
    """Gyros at rest whose mean is Earth's rate in another unit, or is gravity: a warning.

    Three gyros across one another sense all of Earth's rate. Three accelerometers read as gyros
    show one g, or 9.8.
    """
    gyros = recording.gyros
    if not profile.standing or any(gyro.sensor != "gyro" for gyro in gyros):
        return ()
    size = _steady_mean(profile.each(recording))
    text = _as_gravity(gyros[0], size) or _as_earth_rate(gyros, size)
    return _doubt(", ".join(one.name for one in gyros), text)


def _as_gravity(gyro: Channel, size: float) -> str:
    """Sentence on a mean that is gravity, in numbers called rates; empty if it is not."""
    factor, stated = split_factor(gyro.shown_in)
    if gyro.kind != "rate" or factor != 1.0:
        return ""
    number = size / UNITS[stated].size
    for gravity, unit in ((1.0, "g"), (STANDARD_GRAVITY, "m/s^2")):
        if _is_near(number, gravity, _AS_RATES):
            return (
                f"their mean is {number:.4g}, which is gravity in {unit}: they look like "
                "accelerometers; name the gyros ({columns}), and these with {accelerometers}"
            )
    return ""


def _as_earth_rate(gyros: tuple[Channel, ...], size: float) -> str:
    """Sentence on a mean that is Earth's rate in another unit; empty if it is not."""
    stated = {(gyro.shown_in, gyro.kind) for gyro in gyros}
    if len(gyros) < _TRIAD or len(stated) > 1 or 1.0 / _BIASED < size / EARTH_RATE < _BIASED:
        return ""
    factor, name = split_factor(gyros[0].shown_in)
    for unit in _RATES if gyros[0].kind == "rate" else _ANGLES:
        other = size / UNITS[name].size * UNITS[unit].size
        if unit != name and _is_near(other, EARTH_RATE, _EARTH):
            said = unit if factor == 1.0 else f"{factor:g}{unit}"
            return (
                f"their mean rate is {size / DEGREE_PER_HOUR:.4g} deg/h, and in {said} it would be "
                f"{other / DEGREE_PER_HOUR:.4g} deg/h, that of the Earth (15.04): unless "
                f"biases make that by chance, the unit is wrong; state {{unit {said}}}"
            )
    return ""


def _steady_mean(profiles: Iterable[Profile]) -> float:
    """Mean rate of channels across one another, in SI; NaN if they do not stand still."""
    parts = [[float(part.mean()) for part in np.array_split(one.rates, _PARTS)] for one in profiles]
    means = np.array(parts)
    if not np.isfinite(means).all():
        return math.nan
    size = float(np.linalg.norm(means.mean(axis=1)))
    return size if np.linalg.norm(means.std(axis=1)) < _STEADY * size else math.nan


def _is_near(value: float, wanted: float, within: float) -> bool:
    return wanted * (1.0 - within) <= value <= wanted * (1.0 + within)


def earth_on_table_notes(recording: Recording, profile: Profile) -> Notes:
    """A turning table that shows no Earth rate, and would in another unit of time: an error.

    Across its axis Earth rate is a cosine of the table's angle. In a gyro's angle it has the
    amplitude of that rate over the table's, whatever the unit of time that both were stated in. A
    rate in a wrong unit of time contradicts the table's anyway.
    """
    factor, table, gyro = likely_time_factor(recording), recording.table, profile.channel
    if profile.standing or factor is None or table is None or gyro.kind == "rate":
        return ()
    step = max(1, recording.samples // _FITTED)
    angle = every(table.values, step)
    turned = abs(float(angle[-1] - angle[0]))
    if turned < _TURNS * 2.0 * math.pi:
        return ()
    columns = np.stack([np.ones_like(angle), angle, np.cos(angle), np.sin(angle)], axis=1)
    values = every(angle_of(gyro, recording.sample_rate), step)
    _, share, cosine, sine = np.linalg.lstsq(columns, values, rcond=None)[0]
    if not abs(share) < _ALONG:
        return ()
    across = math.hypot(cosine, sine) * turned / recording.duration / math.sqrt(1.0 - share**2)
    least, most = (EARTH_RATE * one for one in _ACROSS)
    if not (across < least < across * factor < most):
        return ()
    text = (
        f"shows {across / DEGREE_PER_HOUR:.3g} deg/h of Earth rate across a table at "
        f"{turned / recording.duration / DEGREE:.3g} deg/s; if the unit of time is {factor:g} "
        f"times smaller, it shows {factor:g} times as much, as it may: state the right "
        f"{{time COLUMN:UNIT}} or {{rate {recording.sample_rate * factor:.6g}}}"
    )
    return _doubt(gyro.name, text, "error")


# ---- motion ------------------------------------------------------------------------

# Scatters of the mean of a block of noise beyond which it moves.
_SIGMAS: Final = 10.0
# A rate that never changes is the bias of the cheapest gyros up to here, and a table beyond.
_LARGEST_BIAS: Final = 25.0 * DEGREE
# So is one beyond this many times the walk in a root second: 200 deg/s for 1 deg/sqrt(h). Of MEMS
# units as they are sold it is 70 at most.
_BIAS_OVER_WALK: Final = 12_000.0


def motion_notes(recording: Recording, profile: Profile) -> Notes:
    """A gyro that turns now more and now less without an encoder beside: an error.

    Means over seconds that lie farther than 2 deg/s from their median, and farther than noise puts
    them, are motion. What is read then is that of the motion. A mean rate beyond the bias of any
    gyro is a warning; beyond the largest that one of such noise has it is an error, since what is
    read then is the error of the table.
    """
    rates = profile.rates
    if not profile.standing or profile.channel.sensor != "gyro" or rates.size < 2:
        return ()
    middle = float(np.median(rates))
    level: Level = "error"
    limit = max(TURNING_RATE, _SIGMAS * profile.walk / math.sqrt(recording.duration / rates.size))
    moves = np.abs(rates - middle) > limit
    if moves.any():
        between = longest_unmarked(moves)
        edges = np.append(profile.edges[:-1], recording.samples)
        still = slice(int(edges[between.start]), int(edges[between.stop]))
        first = int(edges[first_of(moves)])
        text = (
            f"turns at up to {float(np.abs(rates).max()) / DEGREE:.3g} deg/s, in "
            f"{100.0 * number_of(moves) / rates.size:.2g} % of the record, first at "
            f"{second_of(recording, first):.1f} s, and no encoder is looked at: this "
            f"is no still bench; use sagnac analyze with the encoder ({{table}}), state the right "
            f"{{unit}}, or {remedy_of(recording, still)}"
        )
    else:
        largest = max(TURNING_RATE, _BIAS_OVER_WALK * profile.walk)
        if abs(middle) < min(_LARGEST_BIAS, largest):
            return ()
        level = "error" if abs(middle) >= largest else "warning"
        why = "and no encoder is looked at: use sagnac analyze with it ({table})"
        if recording.table is not None:
            why = "and the encoder that is named does not: name its column and unit with {table}"
        text = (
            f"turns steadily at {middle / DEGREE:.4g} deg/s, as on a table, {why}, or state the "
            "right {unit}"
        )
    return (Note(name="motion", level=level, channel=profile.name, text=text),)


# ---- pairs -------------------------------------------------------------------------

# Samples by which one gyro may be late, and samples looked at.
_LATEST: Final = 1024
_PAIRS_LOOKED_AT: Final = 2**15
# Correlation from which on one gyro is said to copy another: least, and in units of what chance
# makes; and how many times that without delay, which two gyros on one table have.
_COPIES: Final = 0.05
_COPY_SIGMAS: Final = 7.0
_MORE: Final = 2.0
# Parts of the record that have to show the copy, each this share of the correlation or more: lines
# that happen to lie together do not last.
_COPY_PARTS: Final = 4
_LASTS: Final = 0.5
# Correlation from which on two gyros may be one, and part of the noise that two differ by.
_ALL_ALIKE: Final = 0.99
_DIFFER: Final = 1e-6
# Ratio of the noise of two gyros from which on their difference is of one of them.
_UNEQUAL: Final = 30.0
# Between the units that angles and rates are written in.
_RATIOS: Final = (180.0 / math.pi, 60.0, 3600.0, 648_000.0 / math.pi)
# Ratio of two shares of the table that no wrong unit makes.
_ALIKE: Final = 2.0


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
    size = min(values.size, _PAIRS_LOOKED_AT) // _COPY_PARTS
    latest = min(_LATEST, size // 2)
    parts = values[: _COPY_PARTS * size].reshape(_COPY_PARTS, size)
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
        samples=_COPY_PARTS * first.size,
    )


def copy_notes(recording: Recording, profile: Profile) -> Notes:
    """Every gyro that is another or comes after it."""
    gyros = list(profile.together.values())
    if len(gyros) < 2:
        return ()
    # Of hundreds of gyros there are tens of thousands of pairs: what one gyro brings is made once.
    size = min(one.changes.size for one in gyros)
    phases = {one.name: phases_of(one.changes[:size]) for one in gyros}
    return tuple(
        note
        for first, second in combinations(gyros, 2)
        for note in _copied(first, second, likeness(phases[first.name], phases[second.name]))
    )


def _copied(first: Profile, second: Profile, found: Likeness) -> Notes:
    """A gyro that is another, or comes after it."""
    if found.delay:
        alike = abs(found.correlation)
        by_chance = _COPY_SIGMAS / math.sqrt(found.samples)
        if alike < max(_COPIES, by_chance, _MORE * abs(found.together)):
            return ()
        late, early = (second, first) if found.delay > 0 else (first, second)
        text = (
            f"repeats gyro {early.name} {counted(abs(found.delay), 'sample')} later (correlation "
            f"{found.correlation:+.3g}): the two share their noise, which their difference hides; "
            "name another gyro ({gyros})"
        )
        return (finding("copy", late.name, text, effect=math.sqrt(max(1.0 - alike, 0.0))),)
    if found.together < _ALL_ALIKE:
        return ()
    # One is the other times a number, to a millionth of the noise.
    size = min(first.changes.size, second.changes.size, _PAIRS_LOOKED_AT)
    some, more = np.diff(first.changes[:size]), np.diff(second.changes[:size])
    rest = more - some * float(some @ more) / float(some @ some)
    if float(rest @ rest) >= _DIFFER**2 * float(more @ more):
        return ()
    text = f"is a copy of gyro {first.name}; name another gyro ({{gyros}})"
    effect = 0.0 if found.correlation > 0.0 else None
    return (finding("copy", second.name, text, effect=effect),)


def unequal_notes(recording: Recording, profile: Profile) -> Notes:
    """Every gyro whose noise is far below that of another."""
    pairs = combinations(profile.together.values(), 2)
    return tuple(note for first, second in pairs for note in _unequal(first, second))


def _unequal(first: Profile, second: Profile) -> Notes:
    """A gyro whose noise is far below that of another."""
    quiet, loud = sorted((first, second), key=lambda one: one.scale)
    if not 0.0 < _UNEQUAL * quiet.scale < loud.scale:
        return ()
    ratio, effect = loud.scale / quiet.scale, 1.0
    text = f"its noise is {ratio:.4g} times below that of gyro {loud.name}"
    low, high = sorted((abs(quiet.share), abs(loud.share)))
    # Shares of the table's rate that no wrong unit would leave alike.
    if low > LEAST_SHARE and high < _ALIKE * low:
        text += (
            f", though both sense the table alike: {loud.name} or its mount may vibrate; see each "
            "alone ({gyros})"
        )
    else:
        near = [size for size in _RATIOS if 0.5 < ratio / size < 2.0]
        hint, effect = f", about a unit's {near[0]:.4g}" if near else "", math.sqrt(0.5)
        text += (
            f"{hint}: a unit may be wrong ({{unit}}), and their difference is of one gyro alone; "
            "see each alone ({gyros})"
        )
    return (finding("units", quiet.name, text, effect=effect),)
