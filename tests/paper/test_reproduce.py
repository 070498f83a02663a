"""The paper's experiment: published numbers, truth, resumption, what the fits do, the page."""

import csv
import json
import math
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from sagnac.cli import app as cli
from sagnac.paper import trials
from sagnac.paper.least_squares import FORMS, least_squares
from sagnac.paper.plan import Scope, plan
from sagnac.paper.prediction import adequate_rate, predicted_angle_random_walk
from sagnac.paper.published import FIGURE_2, FIGURE_3, TABLE_1, TABLE_2
from sagnac.paper.reproduce import outcomes_of_table, reproduce
from sagnac.paper.trials import NEAREST_TRIAL
from sagnac.report import reproduction as pages
from sagnac.rig.config import preset
from sagnac.rig.ring_laser import RingLaser, angle_random_walk
from sagnac.rig.truth import truth_of
from sagnac.units import ARCSECOND, DEGREE, DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR

SMALL = Scope(table_duration_s=60.0, figure_duration_s=720.0, days=1)
RATES = {"table1": (0.0, 10.0, 20.0, 30.0, 40.0), "table2": (10.0, 20.0, 40.0, 60.0, 80.0)}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reproduction")
    stages: list[str] = []
    result = reproduce(
        folder, SMALL, progress=lambda stage, part: stages.append(stage) if part == 0.0 else None
    )
    return folder, result, stages


def test_published_numbers_are_those_of_the_paper():
    assert FIGURE_2 == 0.0498
    assert tuple(FIGURE_3.items()) == ((1.0, 2.5006e-4), (6.0, 3.3011e-3), (12.0, 4.5305e-3))
    rows_1 = """3.6427 3.3903 4.2517 3.4121 3.4328
                3.3709 3.4392 3.1152 3.2906 6.5700
                3.7997 3.0869 3.6555 4.1709 4.5071"""
    rows_2 = """8.3297 6.7278 7.4707 2.1993 3.4774
                4.6176 2.6117 2.3985 2.9396 2.3414
                6.8846 3.2470 2.3238 2.5313 2.6234"""
    for table, rows, size in ((TABLE_1, rows_1, 1e-4), (TABLE_2, rows_2, 1e-5)):
        by_day = np.array(rows.split(), float).reshape(3, 5) * size
        np.testing.assert_allclose(np.array(list(table.values())).T, by_day, rtol=1e-12)
    assert tuple(TABLE_1) == RATES["table1"]
    assert tuple(TABLE_2) == RATES["table2"]


def test_every_cell_has_a_recording_of_its_own():
    cells = [run for run in plan(Scope()) if run.name.startswith("table")]
    assert len(cells) == 30
    assert len({run.config.seed for run in cells}) == 30
    assert {run.config.duration_s for run in cells} == {7200.0}
    for run in cells:
        table, rate, _ = run.name.split("-")
        assert run.config.gyro.mode == {"table1": "dithered", "table2": "rate-biased"}[table]
        assert run.config.table.rate_deg_per_s == float(rate)
        assert run.config.disturbances == preset("paper").disturbances


def test_digest_follows_everything_the_result_depends_on():
    run = plan(SMALL)[0]
    changed = (
        replace(run, config=replace(run.config, seed=run.config.seed + 1)),
        replace(run, method="none"),
        replace(run, interval_s=2.0),
        replace(run, preparation="rate"),
        replace(run, gyros=("x", "y")),
    )
    assert len({run.key, *(other.key for other in changed)}) == 6
    assert replace(run).key == run.key


@pytest.mark.parametrize("days", [0, 4])
def test_days_the_paper_has_not_are_refused(days):
    with pytest.raises(ValueError, match="the paper has three"):
        Scope(days=days)


# ---- runs ----------------------------------------------------------------------------


