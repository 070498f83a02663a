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
    mixed, carrier = [], np.array([frequency])
    for block in blocks(steps.size, multiple=length):
        rest = steps[block]
        if taken is not None:
            rest = rest - np.diff(taken(block.start, rest.size + 1))
        mixed.append(mixed_down(rest, carrier, center - block.start, length)[:, 0])
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
        between, data = _products(base, frequencies)
        lines = _amplitudes(base, frequencies, between, data)
        found.append(lines)
        frequencies = frequencies + _frequency_step(lines.amplitudes, between, data) / base.samples
    return min(found, key=lambda one: one.cost)


def _tones(base: Baseband, frequencies: FloatArray, middles: FloatArray) -> ComplexArray:
    """(tones, middles) steady tones of amplitude one as the means over each length show them."""
    apart = frequencies - base.frequency
    gain = np.sinc(base.length * apart) / np.sinc(apart)
    phase = np.outer(apart, middles - base.center)
    return np.asarray(gain[:, np.newaxis] * np.exp(2j * np.pi * phase))


def _products(base: Baseband, frequencies: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Inner products of steady tones; the lag is 2 pi a record.

    Returns
    -------
    between
        (3, tones, tones) of tones with each other, the lag in them not at all, once and twice.
    data
        (2, tones) of tones with the baseband, without the lag and with it.
    """
    between = np.zeros((3, frequencies.size, frequencies.size), dtype=np.complex128)
    data = np.zeros((2, frequencies.size), dtype=np.complex128)
    for some in blocks(base.middles.size, _ROWS):
        tones = _tones(base, frequencies, base.middles[some])
        lag = 2.0 * np.pi / base.samples * (base.middles[some] - base.center)
        across = tones.conj()
        for power in range(3):
            between[power] += across @ (lag**power * tones).T
        for power in range(2):
            data[power] += across @ (lag**power * base.target[some])
    return between, data


def _amplitudes(
    base: Baseband, frequencies: FloatArray, between: ComplexArray, data: ComplexArray
) -> SteadyLines:
    """Amplitudes at these frequencies, from `_products`."""
    plain, right = between[0], data[0]
    power = float(np.vdot(base.target, base.target).real)
    amplitudes = np.linalg.pinv(plain, rcond=_COLLINEAR, hermitian=True) @ right
    explained = 2.0 * np.vdot(amplitudes, right) - np.vdot(amplitudes, plain @ amplitudes)
    cost = (power - float(explained.real)) / base.variance
    return SteadyLines(frequencies=frequencies, amplitudes=amplitudes, cost=cost)


def _frequency_step(
    amplitudes: ComplexArray, between: ComplexArray, data: ComplexArray
) -> FloatArray:
    """(tones,) Gauss-Newton step of the frequencies, cycles a record.

    Real and imaginary amplitudes and frequencies move together. The amplitudes have been fitted
    first, since the derivative in frequency is proportional to them.
    """
    plain, once, twice = between
    turned = 1j * amplitudes
    moved = once * turned
    normal = np.block(
        [
            [plain.real, -plain.imag, moved.real],
            [plain.imag, plain.real, moved.imag],
            [moved.real.T, moved.imag.T, (np.outer(turned.conj(), turned) * twice).real],
        ]
    )
    left = data[0] - plain @ amplitudes
    slope = turned.conj() * (data[1] - once @ amplitudes)
    rest = np.concatenate([left.real, left.imag, slope.real])
    scale = np.sqrt(np.diag(normal))
    scale[scale == 0.0] = 1.0
    inverse = np.linalg.pinv(normal / np.outer(scale, scale), rcond=_COLLINEAR, hermitian=True)
    step = (inverse @ (rest / scale) / scale)[2 * amplitudes.size :]
    return np.asarray(np.clip(step, -_LONGEST_STEP, _LONGEST_STEP))
