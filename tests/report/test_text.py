"""What a terminal shows."""

import pytest

from sagnac.core.errors import Note
from sagnac.report import text
from tests import handmade
from tests.handmade import N, analysis, estimate


@pytest.mark.parametrize(
    ("answer", "truth", "said"),
    [
        (estimate(N), 2.5e-5, "off by +0.00 % and its interval holds it"),
        (estimate(N), 2.0e-5, "off by +25.00 % and its interval does not hold it"),
        (estimate(N, status="upper bound"), 2.4e-5, "the bound holds it"),
        (estimate(N, status="upper bound"), 2.6e-5, "the bound does not hold it"),
        (estimate(N, status="not observable"), 2.5e-5, "the recording does not show it"),
    ],
)
def test_beside_the_truth(answer, truth, said):
    assert text.beside_truth(analysis(answer=answer), truth).endswith(said)


def test_table_is_aligned_by_what_a_terminal_shows():
    shown = text.table(("N̄ °/√h", "b", ""), [("1", "left", ""), ("12345678", "x", "")], right=(0,))
    # The macron stands over its letter and takes no column.
    assert [row.replace("\u0304", "").find("b") for row in shown.splitlines()][:1] == [10]
    assert set(shown.splitlines()[1]) == {"─", " "}
    assert shown.splitlines()[2] == "       1  left"
    assert text.table(("a", "b"), []).splitlines()[0] == "a  b"


def test_terminal_shows_the_strongest_lines_and_says_how_many_more():
    lines = tuple(handmade.line("time", 1.0 + n, 0.5 - 0.01 * n) for n in range(30))
    shown = text.lines(analysis(lines=lines))
    assert shown.endswith("… and 10 weaker ones: sagnac lines shows all")
    assert len(text.lines(analysis(lines=lines), most=None).splitlines()) == 32
    assert "No periodic component" in text.lines(analysis(lines=()))


def test_answer_says_value_interval_and_filter_figures():
    # What was asked for comes first; what two gyros make per gyro is below.
    made = text.answer(analysis(gyros=("x", "y", "z"))).splitlines()
    assert [line[:13] for line in made[:3]] == [f"ARW of gyro {name}" for name in "xyz"]
    assert [line.endswith("worst") for line in made[:3]] == [True, False, False]
    assert made[3:] == [
        "ARW of gyros x − z, per gyro (N̄)  2.500e-05 °/√h  [2.450e-05, 2.550e-05] 95 %",
        "Rests on: likelihood fit of the spectrum, 0.0006 to 0.5 Hz",
        "For a filter: 2.5000e-05 °/√h = 0.0015000 °/h/√Hz = 7.272e-09 rad/√s",
    ]


def test_what_stands_in_a_table_is_no_markup_and_is_never_cut():
    long = "[bold]:smile: " + "x" * 300
    assert long in text.table(("a", "b"), [(long, "1")])


def test_tables_are_no_wider_than_they_need():
    made = analysis(gyros=("x",))
    # What fits a terminal of 80 columns: units, curves, and lines of no known name.
    unnamed = analysis(lines=(handmade.line("time", 0.0137, 0.05),))
    for shown in (text.units(made), text.lines(unnamed), text.curve(made.curve)):
        assert max(map(len, shown.splitlines())) <= 80


def test_notes_and_findings_name_options_as_they_are_typed():
    note = Note(text="does not follow; leave it out ({table none})", channel="table")
    assert text.notes([note]) == "note: table: does not follow; leave it out (--table none)"
    assert "(--table none)" in text.findings([note])
    assert text.findings([]) == "Nothing was found wrong."
