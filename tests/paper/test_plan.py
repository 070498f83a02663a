"""Every run of the plan, and its digest."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.paper.prediction import DRIVEN, Scope, on_day, plan
from sagnac.rig.config import preset
from tests.paper.scope import SMALL


def test_every_cell_has_a_recording_of_its_own():
    runs = [run for run in plan(Scope()) if run.name.startswith("table")]
    cells = [run for run in runs if not run.name.endswith(("-paper", "-printed"))]
    assert len(runs) == 87
    assert len(cells) == 30
    assert len({run.config.seed for run in cells}) == 30
    assert {run.config.duration_s for run in cells} == {7200.0}
    for run in cells:
        table, rate, _ = run.name.split("-")
        assert run.config.gyro.mode == {"table1": "dithered", "table2": "rate-biased"}[table]
        assert run.config.table.rate_deg_per_s == float(rate)
        assert run.config.disturbances.angle == preset("paper").disturbances.angle


def test_each_cell_is_also_by_the_papers_method_and_at_rest_untouched():
    runs = {run.name: run for run in plan(Scope())}
    for name, run in runs.items():
        if name.startswith("table") and not name.endswith(("-paper", "-printed")):
            other = runs[f"{name}-paper"]
            assert other.config == run.config
            assert run.method == "fos"
            assert other.by_curve
            assert other.method == ("fos-paper" if run.config.turning else "none")
            assert (f"{name}-printed" in runs) == run.config.turning
            if run.config.turning:
                printed = runs[f"{name}-printed"]
                assert printed.config == run.config
                assert printed.as_printed
                assert not other.as_printed


def test_disturbances_at_rest_and_turning_are_two_sets():
    runs = {run.name: run.config for run in plan(Scope())}
    assert runs["table1-0-day1"].disturbances.time == ()
    ordinary = preset("paper").disturbances.time
    for name in ("table1-10-day1", "table2-80-day3"):
        turning = runs[name].disturbances.time
        assert len(turning) == len(ordinary)
        for (frequency, amplitude), (usual, size) in zip(turning, ordinary, strict=True):
            assert frequency == pytest.approx(usual, rel=0.02)
            # Amplitudes differ from day to day by a factor of 1.5, one standard deviation.
            drawn = amplitude / size / (1.0 if usual >= 50.0 else DRIVEN)
            assert 0.2 < drawn < 5.0


def test_days_differ_in_what_a_laboratory_does_not_hold():
    runs = {run.name: run.config for run in plan(Scope())}
    one, other = runs["table2-40-day1"], runs["table2-40-day2"]
    assert one.gyro.lock_in_deg_per_h != other.gyro.lock_in_deg_per_h
    assert one.gyro.warm_up_k != other.gyro.warm_up_k
    assert one.disturbances.time != other.disturbances.time
    assert one.gyro.arw_deg_per_sqrt_h == other.gyro.arw_deg_per_sqrt_h
    lock_in = np.array([c.gyro.lock_in_deg_per_h[0] for c in runs.values() if c.turning])
    spread = np.log(np.unique(lock_in)).std()
    assert 0.1 < spread < 0.2
    assert on_day(preset("paper"), 3) == on_day(preset("paper"), 3)


def test_digest_follows_everything_the_result_depends_on():
    run = plan(SMALL)[0]
    changed = (
        replace(run, config=replace(run.config, seed=run.config.seed + 1)),
        replace(run, method="none"),
        replace(run, interval_s=2.0),
        replace(run, preparation="rate"),
        replace(run, gyros=("x", "y")),
        replace(run, by_curve=True),
    )
    assert len({run.key, *(other.key for other in changed)}) == 7
    assert replace(run).key == run.key


def test_runs_of_one_recording_stand_together_and_names_differ():
    runs = plan(Scope(days=2))
    names = [run.name for run in runs]
    assert len(set(names)) == len(runs)
    place = names.index("figure2-day1")
    cell = "table2-40-day1"
    assert names[place - 3 : place] == [cell, f"{cell}-paper", f"{cell}-printed"]
    assert runs[place - 1].config == runs[place].config
    assert names.index("figure2-day2") == place + 4
