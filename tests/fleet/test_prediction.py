import numpy as np
import pytest
from scipy.stats import t

from sagnac.fleet.design import restricted_components
from sagnac.fleet.study import Outlook
from tests.fleet.examples import DYESTUFF, Campaign, design_of


def test_mean_of_one_factor_is_students_t_of_its_levels() -> None:
    outlook = Outlook(design=DYESTUFF, components=restricted_components(DYESTUFF))
    batches = DYESTUFF.values.reshape(6, 5).mean(axis=1)
    assert outlook.mean.value == pytest.approx(1527.5)
    assert outlook.mean.error == pytest.approx(np.std(batches, ddof=1) / np.sqrt(6), rel=1e-6)
    low, high = t.interval(0.95, 5, loc=1527.5, scale=outlook.mean.error)
    assert outlook.mean.reach(0.95) == pytest.approx(0.5 * (high - low), rel=1e-6)


@pytest.mark.parametrize("wide", [0.015, 0.18])
def test_two_runs_of_wide_intervals_leave_the_rest_as_sure_as_it_was(wide: float) -> None:
    """24 units of one run each, 4 % apart; without the two, Student's t of 22 is the answer."""
    values = np.random.default_rng(3).normal(0.0, 0.04, 24)
    known = np.full(24, 0.015**2)
    known[:2] = wide**2
    design = design_of(values, {}, known)
    outlook = Outlook(design=design, components=restricted_components(design))
    rest = values if wide == 0.015 else values[2:]
    spread = np.std(rest, ddof=1)
    # What is known to 18 % still says a little of the mean of what scatters by 4 %.
    near = 1e-6 if wide == 0.015 else 0.05
    assert outlook.mean.error == pytest.approx(spread / np.sqrt(rest.size), rel=near)
    assert outlook.further_run({}).error == pytest.approx(
        spread * np.sqrt(1.0 + 1.0 / rest.size), rel=near
    )


def test_further_run_of_a_known_level_is_shrunk_towards_the_mean() -> None:
    outlook = Outlook(design=DYESTUFF, components=restricted_components(DYESTUFF))
    batch = float(DYESTUFF.values[:5].mean())
    share = 1764.05 / (1764.05 + 2451.25 / 5)
    wanted = 1527.5 + share * (batch - 1527.5)
    assert outlook.further_run({"batch": "A"}).value == pytest.approx(wanted, rel=1e-6)
    assert outlook.further_run({}).value == pytest.approx(1527.5)
    assert outlook.further_run({"batch": "A"}).error < outlook.further_run({}).error


def test_prediction_error_is_that_of_a_simulation_with_many_levels() -> None:
    truth = {"unit": 0.2, "day": 0.15, "rate": 0.1, "run": 0.05}
    random = np.random.default_rng(8)
    campaigns = [Campaign(truth, random) for _ in range(60)]
    squares, foretold = [], []
    for campaign in campaigns:
        components = restricted_components(campaign.design)
        further = Outlook(design=campaign.design, components=components).further_run({})
        squares.append((further.value - campaign.next_unit) ** 2)
        foretold.append(further.error**2)
    # Either mean of 60 scatters by some 20 %.
    assert np.mean(squares) == pytest.approx(np.mean(foretold), rel=0.6)
