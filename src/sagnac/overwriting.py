"""What may be written over: nothing that a run reads, and nothing that this package did not make.

What the package writes says so itself: a document by its schema, a page by its generator, a
recording and the settings of a filter by a mark. Files that are written together are of one make
if one of them, the mark, says what it is.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sagnac.errors import WouldOverwrite

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
    """What a file that this package made says of itself; empty for any other file."""
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
    there = [path for path in outputs.paths if path.is_symlink() or path.exists()]
    if force or not there:
        return
    for path in there:
        if any(one.exists() and path.exists() and path.samefile(one) for one in reads):
            raise WouldOverwrite(path, "is read by this run, and would be lost")
    if kind_of(outputs.mark) != outputs.kind:
        raise WouldOverwrite(there[0], "is there, and no such run made it, so it would be lost")


def of_report(folder: Path) -> Outputs:
    """The files of the report on one analysis."""
    names = (
        *("report.html", "report.pdf", "analysis.json", "settings.toml"),
        *("stability.csv", "lines.csv", "family.csv", "psd.csv"),
        *("stability.png", "spectrum.png", "parts.png", "self_noise.png"),
    )
    return _in(folder, names, "analysis.json", "analysis")


def of_accelerometers(folder: Path) -> Outputs:
    """The files of the page on the accelerometers of a recording."""
    return _in(folder, ("report.html", "report.pdf", "stability.png"), "report.html", "page")


def of_comparison(folder: Path) -> Outputs:
    """The files of a comparison of methods."""
    names = ("comparison.html", "comparison.json", "comparison.png")
    return _in(folder, names, "comparison.json", "comparison")


def of_alignment(folder: Path) -> Outputs:
    """The files of an alignment."""
    names = ("alignment.json", "alignment.png", "drift.png")
    return _in(folder, names, "alignment.json", "alignment")


def of_campaign(folder: Path) -> Outputs:
    """Table, page and picture of a campaign; results and reports are named by their content."""
    names = ("campaign.csv", "campaign.parquet", "campaign.png", "index.html")
    return _in(folder, names, "index.html", "page")


def of_reproduction(folder: Path) -> Outputs:
    """The page of the paper's experiment, its pictures and tables."""
    names = ["reproduction.html"]
    if folder.is_dir():
        names += sorted(
            path.name
            for pattern in ("figure*.png", "table*.png", "figure*.csv", "table*.csv")
            for path in folder.glob(pattern)
        )
    return _in(folder, names, "reproduction.html", "page")


def of_export(path: Path, format_name: str) -> Outputs:
    """The settings of a filter."""
    return Outputs(paths=(path,), mark=path, kind="filter" if format_name == "json" else "settings")


def _in(folder: Path, names: Iterable[str], mark: str, kind: str) -> Outputs:
    return Outputs(paths=tuple(folder / name for name in names), mark=folder / mark, kind=kind)
