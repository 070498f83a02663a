"""Raw columns and what was stated about them -> Recording. The one place that does so."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import RecordingError, as_note, counted
from sagnac.formats.source import Column, Source, Stored
from sagnac.formats.statement import Statement, as_kind, is_counts, is_unit, of_name, split_factor
from sagnac.recording.encoder import fill_missing, mark_missing
from sagnac.recording.kinds import unwrapped
from sagnac.recording.model import Channel, Kind, Provenance, Recording
from sagnac.recording.quality import integrity
from sagnac.recording.stamps import median_step
from sagnac.units import ANGLE_UNITS, ARCSECOND, RATE_UNITS, TIME_UNITS, canonical

GYRO_NAMES: Final = ("x", "y", "z")
TABLE_NAMES: Final = ("table", "alpha", "encoder")
TIME_NAMES: Final = ("time", "t")

# Sampling is called uniform when no stamp is off its place by more than this share of a step.
UNIFORM: Final = 1e-6
# Rates stated twice, by stamps and in words, have to agree to this.
RATE_AGREEMENT: Final = 0.01
# Twice the periodic error that an encoder may have: what an interpolated reading may be off by.
ENCODER_ACCURACY: Final = 10.0 * ARCSECOND
_TURN: Final = 2.0 * math.pi
# A stamp that misses the limit of a slice by less than this, s, is at it.
_SLACK: Final = 1e-9


def assemble(
    path: Path,
    source: Source,
    layers: Sequence[Statement],
    provenance: Callable[[], Provenance],
    notes: Iterable[str] = (),
    *,
    verify: bool = True,
) -> Recording:
    """Build the recording.

    Parameters
    ----------
    path
        For the messages.
    source
        The opened file.
    layers
        Statements, the one that is heard first first.
    provenance
        Gives where the file came from, called once the columns are there; the span is
        filled in here.
    notes
        What was noticed before.
    verify
        Raise on what `integrity` calls an error, and keep the rest as notes. Without, the
        findings are left to `check`.

    Raises
    ------
    RecordingError
        If a column, kind, unit or rate is missing or contradicts another, or the data are
        not sound.
    """
    builder = _Builder(path, source, layers, list(notes))
    return builder.build(provenance, verify=verify)


class _Builder:
    """One reading: the source, the statements and the notes made on the way."""

    def __init__(
        self, path: Path, source: Source, layers: Sequence[Statement], notes: list[str]
    ) -> None:
        self.path = path
        self.source = source
        self.layers = layers
        self.notes = notes

    def build(self, provenance: Callable[[], Provenance], *, verify: bool) -> Recording:
        gyros = self.gyro_columns()
        table = self.stated_column("table", TABLE_NAMES, "--table")
        time = self.stated_column("time", TIME_NAMES, "--time")
        null_pulse = self.null_column()
        kinds = {name: self.kind_of(name, column) for name, column in gyros.items()}
        scales = {
            name: self.gyro_scale(name, column, kinds[name]) for name, column in gyros.items()
        }
        table_scale = self.table_scale(*table) if table else None
        time_scale = self.time_scale(*time) if time else None
        rate = self.first("sample_rate")
        if time_scale is None and rate is None:
            raise self.error(
                "",
                "neither a sample rate nor time stamps are stated",
                "state --rate HZ or --time COLUMN:UNIT",
            )

        wanted = [*gyros.values(), *(c[0] for c in (table, time) if c)]
        wanted += [null_pulse] if null_pulse else []
        keys = [column.key for column in wanted]
        for key in keys:
            if keys.count(key) > 1:
                raise RecordingError(
                    f"{self.path}: {key}: the column is named for two channels; give each its own "
                    "with --columns, --table and --time"
                )
        stored = self.source.load(keys)
        self.check_lengths(stored.lengths)

        times: FloatArray | None = None
        span = (0, stored.lengths[keys[0]])
        statement_span = self.layers[0].span
        if time is not None and time_scale is not None and span[1] > 1:
            until = statement_span[1] if statement_span is not None else None
            stamps = _seconds(stored, time[0].key, time_scale, until)
            if statement_span is not None:
                span = self.filled(_span_of_times(stamps, statement_span))
            start = float(stamps[span[0]])
            times, rate = self.sampling(stamps[span[0] : span[1]], rate)
        elif rate is not None:
            if statement_span is not None:
                span = self.filled(_span_of_rate(span[1], rate, statement_span))
            start = span[0] / rate
        else:
            raise self.error(
                "time", "one sample or none is too few to tell a rate", "give a longer file"
            )
        span_s: tuple[float, float] | None = None
        if statement_span is not None:
            stop = start + (span[1] - span[0]) / rate
            span_s = (start, stop)

        channels: list[Channel] = []
        bits = self.first("counter_bits")
        wanted = [*gyros.values(), *([table[0]] if table else [])]
        columns = _columns(stored, [column.key for column in wanted], span)
        for name, column in gyros.items():
            raw = columns.pop(column.key)
            if bits is not None:
                raw = self.roll_over(name, raw, kinds[name], bits)
            factor, unit = scales[name]
            channels.append(
                Channel(name=name, kind=kinds[name], shown_in=unit, values=_scaled(raw, factor))
            )
        table_channel = None
        if table is not None and table_scale is not None:
            table_channel = self.table_channel(columns.pop(table[0].key), table_scale, bits)
        pulse = None
        if null_pulse is not None:
            key = null_pulse.key
            pulse = self.pulses(null_pulse, _columns(stored, [key], span)[key])
        recording = Recording(
            gyros=tuple(channels),
            sample_rate=rate,
            times=times,
            table=table_channel,
            null_pulse=pulse,
            provenance=replace(provenance(), span_s=span_s),
            notes=tuple(as_note(note) for note in self.notes),
        )
        return self.verified(recording) if verify else recording

    def verified(self, recording: Recording) -> Recording:
        notes = list(recording.notes)
        for finding in integrity(recording):
            if finding.level == "error":
                raise RecordingError.of(finding, str(self.path))
            notes.append(finding)
        return replace(recording, notes=tuple(notes))

    def error(self, channel: str, wrong: str, remedy: str) -> RecordingError:
        about = f"{channel}: " if channel else ""
        return RecordingError(f"{self.path}: {about}{wrong}; {remedy}")

    def missing(self, name: str, option: str) -> RecordingError:
        present = ", ".join(column.key for column in self.source.columns) or "no numeric column"
        if len(present) > 400:
            present = present[:400] + " ..."
        return RecordingError(
            f"{self.path}: {name}: no such column; the file has {present}; name one with {option}"
        )

    def first(self, field: str) -> Any:
        """What the first layer that says anything says for `field`."""
        for layer in self.layers:
            value = getattr(layer, field)
            if value is not None:
                return value
        return None

    def find(self, name: str) -> Column | None:
        """The column of that full name, else the only one of that name without its unit."""
        for column in self.source.columns:
            if column.key == name:
                return column
        alike = [column for column in self.source.columns if column.name == name]
        if len(alike) > 1:
            keys = ", ".join(column.key for column in alike)
            raise RecordingError(
                f"{self.path}: {name}: more than one column has this name, {keys}; give the full "
                "name with --columns"
            )
        return alike[0] if alike else None

    def mapped(self, name: str) -> str | None:
        """The file's name for `name` where a layer gives one."""
        for layer in self.layers:
            if name in layer.columns:
                return layer.columns[name]
        return None

    def gyro_columns(self) -> dict[str, Column]:
        reserved = {"table", "time", "null_pulse"}
        names: Sequence[str] = ()
        for layer in self.layers:
            names = layer.gyros or [name for name in layer.columns if name not in reserved]
            if names:
                break
        if names:
            gyros = {}
            for name in names:
                column = self.find(self.mapped(name) or name)
                if column is None:
                    raise self.missing(
                        self.mapped(name) or name, "--gyros or --columns NAME=COLUMN"
                    )
                gyros[name] = column
            return gyros
        found = ((name, self.find(name)) for name in GYRO_NAMES)
        gyros = {name: column for name, column in found if column is not None}
        if not gyros:
            raise self.missing("x, y, z", "--columns x=COLUMN or --gyros COLUMN")
        return gyros

    def stated_column(
        self, role: str, names: Sequence[str], option: str
    ) -> tuple[Column, str | None] | None:
        """Column for the table or the time, with the unit stated beside its name, if any.

        Stamps without a unit are left out, and noted, where a rate is stated.
        """
        stated: str | None = self.first(role) or self.mapped(role)
        if stated == "none":
            return None
        if stated is not None:
            column = self.find(stated)
            if column is not None:
                return column, None
            name, colon, unit = stated.rpartition(":")
            column = self.find(name) if colon else None
            if column is None:
                raise self.missing(name if colon else stated, f"{option} COLUMN:UNIT")
            return column, unit
        taken = {column.key for column in self.gyro_columns().values()}
        for name in names:
            column = self.find(name)
            if column is None or column.key in taken:
                continue
            unit_is_stated = column.unit is not None or self.stated_unit(role) is not None
            if not unit_is_stated and role == "time" and self.first("sample_rate") is not None:
                self.notes.append(
                    f"time: column {column.key} has no unit and is left out, the rate is stated; "
                    f"--time {column.key}:UNIT takes it"
                )
                continue
            return column, None
        return None

    def stated_unit(self, name: str) -> str | None:
        """A unit given by name in any layer; the one for all gyros does not count."""
        for layer in self.layers:
            if layer.unit is not None and not isinstance(layer.unit, str) and name in layer.unit:
                return layer.unit[name]
        return None

    def null_column(self) -> Column | None:
        stated = self.first("null_pulse") or self.mapped("null_pulse")
        column = self.find(stated or "null_pulse")
        if stated and column is None:
            raise self.missing(stated, "--null-pulse COLUMN")
        return column

    def kind_of(self, name: str, column: Column) -> Kind:
        for layer in self.layers[:-1]:
            kind = of_name(layer.kind, name)
            if kind is not None:
                return as_kind(kind)
        kind = column.kind or of_name(self.layers[-1].kind, name)
        if kind is None:
            raise self.error(name, "its kind is not stated", "state --kind angle|increment|rate")
        if kind not in ("angle", "increment", "rate"):
            raise self.error(
                name,
                f"the file says kind {kind!r}, which is none",
                "state --kind angle|increment|rate",
            )
        return as_kind(kind)

    def gyro_scale(self, name: str, column: Column, kind: Kind) -> tuple[float, str]:
        """SI size of one raw unit of a gyro, and the unit in words."""
        by_layer = [of_name(layer.unit, name) for layer in self.layers]
        in_words = next((unit for unit in by_layer[:-1] if unit is not None), None)
        by_file = column.unit or by_layer[-1]
        unit = in_words or by_file
        scale: str | None = self.first("scale")
        if unit is None and scale is None:
            raise self.error(name, "its unit is not stated", "state --unit, arcsec for one")
        if in_words and by_file and canonical(in_words) != canonical(by_file):
            self.notes.append(f"{name}: the file says {by_file}, taken as {in_words} as stated")
        if unit is not None and not is_unit(unit):
            raise self.error(
                name, f"unit {unit!r} is not known", "state --unit arcsec, deg/s or counts"
            )
        if unit is None or is_counts(unit):
            if scale is None:
                raise self.error(
                    name, "it is in counts and their size is not stated", "state --scale 0.1arcsec"
                )
            unit = scale
        elif scale is not None:
            raise self.error(
                name,
                f"its unit {unit} and a scale per count contradict each other",
                "state --unit counts and --scale, or --unit alone",
            )
        factor, base = split_factor(unit)
        wanted, other = (RATE_UNITS, ANGLE_UNITS) if kind == "rate" else (ANGLE_UNITS, RATE_UNITS)
        if base not in wanted:
            quantity = "angle" if kind == "rate" else "rate"
            what = f"a unit of {quantity}" if base in other else "no unit of a gyro"
            raise self.error(
                name, f"kind {kind} contradicts {base}, {what}", "state the right --kind or --unit"
            )
        return factor * wanted[base], unit

    def table_scale(self, column: Column, unit: str | None) -> tuple[float, str]:
        unit = unit or self.stated_unit("table") or column.unit
        option = f"state --table {column.key}:deg"
        if unit is None:
            raise self.error(
                "table",
                f"the unit of column {column.key} is not stated",
                f"{option}, or leave it out with --table none",
            )
        factor, base = split_factor(unit)
        if base not in ANGLE_UNITS or factor <= 0.0:
            raise self.error("table", f"unit {unit!r} is not one of angle", option)
        return factor * ANGLE_UNITS[base], unit

    def time_scale(self, column: Column, unit: str | None) -> float:
        unit = unit or self.stated_unit("time") or column.unit
        option = f"state --time {column.key}:s"
        if unit is None:
            raise self.error("time", f"the unit of column {column.key} is not stated", option)
        if canonical(unit) not in TIME_UNITS:
            raise self.error("time", f"unit {unit!r} is not one of time", option)
        return TIME_UNITS[canonical(unit)]

    def check_lengths(self, lengths: Mapping[str, int]) -> None:
        (first, *others) = lengths.items()
        for key, length in others:
            if length != first[1]:
                raise RecordingError(
                    f"{self.path}: {key}: has {length} samples but {first[0]} has {first[1]}; name "
                    "columns sampled together with --columns"
                )

    def filled(self, span: tuple[int, int]) -> tuple[int, int]:
        """`span`, refused where it holds too few samples to tell a rate from their stamps."""
        if span[1] - span[0] < 2:
            raise self.error(
                "", "fewer than two samples lie in the slice", "widen --slice START:STOP"
            )
        return span

    def sampling(
        self, stamps: FloatArray, stated_rate: float | None
    ) -> tuple[FloatArray | None, float]:
        """Stamps (None where uniform) and rate.

        The rate is the mean one: the median interval of stamps on a clock of 1 ms is
        0.010 s both for 99.9 Hz and for 100 Hz.
        """
        times = series.less(stamps, stamps[0])
        finite = all(np.isfinite(times[span]).all() for span in series.through(times.size, times))
        if times.size < 2 or not finite or times[-1] <= 0.0:
            if stated_rate is not None:
                return times, stated_rate
            usual = median_step(times, repeats=False)
            if math.isnan(usual):
                raise self.error("time", "does not run forwards", "state --time none and --rate HZ")
            return times, 1.0 / usual
        step = float(times[-1]) / (times.size - 1)
        worst = 0.0
        for span in series.through(times.size, times):
            off = np.arange(span.start, span.stop) * step
            off -= times[span]
            worst = max(worst, float(off.max()), -float(off.min()))
        clock = _resolution(times)
        # Stamps are exact only to the last digit that was written, or that a float holds.
        slack = max(UNIFORM * step, 1e-9 * clock, 4.0 * float(np.spacing(times[-1])))
        rate = _tidy(1.0 / step, (min(worst, clock) + slack) / float(times[-1]))
        if stated_rate is not None and abs(rate / stated_rate - 1.0) > RATE_AGREEMENT:
            raise RecordingError(
                f"{self.path}: time: the stamps give {rate:.6g} Hz but {stated_rate:.6g} Hz is "
                "stated; leave out --rate, or ignore the stamps with --time none"
            )
        if worst <= slack:
            return None, rate
        if worst <= 0.75 * clock < 0.75 * step:
            self.notes.append(
                f"time: stamps are those of uniform sampling at {rate:.9g} Hz on a clock of "
                f"{clock:g} s: taken as uniform"
            )
            return None, rate
        self.notes.append(
            f"time: sampling is not uniform, mean rate {rate:.6g} Hz, stamps up to {worst:.3g} s "
            "off an even spacing"
        )
        return times, rate

    def roll_over(self, name: str, raw: FloatArray, kind: Kind, bits: int) -> FloatArray:
        if kind != "angle":
            raise self.error(
                name,
                f"a counter that rolls over is an angle, not kind {kind}",
                "state --kind angle, or leave out --counter-bits",
            )
        period = float(2**bits)
        extent = _extent(raw)
        if extent >= period:
            raise self.error(
                name,
                f"it spans {extent:.6g} counts, more than {bits} bits hold",
                "state the right --counter-bits",
            )
        values, wraps = unwrapped(raw, period)
        if wraps:
            self.notes.append(
                f"{name}: the {bits} bit counter rolled over {wraps} times: unwrapped"
            )
        return values

    def table_channel(self, raw: FloatArray, scale: tuple[float, str], bits: int | None) -> Channel:
        factor, unit = scale
        period = _TURN / factor
        marked = mark_missing(raw, period)
        if marked.off_path:
            alike = "" if marked.reading is None else f", all reading {marked.reading:.6g} {unit}"
            self.notes.append(
                f"table: {counted(marked.off_path, 'sample')} off its path{alike}: taken as missing"
            )
        if marked.held:
            self.notes.append(
                f"table: {counted(marked.held, 'repeated sample')} while it turns: taken as missing"
            )
        extent = _extent(raw)
        if extent > period * (1.0 + 1e-9):
            # More than a turn at once: it is a running angle, or a counter wider than a turn.
            width = 2.0**bits if bits is not None and split_factor(unit)[0] != 1.0 else 0.0
            period = width if extent < width else math.inf
        filled = fill_missing(raw, period, accuracy=ENCODER_ACCURACY / factor)
        if filled.samples:
            error = filled.error * factor / ARCSECOND
            known = f" (known ones are met to {error:.2g} arcsec)" if math.isfinite(error) else ""
            self.notes.append(
                f"table: {counted(filled.samples, 'missing sample')}, at most {filled.longest} in "
                f"a row, interpolated from their neighbours{known}"
            )
        values, wraps = (raw, 0) if math.isinf(period) else unwrapped(raw, period)
        if wraps:
            self.notes.append(f"table: unwrapped where it starts over, {wraps} times")
        if not math.isinf(period) and values.size > 1:
            largest = 0.0
            for span in series.through(values.size - 1, values):
                steps = np.abs(np.diff(values[span.start : span.stop + 1]))
                largest = max(largest, float(np.fmax.reduce(steps)) / period)
            if largest > 0.25:
                self.notes.append(
                    f"table: moves by up to {largest:.2f} of its range between samples; "
                    "unwrapping is in doubt"
                )
        return Channel(name="table", kind="angle", shown_in=unit, values=_scaled(values, factor))

    def pulses(self, column: Column, values: FloatArray) -> NDArray[np.bool_]:
        levels = np.unique(series.every(values, max(1, values.size // 100_000)))
        rising = np.empty(values.size, dtype=np.bool_)
        finite = True
        for span in series.through(values.size, values):
            finite = finite and bool(np.isfinite(values[span]).all())
            np.not_equal(values[span], 0.0, out=rising[span])
        if levels.size > 2 or not finite:
            raise self.error(
                "null_pulse",
                f"column {column.key} takes more than two values",
                "name a column of 0 and 1 with --null-pulse",
            )
        high = np.count_nonzero(rising)
        rising[1:] &= ~rising[:-1]
        if np.count_nonzero(rising) < high:
            self.notes.append("null_pulse: stays up for more than a sample; its first is taken")
        return rising


def _columns(stored: Stored, keys: Sequence[str], span: tuple[int, int]) -> dict[str, FloatArray]:
    """The samples of `span`, converted piece by piece: no column is in memory twice."""
    size = span[1] - span[0]
    columns = {key: series.empty(size) for key in keys}
    filled = dict.fromkeys(keys, 0)
    for piece in stored.pieces(keys, *span):
        for key, values in piece.items():
            own = (
                values.dtype == np.float64 and values.flags.writeable and values.flags.c_contiguous
            )
            if own and values.size == size and not series.is_mapped(columns[key]):
                columns[key] = values
                continue
            columns[key][filled[key] : filled[key] + values.size] = values
            series.release(columns[key])
            filled[key] += values.size
    return columns


def _seconds(stored: Stored, key: str, scale: float, until: float | None) -> FloatArray:
    """Stamps in s from the first, to the one at `until`.

    Integers lose nothing by the size of the epoch.
    """
    times = series.empty(stored.lengths[key])
    origin: Any = None
    filled = 0
    for piece in stored.pieces([key], 0, times.size):
        raw = piece[key]
        origin = raw[0] if origin is None else origin
        seconds = np.asarray(raw - origin, dtype=np.float64) * scale
        times[filled : filled + raw.size] = seconds
        series.release(times)
        filled += raw.size
        if until is not None and (seconds >= until - _SLACK).any():
            break
    return times[:filled]


def _extent(values: FloatArray) -> float:
    """Largest less smallest of the finite samples."""
    lowest, highest = math.inf, -math.inf
    for span in series.through(values.size, values):
        finite = values[span][np.isfinite(values[span])]
        if finite.size:
            lowest, highest = min(lowest, float(finite.min())), max(highest, float(finite.max()))
    return max(highest - lowest, 0.0)


def _scaled(values: FloatArray, factor: float) -> FloatArray:
    if factor != 1.0:
        for span in series.through(values.size, values):
            values[span] *= factor
    return values


def _span_of_times(times: FloatArray, span: tuple[float | None, float | None]) -> tuple[int, int]:
    """First sample at or after START to the first at or after STOP, in the file's order."""
    start, stop = span
    first = _first_at(times, start or 0.0)
    return first, times.size if stop is None else first + _first_at(times[first:], stop)


def _first_at(times: FloatArray, limit: float) -> int:
    """First sample at or after `limit`, s; their number where there is none."""
    for span in series.through(times.size, times):
        reached = times[span] >= limit - _SLACK
        if reached.any():
            return int(span.start + np.argmax(reached))
    return times.size


def _span_of_rate(
    samples: int, rate: float, span: tuple[float | None, float | None]
) -> tuple[int, int]:
    start, stop = span
    first = min(samples, math.ceil((start or 0.0) * rate - 1e-6))
    last = samples if stop is None else min(samples, math.ceil(stop * rate - 1e-6))
    return first, last


def _resolution(times: FloatArray) -> float:
    """Clock step of the stamps: the coarsest power of ten that they are multiples of, s."""
    sample = series.every(times, max(1, times.size // 10_000))
    for exponent in range(0, 10):
        ticks = sample * 10.0**exponent
        if np.abs(ticks - np.rint(ticks)).max() < 1e-3:
            return float(10.0**-exponent)
    return 0.0


def _tidy(rate: float, uncertainty: float) -> float:
    """`rate`, or the round figure it cannot be told from (relative `uncertainty`)."""
    for digits in range(0, 10):
        rounded = round(rate, digits)
        if rounded > 0.0 and abs(rounded - rate) <= uncertainty * rate:
            return rounded
    return rate
