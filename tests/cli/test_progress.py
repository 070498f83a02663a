"""Progress without a terminal."""

import sys
import time

from sagnac.cli.output import PATIENCE_S, prefixed, progress_shown, stage_lines


def test_slow_stages_are_told_on_standard_error(capsys):
    tell = stage_lines(sys.stderr)
    tell("read", 0.0)
    assert capsys.readouterr().err == ""
    time.sleep(PATIENCE_S)
    tell("lines", 0.0)
    tell("lines", 0.5)
    tell("stability", 1.0)
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.rstrip().endswith("lines")


def test_a_prefix_goes_before_each_stage():
    told = []
    prefixed(lambda stage, fraction: told.append((stage, fraction)), "x")("lines", 0.5)
    assert told == [("x: lines", 0.5)]


def test_quick_work_is_not_told(capsys):
    with progress_shown("run.csv") as progress:
        progress("read", 0.0)
    assert capsys.readouterr().err == ""
