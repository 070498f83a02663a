"""``--spec``: a verdict by the interval, and the exit status that says it."""

import pytest

from sagnac.cli import main
from sagnac.cli.options import Options, settings_of
from tests.cli.examples import STATED, strict

pytestmark = pytest.mark.usefixtures("blank_figures")

# White noise of 1 deg/h at 100 Hz: N = 0.1/60 deg/sqrt(h).
N = 0.1 / 60.0


@pytest.mark.parametrize(
    ("limit", "status", "said"),
    [(1.5 * N, 0, "pass"), (N, 4, "undecided"), (0.7 * N, 3, "fail")],
)
def test_the_exit_status_says_the_verdict(limit, status, said, bare, capsys):
    stated = ["avar", str(bare), *STATED, "--spec", f"{limit:.6g}deg/sqrt(h)"]
    assert main([*stated, "--json"]) == status
    made = strict(capsys.readouterr().out)
    assert made["verdict"]["overall"] == said
    assert made["verdict"]["gyros"] == {"x": said}
    (row,) = made["verdict"]["limits"]
    answer = made["angle_random_walk"]
    assert (row["value"], row["low"], row["high"]) == (
        answer["value"], answer["low"], answer["high"],
    )  # fmt: skip
    assert row["limit"] == pytest.approx(limit, rel=1e-5)
    assert row["verdict"] == said


def test_analyze_writes_all_whatever_the_verdict(bare, capsys, tmp_path):
    arguments = ["analyze", str(bare), *STATED, "--spec", "N=1e-9,B=100deg/h", "-o", str(tmp_path)]
    assert main(arguments) == 3
    shown = capsys.readouterr().out
    assert "Verdict: FAIL" in shown
    assert "N ≤ 1e-09 °/√h" in shown
    made = strict((tmp_path / "analysis.json").read_text(encoding="utf-8"))
    assert [row["coefficient"] for row in made["verdict"]["limits"]] == [
        "angle_random_walk", "bias_instability",
    ]  # fmt: skip
    assert "FAIL" in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(("limit", "said"), [(1.5 * N, "PASS"), (0.7 * N, "FAIL")])
def test_gyros_together_have_one_verdict(limit, said, bare, tmp_path, capsys):
    both = tmp_path / "both.csv"
    rates = bare.read_text().split()[1:]
    rows = zip(rates, reversed(rates), strict=True)
    both.write_text("x,y\n" + "\n".join(map(",".join, rows)) + "\n")
    main(["avar", str(both), *STATED, "--spec", f"{limit:.6g}deg/sqrt(h)"])
    verdicts = [line for line in capsys.readouterr().out.splitlines() if "Verdict of all" in line]
    assert verdicts == [f"Verdict of all: {said}"]


def test_the_risk_sets_the_confidence():
    assert settings_of(Options()).confidence == 0.95
    assert settings_of(Options(spec="1", risk=0.01)).confidence == 0.99
    assert settings_of(Options(spec="1", risk=0.01, confidence=0.9)).confidence == 0.9


def test_what_was_measured_stands_in_the_unit_of_its_limit(still, capsys):
    """1e6 of one and a sixtieth of the other look like a wide margin, or like none."""
    assert main(["avar", str(still), "--gyros", "x", "--spec", "6 deg/h/sqrt(Hz)"]) == 0
    (row,) = [line for line in capsys.readouterr().out.splitlines() if "N ≤ 6" in line]
    assert row.count("°/h/√Hz") == 2


@pytest.mark.parametrize("command", ["avar", "analyze", "lines"])
def test_a_gyro_that_is_refused_leaves_the_unit_undecided(command, bare, tmp_path, capsys):
    one_dead = tmp_path / "dead.csv"
    rates = bare.read_text().split()[1:]
    one_dead.write_text("x,y,z\n" + "\n".join(f"0.01,{one},{one[:-1]}7" for one in rates) + "\n")
    stated = [command, str(one_dead), *STATED, "--spec", f"{1.5 * N:.6g}deg/sqrt(h)"]
    assert main([*stated, "--json"]) == 4
    made = strict(capsys.readouterr().out)
    assert made["verdict"]["overall"] == "undecided"
    assert list(made["refused"]) == ["x"]


def test_a_file_that_is_refused_leaves_the_verdict_of_all_undecided(bare, tmp_path, capsys):
    gone = tmp_path / "gone.csv"
    stated = ["analyze", str(bare), str(gone), *STATED, "--spec", f"{1.5 * N:.6g}deg/sqrt(h)"]
    assert main([*stated, "--json"]) == 1
    made = strict(capsys.readouterr().out)
    assert made["verdict"] == {"overall": "undecided"}
    assert [one["verdict"]["overall"] for one in made["analyses"]] == ["pass"]
    assert list(made["refused"]) == [str(gone)]
    assert "no such file" in made["refused"][str(gone)]
    both = tmp_path / "both.csv"
    rates = bare.read_text().split()[1:]
    both.write_text("x,y\n" + "\n".join(f"{one},{one[:-1]}7" for one in rates) + "\n")
    stated[1] = str(both)
    assert main([*stated, "-o", str(tmp_path / "out")]) == 1
    assert "Verdict of all: UNDECIDED" in capsys.readouterr().out
