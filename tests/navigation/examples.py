"""Documents of analyses, as files."""

import json
from pathlib import Path

from sagnac.navigation.tools import SettingsFile
from sagnac.report.document import analysis_document, to_json
from tests.handmade import analysis

N = 2.5e-5 * 3.141592653589793 / 180.0 / 60.0  # of the analyses put together by hand, rad/sqrt(s)


def document(folder: Path, *, name: str = "analysis.json", **changes) -> Path:
    """The document of an analysis put together by hand."""
    path = folder / name
    path.write_text(to_json(analysis_document(analysis(**changes))), encoding="utf-8")
    return path


def written(tool: str, settings, accelerometers=(), **how) -> str:
    """The file of a tool."""
    return SettingsFile(tool=tool, settings=(*settings, *accelerometers), **how).text()


def keys(text: str) -> dict[str, str]:
    """``key: value`` of a YAML file without nesting, comments left out."""
    lines = [line.partition("#")[0].strip() for line in text.splitlines()]
    pairs = [line.partition(":") for line in lines if ":" in line and not line.startswith("%")]
    return {key.strip(): value.strip() for key, _, value in pairs}


def changed(path: Path, **changes) -> Path:
    """The same document with other values under its top keys."""
    stated = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps({**stated, **changes}), encoding="utf-8")
    return path
