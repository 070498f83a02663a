"""Compiled loops of spectra: arrays in, arrays out; no validation, no files."""

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.kernels import compiled


@compiled(nogil=True, fastmath=True)
def table_evaluated(phase: FloatArray, table: FloatArray, series: FloatArray) -> None:
    """Fill `series` with the polynomials of `table`, (points, terms), nearest to each phase."""
    points, terms = table.shape
    a_radian = points / (2.0 * np.pi)
    for n in range(phase.size):
        place = phase[n] * a_radian
        nearest = np.floor(place + 0.5)
        offset = place - nearest
        row = table[int(nearest) % points]
        value = row[terms - 1]
        for power in range(terms - 2, -1, -1):
            value = value * offset + row[power]
        series[n] = value


@compiled(nogil=True, fastmath=True)
def table_gathered(phase: FloatArray, strengths: FloatArray, table: FloatArray) -> None:
    """Add each strength, times the powers of its offset, to the nearest row of `table`."""
    points, terms = table.shape
    a_radian = points / (2.0 * np.pi)
    for n in range(phase.size):
        place = phase[n] * a_radian
        nearest = np.floor(place + 0.5)
        offset = place - nearest
        row = table[int(nearest) % points]
        value = strengths[n]
        for power in range(terms):
            row[power] += value
            value *= offset
