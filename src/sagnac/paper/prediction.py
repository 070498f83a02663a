"""Angle random walk that the rig should show, and the table rate that is enough."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from sagnac.arrays import FloatArray
from sagnac.paper.published import PAIR
from sagnac.recording.channel import PAIR_SIZE
from sagnac.rig.config import PRESETS, RigConfig
from sagnac.rig.sections import GYRO_NAMES
from sagnac.rig.truth import truth_of
from sagnac.table.kinematics import shares_from_deviations
from sagnac.units import ARCSECOND, DEGREE, DEGREE_PER_ROOT_HOUR


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """Predicted N-bar and Q-bar of a pair against table rate, and their parts, per gyro.

    What the table adds reaches the difference only through the pair's unequal shares,
    |e_x - e_z|, as an error of angle. An error that is white from sample to sample is
    quantization noise: its Allan variance is 3 Q^2/tau^2 with Q its rms, and the fits tell it from
    N. It does not move N; it raises the frequency from which N cannot be read (`corner`).

    Attributes
    ----------
    rates
        (rates,) table rates, rad/s. The parts have this shape: those of N in rad/sqrt(s), those
        of Q in rad.
    quantum
        N of the quantum limit.
    lock_in
        N of lock-in by `sagnac.rig.ring_laser` at the rate that each gyro senses: it falls as
        1/rate, with the assumed diffusion of the backscatter phase.
    jitter_walk
        N of the servo's angle walk, if the servo holds the rate and the table is not followed.
    encoder
        Q of the encoder: its step over sqrt(12), and the rate times the latch jitter.
    jitter
        Q of the servo's angle jitter, if the servo holds the angle.
    total
        N: quantum limit, lock-in and, if the table is not followed, the jitter's walk.
    quantization
        Q: the gyros' readout, and the encoder or, if the table is not followed, the jitter.

    Raises
    ------
    ValueError
        If a part has not the shape of `rates`.
    """

    rates: FloatArray
    quantum: FloatArray
    lock_in: FloatArray
    jitter_walk: FloatArray
    encoder: FloatArray
    jitter: FloatArray
    total: FloatArray
    quantization: FloatArray

    def __post_init__(self) -> None:
        for part in fields(self):
            values = getattr(self, part.name)
            if values.shape != self.rates.shape:
                raise ValueError(
                    f"{part.name} has shape {values.shape}; give that of rates, {self.rates.shape}"
                )
            values.flags.writeable = False

    def corner(self, sample_rate: float) -> FloatArray:
        """(rates,) frequency in Hz at which N and Q are equally strong in the spectrum.

        White errors of rms Q at each of `sample_rate` (Hz) samples a second have the rate density
        (2 pi f)^2 Q^2 / sample_rate; N has N^2. A record of T seconds holds about `corner` * T
        bins in which N rules, and so N to about 1/sqrt(2 corner T) of itself.
        """
        with np.errstate(divide="ignore"):
            return np.asarray(
                self.total * math.sqrt(sample_rate) / (2.0 * np.pi * self.quantization)
            )


def predicted_angle_random_walk(
    rates: ArrayLike,
    *,
    config: RigConfig = PRESETS["paper"],
    pair: tuple[str, str] = PAIR,
    table_followed: bool = True,
    latch_jitter: float | None = None,
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
        Whether the table's motion is taken out along the encoder (True) or by the difference
        alone, the paper's Step 3 (False).
    latch_jitter
        Rms time between the encoder's sample and the gyro's, s; that of `config` if None.

    Raises
    ------
    ValueError
        If a rate is too low for a rate-biased gyro, or an argument is out of range.

    Examples
    --------
    >>> from sagnac.units import DEGREE, DEGREE_PER_ROOT_HOUR
    >>> prediction = predicted_angle_random_walk([10.0 * DEGREE, 40.0 * DEGREE])
    >>> (prediction.total / DEGREE_PER_ROOT_HOUR).round(7).tolist()
    [6.61e-05, 2.93e-05]
    >>> late = predicted_angle_random_walk([40.0 * DEGREE], latch_jitter=1e-4)
    >>> bool(late.total[0] == prediction.total[1]), (late.corner(500.0) * 7200.0).round().tolist()
    (True, [2212.0])
    """
    speeds = np.array(rates, dtype=np.float64, ndmin=1)
    late = config.encoder.latch_jitter_s if latch_jitter is None else latch_jitter
    if late < 0.0:
        raise ValueError(f"latch_jitter is {late:g} s; it must not be negative")
    for name in pair:
        if name not in GYRO_NAMES:
            raise ValueError(f"pair is {pair!r}; use two of {', '.join(GYRO_NAMES)}")
    quantum = _mean(pair, config.gyro.arw_deg_per_sqrt_h) * DEGREE_PER_ROOT_HOUR
    step = _mean(pair, config.gyro.quantization_step_arcsec) * ARCSECOND
    laser = _laser_noise(speeds, config, pair)
    lock_in = np.sqrt(np.maximum(laser**2 - quantum**2, 0.0))
    encoder = _encoder_error(speeds, config, pair, late)
    walk, jitter = (np.full(speeds.size, part) for part in _jitter(config, pair))
    return Prediction(
        rates=speeds,
        quantum=np.full(speeds.size, quantum),
        lock_in=lock_in,
        jitter_walk=walk,
        encoder=encoder,
        jitter=jitter,
        total=laser if table_followed else np.hypot(laser, walk),
        quantization=np.hypot(step / math.sqrt(12.0), encoder if table_followed else jitter),
    )


