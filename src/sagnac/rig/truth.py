"""Truth of a simulated recording."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Final, Literal

import numpy as np

from sagnac.core.arrays import ComplexArray
from sagnac.core.units import ARCSECOND, DEGREE, DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR
from sagnac.recording.columns import GYRO_NAMES
from sagnac.rig import own_motion, ring_laser, sections
from sagnac.rig.config import RigConfig, TableCommand
from sagnac.rig.table import LineSet, RandomStreams

_PAIRS: Final = (("x", "z"), ("x", "y"), ("y", "z"))
Scale = Literal["angle", "time"]


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseTruth:
    """Coefficients put in: of one gyro, or of a pair per gyro as Eq. 3 averages them.

    A pair's are means of squares; its ramp is the difference of the two over sqrt(2),
    since ramps are no random terms and cancel where they are equal.
    """

    quantization_arcsec: float
    arw_deg_per_sqrt_h: float
    bias_instability_deg_per_h: float
    rate_random_walk_deg_per_h_per_sqrt_h: float
    rate_ramp_deg_per_h_per_h: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LineTruth:
    """A periodic disturbance as put in.

    ``amplitude * cos(2 pi f t + phase)`` with t from the first sample, or
    ``amplitude * cos(order alpha + phase)``, for each gyro; the constant of Eqs. 10 and
    11 that makes it zero at the start is left out. `difference_amplitude_arcsec` is what
    is left in each difference of two. A line in angle has an order, a line in time a frequency.
    """

    scale: Scale
    order: float | None
    frequency_hz: float | None
    amplitude_arcsec: Mapping[str, float]
    phase_rad: Mapping[str, float]
    difference_amplitude_arcsec: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """Contents of the recording; ``dataclasses.asdict`` of it is the JSON.

    The coefficients of `gyros` and `pairs` are those before a gyro's own low-pass, whose corner
    (-3 dB) is in `low_pass_hz`, 0 without one: well below the corner the recording shows them.
    `dither` holds of each gyro whose stripping leaves some of it where the dither is and where
    sampling folds it to, its amplitude and what is left of it.
    `encoder` is None on a table that is not commanded to move. A reading is late by a delay that
    goes from `delay_start_s` to `delay_end_s`, drift and clock together; beside that it walks, by
    `delay_walk_end_s` rms at the end. `nutation_walk_deg_per_sqrt_h` is
    what a nutation of the shaft adds to N of each gyro and pair, as root of squares, on a table
    that turns evenly; the coefficients of `gyros` and `pairs` are without it. It is empty if there
    is no nutation.
    """

    schema: str
    seed: int
    samples: int
    sample_rate_hz: float
    table_rate_deg_per_s: float
    table_jitter_rms_deg_per_s: float
    shares: Mapping[str, float]
    earth_rate_b0_deg_per_h: sections.Triple
    gyros: Mapping[str, NoiseTruth]
    pairs: Mapping[str, NoiseTruth]
    low_pass_hz: Mapping[str, float]
    lines: tuple[LineTruth, ...]
    earth_rate_order_one: LineTruth | None
    config: Mapping[str, Any]
    dither: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    encoder: Mapping[str, Any] | None = None
    nutation_walk_deg_per_sqrt_h: Mapping[str, float] = field(default_factory=dict)


def truth_of(config: RigConfig) -> Truth:
    """Contents of a recording of this configuration, without making it."""
    command = config.command
    turned = command.angle_at(np.array([config.duration_s])) - command.angle_at(np.zeros(1))
    rate = float(turned[0] / config.duration_s)
    gyros = _gyro_truths(config, rate)
    return Truth(
        schema="sagnac.truth/1",
        seed=config.seed,
        samples=config.samples,
        sample_rate_hz=config.sample_rate_hz,
        table_rate_deg_per_s=rate / DEGREE,
        table_jitter_rms_deg_per_s=config.table.jitter_rms_deg_per_s,
        shares=dict(zip(GYRO_NAMES, config.platform.shares.tolist(), strict=True)),
        earth_rate_b0_deg_per_h=tuple((config.platform.earth / DEGREE_PER_HOUR).tolist()),
        gyros=gyros,
        pairs={f"{a}-{b}": _pair_truth(gyros[a], gyros[b]) for a, b in _PAIRS},
        low_pass_hz=dict(zip(GYRO_NAMES, config.gyro.low_pass_hz, strict=True)),
        lines=_line_truths(config),
        earth_rate_order_one=_order_one(command, config.platform),
        config=asdict(config),
        dither=_dither_truths(config),
        encoder=_encoder_truth(config) if config.turning else None,
        nutation_walk_deg_per_sqrt_h=_nutation_walks(config, command),
    )


def _nutation_walks(config: RigConfig, command: TableCommand) -> dict[str, float]:
    """Nutation's part of N of each gyro and, per gyro, of each pair; empty without any."""
    if config.motion.nutation_rms_arcsec == 0.0 or command.rate.size != 1 or not config.turning:
        return {}
    walk = own_motion.nutation_walk(config.motion, float(command.rate[0])) / DEGREE_PER_ROOT_HOUR
    level = dict(zip(GYRO_NAMES, config.platform.matrix[:, :2], strict=True))
    alone = {name: walk * float(np.linalg.norm(part)) for name, part in level.items()}
    apart = {f"{a}-{b}": float(np.linalg.norm(level[a] - level[b])) for a, b in _PAIRS}
    return alone | {name: walk * size / math.sqrt(2.0) for name, size in apart.items()}


