"""Files that lie, hide or lack something: refused in one line, or read as they are."""

import os
import zipfile
from pathlib import Path

import h5py
import numpy as np
import pyarrow.parquet as pq
import pytest
import scipy.io

from sagnac.core.errors import RecordingError
from sagnac.formats import Statement, read, write
from sagnac.formats.files import limited, require_content, require_room
from sagnac.formats.matlab import open_source as open_matlab
from sagnac.recording.model import Recording
from tests.formats.examples import imu, refused, walk

STATED = Statement(kind="rate", unit="deg/s", sample_rate=100.0)


def outcome(path) -> str:
    """What is said of a file: an error in one line, or what was read."""
    try:
        return repr(read(path, STATED))
    except RecordingError as error:
        return str(error)


def mat(path, **arrays):
    scipy.io.savemat(path, {"x": walk()[:, None], **arrays})
    return path


def test_a_matlab_type_tag_that_is_none_is_refused_before_the_library_sees_it(tmp_path):
    path = mat(tmp_path / "run.mat")
    assert [one.name for one in open_matlab(path).columns] == ["x"]
    sound = path.read_bytes()
    # Flags, dimensions, name, then the numbers: doubles are of type 9.
    tag = sound.index(b"\x09\0\0\0", 128 + 8 + 16 + 16)
    for kind in (0, 8, 10, 11, 14, 15, 19, 20, 200, 255):
        path.write_bytes(sound[:tag] + bytes([kind]) + sound[tag + 1 :])
        refused(path, "type", statement=STATED)
    path.write_bytes(sound[: tag + 4] + (2**31).to_bytes(4, "little") + sound[tag + 8 :])
    refused(path, "bytes are missing", statement=STATED)
    path.write_bytes(sound[:-4])
    refused(path, "missing", statement=STATED)


def test_every_byte_of_a_matlab_head_may_be_damaged(tmp_path):
    path = mat(tmp_path / "run.mat")
    sound = path.read_bytes()
    random = np.random.default_rng(4)
    for place in range(124, 200):
        for value in random.integers(0, 256, 3).tolist():
            path.write_bytes(sound[:place] + bytes([value]) + sound[place + 1 :])
            assert "\n" not in outcome(path)


@pytest.mark.parametrize("compressed", [False, True])
def test_compressed_matlab_elements_are_checked_too(tmp_path, compressed):
    scipy.io.savemat(tmp_path / "run.mat", {"x": walk()}, do_compression=compressed)
    source = open_matlab(tmp_path / "run.mat")
    assert source.opened(["x"]).lengths == {"x": walk().size}
    np.testing.assert_allclose(
        read(tmp_path / "run.mat", STATED).gyros[0].values, np.deg2rad(walk()), rtol=1e-14
    )


@pytest.mark.usefixtures("trusted_hdf5")
def test_a_gyro_without_real_numbers_is_not_left_out_in_silence(tmp_path):
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["x"] = [b"1", b"2"]
        file["y"], file["z"] = walk(1), walk(2)
    refused(tmp_path / "run.h5", "x: holds object values", statement=STATED)
    taken = read(tmp_path / "run.h5", Statement(**{**_fields(STATED), "gyros": ("y", "z")}))
    assert [gyro.name for gyro in taken.gyros] == ["y", "z"]
    mat(tmp_path / "run.mat", y=walk() + 1j)
    refused(tmp_path / "run.mat", "y: holds complex values", statement=STATED)
    np.savez(tmp_path / "run.npz", x=walk() + 1j, z=walk())
    refused(tmp_path / "run.npz", "x: holds values of kind 'c'", statement=STATED)


def _fields(statement: Statement) -> dict[str, object]:
    return {"kind": "rate", "unit": "deg/s", "sample_rate": statement.sample_rate}


