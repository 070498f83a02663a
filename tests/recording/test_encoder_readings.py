"""Missing encoder samples, against the angle that was there before they went missing."""

import math

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.formats import Statement, read
from sagnac.quality.encoder import require_encoder_follows
from sagnac.recording.encoder_readings import fill_missing, mark_missing, table_of_readings
from sagnac.recording.model import Channel, Recording

ARCSECOND = math.pi / 648_000
RATE = 500.0
SAMPLES = 30_000
STEP = 0.18 / 3600.0  # of the encoder, deg
ACCURACY = 10.0 / 3600.0  # deg


def motion(rate: float, *, reversing: bool = False, start: float = 350.0) -> np.ndarray:
    """Table angle in deg: ripple at 12 a turn, jitter at 8 Hz, at some mean rate in deg/s."""
    time = np.arange(SAMPLES) / RATE
    if reversing:
        # Turns round within 0.8 s every 8 s: 100 deg/s^2.
        angle = np.cumsum(rate * np.clip(5.0 * np.sin(2.0 * np.pi * time / 16.0), -1.0, 1.0)) / RATE
    else:
        angle = rate * time
    angle += 5e-4 / 12.0 * np.degrees(np.sin(12.0 * np.radians(angle)))
    return start + angle + 8e-5 * np.sin(2.0 * np.pi * 8.0 * time)


def reading(angle: np.ndarray) -> np.ndarray:
    return np.mod(np.rint(angle / STEP), round(360.0 / STEP)) * STEP


