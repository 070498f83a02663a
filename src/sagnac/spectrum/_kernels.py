"""Compiled loops of spectra: arrays in, arrays out; no validation, no files."""

from typing import Final

import numpy as np

from sagnac.core.arrays import ComplexArray, FloatArray
from sagnac.core.kernels import compiled

# Coefficients of a polynomial in a table: known here, the loops over them are unrolled.
TERMS: Final = 8


@compiled(fastmath=True)
def table_evaluated(phase: FloatArray, table: FloatArray, series: FloatArray) -> None:
    """Fill `series` with the polynomials of `table` nearest to each phase.

    `table` is (points, `TERMS`); the points are a power of two, so that a mask folds an angle
    into one turn.
    """
    points = table.shape[0]
    a_radian = points / (2.0 * np.pi)
    for n in range(phase.size):
        place = phase[n] * a_radian
        nearest = np.floor(place + 0.5)
        offset, row = place - nearest, int(nearest) & (points - 1)
        value = table[row, TERMS - 1]
        for power in range(1, TERMS):
            value = value * offset + table[row, TERMS - 1 - power]
        series[n] = value


@compiled(fastmath=True)
def table_gathered(phase: FloatArray, strengths: FloatArray, table: FloatArray) -> None:
    """Add each strength, times the powers of its offset, to the nearest row of such a table."""
    points = table.shape[0]
    a_radian = points / (2.0 * np.pi)
    for n in range(phase.size):
        place = phase[n] * a_radian
        nearest = np.floor(place + 0.5)
        offset, row = place - nearest, int(nearest) & (points - 1)
        value = strengths[n]
        for power in range(TERMS):
            table[row, power] += value
            value *= offset


@compiled(fastmath=True)
def tapered_power(transform: ComplexArray, turns: ComplexArray, power: FloatArray) -> None:
    """Fill `power` with the squares at every second frequency of `transform`, summed over tapers.

    The k-th sine taper is half the difference of two waves, so that the tapered transform is
    that of the sums k frequencies below and k above, turned by ``turns[k - 1]`` and back.
    """
    last = transform.size - 1
    for n in range(power.size):
        total = 0.0
        for order in range(1, turns.size + 1):
            below, above = 2 * n - order, 2 * n + order
            # A real series: what lies below zero or above half a cycle mirrors the rest.
            first = transform[below] if below >= 0 else np.conj(transform[-below])
            second = transform[above] if above <= last else np.conj(transform[2 * last - above])
            turn = turns[order - 1]
            tapered = turn * first - np.conj(turn) * second
            total += tapered.real**2 + tapered.imag**2
        power[n] = total


@compiled()
def times_levels(start: int, points: FloatArray, levels: FloatArray, series: FloatArray) -> None:
    """Multiply `series` by levels at the whole numbers from `start` on, linear between points."""
    n = 0
    last = points.size - 2
    for segment in range(last + 1):
        begin, end = points[segment], points[segment + 1]
        share = 1.0 / (end - begin)
        first, rise = levels[segment], levels[segment + 1] - levels[segment]
        # Before the first point and behind the last one the level stays.
        stop = series.size if segment == last else min(series.size, int(end) - start + 1)
        for place in range(n, stop):
            series[place] *= first + min(max((start + place - begin) * share, 0.0), 1.0) * rise
        n = max(n, stop)
