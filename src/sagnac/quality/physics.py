"""Gravity, Earth rate and what gyros are like, which tell a wrong unit; gyros beside each other.

Rates that no gyro has tell of a wrong unit, noises that differ, and rates of sampling that nobody
uses; gyros that move while nothing tells how stand on no bench, and one may be a copy of another.
"""

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from sagnac.core import units
from sagnac.core.arrays import BooleanArray, FloatArray, every, median, values_at
from sagnac.core.errors import Level, Note, counted, rounded
from sagnac.core.marks import first_of, longest_unmarked, number_of
from sagnac.core.units import DEGREE, DEGREE_PER_HOUR, EARTH_RATE, STANDARD_GRAVITY, split_factor
from sagnac.quality.distribution import find_bumps
from sagnac.quality.effects import finding, remedy_of
from sagnac.quality.encoder import LEAST_SHARE, TURNING_RATE
from sagnac.quality.profile import LOOKED_AT, Notes, Profile, other_units
from sagnac.recording.channel import Channel, angle_of
from sagnac.recording.model import MINIMUM_SAMPLES, Recording, second_of

# ---- wrong unit --------------------------------------------------------------------

# Factors between units of time, and the unit that is finer than a second by them.
_TIMES_FINER: Final = {1e3: "ms", 1e6: "us", 1e9: "ns"}
_LOOKS_WRONG: Final = "the unit or kind looks wrong ({unit}, {kind})"


def _doubt(channel: str, text: str, level: Level = "warning") -> Notes:
    """The note that a unit may be wrong; none without a text."""
    return (Note(name="units", level=level, channel=channel, text=text),) if text else ()


def rate_notes(recording: Recording, profile: Profile) -> Notes:
    """A gyro that turns too fast, or scatters too little or too much for one: a warning.

    Motion scatters as it likes; on a bench it is noise that does, from sample to sample as from
    second to second.
    """
    if profile.channel.sensor != "gyro":
        return ()
    rates, text = profile.rates, ""
    typical = float(np.median(np.abs(rates)))
    scatter = float(np.sqrt(np.mean(np.square(np.diff(rates))))) if rates.size > 1 else typical
    walk = min(scatter * math.sqrt(0.5 * recording.duration / rates.size), profile.walk)
    # No gyro turns so fast for long, none is stable to 1e-6 deg/h from sample to sample, and none
    # on sale has a tenth of the last random walk.
    if typical > 5000.0 * DEGREE:
        wrong = "the unit, kind or rate looks wrong ({unit}, {kind}, {rate})"
        text = f"turns at {typical / DEGREE:.3g} deg/s: {wrong}"
    elif scatter < 1e-6 * DEGREE_PER_HOUR:
        size = f"{scatter / DEGREE_PER_HOUR:.2g} deg/h from second to second"
        text = f"scatters by only {size}: {_LOOKS_WRONG}"
    elif profile.standing and walk > 60.0 * units.DEGREE_PER_ROOT_HOUR:
        size = f"{walk / units.DEGREE_PER_ROOT_HOUR:.3g} deg/sqrt(h)"
        fact = f"scatters like an angle random walk of {size}, over ten times that of the noisiest"
        text = f"{fact}: {_LOOKS_WRONG}"
    elif profile.standing and profile.channel.kind != "angle" and _adds_up(profile.channel.values):
        fact = "goes on from sample to sample as an angle does, at any distance"
        text = f"{fact}: if it is one, state {{kind angle}} with its {{unit}}"
    return _doubt(profile.name, text)


def _adds_up(values: FloatArray) -> bool:
    """Whether values walk at random: their mean square difference grows as their distance does.

    That of a rate does not grow, or stops where a low-pass ends; that of a drift grows as the
    square.
    """
    farthest = values.size // 64
    # Between fewer samples it does not show.
    if farthest < 256:
        return False
    apart = np.geomspace(1, farthest, 6).astype(np.int64)
    starts = np.linspace(0, values.size - farthest - 1, 4096).astype(np.int64)
    here = values_at(values, starts)
    squares = [float(np.mean(np.square(values_at(values, starts + one) - here))) for one in apart]
    growth = np.array(squares) / apart
    # At the largest distance 64 differences do not overlap, whose mean square is good to a fifth.
    return bool(squares[0] > 0.0 and growth.max() < 2.0 * growth.min())


