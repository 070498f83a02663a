from pathlib import Path

import pytest

from sagnac.analysis.settings import Settings
from sagnac.core.errors import RecordingError
from sagnac.fleet.tasks import Choices, tasks_of
from sagnac.formats.statement import Statement


def written(folder: Path, text: str) -> Path:
    for name in ("A_1.csv", "A_2.csv", "b.parquet", "notes.md"):
        (folder / name).touch()
    path = folder / "rack.toml"
    path.write_text(text)
    return path


def test_toml_gives_a_row_for_each_method_and_gyro(tmp_path) -> None:
    path = written(
        tmp_path,
        """
        methods = ["fos", "none"]
        gyros = ["x,z", "y"]
        confidence = 0.9
        pattern = '(?P<unit>[A-Z])_(?P<day>[0-9])'
        files = ["*.csv"]
        [statement]
        kind = "rate"
        [[recording]]
        file = "b.parquet"
        unit = "B"
        rate = 40.0
        """,
    )
    tasks = tasks_of([path], Choices())
    assert len(tasks) == 3 * 2 * 2
    assert tasks[0].labels == {"unit": "A", "day": "1"}
    assert tasks[-1].labels == {"unit": "B", "rate": "40"}
    assert [task.settings.gyros for task in tasks[:4]] == [("x", "z"), ("y",)] * 2
    assert {task.settings.confidence for task in tasks} == {0.9}
    assert {task.statement.kind for task in tasks} == {"rate"}
    assert all(Path(task.path).is_absolute() for task in tasks)


def test_what_is_stated_goes_over_the_toml_and_a_limit_stands_once(tmp_path) -> None:
    path = written(
        tmp_path, 'files = ["*.csv"]\nspec = "1"\nstatement = {kind="rate", unit="deg/s"}'
    )
    (task, _) = tasks_of([path], Choices(statement=Statement(unit="rad/s")))
    assert (task.statement.kind, task.statement.unit) == ("rate", "rad/s")
    with pytest.raises(RecordingError, match="states a limit, and so does the command or call"):
        tasks_of([path], Choices(settings=Settings(specification="2")))


def test_settings_that_are_stated_go_over_the_toml(tmp_path) -> None:
    """As by default, too, where they are stated; the rest is of the TOML."""
    path = written(
        tmp_path,
        'files = ["A_1.csv"]\nmethods = ["fos", "none"]\ngyros = ["x,z", "y"]\n'
        "confidence = 0.9\ninterval_s = 2.0\npattern = '(?P<unit>[A-Z])'",
    )
    (task, *_) = tasks = tasks_of([path], Choices(settings=Settings(gyros=("x",), method="fris")))
    assert len(tasks) == 1
    assert (task.settings.method, task.settings.gyros) == ("fris", ("x",))
    assert (task.settings.confidence, task.settings.interval) == (0.9, 2.0)
    stated = Choices(stated=("confidence", "interval"), pattern="(?P<day>[0-9])[.]csv")
    (task, *_) = tasks = tasks_of([path], stated)
    assert len(tasks) == 4
    assert (task.settings.confidence, task.settings.interval) == (0.95, None)
    assert task.labels == {"day": "1"}


def test_folder_gives_its_recordings_in_order(tmp_path) -> None:
    written(tmp_path, "")
    names = [Path(task.path).name for task in tasks_of([tmp_path], Choices())]
    assert names == ["A_1.csv", "A_2.csv", "b.parquet"]


def test_folder_leaves_out_what_a_campaign_and_a_report_wrote_into_it(tmp_path) -> None:
    """Tables of results are no recordings; files of their names that nobody marked are."""
    written(tmp_path, "")
    marks = {
        "out/index.html": '<meta name="generator" content="sagnac 0.1.0">',
        "A_1-report/analysis.json": '{"schema": "sagnac.analysis/1"}',
        "log/index.html": "<html>of a logger</html>",
        "log/analysis.json": "{}",
    }
    for name, text in marks.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    tables = "campaign.csv", "campaign.parquet", "lines.csv", "psd.csv"
    for place in ("out", "A_1-report", "log"):
        for name in tables:
            (tmp_path / place / name).touch()
    (tmp_path / "out" / "late.csv").touch()
    names = [Path(task.path).relative_to(tmp_path) for task in tasks_of([tmp_path], Choices())]
    of_report = [f"A_1-report/{name}" for name in tables[:2]]
    of_campaign = ["out/late.csv", *(f"out/{name}" for name in tables[2:])]
    of_logger = [f"log/{name}" for name in tables]
    rack = ["A_1.csv", "A_2.csv", "b.parquet"]
    assert sorted(map(str, names)) == sorted([*of_report, *rack, *of_logger, *of_campaign])
    # One that is named is taken at its word.
    (named,) = tasks_of([tmp_path / "out" / "campaign.csv"], Choices())
    assert named.path == str(tmp_path / "out" / "campaign.csv")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("file = 1", "'file' is not known"),
        ("", "names no recording"),
        ('files = ["*.h5"]', "matches no file"),
        ('files = ["b.parquet"]\nmethods = ["magic"]', "method is 'magic'"),
        ('[[recording]]\nname = "b"', "'name' is not known; use file"),
        ("[[recording]]\nday = 1", "file is not stated; give file"),
        ("files = [", "no TOML"),
    ],
)
def test_wrong_toml_is_refused_with_its_path(tmp_path, text, said) -> None:
    path = written(tmp_path, text)
    with pytest.raises(RecordingError, match=said.replace("[", r"\[")) as caught:
        tasks_of([path], Choices())
    assert str(path) in str(caught.value)


def test_pattern_without_known_groups_is_refused() -> None:
    with pytest.raises(ValueError, match="give it groups"):
        Choices(pattern="(?P<colour>.)")


def test_a_rate_that_is_no_number_is_refused(tmp_path) -> None:
    path = written(tmp_path, '[[recording]]\nfile = "b.parquet"\nrate = "slow"\n')
    with pytest.raises(RecordingError, match=r"rate is 'slow'; give deg/s as a number"):
        tasks_of([path], Choices())
