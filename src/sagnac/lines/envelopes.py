"""A line in a baseband as a carrier under a spline envelope, with as many blocks as it asks for.

A baseband is a narrow band of the increments, mixed down to zero frequency. Lines in it are steady,
or drift under an envelope.

Uniform cubic B-splines stand over equal blocks of a record: values and least squares.

These are written out because scipy's are slower here: a least squares fit of a complex envelope by
`scipy.interpolate.BSpline.design_matrix` and sparse products takes 3 to 7 times as long (63 to
104 ms for 21 to 27 ms at 72,000 values, 3.9 for 0.6 ms at 3,000; one core), and agrees to rounding
except for the blocks' ends, at which a `Places.after` goes on with the block's own piece.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np
import scipy.linalg
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.special import chdtri

from sagnac.core import arrays
from sagnac.core.arrays import BooleanArray, ComplexArray, FloatArray, IntegerArray
from sagnac.lines import _kernels
from sagnac.lines.components import mixed_down
from sagnac.spectrum.transforms import TONE_WIDTH

# ---- baseband --------------------------------------------------------------------

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


class SteadyLines(NamedTuple):
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
    means = mixed_down(steps, np.array([frequency]), center, length, taken)[:, 0]
    return Baseband(
        target=2.0 * means,
        middles=np.arange(means.size, dtype=np.float64) * length + 0.5 * (length - 1),
        length=length,
        variance=2.0 * floor_level / length,
        frequency=frequency,
        center=center,
        samples=steps.size + 1,
    )


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
    total = np.zeros(base.middles.size, dtype=np.complex128)
    for some in arrays.blocks(base.middles.size, _ROWS):
        total[some] = amplitudes @ _tones(base, frequencies, base.middles[some])
    return total


def steady_lines(base: Baseband, frequencies: FloatArray) -> SteadyLines:
    """Least squares of steady lines, their frequencies refined by Gauss-Newton steps."""
    fits: list[SteadyLines] = []
    power = float(np.vdot(base.target, base.target).real)
    for _ in range(3):
        gram, data = _products(base, frequencies)
        plain, right = gram[0], data[0]
        amplitudes = np.linalg.pinv(plain, rcond=_COLLINEAR, hermitian=True) @ right
        explained = 2.0 * np.vdot(amplitudes, right) - np.vdot(amplitudes, plain @ amplitudes)
        cost = (power - float(explained.real)) / base.variance
        fits.append(SteadyLines(frequencies=frequencies, amplitudes=amplitudes, cost=cost))
        frequencies = frequencies + _frequency_step(amplitudes, gram, data) / base.samples
    return min(fits, key=lambda one: one.cost)


def _tones(base: Baseband, frequencies: FloatArray, middles: FloatArray) -> ComplexArray:
    """(tones, middles) steady tones of amplitude one as the means over each length show them.

    The middles are evenly apart: a wave is the product of one at every `TONE_WIDTH`-th of them and
    of one from there on, and few exponentials are taken.
    """
    apart = frequencies - base.frequency
    gain = np.sinc(base.length * apart) / np.sinc(apart)
    turned = 2j * np.pi * apart[:, np.newaxis]
    starts = np.exp(turned * (middles[::TONE_WIDTH] - base.center)) * gain[:, np.newaxis]
    along = np.exp(turned * (middles[:TONE_WIDTH] - middles[0]))
    waves = starts[:, :, np.newaxis] * along[:, np.newaxis]
    size = starts.shape[1] * along.shape[1]
    return np.asarray(waves.reshape(apart.size, size)[:, : middles.size])


def _products(base: Baseband, frequencies: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Inner products of steady tones; the lag is 2 pi a record.

    Returns
    -------
    gram
        (3, tones, tones) of tones with each other, the lag in them not at all, once and twice.
    data
        (2, tones) of tones with the baseband, without the lag and with it.
    """
    gram = np.zeros((3, frequencies.size, frequencies.size), dtype=np.complex128)
    data = np.zeros((2, frequencies.size), dtype=np.complex128)
    for some in arrays.blocks(base.middles.size, _ROWS):
        tones = _tones(base, frequencies, base.middles[some])
        lag = 2.0 * np.pi / base.samples * (base.middles[some] - base.center)
        across = tones.conj()
        for power in range(3):
            gram[power] += across @ (lag**power * tones).T
        for power in range(2):
            data[power] += across @ (lag**power * base.target[some])
    return gram, data