def time_notes(recording: Recording, profile: Profile) -> Notes:
    """A recording sampled more slowly, and for longer, than gyros are: a warning."""
    factor = likely_time_factor(recording)
    if factor is None:
        return ()
    rate = recording.sample_rate
    apart = f"{1.0 / rate:.4g} s apart, for {recording.duration / 86_400.0:.3g} days"
    problem = f"samples stand {apart}, as no gyro is read"
    why = f"the unit of time looks {factor:.0f} times too large"
    likely, finer = f"{rate * factor:.6g}", _TIMES_FINER[factor]
    remedy = f"state {{time COLUMN:{finer}}} (in place of s) or {{rate {likely}}}"
    return _doubt("time", f"{problem}: {why}; if they are those of {likely} Hz, {remedy}")


def likely_time_factor(recording: Recording) -> float | None:
    """By how many times a unit of time too large makes the sample rate unusually slow, if any."""
    rate, days = recording.sample_rate, recording.duration / 86_400.0
    # Gyros are read at 1 Hz and faster. Means over longer times are recorded for a day; at 1 Hz a
    # few days are usual.
    if not ((rate < 1.0 and days > 1.0) or (rate < 2.5 and days > 10.0)):
        return None
    # A usual rate is most often near 200 Hz.
    usual = [one for one in _TIMES_FINER if 5.0 <= rate * one <= 2e4]
    return min(usual, key=lambda one: abs(math.log(rate * one / 200.0)), default=None)


# ---- physics -----------------------------------------------------------------------


def gravity_notes(recording: Recording, profile: Profile) -> Notes:
    """Accelerometers at rest whose mean is gravity in another unit or of another kind: a warning.

    Increments of velocity show gravity over the sample rate.
    """
    forces = recording.accelerometers
    if not forces:
        return ()
    size, kind = _steady_mean(Profile.of(recording, one) for one in forces), forces[0].kind
    factor, stated = split_factor(forces[0].shown_in)
    if kind == "angle" or factor != 1.0 or not size > 0.0 or _is_gravity(size):
        return ()
    one = units.UNITS[stated].size * (1.0 if kind == "rate" else recording.sample_rate)
    sizes = {("rate", unit): size for unit, size in units.ACCELERATION_UNITS.items()}
    sizes["increment", "m/s"] = recording.sample_rate
    likely = [named for named, other in sizes.items() if _is_gravity(size / one * other)]
    if not likely:
        return ()
    # The kind that is stated is the more likely one.
    as_kind, unit = min(likely, key=lambda named: named[0] != kind)
    mean, gravity = (f"{each / one:.4g} {stated}" for each in (size, STANDARD_GRAVITY))
    text = f"their mean is {mean}, and gravity is {gravity}: "
    if as_kind == kind:
        text += f"in {unit} it would be gravity; state {{unit accelerometers={unit}}}"
    else:
        remedy = f"state {{kind accelerometers={as_kind}}} with {{unit accelerometers={unit}}}"
        remedy += f", and see whether the gyros are {as_kind}s, too"
        text += f"as {as_kind}s in {unit} it would be gravity; {remedy}"
    return _doubt(", ".join(one.name for one in forces), text)


def _is_gravity(size: float) -> bool:
    """Whether a mean, m/s^2, is gravity.

    It differs by 0.5 % over the Earth, and cheap sensors have biases of a few hundredths.
    """
    return _is_near(size, STANDARD_GRAVITY, 0.05)


def earth_notes(recording: Recording, profile: Profile) -> Notes:
    """Gyros at rest whose mean is Earth's rate in another unit, or is gravity: a warning.

    Three gyros across one another sense all of Earth's rate. Three accelerometers read as gyros
    show one g, or 9.8.
    """
    gyros = recording.gyros
    if not profile.standing or any(gyro.sensor != "gyro" for gyro in gyros):
        return ()
    size = _steady_mean(profile.each(recording))
    text = _as_gravity(gyros, size) or _as_earth_rate(gyros, size)
    return _doubt(", ".join(one.name for one in gyros), text)


