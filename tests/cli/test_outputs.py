"""What a command writes over: its own earlier output, and nothing else unless told so."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import sagnac
from sagnac.cli import main
from sagnac.core.documents import check_analysis
from sagnac.core.overwriting import kind_of
from sagnac.formats import read
from sagnac.report import page
from tests.cli.examples import STATED, one_line, one_line_among

pytestmark = pytest.mark.usefixtures("blank_figures")

SIMULATED = ("--duration", "20", "--table-rate", "0", "--preset", "quiet")
MINE = "what somebody measured for a week\n"


@pytest.fixture
def place(bare, tmp_path, monkeypatch) -> Path:
    """A folder with a recording of nobody's."""
    shutil.copy(bare, tmp_path / "in.csv")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="session")
def analysis(still, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("analysis")
    words = ["analyze", str(still), "--gyros", "x", "--method", "none", "-o"]
    assert main([*words, str(folder / "out")]) == 0
    return folder / "out" / "analysis.json"


def analyze(gyros: str) -> list[str]:
    return ["analyze", "still.parquet", "--gyros", gyros, "--method", "none", "-o", "."]


# What is run in a folder, and the files that it would write over.
RUNS = {
    "analyze": (analyze("x"), ["analysis.json"]),
    "avar": (["avar", "still.parquet", "--gyros", "x", "-o", "."], ["x/settings.toml"]),
    "compare": (
        ["compare", "still.parquet", "--gyros", "x", "--method", "none", "-o", "."],
        ["comparison.png"],
    ),
    "simulate": (["simulate", "-o", "made.csv", *SIMULATED], ["made.csv"]),
    "simulate truth": (["simulate", "-o", "made.npz", *SIMULATED], ["made.npz.truth.json"]),
    "convert": (["convert", "still.parquet", "made.npz"], ["made.npz"]),
    "convert toml": (["convert", "still.parquet", "made.csv"], ["made.csv.toml"]),
    "export": (["export", "analysis.json", "-o", "imu.yaml"], ["imu.yaml"]),
    "export json": (["export", "analysis.json", "-o", "filter.json"], ["filter.json"]),
    "align": (["align", "analysis.json", "--latitude", "32", "-o", "."], ["alignment.json"]),
    "campaign": (
        ["campaign", "still.parquet", "--gyros", "x", "--method", "none", "-o", "."],
        ["campaign.csv"],
    ),
}


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("name", RUNS)
def test_only_what_the_same_run_made_is_written_over(name, analysis, still, place, capsys):
    words, files = RUNS[name]
    shutil.copy(still, "still.parquet")
    if "analysis.json" in words:
        shutil.copy(analysis, "analysis.json")
    for file in files:
        Path(file).parent.mkdir(exist_ok=True)
        Path(file).write_text(MINE)
    before = set(place.rglob("*"))
    assert main(words) == 2
    said = one_line_among(capsys.readouterr().err)
    assert files[0] in said
    assert "--force" in said
    assert set(place.rglob("*")) == before
    assert all(Path(file).read_text() == MINE for file in files)
    assert main([*words, "--force"]) == 0
    assert all(Path(file).read_bytes() != MINE.encode() for file in files)
    # Once made, it may be made again.
    assert main(words) == 0
    assert all(Path(file).exists() for file in files)


# What Python writes, and the file that is there.
DOOR = {
    "write": (lambda one, **how: sagnac.write(one.recording, "made.npz", **how), "made.npz"),
    "write toml": (
        lambda one, **how: sagnac.write(one.recording, "made.csv", **how),
        "made.csv.toml",
    ),
    "to_json": (lambda one, **how: one.to_json("my.json", **how), "my.json"),
    "export": (lambda one, **how: sagnac.export(one, "imu.yaml", **how), "imu.yaml"),
    "write_report": (lambda one, **how: sagnac.write_report(one, "out", **how), "out/psd.csv"),
    "write_report of a gyro": (
        lambda one, **how: sagnac.write_report(one, "out", **how),
        "out/x/stability.csv",
    ),
    "campaign": (
        lambda one, **how: sagnac.campaign(one.recording.provenance.path, "out", **how),
        "out/index.html",
    ),
}
LONG = ("write_report", "write_report of a gyro", "campaign")


@pytest.fixture(scope="module")
def analyzed(still) -> sagnac.Analysis:
    return sagnac.analyze(sagnac.read(still), method="none")


@pytest.mark.parametrize("name", DOOR)
def test_python_writes_over_its_own_and_nothing_else_unless_told_so(name, analyzed, place):
    made, file = DOOR[name]
    Path(file).parent.mkdir(parents=True, exist_ok=True)
    Path(file).write_text(MINE)
    with pytest.raises(sagnac.RecordingError, match=rf"{file}: .* state force to write over it"):
        made(analyzed)
    assert Path(file).read_text() == MINE
    if name not in LONG:
        made(analyzed, force=True)
        made(analyzed)


@pytest.mark.parametrize(
    ("words", "lost"),
    [
        (["export", "analysis.json", "-o", "analysis.json"], "analysis.json"),
        (["export", "analysis.json", "--format", "toml", "-o", "analysis.json"], "analysis.json"),
        (["export", "analysis.json", "-o", "other.json"], "other.json"),
        (["simulate", *SIMULATED, "-o", "in.csv"], "in.csv"),
        (["simulate", "rig.npz", "-o", "rig.npz"], "rig.npz"),
        (["convert", "in.csv", *STATED, "in.csv"], "in.csv"),
        (["convert", "in.csv", *STATED, "link.csv"], "link.csv"),
        (["convert", "in.csv", *STATED, "simulated.npz"], "simulated.npz"),
    ],
)
def test_what_is_read_or_made_by_another_run_stays(words, lost, analysis, place, capsys):
    shutil.copy(analysis, "analysis.json")
    shutil.copy(analysis, "other.json")
    Path("rig.npz").write_text('preset = "quiet"\n')
    Path("link.csv").symlink_to("in.csv")
    assert main(["simulate", *SIMULATED, "-o", "simulated.npz"]) == 0
    capsys.readouterr()
    before = {path.name: path.read_bytes() for path in place.iterdir()}
    assert main(words) == 2
    assert lost in one_line_among(capsys.readouterr().err)
    assert {path.name: path.read_bytes() for path in place.iterdir()} == before


@pytest.mark.parametrize("suffix", ["csv", "tsv", "parquet", "feather", "h5", "npz", "mat"])
def test_a_recording_says_who_made_it_and_is_read_as_before(suffix, place):
    made = Path(f"made.{suffix}")
    for _ in range(2):
        assert main(["convert", "in.csv", str(made), *STATED]) == 0
    said = made.with_name(f"{made.name}.toml") if suffix in ("csv", "tsv") else made
    assert kind_of(said) == "recording"
    expected = read("in.csv", kind="rate", unit="deg/h", sample_rate=100.0).gyros[0].values
    np.testing.assert_allclose(read(made).gyros[0].values, expected, rtol=1e-12)


def test_a_toml_of_another_recording_is_not_believed_in_silence(place, capsys):
    """It would make the numbers 5e4 times too small."""
    Path("out.parquet.toml").write_text('kind = "rate"\nunit = "rad/s"\nsample_rate = 10.0\n')
    assert main(["convert", "in.csv", "out.parquet", *STATED]) == 1
    assert "a TOML beside it states" in one_line(capsys)
    assert not Path("out.parquet").exists()
    assert main(["simulate", *SIMULATED, "-o", "out.parquet"]) == 1
    assert "a TOML beside it states" in one_line(capsys)
    Path("out.parquet.toml").rename("aside")
    assert main(["convert", "in.csv", "out.parquet", *STATED]) == 0
    sound = read("out.parquet")
    assert not [note for note in sound.notes if note.level == "warning"]
    Path("aside").rename("out.parquet.toml")
    warned = {str(note) for note in read("out.parquet").notes if note.level == "warning"}
    assert warned == {
        "x: the file says deg/h and the TOML beside it rad/s, which is taken; remove the TOML if "
        "it is of another recording",
        "time: the file says 100 Hz and the TOML beside it 10 Hz, which is taken; remove the TOML "
        "if it is of another recording",
    }


def test_a_kind_that_file_and_toml_disagree_on_is_told(place):
    assert main(["convert", "in.csv", "out.parquet", *STATED]) == 0
    Path("out.parquet.toml").write_text('kind = "increment"\nunit = "arcsec"\n')
    warned = [str(note) for note in read("out.parquet").notes if note.level == "warning"]
    assert any("the file says rate and the TOML beside it increment" in said for said in warned)


def test_a_document_is_known_by_its_schema_and_a_page_by_its_generator(analysis, tmp_path):
    assert kind_of(analysis) == "analysis"
    assert kind_of(analysis.with_name("report.html")) == "page"
    assert kind_of(tmp_path / "nothing.json") == ""
    other = tmp_path / "other.json"
    other.write_text(json.dumps({"note": '"schema": "sagnac.analysis/1"'}))
    assert kind_of(other) == ""


@pytest.mark.parametrize("words", [["--method", "none"], ["--estimator", "mdev", "--curve"]])
def test_what_the_commands_print_keeps_the_schema(words, still, capsys):
    command = "avar" if "--estimator" in words else "analyze"
    assert main([command, str(still), "--json", "--spec", "3e-4deg/sqrt(h)", *words]) in (0, 3, 4)
    found = json.loads(capsys.readouterr().out)
    for one in found.get("analyses", [found]):
        check_analysis(one)


@pytest.mark.parametrize("words", [["avar"], ["analyze", "--json"]], ids=["avar", "analyze --json"])
def test_what_is_stated_of_a_report_needs_one(words, still, capsys):
    command = [words[0], str(still), *words[1:]]
    for stated in (["--pdf"], ["--serial", "7"], ["--heading", "top.toml"]):
        assert main([*command, *stated]) == 2
        assert f"{stated[0]} is of a report; name its folder with -o" in one_line(capsys)


def test_what_is_no_folder_is_named_once(still, place, capsys):
    Path("out").write_text(MINE)
    command = ["analyze", str(still), "--gyros", "x", "-o"]
    assert main([*command, "out"]) == 1
    assert one_line(capsys) == "sagnac: out: is no folder; choose another folder (-o)\n"
    assert main([*command, "out/deeper"]) == 1
    above = f"sagnac: out/deeper: {place / 'out'} is no folder; choose another folder (-o)\n"
    assert one_line(capsys) == above
    assert Path("out").read_text() == MINE


def test_a_report_leaves_nothing_of_the_unit_before(still, place):
    words = ["--method", "none", "-o", "out"]
    assert main(["analyze", str(still), *words]) == 0
    Path("out/report.pdf").write_bytes(b"%PDF of the unit before")
    Path("out/y/report.pdf").write_bytes(b"%PDF of the unit before")
    for kept in ("out/mine.txt", "out/z/mine.txt"):
        Path(kept).write_text(MINE)
    assert main(["analyze", str(still), "--gyros", "x", *words]) == 0
    found = {str(path.relative_to("out")) for path in Path("out").rglob("*") if path.is_file()}
    names = "report.html analysis.json settings.toml stability.csv lines.csv stability.png"
    assert found == {*names.split(), "spectrum.png", "parts.png", "mine.txt", "z/mine.txt"}
    assert not Path("out/y").exists()


def test_a_report_leaves_what_another_run_wrote_since(still, place):
    words = ["--method", "none", "-o", "out"]
    assert main(["analyze", str(still), *words]) == 0
    assert main(["avar", str(still), "--gyros", "y", "-o", "out"]) == 0
    assert main(["analyze", str(still), "--gyros", "x", *words]) == 0
    assert Path("out/y/report.html").exists()
    assert not Path("out/z").exists()


def test_reports_that_are_written_at_the_same_time_do_not_mix(still, place, monkeypatch):
    """The first ends while the second is written: nothing of it stands beside the second."""
    recording = read(still)
    first = sagnac.analyze(recording, method="none")
    second = sagnac.analyze(recording, gyros=("x",), method="none")
    write = page._write

    def while_another_ends(*given, **how):
        monkeypatch.setattr(page, "_write", write)
        sagnac.write_report(first, "out")
        assert Path("out/y/report.html").exists()
        Path("out/z/mine.txt").write_text(MINE)
        return write(*given, **how)

    monkeypatch.setattr(page, "_write", while_another_ends)
    sagnac.write_report(second, "out")
    assert not Path("out/y").exists()
    assert [path.name for path in Path("out/z").iterdir()] == ["mine.txt"]
    assert json.loads(Path("out/analysis.json").read_text())["input"]["gyros"] == ["x"]


def test_an_alignment_leaves_no_figure_of_the_unit_before(analysis, place):
    words = ["align", str(analysis), "-o", "out"]
    assert main([*words, "--latitude", "32"]) == 0
    assert {path.name for path in Path("out").iterdir()} == {
        "alignment.json", "alignment.png", "drift.png",
    }  # fmt: skip
    assert main(words) == 0
    assert {path.name for path in Path("out").iterdir()} == {"alignment.json", "drift.png"}


@pytest.mark.parametrize(
    "words",
    [
        ["analyze", "in.csv", *STATED, "-o", ""],
        ["avar", "in.csv", *STATED, "-o", ""],
        ["convert", "in.csv", "", *STATED],
        ["simulate", *SIMULATED, "-o", ""],
        ["export", "analysis.json", "-o", ""],
        ["align", "analysis.json", "-o", ""],
        ["campaign", "in.csv", "-o", ""],
    ],
    ids=lambda words: words[0],
)
def test_an_empty_path_is_not_the_folder_where_one_is(words, place, capsys):
    before = set(place.iterdir())
    assert main(words) == 2
    assert "''; give a path" in one_line(capsys)
    assert set(place.iterdir()) == before
