from dataclasses import replace

import pytest

from sagnac.fleet.table import groups_of, lines_of
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


def test_a_recording_without_its_warm_up_is_no_span_of_it() -> None:
    task = Task(path="run.parquet", statement=Statement(kind="rate", span=(100.0, 900.0)))
    row = Row(task=task, state="done", analysis={"input": {"gyros": ["x"]}})
    (line,) = lines_of([row])
    assert list(groups_of([line])) == [("fos", "x")]
    (first, _) = span_tasks(whole(task, 800.0), 400.0)
    (line,) = lines_of([whole(first, 400.0)])
    assert (line.start_s, line.stop_s) == (100.0, 500.0)
    assert groups_of([line]) == {}


def test_a_span_of_too_few_samples_is_refused_before_there_are_thousands() -> None:
    """Five minutes at 100 Hz: 16 samples are 0.16 s."""
    facts = {"duration_s": 300.0, "sample_rate_hz": 100.0}
    row = Row(task=Task(path="run.csv"), state="done", analysis={"input": facts})
    for span in (0.001, 0.159):
        with pytest.raises(ValueError, match=f"{span} s hold less than 16 samples of run"):
            span_tasks(row, span)
    assert len(span_tasks(row, 0.16)) == 1875
    # What is not cut is not refused either.
    assert span_tasks(replace(row, state="failed", reason="why", analysis={}), 0.001) == ()


def test_short_or_failed_recordings_have_no_spans() -> None:
    task = Task(path="run.parquet")
    assert span_tasks(whole(task, 10_000.0), 7200.0) == ()
    assert span_tasks(Row(task=task, state="failed", reason="why"), 7200.0) == ()
