"""Pictures of a result on an axis of matplotlib: stability, spectrum, lines.

Each function takes a result and an axis, draws, and gives the axis back; without an axis it
draws on the current one of ``pyplot``. Values are in the field's units and per gyro.
Analyses drawn one over the other by `stability` or `spectrum` are told apart by ``label``.
"""

from sagnac.report.density import lines, self_noise, spectrum
from sagnac.report.deviation import orders, parts, residual, residual_by_angle, stability

__all__ = [
    "lines",
    "orders",
    "parts",
    "residual",
    "residual_by_angle",
    "self_noise",
    "spectrum",
    "stability",
]
