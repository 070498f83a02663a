"""Files and folders that change whole or not at all, and what dead processes leave."""

import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile

import pytest

from sagnac.core.errors import RecordingError
from sagnac.core.whole_files import (
    made,
    remove_leftovers,
    replacing,
    replacing_folder,
    replacing_set,
    write_text,
)


def dead_process() -> int:
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_nothing_is_left_of_a_file_that_cannot_be_written(tmp_path):
    with pytest.raises(RecordingError, match="cannot be written"):
        write_text(tmp_path / "none" / "a.json", "{}")
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_replaced_whole_or_stays(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("old")
    with pytest.raises(ZeroDivisionError), replacing(path) as temporary:
        temporary.write_text(f"half {1 / 0}")
    assert path.read_text() == "old"
    with replacing(path) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "new"
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.csv"]


def test_a_full_disk_names_the_file(tmp_path):
    said = pytest.raises(RecordingError, match=r"run\.csv: cannot be written \(No space left")
    with said, replacing(tmp_path / "run.csv"):
        raise OSError(28, "No space left on device")
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_names_a_file_in_a_folder_of_the_report_by_its_place(tmp_path):
    folder = tmp_path / "report"
    place = re.escape(str(folder / "x" / "stability.csv"))
    said = pytest.raises(RecordingError, match=rf"^{place}: cannot be written \(No space left")
    with said, replacing_folder(folder) as part, replacing(made(part / "x") / "stability.csv"):
        raise OSError(28, "No space left on device")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("write", [replacing, replacing_set, replacing_folder])
def test_a_signal_that_comes_with_the_part_takes_it_away(write, tmp_path, monkeypatch):
    makes = tempfile.mkdtemp

    def makes_and_stops(*given, **named):
        part = makes(*given, **named)
        signal.raise_signal(signal.SIGINT)
        return part

    monkeypatch.setattr(tempfile, "mkdtemp", makes_and_stops)
    with pytest.raises(KeyboardInterrupt), write(tmp_path / "run.csv"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_folder_is_replaced_whole_and_keeps_what_is_not_of_the_set(tmp_path):
    folder = tmp_path / "report"
    with replacing_folder(folder) as new:
        (new / "a").write_text("1")
        (new / "b").write_text("1")
    (folder / "mine").write_text("kept")
    (folder / "more").mkdir()
    (folder / "more" / "too").write_text("kept")
    with pytest.raises(RecordingError, match="No such file"), replacing_folder(folder) as new:
        shutil.copy("nowhere", shutil.copy(folder / "b", new / "a"))
    assert (folder / "a").read_text() == (folder / "b").read_text() == "1"
    with replacing_folder(folder) as new:
        (new / "a").write_text("2")
        (new / "b").write_text("2")
        (new / "more").mkdir()
        (new / "more" / "b").write_text("2")
    assert (folder / "more" / "b").read_text() == "2"
    assert (folder / "a").read_text() == (folder / "b").read_text() == "2"
    assert (folder / "mine").read_text() == (folder / "more" / "too").read_text() == "kept"
    assert [entry.name for entry in tmp_path.iterdir()] == ["report"]


def test_a_folder_with_files_of_others_or_worked_in_stays_where_it_is(tmp_path, monkeypatch):
    """Who writes into it, or has it open, loses nothing."""
    for name in ("shared", "here"):
        folder = tmp_path / name
        folder.mkdir()
        if name == "here":
            monkeypatch.chdir(folder)
        else:
            (folder / "growing.csv").write_text("1\n")
        (folder / "a").write_text("old")
        place = folder.stat().st_ino
        with (folder / "growing.csv").open("a") as stream:
            with replacing_folder(folder) as new:
                (new / "a").write_text("new")
            stream.write("2\n")
        assert folder.stat().st_ino == place
        assert (folder / "a").read_text() == "new"
        assert (folder / "growing.csv").read_text().endswith("2\n")


def test_leftovers_of_dead_processes_go_and_those_of_the_living_stay(tmp_path):
    dead = dead_process()
    gone = [tmp_path / f".run.csv.{dead}.abc.part", tmp_path / f".run.csv.{dead}.def.part"]
    gone[0].write_text("half")
    gone[1].mkdir()
    (gone[1] / "half").write_text("half")
    kept = [tmp_path / f".run.csv.{os.getpid()}.abc.part", tmp_path / f".other.csv.{dead}.x.part"]
    for path in kept:
        path.write_text("half")
    remove_leftovers(tmp_path / "run.csv")
    assert sorted(tmp_path.iterdir()) == sorted(kept)


def test_a_full_disk_refuses_a_file_of_hdf5_in_one_line(tmp_path):
    made = "sagnac.Recording.from_arrays(x=range(2000), kind='rate', unit='deg/s', sample_rate=10)"
    full = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))"
    run = f"{full}; import sys, sagnac; sagnac.write({made}, sys.argv[1])"
    given = [sys.executable, "-B", "-c", run, str(tmp_path / "run.h5")]
    done = subprocess.run(given, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "run.h5: cannot be written (File too large)" in done.stderr.splitlines()[-1]
    assert list(tmp_path.iterdir()) == []
