"""Cluster times asked for."""

import numpy as np
import pytest

from sagnac.stability.curve import stability_curve
from sagnac.stability.estimators import properties_of
from sagnac.stability.noise_type import cluster_sizes
from tests.stability.examples import THOUSAND_POINTS


def test_taus_are_rounded_merged_and_told():
    curve = stability_curve(
        THOUSAND_POINTS, kind="rate", sample_rate=10.0, taus=[0.1, 0.1000000001, 1.04]
    )
    texts = [note.text for note in curve.notes]
    assert curve.tau == pytest.approx([0.1, 1.0])
    assert "1 of 3 taus rounded to a multiple of the sample interval" in texts
    assert "1 of 3 taus coincide and are merged" in texts


def test_masked_taus_are_left_out():
    taus = np.ma.masked_array([0.1, 0.5, 1.0], mask=[False, True, False])
    curve = stability_curve(THOUSAND_POINTS, kind="rate", sample_rate=10.0, taus=taus)
    assert curve.tau == pytest.approx([0.1, 1.0])


@pytest.mark.parametrize(
    ("estimator", "sizes"),
    [("haar", [1, 2, 4, 8, 16, 32]), ("theo1", [10, 12, 14, 16]), ("ohdev", [1, 2, 3, 4])],
)
def test_default_clusters_follow_the_row(estimator, sizes):
    found, notes = cluster_sizes(None, 101, 1.0, properties_of(estimator))
    assert found[: len(sizes)].tolist() == sizes
    assert notes == ()


def test_a_time_just_out_of_range_differs_from_the_limit_in_the_message():
    asked = r"1200001 s is out of range for oadev; use 1 s to 1200000 s"
    with pytest.raises(ValueError, match=asked):
        cluster_sizes([1200001.0], 2_400_001, 1.0, properties_of("oadev"))
