"""TDMS files of LabVIEW."""

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.formats import read
from sagnac.formats.tdms import check_scales
from tests.formats.examples import refused
from tests.formats.instruments import axes, tdms


def test_channels_with_unit_and_rate(tmp_path):
    values = axes()
    path = tdms(tmp_path / "run.tdms", values)
    assert [gyro.shown_in for gyro in read(path, kind="rate").gyros] == ["deg/s"] * 3
    part = read(path, kind="rate", span=(1.0, 2.0))
    np.testing.assert_allclose(part.gyros[2].values, values.gyros[200:400, 2], rtol=1e-14)


def test_a_scale_that_cannot_be_applied_is_refused(tmp_path):
    properties = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Reciprocal"}
    path = tdms(tmp_path / "run.tdms", axes(), **properties)
    with pytest.raises(RecordingError, match="its scale is of type 'Reciprocal'"):
        read(path, kind="rate")
    check_scales("x", {**properties, "NI_Scaling_Status": "scaled"})
    check_scales("x", {"NI_Scale[0]_Scale_Type": "Linear"})


def test_a_linear_scale_is_applied(tmp_path):
    values = axes()
    scale = {
        "NI_Number_Of_Scales": 1,
        "NI_Scaling_Status": "unscaled",
        "NI_Scale[0]_Scale_Type": "Linear",
        "NI_Scale[0]_Linear_Slope": 2.0,
        "NI_Scale[0]_Linear_Y_Intercept": 1.0,
        "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
    }
    recording = read(tdms(tmp_path / "run.tdms", values, **scale), kind="rate")
    expected = np.deg2rad(2.0 * np.rad2deg(values.gyros[:, 0]) + 1.0)
    np.testing.assert_allclose(recording.gyros[0].values, expected, rtol=1e-13)


@pytest.mark.parametrize("content", [b"x,y\n1,2\n" * 3000, bytes(28), b"XXXX" + bytes(5000)])
def test_what_is_no_tdms_is_said_to_be_none(tmp_path, content):
    (tmp_path / "run.tdms").write_bytes(content)
    said = refused(
        tmp_path / "run.tdms", "does not begin as such a file does", "give it the suffix"
    )
    assert "submitted" not in said


def test_damage_is_not_in_the_words_of_the_library(tmp_path):
    whole = bytearray(tdms(tmp_path / "run.tdms", axes()).read_bytes())
    path = tmp_path / "damaged.tdms"
    # The number of its objects comes right behind the lead-in.
    path.write_bytes(whole[:28] + b"\xff\xff\xff\x0f" + whole[32:])
    refused(path, "damaged", "the description of its channels cannot be read", "get the file again")
    path.write_bytes(whole + b"junk" * 10)
    refused(path, f"no segment begins at byte {len(whole)}", "get the file again")
