"""Differences of gyros: the one factor, and the Groslambert covariance."""

import numpy as np
import pytest

from sagnac.coefficients.three_cornered_hat import groslambert_covariance
from sagnac.recording.difference import per_gyro


@pytest.fixture(scope="module")
def published_phases():
    """The three phases behind the published GCODEV, in the generator they were drawn with."""
    generator = np.random.RandomState(42)
    a, b, c = (scale * generator.randn(100_000) for scale in (1.0, 5.0, 10.0))
    return {"AB": a - b, "BC": b - c, "CA": c - a}


@pytest.mark.parametrize(
    ("pair", "published"),
    [
        (("AB", "CA"), -1.5822698768801253),
        (("AB", "BC"), -8.657226505796759),
        (("CA", "BC"), -17.32687362696734),
    ],
)
def test_groslambert_covariance_against_sigmatheta(published_phases, pair, published):
    covariance = groslambert_covariance(
        published_phases[pair[0]],
        published_phases[pair[1]],
        kind="angle",
        sample_rate=1.0,
        taus=[1.0],
    )[0]
    assert np.sign(covariance) * np.sqrt(abs(covariance)) == pytest.approx(published, abs=1e-10)


def test_groslambert_covariance_of_a_signal_with_itself_is_its_allan_variance():
    generator = np.random.default_rng(1)
    rate = generator.standard_normal(400) + 5.0
    clusters = [1, 3, 10]
    expected = []
    for cluster in clusters:
        means = np.array(
            [rate[start : start + cluster].mean() for start in range(rate.size - cluster + 1)]
        )
        expected.append(0.5 * np.mean((means[cluster:] - means[:-cluster]) ** 2))
    for kind, values in (
        ("rate", rate),
        ("increment", rate * 0.5),
        ("angle", np.concatenate([[0.0], np.cumsum(rate * 0.5)])),
    ):
        measured = groslambert_covariance(
            values, values, kind=kind, sample_rate=2.0, taus=np.array(clusters) / 2.0
        )
        assert measured == pytest.approx(np.array(expected), rel=1e-10)


def test_groslambert_covariance_is_bilinear_and_symmetric():
    generator = np.random.default_rng(2)
    one, two, three = generator.standard_normal((3, 300))

    def covariance(first, second):
        return groslambert_covariance(
            first, second, kind="rate", sample_rate=1.0, taus=[1.0, 7.0, 150.0]
        )

    assert covariance(one, two) == pytest.approx(covariance(two, one))
    assert covariance(2.0 * one + three, two) == pytest.approx(
        2.0 * covariance(one, two) + covariance(three, two)
    )


def test_the_factor_of_a_difference():
    assert per_gyro(9.0, 1) == 3.0
    assert per_gyro(18.0, 2) == 3.0
    for wrong in (0, 3, -1):
        with pytest.raises(ValueError, match=r"use 1 \(a gyro\) or 2 \(a pair\)"):
            per_gyro(1.0, wrong)


def test_groslambert_covariance_refuses_what_does_not_fit():
    with pytest.raises(ValueError, match="give one span"):
        groslambert_covariance(np.zeros(10), np.zeros(11), kind="rate", sample_rate=1.0, taus=[1.0])
    with pytest.raises(ValueError, match="give 1 to 5 of them"):
        groslambert_covariance(np.zeros(10), np.zeros(10), kind="rate", sample_rate=1.0, taus=[6.0])
