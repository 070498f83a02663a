import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from sagnac.core.errors import RecordingError
from sagnac.fleet.study import Run, repeatability
from sagnac.paper.prediction import TABLE_1, TABLE_2
from tests.fleet.examples import CELLS, Campaign


def table_runs(table: dict[float, tuple[float, ...]]) -> list[Run]:
    return [
        Run(value=value, labels={"unit": "x-z", "day": str(day), "rate": f"{rate:g}"})
        for rate, days in table.items()
        for day, value in enumerate(days, start=1)
    ]


def test_paper_table_2_shows_a_scatter_of_runs_and_not_that_rates_differ() -> None:
    found = repeatability(table_runs(dict(TABLE_2)))
    cells = np.log([*TABLE_2.values()])
    left = cells - cells.mean(axis=0) - cells.mean(axis=1)[:, None] + cells.mean()
    assert found.deviations["run"].value == pytest.approx(math.sqrt(np.sum(left**2) / 8), rel=1e-3)
    assert found.deviations["rate"].low == 0.0
    assert found.deviations["rate"].high > 0.9
    assert found.deviations["day"].low == 0.0
    assert found.hidden == {"unit": "all runs are of one unit"}
    assert found.next_unit is None
    assert found.mean.value == pytest.approx(math.exp(cells.mean()))


def test_paper_table_1_has_one_cell_that_the_others_do_not_bear_out() -> None:
    found = repeatability(table_runs(dict(TABLE_1)))
    # Days scatter by less than runs let expect.
    assert found.deviations["day"].status == "upper bound"
    assert 0.05 < found.deviations["day"].high < 0.3
    (outlier,) = found.outliers
    assert table_runs(dict(TABLE_1))[outlier.index].value == 6.5700e-4
    assert outlier.mean_without < found.mean.value


def test_intervals_of_runs_are_known_errors() -> None:
    campaign = Campaign(
        {"unit": 0.2, "day": 0.1, "rate": 0.1, "run": 0.0}, np.random.default_rng(5), measured=0.1
    )
    runs = [
        Run(
            value=math.exp(value),
            low=math.exp(value - 1.959964 * math.sqrt(known)),
            high=math.exp(value + 1.959964 * math.sqrt(known)),
            labels=dict(zip(("unit", "day", "rate"), map(str, cell), strict=True)),
        )
        for value, known, cell in zip(
            campaign.design.values, campaign.design.variances, CELLS, strict=True
        )
    ]
    found = repeatability(runs)
    assert found.within == pytest.approx(math.sqrt(np.median(campaign.design.variances)), rel=1e-6)
    assert found.deviations["run"].low == 0.0
    bare = repeatability([Run(value=run.value, labels=run.labels) for run in runs])
    assert bare.deviations["run"].low > 0.05
    assert found.next_unit is not None
    assert set(found.next_day) == {"0", "1", "2"}


def close_runs(scatter: float, width: float) -> list[Run]:
    """Runs of 3 units, 3 days and 4 rates whose N scatters by less than its intervals say."""
    random = np.random.default_rng(8)
    return [
        Run(
            value=value,
            low=value * math.exp(-width),
            high=value * math.exp(width),
            labels=dict(zip(("unit", "day", "rate"), map(str, cell), strict=True)),
        )
        for cell in CELLS
        for value in [math.exp(scatter * random.normal())]
    ]


def test_runs_closer_than_their_intervals_show_no_scatter_that_is_zero() -> None:
    found = repeatability(close_runs(0.01, 0.1))
    assert "too wide" in found.hidden["run"]
    assert set(found.deviations) == {"unit", "day", "rate"}
    for one in found.deviations.values():
        assert one.status == "upper bound"
        assert one.low == 0.0
        # The means of 9 to 12 runs of 5 % each bound a scatter of theirs to some 5 %.
        assert 0.01 < one.value == one.high < 0.2


def test_runs_that_do_not_differ_say_nothing() -> None:
    runs = [Run(value=1e-8, labels={"unit": unit, "day": day}) for unit in "abc" for day in "1234"]
    found = repeatability(runs)
    assert found.deviations == {}
    assert found.hidden == dict.fromkeys(("unit", "day", "run"), "the runs do not differ")


