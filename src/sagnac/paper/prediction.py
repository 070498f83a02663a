"""The numbers that the paper prints, the runs that they need, and what the rig should show.

A day in the laboratory differs from another beside the random draws. The paper's days differ by up
to 73 % at one rate, and its laboratory had no temperature control. How its days differed is not
printed; the spreads here are assumed.

Disturbances at rest and turning are two sets. The paper's curve at rest (Figure 4) has no peaks,
and on its turning table full-turn sampling reads 1200 times the mean of Table 2 at 40 deg/s (Figure
2). So there are no lines in time at rest here, and on a turning table those below the mains, which
the drive makes, are `DRIVEN` times those of the preset. The factor was chosen for Figure 2.
"""

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import product
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagnac.analysis.evidence import Evidence
from sagnac.analysis.settings import Method
from sagnac.core.arrays import FloatArray
from sagnac.core.errors import RecordingError, refusal
from sagnac.core.units import ARCSECOND, DEGREE, DEGREE_PER_ROOT_HOUR
from sagnac.core.version import __version__
from sagnac.lines.naming import with_noise_restored
from sagnac.noise import curve_fit, readings
from sagnac.paper.trials import Preparation, config_of_run, trials
from sagnac.recording import channel, columns
from sagnac.rig import sections, truth
from sagnac.rig.config import PRESETS, RigConfig

# ---- laboratory --------------------------------------------------------------------

# Lines in time of the drive, over those of the preset.
DRIVEN: Final = 7.0


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
    # The lines in time of the two sets, before they are drawn; those below the mains are the
    # drive's.
    stated = disturbances.time if config.turning else ()
    time = [(where, size if where >= 50.0 else DRIVEN * size) for where, size in stated]
    # Standard deviations of the logarithm: of lock-in by mirrors, gas and alignment, of the
    # diffusion of the backscatter phase, itself assumed, and of the amplitudes of mains and floor.
    common = random.lognormal(0.0, 0.15)
    diffusion = gyro.backscatter_diffusion_rad2_per_s * random.lognormal(0.0, 0.5)
    sizes, places = random.lognormal(0.0, 0.4, len(time)), random.normal(size=len(time))
    # A line's frequency changes by 0.2 % rms; one above half the sample rate is kept at it.
    half = 0.5 * config.sample_rate_hz
    moved: sections.Pairs = tuple(
        (float(min(frequency * (1.0 + 2e-3 * place), half)), float(amplitude * size))
        for (frequency, amplitude), size, place in zip(time, sizes, places, strict=True)
    )
    x, y, z = (float(one * common) for one in gyro.lock_in_deg_per_h)
    gyro = replace(
        gyro,
        lock_in_deg_per_h=(x, y, z),
        backscatter_diffusion_rad2_per_s=float(diffusion),
        temperature_coefficient_deg_per_h_per_k=(1e-4, 1.5e-4, 0.5e-4),
        # Rms of the room's change over a recording.
        warm_up_k=float(2.0 * random.normal()),
    )
    return replace(config, gyro=gyro, disturbances=replace(disturbances, time=moved))


# ---- published ---------------------------------------------------------------------

PAIR: Final = ("x", "z")
_PLACES: Final = [columns.GYRO_NAMES.index(name) for name in PAIR]
# Figures as published, deg/sqrt(h). Figure 3 is by interval in s, the tables are by
# table rate in deg/s, for three days.
FIGURE_2: Final = 0.0498
FIGURE_3: Final[Mapping[float, float]] = {1.0: 2.5006e-4, 6.0: 3.3011e-3, 12.0: 4.5305e-3}
Published = Mapping[float, tuple[float, ...]]
TABLE_1: Final[Published] = {
    0.0: (3.6427e-4, 3.3709e-4, 3.7997e-4),
    10.0: (3.3903e-4, 3.4392e-4, 3.0869e-4),
    20.0: (4.2517e-4, 3.1152e-4, 3.6555e-4),
    30.0: (3.4121e-4, 3.2906e-4, 4.1709e-4),
    40.0: (3.4328e-4, 6.5700e-4, 4.5071e-4),
}
TABLE_2: Final[Published] = {
    10.0: (8.3297e-5, 4.6176e-5, 6.8846e-5),
    20.0: (6.7278e-5, 2.6117e-5, 3.2470e-5),
    40.0: (7.4707e-5, 2.3985e-5, 2.3238e-5),
    60.0: (2.1993e-5, 2.9396e-5, 2.5313e-5),
    80.0: (3.4774e-5, 2.3414e-5, 2.6234e-5),
}
Table = Literal["table1", "table2"]


class PaperTable(NamedTuple):
    """A table of the paper: mode of its gyros, its numbers, and the size that they are shown in.

    `first_seed` begins the seeds of its recordings here; `size` is in deg/sqrt(h).
    """

    mode: sections.GyroMode
    published: Published
    size: float
    first_seed: int


