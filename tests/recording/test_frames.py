"""Frames of pandas and xarray, and dictionaries of columns, as recordings."""

import numpy as np
import pytest

from sagnac.recording.model import Recording

RATE = 50.0
SECONDS = np.arange(40) / RATE
X = np.sin(np.arange(40.0))


def test_columns_are_found_by_name_with_the_units_of_their_headers():
    frame = {"t[ms]": 1e3 * SECONDS, "x[deg/s]": X, "z[deg/h]": X, "encoder[arcsec]": X, "note": X}
    made = Recording.from_frame(frame, kind="rate")
    assert [(gyro.name, gyro.shown_in) for gyro in made.gyros] == [("x", "deg/s"), ("z", "deg/h")]
    assert made.gyro("x").values == pytest.approx(np.radians(X))
    assert made.table.values == pytest.approx(np.radians(X / 3600.0))
    assert made.sample_rate == RATE


def test_columns_are_taken_by_the_names_stated():
    frame = {"gx": X, "gz": 2.0 * X, "enc": X, "stamp": SECONDS, "index": np.arange(40) == 3}
    columns = {"x": "gx", "up": "gz", "table": "enc", "time": "stamp", "null_pulse": "index"}
    made = Recording.from_frame(frame, columns, kind="rate", unit="deg/s", table_unit="rad")
    assert [gyro.name for gyro in made.gyros] == ["x", "up"]
    assert made.table.values == pytest.approx(X)
    assert np.flatnonzero(made.null_pulse).tolist() == [3]


@pytest.mark.parametrize(
    ("frame", "arguments", "words"),
    [
        ({"a": X}, {}, r"the frame has no gyro; it has a: name one with columns=\{'x': NAME\}"),
        ({"x": X}, {}, "the unit of gyro x is not stated"),
        ({"x[deg/s]": X}, {"kind": None}, "kind is not stated"),
        ({"x[deg/s]": X}, {}, r"neither sample_rate nor times is given.*columns="),
        ({"a": X}, {"columns": {"x": "b"}}, r"columns\['x'\] is 'b'; the frame has a"),
        ({"x": X}, {"columns": ["x"]}, r"columns is \['x'\]; give \{'x': NAME\}"),
        ({"x": X, "x[deg]": X}, {}, r"x, x\[deg\] may each be x; name one with columns"),
        ({"x": X}, {"unit": {"z": "deg"}}, "the unit of gyro x is not stated, only that of z"),
    ],
)
def test_frames_that_make_no_recording_are_refused(frame, arguments, words):
    with pytest.raises((TypeError, ValueError), match=words) as caught:
        Recording.from_frame(frame, **{"kind": "rate", **arguments})
    assert "\n" not in str(caught.value)


def test_a_frame_made_of_an_array_has_numbers_for_names():
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(np.column_stack([X, 2.0 * X]))
    stated = {"kind": "rate", "unit": "rad/s", "sample_rate": RATE}
    for columns in ({"x": 0, "z": 1}, {"x": "0", "z": "1"}):
        made = Recording.from_frame(frame, columns, **stated)
        assert [gyro.name for gyro in made.gyros] == ["x", "z"]
        np.testing.assert_array_equal(made.gyro("z").values, 2.0 * X)
    # A column is taken by its own name before that of another whose text is the same.
    both = Recording.from_frame({0: X, "0": 2.0 * X}, {"x": 0, "z": "0"}, **stated)
    np.testing.assert_array_equal(both.gyro("x").values, X)
    np.testing.assert_array_equal(both.gyro("z").values, 2.0 * X)
    with pytest.raises(ValueError, match=r"columns\['x'\] is 2; the frame has 0, 1"):
        Recording.from_frame(frame, {"x": 2}, **stated)


def test_the_dates_of_an_index_are_the_time():
    pandas = pytest.importorskip("pandas")
    index = pandas.date_range("2024-05-01", periods=40, freq="20ms")
    frame = pandas.DataFrame({"x": X}, index=index)
    assert Recording.from_frame(frame, kind="rate", unit="deg/s").sample_rate == RATE
    stated = Recording.from_frame(frame, kind="rate", unit="deg/s", sample_rate=10.0)
    assert stated.sample_rate == 10.0
    (note,) = stated.notes
    assert (note.level, note.channel) == ("warning", "time")
    assert "make 50 Hz" in note.text
    # Dates that bear the rate out say nothing, be they coarse or with a gap.
    for dates in (index, index.floor("1s"), index[:20].append(index[20:] + pandas.Timedelta("9s"))):
        agrees = Recording.from_frame(
            frame.set_index(dates), kind="rate", unit="deg/s", sample_rate=RATE
        )
        assert (agrees.sample_rate, agrees.notes) == (RATE, ())
    series = frame["x"].astype("Float64")
    series.iloc[3] = pandas.NA
    made = Recording.from_arrays(x=series, kind="rate", unit="deg/s", sample_rate=RATE)
    assert np.flatnonzero(np.isnan(made.gyros[0].values)).tolist() == [3]


def test_a_dataset_of_xarray_is_taken():
    xarray = pytest.importorskip("xarray")
    data = xarray.Dataset(
        {"x": ("time", X), "table": ("time", X)}, coords={"time": SECONDS}, attrs={"kind": "rate"}
    )
    made = Recording.from_frame(data, unit="deg/s")
    assert made.sample_rate == RATE
    assert made.gyros[0].values == pytest.approx(np.radians(X))
    assert made.table is not None


@pytest.mark.parametrize("name", ["time", "t"])
def test_the_coordinate_of_xarray_is_the_time_of_columns_that_are_stated(name):
    """Without a rate it was refused, though dates of an index and unnamed columns were taken."""
    xarray = pytest.importorskip("xarray")
    dates = np.datetime64("2024-05-01", "ms") + np.arange(40) * np.timedelta64(20, "ms")
    for stamps in (SECONDS, dates):
        data = xarray.Dataset({"gx": (name, X)}, coords={name: stamps})
        made = Recording.from_frame(data, {"x": "gx"}, kind="rate", unit="deg/s")
        assert (made.sample_rate, made.samples) == (RATE, 40)


def test_a_rate_or_a_column_of_time_counts_before_a_coordinate():
    xarray = pytest.importorskip("xarray")
    data = xarray.Dataset(
        {"gx": ("time", X), "clock": ("time", 2.0 * SECONDS)}, coords={"time": SECONDS}
    )
    how = {"kind": "rate", "unit": "deg/s"}
    assert Recording.from_frame(data, {"x": "gx"}, sample_rate=10.0, **how).sample_rate == 10.0
    made = Recording.from_frame(data, {"x": "gx", "time": "clock"}, **how)
    assert made.sample_rate == 0.5 * RATE
    # Other coordinates are no time.
    other = data.rename(time="place")
    with pytest.raises(ValueError, match="neither sample_rate nor times is given"):
        Recording.from_frame(other, {"x": "gx"}, **how)
