"""Tables as CSV."""

import csv
import dataclasses
import io
import math

import pytest

from sagnac.report import tables
from tests import handmade
from tests.handmade import analysis


def test_tables_are_readable():
    made = analysis()
    rows = list(csv.DictReader(io.StringIO(tables.stability_table(made))))
    assert len(rows) == made.curve.tau.size
    assert float(rows[0]["tau[s]"]) == made.curve.tau[0]
    assert "before_deviation[deg/h]" in rows[0]
    lines = list(csv.DictReader(io.StringIO(tables.line_table(made))))
    assert [float(row["amplitude[arcsec]"]) for row in lines] == pytest.approx(
        [0.6, 0.32, 0.2, 0.08, 0.05]
    )
    assert lines[0]["frequency[Hz]"] == ""


def test_table_of_curves_of_different_length():
    made = analysis()
    short = handmade.curve(made.curve.tau[:5], made.curve.deviation[:5])
    rows = list(
        csv.DictReader(io.StringIO(tables.stability_table(dataclasses.replace(made, curve=short))))
    )
    assert rows[-1]["tau[s]"] == ""
    assert float(rows[-1]["before_tau[s]"]) == made.curve_before.tau[-1]


def test_what_is_no_number_is_an_empty_cell():
    assert tables.cell(math.nan) == tables.cell(math.inf) == ""
    assert tables.cell(1.0 / 3.0) == "0.333333333"
    assert tables.csv_text(("a", "b"), [("1,5", "x")]) == 'a,b\n"1,5",x\n'
