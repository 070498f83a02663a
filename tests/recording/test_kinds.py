"""From what a sample is to the angle, and counters that start over."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sagnac.core import arrays
from sagnac.core.errors import RecordingError
from sagnac.recording.channel import Channel, angle_increments, angle_of, finite_extent, unwrapped
from tests.quality.recordings import DEGREE, RATE, noise, rate_gyro


@given(st.lists(st.floats(-170.0, 170.0), min_size=1, max_size=60), st.floats(0.0, 359.0))
def test_unwrapping_gives_back_any_motion_below_half_a_turn_a_sample(steps, start):
    angle = start + np.cumsum(steps)
    values, wraps = unwrapped(angle % 360.0, 360.0)
    np.testing.assert_allclose(np.diff(values), steps[1:], atol=1e-9)
    naive = np.unwrap(angle % 360.0, period=360.0)
    np.testing.assert_allclose(values, naive, atol=1e-9)
    assert (wraps == 0) == bool(np.all(np.abs(np.diff(angle % 360.0)) <= 180.0))


def test_angle_of_keeps_the_noise_of_a_fast_table():
    increments = noise(1e-9) + 1.0
    gyro = Channel(name="x", kind="increment", values=increments)
    angle = angle_of(gyro, RATE)
    exact = np.array([float(item) for item in np.cumsum(increments.astype(np.longdouble))])
    np.testing.assert_allclose(angle, exact, rtol=4e-16)
    np.testing.assert_allclose(
        angle_of(rate_gyro(noise(1.0)), RATE), np.cumsum(noise(1.0)) * DEGREE / RATE, atol=1e-12
    )


@pytest.mark.parametrize("length", [1, 7, 100, 998, 999, 5000])
def test_wraps_are_found_across_the_borders_of_spans(monkeypatch, length):
    angle = np.cumsum(np.random.default_rng(3).uniform(-170.0, 170.0, 1000))
    reading = angle % 360.0
    reading[[99, 500]] = np.nan
    whole, wraps = unwrapped(reading, 360.0)
    monkeypatch.setattr(arrays, "IN_MEMORY", 0)
    monkeypatch.setattr(arrays, "BLOCK", length)
    values, count = unwrapped(reading, 360.0)
    assert count == wraps > 100
    assert np.array_equal(values, whole, equal_nan=True)
    naive = np.unwrap((angle % 360.0)[:99], period=360.0)
    np.testing.assert_allclose(values[:99], naive, atol=1e-9)
    assert unwrapped(angle[:3] * 0.1, 360.0)[1] == 0


def test_increments_of_each_kind():
    rate = np.array([1.0, 2.0, 4.0])
    assert angle_increments(rate, kind="rate", sample_rate=2.0) == pytest.approx([0.5, 1.0, 2.0])
    assert angle_increments(rate, kind="increment", sample_rate=2.0) == pytest.approx(rate)
    assert angle_increments(rate, kind="angle", sample_rate=2.0) == pytest.approx([1.0, 2.0])


@pytest.mark.parametrize(
    ("values", "settings", "error", "message"),
    [
        ([1.0, np.nan, 2.0], {}, RecordingError, "sample 1 is not finite"),
        ([[1.0, 2.0]], {}, ValueError, "give one column"),
        ([1.0, 2.0], {"kind": "phase"}, ValueError, "use one of angle, increment, rate"),
        ([1.0, 2.0], {"sample_rate": 0.0}, ValueError, "samples per second"),
    ],
)
def test_refusals_are_one_line(values, settings, error, message):
    arguments = {"kind": "rate", "sample_rate": 1.0, **settings}
    with pytest.raises(error, match=message) as caught:
        angle_increments(values, **arguments)
    assert "\n" not in str(caught.value)


def test_the_extent_passes_over_what_is_not_finite():
    assert finite_extent(np.array([np.nan, 3.0, -1.0, np.inf])) == 4.0
    assert finite_extent(np.array([np.nan])) == 0.0
