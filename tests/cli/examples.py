"""What the tests of the commands share."""

import json

STATED = ("--kind", "rate", "--unit", "deg/h", "--rate", "100")


def strict(text: str):
    def refuse(name):
        raise AssertionError(f"{name} is no JSON")

    return json.loads(text, parse_constant=refuse)


def one_line(capsys) -> str:
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("sagnac: ")
    assert "Traceback" not in captured.err
    return captured.err


def one_line_among(text: str) -> str:
    """The one line of `text` that is an error; the others are progress."""
    lines = [line for line in text.splitlines() if line.startswith("sagnac: ")]
    assert len(lines) == 1
    return lines[0]
