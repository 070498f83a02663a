"""Files that may be written over: none that a run reads, and none that this package did not make.

What the package writes says so itself: a document by its schema, a page by its generator, a
recording and the settings of a filter by a mark. Files that are written together are of one make
if one of them, the mark, says what it is.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sagnac.core.errors import WouldOverwrite, require_choice

# Where the words of a file about itself stand.
_HEAD: Final = 1 << 14
_TAIL: Final = 1 << 16
_SCHEMA: Final = re.compile(rb'\A\s*\{\s*"schema":\s*"sagnac\.([a-z-]+)/')
_PAGE: Final = b'<meta name="generator" content="sagnac '
_RECORDING: Final = b"recording made by sagnac"
_SETTINGS: Final = b", made by sagnac"


@dataclass(frozen=True, slots=True, kw_only=True)
class Outputs:
    """Files that are written together.

    Attributes
    ----------
    paths
        All of them.
    mark
        The one that says what they are.
    kind
        What it says: the name of a schema, ``page``, ``recording`` or ``settings``.
    """

    paths: tuple[Path, ...]
    mark: Path
    kind: str


def kind_of(path: Path) -> str:
    """The kind that a file of this package states of itself; empty for any other file."""
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD)
            stream.seek(max(0, path.stat().st_size - _TAIL))
            tail = stream.read(_TAIL)
    except OSError:
        return ""
    schema = _SCHEMA.match(head)
    if schema is not None:
        return schema[1].decode()
    words = {"page": _PAGE, "recording": _RECORDING, "settings": _SETTINGS}
    return next((kind for kind, word in words.items() if word in head or word in tail), "")


def require_free(outputs: Outputs, reads: Iterable[Path] = (), *, force: bool = False) -> None:
    """Refuse to write over what the run reads, or over what such a run did not make.

    Parameters
    ----------
    outputs
        What will be written.
    reads
        What the run reads.
    force
        Whether it was said that it may.

    Raises
    ------
    WouldOverwrite
        If a file is there that would be lost.
    """
    require_choice("force", force, (False, True))
    there = [path for path in outputs.paths if path.is_symlink() or path.exists()]
    if force or not there:
        return
    for path in there:
        if any(one.exists() and path.exists() and path.samefile(one) for one in reads):
            raise WouldOverwrite("is read by this run, and would be lost", path=str(path))
    if kind_of(outputs.mark) != outputs.kind:
        problem = "is there, and no such run made it, so it would be lost"
        raise WouldOverwrite(problem, path=str(there[0]))


# Files that go into a folder together, and the mark among them: a page, or a document that says of
# what kind it is. Results and reports of a campaign are named by their content.
_FOLDERS: Final[Mapping[str, tuple[str, str]]] = {
    "report": (
        "analysis.json",
        "report.html report.pdf analysis.json settings.toml stability.csv lines.csv family.csv "
        "psd.csv stability.png spectrum.png parts.png self_noise.png",
    ),
    "accelerometers": ("report.html", "report.html report.pdf stability.png"),
    "comparison": ("comparison.json", "comparison.html comparison.json comparison.png"),
    "alignment": ("alignment.json", "alignment.json alignment.png drift.png"),
    "campaign": ("index.html", "campaign.csv campaign.parquet campaign.png index.html"),
    "reproduction": (
        "reproduction.html",
        "reproduction.html figure*.png table*.png figure*.csv table*.csv",
    ),
}


def outputs_in(folder: Path, what: str) -> Outputs:
    """The files that a run writes into a folder.

    Parameters
    ----------
    folder
        Of the run.
    what
        ``report`` on one analysis, page on its ``accelerometers``, ``comparison`` of methods,
        ``alignment``, ``campaign`` or ``reproduction``.
    """
    name_of_mark, listed = _FOLDERS[what]
    mark = folder / name_of_mark
    paths: list[Path] = []
    for name in listed.split():
        paths += sorted(folder.glob(name)) if "*" in name else [folder / name]
    kind = "page" if mark.suffix == ".html" else mark.stem
    return Outputs(paths=tuple(paths), mark=mark, kind=kind)


def earlier_files(outputs: Outputs) -> list[Path]:
    """Those of the files that are there and that an earlier run of the kind wrote."""
    if kind_of(outputs.mark) != outputs.kind:
        return []
    return [path for path in outputs.paths if path.is_symlink() or path.exists()]


def results_in(folder: Path) -> set[Path]:
    """The files in a folder that earlier runs of any kind wrote as results."""
    return {path for what in _FOLDERS for path in earlier_files(outputs_in(folder, what))}


def of_export(path: Path, tool: str) -> Outputs:
    """The settings of a filter."""
    return Outputs(paths=(path,), mark=path, kind="filter" if tool == "json" else "settings")
