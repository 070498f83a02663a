"""Encoders as they are, from a second simulator: the pair's answer, and what is said of them."""

import functools

import pytest

import sagnac
from sagnac.analysis.result import Analysis
from tests.second_rig import Bench, simulate

WALK = 2.5e-5  # deg/sqrt(h)
SEEDS = (1, 2, 3)
# What an encoder may be said to be, each in the words of its note.
CAUSES = {
    "delay": "they are shifted",
    "drift": "its angle runs off",
    "latch": "as if latched",
    "wander": "its readings wander",
}


@functools.cache
def analyzed(seed: int, **settings: object) -> Analysis:
    recorded = simulate(Bench(**{"seconds": 900.0, "sample_rate": 100.0, "seed": seed, **settings}))
    recording = sagnac.Recording.from_arrays(
        **recorded.angles,
        kind="angle",
        unit="rad",
        sample_rate=recorded.sample_rate,
        table=recorded.table,
        table_unit="rad",
    )
    return sagnac.analyze(recording, sagnac.Settings(gyros=("x", "z")))


def interval(result: Analysis) -> tuple[float, float]:
    """Of the angle random walk, in parts of the truth; it is estimated."""
    answer = result.angle_random_walk
    assert answer.status == "estimated"
    shown = answer.to("deg/sqrt(h)")
    return shown.low / WALK, shown.high / WALK


def causes(result: Analysis) -> set[str]:
    """Errors of the encoder that the notes name."""
    texts = [note.text for note in result.notes if note.channel == "table"]
    return {cause for cause, said in CAUSES.items() if any(said in text for text in texts)}


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"jitter": 100e-6}, {"latch"}),
        ({"jitter": 500e-6}, {"latch"}),
        ({"step": 36.0}, None),
        # A servo that hunts gives it away as a delay, the orders' phases as a drift of the angle.
        ({"latency_drift": 5e-3}, {"delay", "drift"}),
    ],
    ids=["100 us", "500 us", "steps", "drift"],
)
def test_the_pair_is_as_good_as_beside_a_perfect_latch(settings, named):
    held = 0
    for seed in SEEDS:
        result = analyzed(seed, **settings)
        low, high = interval(result)
        held += low <= 1.0 <= high
        without_low, without_high = interval(analyzed(seed))
        assert high - low <= 1.05 * (without_high - without_low)
        assert not result.findings
        if named is not None:
            assert causes(result)
            assert causes(result) <= named
    assert held >= len(SEEDS) - 1


@pytest.mark.parametrize("seed", SEEDS)
def test_nothing_is_said_of_an_encoder_that_is_read_with_the_gyros(seed):
    assert causes(analyzed(seed)) == set()


def test_the_latch_is_said_with_its_size():
    (note,) = [note for note in analyzed(1, jitter=100e-6).notes if "as if latched" in note.text]
    latch = float(note.text.split("as if latched ")[1].split(" us rms")[0])
    assert latch == pytest.approx(100.0, rel=0.03)


def test_a_delay_is_said_on_a_table_that_turns_back():
    result = analyzed(1, motion="reversing", latency=2e-3)
    low, high = interval(result)
    assert low <= 1.0 <= high
    assert causes(result) == {"delay"}
    (note,) = [note for note in result.notes if "they are shifted" in note.text]
    said = float(note.text.split("readings come ")[1].split(" ms")[0])
    assert said == pytest.approx(2.0, abs=0.01)
    assert causes(analyzed(1, motion="reversing")) == set()


def test_gyros_mounted_against_each_other_are_a_pair():
    opposite = (0.5784, 0.5773, -0.5764)
    for settings in ({}, {"jitter": 100e-6}):
        result = analyzed(1, shares=opposite, **settings)
        low, high = interval(result)
        assert low <= 1.0 <= high
        without_low, without_high = interval(analyzed(1))
        assert high - low <= 1.05 * (without_high - without_low)


def test_gyros_of_unlike_shares_go_with_the_encoder_or_without_it():
    unlike = (0.9, 0.5773, 0.3)
    held = 0
    for seed in SEEDS:
        for settings in ({}, {"jitter": 100e-6}):
            low, high = interval(analyzed(seed, shares=unlike, **settings))
            held += low <= 1.0 <= high
    assert held >= 2 * len(SEEDS) - 1


def test_an_encoder_whose_time_wanders_leaves_the_pair_and_is_named():
    held = 0
    for seed in SEEDS:
        result = analyzed(seed, latency_walk=100e-6)
        low, high = interval(result)
        held += low <= 1.0 <= high
        assert causes(result) == {"wander"}
    assert held >= len(SEEDS) - 1
