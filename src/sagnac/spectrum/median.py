"""The median of many values, quickly."""

import numpy as np

from sagnac.arrays import FloatArray


def median(values: FloatArray) -> float:
    """The median, by one partition.

    `numpy.median` looks for both middle values of an even number by a partition of two places, for
    which numpy has no vector instructions: that takes four times as long.

    Parameters
    ----------
    values
        (samples,), finite, one or more.

    Examples
    --------
    >>> import numpy as np
    >>> median(np.arange(2001.0))
    1000.0
    """
    half = values.size // 2
    parted = np.partition(values, half)
    higher = float(parted[half])
    return higher if values.size % 2 else 0.5 * (float(parted[:half].max()) + higher)
