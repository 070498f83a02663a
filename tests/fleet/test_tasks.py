from dataclasses import replace

from sagnac.analysis.settings import Settings
from sagnac.fleet.tasks import Task, measure, with_digest
from sagnac.formats.statement import Statement
from tests.fleet.conftest import write_recording


def test_key_covers_all_that_the_result_depends_on(tmp_path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("x\n1\n")
    task = with_digest(Task(path=str(path)))
    keys = {
        task.key,
        replace(task, settings=Settings(method="none")).key,
        replace(task, settings=Settings(gyros=("x",))).key,
        replace(task, statement=Statement(kind="rate")).key,
    }
    path.write_text("x\n2\n")
    keys.add(with_digest(task).key)
    (tmp_path / "run.csv.toml").write_text('kind = "rate"\n')
    keys.add(with_digest(task).key)
    assert len(keys) == 6


def test_key_does_not_depend_on_place_and_labels(tmp_path) -> None:
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for path in paths:
        path.write_text("x\n1\n")
    first, second = (with_digest(Task(path=str(path))) for path in paths)
    assert first.key == second.key == replace(first, labels={"unit": "A"}).key


def test_file_that_has_changed_is_refused(tmp_path) -> None:
    path = write_recording(tmp_path / "run.parquet", seed=1, seconds=10.0)
    row = measure(Task(path=str(path), sha256="0" * 64), tmp_path)
    assert row.state == "failed"
    assert "not the file that the campaign was planned with" in row.reason
