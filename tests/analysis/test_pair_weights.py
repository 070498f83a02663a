"""A pair of which each gyro has a weight of its own: the interval holds the plain mean."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.analysis.averaged import Headline
from sagnac.analysis.encoder import for_plain_mean
from sagnac.analysis.measurement import (
    Measurement,
    TurningTable,
    measure,
    turning_table,
    without_encoder_errors,
)
from sagnac.analysis.pipeline import analyze
from sagnac.noise.estimates import Estimate
from sagnac.recording.model import Recording
from sagnac.table.estimate import estimated_table
from tests.instruments import Readout, turntable

SIGMA = 1.3e-3  # standard error of ln N, as of two hours at 500 Hz
DRAWS = 1500


def pair(apart: float) -> Measurement:
    """Two gyros whose weights are a factor `apart` apart."""
    first = np.sqrt(2.0 / (1.0 + apart**2))
    return Measurement(
        channel="x-z",
        angle=np.zeros(2),
        gyros=("x", "z"),
        sample_rate=1.0,
        weights=(first, -first * apart),
    )


def read(value: float, confidence: float) -> Headline:
    reach = {0.95: 1.959964, 0.68: 0.994458}[confidence]
    estimate = Estimate(
        name="angle_random_walk",
        value=value,
        low=value * np.exp(-reach * SIGMA),
        high=value * np.exp(reach * SIGMA),
        confidence=confidence,
        status="estimated",
    )
    return Headline(estimate=estimate, source="")


def coverage(measured: Measurement, part: float, confidence: float) -> float:
    """How often the interval holds the root mean square of two N, one with a part of the noise."""
    squares = np.array([part, 1.0 - part])
    truth = np.sqrt(squares.sum() / 2.0)
    weighted = np.sqrt(squares @ np.square(measured.weights) / 2.0)
    errors = SIGMA * np.random.default_rng(7).standard_normal(DRAWS)
    held = 0
    for value in weighted * np.exp(errors):
        found = for_plain_mean(measured, read(float(value), confidence)).estimate
        held += found.low <= truth <= found.high
    return held / DRAWS


@pytest.mark.parametrize("confidence", [0.95, 0.68])
@pytest.mark.parametrize("apart", [1.0005, 1.0035, 1.01, 1.5])
def test_the_plain_mean_is_held_whichever_gyro_has_the_noise(apart, confidence):
    chance = 3.0 * np.sqrt(confidence * (1.0 - confidence) / DRAWS)
    found = [coverage(pair(apart), part, confidence) for part in (0.0, 0.5, 1.0)]
    assert min(found) > confidence - chance
    # At either end it is no wider than it has to be.
    assert max(found[0], found[2]) < confidence + chance


def test_equal_weights_change_nothing():
    answer = read(1.0, 0.95)
    assert for_plain_mean(pair(1.0), answer) is answer


def test_a_bound_is_that_of_the_gyro_that_counts_least():
    answer = read(1.0, 0.95)
    bound = replace(answer.estimate, value=1.0, low=0.0, high=1.0, status="upper bound")
    found = for_plain_mean(pair(1.02), replace(answer, estimate=bound)).estimate
    least = min(map(abs, pair(1.02).weights))
    assert found.low == 0.0
    assert found.value == found.high == pytest.approx(1.0 / least)


@pytest.mark.parametrize("status", ["estimated", "upper bound"])
def test_a_pair_that_is_all_but_one_gyro_shows_that_one_and_no_mean(status):
    answer = read(1e-6, 0.95)
    if status == "upper bound":
        answer = replace(answer, estimate=answer.estimate.bounded(1e-6))
    found = for_plain_mean(pair(300.0), answer)
    assert found.estimate.status == "not observable"
    (note,) = found.notes
    assert note.level == "warning"
    assert "it shows z alone, whose angle random walk reads" in note.text


def test_readout_noise_of_an_unlike_pair_is_held_by_its_interval():
    # x hardly counts, and has all the noise of readout.
    made = turntable(
        3,
        seconds=600.0,
        sample_rate=50.0,
        walk=1e-3,
        jitter=1e-3,
        shares={"x": 0.9, "z": 0.3},
        readout=Readout(step=1e-3),
    )
    rng = np.random.default_rng(3)
    angles = {name: made.angles[name] for name in "xz"}
    angles["x"] = angles["x"] + 0.5 * rng.standard_normal(made.encoder.size)
    recording = Recording.from_arrays(
        **angles, table=made.encoder, kind="angle", unit="arcsec", sample_rate=50.0
    )
    found = analyze(recording, gyros=("x", "z")).coefficients["quantization"].to("arcsec")
    assert found.low < 0.5 / np.sqrt(2.0) < found.high


@pytest.mark.parametrize("draws", [4, pytest.param(8, marks=pytest.mark.statistics)])
def test_each_gyro_of_a_triad_is_told_apart_though_their_shares_differ(draws):
    """White noise on a table with ripple; the truth is what was put in."""
    rate, samples = 50.0, 20_000
    walks, shares = {"x": 0.05, "y": 0.1, "z": 0.07}, {"x": 0.5, "y": 0.6, "z": 0.7}
    ratios, errors = [], []
    for seed in range(draws):
        random, time = np.random.default_rng(seed), np.arange(samples) / rate
        table = 40.0 * time + 0.002 * np.sin(3.0 * time) + 1e-4 * random.standard_normal(samples)
        angles = {
            name: shares[name] * table
            + np.cumsum(walks[name] / 60.0 * random.standard_normal(samples)) / np.sqrt(rate)
            for name in walks
        }
        known = {"kind": "angle", "unit": "deg", "sample_rate": rate}
        found = analyze(Recording.from_arrays(**angles, table=table, **known), gyros=tuple("xyz"))
        own = {name: found.per_gyro[name].to("deg/sqrt(h)") for name in walks}
        ratios += [[own[name].value / walks[name] for name in walks]]
        errors += [[(own[name].high - own[name].low) / 3.92 / walks[name] for name in walks]]
    # By the errors that are claimed: the scatter of four draws may be a tenth of itself by chance.
    error = np.mean(errors, axis=0) / np.sqrt(draws)
    assert np.all(np.abs(np.mean(ratios, axis=0) - 1.0) < 3.0 * error)
    assert np.all(error < 0.1 / np.sqrt(draws))
    assert np.all(np.std(ratios, axis=0, ddof=1) < 0.085)


@pytest.mark.parametrize("walk", [1e-8, 2e-10])
@pytest.mark.parametrize("second", [0.578, -0.578])
@pytest.mark.parametrize("seed", range(4))
def test_gyros_far_quieter_than_a_fast_table_are_weighted_as_others_are(seed, second, walk):
    """The quieter of them differ from one another by less than the rounding of their motion."""
    random, samples = np.random.default_rng(seed), 30_000
    table = np.cumsum(np.radians(95.0 + 0.02 * random.standard_normal(samples)) / 100.0)
    noise = np.cumsum(walk * random.standard_normal((2, samples)), axis=1)
    encoder = table + 2.4e-5 * np.cos(table)
    gyros = dict(zip("xz", np.array([[0.577], [second]]) * table + noise, strict=True))
    recording = Recording.from_arrays(
        **gyros, kind="angle", unit="rad", sample_rate=100.0, table=encoder, table_unit="rad"
    )
    known = turning_table(recording, ("x", "z"), "fos")
    measured = without_encoder_errors(measure(recording, ("x", "z")), recording, known)
    first = np.sqrt(2.0 / (1.0 + (0.577 / second) ** 2))
    expected = np.array([first, -first * 0.577 / second])
    assert measured.weights == pytest.approx(expected, rel=1e-6)
    # Neither the table's motion nor the encoder's error is left: 1 % of the noise at the most.
    left = np.diff(measured.angle - expected @ noise)
    assert np.std(left) < 0.01 * np.std(np.diff(expected @ noise)) + 2e-12


def test_gyros_that_hardly_share_their_motion_are_not_weighted():
    random, time = np.random.default_rng(1), np.arange(30_000) / 100.0
    table = np.cumsum(np.radians(20.0 + 0.02 * random.standard_normal(time.size)) / 100.0)
    # A mount that sways by itself, by a third of the table's rate.
    swaying = np.radians(40.0) * np.sin(0.2 * time)
    recording = Recording.from_arrays(
        x=0.577 * table,
        z=0.578 * table + swaying,
        kind="angle",
        unit="rad",
        sample_rate=100.0,
        table=table,
        table_unit="rad",
    )
    # `turning_table` would refuse the encoder.
    gyros = [recording[name].values for name in "xz"]
    estimate = estimated_table(gyros, table, 100.0)
    shares = dict(zip("xz", estimate.shares.tolist(), strict=True))
    known = TurningTable(angle=table, estimate=estimate, shares=shares)
    difference = measure(recording, ("x", "z"))
    assert estimate.alike > 0.1
    assert without_encoder_errors(difference, recording, known).weights == (1.0, -1.0)
