"""Analyses of every shape, and what a page has to be."""

from html.parser import HTMLParser

from tests.handmade import N, analysis, estimate

VOID = {"meta", "br", "img", "link", "hr", "input", "use", "path"}


class Checker(HTMLParser):
    """Tags that close in order, ids, and everything that could be fetched."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.references: list[str] = []
        self.tags: set[str] = set()
        self.text: list[str] = []

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        self._look(attributes)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags.add(tag)
        self._look(attributes)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)

    def _look(self, attributes):
        for name, value in attributes:
            if name == "id":
                self.ids.append(value)
            if name in ("src", "href", "xlink:href", "data", "action", "srcset"):
                self.references.append(value)


def checked(html: str) -> Checker:
    checker = Checker()
    checker.feed(html)
    checker.close()
    assert checker.open == []
    return checker


CASES = {
    "pair": analysis(),
    "triad": analysis(gyros=("x", "y", "z")),
    "single at rest": analysis(gyros=("x",), table_rate=None),
    "no lines": analysis(lines=()),
    "nothing removed": analysis(method="none"),
    "upper bound": analysis(answer=estimate(N, status="upper bound")),
    "not observable": analysis(answer=estimate(0.0, status="not observable")),
    "no file": analysis(provenance=False, notes=()),
}
