"""The noise a gyro makes: Q, N, B, K, R, their Allan variance and their spectrum.

Conventions (IEEE Std 647-2006 and 952-1997): every law is of one gyro. Spectral
densities S(f) of the standards are two-sided; instruments show the one-sided 2 S(f), in which
white rate noise of N rad/sqrt(s) lies at 2 N^2.

============================  ======================  =======================  ===============
term                          S(f), two-sided         Allan variance           unit
============================  ======================  =======================  ===============
quantization Q                (4 Q^2/T) sin^2(pi f T) 3 Q^2/tau^2              rad
angle random walk N           N^2                     N^2/tau                  rad/sqrt(s)
bias instability B            B^2/(2 pi f)            (2 ln 2/pi) B^2          rad/s
rate random walk K            K^2/(2 pi f)^2          K^2 tau/3                rad/s/sqrt(s)
rate ramp R                   none (deterministic)    R^2 tau^2/2              rad/s^2
Markov q_c, T_c               (q_c T_c)^2 /           see `markov_allan_       rad/s/sqrt(s), s
                              (1 + (2 pi f T_c)^2)    variance`
sinusoid of rate amplitude A  lines of A^2/4 at +-f0  see `sinusoid_allan_     rad/s, Hz
                                                      variance`
============================  ======================  =======================  ===============

Quantization is white noise of the sampled angle: a uniform step gives Q = step/sqrt(12).
The bias instability here is 1/f at all frequencies, as Eq. 3 of the paper takes it.
"""

from collections.abc import Mapping
from functools import lru_cache
from typing import Final, Literal, get_args

import numpy as np
from scipy.special import sici, zeta

from sagnac.core.arrays import FloatArray
from sagnac.noise import _kernels
from sagnac.spectrum.levels import Levels

CoefficientName = Literal[
    "quantization", "angle_random_walk", "bias_instability", "rate_random_walk", "rate_ramp"
]
COEFFICIENT_NAMES: Final[tuple[CoefficientName, ...]] = get_args(CoefficientName)
STOCHASTIC_NAMES: Final[tuple[CoefficientName, ...]] = COEFFICIENT_NAMES[:4]
# Those that show at low frequency.
SLOW_NAMES: Final[tuple[CoefficientName, ...]] = COEFFICIENT_NAMES[2:]
SYMBOLS: Final[Mapping[CoefficientName, str]] = dict(zip(COEFFICIENT_NAMES, "QNBKR", strict=True))


def allan_variance_basis(tau: FloatArray) -> FloatArray:
    """Allan variance of each term of Eq. 3 with its coefficient at one.

    Parameters
    ----------
    tau
        (points,), s.

    Returns
    -------
    FloatArray
        (points, 5), in the order of `COEFFICIENT_NAMES`; times the squared coefficients
        it is the Allan variance of one gyro, (rad/s)^2.
    """
    tau = np.asarray(tau, dtype=np.float64)
    level = np.full_like(tau, 2.0 * np.log(2.0) / np.pi)
    return np.stack([3.0 / tau**2, 1.0 / tau, level, tau / 3.0, tau**2 / 2.0], axis=-1)


def allan_variance(tau: FloatArray, coefficients: Mapping[CoefficientName, float]) -> FloatArray:
    """Allan variance of one gyro, Eq. 3 of the paper without its factor for two.

    Parameters
    ----------
    tau
        (points,), s.
    coefficients
        SI; a missing name counts as zero.

    Returns
    -------
    FloatArray
        (points,), (rad/s)^2.
    """
    squares = np.array([coefficients.get(name, 0.0) ** 2 for name in COEFFICIENT_NAMES])
    return np.asarray(allan_variance_basis(tau) @ squares)


