"""The table of a campaign: equal data count once."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from sagnac.analysis.settings import Settings
from sagnac.core.errors import MissingExtra
from sagnac.fleet.page import control_chart, terminal_text, write_overview, write_page
from sagnac.fleet.runner import Campaign, run
from sagnac.fleet.table import (
    groups_of,
    lines_of,
    read_table,
    rows_replaced,
    scatter_of,
    write_tables,
)
from sagnac.fleet.tasks import Row, Task, measure
from sagnac.formats import read, write
from sagnac.quality.effects import finding
from sagnac.report.document import analysis_document
from sagnac.verdict.limits import specification_of
from tests.conftest import undrawn
from tests.fleet.commands import rows_of
from tests.fleet.conftest import write_recording
from tests.fleet.test_prior import TABLE
from tests.handmade import analysis


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
    with pytest.MonkeyPatch.context() as patch:
        undrawn(patch)
        return run(
            tasks, place / "many", lambda todo, folder: (measure(one, folder) for one in todo)
        )


def test_equal_data_count_once_and_the_row_says_so(made, tmp_path) -> None:
    lines = lines_of(made.each)
    paths = [row.task.path for row in made.each]
    assert [line.state for line in lines] == ["done"] * 4
    assert [line.same_as for line in lines] == ["", paths[0], paths[0], ""]
    (counted,) = groups_of(lines).values()
    assert [line.file for line in counted] == [paths[0], paths[3]]
    write_tables(lines, tmp_path)
    assert [row["same_as"] for row in rows_of(tmp_path)] == ["", *paths[:1] * 2, ""]
    (counted,) = groups_of(read_table(tmp_path)).values()
    assert [line.file for line in counted] == [paths[0], paths[3]]


def test_lines_of_another_campaign_that_are_replaced_are_counted(made, tmp_path) -> None:
    assert rows_replaced(tmp_path, made.rows) == 0
    write_tables(lines_of(made.each), tmp_path)
    assert rows_replaced(tmp_path, made.rows) == 0
    # The copy of its bytes is the same task.
    assert rows_replaced(tmp_path, made.rows[:1]) == 2
    assert rows_replaced(tmp_path, ()) == 4


def test_a_library_that_is_missing_is_named_with_its_file_and_tried_again(monkeypatch, tmp_path):
    def read(path, statement):
        raise MissingExtra("reading ROS bag", "rosbags", "ros").at(path)

    monkeypatch.setattr("sagnac.fleet.tasks.read", read)
    result = measure(Task(path="/rack/run.bag"), tmp_path)
    assert result.state == "lost"
    assert result.reason.startswith("/rack/run.bag: reading ROS bag needs rosbags, which is not")


def test_drift_of_n_is_shown_in_percent_alone(tmp_path) -> None:
    rows = tuple(Row(task=Task(path="run.csv"), state="done") for _ in TABLE)
    lines = [
        replace(one, low=0.9 * one.n_deg_per_sqrt_h, high=1.1 * one.n_deg_per_sqrt_h)
        for one in TABLE
    ]
    page = write_page(Campaign(rows=rows, computed=0), lines, tmp_path, "rack").read_text()
    (drift,) = re.findall(r"<tr><th>Drift of N a day.*?</tr>", page)
    assert "%" in drift
    assert "°/√h" not in drift
    (unit,) = re.findall(r"<tr><th>Unit x-z, one recording on a new day.*?</tr>", page)
    assert unit.count("°/√h") == 2


def rack_with_a_wrong_unit():
    """Twelve units of three gyros on three days; one is 57.3 times too low."""
    random, lines = np.random.default_rng(12), []
    for place in range(12):
        for gyro in "xyz":
            value = 0.15 * math.exp(0.1 * random.standard_normal()) / (57.3 if place == 7 else 1.0)
            lines.append(
                replace(
                    TABLE[0],
                    file=f"U{place:02d}.csv", unit=f"U{place:02d}", gyros=gyro,
                    day=f"2026-03-{1 + place % 3:02d}", rate_deg_per_s=0.0,
                    n_deg_per_sqrt_h=value, low=0.99 * value, high=1.01 * value,
                )
            )  # fmt: skip
    return lines


def test_terminal_and_page_name_the_unit_that_the_others_do_not_bear_out(tmp_path) -> None:
    lines = rack_with_a_wrong_unit()
    rows = tuple(Row(task=Task(path=one.file), state="done") for one in lines)
    campaign = Campaign(rows=rows, computed=0)
    page = write_page(campaign, lines, tmp_path, "rack").read_text()
    text = terminal_text(campaign, lines, 0)
    said = re.findall(r"U07.csv: N is .* the others give .* without it the mean is .*°/√h", text)
    assert len(said) == 3
    for one in said:
        assert one in page
    # The low end keeps its digits, and both places say the same.
    for value, low, high in re.findall(r"mean N  (\S+) °/√h  \[(\S+), (\S+)\]", text):
        assert f"{value} <small>" in page
        assert f"{low} … {high} °/√h" in page
        assert len(low.lstrip("0.")) >= 2


def test_terminal_counts_the_recordings_that_show_no_n(tmp_path) -> None:
    lines = [replace(one, gyros="x") for one in rack_with_a_wrong_unit() if one.gyros == "x"]
    lines[0] = replace(lines[0], status="not observable")
    lines[1] = replace(lines[1], status="upper bound")
    rows = tuple(Row(task=Task(path=one.file), state="done") for one in lines)
    text = terminal_text(Campaign(rows=rows, computed=0), lines, 0)
    assert "x: 12 of 12 recordings analyzed, 2 without an estimate of N\n" in text
    text = terminal_text(Campaign(rows=rows[2:], computed=0), lines[2:], 0)
    assert "x: 10 of 10 recordings analyzed\n" in text


def test_terminal_counts_a_recording_that_could_not_be_read_for_every_gyro(tmp_path) -> None:
    """Which gyros it would have had, nobody stated; a failure of another method is not counted."""
    lines = [replace(one, method="fos") for one in rack_with_a_wrong_unit()]
    failed = [replace(lines[0], file="cut.csv", state="failed", status="", gyros="", reason="cut")]
    failed += [replace(failed[0], file="other.csv", method="none")]
    rows = tuple(Row(task=Task(path=one.file), state="done") for one in lines)
    text = terminal_text(Campaign(rows=rows, computed=0), [*lines, *failed], 0)
    for gyro in "xyz":
        assert f"{gyro}: 12 of 13 recordings analyzed" in text


def test_a_drift_of_n_falls_by_no_more_than_its_whole(tmp_path) -> None:
    lines = rack_with_a_wrong_unit()
    rows = tuple(Row(task=Task(path=one.file), state="done") for one in lines)
    page = write_page(Campaign(rows=rows, computed=0), lines, tmp_path, "rack").read_text()
    drifts = re.findall(r"Drift of N a day.*?([−\d.]+) % … ", page)
    assert len(drifts) == 3
    assert all(-100.0 <= float(low.replace("−", "-")) < 0.0 for low in drifts)


def test_the_picture_of_a_rack_names_each_recording_once(monkeypatch, tmp_path) -> None:
    drawn = []
    monkeypatch.setattr("sagnac.fleet.page.write_png", lambda figure, path: drawn.append(figure))
    write_overview(rack_with_a_wrong_unit(), (), tmp_path)
    (axes,) = drawn[0].axes
    named = {
        one.get_text(): place
        for place, one in zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)
    }
    assert named == {f"U{place:02d}": 3 * place + 2 for place in range(12)}


def test_the_chart_of_one_gyro_names_what_it_shows() -> None:
    """Rows without N are in the table, not in the chart: a number would name another row."""
    lines = [one for one in rack_with_a_wrong_unit() if one.gyros == "x"][5:]
    figure = control_chart(lines, scatter_of(lines).answer)
    (axes,) = figure.axes
    named = [one.get_text() for one in axes.get_xticklabels()]
    assert named == [f"U{place:02d}" for place in range(5, 12)]
    (ring,) = (one for one in axes.get_lines() if one.get_label() == "off the others")
    assert ring.get_xdata().tolist() == [3.0]
    many = [replace(lines[0], file=f"{place}.csv") for place in range(40)]
    (axes,) = control_chart(many, None).axes
    assert all(place == round(place) for place in axes.get_xticks())


@pytest.mark.parametrize(
    ("limit", "verdict", "reason"),
    [
        ("N=1", "pass", ""),
        ("N=2.5e-5", "undecided", "N: the limit lies within the interval"),
        ("N=1,B=1e-9", "undecided", "B: "),
    ],
)
def test_a_row_says_why_it_does_not_pass(made, limit, verdict, reason) -> None:
    single = analysis(gyros=("x",))
    settings = replace(single.settings, specification=specification_of(limit))
    document = analysis_document(replace(single, settings=settings))
    row = made.each[0]
    (line,) = lines_of([replace(row, analysis=document)])
    assert line.verdict == verdict
    assert line.reason.startswith(reason)
    assert bool(line.reason) == bool(reason)


def test_a_row_without_an_estimate_says_what_spoils_it(made) -> None:
    spoilt = analysis(gyros=("x",), notes=(finding("clipping", "x", "is cut off", effect=0.6),))
    unseen = replace(
        spoilt,
        angle_random_walk=replace(spoilt.angle_random_walk, status="upper bound"),
    )
    row = made.each[0]
    for one, why in ((unseen, "is cut off; "), (spoilt, "")):
        (line,) = lines_of([replace(row, analysis=analysis_document(one))])
        assert line.reason.startswith(why)
        assert bool(line.reason) == bool(why)


def test_the_picture_of_a_campaign_is_of_what_shows_n(made, tmp_path) -> None:
    lines = lines_of(made.each)
    (path,) = write_overview(lines, (1e-3,), tmp_path)
    assert path.read_bytes().startswith(b"\x89PNG")
    # A later start in the same folder that shows no N leaves no picture of an earlier one.
    nothing = [replace(line, n_deg_per_sqrt_h=math.nan, status="not observable") for line in lines]
    assert write_overview(nothing, (1e-3,), tmp_path) == ()
    assert not path.exists()


def test_data_that_differ_by_little_are_two_measurements(made) -> None:
    """The same file by another method is a row of another group, and a changed curve is new."""
    first = made.each[0]
    curve = first.analysis["curve"]
    shifted = (np.array(curve["deviation_deg_per_h"]) * (1.0 + 1e-7)).tolist()
    analysis = {**first.analysis, "curve": {**curve, "deviation_deg_per_h": shifted}}
    near = replace(first, analysis=analysis)
    task = replace(first.task, settings=Settings(method="fris"))
    assert [line.same_as for line in lines_of([first, near, replace(first, task=task)])] == [""] * 3


def test_gyros_that_do_not_pass_are_of_another_color(made):
    line = replace(
        lines_of(made.rows)[0], status="estimated", n_deg_per_sqrt_h=1.0, low=0.9, high=1.1
    )
    verdicts = ("pass", "fail", "undecided", "fail", "")
    (axes,) = control_chart([replace(line, verdict=one) for one in verdicts], None).axes
    drawn = {bars.get_label(): bars.lines[0] for bars in axes.containers}
    places = {label: [int(place) for place in one.get_xdata()] for label, one in drawn.items()}
    assert places == {
        "N with its interval": [1, 5],
        "N: fail": [2, 4],
        "N: undecided": [3],
    }
    assert len({one.get_color() for one in drawn.values()}) == 3


def test_a_name_that_is_none_in_the_systems_encoding_is_in_every_table(tmp_path):
    path = "/rack/A\udcff_day1.csv"
    task = Task(path=path, labels={"unit": "A\udcff"})
    rows = (Row(task=task, state="failed", reason="is empty"),)
    (line,) = lines_of(rows)
    assert line.file == r"/rack/A\udcff_day1.csv"
    write_tables(lines_of(rows), tmp_path)
    assert [one.file for one in read_table(tmp_path)] == [line.file]