def nested_runs(same_date: bool) -> tuple[list[Run], np.ndarray]:
    """Runs of 4 units on 3 dates of their own each, or on one; and means of ln N of the units."""
    random = np.random.default_rng(4)
    effects = [0.3, -0.3, 0.1, -0.2]
    runs = [
        Run(
            value=math.exp(effects[unit] + 0.02 * random.normal()),
            labels={
                "unit": "abcd"[unit],
                "day": f"2026-{unit + 1:02d}-{1 + day * (not same_date):02d}",
            },
        )
        for unit in range(4)
        for day in range(3)
        for _ in range(2)
    ]
    return runs, np.log([run.value for run in runs]).reshape(4, -1).mean(axis=1)


@pytest.mark.parametrize("same_date", [False, True])
def test_units_measured_one_after_another_scatter_as_units(same_date: bool) -> None:
    """Days of one unit each are within it: the mean is Student's t of the means of units."""
    runs, means = nested_runs(same_date)
    found = repeatability(runs)
    reach = stats.t.ppf(0.975, 3) * np.std(means, ddof=1) / 2.0
    assert math.log(found.mean.high / found.mean.value) == pytest.approx(reach, rel=1e-6)
    assert found.deviations["unit"].value == pytest.approx(np.std(means, ddof=1), rel=0.01)
    assert found.next_unit is not None
    assert found.next_unit.low < found.mean.low
    if same_date:
        assert found.drift is None
        assert found.hidden == {
            "day": "each unit has its own day, so that its scatter is that of units"
        }
    else:
        # Units differ by up to 0.6 between dates a month apart, the dates of each by 0.02.
        assert found.drift is not None
        assert -0.05 < found.drift.low < 0.0 < found.drift.high < 0.05
        assert found.deviations["day"].high < 0.1


def test_units_or_days_of_one_run_each_foretell_the_next() -> None:
    random = np.random.default_rng(4)
    values = np.exp(0.01 * np.arange(10) + 0.001 * random.standard_normal(10))
    days = [{"unit": "a", "day": f"2026-03-{day:02d}"} for day in range(1, 11)]
    found = repeatability([Run(value=v, labels=one) for v, one in zip(values, days, strict=True)])
    assert found.drift is not None
    assert found.drift.low < 0.01 < found.drift.high < 0.011
    assert set(found.next_day) == {"a"}
    assert found.hidden["day"] == "each run has its own day, so that its scatter is that of runs"
    units = [{"unit": str(unit), "day": "2026-03-01"} for unit in range(10)]
    found = repeatability([Run(value=v, labels=one) for v, one in zip(values, units, strict=True)])
    reach = stats.t.ppf(0.975, 9) * np.std(np.log(values), ddof=1) * math.sqrt(1.1)
    assert found.next_unit is not None
    assert math.log(found.next_unit.high / found.mean.value) == pytest.approx(reach, rel=1e-6)
    assert found.next_day == {}
    assert found.drift is None


def test_a_run_without_a_unit_is_a_unit_of_its_own() -> None:
    runs, _ = nested_runs(same_date=True)
    found = repeatability([*runs, replace(runs[0], labels={})])
    assert found.deviations["unit"].low > 0.1
    assert found.mean.high / found.mean.low > 1.3


def test_dates_show_a_drift() -> None:
    runs = [
        Run(
            value=1e-8 * math.exp(0.01 * day) * (1.0 + 1e-4 * (-1) ** repeat),
            labels={"unit": "a", "day": f"2026-03-{day:02d}"},
        )
        for day in (1, 5, 9, 20)
        for repeat in range(2)
    ]
    drift = repeatability(runs).drift
    assert drift is not None
    assert drift.low < 0.01 < drift.high
    assert drift.value == pytest.approx(0.01, rel=1e-3)


def test_too_few_runs_are_refused_with_a_remedy() -> None:
    runs = [Run(value=1.0, labels={"unit": "a"}), Run(value=1.1, labels={"unit": "b"})]
    with pytest.raises(RecordingError, match="2 runs cannot tell"):
        repeatability(runs)


def test_wrong_runs_are_refused() -> None:
    with pytest.raises(ValueError, match="above zero"):
        Run(value=0.0)
    with pytest.raises(ValueError, match="within"):
        Run(value=1.0, low=2.0, high=3.0)
