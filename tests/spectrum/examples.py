"""Noise and series that the tests of spectra are made of."""

import numpy as np

from sagnac.core import arrays

SAMPLES = 40_000


def fractional_noise(exponent, samples, generator):
    """Gaussian noise of density f^-exponent: white noise shaped on eight times the length."""
    frequency = np.fft.rfftfreq(8 * samples)
    frequency[0] = frequency[1]
    parts = generator.standard_normal((2, frequency.size))
    shaped = (parts[0] + 1j * parts[1]) * frequency ** (-exponent / 2.0)
    return np.fft.irfft(shaped)[:samples]


def angle_random_walk(generator):
    return generator.standard_normal(SAMPLES)


def quantization(generator):
    return np.diff(generator.standard_normal(SAMPLES + 1))


def rate_random_walk(generator):
    steps = np.cumsum(generator.standard_normal(SAMPLES))
    return steps - steps.mean()


def flicker(generator):
    steps = fractional_noise(1.0, SAMPLES, generator)
    return steps - steps.mean()


def everything(generator):
    steps = (
        generator.standard_normal(SAMPLES)
        + 3.0 * np.diff(generator.standard_normal(SAMPLES + 1))
        + 0.01 * np.cumsum(generator.standard_normal(SAMPLES))
    )
    return steps - steps.mean()


def as_series(values):
    copy = arrays.empty(values.size)
    copy[:] = values
    return copy
