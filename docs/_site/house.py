"""The house drawn from its imports: rooms on their floors, and who imports whom."""

import tomllib
from collections import Counter
from pathlib import Path
from typing import Any, Final

import grimp

_ROOT: Final = Path(__file__).parents[2]
_CONTRACT: Final = "imports run one way, low to high"


def floors() -> list[list[str]]:
    """Rooms side by side, the lowest floor first, as the contract in pyproject.toml has them."""
    content = tomllib.loads((_ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = content["tool"]["importlinter"]["contracts"]
    (layers,) = [one["layers"] for one in contracts if one["name"] == _CONTRACT]
    return [[room.strip() for room in layer.split("|")] for layer in reversed(layers)]


def arrows() -> Counter[tuple[str, str]]:
    """How many imports lead from one room into another."""
    graph = grimp.build_graph("sagnac")
    found: Counter[tuple[str, str]] = Counter()
    for module in graph.modules - {"sagnac"}:
        for imported in graph.find_modules_directly_imported_by(module) - {"sagnac"}:
            one, other = module.split(".")[1], imported.split(".")[1]
            if one != other:
                found[one, other] += 1
    return found


def draw(axes: Any) -> None:
    """Draw it on an axis of matplotlib; a wider arrow is more imports."""
    places: dict[str, tuple[float, float]] = {}
    for height, floor in enumerate(floors()):
        for index, room in enumerate(floor):
            places[room] = ((index + 0.5) / len(floor), float(height))
    for (one, other), count in arrows().items():
        if one not in places or other not in places:
            continue
        width = 0.3 + 0.12 * min(count, 20)
        bend = 0.12 if abs(places[one][1] - places[other][1]) > 1.0 else 0.0
        axes.annotate(
            "",
            places[other],
            places[one],
            arrowprops={
                "arrowstyle": "-|>",
                "color": "tab:blue",
                "alpha": 0.25,
                "linewidth": width,
                "connectionstyle": f"arc3,rad={bend}",
                "shrinkA": 9,
                "shrinkB": 9,
            },
        )
    for room, (across, up) in places.items():
        box = {"boxstyle": "round,pad=0.3", "facecolor": "white", "edgecolor": "0.5"}
        axes.text(across, up, room, ha="center", va="center", fontsize=9, bbox=box)
    axes.set(xlim=(0.0, 1.0), ylim=(-0.7, len(floors()) - 0.3))
    axes.axis("off")
