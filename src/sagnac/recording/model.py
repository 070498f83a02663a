"""A recording: gyro channels, the table encoder, sample times, and where they came from."""

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Self, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagnac.core.arrays import BooleanArray, FloatArray, pandas_for
from sagnac.core.errors import Note, RecordingError, quoted, refusal, require_choice, require_type
from sagnac.core.units import split_header
from sagnac.recording import channel as channels
from sagnac.recording import columns as conversions
from sagnac.recording.channel import PICKOFF, Channel, Compared, Conversion, Kind, Pickoff
from sagnac.recording.columns import NULL_PULSE_NAME
from sagnac.recording.encoder_readings import table_of_readings, with_lost_readings
from sagnac.recording.stamps import RATE_AGREEMENT, Sampling, require_forwards, sampling

__all__ = ["MINIMUM_SAMPLES", "Channel", "Kind", "Provenance", "Recording", "second_of"]

MINIMUM_SAMPLES: Final = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """Where a recording came from.

    Attributes
    ----------
    path, sha256, format
        Of the file.
    span_s
        Start and stop of the span that was taken, s from the first sample of the file; None
        for all of it.

    Raises
    ------
    ValueError
        If the span stops before it starts.
    """

    path: str
    sha256: str
    format: str
    span_s: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if self.span_s is not None and not self.span_s[0] <= self.span_s[1]:
            raise refusal("span_s", f"is {self.span_s}; give (start, stop) in s, start first")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Recording(Compared):
    """Gyros and table encoder sampled together, in SI.

    `from_arrays` makes one from arrays in the units of the field, `from_frame` from a frame.

    Attributes
    ----------
    gyros
        One or more gyro channels, all of one length.
    sample_rate
        Nominal samples per second.
    times
        (samples,) sample times in s from the first sample, or None if sampling is uniform.
    table
        Table angle from the encoder, unwrapped (kind ``angle``), or None at rest.
    null_pulse
        (samples,) bool, true on the first sample at or after the null pulse, or None.
    provenance
        None for a recording that never was a file.
    notes
        Everything noticed while reading.
    accelerometers
        Channels of accelerometers sampled with the gyros; empty if there are none.
    pickoffs
        Of the dithers, sampled with the gyros; empty if there are none.
    temperature
        (samples,) in the unit of its column, sampled with the gyros; None if there is none.

    Raises
    ------
    ValueError
        If there is no gyro, two have one name, lengths differ, the table is not one of angle,
        `times` or `null_pulse` have another type, a pick-off is of no gyro that is there, or the
        rate is no finite number above zero.

    Examples
    --------
    >>> import numpy as np
    >>> rate = np.array([10.01, 9.99, 10.0, 10.02])
    >>> recording = Recording.from_arrays(
    ...     x=rate, kind="rate", unit="deg/s", sample_rate=100.0,
    ...     table=[359.8, 359.9, 0.0, 0.1], table_unit="deg",
    ... )
    >>> recording
    Recording(x (rate, deg/s); table (angle, deg); 4 samples at 100 Hz, 0.04 s)
    >>> np.degrees(recording.table.values).round(3)
    array([359.8, 359.9, 360. , 360.1])
    >>> print(recording.notes[0])
    table: unwrapped where it starts over, 1 time
    >>> len(recording[1:]), recording["x"].shown_in
    (3, 'deg/s')
    """

    gyros: tuple[Channel, ...]
    sample_rate: float
    times: FloatArray | None = None
    table: Channel | None = None
    null_pulse: NDArray[np.bool_] | None = None
    provenance: Provenance | None = None
    notes: tuple[Note, ...] = ()
    accelerometers: tuple[Channel, ...] = ()
    pickoffs: tuple[Pickoff, ...] = ()
    temperature: FloatArray | None = None

    def __post_init__(self) -> None:
        for several in ("gyros", "accelerometers", "notes", "pickoffs"):
            object.__setattr__(self, several, tuple(getattr(self, several)))
        if not self.gyros:
            raise refusal("gyros", "is empty; give one channel or more")
        names = [channel.name for channel in (*self.gyros, *self.accelerometers)]
        if len(set(names)) < len(names):
            raise refusal("gyros", f"are called {', '.join(names)}; give each a name of its own")
        dithered = [pickoff.gyro for pickoff in self.pickoffs]
        if len(set(dithered)) < len(dithered) or not set(dithered) <= set(names):
            raise ValueError(f"pick-offs are of {', '.join(dithered)}; give one a gyro at most")
        channels.require_rate(self.sample_rate)
        # An array of one number, too.
        object.__setattr__(self, "sample_rate", float(self.sample_rate))
        if self.table is not None and self.table.kind != "angle":
            remedy = "give the angle of the table, kind 'angle'"
            raise refusal("table", f"is of kind {self.table.kind!r}; {remedy}")
        self._require_columns()

    def _require_columns(self) -> None:
        """Refuse what was not sampled together with the first gyro."""
        columns: dict[str, NDArray[Any] | None] = {
            **{f"gyro {one.name}": one.values for one in self.gyros},
            **{f"accelerometer {one.name}": one.values for one in self.accelerometers},
            **{f"pick-off of gyro {one.gyro}": one.values for one in self.pickoffs},
            "table": None if self.table is None else self.table.values,
            **{name: getattr(self, name) for name in ("times", "temperature", "null_pulse")},
        }
        for argument, values in columns.items():
            if values is None:
                continue
            wanted = np.bool_ if argument == "null_pulse" else np.float64
            held = getattr(values, "dtype", type(values).__name__)
            if held != wanted:
                raise refusal(argument, f"holds {held}; give an array of {wanted.__name__}")
            if values.shape != (self.samples,):
                first = f"gyro {self.gyros[0].name} has {self.samples} samples"
                problem = f"has shape {values.shape}; {first}: give columns sampled together"
                raise refusal(argument, problem)

    @classmethod
    def from_arrays(
        cls,
        *,
        kind: Kind | Mapping[str, Kind],
        unit: str | Mapping[str, str],
        sample_rate: float | None = None,
        times: ArrayLike | None = None,
        time_unit: str = "s",
        table: ArrayLike | None = None,
        table_unit: str | None = None,
        null_pulse: ArrayLike | None = None,
        period: float | None = None,
        pickoffs: Mapping[str, ArrayLike] | None = None,
        temperature: ArrayLike | None = None,
        **gyros: ArrayLike,
    ) -> Self:
        """A recording from columns in the units of the field, one keyword a gyro or accelerometer.

        Values are converted to SI. A column in a unit of force (``m/s^2``, ``g``; ``m/s`` for
        increments of velocity) is an accelerometer, and stands in the place of a gyro if there is
        no gyro. Encoder readings that are missing are interpolated and those
        that start over at a full turn unwrapped; time stamps of uniform sampling are left out;
        all as on reading a file, and noted.

        Parameters
        ----------
        kind
            What one sample is: ``angle``, ``increment`` or ``rate``; one for all sensors, or by
            name.
        unit
            Of the sensors; one for all, or by name.
        sample_rate
            Samples per second. With `times` it has to agree with them.
        times
            (samples,) time stamps in `time_unit`, or dates of numpy.
        table
            (samples,) encoder readings in `table_unit`, degrees unless stated.
        null_pulse
            (samples,) not 0 at the null pulse.
        period
            Reading, in `unit`, at which the gyros' counters start over (kind ``angle``); None
            if they never do.
        pickoffs
            Gyro name -> (samples,) what the pick-off of its dither shows, in any unit.
        temperature
            (samples,), in any unit.
        **gyros
            Name -> (samples,) values of gyros and accelerometers: lists, arrays, columns of a
            frame.

        Raises
        ------
        ValueError
            If an argument makes no sense, states something of what is not given, or columns
            differ in length.
        RecordingError
            If stamps are missing, run backwards or contradict the rate, or a counter its period.

        Examples
        --------
        >>> Recording.from_arrays(x=[3600, 7200], kind="increment", unit="arcsec", sample_rate=2.0)
        Recording(x (increment, arcsec); 2 samples at 2 Hz, 1 s)
        >>> unit = {"x": "deg/s", "ax": "g"}
        >>> Recording.from_arrays(x=[0, 1], ax=[1, 1], kind="rate", unit=unit, sample_rate=2.0)
        Recording(x (rate, deg/s); ax (rate, g); 2 samples at 2 Hz, 1 s)
        """
        if not gyros:
            raise ValueError("no gyro is given; give one or more by name, x=values for one")
        for name, values in gyros.items():
            if np.isscalar(values):
                why = f"no argument is called {name}, and every other keyword is a gyro"
                raise refusal(name, f"has shape (); give one column, shape (samples,), since {why}")
            if name == "time":
                raise refusal("time", "is no name of a gyro; give time stamps as times")
        dithers = {} if pickoffs is None else pickoffs
        require_type("pickoffs", dithers, Mapping, "give {'x': readings of its pick-off}")
        taken = []
        for name, values in gyros.items():
            own_kind = conversions.stated_for(name, kind, "kind")
            own_unit = conversions.stated_for(name, unit, "unit")
            one = conversions.gyro_of(name, values, kind=own_kind, unit=own_unit, period=period)
            taken.append(one)
        for argument, stated in (("kind", kind), ("unit", unit)):
            for name in stated if isinstance(stated, Mapping) else ():
                require_choice(f"{argument}: name", name, gyros)
        if table is None and table_unit is not None:
            raise refusal("table_unit", f"is {quoted(table_unit)}, and there is no table; give one")
        sampling = _sampled(sample_rate, times, time_unit, taken[0].channel.values.size)
        others: dict[str, Any] = {}
        if table is not None:
            angle = channels.series(table, "table")
            others["table"] = table_of_readings(angle, table_unit or "deg")
        if null_pulse is not None:
            others["null_pulse"] = conversions.pulses_of(null_pulse)
        pairs = dithers.items()
        others["pickoffs"] = {name: channels.series(one, PICKOFF + name) for name, one in pairs}
        if temperature is not None:
            others["temperature"] = channels.series(temperature, "temperature")
        return cls.from_channels(taken, sampling, **others)

    @classmethod
    def from_channels(
        cls,
        sensors: Sequence[Conversion],
        sampling: Sampling,
        *,
        table: Conversion | None = None,
        null_pulse: tuple[BooleanArray, tuple[Note, ...]] | None = None,
        pickoffs: Mapping[str, FloatArray] | None = None,
        temperature: FloatArray | None = None,
    ) -> Self:
        """A recording from what was made of columns, with the notes on them.

        Parameters
        ----------
        sensors
            Gyros and accelerometers; these stand in the place of gyros if there is no gyro.
        sampling
            When they were sampled.
        table
            Its lost readings are taken from a gyro if one tells them.
        null_pulse
            (samples,) and what was noticed of it.
        pickoffs
            Gyro name -> (samples,)
        temperature
            (samples,)

        Raises
        ------
        ValueError
            If columns differ in length, or two sensors have one name.
        """
        forces = tuple(one.channel for one in sensors if one.channel.sensor == "accelerometer")
        turning = tuple(one.channel for one in sensors if one.channel.sensor == "gyro")
        if table is not None:
            table = with_lost_readings(table, turning, sampling.sample_rate)
        pulses, of_pulses = null_pulse or (None, ())
        dithers = (Pickoff(gyro=name, values=one) for name, one in (pickoffs or {}).items())
        of_columns = (note for one in (*sensors, *([table] if table else [])) for note in one.notes)
        return cls(
            gyros=turning or forces,
            accelerometers=forces if turning else (),
            sample_rate=sampling.sample_rate,
            times=sampling.times,
            table=table.channel if table else None,
            null_pulse=pulses,
            pickoffs=tuple(dithers),
            temperature=temperature,
            notes=(*sampling.notes, *of_columns, *of_pulses),
        )

    @classmethod
    def from_frame(
        cls,
        frame: Any,
        columns: Mapping[str, Hashable] | None = None,
        *,
        kind: Kind | Mapping[str, Kind] | None = None,
        unit: str | Mapping[str, str] | None = None,
        sample_rate: float | None = None,
        time_unit: str | None = None,
        table_unit: str | None = None,
        period: float | None = None,
    ) -> Self:
        """A recording from a frame: of pandas, of xarray, or a dictionary of columns.

        Parameters
        ----------
        frame
            What has columns by name. A column called ``x[deg/s]`` states its unit, and
            ``frame.attrs["kind"]`` the kind, where no argument does.
        columns
            Name wanted -> name in the frame: gyros and accelerometers by the names that they
            shall have, besides ``table``, ``time`` and ``null_pulse``. Without it, the columns
            called so, the gyros ``x``, ``y`` and ``z``, and of the accelerometers ``ax``, ``ay``
            and ``az`` those whose unit is stated are taken, as far as they are there. The dates
            of an index, or a coordinate ``time`` of xarray, are the time if there is no such column
            and no rate is stated; a rate that contradicts the dates counts, and a note says so.
        kind, unit, sample_rate, time_unit, table_unit, period
            See `from_arrays`; a time without a unit is in s and a table in degrees.

        Raises
        ------
        TypeError
            If the frame is none of these.
        ValueError
            If a column is not there, or as `from_arrays`.

        Examples
        --------
        >>> frame = {"x[deg/s]": [10.0, 10.1, 9.9], "table[deg]": [0.0, 0.1, 0.2]}
        >>> Recording.from_frame(frame, kind="rate", sample_rate=100.0)
        Recording(x (rate, deg/s); table (angle, deg); 3 samples at 100 Hz, 0.03 s)
        """
        headers = conversions.columns_of(frame, columns, unit)
        for one in getattr(frame, "coords", ()) if sample_rate is None else ():
            if split_header(str(one))[0] in conversions.USUAL_NAMES["time"]:
                headers.setdefault("time", one)
        values = {name: frame[header] for name, header in headers.items()}
        units = {name: split_header(str(header))[1] or "" for name, header in headers.items()}
        sensors = [name for name in headers if name not in ("table", "time", NULL_PULSE_NAME)]
        if not kind:
            kind = getattr(frame, "attrs", {}).get("kind")
            # A frame may have more gyros than are taken.
            if isinstance(kind, Mapping):
                kind = {name: kind[name] for name in sensors if name in kind}
        if kind is None:
            raise refusal("kind", "is not stated; state angle, increment or rate")
        times, index = values.pop("time", None), getattr(frame, "index", ())
        is_dated = conversions.with_dates(index).dtype.kind in "mM"
        times = index if times is None and sample_rate is None and is_dated else times
        made = cls.from_arrays(
            kind=kind,
            unit=unit or {name: units[name] for name in sensors if units[name]},
            sample_rate=sample_rate,
            times=times,
            time_unit=time_unit or units.get("time") or "s",
            table_unit=table_unit or units.get("table"),
            period=period,
            **values,
        )
        if times is None and is_dated:
            steps = np.diff(conversions.with_dates(index)) / np.timedelta64(1, "s")
            # Dates may be coarse, and a gap among them is no other rate.
            slack = RATE_AGREEMENT * steps.sum() + steps.max(initial=0.0)
            if 0.0 < slack < abs(steps.sum() - steps.size / made.sample_rate):
                rate = f"{steps.size / steps.sum():.6g} Hz"
                text = f"the dates of the index make {rate}, and the rate that is stated counts"
                note = Note(level="warning", channel="time", text=text)
                return replace(made, notes=(*made.notes, note))
        return made

    def to_frame(self) -> Any:
        """A pandas frame that `from_frame` takes: ``time[s]`` and a column a channel.

        Columns state the unit they are in, ``x[deg/s]``: the one that the channel is shown in,
        or the field's if a number stands before that. ``frame.attrs["kind"]`` holds the kinds.
        Temperature and pick-offs are left out.

        Raises
        ------
        MissingExtra
            If pandas is not installed.
        """
        pandas = pandas_for("a recording as a data frame")
        times = np.arange(self.samples) / self.sample_rate if self.times is None else self.times
        columns: dict[str, Any] = {"time[s]": times}
        for channel in self._channels:
            columns[f"{channel.name}[{channel.plain_unit}]"] = channel.values_in()
        if self.null_pulse is not None:
            columns[NULL_PULSE_NAME] = self.null_pulse
        frame = pandas.DataFrame(columns)
        frame.attrs["kind"] = {one.name: one.kind for one in (*self.gyros, *self.accelerometers)}
        return frame

    def __len__(self) -> int:
        return self.samples

    @overload
    def __getitem__(self, which: str) -> Channel: ...
    @overload
    def __getitem__(self, which: slice) -> Self: ...
    def __getitem__(self, which: str | slice) -> "Channel | Self":
        """A channel by its name, or a stretch of the samples as a recording.

        Raises
        ------
        KeyError
            If there is no such channel.
        ValueError
            If the stretch is empty, or takes not every sample.
        """
        if isinstance(which, str):
            by_name = {channel.name: channel for channel in self._channels}
            if which not in by_name:
                raise KeyError(f"{which}; there are {', '.join(by_name)}")
            return by_name[which]
        if not isinstance(which, slice):
            # An integer comes from numpy, too, if a recording is given in place of an array.
            remedy = "give 'x', whose values are an array, or 0:1000"
            raise TypeError(f"{quoted(which)} is no name and no slice; {remedy}")
        start, stop, step = which.indices(self.samples)
        if step != 1 or not start < stop:
            raise ValueError(f"{which} is no stretch; give the first sample and the one after it")
        stretch = slice(start, stop)
        times = None if self.times is None else self.times[stretch] - self.times[start]
        return self.with_columns(lambda values: values[stretch], times=times, provenance=None)

    def with_columns(self, change: Callable[[Any], Any], **others: Any) -> Self:
        """Every column but the times put through a function, and `others` in their places."""

        def changed(held: Any) -> Any:
            if isinstance(held, tuple):
                return tuple(map(changed, held))
            if isinstance(held, Channel | Pickoff):
                return replace(held, values=change(held.values))
            return None if held is None else change(held)

        columns = ("gyros", "accelerometers", "pickoffs", "table", "null_pulse", "temperature")
        return replace(self, **{one: changed(getattr(self, one)) for one in columns}, **others)

    @property
    def _channels(self) -> tuple[Channel, ...]:
        return (*self.gyros, *self.accelerometers, *([self.table] if self.table else []))

    @property
    def samples(self) -> int:
        """Number of samples."""
        return int(self.gyros[0].values.size)

    @property
    def duration(self) -> float:
        """Time covered, s: samples over sample rate, or the span of the time stamps."""
        if self.times is not None:
            return float(self.times[-1] - self.times[0]) + 1.0 / self.sample_rate
        return self.samples / self.sample_rate

    @property
    def path(self) -> str:
        """Path of the file it was read from, empty if it never was one."""
        return self.provenance.path if self.provenance else ""

    def gyro(self, name: str) -> Channel:
        """The gyro called `name`.

        Raises
        ------
        RecordingError
            If there is none; the message lists those there are.
        """
        return self._named(name, self.gyros, "gyro", "{gyros}, {columns}")

    def _named(self, name: str, channels: Sequence[Channel], what: str, inputs: str) -> Channel:
        by_name = {channel.name: channel for channel in channels}
        if name in by_name:
            return by_name[name]
        present = ", ".join(by_name) or "none"
        raise RecordingError(f"no {what} {name!r}; it has {present} ({inputs})", path=self.path)

    def of_accelerometer(self, name: str) -> Self:
        """The recording of one accelerometer alone, in the place of a gyro at rest.

        Raises
        ------
        RecordingError
            If there is none of that name.
        """
        channel = self._named(name, self.accelerometers, "accelerometer", "{accelerometers}")
        return replace(
            self, gyros=(channel,), accelerometers=(), pickoffs=(), table=None, null_pulse=None
        )

    def __repr__(self) -> str:
        parts = [f"{one.name} ({one.kind}, {one.shown_in})" for one in self._channels]
        size = f"{self.samples} samples at {self.sample_rate:g} Hz"
        parts.append(f"{size}, {self.duration:g} s" if self.samples else size)
        return f"Recording({'; '.join([*parts, *([self.path] if self.path else [])])})"


