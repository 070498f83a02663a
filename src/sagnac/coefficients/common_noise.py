"""What two gyros share: the cross spectrum over the band of N.

Two gyros with a common part (drive, temperature, table) read low when differenced: it cancels.
The real part of their cross spectrum over the band of N is the common part, with the sign that
the difference sees.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.fft import prev_fast_len, rfft
from scipy.special import ndtri

from sagnac.arrays import FloatArray
from sagnac.coefficients.estimates import require_confidence
from sagnac.spectrum.tapers import HALF_WIDTH, TAPERS, band_degrees_of_freedom, sine_taper


@dataclass(frozen=True, slots=True, kw_only=True)
class Common:
    """Noise that two gyros share in a band.

    Attributes
    ----------
    correlation, low, high
        Real part of the coherency with its interval, -1 to 1.
    confidence
        Of the interval.
    degrees_of_freedom
        Behind it.
    differenced
        What differencing makes of the per-gyro N, ``sqrt(1 - 2 C/(S1 + S2))``, as a factor:
        0.8 reads 20 % low.
    differenced_low, differenced_high
        Its interval.
    present
        Whether the interval leaves zero out.
    """

    correlation: float
    low: float
    high: float
    confidence: float
    degrees_of_freedom: float
    differenced: float
    differenced_low: float
    differenced_high: float
    present: bool


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


def band_moments(
    increments: ArrayLike,
    *,
    sample_rate: float,
    band_hz: tuple[float, float],
    masked: Sequence[tuple[float, float]] = (),
) -> Moments:
    """Real spectral matrix of several gyros over a band, under sine tapers.

    Parameters
    ----------
    increments
        (gyros, samples), rad, of one span.
    sample_rate
        Samples per second.
    band_hz
        Lowest and highest frequency, Hz: that in which N rules.
    masked
        Bands (low, high), Hz, to leave out: lines that gyros on one bench share are no noise.

    Returns
    -------
    Moments

    Raises
    ------
    ValueError
        If no ordinate lies in the band or an argument makes no sense.
    """
    values = np.asarray(increments, dtype=np.float64)
    if values.ndim != 2 or values.shape[0] < 2 or not np.isfinite(values).all():
        raise ValueError(f"increments has shape {values.shape}; give two finite gyros or more")
    length = prev_fast_len(values.shape[1], real=True)
    time = np.arange(length) - 0.5 * (length - 1)
    values = values[:, :length] - values[:, :length].mean(axis=1, keepdims=True)
    values = values - np.outer(values @ time / (time @ time), time)
    frequency = np.arange(length // 2 + 1) * sample_rate / length
    used = (frequency >= band_hz[0]) & (frequency <= band_hz[1]) & (frequency > 0.0)
    reach = HALF_WIDTH * sample_rate / length
    for low, high in masked:
        used &= (frequency < low - reach) | (frequency > high + reach)
    count = int(np.count_nonzero(used))
    if count == 0:
        raise ValueError(f"no frequency between {band_hz[0]:g} and {band_hz[1]:g} Hz")
    matrix = np.zeros((values.shape[0], values.shape[0]))
    for order in range(1, TAPERS + 1):
        transform = rfft(values * sine_taper(order, length), axis=1)[:, used]
        matrix += (transform @ transform.conj().T).real
    matrix *= 2.0 * sample_rate / (TAPERS * count)
    return Moments(matrix=matrix, degrees_of_freedom=band_degrees_of_freedom(count))


def common_noise(moments: Moments, *, confidence: float = 0.95) -> Common:
    """Correlation of two gyros and what it does to their difference.

    Fisher's transform of the correlation of as many pairs as there are degrees of freedom.

    Parameters
    ----------
    moments
        Of two gyros.
    confidence
        Of the intervals.
    """
    if moments.matrix.shape != (2, 2):
        raise ValueError(f"moments are of {moments.matrix.shape[0]} gyros; give two")
    require_confidence(confidence)
    first, second = float(moments.matrix[0, 0]), float(moments.matrix[1, 1])
    size = math.sqrt(first * second)
    correlation = float(np.clip(moments.matrix[0, 1] / size, -0.999999, 0.999999))
    reach = float(ndtri(0.5 + 0.5 * confidence)) / math.sqrt(
        max(moments.degrees_of_freedom - 2.0, 0.5)
    )
    low = math.tanh(math.atanh(correlation) - reach)
    high = math.tanh(math.atanh(correlation) + reach)

    def factor(share: float) -> float:
        return math.sqrt(max(0.0, 1.0 - 2.0 * share * size / (first + second)))

    return Common(
        correlation=correlation,
        low=low,
        high=high,
        confidence=confidence,
        degrees_of_freedom=moments.degrees_of_freedom,
        differenced=factor(correlation),
        differenced_low=factor(high),
        differenced_high=factor(low),
        present=low > 0.0 or high < 0.0,
    )
