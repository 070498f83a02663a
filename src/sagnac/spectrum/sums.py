"""Fourier sums over uneven phases: table angle, and tones at any frequency.

A sum of whole orders is a smooth function of one angle: its Taylor polynomials about even angles,
fine enough, give it anywhere to rounding. The other way round, each sample adds the powers of its
distance from the nearest even angle to a table, whose Fourier transforms are the sums. Up to order
`HIGHEST` that is four times quicker than a non-uniform transform good to 1e-9 of the sums.
"""

from functools import lru_cache
from math import factorial
from typing import Final

import numpy as np
import scipy.fft

from sagnac.core.arrays import BLOCK, ComplexArray, FloatArray, blocks
from sagnac.core.errors import extra_module
from sagnac.spectrum import _kernels
from sagnac.spectrum.transforms import THREADS, TONE_WIDTH

_TURN: Final = 2.0 * np.pi
_NUFFT_TOLERANCE: Final = 1e-9
# Rounding of a phase below one turn that was made by a few multiplications, rad.
_ROUNDED: Final = 8.0 * np.finfo(np.float64).eps * _TURN
# Frequencies worked on at once: their tables take 12 MiB.
_TONES_AT_ONCE: Final = 512
# A frequency times a lag is exact where the first has 23 bits after the point and the second,
# counted in halves of a sample, 29.
_FREQUENCY_STEP: Final = 2.0**-23

# ---- low orders --------------------------------------------------------------------

# Even angles of a turn, a power of two. With eight coefficients the remainder at the highest
# order, half a step away, is (pi * HIGHEST / POINTS)^8 / 8!: below 1e-15.
_POINTS: Final = 2**14
HIGHEST: Final = 256
# Sums of a series that is a cosine or a sine: by a table they take a fifth to a half of the time.
COSINE: Final = np.array([0.0, 1.0 + 0.0j])
SINE: Final = -1j * COSINE


@lru_cache(maxsize=4)
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


# ---- sums --------------------------------------------------------------------------