def _encoder_truth(config: RigConfig) -> dict[str, Any]:
    encoder = config.encoder
    start, end = encoder.delay_at([0.0, config.duration_s], config.duration_s).tolist()
    return {
        "step_arcsec": 2.0 * math.pi / encoder.lines / ARCSECOND,
        "periodic_error_arcsec": encoder.periodic_error,
        "latch_jitter_s": encoder.latch_jitter_s,
        "delay_start_s": start,
        "delay_end_s": end,
        "delay_walk_end_s": encoder.delay_walk(config.duration_s),
        "clock_ppm": encoder.clock_ppm,
        "reading_rate_hz": encoder.reading_rate_hz or config.sample_rate_hz,
        "lost_fraction": encoder.lost_fraction,
        "missing_null_fraction": encoder.missing_null_fraction,
    }


def _dither_truths(config: RigConfig) -> dict[str, dict[str, float]]:
    """Dither of every gyro; empty if the gyros' own stripping leaves nothing."""
    truths = {}
    for g, name in enumerate(GYRO_NAMES if config.dither.is_left else ()):
        frequency = own_motion.dither_frequency(config, g)
        amplitude = own_motion.dither_amplitude(config, g)
        truths[name] = {
            "frequency_hz": frequency,
            "folded_hz": ring_laser.folded(frequency, config.sample_rate_hz),
            "amplitude_arcsec": amplitude / ARCSECOND,
            "left_arcsec": abs(own_motion.left_of(config, g)) * amplitude / ARCSECOND,
        }
    return truths


def _gyro_truths(config: RigConfig, table_rate: float) -> dict[str, NoiseTruth]:
    gyro, truths = config.gyro, {}
    stated = [one.name for one in fields(NoiseTruth) if hasattr(gyro, one.name)]
    for g, walk in enumerate(_angle_random_walks(config, table_rate)):
        step = gyro.quantization_step_arcsec[g] / math.sqrt(12.0)
        put_in = {name: getattr(gyro, name)[g] for name in stated}
        put_in["quantization_arcsec"] = math.hypot(step, gyro.angle_noise_arcsec[g])
        truths[GYRO_NAMES[g]] = NoiseTruth(**put_in | {"arw_deg_per_sqrt_h": walk})
    return truths


def _angle_random_walks(config: RigConfig, table_rate: float) -> list[float]:
    """N of each gyro at the mean of what it senses, deg/sqrt(h)."""
    lasers, dither = ring_laser.ring_lasers_of(config.gyro), ring_laser.dither_of(config.gyro)
    platform = config.platform
    if not lasers:
        return list(config.gyro.arw_deg_per_sqrt_h)
    turned = platform.earth
    if config.turning:
        # The Earth's horizontal part averages out.
        turned = np.array([0.0, 0.0, table_rate + turned[2]])
    sensed = zip(lasers, platform.matrix @ turned, strict=True)
    walks = [ring_laser.angle_random_walk(laser, rate, dither) for laser, rate in sensed]
    return [float(walk) / DEGREE_PER_ROOT_HOUR for walk in walks]


def _line_truths(config: RigConfig) -> tuple[LineTruth, ...]:
    drawn = own_motion.Disturbances(config.disturbances, RandomStreams(config.seed).disturbances)
    scales: tuple[tuple[Scale, LineSet], ...] = (("angle", drawn.angle), ("time", drawn.time))
    return tuple(
        _line_truth(scale, float(position), lines.phasor[:, j])
        for scale, lines in scales
        for j, position in enumerate(lines.position)
    )


def _order_one(command: TableCommand, platform: sections.PlatformConfig) -> LineTruth | None:
    """The harmonic that the Earth rate makes at a constant table rate, or None."""
    if command.rate.size != 1 or command.rate[0] == 0.0:
        return None
    # k1 sin(alpha) - k2 cos(alpha) of Eq. 6, over the rate, as one phasor.
    matrix, earth = platform.matrix, platform.earth
    k1 = matrix[:, 0] * earth[0] + matrix[:, 1] * earth[1]
    k2 = matrix[:, 0] * earth[1] - matrix[:, 1] * earth[0]
    return _line_truth("angle", 1.0, (-k2 - 1j * k1) / command.rate[0])


def _pair_truth(first: NoiseTruth, second: NoiseTruth) -> NoiseTruth:
    both = zip(asdict(first).items(), asdict(second).values(), strict=True)
    mean_square = {name: math.sqrt((a**2 + b**2) / 2.0) for (name, a), b in both}
    ramp = first.rate_ramp_deg_per_h_per_h - second.rate_ramp_deg_per_h_per_h
    mean_square["rate_ramp_deg_per_h_per_h"] = abs(ramp) / math.sqrt(2.0)
    return NoiseTruth(**mean_square)


def _line_truth(scale: Scale, position: float, phasor: ComplexArray) -> LineTruth:
    arcsec = dict(zip(GYRO_NAMES, phasor / ARCSECOND, strict=True))
    apart = {f"{a}-{b}": float(abs(arcsec[a] - arcsec[b])) for a, b in _PAIRS}
    return LineTruth(
        scale=scale,
        order=position if scale == "angle" else None,
        frequency_hz=position if scale == "time" else None,
        amplitude_arcsec={name: float(abs(value)) for name, value in arcsec.items()},
        phase_rad={name: float(np.angle(value)) for name, value in arcsec.items()},
        difference_amplitude_arcsec=apart,
    )