def markov_allan_variance(
    tau: FloatArray, driving_noise: float, correlation_time: float
) -> FloatArray:
    """Allan variance of a first-order Markov rate (IEEE Std 952-1997, C.17).

    Parameters
    ----------
    tau
        (points,), s.
    driving_noise, correlation_time
        q_c in rad/s/sqrt(s) and T_c in s.

    Returns
    -------
    FloatArray
        (points,), (rad/s)^2.
    """
    ratio = np.asarray(tau, dtype=np.float64) / correlation_time
    # 1 - (3 - 4 e^-r + e^-2r)/(2 r), without the cancellation that small r brings.
    series = ratio**2 / 3.0 * (1.0 - 0.75 * ratio + 0.35 * ratio**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        closed = 1.0 + (4.0 * np.expm1(-ratio) - np.expm1(-2.0 * ratio)) / (2.0 * ratio)
    shape = np.where(ratio < 1e-3, series, closed)
    return np.asarray((driving_noise * correlation_time) ** 2 / tau * shape)


def sinusoid_allan_variance(
    tau: FloatArray, amplitude: float | FloatArray, frequency: float | FloatArray
) -> FloatArray:
    """Allan variance of a sinusoidal rate (IEEE Std 952-1997, C.20).

    Parameters
    ----------
    tau
        (points,), s.
    amplitude, frequency
        Peak rate in rad/s, and Hz; arrays are broadcast against `tau`.

    Returns
    -------
    FloatArray
        (points,), (rad/s)^2.
    """
    turns = np.pi * frequency * np.asarray(tau, dtype=np.float64)
    return np.asarray((amplitude * np.sin(turns) ** 2 / turns) ** 2)


def increment_spectrum_basis(frequency: FloatArray, interval: float) -> FloatArray:
    """Discrete spectrum of angle increments for each stochastic coefficient at one.

    The rate is averaged over each interval and then sampled; what folds from above the
    Nyquist frequency is summed in closed form, so that these spectra belong to the Allan
    variances of `allan_variance_basis` exactly, at every multiple of the interval.

    Parameters
    ----------
    frequency
        (bins,), Hz, above zero and at most ``0.5 / interval``.
    interval
        Sample interval, s.

    Returns
    -------
    FloatArray
        (bins, 4), rad^2 for Q, N, B, K; the variance of an increment is the mean over
        -0.5/interval … 0.5/interval.
    """
    cycles = np.asarray(frequency, dtype=np.float64) * interval
    square = np.sin(np.pi * cycles) ** 2
    folded = zeta(3.0, cycles) + zeta(3.0, 1.0 - cycles)
    white, flicker = np.full_like(cycles, interval), square * folded / (2.0 * np.pi**3)
    walk = interval**3 * (0.25 / square - 1.0 / 6.0)
    return np.stack([4.0 * square, white, interval**2 * flicker, walk], axis=-1)


def rate_density_basis(frequency: FloatArray, interval: float) -> FloatArray:
    """One-sided rate density of sampled angle increments for each coefficient at one.

    Parameters
    ----------
    frequency, interval
        As in `increment_spectrum_basis`.

    Returns
    -------
    FloatArray
        (bins, 4), (rad/s)^2/Hz for Q, N, B, K.
    """
    return np.asarray(2.0 / interval * increment_spectrum_basis(frequency, interval))


def flicker_share(frequency: FloatArray, end: float) -> FloatArray:
    """(points,) share of a density of 1/f that is left if relaxations are no faster than an end.

    1/f is a sum of Lorentzians, as many in each decade of relaxation time; without those of times
    below ``1 / (2 pi end)`` it is less by ``(2 / pi) atan(end / f)``, and falls as 1/f^2 above.

    Parameters
    ----------
    frequency
        (points,), Hz, above zero.
    end
        Hz; may be infinite.
    """
    return np.asarray(2.0 / np.pi * np.arctan(end / frequency))


@lru_cache(maxsize=8)
def level_laws(levels: Levels) -> FloatArray:
    """`rate_density_basis` as the levels of a spectrum show it: kept, for every fit asks for it.

    Returns
    -------
    FloatArray
        (bins, 4), (rad/s)^2/Hz for Q, N, B, K at one; not to be written to.
    """
    laws = levels.law(lambda frequency: rate_density_basis(frequency, levels.spectrum.interval))
    laws.flags.writeable = False
    return laws


def cosine_power_basis(index: FloatArray, samples: int, interval: float) -> FloatArray:
    """Expected squares of the orthonormal cosine transform (DCT-II) of angle increments.

    In this basis white rate and rate random walk are diagonal for every length: the
    transform of a random walk, summed by parts, is a sine transform of its steps. For
    the two others the mean of each square is that of the finite record: quantization
    gains 4 cos^2(w/2)/samples from the first and the last sample, and 1/f has the
    factor (2/pi) (Si(pi k) - (1 - cos(pi k))/(pi k)) against its spectrum.

    Parameters
    ----------
    index
        (bins,), 1 ≤ k < samples; k lies at k / (2 samples interval) Hz. Fractions are
        allowed (means over a range of k).
    samples
        Length of the record.
    interval
        Sample interval, s.

    Returns
    -------
    FloatArray
        (bins, 4), rad^2 for Q, N, B, K at one.
    """
    index = np.asarray(index, dtype=np.float64)
    basis = increment_spectrum_basis(index / (2.0 * samples * interval), interval)
    basis[:, 0] += 4.0 / samples * np.cos(0.5 * np.pi * index / samples) ** 2
    angle = np.pi * index
    # Si(pi k) swings about its mean with the parity of k, which a fractional k has not:
    # from a few tens on, the smooth limit 1 - 2/(pi^2 k) serves both.
    exact = 2.0 / np.pi * (sici(angle)[0] - (1.0 - np.cos(angle)) / angle)
    basis[:, 2] *= np.where(index < 32.0, exact, 1.0 - 2.0 / (np.pi * angle))
    return basis


def markov_density(frequency: FloatArray, interval: float, correlation_time: float) -> FloatArray:
    """One-sided rate density of sampled angle increments of a Markov rate of q_c = 1.

    Parameters
    ----------
    frequency, interval
        As in `increment_spectrum_basis`.
    correlation_time
        T_c, s.

    Returns
    -------
    FloatArray
        (bins,), (rad/s)^2/Hz.
    """
    ratio = interval / correlation_time
    decay, one_apart = np.exp(-ratio), np.expm1(-ratio) ** 2
    # r - 1 + e^-r without cancellation.
    series = ratio**2 / 2.0 - ratio**3 / 6.0 + ratio**4 / 24.0 - ratio**5 / 120.0
    excess = series if ratio < 0.01 else ratio + np.expm1(-ratio)
    cosine = np.cos(2.0 * np.pi * np.asarray(frequency, dtype=np.float64) * interval)
    # Of mean rates in squared samples of `ratio` correlation times, twice over, for a variance of
    # one: the variance is T_c/2.
    spectrum = excess + one_apart * (cosine - decay) / (1.0 - 2.0 * decay * cosine + decay**2)
    return np.asarray(2.0 * correlation_time**3 / interval * spectrum)


@lru_cache(maxsize=8)
def overlapped_allan_covariances(
    factors: tuple[int, ...], *, angles: int, interval: float
) -> FloatArray:
    """Covariances between the points of an overlapped Allan variance, for Gaussian noise.

    The covariance of two averages of squared second differences is the sum, over all
    pairs of differences in the record, of twice their squared covariance; that one is
    known in closed form for every term. Ends of the record are counted, nothing is taken
    to be much longer than anything else.

    Parameters
    ----------
    factors
        (points,), cluster times in sample intervals; at most ``(angles - 1) // 2``.
    angles
        Number of angle samples (increments plus one).
    interval
        Sample interval, s.

    Returns
    -------
    FloatArray
        (5, 5, points, points), (rad/s)^4 for pairs of terms, in the order of `COEFFICIENT_NAMES`:
        contracted twice with the squared coefficients it is the covariance. Kept, for the fits of
        a curve share it; not to be written to.
    """
    size = np.array(factors, dtype=np.int64)
    covariances = np.zeros((5, 5, size.size, size.size))
    for place, first in enumerate(factors):
        second = size[place:]
        totals = np.zeros((second.size, 5, 5))
        breaks = _kernels.lag_breaks(first, second, angles)
        _kernels.add_products(breaks, first, second, angles, totals)
        squares = 1.0 * first * first * second * second
        pairs = squares * (angles - 2 * first) * (angles - 2 * second)
        totals *= (0.5 / pairs)[:, np.newaxis, np.newaxis]
        rows = np.moveaxis(totals, 0, -1)
        covariances[:, :, place, place:] = covariances[:, :, place:, place] = rows
    covariances[4, 4] = 0.0  # a ramp does not vary
    # From a sample interval of one: each Allan variance is a covariance over interval^2.
    unit = interval ** np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    covariances *= (unit[:, np.newaxis] * unit)[:, :, np.newaxis, np.newaxis]
    covariances.flags.writeable = False
    return covariances
