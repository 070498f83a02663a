"""The files of other tools, each by its template, with units and the definition that it follows."""

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Final, get_args

from jinja2 import Environment, PackageLoader, StrictUndefined

from sagnac.core.errors import RecordingError, one_line, quoted
from sagnac.core.texts import toml_tables
from sagnac.core.units import (
    DEGREE_PER_HOUR,
    DEGREE_PER_ROOT_HOUR,
    FORCE_COEFFICIENT_UNITS,
    SENSORS,
    STANDARD_GRAVITY,
    Sensor,
)
from sagnac.core.version import __version__
from sagnac.navigation.definitions import ToolName, definition_of
from sagnac.navigation.models import common_time
from sagnac.navigation.settings import FilterSetting, by_name, plain, worst

FORMATS: Final[tuple[str, ...]] = get_args(ToolName)
# Names that ROS allows.
_ROS_NAME: Final = re.compile(r"[A-Za-z~/][A-Za-z0-9_/~]*")
# Correlation time, s, of a Markov rate for a walk that is stated: over an hour its deviation is
# within 5 % of that of the walk.
_AS_A_WALK: Final = 36_000.0


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """Contents of a file.

    Attributes
    ----------
    settings
        One for each gyro.
    accelerometers
        One for each accelerometer; none if they are not known.
    each
        A block for each sensor instead of the worst alone.
    rate
        Of the filter or of the samples, Hz; None for that of the recording.
    topic
        ROS topic of the IMU.
    """

    settings: tuple[FilterSetting, ...]
    accelerometers: tuple[FilterSetting, ...] = ()
    each: bool = False
    rate: float | None = None
    topic: str = "/imu0"

    def __post_init__(self) -> None:
        if not self.settings:
            raise ValueError("no gyro; give an analysis of one, or its data sheet")
        if self.rate is not None and not self.rate > 0.0:
            raise ValueError(f"rate is {quoted(self.rate)}; give Hz above zero")
        if not _ROS_NAME.fullmatch(self.topic):
            raise ValueError(f"topic is {quoted(self.topic)}; give a name of ROS such as /imu0")

    @cached_property
    def worst(self) -> dict[Sensor, FilterSetting]:
        """One that covers all, of each kind of sensor that there is."""
        kinds = zip(SENSORS, (self.settings, self.accelerometers), strict=True)
        return {kind: worst(settings) for kind, settings in kinds if settings}

    @cached_property
    def chosen(self) -> tuple[FilterSetting, ...]:
        """Every gyro, or one that covers them all."""
        return by_name(self.settings) if self.each else (self.worst["gyro"],)

    @cached_property
    def forces(self) -> tuple[FilterSetting, ...]:
        """Every accelerometer, or one that covers them all; none if there is none."""
        if self.each or not self.accelerometers:
            return by_name(self.accelerometers)
        return (self.worst["accelerometer"],)

    @cached_property
    def three(self) -> dict[Sensor, tuple[FilterSetting, ...]]:
        """Settings about x, y and z by sensor: its own for each if it has three, else the worst."""
        axes: dict[Sensor, tuple[FilterSetting, ...]] = {}
        for kind, settings in zip(SENSORS, (self.chosen, self.forces), strict=True):
            names = ("x", "y", "z") if kind == "gyro" else ("ax", "ay", "az")
            own = {one.name: one for one in settings}
            order = names if set(names) == set(own) else tuple(own)
            if len(own) == 3:
                axes[kind] = tuple(own[name] for name in order)
            elif own:
                axes[kind] = (self.worst[kind],) * 3
        return axes

    @property
    def known_rate(self) -> float | None:
        """Hz, if the export or a recording states it."""
        return self.rate or self.settings[0].sample_rate

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
            raise RecordingError(
                "no recording states the sample rate", remedy="state it with {rate}"
            )
        return rate


def exported(format_name: str, wanted: Wanted) -> str:
    """The file of a tool.

    Parameters
    ----------
    format_name
        One of `FORMATS`.
    wanted
        What it is to hold.

    Raises
    ------
    RecordingError
        If the tool cannot hold what is wanted.
    """
    definition = definition_of(format_name)
    if wanted.each and definition.axes == "one" and len(wanted.chosen) > 1:
        raise RecordingError(
            f"{definition.tool} has one gyro noise for all axes",
            remedy="take the worst of them ({axes worst})",
        )
    if format_name not in ("toml", "json"):
        return _environment().get_template(f"{format_name}.txt").render(_facts(format_name, wanted))
    data = plain(wanted.chosen, wanted.forces, wanted.update_rate)
    if format_name == "json":
        return json.dumps(data, allow_nan=False, indent=1) + "\n"
    return f"{_heading(format_name, wanted, in_words=False)}\n{toml_tables(data)}"


