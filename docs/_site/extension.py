"""What the site of sagnac adds to Sphinx.

Tables that are made from the code, equations without a script, short signatures, shell cells that
read as a terminal, and pages that are executed anew when the package has changed.
"""

import hashlib
import re
import shutil
from pathlib import Path
from typing import Any, Final

from benchmarks._made import MADE
from docs._site import tables
from docs._site.signatures import signature_of
from docutils import nodes
from docutils.utils.math import latex2mathml
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

_ROOT: Final = Path(__file__).parents[2]
# What the outcome of an executed page depends on besides the page.
_SOURCES: Final = ("src/sagnac/**/*.py", "docs/_site/house.py", "docs/_site/ipython/**/*.py")


class MadeTable(SphinxDirective):
    """``{made} NAME``: the table of that name in `docs._site.tables`, as Markdown."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """The parsed table."""
        return self.parse_text_to_nodes(tables.TABLES[self.arguments[0]]())


def _math(visitor: Any, node: nodes.Element, *, as_block: bool) -> None:
    made = latex2mathml.tex2mathml(node.astext(), as_block=as_block)
    visitor.body.append(made)
    raise nodes.SkipNode


def _short_signature(
    _app: Sphinx, what: str, _name: str, thing: Any, _options: Any, signature: str, _returns: str
) -> tuple[str, str] | None:
    """Names and short defaults: types stand in the text, long defaults at what they are of."""
    if what not in ("function", "class", "method"):
        return None
    try:
        return signature_of(thing), ""
    except (TypeError, ValueError):
        return None


def _read_source(_app: Sphinx, docname: str, content: list[str]) -> None:
    """Files beside the docs have pages of the site; measured pages say when they were made."""
    for made in MADE:
        if made.page == f"{docname}.md":
            content[0] += f"\n\n---\n\n{made.closing}\n"
    for file, page in (("CONTRIBUTING.md", "contributing.md"), ("CHANGELOG.md", "changelog.md")):
        content[0] = content[0].replace(f"](../{file}", f"]({page}")


def _show_shell(_app: Sphinx, doctree: nodes.document) -> None:
    """A cell of the shell shows its commands, not the word that makes it one."""
    for block in doctree.findall(nodes.literal_block):
        text = block.astext()
        if text.startswith("%%sh\n"):
            shown = text.removeprefix("%%sh\n")
            block.replace_self(nodes.literal_block(shown, shown, language="bash"))


def _digest() -> str:
    """Digest of the code that executed pages call."""
    found = hashlib.sha256()
    for pattern in _SOURCES:
        for file in sorted(_ROOT.glob(pattern)):
            found.update(file.read_bytes())
    return found.hexdigest()[:16]


def _forget_what_is_older(app: Sphinx, config: Any) -> None:
    """Pages that were executed with another version of the package are executed again."""
    config.sagnac_digest = digest = _digest()
    stamp = Path(app.srcdir) / "_build" / "source.digest"
    if stamp.is_file() and stamp.read_text() == digest:
        return
    shutil.rmtree(config.nb_execution_cache_path, ignore_errors=True)
    shutil.rmtree(Path(app.srcdir) / "gallery", ignore_errors=True)
    stamp.parent.mkdir(exist_ok=True)
    stamp.write_text(digest)


_OUTSIDE: Final = re.compile(
    r'<(?:script|img|iframe|link)\b[^>]*?(?:src|href)="((?:https?:)?//[^"]+)"'
)


def _nothing_is_fetched(app: Sphinx, error: Exception | None) -> None:
    """No page asks another machine for anything.

    Raises
    ------
    ValueError
        If one does.
    """
    if error or app.builder.format != "html":
        return
    for page in Path(app.outdir).rglob("*.html"):
        outside = _OUTSIDE.findall(page.read_text(encoding="utf-8"))
        if outside:
            raise ValueError(f"{page.relative_to(app.outdir)} fetches {outside[0]}")


def setup(app: Sphinx) -> dict[str, Any]:
    """Register all of it."""
    app.add_config_value("sagnac_digest", "", "env")
    app.add_directive("made", MadeTable)
    app.add_html_math_renderer(
        "mathml",
        (lambda visitor, node: _math(visitor, node, as_block=False), None),
        (lambda visitor, node: _math(visitor, node, as_block=True), None),
    )
    app.connect("config-inited", _forget_what_is_older, priority=1)
    app.connect("autodoc-process-signature", _short_signature)
    app.connect("source-read", _read_source)
    app.connect("doctree-read", _show_shell)
    app.connect("build-finished", _nothing_is_fetched)
    return {"parallel_read_safe": True}
