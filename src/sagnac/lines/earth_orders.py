"""Orders that Earth rate makes on the table, and how large they can be."""

from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.lines.components import MOST_ORDERS
from sagnac.lines.joint_fit import order_sums
from sagnac.lines.turning import Turning, mean_square_step, speeds
from sagnac.table.earth import LARGEST_EARTH_RATE
from sagnac.table.turns import mean_rate

# Angles that are kept at the least.
_FEWEST_ANGLES: Final = 10_000


def earth_amplitudes(turns: Turning) -> FloatArray:
    """(orders,) largest amplitude, rad, that Earth rate on an unsteady table puts into each order.

    0 for order 1, in which Earth rate and the harmonic are one at a steady table (Eq. 16).
    """
    orders = np.arange(1.0, MOST_ORDERS + 1.0)
    every, rate = _thinned(turns)
    length = every.size * mean_square_step(orders, speeds(every)) / 2.0
    steady = _steady_time(every, rate)
    largest = np.zeros(MOST_ORDERS)
    for function, whole, sign in ((np.cos, np.sin, 1.0), (np.sin, np.cos, -1.0)):

        def made(
            span: slice,
            function: np.ufunc = function,
            whole: np.ufunc = whole,
            sign: float = sign,
        ) -> FloatArray:
            here = every[span.start : span.stop + 1]
            return np.asarray(function(here[1:]) / rate - sign * steady * np.diff(whole(here)))

        steps = series.made(made, every.size - 1, every)
        sums = order_sums(steps, every, MOST_ORDERS)[1:]
        largest = np.maximum(largest, np.abs(sums) / np.maximum(length, np.finfo(float).tiny))
    largest[0] = 0.0
    return LARGEST_EARTH_RATE * largest


def _thinned(turns: Turning) -> tuple[FloatArray, float]:
    """Table angles, rad, at a lower rate, Hz: the table turns slowly beside the samples."""
    stride = max(1, int(1.0 / (MOST_ORDERS * turns.fastest + 1e-9)))
    stride = min(stride, max(1, turns.table.size // _FEWEST_ANGLES))
    return series.every(turns.table, stride), turns.sample_rate / stride


def _steady_time(table: FloatArray, rate: float) -> float:
    """Seconds in which the table turns by 1 rad on its way; 0 if it goes back and forth.

    Order 1 is what a steady table would make of Earth rate. It is taken out first: with ripple in
    the rate neighbouring orders are not orthogonal to it and would not show beside it.
    """
    net = float(table[-1] - table[0]) / (table.size - 1) * rate
    return 1.0 / net if abs(net) > 0.5 * abs(mean_rate(table, rate)) else 0.0
