"""
Three deviations of one recording
=================================

Allan, modified Allan and Hadamard deviation of white noise with a drift: the Hadamard deviation
does not see the drift.
"""

import matplotlib.pyplot as plt
import numpy as np

from sagnac import stability_curve

rates = np.random.default_rng(4).standard_normal(60_000) + 1e-4 * np.arange(60_000)
for name in ("oadev", "mdev", "ohdev"):
    curve = stability_curve(rates, kind="rate", sample_rate=10.0, estimator=name)
    plt.loglog(curve.tau, curve.deviation, label=name)
    plt.fill_between(curve.tau, curve.low, curve.high, alpha=0.2)
plt.xlabel("cluster time τ (s)")
plt.ylabel("deviation")
plt.legend()
