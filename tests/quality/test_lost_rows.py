"""Rows that even time stamps show to be missing, of rates and of angles."""

import numpy as np
import pytest

from sagnac.analysis.pipeline import analyze
from sagnac.quality.check import check
from sagnac.recording.model import Recording

RATE, SAMPLES = 200.0, 120_000
WALK = 0.1  # deg/sqrt(h)


def held(kind, kept, *, late=0.0, seed=2):
    """White rate noise of which some rows are kept, with the stamps of an even clock."""
    random = np.random.default_rng(seed)
    rates = WALK / 60.0 * np.sqrt(RATE) * random.standard_normal(SAMPLES)
    values = {"rate": rates, "increment": rates / RATE, "angle": np.cumsum(rates) / RATE}[kind]
    times = (np.arange(SAMPLES) + late * random.uniform(0.0, 1.0, SAMPLES)) / RATE
    unit = "deg/s" if kind == "rate" else "deg"
    stamped = {"kind": kind, "unit": unit, "times": times[kept]}
    return Recording.from_arrays(x=values[kept], **stamped)


def some(share, seed=2):
    return np.random.default_rng(seed).random(SAMPLES) >= share


@pytest.mark.parametrize("kind", ["rate", "increment", "angle"])
def test_an_interval_holds_n_though_rows_are_lost(kind):
    kept = some(0.04)
    recording = held(kind, kept)
    lost = [note for note in check(recording) if note.name == "dropouts"]
    assert len(lost) == (kind != "angle")
    for note in lost:
        expected = np.sqrt(1.0 / kept.mean())
        effect = expected if kind == "rate" else 1.0 / expected
        assert note.effect == pytest.approx(effect, abs=6e-4)  # four digits
        assert note.text.startswith(f"{np.count_nonzero(~kept)} rows")
    found = analyze(recording).angle_random_walk
    assert found.status == "estimated"
    assert found.to("deg/sqrt(h)").low < WALK < found.to("deg/sqrt(h)").high


def test_a_fifth_of_the_rows_lost_leaves_no_estimate():
    kept = np.arange(SAMPLES) % 5 != 2
    found = analyze(held("rate", kept))
    assert found.angle_random_walk.status != "estimated"
    assert any(note.level == "error" and "rows are not there" in note.text for note in found.notes)


@pytest.mark.parametrize("late", [0.3, 0.9])
def test_rows_that_come_late_are_not_lost(late):
    kept = np.ones(SAMPLES, dtype=bool)
    assert not [note for note in check(held("rate", kept, late=late)) if note.name == "dropouts"]
    assert not [note for note in check(held("rate", kept)) if note.name == "dropouts"]
