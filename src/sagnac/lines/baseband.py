"""A narrow band of the increments mixed down to zero frequency, and steady lines in it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac.core.arrays import ComplexArray, FloatArray, blocks
from sagnac.lines.components import MIX_BLOCK, mixed_down

NEAR: Final = 30.0
"""Cycles a record between the lines that drift makes of one: they thin out as they grow weak."""

# Values of a baseband that are enough for any number of blocks that is tried.
_MOST_VALUES: Final = 2**18
_STEPS_OF_LINES: Final = 3
# Frequencies move by no more than this in one step, in cycles a record.
_LONGEST_STEP: Final = 0.5
# Values at a time, for any number of lines.
_ROWS: Final = 8192
# Singular values below this share of the largest are directions that the data do not distinguish.
_COLLINEAR: Final = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Baseband:
    """Increments mixed down: one complex amplitude for every `length` samples.

    Attributes
    ----------
    target
        (values,) rad.
    middles
        (values,) sample numbers that they stand for.
    length
        Samples a value.
    variance
        Of the real and of the imaginary part of each value, rad^2.
    frequency
        That became zero, cycles per sample.
    center
        Sample number of the phase origin.
    samples
        In the record.
    """

    target: ComplexArray
    middles: FloatArray
    length: int
    variance: float
    frequency: float
    center: float
    samples: int

    def __post_init__(self) -> None:
        if self.target.shape != self.middles.shape:
            raise ValueError(
                f"target has shape {self.target.shape} and middles {self.middles.shape}; give one "
                "of each a value"
            )
        if not self.variance > 0.0:
            raise ValueError(f"variance is {self.variance!r}; give a positive one")


@dataclass(frozen=True, slots=True, kw_only=True)
class SteadyLines:
    """Steady lines fitted to a baseband.

    Attributes
    ----------
    frequencies
        (lines,) cycles per sample.
    amplitudes
        (lines,) complex, of the increments, rad.
    cost
        -2 log likelihood.
    """

    frequencies: FloatArray
    amplitudes: ComplexArray
    cost: float


def mean_length(samples: int) -> int:
    """Samples in the mean that one value of a baseband of so long a record is."""
    return MIX_BLOCK * -(-samples // (MIX_BLOCK * _MOST_VALUES))


def baseband(
    steps: FloatArray,
    frequency: float,
    floor_level: float,
    *,
    center: float,
    length: int,
    taken: Callable[[int, int], FloatArray] | None = None,
) -> Baseband:
    """Increments about a frequency, mixed down and averaged.

    Parameters
    ----------
    steps
        (samples - 1,) increments of the angle, rad.
    frequency
        Cycles per sample.
    floor_level
        Noise power of the increments about `frequency`, rad^2.
    center
        Sample number of the phase origin.
    length
        Samples in the mean that a value is.
    taken
        Gives the angle, rad, that is taken away first, for a first sample and a number of samples.
    """
    mixed = []
    for block in blocks(steps.size, multiple=length):
        rest = steps[block]
        if taken is not None:
            rest = rest - np.diff(taken(block.start, rest.size + 1))
        mixed.append(mixed_down(rest, frequency, center - block.start, length))
    means = np.concatenate(mixed)
    return Baseband(
        target=2.0 * means,
        middles=np.arange(means.size, dtype=np.float64) * length + 0.5 * (length - 1),
        length=length,
        variance=2.0 * floor_level / length,
        frequency=frequency,
        center=center,
        samples=steps.size + 1,
    )


def peak(base: Baseband) -> FloatArray:
    """(1,) frequency, cycles per sample, of the highest peak of the spectrum near the carrier."""
    padded = 2 * base.target.size
    power = np.abs(np.fft.fft(base.target, padded))
    offset = np.fft.fftfreq(padded) / base.length
    power[np.abs(offset) * base.samples > NEAR] = 0.0
    return np.array([base.frequency + float(offset[int(np.argmax(power))])])


def sum_of_tones(base: Baseband, frequencies: FloatArray, amplitudes: ComplexArray) -> ComplexArray:
    """(values,) the sum of steady tones, as the baseband shows it.

    Parameters
    ----------
    base
        Which values.
    frequencies
        (tones,) cycles per sample.
    amplitudes
        (tones,) complex, of the increments, rad.
    """
    if frequencies.size == 0:
        return np.zeros(base.middles.size, dtype=np.complex128)
    return np.concatenate(
        [
            amplitudes @ _tones(base, frequencies, base.middles[some])
            for some in blocks(base.middles.size, _ROWS)
        ]
    )


def steady_lines(base: Baseband, frequencies: FloatArray) -> SteadyLines:
    """Least squares of steady lines, their frequencies refined by Gauss-Newton steps."""
    found: list[SteadyLines] = []
    for _ in range(_STEPS_OF_LINES):
        products = _products(base, frequencies)
        lines = _amplitudes(base, frequencies, products)
        found.append(lines)
        frequencies = frequencies + _frequency_step(lines.amplitudes, products) / base.samples
    return min(found, key=lambda one: one.cost)


def _tones(base: Baseband, frequencies: FloatArray, middles: FloatArray) -> ComplexArray:
    """(tones, middles) steady tones of amplitude one as the means over each length show them."""
    apart = frequencies - base.frequency
    gain = np.sinc(base.length * apart) / np.sinc(apart)
    phase = np.outer(apart, middles - base.center)
    return np.asarray(gain[:, np.newaxis] * np.exp(2j * np.pi * phase))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Products:
    """Inner products of tones with each other and with the baseband.

    Attributes
    ----------
    plain, once, twice
        (tones, tones) with the lag in them not at all, once and twice.
    right, lagged
        (tones,) with the baseband, and with the lag in them.
    """

    plain: ComplexArray
    once: ComplexArray
    twice: ComplexArray
    right: ComplexArray
    lagged: ComplexArray


def _products(base: Baseband, frequencies: FloatArray) -> _Products:
    """Inner products of steady tones; the lag is 2 pi a record."""
    count = frequencies.size
    total = np.zeros((count, 3 * count + 2), dtype=np.complex128)
    for some in blocks(base.middles.size, _ROWS):
        tones = _tones(base, frequencies, base.middles[some])
        lag = 2.0 * np.pi / base.samples * (base.middles[some] - base.center)
        across = tones.conj()
        total[:, :count] += across @ tones.T
        total[:, count : 2 * count] += across @ (lag * tones).T
        total[:, 2 * count : 3 * count] += across @ (lag**2 * tones).T
        total[:, -2] += across @ base.target[some]
        total[:, -1] += across @ (lag * base.target[some])
    plain, once, twice = (total[:, part * count : (part + 1) * count] for part in range(3))
    # Contiguous, as they are used in matrix products.
    return _Products(
        plain=np.ascontiguousarray(plain),
        once=np.ascontiguousarray(once),
        twice=np.ascontiguousarray(twice),
        right=total[:, -2].copy(),
        lagged=total[:, -1].copy(),
    )


def _amplitudes(base: Baseband, frequencies: FloatArray, products: _Products) -> SteadyLines:
    """Amplitudes at these frequencies."""
    plain, right = products.plain, products.right
    power = float(np.vdot(base.target, base.target).real)
    amplitudes = np.linalg.pinv(plain, rcond=_COLLINEAR, hermitian=True) @ right
    explained = 2.0 * np.vdot(amplitudes, right) - np.vdot(amplitudes, plain @ amplitudes)
    cost = (power - float(explained.real)) / base.variance
    return SteadyLines(frequencies=frequencies, amplitudes=amplitudes, cost=cost)


def _frequency_step(amplitudes: ComplexArray, products: _Products) -> FloatArray:
    """(tones,) Gauss-Newton step of the frequencies, cycles a record.

    Real and imaginary amplitudes and frequencies move together. The amplitudes have been fitted
    first, since the derivative in frequency is proportional to them.
    """
    plain, once = products.plain, products.once
    turned = 1j * amplitudes
    moved = once * turned
    normal = np.block(
        [
            [plain.real, -plain.imag, moved.real],
            [plain.imag, plain.real, moved.imag],
            [moved.real.T, moved.imag.T, (np.outer(turned.conj(), turned) * products.twice).real],
        ]
    )
    left = products.right - plain @ amplitudes
    slope = turned.conj() * (products.lagged - once @ amplitudes)
    rest = np.concatenate([left.real, left.imag, slope.real])
    scale = np.sqrt(np.diag(normal))
    scale[scale == 0.0] = 1.0
    inverse = np.linalg.pinv(normal / np.outer(scale, scale), rcond=_COLLINEAR, hermitian=True)
    step = (inverse @ (rest / scale) / scale)[2 * amplitudes.size :]
    return np.asarray(np.clip(step, -_LONGEST_STEP, _LONGEST_STEP))
