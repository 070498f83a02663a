"""Every number of the page is the one that ``analysis.json`` states."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.noise.laws import COEFFICIENT_NAMES, SYMBOLS
from sagnac.recording.model import Recording
from sagnac.report import document, figures, page
from sagnac.verdict.limits import specification_of
from tests.report.examples import CASES
from tests.report.html_tree import Node, numbers, tree

LIMITS = specification_of("N=2.6e-5,B=0.01deg/h,Q=1e-6rad")
COLUMNS = {
    "Likelihood on the spectrum": "likelihood",
    "Weighted, non-negative": "weighted",
    "Least squares on Eq. 3 (paper)": "paper",
}
NAMES = {symbol: name for name, symbol in SYMBOLS.items()}


def still(gyros: str):
    """Gyros at rest, white with a vibration, analyzed."""
    random = np.random.default_rng(5)
    time = np.arange(12_000) / 10.0
    vibration = 3e-7 * np.cos(2.0 * np.pi * 2.2 * time)
    rates = {name: 1e-6 * random.standard_normal(time.size) + vibration for name in gyros}
    recording = Recording.from_arrays(**rates, kind="rate", unit="rad/s", sample_rate=10.0)
    settings = Settings(gyros=tuple(gyros), specification=specification_of("N=1.2e-3,B=4deg/h"))
    return analyze(recording, settings)


def limited(made):
    return replace(made, settings=replace(made.settings, specification=LIMITS))


ONE_ANSWER = (*CASES, "one gyro, limited", "triad, limited", "measured x")


@pytest.fixture(scope="module", params=ONE_ANSWER)
def both(request):
    """The page as a tree, and the document as it is read back."""
    made = {
        **CASES,
        "one gyro, limited": limited(CASES["single at rest"]),
        "triad, limited": limited(CASES["triad"]),
    }.get(request.param)
    made = made or still(request.param.removeprefix("measured "))
    text = document.to_json(document.analysis_document(made))
    blank = {"stability": Figure(), "spectrum": Figure()}
    return tree(page.page(made, drawn=blank)), json.loads(text), made


def check(shown: str, interval: str, stated: dict, status: str) -> None:
    """One reading against the value, low and high that are stated."""
    if status == "not observable":
        assert shown == "–"
        assert stated["value"] is None
    elif status == "upper bound":
        assert shown.startswith("<")
        assert numbers(shown)[0].says(stated["high"]), (shown, stated)
        assert not interval
    else:
        low, high = numbers(interval)
        assert numbers(shown)[0].says(stated["value"]), (shown, stated)
        assert low.says(stated["low"]), (interval, stated)
        assert high.says(stated["high"]), (interval, stated)


def table(root: Node, header: str) -> list[list[Node]]:
    """Rows of the table whose first column is so named."""
    for found in root.all("table"):
        if found.first("th").text == header:
            rows = found.first("tbody").all("tr")
            return [[c for c in row.children if isinstance(c, Node)] for row in rows]
    raise AssertionError(f"no table of {header}")


def ranges(cell: Node) -> str:
    return "".join(one.text for one in cell.all("span", "range"))


def test_the_answer(both):
    root, stated, _ = both
    answer, own = root.first("section", "answer"), stated["angle_random_walk"]
    value = answer.first("p", "value").text.rpartition(": ")[2]
    if own["status"] == "not observable":
        assert value == "Not observable"
        assert own["value"] is None
        assert not answer.all("code")
        return
    value = value.removesuffix(" °/√h")
    interval = answer.first("p", "interval").text
    percent = f"{100 * own['confidence']:g} %"
    assert percent in interval
    check(value, interval.partition("interval ")[2], own, own["status"])
    pasted = [numbers(one.text)[0] for one in answer.all("code")]
    for one, unit in zip(pasted, ("deg/sqrt(h)", "deg/h/sqrt(Hz)", "rad/sqrt(s)"), strict=True):
        assert one.says(own["units"][unit]["value"])


def test_each_gyro_of_a_triad(both):
    root, stated, _ = both
    if not stated["per_gyro"]:
        assert not root.first("section", "answer").all("table")
        return
    rows = table(root.first("section", "answer"), "Gyro")
    assert len(rows) == len(stated["per_gyro"])
    for name, value, interval, status in rows:
        own = stated["per_gyro"][name.text.removesuffix(" (worst)")]
        assert status.text == own["status"]
        check(value.text, interval.text, own, own["status"])
    (worst,) = (row[0].text[0] for row in rows if "worst" in row[0].text)
    assert stated["per_gyro"][worst]["high"] == max(
        own["high"] for own in stated["per_gyro"].values()
    )


@pytest.mark.parametrize("both", [*ONE_ANSWER, "measured xyz"], indirect=True, scope="module")
def test_the_verdict(both):
    root, stated, _ = both
    if "verdict" not in stated:
        assert not root.all("section", "verdict")
        return
    section, verdict = root.first("section", "verdict"), stated["verdict"]
    assert section.first("h2").text.endswith(verdict["overall"].upper())
    (risk,) = numbers(section.all("p")[-1].text)
    assert risk.says(100.0 * verdict["risk"])
    rows = table(section, "Gyro")
    for (name, limit, found, decided), own in zip(rows, verdict["limits"], strict=True):
        assert name.text.partition(",")[0].replace(" − ", "-") == own["gyro"]
        assert limit.text.startswith(f"{SYMBOLS[own['coefficient']]} ≤ ")
        (shown,) = numbers(limit.text.partition("≤")[2])
        assert shown.says(float(own["stated"].split()[0]))
        check(found.own.partition(" °")[0].removesuffix(" ″"), ranges(found), own, own["status"])
        assert decided.first("b").text == own["verdict"].upper()
        assert ranges(decided) == own["reason"]


def test_coefficients_of_every_fit(both):
    root, stated, _ = both
    heads = root.all("h2")
    assert any(one.text.startswith("Coefficients") for one in heads)
    (whole,) = (one for one in root.all("table") if one.first("th").text == "Term")
    titles = [one.own for one in whole.first("thead").all("th")[1:]]
    rows = table(root, "Term")
    assert [row[0].own for row in rows] == [SYMBOLS[name] for name in COEFFICIENT_NAMES]
    for name, *cells in rows:
        coefficient = NAMES[name.own]
        for title, cell in zip(titles, cells, strict=True):
            of = stated["estimates"][COLUMNS[title]] if title in COLUMNS else stated["coefficients"]
            if "chosen" in cell.kinds:
                assert of[coefficient] == stated["coefficients"][coefficient]
            if coefficient not in of:
                assert cell.own == "–"
                continue
            check(cell.own, ranges(cell), of[coefficient], of[coefficient]["status"])


def test_every_unit(both):
    root, stated, _ = both
    found = stated["coefficients"] or {"angle_random_walk": stated["angle_random_walk"]}
    expected = {
        (SYMBOLS[name], unit): (one["units"][unit], one["status"])
        for name, one in found.items()
        if one["status"] != "not observable"
        for unit in one["units"]
    }
    if not expected:
        return
    rows = table(root, "In every unit")
    assert [(row[0].text, row[3].text) for row in rows] == list(expected)
    for (_, value, interval, _), (own, status) in zip(rows, expected.values(), strict=True):
        check(value.text, interval.text, own, status)


def test_every_line(both):
    root, stated, _ = both
    if not stated["lines"]:
        return
    rows = table(root, "Periodic in")
    for cells, own in zip(rows, stated["lines"], strict=True):
        scale, position, amplitude, error, significance, channel, *name = (c.text for c in cells)
        assert scale == ("table angle" if own["scale"] == "angle" else "time")
        shown = numbers(position)[0]
        assert shown.says(own["order"] if own["scale"] == "angle" else own["frequency_hz"])
        assert numbers(amplitude)[0].says(own["amplitude_arcsec"])
        assert numbers(error)[0].says(own["amplitude_error_arcsec"])
        assert numbers(significance)[0].says(own["significance"])
        assert channel.replace(" − ", "-") == own["channel"]
        assert name in ([], [own["name"]])


def test_parts(both):
    root, stated, made = both
    seen = [part for part in stated["parts"] if part["value"] is not None]
    drawn = figures.report_figures(made).get("parts")
    if len(seen) < 2:
        assert drawn is None
        return
    bars = drawn.axes[0].containers
    assert len(bars) == len(seen)
    for bar, part in zip(bars, seen, strict=True):
        across, up = (segment.get_segments()[0] for segment in bar.lines[2])
        np.testing.assert_allclose(across[:, 0], [part["start_s"], part["stop_s"]])
        np.testing.assert_allclose(up[:, 1], [part["low"], part["high"]])
        assert float(bar.lines[0].get_ydata()[0]) == pytest.approx(part["value"])
    said = re.search(r"(\d+) parts of the recording read (\S+) to (\S+)", root.text)
    assert said is not None
    assert int(said[1]) == len(seen)
    assert numbers(said[2])[0].says(min(part["value"] for part in seen))
    assert numbers(said[3])[0].says(max(part["value"] for part in seen))


def test_input_and_notes(both):
    root, stated, _ = both
    names, values = root.all("dt"), root.all("dd")
    facts = dict(zip((one.text for one in names), (one.text for one in values), strict=True))
    count, rate = re.fullmatch(r"([\d ]+) at (\S+) Hz", facts["Samples"]).groups()
    assert int(count.replace(" ", "")) == stated["input"]["samples"]
    assert numbers(rate)[0].says(stated["input"]["sample_rate_hz"])
    assert numbers(facts["Duration"])[0].says(stated["input"]["duration_s"])
    assert facts["SHA-256"] == (stated["input"]["sha256"] or "none")
    turning = stated["input"]["table_rate_deg_per_s"]
    assert (
        facts["Table"] == "at rest" if turning is None else numbers(facts["Table"])[0].says(turning)
    )
    assert facts["Confidence"] == f"{100 * stated['settings']['confidence']:g} %"
    text = root.text.lower()
    for note in stated["notes"]:
        assert " ".join(note.split()).lower() in text
    for stage, spent in stated["seconds"].items():
        assert numbers(facts[stage])[0].says(spent)
