"""Scale factor, bias and asymmetry from a turning table: the rig's shares, and honest errors."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.analysis.shares import table_shares
from sagnac.errors import RecordingError
from sagnac.recording.model import Channel, Recording
from sagnac.rig.config import RigConfig
from sagnac.rig.sections import GyroConfig, PlatformConfig, TableConfig
from sagnac.rig.simulate import simulate


def test_shares_of_the_rig_are_those_put_in():
    config = RigConfig(
        duration_s=600.0,
        sample_rate_hz=20.0,
        table=TableConfig(reversal_interval_s=100.0, jitter_rms_deg_per_s=0.004),
        platform=PlatformConfig(share_deviation=(0.001, 0.0, -0.001)),
        gyro=GyroConfig(bias_deg_per_h=(0.5, -0.3, 0.1)),
    )
    made = simulate(config)
    found = table_shares(made.recording, ("x", "y", "z"), confidence=0.999)
    for name, one in found.items():
        assert one.share.low <= made.truth.shares[name] <= one.share.high
        assert one.share.high - one.share.low < 1e-5
        # At one speed an asymmetry is a bias.
        assert one.asymmetry is None
    # Triad: the squares of the shares add up to one if no scale factor is off.
    assert sum(one.share.value**2 for one in found.values()) == pytest.approx(1.0, abs=1e-6)
    # The bias holds the Earth's rate along the table as well.
    difference = np.degrees(found["x"].bias.value - found["y"].bias.value) * 3600.0
    earth = made.truth.earth_rate_b0_deg_per_h[2]
    expected = 0.8 + earth * (made.truth.shares["x"] - made.truth.shares["y"])
    assert difference == pytest.approx(expected, abs=0.01)


def recording_of(gyro, table):
    channels = (Channel(name="z", kind="angle", shown_in="rad", values=gyro),)
    encoder = Channel(name="table", kind="angle", shown_in="rad", values=table)
    return Recording(gyros=channels, sample_rate=10.0, table=encoder)


def table_angle(samples):
    """Half a minute one way, half a minute the other; every other turn at half the speed."""
    number = np.arange(samples)
    speed = np.where(number // 600 % 2 == 0, 0.05, 0.025)
    return np.cumsum(np.where(number // 300 % 2 == 0, speed, -speed))


def test_error_over_predicted_sigma_is_near_one():
    table = table_angle(12_000)
    turned = np.diff(table, prepend=0.0)
    deviations, asymmetries = [], []
    for seed in range(150):
        noise = 1e-4 * np.random.default_rng(seed).standard_normal(table.size)
        scale = np.where(turned > 0.0, -1.006, -1.004)
        recording = recording_of(np.cumsum(scale * turned + 1e-5 + noise), table)
        one = table_shares(recording, ("z",), confidence=0.6827)["z"]
        sigma = 0.5 * (one.share.high - one.share.low)
        deviations.append((one.share.value + 1.005) / sigma)
        spread = 0.5 * (one.asymmetry.high - one.asymmetry.low)
        asymmetries.append((one.asymmetry.value - 0.002 / 1.005) / spread)
    # A standard deviation of 150 is good to 6 %.
    assert np.std(deviations) == pytest.approx(1.0, abs=0.18)
    assert np.std(asymmetries) == pytest.approx(1.0, abs=0.18)
    assert abs(np.mean(deviations)) < 0.3
    assert abs(np.mean(asymmetries)) < 0.3


def test_one_way_the_bias_is_in_the_share():
    table = 0.05 * np.arange(12_000.0)
    one = table_shares(recording_of(-1.006 * table, table), ("z",))["z"]
    assert one.share.value == pytest.approx(-1.006)
    assert one.bias is None
    assert one.asymmetry is None


def test_refusals():
    table = table_angle(12_000)
    recording = recording_of(table, table)
    with pytest.raises(RecordingError, match="no table angle"):
        table_shares(replace(recording, table=None), ("z",))
    with pytest.raises(RecordingError, match="too short"):
        table_shares(recording_of(table[:100], table[:100]), ("z",))
    with pytest.raises(RecordingError, match="does not turn"):
        table_shares(recording_of(table, np.zeros(table.size)), ("z",))
    # Over by half a turn and back within two seconds: every second has both ways in it.
    swing = 1.5 * np.cos(np.pi * np.arange(12_000) / 10.0 + 0.25 * np.pi)
    with pytest.raises(RecordingError, match="keeps its way over 0 seconds"):
        table_shares(recording_of(swing, swing), ("z",))
