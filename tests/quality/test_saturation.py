"""Jumps and saturation."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.quality.readout import clipped_scatter
from sagnac.recording.model import Recording
from sagnac.rig.config import preset
from sagnac.rig.simulate import simulate
from tests.analysis.test_sound_instruments import on_table
from tests.quality.recordings import RATE, levels


@pytest.mark.parametrize(("low", "high"), [(-1.0, 1.0), (-0.3, 0.3), (-9.0, 0.0), (-2.0, 0.5)])
def test_the_scatter_of_a_clipped_normal_number(low, high):
    numbers = np.clip(np.random.default_rng(1).standard_normal(400_000), low, high)
    scatter = clipped_scatter(float(np.mean(numbers == low)), float(np.mean(numbers == high)))
    assert scatter == pytest.approx(float(numbers.std()), rel=0.01)


@pytest.mark.parametrize("number", [74, 194])
def test_counts_that_a_files_decimals_part_are_one(number):
    """Of twenty samples at the lowest count sixteen were one number, four the one beside it."""
    recording, _ = on_table(number)
    found = levels(recording)
    assert not any("saturated" in line for lines in found.values() for line in lines)


def test_counts_that_are_clipped_are_found_behind_a_files_decimals():
    counts = np.clip(np.rint(np.random.default_rng(3).normal(0.0, 5.0, 20_000)), -4.0, 4.0)
    degrees = np.round(np.cumsum(counts) * 0.0008 / 3600.0, 9)
    found = levels(Recording.from_arrays(x=degrees, kind="angle", unit="deg", sample_rate=RATE))
    (line,) = [line for line in found["error"] if "saturated" in line]
    assert "upper limit" in line
    assert "lower limit" in line


def test_a_dither_that_samples_meet_at_few_phases_is_no_limit():
    config = preset("dithered")
    still = replace(config.table, rate_deg_per_s=0.0)
    made = simulate(replace(config, duration_s=200.0, seed=1, table=still)).recording
    assert not any("saturated" in line for lines in levels(made).values() for line in lines)
