"""Recordings: what they check, and how they are made."""

import pickle
import sys

import numpy as np
import pytest

from sagnac.core.errors import ArgumentError, MissingExtra, RecordingError
from sagnac.formats import Statement, read
from sagnac.recording.channel import Channel
from sagnac.recording.model import Provenance, Recording, second_of
from tests.quality.recordings import RATE, noise, rate_gyro


def sound(**changes):
    arguments = {"gyros": (rate_gyro(noise(1.0)[:20]),), "sample_rate": RATE}
    return Recording(**{**arguments, **changes})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"gyros": ()}, "gyros is empty"),
        ({"gyros": (rate_gyro(noise(1.0)),) * 2}, "gyros are called x, x"),
        ({"gyros": (rate_gyro(noise(1.0)), rate_gyro(np.zeros(9), "z"))}, "gyro z has shape"),
        ({"sample_rate": 0.0}, "sample_rate is 0.0; give samples per second, above zero"),
        ({"sample_rate": np.inf}, "sample_rate is inf"),
        ({"times": np.zeros(19)}, r"times has shape \(19,\); gyro x has 20 samples"),
        ({"times": list(range(20))}, "times holds list; give an array of float64"),
        ({"null_pulse": np.zeros(20)}, "null_pulse holds float64; give an array of bool"),
        ({"table": rate_gyro(np.zeros(20), "table")}, "table is of kind 'rate'"),
        (
            {"table": Channel(name="table", kind="angle", values=np.zeros(21))},
            r"table has shape \(21,\)",
        ),
    ],
)
def test_what_is_no_recording_is_refused(change, words):
    with pytest.raises(ValueError, match=words) as caught:
        sound(**change)
    assert "\n" not in str(caught.value)


def test_a_span_stops_after_it_starts():
    with pytest.raises(ValueError, match="span_s is"):
        Provenance(path="run.csv", sha256="", format="csv", span_s=(3.0, 1.0))


def test_recordings_compare_by_what_they_hold():
    assert sound() == sound()
    assert sound(times=np.arange(20.0)) != sound()
    assert sound(sample_rate=1.0) != sound()
    assert sound() != 3


def test_the_error_over_a_gyro_names_the_file():
    recording = sound(provenance=Provenance(path="run.csv", sha256="", format="csv"))
    with pytest.raises(RecordingError) as caught:
        recording.gyro("q")
    assert caught.value.line(lambda name, value: f"--{name}") == (
        "run.csv: no gyro 'q'; it has x (--gyros, --columns)"
    )


def test_a_sample_is_dated_from_the_start_of_the_file():
    span = Provenance(path="run.csv", sha256="", format="csv", span_s=(7.0, 8.0))
    assert second_of(sound(provenance=span), 5) == 7.05
    times = np.arange(20.0)
    times[4] = np.nan
    assert second_of(sound(times=times), 3) == 3.0
    assert second_of(sound(times=times), 4) == 0.04


# --- made of arrays ---------------------------------------------------------------------------


SAMPLES = 3000
TABLE = 350.0 + 40.0 * np.arange(SAMPLES) / 500.0
READING = np.rint(np.mod(TABLE, 360.0) * 20_000.0) / 20_000.0


def test_arrays_are_taken_as_the_same_numbers_in_a_file_are(tmp_path):
    random = np.random.default_rng(0)
    x, z = 0.6 * TABLE + random.normal(size=(2, SAMPLES)) * 1e-4
    reading = READING.copy()
    reading[[700, 701]] = np.nan
    reading[1500] = 0.0
    stamps = np.rint(1e6 * np.arange(SAMPLES) / 500.0)
    path = tmp_path / "run.csv"
    rows = np.stack([stamps, x, z, reading], axis=1)
    header = "time[us],x[deg],z[deg],table[deg]"
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.17g")
    from_file = read(path, Statement(kind="angle"))
    made = Recording.from_arrays(
        x=x,
        z=z,
        kind="angle",
        unit="deg",
        times=stamps,
        time_unit="us",
        table=reading,
        table_unit="deg",
    )
    assert made.gyros == from_file.gyros
    assert made.table == from_file.table
    assert (made.sample_rate, made.times) == (from_file.sample_rate, None)
    said = {str(note) for note in from_file.notes}
    assert {str(note) for note in made.notes if "unwrapped" not in note.text} <= said
    assert len(made.notes) == len(from_file.notes) == 3
    assert np.isnan(reading[700])


def test_lists_and_units_by_name_are_taken():
    made = Recording.from_arrays(
        x=[1, 2, 3],
        z=[3600.0, 7200.0, 0.0],
        kind={"x": "angle", "z": "rate"},
        unit={"x": "arcsec", "z": "deg/h"},
        sample_rate=10,
    )
    assert made.gyro("z").values == pytest.approx(np.radians([1.0, 2.0, 0.0]))
    assert made.gyro("x").values == pytest.approx(np.radians([1.0, 2.0, 3.0]) / 3600.0)