def _frequency_step(amplitudes: ComplexArray, gram: ComplexArray, data: ComplexArray) -> FloatArray:
    """(tones,) Gauss-Newton step of the frequencies, cycles a record, half of one at most.

    Real and imaginary amplitudes and frequencies move together. The amplitudes have been fitted
    first, since the derivative in frequency is proportional to them.
    """
    plain, once, twice = gram
    turned = 1j * amplitudes
    moved = once * turned
    real, imaginary = [plain.real, -plain.imag, moved.real], [plain.imag, plain.real, moved.imag]
    turning = (np.outer(turned.conj(), turned) * twice).real
    normal = np.block([real, imaginary, [moved.real.T, moved.imag.T, turning]])
    left, slope = data[0] - plain @ amplitudes, turned.conj() * (data[1] - once @ amplitudes)
    rest = np.concatenate([left.real, left.imag, slope.real])
    scale = np.sqrt(np.diag(normal))
    scale[scale == 0.0] = 1.0
    inverse = np.linalg.pinv(normal / np.outer(scale, scale), rcond=_COLLINEAR, hermitian=True)
    step = inverse @ (rest / scale) / scale
    return np.asarray(np.clip(step[2 * amplitudes.size :], -0.5, 0.5))


# ---- splines -----------------------------------------------------------------------

# Rows are the powers of the place in a block, highest first; columns are the four coefficients that
# reach into it. Cubic pieces follow a smooth envelope in half the blocks that straight ones need.
_CUBIC: Final = np.array([[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 0, 3, 0], [1, 4, 1, 0]]) / 6.0
_REACH: Final = 4


class Places(NamedTuple):
    """Places in the blocks of a record, and the splines there.

    Attributes
    ----------
    blocks
        In the record.
    block
        (places,) block of each.
    now, after
        (places, 4) the four splines that reach there, and one sample later. The pieces are smooth
        enough to be carried on by that sample at the end of a block.
    """

    blocks: int
    block: IntegerArray
    now: FloatArray
    after: FloatArray


def places(middles: FloatArray, samples: int, blocks: int) -> Places:
    """Places of the sample numbers `middles` in a record of `samples` cut into `blocks`."""
    scale = blocks / samples
    block = np.minimum((middles * scale).astype(np.int64), blocks - 1)
    place = middles * scale - block
    powers = (np.stack([x**3, x**2, x, np.ones_like(x)], axis=1) for x in (place, place + scale))
    now, after = (rows @ _CUBIC for rows in powers)
    return Places(blocks=blocks, block=block, now=now, after=after)


def spline_values(at: Places, rows: NDArray[Any], coefficients: NDArray[Any]) -> NDArray[Any]:
    """(places,) sum of each row, (places, 4), times the coefficients that reach there."""
    reached = at.block[:, np.newaxis] + np.arange(_REACH)
    return np.asarray(np.einsum("ij,ij->i", rows, coefficients[reached]))


def spline_products(at: Places, rows: NDArray[Any], weights: ComplexArray) -> ComplexArray:
    """(coefficients,) inner products of each column of `rows`, (places, 4), with `weights`."""
    return _kernels.spline_products(at.block, rows.astype(np.complex128), weights, at.blocks)


def normal_bands(at: Places, rows: ComplexArray) -> ComplexArray:
    """(4, coefficients) upper bands of the normal matrix of `rows`; the last is the diagonal."""
    return _kernels.spline_normal(at.block, rows, at.blocks)


