"""Text with delimiters: headers, marks, and files cut off."""

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.formats import Statement, columns, read
from sagnac.formats.csv import check_last
from tests.formats.examples import SAMPLES, refused, save, text, timed, walk


def test_csv_cut_off_and_with_text_in_it(tmp_path):
    ramp = 1e4 + 7.0 * np.arange(SAMPLES) + 0.1 * walk()
    whole = timed(tmp_path / "run.csv", ramp).read_text()
    last = whole.rindex(",")
    refused(save(tmp_path / "row.csv", whole[:last]), "cut off")
    refused(save(tmp_path / "number.csv", whole[: last + 3]), "x[arcsec]", "cut off")
    unended = read(save(tmp_path / "unended.csv", whole[:-1]), Statement(kind="angle"))
    assert any("no line end" in str(note) for note in unended.notes)
    refused(save(tmp_path / "word.csv", whole.replace("0.05,", "0.05,stop")), "stop")


def test_a_wrong_line_is_named_with_its_value(tmp_path):
    rows = [f"{0.01 * n:.2f},{n % 7}" for n in range(SAMPLES)]
    rows[40] = "0.40,stop"
    path = save(tmp_path / "word.csv", "\n".join(["time[s],x[deg]", *rows]) + "\n")
    refused(path, "x[deg]", "line 42", "'stop' is not a number", "correct or remove that line")
    rows[40] = "0.40,1,2"
    path = save(tmp_path / "more.csv", "\n".join(["time[s],x[deg]", *rows]) + "\n")
    refused(path, "line 42 has 3 fields and the first row 2", "'0.40,1,2'")
    rows[40] = "# the door was opened"
    path = save(tmp_path / "door.csv", "\n".join(["time[s],x[deg]", *rows]) + "\n")
    assert read(path, Statement(kind="angle")).samples == SAMPLES - 1


def test_names_that_repeat_are_told_apart_by_number(tmp_path):
    x, other = walk(), walk(1)
    path = save(tmp_path / "twice.csv", text("x[deg],x[deg]", x, other))
    assert columns(path) == ("x[deg] (column 1)", "x[deg] (column 2)")
    refused(path, "more than one column has this name")
    stated = Statement(kind="angle", sample_rate=10.0, columns={"x": "2"})
    np.testing.assert_allclose(np.rad2deg(read(path, stated).gyros[0].values), other, rtol=1e-14)


def test_stamps_of_nineteen_digits_lose_nothing(tmp_path):
    stamps = 1_403_636_579_758_555_392 + 5_000_000 * np.arange(SAMPLES)
    stamps[300:] += 700_000_000
    rows = "\n".join(f"{stamp},{n % 7}" for n, stamp in enumerate(stamps))
    path = save(tmp_path / "run.csv", f"timestamp [ns],x [deg/s]\n{rows}\n")
    recording = read(path, Statement(kind="rate"), verify=False)
    np.testing.assert_allclose(recording.times, (stamps - stamps[0]) * 1e-9, atol=1e-12)


def test_a_last_number_that_leaps_is_cut_short():
    check_last("x", np.array([1.0, 2.0, 3.0, 4.0]))
    with pytest.raises(RecordingError, match="x: the last line is cut off"):
        check_last("x", np.array([101.0, 102.0, 103.0, 10.0]))


def test_lines_of_blanks_between_the_rows_are_passed_over(tmp_path):
    degrees = walk()
    plain = text("time[ms],x[deg]", np.arange(SAMPLES) * 2.0, degrees)
    path = save(tmp_path / "run.csv", plain.replace("\n", "\n  \n"))
    values = read(path, Statement(kind="angle")).gyros[0].values
    np.testing.assert_allclose(values, np.deg2rad(degrees), rtol=1e-14)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_the_minus_that_is_printed_is_one(tmp_path, encoding):
    """As programs write it that follow the customs of Sweden, Norway or Finland."""
    degrees = walk()
    path = tmp_path / "run.csv"
    printed = text("x[deg]", degrees).replace("-", "\N{MINUS SIGN}")
    path.write_text(printed.replace("e\N{MINUS SIGN}", "e-"), encoding=encoding)
    values = read(path, Statement(kind="angle", sample_rate=10.0)).gyros[0].values
    np.testing.assert_allclose(values, np.deg2rad(degrees), rtol=1e-14)


def test_comments_of_as_many_fields_as_a_row_are_passed_over(tmp_path):
    rows = [f"{0.01 * n:.2f},{n % 7}" for n in range(SAMPLES)]
    rows[40:40] = ["# door,open", "  % 3,4"]
    rows.append("# mean,3")
    path = save(tmp_path / "run.csv", "\n".join(["time[s],x[deg]", *rows]) + "\n")
    recording = read(path, Statement(kind="angle"))
    np.testing.assert_allclose(np.rad2deg(recording["x"].values), np.arange(SAMPLES) % 7)


def test_fields_of_blanks_are_empty(tmp_path):
    rows = [f"{0.01 * n:.2f},{n % 7:12d}" for n in range(SAMPLES)]
    rows[40] = "0.40," + 12 * " "
    path = save(tmp_path / "run.csv", "\n".join(["time[s],x[deg]", *rows]) + "\n")
    values = read(path, Statement(kind="angle"), verify=False)["x"].values
    assert np.flatnonzero(np.isnan(values)).tolist() == [40]


@pytest.mark.parametrize("odd", ["12,5", "1,0000.5"])
def test_a_comma_that_is_not_between_thousands_is_refused(tmp_path, odd):
    """Without its comma "12,5" was 125."""
    rows = ["time[s];x[deg]", *(f"{n};1,{n:03}.5" for n in range(999))]
    path = save(tmp_path / "run.csv", "\n".join([*rows, f"999;{odd}", "1,000;2,000.5", ""]))
    refused(path, "x[deg]", "line 1001", f"'{odd}' is not a number")


@pytest.mark.parametrize("stamp", ["05-Mar-2024 23:58:{}.0", "3/5/24 2:03:{}.5 PM", "2:{}:000"])
def test_a_time_in_a_form_that_is_not_read_is_said_to_be_one(tmp_path, stamp):
    """Every line was to be corrected or removed."""
    rows = [f"{stamp.format(10 + n)},{n % 7}" for n in range(40)]
    path = save(tmp_path / "run.csv", "\n".join(["time,x[deg]", *rows, ""]))
    first, remedy = rows[0].split(",")[0], "write it as 2024-03-05T14:03:00.002"
    stated = Statement(kind="angle", time="time:s")
    refused(
        path, "time", f"line 2: '{first}'", "no time as they are read", remedy, statement=stated
    )