def angle_sums(phase: FloatArray, strengths: FloatArray, orders: int) -> ComplexArray:
    """Sums of ``strengths * exp(-1j * k * phase)`` for k = 0 ... `orders`.

    Up to `HIGHEST` by a table; beyond, by one Fourier transform if the phase starts at 0 and makes
    one turn in even steps (time in units of a record over 2 pi), and by one NUFFT if not.

    Parameters
    ----------
    phase
        (samples,) rad; any real number, folded into one turn here.
    strengths
        (samples,) or (several, samples) real. Two take no longer than one.

    Returns
    -------
    (orders + 1,) or (several, orders + 1) in the unit of the strengths.

    Raises
    ------
    MissingExtra
        If finufft is needed and not installed.
    """
    several = np.atleast_2d(strengths)
    if orders <= HIGHEST:
        sums = np.zeros((several.shape[0], orders + 1), dtype=np.complex128)
        steps = -1j * np.arange(orders + 1) * (_TURN / _POINTS)
        for row, own in enumerate(several):
            table = np.zeros((_POINTS, _kernels.TERMS))
            _kernels.table_gathered(phase, own, table)
            for power in range(_kernels.TERMS):
                here = np.fft.rfft(table[:, power])[: orders + 1]
                sums[row] += here * steps**power / factorial(power)
    elif np.abs(phase - np.arange(phase.size) * (_TURN / phase.size)).max() <= _ROUNDED:
        # From the number of samples on the sums repeat.
        place = np.arange(orders + 1) % phase.size
        mirrored = place > phase.size // 2
        sums = scipy.fft.rfft(several)[:, np.where(mirrored, phase.size - place, place)]
        sums = np.where(mirrored, sums.conj(), sums)
    else:
        # The sums of real strengths at -k are the conjugates of those at k: two sets go into one
        # transform, as real and as imaginary part, and come apart again.
        paired = several[0::2].astype(np.complex128)
        paired.imag[: several.shape[0] // 2] = several[1::2]
        # Imported where it is used: few recordings need it.
        purpose = f"a sum over more than {HIGHEST} multiples of an uneven phase"
        finufft = extra_module("finufft", "nufft", purpose)
        how = {"eps": _NUFFT_TOLERANCE, "isign": -1, "nthreads": THREADS}
        modes = finufft.nufft1d1(np.remainder(phase, _TURN), paired, 2 * orders + 1, **how)
        modes = modes.reshape(paired.shape[0], 2 * orders + 1)
        ahead, behind = modes[:, orders:], modes[:, orders::-1].conj()
        sums = np.empty((several.shape[0], orders + 1), dtype=np.complex128)
        sums[0::2] = 0.5 * (ahead + behind)
        sums[1::2] = -0.5j * (ahead - behind)[: several.shape[0] // 2]
    return sums.reshape(*strengths.shape[:-1], orders + 1)


def angle_series(phase: FloatArray, sums: ComplexArray) -> FloatArray:
    """Real part of the sum of ``sums[k] * exp(1j * k * phase)`` over k, by a table.

    Parameters
    ----------
    phase
        (samples,) rad; any real number, folded into one turn here.
    sums
        (orders + 1,) for k = 0 ... orders, `HIGHEST` at the most, in any unit.

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


def tone_sums(values: FloatArray, frequencies: FloatArray) -> ComplexArray:
    """Sums of values times exp(2j pi f x), and times 2 pi x / (size + 1) besides, exactly.

    x is the number of the sample from the middle of the series, whose values are steps of one that
    is longer by one. The frequencies are any. Every block is a product of the samples, in rows,
    with a table of the waves along a row, and the rows are then brought into phase. The products
    are small: limit the BLAS to one thread.

    Parameters
    ----------
    values
        (samples,) in memory or mapped.
    frequencies
        (frequencies,) cycles per sample.

    Returns
    -------
    (2, frequencies).
    """
    sums = np.zeros((2, frequencies.size), dtype=np.complex128)
    width, unit = min(TONE_WIDTH, values.size), _TURN / (values.size + 1)
    for some in blocks(frequencies.size, _TONES_AT_ONCE):
        here = frequencies[some]
        # The waves along a row, then the waves times the place in the row, as real and imaginary
        # parts side by side: a complex table is a real one of twice the width.
        waves = _waves(here, width)
        along = np.hstack([waves, np.arange(width)[:, np.newaxis] * waves]).view(np.float64)
        rows = _waves(here * width, -(-min(BLOCK, values.size) // width))
        for block in blocks(values.size):
            piece, lag = values[block], block.start - 0.5 * (values.size - 1)
            if piece.size % width:
                piece = np.append(piece, np.zeros(-piece.size % width))
            products = (piece.reshape(-1, width) @ along).view(np.complex128)
            plain, ramped = products[:, : here.size], products[:, here.size :]
            ramped += plain * (width * np.arange(plain.shape[0]))[:, np.newaxis]
            total = np.einsum("ij,ij->j", plain, rows[: plain.shape[0]])
            tilted = np.einsum("ij,ij->j", ramped, rows[: plain.shape[0]]) + lag * total
            origin = np.exp(2j * np.pi * _turns(here, lag))
            sums[:, some] += np.stack([total * origin, unit * tilted * origin])
    return sums


def tones(
    start: int, count: int, center: float, frequencies: FloatArray, phasor: ComplexArray
) -> FloatArray:
    """Sum of ``cosine * cos(c) + sine * sin(c)``, c = 2 pi f (n - center), over frequencies f.

    Limit the BLAS to one thread: the products are small.

    Parameters
    ----------
    start, count
        Sample numbers n = start ... start + count - 1.
    center
        Sample number of the phase origin, whole or half.
    frequencies, phasor
        (frequencies,) cycles per sample, and ``cosine + 1j * sine`` in any unit.

    Returns
    -------
    (count,) in the unit of the amplitudes.
    """
    width = min(TONE_WIDTH, max(count, 1))
    total = np.zeros((-(-count // width), width))
    for some in blocks(frequencies.size, _TONES_AT_ONCE):
        here = frequencies[some]
        origin = np.exp(2j * np.pi * _turns(here, start - center))
        # The real part of a product of complex numbers: the first one's conjugate stands beside
        # the second, both as pairs of real ones.
        rows = _waves(here * width, total.shape[0])
        rows *= phasor[some].conj() * origin
        np.conjugate(rows, out=rows)
        total += rows.view(np.float64) @ _waves(here, width).view(np.float64).T
    return total.reshape(-1)[:count]


def _turns(frequencies: FloatArray, lag: float | FloatArray) -> FloatArray:
    """``frequencies * lag`` in cycles, without whole ones and without the rounding of many.

    A lag is a number, or one a row: (lags, 1).
    """
    coarse = np.rint(frequencies / _FREQUENCY_STEP) * _FREQUENCY_STEP
    cycles = coarse * lag
    return np.asarray((cycles - np.rint(cycles)) + (frequencies - coarse) * lag)


def _waves(frequencies: FloatArray, count: int) -> ComplexArray:
    """(count, frequencies) values of ``exp(2j * pi * f * k)`` for k = 0 ... count - 1."""
    # Products of two short tables: a product is a tenth of an exponential.
    fine = 32
    coarse = -(-count // fine)
    lags = np.arange(max(fine, coarse), dtype=np.float64)[:, np.newaxis]
    near = np.exp(2j * np.pi * _turns(frequencies, lags[:fine]))
    far = np.exp(2j * np.pi * _turns(frequencies, fine * lags[:coarse]))
    return np.asarray((far[:, np.newaxis] * near).reshape(coarse * fine, -1)[:count])
