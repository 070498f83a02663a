"""What the encoder's noise costs an interval, beside recordings latched with the gyros."""

import numpy as np
import pytest

import sagnac
from sagnac.analysis.encoder import half_interval, white_noise
from sagnac.analysis.result import Analysis
from tests.analysis.recorded import recorded
from tests.second_rig import DEGREE, Bench, simulate

WALK = 0.1  # deg/sqrt(h)
UNLIKE = (0.9, 0.5, 0.2)
ALIKE = (0.5784, 0.5773, 0.5764)


def analyzed(names: tuple[str, ...], **settings: object) -> Analysis:
    bench = Bench(**{"seconds": 600.0, "sample_rate": 100.0, "walks": (WALK,) * 3, **settings})
    return sagnac.analyze(recorded(simulate(bench), names), sagnac.Settings(gyros=names))


def half(result: Analysis) -> float:
    """Half interval, %."""
    shown = result.angle_random_walk
    assert shown.status == "estimated"
    return 50.0 * (shown.high - shown.low) / shown.value


def said(result: Analysis) -> list[tuple[float, float]]:
    """Half intervals of the note, % as it is and with a better latch."""
    texts = [note.text for note in result.notes if "encoder decides the interval" in note.text]
    return [tuple(float(part.split(" %")[0]) for part in text.split("± ")[1:]) for text in texts]


@pytest.mark.parametrize(
    ("names", "shares"), [(("x",), UNLIKE), (("x", "z"), UNLIKE)], ids=["one", "unlike pair"]
)
def test_a_better_latch_narrows_the_interval_as_said(names, shares):
    result = analyzed(names, shares=shares, jitter=200e-6)
    latched = analyzed(names, shares=shares)
    ((now, then),) = said(result)
    assert now == pytest.approx(half(result), rel=0.05)
    assert 0.5 < then / half(latched) < 2.0
    assert half(latched) < 0.5 * now
    assert said(latched) == []


def test_nothing_is_said_of_a_pair_that_takes_the_table_out():
    assert said(analyzed(("x", "z"), shares=ALIKE, jitter=200e-6)) == []


def test_an_encoder_that_is_latched_well_is_not_blamed_for_unlike_shares():
    result = analyzed(("x", "z"), shares=(0.577, 0.5, 0.565))
    assert said(result) == []
    (text,) = (note.text for note in result.notes if "would narrow it" in note.text)
    assert text.startswith("the shares of the table's rate that the two gyros sense differ")


@pytest.mark.parametrize("white", [1e-7, 1e-9])
def test_the_bound_is_that_of_all_ordinates(white):
    # N of 1e-7 rad/sqrt(s), 200 s at 50 Hz, with Q unknown as well.
    walk, rate, seconds = 1e-7, 50.0, 200.0
    frequency = np.arange(1, round(0.5 * rate * seconds)) / seconds
    angle = (2.0 * rate * np.sin(np.pi * frequency / rate)) ** 2 / rate
    slopes = np.stack([np.ones_like(angle), angle]) / (walk**2 + white**2 * angle)
    error = np.sqrt(np.linalg.inv(slopes @ slopes.T)[0, 0])
    expected = 1.96 * error / (2.0 * walk**2)
    found = half_interval(walk, white, sample_rate=rate, seconds=seconds, confidence=0.95)
    assert found == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("motion", ["steady", "reversing", "dwelling", "swinging"])
def test_third_differences_hold_the_noise_of_readings_alone(motion):
    bench = Bench(seconds=200.0, sample_rate=200.0, motion=motion, jitter=200e-6)
    rate = np.sqrt(np.mean(np.gradient(simulate(bench).true_table, 1.0 / 200.0) ** 2))
    assert white_noise(simulate(bench).table) == pytest.approx(200e-6 * rate, rel=0.05)
    assert rate > 5.0 * DEGREE
