"""From analyses, and from what data sheets state, to the settings file of a tool."""

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from sagnac.core.documents import Documented
from sagnac.core.errors import Note, quoted, require_choice
from sagnac.core.overwriting import of_export, require_free
from sagnac.core.units import SENSED, SENSORS, TIME_UNITS, Sensor, sizes, split_factor
from sagnac.core.version import __version__
from sagnac.core.whole_files import write_text
from sagnac.navigation.definitions import ToolName, definition_of
from sagnac.navigation.models import FilterModel, Markov
from sagnac.navigation.settings import FilterSetting, sensors_in, sensors_of, setting_of
from sagnac.navigation.tools import Wanted, exported, settings_in

# ---- datasheet ---------------------------------------------------------------------

FORM: Final = "such as N=0.004deg/s/sqrt(Hz),B=2deg/h@100s,bandwidth=40Hz,range=450deg/s"
_KEYS: Final = ("N", "B", "bandwidth", "range")
_DIGITS: Final = frozenset(".0123456789")
# Beyond this many times B at its cluster time, N is in another unit: the random walk alone would
# lie above the lowest Allan deviation there is.
_ABOVE_LOWEST: Final = 3.0
_TIME: Final = re.compile(r"\s*([0-9.eE+-]+)\s*([a-z]+)\s*")


def datasheet_setting(text: str, *, source: str = "a data sheet") -> FilterSetting:
    """The models of one kind of sensor from the numbers that its data sheet states.

    N is taken as it stands, a density per root hertz as a two-sided one (a one-sided density of the
    same number is an N smaller by the root of two). B is the lowest Allan deviation, at the cluster
    time that stands with it: the walk of the simple model, ``K = B sqrt(3/tau)``, has that Allan
    deviation at that time, and so has the Markov rate of the full model, whose own is highest
    there.

    Parameters
    ----------
    text
        ``N=…,B=…@TIME`` with their units, which say whether it is a gyro or an accelerometer, and
        ``bandwidth=…Hz`` and ``range=…``, which no model holds and the file repeats.
    source
        Who states it.

    Raises
    ------
    ValueError
        If a number, its unit or its time is missing or wrong, or N alone exceeds B by far.

    Examples
    --------
    >>> stated = datasheet_setting("N=0.15deg/sqrt(h),B=3deg/h@100s")
    >>> stated.kind, stated.limit is None, round(stated.simple.white * 1e6, 3)
    ('gyro', True, 43.633)
    """
    try:
        return _stated_models(text, source)
    except ValueError as error:
        raise ValueError(f"data sheet {quoted(text)}: {error}; state it {FORM}") from None


def _stated_models(text: str, source: str) -> FilterSetting:
    parts = _parts(text)
    if "N" not in parts or "B" not in parts:
        raise ValueError("N and B are needed, since a filter takes a noise and a bias")
    level, at, time = parts["B"].partition("@")
    match = _TIME.fullmatch(time)
    if not at or match is None or match[2] not in TIME_UNITS:
        raise ValueError("B has no cluster time at which the Allan deviation is lowest")
    tau = _above_zero(match[1]) * TIME_UNITS[match[2]]
    kind, white = _in_si(parts["N"], "angle_random_walk")
    other, lowest = _in_si(level, "bias_instability")
    if kind != other:
        raise ValueError(f"N is of a {kind} and B of a {other}; state one sensor at a time")
    if white > _ABOVE_LOWEST * lowest * math.sqrt(tau):
        times = white / (lowest * math.sqrt(tau))
        raise ValueError(f"N alone makes {times:.3g} times B at that time: a unit is wrong")
    return FilterSetting(
        name=kind,
        kind=kind,
        simple=FilterModel(white=white, walk=lowest * math.sqrt(3.0 / tau)),
        full=FilterModel(white=white, markov=(Markov.of_peak(tau, lowest),)),
        source=f"{source}: {text} (stated, not measured)",
        stated={key: parts[key] for key in ("bandwidth", "range") if key in parts},
    )


