"""Tables of the site that are made from the code, as Markdown. Nothing of Sphinx is needed here."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from importlib import import_module
from importlib.resources import files
from typing import Any, Final

from benchmarks._faults import PATHOLOGIES, Pathology

import sagnac
from sagnac.filters.definitions import DEFINITIONS
from sagnac.formats.registry import FORMATS, Format
from sagnac.recording.effects import FINDINGS
from sagnac.stability.estimators import ESTIMATORS
from sagnac.units import QUANTITIES, UNITS

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
        needs = f"`sagnac[{one.extra}]`" if one.extra else "–"
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
        for name, one in DEFINITIONS.items()
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


def findings() -> str:
    """Names by which findings are accepted, each with the faults that make it."""
    made: dict[str, list[str]] = {name: [] for name in FINDINGS}
    for turning in (False, True):
        for fault in PATHOLOGIES:
            if fault.turning if turning else fault.standing:
                _, note = said(fault, turning=turning)
                if note and note.name in made and fault.name not in made[note.name]:
                    made[note.name].append(fault.name)
    rows = ((f"`{name}`", "; ".join(by) or "–") for name, by in made.items())
    return _markdown(("`--accept`", "faults of the table below that make it"), rows)


TABLES: Final[Mapping[str, Callable[[], str]]] = {
    "estimators": estimators,
    "findings": findings,
    "formats": formats,
    "pathologies-at-rest": pathologies_at_rest,
    "pathologies-turning": pathologies_turning,
    "schema": schema,
    "tools": tools,
    "units": units,
}
