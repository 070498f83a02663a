"""Stability against cluster time: the Allan family, its noise types and degrees of freedom.

Modules, low to high: `sums` (samples to angle, and how estimators sum its differences), `freedom`
(degrees of freedom), `estimators` (the one table of what each estimator is), `noise_type`
(clusters, noise and degrees of freedom by that table), `curve` (all of it).
What a caller chooses from stands here, where nothing compiled is imported.
"""

from typing import Literal

Estimator = Literal[
    "adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "totdev", "mtotdev", "theo1", "theoh", "haar"
]
Gaps = Literal["reject", "omit"]
