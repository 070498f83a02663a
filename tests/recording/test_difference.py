"""The difference of two gyros as a signal of one."""

import numpy as np
import pytest

from sagnac.recording.channel import as_one_gyro


@pytest.mark.parametrize("parts", [(1.0, 1.0), (1.2, 0.56**0.5)])
def test_noise_of_a_difference_is_the_mean_square_of_the_two(parts):
    first, second = np.random.default_rng(1).standard_normal((2, 100_000)) * [[1.0], [3.0]]
    mean = (parts[0] ** 2 * 1.0 + parts[1] ** 2 * 9.0) / 2.0
    found = np.var(as_one_gyro(parts[0] * first - parts[1] * second))
    assert found == pytest.approx(mean, rel=0.02)
