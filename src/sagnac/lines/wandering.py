"""Lines in time whose amplitude and phase drift: mains, dither.

A steady sinusoid has three parameters, and a line that drifts is a thicket of them. Here it is one
carrier under a complex envelope, a cubic spline over equal blocks of the record: as many
parameters as its drift asks for, no more, and so no more noise taken with it. Where its
frequency wanders, the phase of the carrier is a spline over the same blocks.
"""

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.stats import chi2

from sagnac import series
from sagnac.arrays import ComplexArray, FloatArray, IntegerArray
from sagnac.lines import _kernels

# Uniform cubic B-splines: rows the powers of the place in a block, highest first, columns the four
# coefficients that reach into it. Of a smooth envelope they ask half the blocks of straight pieces.
_CUBIC: Final = (
    np.array([[-1.0, 3.0, -3.0, 1.0], [3.0, -6.0, 3.0, 0.0], [-3.0, 0.0, 3.0, 0.0], [1, 4, 1, 0]])
    / 6.0
)
_REACH: Final = 4
# Chance that a description with more parameters is taken where fewer would do.
_CHANCE: Final = 0.01
# The noise floor is known to some per cent, which of a thousand parameters is more than chance.
_FLOOR_ERROR: Final = 0.05
# Samples of the baseband that are enough for any number of blocks allowed here.
_MOST_BASEBAND: Final = 2**18
# Baseband samples a block: fewer, and the mean over each would round the envelope off.
_SAMPLES_A_BLOCK: Final = 16
# Cycles of the carrier a block: fewer, and the envelope could not be told from its own mirror
# image at the negative frequency.
_CYCLES_A_BLOCK: Final = 2
# Cycles a record between the lines that drift makes of one: they thin out as they grow weak.
_NEAR: Final = 30.0
_FEWEST: Final = 3
_STEPS_OF_LINES: Final = 3
# Values of the baseband at a time, for as many lines as there may be.
_ROWS: Final = 8192
# Where the envelope is below this share of its rms, the phase is not asked what it does.
_PRESENT: Final = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftingLine:
    """One line in time with a drifting amplitude, in the angle.

    ``Re[a(n) exp(1j phi(n)) exp(2j pi carrier (n - center))]``, n the sample number, a and phi
    cubic splines over equal blocks of the record.

    Attributes
    ----------
    frequency, frequency_error
        Mean weighted by power, and its standard deviation, cycles per sample.
    carrier
        Frequency that the envelope is of, cycles per sample.
    center, samples
        Sample number of the phase origin, and the record's length.
    blocks
        How many the record is cut into.
    amplitude, amplitude_error
        Root mean square over the record of the peak amplitude, and its standard deviation, rad.
    drift
        Standard deviation of the peak amplitude over `amplitude`, its own errors taken off.
    knots, knot_errors
        (blocks + 1,) complex amplitude ``a exp(1j phi)`` where blocks meet, rad, and the standard
        deviation of its real and of its imaginary part.
    parameters
        Real numbers fitted; so many degrees of freedom of the noise went with the line.
    significance
        Drop of -2 log likelihood that the line brings.
    band
        (low, high) cycles per sample within which the noise was taken.
    replaced
        Which of the steady lines given this line stands for.
    envelope, phase
        (4, blocks) polynomials in blocks from the start of each, highest power first: complex a in
        rad, and phi in rad.
    """

    frequency: float
    frequency_error: float
    carrier: float
    center: float
    samples: int
    blocks: int
    amplitude: float
    amplitude_error: float
    drift: float
    knots: ComplexArray
    knot_errors: FloatArray
    parameters: int
    significance: float
    band: tuple[float, float]
    replaced: IntegerArray
    envelope: ComplexArray
    phase: FloatArray


