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
