"""
Three gyros that turn together
==============================

The floor on which they stand moves by far more than their noise, and each senses it by a gain of
its own. Their cross spectra tell the noise of each.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import lfilter

import sagnac
from sagnac import plot

random = np.random.default_rng(3)
moved = 30.0 * lfilter([0.4], [1.0, -0.9], random.standard_normal(60_000))  # °/h
gains, noise = np.array([1.0, 1.02, 0.98]), np.array([1.0, 1.5, 0.7])
rates = np.outer(gains, moved) + noise[:, np.newaxis] * random.standard_normal((3, moved.size))
channels = dict(zip("xyz", rates, strict=True))
unit = sagnac.Recording.from_arrays(**channels, kind="rate", unit="deg/h", sample_rate=10.0)
found = sagnac.self_noise(unit, band=(0.01, 5.0))

plot.self_noise(found, ax=plt.figure().add_subplot())
for (name, one), truth in zip(found.angle_random_walk.items(), noise, strict=True):
    n = one.to("deg/sqrt(h)")
    print(f"{name}: N {n.low:.5f} to {n.high:.5f} °/√h, put in {truth / np.sqrt(10) / 60:.5f}")
