"""``sagnac export``: from a recording to ``imu.yaml`` in two commands."""

import json

import numpy as np
import pytest
import yaml

import sagnac
from sagnac.cli import main
from sagnac.report.document import analysis_document, to_json
from tests.cli.examples import STATED, one_line
from tests.navigation.examples import changed, document, keys

pytestmark = pytest.mark.usefixtures("blank_figures")


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
    said = one_line(capsys)
    assert "--format is not stated, and " in said
    assert "a.txt does not tell it; state it, or name a path that ends in .yaml, " in said
    assert main(["export", stated, "-o", str(tmp_path / "a.yaml"), "--axes", "each"]) == 1
    assert "--axes worst" in one_line(capsys)
    assert not (tmp_path / "a.yaml").exists()


@pytest.mark.parametrize("content", ["x[arcsec]\n1\n", "{}"])
def test_a_file_that_is_no_analysis_is_one_line(content, capsys, tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(content)
    assert main(["export", str(path), "-o", str(tmp_path / "imu.yaml")]) == 1
    assert str(path) in one_line(capsys)


WHITE, FORCE = 2e-5, 3e-4  # rad/sqrt(s) and m/s/sqrt(s), times 1, 2 and 3 for the axes


@pytest.fixture(scope="module")
def unit(tmp_path_factory):
    """A folder with the analysis of three gyros and three accelerometers."""
    noise = np.sqrt(50.0) * np.random.default_rng(31).normal(size=(6, 12_000))
    noise *= np.outer([WHITE, FORCE], [1.0, 2.0, 3.0]).reshape(6, 1)
    noise[5] += 9.80665
    names = ("x", "y", "z", "ax", "ay", "az")
    recording = sagnac.Recording.from_arrays(
        **dict(zip(names, noise, strict=True)),
        kind="rate",
        unit={name: "m/s^2" if "a" in name else "rad/s" for name in names},
        sample_rate=50.0,
    )
    folder = tmp_path_factory.mktemp("unit")
    made = to_json(analysis_document(sagnac.analyze(recording)))
    (folder / "analysis.json").write_text(made, encoding="utf-8")
    return folder


def test_accelerometers_of_the_same_analysis_go_with_the_gyros(unit, capsys, tmp_path):
    path = tmp_path / "imu.yaml"
    assert main(["export", str(unit), "-o", str(path)]) == 0
    assert "ax: N" not in capsys.readouterr().out  # the worst alone
    read = keys(path.read_text(encoding="utf-8"))
    assert 3 * WHITE <= float(read["gyroscope_noise_density"]) < 3 * WHITE * 1.3
    assert 3 * FORCE <= float(read["accelerometer_noise_density"]) < 3 * FORCE * 1.3
    assert float(read["accelerometer_random_walk"]) > 0.0
    # The file itself is the same as its folder.
    again = tmp_path / "again.yaml"
    assert main(["export", str(unit / "analysis.json"), "-o", str(again)]) == 0
    assert keys(again.read_text(encoding="utf-8")) == read


def test_each_axis_has_its_own_where_the_tool_has_axes(unit, tmp_path):
    path = tmp_path / "kf-gins.yaml"
    assert main(["export", str(unit), "--format", "kf-gins", "-o", str(path)]) == 0
    noise = yaml.safe_load(path.read_text(encoding="utf-8"))["imunoise"]
    for axis in range(3):
        white = np.deg2rad(noise["arw"][axis]) / 60.0
        # Four minutes leave a fifth open.
        assert (axis + 1) * WHITE <= white < (axis + 1) * WHITE * 1.3
        assert (axis + 1) * FORCE <= noise["vrw"][axis] / 60.0 < (axis + 1) * FORCE * 1.3
    path = tmp_path / "all.json"
    assert main(["export", str(unit), "-o", str(path)]) == 0
    made = json.loads(path.read_text(encoding="utf-8"))
    assert list(made["sensors"]) == ["x", "y", "z"]
    assert list(made["accelerometers"]) == ["ax", "ay", "az"]
    assert "velocity_random_walk" in made["accelerometers"]["az"]["covariance"]["names"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--format", "gtsam", "--rate", "100"], "takes the time step itself"),
        (["--format", "px4", "--topic", "/imu0"], "names no topic"),
        (["--format", "kalibr", "--markov", "1"], "its bias is a random walk"),
        (["--format", "imu-tools", "--accelerometer", "1e-3,1e-4"], "weighs the gyro alone"),
        (
            ["--format", "px4", "--accelerometer", "1e-3,1e-4"],
            "another noise of the accelerometers",
        ),
        (["--format", "px4", "--datasheet", "N=1deg/sqrt(h)"], "N and B are needed"),
    ],
)
def test_an_option_that_cannot_be_used_is_refused_with_the_reason(
    unit, words, said, capsys, tmp_path
):
    path = tmp_path / "out"
    assert main(["export", str(unit), *words, "-o", str(path)]) == 2
    assert said in one_line(capsys)
    assert not path.exists()


