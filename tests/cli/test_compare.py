"""``sagnac compare``: the methods side by side."""

from typing import get_args

from sagnac.analysis.settings import Method
from sagnac.cli import main
from sagnac.cli.commands.compare import METHODS
from tests.cli.examples import STATED, one_line, strict


def test_the_methods_compared_are_those_there_are():
    assert set(METHODS) == set(get_args(Method))


def test_compare_shows_methods_and_why_one_is_not_possible(bare, capsys, tmp_path):
    arguments = ["compare", str(bare), *STATED, "--interval", "0.1"]
    assert main([*arguments, "-o", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    rows = {line.split()[0] for line in shown.splitlines() if line}
    assert {"none", "fos-paper", "fos", "fris:"} <= rows
    assert {item.name for item in tmp_path.iterdir()} == {
        "comparison.html", "comparison.json", "comparison.png",
    }  # fmt: skip
    assert main([*arguments, "--json", "--method", "none"]) == 0
    made = strict(capsys.readouterr().out)
    assert list(made["methods"]) == ["none"]
    assert main([*arguments, "--method", "fris"]) == 1
    assert str(bare) in one_line(capsys)
