"""Whether intervals hold as often as they say: 500 campaigns of 3 units, 3 days and 4 rates."""

import numpy as np
import pytest

from sagnac.fleet.design import draws_of, restricted_components
from sagnac.fleet.study import Outlook
from tests.fleet.examples import Campaign, design_of

CAMPAIGNS = 500


@pytest.mark.statistics
@pytest.mark.parametrize(
    "truth",
    [
        {"unit": 0.10, "day": 0.30, "rate": 0.10, "run": 0.05},
        {"unit": 0.20, "day": 0.15, "rate": 0.10, "run": 0.05},
    ],
    ids=["days rule", "units rule"],
)
def test_intervals_hold_93_to_97_times_in_100(truth: dict[str, float]) -> None:
    random = np.random.default_rng(20)
    held = dict.fromkeys((*truth, "mean", "next unit", "next day", "next day and rate"), 0)
    for number in range(CAMPAIGNS):
        campaign = Campaign(truth, random)
        draws = draws_of(campaign.design, count=2000, seed=number)
        for name, variance in draws.items():
            low, high = np.quantile(variance, [0.025, 0.975])
            held[name] += bool(low <= truth[name] ** 2 <= high)
        outlook = Outlook(design=campaign.design, components=restricted_components(campaign.design))
        for name, located, true in (
            ("mean", outlook.mean, 0.0),
            ("next unit", outlook.further_run({}), campaign.next_unit),
            ("next day", outlook.further_run({"unit": "0", "rate": "0"}), campaign.next_day),
            ("next day and rate", outlook.further_run({"unit": "0"}), campaign.next_day_and_rate),
        ):
            held[name] += bool(abs(located.value - true) <= located.reach(0.95))
    shares = {name: count / CAMPAIGNS for name, count in held.items()}
    print(shares)
    assert all(0.93 <= share <= 0.97 for share in shares.values()), shares


@pytest.mark.statistics
@pytest.mark.parametrize("truth", [(0.30, 0.05, 0.03), (0.10, 0.10, 0.03)], ids=["units", "both"])
def test_intervals_hold_if_every_unit_has_days_of_its_own(truth: tuple[float, ...]) -> None:
    """5 units on 4 days each that no other has, two runs a day: days lie within units."""
    random = np.random.default_rng(21)
    names = ("unit", "day", "run")
    held = dict.fromkeys((*names, "mean", "next unit", "next day"), 0)
    cells = [(unit, day) for unit in range(5) for day in range(4) for _ in range(2)]
    labels = {
        "unit": tuple(str(unit) for unit, _ in cells),
        "day": tuple(f"{unit}.{day}" for unit, day in cells),
    }
    for number in range(CAMPAIGNS):
        units, days = random.normal(0.0, truth[0], 6), random.normal(0.0, truth[1], (6, 5))
        runs = np.hypot(truth[2], 0.01) * random.standard_normal(len(cells) + 1)
        values = [units[unit] + days[unit, day] for unit, day in cells] + runs[1:]
        design = design_of(values, labels, 1e-4)
        for name, variance in draws_of(design, count=2000, seed=number).items():
            low, high = np.quantile(variance, [0.025, 0.975])
            held[name] += bool(low <= truth[names.index(name)] ** 2 <= high)
        outlook = Outlook(design=design, components=restricted_components(design))
        for name, located, true in (
            ("mean", outlook.mean, 0.0),
            ("next unit", outlook.further_run({}), units[5] + days[5, 4] + runs[0]),
            ("next day", outlook.further_run({"unit": "0"}), units[0] + days[0, 4] + runs[0]),
        ):
            held[name] += bool(abs(located.value - true) <= located.reach(0.95))
    shares = {name: count / CAMPAIGNS for name, count in held.items()}
    print(shares)
    assert all(0.93 <= share <= 0.97 for share in shares.values()), shares


@pytest.mark.statistics
@pytest.mark.parametrize("wide", [(0.18,), (0.15, 0.07), (0.1,) * 4])
@pytest.mark.parametrize("honest", [True, False], ids=["as wide", "as the rest"])
def test_intervals_hold_beside_runs_that_are_known_less_well(wide, honest) -> None:
    """24 units, some with intervals of 10 to 18 %, which are as far off as these say, or less."""
    random, held = np.random.default_rng(22), np.zeros(2)
    known = np.full(24, 0.015)
    known[: len(wide)] = wide
    for _ in range(CAMPAIGNS):
        off = (known if honest else 0.015) * random.standard_normal(24)
        design = design_of(random.normal(0.0, 0.04, 24) + off, {}, known**2)
        outlook = Outlook(design=design, components=restricted_components(design))
        further = random.normal(0.0, np.hypot(0.04, 0.015))
        for place, (located, true) in enumerate(
            ((outlook.mean, 0.0), (outlook.further_run({}), further))
        ):
            held[place] += abs(located.value - true) <= located.reach(0.95)
    shares = held / CAMPAIGNS
    print(shares)
    assert np.all((shares >= 0.92) & (shares <= 0.98)), shares
