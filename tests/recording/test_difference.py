"""The one factor between a difference of gyros and a gyro."""

import pytest

from sagnac.recording.channel import per_gyro


def test_the_factor_of_a_difference():
    assert per_gyro(9.0, 1) == 3.0
    assert per_gyro(18.0, 2) == 3.0
    for wrong in (0, 3, -1):
        with pytest.raises(ValueError, match=r"use 1 \(a gyro\) or 2 \(a pair\)"):
            per_gyro(1.0, wrong)
