"""``sagnac check``: the quality of the data."""

import re

from sagnac.cli import main
from tests.cli.examples import STATED, one_line_among, strict


def test_check_is_0_on_sound_data_and_1_on_an_error(recording, bare, capsys, tmp_path):
    assert main(["check", str(recording)]) == 0
    assert "senses" in capsys.readouterr().out
    spoilt = tmp_path / "spoilt.csv"
    lines = bare.read_text().splitlines()
    lines[1000] = "nan"
    spoilt.write_text("\n".join(lines) + "\n")
    assert main(["check", str(spoilt), *STATED]) == 1
    captured = capsys.readouterr()
    assert re.search(r"error +x +1 sample", captured.out)
    line = one_line_among(captured.err)
    assert str(spoilt) in line
    assert "--slice" in line
    assert main(["check", str(spoilt), *STATED, "--json"]) == 1
    made = strict(capsys.readouterr().out)
    assert made["schema"] == "sagnac.check/1"
    assert made["findings"][0]["level"] == "error"