def _parts(text: str) -> dict[str, str]:
    parts: dict[str, str] = {}
    for part in text.split(","):
        key, equals, value = (one.strip() for one in part.partition("="))
        if not equals or not value or key not in _KEYS:
            raise ValueError(f"{quoted(part.strip())} is none of {', '.join(_KEYS)} with a value")
        if key in parts:
            raise ValueError(f"{key} stands there twice")
        parts[key] = value
    if "bandwidth" in parts:
        _in(parts["bandwidth"], {"Hz": 1.0, "kHz": 1e3})
    if "range" in parts:
        _in(parts["range"], sizes("rate") | sizes("acceleration"))
    return parts


def _in_si(stated: str, coefficient: str) -> tuple[Sensor, float]:
    """The kind of sensor whose unit it is, and the number in SI."""
    known = {
        kind: sizes(SENSED[kind].rate)
        if coefficient == "bias_instability"
        else dict(SENSED[kind].coefficients[coefficient])
        for kind in SENSORS
    }
    for kind, units in known.items():
        if split_factor(stated)[1] in units:
            return kind, _in(stated, units)
    every = [unit for units in known.values() for unit in units]
    raise ValueError(f"{quoted(stated)} has none of the units {', '.join(every)}")


def _in(stated: str, units: dict[str, float]) -> float:
    factor, unit = split_factor(stated)
    if unit not in units or stated[:1] not in _DIGITS:
        raise ValueError(f"{quoted(stated)} is no number with one of {', '.join(units)}")
    return _above_zero(str(factor)) * units[unit]


def _above_zero(stated: str) -> float:
    try:
        value = float(stated)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{quoted(stated)} is no number above zero")
    return value


# ---- export ------------------------------------------------------------------------

_SUFFIXES: Final[Mapping[str, ToolName]] = {
    ".yaml": "kalibr",
    ".yml": "kalibr",
    ".py": "gtsam",
    ".m": "psins",
    ".params": "px4",
    ".sdf": "gazebo",
    ".toml": "toml",
    ".json": "json",
}


Source = Documented | str | Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Exported:
    """The settings of a tool.

    Attributes
    ----------
    tool
        Whose they are.
    text
        Of its file.
    settings
        The models in it, of gyros and then of accelerometers.
    notes
        What is worth knowing of them.

    Examples
    --------
    >>> made = export(tool="kalibr", datasheet=["N=0.004deg/s/sqrt(Hz),B=2deg/h@100s"], rate=200.0)
    >>> made.tool, made.text.splitlines()[-1].startswith("#")
    ('kalibr', True)
    """

    tool: ToolName
    text: str
    settings: tuple[FilterSetting, ...]
    notes: tuple[Note, ...] = ()


def tool_of(path: str | Path) -> ToolName:
    """The tool that the name of a file tells.

    Raises
    ------
    ValueError
        If it tells none.

    Examples
    --------
    >>> tool_of("imu.yaml")
    'kalibr'
    """
    found = _SUFFIXES.get(Path(path).suffix.lower())
    if found is None:
        raise ValueError(f"tool is not told by the name {path}; state it")
    return found


def require_used(tool: ToolName, given: Mapping[str, object]) -> None:
    """Refuse an option that a tool cannot use.

    Parameters
    ----------
    tool
        The tool.
    given
        Options by name; those that are None were not given.

    Raises
    ------
    ValueError
        With the reason.
    """
    definition = definition_of(tool)
    for option, value in given.items():
        if value is not None and option in definition.unused:
            raise ValueError(
                f"{option} has no effect on {definition.tool}: {definition.unused[option]}; "
                "leave it out"
            )


