"""A rack against limits: exit status, words, page, and a row for every gyro."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import sagnac
from sagnac.cli import main
from tests.fleet.commands import rows_of
from tests.fleet.conftest import WALK

pytestmark = pytest.mark.usefixtures("in_this_process", "blank_figures")

# N of the units is 1e-3 deg/sqrt(h); z of each is stuck.
RATE, SAMPLES = 50.0, 6000


@pytest.fixture(scope="module")
def rack(tmp_path_factory):
    """Three units of two gyros each, the second twice as loud, and of one a third that is stuck."""
    place = tmp_path_factory.mktemp("rack")
    for number in range(3):
        noise = np.random.default_rng(number).standard_normal((2, SAMPLES))
        rates = WALK * np.sqrt(RATE) * noise * [[1.0], [2.0]]
        more = {"z": np.zeros(SAMPLES)} if number == 2 else {}
        recording = sagnac.Recording.from_arrays(
            x=rates[0], y=rates[1], **more, kind="rate", unit="rad/s", sample_rate=RATE
        )
        sagnac.write(recording, place / f"U{number}.parquet")
    return place


@pytest.mark.parametrize(
    ("limit", "status", "said"),
    [
        # In the unit that data sheets of MEMS units have: 1e-3 deg/sqrt(h) is a sixtieth of it.
        ("5e-5 deg/s/sqrt(Hz)", 4, "4 pass, 0 fail, 1 undecided"),
        ("1.5e-3 deg/sqrt(h)", 3, "2 pass, 2 fail, 1 undecided"),
    ],
)
def test_status_words_and_page_are_those_of_the_verdict(  # noqa: PLR0917
    rack, tmp_path, capsys, limit, status, said
):
    files = [str(rack / f"U{number}.parquet") for number in (1, 2)]
    words = ["campaign", *files, "-o", str(tmp_path), "--workers", "1", "--spec", limit]
    assert main(words) == status
    shown = capsys.readouterr().out
    assert said in shown
    page = (tmp_path / "index.html").read_text()
    assert said in page
    assert re.search(r"[Yy]ield \d+ % \(\d+ to \d+ %\)", page)
    # The line of the limit is in the chart of each gyro that has one.
    assert page.count("and its limit.") == 2
    found = rows_of(tmp_path)
    assert [row["gyros"] for row in found] == ["x", "y", "x", "y", "z"]
    decisions = [row["verdict"] for row in found[:4]]
    passed, failed, _ = map(int, re.findall(r"\d+", said))
    assert (decisions.count("pass"), decisions.count("fail")) == (passed, failed)
    assert (found[4]["state"], found[4]["verdict"]) == ("failed", "undecided")
    assert "stuck" in found[4]["reason"]
    assert "U2.parquet, gyro z: undecided: " in shown
    # A row that passes has no reason; each other one says why, in the table, here and on the page.
    for row in found[:4]:
        why = "" if row["verdict"] == "pass" else "N: the interval lies above the limit"
        assert row["reason"] == why
        of_row = f"{Path(row['file']).name}, gyro {row['gyros']}: fail: {why}"
        assert (of_row in shown) == bool(why)
    assert page.count("N: the interval lies above the limit") == failed
    assert "2 rows analyzed now\n" in shown
    assert (tmp_path / "campaign.png").read_bytes().startswith(b"\x89PNG")


def test_a_rack_that_keeps_its_limit_ends_with_zero(rack, tmp_path, capsys):
    files = [str(rack / f"U{number}.parquet") for number in (0, 1)]
    # A copy in another folder and format is no third unit.
    copied = tmp_path / "again.csv"
    assert main(["convert", files[0], str(copied)]) == 0
    words = ["campaign", *files, str(copied), "-o", str(tmp_path / "kept"), "--workers", "1"]
    assert main([*words, "--spec", "1e-2"]) == 0
    assert (
        "4 pass, 0 fail, 0 undecided; 2 of 2 units pass, yield 100 % (16 to 100 %)"
        in capsys.readouterr().out
    )
    # Without a limit nothing is said of one.
    other = tmp_path / "other"
    words = ["campaign", files[0], "--gyros", "x", "-o", str(other), "--workers", "1"]
    assert main(words) == 0
    assert "yield" not in capsys.readouterr().out
    # The rows that the table has, and nothing else.
    assert main([*words, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "sagnac.campaign/1"
    for row, line in zip(document["rows"], rows_of(other), strict=True):
        texts = {key: "" if value is None else str(value) for key, value in row.items()}
        assert texts == line
    assert document["scatter"][0]["why"].startswith("1 run cannot tell")
    assert "limit" not in (other / "index.html").read_text()


def test_a_gyro_without_an_answer_is_named_and_the_scatter_of_the_others_is_in_the_json(
    rack, tmp_path, capsys
):
    words = ["campaign", str(rack), "-o", str(tmp_path), "--workers", "1"]
    assert main(words) == 0
    assert re.search("U2.parquet, gyro z: failed: .*stuck", capsys.readouterr().out)
    assert main([*words, "--json"]) == 0
    of_x, of_y = json.loads(capsys.readouterr().out)["scatter"]
    assert [of_x["gyros"], of_y["gyros"], len(of_x["files"]), of_x["runs"]] == ["x", "y", 3, 3]
    walk, run = of_x["mean"], of_x["deviations"]["run"]
    assert walk["low"] < 1e-3 < walk["high"]
    assert walk["value"] == pytest.approx(1e-3, rel=0.1)
    assert run["low"] <= run["value"] <= run["high"]


def test_a_unit_that_cannot_be_measured_counts_in_the_yield(rack, tmp_path, capsys):
    dead, copied = tmp_path / "dead.csv", tmp_path / "copied.csv"
    for path in (dead, copied):
        path.write_text("x[rad/s],y[rad/s]\n" + "0.25,0.5\n" * 500)
    words = [str(rack / "U0.parquet"), str(dead), str(copied)]
    words += ["--kind", "rate", "--rate", "50", "--workers", "1"]
    output = tmp_path / "judged"
    assert main(["campaign", *words, "-o", str(output), "--spec", "1e-2"]) == 1
    said = (
        "2 pass, 0 fail, 0 undecided",
        "1 of 2 units pass, 1 in part or not measured, yield 50 % (1 to 99 %)",
    )
    shown = capsys.readouterr().out
    page = (output / "index.html").read_text()
    assert all(one in text for one in said for text in (shown, page))
    assert 'class="verdict undecided"' in page
    # Beside its verdict; what is wrong with it stands once, at the head of the page.
    assert page.count("not measured</span>") == 2
    verdicts = [(row["state"], row["verdict"]) for row in rows_of(output)]
    assert verdicts == [("done", "pass")] * 2 + [("failed", "undecided")] * 2
    # Beside units of a pattern a file of none, which cannot be read, is no unit; one of a unit is.
    for pattern, share in (
        ("U[0-9]", "1 of 1 unit pass, "),
        ("U[0-9]|dead", "1 of 2 units pass, "),
    ):
        judged = ["campaign", *words, "--pattern", f"(?P<unit>{pattern})", "--spec", "1e-2"]
        assert main([*judged, "-o", str(output)]) == 1
        assert f"0 undecided; {share}" in capsys.readouterr().out
    # If nothing is to be kept, nothing is decided.
    assert main(["campaign", *words[1:], "-o", str(tmp_path / "plain")]) == 1
    assert {row["verdict"] for row in rows_of(tmp_path / "plain")} == {""}


def test_nothing_is_said_to_be_kept_at_the_first_start(rack, tmp_path, capsys):
    folder = tmp_path / "some"
    folder.mkdir()
    for name in ("A", "A_1"):
        (folder / f"{name}.parquet").write_bytes((rack / "U0.parquet").read_bytes())
    words = ["campaign", str(folder), "--gyros", "x", "-o", str(tmp_path / "out")]
    words += ["--workers", "1"]
    assert main(words) == 0
    shown = capsys.readouterr().out
    assert "1 row analyzed now\n" in shown
    assert {row["report"].partition("-")[0] for row in rows_of(tmp_path / "out")} == {"reports/A"}
    assert main(words) == 0
    assert "0 rows analyzed now, 1 kept from an earlier start" in capsys.readouterr().out


def test_the_limit_may_stand_in_the_campaign_s_own_file(rack, tmp_path, capsys):
    (tmp_path / "rack.toml").write_text(
        f'files = "{rack / "U0.parquet"}"\nspec = "limits.toml"\nrisk = 0.1\n'
    )
    (tmp_path / "limits.toml").write_text('[limits]\nN = "1.5e-3 deg/sqrt(h)"\n')
    words = ["campaign", str(tmp_path / "rack.toml"), "-o", str(tmp_path / "out")]
    assert main([*words, "--workers", "1"]) == 3
    assert "1 pass, 1 fail" in capsys.readouterr().out
    assert {row["confidence"] for row in rows_of(tmp_path / "out")} == {"0.9"}
    (tmp_path / "rack.toml").write_text(f'files = "{rack / "U0.parquet"}"\nspec = 3\n')
    assert main([*words, "--workers", "1"]) == 1
    assert "spec is 3" in capsys.readouterr().err


def test_one_page_is_the_certificate_of_all_axes_of_a_unit(rack, tmp_path):
    words = ["analyze", str(rack / "U0.parquet"), "-o", str(tmp_path), "--serial", "17"]
    assert main([*words, "--spec", "1.5e-3"]) == 3
    page = (tmp_path / "report.html").read_text()
    assert "<dd>17</dd>" in page
    assert "FAIL" in page
    assert page.count("N ≤ 0.0015 °/√h") == 2
    assert 'href="x/report.html"' in page
    assert (tmp_path / "y" / "report.html").is_file()


def test_the_terminal_names_a_dead_accelerometer_and_a_copy_within_a_file(tmp_path, capsys):
    """No row is of an accelerometer; the sound unit of the same rack is not named."""
    for seed, name in enumerate(("copy", "dead", "in_g", "sound")):
        noise = np.random.default_rng(seed).standard_normal((5, SAMPLES))
        forces = 1e-3 * noise[2:] + np.array([[0.0], [0.0], [1.0 if name == "in_g" else 9.81]])
        recording = sagnac.Recording.from_arrays(
            x=WALK * np.sqrt(RATE) * noise[0],
            y=WALK * np.sqrt(RATE) * noise[0 if name == "copy" else 1],
            ax=forces[0],
            ay=np.full(SAMPLES, 0.1) if name == "dead" else forces[1],
            az=forces[2],
            kind="rate",
            unit={"x": "rad/s", "y": "rad/s", **dict.fromkeys(("ax", "ay", "az"), "m/s^2")},
            sample_rate=RATE,
        )
        sagnac.write(recording, tmp_path / f"{name}.parquet")
    words = ["--accelerometers", "ax,ay,az", "-o", str(tmp_path / "done"), "--workers", "1"]
    assert main(["campaign", str(tmp_path), *words]) == 0
    before_files, _, _ = capsys.readouterr().out.partition("wrote")
    told = [line for line in before_files.splitlines() if ".parquet" in line]
    # A copy within a file is named once, and not as the copy of its own file.
    copy, dead, in_g = told
    assert copy.endswith(
        "copy.parquet: gyro y: has the data of another gyro of it, and does not count"
    )
    assert dead.startswith("dead.parquet, ay: error: is stuck: every sample is the same;")
    assert in_g.startswith("in_g.parquet, ax, ay, az: warning:")
    assert "gravity" in in_g
    # The folder was made of four files, and now of one: the table of the others is replaced.
    assert main(["campaign", str(tmp_path / "sound.parquet"), *words]) == 0
    assert ".parquet" not in capsys.readouterr().out.partition("wrote")[0]
