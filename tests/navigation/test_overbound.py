"""The smallest model above the limit of a curve."""

import numpy as np
import pytest
from scipy import stats

from sagnac.core.errors import RecordingError
from sagnac.navigation.models import (
    UpperLimit,
    common_time,
    envelope,
    overbound,
    upper_limit,
    white_and_markov,
)
from sagnac.noise.laws import markov_allan_variance

TAU = 2.0 ** np.arange(11)


def exact(variance):
    deviation = np.sqrt(variance)
    return UpperLimit(tau=TAU, deviation=deviation, limit=deviation, confidence=0.95)


def test_the_limit_is_that_of_chi_squared():
    edf = 1000.0 / TAU
    found = upper_limit(TAU, TAU**-0.5, edf, confidence=0.9)
    assert found.tau[-1] == 32.0  # the last with twenty degrees of freedom
    for tau, limit in zip(found.tau, found.limit, strict=True):
        lower = stats.chi2.ppf(0.1, 1000.0 / tau)
        assert limit == pytest.approx(np.sqrt(1000.0 / tau / lower / tau), rel=1e-9)


def test_a_curve_that_is_a_model_gives_that_model():
    found = overbound(exact(4.0 / TAU + 1e-4 * TAU / 3.0))
    assert (found.white, found.walk, found.markov) == (
        pytest.approx(2.0, rel=1e-6), pytest.approx(0.01, rel=1e-4), (),
    )  # fmt: skip
    assert overbound(exact(9.0 / TAU)).white == pytest.approx(3.0)


def test_a_markov_rate_is_taken_where_it_is_worth_it():
    variance = 1.0 / TAU + markov_allan_variance(TAU, 0.05, 32.0)
    limit = exact(variance)
    simple, full = (overbound(limit, most_markov=most) for most in (0, 2))
    assert simple.markov == ()
    assert len(full.markov) == 1
    assert 10.0 < full.markov[0].correlation_time < 100.0
    for found in (simple, full):
        assert np.all(found.allan_deviation(TAU) >= np.sqrt(variance) * (1.0 - 1e-9))
    assert limit.inflation(full) < min(1.02, limit.inflation(simple))


@pytest.mark.parametrize("bend", [0.05, 0.3])
def test_no_pair_of_white_noise_and_a_walk_is_inflated_less(bend):
    variance = 1.0 / TAU + bend * markov_allan_variance(TAU, 0.3, 20.0) + 1e-6 * TAU / 3.0
    found = overbound(exact(variance), most_markov=0)
    inflation = np.mean(np.log(found.allan_deviation(TAU) ** 2 / variance))
    # For every N the least K that lies above.
    for square in np.linspace(0.0, (variance * TAU).max(), 2000):
        walk = max(0.0, ((variance - square / TAU) * 3.0 / TAU).max())
        model = square / TAU + walk * TAU / 3.0
        assert inflation <= np.mean(np.log(model / variance)) + 1e-9


def test_what_a_tool_wants_is_there():
    limit = exact(1.0 / TAU)
    walks = overbound(limit, most_markov=0, walks=True)
    assert walks.walk**2 * TAU[-1] / 3.0 == pytest.approx(0.02 / TAU[-1], rel=1e-6)
    assert overbound(limit, most_markov=0, least_white=1.5).white == pytest.approx(1.5)
    noisy = exact(1.0 / TAU + 3.0 * 0.7**2 / TAU**2)
    assert overbound(noisy, angle=True).angle == pytest.approx(0.7, rel=1e-3)


@pytest.mark.parametrize("most", [0, 1])
def test_what_was_measured_with_few_degrees_of_freedom_is_reached(most):
    """A walk that shows where the curve ends, beyond what its limit tells of."""
    edf, variance = 1000.0 / TAU, 1.0 / TAU + 1e-5 * TAU / 3.0
    limit = upper_limit(TAU, np.sqrt(variance), edf)
    assert limit.beyond[0].tolist() == [64.0, 128.0, 256.0]
    found = overbound(limit, most_markov=most, walks=True)
    reached = found.allan_deviation(limit.beyond[0])
    assert np.all(reached >= np.sqrt(variance[6:9]) * (1.0 - 1e-9))
    slowed = white_and_markov(limit, 1e4)
    assert np.all(slowed.allan_deviation(limit.beyond[0]) >= np.sqrt(variance[6:9]) * (1 - 1e-9))
    # A model of two curves reaches both.
    louder = upper_limit(TAU, 2.0 * np.sqrt(variance), edf)
    both = overbound(envelope([limit, louder]), most_markov=most, walks=True)
    twice = 2.0 * np.sqrt(variance[6:9])
    assert np.all(both.allan_deviation(limit.beyond[0]) >= twice * (1.0 - 1e-9))


@pytest.mark.parametrize("angle", [1.5, 15.0])
def test_vibration_at_short_times_hides_no_walk(angle):
    """White noise that covers it lies above the walk at every cluster time of a limit."""
    walk = 0.02
    slow = 1.0 / TAU + walk**2 * TAU / 3.0
    limit = exact(slow + 3.0 * angle**2 / TAU**2)
    for most in (0, 2):
        found = overbound(limit, most_markov=most, walks=True)
        assert found.angle == 0.0
        assert np.all(found.allan_deviation(TAU) >= limit.limit * (1.0 - 1e-9))
        assert found.walk >= 0.95 * walk
    time = common_time([limit])
    still, shaken = (white_and_markov(one, time).markov[0] for one in (exact(slow), limit))
    assert shaken.driving_noise >= 0.95 * still.driving_noise


def test_a_markov_rate_lasts_ten_times_as_long_as_the_curve_was_measured():
    limit = upper_limit(TAU, np.sqrt(1.0 / TAU + 1e-5 * TAU / 3.0), 1000.0 / TAU)
    assert limit.tau[-1] < limit.beyond[0, -1] == 256.0
    assert common_time([limit]) == 2560.0


def test_too_short_a_curve_is_refused():
    with pytest.raises(RecordingError, match="record longer"):
        upper_limit(TAU, TAU**-0.5, np.full(TAU.size, 3.0))


def test_a_markov_rate_in_the_place_of_a_walk_forgets_nothing_that_was_measured():
    # A rate of 30 s is seen in the curve, and chance bends that of a walk down as a rate of 500 s.
    bends = (markov_allan_variance(TAU, 0.3, 30.0), markov_allan_variance(TAU, 0.01, 500.0))
    for slow in (*bends, 1e-4 * TAU / 3.0):
        bent = exact(1.0 / TAU + slow)
        model = white_and_markov(bent, common_time([bent]))
        assert np.all(model.allan_deviation(TAU) >= bent.limit * (1.0 - 1e-9))
        walks = overbound(bent, most_markov=0, walks=True)
        far = np.array([TAU[-1], 2.0 * TAU[-1], 4.0 * TAU[-1]])
        assert np.all(model.allan_deviation(far) >= 0.85 * walks.allan_deviation(far))
