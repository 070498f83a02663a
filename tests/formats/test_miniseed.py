"""miniSEED."""

import numpy as np
from pymseed import MS3TraceList

from sagnac.formats import read
from tests.formats.examples import refused
from tests.formats.instruments import mseed

COUNTS = np.random.default_rng(6).integers(-500, 500, 2000)
STATED = {"columns": {"z": "BW_RLAS__B_J_Z"}, "kind": "rate", "scale": "2e-9rad/s"}


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


def test_one_channel_a_file_put_together_is_a_triad(tmp_path):
    parts = []
    for number, axis in enumerate("XYZ"):
        with MS3TraceList() as traces:
            name, values = f"FDSN:BW_ROMY__B_J_{axis}", (COUNTS + number).tolist()
            traces.add_data(name, values, "i", 200.0, starttime=10**18)
            traces.to_file(tmp_path / axis)
        parts.append((tmp_path / axis).read_bytes())
    path = tmp_path / "triad.mseed"
    path.write_bytes(b"".join(parts))
    stated = {axis.lower(): f"BW_ROMY__B_J_{axis}" for axis in "XYZ"}
    recording = read(path, columns=stated, kind="rate", scale="2e-9rad/s")
    for number, gyro in enumerate(recording.gyros):
        np.testing.assert_allclose(gyro.values, 2e-9 * (COUNTS + number), rtol=1e-12)


def test_channels_that_do_not_begin_together_are_refused(tmp_path):
    path = tmp_path / "late.mseed"
    with MS3TraceList() as traces:
        for number, axis in enumerate("XZ"):
            start = 10**18 + number * 10**10
            name = f"FDSN:BW_ROMY__B_J_{axis}"
            traces.add_data(name, COUNTS.tolist(), "i", 200.0, starttime=start)
        traces.to_file(path)
    refused(path, "begins 10 s after BW_ROMY__B_J_X")
