"""Damaged files that once were answered with something else than one line, or than the truth."""

import struct

import h5netcdf
import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.formats import Statement, read
from tests.formats.examples import refused
from tests.formats.instruments import axes, mseed, tdms, ulog
from tests.fuzz.sound import sound
from tests.fuzz.test_readers import SEED
from tests.fuzz.worker import damaged, outcome, silently_read, statement_of


def read_of(tmp_path, ending, number):
    """What comes of a damaged file of the fuzz tests, beside what its sound file holds."""
    sound(tmp_path, ending)
    statement = statement_of(ending, number)
    whole = silently_read(tmp_path / f"sound.{ending}", statement)
    return outcome(damaged(tmp_path, ending, SEED, number), statement, whole)


# Exceptions of libraries and crashes, and a log whose gyro has no times.
ESCAPED = [("mat", 106), ("h5", 4), ("h5", 9), ("csv", 1799), ("ulg", 48)]
# Samples of 1e302, over which sums end; and what a library prints.
LARGE = [("tdms", 53), ("ins", 128)]
PRINTED = [("ulg", 4), ("ulg", 10)]
# A record, a segment and messages that are cut off.
CUT = [("mseed", 8), ("tdms", 8), ("tdms", 13), ("ulg", 8), ("ulg", 12), ("mcap", 21), ("mcap", 58)]
# Another sum than the record states, and a column by another name.
OTHER = [("v2.mseed", 53), ("v2.mseed", 74), ("npz", 25)]


@pytest.mark.parametrize(("ending", "number"), [*ESCAPED, *LARGE, *PRINTED])
def test_damage_that_once_escaped(tmp_path, ending, number):
    assert read_of(tmp_path, ending, number) in ("read", "refused", "noted", "changed")


@pytest.mark.parametrize(("ending", "number"), [*CUT, *OTHER])
def test_damage_that_once_changed_the_answer_without_a_word(tmp_path, ending, number):
    assert read_of(tmp_path, ending, number) in ("refused", "noted")


def test_a_row_that_is_no_text_is_refused_in_one_line(tmp_path, capfd):
    path = tmp_path / "run.csv"
    rows = [b"x[deg/s],z[deg/s]", *(b"%d.5,1.25" % n for n in range(200)), b"1.0,2.0,\xff\xff"]
    path.write_bytes(b"\n".join([*rows, b""]))
    with pytest.raises(RecordingError) as caught:
        read(path, sample_rate=100.0)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr().err == ""


def test_a_last_record_of_miniseed_that_is_cut_is_no_short_recording(tmp_path):
    path = mseed(tmp_path / "run.mseed", np.arange(2000), gap=300)
    path.write_bytes(path.read_bytes()[:-7])
    refused(path, "7 more bytes")


def test_a_segment_of_tdms_whose_head_is_cut_is_no_short_recording(tmp_path):
    path = tdms(tmp_path / "run.tdms", axes(samples=100))
    content = path.read_bytes()
    second = content.index(b"TDSm", 4)
    for cut in (second + 9, second + 40, len(content) - 1):
        path.write_bytes(content[:cut])
        refused(path, "last segment is not all there")
    path.write_bytes(content[:second])
    assert read(path, kind="rate").samples == 50


def test_a_px4_log_that_ends_within_a_message_is_read_with_a_note(tmp_path, capfd):
    path = ulog(tmp_path / "run.ulg", axes(samples=100))
    whole = path.read_bytes()
    assert read(path).notes == ()
    # A message of data has 3 bytes of head, 2 of number, 8 of time and 12 of floats.
    path.write_bytes(whole[: -2 * 25 - 4])
    recording = read(path)
    assert recording.samples == 99
    (note,) = recording.notes
    assert (note.level, note.text[:43]) == (
        "warning",
        "4 bytes of the last message are missing: th",
    )
    # An identifier that nobody has announced: the library prints a warning of its own.
    path.write_bytes(whole[:-22] + struct.pack("<H", 77) + whole[-20:])
    refused(path, "messages are damaged")
    assert capfd.readouterr().out == ""


def test_parts_of_netcdf_that_were_never_written_are_no_zeros(tmp_path):
    path = tmp_path / "run.nc"
    stated = Statement(kind="rate", unit="rad/s", sample_rate=100.0)
    values = np.random.default_rng(1).normal(size=500)
    for filled in (False, True):
        path.unlink(missing_ok=True)
        with h5netcdf.File(path, "w") as file:
            file.dimensions = {"time": 1000}
            fill = {"fillvalue": -999.0} if filled else {}
            gyro = file.create_variable("x", ("time",), "f8", chunks=(100,), **fill)
            gyro[:500] = values
        if filled:
            refused(path, "500 samples NaN", statement=stated)
        else:
            refused(path, "5 of 10 chunks were never written", statement=stated)


@pytest.mark.parametrize("value", [1e31, -1e300])
def test_a_sample_that_nothing_turns_is_refused(tmp_path, value):
    values = np.random.default_rng(1).normal(size=500)
    values[40] = value
    path = tmp_path / "run.csv"
    path.write_text("x\n" + "\n".join(map(repr, values.tolist())) + "\n")
    stated = Statement(kind="rate", unit="rad/s", sample_rate=100.0)
    refused(
        path, "x: 1 sample NaN, infinite or beyond 1e+30, the first at 0.400 s", statement=stated
    )