def _mean(pair: tuple[str, str], values: Sequence[float]) -> float:
    """Root mean square over the pair of what each gyro has."""
    return math.sqrt(np.mean([values[GYRO_NAMES.index(name)] ** 2 for name in pair]))


def _laser_noise(speeds: FloatArray, config: RigConfig, pair: tuple[str, str]) -> FloatArray:
    """N-bar of quantum limit and lock-in together, by the truth of a rig at each rate."""
    gyro = replace(config.gyro, mode="rate-biased")
    noise = np.empty(speeds.size)
    for index, speed in enumerate(speeds / DEGREE):
        table = replace(
            config.table,
            rate_deg_per_s=float(speed),
            profile=(),
            reversal_interval_s=0.0,
            dwell_s=0.0,
        )
        truth = truth_of(replace(config, gyro=gyro, table=table))
        each = [truth.gyros[name].arw_deg_per_sqrt_h for name in pair]
        noise[index] = math.sqrt(np.mean(np.square(each))) * DEGREE_PER_ROOT_HOUR
    return noise


def _encoder_error(
    speeds: FloatArray, config: RigConfig, pair: tuple[str, str], latch_jitter: float
) -> FloatArray:
    """Q-bar of the encoder's white error of angle, rad."""
    step = 2.0 * math.pi / config.encoder.lines / math.sqrt(12.0)
    measured = _mismatch(config, pair) * np.hypot(step, speeds * latch_jitter)
    return np.asarray(measured / PAIR_SIZE)


def _jitter(config: RigConfig, pair: tuple[str, str]) -> tuple[float, float]:
    """N-bar and Q-bar of the table's jitter: one of them, by what the servo holds."""
    natural = 2.0 * math.pi * config.table.jitter_bandwidth_hz
    servo = config.table.jitter_rms_deg_per_s * DEGREE * _mismatch(config, pair)
    if config.table.jitter_spectrum == "position":
        return 0.0, servo / natural / PAIR_SIZE
    return servo * math.sqrt(2.0 / natural) / PAIR_SIZE, 0.0


def _mismatch(config: RigConfig, pair: tuple[str, str]) -> float:
    shares = shares_from_deviations(config.platform.share_deviation)
    first, second = (float(shares[GYRO_NAMES.index(name)]) for name in pair)
    return abs(first - second)


def adequate_rate(prediction: Prediction, excess: float = 0.1) -> float:
    """Lowest of the predicted rates whose N is within `excess` of the quantum limit, rad/s.

    Q plays no part, since the fits tell it from N; `Prediction.corner` says how long a record it
    then takes. NaN if there is no such rate.
    """
    within = prediction.total <= (1.0 + excess) * prediction.quantum
    return float(prediction.rates[within].min()) if within.any() else math.nan
