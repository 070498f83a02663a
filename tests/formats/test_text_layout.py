"""How text files are laid out: marks between fields, numbers, header, first row."""

from pathlib import Path

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.formats.text import TextFile, encoding_of, text_file
from sagnac.formats.text_layout import Layout, fields_of, layout


def sample(text: str) -> TextFile:
    return TextFile(path=Path("run.csv"), encoding="utf-8", head=tuple(text.splitlines()))


def keys(found: Layout) -> tuple[str, ...]:
    return tuple(column.key for column in found.columns)


def rows(mark: str, decimal: str = ".") -> str:
    values = np.random.default_rng(5).normal(size=(20, 2)).round(4)
    lines = (mark.join(str(value).replace(".", decimal) for value in row) for row in values)
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("text", "names", "delimiter", "decimal", "skip"),
    [
        ("x[deg],z\n" + rows(","), ("x[deg]", "z"), ",", ".", 1),
        ("# a\n\nx;z\n\n" + rows(";", ","), ("x", "z"), ";", ",", 4),
        (rows(" "), ("1", "2"), " ", ".", 0),
        ("Kreisel X [Zähler]\tKreisel Z\n" + rows("\t", ","), None, "\t", ",", 1),
        ("Kreisel X [Zähler]  Kreisel Z\n" + rows("   "), None, " ", ".", 1),
        ("#time [ns],w x\n" + rows(","), ("time [ns]", "w x"), ",", ".", 1),
        ("x,z\n" + rows(","), ("x", "z"), ",", ".", 1),
        ("a;b\n" + rows(" ; "), ("a", "b"), ";", ".", 1),
        ("Bench 3\nat rest, night\n\n" + rows("|"), ("1", "2"), "|", ".", 3),
    ],
)
def test_marks_and_headers(text, names, delimiter, decimal, skip):
    found = layout(sample(text))
    assert keys(found) == (names or ("Kreisel X [Zähler]", "Kreisel Z"))
    assert (found.delimiter, found.style.decimal, found.skip) == (delimiter, decimal, skip)


def test_one_column_with_a_decimal_comma_is_no_two():
    column = "".join(f"{n / 8:.3f}\n".replace(".", ",") for n in range(20))
    one = layout(sample("x[deg]\n" + column))
    assert (keys(one), one.style.decimal) == (("x[deg]",), ",")
    two = layout(sample("x,z\n" + column))
    assert (keys(two), two.delimiter, two.style.decimal) == (("x", "z"), ",", ".")
    assert "not a decimal comma" in layout(sample(column)).doubts[0]


def test_a_line_of_units_stands_under_the_header():
    found = layout(sample("t;X;Y\n[s];[deg/s];\n" + "".join(f"{n};1.5;2\n" for n in range(9))))
    assert [column.unit for column in found.columns] == ["s", "deg/s", None]
    assert keys(found) == ("t", "X", "Y")


@pytest.mark.parametrize(
    ("lines", "units"),
    [
        ("t,x,z,T\nUTC,deg/s,deg/s,hPa\n", [None, "deg/s", "deg/s", None]),
        ("t,x,z,T\n-,deg/s,,hPa\n", [None, None, None, None]),
        ("IMU,IMU,IMU,IMU\ntime,deg,arcsec,x\n", [None, None, None, None]),
    ],
)
def test_a_line_of_units_may_hold_others_too_if_half_are_known(lines, units):
    row = "0.1,0.2,0.3,0.5\n"
    assert [one.unit for one in layout(sample(lines + 20 * row)).columns] == units


def test_every_comma_with_three_digits_behind_it_is_in_doubt_and_said():
    text = "x;z\n" + "".join(f"{n},125;{n},250\n" for n in range(1, 30))
    found = layout(sample(text))
    assert found.style.decimal == ","
    assert "a decimal comma (not a mark between thousands)" in found.doubts


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_rows_may_end_with_a_mark_that_the_header_does_not_have(mark):
    text = mark.join(("x", "z")) + "\n" + rows(mark).replace("\n", f"{mark}\n")
    found = layout(sample(text))
    assert keys(found) == ("x", "z", "3")
    assert found.first_row[2] == ""


def test_a_header_with_another_number_of_names_is_refused():
    with pytest.raises(RecordingError, match=r"line 1 names 2 columns .* have 4 fields"):
        layout(sample("t,x\n" + "".join(f"0,{n},1,{n}\n" for n in range(20))))


def test_a_file_without_lines_or_without_text(tmp_path):
    with pytest.raises(RecordingError, match="no header line"):
        layout(sample("# x\n"))
    with pytest.raises(RecordingError, match="not text"):
        encoding_of(b"\0")
    long = tmp_path / "long.csv"
    long.write_text("x" * 100_000)
    with pytest.raises(RecordingError, match="no line end in its first 64 KiB"):
        text_file(long)


@pytest.mark.parametrize(
    ("codec", "found"),
    [
        ("utf-8", "utf-8"),
        ("utf-8-sig", "utf-8"),
        ("cp1252", "cp1252"),
        ("utf-16", "utf-16-le"),
        ("utf-16-be", "utf-16-be"),
        ("utf-16-le", "utf-16-le"),
    ],
)
def test_encodings(tmp_path, codec, found):
    text = "Zähler;x\n1;2\n"
    path = tmp_path / "run.csv"
    path.write_bytes(text.encode(codec))
    if codec == "utf-16-be":
        path.write_bytes(b"\xfe\xff" + text.encode(codec))
    assert encoding_of(path.read_bytes()) == found
    assert text_file(path).head[:2] == ("Zähler;x", "1;2")
    assert list(text_file(path).lines()) == ["Zähler;x", "1;2"]


def test_fields():
    assert fields_of(' 1  "2"\t3 ', " ") == ["1", "2", "3"]
    assert fields_of('"1,5", "a ""b""",', ",") == ["1,5", 'a "b"', ""]


@pytest.mark.parametrize(
    ("values", "second"),
    [("True\nFalse\n", "True"), ("on\noff\n", "on"), ("0007,FFF1\n00A2,0004\n", "0007,FFF1")],
)
def test_a_table_of_words_alone_is_refused_by_its_second_line(tmp_path, values, second):
    path = tmp_path / "run.csv"
    path.write_text("x\n" + values * 100)
    with pytest.raises(RecordingError, match=f"has no line of numbers; line 2 is '{second}'"):
        layout(text_file(path))