def clusters(
    frequencies: FloatArray, significance: FloatArray, samples: int
) -> tuple[IntegerArray, ...]:
    """Steady lines that lie together as those do that drift makes of one.

    Three or more, each within 30 cycles a record of the next. Whether one drifting line says it
    better is for `fit_drifting` to find out.

    Parameters
    ----------
    frequencies, significance
        (lines,) cycles per sample, and drop of -2 log likelihood.
    samples
        Length of the record.

    Returns
    -------
    Indices of the members of each cluster, the strongest first.
    """
    ascending = np.argsort(frequencies)
    breaks = 1 + np.flatnonzero(np.diff(frequencies[ascending]) * samples > _NEAR)
    groups = [group for group in np.split(ascending, breaks) if group.size >= _FEWEST]
    return tuple(group[np.argsort(-significance[group])] for group in groups)


def fit_drifting(
    steps: FloatArray,
    frequency: float,
    floor_level: float,
    *,
    center: float,
    most_blocks: int = 8192,
    steady_frequencies: FloatArray | None = None,
    steady_amplitudes: ComplexArray | None = None,
) -> DriftingLine | None:
    """The line at `frequency` as one that drifts, or None where steady lines say it as well.

    Mixed down to zero frequency and averaged, the line is its own envelope, and splines over 1,
    2, 4 ... blocks are fitted to it by least squares. More parameters are taken where chance
    would not lower the sum of squares so much in one case of a hundred; steady lines, three
    parameters each, are judged alike.

    Parameters
    ----------
    steps
        (samples - 1,) increments of the angle, rad; step n leads from sample n to n + 1. The
        series may be mapped.
    frequency
        Cycles per sample, good to a few cycles a record; that of the strongest of a cluster.
    floor_level
        Noise power of the increments about `frequency`, as `spectrum.noise_floor` gives it, rad^2.
    center
        Sample number of the phase origin.
    most_blocks
        The most to try.
    steady_frequencies, steady_amplitudes
        (lines,) cycles per sample, and complex amplitude in the angle, rad, of
        ``Re[amplitude exp(2j pi f (n - center))]``: lines about `frequency` that have been taken
        out of `steps`. They are put back here, and are what the drifting line has to beat. None:
        one steady line at `frequency`, still in `steps`.

    Returns
    -------
    DriftingLine or None
        Of the steady lines given it replaces those in its `band`; the others stay as they are.

    Raises
    ------
    ValueError
        If `frequency` is not between 0 and 0.5, `floor_level` is not positive, or only one of
        the two arrays of steady lines is given.
    """
    if not 0.0 < frequency < 0.5:
        raise ValueError(f"frequency {frequency!r} is not between 0 and 0.5 cycles per sample")
    if not floor_level > 0.0:
        raise ValueError(f"floor_level {floor_level!r} is not a positive power")
    if (steady_frequencies is None) != (steady_amplitudes is None):
        raise ValueError("steady_frequencies and steady_amplitudes go together; give both or none")
    known = np.empty(0) if steady_frequencies is None else np.asarray(steady_frequencies)
    removed = np.empty(0, complex) if steady_amplitudes is None else np.asarray(steady_amplitudes)
    most = min(
        most_blocks,
        steps.size // (_kernels.MIX_BLOCK * _SAMPLES_A_BLOCK),
        int(min(frequency, 0.5 - frequency) * steps.size / _CYCLES_A_BLOCK),
    )
    if most < 1:
        return None
    # The first carrier may be a side line's; the second is where the power is.
    best: _Description | None = None
    line: DriftingLine | None = None
    # About the mean frequency, which the first round finds, the envelope turns least. And the
    # line's mirror image at the negative frequency goes with the line.
    for _ in range(2):
        base = _baseband(steps, frequency, floor_level, center, line)
        phasors = removed * (np.exp(2j * np.pi * known) - 1.0)
        target = base.target + _sum_of_tones(base, known, phasors)
        if best is not None:
            target += _increments(base, best)
        elif known.size == 0:
            alone = _steady(base, _peak(base))
            target -= _sum_of_tones(base, -alone.frequencies, np.conj(alone.amplitudes))
        base = replace(base, target=target)
        best = _chosen(base, _steady(base, known if known.size else _peak(base)), most)
        if best is None:
            return None
        line = _described(best, known.size)
        frequency = line.frequency
    return line


