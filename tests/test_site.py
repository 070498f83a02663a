"""The pages of the docs name what there is; ``make docs`` runs them."""

import ast
import builtins
import dataclasses
import doctest
import json
import re
from importlib import import_module
from pathlib import Path

import pytest
from benchmarks._faults import PATHOLOGIES
from docs._site import tables
from docs._site.signatures import LONGEST, MADE, signature_of

import sagnac
from sagnac.cli import main
from sagnac.cli.app import app, options_of
from sagnac.core.units import UNITS
from sagnac.formats.registry import FORMATS
from sagnac.formats.statement import Statement
from sagnac.navigation.definitions import definitions
from sagnac.report.document import analysis_document
from sagnac.stability.estimators import ESTIMATORS
from tests.handmade import analysis

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in [
        *(ROOT / name for name in ("README.md", "CONTRIBUTING.md")),
        *(page for page in DOCS.rglob("*.md") if page.parts[len(DOCS.parts)] != "_build"),
    ]
}
SOURCE = ROOT / "src" / "sagnac"
FILES = {"csv", "json", "toml", "html", "parquet", "pdf", "png", "md"}


def exported() -> list[str]:
    """Names of the door and of its pictures."""
    door = [name for name in sagnac.__all__ if name not in ("plot", "__version__")]
    return [*door, *(f"plot.{name}" for name in sagnac.plot.__all__)]


def named(name: str) -> object:
    found: object = sagnac
    for part in name.split("."):
        found = getattr(found, part)
    return found


def test_every_exported_name_has_a_page():
    page = PAGES["docs/reference/api.md"]
    blocks = re.findall(r"autosummary::\n(.*?)```", page, re.DOTALL)
    listed = [name for block in blocks for name in re.findall(r"^   (\w[\w.]*)$", block, re.M)]
    assert sorted(listed) == sorted(exported())
    by_library = page.partition("Types that the library makes")[2].partition("\n## ")[0]
    assert set(re.findall(r"^   (\w+)$", by_library, re.M)) == {*MADE}


@pytest.mark.parametrize("name", exported())
def test_every_exported_name_has_an_example(name):
    assert ">>> " in (named(name).__doc__ or "")


@pytest.mark.parametrize("name", exported())
def test_an_example_runs_where_it_is_pasted(name):
    """It needs what ``import sagnac`` exports and what it imports, not its module's other names."""
    shown = doctest.DocTestParser().get_examples(named(name).__doc__ or "")
    parts = [*ast.walk(ast.parse("".join(one.source for one in shown)))]
    names = [one for one in parts if isinstance(one, ast.Name)]
    made = {one.id for one in names if isinstance(one.ctx, ast.Store)}
    made |= {one.name for one in parts if isinstance(one, ast.ExceptHandler)}
    made |= {one.asname or one.name for one in parts if isinstance(one, ast.alias)}
    assert {one.id for one in names} <= {*made, *sagnac.__all__, *dir(builtins)}


def test_a_long_signature_is_cut_and_types_are_left_out():
    def short(a: int, /, *, b: str = "x") -> None: ...
    def long(*, aaaaaaaaaaaaaaaaaaaa=1, bbbbbbbbbbbbbbbbbbbbbbb=2, c="a long default value"): ...

    assert signature_of(short) == "(a, /, *, b='x')"
    assert signature_of(long).endswith("c=...)")
    assert signature_of(sagnac.Analysis) == ""
    assert signature_of(sagnac.Settings).startswith("(*, gyros=(), method='fos', ")
    assert signature_of(sagnac.Settings).endswith(", ...)")


@pytest.mark.parametrize("name", exported())
def test_a_signature_is_read_at_once(name):
    assert len(signature_of(named(name))) <= LONGEST == 160