def _as_gravity(gyros: tuple[Channel, ...], size: float) -> str:
    """Sentence on a mean that is gravity, in numbers called rates; empty if it is not."""
    factor, stated = split_factor(gyros[0].shown_in)
    # One gyro or two may show 9.8 deg/h of Earth's rate, as an upright one does in New York.
    of_earth = len(gyros) < 3 and size < EARTH_RATE
    if gyros[0].kind != "rate" or factor != 1.0 or of_earth:
        return ""
    number = size / units.UNITS[stated].size
    for gravity, unit in ((1.0, "g"), (STANDARD_GRAVITY, "m/s^2")):
        if _is_near(number, gravity, 0.01):
            problem = f"their mean is {number:.4g}, which is gravity in {unit}"
            remedy = "name the gyros ({columns}), and these with {accelerometers}"
            return f"{problem}: they look like accelerometers; {remedy}"
    return ""


def _as_earth_rate(gyros: tuple[Channel, ...], size: float) -> str:
    """Sentence on a mean that is Earth's rate in another unit; empty if it is not."""
    stated = {(gyro.shown_in, gyro.kind) for gyro in gyros}
    # Biases make up to three times as much or as little: that is no sign of another unit.
    if len(gyros) < 3 or len(stated) > 1 or 1.0 / 3.0 < size / EARTH_RATE < 3.0:
        return ""
    for unit, times in other_units(gyros[0]).items():
        # That is hardly chance: the biases of one unit in a hundred make it. A ring laser unit at
        # rest is known to show 14.76 deg/h of 15.04.
        if _is_near(size * times, EARTH_RATE, 0.025):
            mean, other = (f"{one / DEGREE_PER_HOUR:.4g} deg/h" for one in (size, size * times))
            problem = f"their mean rate is {mean}, and in {unit} it would be {other}"
            why = "that of the Earth (15.04): unless biases make that by chance, the unit is wrong"
            return f"{problem}, {why}; state {{unit {unit}}}"
    return ""


