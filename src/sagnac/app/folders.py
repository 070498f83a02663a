"""The folder that a page may look into and write to, and what lies in it."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

_MOST: Final = 500
_RECORDINGS: Final = re.compile(
    r"\.(?:csv|txt|dat|tsv|parquet|pq|np[yz]|hdf5?|h5|mat|nc|tdms|ulg|bag|db3|mcap|mseed|feather|arrow|"
    r"imu|bin|ins|lvm)$",
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """Folders whose files a page may open.

    Attributes
    ----------
    root
        Where the page was started: files are listed, read and written below it.
    dropped
        Where files lie that were dropped on the page.
    """

    root: Path
    dropped: Path

    def path(self, text: str, *, write: bool = False) -> Path:
        """A path that the page names, absolute or from the root.

        ValueError if it lies elsewhere, be it by a link.
        """
        if not text or "\0" in text:
            raise ValueError("no path is given")
        found = (self.root / text).resolve()
        allowed = (self.root,) if write else (self.root, self.dropped)
        if not any(found == one or one in found.parents for one in allowed):
            raise ValueError(
                f"{text} lies outside {self.root}, where the page was started; start sagnac app in "
                "the folder of the file"
            )
        return found

    def listing(self, text: str) -> dict[str, Any]:
        """What lies in a folder: folders first, then files that may be recordings.

        ValueError if it lies elsewhere. OSError If it cannot be read.
        """
        folder = self.path(text)
        entries = []
        for one in sorted(folder.iterdir(), key=lambda each: each.name.lower()):
            if not one.name.startswith(".") and (kind := _kind(one)):
                size = 0 if kind != "file" else one.stat().st_size
                entries.append({"name": one.name, "kind": kind, "size": size})
        entries.sort(key=lambda each: each["kind"] == "file")
        return {
            "folder": "." if folder == self.root else str(folder.relative_to(self.root)),
            "root": str(self.root),
            "entries": entries[:_MOST],
            "left_out": max(0, len(entries) - _MOST),
        }


def _kind(path: Path) -> str:
    """``folder``, ``campaign``, ``file``, or nothing if it is of no use here."""
    try:
        if path.is_dir():
            if (path / "campaign.csv").is_file():
                return "campaign"
            return "file" if (path / "metadata.yaml").is_file() else "folder"
        return "file" if path.is_file() and _RECORDINGS.search(path.name) else ""
    except OSError:
        return ""
