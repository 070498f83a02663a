"""Tables of the site that are made from the code, as Markdown. Nothing of Sphinx is needed here."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from importlib import import_module
from importlib.resources import files
from typing import Any, Final

import numpy as np
from benchmarks._faults import PATHOLOGIES, Pathology

import sagnac
from sagnac.core.units import QUANTITIES, UNITS
from sagnac.formats.registry import FORMATS, Format
from sagnac.navigation.definitions import definitions
from sagnac.quality.check import DETECTORS, FINDINGS
from sagnac.stability.estimators import ESTIMATORS

# Seed of the recordings that are spoilt.
_SEED: Final = 1


def _markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    return "\n".join(lines)


def _code(words: Iterable[str]) -> str:
    return " ".join(f"`{word}`" for word in words)


def _first_line(module: str) -> str:
    said = import_module(module).__doc__ or ""
    return said.partition("\n\n")[0].replace("\n", " ").replace("``", "`")


def formats() -> str:
    """Every format that is read: suffixes, whether it is written, and what it needs."""

    def row(one: Format) -> tuple[str, ...]:
        needs = f"`.[{one.extra}]`" if one.extra else "–"
        return (
            one.name,
            _code(one.suffixes),
            "yes" if one.writes else "–",
            needs,
            _first_line(f"sagnac.formats.{one.module}"),
        )

    return _markdown(
        ("format", "suffixes", "written too", "extra", "the reader"), map(row, FORMATS)
    )


def estimators() -> str:
    """The Allan family."""
    rows = (
        (
            f"`{one.name}`",
            one.title,
            "Hadamard" if one.order == 3 else "Allan",
            "yes" if one.overlapping else "–",
            f"f^{one.lowest_exponent}",
        )
        for one in ESTIMATORS.values()
    )
    head = ("name", "deviation", "differences", "overlapping", "steepest rate noise")
    return _markdown(head, rows)


def tools() -> str:
    """Filters whose settings are written."""
    rows = (
        (f"`{name}`", one.tool, one.text, one.axes, one.reference)
        for name, one in definitions().items()
    )
    return _markdown(("`--format`", "tool", "definition", "noises", "stands in"), rows)


def units() -> str:
    """Every unit by its quantity."""
    rows = (
        (quantity, _code(unit.name for unit in UNITS.values() if unit.quantity == quantity))
        for quantity in QUANTITIES
    )
    return _markdown(("quantity", "units"), rows)


def schema() -> str:
    """Keys of an analysis.json."""
    content: Mapping[str, Any] = json.loads(
        files("sagnac").joinpath("analysis-1.schema.json").read_text("utf-8")
    )

    def kind(value: Mapping[str, Any]) -> str:
        if "const" in value:
            return f"`{value['const']}`"
        if "$ref" in value:
            return value["$ref"].rpartition("/")[2].replace("_", " ")
        if "allOf" in value or "anyOf" in value or "enum" in value or "type" not in value:
            return _code(map(str, value["enum"])) if "enum" in value else "object"
        types = value["type"]
        return types if isinstance(types, str) else " or ".join(types)

    required = set(content["required"])
    rows = (
        (
            f"`{key}`",
            kind(value),
            "always" if key in required else "–",
            value.get("description", ""),
        )
        for key, value in content["properties"].items()
    )
    return _markdown(("key", "type", "there", "meaning"), rows)


@cache
def said(fault: Pathology, *, turning: bool) -> tuple[str, sagnac.Note | None]:
    """The weakest strength at which a fault is noticed in one recording, and what is said first."""
    for strength in fault.strengths:
        shown = f"{strength:g} {fault.unit}"
        try:
            notes = sagnac.check(fault.recording(strength, _SEED, turning=turning))
        except sagnac.RecordingError as error:
            refusal = sagnac.Note(text=error.line(), level="error", name="refused")
            return shown, refusal
        faults = [note for note in notes if note.level != "remark"]
        if faults:
            return shown, faults[0]
    return f"{fault.strengths[-1]:g} {fault.unit}", None


def pathologies_at_rest() -> str:
    """Each fault at rest, at the weakest strength at which one recording shows it."""
    return _pathologies(turning=False)


def pathologies_turning() -> str:
    """The same of a pair on a turning table."""
    return _pathologies(turning=True)


def _pathologies(*, turning: bool) -> str:
    rows = []
    for fault in PATHOLOGIES:
        if not (fault.turning if turning else fault.standing):
            continue
        strength, note = said(fault, turning=turning)
        if note is None:
            rows.append((fault.name, strength, "–", "–", "nothing"))
        else:
            rows.append((fault.name, strength, f"`{note.name}`", note.level, f"{note}"))
    return _markdown(("fault", "strength", "finding", "level", "what `check` says"), rows)


def _noise(*, seed: int, scale: float = 1.8) -> Any:
    """Three minutes of white noise at 100 Hz; of 1.8 °/h, that of N = 0.003 °/√h."""
    return scale * np.random.default_rng(seed).standard_normal(18_000)


def _triad(means: Sequence[float], unit: str) -> sagnac.Recording:
    """Three gyros at rest whose mean rates, in °/h, are read as if they were in another unit."""
    rates = {
        name: mean + _noise(seed=seed)
        for seed, (name, mean) in enumerate(zip("xyz", means, strict=True))
    }
    return sagnac.Recording.from_arrays(**rates, kind="rate", unit=unit, sample_rate=100.0)


def _forces(scale: float) -> sagnac.Recording:
    """A gyro, and three accelerometers whose numbers are called m/s²."""
    forces = {
        name: scale * (mean + _noise(seed=seed, scale=1e-3))
        for seed, (name, mean) in enumerate({"ax": 0.1, "ay": 0.2, "az": 9.8}.items(), start=1)
    }
    units = {"x": "deg/h", **dict.fromkeys(forces, "m/s^2")}
    gyro = 10.0 + _noise(seed=0)
    return sagnac.Recording.from_arrays(
        x=gyro, **forces, kind="rate", unit=units, sample_rate=100.0
    )


_EARTH: Final = (9.0, 7.2, 9.6)  # °/h: 15.04 across one another
# Recordings that contradict physics: what is wrong, and what is read.
_PHYSICS: Final[Mapping[str, Callable[[], sagnac.Recording]]] = {
    "three gyros in °/h called °/s": lambda: _triad(_EARTH, "deg/s"),
    "three gyros in °/h called rad/s": lambda: _triad(_EARTH, "rad/s"),
    "one gyro with a bias of 40 °/h called °/s": lambda: sagnac.Recording.from_arrays(
        x=40.0 + _noise(seed=0), kind="rate", unit="deg/s", sample_rate=100.0
    ),
    "accelerometers in g called m/s²": lambda: _forces(1.0 / 9.80665),
    "accelerometers read as gyros": lambda: sagnac.Recording.from_arrays(
        x=0.1 + _noise(seed=1, scale=1e-3),
        y=0.2 + _noise(seed=2, scale=1e-3),
        z=9.8 + _noise(seed=3, scale=1e-3),
        kind="rate", unit="deg/s", sample_rate=100.0,
    ),
}  # fmt: skip


@cache
def contradicted(fault: str) -> sagnac.Note:
    """The worst that is said of a recording of `_PHYSICS`."""
    return sagnac.check(_PHYSICS[fault]())[0]


def physics() -> str:
    """Units and sensors that the Earth's rate, gravity or the bench gives away."""
    notes = ((fault, contradicted(fault)) for fault in _PHYSICS)
    rows = ((fault, f"`{note.name}`", note.level, f"{note}") for fault, note in notes)
    return _markdown(("what is wrong", "finding", "level", "what `check` says"), rows)


