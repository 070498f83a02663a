import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import multivariate_normal

from sagnac.fleet.design import restricted_components
from tests.fleet.examples import CELLS, DYESTUFF, Campaign, design_of

TRUTH = {"unit": 0.3, "day": 0.2, "rate": 0.2, "run": 0.05}


def test_dyestuff_has_the_published_estimates() -> None:
    found = restricted_components(DYESTUFF)
    assert found["batch"] == pytest.approx(1764.05, rel=1e-4)
    assert found["run"] == pytest.approx(2451.25, rel=1e-4)


def test_balanced_design_gives_the_analysis_of_variance() -> None:
    design = Campaign(TRUTH, np.random.default_rng(3), measured=0.0).design
    cube = design.values.reshape(3, 3, 4)
    mean = cube.mean()
    unit, day, rate = (cube.mean(axis=axes) - mean for axes in ((1, 2), (0, 2), (0, 1)))
    left = cube - mean - unit[:, None, None] - day[None, :, None] - rate[None, None, :]
    run = np.sum(left**2) / 28
    found = restricted_components(design)
    assert found["run"] == pytest.approx(run, rel=1e-4)
    assert found["unit"] == pytest.approx((6 * unit @ unit - run) / 12, rel=1e-4)
    assert found["day"] == pytest.approx((6 * day @ day - run) / 12, rel=1e-4)
    assert found["rate"] == pytest.approx((3 * rate @ rate - run) / 9, rel=1e-4)


def test_unbalanced_design_gives_the_most_likely_contrasts() -> None:
    whole = Campaign(TRUTH, np.random.default_rng(4), measured=0.05).design
    kept = [index for index in range(len(CELLS)) if index % 5]
    design = design_of(
        whole.values[kept],
        {name: tuple(labels[index] for index in kept) for name, labels in whole.factors.items()},
        whole.variances[kept],
    )
    # Successive differences are contrasts free of the mean, whatever their covariance.
    contrasts = np.diff(np.eye(len(kept)), axis=0)
    blocks = [design.incidence(name) @ design.incidence(name).T for name in design.factors]

    def loss(roots: np.ndarray) -> float:
        covariance = np.diag(design.variances + roots[3] ** 2)
        covariance = covariance + sum(
            root**2 * block for root, block in zip(roots[:3], blocks, strict=True)
        )
        density = multivariate_normal(cov=contrasts @ covariance @ contrasts.T)
        return -float(density.logpdf(contrasts @ design.values))

    best = minimize(loss, list(TRUTH.values()), method="Nelder-Mead", options={"xatol": 1e-6})
    found = restricted_components(design)
    found_roots = np.sqrt([*found.values()])
    assert loss(found_roots) <= best.fun + 1e-6
    assert found_roots == pytest.approx(np.abs(best.x), rel=2e-3)
