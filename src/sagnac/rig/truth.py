"""What was put into a simulated recording."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from sagnac.rig.config import RigConfig
from sagnac.rig.gyro import ring_lasers_of
from sagnac.rig.ring_laser import angle_random_walk
from sagnac.rig.sections import GYRO_NAMES, Triple
from sagnac.rig.streams import disturbance_of, random_streams
from sagnac.rig.table import table_command
from sagnac.table.earth import earth_rate
from sagnac.table.frames import shares_from_deviations, table_to_gyro_matrix
from sagnac.units import ARCSECOND, DEGREE, DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR

_PAIRS: Final = (("x", "z"), ("x", "y"), ("y", "z"))
TRUTH_SCHEMA: Final = "sagnac.truth/1"


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
    is left in each difference of two.
    """

    scale: Literal["angle", "time"]
    order: float | None
    frequency_hz: float | None
    amplitude_arcsec: Mapping[str, float]
    phase_rad: Mapping[str, float]
    difference_amplitude_arcsec: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """What the recording was made from; ``dataclasses.asdict`` of it is the JSON."""

    schema: str
    seed: int
    samples: int
    sample_rate_hz: float
    table_rate_deg_per_s: float
    table_jitter_rms_deg_per_s: float
    shares: Mapping[str, float]
    earth_rate_b0_deg_per_h: Triple
    gyros: Mapping[str, NoiseTruth]
    pairs: Mapping[str, NoiseTruth]
    lines: tuple[LineTruth, ...]
    earth_rate_order_one: LineTruth | None
    config: Mapping[str, Any]


def truth_of(config: RigConfig) -> Truth:
    """What a recording of this configuration is made from, without making it."""
    gyro = config.gyro
    shares = shares_from_deviations(config.platform.share_deviation)
    earth = earth_rate(config.platform.latitude_deg * DEGREE, config.platform.heading_deg * DEGREE)
    command = table_command(config)
    mean_rate_of_table = float(
        (command.angle_at(np.array([config.duration_s])) - command.angle_at(np.zeros(1)))[0]
        / config.duration_s
    )
    noise = _angle_random_walk(config, mean_rate_of_table)
    gyros = {
        name: NoiseTruth(
            quantization_arcsec=gyro.quantization_step_arcsec[g] / math.sqrt(12.0),
            arw_deg_per_sqrt_h=noise[g],
            bias_instability_deg_per_h=gyro.bias_instability_deg_per_h[g],
            rate_random_walk_deg_per_h_per_sqrt_h=gyro.rate_random_walk_deg_per_h_per_sqrt_h[g],
            rate_ramp_deg_per_h_per_h=gyro.rate_ramp_deg_per_h_per_h[g],
        )
        for g, name in enumerate(GYRO_NAMES)
    }
    angle_lines, time_lines = disturbance_of(config, random_streams(config.seed).disturbances)
    lines = [
        _line_truth("angle", float(position), angle_lines.phasor[:, j])
        for j, position in enumerate(angle_lines.position)
    ] + [
        _line_truth("time", float(position), time_lines.phasor[:, j])
        for j, position in enumerate(time_lines.position)
    ]
    order_one = None
    if command.rate.size == 1 and command.rate[0] != 0.0:
        # k1 sin(alpha) - k2 cos(alpha) of Eq. 6, over the rate, as one phasor.
        matrix = table_to_gyro_matrix(*shares)
        k1 = matrix[:, 0] * earth[0] + matrix[:, 1] * earth[1]
        k2 = matrix[:, 0] * earth[1] - matrix[:, 1] * earth[0]
        order_one = _line_truth("angle", 1.0, (-k2 - 1j * k1) / command.rate[0])
    return Truth(
        schema=TRUTH_SCHEMA,
        seed=config.seed,
        samples=config.samples,
        sample_rate_hz=config.sample_rate_hz,
        table_rate_deg_per_s=mean_rate_of_table / DEGREE,
        table_jitter_rms_deg_per_s=config.table.jitter_rms_deg_per_s,
        shares=dict(zip(GYRO_NAMES, shares.tolist(), strict=True)),
        earth_rate_b0_deg_per_h=tuple((earth / DEGREE_PER_HOUR).tolist()),
        gyros=gyros,
        pairs={f"{a}-{b}": _pair_truth(gyros[a], gyros[b]) for a, b in _PAIRS},
        lines=tuple(lines),
        earth_rate_order_one=order_one,
        config=asdict(config),
    )


def _angle_random_walk(config: RigConfig, table_rate: float) -> list[float]:
    """N of each gyro at the mean of what it senses, deg/sqrt(h)."""
    lasers, dither = ring_lasers_of(config)
    if not lasers:
        return list(config.gyro.arw_deg_per_sqrt_h)
    platform = config.platform
    matrix = table_to_gyro_matrix(*shares_from_deviations(platform.share_deviation))
    earth = earth_rate(platform.latitude_deg * DEGREE, platform.heading_deg * DEGREE)
    # On a turning table the Earth's horizontal part averages out.
    still = matrix @ earth
    turning = matrix[:, 2] * (table_rate + earth[2])
    sensed = turning if config.turning else still
    return [
        float(angle_random_walk(laser, rate, dither)) / DEGREE_PER_ROOT_HOUR
        for laser, rate in zip(lasers, sensed, strict=True)
    ]


def _pair_truth(first: NoiseTruth, second: NoiseTruth) -> NoiseTruth:
    mean_square = {
        f.name: math.sqrt((getattr(first, f.name) ** 2 + getattr(second, f.name) ** 2) / 2.0)
        for f in fields(NoiseTruth)
    }
    mean_square["rate_ramp_deg_per_h_per_h"] = abs(
        first.rate_ramp_deg_per_h_per_h - second.rate_ramp_deg_per_h_per_h
    ) / math.sqrt(2.0)
    return NoiseTruth(**mean_square)


def _line_truth(
    scale: Literal["angle", "time"], position: float, phasor: NDArray[np.complex128]
) -> LineTruth:
    arcsec = dict(zip(GYRO_NAMES, phasor / ARCSECOND, strict=True))
    return LineTruth(
        scale=scale,
        order=position if scale == "angle" else None,
        frequency_hz=position if scale == "time" else None,
        amplitude_arcsec={name: float(abs(value)) for name, value in arcsec.items()},
        phase_rad={name: float(np.angle(value)) for name, value in arcsec.items()},
        difference_amplitude_arcsec={
            f"{a}-{b}": float(abs(arcsec[a] - arcsec[b])) for a, b in _PAIRS
        },
    )
