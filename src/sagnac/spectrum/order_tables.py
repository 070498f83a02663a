"""Fourier sums over table angle at low orders, by a table of Taylor polynomials over one turn.

A sum of whole orders is a smooth function of one angle: its Taylor polynomials about even angles,
fine enough, give it anywhere to rounding. The other way round, each sample adds the powers of its
distance from the nearest even angle to a table, whose Fourier transforms are the sums. Up to order
`HIGHEST` that is four times quicker than a non-uniform transform good to 1e-9 of the sums.
"""

from functools import lru_cache
from math import factorial
from typing import Final

import numpy as np

from sagnac.arrays import ComplexArray, FloatArray
from sagnac.spectrum import _kernels

# Even angles of a turn, a power of two. With eight coefficients the remainder at the highest
# order, half a step away, is (pi * HIGHEST / POINTS)^8 / 8!: below 1e-15.
_POINTS: Final = 2**14
HIGHEST: Final = 256


def table_series(phase: FloatArray, sums: ComplexArray) -> FloatArray:
    """Real part of the sum of ``sums[k] * exp(1j * k * phase)`` over k.

    Parameters
    ----------
    phase
        (samples,) rad; any real number.
    sums
        (orders + 1,) for k = 0 ... orders, no more than `HIGHEST`, in any unit.

    Returns
    -------
    (samples,) in the unit of the sums.
    """
    series = np.empty(phase.size)
    # Read-only as the table is: what may be written to would be compiled for once more.
    phase = phase.view()
    phase.flags.writeable = False
    _kernels.table_evaluated(phase, _polynomials(sums.tobytes()), series)
    return series


@lru_cache(maxsize=2)
def _polynomials(sums: bytes) -> FloatArray:
    """(points, terms) of complex sums; kept, since every block of a record asks for them."""
    coefficients = np.frombuffer(sums, dtype=np.complex128)
    steps = 1j * np.arange(coefficients.size) * (2.0 * np.pi / _POINTS)
    table = np.empty((_POINTS, _kernels.TERMS))
    for power in range(_kernels.TERMS):
        derivative = np.zeros(_POINTS // 2 + 1, dtype=np.complex128)
        derivative[: coefficients.size] = coefficients * steps**power / factorial(power)
        derivative[1:] *= 0.5
        table[:, power] = np.fft.irfft(derivative, _POINTS, norm="forward")
    table.flags.writeable = False
    return table


def table_sums(phase: FloatArray, strengths: FloatArray, orders: int) -> ComplexArray:
    """Sums of ``strengths * exp(-1j * k * phase)`` for k = 0 ... `orders`.

    Parameters
    ----------
    phase
        (samples,) rad; any real number.
    strengths
        (samples,) real.
    orders
        No more than `HIGHEST`.

    Returns
    -------
    (orders + 1,) in the unit of the strengths.
    """
    table = np.zeros((_POINTS, _kernels.TERMS))
    _kernels.table_gathered(phase, strengths, table)
    steps = -1j * np.arange(orders + 1) * (2.0 * np.pi / _POINTS)
    sums = np.zeros(orders + 1, dtype=np.complex128)
    for power in range(_kernels.TERMS):
        sums += np.fft.rfft(table[:, power])[: orders + 1] * steps**power / factorial(power)
    return sums