TABLES: Final[Mapping[Table, PaperTable]] = {
    "table1": PaperTable("dithered", TABLE_1, 1e-4, 1000),
    "table2": PaperTable("rate-biased", TABLE_2, 1e-5, 2000),
}


# ---- readings ----------------------------------------------------------------------


def by_each_reading(evidence: Evidence) -> dict[readings.ReadingName, float]:
    """N by name of the reading, rad/sqrt(s), whatever its interval.

    The paper has no intervals, so what its squares give is the answer of its method. NaN of a
    curve too short for them.

    Parameters
    ----------
    evidence
        Of a method that leaves the noise of its lines out of the curve, as the paper's methods do
        unless `Settings.step_4` asks for it.
    """
    restored = with_noise_restored(evidence.curve, evidence.taken, len(evidence.lines))
    values: dict[readings.ReadingName, float] = {}
    for name, reading in readings.READINGS.items():
        curve = restored if reading.noise_restored else evidence.curve
        try:
            values[name] = curve_fit.paper_squares(curve, squares=reading.squares)
        except RecordingError:
            values[name] = math.nan
    return values


# ---- plan --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Scope:
    """How much is simulated.

    Attributes
    ----------
    table_duration_s
        Length of each recording of Tables 1 and 2 (and so of Figures 4 to 6), s.
    figure_duration_s
        Length of those of Figures 2 and 3, s; below two hours they have too few points to
        fit five terms to.
    days
        Recordings per table cell, 1 to 3: the paper's days, here seeds.
    """

    table_duration_s: float = 7200.0
    figure_duration_s: float = 7200.0
    days: int = 3


