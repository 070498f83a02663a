"""What the whole answer costs where five terms are the truth and the likelihood alone would do.

Run by ``make test-statistics``; prints the table that stands in the documentation. The noises are
those of `tests.noise.test_statistics`, made without the package.
"""

import numpy as np
import pytest
from scipy.stats import binom

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.recording.model import Recording
from tests.noise.test_statistics import (
    CASES,
    SEED,
    average,
    cramer_rao,
    simulated_rates,
)

RECORDINGS = 200
# One unit of the simulated rate, rad/s.
UNIT = 1e-6
# Chance moves the root mean square error of 200 recordings by 5 % (one standard error).
CHANCE = 2.0 / np.sqrt(2.0 * RECORDINGS)


def answers(case, count):
    """(count, 7): value, low and high of the answer and of the likelihood, and which it was."""
    generator = np.random.default_rng([SEED, 1000 + CASES.index(case)])
    first, *second = (simulated_rates(gyro, count, generator) for gyro in case.gyros)
    # At rest each gyro is taken alone: a difference is one gyro here, of the mean variance of two.
    rates = (first - second[0]) / np.sqrt(2.0) if second else first
    rows = []
    for number in range(count):
        recording = Recording.from_arrays(
            x=UNIT * rates[number], kind="rate", unit="rad/s", sample_rate=1.0
        )
        analysis = analyze(recording, Settings(gyros=("x",), method="none"))
        answer = analysis.angle_random_walk
        assert answer.status == "estimated"
        fitted = analysis.fits["likelihood"].coefficients["angle_random_walk"]
        both = [answer.value, answer.low, answer.high, fitted.value, fitted.low, fitted.high]
        won = analysis.average is not None and analysis.average.member == "whole band"
        rows.append([*(each / UNIT for each in both), won])
    return np.array(rows)


@pytest.mark.statistics
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_answer_is_nearly_as_narrow_as_the_likelihood_of_five_terms(case):
    value, low, high, _, fitted_low, fitted_high, won = answers(case, RECORDINGS).T
    truth = average(case.gyros)
    held = float(np.mean((low <= truth) & (truth <= high)))
    fit_held = float(np.mean((fitted_low <= truth) & (truth <= fitted_high)))
    wider = (high - low) / (fitted_high - fitted_low)
    error = float(np.sqrt(np.mean((value - truth) ** 2)) / cramer_rao(case.gyros, "QNBK"))
    print(
        f"| {case.name} | {100.0 * held:.1f} % | {100.0 * fit_held:.1f} % | {error:.3f} | "
        f"{np.median(wider):.3f} | "
        f"{np.mean(wider):.3f} | {100.0 * np.mean(won):.0f} % |"
    )
    # If the coverage is 95 %, one run in a hundred has a case below this. The recordings are the
    # same for the likelihood, whose own coverage 1000 recordings show.
    assert held >= binom.ppf(0.01 / len(CASES), RECORDINGS, 0.95) / RECORDINGS
    assert held >= fit_held - 0.01
    assert np.mean(wider) <= 1.25
    assert error <= 1.15 * (1.0 + CHANCE)
