"""The paper's experiment: truth, resumption, the page."""

import csv
import json
import math
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from sagnac.cli import app as cli
from sagnac.core.errors import RecordingError
from sagnac.core.processes import GIBIBYTE, Means, Standing
from sagnac.core.units import ARCSECOND, DEGREE, DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR
from sagnac.noise.readings import READINGS
from sagnac.paper import page as pages
from sagnac.paper.prediction import TABLE_1, TABLE_2, plan
from sagnac.paper.reproduce import (
    outcome_of,
    outcomes_of_table,
    read_outcome,
    reproduce,
    write_outcome,
)
from sagnac.paper.tables import figures_of, tables
from sagnac.paper.trials import NEAREST_TRIAL, trials
from sagnac.rig.simulate import simulate
from tests.paper.scope import SMALL

# Those that the page names, and the one that is prepared otherwise; the others differ by the rig.
TRIALS = ("as-simulated", "white", "rate", NEAREST_TRIAL)


@pytest.fixture(scope="module", autouse=True)
def fewer_trials():
    """Four trials of ten, and one analysis of each kind of run, since analyses take the time.

    The other runs of a kind are simulated, and have its numbers beside their own truth.
    """
    kinds = {}

    def some(duration_s):
        return tuple(one for one in trials(duration_s) if one.name in TRIALS)

    def outcome(run, simulation):
        how = (run.method, run.interval_s, run.preparation, run.by_curve, run.as_printed)
        kind = (run.config.gyro.mode, run.config.turning, run.gyros, *how)
        if kind not in kinds:
            kinds[kind] = outcome_of(run, simulation)
            return kinds[kind]
        of_pair, of_gyro = simulation.truth.pairs, simulation.truth.gyros
        noise = of_pair["x-z"] if run.gyros == ("x", "z") else of_gyro[run.gyros[0]]
        return replace(kinds[kind], run=run, truth_deg_per_sqrt_h=noise.arw_deg_per_sqrt_h)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sagnac.paper.reproduce.outcome_of", outcome)
        for module in ("prediction", "reproduce"):
            patch.setattr(f"sagnac.paper.{module}.trials", some)
        yield


@pytest.fixture(scope="module")
def made(fewer_trials, tmp_path_factory):
    folder = tmp_path_factory.mktemp("reproduction")
    told: list[Standing] = []
    return folder, reproduce(folder, SMALL, told=told.append), told


def test_truth_of_each_table_is_that_of_the_closed_forms(made):
    """Dither: lock-in sqrt(fringe/(2 pi peak)); biased: lock-in fringe sqrt(D)/(2 pi rate)."""
    _, result, _ = made
    configs = {run.name: run.config for run in plan(SMALL)}

    def lasers(outcome):
        gyro = configs[outcome.run.name].gyro
        lock_in = np.array([gyro.lock_in_deg_per_h[0], gyro.lock_in_deg_per_h[2]])
        quantum = gyro.arw_deg_per_sqrt_h[0] * DEGREE_PER_ROOT_HOUR
        return gyro, lock_in * DEGREE_PER_HOUR, gyro.fringe_arcsec * ARCSECOND, quantum

    for cell in outcomes_of_table(result, "table1"):
        gyro, lock_in, fringe, quantum = lasers(cell.outcome)
        peak = gyro.dither_rate_deg_per_s * DEGREE
        steepest = math.sqrt(peak**2 - (cell.rate * DEGREE / math.sqrt(3.0)) ** 2)
        squares = quantum**2 + lock_in**2 * fringe / (2.0 * math.pi * steepest)
        expected = math.sqrt(squares.mean()) / DEGREE_PER_ROOT_HOUR
        assert cell.outcome.truth_deg_per_sqrt_h == pytest.approx(expected, rel=1e-3)
    for cell in outcomes_of_table(result, "table2"):
        gyro, lock_in, fringe, quantum = lasers(cell.outcome)
        sensed = cell.rate * DEGREE / math.sqrt(3.0)
        scatter = lock_in * fringe / (2.0 * math.pi) / sensed
        squares = quantum**2 + scatter**2 * gyro.backscatter_diffusion_rad2_per_s
        expected = math.sqrt(squares.mean()) / DEGREE_PER_ROOT_HOUR
        assert cell.outcome.truth_deg_per_sqrt_h == pytest.approx(expected, rel=3e-3)
        assert cell.by_paper.truth_deg_per_sqrt_h == cell.outcome.truth_deg_per_sqrt_h


