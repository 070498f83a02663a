"""A gallery of troublesome gyros: noise that five terms do not describe, with its truth.

Each function makes angle increments of one gyro (rad) from a generator, a number of samples and
a rate, and says which angle random walk is in them. No estimator imports any of it. `GALLERY`
names them all with the settings that the statistics are run with.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
from scipy.fft import irfft, rfftfreq
from scipy.signal import bilinear, butter, lfilter

from sagnac.core.arrays import FloatArray

Generator = np.random.Generator


@dataclass(frozen=True, slots=True, kw_only=True)
class Troubled:
    """Increments with the truth about them.

    Attributes
    ----------
    increments
        (samples,), rad.
    angle_random_walk
        N, rad/sqrt(s): of white rate noise at frequencies that no filter of the sensor lowers.
    parts
        N of equal parts of the record if it changes, rad/sqrt(s); empty if it does not.
    """

    increments: FloatArray
    angle_random_walk: float
    parts: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.increments.ndim != 1 or not self.angle_random_walk >= 0.0:
            raise ValueError("increments must be one series, and N zero or more")


@dataclass(frozen=True, slots=True, kw_only=True)
class Gyro:
    """What every gyro of the gallery has: N beside the five-term rest.

    Attributes
    ----------
    walk
        N, rad/sqrt(s).
    quantization
        Q, rad.
    bias_instability
        B, rad/s.
    rate_walk
        K, rad/s/sqrt(s).
    """

    walk: float = 1.0
    quantization: float = 0.0
    bias_instability: float = 0.0
    rate_walk: float = 0.0

    def __post_init__(self) -> None:
        if min(self.walk, self.quantization, self.bias_instability, self.rate_walk) < 0.0:
            raise ValueError("coefficients must be zero or more")


def white_angle(rng: Generator, samples: int) -> FloatArray:
    """Increments of a white angle of variance one."""
    return np.asarray(np.diff(rng.standard_normal(samples + 1)))


def shaped(
    rng: Generator, samples: int, sample_rate: float, power: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Gaussian rate of a one-sided density (unit^2/Hz), from twice the length so nothing wraps.

    Parameters
    ----------
    rng, samples, sample_rate
        As everywhere here.
    power
        Frequency (Hz, above zero) to density.
    """
    length = 2 * samples
    frequency = rfftfreq(length, 1.0 / sample_rate)
    amplitude = np.zeros(frequency.size)
    amplitude[1:] = np.sqrt(power(frequency[1:]) * sample_rate * length / 4.0)
    parts = rng.standard_normal((2, frequency.size))
    return np.asarray(irfft(amplitude * (parts[0] + 1j * parts[1]), length)[:samples])


def _rate(rng: Generator, samples: int, sample_rate: float, gyro: Gyro) -> FloatArray:
    """White, flicker and walking rate, rad/s."""
    rate = gyro.walk * math.sqrt(sample_rate) * rng.standard_normal(samples)
    if gyro.bias_instability:
        square = gyro.bias_instability**2 / math.pi
        rate += shaped(rng, samples, sample_rate, lambda f: square / f)
    if gyro.rate_walk:
        steps = gyro.rate_walk / math.sqrt(sample_rate) * rng.standard_normal(samples)
        rate += np.cumsum(steps)
    return rate


def _read(rng: Generator, rate: FloatArray, sample_rate: float, gyro: Gyro) -> FloatArray:
    """Increments with the readout's quantization."""
    increments = rate / sample_rate
    if gyro.quantization:
        increments = increments + gyro.quantization * white_angle(rng, rate.size)
    return increments


def five_terms(rng: Generator, samples: int, sample_rate: float, *, gyro: Gyro) -> Troubled:
    """No trouble: Q, N, B and K alone."""
    rate = _rate(rng, samples, sample_rate, gyro)
    return Troubled(increments=_read(rng, rate, sample_rate, gyro), angle_random_walk=gyro.walk)


def low_passed(
    rng: Generator, samples: int, sample_rate: float, *, gyro: Gyro, corner: float, order: int = 1
) -> Troubled:
    """A sensor's own Butterworth low-pass before sampling.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    corner
        Share of the sample rate.
    order
        1 or 2.
    """
    if not 0.0 < corner < 0.5 or order not in (1, 2):
        raise ValueError(f"corner {corner} of the rate, order {order}: give 0 to 0.5 and 1 or 2")
    settle = int(10.0 / corner)
    rate = _rate(rng, samples + settle, sample_rate, gyro)
    numerator, denominator = butter(order, 2.0 * corner)
    rate = lfilter(numerator, denominator, rate)[settle:]
    return Troubled(increments=_read(rng, rate, sample_rate, gyro), angle_random_walk=gyro.walk)


