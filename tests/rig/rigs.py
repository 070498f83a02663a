"""Small rigs that several tests share."""

import math
from dataclasses import replace

import numpy as np

from sagnac.rig.config import RigConfig, preset
from sagnac.rig.sections import GyroConfig, PlatformConfig, TableConfig
from sagnac.rig.simulate import blocks, simulate
from sagnac.table.frames import earth_rate, shares_from_deviations, table_to_gyro_matrix

ARCSEC = math.pi / 648_000
DEG = math.pi / 180
NONE = (0.0, 0.0, 0.0)
NOISELESS = GyroConfig(arw_deg_per_sqrt_h=NONE, quantization_step_arcsec=NONE)
AT_REST = TableConfig(rate_deg_per_s=0.0)


def configured(**changes):
    """A noiseless rig at constant rate, short enough for a test, with changes."""
    return replace(
        RigConfig(
            duration_s=40.0,
            gyro=NOISELESS,
            platform=PlatformConfig(share_deviation=(0.001, 0.0, -0.001), heading_deg=20.0),
        ),
        **changes,
    )


def triad(config):
    return np.array([gyro.values for gyro in simulate(config).recording.gyros])


def true_table_angle(config):
    return np.concatenate([angle for _, angle in blocks(config)])


def geometry(config):
    shares = shares_from_deviations(config.platform.share_deviation)
    earth = earth_rate(config.platform.latitude_deg * DEG, config.platform.heading_deg * DEG)
    return shares, earth


def from_first(angle):
    return angle - angle[..., :1]


def at_rest(gyro, duration, sample_rate=10.0, seed=3):
    return RigConfig(
        duration_s=duration, sample_rate_hz=sample_rate, seed=seed, table=AT_REST, gyro=gyro
    )


HARSH = replace(
    preset("harsh"),
    duration_s=3.0,
    table=TableConfig(
        rate_deg_per_s=300.0,
        jitter_rms_deg_per_s=0.02,
        wander_fraction=0.02,
        ripple=((12.0, 0.001),),
        wobble=((1.0, 2.0), (2.0, 1.0)),
        reversal_interval_s=1.1,
        acceleration_deg_per_s2=2000.0,
    ),
)


def ideal_angle(time, table_angle, table_rate, shares, earth):
    """(3, samples) rad: what the triad would measure at constant table rate, Eq. 6.

    Eq. 6 puts d(alpha) = Omega dt into the integral of Eq. 4, so it holds only while the rate is
    constant; the rig integrates Eq. 4 itself. `time`, s since alpha was zero, and `table_angle`,
    rad, are (samples,); `table_rate` is Omega, rad/s; `shares` are e_x, e_y, e_z; `earth` is eta
    of Eq. 5, rad/s.
    """
    seconds, alpha, eta = (np.asarray(each, dtype=float) for each in (time, table_angle, earth))
    matrix = table_to_gyro_matrix(*shares)
    # Row g of C_b^s times C_b0^b(alpha) eta is k1 cos(alpha) + k2 sin(alpha) + e eta_3.
    k1 = matrix[:, 0] * eta[0] + matrix[:, 1] * eta[1]
    k2 = matrix[:, 0] * eta[1] - matrix[:, 1] * eta[0]
    return (
        np.outer(matrix[:, 2], eta[2] * seconds + alpha)
        + np.outer(k1 / table_rate, np.sin(alpha))
        - np.outer(k2 / table_rate, np.cos(alpha) - 1.0)
    )
