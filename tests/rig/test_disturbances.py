"""Periodic disturbances are those of the truth."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sagnac.rig.own_motion import Disturbances
from sagnac.rig.sections import DisturbancesConfig
from sagnac.rig.simulate import simulate
from tests.rig.rigs import ARCSEC, configured, triad, true_table_angle


def test_disturbances_are_those_of_the_truth():
    config = configured(
        duration_s=200.0,
        disturbances=DisturbancesConfig(
            angle=((1.0, 0.6), (7.0, 0.2), (2.5, 0.1)), time=((1.37, 0.05), (50.0, 0.02))
        ),
    )
    simulation = simulate(config)
    quiet = triad(replace(config, disturbances=DisturbancesConfig()))
    gyros = np.array([gyro.values for gyro in simulation.recording.gyros])
    left = (gyros - quiet) / ARCSEC
    alpha = true_table_angle(config)
    time = np.arange(config.samples) / 500.0
    for line in simulation.truth.lines:
        if line.scale == "angle":
            argument = line.order * alpha
        else:
            argument = 2 * math.pi * line.frequency_hz * time
        for g, name in enumerate("xyz"):
            amplitude, phase = line.amplitude_arcsec[name], line.phase_rad[name]
            # Eqs. 10 and 11: nothing at zero.
            left[g] -= amplitude * (np.cos(argument + phase) - math.cos(phase))
        x, z = (
            line.amplitude_arcsec[name] * np.exp(1j * line.phase_rad[name]) for name in ("x", "z")
        )
        assert line.difference_amplitude_arcsec["x-z"] == pytest.approx(abs(x - z))
    assert np.abs(left).max() < 1e-6
    put_in = {line.order or line.frequency_hz for line in simulation.truth.lines}
    assert put_in == {1.0, 7.0, 2.5, 1.37, 50.0}
    for line in simulation.truth.lines:
        largest = dict([*config.disturbances.angle, *config.disturbances.time])
        position = line.order or line.frequency_hz
        assert all(
            0.5 * largest[position] <= a <= largest[position]
            for a in line.amplitude_arcsec.values()
        )


@pytest.mark.parametrize("pieces", [1, 2, 9])
def test_lines_go_on_from_one_block_to_the_next(pieces):
    config = DisturbancesConfig(angle=((3.0, 1.0), (2.5, 1.0)), time=((7.3, 1.0),))
    drawn = Disturbances(config, np.random.default_rng(3))
    assert drawn.angle.position.tolist() == [2.5, 3.0]
    alpha = np.linspace(0.0, 20.0, 5000)
    parts = np.array_split(np.arange(alpha.size), pieces)
    made = np.concatenate([drawn.advance(int(p[0]), alpha[p], 0.002) for p in parts], axis=1)
    np.testing.assert_allclose(made[:, 0], 0.0, atol=1e-18)
    turns = np.exp(1j * np.outer(drawn.angle.position, alpha))
    time = np.exp(2j * np.pi * 7.3 * 0.002 * np.arange(alpha.size))
    expected = (drawn.angle.phasor @ turns + drawn.time.phasor * time).real
    np.testing.assert_allclose(made, expected - expected[:, :1], atol=1e-12 * ARCSEC)
