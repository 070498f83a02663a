"""The choice of table rate."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sagnac.paper.prediction import adequate_rate, predicted_angle_random_walk
from sagnac.rig.config import preset
from sagnac.rig.ring_laser import RingLaser, angle_random_walk
from sagnac.rig.truth import truth_of
from sagnac.units import ARCSECOND, DEGREE, DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR
from tests.paper.scope import RATES


def test_prediction_is_the_truth_of_table_2():
    rates = np.array(RATES["table2"]) * DEGREE
    prediction = predicted_angle_random_walk(rates)
    for index, rate in enumerate(RATES["table2"]):
        base = preset("paper")
        config = replace(
            base,
            gyro=replace(base.gyro, mode="rate-biased"),
            table=replace(base.table, rate_deg_per_s=rate),
        )
        truth = truth_of(config).pairs["x-z"].arw_deg_per_sqrt_h * DEGREE_PER_ROOT_HOUR
        laser = math.hypot(prediction.quantum[index], prediction.lock_in[index])
        assert laser == pytest.approx(truth, rel=1e-9)
        assert prediction.total[index] == pytest.approx(
            math.hypot(laser, prediction.encoder[index])
        )
    # Lock-in falls as one over the rate (the Earth's share of it aside).
    np.testing.assert_allclose(prediction.lock_in * rates, prediction.lock_in[0] * rates[0], 2e-3)


def test_prediction_of_one_laser_agrees_with_its_law():
    base = preset("paper")
    rate = 20.0 * DEGREE
    prediction = predicted_angle_random_walk([rate], config=base, pair=("x", "y"))
    expected = []
    for lock_in, share in zip((24.0, 26.0), (1.001, 1.0), strict=True):
        laser = RingLaser(
            lock_in=lock_in * DEGREE_PER_HOUR,
            fringe=1.5 * ARCSECOND,
            quantum_noise=2.5e-5 * DEGREE_PER_ROOT_HOUR,
            backscatter_diffusion=150.0,
        )
        expected.append(float(angle_random_walk(laser, share * rate / math.sqrt(3.0))))
    mean = math.sqrt(np.mean(np.square(expected)))
    assert math.hypot(prediction.quantum[0], prediction.lock_in[0]) == pytest.approx(mean, rel=2e-3)


def test_encoder_part_is_what_white_angle_error_makes():
    """Allan variance of simulated encoder rounding, through the share mismatch, as N."""
    rates = np.array([10.0, 40.0]) * DEGREE
    prediction = predicted_angle_random_walk(rates, cluster_time=2.0)
    line = 2.0 * math.pi / 7_200_000
    rounding = np.random.default_rng(3).uniform(-0.5, 0.5, 200_001) * line
    shares = truth_of(preset("paper")).shares
    error = (shares["x"] - shares["z"]) * rounding
    second = error[2:] - 2.0 * error[1:-1] + error[:-2]
    variance = np.mean(second**2) / (2.0 * 2.0**2)
    expected = math.sqrt(variance * 2.0 / 2.0)  # N^2 = variance tau, half of it per gyro
    np.testing.assert_allclose(prediction.encoder, expected, rtol=0.01)


def test_latch_jitter_makes_a_best_rate():
    rates = np.geomspace(5.0, 300.0, 60) * DEGREE
    free = predicted_angle_random_walk(rates)
    assert np.all(np.diff(free.total) < 0.0)
    held = predicted_angle_random_walk(rates, latch_jitter=2e-6)
    best = int(held.total.argmin())
    assert 0 < best < rates.size - 1
    assert np.all(held.total >= free.total)


def test_without_following_the_table_its_jitter_counts():
    alone = predicted_angle_random_walk([0.5], table_followed=False)
    assert alone.jitter[0] > 0.0
    assert alone.total[0] ** 2 == pytest.approx(
        alone.quantum[0] ** 2 + alone.lock_in[0] ** 2 + alone.jitter[0] ** 2
    )
    base = preset("paper")
    doubled = replace(base, table=replace(base.table, jitter_rms_deg_per_s=0.008))
    twice = predicted_angle_random_walk([0.5], config=doubled)
    assert twice.jitter[0] == pytest.approx(2.0 * alone.jitter[0])


def test_adequate_rate_is_the_first_within_the_excess():
    rates = np.linspace(5.0, 100.0, 96) * DEGREE
    prediction = predicted_angle_random_walk(rates)
    chosen = adequate_rate(prediction, 0.2)
    index = int(np.argmin(np.abs(rates - chosen)))
    assert prediction.total[index] <= 1.2 * prediction.quantum[index]
    assert prediction.total[index - 1] > 1.2 * prediction.quantum[index - 1]
    assert math.isnan(adequate_rate(prediction, 0.0))


@pytest.mark.parametrize("arguments", [{"latch_jitter": -1e-6}, {"cluster_time": 0.0}])
def test_prediction_refuses_what_cannot_be(arguments):
    with pytest.raises(ValueError, match="latch_jitter"):
        predicted_angle_random_walk([0.5], **arguments)


def test_prediction_refuses_a_rate_near_lock_in():
    with pytest.raises(ValueError, match="rate-biased"):
        predicted_angle_random_walk([1e-4])


def test_prediction_is_read_only_and_leaves_its_rates_alone():
    rates = np.array([0.5, 1.0])
    prediction = predicted_angle_random_walk(rates)
    with pytest.raises(ValueError, match="read-only"):
        prediction.total[0] = 0.0
    rates[0] = 0.7
    assert prediction.rates[0] == 0.5
    with pytest.raises(ValueError, match=r"pair is \('x', 'w'\); use two of x, y, z"):
        predicted_angle_random_walk(rates, pair=("x", "w"))
