"""Gyros on a table that swings over half a turn, as a shaft with an encoder does."""

import pytest

import sagnac
from sagnac.analysis.result import Analysis
from tests.analysis.recorded import recorded
from tests.second_rig import Bench, simulate

MEMS, RING_LASER = 2.5, 2.5e-5  # deg/sqrt(h)
# A motor shaft: 90 deg to either side in 7.8 s, an encoder in steps of 0.09 deg that is read early.
SHAFT = {"hunting": 0.5, "hunting_hz": 8.0, "wander": 0.02, "step": 324.0, "readout": 5.0}


# One draw in the default suite, the others in `make test-statistics`.
SECOND = pytest.param(2, marks=pytest.mark.statistics)


def analyzed(gyros: tuple[str, ...], walk: float, **settings: object) -> Analysis:
    swing = {"seconds": 900.0, "sample_rate": 100.0, "motion": "swinging", "cycle": 7.8}
    bench = Bench(**{"walks": (walk,) * 3, **swing, **settings})
    return sagnac.analyze(recorded(simulate(bench), gyros), sagnac.Settings(gyros=gyros))


def holds(result: Analysis, walk: float) -> bool:
    answer = result.angle_random_walk
    assert answer.status == "estimated", result.source
    shown = answer.to("deg/sqrt(h)")
    assert shown.high - shown.low < 0.4 * walk
    return shown.low <= walk <= shown.high


def delays(result: Analysis) -> list[float]:
    """That the notes name, ms."""
    texts = [note.text for note in result.notes if "they are shifted" in note.text]
    return [float(text.split("readings come ")[1].split(" ms")[0]) for text in texts]


@pytest.mark.parametrize("seed", [1, SECOND])
def test_a_lone_gyro_is_estimated_and_the_delay_of_its_encoder_named(seed):
    result = analyzed(("x",), MEMS, latency=-7e-3, seed=seed, **SHAFT)
    assert holds(result, MEMS)
    assert delays(result) == [pytest.approx(7.0, abs=0.5)]
    assert delays(analyzed(("x",), MEMS, seed=seed, **SHAFT)) == []


@pytest.mark.parametrize("seeds", [(4,), pytest.param((4, 5, 6), marks=pytest.mark.statistics)])
def test_a_gyro_across_the_axis_does_not_lead_the_table(seeds):
    # Its own noise over its share is far above the encoder's.
    held = 0
    for seed in seeds:
        result = analyzed(("x",), MEMS, shares=(-0.018, 0.5, 0.6), seed=seed, **SHAFT)
        held += holds(result, MEMS)
        texts = [note.text for note in result.notes]
        assert not any("as if latched" in text or "encoder decides" in text for text in texts)
    assert held >= max(len(seeds) - 1, 1)


@pytest.mark.parametrize("seed", [1, SECOND])
def test_the_search_for_the_lines_of_a_pair_comes_to_an_end(seed):
    result = analyzed(("x", "z"), RING_LASER, seed=seed, hunting=0.01)
    assert holds(result, RING_LASER)


@pytest.mark.parametrize("seeds", [(1,), pytest.param((1, 2, 3), marks=pytest.mark.statistics)])
@pytest.mark.parametrize("hunting", [5e-4, pytest.param(4e-3, marks=pytest.mark.statistics)])
def test_over_part_of_a_turn_of_a_slow_table_the_noise_stays(hunting, seeds):
    # Orders that took all noise below 0.2 Hz left 7 % of N.
    walk, held = 1e-4, 0
    for seed in seeds:
        table = {"rate": 0.5, "seconds": 600.0, "sample_rate": 200.0, "hunting": hunting}
        bench = Bench(walks=(walk,) * 3, jitter=2e-5, seed=seed, **table)
        result = sagnac.analyze(recorded(simulate(bench), ("x", "z")))
        shown = result.angle_random_walk.to("deg/sqrt(h)")
        assert shown.value == pytest.approx(walk, rel=0.05)
        held += shown.low <= walk <= shown.high
    assert held >= max(len(seeds) - 1, 1)
