"""Which columns are taken."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.formats import Statement, columns, read
from sagnac.formats.choice import choose, choose_gyros, find
from sagnac.formats.source import column
from sagnac.formats.statement import Statements
from tests.formats.examples import SAMPLES, refused, save, text, walk


def test_missing_columns_list_those_there_are(tmp_path):
    path = save(tmp_path / "run.csv", text("time[s],gyro[deg]", np.arange(SAMPLES) / 10, walk()))
    refused(path, "x, y, z", "gyro[deg]", "--columns")
    refused(path, "z:", "gyro[deg]", "--columns", statement=Statement(kind="angle", gyros=("z",)))
    refused(path, "enc", "--table", statement=Statement(kind="angle", table="enc", gyros=("gyro",)))
    assert read(path, Statement(kind="angle", gyros=("gyro",))).gyros[0].name == "gyro"
    assert columns(path) == ("time[s]", "gyro[deg]")


COLUMNS = tuple(column(key) for key in ("t", "x[deg]", "y", "table[deg]", "z", "z[arcsec]", "null"))


def by_caller(**stated):
    return Statements(caller=Statement(**stated))


def test_a_column_is_found_by_its_full_name_or_its_only_short_one():
    assert find(COLUMNS, "x") == COLUMNS[1]
    assert find(COLUMNS, "z") == COLUMNS[4]
    assert find(COLUMNS, "w") is None
    with pytest.raises(
        RecordingError, match=r"z: more than one column has this name, z\[a\], z\[b\]"
    ):
        find((column("z[a]"), column("z[b]")), "z")


def test_gyros_are_those_stated_else_x_y_z():
    assert list(choose_gyros(COLUMNS, Statements())) == ["x", "y", "z"]
    chosen = choose_gyros(COLUMNS, by_caller(gyros=("left",), columns={"left": "z[arcsec]"}))
    assert chosen == {"left": COLUMNS[5]}
    # Columns that have another role are no gyros.
    chosen = choose_gyros(COLUMNS, by_caller(columns={"y": "y", "table": "t"}))
    assert chosen == {"y": COLUMNS[2]}
    with pytest.raises(RecordingError, match=r"w: no such column; the file has t, "):
        choose_gyros(COLUMNS, by_caller(gyros=("w",)))
    with pytest.raises(RecordingError, match="x, y, z: no such column; the file has a;"):
        choose_gyros((column("a"),), Statements())


def table_of(**stated):
    return choose(COLUMNS, by_caller(gyros=("z[arcsec]",), **stated)).table


def test_the_table_is_the_one_stated_in_its_unit_or_the_first_of_a_usual_name():
    assert table_of() == COLUMNS[3]
    assert table_of(table="none") is None
    assert table_of(table="y:arcsec") == replace(COLUMNS[2], unit="arcsec")
    assert table_of(table="x[deg]") == COLUMNS[1]
    assert table_of(columns={"table": "y"}) == COLUMNS[2]
    assert choose(COLUMNS, by_caller(gyros=("table",))).table is None
    with pytest.raises(RecordingError, match=r"w: no such column.*table=COLUMN:UNIT"):
        table_of(table="w:deg")


def test_a_column_that_looks_like_the_table_is_offered():
    def said(*keys, **stated):
        notes = choose(tuple(map(column, ("x[deg]", *keys))), by_caller(**stated)).notes
        return [str(note) for note in notes]

    (offer,) = said("EncoderAngle", "temperature[K]")
    assert "column EncoderAngle looks like the table's angle and is not taken" in offer
    assert "table=EncoderAngle:UNIT" in offer
    assert "table=Drehtisch:gon" in said("Drehtisch[gon]")[0]
    # A number goes through a shell, and through the braces of a text, as no such name does.
    named = [
        replace(column(name), number=number)
        for number, name in enumerate(("x", "{encoder angle}"), 1)
    ]
    assert "table=2:UNIT" in str(choose(named, by_caller(gyros=("x",))).notes[0])
    # What is no angle, or a time, or beside a table that is taken or not wanted, is not.
    for keys in (["encoder_time"], ["table_speed[deg/s]"], ["roll"], ["EncoderAngle", "table"]):
        assert said(*keys) == []
    assert said("EncoderAngle", table="none") == said("EncoderAngle", table="EncoderAngle") == []


def test_stamps_without_a_unit_are_left_out_if_a_rate_is_stated():
    assert choose(COLUMNS, by_caller(gyros=("y",))).time == COLUMNS[0]
    choice = choose(COLUMNS, by_caller(gyros=("y",), sample_rate=1.0))
    assert choice.time is None
    assert [note.channel for note in choice.notes] == ["time"]
    assert "{time t:UNIT} takes it" in choice.notes[0].text
    with_unit = by_caller(gyros=("y",), sample_rate=1.0, unit={"time": "ms"})
    assert choose(COLUMNS, with_unit).time == replace(COLUMNS[0], unit="ms")


def test_the_null_pulse_is_taken_only_by_its_name():
    assert choose(COLUMNS, by_caller(gyros=("y",))).null_pulse is None
    assert choose(COLUMNS, by_caller(gyros=("y",), null_pulse="null")).null_pulse == COLUMNS[6]
    named = (*COLUMNS, column("null_pulse"))
    assert choose(named, by_caller(gyros=("y",))).null_pulse == named[-1]
    assert choose(named, by_caller(gyros=("y",), null_pulse="none")).null_pulse is None


def test_a_column_is_no_two_channels():
    stated = by_caller(gyros=("x",), table="x:deg")
    with pytest.raises(RecordingError, match=r"x\[deg\]: the column is named for two channels"):
        choose(COLUMNS, stated)
    choice = choose(COLUMNS, by_caller(gyros=("y", "x"), null_pulse="null"))
    assert choice.keys == ("y", "x[deg]", "table[deg]", "t", "null")
