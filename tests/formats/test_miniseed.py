"""miniSEED."""

import numpy as np

from sagnac.formats import columns, missing, read
from tests.formats.examples import refused
from tests.formats.instruments import mseed

COUNTS = np.random.default_rng(6).integers(-500, 500, 2000)
STATED = {"columns": {"z": "BW_RLAS__B_J_Z"}, "kind": "rate", "scale": "2e-9rad/s"}


def test_a_source_in_counts(tmp_path):
    path = mseed(tmp_path / "ring.mseed", COUNTS)
    assert columns(path) == ("BW_RLAS__B_J_Z",)
    assert missing(path)["scale"] == "SIZE"
    recording = read(path, **STATED)
    assert recording.sample_rate == 200.0
    np.testing.assert_allclose(recording.gyros[0].values, 2e-9 * COUNTS, rtol=1e-14)


def test_missing_records_show_in_the_stamps(tmp_path):
    path = mseed(tmp_path / "ring.mseed", COUNTS, gap=300)
    recording = read(path, verify=False, **STATED)
    steps = np.diff(recording.times)
    assert np.flatnonzero(steps > 0.1).tolist() == [999]
    np.testing.assert_allclose(steps[999], 301 / 200.0, rtol=1e-9)
    assert any("records are missing" in str(note) for note in recording.notes)


def test_not_miniseed(tmp_path):
    path = tmp_path / "ring.mseed"
    path.write_bytes(b"no records at all" * 20)
    refused(path, "is not miniSEED")
