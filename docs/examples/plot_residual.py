"""
What is left, by table angle
============================

The residual of a pair after its lines were taken out, against time and folded over one turn.
"""

from dataclasses import replace

import matplotlib.pyplot as plt

import sagnac
from sagnac import plot
from sagnac.rig.config import preset

rig = replace(preset("paper"), duration_s=600.0, seed=7)
analysis = sagnac.analyze(sagnac.simulate(rig).recording, gyros=("x", "z"))
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.8))
plot.residual(analysis, ax=left)
plot.residual_by_angle(analysis, ax=right)
