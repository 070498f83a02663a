"""
Lines in angle and in time
==========================

On a table orders are fixed to its angle and tones to the clock. Each has an amplitude with an
error.
"""

from dataclasses import replace

import matplotlib.pyplot as plt

import sagnac
from sagnac import plot
from sagnac.rig.config import preset

rig = replace(preset("paper"), duration_s=600.0, seed=6)
analysis = sagnac.analyze(sagnac.simulate(rig).recording, gyros=("x", "z"))
plot.lines(analysis, ax=plt.figure().add_subplot())

# %%
# The same orders by their number.

plot.orders(analysis, ax=plt.figure().add_subplot())
