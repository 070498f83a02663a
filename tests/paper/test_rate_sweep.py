"""The law of a sweep of table rates, against its own truth and over many sweeps."""

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.rate_sweep import fit_rate_sweep, sweep_of

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.core.units import DEGREE, DEGREE_PER_ROOT_HOUR
from sagnac.noise.estimates import Estimate
from sagnac.noise.fit import likelihood_fit
from sagnac.rig.config import preset
from sagnac.rig.sections import DisturbancesConfig
from sagnac.rig.simulate import simulate
from sagnac.rig.truth import truth_of

RATES = np.array([10.0, 20.0, 30.0, 40.0, 60.0, 80.0]) * DEGREE
QUANTUM = 7e-9  # rad/sqrt(s)
FALLING = 3e-9


def law(rates, quantum=QUANTUM, falling=FALLING):
    return np.hypot(quantum, falling / rates)


def estimate(value, relative=0.01, status="estimated"):
    return Estimate(
        value=value,
        low=value * (1.0 - 1.96 * relative),
        high=value * (1.0 + 1.96 * relative),
        confidence=0.95,
        status=status,
        name="angle_random_walk",
    )


def test_exact_readings_give_the_law_back():
    found = fit_rate_sweep(RATES, [estimate(value) for value in law(RATES)], excess=0.2)
    assert found.quantum.value == pytest.approx(QUANTUM)
    assert found.falling.value == pytest.approx(FALLING)
    assert found.misfit == pytest.approx(0.0, abs=1e-12)
    assert law(found.adequate.value) == pytest.approx(1.2 * QUANTUM)
    assert found.adequate.low < found.adequate.value < found.adequate.high


def test_errors_are_those_of_the_linear_problem():
    """A Monte Carlo of Gaussian readings scatters as the intervals say."""
    rng = np.random.default_rng(1)
    truth = law(RATES)
    sweeps = [
        fit_rate_sweep(RATES, [estimate(v) for v in truth * (1 + 0.01 * rng.standard_normal(6))])
        for _ in range(400)
    ]
    for name, true in (("quantum", QUANTUM), ("falling", FALLING)):
        readings = [getattr(one, name) for one in sweeps]
        widths = [(one.high - one.low) / 3.92 for one in readings]
        deviations = [one.value - true for one in readings]
        assert np.std(deviations) == pytest.approx(np.mean(widths), rel=0.12)
    assert np.mean([one.misfit for one in sweeps]) == pytest.approx(1.0, abs=0.12)


def test_without_a_falling_part_any_rate_is_enough():
    found = fit_rate_sweep(RATES, [estimate(QUANTUM) for _ in RATES])
    assert found.falling.low == 0.0
    assert found.adequate.low == 0.0
    assert math.isfinite(found.adequate.high)


def test_without_a_quantum_limit_none_is_known_to_be():
    found = fit_rate_sweep(RATES, [estimate(v, 0.05) for v in law(RATES, quantum=0.0)])
    assert found.quantum.low == 0.0
    assert found.adequate.high == math.inf


@pytest.mark.parametrize(
    ("rates", "change", "message"),
    [
        (RATES[:2], {}, "2 table rates"),
        (RATES[:5] * 0.0, {}, "above zero"),
        (RATES[:4], {"excess": 0.0}, "excess is 0.0"),
    ],
)
def test_refusals(rates, change, message):
    with pytest.raises(ValueError, match=message):
        fit_rate_sweep(rates, [estimate(1e-8) for _ in rates], **change)


def test_bounds_are_no_estimates():
    readings = [estimate(1e-8), estimate(1e-8), estimate(1e-8, status="upper bound")]
    with pytest.raises(ValueError, match="upper bound"):
        fit_rate_sweep(RATES[:3], readings)


def test_recordings_of_the_rig_give_its_quantum_limit_and_fall():
    base = preset("paper")
    config = replace(
        base,
        duration_s=300.0,
        sample_rate_hz=100.0,
        gyro=replace(base.gyro, mode="rate-biased"),
        disturbances=DisturbancesConfig(),
    )
    analyses, truths = [], []
    for number, rate in enumerate((8.0, 20.0, 60.0)):
        one = replace(config, seed=number, table=replace(config.table, rate_deg_per_s=rate))
        settings = Settings(gyros=("x", "z"), confidence=0.999)
        analyses.append(analyze(simulate(one).recording, settings))
        truths.append(truth_of(one).pairs["x-z"].arw_deg_per_sqrt_h * DEGREE_PER_ROOT_HOUR)
    found = sweep_of(analyses, confidence=0.999)
    assert found.quantum.low < 2.5e-5 * DEGREE_PER_ROOT_HOUR < found.quantum.high
    falling = 8.0 * DEGREE * math.sqrt(truths[0] ** 2 - (2.5e-5 * DEGREE_PER_ROOT_HOUR) ** 2)
    assert found.falling.low < falling < found.falling.high
    assert found.falling.low > 0.0


@pytest.mark.statistics
def test_intervals_of_two_hundred_sweeps_hold_the_truth():
    """Sweeps of six records of white rate and white angle, each fitted by likelihood."""
    rng = np.random.default_rng(20130227)
    excess = 0.1
    adequate = FALLING / QUANTUM / math.sqrt((1.0 + excess) ** 2 - 1.0)
    truths = {"quantum": QUANTUM, "falling": FALLING, "adequate": adequate}
    held = dict.fromkeys(truths, 0)
    for _ in range(200):
        readings = []
        for true in law(RATES):
            angle = np.cumsum(true * rng.standard_normal(1200))
            angle += 2e-9 * rng.standard_normal(1200)
            fit = likelihood_fit(angle, kind="angle", sample_rate=1.0)
            readings.append(fit.coefficients["angle_random_walk"])
        found = fit_rate_sweep(RATES, readings, excess=excess)
        for name, true in truths.items():
            reading = getattr(found, name)
            held[name] += reading.low <= true <= reading.high
    # 95 %, and two standard errors of a share of 200.
    for count in held.values():
        assert 0.92 <= count / 200 <= 0.98, held
