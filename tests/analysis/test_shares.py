"""Scale factor, bias and asymmetry from a turning table: the rig's shares, and honest errors."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.analysis.table_shares import table_shares
from sagnac.core.errors import RecordingError
from sagnac.recording.model import Channel, Recording
from sagnac.rig.config import RigConfig
from sagnac.rig.sections import EncoderConfig, GyroConfig, PlatformConfig, TableConfig
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
    found, _ = table_shares(made.recording, ("x", "y", "z"), confidence=0.999)
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


@pytest.mark.parametrize("draws", [60, pytest.param(150, marks=pytest.mark.statistics)])
def test_error_over_predicted_sigma_is_near_one(draws):
    table = table_angle(12_000)
    turned = np.diff(table, prepend=0.0)
    deviations, asymmetries = [], []
    for seed in range(draws):
        noise = 1e-4 * np.random.default_rng(seed).standard_normal(table.size)
        scale = np.where(turned > 0.0, -1.006, -1.004)
        recording = recording_of(np.cumsum(scale * turned + 1e-5 + noise), table)
        one = table_shares(recording, ("z",), confidence=0.6827)[0]["z"]
        sigma = 0.5 * (one.share.high - one.share.low)
        deviations.append((one.share.value + 1.005) / sigma)
        spread = 0.5 * (one.asymmetry.high - one.asymmetry.low)
        asymmetries.append((one.asymmetry.value - 0.002 / 1.005) / spread)
    # A standard deviation of 150 is good to 6 %, and a mean to 8 %.
    fewer = np.sqrt(150.0 / draws)
    assert np.std(deviations) == pytest.approx(1.0, abs=0.18 * fewer)
    assert np.std(asymmetries) == pytest.approx(1.0, abs=0.18 * fewer)
    assert abs(np.mean(deviations)) < 0.3 * fewer
    assert abs(np.mean(asymmetries)) < 0.3 * fewer


@pytest.mark.parametrize("course", ["speeds up", "steps"])
def test_a_table_that_turns_one_way_at_several_rates_tells_the_bias_from_the_share(course):
    """Earth rate, and an order 1 of the table beside it, are not in the share."""
    number, random = np.arange(9000), np.random.default_rng(4)
    rates = {"speeds up": 0.02 + 5e-6 * number, "steps": 0.02 * (1 + number // 500 % 3)}[course]
    table = np.cumsum(rates)
    earth = np.cumsum(2e-6 + 5e-6 * np.cos(table))
    noise = np.cumsum(1e-6 * random.standard_normal(table.size))
    angle = 0.577 * table + earth + 1e-5 * np.cos(table) + noise
    share = table_shares(recording_of(angle, table), ("z",), confidence=0.999)[0]["z"]
    assert share.share.low < 0.577 < share.share.high
    # Samples are a tenth of a second apart.
    assert share.bias.low < 2e-5 < share.bias.high < 3e-5


def both_ways_at_two_speeds(seconds):
    """A commanded rate that changes its way every 20 s and its speed every 40 s."""
    knots = []
    for start in range(0, seconds, 20):
        way = 1.0 if start // 20 % 2 == 0 else -1.0
        speed = 30.0 if start // 40 % 2 == 0 else 15.0
        knots += [(float(start), way * speed), (start + 19.0, way * speed)]
    return tuple(knots)


@pytest.mark.parametrize("draws", [25, pytest.param(60, marks=pytest.mark.statistics)])
def test_on_the_rig_error_over_predicted_sigma_is_near_one(draws):
    config = RigConfig(
        duration_s=240.0,
        sample_rate_hz=10.0,
        table=TableConfig(profile=both_ways_at_two_speeds(240), jitter_rms_deg_per_s=0.004),
        encoder=EncoderConfig(periodic_error=((1.0, 1.0),)),
        platform=PlatformConfig(share_deviation=(0.01, 0.0, -0.02)),
        gyro=GyroConfig(arw_deg_per_sqrt_h=(0.02, 0.03, 0.04), bias_deg_per_h=(0.5, -0.3, 0.1)),
    )
    deviations = {what: [] for what in ("share", "asymmetry", "bias", "scale", "angle")}

    def note(what, interval, truth):
        deviations[what].append((interval.value - truth) / (0.5 * (interval.high - interval.low)))

    for seed in range(draws):
        made = simulate(replace(config, seed=seed))
        shares, triad = table_shares(made.recording, ("x", "y", "z"), confidence=0.6827)
        truth, biases = made.truth, config.gyro.bias_deg_per_h
        for bias, (name, one) in zip(biases, shares.items(), strict=True):
            share = truth.shares[name]
            note("share", one.share, share)
            note("asymmetry", one.asymmetry, 0.0)
            along = bias + share * truth.earth_rate_b0_deg_per_h[2]
            note("bias", one.bias, np.radians(along / 3600.0))
            note("angle", triad.angles[name], np.arccos(share))
        # The rig's axes are square and its scale factor is 1.
        note("scale", triad.scale, 1.0)
    fewer = np.sqrt(60.0 / draws)
    for what, several in deviations.items():
        # A standard deviation of 60 values is good to 9 %, and the Student factor of 25 to 2 %.
        assert np.std(several) == pytest.approx(1.0, abs=0.28 * fewer), what
        assert abs(np.mean(several)) < 0.4 * fewer, what


def test_axes_that_turn_about_the_table_have_no_angle_below_zero():
    table = table_angle(12_000)
    turned = np.diff(table, prepend=0.0)
    channels = tuple(
        Channel(
            name=name,
            kind="angle",
            shown_in="rad",
            values=np.cumsum(
                share * turned + 1e-4 * np.random.default_rng(seed).standard_normal(table.size)
            ),
        )
        for seed, (name, share) in enumerate({"x": 0.0, "y": 0.0, "z": -1.003}.items())
    )
    recording = replace(recording_of(table, table), gyros=channels)
    _, triad = table_shares(recording, ("x", "y", "z"))
    assert triad.scale.low < 1.003 < triad.scale.high
    assert triad.angles["z"].high == pytest.approx(np.pi)
    for name in ("x", "y"):
        assert triad.angles[name].low < 0.5 * np.pi < triad.angles[name].high


def test_one_gyro_has_no_triad():
    table = table_angle(12_000)
    assert table_shares(recording_of(table, table), ("z",))[1] is None


def test_one_way_the_bias_is_in_the_share():
    table = 0.05 * np.arange(12_000.0)
    one = table_shares(recording_of(-1.006 * table, table), ("z",))[0]["z"]
    assert one.share.value == pytest.approx(-1.006)
    assert one.bias is None
    assert one.asymmetry is None


def held_on_a_sweep(amplitude):
    """How many of 40 shares hold, and the median half interval, with a tone at order 11.3."""
    table, holds, halves = 2.5 * np.sin(2.0 * np.pi * np.arange(9000) / 170.0), 0, []
    for seed in range(40):
        random = np.random.default_rng(seed)
        tone = amplitude * np.sin(11.3 * table + random.uniform(0.0, 2.0 * np.pi))
        noise = np.cumsum(1e-7 * random.standard_normal(table.size))
        recording = recording_of(0.577 * table + tone + noise, table)
        share = table_shares(recording, ("z",))[0]["z"].share
        holds += share.low <= 0.577 <= share.high
        halves.append(0.5 * (share.high - share.low))
    return holds, float(np.median(halves))


def test_an_order_that_is_the_same_in_every_sweep_is_in_the_error_of_a_share():
    held, half = held_on_a_sweep(2e-6)
    assert held >= 34
    # Without a tone the interval is of the noise alone: 1e-7 rad each tenth of a second.
    sound, of_noise = held_on_a_sweep(0.0)
    assert sound >= 34
    assert of_noise < 0.1 * half
    bound = 1.96 * 1e-7 / (2.5 * 2.0 * np.pi / 170.0 * np.sqrt(0.5 * 9000))
    assert bound < of_noise < 3.0 * bound


def indexed(step, back=False):
    """Ten samples of a move at each fifth second, rest between; every third one back."""
    number = np.arange(6000)
    way = np.where(number // 50 % 3 == 1, -1.0, 1.0) if back else 1.0
    # Six samples into a second, so that each move lies in two of them.
    return np.cumsum(np.where((number - 6) % 50 < 10, 0.1 * way * step, 0.0))


@pytest.mark.parametrize("back", [False, True])
def test_a_table_that_indexes_in_a_second_shows_its_shares(back):
    """No move has a second of its own way on both sides: each has rest there."""
    table, random = indexed(np.radians(37.0), back), np.random.default_rng(8)
    noise = np.cumsum(1e-7 * random.standard_normal(table.size))
    angle = 0.577 * table + 2e-6 * np.arange(table.size) + noise
    one = table_shares(recording_of(angle, table), ("z",), confidence=0.999)[0]["z"]
    assert one.share.low < 0.577 < one.share.high < 0.577 + 1e-5
    assert one.bias.low < 2e-5 < one.bias.high < 2.1e-5


@pytest.mark.parametrize("table", [indexed(2.0 * np.pi), np.where(np.arange(6000) < 300, 0.0, 0.5)])
def test_moves_that_tell_no_columns_apart_are_refused(table):
    """A whole turn each time, whose angles are always the same; one move in ten minutes."""
    with pytest.raises(RecordingError, match="vary too little"):
        table_shares(recording_of(0.577 * table, table), ("z",))


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
