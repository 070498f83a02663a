"""Noise that gyros share: the cross spectra over the band of N.

Two gyros with a common part (drive, temperature, table) read low when differenced: it cancels.
The real part of their cross spectrum over the band of N is the common part, with the sign that
the difference sees.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.fft import prev_fast_len, rfft

from sagnac.arrays import BooleanArray, FloatArray
from sagnac.spectrum.power_laws import running_median
from sagnac.spectrum.tapers import CELL, TAPERS, band_degrees_of_freedom, sine_taper

# A cell this many times the median of its neighbourhood, and those cells, is a line.
_STANDING: Final = 3.0
_AROUND: Final = 41


@dataclass(frozen=True, slots=True, kw_only=True)
class Moments:
    """Spectral matrix of gyros over a band, real part.

    Attributes
    ----------
    matrix
        (gyros, gyros) one-sided rate density, (rad/s)^2/Hz.
    degrees_of_freedom
        Of the chi-square laws on its diagonal.
    """

    matrix: FloatArray
    degrees_of_freedom: float

    def __post_init__(self) -> None:
        size = self.matrix.shape[0]
        if self.matrix.shape != (size, size) or not np.allclose(self.matrix, self.matrix.T):
            raise ValueError("matrix must be square and symmetric")
        if not self.degrees_of_freedom > 0.0:
            raise ValueError("degrees_of_freedom must be above zero")


@dataclass(frozen=True, slots=True, kw_only=True)
class SharedCells:
    """Spectral matrices of gyros, real part, in cells that hold no line.

    Attributes
    ----------
    matrices
        (gyros, gyros, cells) one-sided rate density, (rad/s)^2/Hz.
    frequency
        (cells,) in the middle of each, Hz, ascending.
    """

    matrices: FloatArray
    frequency: FloatArray

    def __post_init__(self) -> None:
        if self.matrices.shape[2:] != self.frequency.shape or self.frequency.size == 0:
            raise ValueError(
                f"matrices has shape {self.matrices.shape} and frequency {self.frequency.shape}; "
                "give one of each a cell"
            )

    def mean(self, some: slice) -> Moments:
        """Over some of the cells."""
        count = self.frequency[some].size
        return Moments(
            matrix=self.matrices[:, :, some].mean(axis=2),
            degrees_of_freedom=band_degrees_of_freedom(CELL * count),
        )


def band_cells(
    increments: ArrayLike,
    *,
    sample_rate: float,
    band_hz: tuple[float, float],
    masked: Sequence[tuple[float, float]] = (),
) -> SharedCells:
    """Real spectral matrices of several gyros over a band, cell by cell, under sine tapers.

    Parameters
    ----------
    increments
        (gyros, samples), rad, of one span.
    sample_rate
        Samples per second.
    band_hz
        Lowest and highest frequency, Hz: that in which N rules.
    masked
        Bands (low, high), Hz, to leave out. Lines that gyros on one bench share are no noise;
        what stands out is left out besides.

    Raises
    ------
    ValueError
        If no ordinate lies in the band or an argument makes no sense.
    """
    values = np.asarray(increments, dtype=np.float64)
    if values.ndim != 2 or values.shape[0] < 2 or not np.isfinite(values).all():
        raise ValueError(f"increments has shape {values.shape}; give two finite gyros or more")
    length = int(prev_fast_len(values.shape[1], real=True))
    time = np.arange(length) - 0.5 * (length - 1)
    values = values[:, :length] - values[:, :length].mean(axis=1, keepdims=True)
    values -= np.outer(values @ time / (time @ time), time)
    first, last = np.searchsorted(
        np.arange(1, length // 2 + 1) * sample_rate / length, band_hz, side="left"
    )
    cells = (last - first) // CELL
    if cells <= 0:
        raise ValueError(f"too few frequencies between {band_hz[0]:g} and {band_hz[1]:g} Hz")
    used = slice(1 + int(first), 1 + int(first + cells * CELL))
    products = np.zeros((values.shape[0], values.shape[0], int(cells)))
    for order in range(1, TAPERS + 1):
        transform = rfft(values * sine_taper(order, length), axis=1)[:, used]
        pairs = (transform[:, np.newaxis] * transform.conj()).real
        products += pairs.reshape(*products.shape, CELL).sum(axis=3)
    products *= 2.0 * sample_rate / (TAPERS * CELL)
    place = 1 + first + CELL * (np.arange(cells) + 0.5)
    plain = _plain(products) & ~_within(place * sample_rate / length, masked, sample_rate / length)
    if not plain.any():
        raise ValueError(f"only lines between {band_hz[0]:g} and {band_hz[1]:g} Hz")
    return SharedCells(
        matrices=products[:, :, plain], frequency=place[plain] * sample_rate / length
    )


def _plain(products: FloatArray) -> BooleanArray:
    """Cells in which no gyro stands out of its neighbourhood, and none beside one that does."""
    plain = np.ones(products.shape[2], dtype=np.bool_)
    for gyro in range(products.shape[0]):
        density = products[gyro, gyro]
        standing = density > _STANDING * running_median(density, _AROUND)
        plain &= ~np.convolve(standing, np.ones(3), mode="same").astype(bool)[: plain.size]
    return plain


def _within(
    frequency: FloatArray, masked: Sequence[tuple[float, float]], unit: float
) -> BooleanArray:
    """Cells that touch a masked band or its neighbourhood."""
    reach = CELL * unit
    touched = np.zeros(frequency.size, dtype=np.bool_)
    for low, high in masked:
        touched |= (frequency > low - reach) & (frequency < high + reach)
    return touched
