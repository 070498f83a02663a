"""Numbers and times as instruments write them."""

import datetime

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sagnac.formats import read
from sagnac.formats.text import (
    STYLES,
    NumberStyle,
    form_of,
    is_in_doubt,
    nanoseconds,
    past_midnight,
    style_of,
)


@pytest.mark.parametrize(
    ("text", "decimal", "thousands", "value"),
    [
        ("-1.5e-3", ".", "", -1.5e-3),
        ("1.234.567,25", ",", ".", 1234567.25),
        ("1,234.5", ".", ",", 1234.5),
        ("1'234.5", ".", "'", 1234.5),
        ("12\u00a0345,5", ",", "\u00a0", 12345.5),
        (",5", ",", "", 0.5),
        ("n/a", ".", "", float("nan")),
    ],
)
def test_numbers(text, decimal, thousands, value):
    style = NumberStyle(decimal=decimal, thousands=thousands)
    np.testing.assert_equal(style.value(text), value)
    if text != "n/a":
        assert style_of([text, text]) == style


def test_a_number_below_one_shows_that_a_comma_stands_before_decimals():
    """Beside stamps with a point "0,512" was 512, and N a thousand times too large."""
    assert not NumberStyle(thousands=",").holds("0,512")
    assert style_of(["0.01", "5,209", "-9,273", "-0,512", "3,996"]).decimal == ","
    assert style_of(["0.01", "5,209", "-9,273", "3,996"]).thousands == ","


@pytest.mark.parametrize("text", ["1,2,3", "1.2.3", "12.34,5", "stop", "1e", "0x1", "--1"])
def test_what_is_no_number(text):
    assert not any(style.holds(text) for style in STYLES)
    with pytest.raises(ValueError, match="is not a number"):
        NumberStyle().value(text)


def test_doubt():
    assert is_in_doubt(["1,234", "12,345", "7"])
    assert not is_in_doubt(["1,234", "1,2345"])
    assert not is_in_doubt(["0,234"])
    assert not is_in_doubt(["1.5"])


MOMENTS = st.datetimes(datetime.datetime(1970, 1, 2), datetime.datetime(2100, 1, 1))


@settings(max_examples=60, deadline=None)
@given(
    MOMENTS, st.sampled_from(["%Y-%m-%dT%H:%M:%S.%f", "%d.%m.%Y %H:%M:%S,%f", "%m/%d/%Y %H:%M:%S"])
)
def test_dates_are_those_of_the_standard_library(moment, form):
    text = moment.strftime(form)
    assert form_of(text) == "iso"
    written = datetime.datetime.strptime(text, form)
    expected = (written - datetime.datetime(1970, 1, 1)) // datetime.timedelta(microseconds=1)
    assert nanoseconds(pa.array([text]), "iso").tolist() == [1000 * expected]


@pytest.mark.parametrize("form", ["%d/%m/%Y %H:%M:%S.%f", "%m/%d/%Y %H:%M:%S.%f"])
@pytest.mark.parametrize("date", [(2024, 3, 5), (2024, 2, 29), (2023, 12, 31), (2024, 10, 12)])
def test_dates_with_strokes_go_on_past_midnight_whichever_number_is_the_day(tmp_path, date, form):
    start = datetime.datetime(*date, 23, 59, 55)
    steps = [datetime.timedelta(milliseconds=10 * n) for n in range(1000)]
    rows = (f"{(start + step).strftime(form)},{n % 7}\n" for n, step in enumerate(steps))
    path = tmp_path / "run.csv"
    path.write_text("t,x\n" + "".join(rows), encoding="utf-8")
    recording = read(path, kind="rate", unit="deg/s", time="t")
    assert (recording.samples, recording.sample_rate) == (1000, pytest.approx(100.0))


def test_zones():
    texts = pa.array(["2024-03-05T14:03:00Z", "2024-03-05T14:03:00+01:30", "2024-03-05 14:03:00"])
    zulu, east, plain = nanoseconds(texts, "iso")
    assert zulu == plain == 1_709_647_380 * 10**9
    assert zulu - east == 5400 * 10**9


def test_times_of_the_clock():
    texts = ["14:03:00.002", "2:03:01,5 PM", "12:00:00 am", "12:30 p.m.", "00:00:00.123456789"]
    assert all(form_of(text) == "clock" for text in texts)
    found = nanoseconds(pa.array(texts), "clock")
    assert found.tolist() == [50_580_002_000_000, 50_581_500_000_000, 0, 45_000 * 10**9, 123456789]
    assert form_of("25.3") is form_of("14:61:00") is None
    with pytest.raises(ValueError, match="cannot be read"):
        nanoseconds(pa.array(["14:03:00", "x"]), "clock")


def test_days_go_on_past_midnight():
    seconds = np.arange(0, 4 * 86_400, 997)
    clock = (seconds % 86_400) * 10**9
    np.testing.assert_array_equal(past_midnight(clock), seconds * 10**9)
