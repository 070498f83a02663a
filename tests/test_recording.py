"""Checks of the data, against recordings whose fault is known because it was put in."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sagnac.recording import (
    Channel,
    Recording,
    RecordingError,
    angle_of,
    check,
    integrity,
    longest_whole_stretch,
    require_encoder_follows,
    unwrapped,
    with_gaps_marked,
)

DEGREE = np.pi / 180.0
RATE = 100.0
SAMPLES = 20_000


def noise(scale: float, seed: int = 0) -> np.ndarray:
    return scale * np.random.default_rng(seed).normal(size=SAMPLES)


def rate_gyro(values: np.ndarray, name: str = "x") -> Channel:
    return Channel(name=name, kind="rate", unit="deg/s", values=values * DEGREE)


def turning(rate: np.ndarray, share: float, seed: int = 0) -> Recording:
    """A gyro that senses `share` of `rate` (deg/s), and the encoder that went with it."""
    table = np.cumsum(rate) / RATE * DEGREE
    return Recording(
        gyros=(rate_gyro(share * rate + noise(0.05, seed)),),
        sample_rate=RATE,
        table=Channel(name="table", kind="angle", unit="deg", values=table),
    )


def with_table(recording: Recording, values: np.ndarray) -> Recording:
    table = Channel(name="table", kind="angle", unit="deg", values=values)
    return Recording(gyros=recording.gyros, sample_rate=RATE, table=table)


def levels(recording: Recording) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {"error": [], "warning": [], "note": []}
    for finding in check(recording):
        assert "\n" not in finding.message
        found[finding.level].append(f"{finding.channel}: {finding.message}")
    return found


STEADY = np.full(SAMPLES, 40.0)
SECONDS = np.arange(SAMPLES) / RATE
BACK_AND_FORTH = 46.0 * np.sign(np.sin(2.0 * np.pi * SECONDS / 7.81) + 1e-9)
MOTIONS = {"steady": STEADY, "back and forth": BACK_AND_FORTH}


@given(st.lists(st.floats(-170.0, 170.0), min_size=1, max_size=60), st.floats(0.0, 359.0))
def test_unwrapping_gives_back_any_motion_below_half_a_turn_a_sample(steps, start):
    angle = start + np.cumsum(steps)
    values, wraps = unwrapped(angle % 360.0, 360.0)
    np.testing.assert_allclose(np.diff(values), steps[1:], atol=1e-9)
    naive = np.unwrap(angle % 360.0, period=360.0)
    np.testing.assert_allclose(values, naive, atol=1e-9)
    assert (wraps == 0) == bool(np.all(np.abs(np.diff(angle % 360.0)) <= 180.0))


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
    assert "--table" in str(caught.value)


def test_a_unit_that_makes_the_gyro_outrun_its_table_is_refused():
    recording = turning(STEADY, 0.577 * 60.0)
    with pytest.raises(RecordingError, match=r"34\.6 times as fast as the table"):
        require_encoder_follows(recording, recording.gyros[0])


def test_a_gyro_across_the_axis_or_in_the_wrong_unit_is_warned_of():
    found = levels(turning(STEADY, 0.577 / 3600.0))
    assert any("across the axis" in line for line in found["warning"])
    assert any(
        "0.5770 of the table rate" in line for line in levels(turning(STEADY, 0.577))["note"]
    )


def test_a_table_at_rest_is_no_fault():
    recording = turning(np.zeros(SAMPLES), 0.577)
    require_encoder_follows(recording, recording.gyros[0])
    assert any("does not turn" in line for line in levels(recording)["note"])


@pytest.mark.parametrize("kind", ["angle", "increment", "rate"])
def test_share_is_the_same_for_every_kind(kind):
    steady = turning(STEADY, 0.577)
    rate = steady.gyros[0].values
    values = {"rate": rate, "increment": rate / RATE, "angle": np.cumsum(rate) / RATE}[kind]
    recording = Recording(
        gyros=(Channel(name="x", kind=kind, unit="rad", values=values),),
        sample_rate=RATE,
        table=steady.table,
    )
    assert any("0.577" in line for line in levels(recording)["note"])


@pytest.mark.parametrize("step", [0.3, 1.0, 5.0, 20.0])
@pytest.mark.parametrize("kind", ["angle", "increment"])
def test_a_quiet_quantized_gyro_is_not_stuck(step, kind):
    for seed in range(5):
        angle = np.cumsum(noise(0.05, seed)) + 0.002 * np.arange(SAMPLES)
        counts = np.rint(angle / step)
        values = counts if kind == "angle" else np.diff(counts, prepend=0.0)
        gyro = Channel(name="x", kind=kind, unit="arcsec", values=values * 1e-6)
        recording = Recording(gyros=(gyro,), sample_rate=RATE)
        assert not [finding for finding in integrity(recording) if "stuck" in finding.message]


@pytest.mark.parametrize("length", [400, 2000])
@pytest.mark.parametrize("quantum", [0.0, 0.1])
def test_a_channel_that_sticks_once_is_found_where_it_does(length, quantum):
    values = noise(0.05)
    values = np.rint(values / quantum) * quantum if quantum else values
    values[5000 : 5000 + length] = values[5000]
    findings = integrity(Recording(gyros=(rate_gyro(values),), sample_rate=RATE))
    assert findings[0].level == "error"
    assert f"for {length}" in findings[0].message or quantum
    assert "50.0" in findings[0].message or quantum


def test_jumps_and_saturation_are_warned_of():
    values = noise(0.05)
    values[7000:] += 500.0
    found = levels(Recording(gyros=(rate_gyro(values),), sample_rate=RATE))
    assert any("1 jump" in line and "70.000 s" in line for line in found["warning"])
    clipped = np.clip(noise(0.05), -0.1, 0.09)
    found = levels(Recording(gyros=(rate_gyro(clipped),), sample_rate=RATE))
    assert len([line for line in found["warning"] if "saturated" in line]) == 2
    for sound in (noise(0.05), np.rint(noise(3.0)), np.rint(noise(0.3))):
        assert levels(Recording(gyros=(rate_gyro(sound),), sample_rate=RATE))["warning"] == []


def test_rates_that_no_gyro_has_are_warned_of():
    for scale in (1e-14, 1e6):
        gyro = rate_gyro(noise(scale) + 100.0 * scale)
        found = levels(Recording(gyros=(gyro,), sample_rate=RATE))
        assert any("looks wrong" in line for line in found["warning"])


@pytest.mark.parametrize(("missing", "level"), [(1, "note"), (3, "note"), (5, "error")])
def test_a_gap_is_more_than_five_steps(missing, level):
    times = np.delete(SECONDS, slice(100, 100 + missing))
    gyro = rate_gyro(noise(0.05)[: times.size])
    findings = integrity(Recording(gyros=(gyro,), sample_rate=RATE, times=times))
    assert [finding.level for finding in findings] == [level]
    assert findings[0].channel == "time"


def test_angle_of_keeps_the_noise_of_a_fast_table():
    increments = noise(1e-9) + 1.0
    gyro = Channel(name="x", kind="increment", unit="rad", values=increments)
    angle = angle_of(gyro, RATE)
    exact = np.array([float(item) for item in np.cumsum(increments.astype(np.longdouble))])
    np.testing.assert_allclose(angle, exact, rtol=4e-16)
    np.testing.assert_allclose(
        angle_of(rate_gyro(noise(1.0)), RATE), np.cumsum(noise(1.0)) * DEGREE / RATE, atol=1e-12
    )


def test_a_gyro_that_is_not_there_is_named_with_those_that_are():
    with pytest.raises(RecordingError, match=r"no gyro 'q'; it has x"):
        Recording(gyros=(rate_gyro(noise(1.0)),), sample_rate=RATE).gyro("q")


@pytest.mark.parametrize("kind", ["rate", "increment", "angle"])
def test_gaps_are_marked_where_the_stamps_jump(kind):
    values = noise(1.0)
    there = np.ones(SAMPLES, dtype=bool)
    there[5000:5200] = there[9000:9007] = False
    # Stamps off their place by a fifth of a step, as of a busy host.
    stamps = SECONDS + 0.2 / RATE * np.random.default_rng(6).uniform(-1.0, 1.0, SAMPLES)
    channel = Channel(name="x", kind=kind, unit="rad", values=values[there])
    times = stamps[there] - stamps[0]
    made = with_gaps_marked(Recording(gyros=(channel,), sample_rate=98.9, times=times))
    np.testing.assert_array_equal(made.gyros[0].values, np.where(there, values, np.nan))
    assert made.sample_rate == pytest.approx(RATE, rel=1e-4)
    assert made.times is None
    assert any("2 gaps, 207 samples missing" in note for note in made.notes)


def test_even_stamps_and_none_stay_as_they_are():
    recording = Recording(gyros=(rate_gyro(noise(1.0)),), sample_rate=RATE)
    assert with_gaps_marked(recording) == recording
    stamped = Recording(gyros=recording.gyros, sample_rate=RATE, times=SECONDS)
    assert with_gaps_marked(stamped).times is SECONDS


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"values": (300, np.inf)}, "1 sample infinite, the first at 3.000 s"),
        ({"values": (slice(300, 900), 0.5)}, "is stuck at one value for 600 samples"),
        ({"times": (slice(300, None), SECONDS[300:] - 9.0)}, "runs backwards"),
        ({"times": (slice(300, None), SECONDS[300:] + 1e6)}, "1 gap would hold"),
    ],
)
def test_what_is_no_gap_is_refused_beside_gaps(change, words):
    values, times = noise(1.0), SECONDS.copy()
    values[100] = np.nan
    for name, (place, value) in change.items():
        {"values": values, "times": times}[name][place] = value
    with pytest.raises(RecordingError, match=words) as caught:
        with_gaps_marked(Recording(gyros=(rate_gyro(values),), sample_rate=RATE, times=times))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("missing", "first", "last"),
    [([], 0, 20), ([3], 4, 20), ([15, 18], 0, 15), ([0, 8, 19], 9, 19), (range(20), 0, 0)],
)
def test_the_longest_stretch_holds_no_missing_sample(missing, first, last):
    values = np.arange(20.0)
    values[list(missing)] = np.nan
    channel = Channel(name="x", kind="angle", unit="rad", values=values)
    stretch, start = longest_whole_stretch(Recording(gyros=(channel,), sample_rate=RATE), "x")
    assert stretch.gyros[0].values.tolist() == list(range(first, last))
    assert start == pytest.approx(first / RATE if last else 0.0)
