"""What a note says of noise that both gyros of a pair have, against what was put in."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.recording.model import Recording
from sagnac.rig.config import preset
from sagnac.rig.simulate import simulate
from tests.instruments import Readout, turntable

RATE = 100.0
WALK = math.radians(2.5e-5) / 60.0  # rad/sqrt(s), of each gyro alone


def analysis_of(common, seed=4, jitter=0.0):
    """Half an hour at 40 deg/s with a walk of `common` times that of a gyro in both."""
    paper = preset("paper")
    low = tuple(line for line in paper.disturbances.time if line[0] < 0.5 * RATE)
    config = replace(
        paper,
        duration_s=1800.0,
        sample_rate_hz=RATE,
        seed=seed,
        encoder=replace(paper.encoder, latch_jitter_s=jitter),
        disturbances=replace(paper.disturbances, time=low),
    )
    recording = simulate(config).recording
    generator = np.random.default_rng(seed)
    shared = (
        common * WALK / math.sqrt(RATE) * np.cumsum(generator.standard_normal(recording.samples))
    )
    gyros = tuple(
        replace(gyro, values=gyro.values + shared) if gyro.name in "xz" else gyro
        for gyro in recording.gyros
    )
    return analyze(replace(recording, gyros=gyros), Settings(gyros=("x", "z")))


def test_a_common_walk_on_a_turning_table_is_noted_with_its_effect():
    analysis = analysis_of(1.5)
    assert analysis.angle_random_walk.value == pytest.approx(WALK, rel=0.1)
    (note,) = [note for note in analysis.notes if note.name == "shared"]
    assert note.level == "warning"
    assert note.effect == pytest.approx(1.0 / math.hypot(1.0, 1.5), rel=0.15)
    assert "low against the gyros themselves" in note.text
    walk = analysis.angle_random_walk
    assert walk.low < WALK < math.hypot(1.0, 1.5) * WALK < walk.high


def test_gyros_that_share_nothing_but_the_table_are_said_to():
    analysis = analysis_of(0.0)
    notes, walk = analysis.notes, analysis.angle_random_walk
    assert walk.low < WALK < walk.high < 1.2 * WALK
    assert not [note for note in notes if note.name == "shared"]
    (note,) = [note for note in notes if "no angle random walk that the two gyros" in note.text]
    assert note.channel == "x-z"


def beside_white(made, *, ways=(1.0, 1.0), common=0.0):
    """Two gyros that turn one way or the other, with a walk of `common` times 0.01 in both."""
    white = np.random.default_rng(9).standard_normal(made.encoder.size)
    shared = np.cumsum(common * 3600.0 * 0.01 / 60.0 * math.sqrt(1.0 / 50.0) * white)
    angles = {name: way * made.angles[name] + shared for name, way in zip("xz", ways, strict=True)}
    return Recording.from_arrays(
        **angles, table=made.encoder, kind="angle", unit="arcsec", sample_rate=50.0
    )


@pytest.mark.parametrize("common", [0.0, 0.6])
def test_what_gyros_in_opposite_senses_share_is_there_twice(common):
    made = turntable(
        4, seconds=900.0, sample_rate=50.0, walk=0.01, jitter=1e-5, readout=Readout(step=1e-4)
    )
    recording = beside_white(made, ways=(1.0, -1.0), common=common)
    analysis = analyze(recording, Settings(gyros=("x", "z")))
    walk = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert walk.value == pytest.approx(0.01 * math.hypot(1.0, math.sqrt(2.0) * common), rel=0.03)
    assert walk.low < 0.01 * math.hypot(1.0, common) < walk.high
    texts = [note.text for note in analysis.notes if "against the gyros themselves" in note.text]
    assert len(texts) == 1
    assert " % high" in texts[0] or "%) high" in texts[0]


def test_a_table_that_stands_on_steps_of_its_encoder_is_no_shared_walk():
    made = turntable(
        6,
        seconds=1200.0,
        sample_rate=200.0,
        table_rate=30.0,
        walk=1e-3,
        motion="dwelling",
        readout=Readout(step=1e-3),
    )
    seconds = np.arange(made.encoder.size) / 200.0
    late = np.interp(seconds - 3e-4, seconds, np.unwrap(made.encoder, period=360.0))
    recording = Recording.from_arrays(
        x=made.angles["x"],
        z=made.angles["z"],
        table=np.round(late / 1e-4) * 1e-4,
        kind="angle",
        unit="arcsec",
        sample_rate=200.0,
    )
    analysis = analyze(recording, Settings(gyros=("x", "z")))
    assert not [note for note in analysis.notes if note.name == "shared"]
    walk = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert walk.low < 1e-3 < walk.high < 1.08e-3


@pytest.mark.parametrize("common", [0.0, 1.0])
def test_an_encoder_that_slips_is_no_walk_that_gyros_share(common):
    made = turntable(
        9, seconds=900.0, sample_rate=50.0, walk=0.01, jitter=1e-5, readout=Readout(step=1e-4)
    )
    slipped = made.encoder + 0.005 * (np.arange(made.encoder.size) > 15_000)
    recording = beside_white(replace(made, encoder=slipped), common=common)
    analysis = analyze(recording, Settings(gyros=("x", "z")))
    assert [note for note in analysis.notes if "1 jump that gyro" in note.text]
    walk = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert walk.low < 0.01 * math.hypot(1.0, common) < walk.high
    assert (walk.high < 0.011) == (common == 0.0)


@pytest.mark.parametrize("common", [pytest.param(0.0, marks=pytest.mark.statistics), 1.5])
def test_what_gyros_share_below_the_noise_of_the_encoder_is_not_told(common):
    analysis = analysis_of(common, jitter=20e-6)
    assert not [note for note in analysis.notes if note.name == "shared"]
    assert [note for note in analysis.notes if "cannot be told beside the noise" in note.text]


@pytest.mark.parametrize("draws", [1, pytest.param(4, marks=pytest.mark.statistics)])
def test_gyros_that_answer_alike_share_no_walk_where_the_table_turns_round(draws):
    """They share their bandwidth: 22 % of N was said to be common to both, in 14 of 14 draws."""
    rate, walk, said = 100.0, 0.003, 0
    time = np.arange(900 * 200 + 3) / (2.0 * rate)
    # A minute each way, and a reversal within a second.
    turning = 30.0 * np.tanh(45.0 * np.sin(np.pi * time / 60.0))
    table = np.cumsum(turning) / (2.0 * rate)
    answered = (0.25 * (table[:-2] + table[2:]) + 0.5 * table[1:-1])[::2]
    for seed in range(draws):
        random = np.random.default_rng(seed)
        noise = random.normal(size=(2, answered.size)) * walk / 60.0 / np.sqrt(rate)
        x, z = np.array([[0.577], [0.575]]) * answered + np.cumsum(noise, axis=1)
        read = table[1:-1:2] + 1e-5 * random.normal(size=answered.size)
        recording = Recording.from_arrays(
            x=x, z=z, table=read, kind="angle", unit="deg", sample_rate=rate
        )
        analysis = analyze(recording)
        own = analysis.angle_random_walk.to("deg/sqrt(h)")
        assert own.low < walk < own.high < 1.15 * walk
        said += any(note.name == "shared" and note.level == "warning" for note in analysis.notes)
    assert said <= draws // 4


def test_an_order_that_is_not_whole_is_no_shared_walk_of_a_table_that_sweeps():
    """A bearing that both gyros hum with, at an order of 7.25, from 5 to 120 deg/s and back."""
    rate, samples = 100.0, 60_000
    random, along = np.random.default_rng(3), np.linspace(-1.0, 1.0, samples)
    table = np.cumsum(120.0 - 115.0 * np.abs(along)) / rate
    table += np.cumsum(0.01 / rate * random.standard_normal(samples))
    hum = {name: size / 3600.0 * np.cos(np.radians(7.25 * table) + phase)
           for name, size, phase in (("x", 3.0, 0.0), ("z", 1.0, 2.0))}  # fmt: skip
    angles = {
        name: share * table
        + hum[name]
        + np.cumsum(5e-3 / 60.0 * random.standard_normal(samples)) / 10
        for name, share in (("x", 0.577), ("z", 0.575))
    }
    recording = Recording.from_arrays(
        **angles, table=table, kind="angle", unit="deg", sample_rate=rate
    )
    analysis = analyze(recording, Settings(gyros=("x", "z")))
    assert not [note for note in analysis.notes if note.name == "shared"]
    walk = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert 4.7e-3 < walk.low < 5e-3 < walk.high < 5.3e-3


@pytest.mark.parametrize("draws", [2, pytest.param(12, marks=pytest.mark.statistics)])
def test_the_noise_of_an_encoder_is_no_shared_walk_of_a_table_that_steps_between_rates(draws):
    """What was left out where its rate changed made a walk of the readings' noise."""
    rate, walk = 100.0, 2e-3
    seconds = np.arange(90_000) / rate
    # Every half minute another rate, within 1.5 s.
    rates = np.resize([6.0, 15.0, 25.0], 30)
    edges = np.sort(np.concatenate([30.0 * np.arange(1, 30), 30.0 * np.arange(1, 30) + 1.5]))
    turning = np.interp(seconds, edges, np.repeat(rates, 2)[1:-1])
    for seed in range(draws):
        random = np.random.default_rng(seed)
        table = np.cumsum(turning + 0.005 * random.standard_normal(seconds.size)) / rate
        noise = np.cumsum(random.standard_normal((2, seconds.size)), axis=1) / math.sqrt(rate)
        x, z = np.array([[0.577], [0.575]]) * table + walk / 60.0 * noise
        read = table + 2.0 / 3600.0 * random.standard_normal(seconds.size)
        recording = Recording.from_arrays(
            x=x, z=z, table=read, kind="angle", unit="deg", sample_rate=rate
        )
        analysis = analyze(recording)
        assert not [note for note in analysis.notes if note.name == "shared"], seed
        assert analysis.angle_random_walk.to("deg/sqrt(h)").high < 1.2 * walk, seed