@pytest.mark.usefixtures("trusted_hdf5")
def test_holes_of_hdf5_are_no_zeros(tmp_path):
    with h5py.File(tmp_path / "chunks.h5", "w") as file:
        file.create_dataset("x", (1000,), "f8", chunks=(100,))[:500] = walk()[:500]
    refused(tmp_path / "chunks.h5", "5 of 10 chunks", statement=STATED)
    with h5py.File(tmp_path / "none.h5", "w") as file:
        file.create_dataset("x", (1000,), "f8")
    refused(tmp_path / "none.h5", "never written", statement=STATED)
    samples = walk().size
    layout = h5py.VirtualLayout(shape=(samples,), dtype="f8")
    layout[:] = h5py.VirtualSource("part.h5", "x", shape=(samples,))
    with h5py.File(tmp_path / "virtual.h5", "w") as file:
        file.create_virtual_dataset("x", layout)
    refused(tmp_path / "virtual.h5", "part.h5", "not there", statement=STATED)
    with h5py.File(tmp_path / "part.h5", "w") as file:
        file["x"] = walk()
    assert read(tmp_path / "virtual.h5", STATED).samples == samples


def virtual(path, source, name="x"):
    """A file whose dataset is that of another one."""
    layout = h5py.VirtualLayout(shape=walk().shape, dtype="f8")
    layout[:] = h5py.VirtualSource(str(source), name, shape=walk().shape)
    with h5py.File(path, "w") as file:
        file.create_virtual_dataset("x", layout)
    return path


def external(path, secret, **attributes):
    """A file whose dataset is the bytes of any other."""
    with h5py.File(path, "w") as file:
        made = file.create_dataset("x", walk().shape, "f8", external=[(str(secret), 0, 4800)])
        made.attrs.update(attributes)
    return path


@pytest.mark.usefixtures("trusted_hdf5")
@pytest.mark.parametrize("attributes", [{}, {"_FillValue": -999.0}])
@pytest.mark.parametrize("suffix", ["h5", "nc"])
def test_external_storage_reads_no_other_file(tmp_path, suffix, attributes):
    secret = tmp_path / "secret.bin"
    walk().tofile(secret)
    path = external(tmp_path / f"run.{suffix}", secret, **attributes)
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["x"], walk())  # the library would
    refused(path, "x: its values lie in another file", str(secret), "h5repack", statement=STATED)
    with h5py.File(path, "w") as file:
        file["x"] = walk()
        file["x"].attrs.update(attributes)
    np.testing.assert_allclose(read(path, STATED).gyros[0].values, np.deg2rad(walk()), rtol=1e-14)


@pytest.mark.usefixtures("trusted_hdf5")
def test_parts_of_a_virtual_dataset_lie_in_its_folder(tmp_path):
    inside = tmp_path / "in"
    (inside / "below").mkdir(parents=True)
    for folder in (tmp_path, inside / "below"):
        with h5py.File(folder / "part.h5", "w") as file:
            file["x"] = walk()
    (inside / "link.h5").symlink_to(tmp_path / "part.h5")
    path = inside / "run.h5"
    for source in ("../part.h5", tmp_path / "part.h5", "below/../../part.h5", "link.h5"):
        virtual(path, source)
        with h5py.File(path) as file:
            np.testing.assert_array_equal(file["x"], walk())  # the library would
        refused(path, "x: a part of it lies outside the folder", statement=STATED)
    virtual(path, "below/part.h5")
    np.testing.assert_allclose(read(path, STATED).gyros[0].values, np.deg2rad(walk()), rtol=1e-14)


@pytest.mark.usefixtures("trusted_hdf5")
def test_a_part_that_has_parts_leads_nowhere_else(tmp_path):
    inside = tmp_path / "in"
    inside.mkdir()
    with h5py.File(tmp_path / "part.h5", "w") as file:
        file["x"] = walk()
    walk().tofile(tmp_path / "secret.bin")
    virtual(inside / "virtual.h5", "../part.h5")
    external(inside / "external.h5", tmp_path / "secret.bin")
    with h5py.File(inside / "linked.h5", "w") as file:
        file["x"] = h5py.ExternalLink("../part.h5", "x")
    for name in ("virtual.h5", "external.h5", "linked.h5"):
        path = virtual(inside / "run.h5", name)
        with h5py.File(path) as file:
            np.testing.assert_array_equal(file["x"], walk())  # the library would
        refused(path, f"x: {name} takes x from elsewhere in turn", statement=STATED)


