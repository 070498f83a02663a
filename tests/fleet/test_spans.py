import pytest

from sagnac.fleet.tasks import Row, Task, span_tasks
from sagnac.formats.statement import Statement


def whole(task: Task, duration: float) -> Row:
    return Row(task=task, state="done", analysis={"input": {"duration_s": duration}})


def test_spans_cover_what_they_fit_into() -> None:
    task = Task(path="run.parquet", statement=Statement(kind="rate", span=(100.0, None)))
    spans = span_tasks(whole(task, 86_400.0), 7200.0)
    assert len(spans) == 12
    assert spans[0].span == (100.0, 7300.0)
    assert spans[-1].span == (79_300.0, 86_500.0)
    assert {one.statement.kind for one in spans} == {"rate"}
    assert len({one.key for one in spans}) == 12


def test_short_or_failed_recordings_have_no_spans() -> None:
    task = Task(path="run.parquet")
    assert span_tasks(whole(task, 10_000.0), 7200.0) == ()
    assert span_tasks(Row(task=task, state="failed", reason="why"), 7200.0) == ()
    with pytest.raises(ValueError, match="span is 0"):
        span_tasks(whole(task, 10.0), 0.0)
