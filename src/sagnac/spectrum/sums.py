"""Fourier sums over uneven phases: table angle, and tones at any frequency."""

from typing import Final

import finufft
import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.spectrum.order_tables import HIGHEST, table_series, table_sums
from sagnac.spectrum.transforms import THREADS, TONE_WIDTH

_NUFFT_TOLERANCE: Final = 1e-9
# Frequencies worked on at once: their tables take 12 MiB.
_TONES_AT_ONCE: Final = 512
# A frequency times a lag is exact where the first has 23 bits after the point and the second,
# counted in halves of a sample, 29.
_FREQUENCY_STEP: Final = 2.0**-23


def angle_sums(
    phase: FloatArray,
    strengths: FloatArray,
    orders: int,
    *,
    tolerance: float = _NUFFT_TOLERANCE,
) -> NDArray[np.complex128]:
    """Sums of ``strengths * exp(-1j * k * phase)`` for k = 0 ... `orders`, by one NUFFT.

    Parameters
    ----------
    phase
        (samples,) rad; any real number, folded into one turn here.
    strengths
        (samples,) or (several, samples) real. Two take no longer than one.
    tolerance
        Error of the sums, relative to the sum of all strengths' magnitudes.

    Returns
    -------
    (orders + 1,) or (several, orders + 1) in the unit of the strengths.
    """
    # Of real strengths the sums at -k are the conjugates of those at k: two sets go into one
    # transform, as real and as imaginary part, and come apart again.
    several = np.atleast_2d(strengths)
    if orders <= HIGHEST:
        rows = [table_sums(phase, row, orders) for row in several]
        return np.stack(rows).reshape(*strengths.shape[:-1], orders + 1)
    paired = several[0::2].astype(np.complex128)
    paired.imag[: several.shape[0] // 2] = several[1::2]
    modes = finufft.nufft1d1(
        np.remainder(phase, 2.0 * np.pi),
        paired,
        2 * orders + 1,
        eps=tolerance,
        isign=-1,
        nthreads=THREADS,
    )
    modes = modes.reshape(paired.shape[0], 2 * orders + 1)
    ahead, behind = modes[:, orders:], modes[:, orders::-1].conj()
    sums = np.empty((several.shape[0], orders + 1), dtype=np.complex128)
    sums[0::2] = 0.5 * (ahead + behind)
    sums[1::2] = -0.5j * (ahead - behind)[: several.shape[0] // 2]
    return sums.reshape(*strengths.shape[:-1], orders + 1)


def angle_series(
    phase: FloatArray, sums: NDArray[np.complex128], *, tolerance: float = _NUFFT_TOLERANCE
) -> FloatArray:
    """Real part of the sum of ``sums[k] * exp(1j * k * phase)`` over k, by one NUFFT.

    Parameters
    ----------
    phase
        (samples,) rad; any real number, folded into one turn here.
    sums
        (orders + 1,) for k = 0 ... orders, in any unit.
    tolerance
        Error of the series, relative to the sum of the sums' magnitudes.

    Returns
    -------
    (samples,) in the unit of the sums.
    """
    if sums.size <= HIGHEST + 1:
        return table_series(phase, sums)
    modes = np.zeros(2 * sums.size - 1, dtype=np.complex128)
    modes[sums.size - 1 :] = sums
    values = finufft.nufft1d2(
        np.remainder(phase, 2.0 * np.pi), modes, eps=tolerance, isign=1, nthreads=THREADS
    )
    return np.ascontiguousarray(values.real)


def tone_sums(
    values: FloatArray, frequencies: FloatArray, center: float, *, lag_unit: float
) -> NDArray[np.complex128]:
    """Sums of ``values * lag**r * exp(2j * pi * f * (n - center))`` for r = 0, 1, exactly.

    Here n is the sample number and ``lag = (n - center) * lag_unit``. The frequencies are any.
    Every span is a product of the samples, in rows, with a table of the waves along a row, and
    the rows are then brought into phase. Limit the BLAS to one thread around it: spans are shared
    out among threads here.

    Parameters
    ----------
    values
        (samples,) in memory or mapped.
    frequencies
        (frequencies,) cycles per sample.
    center
        Sample number of the phase origin, whole or half.
    lag_unit
        Unit of the lag, per sample: ``1 / samples`` keeps it near one.

    Returns
    -------
    (2, frequencies).
    """
    width = min(TONE_WIDTH, max(values.size, 1))
    rows = -(-min(series.SPAN, values.size) // width)
    sums = np.empty((2, frequencies.size), dtype=np.complex128)
    for some in series.spans(frequencies.size, _TONES_AT_ONCE):
        wanted = frequencies[some]
        waves = _waves(wanted, width)
        # Real and imaginary parts side by side: a complex table is a real one of twice the width.
        table = np.hstack([waves, np.arange(width)[:, np.newaxis] * waves]).view(np.float64)
        of_rows = _waves(wanted * width, rows)

        def span_sums(
            span: slice,
            wanted: FloatArray = wanted,
            table: FloatArray = table,
            of_rows: NDArray[np.complex128] = of_rows,
        ) -> NDArray[np.complex128]:
            piece = values[span]
            if piece.size % width:
                piece = np.append(piece, np.zeros(-piece.size % width))
            along = (piece.reshape(-1, width) @ table).view(np.complex128)
            plain, ramped = along[:, : wanted.size], along[:, wanted.size :]
            ramped += plain * (width * np.arange(along.shape[0]))[:, np.newaxis]
            total = np.einsum("ij,ij->j", plain, of_rows[: along.shape[0]])
            tilted = np.einsum("ij,ij->j", ramped, of_rows[: along.shape[0]])
            tilted += (span.start - center) * total
            origin = np.exp(2j * np.pi * _turns(wanted, span.start - center))
            return np.stack([total * origin, lag_unit * tilted * origin])

        sums[:, some] = sum(
            series.each(span_sums, values.size, series.SPAN, release_of=(values,)),
            start=np.zeros((2, wanted.size), dtype=np.complex128),
        )
    return sums


def tones(
    start: int,
    count: int,
    center: float,
    frequencies: FloatArray,
    *,
    cosine: FloatArray,
    sine: FloatArray,
) -> FloatArray:
    """Sum of ``cosine * cos(c) + sine * sin(c)``, c = 2 pi f (n - center), over frequencies f.

    Limit the BLAS to one thread where several threads call this.

    Parameters
    ----------
    start, count
        Sample numbers n = start ... start + count - 1.
    center
        Sample number of the phase origin, whole or half.
    frequencies, cosine, sine
        (frequencies,) cycles per sample, and amplitudes in any unit.

    Returns
    -------
    (count,) in the unit of the amplitudes.
    """
    width = min(TONE_WIDTH, max(count, 1))
    total = np.zeros((-(-count // width), width))
    for some in series.spans(frequencies.size, _TONES_AT_ONCE):
        here = frequencies[some]
        origin = np.exp(2j * np.pi * _turns(here, start - center))
        # The real part of a product of complex numbers: the first one's conjugate stands beside
        # the second, both as pairs of real ones.
        rows = _waves(here * width, total.shape[0])
        rows *= (cosine[some] - 1j * sine[some]) * origin
        np.conjugate(rows, out=rows)
        total += rows.view(np.float64) @ _waves(here, width).view(np.float64).T
    return total.reshape(-1)[:count]


def _turns(frequencies: FloatArray, lag: float) -> FloatArray:
    """``frequencies * lag`` in cycles, without whole ones and without the rounding of many."""
    coarse = np.rint(frequencies / _FREQUENCY_STEP) * _FREQUENCY_STEP
    cycles = coarse * lag
    return np.asarray((cycles - np.rint(cycles)) + (frequencies - coarse) * lag)


def _waves(frequencies: FloatArray, count: int) -> NDArray[np.complex128]:
    """(count, frequencies) values of ``exp(2j * pi * f * k)`` for k = 0 ... count - 1."""
    # Products of two short tables: a product is a tenth of an exponential.
    fine = 32
    coarse = -(-count // fine)
    near = np.exp(2j * np.pi * np.array([_turns(frequencies, k) for k in range(fine)]))
    far = np.exp(2j * np.pi * np.array([_turns(frequencies, fine * k) for k in range(coarse)]))
    return (far[:, np.newaxis] * near).reshape(coarse * fine, -1)[:count]
