"""The difference of two gyros, what it means for one, and the covariance of two."""

import math

import numpy as np
from numpy.typing import ArrayLike

from sagnac import series
from sagnac.recording import FloatArray, Kind, RecordingError


def per_gyro(square: float, gyros_differenced: int) -> float:
    """Coefficient of one gyro from the squared coefficient of what was measured.

    This is the one place where the factor for a difference stands. Independent gyros
    add in square, so a difference of two has twice their mean square (Eq. 3 of the
    paper), whatever the term.

    Parameters
    ----------
    square
        Squared coefficient of the measured signal.
    gyros_differenced
        1 for a single gyro, 2 for a difference.

    Returns
    -------
    float
        Root of the mean square over the gyros.

    Raises
    ------
    ValueError
        If `gyros_differenced` is neither 1 nor 2.
    """
    if gyros_differenced not in (1, 2):
        raise ValueError(f"gyros_differenced is {gyros_differenced}; use 1 (a gyro) or 2 (a pair)")
    return math.sqrt(square / gyros_differenced)


def angle_increments(values: ArrayLike, *, kind: Kind, sample_rate: float) -> FloatArray:
    """Angle turned over each sample interval.

    Parameters
    ----------
    values
        (samples,), rad for ``angle`` and ``increment``, rad/s for ``rate``.
    kind
        What one sample is.
    sample_rate
        Samples per second.

    Returns
    -------
    FloatArray
        (increments,), rad: one fewer than the samples for ``angle``, else as many.

    Raises
    ------
    RecordingError
        If a sample is not finite.
    ValueError
        If an argument makes no sense.
    """
    samples = np.asarray(values, dtype=np.float64)
    if samples.ndim != 1:
        raise ValueError(f"values has shape {samples.shape}; give one channel, shape (samples,)")
    if kind not in ("angle", "increment", "rate"):
        raise ValueError(f"kind is {kind!r}; state angle, increment or rate")
    if not (math.isfinite(sample_rate) and sample_rate > 0.0):
        raise ValueError(f"sample_rate is {sample_rate}; give samples per second, above zero")
    # One sum tells whole samples without a second array of their size.
    finite = samples.size == 0 or math.isfinite(series.mean(samples))
    if not finite and not np.isfinite(samples).all():
        first = int(np.argmin(np.isfinite(samples)))
        raise RecordingError(
            f"sample {first} is not finite and there is no room for gaps here; "
            "take a span without gaps (--slice)"
        )
    if kind == "angle":
        return series.differences(samples)
    return samples / sample_rate if kind == "rate" else samples


def groslambert_covariance(
    first: ArrayLike, second: ArrayLike, *, kind: Kind, sample_rate: float, taus: ArrayLike
) -> FloatArray:
    """Overlapped Allan covariance of two signals (Groslambert covariance).

    ``mean(d1 d2) / (2 tau^2)`` over the second differences d of the angles: the Allan
    variance, with a product where it has a square. Noise that only one of the signals has
    drops out in the mean, so that of three gyros ``GCOV(x - y, x - z)`` is the Allan
    variance of x alone (E. Lantz et al., IEEE Trans. UFFC 66:1942, 2019; sign
    conventions: with ``z - x`` it is negative). The published GCODEV is
    ``sign(GCOV) sqrt(abs(GCOV))``.

    Parameters
    ----------
    first, second
        (samples,), rad for ``angle`` and ``increment``, rad/s for ``rate``.
    kind
        What one sample is.
    sample_rate
        Samples per second.
    taus
        (points,) cluster times, s, each rounded to a whole number of samples.

    Returns
    -------
    FloatArray
        (points,), (rad/s)^2; either sign.

    Raises
    ------
    RecordingError
        If a sample is not finite.
    ValueError
        If the signals differ in length, or a cluster time does not fit in them.
    """
    angles = []
    for values in (first, second):
        increments = angle_increments(values, kind=kind, sample_rate=sample_rate)
        angles.append(np.concatenate([[0.0], np.cumsum(increments - increments.mean())]))
    if angles[0].size != angles[1].size:
        raise ValueError(
            f"first and second have {angles[0].size} and {angles[1].size} angles; give one span"
        )
    covariances = []
    for tau in np.atleast_1d(np.asarray(taus, dtype=np.float64)):
        cluster = round(tau * sample_rate)
        if not 1 <= cluster <= (angles[0].size - 1) // 2:
            raise ValueError(
                f"tau {tau:g} s is {cluster} samples; give 1 to {(angles[0].size - 1) // 2} of them"
            )
        one, other = (
            angle[2 * cluster :] - 2.0 * angle[cluster:-cluster] + angle[: -2 * cluster]
            for angle in angles
        )
        span = cluster / sample_rate
        covariances.append(float(one @ other) / one.size / (2.0 * span**2))
    return np.array(covariances)