def boxcar_decimated(
    rng: Generator, samples: int, sample_rate: float, *, gyro: Gyro, length: float
) -> Troubled:
    """Each sample is the mean of a fast inner rate over `length` sample intervals.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    length
        Of the boxcar in sample intervals: above one samples overlap, below one noise folds.
    """
    inner = 8
    taps = max(1, round(inner * length))
    rate = _rate(rng, inner * samples + taps, inner * sample_rate, gyro)
    total = np.concatenate([[0.0], np.cumsum(rate - rate.mean())])
    mean = (total[taps:] - total[:-taps]) / taps + rate.mean()
    rate = mean[: inner * samples : inner]
    # A boxcar shorter than the interval samples noise that folds: N is what the samples show.
    walk = gyro.walk * (1.0 if length >= 1.0 else math.sqrt(inner / taps))
    return Troubled(increments=_read(rng, rate, sample_rate, gyro), angle_random_walk=walk)


def coloured_angle(
    rng: Generator, samples: int, sample_rate: float, *, gyro: Gyro, angle: float, memory: float
) -> Troubled:
    """Angle noise of a readout with a memory: a first-order Markov angle.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    angle
        Root mean square, rad.
    memory
        Correlation from one sample to the next, 0 to 1.
    """
    rate = _rate(rng, samples, sample_rate, gyro)
    drive = angle * math.sqrt(1.0 - memory**2) * rng.standard_normal(samples + 1)
    noise = lfilter([1.0], [1.0, -memory], drive)
    return Troubled(increments=rate / sample_rate + np.diff(noise), angle_random_walk=gyro.walk)


def dithered(
    rng: Generator,
    samples: int,
    sample_rate: float,
    *,
    gyro: Gyro,
    frequency: float,
    amplitude: float,
    wander: float = 0.1,
) -> Troubled:
    """Residue of a dither whose amplitude and phase wander, folded by the sampling.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    frequency
        Of the dither, Hz; above half the rate it folds.
    amplitude
        Of the angle, rad.
    wander
        Rad of phase and relative change of amplitude, per root second.
    """
    time = np.arange(samples + 1) / sample_rate
    step = wander / math.sqrt(sample_rate)
    phase = np.cumsum(step * rng.standard_normal(samples + 1))
    decay = math.exp(-1.0 / (20.0 * sample_rate))
    swing = lfilter([1.0], [1.0, -decay], step * rng.standard_normal(samples + 1))
    angle = amplitude * (1.0 + swing) * np.sin(2.0 * np.pi * frequency * time + phase)
    plain = five_terms(rng, samples, sample_rate, gyro=gyro)
    return Troubled(increments=plain.increments + np.diff(angle), angle_random_walk=gyro.walk)


def resonant(
    rng: Generator,
    samples: int,
    sample_rate: float,
    *,
    gyro: Gyro,
    frequencies: tuple[float, ...],
    peak: float,
    quality: float = 30.0,
) -> Troubled:
    """Structure resonances driven by white noise: bands of vibration, not lines.

    The rate of a vibration is the derivative of an angle that comes back, so that its density
    vanishes as f^4 at low frequency.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    frequencies
        Of the resonances, Hz.
    peak
        Density at each peak relative to that of N.
    quality
        Frequency over bandwidth.
    """

    def power(f: FloatArray) -> FloatArray:
        total = np.zeros(f.size)
        for middle in frequencies:
            ratio = f / middle
            total += peak * ratio**4 / (quality**2 * (1.0 - ratio**2) ** 2 + ratio**2)
        return 2.0 * gyro.walk**2 * total

    plain = five_terms(rng, samples, sample_rate, gyro=gyro)
    vibration = shaped(rng, samples, sample_rate, power) / sample_rate
    return Troubled(increments=plain.increments + vibration, angle_random_walk=gyro.walk)


def swaying(
    rng: Generator,
    samples: int,
    sample_rate: float,
    *,
    gyro: Gyro,
    peak: float,
    low: float = 0.1,
    high: float = 2.0,
) -> Troubled:
    """Sway of the bench: a hump between two frequencies, steep on either side.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    peak
        Density at the top relative to that of N.
    low, high
        Where the hump is half as high, Hz.
    """

    def power(f: FloatArray) -> FloatArray:
        return 2.0 * gyro.walk**2 * peak / ((1.0 + (low / f) ** 8) * (1.0 + (f / high) ** 8))

    plain = five_terms(rng, samples, sample_rate, gyro=gyro)
    sway = shaped(rng, samples, sample_rate, power) / sample_rate
    return Troubled(increments=plain.increments + sway, angle_random_walk=gyro.walk)


