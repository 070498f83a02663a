"""Folders, and the files that go into them."""

from pathlib import Path

import pytest

from sagnac.cli.output import folders_of, require_place
from sagnac.core.errors import RecordingError
from sagnac.core.whole_files import made


def test_files_of_one_name_do_not_share_a_folder():
    folders = folders_of([Path("a/run.csv"), Path("b/run.csv")], Path("out"), as_json=False)
    assert len(set(folders)) == 2
    assert folders_of([Path("a/run.csv")], None, as_json=False) == [Path("run-report")]
    assert folders_of([Path("a.csv")], None, as_json=True) == [None]


def test_the_folder_one_stands_in_gives_the_report_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(made(tmp_path / "unit 7"))
    assert folders_of([Path(".")], None, as_json=False) == [Path("unit 7-report")]


def test_a_folder_below_a_file_is_refused_and_nothing_is_made(tmp_path):
    (tmp_path / "file").write_text("mine")
    for folder in (tmp_path / "file", tmp_path / "file" / "deep"):
        with pytest.raises(RecordingError, match="choose another"):
            require_place(folder, "report")
        with pytest.raises(RecordingError, match="choose another"):
            made(folder)
    require_place(tmp_path / "none" / "deep", "report")
    assert [item.name for item in tmp_path.iterdir()] == ["file"]
