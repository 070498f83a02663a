r"""
An Allan curve with its interval
================================

The overlapping Allan deviation of white rate noise falls as one over the root of the cluster time,

.. math:: \sigma(\tau) = N / \sqrt{\tau},

and scatters about that line within its interval.
"""

import matplotlib.pyplot as plt
import numpy as np

from sagnac import plot, stability_curve

walk = 2.0  # °/h/√Hz
rates = walk * np.sqrt(50.0) * np.random.default_rng(1).standard_normal(100_000)
curve = stability_curve(rates, kind="rate", sample_rate=50.0, confidence=0.95)

axes = plot.stability(curve, ax=plt.figure().add_subplot())
axes.plot(curve.tau, walk / np.sqrt(curve.tau), "k:", label="N/√τ")
axes.set_ylabel("Allan deviation (°/h)")
axes.legend()
