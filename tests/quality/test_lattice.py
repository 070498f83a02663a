"""The step that numbers are counted in, as files hold them."""

import numpy as np
import pytest

from sagnac.quality.check import judged
from sagnac.quality.readout import joint_readout, readout_of
from sagnac.recording.model import Recording
from tests.instruments import ARCSECOND, Readout, turntable

STEP = 0.0008  # arcsec


@pytest.mark.parametrize("motion", ["reversing", "dwelling"])
def test_a_table_that_reverses_at_once_has_the_step_of_its_readout(motion):
    made = turntable(2, seconds=300.0, jitter=0.0, motion=motion, readout=Readout(step=STEP))
    found = readout_of(made.angles["x"])
    assert found.step == pytest.approx(STEP, rel=1e-3)
    recording = Recording.from_arrays(
        kind="angle",
        unit="arcsec",
        sample_rate=made.sample_rate,
        table=made.encoder,
        table_unit="deg",
        **made.angles,
    )
    # The encoder has 24 bits a turn, 0.077 arcsec, and the gyro senses 0.577 of it.
    joint = joint_readout(recording, ("x",), made.sample_rate)
    assert joint.step < 0.05 * ARCSECOND


@pytest.mark.parametrize("part", [1, 20])
def test_a_table_that_turns_round_evenly_has_no_step_of_its_own(part):
    times = np.arange(120_000) / 200.0
    rate = 30.0 * np.clip(25.0 * np.sin(2.0 * np.pi * times / 150.0), -1.0, 1.0)
    noise = np.cumsum(2e-4 * np.random.default_rng(4).standard_normal(times.size))
    angle = np.cumsum(0.577 * rate) / 200.0 + noise
    coarse = np.rint(angle / 0.1) * 0.1
    stated = {"kind": "angle", "unit": "deg", "sample_rate": 200.0}
    fine = Recording.from_arrays(x=angle, **stated)
    assert joint_readout(fine, ("x",), 200.0 / part).notes == ()
    found = joint_readout(Recording.from_arrays(x=coarse, **stated), ("x",), 200.0 / part)
    assert found.step == pytest.approx(np.radians(0.1), rel=0.02)


@pytest.mark.parametrize("begins", [0.0, 0.2])
def test_even_ramps_that_begin_within_a_sample_are_no_readout_of_a_rate(begins):
    fine = np.arange(64 * 20 * 288) / (64 * 20.0) + begins / 20.0
    corners = [0, 1, 30, 31, 36, 37, 66, 67, 72]
    motion = np.interp(fine % 72.0, corners, [0, 10, 10, 0, 0, -10, -10, 0, 0])
    rates = motion.reshape(-1, 64).mean(axis=1)
    noise = 2e-4 * np.random.default_rng(3).standard_normal(rates.size)
    turned = {"table": np.cumsum(rates) / 20.0, "table_unit": "deg", "x": rates + noise}
    recording = Recording.from_arrays(kind="rate", unit="deg/s", sample_rate=20.0, **turned)
    assert "resolution" not in {note.name for note in judged(recording)}


def test_reversals_of_a_readout_that_nothing_dithers_dither_nothing():
    turned = np.abs(np.mod(np.arange(100_000) * 0.25, 2000.0) - 1000.0)
    assert readout_of(np.floor(turned)).every != 1


@pytest.mark.parametrize("decimals", [8, 9, 10])
def test_counts_of_an_angle_are_no_soft_saturation(decimals):
    for seed in (1, 2, 3):
        made = turntable(
            seed,
            seconds=80.0,
            sample_rate=500.0,
            walk=2.5e-5,
            jitter=1e-4,
            mains=0.005,
            table_rate=40.0,
        )
        recording = Recording.from_arrays(
            x=np.round(made.angles["x"] / 3600.0, decimals),
            kind="angle",
            unit="deg",
            sample_rate=500.0,
        )
        assert not {note.name for note in judged(recording)} & {"clipping", "short-tails"}


@pytest.mark.parametrize("bias", [8.12, 12.5, 13.96])
@pytest.mark.parametrize("kind", ["rate", "increment"])
def test_counts_of_an_angle_that_hardly_scatters_are_of_one_sensor(kind, bias):
    """Their scatter is none, and what rounding makes of it may differ from sample to sample."""
    rate, samples, count = 100.0, 90_000, 0.1
    noise = np.random.default_rng(3).standard_normal(samples)
    # N = 0.003 deg/sqrt(h), in arcseconds.
    angle = np.cumsum(bias / rate + 0.003 * 60.0 / np.sqrt(rate) * noise)
    steps = np.diff(count * np.round(angle / count), prepend=0.0)
    values, unit = (steps * rate, "arcsec/s") if kind == "rate" else (steps, "arcsec")
    recording = Recording.from_arrays(x=values, kind=kind, unit=unit, sample_rate=rate)
    assert "interleaved" not in [note.name for note in judged(recording)]
