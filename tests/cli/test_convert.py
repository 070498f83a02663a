"""``sagnac convert``: one format into another."""

import numpy as np

from sagnac import formats
from sagnac.cli import main
from tests.cli.examples import STATED, one_line


def test_convert_states_what_was_stated(bare, capsys, tmp_path):
    target = tmp_path / "same.parquet"
    assert main(["convert", str(bare), str(target), *STATED]) == 0
    assert "wrote" in capsys.readouterr().out
    again = formats.read(target)
    assert again.sample_rate == 100.0
    assert again.gyros[0].kind == "rate"
    once = np.loadtxt(bare, skiprows=1) * np.pi / 180.0 / 3600.0
    np.testing.assert_allclose(again.gyros[0].values, once, rtol=1e-12)


def test_a_name_that_cannot_be_written_is_wrong_usage(bare, capsys, tmp_path):
    target = tmp_path / "same.csv"
    assert main(["convert", str(bare), str(target), *STATED, "--columns", "_x=x"]) == 2
    assert "gyro name is '_x', which cannot stand in a file" in one_line(capsys)
    assert not target.exists()