def knot_values(coefficients: NDArray[Any]) -> NDArray[Any]:
    """(blocks + 1,) values of a spline where blocks meet."""
    return np.asarray(sliding_window_view(coefficients, _REACH - 1) @ _CUBIC[3, :3])


def pieces(coefficients: NDArray[Any]) -> NDArray[Any]:
    """(4, blocks) polynomials in blocks from the start of each, highest power first."""
    return np.ascontiguousarray(_CUBIC @ sliding_window_view(coefficients, _REACH).T)


def knot_variances(factor: ComplexArray) -> FloatArray:
    """(blocks + 1,) variances of the values where blocks meet, for data of unit variance.

    `factor` is the banded Cholesky factor of the normal matrix.
    """
    inverse = np.empty(factor.shape, dtype=np.complex128)
    _kernels.inverse_bands(factor, inverse)
    count, (first, middle, last) = factor.shape[1] - 2, _CUBIC[3, :3]
    own, beside, across = inverse.real[:3]
    variances = first**2 * own[:count] + middle**2 * own[1:-1] + last**2 * own[2:]
    variances += 2.0 * middle * (first * beside[:count] + last * beside[1:-1])
    return np.asarray(variances + 2.0 * first * last * across[:count])


# ---- envelopes ---------------------------------------------------------------------

# Parameters of a steady line: two of amplitude, one of frequency.
_OF_STEADY: Final = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """Splines over `blocks` blocks fitted to a baseband, some steady lines left beside them.

    Attributes
    ----------
    base
        What they are fitted to.
    blocks
        That the record is cut into.
    coefficients, phase
        (blocks + 3,) of the envelope (complex, rad) and of the carrier's phase (rad).
    factor
        Banded Cholesky factor of the normal matrix.
    kept
        (lines,) bool, the steady lines beside it.
    cost, significance
        -2 log likelihood, and how much lower it is than without the line.
    parameters
        All told, those of the lines kept among them.
    """

    base: Baseband
    blocks: int
    coefficients: ComplexArray
    phase: FloatArray
    factor: ComplexArray
    kept: BooleanArray
    cost: float
    significance: float
    parameters: int

    def variance(self, gradient: ComplexArray) -> float:
        """Variance of a number whose change is the real part of gradient* times coefficients'."""
        solved = scipy.linalg.cho_solve_banded((self.factor, False), gradient)
        return self.base.variance * float(np.vdot(gradient, solved).real)

    def shown_by(self, base: Baseband) -> ComplexArray:
        """(values,) the line as another baseband shows it."""
        at, rows, _ = _columns(base, self.blocks, self.phase, self.base.frequency - base.frequency)
        return spline_values(at, rows, self.coefficients)


