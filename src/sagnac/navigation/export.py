"""From analyses, and from what data sheets state, to the settings file of a tool."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final, Literal

from sagnac.core import documents, errors, overwriting, units, whole_files
from sagnac.navigation import definitions, models, tools
from sagnac.navigation.settings import FilterSetting, measured_in

# ---- datasheet ---------------------------------------------------------------------

FORM: Final = "such as N=0.004deg/s/sqrt(Hz),B=2deg/h@100s,bandwidth=40Hz,range=450deg/s"
# Units of each number that a data sheet states: name -> SI size.
_UNITS: Final[Mapping[str, Mapping[str, float]]] = {
    "N": units.sizes("angle random walk") | units.sizes("velocity random walk"),
    "B": units.RATE_UNITS | units.ACCELERATION_UNITS,
    "bandwidth": {"Hz": 1.0, "kHz": 1e3},
    "range": units.RATE_UNITS | units.ACCELERATION_UNITS,
}


def datasheet_setting(text: str) -> FilterSetting:
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

    Raises
    ------
    ValueError
        If a number, its unit or its time is missing or wrong, or N makes far more or less than B.

    Examples
    --------
    >>> stated = datasheet_setting("N=0.15deg/sqrt(h),B=3deg/h@100s")
    >>> stated.kind, stated.limit is None, round(stated.simple.white * 1e6, 3)
    ('gyro', True, 43.633)
    """
    try:
        return _stated_models(text)
    except ValueError as error:
        raise ValueError(f"data sheet {errors.quoted(text)}: {error}; state it {FORM}") from None


def _stated_models(text: str) -> FilterSetting:
    parts: dict[str, str] = {}
    for part in text.split(","):
        key, _, value = (one.strip() for one in part.partition("="))
        if key not in _UNITS or not value:
            stated, known = errors.quoted(part.strip()), ", ".join(_UNITS)
            raise ValueError(f"{stated} is none of {known} with a value")
        if key in parts:
            raise ValueError(f"{key} stands there twice")
        parts[key] = value
    if not {"N", "B"} <= set(parts):
        raise ValueError("N and B are needed, since a filter takes a noise and a bias")
    level, at, time = parts["B"].partition("@")
    if not at:
        raise ValueError("B has no cluster time at which the Allan deviation is lowest")
    numbers = {key: _number(part, _UNITS[key]) for key, part in {**parts, "B": level}.items()}
    tau, white, lowest = _number(time, units.TIME_UNITS), numbers["N"], numbers["B"]
    kind = units.sensor_of(level)
    of_kind = units.SENSED[kind].coefficients["angle_random_walk"]
    if units.split_factor(parts["N"])[1] not in of_kind:
        raise ValueError("N and B are of two kinds of sensor; state one sensor at a time")
    times = white / (lowest * math.sqrt(tau))
    # With more it would lie above the lowest Allan deviation there is, with less the curve would be
    # lowest long before.
    if not 0.01 <= times <= 3.0:
        raise ValueError(f"N alone makes {times:.3g} times B at that time: a unit is wrong")
    simple = models.FilterModel(white=white, walk=lowest * math.sqrt(3.0 / tau))
    full = models.FilterModel(white=white, markov=(models.Markov.of_peak(tau, lowest),))
    source = f"a data sheet: {text} (stated, not measured)"
    more: dict[str, str] = {key: parts[key] for key in ("bandwidth", "range") if key in parts}
    return FilterSetting(name=kind, kind=kind, simple=simple, full=full, source=source, stated=more)


def _number(stated: str, sizes: Mapping[str, float]) -> float:
    """A number with its unit in SI."""
    factor, unit = units.split_factor(stated)
    if unit not in sizes or not (stated.strip()[:1].isdigit() or stated.strip()[:1] == "."):
        raise ValueError(f"{errors.quoted(stated)} is no number with one of {', '.join(sizes)}")
    if not (math.isfinite(factor) and factor > 0.0):
        raise ValueError(f"{errors.quoted(stated)} is no number above zero")
    return factor * sizes[unit]


# ---- export ------------------------------------------------------------------------

_SUFFIXES: Final[Mapping[str, definitions.ToolName]] = {
    ".yaml": "kalibr",
    ".yml": "kalibr",
    ".py": "gtsam",
    ".m": "psins",
    ".params": "px4",
    ".sdf": "gazebo",
    ".toml": "toml",
    ".json": "json",
}


