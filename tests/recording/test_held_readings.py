"""Whether readings are held is told without a list of millions of changes."""

import tracemalloc

import numpy as np
import pytest

from sagnac.recording.encoder_readings import clock_of


def test_an_angle_that_changes_at_every_sample_has_no_clock_and_costs_no_memory():
    angle = 1e-3 * np.arange(1_000_000.0)
    tracemalloc.start()
    assert clock_of(angle) is None
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # The places of a million changes alone take 8 MB.
    assert most < 4e6


@pytest.mark.parametrize("held", [2, 10, 250])
def test_the_clock_of_held_readings_is_theirs(held):
    angle = 0.1 * np.floor((np.arange(20_000) + 0.5 * held) / held)
    found = clock_of(angle)
    assert found is not None
    assert found.period == pytest.approx(held, rel=1e-6)