def test_an_address_of_a_text_that_ends_the_library_is_refused(tmp_path):
    recording = Recording.from_arrays(
        x=walk(), z=walk(2), kind="rate", unit="deg/s", sample_rate=100.0
    )
    sound = write(recording, tmp_path / "run.h5").read_bytes()
    # A global heap collection holds the texts; its objects say their sizes.
    heap = sound.index(b"GCOL")
    random = np.random.default_rng(5)
    for place in random.integers(heap + 4, heap + 200, 4).tolist():
        (tmp_path / "run.h5").write_bytes(sound[:place] + b"\xff\x7f" + sound[place + 2 :])
        assert "\n" not in outcome(tmp_path / "run.h5")


@pytest.mark.usefixtures("trusted_hdf5")
def test_datasets_that_are_not_asked_for_cost_nothing(tmp_path):
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["x"] = walk()
        file.create_dataset("other", (2**26, 2**26), "f8", chunks=(1024, 1024))
    assert read(tmp_path / "run.h5", STATED).samples == walk().size


def test_what_is_declared_is_held_against_memory_and_file(tmp_path):
    np.savez(tmp_path / "run.npz", x=walk())
    with limited(1000):
        refused(tmp_path / "run.npz", "x takes", "{memory}".strip("{}"), statement=STATED)
    with zipfile.ZipFile(tmp_path / "run.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        head = str({"descr": "<f8", "fortran_order": False, "shape": (10**8,)}).encode()
        head = head.ljust(117) + b"\n"
        archive.writestr("x.npy", b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head)
    refused(tmp_path / "run.npz", "declares 800000000 bytes", statement=STATED)
    require_room(2**30, "x")
    require_content(10**6, 10**3, "x")
    with pytest.raises(ValueError, match="memory is 0"), limited(0):
        pass


@pytest.mark.parametrize("suffix", ["csv", "npz", "mat", "h5", "parquet", "imu"])
def test_only_regular_files_are_opened(tmp_path, suffix):
    os.mkfifo(tmp_path / f"run.{suffix}")
    refused(tmp_path / f"run.{suffix}", "no regular file")


@pytest.mark.skipif(not Path("/proc/version").is_file(), reason="asks Linux for its files")
@pytest.mark.parametrize("suffix", ["csv", "imu", "bin"])
def test_a_file_that_the_system_makes_as_it_is_read_is_refused(tmp_path, suffix):
    (tmp_path / f"run.{suffix}").symlink_to("/proc/version")
    refused(tmp_path / f"run.{suffix}", "made by the system", "copy it")


@pytest.mark.parametrize("name", ["unit.euroc", "folder"])
def test_a_folder_that_lacks_what_it_should_hold_is_refused_by_that(tmp_path, name):
    (tmp_path / name / "imu0").mkdir(parents=True)
    refused(tmp_path / name, "is a folder without mav0/imu0/data.csv", "metadata.yaml")


def test_what_cannot_be_parsed_is_said_in_words(tmp_path):
    rows = "x\n" + "1\n2\n" * 200
    for content, said in (
        (b"kind = 3", "kind is 3; use one of angle"),
        (b"sample_rate = 'fast'", "sample_rate is 'fast'; give a number"),
        (b"counter_bits = '4.5'", "counter_bits is '4.5'; give a whole number"),
        (b"\xff\xfe", "byte 1 is none of UTF-8"),
    ):
        (tmp_path / "run.csv").write_text(rows)
        (tmp_path / "run.csv.toml").write_bytes(content)
        refused(tmp_path / "run.csv", said)
    (tmp_path / "run.bin").write_bytes(bytes(800))
    layout = {"fields": [["x", "f8"]], "sync": "zz"}
    refused(tmp_path / "run.bin", "'zz'; give bytes of sync", statement=Statement(layout=layout))


def test_a_psins_log_without_its_header_is_refused(tmp_path):
    path, _ = imu(tmp_path / "run.imu")
    rows = [line for line in path.read_text().splitlines() if not line.startswith("%")]
    path.write_text("\n".join(rows[3:]) + "\n")
    refused(path, "header")


def test_a_psins_log_without_a_last_end_of_line_is_noted(tmp_path):
    path, _ = imu(tmp_path / "run.imu")
    assert not [note for note in read(path).notes if "cut off" in note.text]
    path.write_text(path.read_text().rstrip("\n"))
    assert [note.level for note in read(path).notes if "cut off" in note.text] == ["warning"]


def test_integers_that_would_lose_digits_are_refused(tmp_path):
    np.savez(tmp_path / "run.npz", x=2**60 + np.arange(1000))
    stated = Statement(kind="angle", unit="arcsec", sample_rate=100.0)
    refused(tmp_path / "run.npz", "beyond 2^53", statement=stated)
    np.savez(tmp_path / "run.npz", x=2**60 + 256 * np.arange(1000))
    assert np.ptp(read(tmp_path / "run.npz", stated).gyros[0].values) > 0.0


@pytest.mark.parametrize(
    "line",
    [
        "kind = 5",
        "unit = 3",
        "sample_rate = true",
        "gyros = 7",
        "columns = 1",
        "counter_bits = 1.5",
    ],
)
def test_a_toml_of_wrong_types_is_refused(tmp_path, line):
    (tmp_path / "run.csv").write_text("x\n" + "1\n2\n" * 50)
    (tmp_path / "run.csv.toml").write_text(line + "\n")
    with pytest.raises(RecordingError, match=line.partition(" ")[0]) as caught:
        read(tmp_path / "run.csv")
    assert "run.csv.toml" in str(caught.value)


@pytest.mark.parametrize(
    "name", ["kind", "unit", "sample_rate", "_x", "time", "a#b", " x", "x\x1b"]
)
@pytest.mark.parametrize("suffix", ["csv", "npz", "mat", "h5", "parquet"])
def test_a_name_that_does_not_come_back_is_not_written(tmp_path, name, suffix):
    sound = Recording.from_arrays(x=walk(), kind="rate", unit="deg/s", sample_rate=100.0)
    renamed = type(sound.gyros[0])(name=name, kind="rate", values=sound.gyros[0].values)
    recording = Recording(gyros=(renamed,), sample_rate=100.0)
    with pytest.raises(ValueError, match="cannot stand in a file"):
        write(recording, tmp_path / f"run.{suffix}")
    assert list(tmp_path.iterdir()) == []


def test_pages_of_parquet_carry_checksums_that_are_verified(tmp_path):
    recording = Recording.from_arrays(x=walk(), kind="rate", unit="deg/s", sample_rate=100.0)
    path = write(recording, tmp_path / "run.parquet")
    chunk = pq.read_metadata(path).row_group(0).column(0)
    content = bytearray(path.read_bytes())
    middle = chunk.data_page_offset + chunk.total_compressed_size // 2
    content[middle] ^= 0xFF
    path.write_bytes(content)
    refused(path, "Parquet", statement=Statement())


def test_a_parquet_footer_that_claims_fewer_rows_is_refused(tmp_path):
    recording = Recording.from_arrays(x=walk(), kind="rate", unit="deg/s", sample_rate=100.0)
    path = write(recording, tmp_path / "run.parquet")
    content = path.read_bytes()
    rows = walk().size

    # Thrift writes an i64 as a zigzag variable-length integer.
    def number(value):
        value, found = 2 * value, b""
        while value > 127:
            found, value = found + bytes([value & 127 | 128]), value >> 7
        return found + bytes([value])

    assert len(number(rows)) == len(number(rows - 1))
    start = len(content) - 8 - int.from_bytes(content[-8:-4], "little")
    at = content.index(number(rows), start)
    path.write_bytes(content[:at] + number(rows - 1) + content[at + len(number(rows)) :])
    refused(path, "rows", statement=Statement())


@pytest.mark.parametrize("suffix", ["csv", "mat", "bin"])
def test_a_file_whose_content_was_not_fetched(suffix, tmp_path):
    path = tmp_path / f"run.{suffix}"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:be4b\nsize 2269406\n")
    refused(path, "is a pointer of Git LFS", "git lfs pull")


def test_the_folder_one_stands_in_is_named_as_any_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused(Path("."), "is a folder without mav0/imu0/data.csv", "metadata.yaml")
