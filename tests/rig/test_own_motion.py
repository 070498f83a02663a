"""Motion that gyros do not share: mounts that resonate, a shaft that nutates."""

import math
from copy import deepcopy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.signal import welch

from sagnac.rig.own_motion import Nutation
from sagnac.rig.sections import MotionConfig, PlatformConfig, TableConfig
from sagnac.rig.simulate import blocks, simulate
from sagnac.rig.table import Motion
from sagnac.rig.truth import truth_of
from sagnac.table.frames import table_to_gyro_matrix
from tests.rig.rigs import ARCSEC, AT_REST, DEG, configured, geometry, triad

DEG_PER_ROOT_HOUR = DEG / 60.0


def added_by(motion, config):
    """(3, n) what the motion adds to the angles, arcsec."""
    return (triad(replace(config, motion=motion)) - triad(config)) / ARCSEC


def test_a_mount_adds_the_spectrum_of_its_resonance_gyro_by_gyro():
    motion = MotionConfig(
        resonance_rms_arcsec=(0.1, 0.0, 0.2), resonance_hz=(9.0, 9.0, 14.0), resonance_quality=10.0
    )
    config = configured(duration_s=1000.0, sample_rate_hz=200.0)
    added = added_by(motion, config)
    assert np.abs(added[1]).max() == 0.0
    for g, rms, middle in ((0, 0.1, 9.0), (2, 0.2, 14.0)):
        # A thousand ring-downs of some 0.2 to 0.4 s, twice over.
        assert added[g].std() == pytest.approx(rms, rel=0.06)
        frequency, density = welch(added[g], 200.0, nperseg=2048)
        inside = (frequency > 1.0) & (frequency < 30.0)
        ratio = frequency[inside] / middle
        law = (
            4.0 * rms**2 / (2 * math.pi * middle * 10.0)
            / ((1 - ratio**2) ** 2 + (ratio / 10.0) ** 2)
        )  # fmt: skip
        assert np.mean(density[inside] / law) == pytest.approx(1.0, abs=0.04)
        assert frequency[np.argmax(density)] == pytest.approx(middle, abs=0.3)
    # Of some 2000 independent stretches, four standard deviations are 0.09.
    assert abs(np.corrcoef(added[0], added[2])[0, 1]) < 0.1


def test_a_mount_rests_while_the_table_stands():
    motion = MotionConfig(resonance_rms_arcsec=0.5, resonance_hz=20.0, resonance_quality=20.0)
    table = TableConfig(profile=((0.0, 0.0), (10.0, 0.0), (11.0, 30.0), (20.0, 30.0), (21.0, 0.0)))
    added = added_by(motion, configured(table=table))
    assert np.abs(added[:, : 10 * 500]).max() == 0.0
    assert added[:, 12 * 500 : 21 * 500].std() == pytest.approx(0.5, rel=0.25)
    # Its amplitude falls by e^-pi a second: after four seconds 3e-6 of it is left.
    assert np.abs(added[:, 26 * 500 :]).max() < 1e-4
    assert np.abs(added_by(motion, configured(table=AT_REST))).max() == 0.0


