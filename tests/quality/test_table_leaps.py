"""Leaps of an encoder: rows that were lost, and slips."""

import numpy as np
import pytest

from sagnac.quality.check import judged
from sagnac.recording.model import Recording
from tests.instruments import Readout, behind_low_pass, turntable

RATE = 100.0


def columns(seed=5, **how):
    made = turntable(
        seed,
        seconds=100.0,
        sample_rate=RATE,
        walk=0.01,
        readout=Readout(step=1e-3),
        **{"jitter": 1e-3, "table_rate": 30.0, **how},
    )
    return {**made.angles, "table": made.encoder}


def found(held, kind="angle"):
    if kind == "rate":
        turned = {name: np.diff(held[name]) * RATE for name in "xyz"}
        held = {**turned, "table": held["table"][1:]}
    recording = Recording.from_arrays(
        **held,
        kind=kind,
        unit="arcsec" if kind == "angle" else "arcsec/s",
        sample_rate=RATE,
    )
    return [note for note in judged(recording) if note.level != "remark"]


def without(held, *rows):
    gone = np.concatenate([np.arange(first, first + size) for first, size in rows])
    return {name: np.delete(one, gone) for name, one in held.items()}


@pytest.mark.parametrize("motion", ["steady", "reversing", "dwelling"])
def test_rows_that_are_lost_are_called_so_and_nothing_else(motion):
    held = columns(motion=motion)
    (note,) = found(without(held, (1000, 1), (2500, 3), (7000, 12)))
    assert (note.name, note.channel, note.level) == ("lost", "table", "warning")
    assert "16 rows of the file lost at 3 places, the first at 9.990 s" in note.text
    assert "{slice 25:69.950}" in note.text
    assert found(held) == []


def test_rows_beside_rates_are_told_by_the_encoder_alone():
    held = columns()
    rates = {name: np.diff(held[name], append=np.nan) * RATE for name in "xyz"}
    whole = {**rates, "table": held["table"]}
    cut = {name: one[:-1] for name, one in without(whole, (1000, 2), (7000, 12)).items()}
    recording = Recording.from_arrays(**cut, kind="rate", unit="arcsec/s", sample_rate=RATE)
    (note,) = (note for note in judged(recording) if note.level != "remark")
    assert "14 rows of the file lost at 2 places" in note.text


@pytest.mark.parametrize("kind", ["angle", "rate"])
@pytest.mark.parametrize("size", [0.01, -0.02, 0.05])
def test_slips_of_the_encoder_are_told_by_the_gyros(size, kind):
    held = columns()
    slipped = held["table"] + np.where(np.arange(held["table"].size) > 4000, size, 0.0)
    (note,) = found({**held, "table": np.mod(slipped, 360.0)}, kind)
    assert (note.name, note.channel, note.level) == ("steps", "table", "warning")
    assert "1 jump that gyro y does not make" in note.text
    assert float(note.text.split("by up to ")[1].split()[0]) == pytest.approx(abs(size), abs=1e-3)
    assert found(held, kind) == []


@pytest.mark.parametrize("turns", [100.0, 37.3])
def test_counts_of_a_coarse_encoder_are_no_slips(turns):
    # Half a degree a sample on rough bearings, and readings of a tenth: at times a count more.
    rough = behind_low_pass(np.random.default_rng(2).standard_normal(60_000), 200.0, 20.0)
    rates = turns + 0.2 * rough / rough.std()
    angle = np.cumsum(rates) / 200.0
    recording = Recording.from_arrays(
        z=rates,
        table=np.mod(np.round(angle, 1), 360.0),
        kind="rate",
        unit="deg/s",
        sample_rate=200.0,
    )
    assert [note for note in judged(recording) if "jump" in note.text] == []


def test_a_glitch_of_a_gyro_is_no_slip_of_the_encoder():
    held = columns()
    held["y"] = held["y"] + np.where(np.arange(held["y"].size) > 4000, 0.02 * 3600.0, 0.0)
    names = [(note.name, note.channel) for note in found(held)]
    assert ("spikes", "y") in names or ("steps", "y") in names
    assert all(channel != "table" for _, channel in names)


@pytest.mark.parametrize(
    ("counts", "sample_rate", "rate", "late"), [(256, 1000.0, 10.0, 1e-3), (1024, 250.0, 40.0, 0.0)]
)
def test_edges_of_a_coarse_encoder_are_no_jumps_and_no_short_turn(counts, sample_rate, rate, late):
    """It is read several times between two edges, and in every turn at the same of them."""
    how = {"sample_rate": sample_rate, "table_rate": rate, "jitter": 0.02, "walk": 0.01}
    made = turntable(6, seconds=180.0, **how)
    # A latch that jitters shows an edge, and once more what was before it.
    off = rate * late * np.random.default_rng(2).standard_normal(made.encoder.size)
    coarse = np.floor((made.encoder + off) / 360.0 * counts) * 360.0 / counts
    held = {**made.angles, "table": coarse, "table_unit": "deg"}
    recording = Recording.from_arrays(kind="angle", unit="arcsec", sample_rate=sample_rate, **held)
    assert not {"encoder", "steps", "lost"} & {note.name for note in judged(recording)}


def test_a_latch_that_is_off_by_a_part_of_a_sample_loses_no_rows():
    rates = np.repeat([8.0, 20.0, 34.0], 4000)
    steps = np.random.default_rng(8).standard_normal((2, 12_000))
    read = np.cumsum(rates) / RATE + 1e-3 * rates * steps[0]
    held = {"table": read, "table_unit": "deg", "x": rates + 0.05 * steps[1]}
    recording = Recording.from_arrays(kind="rate", unit="deg/s", sample_rate=RATE, **held)
    assert "lost" not in {note.name for note in judged(recording)}
