"""Records and choices that the tests of this room share."""

from typing import get_args

import numpy as np

from sagnac.stability import Estimator

ESTIMATORS = get_args(Estimator)


WITH_GAPS = ("adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "haar")


def nbs14(count):
    numbers = [1234567890]
    while len(numbers) < count:
        numbers.append(16807 * numbers[-1] % 2147483647)
    return np.array(numbers) / 2147483647


THOUSAND_POINTS = nbs14(1000)
