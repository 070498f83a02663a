"""Encoders as they are, from a second simulator: the pair's answer, and what is said of them."""

import functools

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

import sagnac
from sagnac.analysis.measurement import Measurement, TurningTable, with_order_phases
from sagnac.analysis.result import Analysis
from sagnac.table.estimate import Delay, EstimatedTable
from tests.analysis.recorded import causes, recorded
from tests.second_rig import Bench, simulate

WALK = 2.5e-5  # deg/sqrt(h)
# One draw in the default suite; of three one may miss.
SEEDS = [(1,), pytest.param((1, 2, 3), marks=pytest.mark.statistics)]


@functools.cache
def analyzed(seed: int, **settings: object) -> Analysis:
    made = simulate(Bench(**{"seconds": 600.0, "sample_rate": 100.0, "seed": seed, **settings}))
    return sagnac.analyze(recorded(made), sagnac.Settings(gyros=("x", "z")))


def interval(result: Analysis) -> tuple[float, float]:
    """Of the angle random walk, in parts of the truth; it is estimated."""
    answer = result.angle_random_walk
    assert answer.status == "estimated"
    shown = answer.to("deg/sqrt(h)")
    return shown.low / WALK, shown.high / WALK


@pytest.mark.parametrize("seeds", SEEDS)
@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"jitter": 100e-6}, {"latch"}),
        ({"jitter": 500e-6}, {"latch"}),
        ({"step": 36.0}, None),
        # A servo that hunts gives it away as a delay, the orders' phases as a drift of the angle.
        ({"latency_drift": 5e-3}, {"delay", "runs-off"}),
    ],
    ids=["100 us", "500 us", "steps", "drift"],
)
def test_the_pair_is_as_good_as_beside_a_perfect_latch(settings, named, seeds):
    held = 0
    for seed in seeds:
        result = analyzed(seed, **settings)
        low, high = interval(result)
        held += low <= 1.0 <= high
        # Ten are put in.
        assert len(result.lines) == 10 or "latency_drift" in settings
        without_low, without_high = interval(analyzed(seed))
        assert high - low <= 1.05 * (without_high - without_low)
        assert not result.findings
        if named is not None:
            assert causes(result)
            assert causes(result) <= named
    assert held >= max(len(seeds) - 1, 1)


@pytest.mark.parametrize("seeds", SEEDS)
def test_nothing_is_said_of_an_encoder_that_is_read_with_the_gyros(seeds):
    assert not any(causes(analyzed(seed)) for seed in seeds)


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


@pytest.mark.parametrize(("drift", "direction"), [(5e-3, "later"), (-5e-3, "earlier")])
def test_a_delay_that_changes_is_said_to_be_later_or_earlier_at_the_end(drift, direction):
    result = analyzed(1, motion="reversing", latency=10e-3, latency_drift=drift)
    (note,) = [note for note in result.notes if "they are shifted" in note.text]
    _, mean, change = note.text.split(" ms (")
    assert float(mean.split("on average, at the end ")[1]) == pytest.approx(5.0, abs=0.05)
    assert change.split(")")[1].startswith(f" {direction} than at the start")


def test_gyros_mounted_against_each_other_are_a_pair():
    opposite = (0.5784, 0.5773, -0.5764)
    for settings in ({}, {"jitter": 100e-6}):
        result = analyzed(1, shares=opposite, **settings)
        low, high = interval(result)
        assert low <= 1.0 <= high
        without_low, without_high = interval(analyzed(1))
        assert high - low <= 1.05 * (without_high - without_low)


@pytest.mark.parametrize("seeds", SEEDS)
def test_gyros_of_unlike_shares_go_with_the_encoder_or_without_it(seeds):
    unlike = (0.9, 0.5773, 0.3)
    held = 0
    for seed in seeds:
        for settings in ({}, {"jitter": 100e-6}):
            low, high = interval(analyzed(seed, shares=unlike, seconds=900.0, **settings))
            held += low <= 1.0 <= high
    assert held >= max(2 * len(seeds) - 1, 2)


