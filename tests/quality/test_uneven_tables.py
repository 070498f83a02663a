"""Sound recordings of tables that start, stop and turn round; and faults beside such motion."""

import numpy as np
import pytest

from sagnac.quality.check import judged
from sagnac.recording.model import Recording

RATE, SAMPLES = 200.0, 40_000
COUNT = 1e-3  # deg, of the encoder
SHARES = {"x": 0.577, "z": 0.57}


def table_rates(motion: str, acceleration: float) -> np.ndarray:
    """(samples,) deg/s of a trapezoid whose corners take 0.2 s."""
    time = np.arange(SAMPLES) / RATE
    rates = {
        "dwell": np.where(time % 50.0 < 30.0, 50.0, 0.0) * np.where(time % 100.0 < 50.0, 1, -1),
        "onward": np.where(time % 50.0 < 30.0, 10.0, 0.0),
        "index": np.where(time % 31.0 < 30.0, 0.0, 30.0),
        "reverse": np.where(time % 60.0 < 30.0, 60.0, -60.0),
        "swing": 20.0 * np.cos(2.0 * np.pi * 0.1 * time),
    }[motion]
    if motion != "swing":
        for seconds in (np.ptp(rates) / acceleration, 0.2):
            width = max(1, round(seconds * RATE))
            padded = np.pad(rates, (width // 2, width - 1 - width // 2), mode="edge")
            rates = np.convolve(padded, np.ones(width) / width, mode="valid")
    return rates


def of_table(motion: str, acceleration: float = 50.0, *, walk: float = 5e-3, seed: int = 3):
    """Columns of rates, deg/s, and of the encoder, deg; the walk in deg/sqrt(h)."""
    random, rates = np.random.default_rng(seed), table_rates(motion, acceleration)
    noise = walk / 60.0 * np.sqrt(RATE)
    columns = {
        name: share * rates + noise * random.standard_normal(SAMPLES)
        for name, share in SHARES.items()
    }
    return {**columns, "table": np.floor(np.cumsum(rates) / RATE / COUNT) * COUNT}


def found(columns):
    recording = Recording.from_arrays(**columns, kind="rate", unit="deg/s", sample_rate=RATE)
    return [note for note in judged(recording) if note.level != "remark"]


@pytest.mark.parametrize(
    "acceleration", [10.0, 300.0, pytest.param(50.0, marks=pytest.mark.statistics)]
)
@pytest.mark.parametrize("motion", ["dwell", "onward", "index", "reverse", "swing"])
@pytest.mark.parametrize("walk", [1e-3, 0.1])
def test_nothing_is_said_of_a_sound_recording(motion, acceleration, walk):
    assert found(of_table(motion, acceleration, walk=walk)) == []


@pytest.mark.parametrize("motion", ["dwell", "index", "reverse", "swing"])
def test_spikes_beside_the_motion_are_found(motion):
    columns = of_table(motion)
    random = np.random.default_rng(8)
    places = random.random(SAMPLES) < 0.02
    columns["x"][places] += random.uniform(0.2, 1.0, np.count_nonzero(places))
    notes = {(note.name, note.channel): note.text for note in found(columns)}
    assert notes["spikes", "x"].startswith("more than one sample in 100 lies far off")
    assert ("spikes", "z") not in notes


@pytest.mark.parametrize("motion", ["dwell", "onward", "reverse"])
def test_lost_rows_are_found_where_the_table_turns_fast(motion):
    columns = of_table(motion)
    gone = np.r_[2000, 4000:4003]
    (note,) = found({name: np.delete(values, gone) for name, values in columns.items()})
    assert note.name == "lost"
    assert "4 rows of the file lost at 2 places" in note.text


def as_stored(columns, precision):
    """Round the rates to single precision, or to `precision` figures as a text file does."""
    for name in SHARES:
        rates = columns[name]
        if precision == "single":
            columns[name] = rates.astype(np.float32)
        else:
            places = 10.0 ** (precision - 1 - np.floor(np.log10(np.abs(rates))))
            columns[name] = np.rint(rates * places) / places
    return columns


@pytest.mark.parametrize("motion", ["dwell", "onward", "reverse", "swing"])
@pytest.mark.parametrize("precision", ["single", 6, 7])
def test_steps_that_grow_with_the_rate_repeat_no_samples(motion, precision):
    """Chance was judged by the steps of a table that stands, which are the finest."""
    columns = of_table(motion, walk=6e-3)
    assert found(as_stored(columns, precision)) == []


@pytest.mark.parametrize("motion", ["dwell", "swing"])
def test_held_samples_are_found_beside_such_steps(motion):
    columns = of_table(motion, walk=6e-3)
    held = 1 + np.flatnonzero(np.random.default_rng(9).random(SAMPLES - 1) < 0.003)
    for name in SHARES:
        columns[name][held] = columns[name][held - 1]
    notes = found(as_stored(columns, "single"))
    assert {note.channel for note in notes if note.name == "repeats"} == set(SHARES)