def test_truth_of_each_table_is_that_of_the_closed_forms(made):
    """Dither: lock-in sqrt(fringe/(2 pi peak)); biased: lock-in fringe sqrt(D)/(2 pi rate)."""
    _, result, _ = made
    gyro = preset("paper").gyro
    lock_in = np.array([gyro.lock_in_deg_per_h[0], gyro.lock_in_deg_per_h[2]]) * DEGREE_PER_HOUR
    fringe = gyro.fringe_arcsec * ARCSECOND
    quantum = gyro.arw_deg_per_sqrt_h[0] * DEGREE_PER_ROOT_HOUR
    peak = gyro.dither_rate_deg_per_s * DEGREE
    for rate, _, _, outcome in outcomes_of_table(result, "table1"):
        steepest = math.sqrt(peak**2 - (rate * DEGREE / math.sqrt(3.0)) ** 2)
        squares = quantum**2 + lock_in**2 * fringe / (2.0 * math.pi * steepest)
        expected = math.sqrt(squares.mean()) / DEGREE_PER_ROOT_HOUR
        assert outcome.truth_deg_per_sqrt_h == pytest.approx(expected, rel=1e-3)
    for rate, _, _, outcome in outcomes_of_table(result, "table2"):
        sensed = rate * DEGREE / math.sqrt(3.0)
        scatter = lock_in * fringe / (2.0 * math.pi) / sensed
        squares = quantum**2 + scatter**2 * gyro.backscatter_diffusion_rad2_per_s
        expected = math.sqrt(squares.mean()) / DEGREE_PER_ROOT_HOUR
        assert outcome.truth_deg_per_sqrt_h == pytest.approx(expected, rel=3e-3)


def test_second_call_makes_nothing_and_finds_the_same(made, monkeypatch):
    folder, result, stages = made
    assert result.computed == len(stages) == len(result.outcomes)

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
    run = next(run for run in plan(SMALL) if run.name == "figure3-rate-12s")
    path = folder / "runs" / f"{run.key}.json"
    whole = path.read_text()
    for spoilt in (whole[:50], '{"name": 1}', "[]"):
        path.write_text(spoilt)
        again = reproduce(folder, SMALL)
        assert again.computed == 1
        assert path.read_text() == whole
    assert not list((folder / "runs").glob("*.part"))
    assert json.loads(whole)["name"] == run.name


# ---- least squares and Figure 3 ------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
def test_least_squares_are_exact_where_the_terms_are(form):
    tau = np.arange(1.0, 60.0)
    if form.startswith("variance"):
        curve = np.sqrt(3.0 * 0.2**2 / tau**2 + 1.5**2 / tau + 0.4 + 0.01 * tau)
    else:
        curve = 0.3 / tau + 1.5 / np.sqrt(tau) + 0.4 + 0.02 * np.sqrt(tau)
    assert least_squares(tau, curve, form) == pytest.approx(1.5, rel=1e-6)
    half = least_squares(tau, curve, form, gyros_differenced=2)
    assert half == pytest.approx(1.5 / math.sqrt(2.0), rel=1e-6)


def test_least_squares_say_when_the_coefficient_is_negative():
    tau = np.arange(1.0, 60.0)
    curve = np.sqrt(9.0 / tau**2 - 1.5**2 / tau + 1.0)
    assert least_squares(tau, curve, "variance, plain") == pytest.approx(-1.5, rel=1e-6)
    assert least_squares(tau, curve, "variance, plain, none below zero") >= 0.0


def test_least_squares_refuse_four_points():
    with pytest.raises(ValueError, match="4 points cannot hold five terms"):
        least_squares([1.0, 2, 3, 4], [1.0, 1, 1, 1], "variance, plain")


