import json
import multiprocessing
import os
import shutil
import signal
import threading
import time

import pytest

from sagnac.analysis.settings import Settings
from sagnac.core.processes import GIBIBYTE, Means
from sagnac.fleet import runner
from sagnac.fleet.runner import run
from sagnac.fleet.tasks import Task, result_path
from tests.conftest import in_one_process


def test_killed_worker_is_one_row_and_the_next_start_does_it(folder, tmp_path, monkeypatch):
    tasks = [
        Task(path=str(path), settings=Settings(method="none"))
        for path in sorted(folder.glob("A_*.parquet"))
    ]
    means = Means(workers=2, memory=4.0 * GIBIBYTE)
    killed = threading.Thread(target=_kill_one, daemon=True)
    killed.start()
    first = run(tasks, tmp_path, lambda todo, place: runner.completed_here(todo, place, means))
    killed.join()
    (lost,) = first.failed
    assert lost.state == "lost"
    assert "the worker died" in lost.reason
    kept = {row.task.key: result_path(tmp_path, row.task.key) for row in first.rows}
    times = {key: path.stat().st_mtime_ns for key, path in kept.items() if path.exists()}
    assert len(times) == 1
    in_one_process(monkeypatch)
    second = run(tasks, tmp_path, lambda todo, place: runner.completed_here(todo, place, means))
    assert second.computed == 1
    assert second.failed == ()
    assert all(kept[key].stat().st_mtime_ns == then for key, then in times.items())


@pytest.mark.usefixtures("in_this_process", "blank_figures")
def test_reports_that_were_moved_away_are_made_again(folder, tmp_path) -> None:
    tasks = [
        Task(path=str(path), settings=Settings(method="none"))
        for path in sorted(folder.glob("A_*.parquet"))
    ]
    means = Means(workers=1, memory=4.0 * GIBIBYTE)

    def start():
        return run(tasks, tmp_path, lambda todo, place: runner.completed_here(todo, place, means))

    def answers():
        documents = (json.loads((report / "analysis.json").read_text()) for report in reports)
        return [document["angle_random_walk"] for document in documents]

    reports = [tmp_path / row.report for row in start().rows]
    held = answers()
    assert start().computed == 0
    (tmp_path / "reports").rename(tmp_path / "elsewhere")
    assert start().computed == 2
    assert answers() == held
    assert all((report / "report.html").is_file() for report in reports)
    # One of them, or one file of one.
    shutil.rmtree(reports[0])
    assert start().computed == 1
    (reports[1] / "report.html").unlink()
    assert start().computed == 1
    assert all((report / "report.html").is_file() for report in reports)


def _kill_one() -> None:
    """Kill the first process that appears."""
    for _ in range(6000):
        for child in multiprocessing.active_children():
            if child.pid is not None:
                os.kill(child.pid, signal.SIGKILL)
                return
        time.sleep(0.01)


def test_worker_killed_between_two_tasks_costs_no_row(folder, tmp_path) -> None:
    # A damaged file is a row as well, and done at once.
    tasks = 2 * [Task(path=str(folder / "C_day1.parquet"))]
    work = runner.completed_here(tasks, tmp_path, runner.Means(workers=1, memory=runner.GIBIBYTE))
    results = [next(work)]
    before = threading.enumerate()
    (idle,) = multiprocessing.active_children()
    assert idle.pid is not None
    os.kill(idle.pid, signal.SIGKILL)
    idle.join()
    # The thread that watches the process ends when it has noticed.
    for thread in before:
        if type(thread).__name__ == "_ExecutorManagerThread":
            thread.join()
    results += work
    assert [result.state for result in results] == ["failed", "failed"]


def test_memory_is_that_of_the_format(tmp_path) -> None:
    for name in ("a.parquet", "a.csv"):
        (tmp_path / name).write_bytes(bytes(1000))
    by_blocks, whole = (
        runner.needed_memory(Task(path=str(tmp_path / name))) for name in ("a.parquet", "a.csv")
    )
    assert by_blocks == GIBIBYTE
    assert whole == by_blocks + 4000.0
