"""
Accelerometers beside gyros
===========================

An accelerometer has the same terms in other units; each channel is analyzed by itself.
"""

import matplotlib.pyplot as plt
import numpy as np

import sagnac
from sagnac import plot

random = np.random.default_rng(12)
recording = sagnac.Recording.from_arrays(
    x=5.0 * random.standard_normal(40_000),
    az=9.81 + 2e-3 * random.standard_normal(40_000),
    kind="rate",
    unit={"x": "deg/h", "az": "m/s^2"},
    sample_rate=50.0,
)
analysis = sagnac.analyze(recording)
force = analysis.accelerometers["az"]
plot.stability(force.curve, ax=plt.figure().add_subplot())
n = force.angle_random_walk.to("m/s/sqrt(h)")
print(f"velocity random walk {n.low:.4f} to {n.high:.4f} m/s/√h")