def test_a_slow_line_makes_the_published_figure_3():
    """The curve of a white rate and a sinusoid, in closed form at the three intervals."""
    grown = []
    for interval in (1, 6, 12):
        angles = 7200 // interval
        factors = np.arange(1, angles // 3)
        factors = factors[2.0 * ((angles - 1) / factors - 1.0) >= 100.0]
        tau = factors * float(interval)
        line = 2.0 * 0.031 * np.sin(np.pi * tau / 25.5) ** 2 / tau
        curve = np.sqrt((2.5e-4 * 60.0) ** 2 / tau + line**2)
        grown.append(abs(least_squares(tau, curve, "deviation, plain")) / 60.0)
    np.testing.assert_allclose(grown, list(FIGURE_3.values()), rtol=0.3)


def test_trials_have_the_line_that_they_name():
    named = {trial.name: trial for trial in trials.trials()}
    line = next(
        line for line in truth_of(named[NEAREST_TRIAL].config).lines
        if line.scale == "time"
    )  # fmt: skip
    assert line.amplitude_arcsec["z"] == pytest.approx(0.0389, rel=1e-9)
    assert line.frequency_hz == pytest.approx(1.0 / 38.71)
    assert named["white"].config.disturbances.time == ()
    assert min(f for f, _ in named["aliasing"].config.disturbances.time) > 0.5


# ---- the choice of table rate --------------------------------------------------------


def test_prediction_is_the_truth_of_table_2():
    rates = np.array(RATES["table2"]) * DEGREE
    prediction = predicted_angle_random_walk(rates)
    for index, rate in enumerate(RATES["table2"]):
        base = preset("paper")
        config = replace(
            base,
            gyro=replace(base.gyro, mode="rate-biased"),
            table=replace(base.table, rate_deg_per_s=rate),
        )
        truth = truth_of(config).pairs["x-z"].arw_deg_per_sqrt_h * DEGREE_PER_ROOT_HOUR
        laser = math.hypot(prediction.quantum[index], prediction.lock_in[index])
        assert laser == pytest.approx(truth, rel=1e-9)
        assert prediction.total[index] == pytest.approx(
            math.hypot(laser, prediction.encoder[index])
        )
    # Lock-in falls as one over the rate (the Earth's share of it aside).
    np.testing.assert_allclose(prediction.lock_in * rates, prediction.lock_in[0] * rates[0], 2e-3)


def test_prediction_of_one_laser_agrees_with_its_law():
    base = preset("paper")
    rate = 20.0 * DEGREE
    prediction = predicted_angle_random_walk([rate], config=base, pair=("x", "y"))
    expected = []
    for lock_in, share in zip((24.0, 26.0), (1.001, 1.0), strict=True):
        laser = RingLaser(
            lock_in=lock_in * DEGREE_PER_HOUR,
            fringe=1.5 * ARCSECOND,
            quantum_noise=2.5e-5 * DEGREE_PER_ROOT_HOUR,
            backscatter_diffusion=150.0,
        )
        expected.append(float(angle_random_walk(laser, share * rate / math.sqrt(3.0))))
    mean = math.sqrt(np.mean(np.square(expected)))
    assert math.hypot(prediction.quantum[0], prediction.lock_in[0]) == pytest.approx(mean, rel=2e-3)


def test_encoder_part_is_what_white_angle_error_makes():
    """Allan variance of simulated encoder rounding, through the share mismatch, as N."""
    rates = np.array([10.0, 40.0]) * DEGREE
    prediction = predicted_angle_random_walk(rates, cluster_time=2.0)
    line = 2.0 * math.pi / 7_200_000
    rounding = np.random.default_rng(3).uniform(-0.5, 0.5, 200_001) * line
    shares = truth_of(preset("paper")).shares
    error = (shares["x"] - shares["z"]) * rounding
    second = error[2:] - 2.0 * error[1:-1] + error[:-2]
    variance = np.mean(second**2) / (2.0 * 2.0**2)
    expected = math.sqrt(variance * 2.0 / 2.0)  # N^2 = variance tau, half of it per gyro
    np.testing.assert_allclose(prediction.encoder, expected, rtol=0.01)


def test_latch_jitter_makes_a_best_rate():
    rates = np.geomspace(5.0, 300.0, 60) * DEGREE
    free = predicted_angle_random_walk(rates)
    assert np.all(np.diff(free.total) < 0.0)
    held = predicted_angle_random_walk(rates, latch_jitter=2e-6)
    best = int(held.total.argmin())
    assert 0 < best < rates.size - 1
    assert np.all(held.total >= free.total)


def test_without_following_the_table_its_jitter_counts():
    alone = predicted_angle_random_walk([0.5], table_followed=False)
    assert alone.jitter[0] > 0.0
    assert alone.total[0] ** 2 == pytest.approx(
        alone.quantum[0] ** 2 + alone.lock_in[0] ** 2 + alone.jitter[0] ** 2
    )
    base = preset("paper")
    doubled = replace(base, table=replace(base.table, jitter_rms_deg_per_s=0.008))
    twice = predicted_angle_random_walk([0.5], config=doubled)
    assert twice.jitter[0] == pytest.approx(2.0 * alone.jitter[0])


def test_adequate_rate_is_the_first_within_the_excess():
    rates = np.linspace(5.0, 100.0, 96) * DEGREE
    prediction = predicted_angle_random_walk(rates)
    chosen = adequate_rate(prediction, 0.2)
    index = int(np.argmin(np.abs(rates - chosen)))
    assert prediction.total[index] <= 1.2 * prediction.quantum[index]
    assert prediction.total[index - 1] > 1.2 * prediction.quantum[index - 1]
    assert math.isnan(adequate_rate(prediction, 0.0))


@pytest.mark.parametrize("arguments", [{"latch_jitter": -1e-6}, {"cluster_time": 0.0}])
def test_prediction_refuses_what_cannot_be(arguments):
    with pytest.raises(ValueError, match="latch_jitter"):
        predicted_angle_random_walk([0.5], **arguments)


def test_prediction_refuses_a_rate_near_lock_in():
    with pytest.raises(ValueError, match="rate-biased"):
        predicted_angle_random_walk([1e-4])


# ---- page and tables -----------------------------------------------------------------


def test_tables_hold_every_cell_with_truth_and_published_number(made):
    _, result, _ = made
    texts = pages.tables(result)
    for name, published in (("table1", TABLE_1), ("table2", TABLE_2)):
        rows = list(csv.DictReader(texts[name].splitlines()))
        assert list(rows[0]) == [
            "table_rate[deg/s]", "day", "paper[deg/sqrt(h)]", "estimate[deg/sqrt(h)]",
            "low[deg/sqrt(h)]", "high[deg/sqrt(h)]", "confidence", "status",
            "truth[deg/sqrt(h)]", "error", "lines", "seed",
        ]  # fmt: skip
        assert [float(row["table_rate[deg/s]"]) for row in rows] == list(published)
        for row in rows:
            rate = float(row["table_rate[deg/s]"])
            assert float(row["paper[deg/sqrt(h)]"]) == published[rate][0]
            assert float(row["truth[deg/sqrt(h)]"]) > 0.0
    trials = list(csv.DictReader(texts["figure3_trials"].splitlines()))
    assert len(trials) == 3 * len(result.trials)
    assert {"figure2", "figure3", "figure4", "figure5", "figure6", "table_rate"} < texts.keys()


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
    for figure in ("Figure 2", "Figure 3", "Figures 4, 5 and 6", "Table 1", "Table 2"):
        assert figure in text


def test_command_reproduces_and_says_what_it_wrote(made, capsys, monkeypatch):
    folder, _, _ = made
    monkeypatch.setattr("sagnac.paper.plan.QUICK", SMALL)
    assert cli.main(["reproduce", "-o", str(folder), "--quick"]) == 0
    shown = capsys.readouterr().out
    assert "0 of " in shown
    assert f"wrote {folder / 'reproduction.html'}" in shown
    assert (folder / "table2.csv").exists()


def test_command_refuses_a_file_as_folder(tmp_path, capsys):
    path = tmp_path / "file"
    path.write_text("")
    assert cli.main(["reproduce", "-o", str(path / "out")]) == 1
    assert capsys.readouterr().err.count("\n") == 1
