"""``sagnac simulate``: a recording of the rig."""

import json

from sagnac.cli import main
from tests.cli.examples import one_line


def test_simulate_takes_what_was_typed(capsys, tmp_path):
    path = tmp_path / "run.npz"
    arguments = ["simulate", "-o", str(path), "--preset", "quiet", "--seed", "7"]
    assert main([*arguments, "--table-rate", "-20", "--duration", "12s"]) == 0
    assert "wrote" in capsys.readouterr().out
    truth = json.loads((tmp_path / "run.npz.truth.json").read_text())
    assert truth["seed"] == 7
    assert truth["samples"] == 6000
    assert truth["table_rate_deg_per_s"] == -20.0


def test_a_toml_that_is_not_of_the_rig_is_an_error_in_the_data(capsys, tmp_path):
    config = tmp_path / "rig.toml"
    config.write_text("duration_hours = 2\n")
    assert main(["simulate", str(config), "-o", str(tmp_path / "a.parquet")]) == 1
    line = one_line(capsys)
    assert str(config) in line
    assert "duration_hours" in line
    assert [item.name for item in tmp_path.iterdir()] == ["rig.toml"]