def best_description(base: Baseband, steady: SteadyLines, most: int) -> Description | None:
    """The description that no other with more parameters beats; None if it is steady lines.

    Parameters
    ----------
    base
        What is described.
    steady
        Steady lines fitted to it.
    most
        The largest number of blocks; powers of 2 up to it are tried.
    """
    numbers = [2**power for power in range(most.bit_length())]
    # What is left without the steady lines kept is the same for many a number of blocks.
    without: dict[bytes, ComplexArray] = {}

    def fitted(blocks: int, phase: FloatArray) -> Description:
        at, rows, turned = _columns(base, blocks, phase, 0.0)
        # Steady lines beyond the band of the envelope stay beside it.
        half = 0.5 * (blocks + 3) / base.samples
        offset = steady.frequencies - base.frequency
        kept = offset < turned.min() / (2.0 * np.pi) - half
        kept |= offset > turned.max() / (2.0 * np.pi) + half
        if kept.tobytes() not in without:
            others = sum_of_tones(base, steady.frequencies[kept], steady.amplitudes[kept])
            without[kept.tobytes()] = base.target - others
        target = without[kept.tobytes()]
        factor = scipy.linalg.cholesky_banded(normal_bands(at, rows))
        right = spline_products(at, rows, target)
        coefficients = scipy.linalg.cho_solve_banded((factor, False), right)
        rest = target - spline_values(at, rows, coefficients)
        cost = float(np.vdot(rest, rest).real)
        return Description(
            base=base,
            blocks=blocks,
            coefficients=coefficients,
            phase=phase,
            factor=factor,
            kept=kept,
            cost=cost / base.variance,
            significance=(float(np.vdot(target, target).real) - cost) / base.variance,
            parameters=2 * (blocks + 3) + _OF_STEADY * int(kept.sum()),
        )

    fits = [fitted(blocks, np.zeros(blocks + 3)) for blocks in numbers]
    plain = fits[simplest([(one.parameters, one.cost) for one in fits])]
    if plain.blocks > 1:
        followed = [blocks for blocks in numbers if blocks <= plain.blocks]
        fits += [fitted(blocks, followed_phase(plain, blocks)) for blocks in followed]
    # A line's own skirts may have raised the floor about it: noise is no more than what the
    # richest description leaves.
    richest = fits[len(numbers) - 1]
    free = 2 * base.target.size - richest.parameters
    part = min(1.0, richest.cost / free) if free > 0 else 1.0
    rivals = [(_OF_STEADY * steady.frequencies.size, steady.cost / part)]
    index = simplest(rivals + [(one.parameters, one.cost / part) for one in fits])
    if index == 0:
        return None
    best = fits[index - 1]
    base, significance = replace(base, variance=base.variance * part), best.significance / part
    return replace(best, base=base, cost=best.cost / part, significance=significance)


def simplest(rivals: list[tuple[int, float]]) -> int:
    """Which (parameters, cost) no other with more parameters beats by more than chance."""
    order = sorted(range(len(rivals)), key=lambda index: rivals[index])
    best = order[0]
    for index in order[1:]:
        added, gained = rivals[index][0] - rivals[best][0], rivals[best][1] - rivals[index][1]
        # One of a hundred descriptions with more parameters is taken if fewer would do.
        chance = float(chdtri(added, 0.01 / len(rivals))) if added else 0.0
        # The floor is known to some per cent, which for a thousand parameters is more than chance.
        if gained > 1.05 * chance:
            best = index
    return best


def followed_phase(plain: Description, blocks: int) -> FloatArray:
    """(blocks + 3,) spline through the phase of an envelope, weighted by its power."""
    base = plain.base
    at = places(base.middles, base.samples, plain.blocks)
    envelope = spline_values(at, at.now, plain.coefficients)
    weight = np.abs(envelope)
    at = places(base.middles, base.samples, blocks)
    band = normal_bands(at, (weight[:, np.newaxis] * at.now).astype(np.complex128))
    # A block in which the line was gone has no phase.
    band[-1] += 1e-9 * band[-1].real.max()
    phase = (weight * np.unwrap(np.angle(envelope))).astype(complex)
    right = spline_products(at, weight[:, np.newaxis] * at.now, phase)
    return np.asarray(scipy.linalg.solveh_banded(band, right).real)


def _columns(
    base: Baseband, blocks: int, phase: FloatArray, apart: float
) -> tuple[Places, ComplexArray, FloatArray]:
    """Columns of the splines of an envelope on a baseband, about a carrier `apart` from its own.

    Returns
    -------
    at
        Places of the baseband's values.
    rows
        (values, 4) of the splines that reach there.
    turned
        (values,) phase that the carrier gains in a sample there, rad.
    """
    at = places(base.middles, base.samples, blocks)
    here, later = spline_values(at, at.now, phase), spline_values(at, at.after, phase)
    turned = later - here + 2.0 * np.pi * apart
    angle = here + 2.0 * np.pi * apart * (base.middles - base.center)
    # From the envelope of the angle to that of its increments, and to the mean over a length.
    lead = np.exp(2j * np.pi * base.frequency + 1j * turned)
    gain = np.sinc(base.length * turned / (2.0 * np.pi)) * np.exp(1j * angle)
    return at, gain[:, np.newaxis] * (lead[:, np.newaxis] * at.after - at.now), turned
