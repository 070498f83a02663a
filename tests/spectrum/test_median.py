"""The running median against that of scipy."""

import numpy as np
import pytest
from scipy.ndimage import median_filter

from sagnac.spectrum.power_laws import running_median


@pytest.mark.parametrize("size", [1, 5, 41, 300])
def test_the_running_median_is_that_of_scipy(size):
    values = np.random.default_rng(size).exponential(size=size)
    wanted = median_filter(values, 41, mode="nearest")
    np.testing.assert_array_equal(running_median(values, 41), wanted)
