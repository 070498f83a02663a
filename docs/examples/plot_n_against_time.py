"""
N against time
==============

A unit that is twice as loud for its last third. N is read over parts of the record, and the
interval of the answer covers them.
"""

import matplotlib.pyplot as plt
import numpy as np

import sagnac
from sagnac import plot

random = np.random.default_rng(3)
loudness = np.where(np.arange(90_000) < 60_000, 1.0, 2.0)
rates = 0.05 * 60.0 * np.sqrt(50.0) * loudness * random.standard_normal(90_000)  # °/h
unit = sagnac.Recording.from_arrays(x=rates, kind="rate", unit="deg/h", sample_rate=50.0)
analysis = sagnac.analyze(unit, accepted=("unsteady",))
plot.parts(analysis, ax=plt.figure().add_subplot())
