"""A forecast of the interval against laws, and against what longer recordings give."""

import dataclasses

import numpy as np
import pytest
from scipy.special import ndtri

import sagnac
from sagnac.analysis.forecast import shown_by
from sagnac.coefficients.laws import STOCHASTIC_NAMES
from sagnac.errors import RecordingError
from sagnac.specification.planning import Shown

WHITE = Shown(
    value=1.0,
    low=0.9,
    high=1.1,
    confidence=0.95,
    coefficients={"angle_random_walk": 1.0},
    terms=("angle_random_walk",),
    duration=100.0,
    highest=5.0,
    interval=0.1,
    efficient=True,
)


def test_white_noise_by_hand():
    # 2 T f bins of one degree of freedom: N^2 to sqrt(2/n), N to half of that.
    for duration in (100.0, 7200.0, 1e6):
        by_hand = 0.5 * ndtri(0.975) * np.sqrt(2.0 / (2.0 * duration * 5.0))
        assert WHITE.expected(duration) == pytest.approx(by_hand, rel=1e-3)


def test_an_average_is_as_much_wider_as_the_short_recording_shows():
    wide = dataclasses.replace(WHITE, efficient=False)
    assert wide.expected(100.0) == pytest.approx(wide.half_width)
    assert wide.expected(400.0) == pytest.approx(0.5 * wide.half_width, rel=1e-2)


def test_terms_that_are_fitted_beside_n_take_information():
    beside = dataclasses.replace(WHITE, terms=STOCHASTIC_NAMES)
    assert beside.expected(1e3) > 1.02 * WHITE.expected(1e3)
    # The information by sums over every bin, without groups of bins.
    walk = dataclasses.replace(
        WHITE,
        terms=("angle_random_walk", "rate_random_walk"),
        coefficients={"angle_random_walk": 1.0, "rate_random_walk": 0.1},
    )
    duration = 2000.0
    frequency = np.arange(1, 20_001) / (2.0 * duration)
    shares = np.stack([np.ones_like(frequency), (2.0 * np.pi * frequency) ** -2.0], axis=1)
    relative = shares / (shares @ [1.0, 0.01])[:, np.newaxis]
    variance = np.linalg.inv(0.5 * relative.T @ relative)[0, 0]
    # The laws are of sampled increments, the sums of the continuous rate.
    assert walk.expected(duration) == pytest.approx(
        0.5 * ndtri(0.975) * np.sqrt(variance), rel=0.01
    )


def test_the_duration_is_that_of_the_width():
    # Bins are whole: at a tenth there are some two hundred.
    for width in (0.1, 0.01):
        assert WHITE.expected(WHITE.duration_for(width)) == pytest.approx(width, rel=5e-3)
    with pytest.raises(RecordingError, match="more than a year"):
        WHITE.duration_for(1e-6)
    with pytest.raises(RecordingError, match="lies at the limit"):
        WHITE.duration_to_decide(1.0)


def test_a_limit_is_decided_as_often_as_said():
    # N scatters by one standard error about its truth; its interval is two of them wide each way.
    duration = WHITE.duration_to_decide(1.1, power=0.9)
    half_width = WHITE.expected(duration)
    error = half_width / ndtri(0.975)
    found = np.exp(error * np.random.default_rng(2).standard_normal(20_000))
    decided = found * np.exp(half_width) <= 1.1
    assert decided.mean() == pytest.approx(0.9, abs=0.01)


def test_what_shows_nothing_is_refused():
    with pytest.raises(ValueError, match="must lie within"):
        dataclasses.replace(WHITE, low=1.2)
    with pytest.raises(ValueError, match="terms lacks"):
        dataclasses.replace(WHITE, terms=("quantization",))


def test_from_a_tenth_of_the_record():
    """Walk of the angle and steps of the readout, as a ring laser has them."""
    random, samples = np.random.default_rng(5), 36_000
    angle = np.cumsum(random.standard_normal(samples)) * 7.4e-9 * np.sqrt(0.1)
    angle += 1.4e-9 * random.standard_normal(samples)

    def analyzed(values):
        recording = sagnac.Recording.from_arrays(
            x=values, kind="angle", unit="rad", sample_rate=10.0
        )
        return sagnac.analyze(recording, sagnac.Settings(method="none"))

    whole = shown_by(analyzed(angle))
    forecast = shown_by(analyzed(angle[: samples // 10])).expected(whole.duration)
    assert forecast == pytest.approx(whole.half_width, rel=0.1)
