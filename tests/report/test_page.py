"""The page."""

import re
from dataclasses import replace

import pytest

from sagnac.core.errors import Note
from sagnac.noise.model_average import ModelChoice
from sagnac.report import page
from tests.handmade import SHA256, analysis
from tests.report.examples import CASES, checked
from tests.report.html_tree import tree


@pytest.mark.parametrize("made", CASES.values(), ids=CASES.keys())
def test_page_stands_alone(made):
    html = page.page(made)
    checker = checked(html)
    assert all(reference.startswith("#") for reference in checker.references)
    assert len(set(checker.ids)) == len(checker.ids)
    assert not checker.tags & {"script", "link", "iframe", "img", "object", "embed"}
    assert "@import" not in html
    assert "url(http" not in html
    assert set(re.findall(r"url\(#([^)]*)\)", html)) <= set(checker.ids)
    assert {reference[1:] for reference in checker.references} <= set(checker.ids)
    assert len(html.encode()) < 1_500_000
    assert checker.tags >= {"svg", "table", "h1"}


@pytest.mark.usefixtures("blank_figures")
def test_no_number_of_an_interval_is_broken_at_its_exponent():
    rows = tree(page.page(analysis())).all("tr")
    (table,) = [place for place, row in enumerate(rows) if row.text.startswith("In every unit")]
    cells = [row.all("td")[1] for row in rows[table + 1 : table + 9]]
    intervals = [cell for cell in cells if " … " in cell.text]
    assert len(intervals) > 4
    assert any("e-" in cell.text for cell in intervals)
    for cell in intervals:
        low, high = cell.text.split(" … ")
        # Each number is whole, and a line may begin between the two.
        assert [one.text for one in cell.all("span", "whole")] == [f"{low} …", high]
        assert float(low) < float(high)


@pytest.mark.usefixtures("blank_figures")
def test_many_gyros_have_a_row_of_coefficients_each_so_that_paper_holds_them():
    names = [f"gyro_{number:02}" for number in range(10)]
    gyros = {one: analysis(gyros=(one,), table_rate=None) for one in names}
    html = page.page(replace(gyros[names[0]], gyros=gyros))
    table = html.partition("<h2>Coefficients</h2>")[2].partition("</table>")[0]
    rows = [" ".join(checked(row).text).split() for row in re.findall("<tr>.*?</tr>", table, re.S)]
    assert [row[0] for row in rows] == ["Gyro", *names]
    assert all(row.count("<td") == 5 for row in table.split("<tr>")[2:])


@pytest.mark.usefixtures("blank_figures")
def test_what_is_said_of_many_gyros_alike_is_said_once():
    gyros = {one: analysis(gyros=(one,), table_rate=None) for one in "xyz"}
    notes = [Note(channel=one, text=text) for one in gyros for text in ("is short", f"is {one}")]
    html = page.page(replace(gyros["x"], gyros=gyros, notes=tuple(notes)))
    said = re.findall("<li>(.*?)</li>", html.partition("<h2>Notes</h2>")[2].partition("</ul>")[0])
    assert said == ["x, y, z: is short", "x: is x", "y: is y", "z: is z"]


@pytest.mark.usefixtures("blank_figures")
def test_page_says_the_answer_first_and_what_it_rests_on():
    made = analysis(
        notes=(Note(text="first doubt"), Note(text="table & time are <nearly> one basis"))
    )
    html = page.page(made)
    checker = checked(html)
    text = " ".join(" ".join(checker.text).split())
    order = [
        text.index(part)
        for part in (
            "2.500 × 10⁻⁵",
            "2.450 … 2.550 × 10⁻⁵",
            "likelihood fit of the spectrum, 0.0006 to 0.5 Hz",
            "first doubt",
            "table & time are <nearly> one basis",
            "Figure 1.",
            "Figure 2.",
            "Coefficients",
            "Periodic components",
            SHA256,
        )
    ]
    assert order == sorted(order)
    assert "sagnac 0" in text
    assert "order 12" in text
    assert "mains <50 Hz>" in text
    assert "run.parquet" in text


@pytest.mark.usefixtures("blank_figures")
def test_page_does_not_call_removed_what_was_only_found():
    html = page.page(CASES["nothing removed"])
    assert "found, not removed" in html
    assert "before and after" not in html


@pytest.mark.usefixtures("blank_figures")
def test_comparison_page_shows_each_method_and_each_refusal():
    html = page.comparison_page(
        {"none": analysis(method="none"), "fos": analysis()}, {"fris": "never a full turn"}
    )
    checker = checked(html)
    text = " ".join(checker.text)
    assert "never a full turn" in text
    assert "nothing removed" in text
    assert all(reference.startswith("#") for reference in checker.references)
    # What makes a value wrong stands beside it, as in the terminal.
    assert "fos: table angle & time are <nearly> one basis: condition 4.1 × 10⁵" in text


@pytest.mark.usefixtures("blank_figures")
def test_a_page_without_an_answer_says_of_no_picture_what_it_does_not_show():
    spoilt = replace(
        CASES["not observable"],
        source="not given, for clipping of x spoils it; lines removed",
        fits={},
        coefficients={},
    )
    quiet, faulty = (page.page(one) for one in (CASES["not observable"], spoilt))
    hidden, fault = "above its other noise", "A fault of the recording leaves no answer"
    assert (hidden in quiet, fault in quiet) == (True, False)
    assert (hidden in faulty, fault in faulty) == (False, True)
    assert "Solid: what the answer rests on" in page.page(CASES["pair"])
    assert "Solid: what the answer rests on" not in faulty
    assert "the answer rests on this" not in faulty


@pytest.mark.usefixtures("blank_figures")
def test_a_curve_of_which_lines_were_taken_is_not_called_as_recorded():
    found = CASES["nothing removed"]
    drawn = replace(found, curve_of_answer=found.curve)
    assert "Allan deviation as recorded" in page.page(found)
    assert "Allan deviation before and after the removal" in page.page(drawn)


@pytest.mark.usefixtures("blank_figures")
def test_a_likelihood_whose_interval_was_widened_is_no_average(tmp_path):
    found = analysis()
    answer = found.angle_random_walk
    widened = replace(
        found,
        angle_random_walk=replace(answer, high=1.01 * answer.high),
        average=ModelChoice(
            member="whole band", terms=("angle_random_walk",), band_hz=(0.001, 0.5)
        ),
        coefficients=found.fits["likelihood"].coefficients,
    )
    path = tmp_path / "report.html"
    page.write_page(widened, path)
    text = path.read_text(encoding="utf-8")
    assert "Likelihood, its interval widened" in text
    assert "verage over bands" not in text
