"""Texts that are written whole."""

import os

from sagnac.core.whole_files import write_text


def test_a_name_that_the_encoding_of_the_system_did_not_read_is_written_as_its_bytes(tmp_path):
    path = tmp_path / "said.txt"
    name = "😀.csv".encode().decode("ascii", "surrogateescape")
    write_text(path, f"of {name}")
    assert path.read_text(encoding="utf-8") == "of 😀.csv"
    # Bytes that are none of UTF-8 leave a page that can be read.
    write_text(path, f"of {os.fsdecode(b'a' + bytes([0xFF]))}")
    assert path.read_text(encoding="utf-8") == "of a\N{REPLACEMENT CHARACTER}"
