"""MATLAB files of both kinds."""

import struct
from contextlib import suppress

import h5py
import numpy as np
import pytest
import scipy.io

from sagnac.core.errors import RecordingError
from sagnac.formats import Statement, read
from sagnac.formats.source import Vector, vectors
from tests.formats.examples import SAMPLES, walk


def test_matlab_matrix_and_version_7_3(tmp_path):
    matrix = np.stack([walk(1), walk(2), walk(3)], axis=1)
    scipy.io.savemat(tmp_path / "run.mat", {"w": matrix, "note": "bench"})
    stated = Statement(kind="rate", unit="deg/s", sample_rate=100.0, columns={"z": "w.3"})
    values = read(tmp_path / "run.mat", stated).gyros[0].values
    np.testing.assert_allclose(values, np.deg2rad(matrix[:, 2]), rtol=1e-14)
    with h5py.File(tmp_path / "new.mat", "w", userblock_size=512) as file:
        file.create_dataset("w", data=matrix.T)
        text_set = file.create_dataset("kind", data=np.frombuffer(b"rate", np.uint8).astype("u2"))
        text_set.attrs["MATLAB_class"] = np.bytes_("char")
    with (tmp_path / "new.mat").open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    again = read(tmp_path / "new.mat", stated).gyros[0].values
    np.testing.assert_array_equal(again, values)


def test_matlab_4_is_read_too(tmp_path):
    matrix = np.stack([walk(1), walk(2), walk(3)], axis=1)
    scipy.io.savemat(tmp_path / "run.mat", {"w": matrix, "kind": "rate"}, format="4")
    stated = Statement(unit="deg/s", sample_rate=100.0, columns={"z": "w.3"})
    values = read(tmp_path / "run.mat", stated).gyros[0].values
    np.testing.assert_allclose(values, np.deg2rad(matrix[:, 2]), rtol=1e-14)


def test_columns_of_arrays():
    assert vectors("w", "w", (9, 1)) == {"w": Vector(array="w", index=None)}
    assert list(vectors("w", "g/w", (3, 9))) == ["w.1", "w.2", "w.3"]
    assert vectors("w", "w", (1, 1)) == vectors("w", "w", (2, 3, 4)) == {}
    matrix = np.arange(12.0).reshape(4, 3)
    for number, vector in enumerate(vectors("w", "w", (4, 3)).values()):
        np.testing.assert_array_equal(vector.of(matrix), matrix[:, number])
        np.testing.assert_array_equal(vector.of(matrix.T), matrix[:, number])


def test_a_file_that_is_hdf5_at_heart_is_read_as_it_is(tmp_path):
    with h5py.File(tmp_path / "plain.mat", "w") as file:
        file.create_dataset("x", data=walk())
    stated = Statement(kind="rate", unit="deg/s", sample_rate=100.0)
    assert read(tmp_path / "plain.mat", stated).samples == SAMPLES


def unit(samples):
    """A struct as users keep one: gyros (samples, 3), a time, text, and a struct in it."""
    rates = np.random.default_rng(3).standard_normal((samples, 3))
    return {
        "gyro": rates,
        "time": np.arange(samples)[:, None] / 100.0,
        "name": "unit 7",
        "info": {"count": np.arange(samples, dtype=np.int16)[:, None] % 7},
    }


