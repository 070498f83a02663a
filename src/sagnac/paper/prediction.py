"""Angle random walk that the rig should show, and the table rate that is enough."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from sagnac.arrays import FloatArray
from sagnac.paper.plan import PAIR
from sagnac.recording.difference import per_gyro
from sagnac.rig.config import PRESETS, RigConfig
from sagnac.rig.sections import GYRO_NAMES
from sagnac.rig.truth import truth_of
from sagnac.units import DEGREE, DEGREE_PER_ROOT_HOUR


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """Predicted N-bar of a pair against table rate, and its parts; (rates,), SI.

    The parts add in square: `quantum`, `lock_in`, and `encoder` or `jitter`, whichever
    `predicted_angle_random_walk` was asked to count into `total`.
    """

    rates: FloatArray
    quantum: FloatArray
    lock_in: FloatArray
    encoder: FloatArray
    jitter: FloatArray
    total: FloatArray


def predicted_angle_random_walk(
    rates: ArrayLike,
    *,
    config: RigConfig = PRESETS["paper"],
    pair: tuple[str, str] = PAIR,
    table_followed: bool = True,
    latch_jitter: float = 0.0,
    cluster_time: float = 1.0,
) -> Prediction:
    """N that a rate-biased pair will show at each table rate: the choice of table rate.

    Quantum limit and lock-in are those of `sagnac.ring_laser` at the rate that each gyro
    senses; lock-in falls as 1/rate. What the table adds reaches the difference only through
    the pair's unequal shares, |e_x - e_z|, as an error of angle. An angle error that is
    white between samples, of rms a, has the Allan variance 3 a^2/tau^2, which at cluster
    time tau passes for N = sqrt(3/tau) a:

    encoder
        Where the table's motion is taken out along the encoder, its step over sqrt(12),
        and the rate times the latch jitter: the part that grows with rate.
    jitter
        Where it is not (the paper's Step 3 alone), the servo's angle jitter; of a servo
        that holds the rate and not the angle, the walk of that angle.

    Parameters
    ----------
    rates
        Table rates, rad/s, in any shape that is one-dimensional.
    config
        Laser, table, encoder and shares; its mode and rate play no part.
    pair
        The gyros differenced.
    table_followed
        Whether `total` counts the encoder (True) or the jitter (False).
    latch_jitter
        Rms time between the encoder's sample and the gyro's, s; 0 on the simulated rig.
    cluster_time
        At which the white angle errors are read as N, s.

    Raises
    ------
    ValueError
        If a rate is too low for a rate-biased gyro, or an argument is out of range.
    """
    speeds = np.atleast_1d(np.asarray(rates, dtype=np.float64))
    if latch_jitter < 0.0 or not cluster_time > 0.0:
        raise ValueError(
            f"latch_jitter {latch_jitter:g} s must not be negative and cluster_time "
            f"{cluster_time:g} s must be positive"
        )
    gyro = replace(config.gyro, mode="rate-biased")
    limits = [gyro.arw_deg_per_sqrt_h[GYRO_NAMES.index(name)] for name in pair]
    quantum = np.full(speeds.size, math.sqrt(np.mean(np.square(limits)))) * DEGREE_PER_ROOT_HOUR
    laser = np.empty(speeds.size)
    shares: Mapping[str, float] = {}
    for index, speed in enumerate(speeds / DEGREE):
        table = replace(
            config.table, rate_deg_per_s=float(speed), profile=(), reversal_interval_s=0.0
        )
        truth = truth_of(replace(config, gyro=gyro, table=table))
        shares = truth.shares
        noise = [truth.gyros[name].arw_deg_per_sqrt_h for name in pair]
        laser[index] = math.sqrt(np.mean(np.square(noise))) * DEGREE_PER_ROOT_HOUR
    mismatch = abs(shares[pair[0]] - shares[pair[1]]) if shares else 0.0
    white = mismatch * math.sqrt(3.0 / cluster_time)
    step = 2.0 * math.pi / config.encoder.lines / math.sqrt(12.0)
    encoder = _of_pair(white * np.hypot(step, speeds * latch_jitter))
    natural = 2.0 * math.pi * config.table.jitter_bandwidth_hz
    servo = config.table.jitter_rms_deg_per_s * DEGREE
    walk = (
        white * servo / natural
        if config.table.jitter_spectrum == "position"
        else mismatch * servo * math.sqrt(2.0 / natural)
    )
    jitter = _of_pair(np.full(speeds.size, walk))
    return Prediction(
        rates=speeds,
        quantum=quantum,
        lock_in=np.sqrt(np.maximum(laser**2 - quantum**2, 0.0)),
        encoder=encoder,
        jitter=jitter,
        total=np.hypot(laser, encoder if table_followed else jitter),
    )


def _of_pair(measured: FloatArray) -> FloatArray:
    """Per gyro, what is measured of a difference of two."""
    return np.array([per_gyro(value**2, 2) for value in measured])


def adequate_rate(prediction: Prediction, excess: float = 0.1) -> float:
    """Lowest of the predicted rates whose N is within `excess` of the quantum limit, rad/s.

    NaN where none is.
    """
    within = prediction.total <= (1.0 + excess) * prediction.quantum
    return float(prediction.rates[within].min()) if within.any() else math.nan
