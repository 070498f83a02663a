"""Noises and curves that the tests of this room share."""

import numpy as np

NAMES = (
    "quantization",
    "angle_random_walk",
    "bias_instability",
    "rate_random_walk",
    "rate_ramp",
)


def white(samples, seed, size=1.0):
    return size * np.random.default_rng(seed).standard_normal(samples)


def read_out(walk, samples, seed, *, rate=0.0, white=0.0):
    """An angle that walks, turns steadily and shakes, in readout steps: as it is, and rounded."""
    generator = np.random.default_rng(seed)
    angle = generator.random() + np.cumsum(walk * generator.standard_normal(samples))
    angle += rate * np.arange(samples) + white * generator.standard_normal(samples)
    return angle, np.round(angle)
