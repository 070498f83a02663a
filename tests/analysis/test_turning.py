"""Tables that reverse, stop and wander, and whose encoder drops samples: N and lines as put in."""

import functools
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.result import Analysis
from sagnac.analysis.settings import Settings
from sagnac.formats import Statement, read, write
from sagnac.lines.model import Line
from sagnac.rig.config import RigConfig
from sagnac.rig.sections import DisturbancesConfig, EncoderConfig, PlatformConfig, TableConfig
from sagnac.rig.simulate import Simulation, simulate
from sagnac.rig.truth import LineTruth, Truth

DURATION = 600.0
RATE = 100.0
WALK = 2.5e-5  # deg/sqrt(h)
ARW = np.radians(WALK) / 60.0  # rad/sqrt(s)
ARCSECOND = np.pi / 648_000
# Encoder error of 1 arcsec, 5e-6 rad, takes a part of as much times the order from a line of 0.6
# arcsec to those beside it: less than this.
LEAKED = 2e-5
ORDERS = ((1.0, 0.6), (2.0, 0.45), (3.0, 0.3), (5.0, 0.2), (9.0, 0.1), (18.0, 0.06), (36.0, 0.03))
BROKEN_ORDERS = ((2.4, 0.2), (10.5, 0.1))
TONES = ((1.37, 0.05), (7.3, 0.03), (31.0, 0.02))


def stops(on: float, off: float, signs: tuple[int, ...] = (1,)) -> tuple[tuple[float, float], ...]:
    """40 deg/s for `on` seconds, at rest for `off`, one second to start and one to stop."""
    knots = [(0.0, 0.0)]
    start = 0.1
    number = 0
    while start < DURATION:
        rate = 40.0 * signs[number % len(signs)]
        knots += [(start, 0.0), (start + 1.0, rate), (start + on - 1.0, rate), (start + on, 0.0)]
        start += on + off
        number += 1
    return tuple(knots)


def wavers(part: float) -> tuple[tuple[float, float], ...]:
    """A rate that swings by a part of itself within five minutes."""
    times = np.arange(0.0, DURATION + 5.0, 5.0)
    rates = 40.0 * (1.0 + part * np.sin(2.0 * np.pi * times / 300.0))
    return tuple(zip(times.tolist(), rates.tolist(), strict=True))


TABLES = {
    "reverses once": TableConfig(reversal_interval_s=300.0),
    "reverses every 100 s": TableConfig(reversal_interval_s=100.0),
    "stops": TableConfig(profile=stops(90.0, 30.0)),
    "stops and reverses": TableConfig(profile=stops(90.0, 30.0, (1, -1))),
    "stands at both ends": TableConfig(
        profile=((0.0, 0.0), (120.0, 0.0), (121.0, 40.0), (479.0, 40.0), (480.0, 0.0))
    ),
    "a thousandth": TableConfig(profile=wavers(1e-3)),
    "two per cent": TableConfig(profile=wavers(0.02)),
    "five per cent": TableConfig(profile=wavers(0.05)),
    "twenty per cent": TableConfig(profile=wavers(0.2)),
    # Here a shift between encoder and gyro cannot be told from a drift of the gyro.
    "runs up evenly": TableConfig(profile=((0.0, 20.0), (DURATION, 60.0))),
    "four rates": TableConfig(
        profile=((0, 10), (150, 10), (153, 20), (300, 20), (303, 40), (450, 40), (453, 80))
    ),
    "slow": TableConfig(rate_deg_per_s=3.0),
}
LINES_RIGHT = (
    "reverses once",
    "reverses every 100 s",
    "stops",
    "stops and reverses",
    "stands at both ends",
    "a thousandth",
    "runs up evenly",
    "four rates",
    "slow",
)


@functools.cache
def simulated(name: str, orders: tuple[tuple[float, float], ...] = ORDERS) -> Simulation:
    return turned(TABLES[name], orders, DURATION)


