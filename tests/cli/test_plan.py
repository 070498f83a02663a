"""``sagnac plan``: how long to record."""

import pytest

from sagnac.cli import main
from tests.cli.examples import STATED, strict


def test_hours_for_a_width_and_to_decide_a_limit(bare, capsys):
    arguments = ["plan", str(bare), *STATED, "--within", "2%,1%", "--spec", "2e-3deg/sqrt(h)"]
    # Of angles at 1 s the average is the narrower one.
    arguments += ["--interval", "1s"]
    assert main([*arguments, "--json"]) == 0
    made = strict(capsys.readouterr().out)
    wide, narrow, limit = (row["hours"] for row in made["plan"])
    # Half the width takes four times as long, and longer of an average.
    assert made["supposes"] == "average"
    assert 4.2 < narrow / wide < 6.0
    assert limit > 0.0
    assert made["supposes"] in ("whole band", "average")
    assert main(arguments) == 0
    shown = capsys.readouterr().out
    assert "± 1 %" in shown
    assert "Forecast for an answer that" in shown
    assert "N ≤ 0.002 °/√h decided" in shown


@pytest.mark.parametrize(
    ("more", "words"), [(("--within", "0"), "--within 0"), (("--spec", "B=1"), "only an interval")]
)
def test_what_cannot_be_planned_is_wrong_usage(more, words, bare, capsys):
    assert main(["plan", str(bare), *STATED, *more]) == 2
    assert words in capsys.readouterr().err
