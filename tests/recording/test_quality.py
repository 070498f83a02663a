"""Checks of the data, against recordings whose fault is known because it was put in."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sagnac import series
from sagnac.errors import RecordingError
from sagnac.recording.following import require_encoder_follows
from sagnac.recording.gaps import longest_whole_stretch, with_gaps_marked
from sagnac.recording.kinds import angle_of, unwrapped
from sagnac.recording.model import Channel, Recording
from sagnac.recording.quality import check, integrity
from sagnac.recording.stamps import median_step

DEGREE = np.pi / 180.0
RATE = 100.0
SAMPLES = 20_000


def noise(scale: float, seed: int = 0) -> np.ndarray:
    return scale * np.random.default_rng(seed).normal(size=SAMPLES)


def rate_gyro(values: np.ndarray, name: str = "x") -> Channel:
    return Channel(name=name, kind="rate", shown_in="deg/s", values=values * DEGREE)


def turning(rate: np.ndarray, share: float, seed: int = 0) -> Recording:
    """A gyro that senses `share` of `rate` (deg/s), and the encoder that went with it."""
    table = np.cumsum(rate) / RATE * DEGREE
    return Recording(
        gyros=(rate_gyro(share * rate + noise(0.05, seed)),),
        sample_rate=RATE,
        table=Channel(name="table", kind="angle", shown_in="deg", values=table),
    )


def with_table(recording: Recording, values: np.ndarray) -> Recording:
    table = Channel(name="table", kind="angle", shown_in="deg", values=values)
    return Recording(gyros=recording.gyros, sample_rate=RATE, table=table)


def levels(recording: Recording) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {"error": [], "warning": [], "remark": []}
    for finding in check(recording):
        assert "\n" not in str(finding)
        found[finding.level].append(str(finding))
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
    assert "table" in caught.value.line(lambda name, value: f"<{name}>").split(";")[1]


def test_a_unit_that_makes_the_gyro_outrun_its_table_is_refused():
    recording = turning(STEADY, 0.577 * 60.0)
    with pytest.raises(RecordingError, match=r"34\.6 times as fast as the table"):
        require_encoder_follows(recording, recording.gyros[0])


def test_a_gyro_across_the_axis_or_in_the_wrong_unit_is_warned_of():
    found = levels(turning(STEADY, 0.577 / 3600.0))
    assert any("across the axis" in line for line in found["warning"])
    assert any(
        "0.5770 of the table rate" in line for line in levels(turning(STEADY, 0.577))["remark"]
    )


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


@pytest.mark.parametrize("step", [0.3, 1.0, 5.0, 20.0])
@pytest.mark.parametrize("kind", ["angle", "increment"])
def test_a_quiet_quantized_gyro_is_not_stuck(step, kind):
    for seed in range(5):
        angle = np.cumsum(noise(0.05, seed)) + 0.002 * np.arange(SAMPLES)
        counts = np.rint(angle / step)
        values = counts if kind == "angle" else np.diff(counts, prepend=0.0)
        gyro = Channel(name="x", kind=kind, shown_in="arcsec", values=values * 1e-6)
        recording = Recording(gyros=(gyro,), sample_rate=RATE)
        assert not [finding for finding in integrity(recording) if "stuck" in str(finding)]


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


@pytest.mark.parametrize(("missing", "level"), [(1, "remark"), (3, "remark"), (5, "error")])
def test_a_gap_is_more_than_five_steps(missing, level):
    times = np.delete(SECONDS, slice(100, 100 + missing))
    gyro = rate_gyro(noise(0.05)[: times.size])
    findings = integrity(Recording(gyros=(gyro,), sample_rate=RATE, times=times))
    assert [finding.level for finding in findings] == [level]
    assert findings[0].channel == "time"


def test_angle_of_keeps_the_noise_of_a_fast_table():
    increments = noise(1e-9) + 1.0
    gyro = Channel(name="x", kind="increment", values=increments)
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


# --- recordings longer than memory should hold ------------------------------------------------


def faulty() -> dict[str, Recording]:
    """Good and bad recordings whose faults lie on and across the borders of spans."""
    size = 3000
    random = np.random.default_rng(12)
    white = random.normal(size=size)
    seconds = np.arange(size) / RATE

    def still(values, kind="rate", times=None, unit=1e-3):
        gyro = Channel(name="x", kind=kind, values=unit * values)
        return Recording(gyros=(gyro,), sample_rate=RATE, times=times)

    def turned(rate, table_rate):
        gyro = rate_gyro(0.577 * rate + 0.05 * white)
        table = np.cumsum(table_rate) / RATE * DEGREE
        channel = Channel(name="table", kind="angle", shown_in="deg", values=table)
        return Recording(gyros=(gyro,), sample_rate=RATE, table=channel)

    def changed(values, *changes):
        values = values.copy()
        for place, value in changes:
            values[place] = value
        return values

    steady = np.full(size, 40.0)
    late = seconds + 0.2 / RATE * random.uniform(-1.0, 1.0, size)
    there = np.ones(size, dtype=bool)
    there[970:1015] = there[2000:2007] = False
    nan = np.nan
    return {
        "sound": still(white),
        "sound increments": still(white, kind="increment"),
        "sound angle": still(np.cumsum(white), kind="angle"),
        "turning": turned(steady, steady),
        "reversing": turned(steady * np.sign(np.sin(seconds)), steady * np.sign(np.sin(seconds))),
        "at rest": turned(0.0 * steady, 0.0 * steady),
        "another's encoder": turned(steady, 30.0 * np.sin(seconds)),
        "too fast": turned(60.0 * steady, steady),
        "missing": still(changed(white, (slice(96, 98), nan), (1000, nan), (2999, nan))),
        "mostly missing": still(changed(white, (slice(40, 2960), nan))),
        "infinite": still(changed(white, (999, np.inf))),
        "stuck across borders": still(changed(white, (slice(90, 1110), 0.5))),
        "stuck twice": still(changed(white, (slice(0, 300), 0.5), (slice(1000, 1300), 0.2))),
        "stuck to the end": still(changed(white, (slice(2500, None), 0.5))),
        "stuck throughout": still(0.0 * white),
        "quantized": still(np.rint(0.3 * np.cumsum(white)), kind="angle"),
        "quantized and stuck": still(changed(np.rint(3.0 * white), (slice(997, 1597), 2.0))),
        "jumps": still(changed(white, (slice(97, None), 900.0), (slice(1000, None), 0.0))),
        "saturated": still(np.clip(white, -1.5, 1.2)),
        "few levels": still(np.clip(np.rint(white), -1.0, 1.0)),
        "too quiet": still(white, unit=1e-19),
        "uneven stamps": still(white, times=late),
        "late stamps": still(white, times=changed(late, (slice(97, None), late[97:] + 0.02))),
        "repeated stamps": still(white, times=changed(late, (97, late[96]), (1000, late[999]))),
        "gaps": still(white[there], times=late[there]),
        "gap far too long": still(white, times=changed(late, (slice(97, None), late[97:] + 1e5))),
        "backwards": still(white, times=changed(late, (97, late[95]), (1000, late[998]))),
        "no stamp": still(white, times=changed(late, (slice(97, 99), nan))),
        "coarse clock": still(white, times=np.floor(seconds * 20.0) / 20.0),
    }


def mapped(recording: Recording) -> Recording:
    def moved(values):
        moved = series.empty(values.size)
        moved[:] = values
        assert series.is_mapped(moved)
        return moved

    def channel(one):
        return replace(one, values=moved(one.values))

    return replace(
        recording,
        gyros=tuple(channel(gyro) for gyro in recording.gyros),
        table=None if recording.table is None else channel(recording.table),
        times=None if recording.times is None else moved(recording.times),
    )


def outcome(work, *arguments):
    try:
        return work(*arguments)
    except RecordingError as error:
        return str(error)


@pytest.mark.parametrize("length", [97, 1000, 2999])
@pytest.mark.parametrize("name", faulty())
def test_findings_and_values_are_the_same_span_by_span(monkeypatch, name, length):
    recording = faulty()[name]
    gyro = recording.gyros[0]
    found = check(recording)
    follows = outcome(require_encoder_follows, recording, gyro)
    marked = outcome(with_gaps_marked, recording)
    stretch, start = longest_whole_stretch(recording, "x")
    sound = bool(np.isfinite(gyro.values).all())
    angle = angle_of(gyro, RATE) if sound else None

    monkeypatch.setattr(series, "IN_MEMORY", 0)
    monkeypatch.setattr(series, "SPAN", length)
    long = mapped(recording)
    assert check(long) == found
    assert outcome(require_encoder_follows, long, long.gyros[0]) == follows
    marked_long = outcome(with_gaps_marked, long)
    if isinstance(marked, str):
        assert marked_long == marked
    else:
        assert marked_long.notes == marked.notes
        assert marked_long.sample_rate == pytest.approx(marked.sample_rate, rel=1e-14)
        assert np.array_equal(marked_long.gyros[0].values, marked.gyros[0].values, equal_nan=True)
    stretch_long, start_long = longest_whole_stretch(long, "x")
    assert start_long == start
    assert np.array_equal(stretch_long.gyros[0].values, stretch.gyros[0].values)
    if stretch.times is not None:
        assert np.array_equal(stretch_long.times, stretch.times, equal_nan=True)
    if angle is not None:
        rounding = 1e-13 * np.abs(gyro.values).max()
        assert angle_of(long.gyros[0], RATE) == pytest.approx(angle, rel=1e-12, abs=rounding)


def test_a_fault_of_every_kind_is_among_the_recordings():
    messages = " ".join(str(finding) for one in faulty().values() for finding in check(one))
    for words in (
        "NaN or infinite",
        "stuck at one value",
        "every sample is the same",
        "jump",
        "saturated",
        "does not follow",
        "times as fast",
        "does not turn",
        "looks wrong",
        "gap",
        "backwards",
        "repeated stamp",
        "interval",
        "clock is too coarse",
    ):
        assert words in messages, words


@pytest.mark.parametrize("length", [1, 7, 100, 998, 999, 5000])
def test_wraps_are_found_across_the_borders_of_spans(monkeypatch, length):
    angle = np.cumsum(np.random.default_rng(3).uniform(-170.0, 170.0, 1000))
    reading = angle % 360.0
    reading[[99, 500]] = np.nan
    whole, wraps = unwrapped(reading, 360.0)
    monkeypatch.setattr(series, "IN_MEMORY", 0)
    monkeypatch.setattr(series, "SPAN", length)
    values, count = unwrapped(reading, 360.0)
    assert count == wraps > 100
    assert np.array_equal(values, whole, equal_nan=True)
    naive = np.unwrap((angle % 360.0)[:99], period=360.0)
    np.testing.assert_allclose(values[:99], naive, atol=1e-9)
    assert unwrapped(angle[:3] * 0.1, 360.0)[1] == 0


@pytest.mark.parametrize("size", [2, 3, 1000, 1001])
@pytest.mark.parametrize("repeats", [True, False])
def test_the_median_interval_is_exact_span_by_span(monkeypatch, size, repeats):
    random = np.random.default_rng(size)
    for stamps in (
        np.cumsum(random.exponential(size=size)),
        np.floor(np.arange(size) * 1.3) * 0.001,
        np.cumsum(
            random.choice([-0.5, 0.0, 0.01, np.nan, 1e300], p=[0.1, 0.3, 0.4, 0.1, 0.1])
            * np.ones(size)
        ),
        np.zeros(size),
    ):
        with np.errstate(invalid="ignore", over="ignore"):
            steps = np.diff(stamps)
            kept = steps[np.isfinite(steps) & (steps >= 0.0 if repeats else steps > 0.0)]
            expected = float(np.median(kept)) if kept.size else np.nan
            with monkeypatch.context() as patch:
                patch.setattr(series, "IN_MEMORY", 0)
                patch.setattr(series, "SPAN", 97)
                long = series.empty(size)
                long[:] = stamps
                found = median_step(long, repeats=repeats)
            assert median_step(stamps, repeats=repeats) == pytest.approx(expected, nan_ok=True)
        assert found == expected or (np.isnan(found) and np.isnan(expected))
