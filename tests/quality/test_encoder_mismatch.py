"""Whether the encoder and the gyros turn together."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.quality.check import check
from sagnac.quality.encoder import jumps_of_encoder, require_encoder_follows, turned_around
from sagnac.quality.profile import Profile
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording
from tests.quality.recordings import (
    DEGREE,
    MOTIONS,
    RATE,
    SAMPLES,
    SECONDS,
    STEADY,
    levels,
    turning,
    with_table,
)
from tests.recording.test_encoder_readings import motion, table


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("share", [0.577, -1.006, 0.0, 1e-4])
def test_an_encoder_that_follows_is_taken(motion, share):
    recording = turning(MOTIONS[motion], share)
    require_encoder_follows(recording, recording.gyros[0])
    assert levels(recording)["error"] == []


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("share", [0.577, -1.006])
@pytest.mark.parametrize("fault", ["stands still", "sticks", "another's", "scrambled", "late"])
def test_an_encoder_that_does_not_follow_is_refused(motion, share, fault):
    recording = turning(MOTIONS[motion], share)
    table = recording.table.values.copy()
    if fault == "stands still":
        table[:] = 1.0
    elif fault == "sticks":
        table[12_000:15_000] = table[12_000]
    elif fault == "another's":
        table = np.cumsum(30.0 * np.sin(2.0 * np.pi * SECONDS / 31.0)) / RATE * DEGREE
    elif fault == "scrambled":
        table = np.random.default_rng(4).uniform(0.0, 2.0 * np.pi, SAMPLES)
    elif motion == "steady":
        table = np.where(SECONDS < 60.0, table, 2.0 * table[6000] - table)
    else:
        table = np.roll(table, 250)
    broken = with_table(recording, table)
    with pytest.raises(RecordingError, match=r"encoder|times as fast") as caught:
        require_encoder_follows(broken, broken.gyros[0])
    assert "\n" not in str(caught.value)
    assert "table" in caught.value.line(lambda name, value: f"<{name}>").split(";")[1]


def test_a_unit_that_makes_the_gyro_outrun_its_table_is_refused():
    recording = turning(STEADY, 0.577 * 60.0)
    with pytest.raises(RecordingError, match=r"34\.6 times as fast as the table"):
        require_encoder_follows(recording, recording.gyros[0])


def test_increments_called_rates_are_named_beside_the_unit_that_would_fit_too():
    said = " ".join(levels(turning(STEADY, 0.577 / RATE))["error"])
    assert "state unit=rad/s, or kind=increment, as which it would sense 57.7 %" in said
    in_degrees = " ".join(levels(turning(STEADY, 0.577 / 3600.0))["warning"])
    assert "increment" not in in_degrees


def test_a_gyro_across_the_axis_or_in_the_wrong_unit_is_warned_of():
    found = levels(turning(STEADY, 0.577 / 3600.0))
    assert any("across the axis" in line for line in found["warning"])
    assert any(
        "0.5770 of the table rate" in line for line in levels(turning(STEADY, 0.577))["remark"]
    )


@pytest.mark.parametrize("vibrates", [False, True])
@pytest.mark.parametrize(("unit", "level"), [(1.0, "warning"), (57.3, "error")])
def test_a_gyro_that_vibrates_is_in_no_wrong_unit_if_both_sense_the_table_alike(
    vibrates, unit, level
):
    """Nor is one that hums a tone, which an answer goes without: nothing is said of it."""
    sound = turning(STEADY, 0.577)
    hum = 4.0 * DEGREE * np.cos(2.0 * np.pi * 31.0 * SECONDS)
    if vibrates:
        hum = 4.0 * DEGREE * np.random.default_rng(2).standard_normal(SECONDS.size)
    shaken = sound.gyros[0].values + hum
    quiet = turning(STEADY, 0.577, seed=1).gyros[0].values
    gyros = (
        Channel(name="x", kind="rate", values=shaken),
        Channel(name="z", kind="rate", values=quiet / unit),
    )
    pair = replace(sound, gyros=gyros)
    found = [note for note in check(pair) if "times below that of gyro x" in note.text]
    assert [note.level for note in found] == [level] * (vibrates or level == "error")
    assert any("a unit may be wrong" in note.text for note in found) == (level == "error")


def test_a_table_at_rest_is_no_fault():
    recording = turning(np.zeros(SAMPLES), 0.577)
    require_encoder_follows(recording, recording.gyros[0])
    assert any("does not turn" in line for line in levels(recording)["remark"])


@pytest.mark.parametrize("kind", ["angle", "increment", "rate"])
def test_share_is_the_same_for_every_kind(kind):
    steady = turning(STEADY, 0.577)
    rate = steady.gyros[0].values
    values = {"rate": rate, "increment": rate / RATE, "angle": np.cumsum(rate) / RATE}[kind]
    recording = Recording(
        gyros=(Channel(name="x", kind=kind, values=values),),
        sample_rate=RATE,
        table=steady.table,
    )
    assert any("0.577" in line for line in levels(recording)["remark"])


@pytest.mark.parametrize("kind", ["angle", "increment", "rate"])
def test_a_jump_that_the_gyro_does_not_make_is_refused(kind):
    angle = np.radians(motion(40.0, reversing=True))
    steps = 0.6 * np.diff(angle, prepend=angle[0])
    gyro = {"angle": 0.6 * angle, "increment": steps, "rate": steps * RATE}[kind]
    require_encoder_follows(table(angle, gyro, kind), table(angle, gyro, kind).gyros[0])
    jumped = angle.copy()
    jumped[12_000:] += np.radians(30.0)
    recording = table(jumped, gyro, kind)
    with pytest.raises(
        RecordingError, match=r"table: 1 jump that gyro x does not make.*30 deg at "
    ):
        require_encoder_follows(recording, recording.gyros[0])
    messages = [str(finding) for finding in check(recording) if finding.level == "error"]
    assert len(messages) == 1
    assert "24.000 s" in messages[0]
    assert "span=(24.002, None)" in messages[0]


def test_jumps_of_an_encoder_are_those_beside_its_usual_steps():
    angle = np.cumsum(np.full(1000, 0.001))
    assert jumps_of_encoder(angle).size == 0
    angle[400:] += 2.0 * DEGREE
    angle[700:] -= 0.9 * DEGREE
    assert jumps_of_encoder(angle).tolist() == [399]


@pytest.mark.parametrize("kind", ["angle", "increment", "rate"])
def test_what_a_gyro_turns_around_a_step_holds_two_samples_on_each_side(kind):
    angle = np.arange(20.0) ** 2
    steps = np.diff(angle, prepend=0.0)
    values = {"angle": angle, "increment": steps, "rate": steps * RATE}[kind]
    gyro = Channel(name="x", kind=kind, values=values)
    turned = turned_around(Profile(channel=gyro, sample_rate=RATE), np.array([0, 9, 18]))
    # From sample 0 to 3, from 7 to 12 and from 16 to the last, 19.
    assert turned == pytest.approx([9.0, 144.0 - 49.0, 361.0 - 256.0])


@pytest.mark.parametrize("sample_rate", [0.1, 1.0, 1.4, 7.0])
@pytest.mark.parametrize("samples", [16, 21, 500])
def test_rates_of_blocks_are_those_of_the_samples(sample_rate, samples):
    rate = np.random.default_rng(3).normal(size=samples)
    gyro = Channel(name="x", kind="rate", values=rate)
    profile = Profile(channel=gyro, sample_rate=sample_rate)
    assert profile.edges[-1] == samples - 1
    means = [rate[one + 1 : other + 1].mean() for one, other in itertools.pairwise(profile.edges)]
    assert profile.rates == pytest.approx(means)


def test_the_size_of_a_jump_is_without_what_the_table_turned_meanwhile():
    whole = turning(np.full(SAMPLES, 20.0), 0.577)
    jumped = whole.table.values + 2.5 * DEGREE * (np.arange(SAMPLES) >= 7000)
    said = levels(with_table(whole, jumped))
    assert all("2.5 deg" in line for line in said["error"] + said["warning"])
    assert said["error"]
