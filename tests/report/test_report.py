"""The report: numbers, document, tables, figures, page."""

import csv
import dataclasses
import io
import json
import math
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sagnac.analysis.spectra import Spectrum
from sagnac.errors import RecordingError
from sagnac.report import document, figures, page, text, wording
from tests import handmade
from tests.handmade import SHA256, N, analysis, estimate

VOID = {"meta", "br", "img", "link", "hr", "input", "use", "path"}


class Checker(HTMLParser):
    """Tags that close in order, ids, and everything that could be fetched."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.references: list[str] = []
        self.tags: set[str] = set()
        self.text: list[str] = []

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        self._look(attributes)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags.add(tag)
        self._look(attributes)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)

    def _look(self, attributes):
        for name, value in attributes:
            if name == "id":
                self.ids.append(value)
            if name in ("src", "href", "xlink:href", "data", "action", "srcset"):
                self.references.append(value)


def checked(html: str) -> Checker:
    checker = Checker()
    checker.feed(html)
    checker.close()
    assert checker.open == []
    return checker


def strict(text: str):
    def refuse(name):
        raise AssertionError(f"{name} is no JSON")

    return json.loads(text, parse_constant=refuse)


# ---- digits --------------------------------------------------------------------------


@given(
    st.floats(1e-12, 1e9),
    st.floats(1e-4, 1.0),
)
def test_a_number_keeps_what_its_interval_allows_and_no_more(value, relative):
    width = relative * value
    text = wording.number(value, width, plain=True)
    assert abs(float(text) - value) <= 0.06 * width
    mantissa = text.partition("e")[0].replace(".", "").lstrip("0")
    assert len(mantissa) <= max(3 - math.floor(math.log10(relative)), 6)


@given(st.floats(1e-12, 1e9), st.floats(1e-4, 0.9))
def test_a_number_for_people_says_the_same_as_one_for_programs(value, relative):
    superscripts = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    shown = wording.number(value, relative * value)
    mantissa, _, power = shown.partition(" × 10")
    figure = float(mantissa) * 10.0 ** int(power.translate(superscripts) or 0)
    assert figure == pytest.approx(float(wording.number(value, relative * value, plain=True)))


def test_a_number_by_example():
    assert wording.number(2.5134e-5, 4e-7) == "2.513 × 10⁻⁵"
    assert wording.number(2.5134e-5, 4e-7, plain=True) == "2.513e-05"
    assert wording.number(0.012345, 0.001) == "0.0123"
    assert wording.number(1234.5, 30.0) == "1234"
    assert wording.number(0.0) == "0"
    assert wording.number(math.nan) == "–"


def test_interval_of_a_person_has_one_power_of_ten():
    value = dataclasses.replace(estimate(1.24e-4), low=0.804e-4, high=1.67e-4)
    assert wording.figures(value) == ("1.24 × 10⁻⁴", "0.80 … 1.67 × 10⁻⁴")


@pytest.mark.parametrize(
    ("status", "said"),
    [
        ("estimated", "2.500e-05 °/√h  [2.450e-05, 2.550e-05] 95 %"),
        ("upper bound", "< 2.50e-05 °/√h  (upper bound, 95 %)"),
        ("not observable", "not observable"),
    ],
)
def test_what_each_status_says(status, said):
    assert wording.sentence("angle_random_walk", estimate(N, status=status), plain=True) == said


def test_zero_is_never_said_of_what_was_not_seen():
    for name in wording.FIELD_UNITS:
        said = wording.sentence(name, estimate(0.0, status="not observable"))
        assert "0" not in said


def test_filter_figures_are_one_density_in_three_units():
    (root_hour, _), (root_hertz, _), (si, _) = wording.kalman_figures(estimate(N))
    assert float(root_hour) == pytest.approx(2.5e-5, rel=1e-3)
    # deg/sqrt(h) to deg/h/sqrt(Hz) is 60, to rad/sqrt(s) is pi/180/60.
    assert float(root_hertz) == pytest.approx(60.0 * 2.5e-5, rel=1e-3)
    assert float(si) == pytest.approx(2.5e-5 * math.pi / 180.0 / 60.0, rel=1e-3)
    assert wording.kalman_figures(estimate(0.0, status="not observable")) == ()


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
    assert shown.splitlines()[1] == "────────  ────"
    assert shown.splitlines()[2] == "       1  left"
    assert text.table(("a", "b"), []) == "a  b\n─  ─"


def test_terminal_shows_the_strongest_lines_and_says_how_many_more():
    lines = tuple(handmade.line("time", 1.0 + n, 0.5 - 0.01 * n) for n in range(30))
    shown = text.lines(analysis(lines=lines))
    assert shown.endswith("… and 10 weaker ones: sagnac lines shows all")
    assert len(text.lines(analysis(lines=lines), most=None).splitlines()) == 32
    assert "No periodic component" in text.lines(analysis(lines=()))


def test_answer_says_value_interval_and_filter_figures():
    first, *others = text.answer(analysis(gyros=("x", "y", "z"))).splitlines()
    assert first == (
        "ARW of gyros x − z, per gyro (N̄)  2.500e-05 °/√h  [2.450e-05, 2.550e-05] 95 %   "
        "likelihood fit of the spectrum, 0.0006 to 0.5 Hz"
    )
    assert [line[:12] for line in others] == ["ARW of gyro "] * 3 + ["For a filter"]


# ---- document ------------------------------------------------------------------------


def test_document_has_the_schema():
    made = strict(document.to_json(document.analysis_document(analysis())))
    assert made["schema"] == "sagnac.analysis/1"
    assert {
        "schema", "version", "input", "settings", "angle_random_walk", "coefficients",
        "estimates", "lines", "curve", "notes", "seconds", "per_gyro",
    } <= set(made)  # fmt: skip
    assert set(made["input"]) >= {
        "path", "sha256", "samples", "sample_rate_hz", "duration_s", "gyros",
        "table_rate_deg_per_s",
    }  # fmt: skip
    assert made["input"]["path"] == "run.parquet"
    assert made["input"]["sha256"] == SHA256
    assert made["input"]["table_rate_deg_per_s"] == pytest.approx(40.0)
    assert made["settings"] == {"method": "fos", "interval_s": 1.0, "confidence": 0.95}
    answer = made["angle_random_walk"]
    assert answer["value"] == pytest.approx(2.5e-5)
    assert answer["low"] == pytest.approx(2.45e-5)
    assert answer["high"] == pytest.approx(2.55e-5)
    assert answer["unit"] == "deg/sqrt(h)"
    assert answer["status"] == "estimated"
    assert answer["source"]
    assert {name: item["unit"] for name, item in made["coefficients"].items()} == {
        "quantization": "arcsec",
        "angle_random_walk": "deg/sqrt(h)",
        "bias_instability": "deg/h",
        "rate_random_walk": "deg/h/sqrt(h)",
        "rate_ramp": "deg/h/h",
    }
    assert set(made["estimates"]) == {"paper", "weighted", "likelihood"}
    for estimates in made["estimates"].values():
        for item in estimates.values():
            assert set(item) == {
                "value", "low", "high", "confidence", "unit", "status", "units"
            }  # fmt: skip
    assert made["curve"]["estimator"] == "oadev"
    assert len({len(made["curve"][key]) for key in ("tau_s", "deviation_deg_per_h", "low")}) == 1


def test_document_units_of_every_coefficient():
    made = document.analysis_document(analysis())["coefficients"]
    degree, hour = math.pi / 180.0, 3600.0
    assert made["quantization"]["value"] == pytest.approx(3e-4)
    assert made["bias_instability"]["high"] == pytest.approx(2e-11 / degree * hour)
    assert made["rate_random_walk"]["value"] == pytest.approx(1e-11 / degree * hour * 60.0)


def test_document_and_tables_have_every_unit():
    made = document.analysis_document(analysis())["coefficients"]["angle_random_walk"]["units"]
    # 2.5e-5 deg/sqrt(h) by hand: 60 deg/h/sqrt(Hz) to each, pi/180/60 rad/sqrt(s) to each.
    assert made["deg/sqrt(h)"]["value"] == pytest.approx(2.5e-5)
    assert made["deg/h/sqrt(Hz)"]["value"] == pytest.approx(1.5e-3)
    assert made["rad/sqrt(s)"] == made["rad/s/sqrt(Hz)"]
    assert made["rad/sqrt(s)"]["low"] == pytest.approx(2.45e-5 * math.pi / 180.0 / 60.0)
    shown = text.units(analysis())
    for unit in made:
        assert f"  {unit}\n" in shown
    assert "1.500e-03" in shown or "0.00150" in shown
    assert "rate ramp" not in shown  # not observable
    html = page.page(analysis())
    assert "deg/h/sqrt(Hz)" in html


def test_family_of_curves_and_their_spectrum():
    plain = analysis()
    spectrum = Spectrum(frequency=np.array([1.0, 2.0, 4.0]), density=np.array([4.0, 2.0, 1.0]))
    tdev = dataclasses.replace(plain.curve, estimator="tdev")
    made = dataclasses.replace(plain, family=(plain.curve, tdev), density=spectrum)
    shown = strict(document.to_json(document.analysis_document(made)))
    first, second = shown["curves"]
    assert first["deviation"] == shown["curve"]["deviation_deg_per_h"]
    assert (first["unit"], second["unit"]) == ("deg/h", "arcsec")
    arcsec = 3600.0 * 180.0 / math.pi
    # The deviation of one gyro of a pair is less by root two, its density by two.
    assert second["high"][0] == pytest.approx(tdev.high[0] * arcsec / math.sqrt(2.0))
    assert shown["spectrum"]["density"] == pytest.approx([2 * arcsec**2, arcsec**2, arcsec**2 / 2])
    rows = list(csv.DictReader(io.StringIO(document.family_table(made))))
    assert [row["estimator"] for row in rows] == ["oadev"] * len(first["tau_s"]) + ["tdev"] * len(
        second["tau_s"]
    )
    assert float(rows[0]["deviation"]) == pytest.approx(first["deviation"][0])
    rows = list(csv.DictReader(io.StringIO(document.density_table(made))))
    assert [float(row["frequency[Hz]"]) for row in rows] == [1.0, 2.0, 4.0]
    assert "tdev ″" in text.curve(made, tdev)
    assert "PSD" in text.density(made)
    assert text.density(plain) == ""
    assert {"curves", "spectrum"}.isdisjoint(document.analysis_document(plain))


def test_a_coarser_spectrum_keeps_its_power():
    frequency = np.arange(1.0, 1001.0)
    density = np.random.default_rng(3).exponential(size=1000)
    made = document.coarser(Spectrum(frequency=frequency, density=density), 20)
    assert made.frequency.size <= 20
    assert np.all(np.diff(made.frequency) > 0.0)
    edges = np.searchsorted(frequency, np.geomspace(1.0, 1000.0, 21)[:-1])
    starts = np.unique(edges)
    assert made.density == pytest.approx([part.mean() for part in np.split(density, starts[1:])])


def test_what_was_not_observed_is_null():
    made = strict(document.to_json(document.analysis_document(analysis())))
    ramp = made["coefficients"]["rate_ramp"]
    assert ramp["status"] == "not observable"
    assert ramp["value"] is ramp["low"] is ramp["high"] is None


def test_document_of_lines():
    made = document.analysis_document(analysis())["lines"]
    first = made[0]
    assert first["scale"] == "angle"
    assert first["order"] == 1
    assert first["amplitude_arcsec"] == pytest.approx(0.6)
    assert first["amplitude_error_arcsec"] == pytest.approx(0.0004)
    mains = next(item for item in made if item["name"])
    assert mains["scale"] == "time"
    assert mains["frequency_hz"] == pytest.approx(50.0003)
    assert mains["frequency_error_hz"] == pytest.approx(3.2e-7)
    assert "order" not in mains


def test_curve_of_a_pair_is_per_gyro():
    pair = analysis()
    made = document.analysis_document(pair)["curve"]
    raw = pair.curve.deviation * 3600.0 * 180.0 / math.pi
    np.testing.assert_allclose(made["deviation_deg_per_h"], raw / math.sqrt(2.0))
    single = analysis(gyros=("x",))
    raw = single.curve.deviation * 3600.0 * 180.0 / math.pi
    np.testing.assert_allclose(
        document.analysis_document(single)["curve"]["deviation_deg_per_h"], raw
    )


def test_document_of_a_triad_and_of_no_file():
    made = document.analysis_document(analysis(gyros=("x", "y", "z"), provenance=False))
    assert set(made["per_gyro"]) == {"x", "y", "z"}
    assert made["input"]["path"] is None
    assert strict(document.to_json(made)) == made


def test_headline_is_the_fit_that_the_answer_is_of():
    fit = document.headline_fit(analysis())
    assert fit is not None
    assert fit.method == "likelihood"
    other = dataclasses.replace(analysis(), angle_random_walk=estimate(7 * N))
    assert document.headline_fit(other) is None
    assert document.analysis_document(other)["coefficients"] == {}


def test_tables_are_readable():
    made = analysis()
    rows = list(csv.DictReader(io.StringIO(document.stability_table(made))))
    assert len(rows) == made.curve.tau.size
    assert float(rows[0]["tau[s]"]) == made.curve.tau[0]
    assert "before_deviation[deg/h]" in rows[0]
    lines = list(csv.DictReader(io.StringIO(document.line_table(made))))
    assert [float(row["amplitude[arcsec]"]) for row in lines] == pytest.approx(
        [0.6, 0.32, 0.2, 0.08, 0.05]
    )
    assert lines[0]["frequency[Hz]"] == ""


def test_table_of_curves_of_different_length():
    made = analysis()
    short = handmade.curve(made.curve.tau[:5], made.curve.deviation[:5])
    rows = list(
        csv.DictReader(
            io.StringIO(document.stability_table(dataclasses.replace(made, curve=short)))
        )
    )
    assert rows[-1]["tau[s]"] == ""
    assert float(rows[-1]["before_tau[s]"]) == made.curve_before.tau[-1]


@pytest.mark.parametrize("count", [0, 1, 5])
def test_residual_peaks_counts_what_stands_out(count):
    made = analysis()
    density = made.spectrum.density.copy()
    for index in range(count):
        density[300 + 250 * index] *= 1000.0
    spectrum = dataclasses.replace(made.spectrum, density=density)
    clean = document.residual_peaks(made)
    assert document.residual_peaks(dataclasses.replace(made, spectrum=spectrum)) == clean + count


def test_nothing_is_left_of_a_file_that_cannot_be_written(tmp_path):
    with pytest.raises(RecordingError, match="cannot be written"):
        document.write_text(tmp_path / "none" / "a.json", "{}")
    assert list(tmp_path.iterdir()) == []


# ---- figures -------------------------------------------------------------------------

CASES = {
    "pair": analysis(),
    "triad": analysis(gyros=("x", "y", "z")),
    "single at rest": analysis(gyros=("x",), table_rate=None),
    "no lines": analysis(lines=()),
    "nothing removed": analysis(method="none"),
    "upper bound": analysis(answer=estimate(N, status="upper bound")),
    "not observable": analysis(answer=estimate(0.0, status="not observable")),
    "no file": analysis(provenance=False, notes=()),
}


@pytest.mark.parametrize("made", CASES.values(), ids=CASES.keys())
def test_figures_can_be_drawn(made, tmp_path):
    for number, figure in enumerate(
        (
            figures.stability_figure(made),
            figures.spectrum_figure(made),
            figures.comparison_figure({"fos": made, "none": made}),
        )
    ):
        path = tmp_path / f"{number}.png"
        figures.write_png(figure, path)
        assert path.read_bytes().startswith(b"\x89PNG")
    assert len(list(tmp_path.iterdir())) == 3


def test_fit_passes_through_the_curve_it_was_made_from():
    made = analysis()
    axes = figures.stability_figure(made).axes[0]
    drawn = {line.get_label(): line for line in axes.get_lines()}
    fit = drawn["fit (likelihood)"]
    points = drawn["after removal"]
    level = np.interp(np.log(points.get_xdata()), np.log(fit.get_xdata()), np.log(fit.get_ydata()))
    # The first points have thousands of degrees of freedom.
    np.testing.assert_allclose(np.exp(level)[:10], points.get_ydata()[:10], rtol=0.05)


def test_spectrum_lies_at_root_two_n():
    axes = figures.spectrum_figure(analysis()).axes[0]
    drawn = {line.get_label(): line for line in axes.get_lines()}
    level = float(drawn["√2 N"].get_ydata()[0])
    assert level == pytest.approx(math.sqrt(2.0) * 60.0 * 2.5e-5)  # deg/h/sqrt(Hz)
    after = drawn["after removal"]
    high = np.asarray(after.get_xdata()) > 1.0
    assert np.median(np.asarray(after.get_ydata())[high]) == pytest.approx(level, rel=0.02)


def test_lines_in_table_angle_stand_at_order_times_table_rate():
    axes = figures.spectrum_figure(analysis()).axes[0]
    drawn = {line.get_label(): line for line in axes.get_lines()}
    # 40 deg/s is one turn in 9 s.
    np.testing.assert_allclose(drawn["line in table angle"].get_xdata(), [1 / 9, 2 / 9, 12 / 9])


def test_a_spectrum_of_many_bins_keeps_its_peaks():
    random = np.random.default_rng(3)
    frequency = np.linspace(1e-3, 250.0, 400_000)
    density = random.gamma(4, 1 / 4, frequency.size)
    density[123_456] = 1e6
    made = analysis()
    made = dataclasses.replace(
        made, spectrum=dataclasses.replace(made.spectrum, frequency=frequency, density=density)
    )
    axes = figures.spectrum_figure(made).axes[0]
    after = {line.get_label(): line for line in axes.get_lines()}["after removal"]
    assert len(after.get_xdata()) < 5000
    assert np.asarray(after.get_xdata())[np.argmax(after.get_ydata())] == frequency[123_456]


# ---- page ----------------------------------------------------------------------------


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


def test_page_says_the_answer_first_and_what_it_rests_on():
    made = analysis(notes=("first doubt", "table & time are <nearly> one basis"))
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


def test_page_of_a_bound_and_of_nothing_seen():
    bound = page.page(CASES["upper bound"])
    assert "&lt; 2.50 × 10⁻⁵" in bound
    assert "Upper bound at 95 %" in bound
    unseen = page.page(CASES["not observable"])
    assert "Not observable" in unseen
    assert "For a filter" not in unseen


def test_page_of_a_triad_lists_each_gyro():
    text = page.page(CASES["triad"])
    for name in "xyz":
        assert f"<tr><th>{name}</th>" in text


def test_page_does_not_call_removed_what_was_only_found():
    html = page.page(CASES["nothing removed"])
    assert "found, not removed" in html
    assert "before and after" not in html


def test_comparison_page_shows_each_method_and_each_refusal():
    html = page.comparison_page(
        {"none": analysis(method="none"), "fos": analysis()}, {"fris": "never a full turn"}
    )
    checker = checked(html)
    text = " ".join(checker.text)
    assert "never a full turn" in text
    assert "nothing removed" in text
    assert all(reference.startswith("#") for reference in checker.references)


def test_report_is_written_whole(tmp_path):
    path = tmp_path / "report.html"
    page.write_report(analysis(), path)
    assert path.read_text(encoding="utf-8") == page.page(analysis())
    assert [item.name for item in tmp_path.iterdir()] == ["report.html"]
