"""Cluster times asked for."""

import pytest

from sagnac.stability.curve import stability_curve
from tests.stability.examples import THOUSAND_POINTS


def test_taus_are_rounded_merged_and_told():
    curve = stability_curve(
        THOUSAND_POINTS, kind="rate", sample_rate=10.0, taus=[0.1, 0.1000000001, 1.04]
    )
    texts = [note.text for note in curve.notes]
    assert curve.tau == pytest.approx([0.1, 1.0])
    assert "1 of 3 taus rounded to a multiple of the sample interval" in texts
    assert "1 of 3 taus coincide and are merged" in texts
