"""Raw columns and what was stated about them -> Recording. The one place that does so."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagnac.formats.source import Column, Source
from sagnac.formats.statement import (
    Statement,
    as_kind,
    is_counts,
    is_unit,
    of_name,
    split_factor,
)
from sagnac.recording import (
    Channel,
    FloatArray,
    Kind,
    Provenance,
    Recording,
    RecordingError,
    integrity,
    unwrapped,
)
from sagnac.units import ANGLE_UNITS, RATE_UNITS, TIME_UNITS, canonical

GYRO_NAMES: Final = ("x", "y", "z")
TABLE_NAMES: Final = ("table", "alpha", "encoder")
TIME_NAMES: Final = ("time", "t")

# Sampling is called uniform when no stamp is off its place by more than this share of a step.
UNIFORM: Final = 1e-6
# Rates stated twice, by stamps and in words, have to agree to this.
RATE_AGREEMENT: Final = 0.01
_TURN: Final = 2.0 * math.pi


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
        arrays = self.source.load(keys)
        self.check_lengths(arrays)

        times: FloatArray | None = None
        span = (0, next(iter(arrays.values())).size)
        statement_span = self.layers[0].span
        if time is not None and time_scale is not None and span[1] > 1:
            raw_times = self.seconds(arrays.pop(time[0].key), time_scale)
            if statement_span is not None:
                span = self.filled(_span_of_times(raw_times, statement_span))
            times, rate = self.sampling(raw_times[span[0] : span[1]], rate)
            start = float(raw_times[span[0]])
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
        for name, column in gyros.items():
            raw = self.floats(arrays, column, span)
            if bits is not None:
                raw = self.roll_over(name, raw, kinds[name], bits)
            factor, unit = scales[name]
            channels.append(
                Channel(name=name, kind=kinds[name], unit=unit, values=_scaled(raw, factor))
            )
        table_channel = None
        if table is not None and table_scale is not None:
            raw = self.floats(arrays, table[0], span)
            table_channel = self.table_channel(raw, table_scale, bits)
        pulse = None
        if null_pulse is not None:
            pulse = self.pulses(null_pulse, arrays[null_pulse.key][span[0] : span[1]])
        recording = Recording(
            gyros=tuple(channels),
            sample_rate=rate,
            times=times,
            table=table_channel,
            null_pulse=pulse,
            provenance=replace(provenance(), span_s=span_s),
            notes=tuple(self.notes),
        )
        return self.verified(recording) if verify else recording

    def verified(self, recording: Recording) -> Recording:
        notes = list(recording.notes)
        for finding in integrity(recording):
            about = f"{finding.channel}: " if finding.channel else ""
            if finding.level == "error":
                raise RecordingError(f"{self.path}: {about}{finding.message}")
            notes.append(f"{about}{finding.message}")
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

    def check_lengths(self, arrays: dict[str, NDArray[Any]]) -> None:
        (first, *others) = arrays.items()
        for key, values in others:
            if values.size != first[1].size:
                raise RecordingError(
                    f"{self.path}: {key}: has {values.size} samples but {first[0]} has "
                    f"{first[1].size}; name columns sampled together with --columns"
                )

    def floats(
        self, arrays: dict[str, NDArray[Any]], column: Column, span: tuple[int, int]
    ) -> FloatArray:
        # Each raw array is let go or taken over as it is converted: two hours of samples are
        # then never in memory twice.
        raw = arrays.pop(column.key)[span[0] : span[1]]
        own = raw.dtype == np.float64 and raw.flags.writeable and raw.flags.c_contiguous
        return raw if own else np.array(raw, dtype=np.float64)

    def seconds(self, raw: NDArray[Any], scale: float) -> FloatArray:
        """Stamps in s from the first; integers lose nothing by the size of the epoch."""
        return _scaled(np.asarray(raw - raw[0], dtype=np.float64), scale)

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
        times = stamps - stamps[0] if stamps.size else stamps
        if times.size < 2 or not np.isfinite(times).all() or times[-1] <= 0.0:
            if stated_rate is not None:
                return times, stated_rate
            steps = np.diff(times)
            usable = steps[np.isfinite(steps) & (steps > 0.0)]
            if usable.size == 0:
                raise self.error("time", "does not run forwards", "state --time none and --rate HZ")
            return times, 1.0 / float(np.median(usable))
        step = float(times[-1]) / (times.size - 1)
        off = np.arange(times.size) * step
        off -= times
        worst = float(max(off.max(), -off.min()))
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
        extent = _extent(raw)
        period = _TURN / factor
        if extent > period * (1.0 + 1e-9):
            # More than a turn at once: it is a running angle, or a counter wider than a turn.
            width = 2.0**bits if bits is not None and split_factor(unit)[0] != 1.0 else 0.0
            period = width if extent < width else math.inf
        values, wraps = (raw, 0) if math.isinf(period) else unwrapped(raw, period)
        if wraps:
            self.notes.append(f"table: unwrapped where it starts over, {wraps} times")
        if not math.isinf(period) and values.size > 1:
            steps = np.diff(values)
            largest = max(float(steps.max()), -float(steps.min())) / period
            if largest > 0.25:
                self.notes.append(
                    f"table: moves by up to {largest:.2f} of its range between samples; "
                    "unwrapping is in doubt"
                )
        return Channel(name="table", kind="angle", unit=unit, values=_scaled(values, factor))

    def pulses(self, column: Column, raw: NDArray[Any]) -> NDArray[np.bool_]:
        values = np.asarray(raw, dtype=np.float64)
        levels = np.unique(values[:: max(1, values.size // 100_000)])
        if levels.size > 2 or not np.isfinite(values).all():
            raise self.error(
                "null_pulse",
                f"column {column.key} takes more than two values",
                "name a column of 0 and 1 with --null-pulse",
            )
        high = values != 0.0
        rising: NDArray[np.bool_] = high.copy()
        rising[1:] &= ~high[:-1]
        if np.count_nonzero(rising) < np.count_nonzero(high):
            self.notes.append("null_pulse: stays up for more than a sample; its first is taken")
        return rising


def _extent(values: FloatArray) -> float:
    """Largest less smallest of the finite samples."""
    extent = float(np.ptp(values)) if values.size else 0.0
    if math.isfinite(extent):
        return extent
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if finite.size else 0.0


def _scaled(values: FloatArray, factor: float) -> FloatArray:
    if factor != 1.0:
        values *= factor
    return values


def _span_of_times(times: FloatArray, span: tuple[float | None, float | None]) -> tuple[int, int]:
    """First sample at or after START to the first at or after STOP, in the file's order."""
    start, stop = span
    after = times >= (start or 0.0) - 1e-9
    first = int(np.argmax(after)) if after.any() else times.size
    if stop is None:
        return first, times.size
    beyond = times[first:] >= stop - 1e-9
    return first, first + int(np.argmax(beyond)) if beyond.any() else times.size


def _span_of_rate(
    samples: int, rate: float, span: tuple[float | None, float | None]
) -> tuple[int, int]:
    start, stop = span
    first = min(samples, math.ceil((start or 0.0) * rate - 1e-6))
    last = samples if stop is None else min(samples, math.ceil(stop * rate - 1e-6))
    return first, last


def _resolution(times: FloatArray) -> float:
    """Clock step of the stamps: the coarsest power of ten that they are multiples of, s."""
    sample = times[:: max(1, times.size // 10_000)]
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
