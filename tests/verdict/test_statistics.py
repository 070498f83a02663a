"""How often units at, under and over a limit pass, over a thousand simulated recordings."""

import numpy as np
import pytest
from scipy.signal import butter, lfilter

import sagnac
from sagnac.analysis.planning import short_recording
from sagnac.noise.model_average import average
from sagnac.spectrum.levels import robust_levels
from sagnac.spectrum.tapered import tapered_spectrum
from sagnac.verdict.judgement import judged
from sagnac.verdict.limits import specification_of

UNITS = 1000
RATE = 10.0
SAMPLES = 6000


def decisions(walk: float, seed: int) -> list[str]:
    """On units of N = `walk` against a limit of 1 rad/sqrt(s), ten minutes each."""
    specification = specification_of("1rad/sqrt(s)", risk=0.05)
    (limit,) = specification.limits
    random = np.random.default_rng(seed)
    found = []
    for _ in range(UNITS):
        increments = walk / np.sqrt(RATE) * random.standard_normal(SAMPLES)
        levels = robust_levels(tapered_spectrum(increments, sample_rate=RATE))
        walk_found = average(levels, confidence=0.95).angle_random_walk
        found.append(judged("x", limit, walk_found, specification).decision)
    return found


@pytest.mark.statistics
@pytest.mark.parametrize("flicker", [0.0, 3.0])
def test_a_plan_beside_flicker_and_a_low_pass_holds(flicker):
    """A tenth of 6000 s at 100 Hz behind 20 Hz, second order; B in deg/h, N 0.1 deg/sqrt(h)."""
    rate, samples = 100.0, 600_000
    walk, slow = np.deg2rad(0.1) / 60.0, np.deg2rad(flicker) / 3600.0
    frequency = np.fft.rfftfreq(2 * samples, 1.0 / rate)[1:]
    # B^2/(2 pi f) two-sided.
    law = np.append(0.0, slow * np.sqrt(rate / (2.0 * np.pi * frequency)))
    filtered = butter(2, 20.0 / (0.5 * rate))
    ratios = []
    for seed in range(10):
        random = np.random.default_rng(seed)
        slow_rate = np.fft.irfft(law * np.fft.rfft(random.standard_normal(2 * samples)))[:samples]
        noise = walk * np.sqrt(rate) * random.standard_normal(samples) + slow_rate
        values = lfilter(*filtered, noise)
        early, whole = (
            short_recording(
                sagnac.analyze(
                    sagnac.Recording.from_arrays(
                        x=some, kind="rate", unit="rad/s", sample_rate=rate
                    ),
                    method="none",
                )
            )
            for some in (values[: samples // 10], values)
        )
        ratios.append(early.expected(whole.duration) / whole.half_width)
    print(f"B {flicker:g} deg/h: foretold over found {np.sort(ratios).round(2)}")
    assert 0.9 < np.median(ratios) < 1.25
    assert min(ratios) > 0.75


@pytest.mark.statistics
def test_a_unit_at_its_limit_passes_no_more_often_than_the_risk():
    found = decisions(1.0, seed=1)
    # Three standard errors of a thousand draws at 5 %.
    assert found.count("pass") / UNITS < 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / UNITS)
    assert found.count("fail") / UNITS < 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / UNITS)
    print(f"at the limit: {found.count('pass')} of {UNITS} pass, {found.count('fail')} fail")


@pytest.mark.statistics
def test_a_unit_well_under_its_limit_passes_and_one_well_over_fails():
    under, over = decisions(0.8, seed=2), decisions(1.25, seed=3)
    print(f"under: {under.count('pass')} of {UNITS} pass; over: {over.count('fail')} fail")
    assert under.count("pass") > 0.9 * UNITS
    assert under.count("fail") == 0
    assert over.count("fail") > 0.9 * UNITS
    assert over.count("pass") == 0
