"""``sagnac compare``: the methods side by side."""

import re
from typing import get_args

import numpy as np
import pytest

from sagnac.analysis.settings import Method
from sagnac.cli import main
from sagnac.cli.measure import METHODS
from tests.cli.examples import STATED, one_line, strict

pytestmark = pytest.mark.usefixtures("blank_figures")


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


def test_every_gyro_at_rest_is_compared(tmp_path, capsys):
    path = tmp_path / "still.csv"
    noise = np.random.default_rng(6).standard_normal((4000, 2)) * [1.0, 2.0]
    np.savetxt(path, noise, delimiter=",", header="x[deg/h],z[deg/h]", comments="")
    words = ["compare", str(path), "--kind", "rate", "--rate", "10", "--method", "none"]
    assert main([*words, "-o", str(tmp_path / "out")]) == 0
    shown = capsys.readouterr().out
    assert shown.count("peaks left") == 2
    html = (tmp_path / "out" / "comparison.html").read_text()
    # N of 1 and 2 deg/h at 10 Hz is 0.0053 and 0.0105 deg/sqrt(h).
    assert "Methods compared, x, z" in html
    assert html.count("<svg") == 2
    rows = re.findall(r'<tr><th>([xz]): [^<]*</th><td class="number">([^<]*)</td>', html)
    assert [name for name, _ in rows] == ["x", "z"]
    assert float(rows[1][1]) / float(rows[0][1]) == pytest.approx(2.0, rel=0.05)
