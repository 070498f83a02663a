"""Time stamps that jump, come late or run backwards, and what is made of them."""

import re

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.quality.check import integrity
from sagnac.quality.samples import longest_whole_stretch, uneven_notes, with_gaps_marked
from sagnac.recording.channel import Channel
from sagnac.recording.model import Provenance, Recording, second_of
from tests.quality.recordings import RATE, SAMPLES, SECONDS, noise, rate_gyro


@pytest.mark.parametrize(("missing", "level"), [(1, "remark"), (3, "remark"), (5, "error")])
def test_a_gap_is_more_than_five_steps(missing, level):
    times = np.delete(SECONDS, slice(100, 100 + missing))
    gyro = rate_gyro(noise(0.05)[: times.size])
    findings = integrity(Recording(gyros=(gyro,), sample_rate=RATE, times=times))
    assert [finding.level for finding in findings] == [level]
    assert findings[0].channel == "time"


@pytest.mark.parametrize("kind", ["rate", "increment", "angle"])
def test_gaps_are_marked_where_the_stamps_jump(kind):
    values = noise(1.0)
    there = np.ones(SAMPLES, dtype=bool)
    there[5000:5200] = there[9000:9007] = False
    # Stamps off their place by a fifth of a step, as of a busy host.
    stamps = SECONDS + 0.2 / RATE * np.random.default_rng(6).uniform(-1.0, 1.0, SAMPLES)
    channel = Channel(name="x", kind=kind, values=values[there])
    times = stamps[there] - stamps[0]
    made = with_gaps_marked(Recording(gyros=(channel,), sample_rate=98.9, times=times))
    np.testing.assert_array_equal(made.gyros[0].values, np.where(there, values, np.nan))
    assert made.sample_rate == pytest.approx(RATE, rel=1e-4)
    assert made.times is None
    assert any("2 gaps, 207 samples missing" in str(note) for note in made.notes)


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
    channel = Channel(name="x", kind="angle", values=values)
    stretch, start = longest_whole_stretch(Recording(gyros=(channel,), sample_rate=RATE), "x")
    assert stretch.gyros[0].values.tolist() == list(range(first, last))
    assert start == pytest.approx(first / RATE if last else 0.0)


@pytest.mark.parametrize(
    ("times", "said"),
    [
        # Packets of ten that arrive within a millisecond of each other.
        (
            np.floor(np.arange(SAMPLES) / 10) * 10 / RATE + 1e-4 * (np.arange(SAMPLES) % 10),
            "bursts",
        ),
        # After every twenty samples the next ten were lost.
        ((np.arange(SAMPLES) + np.arange(SAMPLES) // 20 * 10) / RATE, "gaps"),
    ],
)
def test_packets_are_told_from_losses(times, said):
    gyro = rate_gyro(noise(0.05))
    rate = (SAMPLES - 1) / float(times[-1])
    (found,) = integrity(Recording(gyros=(gyro,), sample_rate=rate, times=times))
    assert found.level == "error"
    assert ("comes in bursts" in found.text) == (said == "bursts")
    assert (f"{{time none}} and {{rate {rate:.6g}}}" in found.text) == (said == "bursts")


@pytest.mark.parametrize(
    ("name", "rates"),
    [
        ("halves", ("100", "200")),
        ("drops", ("100", "80")),
        # Sound twins: a clock of 1 ms, a third of a stretch lost, random times, drift of 2 %.
        ("ticks", ()),
        ("lost", ()),
        ("random", ()),
        ("drift", ()),
    ],
)
def test_a_rate_that_changes_is_told_from_lost_rows_and_coarse_clocks(name, rates):
    generator, places = np.random.default_rng(3), np.arange(SAMPLES)
    steps = np.full(SAMPLES, 1.0 / RATE)
    if rates:
        steps[4000:] = 1.0 / float(rates[1])
    times = np.cumsum(steps) - steps[0]
    if name == "ticks":
        times = np.round(places / 153.8, 3)
    elif name == "lost":
        times = times[(places > SAMPLES // 4) | (generator.random(SAMPLES) > 0.3)]
    elif name == "random":
        times = np.cumsum(generator.exponential(1.0 / RATE, SAMPLES))
        times = times[:2000] - times[0]
    elif name == "drift":
        times = times + 0.01 * times**2 / times[-1]
    gyro, rate = rate_gyro(noise(0.05)[: times.size]), (times.size - 1) / float(times[-1])
    recording = Recording(gyros=(gyro,), sample_rate=rate, times=times)
    said = [one.text for one in integrity(recording) if "the samples come at" in one.text]
    assert len(said) == bool(rates)
    for text in said:
        assert text.startswith(f"the samples come at {rates[0]} Hz, and at {rates[1]} Hz")
        assert not [one for one in integrity(recording[4010:]) if one.level == "error"]


def test_late_and_repeated_stamps_are_told_from_gaps():
    steps = np.array([1.0, 0.0, 2.0, 1.0, 4.0, 1.0, 9.0, 0.0])
    notes = uneven_notes(np.concatenate([[0.0], np.cumsum(steps)]), 1.0)
    assert [note.text for note in notes] == [
        "2 repeated stamps",
        "2 intervals longer than 1.5 steps of 1 s, the longest 4 s",
    ]


def test_a_stretch_of_a_turning_recording_leaves_the_table_out():
    table = Channel(name="table", kind="angle", values=np.arange(20.0))
    values = np.arange(20.0)
    values[3] = np.nan
    gyro = Channel(name="x", kind="angle", values=values)
    stretch, _ = longest_whole_stretch(Recording(gyros=(gyro,), sample_rate=RATE, table=table), "x")
    assert stretch.table is None


def test_seconds_of_a_stretch_count_from_the_start_of_the_file():
    values = np.arange(20.0)
    values[3] = np.nan
    channel = Channel(name="x", kind="angle", values=values)
    file = Provenance(path="x.csv", sha256="", format="csv", span_s=(100.0, 200.0))
    recording = Recording(gyros=(channel,), sample_rate=RATE, provenance=file)
    stretch, start = longest_whole_stretch(recording, "x")
    assert second_of(stretch, 0) == start == pytest.approx(100.0 + 4 / RATE)


def coarse(times) -> str:
    """The finding on stamps of a clock that is too coarse for them."""
    gyro = rate_gyro(np.random.default_rng(8).normal(size=times.size))
    (found,) = integrity(Recording(gyros=(gyro,), sample_rate=RATE, times=times))
    assert "too coarse" in found.text
    return found.text


@pytest.mark.parametrize("start", [0.0, 0.13, 0.99])
@pytest.mark.parametrize("rate", [100.0, 62.5, 199.87])
def test_a_clock_of_whole_seconds_shows_the_rate_between_its_ticks(rate, start):
    rows = np.arange(int(30.0 * rate) + 17)
    text = coarse(np.floor(start + rows / rate))
    stated = float(re.search(r"{rate ([\d.]+)}", text)[1])
    assert stated == pytest.approx(rate, rel=1.0 / (28.0 * rate))
    assert rate != 100.0 or stated == 100.0


def test_a_clock_that_ticks_once_shows_no_rate():
    assert "{rate HZ}" in coarse(np.repeat([0.0, 1.0], [10, 90]))