def coarse_rate(
    rng: Generator, samples: int, sample_rate: float, *, gyro: Gyro, step: float
) -> Troubled:
    """Rate samples rounded to a step. Rounding is white noise of the rate: it adds to N.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    step
        In root mean squares of the rate noise from sample to sample; up to two.
    """
    if not 0.0 < step <= 2.0:
        raise ValueError(f"step is {step}; give root mean squares above 0, at most 2")
    size = step * gyro.walk * math.sqrt(sample_rate)
    rate = _rate(rng, samples, sample_rate, gyro) + 0.3 * size
    rounded = size * np.round(rate / size)
    # Sheppard: the variance of a rounded Gaussian is that of the noise and a twelfth of the step.
    walk = math.sqrt(gyro.walk**2 + size**2 / 12.0 / sample_rate)
    return Troubled(increments=rounded / sample_rate, angle_random_walk=walk)


def spiked(
    rng: Generator, samples: int, sample_rate: float, *, gyro: Gyro, every: float, height: float
) -> Troubled:
    """Single samples far off, as lost bits or shocks make.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    every
        Mean time between them, s.
    height
        Root mean square, in root mean squares of the increments.
    """
    plain = five_terms(rng, samples, sample_rate, gyro=gyro)
    hit = rng.random(samples) < 1.0 / (every * sample_rate)
    size = height * float(plain.increments.std())
    spikes = np.where(hit, size * rng.standard_normal(samples), 0.0)
    return Troubled(increments=plain.increments + spikes, angle_random_walk=gyro.walk)


def warming(
    rng: Generator, samples: int, sample_rate: float, *, gyro: Gyro, rate: float, time: float
) -> Troubled:
    """A bias that settles: ``rate exp(-t/time)``.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    rate
        At the start, rad/s.
    time
        Of the settling, s.
    """
    plain = five_terms(rng, samples, sample_rate, gyro=gyro)
    settling = rate * np.exp(-np.arange(samples) / (sample_rate * time))
    return Troubled(
        increments=plain.increments + settling / sample_rate, angle_random_walk=gyro.walk
    )


def markov(
    rng: Generator, samples: int, sample_rate: float, *, gyro: Gyro, deviation: float, time: float
) -> Troubled:
    """A first-order Markov rate besides.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    deviation
        Root mean square of the rate, rad/s.
    time
        Of correlation, s.
    """
    plain = five_terms(rng, samples, sample_rate, gyro=gyro)
    memory = math.exp(-1.0 / (sample_rate * time))
    drive = deviation * math.sqrt(1.0 - memory**2) * rng.standard_normal(samples)
    drive[0] = deviation * rng.standard_normal()
    rate = lfilter([1.0], [1.0, -memory], drive)
    return Troubled(increments=plain.increments + rate / sample_rate, angle_random_walk=gyro.walk)


def stepping(
    rng: Generator, samples: int, sample_rate: float, *, gyro: Gyro, factor: float
) -> Troubled:
    """N changes by a factor half-way; the truth is the root mean square.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    factor
        N of the second half over that of the first.
    """
    plain = five_terms(rng, samples, sample_rate, gyro=gyro)
    later = np.arange(samples) >= samples // 2
    increments = np.where(later, factor, 1.0) * plain.increments
    return Troubled(
        increments=increments,
        angle_random_walk=gyro.walk * math.sqrt(0.5 * (1.0 + factor**2)),
        parts=(gyro.walk, factor * gyro.walk),
    )


def shaken(
    rng: Generator,
    samples: int,
    sample_rate: float,
    *,
    gyro: Gyro,
    first: float,
    count: int,
    amplitude: float,
    wander: float,
) -> Troubled:
    """A motor shaft: many harmonics of a speed that wanders.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    first
        Mean speed, turns a second.
    count
        Harmonics.
    amplitude
        Of the rate of each, in root densities of N: rad/s over ``walk``.
    wander
        Relative change of the speed.
    """
    slow = shaped(rng, samples, sample_rate, lambda f: 1.0 / (1.0 + (f / 0.02) ** 2))
    speed = first * (1.0 + wander * slow / slow.std())
    phase = 2.0 * np.pi * np.cumsum(speed) / sample_rate
    rate = np.zeros(samples)
    for order in range(1, count + 1):
        size = gyro.walk * amplitude / math.sqrt(order)
        rate += size * np.sin(order * phase + rng.uniform(0.0, 2.0 * np.pi))
    plain = five_terms(rng, samples, sample_rate, gyro=gyro)
    return Troubled(increments=plain.increments + rate / sample_rate, angle_random_walk=gyro.walk)


def cycling(
    rng: Generator, samples: int, sample_rate: float, *, gyro: Gyro, rate: float, period: float
) -> Troubled:
    """Temperature that a controller swings: a slow triangle with an uneven period.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    rate
        Amplitude, rad/s.
    period
        Mean, s.
    """
    turns = np.cumsum(1.0 + 0.2 * rng.standard_normal(int(samples / sample_rate / period) + 20))
    time = np.arange(samples) / sample_rate / period
    phase = np.interp(time, np.concatenate([[0.0], turns]), np.arange(turns.size + 1))
    triangle = 2.0 * np.abs(2.0 * (phase % 1.0) - 1.0) - 1.0
    plain = five_terms(rng, samples, sample_rate, gyro=gyro)
    return Troubled(
        increments=plain.increments + rate * triangle / sample_rate,
        angle_random_walk=gyro.walk,
    )