def turned(
    table: TableConfig, orders: tuple[tuple[float, float], ...], duration: float
) -> Simulation:
    return simulate(
        RigConfig(
            duration_s=duration,
            sample_rate_hz=RATE,
            seed=5,
            table=replace(table, jitter_rms_deg_per_s=0.004, ripple=((12.0, 5e-4), (36.0, 2e-4))),
            encoder=EncoderConfig(periodic_error=((1.0, 1.0),)),
            platform=PlatformConfig(share_deviation=(0.001, 0.0, -0.001)),
            disturbances=DisturbancesConfig(angle=orders, time=TONES),
        )
    )


@functools.cache
def analyzed(name: str) -> Analysis:
    # One record in a thousand of each kind may miss by chance.
    return analyze(simulated(name).recording, Settings(gyros=("x", "z"), confidence=0.999))


# What lies between two others.
BETWEEN = ("reverses once", "stops", "a thousandth", "two per cent")


def most_of(names: Iterable[str]) -> list:
    """Those that lie between two others in `make test-statistics`."""
    return [
        pytest.param(name, marks=pytest.mark.statistics) if name in BETWEEN else name
        for name in names
    ]


@pytest.mark.parametrize("name", most_of(TABLES))
def test_arw_lies_in_its_interval(name):
    answer = analyzed(name).angle_random_walk
    assert answer.status == "estimated"
    assert answer.low <= ARW <= answer.high
    # And that interval says something: ten minutes at 10 Hz hold 3000 bins, half of them white.
    assert answer.high < 1.25 * ARW
    assert answer.low > 0.8 * ARW


@pytest.mark.parametrize("name", most_of(LINES_RIGHT))
def test_lines_are_those_put_in(name):
    truth = simulated(name).truth.lines
    lines = analyzed(name).lines
    for scale, within in (("angle", 0.0), ("time", 0.05 / DURATION)):
        found = sorted((line for line in lines if line.scale == scale), key=frequency_of)
        put_in = [line for line in truth if line.scale == scale]
        places = [line.order or line.frequency_hz for line in put_in]
        assert [line.frequency for line in found] == pytest.approx(places, abs=within, rel=0.0)
        for line, true in zip(found, put_in, strict=True):
            # What Earth rate and the encoder's error make of order 1 cannot be told from it.
            if line.scale == "time" or line.frequency != 1.0:
                amplitude = amplitude_of(true, simulated(name).truth)
                error = 4.5 * line.amplitude_error + LEAKED * ARCSECOND
                assert line.amplitude == pytest.approx(amplitude, abs=error)


@pytest.mark.parametrize(
    "name",
    [
        "stops",
        "five per cent",
        pytest.param("reverses every 100 s", marks=pytest.mark.statistics),
        pytest.param("a thousandth", marks=pytest.mark.statistics),
    ],
)
def test_orders_that_are_not_whole_are_told_from_tones(name):
    # Bearings and gears have such; at a steady table they are tones.
    simulation = simulated(name, ORDERS + BROKEN_ORDERS)
    lines = analyze(simulation.recording, Settings(gyros=("x", "z"))).lines
    found = sorted(
        (line for line in lines if line.scale == "angle" and line.frequency % 1.0 != 0.0),
        key=frequency_of,
    )
    put_in = [line for line in simulation.truth.lines if line.order and line.order % 1.0 != 0.0]
    assert len(found) == len(put_in) == len(BROKEN_ORDERS)
    for line, true in zip(found, put_in, strict=True):
        assert true.order is not None
        assert abs(line.frequency - true.order) < 5.0 * line.frequency_error
        amplitude = amplitude_of(true, simulation.truth)
        error = 4.5 * line.amplitude_error + LEAKED * ARCSECOND
        assert line.amplitude == pytest.approx(amplitude, abs=error)
    in_time = sorted(line.frequency for line in lines if line.scale == "time")
    assert in_time == pytest.approx([place for place, _ in TONES], abs=0.05 / DURATION)