@pytest.mark.parametrize("compressed", [False, True])
def test_fields_of_a_struct_are_columns(compressed, tmp_path):
    imu = unit(200)
    path = tmp_path / "run.mat"
    scipy.io.savemat(path, {"imu": imu, "spare": np.arange(5.0)}, do_compression=compressed)
    columns = {"x": "gyro.1", "z": "gyro.3"}
    recording = read(path, columns=columns, kind="rate", unit="rad/s", time="time:s")
    np.testing.assert_array_equal(recording.gyro("x").values, imu["gyro"][:, 0])
    np.testing.assert_array_equal(recording.gyro("z").values, imu["gyro"][:, 2])
    assert recording.sample_rate == pytest.approx(100.0)
    whole = read(path, columns={"x": "count"}, kind="rate", unit="rad/s", time="time:s")
    np.testing.assert_array_equal(whole.gyro("x").values, imu["info"]["count"][:, 0])
    with pytest.raises(RecordingError) as caught:
        read(path, kind="rate", unit="rad/s", sample_rate=100.0)
    assert "the file has" in str(caught.value)
    assert "gyro.1, gyro.2, gyro.3, time" in str(caught.value)
    with pytest.raises(RecordingError, match="holds text"):
        read(path, columns={"x": "imu.name"}, kind="rate", unit="rad/s", sample_rate=100.0)


def test_fields_of_one_name_are_called_by_their_structs(tmp_path):
    path = tmp_path / "two.mat"
    units = {"left": unit(100), "right": unit(100)}
    many = np.array([(1.0,), (2.0,)], dtype=[("part", object)])
    scipy.io.savemat(path, {**units, "many": many})
    columns = {"x": "left.gyro.1", "y": "right.gyro.1"}
    recording = read(path, columns=columns, kind="rate", unit="rad/s", sample_rate=100.0)
    np.testing.assert_array_equal(recording.gyro("y").values, units["right"]["gyro"][:, 0])
    with pytest.raises(RecordingError, match="holds struct values"):
        read(path, columns={"x": "many"}, kind="rate", unit="rad/s", sample_rate=100.0)


def test_a_damaged_struct_is_one_line_or_what_its_numbers_say(tmp_path):
    path = tmp_path / "run.mat"
    scipy.io.savemat(path, {"imu": unit(40)}, do_compression=False)
    sound, generator = path.read_bytes(), np.random.default_rng(5)
    refused = 0
    for _ in range(300):
        data = bytearray(sound)
        data[generator.integers(128, 900)] = generator.integers(256)
        path.write_bytes(data)
        with suppress(RecordingError):
            read(path, columns={"x": "gyro.1"}, kind="rate", unit="rad/s", sample_rate=100.0)
            continue
        refused += 1
    assert refused > 30


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(("kind", "codec"), [(4, "utf-16"), (17, "utf-16"), (16, "utf-8")])
def test_text_is_read_in_either_order_of_bytes(order, kind, codec, tmp_path):
    def element(kind, content):
        filled = content + b"\0" * (-len(content) % 8)
        return struct.pack(f"{order}2I", kind, len(content)) + filled

    def variable(name, kind, shape, data):
        flags, sides = struct.pack(f"{order}2I", kind, 0), struct.pack(f"{order}2i", *shape)
        heads = element(6, flags) + element(5, sides) + element(1, name.encode())
        return element(14, heads + data)

    ends = {"<": "-le", ">": "-be"}
    text = "°/h".encode(codec + (ends[order] if codec == "utf-16" else ""))
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack(f"{order}H", 0x100)
    parts = (
        head + {"<": b"IM", ">": b"MI"}[order],
        variable("x", 6, (SAMPLES, 1), element(9, walk().astype(f"{order}f8").tobytes())),
        variable("unit", 4, (1, 3), element(kind, text)),
        variable("sample_rate", 6, (1, 1), element(2, bytes([100]))),
    )
    path = tmp_path / "run.mat"
    path.write_bytes(b"".join(parts))
    recording = read(path, kind="rate")
    assert (recording.gyros[0].shown_in, recording.sample_rate) == ("°/h", 100.0)


def test_a_table_of_text_is_named_as_one(tmp_path):
    """MATLAB writes it with save -ascii, and the suffix is the same."""
    path = tmp_path / "run.mat"
    np.savetxt(path, np.random.default_rng(1).normal(size=(50, 3)), fmt="%16.7e")
    with pytest.raises(RecordingError, match=r"run.mat: is text.*give it the suffix .txt"):
        read(path)
