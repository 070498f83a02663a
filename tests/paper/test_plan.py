"""Every run of the plan, and its digest."""

from dataclasses import replace

import pytest

from sagnac.paper.plan import Scope, plan
from sagnac.rig.config import preset
from tests.paper.scope import SMALL


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


def test_runs_of_one_recording_stand_together_and_names_differ():
    runs = plan(Scope(days=2))
    names = [run.name for run in runs]
    assert len(set(names)) == len(runs)
    place = names.index("figure2-day1")
    assert names[place - 1] == "table2-40-day1"
    assert runs[place - 1].config == runs[place].config
    assert names.index("figure2-day2") == place + 2


def test_a_scope_or_run_that_cannot_be_is_refused():
    with pytest.raises(ValueError, match=r"table_duration_s is 0\.0; it must be positive"):
        Scope(table_duration_s=0.0)
    run = plan(SMALL)[0]
    with pytest.raises(ValueError, match="give one, or two to be differenced"):
        replace(run, gyros=())
    with pytest.raises(ValueError, match="preparation is 'both'; use one of angle, rate"):
        replace(run, preparation="both")
