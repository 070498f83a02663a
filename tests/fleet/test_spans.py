import pytest

from sagnac.fleet.tasks import Result, Task, span_of, span_tasks
from sagnac.formats.statement import Statement


def result(duration: float) -> Result:
    return Result(key="k", state="done", analysis={"input": {"duration_s": duration}})


def test_spans_cover_what_they_fit_into() -> None:
    task = Task(path="run.parquet", statement=Statement(kind="rate", span=(100.0, None)))
    spans = span_tasks(task, result(86_400.0), 7200.0)
    assert len(spans) == 12
    assert span_of(spans[0]) == (100.0, 7300.0)
    assert span_of(spans[-1]) == (79_300.0, 86_500.0)
    assert {one.statement.kind for one in spans} == {"rate"}
    assert len({one.key for one in spans}) == 12


def test_short_or_failed_recordings_have_no_spans() -> None:
    task = Task(path="run.parquet")
    assert span_tasks(task, result(10_000.0), 7200.0) == ()
    assert span_tasks(task, Result(key="k", state="failed", reason="why"), 7200.0) == ()
    with pytest.raises(ValueError, match="span is 0"):
        span_tasks(task, result(10.0), 0.0)
