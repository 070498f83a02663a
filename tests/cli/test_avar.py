"""``sagnac avar``: the still bench."""

import re

import numpy as np
import pytest

from sagnac.cli import main
from tests.cli.examples import STATED, one_line, strict

pytestmark = pytest.mark.usefixtures("blank_figures")

GAPPED = ("--kind", "rate", "--unit", "deg/h", "--time", "t:s")


def test_avar_of_white_noise(bare, capsys):
    assert main(["avar", str(bare), *STATED, "--json"]) == 0
    made = strict(capsys.readouterr().out)
    # One deg/h at 100 Hz is N = 1/sqrt(100) deg/h/sqrt(Hz), a sixtieth of that in deg/sqrt(h).
    answer = made["angle_random_walk"]
    assert answer["value"] == pytest.approx(0.1 / 60.0, rel=0.05)
    assert answer["low"] < 0.1 / 60.0 < answer["high"]
    assert made["curve"]["tau_s"][0] == pytest.approx(0.01)
    assert made["curve"]["deviation_deg_per_h"][0] == pytest.approx(1.0, rel=0.05)
    assert made["settings"]["method"] == "none"


def test_avar_speaks_of_each_gyro(still, capsys, tmp_path):
    arguments = ["avar", str(still), "--gyros", "x,y"]
    triad = [*arguments[:-1], "x,y,z", "--self-noise", "0.1:50"]
    assert main([*triad, "--curve", "-o", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert "ARW of gyro x  " in shown
    assert "ARW of gyro y  " in shown
    assert "Self-noise from the cross spectra of 3 gyros, 0.1 to 50 Hz" in shown
    # One table of all at the end.
    assert [row.split()[0] for row in shown.splitlines()[-3:]] == ["x", "y", "z"]
    assert "oadev °/h" in shown
    assert "Verdict" not in shown  # no limit is stated
    written = {item.name for item in tmp_path.iterdir()}
    assert {"x", "y", "z", "report.html", "analysis.json", "self_noise.png"} <= written
    assert main([*arguments, "--json"]) == 0
    made = strict(capsys.readouterr().out)
    assert [item["channel"] for item in made["analyses"]] == ["x", "y"]


def test_avar_offers_the_family_and_the_spectrum(bare, capsys, tmp_path):
    arguments = ["avar", str(bare), *STATED, "--estimator", "mdev,tdev", "--estimator", "haar"]
    assert main([*arguments, "--json"]) == 0
    made = strict(capsys.readouterr().out)
    assert [curve["estimator"] for curve in made["curves"]] == ["mdev", "tdev", "haar"]
    assert made["curve"]["estimator"] == "oadev"  # what the coefficients rest on
    mdev, tdev, haar = made["curves"]
    tau = np.array(mdev["tau_s"])
    # tdev is tau mdev / sqrt(3), and an hour has as many seconds as a degree.
    assert np.array(tdev["deviation"]) == pytest.approx(
        np.array(mdev["deviation"]) * tau / np.sqrt(3.0)
    )
    oadev = dict(zip(made["curve"]["tau_s"], made["curve"]["deviation_deg_per_h"], strict=True))
    for at, deviation in list(zip(haar["tau_s"], haar["deviation"], strict=True))[:3]:
        assert deviation == pytest.approx(oadev[at] / np.sqrt(2.0))
    # White noise of 1 deg/h at 100 Hz: 2/100 (deg/h)^2/Hz, one-sided.
    density, frequency = (np.array(made["spectrum"][key]) for key in ("density", "frequency_hz"))
    assert np.average(density, weights=np.gradient(frequency)) == pytest.approx(0.02, rel=0.05)
    assert main([*arguments, "-o", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert all(heading in shown for heading in ("mdev °/h", "tdev ″", "haar °/h", "PSD"))
    assert "oadev °/h" not in shown
    assert {"family.csv", "psd.csv"} <= {item.name for item in (tmp_path / "x").iterdir()}


def test_avar_refuses_gaps_unless_told_to_omit_them(gapped, capsys):
    assert main(["avar", str(gapped), *GAPPED]) == 1
    assert "1.000 s" in one_line(capsys)
    assert main(["avar", str(gapped), *GAPPED, "--gaps", "omit", "--json"]) == 0
    made = strict(capsys.readouterr().out)
    assert made["input"]["samples"] == 4000
    notes = " ".join(made["notes"])
    assert "1 gap, 500 samples missing" in notes
    assert "503 of 4000 samples are missing" in notes
    assert "longest stretch without a gap, 11 to 35 s" in notes
    assert made["angle_random_walk"]["low"] < 0.1 / 60.0 < made["angle_random_walk"]["high"]
    assert "of 11 to 35 s" in made["angle_random_walk"]["source"]


@pytest.mark.parametrize("command", ["avar", "analyze"])
def test_one_gyro_of_two_with_a_missing_sample_is_not_passed(command, capsys, tmp_path):
    values = np.random.default_rng(3).standard_normal((3000, 2))
    values[700, 0] = np.nan
    path = tmp_path / "two.csv"
    np.savetxt(path, values, delimiter=",", header="x,y", comments="")
    judged = [command, str(path), *STATED, "--gyros", "x,y", "--spec", "0.01", "--json"]
    assert main(judged) == 4
    made = strict(capsys.readouterr().out)
    assert made["verdict"]["overall"] == "undecided"
    assert [one["channel"] for one in made.get("analyses", [made])] == ["y"]
    if command == "avar":
        assert main([*judged, "--gaps", "omit"]) == 0


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--estimator", "totdev"), "needs a whole record"),
        (("--method", "fos"), "lines cannot be removed across gaps"),
    ],
)
def test_what_gaps_do_not_allow_is_one_line(more, words, gapped, capsys):
    assert main(["avar", str(gapped), *GAPPED, "--gaps", "omit", *more]) == 1
    said = one_line(capsys)
    assert words in said
    assert str(gapped) in said


def test_avar_of_gaps_too_close_for_any_fit_still_has_a_curve(bare, capsys, tmp_path):
    rate = np.loadtxt(bare, skiprows=1)
    rate[::13] = np.nan
    path = tmp_path / "sieve.csv"
    path.write_text("x\n" + "\n".join(f"{value:.6f}" for value in rate) + "\n")
    folder = tmp_path / "out"
    assert main(["avar", str(path), *STATED, "--gaps", "omit", "--curve", "-o", str(folder)]) == 0
    shown = capsys.readouterr().out
    assert "not observable" in shown
    assert "oadev °/h" in shown
    assert "No periodic component" not in shown
    made = strict((folder / "x" / "analysis.json").read_text(encoding="utf-8"))
    assert made["curve"]["deviation_deg_per_h"][0] == pytest.approx(1.0, rel=0.05)
    assert made["estimates"] == {}


def test_avar_lists_lines_that_it_does_not_remove(capsys, tmp_path):
    path = tmp_path / "tone.csv"
    time_s = np.arange(6000) / 100.0
    noise = np.random.default_rng(8).normal(size=time_s.size)
    rate = noise + 0.5 * np.cos(2 * np.pi * 23.4 * time_s)
    path.write_text("x\n" + "\n".join(f"{value:.6f}" for value in rate) + "\n")
    assert main(["avar", str(path), *STATED, "--json"]) == 0
    made = strict(capsys.readouterr().out)
    assert [line["frequency_hz"] for line in made["lines"]] == [pytest.approx(23.4, abs=2e-3)]
    assert main(["avar", str(path), *STATED]) == 0
    shown = capsys.readouterr().out
    assert "With the lines below left in" in shown
    assert re.search(r"^23\.(4|39)\d* Hz", shown, re.MULTILINE)


def test_self_noise_of_three_gyros_that_turn_together(tmp_path, capsys):
    random = np.random.default_rng(4)
    shared, *alone = random.standard_normal((4, 3000)) * [[30.0], [1.0], [1.0], [2.0]]
    x, y, z = np.array(alone) + shared
    table = np.stack([x, y, z], axis=1)
    path = tmp_path / "three.csv"
    np.savetxt(path, table, delimiter=",", header="x,y,z", comments="", fmt="%.5f")
    stated = ["avar", str(path), "--kind", "rate", "--unit", "deg/h", "--rate", "10"]
    asked = [*stated, "--gyros", "x,y,z", "--method", "none", "--self-noise", "0.1:5"]
    assert main([*asked, "--json"]) == 0
    found = strict(capsys.readouterr().out)["self_noise"]["gyros"]
    for name, wanted in {"x": 1.0, "y": 1.0, "z": 2.0}.items():
        walk = found[name]["angle_random_walk"]
        # Of white samples N is their deviation over the root of 10 Hz, a sixtieth in deg/sqrt(h).
        assert walk["low"] < wanted / np.sqrt(10.0) / 60.0 < walk["high"]
        assert found[name]["gain"] == pytest.approx(1.0, abs=0.01)
    assert main([*stated, "--gyros", "x,y", "--self-noise", "0.1:5"]) == 2
    assert "give 3 or more" in one_line(capsys)
    assert main([*stated, "--self-noise", "5:0.1"]) == 2
    assert "give LOW:HIGH in Hz" in one_line(capsys)
