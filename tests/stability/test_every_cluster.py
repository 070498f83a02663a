"""The Allan deviation at every cluster time, against plain sums."""

import math

import numpy as np
import pytest

from sagnac.stability.curve import deviation_at_every_tau
from tests import naive_stability as naive


@pytest.mark.parametrize("kind", ["rate", "angle"])
@pytest.mark.parametrize("samples", [3, 4, 65, 66, 67, 130, 401])
def test_every_cluster_is_the_naive_one(kind, samples):
    values = np.random.default_rng(samples).standard_normal(samples)
    tau, deviation = deviation_at_every_tau(values, kind=kind, sample_rate=2.0)
    x = naive.angle(values) if kind == "rate" else values
    assert tau.tolist() == [m / 2.0 for m in range(1, (len(x) - 1) // 2 + 1)]
    unit = 1.0 if kind == "rate" else 2.0
    for m in range(1, tau.size + 1):
        variance, _ = naive.oadev(x, m)
        assert deviation[m - 1] == pytest.approx(unit * math.sqrt(variance), rel=1e-9)


@pytest.mark.parametrize("name", ["white", "random walk", "line", "white on a ramp"])
def test_long_records_keep_their_digits(name):
    """A walk or a ramp is a thousand times its differences: plain sums of the angle say."""
    samples = 200_000
    generator = np.random.default_rng(5)
    white = generator.standard_normal(samples)
    rate = {
        "white": white,
        "random walk": np.cumsum(white),
        "line": white + 1e3 * np.sin(np.arange(samples)),
        "white on a ramp": white + 1e-3 * np.arange(samples),
    }[name]
    _, deviation = deviation_at_every_tau(rate, kind="rate", sample_rate=1.0)
    x = np.concatenate([[0.0], np.cumsum(rate - rate.mean())])
    clusters = np.concatenate([generator.integers(1, 100_001, 60), np.geomspace(1, 1e5, 40)])
    for m in clusters.astype(int):
        differences = x[2 * m :] - 2.0 * x[m:-m] + x[: -2 * m]
        direct = math.sqrt(np.mean(differences**2) / 2.0) / m
        assert deviation[m - 1] == pytest.approx(direct, rel=1e-9)