def require_recording(value: object) -> None:
    """Refuse what is no recording.

    Raises
    ------
    TypeError
        With what makes one.
    """
    remedy = "read one with read(path), or make one with Recording.from_arrays(...)"
    require_type("recording", value, Recording, remedy)


def second_of(recording: Recording, index: int) -> float:
    """When sample `index` was taken, s from the first sample of the file."""
    provenance = recording.provenance
    offset = provenance.span_s[0] if provenance and provenance.span_s else 0.0
    if recording.times is not None and math.isfinite(recording.times[index]):
        return offset + float(recording.times[index])
    return offset + index / recording.sample_rate


def _sampled(
    sample_rate: float | None, times: ArrayLike | None, time_unit: str, samples: int
) -> Sampling:
    """When samples were taken, from a rate, from stamps, or from both."""
    if sample_rate is not None:
        channels.require_rate(sample_rate)
    if times is not None:
        stamps = conversions.seconds_of(times, unit=time_unit)
        if stamps.size != samples:
            problem = f"times has {stamps.size} samples and the gyros have {samples}"
            raise ValueError(f"{problem}: give columns sampled together")
        if stamps.size:
            try:
                return require_forwards(sampling(stamps, sample_rate))
            except RecordingError as error:
                # A file is read with {time}; arrays have the arguments times and time_unit.
                remedy = error.remedy.replace("{time none}", "no times")
                remedy = remedy.replace("{time COLUMN:UNIT}", "time_unit")
                raise RecordingError(error.problem, channel="time", remedy=remedy) from None
    elif time_unit != "s":
        raise refusal("time_unit", f"is {quoted(time_unit)}, and there are no times; give them")
    if sample_rate is None:
        remedy = "give sample_rate in Hz, or times (of a frame columns={'time': NAME})"
        raise ValueError(f"neither sample_rate nor times is given; {remedy}")
    return Sampling(times=None, sample_rate=sample_rate)
