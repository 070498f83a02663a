"""The low-pass of a sensor: where its spectrum falls below what N, B and K make."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import minimize_scalar

from sagnac.analysis.headline_coefficients import answer_coefficients
from sagnac.analysis.result import Analysis
from sagnac.arrays import FloatArray
from sagnac.coefficients.band_models import ORDERS
from sagnac.coefficients.laws import CoefficientName, rate_density_basis

# Share of the weight of fits under a low-pass, and the part of N left at the highest frequencies,
# from which on there is one.
_SHARE: Final = 0.2
_FALLEN: Final = 0.5
# What is left of N below this part is a floor of another kind, such as steps of the readout.
_FLOOR: Final = 0.01
_TERMS: Final[tuple[CoefficientName, ...]] = (
    "angle_random_walk",
    "bias_instability",
    "rate_random_walk",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorLowPass:
    """A Butterworth low-pass: its corner (-3 dB), Hz, and its order."""

    corner: float
    order: int


def low_pass_of(analysis: Analysis) -> SensorLowPass | None:
    """The low-pass that the spectrum of one gyro or accelerometer shows; None if there is none.

    The rate density over N, B and K falls as ``1/(1 + (tan(pi f/r)/tan(pi c/r))^(2 order))`` behind
    a filter of corner c that works at the sample rate r, and nearly so behind any of its order.

    Parameters
    ----------
    analysis
        Of one channel, with its spectrum.
    """
    walk, resting = analysis.angle_random_walk, analysis.average
    if resting is None or resting.falls < _SHARE or walk.status != "estimated":
        return None
    frequency, density = analysis.spectrum.frequency, analysis.spectrum.density
    rate = analysis.recording.sample_rate
    sound = (frequency > 0.0) & (frequency < 0.49 * rate) & (density > 0.0)
    frequency, density = frequency[sound], density[sound]
    found = answer_coefficients(analysis)
    squares = np.zeros(rate_density_basis(frequency, 1.0 / rate).shape[1])
    for place, name in enumerate(_TERMS, start=1):
        if name in found and found[name].status == "estimated":
            squares[place] = found[name].value ** 2
    share = density / (rate_density_basis(frequency, 1.0 / rate) @ squares)
    share /= analysis.gyros_differenced
    if not share.size or not float(np.median(share[-5:])) < _FALLEN:
        return None
    kept = share > _FLOOR
    fits = [_fitted(frequency[kept], share[kept], rate, order) for order in ORDERS]
    return min(fits, key=lambda fit: fit[0])[1]


def low_pass_data(analysis: Analysis) -> dict[str, dict[str, float]]:
    """The same for JSON: ``low_pass`` with ``corner_hz`` and ``order``; ``{}`` if there is none."""
    found = low_pass_of(analysis)
    return {} if found is None else {"low_pass": {"corner_hz": found.corner, "order": found.order}}


def _fitted(
    frequency: FloatArray, share: FloatArray, rate: float, order: int
) -> tuple[float, SensorLowPass]:
    """What a filter of an order leaves unexplained, and its corner; bins count by their width."""
    warped = np.tan(np.pi * frequency / rate)

    def missed(logarithm: float) -> float:
        corner = np.tan(np.pi * np.exp(logarithm) / rate)
        left = np.log(share) + np.log1p((warped / corner) ** (2 * order))
        return float(frequency @ left**2)

    bounds = (np.log(frequency[0]), np.log(0.499 * rate))
    best = minimize_scalar(missed, bounds=bounds, method="bounded", options={"xatol": 1e-4})
    return float(best.fun), SensorLowPass(corner=float(np.exp(best.x)), order=order)
