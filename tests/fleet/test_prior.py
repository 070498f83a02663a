"""What a campaign foretells of N, and what that means for azimuth."""

import json
import math
from dataclasses import replace

import pytest

from sagnac.cli import app as cli
from sagnac.core.errors import RecordingError
from sagnac.core.units import ARCSECOND, DEGREE, DEGREE_PER_ROOT_HOUR, EARTH_RATE
from sagnac.fleet.study import Run, repeatability
from sagnac.fleet.table import Line, prior_of, read_table, write_tables
from sagnac.paper.prediction import TABLE_2

NAN = math.nan
EMPTY = Line(
    file="", unit="x-z", day="1", rate_deg_per_s=40.0, method="fos", gyros="x,z", start_s=NAN,
    stop_s=NAN, state="done", status="estimated", n_deg_per_sqrt_h=1e-4, low=NAN, high=NAN,
    confidence=0.95, b_deg_per_h=NAN, k_deg_per_h_per_sqrt_h=NAN, band_low_hz=NAN,
    band_high_hz=NAN, verdict="", duration_s=7200.0, lines=0, notes=0, reason="", report="",
    key="",
)  # fmt: skip
TABLE = [
    replace(EMPTY, day=str(day), rate_deg_per_s=rate, n_deg_per_sqrt_h=value)
    for rate, days in TABLE_2.items()
    for day, value in enumerate(days, start=1)
]


def test_a_table_is_read_as_it_was_written(tmp_path):
    write_tables(TABLE, tmp_path)
    assert repr(read_table(tmp_path)) == repr(TABLE)
    assert repr(read_table(tmp_path / "campaign.csv")) == repr(TABLE)


def test_table_2_foretells_what_its_statistics_say(tmp_path):
    write_tables(TABLE, tmp_path)
    runs = [
        Run(value=value, labels={"unit": "x-z", "day": str(day), "rate": f"{rate:g}"})
        for rate, days in TABLE_2.items()
        for day, value in enumerate(days, start=1)
    ]
    for confidence in (0.95, 0.6827):
        foretold = repeatability(runs, confidence=confidence).next_day["x-z"]
        noise, words = prior_of(tmp_path, confidence=confidence)
        assert noise.angle_random_walk == pytest.approx(foretold.value * DEGREE_PER_ROOT_HOUR)
        assert "foretold for unit x-z on a new day, at a new rate by 15 runs" in words
        assert f"{foretold.low:.3g}, {foretold.high:.3g}" in words


def test_a_file_that_failed_is_left_out_and_told_of(tmp_path, capsys):
    failed = replace(
        EMPTY, gyros="", state="failed", status="", n_deg_per_sqrt_h=NAN, reason="is no Parquet"
    )
    noises = {}
    for name, table in (("sound", TABLE), ("damaged", [*TABLE, failed])):
        (tmp_path / name).mkdir()
        write_tables(table, tmp_path / name)
        noises[name], words = prior_of(tmp_path / name)
        assert ("1 row without an answer left out" in words) == (name == "damaged")
        assert "without a unit" not in words
        assert cli.main(["align", str(tmp_path / name)]) == 0
        assert words in capsys.readouterr().out
    assert repr(noises["sound"]) == repr(noises["damaged"])
    write_tables([failed], tmp_path)
    with pytest.raises(RecordingError, match="holds no recording with an answer"):
        prior_of(tmp_path)


def test_a_file_without_a_unit_is_told_of(tmp_path):
    write_tables([*TABLE, replace(EMPTY, unit="", day="1")], tmp_path)
    assert prior_of(tmp_path)[1].endswith("; 1 row without a unit, each taken for one of its own")


def test_an_interval_of_n_alone_says_so(tmp_path, capsys):
    """It stood as 95 % of heading, which K of such gyros made ten times as large."""
    write_tables(TABLE, tmp_path)
    arguments = ["--latitude", "28.2", "--table-rate", "40", "--after", "10min"]
    assert cli.main(["align", str(tmp_path), *arguments]) == 0
    shown = capsys.readouterr().out.splitlines()
    for line in ("heading drift", "gyrocompass", "triad turning"):
        (one,) = [text for text in shown if text.strip().startswith(line)]
        assert "] 95 %, without B and K" in one
    assert "B and K are not foretold: the analysis of a run has them" in "".join(shown)
    assert not any("not observable" in text for text in shown)


def test_azimuth_of_what_is_foretold_has_its_interval(tmp_path, capsys):
    """N over the root of t and the north rate, at the median and at both ends that are foretold."""
    write_tables(TABLE, tmp_path)
    arguments = ["--latitude", "28.2", "--time", "10min", "--table-rate", "40", "--json"]
    assert cli.main(["align", str(tmp_path), *arguments]) == 0
    found = json.loads(capsys.readouterr().out)
    runs = [Run(value=line.n_deg_per_sqrt_h, labels={"unit": "x-z", "day": line.day,
                "rate": f"{line.rate_deg_per_s:g}"}) for line in TABLE]  # fmt: skip
    foretold = repeatability(runs).next_day["x-z"]
    per_walk = DEGREE_PER_ROOT_HOUR / math.sqrt(600.0) / (EARTH_RATE * math.cos(28.2 * DEGREE))
    expected = [
        walk * per_walk / (60.0 * ARCSECOND)
        for walk in (foretold.value, foretold.low, foretold.high)
    ]
    rotating = found["rotating_triad"]
    shown = [rotating[name] for name in ("azimuth_arcmin", "low_arcmin", "high_arcmin")]
    assert shown == pytest.approx(expected, rel=0.03)
    assert "foretold" in found["notes"][0]
    assert cli.main(["align", str(tmp_path), "--latitude", "28.2", "--table-rate", "0.1"]) == 2
    assert "table rate: times must be of a turn, 3600 s" in capsys.readouterr().err


def test_a_campaign_that_foretells_nothing_is_refused(tmp_path):
    (tmp_path / "campaign.csv").write_text("file,unit\na,b\n")
    with pytest.raises(RecordingError, match=r"no table of a campaign; give an analysis\.json, "):
        prior_of(tmp_path)
    with pytest.raises(RecordingError, match="cannot be read"):
        prior_of(tmp_path / "campaign")
    write_tables([*TABLE, replace(EMPTY, gyros="y")], tmp_path)
    with pytest.raises(RecordingError, match="holds fos of x,z; fos of y"):
        prior_of(tmp_path)
    write_tables(TABLE[:2], tmp_path)
    with pytest.raises(RecordingError) as caught:
        prior_of(tmp_path)
    assert caught.value.path == str(tmp_path)
    days = [replace(EMPTY, rate_deg_per_s=rate, n_deg_per_sqrt_h=1e-4 + 1e-6 * rate)
            for rate in (10.0, 20.0, 40.0, 60.0)]  # fmt: skip
    write_tables(days, tmp_path)
    with pytest.raises(RecordingError, match="days"):
        prior_of(tmp_path)
