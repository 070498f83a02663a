"""The gallery of troublesome gyros."""

import numpy as np
import pytest
from benchmarks.gallery import GALLERY, Gyro

RATE = 100.0


@pytest.mark.parametrize("name", list(GALLERY))
def test_gallery_makes_what_it_says(name):
    gyro = GALLERY[name](np.random.default_rng(20), 6000, RATE)
    assert gyro.increments.shape == (6000,)
    assert np.isfinite(gyro.increments).all()
    assert gyro.angle_random_walk > 0.0


def test_a_negative_coefficient_is_refused():
    with pytest.raises(ValueError, match="zero or more"):
        Gyro(walk=-1.0)
