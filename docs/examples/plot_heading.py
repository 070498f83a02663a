"""
Heading without aiding
======================

What white noise, bias instability, a random walk of the rate and a bias that is left over do to
heading, for a gyro that was measured for twenty minutes. The band is the 95 % interval.
"""

import matplotlib.pyplot as plt
import numpy as np

import sagnac

random = np.random.default_rng(9)
rates = 10.0 * random.standard_normal(60_000) + 0.02 * np.cumsum(random.standard_normal(60_000))
unit = sagnac.Recording.from_arrays(z=rates, kind="rate", unit="deg/h", sample_rate=50.0)
after = np.geomspace(1.0, 3600.0, 40)
drift = sagnac.align(sagnac.analyze(unit), after=list(after)).unaided.drift
plt.loglog(after, np.degrees(drift.heading.deviation(misaligned=False)), "k", linewidth=2)
plt.fill_between(after, *np.degrees(drift.heading.interval), color="0.8")
plt.xlabel("time without aiding (s)")
plt.ylabel("heading drift, standard deviation (°)")
