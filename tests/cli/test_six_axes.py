"""Gyros and accelerometers of one file by one command."""

import re
from contextlib import redirect_stdout
from io import StringIO

import numpy as np
import pytest

from sagnac.cli import main
from tests.cli.examples import strict
from tests.conftest import undrawn
from tests.report.html_tree import tree

pytestmark = pytest.mark.usefixtures("blank_figures")

WALK = 3e-4  # m/s/sqrt(s), 0.018 m/s/sqrt(h)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    noise = np.sqrt(50.0) * np.random.default_rng(23).normal(size=(6000, 2))
    rows = (f"{1e-6 * x:.12g},{(9.81 + WALK * a) / 9.80665:.12g}" for x, a in noise)
    path = tmp_path_factory.mktemp("six") / "unit.csv"
    path.write_text("x[rad/s],force[g]\n" + "\n".join(rows) + "\n")
    return path


STATED = ["--kind", "rate", "--rate", "50", "--gyros", "x", "--columns", "x=x,az=force"]


@pytest.fixture(scope="module")
def bench(file, tmp_path_factory):
    """The folder that the still bench writes, printed, and what is said of it."""
    folder = tmp_path_factory.mktemp("bench")
    words = ["avar", str(file), *STATED, "--accelerometers", "az", "-o", str(folder)]
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(StringIO()) as said:
        undrawn(patch)
        # What prints is tested elsewhere, and not every machine can.
        patch.setattr("sagnac.report.sections.require_pdf", lambda: None)
        patch.setattr("sagnac.report.page.write_pdf", lambda text, path: path.write_text(text))
        assert main([*words, "--confidence", "0.9", "--pdf"]) == 0
    return folder, said.getvalue()


def test_one_command_gives_both(file, bench, tmp_path, capsys):
    words = ["analyze", str(file), *STATED, "--accelerometers", "az", "-o", str(tmp_path)]
    assert main(words) == 0
    for shown, folder in ((capsys.readouterr().out, tmp_path), (bench[1], bench[0] / "x")):
        assert "accelerometer az" in shown
        assert "N velocity random walk" in shown
        section = "<h2>Accelerometers</h2>" in (folder / "report.html").read_text()
        assert section is (folder == tmp_path)
        made = strict((folder / "analysis.json").read_text())
        walk = made["accelerometers"]["az"]["velocity_random_walk"]
        assert walk["low"] < 60.0 * WALK < walk["high"]
        assert made["angle_random_walk"]["unit"] == "deg/sqrt(h)"


def test_the_still_bench_writes_accelerometers_on_a_page_of_their_own(bench):
    folder, shown = bench
    assert f"wrote {folder}/accelerometers/: report.html" in " ".join(shown.split())
    page = tree((folder / "accelerometers" / "report.html").read_text())
    assert (folder / "accelerometers" / "stability.png").stat().st_size > 0
    assert page.first("h1").text == "Accelerometers az"
    assert "bounds at 90 %" in page.text
    assert "Accelerometers az (g)" in " ".join(page.text.split())
    assert "Gyros" not in page.text
    (row,) = (one.text for one in page.all("tr") if "velocity random walk" in one.text)
    walk = strict((folder / "x" / "analysis.json").read_text())["accelerometers"]["az"]
    made = walk["velocity_random_walk"]
    value, low, high = map(float, re.findall(r"\d+\.\d+", row))
    assert value == pytest.approx(made["value"], rel=0.02)
    assert low <= made["low"] * 1.02 < made["high"] <= high * 1.02


def test_the_accelerometers_page_is_printed_with_the_others(bench):
    for folder in (bench[0] / "x", bench[0] / "accelerometers"):
        printed = (folder / "report.pdf").read_text()
        assert printed == (folder / "report.html").read_text()


def test_without_the_option_there_are_none(file, capsys):
    assert main(["avar", str(file), *STATED[:-2], "--json"]) == 0
    assert "accelerometers" not in strict(capsys.readouterr().out)
