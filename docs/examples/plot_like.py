"""
A unit simulated from its measurement
=====================================

A gyro with white noise, a walk and a low-pass of its own is measured. A unit like it is simulated,
and its spectrum is drawn over the first.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import butter, lfilter

import sagnac
from sagnac.rig.simulate import simulate

random = np.random.default_rng(4)
RATE = 50.0
rates = 100.0 * random.standard_normal(90_000) + np.cumsum(random.standard_normal(90_000))  # °/h
rates = lfilter(*butter(1, 8.0, fs=RATE), rates)
unit = sagnac.Recording.from_arrays(x=rates, kind="rate", unit="deg/h", sample_rate=RATE)
first = sagnac.analyze(unit)
again = sagnac.analyze(simulate(sagnac.RigConfig.from_analysis(first)).recording, gyros=("x",))

axes = plt.figure().add_subplot()
for analysis, label in ((first, "measured"), (again, "simulated like it")):
    one = analysis.spectrum
    axes.loglog(one.frequency, np.degrees(np.sqrt(one.density)) * 3600.0, label=label)
axes.set_xlabel("frequency (Hz)")
axes.set_ylabel("rate noise density (°/h/√Hz)")
axes.legend()