def test_ripple_at_the_order_of_a_line_is_no_shift_of_the_encoder():
    # Where the rate swings, what a shift of the encoder makes of order 36 goes with the ripple.
    times = np.arange(0.0, 1405.0, 5.0)
    rates = 40.0 + 12.0 * np.sin(2.0 * np.pi * times / 700.0)
    table = TableConfig(profile=tuple(zip(times.tolist(), rates.tolist(), strict=True)))
    recording = turned(table, ORDERS, 1400.0).recording
    result = analyze(recording, Settings(gyros=("x", "z"), confidence=0.999))
    answer = result.angle_random_walk
    assert answer.low <= ARW <= answer.high
    assert answer.high < 1.25 * ARW
    assert not any("they are shifted" in str(note) for note in result.notes)


def test_an_order_beyond_those_looked_for_as_a_rule_is_one_line():
    # Gear teeth and motor poles make such; in time it smears over thousands of frequencies.
    simulation = simulated("twenty per cent", (*ORDERS, (140.0, 0.05)))
    result = analyze(simulation.recording, Settings(gyros=("x", "z"), confidence=0.999))
    answer = result.angle_random_walk
    assert answer.low <= ARW <= answer.high
    assert answer.high < 1.25 * ARW
    found = [line for line in result.lines if line.scale == "angle" and line.frequency > 100.0]
    (true,) = [line for line in simulation.truth.lines if line.order == 140.0]
    strongest = max(found, key=lambda line: line.amplitude)
    assert strongest.frequency == 140.0
    amplitude = amplitude_of(true, simulation.truth)
    assert strongest.amplitude == pytest.approx(amplitude, rel=1e-2)
    # Beside it only what the encoder's error makes of it.
    assert all(line is strongest or "encoder" in line.name for line in found)
    in_time = sorted(line.frequency for line in result.lines if line.scale == "time")
    assert in_time == pytest.approx([place for place, _ in TONES], abs=0.05 / DURATION)


def test_a_search_that_does_not_end_gives_a_bound(monkeypatch):
    # As many lines as it may list are found before the weakest stand out.
    monkeypatch.setattr("sagnac.lines.search._MOST_LINES", 3)
    recording = simulated("stands at both ends").recording
    result = analyze(recording, Settings(gyros=("x", "z")))
    answer = result.angle_random_walk
    assert answer.status == "upper bound"
    assert answer.low == 0.0
    assert answer.high >= ARW
    assert "with its lines in" in result.source
    assert any("did not come to an end" in str(note) for note in result.notes)


def frequency_of(line: Line) -> float:
    return line.frequency


def amplitude_of(line: LineTruth, truth: Truth) -> float:
    """Of a line in x and z, each weighted by the other's share; the weights' squares add up to 2.

    So weighted, the two hold none of the table's motion.
    """
    x, z = (
        line.amplitude_arcsec[name] * np.exp(1j * line.phase_rad[name]) * ARCSECOND
        for name in ("x", "z")
    )
    of_x, of_z = truth.shares["x"], truth.shares["z"]
    return float(np.sqrt(2.0) * abs(of_z * x - of_x * z) / np.hypot(of_x, of_z))


def test_a_thousandth_of_the_encoder_missing_changes_nothing(tmp_path):
    name = "stands at both ends"
    whole = simulated(name).recording
    wrapped = np.mod(whole.table.values, 2.0 * np.pi)
    gone = np.flatnonzero(np.random.default_rng(8).random(wrapped.size) < 1e-3)
    gone = gone[(gone > 4) & (gone < wrapped.size - 5)]
    wrapped[gone] = np.nan
    write(replace(whole, table=replace(whole.table, values=wrapped)), tmp_path / "run.parquet")
    recording = read(tmp_path / "run.parquet", Statement())
    assert any(f"{gone.size} missing samples" in str(note) for note in recording.notes)
    found = analyze(recording, Settings(gyros=("x", "z"), confidence=0.999))
    expected = analyzed(name)
    assert found.angle_random_walk.value == pytest.approx(
        expected.angle_random_walk.value, rel=2e-3
    )
    assert len(found.lines) == len(expected.lines)
    for one, other in zip(found.lines, expected.lines, strict=True):
        assert one.frequency == pytest.approx(other.frequency, abs=1e-2 / DURATION)
        assert one.amplitude == pytest.approx(other.amplitude, abs=3.0 * other.amplitude_error)
