"""Pages of the docs that a program makes are no older than what makes them."""

from dataclasses import replace

import pytest
from benchmarks._made import MADE, Made, stated, with_stamp

from sagnac.rig.config import RigConfig, preset
from sagnac.rig.sections import TableConfig


def test_a_page_that_is_older_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr("benchmarks._made.ROOT", tmp_path)
    (tmp_path / "docs").mkdir()
    source = tmp_path / "maker.py"
    source.write_text("a = 1\n")
    made = Made(page="page.md", sources=("*.py",), command="make it", may_be_older=True)
    at = " at 0123abc, 2026-11-22"
    made.path.write_text(with_stamp("# A page\n", made.digest, at))
    by = "by commit 0123abc, 2026-11-22"
    assert made.closing == f"As made {by}; what makes it has not changed since."
    source.write_text("a = 2\n")
    assert f"Made {by}, and **older than what makes it**" in made.closing
    assert "`make it`" in made.closing


@pytest.mark.parametrize("made", MADE, ids=[one.page for one in MADE])
def test_a_made_page_is_not_older_than_what_makes_it(made):
    if made.may_be_older:
        assert made.stamped, f"python -m benchmarks._made --stamp {made.page}"
        return
    assert made.stamped == made.digest, (
        f"docs/{made.page} is older than what makes it: {made.command}; or, if its figures still "
        f"hold, python -m benchmarks._made --stamp {made.page}"
    )


@pytest.mark.parametrize("made", MADE, ids=[one.page for one in MADE])
def test_every_source_is_there(made):
    for pattern in made.sources:
        assert list(made.path.parents[1].glob(pattern)), pattern


def test_a_changed_source_and_a_changed_setting_change_the_digest(tmp_path, monkeypatch):
    monkeypatch.setattr("benchmarks._made.ROOT", tmp_path)
    source = tmp_path / "maker.py"
    source.write_bytes(b"a = 1\n")
    made = Made(page="page.md", sources=("*.py",), command="make")
    first = made.digest
    source.write_bytes(b"a = 1\r\n")
    assert made.digest == first
    source.write_bytes(b"a = 2\n")
    assert made.digest != first
    assert replace(made, settings=lambda: [1]).digest != made.digest


def test_a_page_is_stamped_once():
    page = with_stamp("# A page\n", "0" * 12)
    assert page.endswith(f"\n\n<!-- Made from {'0' * 12} -->\n")
    assert with_stamp(page, "1" * 12).count("Made from") == 1


def test_what_is_stated_leaves_defaults_out():
    assert stated(RigConfig()) == {}
    assert stated(RigConfig(table=TableConfig(rate_deg_per_s=10.0))) == {
        "table": {"rate_deg_per_s": 10.0}
    }
    changed = replace(preset("paper"), seed=7)
    assert stated(changed)["seed"] == 7
    assert stated(changed)["disturbances"] == stated(preset("paper"))["disturbances"]