def test_a_data_sheet_alone(capsys, tmp_path):
    path = tmp_path / "imu.yaml"
    words = ["export", "--datasheet", "N=0.15deg/sqrt(h),B=3deg/h@100s", "-o", str(path)]
    assert main(words) == 0
    text = path.read_text(encoding="utf-8")
    assert "# update_rate:  # Hz: no recording states it" in text
    assert "discrete" not in text
    assert main([*words, "--rate", "200"]) == 0
    assert "stated, not measured" in capsys.readouterr().out
    text = path.read_text(encoding="utf-8")
    assert "\nupdate_rate: 200  # Hz" in text
    assert "accelerometer_noise_density:  #" in text
    # What a discrete form needs is asked for.
    assert main([*words[:-1], str(tmp_path / "imu.json")]) == 1
    assert "--rate" in one_line(capsys)
    assert main(["export", "-o", str(tmp_path / "b.yaml")]) == 2
    assert "--datasheet" in one_line(capsys)


def test_the_folder_of_the_file_is_made(tmp_path):
    path = document(tmp_path, gyros=("x",))
    assert main(["export", str(path), "-o", str(tmp_path / "new" / "one" / "imu.yaml")]) == 0
    assert (tmp_path / "new" / "one" / "imu.yaml").read_text(encoding="utf-8")


def test_an_empty_folder_is_one_line(capsys, tmp_path):
    assert main(["export", str(tmp_path), "-o", str(tmp_path / "imu.yaml")]) == 1
    assert "holds no analysis.json" in one_line(capsys)


def test_a_campaign_is_covered_by_the_worst_of_each_axis(tmp_path):
    for name, factor in (("first", 1.0), ("second", 3.0)):
        folder = tmp_path / "reports" / name
        folder.mkdir(parents=True)
        path = document(folder, gyros=("x",))
        stated = json.loads(path.read_text(encoding="utf-8"))
        for key in ("deviation_deg_per_h", "low", "high"):
            stated["curve"][key] = [factor * value for value in stated["curve"][key]]
        changed(path, curve=stated["curve"])
    both, one = tmp_path / "both.json", tmp_path / "one.json"
    assert main(["export", str(tmp_path), "-o", str(both)]) == 0
    worst = str(tmp_path / "reports" / "second" / "analysis.json")
    assert main(["export", worst, "-o", str(one)]) == 0
    made, alone = (json.loads(path.read_text(encoding="utf-8")) for path in (both, one))
    # The units have one axis of one name, and the louder one is above the other everywhere.
    assert list(made["sensors"]) == ["x"]
    simple, other = (each["sensors"]["x"]["simple"]["continuous"] for each in (made, alone))
    assert simple == other
    full = made["sensors"]["x"]["full"]["continuous"]["white_rad_per_s_per_sqrt_hz"]
    alone_full = alone["sensors"]["x"]["full"]["continuous"]["white_rad_per_s_per_sqrt_hz"]
    assert full == pytest.approx(alone_full, rel=1e-6)


def test_a_lot_names_the_recording_of_each_warning_and_of_n_and_k(tmp_path):
    """The first is the louder one at short times, the second at long ones, and settles."""
    found = {"level": "warning", "channel": "x", "name": "spikes", "effect": None}
    found["text"] = "has spikes"
    settles = found | {"level": "remark", "name": "warm-up", "text": "settles"}
    steady = found | {"level": "remark", "name": "steady", "text": "is steady"}
    for number, findings in enumerate(([found, steady], [settles])):
        folder = tmp_path / "reports" / f"U{number}"
        folder.mkdir(parents=True)
        path = document(folder, gyros=("x",))
        stated = json.loads(path.read_text(encoding="utf-8"))
        tau = np.array(stated["curve"]["tau_s"])
        rise = np.hypot(1.0, tau / 10.0) if number else np.full(tau.size, 3.0)
        for key in ("deviation_deg_per_h", "low", "high"):
            stated["curve"][key] = (rise * stated["curve"][key]).tolist()
        where = stated["input"] | {"path": f"rack/U{number}.csv", "sha256": "ab"}
        changed(path, curve=stated["curve"], input=where, findings=findings)
    lot, one = (
        sagnac.export(tmp_path / "reports" / name, tool="kalibr").text for name in ("", "U1")
    )
    assert "From rack/U0.csv, SHA-256 ab (N); rack/U1.csv, SHA-256 ab (K)" in lot
    assert "Warning: rack/U0.csv: x: has spikes" in lot
    assert "Warning: rack/U1.csv: x: settles" in lot
    assert "steady" not in lot
    # One alone needs no name at each line.
    assert "# From rack/U1.csv, SHA-256 ab\n" in one
    assert "Warning: x: settles" in one


