"""Gravity and Earth rate, which sensors have to show and which tell a wrong unit by name.

Rates that no gyro has tell of a wrong unit, too, and values at the two ends of a counter's range of
signed counts that were read as unsigned; gyros that move while nothing tells how stand on no bench.
"""

import math
from typing import Final

import numpy as np

from sagnac.core.arrays import FloatArray, blocks, every, extent
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
from sagnac.quality.encoder_faults import TURNING_RATE, block_rates
from sagnac.quality.profile import Profile, remedy_of
from sagnac.recording.channel import Channel, angle_of
from sagnac.recording.model import Recording, second_of
from sagnac.recording.stamps import Places, longest_between

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


def wrong_unit_notes(recording: Recording, profile: Profile, *, standing: bool) -> tuple[Note, ...]:
    """A gyro that turns too fast, or scatters too little or too much for one: a warning.

    Motion scatters as it likes; on a bench it is noise that does, from sample to sample as from
    second to second.
    """
    rates, _ = block_rates(recording, profile.channel)
    typical = float(np.median(np.abs(rates)))
    scatter = float(np.sqrt(np.mean(np.square(np.diff(rates))))) if rates.size > 1 else typical
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
    elif standing and (walk := _least_walk(recording, profile, scatter, rates.size)):
        text = (
            f"scatters like an angle random walk of {walk / DEGREE_PER_ROOT_HOUR:.3g} deg/sqrt(h), "
            "over ten times that of the noisiest: the unit or kind looks wrong ({unit}, {kind})"
        )
    else:
        return ()
    return (Note(name="units", level="warning", channel=profile.channel.name, text=text),)


def _least_walk(recording: Recording, profile: Profile, scatter: float, blocks: int) -> float:
    """Random walk of a gyro, rad/sqrt(s), by samples or by seconds, the lesser; 0 if it may be."""
    if profile.channel.sensor != "gyro":
        return 0.0
    by_seconds = scatter * math.sqrt(0.5 * recording.duration / blocks)
    walk = min(by_seconds, _walk_by_samples(recording, profile))
    return walk if walk > STRONGEST_WALK else 0.0


def _walk_by_samples(recording: Recording, profile: Profile) -> float:
    """Random walk that would scatter a gyro from sample to sample as it does, rad/sqrt(s)."""
    turned = profile.scale / (recording.sample_rate if profile.channel.kind == "rate" else 1.0)
    return turned * math.sqrt(recording.sample_rate)


def rate_doubts(recording: Recording) -> tuple[Note, ...]:
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
    return (Note(name="units", level="warning", channel="time", text=text),)


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


def gravity_notes(recording: Recording) -> tuple[Note, ...]:
    """Accelerometers at rest whose mean is no gravity, but is in another unit: a warning."""
    if not recording.accelerometers:
        return ()
    found = _mean_of(recording, recording.accelerometers)
    if found is None:
        return ()
    size = float(np.linalg.norm(found))
    if not size > 0.0 or _is_near(size, STANDARD_GRAVITY, _GRAVITY):
        return ()
    factor, stated = split_factor(recording.accelerometers[0].shown_in)
    if stated not in ACCELERATION_UNITS or factor != 1.0:
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
    names = ", ".join(one.name for one in recording.accelerometers)
    return (Note(name="units", level="warning", channel=names, text=text),)


def earth_notes(recording: Recording) -> tuple[Note, ...]:
    """Gyros at rest whose mean is Earth's rate in another unit, or is gravity: a warning.

    Three gyros across one another sense all of Earth's rate. Three accelerometers read as gyros
    show one g, or 9.8.
    """
    gyros = recording.gyros
    if any(gyro.sensor != "gyro" for gyro in gyros):
        return ()
    found = _mean_of(recording, gyros)
    if found is None:
        return ()
    size = float(np.linalg.norm(found))
    text = _as_gravity(gyros[0], size) or _as_earth_rate(gyros, size)
    names = ", ".join(one.name for one in gyros)
    return (Note(name="units", level="warning", channel=names, text=text),) if text else ()


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
    if len(gyros) < _TRIAD or EARTH_RATE / _BIASED < size < EARTH_RATE * _BIASED:
        return ""
    stated = {(gyro.shown_in, gyro.kind) for gyro in gyros}
    if len(stated) > 1:
        return ""
    factor, name = split_factor(gyros[0].shown_in)
    others = _RATES if gyros[0].kind == "rate" else _ANGLES
    for unit in others:
        other = size / UNITS[name].size * UNITS[unit].size
        if unit != name and _is_near(other, EARTH_RATE, _EARTH):
            said = unit if factor == 1.0 else f"{factor:g}{unit}"
            return (
                f"their mean rate is {size / DEGREE_PER_HOUR:.4g} deg/h, and in {said} it would be "
                f"{other / DEGREE_PER_HOUR:.4g} deg/h, that of the Earth (15.04): unless "
                f"biases make that by chance, the unit is wrong; state {{unit {said}}}"
            )
    return ""


