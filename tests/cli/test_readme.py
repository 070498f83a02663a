"""The first page: every command on it runs as it is printed."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from sagnac.cli import main

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """A folder with a recording of two gyros, in deg/s at 200 Hz."""
    folder = tmp_path_factory.mktemp("readme")
    rates = 0.01 * np.random.default_rng(2).standard_normal((12_000, 2))
    np.savetxt(folder / "run.csv", rates, delimiter=",", header="x,z", comments="")
    return folder


def test_it_fits_a_screen_and_a_half_and_its_pages_are_there():
    assert len(README.splitlines()) <= 100
    for path in re.findall(r"\]\(((?!http)[^)#]+)", README):
        assert (ROOT / path).is_file(), path


@pytest.mark.usefixtures("blank_figures")
def test_its_commands_run(place, monkeypatch, capsys):
    monkeypatch.chdir(place)
    commands = re.findall(r"^sagnac (.*)$", README, re.MULTILINE)
    assert len(commands) >= 3
    for command in commands:
        assert main(shlex.split(command)) == 0, capsys.readouterr().err
    assert (place / "report" / "report.html").is_file()
    assert "gyroscope_noise_density" in (place / "imu.yaml").read_text()


@pytest.mark.usefixtures("blank_figures")
def test_its_script_runs(place, monkeypatch, capsys):
    (script,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    monkeypatch.chdir(place)
    exec(script, {})
    assert "deg/sqrt(h)" in capsys.readouterr().out
