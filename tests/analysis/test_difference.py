"""The difference of two gyros as the noise of one."""

import numpy as np
import pytest

from sagnac.analysis.measurement import Measurement


@pytest.mark.parametrize("parts", [(1.0, 1.0), (1.2, 0.56**0.5)])
def test_noise_of_a_difference_is_the_mean_square_of_the_two(parts):
    first, second = np.random.default_rng(1).standard_normal((2, 100_000)) * [[1.0], [3.0]]
    mean = (parts[0] ** 2 * 1.0 + parts[1] ** 2 * 9.0) / 2.0
    angle = parts[0] * first - parts[1] * second
    weights = (parts[0], -parts[1])
    pair = Measurement(
        channel="x-z", angle=angle, gyros=("x", "z"), sample_rate=1.0, weights=weights
    )
    assert np.var(pair.noise(angle)) == pytest.approx(mean, rel=0.02)