Source = documents.Documented | str | Path


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
        The models in it, of gyros and then of accelerometers; not compared, as the text is.
    notes
        What is worth knowing of them.

    Examples
    --------
    >>> made = export(tool="kalibr", datasheet=["N=0.004deg/s/sqrt(Hz),B=2deg/h@100s"], rate=200.0)
    >>> made.tool, made.text.splitlines()[-1].startswith("#")
    ('kalibr', True)
    """

    tool: definitions.ToolName
    text: str
    settings: tuple[FilterSetting, ...] = field(compare=False)
    notes: tuple[errors.Note, ...] = ()


def export(
    source: Source | Sequence[Source] = (),
    path: str | Path | None = None,
    *,
    tool: definitions.ToolName | None = None,
    axes: Literal["worst", "each"] | None = None,
    rate: float | None = None,
    confidence: float = 0.95,
    markov: Literal[0, 1, 2] | None = None,
    topic: str | None = None,
    accelerometer: tuple[float, float] | None = None,
    datasheet: str | Sequence[str] = (),
    force: bool = False,
) -> Exported:
    """Filter settings of analyses: a model that lies above the upper limit of each curve.

    Parameters
    ----------
    source
        An analysis, the path of an ``analysis.json`` or of a folder that holds some, or several.
    path
        File to write, and its folder; none is written without it. Settings that this package
        wrote are replaced.
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
        What data sheets state: a text, or one for gyros and one for accelerometers
        (`datasheet_setting`).
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
    path = None if path is None else errors.path_of("path", path)
    tool = tool or _SUFFIXES.get(Path(path or "").suffix.lower())
    if tool is None:
        named = "there is no path" if path is None else f"{path} does not tell it"
        remedy = f"state it, or name a path that ends in {', '.join(_SUFFIXES)}"
        raise errors.refusal("tool", f"is not stated, and {named}; {remedy}")
    errors.require_choice("tool", tool, definitions.ToolName)
    errors.require_choice("axes", axes or "each", Literal["worst", "each"])
    errors.require_confidence(confidence)
    definition = definitions.definition_of(tool)
    given = {"rate": rate, "markov": markov, "topic": topic, "accelerometer": accelerometer}
    for option, value in given.items():
        if value is not None and option in definition.unused:
            why = definition.unused[option]
            raise errors.refusal(option, f"has no effect on {definition.tool}: {why}; leave it out")
    if isinstance(markov, bool | float) or markov not in (None, 0, 1, 2):
        raise errors.refusal("markov", f"is {errors.quoted(markov)}; use 0, 1 or 2")
    errors.require_type("datasheet", datasheet, Sequence, f"give text {FORM}")
    datasheet = [datasheet] if isinstance(datasheet, str) else datasheet
    sources = source if isinstance(source, Sequence) and not isinstance(source, str) else [source]
    for one in sources:
        documents.require_source(one)
    read = partial(measured_in, confidence=confidence, most_markov=2 if markov is None else markov)
    settings = [setting for one in sources for setting in read(one)]
    stated = [] if accelerometer is None else [_stated(accelerometer)]
    for setting in (*stated, *map(datasheet_setting, datasheet)):
        if setting.kind in [other.kind for other in settings]:
            problem = f"another noise of the {setting.kind}s is there; leave one of them out"
            raise ValueError(f"{setting.source}: {problem}")
        settings.append(setting)
    each = axes == "each" or (axes is None and definition.axes != "one" and tool != "openvins")
    topic, held = topic or "/imu0", tuple(settings)
    file = tools.SettingsFile(tool=tool, settings=held, each=each, rate=rate, topic=topic)
    text = file.text()
    if path is not None:
        inputs = [Path(one) for one in sources if isinstance(one, str | Path)]
        overwriting.require_free(overwriting.of_export(path, tool), inputs, force=force)
        whole_files.made(path.parent)
        whole_files.write_text(path, text)
    return Exported(tool=tool, text=text, settings=file.held, notes=file.notes)


def _stated(accelerometer: tuple[float, float]) -> FilterSetting:
    try:
        density, walk = accelerometer
    except (TypeError, ValueError):
        density = walk = math.nan
    if not (errors.is_finite(density) and density > 0.0 and errors.is_finite(walk) and walk >= 0.0):
        remedy = "since no accelerometer is without noise, and a walk of zero or more"
        problem = f"is {errors.quoted(accelerometer)}; give a density above zero, {remedy}"
        raise errors.refusal("accelerometer", problem)
    model = models.FilterModel(white=density, walk=walk)
    kind: units.Sensor = "accelerometer"
    source = f"accelerometer {density:g},{walk:g} (stated, not measured)"
    return FilterSetting(name=kind, kind=kind, simple=model, full=model, source=source)