def _steady_mean(profiles: Iterable[Profile]) -> float:
    """Mean rate of channels across one another, in SI; NaN if they do not stand still."""
    parts = [[float(part.mean()) for part in np.array_split(one.rates, 8)] for one in profiles]
    means = np.array(parts)
    if not np.isfinite(means).all():
        return math.nan
    size = float(np.linalg.norm(means.mean(axis=1)))
    return size if np.linalg.norm(means.std(axis=1)) < 0.02 * size else math.nan


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
    step = max(1, recording.samples // 20_000)
    angle = every(table.values, step)
    turned = abs(float(angle[-1] - angle[0]))
    if turned < 4.0 * 2.0 * math.pi:
        return ()
    columns = np.stack([np.ones_like(angle), angle, np.cos(angle), np.sin(angle)], axis=1)
    values = every(angle_of(gyro, recording.sample_rate), step)
    _, share, cosine, sine = np.linalg.lstsq(columns, values, rcond=None)[0]
    # Nearer to the axis a gyro does not sense what is across it.
    if not abs(share) < 0.9:
        return ()
    across = math.hypot(cosine, sine) * turned / recording.duration / math.sqrt(1.0 - share**2)
    # Below lie only the poles of the Earth, and tables whose axis points there.
    if not (across < 0.02 * EARTH_RATE < across * factor < 1.2 * EARTH_RATE):
        return ()
    shown = f"{across / DEGREE_PER_HOUR:.3g} deg/h of Earth rate across a table"
    problem = f"shows {shown} at {turned / recording.duration / DEGREE:.3g} deg/s"
    why = f"if the unit of time is {factor:g} times smaller, it shows {factor:g} times as much"
    remedy = f"{{time COLUMN:UNIT}} or {{rate {recording.sample_rate * factor:.6g}}}"
    return _doubt(gyro.name, f"{problem}; {why}, as it may: state the right {remedy}", "error")


# ---- motion ------------------------------------------------------------------------


def motion_notes(recording: Recording, profile: Profile) -> Notes:
    """A gyro that turns now more and now less without an encoder beside: an error.

    Means over seconds that lie farther than 2 deg/s from their median, and farther than noise puts
    them, are motion. What is read then is that of the motion. A mean rate beyond the bias of any
    gyro is a warning; beyond the largest that one of such noise has, by steps between samples and
    within seconds, it is an error, since what is read then is the error of the table.
    """
    rates = profile.rates
    if not profile.standing or profile.channel.sensor != "gyro" or rates.size < 2:
        return ()
    middle = float(np.median(rates))
    level: Level = "error"
    moves, rate = _turning(profile), recording.sample_rate
    why = "and no encoder is looked at: use sagnac analyze with it ({table})"
    if recording.table is not None:
        why = "and the encoder that is named does not: name its column and unit with {table}"
    # A few seconds or samples are said as such, and an answer goes without them.
    if moves.any() and find_bumps(profile.changes, sample_rate=rate, with_spikes=True) is None:
        first = int(profile.edges[first_of(moves)])
        rest = _longest_rest(profile)
        remedy = remedy_of(recording, rest) if _is_long(rest, profile) else "record at rest"
        part = f"{rounded(100.0 * number_of(moves) / rates.size)} % of the record"
        when = f"in {part}, first at {second_of(recording, first):.1f} s"
        problem = f"turns at up to {float(np.abs(rates).max()) / DEGREE:.3g} deg/s, {when}"
        text = f"{problem}, as no still bench does, {why}, state the right {{unit}}, or {remedy}"
    else:
        # A rate that never changes is a table's beyond this many times the walk in a root second,
        # 200 deg/s for 1 deg/sqrt(h); of MEMS units as they are sold it is 70 at most. Up to
        # 25 deg/s it is the bias of the cheapest gyros.
        least = largest = max(TURNING_RATE, 12_000.0 * profile.walk)
        if abs(middle) < min(25.0 * DEGREE, least):
            return ()
        # Behind a low-pass the steps between samples hide the noise. What scatters within a second
        # may be ripple of a table: if one is named, it is.
        if recording.table is None:
            largest = max(least, 12_000.0 * profile.walk_in_seconds)
        level = "error" if abs(middle) >= largest else "warning"
        problem = f"turns steadily at {middle / DEGREE:.4g} deg/s, as on a table"
        half = _half_of_range(profile.channel, middle)
        text = f"{problem}, {why}, or state the right {{unit}}{half}"
    return (Note(name="motion", level=level, channel=profile.name, text=text),)


def _turning(profile: Profile) -> BooleanArray:
    """(rates,) true in the seconds in which a unit on a bench turns."""
    rates = profile.rates
    second = profile.channel.values.size / profile.sample_rate / rates.size
    limit = max(TURNING_RATE, 10.0 * profile.walk / math.sqrt(second))
    return np.asarray(np.abs(rates - np.median(rates)) > limit)


def _is_long(stretch: slice, profile: Profile) -> bool:
    """Whether a stretch of samples has two seconds, by which motion would show."""
    samples: int = stretch.stop - stretch.start
    return samples >= max(2.0 * profile.sample_rate, MINIMUM_SAMPLES)


def _longest_rest(profile: Profile) -> slice:
    """Samples of the longest stretch that does not move by its own noise either.

    In a record that is mostly motion what scatters is the motion, beside which a slower turn does
    not stand out.
    """
    rest = slice(0, profile.channel.values.size)
    while _is_long(rest, profile):
        own = replace(profile.channel, values=profile.channel.values[rest])
        part = Profile(channel=own, sample_rate=profile.sample_rate)
        moves = _turning(part)
        if not moves.any():
            break
        # A turn begins and ends in the seconds beside.
        between = longest_unmarked(np.convolve(moves, np.ones(3), mode="same") > 0.0)
        edges = rest.start + np.append(part.edges[:-1], own.values.size)
        rest = slice(int(edges[between.start]), int(edges[between.stop]))
    return rest


def _half_of_range(channel: Channel, rate: float) -> str:
    """End of a sentence on counts that begin at half of their range; empty if these do not."""
    size, unit = split_factor(channel.shown_in)
    if channel.kind != "rate" or size == 1.0:
        return ""
    counts = abs(rate) / (size * units.UNITS[unit].size)
    for bits in (12, 14, 16, 20, 24):
        if abs(counts / 2.0 ** (bits - 1) - 1.0) < 0.05:
            problem = f"; if its counts begin at {2 ** (bits - 1)}, half of a range of {bits} bits"
            return f"{problem}, take that knowingly ({{accept motion}})"
    return ""


# ---- pairs -------------------------------------------------------------------------

# Parts of a record, and of its band, that all have to show a copy: lines that happen to lie
# together do not last, and what shakes two gyros ends at some frequency.
_PARTS: Final = 4
# Correlation from which on one gyro is said to copy another.
_COPIES: Final = 0.05


class Likeness(NamedTuple):
    """How far the noise of one gyro is that of another.

    Attributes
    ----------
    delay
        Samples by which the second comes after the first at the highest correlation.
    correlation
        The highest, at that delay.
    together
        Without delay.
    """

    delay: int
    correlation: float
    together: float


def _delays(samples: int) -> tuple[int, int, int]:
    """Samples of a part, longest delay looked at, and length of transforms padded by it."""
    size = samples // _PARTS
    latest = min(1024, size // 2)
    return size, latest, int(next_fast_len(size + latest, real=True))


def phases_of(values: FloatArray) -> NDArray[np.complex64]:
    """(parts, frequencies) transforms of what each sample turned, with every amplitude 1.

    `values` are (samples,). Each part has a Hann taper, and is padded so that nothing comes round.
    """
    size, _, length = _delays(values.size)
    parts = values[: _PARTS * size].reshape(_PARTS, size)
    transform = rfft((parts - parts.mean(axis=1, keepdims=True)) * np.hanning(size), length)
    power = np.abs(transform)
    unit = np.divide(transform, power, out=np.zeros_like(transform), where=power > 0.0)
    return np.asarray(unit, dtype=np.complex64)


def likeness(first: NDArray[np.complex64], second: NDArray[np.complex64], samples: int) -> Likeness:
    """How far the changes of two gyros are the same at any delay up to 1024 samples.

    Every frequency counts alike, whatever its power: the mean cosine of the phase between the two
    (phase transform of Knapp and Carter, 1976). So lines and sway that both sense weigh as little
    as they are wide; a Hann taper keeps them so. The correlation is the mean over four parts of
    the record; if one of them shows less than half of it, there is none. So it is with four parts
    of the band, whose median has to show three quarters of it: a table that shakes is no copy,
    though one gyro has it some samples later.

    Parameters
    ----------
    first, second
        Of `phases_of` as many samples.
    samples
        How many.
    """
    _, latest, length = _delays(samples)
    cross, delays = np.conj(first) * second, np.arange(-latest, latest + 1)
    mean = irfft(cross.mean(axis=0), length)[delays]
    best, correlation = latest, 0.0
    # Four transforms more only if there is something to confirm.
    if np.abs(mean).max() >= _COPIES:
        parts = irfft(cross, length)[:, delays]
        lasts = np.all(parts * np.sign(mean) >= 0.5 * np.abs(mean), axis=0)
        best = int(np.argmax(np.abs(mean) * lasts))
        correlation = float(mean[best] * lasts[best])
        turn = np.exp(2j * np.pi * delays[best] / length * np.arange(cross.shape[1]))
        bands = [abs(b.mean()) for b in np.array_split(cross.mean(axis=0) * turn, _PARTS)]
        if min(bands) < 0.5 * abs(correlation) or np.median(bands) < 0.75 * abs(correlation):
            best, correlation = latest, 0.0
    return Likeness(best - latest, correlation, float(mean[latest]))


def copy_notes(recording: Recording, profile: Profile) -> Notes:
    """Every gyro that is another or comes after it."""
    gyros = list(profile.together.values())
    if len(gyros) < 2:
        return ()
    # The first change of an angle is that of the second sample. Taken with the first of a rate, a
    # table's motion would look like a copy that comes one sample later.
    turns = [one.changes[int(one.channel.kind != "angle") :] for one in gyros]
    # Of hundreds of gyros there are tens of thousands of pairs: what one gyro brings is made once.
    samples = min(2**15, *(one.size for one in turns))
    turns = [one[:samples] for one in turns]
    brought = [(gyro, one, phases_of(one)) for gyro, one in zip(gyros, turns, strict=True)]
    found = {
        frozenset((one[0].name, other[0].name)): note
        for one, other in combinations(brought, 2)
        for note in _copied(one, other)
    }
    names = {gyro.name for gyro in gyros}

    def is_filtered(pair: frozenset[str], late: str) -> bool:
        """Whether a gyro comes after two that are no copies of each other: by what all sense."""
        beside = [(frozenset((late, one)), (pair - {late}) | {one}) for one in names - pair]
        return any(after in found and early not in found for after, early in beside)

    return tuple(note for pair, note in found.items() if not is_filtered(pair, note.channel))


def _fresh(turns: FloatArray) -> int:
    """Samples that are neither held nor on a straight line between others, which tell nothing."""
    apart = (np.abs(np.diff(turns, order)) for order in range(3))
    return min(int(np.count_nonzero(one > 1e-3 * one.mean())) for one in apart)


_Brought = tuple[Profile, FloatArray, NDArray[np.complex64]]


def _copied(one: _Brought, other: _Brought) -> Notes:
    """A gyro that is another, or comes after it.

    `turns` are (samples,) what both turned, from one sample on.
    """
    (first, some, _), (second, more, _) = one, other
    both = likeness(one[2], other[2], some.size)
    if both.delay:
        alike = abs(both.correlation)
        # Beyond what two gyros on one table have without delay, and beyond what chance makes: with
        # 7 in place of 8, two of 480 sound pairs were copies.
        by_chance = 8.0 / math.sqrt(max(min(map(_fresh, (some, more))), 1))
        if alike < max(_COPIES, by_chance, 2.0 * abs(both.together)):
            return ()
        late, early = (second, first) if both.delay > 0 else (first, second)
        later = f"{counted(abs(both.delay), 'sample')} later"
        shared = "the two share their noise, which their difference hides"
        text = f"repeats gyro {early.name} {later} (correlation {both.correlation:+.3g}): {shared}"
        text += "; name another gyro ({gyros})"
        return (finding("copy", late.name, text, effect=math.sqrt(max(1.0 - alike, 0.0))),)
    if both.together < 0.99:
        return ()
    # One is the other times a number, to a millionth of the noise.
    some, more = np.diff(some), np.diff(more)
    rest = more - some * float(some @ more) / float(some @ some)
    if float(rest @ rest) >= 1e-12 * float(more @ more):
        return ()
    text = f"is a copy of gyro {first.name}; name another gyro ({{gyros}})"
    return (finding("copy", second.name, text, effect=0.0 if both.correlation > 0.0 else None),)


def unequal_notes(recording: Recording, profile: Profile) -> Notes:
    """Every gyro whose noise is far below that of another."""
    pairs = combinations(profile.together.values(), 2)
    return tuple(note for first, second in pairs for note in _unequal(first, second))


def _floor(gyro: Profile) -> float:
    """Typical ordinate of the spectrum at the beginning, as what a gyro turns in a sample."""
    steps = np.diff(gyro.changes[:LOOKED_AT])
    ordinates = np.abs(rfft(steps * np.hanning(steps.size)))
    return median(ordinates) / (gyro.sample_rate if gyro.channel.kind == "rate" else 1.0)


def _unequal(first: Profile, second: Profile) -> Notes:
    """A gyro whose noise is far below that of another."""
    # By the walk, since a rate and what an angle turned in a sample have unlike units.
    quiet, loud = sorted((first, second), key=lambda one: one.walk)
    ratio, effect = loud.walk / (quiet.walk or math.inf), 1.0
    if ratio > 30.0:
        # Spikes in a hundredth of the samples raise the scatter, and not the median of the steps.
        steps = float(np.median(np.abs(np.diff(loud.changes[:LOOKED_AT]))))
        ratio *= min(steps / (0.954 * loud.scale), 1.0) or 1.0
        # An answer goes without the lines of either, which are in the scatter.
        ratio = min(ratio, _floor(loud) / max(_floor(quiet), 1e-300))
    # From there on their difference is of one of them.
    if not ratio > 30.0:
        return ()
    text = f"its noise is {ratio:.4g} times below that of gyro {loud.name}"
    low, high = sorted((abs(quiet.share), abs(loud.share)))
    # Shares of the table's rate that no wrong unit would leave alike.
    if low > LEAST_SHARE and high < 2.0 * low:
        text += f", though both sense the table alike: {loud.name} or its mount may vibrate"
    else:
        # Between the units that angles and rates are written in.
        sizes = (180.0 / math.pi, 60.0, 3600.0, 648_000.0 / math.pi)
        near = [size for size in sizes if 0.5 < ratio / size < 2.0]
        hint, effect = f", about a unit's {near[0]:.4g}" if near else "", math.sqrt(0.5)
        text += f"{hint}: a unit may be wrong ({{unit}}), and their difference is of one gyro alone"
    text += "; see each alone ({gyros})"
    return (finding("units", quiet.name, text, effect=effect),)
