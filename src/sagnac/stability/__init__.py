"""Stability against cluster time: the Allan family, its noise types and degrees of freedom.

Modules, low to high: `names` (what there is to choose from), `accumulate` (samples to angle),
`sums`, `total` and `theo1` (how estimators sum their differences), `freedom_laws` (published
degrees of freedom), `estimators` (the one table of what each estimator is), `clusters`,
`noise_type` and `degrees_of_freedom` (questions put to that table), `curve` (all of it).
"""
