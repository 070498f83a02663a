"""``sagnac demo``: the answer beside the truth."""

import dataclasses
import json
import re

import pytest

from sagnac.cli import main, simulated
from sagnac.rig.config import PRESETS


@pytest.mark.usefixtures("blank_figures")
def test_demo_prints_the_answer_and_the_truth(capsys, tmp_path, monkeypatch):
    asked = []

    def light(name):
        asked.append(name)
        return dataclasses.replace(PRESETS["quiet"], sample_rate_hz=100.0)

    monkeypatch.setattr("sagnac.rig.config.preset", light)
    monkeypatch.setattr(simulated, "QUICK_S", 300.0)
    folder = tmp_path / "demo"
    assert main(["demo", "--quick", "--seed", "3", "-o", str(folder)]) == 0
    assert asked == ["paper"]
    shown = capsys.readouterr().out
    assert [line.split("  ")[0] for line in shown.splitlines()[:4]] == [
        "ARW of gyro x",
        "ARW of gyro y",
        "ARW of gyro z",
        "ARW of gyros x − z, per gyro (N̄)",
    ]
    assert "The truth put in: 2.5e-05 °/√h" in shown
    assert re.search(r"(holds|does not hold|does not show) it", shown)
    truth = json.loads((folder / "recording.parquet.truth.json").read_text())
    assert truth["seed"] == 3
    assert truth["samples"] == 30_000
    assert {"recording.parquet", "report.html", "analysis.json"} <= {
        item.name for item in folder.iterdir()
    }