def off_by(values: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Difference from the truth by the shorter way round, arcsec."""
    return 3600.0 * np.abs(np.remainder(values - angle + 180.0, 360.0) - 180.0)


def spoiled(values: np.ndarray, places: np.ndarray, how: str) -> np.ndarray:
    values = values.copy()
    if how == "held":
        for place in places:
            values[place] = values[place - 1]
    else:
        values[places] = {"nan": np.nan, "zero": 0.0, "minus one": -1.0, "999": 999.0}[how]
    return values


def places(share: float, seed: int = 1) -> np.ndarray:
    chosen = np.flatnonzero(np.random.default_rng(seed).random(SAMPLES) < share)
    return chosen[(chosen > 4) & (chosen < SAMPLES - 5)]


@pytest.mark.parametrize("rate", [-80.0, -10.0, 1.0, 40.0])
@pytest.mark.parametrize("how", ["nan", "zero", "minus one", "999", "held"])
def test_a_thousandth_missing_is_as_good_as_read(rate, how):
    angle = motion(rate)
    gone = places(1e-3)
    values = spoiled(reading(angle), gone, how)
    off_path, _, held = mark_missing(values, 360.0)
    assert held == (gone.size if how == "held" else 0)
    assert off_path == (0 if how in ("nan", "held") else gone.size)
    samples, _, error = fill_missing(values, 360.0, accuracy=ACCURACY)
    assert samples == gone.size
    # Four readings rounded to half a step, by weights whose sizes add up to 1.25 for one missing
    # sample and to some 2 for two; the table itself is met far better than that.
    assert off_by(values, angle).max() < 2.0 * 0.5 * 0.18 + 0.01
    assert 3600.0 * error < 0.25


def test_lost_readings_beside_held_ones_are_interpolated():
    """A bus that loses readings writes NaN, or gives the last one that it has, by turns."""
    angle = motion(40.0)
    random = np.random.default_rng(4).random(SAMPLES)
    random[[*range(9), *range(-9, 0)]] = 1.0
    lost, held = random < 0.01, (random >= 0.01) & (random < 0.04)
    there = np.where(lost | held, 0, np.arange(SAMPLES))
    values = np.where(lost, np.nan, reading(angle)[np.maximum.accumulate(there)])
    _, _, marked = mark_missing(values, 360.0)
    assert marked == np.count_nonzero(held)
    samples, _, _ = fill_missing(values, 360.0, accuracy=ACCURACY)
    assert samples == np.count_nonzero(lost | held)
    assert off_by(values, angle).max() < 1.0


def test_repeats_are_found_on_an_even_table_and_not_on_one_at_rest():
    even_table = reading(40.0 * np.arange(SAMPLES) / RATE)
    gone = places(5e-3)
    gone = gone[gone > 100]
    _, _, held = mark_missing(spoiled(even_table, gone, "held"), 360.0)
    assert held == gone.size
    # At rest a reading jitters by a count or so, and most repeat.
    jitter = 0.8 * STEP * np.random.default_rng(4).standard_normal(SAMPLES)
    at_rest = reading(100.0 + jitter)
    slow = reading(100.0 + 0.6 * STEP * np.arange(SAMPLES) + jitter)
    for values in (at_rest, slow):
        _, _, held = mark_missing(values.copy(), 360.0)
        assert held == 0


@pytest.mark.parametrize("period", [360.0, math.inf])
def test_a_hundredth_missing_across_the_wrap_and_turning_round(period):
    angle = motion(40.0, reversing=True)
    values = reading(angle) if period == 360.0 else np.rint(angle / STEP) * STEP
    gone = places(9e-3)
    wraps = 1 + np.flatnonzero(np.abs(np.diff(values)) > 180.0)
    gone = np.union1d(gone, wraps)
    values[gone] = np.nan
    samples, longest, _ = fill_missing(values, period, accuracy=ACCURACY)
    assert samples == gone.size
    assert 2 <= longest <= 4
    # Turning round begins and ends with a jump of the acceleration.
    kink = 100.0 / RATE**2 * 3600.0
    assert off_by(values, angle).max() < 0.4 + kink


def test_harmonics_at_filled_samples_are_below_the_noise_of_a_sample():
    angle = motion(40.0)
    values = spoiled(reading(angle), places(9e-3), "nan")
    fill_missing(values, 360.0, accuracy=ACCURACY)
    phase = np.radians(np.stack([values, angle]))
    walk = 2.5e-5 * 3600.0 / 60.0 * math.sqrt(1.0 / RATE)  # arcsec a sample, at 2.5e-5 deg/sqrt(h)
    for order in (64, 128):
        of_values, of_angle = 0.6 * np.cos(order * phase)
        assert np.abs(of_values - of_angle).max() < 1.5 * walk
        assert np.std(of_values - of_angle) < 0.5 * walk


@pytest.mark.parametrize(("length", "is_filled"), [(4, True), (5, False)])
def test_more_than_four_in_a_row_stay_missing(length, is_filled):
    angle = motion(40.0)
    values = reading(angle)
    values[1000 : 1000 + length] = np.nan
    values[2000] = np.nan
    samples, longest, _ = fill_missing(values, 360.0, accuracy=ACCURACY)
    assert np.isnan(values[1000 : 1000 + length]).all() == (not is_filled)
    assert np.isfinite(values[2000])
    assert longest == (length if is_filled else 1)
    assert samples == 1 + length * is_filled


def test_what_cannot_be_told_stays_missing():
    whole = reading(motion(40.0))
    for spoil in ([0], [1], [SAMPLES - 1], np.arange(100, SAMPLES, 15)):
        values = whole.copy()
        values[spoil] = np.nan
        assert fill_missing(values, 360.0, accuracy=ACCURACY)[0] == 0
        assert np.flatnonzero(np.isnan(values)).tolist() == np.atleast_1d(spoil).tolist()
    values = whole.copy()
    values[[300, 400]] = np.nan, np.inf
    assert fill_missing(values, 360.0, accuracy=ACCURACY)[0] == 0
    # A table that starts at once: by where, between two samples, nobody knows.
    values = np.concatenate([np.zeros(500), np.arange(1.0, 501.0)])
    values[499] = np.nan
    assert fill_missing(values, math.inf, accuracy=ACCURACY)[0] == 0


@pytest.mark.parametrize("rate", [0.05, 1.0, 40.0, 80.0])
@pytest.mark.parametrize("reversing", [False, True])
def test_nothing_is_marked_where_nothing_is_missing(rate, reversing):
    angle = motion(rate, reversing=reversing)
    values = reading(angle)
    before = values.copy()
    assert mark_missing(values, 360.0) == (0, None, 0)
    assert (values == before).all()


def test_a_table_that_moves_in_steps_is_not_taken_for_dropouts():
    # 90 deg in a second, ten seconds at rest, forth and back, ten readings a second.
    move = 45.0 * (1.0 - np.cos(np.pi * np.arange(10) / 10.0))
    cycle = np.concatenate([move, np.full(100, 90.0), 90.0 - move, np.zeros(100)])
    values = np.tile(cycle, 40)
    assert mark_missing(values, 360.0)[0] == 0
    assert np.isfinite(values).all()


def table(values: np.ndarray, gyro: np.ndarray, kind: str = "rate") -> Recording:
    return Recording(
        gyros=(Channel(name="x", kind=kind, values=gyro),),
        sample_rate=RATE,
        table=Channel(name="table", kind="angle", shown_in="deg", values=values),
    )


# --- from a file ------------------------------------------------------------------------------


def file(path, values, gyro):
    rows = "\n".join(f"{a:.9f},{b:.6f}" for a, b in zip(gyro, values, strict=True))
    path.write_text(f"x[deg],table[deg]\n{rows}\n", encoding="utf-8")
    return path


def test_what_was_filled_on_reading_is_said(tmp_path):
    angle = motion(40.0)[:6000]
    gone = np.array([300, 1200, 1201, 4000])
    for how, words in (
        ("nan", ()),
        ("zero", ("4 samples off its path, all reading 0 deg",)),
        ("held", ("4 repeated samples",)),
    ):
        path = file(tmp_path / f"{how}.csv", spoiled(reading(angle), gone, how), 0.6 * angle)
        recording = read(path, Statement(kind="angle", sample_rate=RATE))
        notes = " ".join(map(str, recording.notes))
        for word in (*words, "4 missing samples, at most 2 in a row, interpolated"):
            assert word in notes
        truth = np.radians(angle - angle[0])
        found = recording.table.values - recording.table.values[0]
        assert np.abs(found - truth).max() < 0.5 * ARCSECOND


@pytest.mark.parametrize("how", ["nan", "zero", "held"])
def test_a_long_dropout_is_taken_from_a_gyro_or_refused_with_place_and_remedy(tmp_path, how):
    angle = motion(40.0)[:6000]
    gone = np.arange(2000, 2030)
    statement = Statement(kind="angle", sample_rate=RATE)

    def taken(share):
        path = file(tmp_path / "run.csv", spoiled(reading(angle), gone, how), share * angle)
        recording = read(path, statement)
        require_encoder_follows(recording, recording.gyros[0])
        return recording

    if how != "zero":
        recording = taken(0.6)
        assert np.degrees(recording.table.values) == pytest.approx(angle, abs=STEP)
        (note,) = (note for note in recording.notes if note.level == "warning")
        assert "lost at 1 place" in note.text
        assert "the first at 4.00" in note.text

    # Across the axis a gyro tells nothing of it, and what leaves the path for long may be a motion.
    with pytest.raises(RecordingError) as caught:
        taken(0.6 if how == "zero" else 1e-4)
    message = str(caught.value)
    assert "\n" not in message
    for word in ("run.csv", "table:", "4.0", "span=(4.0"):
        assert word in message


# --- the angle of a table ---------------------------------------------------------------------


def test_a_table_that_may_have_gone_either_way_is_warned_of():
    taken = table_of_readings(np.mod(100.0 * np.arange(50.0), 360.0), "deg")
    assert taken.notes[-1].level == "warning"
    assert "moves by up to 0.28 of its range between samples" in taken.notes[-1].text


@pytest.mark.parametrize(("lost", "longest"), [((), 0), ((40, 300, 301, 800), 2)])
def test_of_readings_that_are_held_lost_ones_are_interpolated(lost, longest):
    """An encoder read 25 times a second, on a table that turns by 1.6 deg meanwhile."""
    held = 20
    angle = motion(40.0)
    ticks = np.arange(0, SAMPLES, held)
    for tick in lost:
        ticks[tick] = ticks[tick - 1]
    values = np.repeat(reading(angle)[ticks], held)
    taken = table_of_readings(values, "deg")
    inside = slice(held, SAMPLES - held)
    # The clock is known to half a sample, 0.04 deg.
    assert np.degrees(taken.channel.values)[inside] == pytest.approx(angle[inside], abs=0.1)
    texts = [note.text for note in taken.notes]
    assert texts[-1].startswith("read every 20 samples and held between")
    assert (f"at most {longest} in a row" in " ".join(texts)) == bool(lost)
