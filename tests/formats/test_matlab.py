"""MATLAB files of both kinds."""

import h5py
import numpy as np
import scipy.io

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
