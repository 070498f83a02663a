"""Readout steps: how large, and what dithers them."""

import math

import numpy as np
import pytest

from sagnac.quality.check import judged
from sagnac.quality.readout import readout_of, step_shown
from sagnac.recording.model import Channel
from tests.noise.examples import read_out
from tests.quality.pathologies import unsigned


@pytest.mark.parametrize("rate", [0.0, 0.5, 1.0, 0.0137, 1000.0, 12.3456])
def test_a_readout_is_white_of_angles_half_a_step_apart(rate):
    # (0.1 step)^2 a sample: half a step after 25 samples.
    angle, reading = read_out(0.1, 200_000, 3, rate=rate)
    found = readout_of(1e-8 * reading)
    assert found.step == pytest.approx(1e-8, rel=1e-6)
    assert found.every in (16, 32)
    error = reading - angle
    close, apart = error, error[:: found.every]
    assert apart.var() == pytest.approx(1.0 / 12.0, rel=0.05)
    assert abs(np.corrcoef(apart[1:], apart[:-1])[0, 1]) < 0.1
    assert np.cos(2.0 * np.pi * rate) < 0.0 or np.corrcoef(close[1:], close[:-1])[0, 1] > 0.5


def test_a_readout_that_is_dithered_is_taken_as_it_is():
    assert readout_of(read_out(0.7, 10_000, 4)[1]).every == 1
    assert readout_of(read_out(0.01, 10_000, 5, white=0.5)[1]).every == 1
    unrounded, _ = read_out(0.01, 10_000, 6)
    assert readout_of(unrounded).every == 1


def test_a_readout_step_shows_through_the_rounding_of_a_file():
    _, reading = read_out(0.1, 50_000, 7)
    rounding = 1e-3 * np.random.default_rng(8).uniform(-1.0, 1.0, reading.size)
    assert readout_of(reading + rounding).step == pytest.approx(1.0, abs=5e-3)
    assert readout_of(reading + rounding).every == readout_of(reading).every


def test_a_readout_that_moves_a_few_times_is_never_dithered():
    reading = np.repeat([0.0, 1.0, 0.0, 1.0, 2.0], [3000, 1, 2000, 5000, 999])
    assert readout_of(reading).every is None
    assert readout_of(np.zeros(5000)).step == 0.0


STEP = math.radians(250.0 / 32768.0)


def shown(values, kind="rate"):
    unit = "rad/s" if kind == "rate" else "rad"
    values = np.asarray(values, dtype=np.float64)
    return step_shown(Channel(name="x", kind=kind, shown_in=unit, values=values))


@pytest.mark.parametrize("scatter", [0.2, 1.0, 10.0, 100.0])
def test_the_step_that_samples_are_counted_in(scatter):
    """Counts of a rate, of increments, of an angle; with an offset, single, in decimals."""
    noise = scatter * STEP * np.random.default_rng(3).standard_normal(20_000)
    rates, angles = (np.rint(one / STEP) * STEP for one in (noise, np.cumsum(noise)))
    for values in (rates, rates + 0.3 * STEP, rates.astype(np.float32), np.round(rates, 9)):
        assert shown(values) == pytest.approx(STEP, rel=1e-5)
    assert shown(angles, "angle") == pytest.approx(STEP, rel=1e-9)
    assert shown(np.diff(angles), "increment") == pytest.approx(STEP, rel=1e-9)
    # On a table that turns by half a million steps a sample, stored with few digits too many.
    turning = np.round(angles + STEP * np.arange(20_000) * 500_000, 9)
    assert shown(turning, "angle") == pytest.approx(STEP, rel=1e-6)
    gap = np.where(np.arange(20_000) % 977 == 5, np.nan, rates)
    assert shown(gap) == pytest.approx(STEP, rel=1e-9)


def test_samples_that_are_not_counted_show_no_step():
    noise = 1e-3 * np.random.default_rng(4).standard_normal(20_000)
    angle = np.cumsum(noise)
    for values, kind in ((noise, "rate"), (noise, "increment"), (angle, "angle")):
        for stored in (values, values.astype(np.float32), 1e3 + values):
            assert shown(stored, kind) == 0.0
    assert shown(np.zeros(100)) == shown(np.full(5, np.nan)) == 0.0
    # A turn that speeds up evenly is no lattice either.
    assert shown(1e-6 * np.arange(20_000.0) ** 2 + noise, "angle") == 0.0


def test_rates_that_are_read_as_unsigned_are_not_called_counters():
    (found,) = (one for one in judged(unsigned(16)) if one.name == "wraps")
    assert (
        "write them as signed, or state the width of an angle's with {counter-bits}" in found.text
    )
