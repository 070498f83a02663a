"""The JSON document."""

import csv
import dataclasses
import io
import math

import numpy as np
import pytest

from sagnac.analysis.spectra import Spectrum
from sagnac.core.errors import Note
from sagnac.report import document, page, tables, text
from tests.cli.examples import strict
from tests.handmade import SHA256, analysis


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


@pytest.mark.usefixtures("blank_figures")
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
    assert second["high"][0] == pytest.approx(tdev.high[0] * arcsec)
    assert shown["spectrum"]["density"] == pytest.approx([4 * arcsec**2, 2 * arcsec**2, arcsec**2])
    rows = list(csv.DictReader(io.StringIO(tables.family_table(made))))
    assert [row["estimator"] for row in rows] == ["oadev"] * len(first["tau_s"]) + ["tdev"] * len(
        second["tau_s"]
    )
    assert float(rows[0]["deviation"]) == pytest.approx(first["deviation"][0])
    rows = list(csv.DictReader(io.StringIO(tables.density_table(made))))
    assert [float(row["frequency[Hz]"]) for row in rows] == [1.0, 2.0, 4.0]
    assert "tdev ″" in text.curve(tdev)
    assert "PSD" in text.density(made)
    assert text.density(plain) == ""
    assert {"curves", "spectrum"}.isdisjoint(document.analysis_document(plain))


def test_a_document_from_before_terms_were_stated_is_read():
    older = document.analysis_document(analysis())
    for name in ("terms", "noise_type"):
        del older["curve"][name]
    read = document.read_analysis(document.to_json(older))
    assert not read.curve.terms.any()
    assert not read.family


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


@pytest.mark.parametrize(("gyros", "differenced"), [(("x", "z"), 2), (("x",), 1)])
def test_the_curve_is_shown_as_it_is_and_the_gyros_are_counted(gyros, differenced):
    one = analysis(gyros=gyros)
    made = document.analysis_document(one)
    shown = one.curve.deviation * 3600.0 * 180.0 / math.pi
    np.testing.assert_allclose(made["curve"]["deviation_deg_per_h"], shown)
    assert made["gyros_differenced"] == differenced


def test_document_of_a_triad_and_of_no_file():
    made = document.analysis_document(analysis(gyros=("x", "y", "z"), provenance=False))
    assert set(made["per_gyro"]) == {"x", "y", "z"}
    assert made["input"]["path"] is None
    assert strict(document.to_json(made)) == made


def test_notes_are_texts_for_the_command_line():
    note = Note(channel="x", level="warning", text="take the sound stretch ({slice 30:90})")
    made = document.analysis_document(analysis(notes=(note,)))
    assert made["notes"] == ["x: take the sound stretch (--slice 30:90)"]
