import pytest

from sagnac.fleet.tasks import Result, read_result, result_path, write_result


def test_result_is_kept_and_read(tmp_path) -> None:
    result = Result(key="k", state="done", report="reports/k", analysis={"lines": 3})
    write_result(tmp_path, result)
    assert read_result(tmp_path, "k") == result
    assert [path.name for path in result_path(tmp_path, "k").parent.iterdir()] == ["k.json"]


@pytest.mark.parametrize("text", ["", "{", "[]", '{"schema": "other/1"}'])
def test_file_that_is_no_result_is_done_again(tmp_path, text) -> None:
    write_result(tmp_path, Result(key="k", state="failed", reason="why"))
    result_path(tmp_path, "k").write_text(text)
    assert read_result(tmp_path, "k") is None


def test_reason_belongs_to_what_is_not_done() -> None:
    with pytest.raises(ValueError, match="reason"):
        Result(key="k", state="failed")
    with pytest.raises(ValueError, match="state is 'late'"):
        Result(key="k", state="late", reason="why")