def common_pair(
    rng: Generator, samples: int, sample_rate: float, *, gyro: Gyro, share: float
) -> tuple[Troubled, Troubled]:
    """Two gyros with a common white part.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    share
        Of N^2 of each that is common, 0 to 1.
    """
    if not 0.0 <= share <= 1.0:
        raise ValueError(f"share is {share}; give 0 to 1")
    both = Gyro(walk=gyro.walk * math.sqrt(share))
    own = Gyro(
        walk=gyro.walk * math.sqrt(1.0 - share),
        quantization=gyro.quantization,
        bias_instability=gyro.bias_instability,
        rate_walk=gyro.rate_walk,
    )
    common = five_terms(rng, samples, sample_rate, gyro=both).increments
    one, other = (
        Troubled(
            increments=common + five_terms(rng, samples, sample_rate, gyro=own).increments,
            angle_random_walk=gyro.walk,
        )
        for _ in range(2)
    )
    return one, other


def filtered_shaper(
    rng: Generator, samples: int, sample_rate: float, *, gyro: Gyro, corner: float, peak: float
) -> Troubled:
    """A servo loop with a peak before it falls: a second-order low-pass with little damping.

    Parameters
    ----------
    rng, samples, sample_rate, gyro
        As everywhere here.
    corner
        Of the loop, Hz.
    peak
        Amplification there.
    """
    natural = 2.0 * np.pi * corner
    numerator, denominator = bilinear([natural**2], [1.0, natural / peak, natural**2], sample_rate)
    settle = int(20.0 * peak * sample_rate / corner)
    rate = _rate(rng, samples + settle, sample_rate, gyro)
    rate = lfilter(numerator, denominator, rate)[settle:]
    return Troubled(increments=_read(rng, rate, sample_rate, gyro), angle_random_walk=gyro.walk)


Kind = Callable[[Generator, int, float], Troubled]

# N is one; at 100 Hz the rate scatters by 10 from sample to sample.
_PLAIN: Final = Gyro()
_LASER: Final = Gyro(quantization=0.3)
_MEMS: Final = Gyro(bias_instability=0.15, rate_walk=0.02)

GALLERY: Final[Mapping[str, Kind]] = {
    "low-pass, first order, 5 % of the rate": partial(low_passed, gyro=_MEMS, corner=0.05),
    "low-pass, first order, 1 % of the rate": partial(low_passed, gyro=_PLAIN, corner=0.01),
    "low-pass, second order, 10 % of the rate": partial(
        low_passed, gyro=_MEMS, corner=0.1, order=2
    ),
    "low-pass and quantization": partial(
        low_passed, gyro=Gyro(quantization=0.02), corner=0.04, order=2
    ),
    "boxcar of 6 samples": partial(boxcar_decimated, gyro=_MEMS, length=6.0),
    "boxcar of half a sample": partial(boxcar_decimated, gyro=_PLAIN, length=0.5),
    "servo with a peak": partial(filtered_shaper, gyro=_MEMS, corner=15.0, peak=3.0),
    "coloured angle noise": partial(coloured_angle, gyro=_PLAIN, angle=0.5, memory=0.8),
    "wandering dither, folded": partial(
        dithered, gyro=_LASER, frequency=417.3, amplitude=20.0, wander=0.3
    ),
    "wandering dither in band": partial(
        dithered, gyro=_LASER, frequency=29.9, amplitude=50.0, wander=0.3
    ),
    "structure resonances": partial(
        resonant, gyro=_LASER, frequencies=(4.2, 9.2, 18.9, 20.7), peak=1e4
    ),
    "sway": partial(swaying, gyro=_PLAIN, peak=30.0, low=0.3, high=2.0),
    "coarse rate steps": partial(coarse_rate, gyro=_PLAIN, step=1.5),
    "spikes": partial(spiked, gyro=_PLAIN, every=20.0, height=20.0),
    "warm-up": partial(warming, gyro=_PLAIN, rate=5.0, time=100.0),
    "Markov rate": partial(markov, gyro=_PLAIN, deviation=1.5, time=3.0),
    "temperature cycles": partial(cycling, gyro=_MEMS, rate=1.0, period=90.0),
    "motor shaft": partial(shaken, gyro=_MEMS, first=1.7, count=28, amplitude=20.0, wander=0.01),
    "noise steps half-way": partial(stepping, gyro=_PLAIN, factor=1.3),
}
