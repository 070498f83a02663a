"""Columns of numbers taken as channels, pulses and stamps, and the rate that stamps give.

A frame whose columns are taken is one of pandas or xarray, or a dictionary; none is imported.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from types import NoneType
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagnac.core import arrays
from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.core.errors import Note, RecordingError, counted, is_finite, quoted, require_type
from sagnac.core.marks import first_of, is_missing, marked_steps, number_of
from sagnac.core.units import sensor_of, split_header, unit_of
from sagnac.recording.channel import Channel, Conversion, Kind, finite_extent, numbers, unwrapped
from sagnac.recording.encoder_readings import MOST_MISSING_IN_A_ROW

# ---- frames ------------------------------------------------------------------------

# What columns are called if nobody says otherwise.
GYRO_NAMES: Final = ("x", "y", "z")
ACCELEROMETER_NAMES: Final = ("ax", "ay", "az")
USUAL_NAMES: Final = {"table": ("table", "alpha", "encoder"), "time": ("time", "t")}
NULL_PULSE_NAME: Final = "null_pulse"
TEMPERATURE: Final = "temperature"

_Text = TypeVar("_Text", bound=str)


def columns_of(
    frame: Any, columns: Mapping[str, str] | None, unit: str | Mapping[str, str] | None
) -> dict[str, str]:
    """Name wanted -> name in the frame, for all that are wanted or, without a wish, known.

    An accelerometer is known by its name only if its unit is stated, by itself or in its header.

    Parameters
    ----------
    frame
        What has columns by name, and coordinates perhaps.
    columns
        Name wanted -> name in the frame, or None for the columns of known names.
    unit
        As stated, for all or by name.

    Raises
    ------
    TypeError
        If the frame, or `columns`, has no names.
    ValueError
        If a column is not there, two may be one that is wanted, or there is no gyro.
    """
    # What has a type of its numbers, as an array or one column, has no columns by name.
    if not hasattr(frame, "keys") or hasattr(type(frame), "dtype"):
        raise TypeError(
            f"frame is {quoted(frame)}; give a frame of pandas or xarray, or a dictionary of "
            "columns"
        )
    require_type("columns", columns, (Mapping, NoneType), "give {'x': NAME}, NAME in the frame")
    headers = [str(name) for name in (*frame, *getattr(frame, "coords", ()))]
    present, found = ", ".join(headers) or "no column", dict(columns or {})
    for name, header in found.items():
        if header not in headers:
            raise ValueError(f"columns[{name!r}] is {quoted(header)}; the frame has {present}")
    wanted: dict[str, tuple[str, ...]]
    wanted = {name: (name,) for name in (*GYRO_NAMES, *ACCELEROMETER_NAMES, NULL_PULSE_NAME)}
    wanted |= USUAL_NAMES
    for name, names in wanted.items() if columns is None else ():
        alike = [header for header in headers if split_header(header)[0] in names]
        if len(alike) > 1:
            raise ValueError(
                f"{', '.join(alike)} may each be {name}; name one with columns={{{name!r}: NAME}}"
            )
        is_named = isinstance(unit, Mapping) and name in unit
        is_gyro = name not in ACCELEROMETER_NAMES
        if alike and (is_gyro or is_named or split_header(alike[0])[1] is not None):
            found[name] = alike[0]
    if not set(found) - {"table", "time", NULL_PULSE_NAME}:
        said = f"the frame has no gyro; it has {present}: name one with columns={{'x': NAME}}"
        raise ValueError(said)
    return found


def stated_for(name: str, stated: _Text | Mapping[str, _Text], argument: str) -> _Text:
    """Statement of an argument for one gyro: the one for all, or its own.

    Raises
    ------
    ValueError
        If it states something by name and nothing for this gyro.
    """
    if not isinstance(stated, Mapping):
        return stated
    if name not in stated:
        others = f", only that of {', '.join(stated)}" if stated else ""
        raise ValueError(f"the {argument} of gyro {name} is not stated{others}; state {argument}")
    return stated[name]


# ---- columns -----------------------------------------------------------------------


def gyro_of(
    name: str,
    values: ArrayLike,
    *,
    kind: Kind,
    unit: str,
    period: float | None = None,
    out: FloatArray | None = None,
    inputs: str = "{period}",
) -> Conversion:
    """A gyro of a column in a unit of the field; an accelerometer if the unit is one of force.

    Parameters
    ----------
    name
        Of the gyro.
    values
        (samples,) in `unit`.
    kind, unit, out
        See `Channel.from_values`.
    period
        Reading at which a counter of angle starts over, in `unit`; None if it never does.
        Accelerometers have none.
    inputs
        Those that state the period, for the message.

    Raises
    ------
    ValueError
        If an argument makes no sense.
    RecordingError
        If it cannot be such a counter: it is no angle, or spans more than that holds.
    """
    sensor, notes = sensor_of(unit), tuple[Note, ...]()
    if period is not None and sensor == "gyro":
        if kind != "angle":
            said = f"a counter that starts over is an angle, not kind {kind}"
            remedy = f"state {{kind angle}}, or leave out {inputs}"
            raise RecordingError(said, channel=name, remedy=remedy)
        if not (is_finite(period) and period > 0.0):
            raise ValueError(
                f"period is {quoted(period)}; give the reading at which the counter starts over"
            )
        readings = np.asarray(numbers(values, name), dtype=np.float64)
        extent = finite_extent(readings)
        if extent >= period:
            said = f"it spans {extent:.6g}, more than a counter of {period:.9g} holds"
            raise RecordingError(said, channel=name, remedy=f"state the right {inputs}")
        values, wraps = unwrapped(readings, period)
        bits = math.log2(period)
        counter = f"{bits:g} bit counter" if bits.is_integer() else f"counter of {period:.9g}"
        text = f"the {counter} rolled over {counted(wraps, 'time')}: unwrapped"
        notes = (Note(channel=name, text=text),) if wraps else ()
    channel = Channel.from_values(name, values, kind=kind, unit=unit, sensor=sensor, out=out)
    return Conversion(channel=channel, notes=notes)


def with_dates(values: ArrayLike) -> NDArray[Any]:
    """An array of values; dates of Python or of a frame become those of numpy, in UTC.

    Examples
    --------
    >>> with_dates([datetime(2026, 1, 1, tzinfo=UTC)])
    array(['2026-01-01T00:00:00.000000'], dtype='datetime64[us]')
    """
    column = np.asarray(values)
    if not (column.dtype.kind == "O" and column.size and isinstance(column.flat[0], datetime)):
        return column
    if not isinstance(values, list | tuple | np.ndarray):
        # A frame knows its time zone, and parts of a microsecond.
        return np.asarray(values, dtype="datetime64[ns]")
    utc = [one.astimezone(UTC).replace(tzinfo=None) if one.tzinfo else one for one in column]
    return np.array(utc, dtype="datetime64[us]")


def seconds_of(values: ArrayLike, *, unit: str) -> FloatArray:
    """Time stamps in s from the first, shape (samples,).

    Integers, and dates, which state their own unit, lose nothing by the size of the epoch.

    Raises
    ------
    ValueError
        If `unit` is not one of time, or the values are no column of numbers or dates.
    """
    stamps = with_dates(values)
    if stamps.dtype.kind in "mM":
        if stamps.ndim != 1:
            raise ValueError(f"times has shape {stamps.shape}; give one column, shape (samples,)")
        return np.asarray((stamps - stamps[:1]) / np.timedelta64(1, "s"), dtype=np.float64)
    scale = unit_of(unit, "time").size
    column = numbers(values, "times")
    return np.asarray(column - column[:1], dtype=np.float64) * scale


def pulses_of(values: ArrayLike, *, column: str = "") -> tuple[BooleanArray, tuple[Note, ...]]:
    """First samples of pulses in a column of two levels, one of them 0, and what was noticed.

    Parameters
    ----------
    values
        (samples,), not 0 while a pulse is up.
    column
        What the source calls it, for the message; empty if it has no name.

    Raises
    ------
    RecordingError
        If the column takes more than two values.
    """
    given = np.asarray(values)
    levels = numbers(given.astype(np.uint8) if given.dtype.kind == "b" else given, "null_pulse")
    some = arrays.every(levels, max(1, levels.size // 100_000))
    if np.unique(some).size > 2 or not arrays.all_finite(levels):
        said = f"{f'column {column} ' if column else ''}takes more than two values"
        remedy = "name a column of 0 and 1 with {null-pulse}"
        raise RecordingError(said, channel="null_pulse", remedy=remedy)
    high = levels != 0
    rising = high.copy()
    rising[1:] &= ~high[:-1]
    if np.array_equal(rising, high):
        return rising, ()
    text = "stays up for more than a sample; its first is taken"
    return rising, (Note(text=text, channel="null_pulse"),)


# ---- stamps ------------------------------------------------------------------------

# An interval longer than this many nominal steps is a gap: an error. Recorders that stamp on
# arrival, on a clock of 1 ms, repeat a stamp now and then and follow it with one of two steps,
# and a busy host holds a few samples back (stamps up to 4.4 steps apart at 100 Hz are known
# from sound recordings); from more than four samples missing, the angle turned meanwhile is a
# guess. Shorter ones are a remark.
GAP_STEPS: Final = MOST_MISSING_IN_A_ROW + 1.0
# Stamps closer than this, s, are no times, or in another unit.
_SHORTEST: Final = 1e-15
# Sampling is called uniform if no stamp is off its place by more than this share of a step.
UNIFORM: Final = 1e-6
# Rates stated twice, by stamps and in words, have to agree to this.
RATE_AGREEMENT: Final = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampling:
    """When the samples were taken.

    Attributes
    ----------
    times
        (samples,) s from the first sample, or None if sampling is uniform.
    sample_rate
        Mean samples per second.
    notes
        What was noticed of the stamps.
    """

    times: FloatArray | None
    sample_rate: float
    notes: tuple[Note, ...] = ()


# What stamps start over at, s: counters of 16, 24 and 32 bits in us, ms and ns, a GPS week, a day.
# Minutes and hours are not among them: logs last as long, and begin at 0 again if several are put
# together.
_STARTING_OVER: Final = (
    604_800.0,
    86_400.0,
    *(size * 2.0**bits for size in (1e-3, 1e-6, 1e-9) for bits in (32, 24, 16)),
)


def without_starting_over(times: FloatArray) -> tuple[FloatArray, tuple[Note, ...]]:
    """Stamps that go on where a clock starts over, as far as each of its leaps back shows that.

    Parameters
    ----------
    times
        (samples,) s.

    Returns
    -------
    times
        (samples,) s: those given, unless they start over.
    notes
        That they do.
    """
    backwards = marked_steps(times, lambda steps: steps < 0.0)
    usual = median_step(times, repeats=False)
    if not backwards.any() or not usual > 0.0:
        return times, ()
    places = np.flatnonzero(backwards)
    leaps = times[places] - times[places - 1]
    for period in _STARTING_OVER:
        # A clock of milliseconds rounds, and a stamp may come late, but none is lost there.
        if period > 4.0 * usual and np.all(np.abs(leaps + period - usual) < 0.75 * usual):
            running = period * np.cumsum(backwards, dtype=np.float64)
            running += times
            text = (
                f"starts over at {period:.9g} s, {counted(places.size, 'time')}: taken as going on"
            )
            return running, (Note(text=text, channel="time"),)
    return times, ()


def sampling(stamps: FloatArray, stated_rate: float | None = None) -> Sampling:
    """Rate and evenness of time stamps, which go on where their clock starts over.

    The rate is the mean one: the median interval of stamps on a clock of 1 ms is
    0.010 s both for 99.9 Hz and for 100 Hz.

    Parameters
    ----------
    stamps
        (samples,) s, from any origin.
    stated_rate
        Hz, if it is stated as well.

    Raises
    ------
    RecordingError
        If the stamps do not run forwards and no rate is stated, the two disagree, or no sensor
        samples as fast.
    """
    times, notes = without_starting_over(arrays.elementwise(np.subtract, stamps, stamps[0]))
    taken = _evenness(times, stated_rate)
    return replace(taken, notes=(*notes, *taken.notes))


def _evenness(times: FloatArray, stated_rate: float | None) -> Sampling:
    """Rate and evenness of stamps from the first sample, s; see `sampling`."""
    if times.size < 2 or not arrays.all_finite(times) or times[-1] <= 0.0:
        rate = stated_rate
        if rate is None:
            usual = median_step(times, repeats=False)
            if math.isnan(usual):
                remedy = "state {time none} and {rate HZ}"
                raise RecordingError("does not run forwards", channel="time", remedy=remedy)
            rate = 1.0 / _plausible(usual)
        return Sampling(times=times, sample_rate=rate)
    step = _plausible(float(times[-1]) / (times.size - 1))
    # The largest distance of a stamp from its place at even steps.
    worst = max(
        float(np.abs(np.arange(some.start, some.stop) * step - times[some]).max())
        for some in arrays.blocks(times.size)
    )
    # The clock: the coarsest power of ten that stamps are multiples of, s.
    sample = arrays.every(times, max(1, times.size // 10_000))
    ticks = ((exponent, sample * 10.0**exponent) for exponent in range(10))
    whole = (one for one, some in ticks if np.abs(some - np.rint(some)).max() < 1e-3)
    clock = next((float(10.0**-exponent) for exponent in whole), 0.0)
    # Stamps are exact only to the last digit that was written, or that a float holds.
    slack = max(UNIFORM * step, 1e-9 * clock, 4.0 * float(np.spacing(times[-1])))
    # The round figure that the rate cannot be told from, or the rate.
    rate, unsure = 1.0 / step, (min(worst, clock) + slack) / float(times[-1])
    rate = round_figure(rate, unsure)
    disagree = stated_rate is not None and abs(rate / stated_rate - 1.0) > RATE_AGREEMENT
    # Stamps that run back, as of two logs put together, have no rate, and are refused as such.
    if disagree and not marked_steps(times, lambda steps: steps < 0.0).any():
        said = f"the stamps give {rate:.6g} Hz but {stated_rate:.6g} Hz is stated"
        remedy = "leave out {rate}, or ignore the stamps with {time none}"
        raise RecordingError(said, channel="time", remedy=remedy)
    if worst <= slack:
        return Sampling(times=None, sample_rate=rate)
    is_uniform = worst <= 0.75 * clock < 0.75 * step
    text = (
        f"stamps are those of uniform sampling at {rate:.9g} Hz on a clock of {clock:g} s: "
        "taken as uniform"
        if is_uniform
        else f"sampling is not uniform, mean rate {rate:.6g} Hz, stamps up to {worst:.3g} s off an "
        "even spacing"
    )
    notes = (Note(text=text, channel="time"),)
    return Sampling(times=None if is_uniform else times, sample_rate=rate, notes=notes)


def round_figure(rate: float, unsure: float) -> float:
    """The rate of the fewest decimals that a rate known to a share of `unsure` may be.

    Examples
    --------
    >>> round_figure(99.993, 1e-4), round_figure(99.993, 1e-6)
    (100.0, 99.993)
    """
    near = (round(rate, digits) for digits in range(10))
    return next((one for one in near if one > 0.0 and abs(one - rate) <= unsure * rate), rate)


def require_forwards(taken: Sampling) -> Sampling:
    """Refuse stamps that are missing or run backwards.

    Raises
    ------
    RecordingError
        With how many do, and when the first does.
    """
    times = taken.times
    if times is None:
        return taken
    missing, backwards = is_missing(times), marked_steps(times, lambda steps: steps < 0.0)
    said, when = "", 0.0
    if missing.any():
        said = f"{counted(number_of(missing), 'sample')} NaN or infinite, the first"
        when = first_of(missing) / taken.sample_rate
    elif backwards.any():
        said = f"runs backwards {counted(number_of(backwards), 'time')}, first"
        when = float(times[first_of(backwards) - 1])
    if said:
        remedy = "correct the stamps, or state {time none} with {rate}"
        raise RecordingError(f"{said} at {when:.3f} s", channel="time", remedy=remedy)
    return taken


def _plausible(step: float) -> float:
    """The step, s.

    Raises
    ------
    RecordingError
        If no sensor samples as fast: the stamps are no times, or in another unit.
    """
    if step >= _SHORTEST:
        return step
    said = f"the stamps are {step:.3g} s apart, faster than any sensor samples"
    remedy = "state their unit ({time COLUMN:UNIT}), or {time none} and {rate HZ}"
    raise RecordingError(said, channel="time", remedy=remedy)


def median_step(times: FloatArray, *, repeats: bool = True) -> float:
    """Median interval of time stamps, of those that are finite and do not run backwards.

    Parameters
    ----------
    times
        (samples,) s.
    repeats
        Whether stamps that repeat the one before count.

    Returns
    -------
    float
        s, or NaN if there is no such interval.
    """
    steps = arrays.differences(times)
    kept = 0
    for block in arrays.blocks(steps.size):
        here = steps[block]
        here = here[np.isfinite(here) & ((here >= 0.0) if repeats else (here > 0.0))]
        steps[kept : kept + here.size] = here
        kept += here.size
    return float(np.median(steps[:kept], overwrite_input=True)) if kept else math.nan


# ---- slices ------------------------------------------------------------------------

Span = tuple[float | None, float | None]

# A stamp that misses the limit of a slice by less than this, s, is at it.
_SLACK: Final = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """The samples of a file that are taken, and when they were.

    Attributes
    ----------
    first, stop
        First sample of the file that is taken, and the one after the last.
    start
        Time of the first, s from the first sample of the file.
    sampling
        Rate and times of those taken.
    """

    first: int
    stop: int
    start: float
    sampling: Sampling

    @property
    def span_s(self) -> tuple[float, float]:
        """Start of the first sample and end of the last, s from the first of the file."""
        return self.start, self.start + (self.stop - self.first) / self.sampling.sample_rate


def stretch_of(
    samples: int, span: Span | None, rate: float | None, stamps: FloatArray | None = None
) -> Stretch:
    """The samples that lie in a span, their rate and their times.

    Parameters
    ----------
    samples
        In the file.
    span
        Start and stop to take, s from the first sample, or None for all.
    rate
        Samples per second that are stated, or None.
    stamps
        (two samples or more,) s from the first of the file; None for uniform samples.

    Raises
    ------
    RecordingError
        If fewer than two samples lie in the span, time does not run forwards, the stamps
        contradict the rate, or there is neither.
    """
    if stamps is None and rate is None:
        said = "one sample or none is too few to tell a rate"
        raise RecordingError(said, channel="time", remedy="give a longer file")

    def first_after(limit: float, known: int) -> int:
        if stamps is None:
            return min(samples, math.ceil(limit * (rate or 0.0) - 1e-6))
        return known + first_at(stamps[known:], limit)

    start, stop = span or (None, None)
    first = first_after(start, 0) if start else 0
    last = samples if stop is None else first_after(stop, first)
    if span is not None and last - first < 2:
        remedy = "widen {slice START:STOP}"
        raise RecordingError("fewer than two samples lie in the slice", remedy=remedy)
    if stamps is None:
        even = Sampling(times=None, sample_rate=rate or 0.0)
        return Stretch(first=first, stop=last, start=first / even.sample_rate, sampling=even)
    taken = sampling(stamps[first:last], rate)
    return Stretch(first=first, stop=last, start=float(stamps[first]), sampling=taken)


def first_at(times: FloatArray, limit: float) -> int:
    """First sample at or after `limit`, s; their number if there is none."""
    for block in arrays.blocks(times.size):
        reached = times[block] >= limit - _SLACK
        if reached.any():
            return int(block.start + reached.argmax())
    return times.size
