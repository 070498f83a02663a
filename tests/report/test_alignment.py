"""The figure on heading."""

import math

import numpy as np
import pytest

from sagnac.navigation.noise import GyroNoise
from sagnac.report import page
from sagnac.report.alignment import compass_figure
from tests.handmade import DEGREE, N
from tests.report.examples import CASES, checked

EARTH = 7.292115e-5  # rad/s
ARCMINUTE = DEGREE / 60.0
LATITUDE = 45.0 * DEGREE


def drawn(figure):
    return {line.get_label(): line for line in figure.axes[0].get_lines()}


def test_white_noise_alone_falls_with_the_root_of_time():
    noise = GyroNoise(angle_random_walk=N)
    lines = drawn(compass_figure(noise, latitude=LATITUDE, confidence=0.95))
    compass = lines["gyrocompass, two positions"]
    # Half of the difference of two means over half of the time each: N over the root of t.
    expected = N / np.sqrt(compass.get_xdata()) / (EARTH * math.cos(LATITUDE)) / ARCMINUTE
    np.testing.assert_allclose(compass.get_ydata(), expected, rtol=1e-6)
    assert compass.get_xdata()[-1] == pytest.approx(3600.0)
    assert not any("floor" in label for label in lines)


def test_floor_by_flicker_and_by_its_bound():
    flicker = 1e-9
    expected = flicker * math.sqrt(math.log(2.0) / math.pi) / (EARTH * math.cos(LATITUDE))
    seen = GyroNoise(angle_random_walk=N, bias_instability=flicker)
    lines = drawn(compass_figure(seen, latitude=LATITUDE, confidence=0.95))
    assert lines["floor by B"].get_ydata()[0] == pytest.approx(expected / ARCMINUTE, rel=1e-6)
    bounded = GyroNoise(angle_random_walk=N, bounds={"bias_instability": flicker})
    lines = drawn(compass_figure(bounded, latitude=LATITUDE, confidence=0.95))
    highest = lines["floor by B, at most"]
    assert highest.get_ydata()[0] == pytest.approx(expected / ARCMINUTE, rel=1e-6)


def test_terms_are_named_apart_and_half_a_turn_is_marked_where_it_is_reached():
    """N and K of a MEMS unit that make as much of the error at the start as one another."""
    noisy = GyroNoise(angle_random_walk=0.3 * DEGREE / 60.0, rate_random_walk=3e-5)
    figure = compass_figure(noisy, latitude=LATITUDE, confidence=0.95)
    of_n, of_k = (one.xy for one in figure.axes[0].texts)
    assert (of_n[0], of_k[0]) == (10.0, pytest.approx(3600.0))
    assert drawn(figure)["half a turn: no heading"].get_ydata()[0] == pytest.approx(180.0 * 60.0)
    quiet = compass_figure(
        GyroNoise(angle_random_walk=N, rate_random_walk=1e-12), latitude=LATITUDE, confidence=0.95
    )
    assert "half a turn: no heading" not in drawn(quiet)


@pytest.mark.usefixtures("blank_figures")
@pytest.mark.parametrize("name", CASES)
def test_the_page_has_it_wherever_n_was_seen(name):
    text = " ".join(checked(page.page(CASES[name])).text)
    assert ("What it means for heading" in text) == (name != "not observable")
