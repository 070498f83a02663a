"""Columns taken as channels, stamps and pulses."""

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.recording.columns import gyro_of, pulses_of, seconds_of
from sagnac.recording.model import Recording


def test_integer_stamps_lose_nothing_by_the_size_of_the_epoch():
    origin = 1_700_000_000_000_000_000
    stamps = origin + np.arange(5) * 333
    assert seconds_of(stamps, unit="ns") == pytest.approx(np.arange(5) * 333e-9, rel=1e-15)


def test_dates_state_their_own_unit():
    dates = np.datetime64("2024-05-01") + np.arange(3) * np.timedelta64(250, "ms")
    np.testing.assert_array_equal(seconds_of(dates, unit="h"), [0.0, 0.25, 0.5])
    np.testing.assert_array_equal(seconds_of(dates - dates[0], unit="h"), [0.0, 0.25, 0.5])


def test_a_table_is_unwrapped_and_its_column_left_alone():
    column = np.array([359.0, 359.5, 0.0, 0.5])
    taken = Recording.from_arrays(
        x=np.zeros(4), kind="rate", unit="deg/s", sample_rate=1.0, table=column
    )
    assert np.degrees(taken.table.values) == pytest.approx([359.0, 359.5, 360.0, 360.5])
    assert column[2] == 0.0
    assert str(taken.notes[0]) == "table: unwrapped where it starts over, 1 time"


@pytest.mark.parametrize("period", [0.0, -1.0, np.nan, np.inf])
def test_a_period_is_above_zero(period):
    with pytest.raises(ValueError, match="give the reading at which the counter starts over"):
        gyro_of("x", [1.0], kind="angle", unit="deg", period=period)


@pytest.mark.parametrize("column", [[False, True, True, False, True], [0, 5, 5, 0, 5]])
def test_the_first_sample_of_each_pulse_is_taken(column):
    rising, notes = pulses_of(column)
    assert rising.tolist() == [False, True, False, False, True]
    assert "stays up" in notes[0].text
    assert pulses_of([0, 1, 0])[1] == ()


@pytest.mark.parametrize("column", [[0, 1, 2], [0.0, np.nan, 1.0]])
def test_pulses_have_two_levels(column):
    with pytest.raises(RecordingError, match="null_pulse: takes more than two values"):
        pulses_of(column)
    with pytest.raises(RecordingError, match="null_pulse: column p takes more than two values"):
        pulses_of(column, column="p")


@pytest.mark.parametrize("zone", [None, "UTC", "Europe/Berlin"])
@pytest.mark.parametrize(
    "taken",
    [
        lambda index: index,
        lambda index: index.as_unit("ns"),
        lambda index: index.to_series(),
        lambda index: np.asarray(index.to_series(), dtype=object),
        lambda index: list(index.to_pydatetime()),
    ],
    ids=["index", "in ns", "column", "objects", "list"],
)
def test_dates_are_the_time_whatever_holds_them_and_whatever_their_zone(taken, zone):
    pandas = pytest.importorskip("pandas")
    x = np.random.default_rng(1).standard_normal(50)
    index = pandas.date_range("2026-01-01", periods=x.size, freq="100ms", tz=zone)
    times = taken(index)
    recording = Recording.from_arrays(x=x, kind="rate", unit="deg/h", times=times)
    assert recording.sample_rate == pytest.approx(10.0)
    frame = pandas.DataFrame({"x": x}, index=index)
    by_index = Recording.from_frame(frame, kind="rate", unit="deg/h")
    assert by_index.sample_rate == pytest.approx(10.0)
    with pytest.raises(ValueError, match="x holds"):
        Recording.from_arrays(x=times, kind="rate", unit="deg/h", sample_rate=10.0)