def findings() -> str:
    """Names by which findings are accepted, each with the faults that make it."""
    made: dict[str, list[str]] = {name: [] for name in FINDINGS}
    for fault_of_unit in _PHYSICS:
        made[contradicted(fault_of_unit).name].append(fault_of_unit)
    for turning in (False, True):
        for fault in PATHOLOGIES:
            if fault.turning if turning else fault.standing:
                _, note = said(fault, turning=turning)
                if note and note.name in made and fault.name not in made[note.name]:
                    made[note.name].append(fault.name)
    rows = []
    for name, by in made.items():
        detectors = [one for one in DETECTORS if one.name == name]
        sees = "; ".join(one.sees for one in detectors)
        effects = "; ".join(dict.fromkeys(one.effect for one in detectors))
        rows.append((f"`{name}`", sees, effects, "; ".join(by) or "–"))
    head = ("`--accept`", "what is seen", "what it does to N", "faults of the tables that make it")
    return _markdown(head, rows)


TABLES: Final[Mapping[str, Callable[[], str]]] = {
    "estimators": estimators,
    "findings": findings,
    "formats": formats,
    "pathologies-at-rest": pathologies_at_rest,
    "pathologies-turning": pathologies_turning,
    "physics": physics,
    "schema": schema,
    "tools": tools,
    "units": units,
}
