"""Stability against cluster time: the Allan family, its noise types and degrees of freedom.

Modules, low to high: `names` (what there is to choose from), `sums` and `total` (samples to angle,
and how estimators sum its differences), `freedom` (degrees of freedom), `estimators`
(the one table of what each estimator is), `noise_type` (clusters, noise and degrees of freedom by
that table), `curve` (all of it).
"""
