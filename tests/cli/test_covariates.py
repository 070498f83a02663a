"""``--covariates temperature``: a column of the file, and what is said of it."""

import numpy as np
import pytest

from sagnac.cli import main
from tests.cli.examples import one_line

pytestmark = pytest.mark.usefixtures("blank_figures")

RATE = 5.0
STATED = ["--kind", "rate", "--unit", "deg/h", "--rate", "5", "--gyros", "x"]


@pytest.fixture
def file(tmp_path):
    """A unit that warms up by 10 degrees and drifts by 30 deg/h with it."""
    time = np.arange(8000) / RATE
    temperature = 20.0 - 10.0 * np.expm1(-time / 400.0)
    rate = 3.0 * temperature + np.random.default_rng(41).standard_normal(time.size)
    path = tmp_path / "unit.csv"
    np.savetxt(
        path, np.column_stack([rate, temperature]), delimiter=",", header="x,T_board", comments=""
    )
    return path


def test_the_drift_is_named_and_taken_off(file, capsys):
    words = ["avar", str(file), *STATED, "--method", "fos"]
    assert (
        main([*words, "--columns", "x=x,temperature=T_board", "--covariates", "temperature"]) == 0
    )
    shown = " ".join(capsys.readouterr().out.split())
    assert "temperature from 20 to" in shown
    # 3 deg/h a degree, to the noise of 1 deg/h a sample.
    stated = shown.partition("a drift of (")[2].partition(" ")[0]
    assert float(stated) == pytest.approx(3.0, abs=0.1)
    assert "warm-up" not in shown


def test_settings_of_a_filter_say_that_they_are_without_the_drift(file, tmp_path, capsys):
    columns = ["--columns", "x=x,temperature=T_board"]
    for name, more in (("plain", []), ("compensated", ["--covariates", "temperature"])):
        report = str(tmp_path / name)
        assert main(["avar", str(file), *STATED, *columns, *more, "-o", report]) == 0
        assert main(["export", report, "-o", f"{report}.yaml"]) == 0
        warned = "rates that are compensated alike" in " ".join(capsys.readouterr().out.split())
        assert warned is bool(more)
        settings = (tmp_path / f"{name}.yaml").read_text("utf-8")
        assert ("took off what followed the temperature" in settings) is bool(more)


def test_a_column_that_is_not_there_is_one_line(file, capsys):
    assert main(["avar", str(file), *STATED, "--covariates", "temperature"]) == 1
    said = one_line(capsys)
    assert "temperature: no such column; the file has x, T_board" in said
    assert "--columns temperature=COLUMN" in said
    assert main(["avar", str(file), *STATED, "--covariates", "pressure"]) == 2
    assert "temperature" in one_line(capsys)
