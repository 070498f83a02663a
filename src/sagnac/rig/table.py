"""The table of the rig: the rate commanded and the rate that it makes of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg

from sagnac.arrays import FloatArray
from sagnac.units import DEGREE

if TYPE_CHECKING:
    from sagnac.rig.config import RigConfig


@dataclass(frozen=True, slots=True, kw_only=True)
class _Command:
    """Commanded table motion: rate at knots, straight between, constant outside."""

    time: FloatArray
    rate: FloatArray
    angle: FloatArray

    def rate_at(self, time: FloatArray) -> FloatArray:
        return np.interp(time, self.time, self.rate)

    def angle_at(self, time: FloatArray) -> FloatArray:
        index = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, self.time.size - 1)
        since = time - self.time[index]
        rate = self.rate_at(time)
        # Mean of the rates at both ends of a straight piece; outside the knots they agree.
        return np.asarray(self.angle[index] + 0.5 * (self.rate[index] + rate) * since)


def table_command(config: RigConfig) -> _Command:
    """The motion that the configuration commands."""
    table = config.table
    if table.profile:
        knots = list(table.profile)
    else:
        knots = [(0.0, table.rate_deg_per_s)]
        interval = table.reversal_interval_s
        if interval > 0.0 and table.rate_deg_per_s != 0.0:
            half_ramp = abs(table.rate_deg_per_s) / table.acceleration_deg_per_s2
            sign = 1.0
            turn_round = interval
            while turn_round < config.duration_s:
                knots.append((turn_round - half_ramp, sign * table.rate_deg_per_s))
                sign = -sign
                knots.append((turn_round + half_ramp, sign * table.rate_deg_per_s))
                turn_round += interval
    time = np.array([time for time, _ in knots])
    rate = np.array([rate for _, rate in knots]) * DEGREE
    pieces = 0.5 * (rate[1:] + rate[:-1]) * np.diff(time)
    angle = np.concatenate([[0.0], np.cumsum(pieces)])
    command = _Command(time=time, rate=rate, angle=angle)
    start = table.start_deg * DEGREE - float(command.angle_at(np.zeros(1))[0])
    return replace(command, angle=angle + start)


def jitter_step(config: RigConfig, step: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Exact transition, noise factor and starting spread of the servo's oscillator."""
    natural = 2.0 * math.pi * config.table.jitter_bandwidth_hz
    rms = config.table.jitter_rms_deg_per_s * DEGREE
    damping = config.table.jitter_damping
    stationary = np.diag([(rms / natural) ** 2, rms**2])
    slope = np.array([[0.0, 1.0], [-natural * natural, -2.0 * damping * natural]])
    transition = np.asarray(scipy.linalg.expm(slope * step))
    added = stationary - transition @ stationary @ transition.T
    return transition, np.linalg.cholesky(added), np.sqrt(np.diag(stationary))
