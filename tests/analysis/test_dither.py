"""Dither stripped by its pick-off: N of a dithered gyro as put in, against one that is not."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.analysis.corrections import without_dither
from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.core.units import ARCSECOND, DEGREE_PER_ROOT_HOUR
from sagnac.rig.config import preset
from sagnac.rig.sections import DitherConfig
from sagnac.rig.simulate import simulate

PRESET = preset("dithered")
# A line at 100 Hz cannot be put into a recording at 100 Hz; the dithers fold to 12.7 and 11.3 Hz.
CONFIG = replace(
    PRESET,
    duration_s=300.0,
    sample_rate_hz=100.0,
    disturbances=replace(PRESET.disturbances, time=PRESET.disturbances.time[:3]),
)


@pytest.fixture(scope="module")
def made():
    return simulate(CONFIG)


@pytest.fixture(scope="module")
def clean():
    return simulate(replace(CONFIG, dither=DitherConfig())).recording


def test_what_is_left_of_the_dither_is_under_the_readout(made, clean):
    found = without_dither(made.recording, ("x", "z"), "fos")
    for name in ("x", "z"):
        before = made.recording.gyro(name).values - clean.gyro(name).values
        after = found.gyro(name).values - clean.gyro(name).values
        assert np.std(before) > 1.0 * ARCSECOND
        # The preset reads out in steps of 0.001 arcsec; the regression is over 30,000 samples.
        assert np.std(after) < 0.005 * ARCSECOND
    # y was not asked for.
    assert found.gyro("y") is made.recording.gyro("y")
    assert [note.channel for note in found.notes] == ["x", "z"]
    assert "arcsec rms that follows its pick-off" in found.notes[0].text


def test_the_angle_random_walk_is_the_one_put_in(made):
    truth = made.truth.pairs["x-z"].arw_deg_per_sqrt_h * DEGREE_PER_ROOT_HOUR
    stripped = analyze(made.recording, Settings(gyros=("x", "z"))).angle_random_walk
    assert stripped.status == "estimated"
    assert stripped.low < truth < stripped.high
    assert stripped.value == pytest.approx(truth, rel=0.05)
    bare = replace(made.recording, pickoffs=())
    kept = analyze(bare, Settings(gyros=("x", "z"), method="none")).angle_random_walk
    assert kept.high > 3.0 * truth


def test_the_method_none_takes_nothing(made):
    found = without_dither(made.recording, ("x", "z"), "none")
    assert found is made.recording


@pytest.mark.parametrize(
    ("spoil", "why"),
    [(np.nan, "has samples that are missing"), (None, "does not move")],
)
def test_a_pickoff_that_is_broken_is_left_alone(made, spoil, why):
    pickoff = made.recording.pickoffs[0]
    values = pickoff.values.copy()
    if spoil is None:
        values[:] = 2.5
    else:
        values[17] = spoil
    recording = replace(made.recording, pickoffs=(replace(pickoff, values=values),))
    found = without_dither(recording, ("x",), "fos")
    np.testing.assert_array_equal(found.gyro("x").values, recording.gyro("x").values)
    (note,) = found.notes
    assert why in note.text
    assert note.level == "warning"


def test_a_gyro_of_rates_is_stripped_as_one_of_angles(made):
    recording = made.recording
    x = recording.gyro("x")
    steps = np.diff(x.values, prepend=x.values[0])
    of_rate = replace(x, kind="rate", shown_in="deg/s", values=steps * recording.sample_rate)
    same = without_dither(replace(recording, gyros=(of_rate, *recording.gyros[1:])), ("x",), "fos")
    angles = without_dither(recording, ("x",), "fos")
    difference = same.gyro("x").values - angles.gyro("x").values
    assert np.ptp(difference) < 1e-4 * ARCSECOND
