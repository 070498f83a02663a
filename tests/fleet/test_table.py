"""The table of a campaign: equal data count once."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from sagnac.analysis.settings import Settings
from sagnac.fleet import runner
from sagnac.fleet.config import Task
from sagnac.fleet.runner import run
from sagnac.fleet.table import groups_of, lines_of, read_table, write_tables
from sagnac.formats import read, write
from sagnac.processes import GIBIBYTE, Means
from tests.fleet.conftest import write_recording


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A recording, its bytes under another name, its numbers in another format, and another."""
    place = tmp_path_factory.mktemp("copies")
    first = write_recording(place / "A_day1.parquet", seed=1)
    (place / "A_day2.parquet").write_bytes(first.read_bytes())
    write(read(first), place / "A_day3.npz")
    write_recording(place / "A_day4.parquet", seed=2)
    tasks = [
        Task(path=str(path), settings=Settings(method="none")) for path in sorted(place.iterdir())
    ]
    means = Means(workers=1, memory=4.0 * GIBIBYTE)
    return run(
        tasks, place / "many", lambda todo, folder: runner.completed_here(todo, folder, means)
    )


def test_equal_data_count_once_and_the_row_says_so(made, tmp_path) -> None:
    lines = lines_of(made.each)
    paths = [row.task.path for row in made.each]
    assert [line.state for line in lines] == ["done"] * 4
    assert [line.same_as for line in lines] == ["", paths[0], paths[0], ""]
    (counted,) = groups_of(lines).values()
    assert [line.file for line in counted] == [paths[0], paths[3]]
    written, _ = write_tables(lines, tmp_path)
    with written.open(newline="") as stream:
        assert [row["same_as"] for row in csv.DictReader(stream)] == ["", *paths[:1] * 2, ""]
    (counted,) = groups_of(read_table(tmp_path)).values()
    assert [line.file for line in counted] == [paths[0], paths[3]]


def test_data_that_differ_by_little_are_two_measurements(made) -> None:
    """The same file by another method is a row of another group, and a changed curve is new."""
    first = made.each[0]
    curve = first.result.analysis["curve"]
    shifted = (np.array(curve["deviation_deg_per_h"]) * (1.0 + 1e-7)).tolist()
    analysis = {**first.result.analysis, "curve": {**curve, "deviation_deg_per_h": shifted}}
    near = replace(first, result=replace(first.result, analysis=analysis))
    task = replace(first.task, settings=Settings(method="fris"))
    assert [line.same_as for line in lines_of([first, near, replace(first, task=task)])] == [""] * 3