@pytest.mark.parametrize("rate", [60.0, -200.0])
def test_nutation_turns_the_gyros_as_its_integral_by_parts(rate):
    """C(alpha) p less the integral of Omega C'(alpha) p: no rate of the tilt is needed."""
    config = MotionConfig(nutation_rms_arcsec=2.0, nutation_hz=3.0)
    table = SimpleNamespace(origin=0.3, moving=True, interval=1e-3)
    made = Nutation(config, table, np.random.default_rng(3))
    moving = np.ones(20_000, dtype=bool)
    tilt = np.array([deepcopy(one).angles(moving) for one in made.tilts])
    tilt = np.concatenate([[[one.state[0]] for one in made.tilts], tilt], axis=1)
    alpha = 0.3 + rate * DEG * 1e-3 * np.arange(20_001)
    motion = Motion(angle=alpha[1:], turned=np.zeros((3, 20_000)), moving=moving)
    turned = made.added_to(motion).turned
    cosine, sine = np.cos(alpha), np.sin(alpha)
    kept = np.array([cosine * tilt[0] + sine * tilt[1], cosine * tilt[1] - sine * tilt[0]])
    slope = np.array([cosine * tilt[1] - sine * tilt[0], -sine * tilt[1] - cosine * tilt[0]])
    walked = cumulative_simpson(slope, dx=rate * DEG * 1e-3, initial=0.0)
    expected = (kept - kept[:, :1] - walked)[:, 1:]
    assert expected.std() > ARCSEC
    assert np.abs(turned[:2] - expected).max() < 1e-3 * expected.std()
    assert np.abs(turned[2]).max() == 0.0


def test_nutation_adds_the_walk_of_the_truth_and_three_gyros_cancel_it():
    motion = MotionConfig(nutation_rms_arcsec=0.5, nutation_hz=4.0, nutation_quality=0.5)
    config = configured(
        duration_s=16_000.0,
        sample_rate_hz=25.0,
        platform=PlatformConfig(),
        table=TableConfig(rate_deg_per_s=180.0),
    )
    added = added_by(motion, config)
    # The table's 50,000 rad are rounded to 1.5e-6 arcsec, and each gyro walks by some 100 arcsec.
    assert np.abs(added.sum(axis=0)).max() < 1e-5
    assert np.abs(added).max() > 50.0
    walk = truth_of(replace(config, motion=motion)).nutation_walk_deg_per_sqrt_h
    assert walk["x"] == pytest.approx(walk["z"])
    assert walk["x-z"] / walk["x"] == pytest.approx(math.sqrt(1.5))
    # Over 8 s, four turns of the table, the angle that comes back is met at one phase: 2000 steps
    # are the walk's and, at their ends, twice the tilt's, and scatter by 1.6 %.
    for name, angle in (("x", added[0]), ("x-z", (added[0] - added[2]) / math.sqrt(2.0))):
        steps = np.diff(angle[::200]) * ARCSEC
        level = 2.0 / 3.0 * (1.0 if name == "x" else 1.5)
        ends = 2.0 * level * (0.5 * ARCSEC) ** 2
        expected = math.sqrt(8.0 * (walk[name] * DEG_PER_ROOT_HOUR) ** 2 + ends)
        assert steps.std() == pytest.approx(expected, rel=0.07)
        assert math.sqrt(ends) < 0.5 * expected


def test_the_truth_is_silent_about_a_walk_that_is_not_there():
    assert truth_of(configured()).nutation_walk_deg_per_sqrt_h == {}
    nutating = configured(motion=MotionConfig(nutation_rms_arcsec=0.1))
    shares, _ = geometry(nutating)
    walk = truth_of(nutating).nutation_walk_deg_per_sqrt_h
    level = np.linalg.norm(table_to_gyro_matrix(*shares)[:, :2], axis=1)
    np.testing.assert_allclose(
        [walk["x"] / walk["y"], walk["z"] / walk["y"]], level[[0, 2]] / level[1]
    )
    assert truth_of(replace(nutating, table=AT_REST)).nutation_walk_deg_per_sqrt_h == {}


@pytest.mark.parametrize("block_samples", [1, 333])
def test_own_motion_does_not_depend_on_the_blocks(block_samples):
    motion = MotionConfig(resonance_rms_arcsec=0.3, nutation_rms_arcsec=0.2)
    table = TableConfig(reversal_interval_s=2.0, dwell_s=0.5)
    config = configured(duration_s=2.6, motion=motion, table=table)
    parts = [columns for columns, _ in blocks(config, block_samples)]
    for gyro in simulate(config).recording.gyros:
        joined = np.concatenate([part[gyro.name] for part in parts])
        np.testing.assert_array_equal(joined, gyro.values)
