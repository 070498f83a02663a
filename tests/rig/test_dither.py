"""Dither in the output of the rig: where sampling folds it, how much is left, what drives it."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.rig.config import RigConfig, preset
from sagnac.rig.ring_laser import folded
from sagnac.rig.sections import ConfigurationError, DitherConfig, GyroConfig, TableConfig
from sagnac.rig.simulate import blocks, simulate
from tests.rig.rigs import ARCSEC

LEFT = DitherConfig(residue=(0.01, 0.0, 0.02), delay_s=(0.0, 2e-6, 1e-6))
STEADY = GyroConfig(mode="dithered", quantization_step_arcsec=(0.0, 0.0, 0.0))
CONFIG = RigConfig(duration_s=20.0, table=TableConfig(rate_deg_per_s=0.0), gyro=STEADY, dither=LEFT)


def residue_of(config):
    """What the dither adds to each gyro, arcsec."""
    made = simulate(config).recording
    clean = simulate(replace(config, dither=DitherConfig())).recording
    return {gyro.name: (gyro.values - clean.gyro(gyro.name).values) / ARCSEC for gyro in made.gyros}


def test_what_is_left_lies_where_the_truth_says():
    truth = simulate(CONFIG).truth
    for name, residue in residue_of(CONFIG).items():
        put_in = truth.dither[name]
        window = np.hanning(residue.size)
        spectrum = np.abs(np.fft.rfft(window * residue))
        peak = np.argmax(spectrum) / CONFIG.duration_s
        assert peak == pytest.approx(put_in["folded_hz"], abs=1.0 / CONFIG.duration_s)
        # A random part of 2 % moves the amplitude of ten seconds by less.
        assert np.std(residue) * np.sqrt(2.0) == pytest.approx(put_in["left_arcsec"], rel=0.05)
    # Amplitude is rate over angular frequency; 1 % of it is left, and 2 us late of 400 Hz is 0.5 %.
    amplitude = 100.0 * 3600.0 / (2.0 * np.pi * 387.3)
    assert truth.dither["x"]["left_arcsec"] == pytest.approx(0.01 * amplitude)
    late = 2.0 * np.pi * 400.0 * 2e-6
    assert truth.dither["y"]["left_arcsec"] / truth.dither["y"][
        "amplitude_arcsec"
    ] == pytest.approx(2.0 * np.sin(late / 2.0))


def test_sampling_folds():
    for frequency in (387.3, 411.3, 640.0):
        times = np.arange(2000) / 500.0
        spectrum = np.abs(np.fft.rfft(np.hanning(2000) * np.cos(2.0 * np.pi * frequency * times)))
        assert np.argmax(spectrum) * 0.25 == pytest.approx(folded(frequency, 500.0), abs=0.26)


def test_the_random_part_has_the_strength_and_ring_down_asked_for():
    config = replace(
        CONFIG,
        duration_s=400.0,
        gyro=replace(STEADY, dither_amplitude_noise=0.1),
        dither=replace(LEFT, ring_down_s=0.2, pickoff_noise_arcsec=0.0),
    )
    truth = simulate(config).truth.dither["x"]
    shown = next(one for one in simulate(config).recording.pickoffs if one.gyro == "x").values
    times = np.arange(shown.size) / config.sample_rate_hz
    # Mixed down, and the image at twice the frequency taken out by a window of 40 ms.
    mixed = (
        shown * np.exp(2j * np.pi * truth["folded_hz"] * times) * 2.0 / truth["amplitude_arcsec"]
    )
    window = np.hanning(22)[1:-1]
    envelope = mixed.reshape(-1, 20) @ (window / window.sum())
    random = envelope - envelope.mean()
    assert np.std(random.real) == pytest.approx(0.1, rel=0.15)
    lag = 5
    correlation = np.mean(random[lag:] * random[:-lag].conj()).real / np.mean(np.abs(random) ** 2)
    # 400 s with a ring-down of 0.2 s hold 2000 independent values: 2 % each.
    assert correlation == pytest.approx(np.exp(-lag * 0.04 / 0.2), abs=0.08)


def test_samples_do_not_depend_on_the_blocks():
    # Angles are read out in steps, as they are in the presets.
    config = replace(CONFIG, duration_s=4.0, gyro=GyroConfig(mode="dithered"))
    whole = simulate(config).recording
    made = [columns for columns, _ in blocks(config, block_samples=333)]
    for held in (*whole.gyros, *whole.pickoffs):
        name = held.column if held in whole.pickoffs else held.name
        np.testing.assert_array_equal(held.values, np.concatenate([part[name] for part in made]))


def test_without_residue_there_is_no_pickoff():
    simulation = simulate(replace(CONFIG, duration_s=1.0, dither=DitherConfig()))
    assert simulation.recording.pickoffs == ()
    assert simulation.truth.dither == {}


def test_the_preset_is_the_paper_s_rig_with_dither():
    config = preset("dithered")
    assert config.gyro.mode == "dithered"
    assert config.table == preset("paper").table
    assert all(
        1.0 < one["left_arcsec"] < 3.0
        for one in simulate(replace(config, duration_s=1.0)).truth.dither.values()
    )


def test_what_cannot_be_is_refused():
    with pytest.raises(ConfigurationError, match=r"of mode 'dithered'; gyro\.mode is 'ideal'"):
        RigConfig(dither=LEFT)
    with pytest.raises(ConfigurationError, match="leaves no frequency"):
        replace(
            CONFIG,
            gyro=replace(STEADY, dither_frequency_hz=50.0),
            dither=replace(LEFT, detuning_hz=(-60.0, 0.0, 0.0)),
        )