def test_second_call_makes_nothing_and_finds_the_same(made, monkeypatch):
    folder, result, told = made
    assert result.computed == len(result.outcomes)
    assert [one.done for one in told] == list(range(len(result.outcomes) + 1))
    assert told[-1].left_s == 0.0

    def refuse(_config):
        raise AssertionError("simulated again")

    monkeypatch.setattr("sagnac.paper.reproduce.simulate", refuse)
    again = reproduce(folder, SMALL)
    assert again.computed == 0
    assert again.outcomes.keys() == result.outcomes.keys()
    for name, outcome in result.outcomes.items():
        assert repr(again.outcomes[name]) == repr(outcome)


def test_a_spoilt_run_is_made_again_and_the_others_are_not(made):
    folder, _, _ = made
    run = next(run for run in plan(SMALL) if run.name == "table2-60-day1-paper")
    path = folder / "runs" / f"{run.key}.json"
    whole = path.read_text()
    for spoilt in ("[]", '{"name": 1}', whole[:50]):
        path.write_text(spoilt)
        assert read_outcome(path, run) is None
    again = reproduce(folder, SMALL)
    assert again.computed == 1
    assert path.read_text() == whole
    assert not list((folder / "runs").glob("*.part"))
    assert json.loads(whole)["run"]["name"] == run.name


def test_processes_make_the_same_and_each_recording_once(made, tmp_path):
    folder, _, _ = made
    (tmp_path / "runs").mkdir()
    names = [path.name for path in (folder / "runs").iterdir()]
    lacking = [name for name in names if name.startswith(("table1-0-day1", "table1-10-day1"))]
    assert len(lacking) == 5
    for name in set(names) - set(lacking):
        (tmp_path / "runs" / name).write_bytes((folder / "runs" / name).read_bytes())
    told: list[Standing] = []
    again = reproduce(
        tmp_path, SMALL, means=Means(workers=1, memory=2.0 * GIBIBYTE), told=told.append
    )
    assert again.computed == 5
    assert told[0].done == told[0].total - 5
    number = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
    for name in lacking:
        texts = [(place / "runs" / name).read_text() for place in (tmp_path, folder)]
        assert number.sub("", texts[0]) == number.sub("", texts[1])
        # Loops that two processes compiled apart may round their sums otherwise.
        ours, theirs = (list(map(float, number.findall(text))) for text in texts)
        assert ours == pytest.approx(theirs, rel=1e-6)


def test_runs_of_one_recording_share_one_simulation(tmp_path, monkeypatch):
    seen = []

    def counted(config):
        seen.append(config)
        return simulate(config)

    monkeypatch.setattr("sagnac.paper.reproduce.simulate", counted)
    folder = tmp_path / "out"
    folder.mkdir()

    class _Enough(Exception):
        pass

    def stop(standing):
        if standing.computed == 6:
            raise _Enough

    # The first cell has two runs and the second three; the sixth run is of the third.
    with pytest.raises(_Enough):
        reproduce(folder, SMALL, told=stop)
    assert len(seen) == 3
    assert len(set(seen)) == 3
    assert len(list((folder / "runs").glob("*.json"))) == 6


