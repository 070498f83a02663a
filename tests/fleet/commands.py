"""Campaigns by the command line, in this process or in one of its own."""

import csv
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from sagnac.cli import main
from tests.conftest import in_one_process, undrawn
from tests.processes import SAGNAC

PATTERN = "(?P<unit>[A-Z])_day(?P<day>[0-9])"


SHARED = ("campaign", "--method", "none", "--pattern", PATTERN)


def campaign(*arguments: object) -> tuple[int, str, str]:
    """Exit status of a campaign in this process, and what it says."""
    said, errors = StringIO(), StringIO()
    with redirect_stdout(said), redirect_stderr(errors), pytest.MonkeyPatch.context() as patch:
        in_one_process(patch)
        undrawn(patch)
        status = main([str(word) for word in (*SHARED, *arguments)])
    return status, said.getvalue(), errors.getvalue()


def command(*arguments: str) -> list[str]:
    """Words that start one as a process."""
    return [*SAGNAC, *SHARED, *arguments]


def rows_of(output: Path) -> list[dict[str, str]]:
    """The table of a campaign."""
    with (output / "campaign.csv").open(newline="") as stream:
        return list(csv.DictReader(stream))
