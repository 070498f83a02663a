import pytest

from sagnac.analysis.settings import Settings
from sagnac.fleet.tasks import Row, Task, measure, read_row, result_path
from tests.fleet.conftest import write_recording


def test_row_is_kept_and_read(tmp_path) -> None:
    path = write_recording(tmp_path / "run.parquet", seed=1)
    task = Task(path=str(path), settings=Settings(method="none"))
    row = measure(task, tmp_path)
    assert (row.state, row.reason) == ("done", "")
    assert read_row(tmp_path, task) == row
    names = [one.name for one in result_path(tmp_path, task.key).parent.iterdir()]
    assert names == [f"{task.key}.json"]
    (tmp_path / row.report / "analysis.json").write_text("{")
    assert read_row(tmp_path, task) is None


@pytest.mark.parametrize("text", ["", "{", "[]", '{"schema": "other/1"}'])
def test_file_that_is_no_result_is_done_again(tmp_path, text) -> None:
    task = Task(path=str(tmp_path / "none.csv"))
    row = measure(task, tmp_path)
    assert row.state == "failed"
    assert read_row(tmp_path, task) == row
    result_path(tmp_path, task.key).write_text(text)
    assert read_row(tmp_path, task) is None


def test_reason_belongs_to_what_is_not_done() -> None:
    task = Task(path="run.csv")
    with pytest.raises(ValueError, match="reason"):
        Row(task=task, state="failed")
    with pytest.raises(ValueError, match="state is 'late'"):
        Row(task=task, state="late", reason="why")
