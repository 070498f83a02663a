"""The choice of table rate."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.core.units import ARCSECOND, DEGREE, DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR
from sagnac.lines.search import remove_lines
from sagnac.paper.prediction import adequate_rate, predicted_angle_random_walk
from sagnac.rig.config import preset
from sagnac.rig.ring_laser import RingLaser, angle_random_walk
from sagnac.rig.sections import DisturbancesConfig, EncoderConfig
from sagnac.rig.simulate import simulate
from sagnac.rig.truth import truth_of
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
        assert prediction.total[index] == pytest.approx(laser)
    # Lock-in falls as one over the rate (the Earth's share of it aside).
    np.testing.assert_allclose(prediction.lock_in * rates, prediction.lock_in[0] * rates[0], 2e-3)


def test_prediction_of_one_laser_agrees_with_its_law():
    base = preset("paper")
    rate = 20.0 * DEGREE
    prediction = predicted_angle_random_walk([rate], config=base)
    expected = []
    for lock_in, share in zip((24.0, 28.0), (1.001, 0.999), strict=True):
        laser = RingLaser(
            lock_in=lock_in * DEGREE_PER_HOUR,
            fringe=1.5 * ARCSECOND,
            quantum_noise=2.5e-5 * DEGREE_PER_ROOT_HOUR,
            backscatter_diffusion=150.0,
        )
        expected.append(float(angle_random_walk(laser, share * rate / math.sqrt(3.0))))
    mean = math.sqrt(np.mean(np.square(expected)))
    assert math.hypot(prediction.quantum[0], prediction.lock_in[0]) == pytest.approx(mean, rel=2e-3)


def test_encoder_part_is_quantization_noise():
    """Allan variance of simulated encoder rounding, through the share mismatch: 3 Q^2/tau^2."""
    prediction = predicted_angle_random_walk([10.0 * DEGREE, 40.0 * DEGREE], latch_jitter=0.0)
    line = 2.0 * math.pi / 7_200_000
    rounding = np.random.default_rng(3).uniform(-0.5, 0.5, 200_001) * line
    shares = truth_of(preset("paper")).shares
    error = (shares["x"] - shares["z"]) * rounding
    second = error[2:] - 2.0 * error[1:-1] + error[:-2]
    tau = 2.0
    variance = np.mean(second**2) / (2.0 * tau**2)
    expected = math.sqrt(variance * tau**2 / 3.0 / 2.0)  # half of it per gyro
    np.testing.assert_allclose(prediction.encoder, expected, rtol=0.01)


def test_latch_jitter_moves_q_and_leaves_n():
    rates = np.geomspace(5.0, 300.0, 60) * DEGREE
    free = predicted_angle_random_walk(rates)
    late = predicted_angle_random_walk(rates, latch_jitter=1e-4)
    np.testing.assert_array_equal(late.total, free.total)
    assert np.all(np.diff(free.total) < 0.0)
    # Far above the encoder's step the part is mismatch * rate * jitter / sqrt(2).
    shares = truth_of(preset("paper")).shares
    expected = abs(shares["x"] - shares["z"]) * rates * 1e-4 / math.sqrt(2.0)
    np.testing.assert_allclose(late.encoder, expected, rtol=1e-3)
    assert np.all(np.diff(late.corner(500.0)) < 0.0)
    stated = replace(preset("paper"), encoder=EncoderConfig(latch_jitter_s=1e-4))
    by_rig = predicted_angle_random_walk(rates, config=stated)
    np.testing.assert_allclose(by_rig.encoder, late.encoder)


def test_a_rig_with_latch_jitter_reads_as_predicted():
    """Followed along the encoder Q is as predicted; the analysis of the pair reads N alone."""
    base = preset("paper")
    config = replace(
        base,
        duration_s=900.0,
        sample_rate_hz=100.0,
        gyro=replace(base.gyro, mode="rate-biased"),
        encoder=EncoderConfig(latch_jitter_s=2e-5),
        disturbances=DisturbancesConfig(),
    )
    prediction = predicted_angle_random_walk([40.0 * DEGREE], config=config)
    recording = simulate(config).recording
    # Followed along the readings as they are, what the latch leaves is white noise of the angle.
    difference = recording.gyro("x").values - recording.gyro("z").values
    along = remove_lines(difference, recording.table.values, 100.0, channel="x-z")
    steps = np.diff(along.residual)
    left = math.sqrt(-0.5 * np.mean(steps[1:] * steps[:-1]))  # per gyro
    assert left == pytest.approx(prediction.quantization[0], rel=0.05)
    # The pair by itself is free of it.
    analysis = analyze(recording, Settings(gyros=("x", "z"), confidence=0.999))
    answer = analysis.angle_random_walk
    assert answer.status == "estimated"
    assert answer.low <= prediction.total[0] <= answer.high
    assert answer.value == pytest.approx(prediction.total[0], rel=0.15)
    q = analysis.fits["likelihood"].coefficients["quantization"]
    assert q.value < 0.1 * prediction.quantization[0]
    assert math.sqrt(3.0) * prediction.encoder[0] > 3.0 * answer.high


def test_a_rig_that_dwells_is_predicted_for_its_turning():
    base = preset("paper")
    dwelling = replace(base, table=replace(base.table, reversal_interval_s=60.0, dwell_s=5.0))
    even, stops = (predicted_angle_random_walk([0.5], config=one) for one in (base, dwelling))
    assert stops.total[0] == even.total[0]


def test_the_jitter_of_a_servo_that_holds_the_angle_is_quantization():
    alone = predicted_angle_random_walk([0.5])
    assert alone.jitter[0] > 0.0
    assert alone.total[0] == pytest.approx(math.hypot(alone.quantum[0], alone.lock_in[0]))
    base = preset("paper")
    doubled = replace(base, table=replace(base.table, jitter_rms_deg_per_s=0.008))
    twice = predicted_angle_random_walk([0.5], config=doubled)
    assert twice.jitter[0] == pytest.approx(2.0 * alone.jitter[0])
    walking = replace(base, table=replace(base.table, jitter_spectrum="rate"))
    assert predicted_angle_random_walk([0.5], config=walking).jitter[0] == 0.0


def test_adequate_rate_is_the_first_within_the_excess():
    rates = np.linspace(5.0, 100.0, 96) * DEGREE
    prediction = predicted_angle_random_walk(rates)
    chosen = adequate_rate(prediction, 0.2)
    index = int(np.argmin(np.abs(rates - chosen)))
    assert prediction.total[index] <= 1.2 * prediction.quantum[index]
    assert prediction.total[index - 1] > 1.2 * prediction.quantum[index - 1]
    assert math.isnan(adequate_rate(prediction, 0.0))


def test_prediction_refuses_what_cannot_be():
    with pytest.raises(ValueError, match="latch_jitter"):
        predicted_angle_random_walk([0.5], latch_jitter=-1e-6)


def test_prediction_refuses_a_rate_near_lock_in():
    with pytest.raises(ValueError, match="rate-biased"):
        predicted_angle_random_walk([1e-4])


def test_a_prediction_leaves_its_rates_alone():
    rates = np.array([0.5, 1.0])
    prediction = predicted_angle_random_walk(rates)
    rates[0] = 0.7
    assert prediction.rates[0] == 0.5
