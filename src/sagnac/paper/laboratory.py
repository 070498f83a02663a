"""One day in the laboratory: what differs from another day beside the random draws.

The paper's days differ by up to 73 % at one rate, and its laboratory had no temperature control.
How its days differed is not printed; the spreads here are assumed.

Disturbances at rest and turning are two sets. The paper's curve at rest (Figure 4) has no peaks,
and on its turning table full-turn sampling reads N 1800 times too large (Figure 2). So there are no
lines in time at rest here, and on a turning table those below the mains, which the drive makes, are
`DRIVEN` times those of the preset. The factor was chosen for Figure 2.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from sagnac.rig.config import RigConfig
from sagnac.rig.sections import Pairs, Triple

# Standard deviations of the logarithm.
_LOCK_IN: Final = 0.15  # mirrors, gas and alignment
_DIFFUSION: Final = 0.5  # of the backscatter phase, itself assumed
_LINES: Final = 0.4  # amplitudes of mains and floor
_FREQUENCY: Final = 2e-3  # of lines in time
_WARM_UP: Final = 2.0  # K, rms of the room's change over a recording
_PER_KELVIN: Final = (1e-4, 1.5e-4, 0.5e-4)  # deg/h/K
_MAINS: Final = 50.0  # Hz; slower lines in time are the drive's
DRIVEN: Final = 7.0
"""Lines in time of the drive, over those of the preset."""


def on_day(config: RigConfig, seed: int) -> RigConfig:
    """The rig as it may stand on the day that a seed numbers.

    Parameters
    ----------
    config
        The rig on an ordinary day.
    seed
        Of the day: lock-in, backscatter, disturbances and temperature are drawn by it.
    """
    random = np.random.default_rng([20130227, seed])
    gyro, disturbances = config.gyro, config.disturbances
    lock_in, time = gyro.lock_in_deg_per_h, _lines_of(config)
    common = random.lognormal(0.0, _LOCK_IN)
    diffusion = gyro.backscatter_diffusion_rad2_per_s * random.lognormal(0.0, _DIFFUSION)
    sizes, places = random.lognormal(0.0, _LINES, len(time)), random.normal(size=len(time))
    moved: Pairs = tuple(
        (_moved(frequency, place, config.sample_rate_hz), float(amplitude * size))
        for (frequency, amplitude), size, place in zip(time, sizes, places, strict=True)
    )
    each: Triple = (
        float(lock_in[0] * common),
        float(lock_in[1] * common),
        float(lock_in[2] * common),
    )
    return replace(
        config,
        gyro=replace(
            gyro,
            lock_in_deg_per_h=each,
            backscatter_diffusion_rad2_per_s=float(diffusion),
            temperature_coefficient_deg_per_h_per_k=_PER_KELVIN,
            warm_up_k=float(_WARM_UP * random.normal()),
        ),
        disturbances=replace(disturbances, time=moved),
    )


def _lines_of(config: RigConfig) -> Pairs:
    """The lines in time of the two sets, before they are drawn for a day."""
    if not config.turning:
        return ()
    return tuple(
        (frequency, amplitude if frequency >= _MAINS else DRIVEN * amplitude)
        for frequency, amplitude in config.disturbances.time
    )


def _moved(frequency: float, place: float, sample_rate: float) -> float:
    """A frequency of the day, Hz; one above half the sample rate is kept at it."""
    return float(min(frequency * (1.0 + _FREQUENCY * place), 0.5 * sample_rate))
