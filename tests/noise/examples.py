"""Noises and curves that the tests of this room share."""

import math
from itertools import pairwise

import numpy as np

from sagnac.noise.three_cornered_hat import three_cornered_hat

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


def told_apart(gyros):
    """The three-cornered hat of three gyros' rates, one a second."""
    steps = [one - other for one, other in pairwise(gyros.values())]
    how = {"sample_rate": 1.0, "confidence": 0.95, "masked": (), "band": (0.0, math.inf)}
    return three_cornered_hat(tuple(gyros), steps, **how)