def test_pulses_and_dates_are_taken():
    dates = np.datetime64("2024-05-01T00:00:00") + np.arange(40) * np.timedelta64(20, "ms")
    pulse = np.zeros(40, dtype=int)
    pulse[[3, 4, 20]] = 1
    made = Recording.from_arrays(
        x=np.zeros(40), kind="rate", unit="deg/s", times=dates, null_pulse=pulse
    )
    assert made.sample_rate == 50.0
    assert np.flatnonzero(made.null_pulse).tolist() == [3, 20]
    assert [str(note) for note in made.notes] == [
        "null_pulse: stays up for more than a sample; its first is taken"
    ]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"unit": "deg"}, "channel x of kind rate: unit 'deg' is not a unit of rate; use one of"),
        ({"kind": "rates"}, "kind is 'rates'"),
        ({"kind": {"z": "rate"}}, "the kind of gyro x is not stated, only that of z"),
        ({"sample_rate": None}, "neither sample_rate nor times is given"),
        ({"sample_rate": -1.0}, "sample_rate is -1.0"),
        ({"times": [0.0, 0.1]}, "times has 2 samples and the gyros have 3"),
        ({"times": [0.0, 0.1, 0.2], "time_unit": "deg"}, "unit 'deg' is not a unit of time"),
        ({"time_unit": "ms"}, "time_unit is 'ms', and there are no times; give them"),
        ({"times": [0.0, 0.1, 0.2]}, "the stamps give 10 Hz but 1 Hz is stated"),
        ({"table": [1.0, 2.0]}, r"table has shape \(2,\); gyro x has 3 samples"),
        ({"table": [1.0, 2.0, 3.0], "table_unit": "deg/s"}, "is not a unit of angle"),
        ({"null_pulse": [0, 1, 2]}, "null_pulse: takes more than two values"),
        ({"period": 360.0}, "x: a counter that starts over is an angle, not kind rate"),
        ({"z": [1.0]}, r"gyro z has shape \(1,\)"),
        ({"x": "abc"}, "x has shape"),
    ],
)
def test_arrays_that_make_no_recording_are_refused(change, words):
    arguments = {"x": [1.0, 2.0, 3.0], "kind": "rate", "unit": "deg/s", "sample_rate": 1.0}
    with pytest.raises(ValueError, match=words) as caught:
        Recording.from_arrays(**{**arguments, **change})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("change", [{"unit": "deg"}, {"kind": "rates"}])
def test_a_wrong_kind_or_unit_says_which_argument_it_is(change):
    arguments = {"x": [1.0, 2.0, 3.0], "kind": "rate", "unit": "deg/s", "sample_rate": 1.0}
    with pytest.raises(ArgumentError) as caught:
        Recording.from_arrays(**{**arguments, **change})
    assert [caught.value.argument] == list(change)
    # As it comes back from a process of its own.
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value)
    assert again.argument == caught.value.argument


def test_a_recording_of_no_gyro_is_refused():
    with pytest.raises(ValueError, match="no gyro is given"):
        Recording.from_arrays(kind="rate", unit="deg/s", sample_rate=1.0)


def test_a_frame_needs_pandas(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingExtra, match=r"pip install '\.\[frames\]'"):
        sound().to_frame()


def test_a_frame_gives_the_recording_back():
    pytest.importorskip("pandas")
    recording = Recording.from_arrays(
        x=noise(1.0)[:SAMPLES],
        z=noise(2.0)[:SAMPLES],
        kind="rate",
        unit="deg/h",
        sample_rate=500.0,
        table=READING,
        null_pulse=np.arange(SAMPLES) == 7,
    )
    frame = recording.to_frame()
    assert list(frame) == ["time[s]", "x[deg/h]", "z[deg/h]", "table[deg]", "null_pulse"]
    back = Recording.from_frame(frame)
    assert back.sample_rate == 500.0
    for one, other in zip(
        (*back.gyros, back.table), (*recording.gyros, recording.table), strict=True
    ):
        assert (one.name, one.kind, one.shown_in) == (other.name, other.kind, other.shown_in)
        assert one.values == pytest.approx(other.values, rel=1e-14, abs=1e-20)
    assert np.array_equal(back.null_pulse, recording.null_pulse)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"fs": 50.0}, "since no argument is called fs"),
        ({"units": "deg/s"}, "since no argument is called units"),
        ({"time": [0.0, 0.02, 0.04]}, "give time stamps as times"),
    ],
)
def test_a_keyword_that_is_no_argument_is_not_taken_for_a_gyro(wrong, said):
    with pytest.raises(ValueError, match=said):
        Recording.from_arrays(
            x=[0.0, 1.0, 0.5], kind="rate", unit="deg/s", sample_rate=50.0, **wrong
        )