def test_tables_hold_every_cell_with_truth_and_published_number(made):
    _, result, _ = made
    texts = tables(result)
    for name, published in (("table1", TABLE_1), ("table2", TABLE_2)):
        rows = list(csv.DictReader(texts[name].splitlines()))
        assert list(rows[0]) == [
            "table_rate[deg/s]", "day", "paper[deg/sqrt(h)]", "estimate[deg/sqrt(h)]",
            "low[deg/sqrt(h)]", "high[deg/sqrt(h)]", "confidence", "status",
            "truth[deg/sqrt(h)]", "error", "lines", "seed",
            "by_paper_method[deg/sqrt(h)]", "by_paper_method_status", "by_paper_method_error",
            "duration[s]",
            *(f"{order}_{name}[deg/sqrt(h)]" for order in ("by_paper", "as_printed")
              for name in READINGS),
        ]  # fmt: skip
        assert [float(row["table_rate[deg/s]"]) for row in rows] == list(published)
        for row in rows:
            rate = float(row["table_rate[deg/s]"])
            assert float(row["paper[deg/sqrt(h)]"]) == published[rate][0]
            assert float(row["truth[deg/sqrt(h)]"]) > 0.0
    trials = list(csv.DictReader(texts["figure3_trials"].splitlines()))
    assert len(trials) == 3 * len(result.trials)
    assert {"figure2", "figure3", "figure4", "figure5", "figure6", "table_rate"} < texts.keys()
    assert set(figures_of(result)) == {f"figure{number}" for number in range(1, 7)} | {"table_rate"}


class _Reader(HTMLParser):
    def __init__(self):
        super().__init__()
        self.fetched: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name in ("src", "href", "xlink:href") and not (value or "").startswith("#"):
                self.fetched.append(value or "")
        if tag not in ("meta", "br", "use", "path", "link"):
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_endtag(self, tag):
        if tag in self.open:
            while self.open.pop() != tag:
                raise AssertionError(f"{tag} closes what it did not open")


def test_page_stands_alone_and_shows_every_published_number(made, tmp_path):
    _, result, _ = made
    written = pages.write(result, tmp_path)
    assert all(path.stat().st_size > 0 for path in written)
    text = written[0].read_text()
    reader = _Reader()
    reader.feed(text)
    assert reader.fetched == []
    assert reader.open == []
    assert "nan" not in text.lower().replace("nanoseconds", "").split("<svg")[0]
    for table, size in ((TABLE_1, 1e-4), (TABLE_2, 1e-5)):
        for days in table.values():
            assert f"paper {days[0] / size:.2f}" in text
    for figure in ("Figure 1", "Figure 2", "Figure 3", "Figures 4, 5 and 6", "Table 1", "Table 2"):
        assert figure in text


def test_command_reproduces_and_says_what_it_wrote(made, capsys, monkeypatch):
    folder, _, _ = made
    monkeypatch.setattr("sagnac.paper.prediction.QUICK", SMALL)
    assert cli.main(["reproduce", "-o", str(folder), "--quick", "--workers", "0"]) == 2
    assert "--workers is 0; give a whole number of 1 or more" in capsys.readouterr().err
    assert cli.main(["reproduce", "-o", str(folder), "--quick"]) == 0
    shown = capsys.readouterr().out
    assert "0 of " in shown
    assert f"wrote {folder}/: reproduction.html," in " ".join(shown.split())
    assert (folder / "table2.csv").exists()


def test_command_refuses_a_file_as_folder(tmp_path, capsys):
    path = tmp_path / "file"
    path.write_text("")
    assert cli.main(["reproduce", "-o", str(path / "out")]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_a_folder_that_cannot_be_made_is_an_error_as_data(tmp_path):
    (tmp_path / "nowhere").write_text("a file")
    with pytest.raises(RecordingError) as caught:
        reproduce(tmp_path / "nowhere", SMALL)
    assert caught.value.path == str(tmp_path / "nowhere" / "runs")
    assert caught.value.remedy == "choose another output"


def test_an_outcome_is_read_as_it_was_written(made, tmp_path):
    _, result, _ = made
    outcome = replace(result.outcomes["table2-40-day1"], low=math.nan)
    write_outcome(tmp_path / "run.json", outcome)
    assert repr(read_outcome(tmp_path / "run.json", outcome.run)) == repr(outcome)
    assert read_outcome(tmp_path / "none.json", outcome.run) is None