def values(line: DriftingLine, start: int, count: int) -> FloatArray:
    """(count,) the line's angle, rad, at samples `start`, `start` + 1, ...."""
    out = np.empty(count)
    scale = line.blocks / line.samples
    _kernels.drifting_tone(start, line.carrier, line.center, scale, line.envelope, line.phase, out)
    return out


@dataclass(frozen=True, slots=True, kw_only=True)
class _Baseband:
    """Increments mixed down: one complex amplitude for every `length` samples.

    `target`, (baseband,), in rad; `variance` is that of its real and of its imaginary part, and
    `middles` are the sample numbers that its values stand for.
    """

    target: ComplexArray
    middles: FloatArray
    length: int
    variance: float
    frequency: float
    center: float
    samples: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Steady:
    """Steady lines: frequencies, amplitudes of the increments, -2 log likelihood."""

    frequencies: FloatArray
    amplitudes: ComplexArray
    cost: float


def _baseband(
    steps: FloatArray,
    frequency: float,
    floor_level: float,
    center: float,
    line: DriftingLine | None,
) -> _Baseband:
    """`steps`, without `line`, mixed down."""
    merged = -(-steps.size // (_kernels.MIX_BLOCK * _MOST_BASEBAND))
    length = merged * _kernels.MIX_BLOCK

    def mixed(span: slice) -> ComplexArray:
        rest = steps[span]
        if line is not None:
            rest = rest - np.diff(values(line, span.start, rest.size + 1))
        return _kernels.mixed_down(rest, frequency, center - span.start)

    pieces = series.each(
        mixed, steps.size, length * max(1, series.SPAN // length), release_of=(steps,)
    )
    means = np.concatenate(list(pieces))
    means = means[: means.size // merged * merged].reshape(-1, merged).mean(axis=1)
    return _Baseband(
        target=2.0 * means,
        middles=np.arange(means.size) * length + 0.5 * (length - 1),
        length=length,
        variance=2.0 * floor_level / length,
        frequency=frequency,
        center=center,
        samples=steps.size + 1,
    )


def _peak(base: _Baseband) -> FloatArray:
    """(1,) frequency of the highest peak of the spectrum near the carrier."""
    padded = 2 * base.target.size
    power = np.abs(np.fft.fft(base.target, padded))
    offset = np.fft.fftfreq(padded) / base.length
    power[np.abs(offset) * base.samples > _NEAR] = 0.0
    return np.array([base.frequency + float(offset[int(np.argmax(power))])])


def _tones(base: _Baseband, frequencies: FloatArray, span: slice) -> ComplexArray:
    """(lines, span) steady tones of amplitude one as the means over each length show them."""
    apart = frequencies - base.frequency
    gain = np.sinc(base.length * apart) / np.sinc(apart)
    phase = np.outer(apart, base.middles[span] - base.center)
    return np.asarray(gain[:, np.newaxis] * np.exp(2j * np.pi * phase))


def _sum_of_tones(
    base: _Baseband, frequencies: FloatArray, amplitudes: ComplexArray
) -> ComplexArray:
    """(baseband,) the sum of steady tones."""
    total = np.zeros(base.middles.size, dtype=np.complex128)
    if frequencies.size:
        for span in series.spans(total.size, _ROWS):
            total[span] = amplitudes @ _tones(base, frequencies, span)
    return total


def _steady(base: _Baseband, frequencies: FloatArray) -> _Steady:
    """Least squares of steady lines, their frequencies refined by Gauss-Newton steps."""
    lines = frequencies.size
    power = float(np.vdot(base.target, base.target).real)
    found: list[_Steady] = []
    for _ in range(_STEPS_OF_LINES):
        # Products of the tones with each other, with the lag in them once and twice, and
        # with what they are fitted to.
        plain, once, twice = np.zeros((3, lines, lines), dtype=np.complex128)
        right, lagged = np.zeros((2, lines), dtype=np.complex128)
        for span in series.spans(base.middles.size, _ROWS):
            tones = _tones(base, frequencies, span)
            lag = 2.0 * np.pi / base.samples * (base.middles[span] - base.center)
            across = tones.conj()
            plain += across @ tones.T
            once += across @ (lag * tones).T
            twice += across @ (lag**2 * tones).T
            right += across @ base.target[span]
            lagged += across @ (lag * base.target[span])
        # Amplitudes first: the derivative in frequency is proportional to them.
        amplitudes = np.linalg.pinv(plain, rcond=1e-9, hermitian=True) @ right
        explained = 2.0 * np.vdot(amplitudes, right) - np.vdot(amplitudes, plain @ amplitudes)
        cost = (power - float(explained.real)) / base.variance
        found.append(_Steady(frequencies=frequencies, amplitudes=amplitudes, cost=cost))
        # Real and imaginary amplitudes and frequencies together.
        turned = 1j * amplitudes
        moved = once * turned
        normal = np.block(
            [
                [plain.real, -plain.imag, moved.real],
                [plain.imag, plain.real, moved.imag],
                [moved.real.T, moved.imag.T, (np.outer(turned.conj(), turned) * twice).real],
            ]
        )
        left = right - plain @ amplitudes
        slope = turned.conj() * (lagged - once @ amplitudes)
        rest = np.concatenate([left.real, left.imag, slope.real])
        scale = np.sqrt(np.diag(normal))
        scale[scale == 0.0] = 1.0
        inverse = np.linalg.pinv(normal / np.outer(scale, scale), rcond=1e-9, hermitian=True)
        step = (inverse @ (rest / scale) / scale)[2 * lines :]
        frequencies = frequencies + np.clip(step, -0.5, 0.5) / base.samples
    return min(found, key=lambda one: one.cost)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Description:
    """Splines over `blocks` blocks fitted to a baseband, some steady lines left beside them.

    Attributes
    ----------
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

    base: _Baseband
    blocks: int
    coefficients: ComplexArray
    phase: FloatArray
    factor: ComplexArray
    kept: NDArray[np.bool_]
    cost: float
    significance: float
    parameters: int


def _chosen(base: _Baseband, steady: _Steady, most: int) -> _Description | None:
    """The description with the fewest parameters that no other beats; None for steady lines."""
    numbers = [2**power for power in range(most.bit_length())]
    without: dict[bytes, ComplexArray] = {}
    found = [_fitted(base, steady, blocks, np.zeros(blocks + 3), without) for blocks in numbers]
    plain = found[_simplest([(one.parameters, one.cost) for one in found])]
    if plain.blocks > 1:
        followed = [blocks for blocks in numbers if blocks <= plain.blocks]
        found += [
            _fitted(base, steady, blocks, _followed(plain, blocks), without) for blocks in followed
        ]
    rivals = [(3 * steady.frequencies.size, steady.cost)]
    index = _simplest(rivals + [(one.parameters, one.cost) for one in found])
    return None if index == 0 else found[index - 1]


def _simplest(rivals: list[tuple[int, float]]) -> int:
    """Which (parameters, cost) no other with more parameters beats by more than chance."""
    order = sorted(range(len(rivals)), key=lambda index: rivals[index])
    best = order[0]
    for index in order[1:]:
        added = rivals[index][0] - rivals[best][0]
        gained = rivals[best][1] - rivals[index][1]
        chance = float(chi2.isf(_CHANCE / len(rivals), added)) if added else 0.0
        if gained > chance * (1.0 + _FLOOR_ERROR):
            best = index
    return best


def _places(base: _Baseband, blocks: int) -> tuple[IntegerArray, FloatArray, FloatArray]:
    """Block of each baseband value, and the four splines there and one sample later."""
    scale = blocks / base.samples
    block = np.minimum((base.middles * scale).astype(np.int64), blocks - 1)
    place = base.middles * scale - block
    # The pieces are smooth enough to be carried on by that sample where a block ends.
    now, after = (
        np.stack([x**3, x**2, x, np.ones_like(x)], axis=1) @ _CUBIC for x in (place, place + scale)
    )
    return block, now, after


def _spline(block: IntegerArray, rows: NDArray[Any], coefficients: NDArray[Any]) -> NDArray[Any]:
    """Values of a spline at places given by `_places`."""
    reached = block[:, np.newaxis] + np.arange(_REACH)
    return np.asarray(np.einsum("ij,ij->i", rows, coefficients[reached]))


def _gathered(
    block: IntegerArray, rows: NDArray[Any], weights: ComplexArray, blocks: int
) -> ComplexArray:
    """(blocks + 3,) inner products of each spline with `weights`."""
    return _kernels.spline_products(block, rows.astype(np.complex128), weights, blocks)


def _rows(
    base: _Baseband, blocks: int, phase: FloatArray, apart: float
) -> tuple[IntegerArray, ComplexArray, FloatArray]:
    """Block, (baseband, 4) what the splines make of the baseband, and the phase's turn a sample.

    The carrier lies `apart`, cycles per sample, from the frequency of the baseband.
    """
    block, now, after = _places(base, blocks)
    turned = _spline(block, after, phase) - _spline(block, now, phase) + 2.0 * np.pi * apart
    angle = _spline(block, now, phase) + 2.0 * np.pi * apart * (base.middles - base.center)
    # From the envelope of the angle to that of its increments, and to the mean over a length.
    lead = np.exp(2j * np.pi * base.frequency + 1j * turned)
    gain = np.sinc(base.length * turned / (2.0 * np.pi)) * np.exp(1j * angle)
    return block, gain[:, np.newaxis] * (lead[:, np.newaxis] * after - now), turned


def _increments(base: _Baseband, found: _Description) -> ComplexArray:
    """(baseband,) a line found in another baseband as this one shows it."""
    apart = found.base.frequency - base.frequency
    block, rows, _ = _rows(base, found.blocks, found.phase, apart)
    return _spline(block, rows, found.coefficients)


def _fitted(
    base: _Baseband,
    steady: _Steady,
    blocks: int,
    phase: FloatArray,
    without: dict[bytes, ComplexArray],
) -> _Description:
    """Least squares of the envelope about a carrier of this phase.

    `without` holds what is left of the baseband without the steady lines that are kept, which is
    the same for many a number of blocks.
    """
    block, rows, turned = _rows(base, blocks, phase, 0.0)
    half = 0.5 * (blocks + 3) / base.samples
    slow, fast = float(turned.min()) / (2.0 * np.pi), float(turned.max()) / (2.0 * np.pi)
    offset = steady.frequencies - base.frequency
    kept = (offset < slow - half) | (offset > fast + half)
    if kept.tobytes() not in without:
        others = _sum_of_tones(base, steady.frequencies[kept], steady.amplitudes[kept])
        without[kept.tobytes()] = base.target - others
    target = without[kept.tobytes()]
    factor = scipy.linalg.cholesky_banded(_kernels.spline_normal(block, rows, blocks))
    right = _gathered(block, rows, target, blocks)
    coefficients = scipy.linalg.cho_solve_banded((factor, False), right)
    rest = target - _spline(block, rows, coefficients)
    cost = float(np.vdot(rest, rest).real)
    return _Description(
        base=base,
        blocks=blocks,
        coefficients=coefficients,
        phase=phase,
        factor=factor,
        kept=kept,
        cost=cost / base.variance,
        significance=(float(np.vdot(target, target).real) - cost) / base.variance,
        parameters=2 * (blocks + 3) + 3 * int(kept.sum()),
    )


def _followed(plain: _Description, blocks: int) -> FloatArray:
    """(blocks + 3,) spline through the phase of an envelope, weighted by its power."""
    base = plain.base
    block, now, _ = _places(base, plain.blocks)
    envelope = _spline(block, now, plain.coefficients)
    weight = np.abs(envelope)
    block, now, _ = _places(base, blocks)
    rows = (weight[:, np.newaxis] * now).astype(np.complex128)
    band = _kernels.spline_normal(block, rows, blocks)
    # A block in which the line was gone has no phase of its own.
    band[-1] += 1e-9 * band[-1].real.max()
    right = _gathered(block, rows, (weight * np.unwrap(np.angle(envelope))).astype(complex), blocks)
    return np.asarray(scipy.linalg.solveh_banded(band, right).real)


def _mean_offset(found: _Description) -> tuple[float, float]:
    """Mean frequency off the carrier weighted by power, and its error, cycles per sample."""
    base, blocks = found.base, found.blocks
    block, now, after = _places(base, blocks)
    carrier = np.exp(1j * _spline(block, now, found.phase))
    later = np.exp(1j * _spline(block, after, found.phase))
    rows = now * carrier[:, np.newaxis]
    slopes = after * later[:, np.newaxis] - rows
    envelope = _spline(block, rows, found.coefficients)
    slope = _spline(block, slopes, found.coefficients)
    power = float(np.vdot(envelope, envelope).real)
    offset = float(np.vdot(envelope, slope).imag) / power
    gradient = _gathered(block, rows, -1j * slope - 2.0 * offset * envelope, blocks)
    gradient += _gathered(block, slopes, 1j * envelope, blocks)
    error = np.sqrt(_variance(found, gradient)) / power
    return offset / (2.0 * np.pi), float(error) / (2.0 * np.pi)


def _variance(found: _Description, gradient: ComplexArray) -> float:
    """Variance of a number whose change is the real part of gradient* times coefficients'."""
    solved = scipy.linalg.cho_solve_banded((found.factor, False), gradient)
    return found.base.variance * float(np.vdot(gradient, solved).real)


def _knot_errors(found: _Description) -> FloatArray:
    """(blocks + 1,) standard deviation of either part of the envelope where blocks meet."""
    variances = np.empty(found.blocks + 1)
    # The inverse of a banded matrix is full: some columns at a time.
    for span in series.spans(variances.size, 64):
        count = span.stop - span.start
        columns = np.zeros((found.blocks + 3, count))
        for part in range(3):
            columns[np.arange(span.start, span.stop) + part, np.arange(count)] = _CUBIC[3, part]
        solved = scipy.linalg.cho_solve_banded((found.factor, False), columns)
        variances[span] = np.einsum("ij,ij->j", columns, solved.real)
    return np.asarray(np.sqrt(found.base.variance * variances))


def _described(found: _Description, lines: int) -> DriftingLine:
    base, blocks = found.base, found.blocks
    offset, frequency_error = _mean_offset(found)
    block, now, after = _places(base, blocks)
    envelope = _spline(block, now, found.coefficients)
    size = np.abs(envelope)
    errors = _knot_errors(found)
    own = float(np.mean(errors**2))
    power = float(np.mean(size**2))
    spread = _variance(found, 2.0 / size.size * _gathered(block, now, envelope, blocks))
    # An error adds its own power to what it is an error of.
    amplitude = float(np.sqrt(max(power - 2.0 * own, own)))
    turned = _spline(block, after, found.phase) - _spline(block, now, found.phase)
    turned = turned[size > _PRESENT * np.sqrt(power)] / (2.0 * np.pi)
    half = 0.5 * (blocks + 3) / base.samples
    windows = np.lib.stride_tricks.sliding_window_view
    meeting, turn = (windows(part, 3) @ _CUBIC[3, :3] for part in (found.coefficients, found.phase))
    return DriftingLine(
        frequency=base.frequency + offset,
        frequency_error=frequency_error,
        carrier=base.frequency,
        center=base.center,
        samples=base.samples,
        blocks=blocks,
        amplitude=amplitude,
        amplitude_error=float(np.sqrt(spread)) / (2.0 * amplitude),
        drift=float(np.sqrt(max(float(np.var(size)) - own, 0.0))) / amplitude,
        knots=meeting * np.exp(1j * turn),
        knot_errors=errors,
        parameters=2 * (blocks + 3),
        significance=found.significance,
        band=(
            max(base.frequency + float(turned.min()) - half, 0.0),
            min(base.frequency + float(turned.max()) + half, 0.5),
        ),
        replaced=np.flatnonzero(~found.kept)[:lines],
        envelope=np.ascontiguousarray(_CUBIC @ windows(found.coefficients, 4).T),
        phase=np.ascontiguousarray(_CUBIC @ windows(found.phase, 4).T),
    )
