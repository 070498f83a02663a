"""
A turning table: before and after its lines
===========================================

Ten minutes of two ring lasers on a table at 40 °/s. Grey is their difference as recorded, blue what
is left when every line that stands above the noise floor has been taken out.
"""

from dataclasses import replace

import matplotlib.pyplot as plt

import sagnac
from sagnac import plot
from sagnac.rig.config import preset

rig = replace(preset("paper"), duration_s=600.0, seed=5)
analysis = sagnac.analyze(sagnac.simulate(rig).recording, gyros=("x", "z"))
plot.stability(analysis, ax=plt.figure().add_subplot())

# %%
# The spectrum says where the lines were, and on which band the answer rests.

plot.spectrum(analysis, ax=plt.figure().add_subplot())
