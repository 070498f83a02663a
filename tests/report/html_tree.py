"""A page as a tree, and its numbers as a reader takes them."""

import re
from dataclasses import dataclass, field
from html.parser import HTMLParser

from tests.report.examples import VOID

_RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_NUMBER = re.compile(r"([-−]?\d+(?:\.(\d+))?)(?:e([-+]?\d+)| × 10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?")


@dataclass
class Node:
    """An element with what is in it."""

    tag: str
    kinds: tuple[str, ...] = ()
    children: list = field(default_factory=list)

    def all(self, tag: str = "", kind: str = "") -> list["Node"]:
        """Every element below of a tag, of a class, or of both."""
        found = []
        for child in self.children:
            if isinstance(child, Node):
                if tag in ("", child.tag) and (not kind or kind in child.kinds):
                    found.append(child)
                found += child.all(tag, kind)
        return found

    def first(self, tag: str = "", kind: str = "") -> "Node":
        return self.all(tag, kind)[0]

    @property
    def text(self) -> str:
        """Everything below, with single spaces."""
        parts = [child if isinstance(child, str) else child.text for child in self.children]
        return " ".join("".join(f"{part} " for part in parts).split())

    @property
    def own(self) -> str:
        """Without what stands in elements below."""
        return " ".join("".join(c for c in self.children if isinstance(c, str)).split())


class _Builder(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.open = [Node("page")]

    def handle_starttag(self, tag, attributes):
        node = Node(tag, tuple((dict(attributes).get("class") or "").split()))
        self.open[-1].children.append(node)
        if tag not in VOID:
            self.open.append(node)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop().tag == tag

    def handle_data(self, data):
        self.open[-1].children.append(data)


def tree(html: str) -> Node:
    builder = _Builder()
    builder.feed(html)
    builder.close()
    return builder.open[0]


@dataclass(frozen=True)
class Shown:
    """A number as written, and half of its last digit."""

    value: float
    half: float

    def says(self, stated: float | None) -> bool:
        """Whether it is the number stated, rounded."""
        return stated is not None and abs(self.value - stated) <= 1.000001 * self.half


def numbers(text: str) -> list[Shown]:
    """The numbers of a text; a power of ten after the second of two stands for both."""
    found = []
    for match in _NUMBER.finditer(text):
        power = int(match[3] or (match[4] or "0").translate(_RAISED))
        found.append((float(match[1].replace("−", "-")), len(match[2] or ""), power))
    if len(found) == 2 and "…" in text and found[0][2] == 0 and " × " in text:
        found[0] = (*found[0][:2], found[1][2])
    return [
        Shown(value=value * 10.0**power, half=0.5 * 10.0 ** (power - places))
        for value, places, power in found
    ]
