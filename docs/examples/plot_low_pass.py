r"""
A sensor behind its own low-pass
================================

A low-pass of the sensor puts the Allan deviation below :math:`N/\sqrt\tau` at short cluster times.
A fit of the slope there reads N too low; the answer rests on the band that the low-pass leaves.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import butter, lfilter

import sagnac
from sagnac import plot

WALK, RATE = 0.1, 100.0  # °/√h, Hz
white = WALK * 60.0 * np.sqrt(RATE) * np.random.default_rng(2).standard_normal(120_000)  # °/h
rates = lfilter(*butter(2, 15.0, fs=RATE), white)
unit = sagnac.Recording.from_arrays(x=rates, kind="rate", unit="deg/h", sample_rate=RATE)
analysis = sagnac.analyze(unit)

axes = plot.stability(analysis, ax=plt.figure().add_subplot())
tau = np.geomspace(0.01, 100.0, 50)
axes.plot(tau, WALK * 60.0 / np.sqrt(tau), "k:", label="N/√τ of the truth")
axes.legend()
n = analysis.angle_random_walk.to("deg/sqrt(h)")
print(f"N {n.low:.4f} to {n.high:.4f} °/√h, put in {WALK}")
