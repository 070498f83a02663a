"""``sagnac plan``: how long to record."""

import numpy as np
import pytest

from sagnac.cli import main
from tests.cli.examples import STATED, one_line_among, strict


def test_hours_for_a_width_and_to_decide_a_limit(bare, capsys):
    arguments = ["plan", str(bare), *STATED, "--within", "2%,1%", "--spec", "2e-3deg/sqrt(h)"]
    # The interval of the curve has no say in it.
    arguments += ["--interval", "1s"]
    assert main([*arguments, "--json"]) == 0
    made = strict(capsys.readouterr().out)
    wide, narrow, limit = (row["hours"] for row in made["plan"])
    # Half the width takes four times as long, of an average longer.
    assert made["supposes"] == "whole band"
    assert 3.8 < narrow / wide < 4.2
    assert limit > 0.0
    assert main(arguments) == 0
    shown = capsys.readouterr().out
    assert "± 1 %" in shown
    assert "Forecast for an answer that" in shown
    assert "N ≤ 0.002 °/√h decided" in shown
    assert "B is not estimated yet" in shown
    assert "N is taken to be what was read" in shown
    assert main(arguments[:-4]) == 0
    assert "N is taken to be what was read" not in capsys.readouterr().out


def test_data_that_is_spoilt_is_not_to_be_recorded_longer(tmp_path, capsys):
    path = tmp_path / "coarse.csv"
    noise = np.round(0.35 * np.random.default_rng(6).standard_normal(6000))
    np.savetxt(path, noise, header="x[deg/h]", comments="")
    assert main(["plan", str(path), "--kind", "rate", "--rate", "50"]) == 1
    said = capsys.readouterr().err
    assert "mend this first: x: is read out in steps of 1 deg/h" in said
    assert "four times as long" not in said


def test_every_gyro_at_rest_has_a_plan(tmp_path, capsys):
    path = tmp_path / "still.csv"
    noise = np.random.default_rng(6).standard_normal((4000, 2)) * [1.0, 2.0]
    np.savetxt(path, noise, delimiter=",", header="x[deg/h],z[deg/h]", comments="")
    words = ["plan", str(path), "--kind", "rate", "--rate", "10", "--method", "none"]
    words += ["--within", "1%", "--spec", "0.007deg/sqrt(h)"]
    assert main([*words, "--json"]) == 0
    made = strict(capsys.readouterr().out)
    assert list(made["gyros"]) == ["x", "z"]
    assert made["plan"] == made["gyros"]["x"]["plan"]
    # The limit lies above N of x, 0.0053, by a third and below that of z by a third.
    widths, limits = zip(*(one["plan"] for one in made["gyros"].values()), strict=True)
    assert widths[0]["hours"] == pytest.approx(widths[1]["hours"], rel=0.5)
    assert all(limit["hours"] > 0.0 for limit in limits)
    assert main(words) == 0
    assert capsys.readouterr().out.count("interval of N") == 2
    assert main([*words, "--gyros", "z", "--json"]) == 0
    alone = strict(capsys.readouterr().out)
    assert "gyros" not in alone
    assert alone["plan"] == made["gyros"]["z"]["plan"]


@pytest.mark.parametrize(
    ("command", "more", "words"),
    [
        ("plan", ("--within", "0"), "--within: '0'"),
        ("plan", ("--within", "1%,200%"), "--within: '200%'; give half widths"),
        ("plan", ("--spec", "B=1"), "only an interval"),
        ("analyze", ("--spec", "3furlong"), "--spec"),
        ("analyze", ("--spec", "1", "--risk", "2"), "--risk"),
    ],
)
def test_a_width_or_limit_that_cannot_be_is_wrong_usage(command, more, words, bare, capsys):
    assert main([command, str(bare), *STATED, *more]) == 2
    assert words in one_line_among(capsys.readouterr().err)
