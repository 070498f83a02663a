"""``sagnac campaign``: many recordings in, one table and one page out."""

import re
import signal
import subprocess
import time

import pyarrow.parquet as pq
import pytest

from sagnac.cli import main
from sagnac.cli.options import memory_size
from tests.cli.examples import one_line
from tests.fleet.commands import campaign, command, rows_of
from tests.fleet.conftest import write_rack, write_recording
from tests.processes import started


@pytest.fixture(scope="module")
def rack(tmp_path_factory):
    """The second day is too short for spans."""
    return write_rack(tmp_path_factory.mktemp("rack"), second=90.0)


@pytest.fixture(scope="module")
def done(rack, tmp_path_factory):
    """Its campaign, and the folder of it."""
    output = tmp_path_factory.mktemp("campaign")
    return campaign(rack, "-o", output, "--span", "1min", "--workers", 1), output


def test_every_recording_is_a_row_and_a_damaged_one_says_why(done) -> None:
    (status, said, errors), output = done
    assert status == 1, errors
    assert "C_day1.parquet" in errors
    assert "1 row without an answer left out\n" in said
    rows = rows_of(output)
    whole = [row for row in rows if not row["start_s"]]
    assert [(row["unit"], row["day"]) for row in whole] == [
        ("A", "1"), ("A", "2"), ("B", "1"), ("B", "2"), ("C", "1"),
    ]  # fmt: skip
    assert [row["state"] for row in whole] == ["done"] * 4 + ["failed"]
    assert "damaged" in whole[-1]["reason"]
    for row in whole[:4]:
        assert float(row["low"]) < 1e-3 < float(row["high"])
    assert len(rows) == 5 + 2 * 2
    assert pq.read_table(output / "campaign.parquet").num_rows == len(rows)


def test_page_links_to_reports_that_are_there(done) -> None:
    _, output = done
    page = (output / "index.html").read_text()
    links = re.findall(r'href="(reports/[^"]*)"', page)
    assert len(links) == 4 + 4
    assert all((output / link).is_file() for link in links)
    assert "9 rows: 8 estimated, 1 failed." in page
    assert "between units" in page
    assert "not observable" in page
    # Two days of noise that does not differ: no scatter of zero is claimed.
    assert '<td class="number">0 %</td>' not in page
    assert "0 % … 0 %" not in page
    assert "at most" in page


def test_second_start_does_nothing_again_and_says_the_same(rack, done) -> None:
    _, output = done
    before = (output / "campaign.csv").read_bytes()
    times = {path: path.stat().st_mtime_ns for path in (output / "results").iterdir()}
    status, said, _ = campaign(rack, "-o", output, "--span", "1min", "--workers", 1)
    assert status == 1
    assert "0 rows analyzed now, 9 kept from an earlier start, which was resumed" in said
    assert "replaced" not in said
    assert (output / "campaign.csv").read_bytes() == before
    assert all(path.stat().st_mtime_ns == then for path, then in times.items())


def test_a_campaign_within_its_own_recordings_goes_on(tmp_path) -> None:
    for number, name in enumerate(("A_day1", "B_day1")):
        write_recording(tmp_path / f"{name}.parquet", seed=number, seconds=20.0)
    words = (tmp_path, "-o", tmp_path / "out", "--workers", 1, "--spec", "2e-3 deg/sqrt(h)")
    first, again = campaign(*words), campaign(*words)
    assert first[0] == again[0] == 0, again
    for _, said, _ in (first, again):
        assert "2 of 2 units pass, yield 100 %" in said
    assert "0 rows analyzed now, 2 kept" in again[1]
    # Nor are the tables of one campaign, or of a report, units of the next.
    rows = rows_of(tmp_path / "out")
    assert main(["analyze", rows[0]["file"], "-o", str(tmp_path / "A-report")]) == 0
    status, said, errors = campaign(*words[:2], tmp_path / "more", *words[3:])
    assert (status, errors.count("no such column")) == (0, 0), errors
    assert "2 of 2 units pass" in said


def test_campaign_that_was_ended_goes_on(rack, done, tmp_path) -> None:
    _, whole = done
    files = [str(rack / f"{name}_day1.parquet") for name in "ABC"]
    arguments = (*files, "-o", str(tmp_path), "--workers", "1")
    with started(*command(*arguments), stdout=subprocess.DEVNULL) as process:
        for _ in range(3000):
            if list(tmp_path.glob("results/*.json")):
                break
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.glob("results/*.json")}
    assert 1 <= len(kept) < 3
    assert process.returncode == 130
    assert "Traceback" not in said
    _, again, _ = campaign(*arguments)
    assert f" analyzed now, {len(kept)} kept from an earlier start" in again
    assert all(path.stat().st_mtime_ns == then for path, then in kept.items())
    wanted = [row for row in rows_of(whole) if not row["start_s"] and row["day"] == "1"]
    assert rows_of(tmp_path) == wanted


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("nowhere.toml",), "nowhere.toml: cannot be read"),
        (("--pattern", "("), "--pattern"),
        (("--workers", "0"), "--workers is 0"),
        (("--scheduler", "tcp://x:1", "--workers", "2"), "a cluster has its own"),
    ],
)
def test_wrong_usage_is_one_line(rack, tmp_path, capsys, arguments, said) -> None:
    sources = () if arguments[0].endswith(".toml") else (str(rack),)
    words = ("campaign", "--method", "none", *sources, *arguments, "-o", str(tmp_path / "out"))
    assert main(words) in (1, 2)
    assert said in one_line(capsys)
    assert not (tmp_path / "out" / "campaign.csv").exists()


def test_sizes_of_memory() -> None:
    assert memory_size("4GiB") == 4.0 * 2**30
    assert memory_size("800MB") == 8e8
    assert memory_size("1e9") == 1e9
    for wrong in ("", "0", "4 pounds", "-1GB"):
        with pytest.raises(ValueError, match="give a size"):
            memory_size(wrong)


def test_a_mistyped_source_leaves_an_earlier_table_as_it_is(rack, done, tmp_path) -> None:
    """It made a table of one row that could not be read, in place of the earlier one."""
    _, output = done
    before = (output / "campaign.csv").read_bytes()
    status, _, errors = campaign(tmp_path / "rakc", "-o", output)
    assert status == 1
    assert errors.endswith("rakc: no such file; check the path\n")
    assert (output / "campaign.csv").read_bytes() == before
    # One of several is a row that says so.
    status, _, errors = campaign(rack / "A_day1.parquet", tmp_path / "rakc", "-o", tmp_path / "o")
    assert status == 1
    assert "rakc: no such file" in errors
    assert [row["state"] for row in rows_of(tmp_path / "o")] == ["done", "failed"]