def _mean_of(recording: Recording, channels: tuple[Channel, ...]) -> FloatArray | None:
    """(channels,) mean rates in SI; None if they do not stand still."""
    means = []
    for channel in channels:
        rates, _ = block_rates(recording, channel)
        if not np.isfinite(rates).all():
            return None
        means.append([float(part.mean()) for part in np.array_split(rates, _PARTS)])
    table = np.array(means)
    mean = np.asarray(table.mean(axis=1))
    scatter = float(np.linalg.norm(table.std(axis=1)))
    return mean if scatter < _STEADY * float(np.linalg.norm(mean)) else None


def _is_near(value: float, wanted: float, within: float) -> bool:
    return wanted * (1.0 - within) <= value <= wanted * (1.0 + within)


def earth_on_table_notes(recording: Recording, gyro: Channel) -> tuple[Note, ...]:
    """A turning table that shows no Earth rate, and would in another unit of time: an error.

    Across its axis Earth rate is a cosine of the table's angle. In a gyro's angle it has the
    amplitude of that rate over the table's, whatever the unit of time that both were stated in.

    Parameters
    ----------
    recording
        With a table; its sample rate may be the doubtful one.
    gyro
        Of angles or increments: a rate in a wrong unit of time contradicts the table's.
    """
    factor = likely_time_factor(recording)
    table = recording.table
    if factor is None or table is None or gyro.kind == "rate":
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
    return (Note(name="units", level="error", channel=gyro.name, text=text),)


# ---- motion ------------------------------------------------------------------------

# Scatters of the mean of a block of noise beyond which it moves.
_SIGMAS: Final = 10.0
# A rate that never changes is the bias of the cheapest gyros up to here, and a table beyond.
_LARGEST_BIAS: Final = 25.0 * DEGREE
# So is one beyond this many times the walk in a root second: 200 deg/s for 1 deg/sqrt(h). Of MEMS
# units as they are sold it is 70 at most.
_BIAS_OVER_WALK: Final = 12_000.0


def motion_notes(recording: Recording, profile: Profile) -> tuple[Note, ...]:
    """A gyro that turns now more and now less without an encoder beside: an error.

    Means over seconds that lie farther than 2 deg/s from their median, and farther than noise puts
    them, are motion. What is read then is that of the motion.
    """
    gyro = profile.channel
    rates, starts = block_rates(recording, gyro)
    if rates.size < 2:
        return ()
    middle = float(np.median(rates))
    off = np.abs(rates - middle)
    walk = _walk_by_samples(recording, profile)
    limit = max(TURNING_RATE, _SIGMAS * walk / math.sqrt(recording.duration / rates.size))
    moves = np.flatnonzero(off > limit)
    if moves.size == 0:
        return _turns_steadily(recording, gyro, middle, max(TURNING_RATE, _BIAS_OVER_WALK * walk))
    between = longest_between(rates.size, moves)
    edges = np.append(starts, recording.samples)
    still = type(between)(first=int(edges[between.first]), after=int(edges[between.after]))
    text = (
        f"turns at up to {float(np.abs(rates).max()) / DEGREE:.3g} deg/s, in "
        f"{100.0 * moves.size / rates.size:.2g} % of the record, first at "
        f"{second_of(recording, int(starts[moves[0]])):.1f} s, and no encoder is looked at: this "
        f"is no still bench; use sagnac analyze with the encoder ({{table}}), state the right "
        f"{{unit}}, or {remedy_of(recording, still)}"
    )
    return (Note(name="motion", level="error", channel=gyro.name, text=text),)


def _turns_steadily(
    recording: Recording, gyro: Channel, rate: float, largest: float
) -> tuple[Note, ...]:
    """A mean rate beyond the bias of any gyro: a warning; or beyond the `largest`, rad/s, that one
    of such noise has: an error, since what is read then is the error of the table."""
    if abs(rate) < min(_LARGEST_BIAS, largest):
        return ()
    why = "and no encoder is looked at: use sagnac analyze with it ({table})"
    if recording.table is not None:
        why = "and the encoder that is named does not: name its column and unit with {table}"
    text = (
        f"turns steadily at {rate / DEGREE:.4g} deg/s, as on a table, {why}, or state the right "
        "{unit}"
    )
    level: Level = "error" if abs(rate) >= largest else "warning"
    return (Note(name="motion", level=level, channel=gyro.name, text=text),)


# ---- counts that start over ----------------------------------------------------------

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


def _counter_bits(gyro: Channel, covered: float) -> int | None:
    """Width of a counter whose range the values fill, in counts of the unit they came in."""
    factor, name = split_factor(gyro.shown_in)
    counts = covered / (factor * UNITS[name].size)
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
