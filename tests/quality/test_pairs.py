"""Gyros beside each other: likeness against its definition, and hundreds of gyros."""

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from sagnac.quality import physics as pairs
from sagnac.quality.check import check
from sagnac.recording.model import Recording


def correlation_at(first: np.ndarray, second: np.ndarray, delay: int) -> float:
    """Mean cosine of the phase at a delay, part by part, by sums over frequencies."""
    size = first.size // 4
    latest = min(1024, size // 2)
    length = pairs.next_fast_len(size + latest, real=True)
    found = []
    for start in range(0, 4 * size, size):
        one, other = (
            np.fft.fft((part - part.mean()) * np.hanning(size), length)
            for part in (first[start : start + size], second[start : start + size])
        )
        turn = np.exp(2j * np.pi * np.arange(length) * delay / length)
        found.append(np.mean(np.conj(one) / abs(one) * other / abs(other) * turn).real)
    return float(np.mean(found))


@pytest.mark.parametrize("delay", [0, 3, -7])
def test_likeness_is_the_mean_cosine_of_the_phase(delay):
    random = np.random.default_rng(2)
    first = random.normal(size=4000)
    second = np.roll(first, delay) + random.normal(size=4000)
    found = pairs.likeness(pairs.phases_of(first), pairs.phases_of(second), 4000)
    assert found.delay == delay
    expected = correlation_at(first, second, delay)
    assert found.correlation == pytest.approx(expected, rel=1e-4)
    assert found.together == pytest.approx(correlation_at(first, second, 0), abs=1e-5)


@pytest.mark.parametrize(
    ("alike", "copies"), [((0.15, 0.04, 0.036, 0.036), False), ((0.06, 0.06, 0.06, 0.06), True)]
)
def test_gyros_that_are_alike_in_a_quarter_of_the_band_are_no_copies(alike, copies):
    """Two gyros of one table that swings shared 5.5 % of their phases, nearly all below 6 Hz."""
    size, late = 8192, 12
    length = pairs.next_fast_len(size + 1024, real=True)
    turn = np.exp(-2j * np.pi * late / length * np.arange(length // 2 + 1))
    found = []
    for seed in range(20):
        random = np.random.default_rng(seed)
        bands = np.array_split(random.uniform(-np.pi, np.pi, (4, turn.size)), 4, axis=1)
        # So many phases are the same that their mean cosine is as stated, the others are any.
        for band, part in zip(bands, alike, strict=True):
            band[random.uniform(size=band.shape) < part] = 0.0
        second = turn * np.exp(1j * np.concatenate(bands, axis=1))
        found.append(pairs.likeness(np.ones_like(second), second, 4 * size).delay == late)
    assert np.mean(found) == pytest.approx(float(copies), abs=0.25)


def test_what_a_gyro_brings_to_its_pairs_is_made_once(monkeypatch):
    """300 gyros took minutes to begin: each was transformed eight times for each of 299 others."""
    calls = []

    def counted(*arguments, **named):
        calls.append(1)
        return whole(*arguments, **named)

    whole = pairs.rfft
    monkeypatch.setattr(pairs, "rfft", counted)
    random = np.random.default_rng(3)
    gyros = {f"g{number}": random.normal(size=600) for number in range(40)}
    gyros["g39"] = gyros["g0"]
    recording = Recording.from_arrays(**gyros, kind="rate", unit="deg/h", sample_rate=100.0)
    said = [str(note) for note in check(recording)]
    assert len(calls) == 40
    assert [one for one in said if "is a copy of gyro g0" in one] == [
        one for one in said if "copy" in one
    ]
    assert any(one.startswith("g39: is a copy of gyro g0") for one in said)


@pytest.mark.parametrize(
    "kinds", [("angle", "rate"), ("increment", "rate"), ("angle", "increment")]
)
def test_gyros_of_unlike_kinds_on_one_table_are_sound(kinds):
    """A rate was called a copy of an angle one sample later, and a hundred times as loud."""
    random, rate = np.random.default_rng(4), 100.0
    time, units = np.arange(60_001) / rate, {"rate": "deg/s"}
    # Gears and a servo move the table by more than the gyros' noise from sample to sample.
    table = 40.0 * time + 0.002 * np.sin(26.0 * time) + 0.001 * np.sin(5.0 * time)
    gyros = {}
    for name, kind, share in zip("xz", kinds, (0.577, 0.575), strict=True):
        angle = share * table + np.cumsum(5e-6 * random.normal(size=time.size))
        turned = np.diff(angle)
        gyros[name] = {"angle": angle[1:], "rate": turned * rate, "increment": turned}[kind]
    recording = Recording.from_arrays(
        **gyros,
        table=table[1:],
        kind=dict(zip("xz", kinds, strict=True)),
        unit={name: units.get(kind, "deg") for name, kind in zip("xz", kinds, strict=True)},
        sample_rate=rate,
    )
    assert not [note for note in check(recording) if note.name in {"copy", "units"}]


@pytest.mark.parametrize(("shaking", "copied"), [(7.0, 0.0), (0.05, 0.3)])
def test_a_table_that_shakes_is_no_copy_though_one_gyro_has_it_late(shaking, copied):
    """Of channels that are sampled by turns on such a table, N was refused."""
    random = np.random.default_rng(5)
    shakes = butter(2, [0.5, 8.0], btype="bandpass", fs=100.0, output="sos")
    table = 30.0 + shaking * sosfilt(shakes, random.normal(size=30_001))
    x, z = 0.05 * random.normal(size=(2, 30_001))
    recording = Recording.from_arrays(
        x=table[1:] + x[1:],
        # The noise of a copy comes late, and the table at once.
        z=table[1:] + copied * x[:-1] + z[1:] if copied else table[:-1] + z[1:],
        table=np.cumsum(table[1:]) / 100.0,
        kind="rate",
        unit="deg/s",
        sample_rate=100.0,
    )
    said = {note.name for note in check(recording) if note.level != "remark"}
    assert said == ({"copy"} if copied else set())


def interpolated(values: np.ndarray, times: int) -> np.ndarray:
    """Straight lines between samples."""
    return np.interp(np.arange(times * values.size) / times, np.arange(values.size), values)


@pytest.mark.parametrize("filled", [np.repeat, interpolated])
@pytest.mark.parametrize("late", [0, 50])
def test_gyros_that_are_logged_faster_than_they_measure_are_no_copies_by_chance(filled, late):
    """Held for ten samples each, independent gyros were said to repeat each other."""
    for seed in range(4):
        x, z, more = np.random.default_rng(seed).normal(size=(3, 4000))
        x, z = (filled(one, 10) for one in (x, z))
        z = np.roll(x, late) + 0.3 * filled(more, 10) if late else z
        recording = Recording.from_arrays(x=x, z=z, kind="rate", unit="deg/h", sample_rate=1000.0)
        assert any(note.name == "copy" for note in check(recording)) == bool(late)


@pytest.mark.parametrize(("unit", "said"), [("deg/s", set()), ("rad/s", {"units"})])
def test_spikes_of_one_gyro_put_no_unit_of_the_others_in_doubt(unit, said):
    """They were "447 times below" a gyro of which 500 samples in 60 000 stood at full scale."""
    random = np.random.default_rng(6)
    gyros = 0.03 * random.normal(size=(2, 60_000))
    gyros[1, random.choice(60_000, 500, replace=False)] = 250.0
    units = {"x": "deg/s", "z": unit}
    recording = Recording.from_arrays(
        x=gyros[0], z=gyros[1], kind="rate", unit=units, sample_rate=100.0
    )
    assert {n.name for n in check(recording) if n.channel == "x" and n.level != "remark"} == said


@pytest.mark.parametrize("copied", [False, True])
def test_a_gyro_behind_a_filter_is_no_copy_of_two_that_are_unlike(copied):
    """It was said to repeat both, one sample later, where all sense a table that hunts."""
    random = np.random.default_rng(7)
    x, y, z = 1e-4 * random.normal(size=(3, 40_001))
    hunting = 0.05 * random.normal(size=40_001)
    rate = 40.0 + (0.0 if copied else hunting)
    first = butter(1, 8.0, fs=100.0, output="sos")
    recording = Recording.from_arrays(
        x=(rate + x)[1:],
        y=(rate + x)[:-1] if copied else sosfilt(first, rate + y)[1:],
        z=(rate + z)[1:],
        table=np.cumsum(40.0 + hunting)[1:] / 100.0,
        kind="rate",
        unit="deg/s",
        sample_rate=100.0,
    )
    notes = [note.channel for note in check(recording) if note.name == "copy"]
    assert notes == (["y"] if copied else [])
