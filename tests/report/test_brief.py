"""What fits a screen of 80 columns."""

from dataclasses import replace

from sagnac.core.errors import Note
from sagnac.report import text
from sagnac.verdict.limits import specification_of
from tests import handmade
from tests.handmade import N, analysis, estimate


def widest(shown: str) -> int:
    return max(len(line.replace("\u0304", "")) for line in shown.splitlines())


def test_all_of_one_analysis_fits_a_screen():
    notes = tuple(
        Note(text=f"something was noticed that takes some words to say, number {n}", level=level)
        for n in range(6)
        for level in ("remark", "warning")
    )
    made = analysis(gyros=("x", "y", "z"), notes=notes)
    settings = replace(made.settings, specification=specification_of("N=3e-5,B=0.01deg/h"))
    made = replace(made, settings=settings)
    shown = text.blocks(
        text.answer(made),
        text.verdict(made),
        text.main_coefficients(made),
        text.strongest_lines(made),
        text.short_notes(made),
        text.seconds(made),
    )
    assert widest(shown) <= 80
    assert len(shown.splitlines()) <= 50


def test_warnings_come_first_and_all_of_them():
    notes = (
        *(Note(text=f"remark {n}") for n in range(6)),
        *(Note(text=f"warning {n}", level="warning") for n in range(6)),
    )
    shown = text.short_notes(analysis(notes=notes)).splitlines()
    assert shown[:6] == [f"warning: warning {n}" for n in range(6)]
    assert shown[6:10] == [f"remark: remark {n}" for n in range(4)]
    assert shown[10].startswith("… and 2 further notes")
    assert len(text.every_note(notes).splitlines()) == 12


def test_notes_on_what_is_not_shown_are_counted_only():
    aside = Note(text="the curve departs; the paper intervals allow for it", level="warning")
    made = analysis(notes=(aside,))
    fits = dict(made.fits)
    fits["paper"] = replace(fits["paper"], notes=(aside,))
    assert "departs" in text.short_notes(made)
    assert text.short_notes(replace(made, fits=fits)).startswith("… and 1 further note")


def test_the_strongest_five_lines_and_how_many_more():
    lines = tuple(handmade.line("time", 1.0 + n, 0.5 - 0.01 * n, "m" * 90) for n in range(7))
    shown = text.strongest_lines(analysis(lines=lines))
    assert shown.splitlines()[-1] == "… and 2 weaker lines: sagnac lines shows all"
    assert len(shown.splitlines()) == 8
    assert widest(shown) <= 80
    assert "No periodic component" in text.strongest_lines(analysis(lines=()))


def test_what_was_warned_of_stands_below_the_last_table():
    doubt = Note(name="units", level="warning", channel="x, z", text="looks like another unit")
    seen = Note(name="motion", level="remark", channel="z", text="moves a little")
    alone = {name: analysis(gyros=("x",), notes=(seen,)) for name in "xz"}
    unit = replace(alone["x"], gyros=alone, notes=(doubt, seen))
    assert text.closing([("", unit)]).splitlines()[-1] == "warned of above: units (x, z)"
    sound = replace(unit, notes=(seen,))
    assert "warned" not in text.closing([("", sound)])
    shown = text.closing([("a.csv", unit), ("b.csv", sound)])
    assert shown.splitlines()[-1] == "warned of above: a.csv: units (x, z)"


def test_several_analyses_end_in_one_table():
    triad, single = analysis(gyros=("x", "y", "z")), analysis(gyros=("x",))
    assert text.closing([("a.csv", triad)]) == ""
    long = "a_name_of_a_file_that_is_rather_long.parquet"
    shown = text.closing([(long, triad), ("b.csv", single)])
    rows = shown.splitlines()[2:]
    assert [row.split()[1] for row in rows] == ["x", "y", "z", "x"]
    assert widest(shown) <= 80
    limited = [
        ("", replace(one, settings=replace(one.settings, specification=specification_of(limit))))
        for one, limit in ((single, "3e-5"), (analysis(answer=estimate(2 * N)), "3e-5"))
    ]
    *rows, last = text.closing(limited).splitlines()[2:]
    assert [row.split()[-1] for row in rows] == ["pass", "fail"]
    assert last == "Verdict of all: FAIL"
