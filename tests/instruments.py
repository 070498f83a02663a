"""Instruments as their files hold them, made by numpy alone: nothing here knows the rig.

A turning table with laser gyros, and still benches with gyros of several makes. Their noise is an
angle random walk of known size; beside it stand what sound instruments have: a low-pass of the
sensor, mains and structure lines, harmonics of the turn, sway, reversals, dwells, and a readout in
counts that a file holds times a decimal scale, in single precision, or as decimal text.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Storage = Literal["float64", "float32", "text"]

DEGREE: Final = math.pi / 180.0
ARCSECOND: Final = DEGREE / 3600.0
# One deg/sqrt(h) in rad/sqrt(s).
WALK_UNIT: Final = DEGREE / 60.0
GRAVITY: Final = 9.80665


@dataclass(frozen=True, slots=True, kw_only=True)
class Readout:
    """How numbers get into a file.

    Attributes
    ----------
    step
        Of a count, in the unit of the file.
    storage
        What counts times the step become.
    decimals
        Of decimal text.
    """

    step: float
    storage: Storage = "float64"
    decimals: int = 6

    def held(self, values: Floats) -> Floats:
        """Values as whoever opens the file gets them."""
        counted = np.rint(values / self.step) * self.step
        if self.storage == "float32":
            return counted.astype(np.float32).astype(np.float64)
        if self.storage == "text":
            return np.array([float(f"{value:.{self.decimals}f}") for value in counted])
        return counted


def white(random: np.random.Generator, samples: int, sample_rate: float, walk: float) -> Floats:
    """Mean rates of an angle random walk, deg/s.

    Parameters
    ----------
    walk
        deg/sqrt(h).
    """
    return walk / 60.0 * math.sqrt(sample_rate) * random.standard_normal(samples)


def behind_low_pass(values: Floats, sample_rate: float, corner: float) -> Floats:
    """Values behind a Butterworth low-pass of the sensor, of second order."""
    frequency = np.fft.rfftfreq(values.size, 1.0 / sample_rate)
    s = 1j * frequency / corner
    return np.fft.irfft(np.fft.rfft(values) / (1.0 + math.sqrt(2.0) * s + s * s), values.size)


def flicker(random: np.random.Generator, samples: int, sample_rate: float, level: float) -> Floats:
    """Rates whose density falls as 1/f, of bias instability `level`, in its unit."""
    frequency = np.fft.rfftfreq(samples, 1.0 / sample_rate)
    frequency[0] = math.inf
    # One-sided density (B^2 / pi) / f, from white numbers of density 2 / sample_rate.
    shape = np.sqrt(level**2 / math.pi / frequency / (2.0 / sample_rate))
    return np.fft.irfft(np.fft.rfft(random.standard_normal(samples)) * shape, samples)


def lines_in_time(
    random: np.random.Generator, times: Floats, *heights: tuple[float, float]
) -> Floats:
    """Sines of a frequency in Hz and an amplitude each, at any phase."""
    total = np.zeros(times.size)
    for frequency, amplitude in heights:
        total += amplitude * np.sin(2.0 * math.pi * (frequency * times + random.uniform()))
    return total


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """A still bench with gyros, maybe accelerometers.

    Attributes
    ----------
    rates
        Name -> deg/s as the file holds them.
    forces
        Name -> m/s^2.
    sample_rate
        Hz.
    walk
        Of each gyro, deg/sqrt(h).
    """

    rates: dict[str, Floats]
    sample_rate: float
    walk: float
    forces: dict[str, Floats]

    @property
    def times(self) -> Floats:
        """s from the first sample."""
        return np.arange(next(iter(self.rates.values())).size) / self.sample_rate

    def changed(self, change: Callable[[Floats], Floats]) -> "Bench":
        """The same with its rates changed."""
        return replace(self, rates={name: change(one) for name, one in self.rates.items()})


def bench(
    seed: int,
    *,
    seconds: float = 600.0,
    sample_rate: float = 200.0,
    walk: float = 0.3,
    bias_instability: float = 0.0,
    readout: Readout | None = None,
    low_pass: float | None = None,
    mains: float = 0.0,
    sway: float = 0.0,
    bias: float = 0.1,
    latitude: float = 48.0,
    names: str = "xyz",
    forces: bool = False,
    earth: bool = True,
) -> Bench:
    """Gyros that stand still, deg/s; x north, y east, z up.

    Parameters
    ----------
    walk
        deg/sqrt(h).
    bias_instability
        deg/h.
    readout
        In deg/s; none for numbers as they are.
    low_pass
        Corner of the sensor's own, Hz.
    mains
        Amplitude of the line at 50 Hz, in scatters of a sample; a third at 33 and at 118 Hz if
        these can be.
    sway
        Amplitude of a bench that sways at 1.3 Hz now more and now less, deg/s.
    bias
        Scatter of the biases, deg/s.
    """
    random = np.random.default_rng(seed)
    samples = round(seconds * sample_rate)
    times = np.arange(samples) / sample_rate
    scatter = walk / 60.0 * math.sqrt(sample_rate)
    angle = math.radians(latitude)
    earth_rate = {"x": math.cos(angle), "y": 0.0, "z": math.sin(angle)}
    rates = {}
    for name in names:
        rate = white(random, samples, sample_rate, walk)
        if bias_instability:
            rate += flicker(random, samples, sample_rate, bias_instability / 3600.0)
        if low_pass:
            rate = behind_low_pass(rate, sample_rate, low_pass)
        rate += bias * random.standard_normal()
        if earth:
            rate += 15.041067 / 3600.0 * earth_rate[name]
        if mains:
            heights = [(50.0, mains * scatter), (33.0, mains * scatter / 3.0)]
            heights.append((118.0, mains * scatter / 3.0))
            rate += lines_in_time(
                random, times, *(one for one in heights if one[0] < 0.45 * sample_rate)
            )
        if sway:
            slow = np.cumsum(random.standard_normal((2, samples)), axis=1) / math.sqrt(samples)
            rate += sway * (
                slow[0] * np.sin(2.6 * math.pi * times) + slow[1] * np.cos(2.6 * math.pi * times)
            )
        rates[name] = readout.held(rate) if readout else rate
    return Bench(
        rates=rates,
        sample_rate=sample_rate,
        walk=walk,
        forces=_forces(random, samples) if forces else {},
    )


def _forces(random: np.random.Generator, samples: int) -> dict[str, Floats]:
    """Accelerometers of a level bench, m/s^2, in 16 bit counts of 8 g."""
    step = 16.0 * GRAVITY / 65536.0
    level = {"ax": 0.05, "ay": -0.08, "az": GRAVITY * 1.003}
    return {
        name: step * np.rint((mean + 0.02 * random.standard_normal(samples)) / step)
        for name, mean in level.items()
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class Turntable:
    """A table that turns under laser gyros.

    Attributes
    ----------
    angles
        Name -> arcsec as the file holds them.
    encoder
        deg, from 0 to 360.
    sample_rate
        Hz.
    walk
        Of each gyro, deg/sqrt(h).
    """

    angles: dict[str, Floats]
    encoder: Floats
    sample_rate: float
    walk: float

    @property
    def times(self) -> Floats:
        """s from the first sample."""
        return np.arange(self.encoder.size) / self.sample_rate


Motion = Literal["steady", "reversing", "dwelling"]


def _turned(motion: Motion, times: Floats, table_rate: float) -> Floats:
    """Angle of the table, deg."""
    if motion == "steady":
        return table_rate * times
    period = 60.0
    within = np.mod(times, period)
    if motion == "reversing":
        # At once: from one sample to the next the rate changes its sign.
        return table_rate * np.where(within < 0.5 * period, within, period - within)
    # Turns for forty seconds and stands for twenty, at once as well.
    return table_rate * (np.floor(times / period) * 40.0 + np.minimum(within, 40.0))


def turntable(
    seed: int,
    *,
    seconds: float = 600.0,
    sample_rate: float = 200.0,
    table_rate: float = 20.0,
    walk: float = 1e-3,
    readout: Readout | None = None,
    mains: float = 0.0,
    orders: float = 0.0,
    jitter: float = 0.002,
    motion: Motion = "steady",
    shares: dict[str, float] | None = None,
    latitude: float = 32.0,
) -> Turntable:
    """Gyros on a table that turns.

    Parameters
    ----------
    table_rate
        deg/s.
    walk
        deg/sqrt(h).
    readout
        Of the gyros, in arcsec; counts of 0.0008 unless given.
    mains
        Amplitude of the gyros' lines at 33, 50 and 118 Hz, arcsec.
    orders
        Amplitude of their harmonics of the turn, arcsec.
    jitter
        Share of the rate by which it strays, slowly.
    shares
        Of the table rate, by gyro.
    """
    random = np.random.default_rng(seed)
    samples = round(seconds * sample_rate)
    times = np.arange(samples) / sample_rate
    random.standard_normal(samples)  # so that seeds give what they gave
    # The rate strays by `jitter` of itself within a second; the servo pulls it back.
    wander = _pulled_back(random, samples, sample_rate, jitter * table_rate)
    angle = _turned(motion, times, table_rate) + wander + random.uniform(0.0, 360.0)
    turn = np.deg2rad(angle)
    readout = readout or Readout(step=0.0008)
    angles = {}
    for name, share in (shares or {"x": 0.577, "y": 0.579, "z": 0.576}).items():
        noise = np.cumsum(white(random, samples, sample_rate, walk)) / sample_rate * 3600.0
        gyro = 3600.0 * share * angle + noise
        level = math.sqrt(max(0.0, 1.0 - share**2))
        # Earth rate: along the axis at a steady rate, across it once a turn.
        gyro += 15.041067 * math.sin(math.radians(latitude)) * share * times
        gyro += (
            15.041067
            * math.cos(math.radians(latitude))
            * level
            * np.cumsum(np.cos(turn + random.uniform(0.0, 2.0 * math.pi)))
            / sample_rate
        )
        if mains:
            gyro += lines_in_time(
                random,
                times,
                *((f, mains) for f in (33.0, 50.0, 118.0) if f < 0.45 * sample_rate),
            )
        if orders:
            for order in (1, 2, 3, 8, 16, 24):
                phase = random.uniform(0.0, 2.0 * math.pi)
                gyro += orders / order * np.sin(order * turn + phase)
        angles[name] = readout.held(gyro)
    encoder = np.mod(angle + 0.05 / 3600.0 * random.standard_normal(samples), 360.0)
    step = 360.0 / 2**24
    return Turntable(
        angles=angles,
        encoder=np.mod(np.rint(encoder / step) * step, 360.0),
        sample_rate=sample_rate,
        walk=walk,
    )


def _pulled_back(
    random: np.random.Generator, samples: int, sample_rate: float, rate: float
) -> Floats:
    """A wander of the table's angle, deg, whose rate has a scatter of `rate`, about 1 Hz."""
    frequency = np.fft.rfftfreq(samples, 1.0 / sample_rate)
    shape = frequency / (1.0 + frequency**2) ** 2
    wander = np.fft.irfft(np.fft.rfft(random.standard_normal(samples)) * shape, samples)
    return wander * rate / (np.std(np.diff(wander)) * sample_rate)