@lru_cache(maxsize=4)
def settings_in(format_name: str, wanted: Wanted) -> tuple[FilterSetting, ...]:
    """The models as the file of a tool has them: of gyros, then of accelerometers it takes."""
    definition = definition_of(format_name)
    forces = () if "accelerometer" in definition.unused else wanted.forces
    if definition.bias != "markov":
        return (*wanted.chosen, *forces)
    times = _markov_times(wanted, one_time=definition.one_time)
    return tuple(one.as_markov(times[one.kind]) for one in (*wanted.chosen, *forces))


# ---- templates -----------------------------------------------------------------------


def _environment() -> Environment:
    """Templates, and what they write numbers with."""
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
    return environment


def _facts(format_name: str, wanted: Wanted) -> dict[str, Any]:
    """Facts that templates write: sensors, their Markov biases, sizes of units in SI."""
    definition = definition_of(format_name)
    times = _markov_times(wanted, one_time=definition.one_time)
    markov = {
        kind: [one.as_markov(times[kind]).simple for one in axes]
        for kind, axes in wanted.three.items()
        if definition.bias == "markov"
    }
    return {
        "wanted": wanted,
        "three": wanted.three,
        "times": times,
        "markov": markov,
        "loudest": wanted.worst.get("accelerometer"),
        "heading": lambda **how: _heading(format_name, wanted, **how),
        "comment": _comment,
        "whites": lambda kind, size: [one.white / size for one in markov[kind]],
        "deviations": lambda kind, size: [one.markov[0].deviation / size for one in markov[kind]],
        "zip": zip,
        "deg_per_sqrt_h": DEGREE_PER_ROOT_HOUR,
        "deg_per_h": DEGREE_PER_HOUR,
        "m_per_s_per_sqrt_h": FORCE_COEFFICIENT_UNITS["angle_random_walk"]["m/s/sqrt(h)"],
        "gravity": STANDARD_GRAVITY,
    }


def _heading(name: str, wanted: Wanted, *, in_words: bool = True, mark: str = "#") -> str:
    """Comment on what is in the file, by what definition, and from what."""
    definition = definition_of(name)
    shown = settings_in(name, wanted)
    lines = [
        f"{definition.tool}: noise of {', '.join(one.name for one in shown)}, "
        f"made by sagnac {__version__}",
        f"Definition: {definition.text}.",
        f"Reference: {definition.reference}.",
    ]
    limit = next((one.limit for one in shown if one.limit is not None), None)
    if limit is not None:
        lines.append(
            f"The model lies above the Allan deviation at {100.0 * limit.confidence:g} % from "
            f"{limit.tau[0]:.4g} to {limit.tau[-1]:.4g} s."
        )
    if any(one.limit is None for one in shown):
        lines.append("What is stated was not measured, and is not inflated.")
    lines += dict.fromkeys(f"From {one.source}" for one in shown)
    return _comment(lines + ([one.in_words() for one in shown] if in_words else []), mark)


def _comment(lines: Sequence[str], mark: str = "#") -> str:
    """Lines that every format passes over; names of files and gyros in them end none of them."""
    return "\n".join(f"{mark} {one_line(line)}" for line in lines)


def _listed(values: Iterable[float], separator: str = ", ") -> str:
    return f"[{separator.join(f'{value:.6e}' for value in values)}]"


@lru_cache(maxsize=4)
def _markov_times(wanted: Wanted, *, one_time: bool) -> dict[Sensor, float]:
    """The correlation time that serves the sensors of each kind best, s; or one for all of them.

    It is that of the curves that were measured, else the longest that is stated, else that of a
    walk.
    """
    every = tuple(one for axes in wanted.three.values() for one in axes)
    times: dict[Sensor, float] = {}
    for kind, axes in wanted.three.items():
        sensors = every if one_time else axes
        limits = [one.limit for one in sensors if one.limit is not None]
        stated = [rate.correlation_time for one in sensors for rate in one.full.markov]
        times[kind] = common_time(limits) if limits else max(stated, default=_AS_A_WALK)
    return times