FULL: Final = Scope()
# Half an hour: in less, the preset's 0.0137 Hz line cannot be told from the random walk.
QUICK: Final = Scope(table_duration_s=1800.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One recording and one analysis of it.

    `preparation` ``rate`` takes one mean rate over 1 s in each interval instead of the angle.
    `by_curve` takes the fit of the Allan curve as the answer whatever the method: Step 4.
    `as_printed` takes Steps 1 to 3 in the paper's order, with no lowest frequency.
    """

    name: str
    config: RigConfig
    gyros: tuple[str, ...]
    method: Method
    interval_s: float = 1.0
    preparation: Preparation = "angle"
    by_curve: bool = False
    as_printed: bool = False

    @property
    def key(self) -> str:
        """Name and a digest of everything the result depends on."""
        schema = "sagnac.reproduction-run/3"
        what = json.dumps({"schema": schema, "version": __version__, **asdict(self)})
        return f"{self.name}-{hashlib.sha256(what.encode()).hexdigest()[:12]}"


def cell_name(table: Table, rate: float, day: int, by: Literal["", "paper", "printed"] = "") -> str:
    """Name of the run of one table cell; days count from 1.

    `by` is empty for our method, ``paper`` for the paper's, and ``printed`` for the paper's in the
    order in which it prints its steps.
    """
    return f"{table}-{rate:g}-day{day}" + (f"-{by}" if by else "")


def plan(scope: Scope) -> tuple[Run, ...]:
    """Every run; those of one recording stand together."""
    of_tables = [run for table in TABLES for run in _runs_of_table(table, scope)]
    of_figure_3: list[Run] = []
    for trial, interval in product(trials(scope.figure_duration_s), FIGURE_3):
        name = f"figure3-{trial.name}-{interval:g}s"
        run = Run(name=name, config=trial.config, gyros=("z",), method=trial.method)
        of_figure_3.append(replace(run, interval_s=interval, preparation=trial.preparation))
    return (*of_tables, *of_figure_3)


def _runs_of_table(table: Table, scope: Scope) -> list[Run]:
    """Runs of every cell, ours and the paper's; the recording of Figure 2 comes after its cell."""
    runs: list[Run] = []
    for rate, day in product(TABLES[table].published, range(1, scope.days + 1)):
        seed = TABLES[table].first_seed + round(rate) * 10 + day
        config = config_of_run(TABLES[table].mode, rate, seed, scope.table_duration_s)
        config = on_day(config, seed)
        name = partial(cell_name, table, rate, day)
        own = Run(name=name(), config=config, gyros=PAIR, method="fos")
        # At rest the paper removes nothing.
        method: Method = "fos-paper" if rate > 0.0 else "none"
        paper = replace(own, name=name("paper"), method=method, by_curve=True)
        runs += [own, paper]
        if rate > 0.0:
            runs.append(replace(paper, name=name("printed"), as_printed=True))
        if (table, rate) == ("table2", 40.0):
            long = replace(config, duration_s=scope.figure_duration_s)
            runs.append(Run(name=f"figure2-day{day}", config=long, gyros=PAIR, method="fris"))
    return runs


# ---- prediction --------------------------------------------------------------------


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
    encoder
        Q of the encoder: its step over sqrt(12), and the rate times the latch jitter.
    jitter
        Q of the servo's angle jitter, if the servo holds the angle; the table is followed along
        the encoder, so that it is no part of the sums.
    total
        N: quantum limit and lock-in.
    quantization
        Q: the gyros' readout, and the encoder.
    """

    rates: FloatArray
    quantum: FloatArray
    lock_in: FloatArray
    encoder: FloatArray
    jitter: FloatArray
    total: FloatArray
    quantization: FloatArray

    def corner(self, sample_rate: float) -> FloatArray:
        """(rates,) frequency in Hz at which N and Q are equally strong in the spectrum.

        White errors of rms Q at each of `sample_rate` (Hz) samples a second have the rate density
        (2 pi f)^2 Q^2 / sample_rate; N has N^2. A record of T seconds holds about `corner` * T
        bins in which N rules, and so N to about 1/sqrt(2 corner T) of itself.
        """
        walk = self.total * math.sqrt(sample_rate)
        with np.errstate(divide="ignore"):
            return np.asarray(walk / (2.0 * np.pi * self.quantization))


def predicted_angle_random_walk(
    rates: ArrayLike, *, config: RigConfig = PRESETS["paper"], latch_jitter: float | None = None
) -> Prediction:
    """N that the rate-biased pair will show at each table rate: the choice of table rate.

    The parts of it and where they come from are those of `Prediction`.

    Parameters
    ----------
    rates
        (rates,) table rates, rad/s.
    config
        Laser, table, encoder and shares; its mode and rate play no part.
    latch_jitter
        Rms time between the encoder's sample and the gyro's, s; that of `config` if None.

    Raises
    ------
    ValueError
        If a rate is too low for a rate-biased gyro, or an argument is out of range.

    Examples
    --------
    >>> from sagnac.core.units import DEGREE, DEGREE_PER_ROOT_HOUR
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
        raise refusal("latch_jitter", f"is {late:g} s; it must not be negative")
    quantum = _mean(config.gyro.arw_deg_per_sqrt_h) * DEGREE_PER_ROOT_HOUR
    step = _mean(config.gyro.quantization_step_arcsec) * ARCSECOND
    laser = _laser_noise(speeds, config)
    first, second = config.platform.shares[_PLACES].tolist()
    mismatch = abs(first - second)
    # The encoder's white error of angle, of its steps and of when it is read.
    line = 2.0 * math.pi / config.encoder.lines / math.sqrt(12.0)
    encoder = np.asarray(mismatch * np.hypot(line, speeds * late) / channel.PAIR_SIZE)
    return Prediction(
        rates=speeds,
        quantum=np.full(speeds.size, quantum),
        lock_in=np.sqrt(np.maximum(laser**2 - quantum**2, 0.0)),
        encoder=encoder,
        jitter=np.full(speeds.size, _jitter(config, mismatch)),
        total=laser,
        quantization=np.hypot(step / math.sqrt(12.0), encoder),
    )


def _mean(values: Sequence[float]) -> float:
    """Root mean square over the pair of what each gyro has."""
    return math.sqrt(np.mean(np.square(values)[_PLACES]))


def _laser_noise(speeds: FloatArray, config: RigConfig) -> FloatArray:
    """N-bar of quantum limit and lock-in together, by the truth of a rig at each rate."""
    gyro = replace(config.gyro, mode="rate-biased")
    noise = np.empty(speeds.size)
    even = replace(config.table, profile=(), reversal_interval_s=0.0, dwell_s=0.0)
    for index, speed in enumerate(speeds / DEGREE):
        table = replace(even, rate_deg_per_s=float(speed))
        gyros = truth.truth_of(replace(config, gyro=gyro, table=table)).gyros
        noise[index] = _mean([gyros[name].arw_deg_per_sqrt_h for name in columns.GYRO_NAMES])
    return noise * DEGREE_PER_ROOT_HOUR


def _jitter(config: RigConfig, mismatch: float) -> float:
    """Q-bar of the table's jitter; zero if the servo holds the rate, so that the angle walks."""
    if config.table.jitter_spectrum != "position":
        return 0.0
    natural = 2.0 * math.pi * config.table.jitter_bandwidth_hz
    return config.table.jitter_rms_deg_per_s * DEGREE * mismatch / natural / channel.PAIR_SIZE


def adequate_rate(prediction: Prediction, excess: float = 0.1) -> float:
    """Lowest of the predicted rates whose N is within `excess` of the quantum limit, rad/s.

    Q plays no part, since the fits tell it from N; `Prediction.corner` says how long a record it
    then takes. NaN if there is no such rate.
    """
    within = prediction.total <= (1.0 + excess) * prediction.quantum
    return float(prediction.rates[within].min()) if within.any() else math.nan
