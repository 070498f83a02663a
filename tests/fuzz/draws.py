"""How much is drawn, by which seed, and a command that is called with it."""

import contextlib
import io
import os

from sagnac.cli import main

SEED = 20_130_227


def part_of(most: int) -> int:
    """Draws, of which SAGNAC_FUZZ takes a part."""
    return max(1, round(most * float(os.environ.get("SAGNAC_FUZZ", "1"))))


def called(words: list[str]) -> tuple[int | str, str, str]:
    """Status of a command, or the exception that escapes it; what it prints, and its errors."""
    out, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
        try:
            status: int | str = main(words)
        except BaseException as error:
            status = f"ESCAPED {type(error).__name__}: {str(error)[:200]!r}"
    return status, out.getvalue(), errors.getvalue()
