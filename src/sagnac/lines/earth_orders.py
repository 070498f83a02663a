"""Orders that Earth rate makes on the table, and how large they can be."""

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.constants import EARTH_RATE
from sagnac.lines.components import MOST_ORDERS
from sagnac.lines.joint_fit import order_sums
from sagnac.lines.selection import mean_square_step, speeds
from sagnac.table.turns import mean_rate


def earth_amplitudes(table: FloatArray, sample_rate: float) -> FloatArray:
    """(orders,) largest amplitude, rad, that Earth rate on an unsteady table puts into each order.

    0 for order 1, in which Earth rate and the harmonic are one at a steady table (Eq. 16).
    """
    highest = MOST_ORDERS
    orders = np.arange(1.0, highest + 1.0)
    # The table turns slowly beside the samples: every so-many-th angle tells the same.
    stride = max(1, int(1.0 / (highest * float(speeds(table).max()) + 1e-9)))
    stride = min(stride, max(1, table.size // 10_000))
    every = series.every(table, stride)
    rate = sample_rate / stride
    length = every.size * mean_square_step(orders, speeds(every)) / 2.0
    largest = np.zeros(highest)
    # Order 1 is what a steady table would make of it; it goes first, since with ripple in the rate
    # neighbouring orders are not orthogonal to it and would not show beside it.
    net = float(every[-1] - every[0]) / (every.size - 1) * rate
    path = mean_rate(every, rate)
    steady = 1.0 / net if abs(net) > 0.5 * abs(path) else 0.0
    steps = series.empty(every.size - 1)
    for function, whole, sign in ((np.cos, np.sin, 1.0), (np.sin, np.cos, -1.0)):
        for span in series.spans(steps.size):
            here = every[span.start : span.stop + 1]
            steps[span] = function(here[1:]) / rate - sign * steady * np.diff(whole(here))
        sums = order_sums(steps, every, highest)[1:]
        largest = np.maximum(largest, np.abs(sums) / np.maximum(length, np.finfo(float).tiny))
    largest[0] = 0.0
    return 2.0 * EARTH_RATE * largest
