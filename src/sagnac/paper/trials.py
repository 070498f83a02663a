"""Trials that might explain Figure 3."""

from dataclasses import dataclass, replace
from typing import Final, Literal

from sagnac.analysis.settings import Method
from sagnac.rig.config import RigConfig, preset
from sagnac.rig.sections import GyroMode, Pairs
from sagnac.rig.truth import truth_of

Preparation = Literal["angle", "rate"]
NEAREST_TRIAL: Final = "slow-40s"
_SLOW_HZ: Final = 0.5  # above, a line folds when the angle is taken once a second


def config_of_run(mode: GyroMode, rate: float, seed: int, duration_s: float) -> RigConfig:
    """The preset ``paper`` at one gyro mode and table rate, deg/s."""
    base = preset("paper")
    return replace(
        base,
        seed=seed,
        duration_s=duration_s,
        table=replace(base.table, rate_deg_per_s=rate),
        gyro=replace(base.gyro, mode=mode),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """A candidate explanation of Figure 3, and how its recording is made."""

    name: str
    meaning: str
    config: RigConfig
    method: Method = "none"
    preparation: Preparation = "angle"


def trials(duration_s: float = 7200.0) -> tuple[Trial, ...]:
    """Trials that might explain Figure 3, all on gyro z, dithered, at rest."""
    base = config_of_run("dithered", 0.0, 3001, duration_s)
    return (
        Trial(name="as-simulated", meaning="the preset as it is, nothing removed", config=base),
        *_without_slow_lines(base),
        *_slow_lines_alone(base),
        Trial(
            name="removed",
            meaning="the preset as it is, lines removed by fos before sampling",
            config=base,
            method="fos",
        ),
    )


def _without_slow_lines(base: RigConfig) -> tuple[Trial, ...]:
    quiet = with_time_lines(base, ())
    fast = tuple((f, 10.0 * a) for f, a in base.disturbances.time if f > _SLOW_HZ)
    warm = replace(
        base.gyro,
        temperature_coefficient_deg_per_h_per_k=(0.004, 0.004, 0.004),
        warm_up_k=5.0,
        rate_random_walk_deg_per_h_per_sqrt_h=(0.01, 0.01, 0.01),
        bias_instability_deg_per_h=(1e-3, 1e-3, 1e-3),
    )
    return (
        Trial(
            name="white",
            meaning="angle random walk and readout alone: what five terms on few points do",
            config=quiet,
        ),
        Trial(
            name="aliasing",
            meaning="lines above 0.5 Hz alone, ten times the preset: what folding does",
            config=with_time_lines(base, fast),
        ),
        Trial(
            name="warm-up",
            meaning=(
                "no lines; warming by 5 K at 0.004 °/h/K, rate random walk 0.01 °/h/√h, bias "
                "instability 0.001 °/h: drift without temperature control"
            ),
            config=replace(quiet, gyro=warm),
        ),
        Trial(
            name="rate",
            meaning="no lines; one mean rate over 1 s in each interval instead of the angle",
            config=quiet,
            preparation="rate",
        ),
    )


def _slow_lines_alone(base: RigConfig) -> tuple[Trial, ...]:
    slow = tuple(line for line in base.disturbances.time if line[0] <= _SLOW_HZ)
    return (
        Trial(
            name="slow-line",
            meaning="the preset's line at 0.0137 Hz alone",
            config=with_time_lines(base, slow),
        ),
        Trial(
            name=NEAREST_TRIAL,
            meaning=(
                "one line of 0.039″, period 39.9 s: of the periods from 15 to 150 s and amplitudes "
                "to 0.3″ that python -m benchmarks.figure_3 tries, the nearest to the paper by "
                "relative squares on the deviation"
            ),
            config=with_line_in_z(base, 1.0 / 39.9, 0.0387),
        ),
        Trial(
            name="slow-39s",
            meaning="one line of 0.039″, period 38.7 s: its neighbour",
            config=with_line_in_z(base, 1.0 / 38.71, 0.0389),
        ),
        Trial(
            name="slow-37s",
            meaning=(
                "one line of 0.026″, period 36.6 s: the nearest of them by plain squares on the "
                "deviation"
            ),
            config=with_line_in_z(base, 1.0 / 36.6, 0.0257),
        ),
    )


def with_time_lines(base: RigConfig, time: Pairs) -> RigConfig:
    """`base` with these lines in time instead of its own: frequencies in Hz, amplitudes in ″."""
    return replace(base, disturbances=replace(base.disturbances, time=time))


def with_line_in_z(base: RigConfig, frequency: float, amplitude: float) -> RigConfig:
    """`base` with one line in time, of `amplitude` arcsec in gyro z.

    The rig draws what part of a line each gyro takes, so the line is asked for by that part.
    """
    drawn = truth_of(with_time_lines(base, ((frequency, 1.0),))).lines
    part = next(line for line in drawn if line.scale == "time").amplitude_arcsec["z"]
    return with_time_lines(base, ((frequency, amplitude / part),))