def test_gyros_of_unlike_shares_behind_a_low_pass_take_the_table_out_by_themselves():
    """Earth rate hid what the encoder, which has no low-pass, leaves of a table that turns back."""
    random, rate = np.random.default_rng(6), 100.0
    time = np.arange(30_000) / rate
    turn = np.hanning(150) / np.hanning(150).sum()
    rates = np.convolve(np.where(time % 80.0 < 40.0, 60.0, -60.0), turn, mode="same")
    table = np.cumsum(rates) / rate
    rates = rates * (1.0 + 3e-4 * np.cos(np.deg2rad(12.0 * table)))
    earth = 2.7e-3 * np.cos(np.deg2rad(table))  # deg/s, of a gyro that lies nearly level
    corner = butter(1, 20.0, fs=rate, output="sos")
    white = 3e-3 / 60.0 * np.sqrt(rate) * random.normal(size=(2, time.size))
    senses = {"x": rates + white[0], "z": 0.3 * rates + earth + white[1]}
    recording = sagnac.Recording.from_arrays(
        **{name: sosfilt(corner, sensed)[100:] for name, sensed in senses.items()},
        table=(np.cumsum(rates) / rate)[100:],
        kind="rate",
        unit="deg/s",
        sample_rate=rate,
    )
    result = sagnac.analyze(recording)
    answer = result.angle_random_walk.to("deg/sqrt(h)")
    assert result.angle_random_walk.status == "estimated"
    assert answer.low <= 3e-3 <= answer.high
    assert not result.lines


@pytest.mark.parametrize("seeds", SEEDS)
def test_an_encoder_whose_time_wanders_leaves_the_pair_and_is_named(seeds):
    held = 0
    for seed in seeds:
        result = analyzed(seed, latency_walk=100e-6, seconds=900.0)
        low, high = interval(result)
        held += low <= 1.0 <= high
        assert causes(result) == {"wander"}
    assert held >= max(len(seeds) - 1, 1)


@pytest.mark.parametrize("rate", [40.0, -40.0])
@pytest.mark.parametrize("change", [0.0, 3e-3])
def test_only_a_change_of_the_delay_that_is_there_is_said(change, rate):
    # A fit has put in a change of 1 ms that orders undo, and may have missed one of 3 ms.
    fitted, seconds, sample_rate = 1e-3, 400.0, 20.0
    place = (np.arange(round(seconds * sample_rate)) + 0.5) / (seconds * sample_rate) - 0.5
    true = np.radians(rate) * seconds * place
    error = np.radians(rate) * (change - fitted) * place
    random = np.random.default_rng(3)
    gyro = 1e-4 * np.sin(true) + 5e-5 * np.sin(3.0 * true + 1.0)
    gyro = gyro + 2e-8 * random.standard_normal(gyro.size)
    estimate = EstimatedTable(
        angle=true - error,
        readings=true - error,
        shares=np.array([0.6]),
        noise=0.0,
        corner=np.inf,
        delay=Delay(mean=2e-3, mean_error=1e-4, change=fitted, change_error=1e-3, duration=seconds),
        alike=0.0,
    )
    table = TurningTable(angle=true, estimate=estimate, shares={"x": 0.6})
    measured = Measurement(channel="x", angle=gyro, gyros=("x",), sample_rate=sample_rate)
    found = with_order_phases(table, measured)
    # Whatever is said, most of the error is taken out of the angle.
    off = found.estimate.angle - true
    assert np.abs(off - off.mean()).max() < 0.3 * np.abs(error).max()
    texts = [note.text for note in found.notes]
    if not change:
        assert texts == []
        return
    (text,) = texts
    assert float(text.split("changed by ")[1].split()[0]) == pytest.approx(3.0, abs=0.3)
    # Readings that come later and later fall behind.
    assert np.sign(float(text.split("runs off by ")[1].split()[0])) == -np.sign(rate)
