"""``sagnac lines``: the periodic components."""

from sagnac.cli import main
from tests.cli.examples import strict


def test_lines_is_a_table_of_what_is_in_the_analysis(recording, capsys):
    arguments = ["lines", str(recording), "--gyros", "x,z"]
    assert main(arguments) == 0
    shown = capsys.readouterr().out
    assert main([*arguments, "--json"]) == 0
    made = strict(capsys.readouterr().out)
    assert made["channel"] == "x-z"
    rows = [row for row in shown.splitlines() if row.startswith(("time ", "table angle "))]
    assert len(rows) == len(made["lines"])