def export(
    source: Source | Sequence[Source] = (),
    path: str | Path | None = None,
    *,
    tool: ToolName | None = None,
    axes: Literal["worst", "each"] | None = None,
    rate: float | None = None,
    confidence: float = 0.95,
    markov: Literal[0, 1, 2] | None = None,
    topic: str | None = None,
    accelerometer: tuple[float, float] | None = None,
    datasheet: Sequence[str] = (),
    force: bool = False,
) -> Exported:
    """Filter settings of analyses: a model that lies above the upper limit of each curve.

    Parameters
    ----------
    source
        An analysis, the path of an ``analysis.json`` or of a folder that holds some, or several.
    path
        File to write; none is written without it. Settings that this package wrote are replaced.
    tool
        Whose settings; by the name of `path` unless stated.
    axes
        One noise that covers all axes, or each its own; each unless the tool has one for all.
    rate
        Update rate of the discrete form, Hz; that of the recording unless stated, 100 for PX4.
    confidence
        That the model lies above the Allan deviation of the sensor.
    markov
        Markov rates of the full model (``toml``, ``json``) at most; 2 unless stated.
    topic
        ROS topic of the IMU; ``/imu0`` unless stated.
    accelerometer
        Noise density, m/s^2/sqrt(Hz), and random walk, m/s^3/sqrt(Hz), of accelerometers that were
        not measured.
    datasheet
        What data sheets state, a text for gyros and one for accelerometers (`datasheet_setting`).
    force
        Replace any other file at `path`, too.

    Raises
    ------
    ValueError
        If the tool is not known, or cannot use an option, or there is no gyro.
    RecordingError
        If a source holds no analysis, or the file cannot be written.
    WouldOverwrite
        If another file is at `path`, and `force` is not set.

    Examples
    --------
    >>> made = export(tool="gtsam", datasheet=["N=0.004deg/s/sqrt(Hz),B=2deg/h@100s"])
    >>> "not measured" in made.text
    True
    """
    if tool is None:
        if path is None:
            raise ValueError("tool is not stated, and there is no path whose name tells it")
        tool = tool_of(path)
    require_choice("tool", tool, ToolName)
    require_choice("axes", axes or "each", Literal["worst", "each"])
    require_used(
        tool, {"rate": rate, "markov": markov, "topic": topic, "accelerometer": accelerometer}
    )
    stated = [] if accelerometer is None else [_stated(accelerometer)]
    stated += [datasheet_setting(text) for text in datasheet]
    measured = [
        setting_of(sensor, confidence=confidence, most_markov=2 if markov is None else markov)
        for one in _several(source)
        for sensor in (
            sensors_in(Path(one))
            if isinstance(one, str | Path)
            else sensors_of(json.loads(one.to_json()))
        )
    ]
    settings = _together(measured, stated)
    takes_each = definition_of(tool).axes != "one" and tool != "openvins"
    wanted = Wanted(
        settings=tuple(one for one in settings if one.kind == "gyro"),
        accelerometers=tuple(one for one in settings if one.kind == "accelerometer"),
        each=axes == "each" or (axes is None and takes_each),
        rate=rate,
        topic=topic or "/imu0",
        version=__version__,
    )
    text = exported(tool, wanted)
    if path is not None:
        read = [Path(one) for one in _several(source) if isinstance(one, str | Path)]
        require_free(of_export(Path(path), tool), read, force=force)
        write_text(Path(path), text)
    return Exported(
        tool=tool, text=text, settings=settings_in(tool, wanted), notes=_for_others(tool, measured)
    )


def _for_others(tool: ToolName, measured: list[FilterSetting]) -> tuple[Note, ...]:
    """Said where the noise of one gyro that was measured is that of all axes of a unit."""
    gyros = [one.name for one in measured if one.kind == "gyro"]
    if len(gyros) != 1 or definition_of(tool).axes == "any":
        return ()
    return (Note(channel=gyros[0], text="alone was measured, and stands for all three axes"),)


def _several(source: Source | Sequence[Source]) -> Sequence[Source]:
    if isinstance(source, str | Path):
        return (source,)
    return source if isinstance(source, Sequence) else (source,)


def _together(measured: list[FilterSetting], stated: list[FilterSetting]) -> list[FilterSetting]:
    """Measured and stated models; a kind of sensor is either."""
    kinds = [one.kind for one in (*measured, *stated)]
    for one in stated:
        if kinds.count(one.kind) > 1:
            raise ValueError(
                f"{one.source}: another noise of the {one.kind}s is there; leave one of them out"
            )
    if "gyro" not in kinds:
        raise ValueError("no gyro; give an analysis of one, or its data sheet")
    return [*measured, *stated]


def _stated(accelerometer: tuple[float, float]) -> FilterSetting:
    density, walk = accelerometer
    try:
        if not density > 0.0:
            raise ValueError("no accelerometer is without noise; give a density above zero")
        model = FilterModel(white=density, walk=walk)
    except ValueError as error:
        raise ValueError(f"accelerometer is {quoted(accelerometer)}; {error}") from None
    return FilterSetting(
        name="accelerometer",
        kind="accelerometer",
        simple=model,
        full=model,
        source=f"accelerometer {density:g},{walk:g} (stated, not measured)",
    )
