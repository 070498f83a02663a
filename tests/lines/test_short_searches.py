"""Orders and tones that a table which stops sweeps over each other, in a short record."""

import numpy as np
import pytest

from sagnac.lines import search

RATE, SAMPLES = 100.0, 30_000
ORDERS = (3.0, 8.0, 19.0, 27.0, 34.0, 41.0, 52.0, 66.0, 77.0, 85.0, 92.0, 99.0)
TONES = (1.7, 4.4, 7.3, 9.9, 12.1, 15.6, 18.2, 23.5, 31.0, 43.0)


def record(seed):
    """Angle and its table, rad: 60 deg/s in three dwells, ten tones and twelve orders."""
    random, time = np.random.default_rng(seed), np.arange(SAMPLES) / RATE
    place = (time % 100.0) / 100.0
    speed = 61.0 * np.clip(np.minimum((place - 0.2) * 50.0, (1.0 - place) * 50.0), 0.0, 1.0)
    table = np.cumsum(np.radians(speed + 0.03 * random.standard_normal(SAMPLES))) / RATE
    angle = np.cumsum(1e-8 * random.standard_normal(SAMPLES))
    noise = angle.copy()
    for waves in ([order * table for order in ORDERS], [2 * np.pi * one * time for one in TONES]):
        for wave in waves:
            size = 2e-9 * np.exp(random.uniform(0.0, 1.5)) / np.std(np.diff(np.cos(wave)))
            angle += size * np.cos(wave + random.uniform(0.0, 6.0))
    return angle, table, noise


@pytest.mark.parametrize("seed", range(3))
def test_a_short_record_is_searched_to_its_end(seed):
    angle, table, noise = record(seed)
    removal = search.remove_lines(angle, table, RATE, channel="x-z")
    assert removal.unfinished is None
    found = {(line.scale, round(line.frequency, 2)) for line in removal.lines}
    assert {("angle", order) for order in ORDERS} | {("time", tone) for tone in TONES} <= found
    left = np.std(np.diff(removal.residual)) / np.std(np.diff(noise))
    # 22 lines take 64 parameters of 30,000 samples.
    assert left == pytest.approx(1.0, abs=0.003)


def test_a_search_of_a_record_that_is_not_short_stops_after_as_many_passes(monkeypatch):
    monkeypatch.setattr(search, "_LONG", SAMPLES)
    angle, table, _ = record(2)
    removal = search.remove_lines(angle, table, RATE, channel="x-z")
    assert removal.unfinished is not None
    assert any("the search stopped" in str(note) for note in removal.notes)