@pytest.mark.parametrize("warms", [True, False])
def test_a_warm_up_that_raises_the_walk_is_said_with_the_settings(warms, tmp_path):
    """The answer is without it, the curve is not: twenty minutes that settle by 500 deg/h."""
    time = np.arange(24_000) / 20.0
    rate = 9.0 * np.sqrt(20.0) * np.random.default_rng(6).standard_normal(time.size)
    rate -= 500.0 * warms * np.exp(-time / 300.0)
    still = sagnac.Recording.from_arrays(x=rate, kind="rate", unit="deg/h", sample_rate=20.0)
    text = sagnac.export(sagnac.analyze(still), tool="kalibr").text
    assert ("Warning: x: the rate settles by" in text) is warms
    walk = float(keys(text)["gyroscope_random_walk"])
    # In rad/s^2/sqrt(Hz); nothing walks here.
    assert bool(walk > np.radians(100.0 / 3600.0 / 60.0)) is warms


@pytest.mark.parametrize(("command", "hum"), [("avar", True), ("avar", False), ("analyze", True)])
def test_an_n_that_lines_inflate_names_them_and_the_command_that_removes_them(
    command, hum, capsys, tmp_path
):
    # 1e-4 rad/s beside white noise of 1e-5 rad/s a sample; ten minutes of 20 Hz.
    time = np.arange(12_000) / 20.0
    rate = 1e-5 * np.random.default_rng(3).standard_normal(time.size)
    rate += hum * 1e-4 * np.sin(2.0 * np.pi * 4.3137 * time)
    recording = tmp_path / "still.csv"
    np.savetxt(recording, rate, fmt="%.9e", header="x[rad/s]", comments="")
    how = ["--kind", "rate", "--rate", "20", "-o", str(tmp_path / "still")]
    assert main([command, str(recording), *how]) == 0
    capsys.readouterr()
    assert main(["export", str(tmp_path / "still"), "-o", str(tmp_path / "imu.yaml")]) == 0
    shown = capsys.readouterr().out
    said = "lines, vibration or readout are in its curve; `sagnac analyze` removes lines"
    assert (said in shown) == (hum and command == "avar")
    assert ("times the estimate" in shown) == (hum and command == "avar")
    settings = sagnac.export(tmp_path / "still", tool="toml").settings
    # N of the truth is 1e-5 rad/s over the root of 20 Hz.
    assert (settings[0].simple.white > 3.0 * 1e-5 / np.sqrt(20.0)) == (hum and command == "avar")


def test_an_n_that_is_inflated_without_lines_has_another_reason(tmp_path):
    path = document(tmp_path, gyros=("x",), method="fos")
    curve = json.loads(path.read_text(encoding="utf-8"))["curve"]
    louder = [5.0 * value for value in curve["deviation_deg_per_h"]]
    changed(path, curve={**curve, "deviation_deg_per_h": louder})
    (note,) = (one for one in sagnac.export(path, tool="toml").notes if "estimate" in one.text)
    assert "a readout, vibration or other noise that N does not describe is in its" in note.text
    assert note.text.endswith("a longer interval leaves the shortest times out")


def test_a_longer_interval_leaves_the_steps_of_a_readout_out_of_the_white_noise():
    random = np.random.default_rng(4)
    angle = np.cumsum(1e-7 * random.standard_normal(60_000)) + 2e-6 * random.standard_normal(60_000)
    still = sagnac.Recording.from_arrays(x=angle, kind="angle", unit="rad", sample_rate=100.0)
    for interval, least, most in ((None, 20.0, 40.0), (10.0, 1.0, 2.0)):
        made = sagnac.export(sagnac.analyze(still, interval=interval), tool="kalibr")
        assert least < made.settings[0].excess < most
        assert ("leaves the shortest times out" in made.text) == (interval is None)
