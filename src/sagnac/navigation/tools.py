"""The files of other tools, each by its template, with units and the definition that it follows."""

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from jinja2 import Environment, PackageLoader, StrictUndefined

from sagnac.core import units
from sagnac.core.errors import Note, RecordingError, is_finite, one_line, per_cent, quoted, refusal
from sagnac.core.texts import by_axis, toml_tables
from sagnac.core.version import __version__
from sagnac.navigation.definitions import Definition, ToolName, definition_of
from sagnac.navigation.models import common_span, common_time
from sagnac.navigation.settings import FilterSetting, by_name, plain, worst


@dataclass(frozen=True, kw_only=True)
class SettingsFile:
    """The file of a tool.

    Attributes
    ----------
    tool
        One of `TOOLS`.
    settings
        One for each gyro, and for each accelerometer that is known.
    each
        A block for each sensor instead of the worst alone.
    rate
        Of the filter or of the samples, Hz; None for that of the recording.
    topic
        ROS topic of the IMU.

    Raises
    ------
    ValueError
        If there is no gyro, or the rate or the topic cannot be.
    RecordingError
        If the tool cannot hold a noise for each gyro.
    """

    tool: ToolName
    settings: tuple[FilterSetting, ...]
    each: bool = False
    rate: float | None = None
    topic: str = "/imu0"

    def __post_init__(self) -> None:
        if "gyro" not in self._sensors:
            raise ValueError("no gyro; give an analysis of one, or its data sheet")
        # No filter reaches 1 GHz.
        if self.rate is not None and not (is_finite(self.rate) and 0.0 < self.rate < 1e9):
            raise refusal("rate", f"is {quoted(self.rate)}; give Hz above zero")
        # Names that ROS allows.
        if not re.fullmatch(r"[A-Za-z~/][A-Za-z0-9_/~]*", str(self.topic)):
            raise refusal("topic", f"is {quoted(self.topic)}; give a name of ROS such as /imu0")
        if self.definition.axes == "one" and len(self.chosen["gyro"]) > 1:
            problem = f"{self.definition.tool} has one gyro noise for all axes"
            raise RecordingError(problem, remedy="take the worst of them ({axes worst})")

    @property
    def definition(self) -> Definition:
        """How the tool defines its parameters."""
        return definition_of(self.tool)

    @cached_property
    def _sensors(self) -> dict[units.Sensor, list[FilterSetting]]:
        """Settings by the kinds of sensor that there are and the tool takes."""
        kinds = [kind for kind in units.SENSORS if kind not in self.definition.unused]
        by_kind = {kind: [one for one in self.settings if one.kind == kind] for kind in kinds}
        return {kind: settings for kind, settings in by_kind.items() if settings}

    @cached_property
    def worst(self) -> dict[units.Sensor, FilterSetting]:
        """One that covers all, by kind of sensor."""
        return {kind: worst(settings) for kind, settings in self._sensors.items()}

    @cached_property
    def chosen(self) -> dict[units.Sensor, tuple[FilterSetting, ...]]:
        """Every sensor, or one that covers them all, by kind."""
        if self.each:
            return {kind: by_name(settings) for kind, settings in self._sensors.items()}
        return {kind: (one,) for kind, one in self.worst.items()}

    @cached_property
    def _axes(self) -> dict[units.Sensor, tuple[FilterSetting, ...]]:
        """Settings about x, y and z by kind: each its own; the worst stands for one without."""
        axes: dict[units.Sensor, tuple[FilterSetting, ...]] = {}
        for kind, settings in self.chosen.items():
            own = by_axis({one.name: one for one in settings}) if len(settings) < 4 else {}
            if len(settings) == 3 and not own:
                own = dict(zip("xyz", settings, strict=True))
            axes[kind] = tuple(own.get(axis, self.worst[kind]) for axis in "xyz")
        return axes

    @property
    def notes(self) -> tuple[Note, ...]:
        """On axes that one sensor, or the worse of two, stands for; on inflated N; on doubts."""
        notes = []
        for kind, settings in self._sensors.items():
            names = dict.fromkeys(one.name for one in settings if one.limit is not None)
            if self.definition.axes != "any" and len(names) in {1, 2}:
                text = f"is the only {kind} that was measured, and stands for all three axes"
                if any(one.is_pair for one in settings):
                    of_two = "it is of the mean square of two"
                    text += f"; {of_two}: one may have up to 1.41 times as much"
                if len(names) == 2:
                    which = "the third axis" if self.each else "all three axes"
                    text = f"were measured, and the worse of these {kind}s stands for {which}"
                notes.append(Note(channel=", ".join(names), text=text))
            in_order = self.each and self.definition.axes == "three" and not by_axis(names)
            if in_order and len(names) == 3:
                text = "are taken for x, y and z in this order, which their names do not tell"
                notes.append(Note(channel=", ".join(names), text=text))
        for one in self.held:
            # The reason is stated if N is more than three times its estimate.
            if one.excess > 3.0:
                known = "estimate" if one.estimate > 0.0 else "upper bound"
                why = "lines, vibration or readout are in its curve; `sagnac analyze` removes lines"
                if not one.has_lines:
                    noise = "a readout, vibration or other noise that N does not describe"
                    remedy = "an analysis with a longer interval leaves the shortest times out"
                    why = f"{noise} is in its curve; {remedy}"
                text = f"N is {one.excess:.3g} times the {known}, since {why}"
                notes.append(Note(channel=one.name, text=text))
        rates = {one.sample_rate for one in self.held if one.sample_rate}
        if self.rate is None and len(rates) > 1 and "rate" not in self.definition.unused:
            hertz = " and ".join(f"{one:.9g}" for one in sorted(rates))
            known = f"what a sample has is for {self.known_rate:.9g} Hz"
            remedy = "state the update rate (--rate, in Python rate)"
            text = f"the recordings have {hertz} Hz, and {known}; {remedy}"
            notes.append(Note(level="warning", text=text))
        doubts = dict.fromkeys(doubt for one in self.held for doubt in one.doubts)
        return (*notes, *(Note(level="warning", text=doubt) for doubt in doubts))

    @cached_property
    def times(self) -> dict[units.Sensor, float]:
        """The correlation time that serves the sensors of each kind best, s; or one for all.

        It is that of the curves that were measured, else the longest that is stated, else that of a
        walk.
        """
        every = tuple(one for axes in self._axes.values() for one in axes)
        times: dict[units.Sensor, float] = {}
        for kind, axes in self._axes.items():
            sensors = every if self.definition.one_time else axes
            limits = [one.limit for one in sensors if one.limit is not None]
            stated = [rate.correlation_time for one in sensors for rate in one.full.markov]
            # A walk that is stated becomes a Markov rate whose deviation over an hour is within 5 %
            # of it.
            times[kind] = common_time(limits) if limits else max(stated, default=36_000.0)
        return times

    def _as_held(self, settings: Iterable[FilterSetting]) -> tuple[FilterSetting, ...]:
        """Settings as the tool takes them."""
        if self.definition.bias != "markov":
            return tuple(settings)
        return tuple(one.as_markov(self.times[one.kind]) for one in settings)

    @cached_property
    def held(self) -> tuple[FilterSetting, ...]:
        """The models as the file has them: of gyros, then of accelerometers."""
        return self._as_held(one for settings in self.chosen.values() for one in settings)

    @cached_property
    def three(self) -> dict[units.Sensor, tuple[FilterSetting, ...]]:
        """The same about x, y and z, by kind of sensor."""
        return {kind: self._as_held(axes) for kind, axes in self._axes.items()}

    @property
    def known_rate(self) -> float | None:
        """Hz, if the export or a recording states it."""
        return self.rate or self._sensors["gyro"][0].sample_rate

    @property
    def update_rate(self) -> float:
        """Hz.

        Raises
        ------
        RecordingError
            If neither the export nor a recording states it.
        """
        rate = self.known_rate
        if rate is None:
            problem = "no recording states the sample rate"
            # The keyword of a recording's rate is another one, so that it is not named in braces.
            raise RecordingError(problem, remedy="state the update rate (--rate, in Python rate)")
        return rate

    def heading(self, *, in_words: bool = True, mark: str = "#") -> str:
        """Comment on what is in the file, by what definition, and from what."""
        names, definition = ", ".join(one.name for one in self.held), self.definition
        made = f"{definition.tool}: noise of {names}, made by sagnac {__version__}"
        lines = [made, f"Definition: {definition.text}.", f"Reference: {definition.reference}."]
        limits = [one.limit for one in self.held if one.limit is not None]
        if limits:
            first, last = common_span(limits)
            reach = f"at {per_cent(limits[0].confidence)} from {first:.4g} to {last:.4g} s"
            lines.append(f"The model lies above the Allan deviation {reach}.")
        if len(limits) < len(self.held):
            lines.append("What is stated was not measured, and is not inflated.")
        lines += dict.fromkeys(f"From {one.source}" for one in self.held)
        lines += [f"{note.level.capitalize()}: {note}" for note in self.notes]
        if in_words:
            lines += [one.in_words() for one in self.held]
        return _comment(lines, mark)

    def text(self) -> str:
        """Content of the file.

        Raises
        ------
        RecordingError
            If it takes a sample rate, and none is stated.
        """
        if self.tool not in ("toml", "json"):
            template = _environment().get_template(f"{self.tool}.txt")
            return template.render(file=self, three=self.three, times=self.times)
        data = plain(self.chosen, self.update_rate)
        if self.tool == "json":
            return json.dumps(data, allow_nan=False, indent=1) + "\n"
        return f"{self.heading(in_words=False)}\n{toml_tables(data)}"


