"""Binary records of a declared layout."""

import zlib

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.formats import missing, read
from sagnac.formats.binary import CHECKSUMS, declared, open_source
from tests.formats.examples import refused, save

TIMES = np.arange(400) / 64.0
NUMBERS = np.random.default_rng(12).normal(size=(400, 6))


def seven_doubles(path):
    np.column_stack([TIMES, NUMBERS]).astype("<f8").tofile(path)
    return path


def test_a_preset(tmp_path):
    path = seven_doubles(tmp_path / "run.ins")
    refused(path, "its layout is not declared", "--layout NAME")
    assert missing(path, layout="imu7-deg") == {}
    recording = read(path, layout="imu7-deg")
    assert recording.sample_rate == 64.0
    np.testing.assert_allclose(recording.gyros[2].values, np.deg2rad(NUMBERS[:, 2]), rtol=1e-14)
    part = read(path, layout="imu7-rad", span=(1.0, 3.0))
    np.testing.assert_array_equal(part.gyros[0].values, NUMBERS[64:192, 0])


def test_a_layout_beside_the_file_or_in_a_toml_of_its_own(tmp_path):
    path = seven_doubles(tmp_path / "run.dat")
    fields = '[["t", "f8", "s"], ["x", "f8", "deg/s"], ["", "pad40"]]'
    own = save(tmp_path / "unit.toml", f'fields = {fields}\nkind = "rate"\n')
    expected = np.deg2rad(NUMBERS[:, 0])
    np.testing.assert_allclose(read(path, layout=str(own)).gyros[0].values, expected, rtol=1e-14)
    own = own.rename(tmp_path / "run.toml")
    assert read(path, layout=str(own)).notes == ()
    save(tmp_path / "run.dat.toml", f'kind = "rate"\n[layout]\nfields = {fields}\n')
    np.testing.assert_allclose(read(path).gyros[0].values, expected, rtol=1e-14)


def records(counts, checksum):
    """Sync bytes AA 55, big-endian counts, checksum by plain definitions."""
    made = []
    for n, count in enumerate(counts):
        body = int(n).to_bytes(4, "big") + int(count).to_bytes(4, "big", signed=True)
        if checksum == "crc16":
            crc = 0xFFFF
            for byte in body:
                crc ^= byte << 8
                for _ in range(8):
                    crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
            check = crc.to_bytes(2, "big")
        elif checksum == "crc32":
            check = zlib.crc32(body).to_bytes(4, "big")
        elif checksum == "xor8":
            total = 0
            for byte in body:
                total ^= byte
            check = bytes([total])
        else:
            width = int(checksum[3:]) // 8
            check = (sum(body) % 256**width).to_bytes(width, "big")
        made.append(b"\xaa\x55" + body + check)
    return made


@pytest.mark.parametrize("checksum", ["xor8", "sum8", "sum16", "crc16", "crc32"])
def test_sync_bytes_and_checksums_find_the_records_between_what_is_damaged(tmp_path, checksum):
    counts = np.random.default_rng(2).integers(-70_000, 70_000, 300)
    made = records(counts, checksum)
    made[100] = made[100][:4] + bytes([made[100][4] ^ 0xFF]) + made[100][5:]
    made[200] = made[200][:-3]
    path = tmp_path / "run.bin"
    path.write_bytes(b"HEADER" + b"".join(made))
    layout = {
        "fields": [["n", "u4"], ["x", "i4", "0.1arcsec"]],
        "byte_order": "big",
        "header_bytes": 6,
        "sync": "aa55",
        "checksum": checksum,
        "kind": "increment",
    }
    source = open_source(path, layout)
    stored = source.load(["n", "x"])
    (piece,) = stored.pieces(["n", "x"], 0, stored.lengths["x"])
    kept = np.delete(np.arange(300), [100, 200])
    np.testing.assert_array_equal(piece["n"], kept)
    np.testing.assert_array_equal(piece["x"], counts[kept])
    assert "belong to no record" in str(source.notes[0])


def test_crc16_is_the_published_one():
    # CRC catalogue: CRC-16/IBM-3740 of "123456789" is 0x29B1.
    digits = np.frombuffer(b"123456789", np.uint8)[None]
    assert CHECKSUMS["crc16"](digits)[0] == 0x29B1


@pytest.mark.parametrize(
    ("layout", "said"),
    [
        ("none", "layout 'none' is not known"),
        ({"fields": []}, "fields are none"),
        ({"fields": [["x", "f8"], ["x", "f4"]]}, "fields are x, x"),
        ({"fields": [["x", "f2"]]}, "'f2'; use f4"),
        ({"fields": [["x"]]}, "name, type and"),
        ({"field": []}, "'field' is not known"),
        ({"fields": [["x", "f8"]], "byte_order": "middle"}, "byte_order is 'middle'"),
        ({"fields": [["x", "f8"]], "record_bytes": 4}, "record_bytes is 4"),
        ({"fields": [["x", "f8"]], "checksum": "md5"}, "checksum is 'md5'"),
        ({"fields": [["x", "f8"]], "sync": "xy"}, "the layout of the records"),
    ],
)
def test_layouts_that_cannot_be(layout, said):
    with pytest.raises(RecordingError, match=said):
        declared(layout)


def test_files_that_end_within_a_record(tmp_path):
    path = seven_doubles(tmp_path / "run.ins")
    path.write_bytes(path.read_bytes()[:-5])
    recording = read(path, layout="imu7-deg")
    assert recording.samples == 399
    assert any("51 bytes behind the last record" in str(note) for note in recording.notes)
    path.write_bytes(b"12345")
    with pytest.raises(RecordingError, match="shorter than one record of 56 bytes"):
        read(path, layout="imu7-deg")
