import numpy as np
import pytest

from sagnac.fleet.design import restricted_components
from sagnac.fleet.study import Outlook, departures, slope_of_days
from tests.fleet.examples import CELLS, Campaign, design_of

TRUTH = {"unit": 0.3, "day": 0.2, "rate": 0.1, "run": 0.05}


def even(values, labels) -> Outlook:
    """Runs whose effects all scatter alike."""
    return Outlook(
        design=design_of(values, labels), components=dict.fromkeys((*labels, "run"), 1.0)
    )


def test_run_that_was_spoilt_is_named_and_foretold_from_the_others() -> None:
    campaign = Campaign(TRUTH, np.random.default_rng(1))
    values = campaign.design.values.copy()
    values[17] += 0.6
    design = design_of(values, campaign.design.factors, campaign.design.variances)
    components = restricted_components(design)
    (found,) = departures(design, components)
    assert found.index == 17
    kept = [index for index in range(36) if index != 17]
    rest = design_of(
        values[kept],
        {name: tuple(labels[index] for index in kept) for name, labels in design.factors.items()},
        design.variances[kept],
    )
    known = {name: labels[17] for name, labels in design.factors.items()}
    outlook = Outlook(design=rest, components=components)
    assert found.foretold == pytest.approx(outlook.further_run(known).value, rel=1e-9)
    assert found.mean_without == pytest.approx(outlook.mean.value, rel=1e-9)


def test_a_run_is_no_surer_than_its_own_interval() -> None:
    """Of twelve that lie closer than their intervals, one twice as loud was 300221 of them off."""
    random, error = np.random.default_rng(3), 0.01
    alike = 0.3 * error * random.standard_normal(12)
    loud = alike.copy()
    loud[4] = np.log(2.0)
    off = loud[4] - np.delete(loud, 4).mean()
    design = design_of(loud, {}, np.full(12, error**2))
    (found,) = departures(design, restricted_components(design))
    assert found.index == 4
    # With the error of the mean of the others it would be 4 % less.
    assert found.deviations == pytest.approx(off / error, rel=0.05)
    design = design_of(alike, {}, np.full(12, error**2))
    assert departures(design, restricted_components(design)) == ()


@pytest.mark.parametrize("campaigns", [50, pytest.param(100, marks=pytest.mark.statistics)])
def test_sound_campaigns_have_few_outliers(campaigns) -> None:
    random = np.random.default_rng(2)
    named = 0
    for _ in range(campaigns):
        design = Campaign(TRUTH, random).design
        named += bool(departures(design, restricted_components(design)))
    assert named <= 0.1 * campaigns


def test_slope_of_days_is_that_of_their_means() -> None:
    labels = {"day": tuple(str(cell[1]) for cell in CELLS), "unit": tuple(str(c[0]) for c in CELLS)}
    day = np.array([cell[1] for cell in CELLS], dtype=float)
    values = 0.1 * day + np.array([0.0, 0.02, -0.02])[np.array([cell[0] for cell in CELLS])]
    values += np.tile([0.001, -0.001, 0.0, 0.0], 9)
    slope = slope_of_days(even(values, labels), labels["day"], confidence=0.95)
    assert slope is not None
    assert slope.value == pytest.approx(0.1)
    bent = values + 0.01 * (day == 1.0)
    slope = slope_of_days(even(bent, labels), labels["day"], confidence=0.95)
    assert slope is not None
    # The days stand -1/3, 2/3 and -1/3 of 0.01 off the line; t of one degree is 12.706.
    error = 0.01 * np.sqrt(6.0 / 9.0) / np.sqrt(2.0)
    assert slope.high - slope.value == pytest.approx(12.706 * error, rel=1e-3)
