"""What the intervals promise, over a thousand records."""

import numpy as np
import pytest

from sagnac.stability.curve import stability_curve
from tests import naive_stability as naive


@pytest.mark.statistics
@pytest.mark.parametrize("estimator", ["oadev", "mdev", "ohdev", "totdev"])
@pytest.mark.parametrize("alpha", [2, 0, -2])
def test_intervals_cover_the_truth(estimator, alpha):
    """95 % intervals over 1000 records of 10 000 samples; the truth is the mean over all.

    Seed 40. Clusters start at 2: at one sample the published degrees of freedom suppose
    band-limited noise, and sampled white rates have 15 % fewer.
    """
    generator = np.random.default_rng(40)
    clusters = np.array([2, 8, 32, 128, 512, 1024])
    runs = 1000
    curves = []
    for _ in range(runs):
        rates = naive.power_law_rates(generator, 10_000, alpha)
        curves.append(
            stability_curve(
                rates,
                kind="rate",
                sample_rate=1.0,
                estimator=estimator,
                taus=clusters,
                confidence=0.95,
            )
        )
    truth = np.sqrt(np.mean([curve.deviation**2 for curve in curves], axis=0))
    inside = [(curve.low <= truth) & (truth <= curve.high) for curve in curves]
    coverage = np.mean(inside, axis=0)
    cells = " | ".join(f"{100.0 * share:.1f} %" for share in coverage)
    print(f"| {estimator} | {alpha:+d} | {cells} |")
    assert np.all((coverage >= 0.93) & (coverage <= 0.97))