# ---- templates -----------------------------------------------------------------------


def _environment() -> Environment:
    """Templates, and what they write numbers with: formats, and sizes of units in SI."""
    environment = Environment(
        loader=PackageLoader("sagnac.navigation"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    environment.filters |= {
        "e6": "{:.6e}".format,
        "listed": _listed,
        "square": lambda one, name: getattr(one.simple, name) ** 2,
    }
    environment.globals |= {
        "comment": _comment,
        "whites": lambda axes, size: [one.simple.white / size for one in axes],
        "deviations": lambda axes, size: [one.simple.markov[0].deviation / size for one in axes],
        "zip": zip,
        "deg_per_sqrt_h": units.DEGREE_PER_ROOT_HOUR,
        "deg_per_h": units.DEGREE_PER_HOUR,
        "m_per_s_per_sqrt_h": units.FORCE_COEFFICIENT_UNITS["angle_random_walk"]["m/s/sqrt(h)"],
    }
    return environment


def _comment(lines: Sequence[str], mark: str = "#") -> str:
    """Lines that every format passes over; names of files and gyros in them end none of them."""
    return "\n".join(f"{mark} {one_line(line)}" for line in lines)


def _listed(values: Iterable[float], separator: str = ", ") -> str:
    return f"[{separator.join(f'{value:.6e}' for value in values)}]"
