"""One line for each error, and the exit status that it means."""

import errno
import os

import pytest

from sagnac.cli.output import DATA_ERROR, USAGE_ERROR, UsageError, explain
from sagnac.core.errors import MissingExtra, RecordingError


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (
            RecordingError(
                "3 samples are not finite", path="a.csv", channel="x",
                remedy="take the sound stretch ({slice 30:90})",
            ),
            DATA_ERROR,
            "a.csv: x: 3 samples are not finite; take the sound stretch (--slice 30:90)",
        ),
        (UsageError("--rate and --time\nexclude each other"), USAGE_ERROR, None),
        (ValueError("give {kind}"), USAGE_ERROR, "give --kind"),
        (MissingExtra("a table", "finufft", "table"), DATA_ERROR, None),
        (FileNotFoundError(2, "No such file", "a.csv"), DATA_ERROR, None),
        (MemoryError(), DATA_ERROR, None),
        (KeyError("surprise"), DATA_ERROR, None),
    ],
)  # fmt: skip
def test_one_line_and_its_status(error, status, said, capsys):
    assert explain(error) == status
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    if said is not None:
        assert shown == f"sagnac: {said}\n"


def test_an_interrupt_in_a_compiled_loop_is_one(capsys):
    error = SystemError("the loop returned a result with an exception set")
    error.__cause__ = KeyboardInterrupt()
    assert explain(error) == 130
    assert capsys.readouterr().err == "sagnac: interrupted\n"


@pytest.mark.parametrize(("number", "remedy"), [("EMFILE", "ulimit -n"), ("EACCES", "its rights")])
def test_too_many_open_files_are_no_matter_of_rights(number, remedy, capsys):
    code = getattr(errno, number)
    assert explain(OSError(code, os.strerror(code))) == 1
    assert remedy in capsys.readouterr().err


def test_a_message_fits_ten_lines_and_moves_no_cursor(capsys):
    assert explain(RecordingError("is odd", path="\x1b[2J" + "x" * 5000, remedy="look at it")) == 1
    said = capsys.readouterr().err
    assert len(said) <= 800
    assert said.startswith("sagnac: \\u001b[2Jxxx")
    assert said.endswith("xxx: is odd; look at it\n")