def slug(heading: str) -> str:
    """The anchor of a heading."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
    return re.sub(r"[^\w\- ]", "", plain.strip().lower()).replace(" ", "-")


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(((?!https?:)[^)\s]+)\)", PAGES[page]):
        path, _, anchor = link.partition("#")
        target = (ROOT / page).parent / path if path else ROOT / page
        if path == "../gallery/index.rst":
            continue  # made by the build
        assert target.exists(), link
        if anchor:
            text = re.sub(r"```.*?```", "", target.read_text(encoding="utf-8"), flags=re.DOTALL)
            headings = re.findall(r"^#+ (.*)$", text, re.M)
            assert anchor in map(slug, headings), link


@pytest.mark.parametrize("page", PAGES)
def test_modules_and_names_are_there(page):
    prose = re.sub(r"```.*?```", "", PAGES[page], flags=re.DOTALL)
    for name in re.findall(r"`(sagnac(?:\.\w+)+)`", prose):
        module, _, rest = name.partition(".")
        found: object = import_module(module)
        for part in rest.split("."):
            try:
                found = getattr(found, part)
            except AttributeError:
                found = import_module(f"{found.__name__}.{part}")  # type: ignore[attr-defined]
    if page == "docs/simulate.md":
        return  # keys of a TOML, which tests/rig/test_config.py compares
    for room, module in re.findall(r"`(\w+)\.(\w+)`", prose):
        if (SOURCE / room).is_dir() and room != "plot" and module not in FILES:
            inside = import_module(f"sagnac.{room}")
            there = (SOURCE / room / f"{module}.py").is_file() or hasattr(inside, module)
            assert there, f"{room}.{module}"


COMMANDS = [name for name in app if not name.startswith("-")]
OPTIONS = {name: options_of(name) for name in COMMANDS}


@pytest.mark.parametrize("page", PAGES)
def test_commands_have_the_options_that_are_printed(page):
    """In blocks of commands each option is one of its command; in prose, one of any."""
    text = PAGES[page].replace("\\\n", " ")
    for command, rest in re.findall(r"^sagnac (\w+)(.*)$", text, re.M):
        assert command in OPTIONS, command
        for option in re.findall(r"(?<!\S)(--[a-z][a-z-]*)", rest.partition("#")[0]):
            assert option in OPTIONS[command], f"sagnac {command} {option}"


def test_what_none_leaves_out_is_said_in_the_help_and_on_the_page(capsys):
    """Statements that a file makes and a caller can take back."""
    assert main(["check", "--help"]) == 0
    shown = " ".join(re.sub("[│╭╮╰╯─]", " ", capsys.readouterr().out).split())
    for what in ("no stamps", "no table", "no null pulse", "none"):
        assert f"; none for {what}." in shown
    assert re.search(r"`--null-pulse COLUMN` \|.*`none`", PAGES["docs/commands.md"])


def test_every_format_is_on_its_page():
    page = PAGES["docs/files.md"]
    for one in FORMATS:
        for suffix in one.suffixes:
            assert f"`{suffix}`" in page or one.name == "binary", suffix


def test_tables_have_a_row_for_each():
    assert tables.formats().count("\n") == len(FORMATS) + 1
    assert tables.estimators().count("\n") == len(ESTIMATORS) + 1
    assert tables.tools().count("\n") == len(definitions()) + 1
    assert all(f"`{name}`" in tables.units() for name in UNITS)
    document = json.loads(analysis_document_text())
    for key in document:
        assert f"| `{key}` |" in tables.schema(), key
    called = {name for page in PAGES.values() for name in re.findall(r"{made} (\S+)", page)}
    assert called == set(tables.TABLES)


def analysis_document_text() -> str:
    """A document with every key that one of a still gyro has."""
    return json.dumps(analysis_document(analysis()))


def test_a_fault_of_the_table_is_said():
    (fault,) = [one for one in PATHOLOGIES if one.name == "zeros"]
    strength, note = tables.said(fault, turning=False)
    assert note is not None
    assert (note.name, strength) == ("dropouts", "0.001 share")


def test_what_physics_contradicts_is_said():
    assert "15.04" in tables.contradicted("three gyros in °/h called °/s").text
    rows = tables.physics().splitlines()[2:]
    assert len(rows) >= 5
    for row in rows:
        assert "`units`" in row or "`motion`" in row, row
        assert "warning" in row or "error" in row, row


def test_read_names_everything_that_may_be_stated():
    for one in dataclasses.fields(Statement):
        assert f"``{one.name}``" in (sagnac.read.__doc__ or ""), one.name


def test_commands_of_the_front_page_have_their_options():
    """Each leads to a page of the site; the five tasks of a newcomer are among them."""
    page = PAGES["docs/index.md"]
    for task in ("bag", "accept", "wrong_unit", "batch", "script"):
        assert f"](tasks/{task}.md) |" in page
    commands = re.findall(r"^\| \[.*\.md\S*\) \| `sagnac (\w+)([^`]*)` \|$", page, re.M)
    assert len(commands) >= 10
    for command, rest in commands:
        assert command in OPTIONS
        for option in re.findall(r"(?<!\S)(--[a-z][a-z-]*)", rest):
            assert option in OPTIONS[command], f"sagnac {command} {option}"


def test_every_command_is_on_its_page():
    for command in COMMANDS:
        assert f"`sagnac {command}" in PAGES["docs/commands.md"], command
