"""Whether intervals hold as often as they say: 500 campaigns of 3 units, 3 days and 4 rates."""

import numpy as np
import pytest

from sagnac.fleet.design import draws_of, restricted_components
from sagnac.fleet.study import Outlook
from tests.fleet.examples import Campaign

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
