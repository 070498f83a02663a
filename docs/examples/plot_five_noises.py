"""
Five noises on an Allan plot
============================

Quantization, angle random walk, bias instability, rate random walk and rate ramp, each alone and
with its slope.
"""

import matplotlib.pyplot as plt
import numpy as np

from sagnac.noise.laws import COEFFICIENT_NAMES, SYMBOLS, allan_variance

tau = np.geomspace(0.01, 1e4, 200)
units = dict(zip(COEFFICIENT_NAMES, (0.05, 1.0, 0.3, 0.03, 3e-4), strict=True))
figure, axes = plt.subplots()
total = np.zeros_like(tau)
for name, value in units.items():
    law = allan_variance(tau, {name: value})
    total += law
    axes.loglog(tau, np.sqrt(law), label=f"{SYMBOLS[name]}, {name.replace('_', ' ')}")
axes.loglog(tau, np.sqrt(total), "k", linewidth=2, label="together")
axes.set(xlabel="cluster time τ (s)", ylabel="Allan deviation", ylim=(0.02, 20.0))
axes.legend()
