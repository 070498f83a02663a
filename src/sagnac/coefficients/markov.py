"""A first-order Markov rate in a spectrum: whether there is one, and its estimates."""

import math

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import ndtri

from sagnac.coefficients.estimates import Estimate, OptionalName, SquaredEstimate
from sagnac.coefficients.limits import PRESENCE_OF_TWO
from sagnac.coefficients.maximum import Optimum, errors_of, maximize
from sagnac.coefficients.spectrum_model import MarkovRate, SpectrumModel


def found_markov(model: SpectrumModel) -> MarkovRate | None:
    """The most likely Markov rate, if leaving it out costs three standard deviations.

    Its time is looked for from three sample intervals to an eighth of the record.
    """

    def fit(time: float) -> Optimum:
        return maximize(model.ordinates(MarkovRate(time=time)))

    interval = model.cosine.interval
    grid = np.geomspace(3.0 * interval, model.samples * interval / 8.0, 25)
    at = int(np.argmin([fit(float(time)).deviance for time in grid]))
    refined = minimize_scalar(
        lambda logarithm: fit(math.exp(logarithm)).deviance,
        bounds=np.log(grid[[max(at - 1, 0), min(at + 1, grid.size - 1)]]),
        method="bounded",
        options={"xatol": 1e-3},
    )
    time = math.exp(refined.x)
    best = fit(time)
    driving = float(best.squares[-1])
    absent = maximize(model.ordinates()).deviance
    if driving > 0.0 and absent - best.deviance > PRESENCE_OF_TWO:
        return MarkovRate(time=time, driving=driving)
    return None


def markov_estimates(
    best: Optimum, rate: MarkovRate | None, gyros_differenced: int, confidence: float
) -> dict[OptionalName, Estimate]:
    """q_c and T_c of a Markov rate, or that there is none.

    Parameters
    ----------
    best
        Maximum of a spectrum whose last two terms are the squared driving noise, and the
        logarithm of the time.
    rate
        The one that was found.
    gyros_differenced, confidence
        As in `likelihood_fit`.
    """
    if rate is None:
        unseen = SquaredEstimate.unseen()
        return {
            "markov_driving_noise": unseen.of_one_gyro(
                "markov_driving_noise", gyros_differenced, confidence
            ),
            "markov_correlation_time": unseen.of_one_gyro(
                "markov_correlation_time", gyros_differenced, confidence
            ),
        }
    errors = errors_of(best.fisher)
    deviations = float(ndtri(0.5 + 0.5 * confidence))
    square, shift = float(best.squares[-2]), float(best.squares[-1])
    spread = math.exp(deviations * float(errors[-2]) / square)
    length = math.exp(deviations * float(errors[-1]))
    middle = rate.time * math.exp(shift)
    return {
        "markov_driving_noise": SquaredEstimate(
            value=square, low=square / spread, high=square * spread, status="estimated"
        ).of_one_gyro("markov_driving_noise", gyros_differenced, confidence),
        "markov_correlation_time": Estimate(
            name="markov_correlation_time",
            value=middle,
            low=middle / length,
            high=middle * length,
            confidence=confidence,
            status="estimated",
        ),
    }
