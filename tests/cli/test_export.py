"""``sagnac export``: from a recording to ``imu.yaml`` in two commands."""

import pytest

from sagnac.cli import main
from tests.cli.examples import STATED, one_line
from tests.filters.examples import document, keys


def test_from_a_recording_to_imu_yaml(bare, capsys, tmp_path):
    assert main(["avar", str(bare), *STATED, "-o", str(tmp_path)]) == 0
    path = tmp_path / "imu.yaml"
    assert main(["export", str(tmp_path / "x" / "analysis.json"), "-o", str(path)]) == 0
    assert f"wrote {path}" in capsys.readouterr().out
    read = keys(path.read_text(encoding="utf-8"))
    # One deg/h at 100 Hz; forty seconds of it leave a third open.
    truth = 0.1 * 4.84813681109536e-06
    assert truth <= float(read["gyroscope_noise_density"]) < 1.5 * truth
    assert float(read["gyroscope_random_walk"]) > 0.0


def test_the_name_of_the_file_tells_the_format(capsys, tmp_path):
    stated = str(document(tmp_path, gyros=("x", "y", "z")))
    for name, said in (("a.toml", "schema"), ("a.params", "EKF2_GYR_NOISE"), ("a.py", "numpy")):
        assert main(["export", stated, "-o", str(tmp_path / name)]) == 0
        assert said in (tmp_path / name).read_text(encoding="utf-8")
    capsys.readouterr()
    assert main(["export", stated, "-o", str(tmp_path / "a.txt")]) == 2
    assert "--format" in one_line(capsys)
    assert main(["export", stated, "-o", str(tmp_path / "a.yaml"), "--axes", "each"]) == 1
    assert "--axes worst" in one_line(capsys)
    assert not (tmp_path / "a.yaml").exists()


@pytest.mark.parametrize("content", ["x[arcsec]\n1\n", "{}"])
def test_a_file_that_is_no_analysis_is_one_line(content, capsys, tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(content)
    assert main(["export", str(path), "-o", str(tmp_path / "imu.yaml")]) == 1
    assert str(path) in one_line(capsys)
