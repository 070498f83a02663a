"""Pick-offs in files: written and read again, named otherwise, left out."""

from dataclasses import replace

import numpy as np
import pytest

import sagnac
from sagnac.core.errors import RecordingError
from sagnac.recording.channel import Pickoff
from sagnac.recording.model import Recording

pytestmark = pytest.mark.usefixtures("trusted_hdf5")


def recorded(**changes):
    random = np.random.default_rng(1)
    gyros = {name: random.standard_normal(400) for name in ("x", "z")}
    pickoffs = {"x": random.standard_normal(400), "z": np.arange(400)}
    return Recording.from_arrays(
        kind="rate", unit="rad/s", sample_rate=100.0, pickoffs=pickoffs, **{**gyros, **changes}
    )


def test_only_those_of_the_gyros_taken_are_read(tmp_path):
    path = tmp_path / "run.parquet"
    sagnac.write(recorded(), path)
    assert [one.gyro for one in sagnac.read(path, gyros=("z",)).pickoffs] == ["z"]


def test_a_column_of_another_name_is_taken_where_it_is_stated(tmp_path):
    path = tmp_path / "run.csv"
    values = np.random.default_rng(2).standard_normal((200, 3))
    np.savetxt(path, values, delimiter=",", header="x[deg/s],z[deg/s],dpo 1", comments="")
    columns = {"pickoff_x": "dpo 1"}
    read = sagnac.read(path, kind="rate", sample_rate=10.0, columns=columns)
    assert [gyro.name for gyro in read.gyros] == ["x", "z"]
    np.testing.assert_allclose(read.pickoffs[0].values, values[:, 2])
    with pytest.raises(RecordingError, match="no such column"):
        sagnac.read(path, kind="rate", sample_rate=10.0, columns={"pickoff_x": "dpo 9"})


def test_one_is_left_out_where_that_is_stated(tmp_path):
    path = tmp_path / "run.parquet"
    sagnac.write(recorded(), path)
    read = sagnac.read(path, columns={"pickoff_x": "none"})
    assert [one.gyro for one in read.pickoffs] == ["z"]
    assert [gyro.name for gyro in read.gyros] == ["x", "z"]


def test_a_slice_takes_the_same_samples_of_all(tmp_path):
    path = tmp_path / "run.parquet"
    recording = recorded()
    sagnac.write(recording, path)
    read = sagnac.read(path, span=(1.0, 3.0))
    np.testing.assert_array_equal(read.pickoffs[0].values, recording.pickoffs[0].values[100:300])


def test_recordings_that_differ_in_a_pickoff_differ():
    one = recorded()
    assert one == recorded()
    moved = Pickoff(gyro="x", values=one.pickoffs[0].values + 1.0)
    assert one != replace(one, pickoffs=(moved, one.pickoffs[1]))


def test_refusals(tmp_path):
    one = recorded()
    with pytest.raises(ValueError, match="pick-offs are of q"):
        replace(one, pickoffs=(Pickoff(gyro="q", values=np.zeros(400)),))
    with pytest.raises(ValueError, match="sampled together"):
        replace(one, pickoffs=(Pickoff(gyro="x", values=np.zeros(399)),))
    with pytest.raises(ValueError, match="series of float64"):
        Pickoff(gyro="x", values=[1.0])
    wrong = Recording.from_arrays(
        kind="rate", unit="rad/s", sample_rate=1.0, pickoff_x=np.zeros(20)
    )
    with pytest.raises(ValueError, match="cannot stand in a file"):
        sagnac.write(wrong, tmp_path / "run.parquet")
