"""Text with delimiters: headers, marks, and files cut off."""

import numpy as np
import pytest

from sagnac.errors import RecordingError
from sagnac.formats import Statement, columns, read
from sagnac.formats.csv import Layout, check_last, layout
from tests.formats.examples import SAMPLES, refused, save, text, timed, walk


def test_values_are_in_si_by_the_header(tmp_path):
    degrees = walk()
    path = save(tmp_path / "run.csv", text("time[ms],x[deg]", np.arange(SAMPLES) * 2.0, degrees))
    recording = read(path, Statement(kind="angle"))
    np.testing.assert_allclose(recording.gyros[0].values, np.deg2rad(degrees), rtol=1e-14)
    assert recording.sample_rate == 500.0
    assert recording.times is None


def test_delimiters_comments_and_files_without_header(tmp_path):
    x = walk()
    plain = read(
        save(tmp_path / "a.csv", text("x[deg]", x)), Statement(kind="angle", sample_rate=10)
    )
    rows = "\n".join(f"{i};{str(float(item)).replace('.', ',')}" for i, item in enumerate(x))
    german = save(tmp_path / "b.csv", f"# bench 3\nn;x[deg]\n{rows}\n")
    headless = save(
        tmp_path / "c.txt", "\n".join(f"{i} {float(item)!r}" for i, item in enumerate(x)) + "\n"
    )
    stated = Statement(kind="angle", sample_rate=10.0)
    np.testing.assert_array_equal(read(german, stated).gyros[0].values, plain.gyros[0].values)
    stated = Statement(kind="angle", sample_rate=10.0, columns={"x": "2"}, unit="deg")
    np.testing.assert_array_equal(read(headless, stated).gyros[0].values, plain.gyros[0].values)
    assert columns(headless) == ("1", "2")


def test_csv_cut_off_and_with_text_in_it(tmp_path):
    ramp = 1e4 + 7.0 * np.arange(SAMPLES) + 0.1 * walk()
    whole = timed(tmp_path / "run.csv", ramp).read_text()
    last = whole.rindex(",")
    refused(save(tmp_path / "row.csv", whole[:last]), "cut off")
    refused(save(tmp_path / "number.csv", whole[: last + 3]), "x[arcsec]", "cut off")
    unended = read(save(tmp_path / "unended.csv", whole[:-1]), Statement(kind="angle"))
    assert any("no line end" in str(note) for note in unended.notes)
    refused(save(tmp_path / "word.csv", whole.replace("0.05,", "0.05,stop")), "stop")


@pytest.mark.parametrize(
    ("head", "expected"),
    [
        ("x[deg],z\n1,2\n", Layout(names=("x[deg]", "z"), delimiter=",", skip=1, first_row="1,2")),
        (
            "# a\n\nx;z\n\n1,5;2\n",
            Layout(names=("x", "z"), delimiter=";", skip=3, first_row="1,5;2"),
        ),
        ("1 2 3\n", Layout(names=("1", "2", "3"), delimiter=" ", skip=0, first_row="1 2 3")),
        ("x\n", Layout(names=("x",), delimiter=",", skip=1, first_row="")),
    ],
)
def test_layouts(head, expected):
    assert layout(head.encode(), tabs=False) == expected


def test_a_decimal_comma_needs_another_delimiter():
    assert layout(b"x;z\n1,5;2\n", tabs=False).decimal_point == ","
    assert layout(b"x,z\n1,5\n", tabs=False).decimal_point == "."


@pytest.mark.parametrize(
    ("head", "said"),
    [(b"\0", "not text"), (b"# x\n", "no header line"), (b"x,x\n", "x: two columns")],
)
def test_heads_that_cannot_be(head, said):
    with pytest.raises(RecordingError, match=said):
        layout(head, tabs=False)


def test_a_last_number_that_leaps_is_cut_short():
    check_last("x", np.array([1.0, 2.0, 3.0, 4.0]))
    with pytest.raises(RecordingError, match="x: the last line is cut off"):
        check_last("x", np.array([101.0, 102.0, 103.0, 10.0]))
