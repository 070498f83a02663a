"""Angle random walk that the rig should show, and the table rate that is enough."""

import math
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from sagnac.arrays import FloatArray
from sagnac.paper.published import PAIR
from sagnac.recording.difference import per_gyro
from sagnac.rig.config import PRESETS, RigConfig
from sagnac.rig.sections import GYRO_NAMES
from sagnac.rig.truth import truth_of
from sagnac.table.frames import shares_from_deviations
from sagnac.units import DEGREE, DEGREE_PER_ROOT_HOUR


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """Predicted N-bar of a pair against table rate, and its parts, per gyro.

    What the table adds reaches the difference only through the pair's unequal shares,
    |e_x - e_z|, as an error of angle. An angle error that is white between samples, of rms a,
    has the Allan variance 3 a^2/tau^2, which at cluster time tau passes for N = sqrt(3/tau) a.

    Attributes
    ----------
    rates
        (rates,) table rates, rad/s. The parts have this shape, in rad/sqrt(s).
    quantum
        The quantum limit.
    lock_in
        Lock-in of `sagnac.rig.ring_laser` at the rate that each gyro senses: it falls as 1/rate.
    encoder
        If the table's motion is taken out along the encoder: its step over sqrt(12), and the
        rate times the latch jitter, the part that grows with rate.
    jitter
        If it is not (the paper's Step 3 alone): the servo's angle jitter, or, if the servo holds
        the rate and not the angle, the walk of that angle.
    total
        Quantum limit, lock-in, and encoder or jitter, added in square.

    Raises
    ------
    ValueError
        If a part has not the shape of `rates`.
    """

    rates: FloatArray
    quantum: FloatArray
    lock_in: FloatArray
    encoder: FloatArray
    jitter: FloatArray
    total: FloatArray

    def __post_init__(self) -> None:
        for part in fields(self):
            values = getattr(self, part.name)
            if values.shape != self.rates.shape:
                raise ValueError(
                    f"{part.name} has shape {values.shape}; give that of rates, {self.rates.shape}"
                )
            values.flags.writeable = False


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

    The parts of it and where they come from are those of `Prediction`.

    Parameters
    ----------
    rates
        (rates,) table rates, rad/s.
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

    Examples
    --------
    >>> from sagnac.units import DEGREE, DEGREE_PER_ROOT_HOUR
    >>> prediction = predicted_angle_random_walk([10.0 * DEGREE, 40.0 * DEGREE])
    >>> (prediction.total / DEGREE_PER_ROOT_HOUR).round(7).tolist()
    [6.61e-05, 2.94e-05]
    """
    speeds = np.array(rates, dtype=np.float64, ndmin=1)
    if latch_jitter < 0.0 or not cluster_time > 0.0:
        raise ValueError(
            f"latch_jitter {latch_jitter:g} s must not be negative and cluster_time "
            f"{cluster_time:g} s must be positive"
        )
    for name in pair:
        if name not in GYRO_NAMES:
            raise ValueError(f"pair is {pair!r}; use two of {', '.join(GYRO_NAMES)}")
    limits = [config.gyro.arw_deg_per_sqrt_h[GYRO_NAMES.index(name)] for name in pair]
    quantum = np.full(speeds.size, math.sqrt(np.mean(np.square(limits)))) * DEGREE_PER_ROOT_HOUR
    laser = _laser_noise(speeds, config, pair)
    encoder = _encoder_noise(speeds, config, pair, latch_jitter, cluster_time)
    jitter = np.full(speeds.size, _jitter_noise(config, pair, cluster_time))
    return Prediction(
        rates=speeds,
        quantum=quantum,
        lock_in=np.sqrt(np.maximum(laser**2 - quantum**2, 0.0)),
        encoder=encoder,
        jitter=jitter,
        total=np.hypot(laser, encoder if table_followed else jitter),
    )


def _laser_noise(speeds: FloatArray, config: RigConfig, pair: tuple[str, str]) -> FloatArray:
    """N-bar of quantum limit and lock-in together, by the truth of a rig at each rate."""
    gyro = replace(config.gyro, mode="rate-biased")
    noise = np.empty(speeds.size)
    for index, speed in enumerate(speeds / DEGREE):
        table = replace(
            config.table, rate_deg_per_s=float(speed), profile=(), reversal_interval_s=0.0
        )
        truth = truth_of(replace(config, gyro=gyro, table=table))
        each = [truth.gyros[name].arw_deg_per_sqrt_h for name in pair]
        noise[index] = math.sqrt(np.mean(np.square(each))) * DEGREE_PER_ROOT_HOUR
    return noise


def _encoder_noise(
    speeds: FloatArray,
    config: RigConfig,
    pair: tuple[str, str],
    latch_jitter: float,
    cluster_time: float,
) -> FloatArray:
    """N-bar that the encoder's white angle error passes for."""
    white = _mismatch(config, pair) * math.sqrt(3.0 / cluster_time)
    step = 2.0 * math.pi / config.encoder.lines / math.sqrt(12.0)
    measured = white * np.hypot(step, speeds * latch_jitter)
    return np.array([per_gyro(value**2, 2) for value in measured])


def _jitter_noise(config: RigConfig, pair: tuple[str, str], cluster_time: float) -> float:
    """N-bar that the table's jitter passes for."""
    natural = 2.0 * math.pi * config.table.jitter_bandwidth_hz
    servo = config.table.jitter_rms_deg_per_s * DEGREE
    mismatch = _mismatch(config, pair)
    if config.table.jitter_spectrum == "position":
        measured = mismatch * math.sqrt(3.0 / cluster_time) * servo / natural
    else:
        measured = mismatch * servo * math.sqrt(2.0 / natural)
    return per_gyro(measured**2, 2)


def _mismatch(config: RigConfig, pair: tuple[str, str]) -> float:
    shares = shares_from_deviations(config.platform.share_deviation)
    first, second = (float(shares[GYRO_NAMES.index(name)]) for name in pair)
    return abs(first - second)


def adequate_rate(prediction: Prediction, excess: float = 0.1) -> float:
    """Lowest of the predicted rates whose N is within `excess` of the quantum limit, rad/s.

    NaN if there is none.
    """
    within = prediction.total <= (1.0 + excess) * prediction.quantum
    return float(prediction.rates[within].min()) if within.any() else math.nan
