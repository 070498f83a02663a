"""Gravity and Earth rate, which sensors have to show and which tell a wrong unit by name.

Rates that no gyro has tell of a wrong unit, too; gyros that move while nothing tells how stand on
no bench.
"""

import math
from typing import Final

import numpy as np

from sagnac.arrays import FloatArray, every
from sagnac.errors import Level, Note
from sagnac.recording.channel import Channel, angle_of
from sagnac.recording.encoder_faults import TURNING_RATE, block_rates
from sagnac.recording.model import Recording, second_of
from sagnac.recording.profile import Profile, remedy_of
from sagnac.recording.stamps import longest_between
from sagnac.units import (
    ACCELERATION_UNITS,
    DEGREE,
    DEGREE_PER_HOUR,
    EARTH_RATE,
    STANDARD_GRAVITY,
    UNITS,
    split_factor,
)

# ---- wrong unit --------------------------------------------------------------------

# No gyro turns at 5000 deg/s for long, and none is stable to 1e-6 deg/h from sample to sample.
FASTEST_RATE: Final = 5000.0 * DEGREE
SLOWEST_RATE: Final = 1e-6 * DEGREE_PER_HOUR
# Gyros are read at 1 Hz and faster. Means over longer times are recorded for a day; at 1 Hz a few
# days are usual. If a recording is slower than the first number, Hz, and longer than the second, s,
# its stamps may be ms that were taken as s.
_SLOW_FOR_LONG: Final = ((1.0, 86_400.0), (2.5, 10.0 * 86_400.0))
# Factors between units of time; a usual rate lies between these, most often near the last, Hz.
_TIMES_FINER: Final = {1e3: "ms", 1e6: "us", 1e9: "ns"}
_USUAL: Final = (5.0, 2e4)
_COMMON: Final = 200.0


def wrong_unit_notes(recording: Recording, profile: Profile) -> tuple[Note, ...]:
    """A gyro that turns too fast or scatters too little for one: a warning."""
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
    else:
        return ()
    return (Note(name="units", level="warning", channel=profile.channel.name, text=text),)


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
    return _as_gravity(gyros, size) or _as_earth_rate(recording, gyros, size)


def _as_gravity(gyros: tuple[Channel, ...], size: float) -> tuple[Note, ...]:
    gyro = gyros[0]
    if gyro.kind != "rate":
        return ()
    factor, stated = split_factor(gyro.shown_in)
    number = size / (factor * UNITS[stated].size)
    for gravity, unit in ((1.0, "g"), (STANDARD_GRAVITY, "m/s^2")):
        if factor == 1.0 and _is_near(number, gravity, _AS_RATES):
            names = ", ".join(one.name for one in gyros)
            text = (
                f"their mean is {number:.4g}, which is gravity in {unit}: they look like "
                "accelerometers; name the gyros ({columns}), and these with {accelerometers}"
            )
            return (Note(name="units", level="warning", channel=names, text=text),)
    return ()


def _as_earth_rate(
    recording: Recording, gyros: tuple[Channel, ...], size: float
) -> tuple[Note, ...]:
    if len(gyros) < _TRIAD or EARTH_RATE / _BIASED < size < EARTH_RATE * _BIASED:
        return ()
    stated = {gyro.shown_in for gyro in gyros}
    kinds = {gyro.kind for gyro in gyros}
    if len(stated) > 1 or len(kinds) > 1:
        return ()
    factor, name = split_factor(stated.pop())
    others = _RATES if kinds == {"rate"} else _ANGLES
    for unit in others:
        other = size / UNITS[name].size * UNITS[unit].size
        if unit != name and _is_near(other, EARTH_RATE, _EARTH):
            said = unit if factor == 1.0 else f"{factor:g}{unit}"
            text = (
                f"their mean rate is {size / DEGREE_PER_HOUR:.4g} deg/h, and in {said} it would be "
                f"{other / DEGREE_PER_HOUR:.4g} deg/h, that of the Earth (15.04): unless "
                f"biases make that by chance, the unit is wrong; state {{unit {said}}}"
            )
            names = ", ".join(one.name for one in gyros)
            return (Note(name="units", level="warning", channel=names, text=text),)
    return ()


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
    if not (across < _ACROSS[0] * EARTH_RATE and _is_across(across * factor)):
        return ()
    text = (
        f"shows {across / DEGREE_PER_HOUR:.3g} deg/h of Earth rate across a table at "
        f"{turned / recording.duration / DEGREE:.3g} deg/s; if the unit of time is {factor:g} "
        f"times smaller, it shows {factor:g} times as much, as it may: state the right "
        f"{{time COLUMN:UNIT}} or {{rate {recording.sample_rate * factor:.6g}}}"
    )
    return (Note(name="units", level="error", channel=gyro.name, text=text),)


def _is_across(rate: float) -> bool:
    return _ACROSS[0] * EARTH_RATE < rate < _ACROSS[1] * EARTH_RATE


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
    scale = profile.scale * (1.0 if gyro.kind == "rate" else recording.sample_rate)
    length = recording.samples / rates.size
    limit = max(TURNING_RATE, _SIGMAS * scale / np.sqrt(length))
    moves = np.flatnonzero(off > limit)
    if moves.size == 0:
        walk = scale / math.sqrt(recording.sample_rate)
        return _turns_steadily(recording, gyro, middle, max(TURNING_RATE, _BIAS_OVER_WALK * walk))
    between = longest_between(rates.size, moves)
    edges = np.append(starts, recording.samples)
    still = type(between)(first=int(edges[between.first]), after=int(edges[between.after]))
    text = (
        f"turns at up to {float(np.abs(rates).max()) / DEGREE:.3g} deg/s, in "
        f"{100.0 * moves.size / rates.size:.2g} % of the record, first at "
        f"{second_of(recording, int(starts[moves[0]])):.1f} s, and no encoder is looked at: this "
        f"is no still bench; use sagnac analyze with the encoder ({{table}}), or "
        f"{remedy_of(recording, still)}"
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
