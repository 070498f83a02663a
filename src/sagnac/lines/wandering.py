"""Lines in time whose amplitude and phase drift: mains, dither.

A steady sinusoid has three parameters, and a line that drifts is a thicket of them. Here it is one
carrier under a complex envelope, a cubic spline over equal blocks of the record: as many
parameters as its drift asks for, no more, and so no more noise taken with it. If its frequency
wanders, the phase of the carrier is a spline over the same blocks.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from sagnac.core.arrays import ComplexArray, FloatArray, IntegerArray
from sagnac.lines import _kernels
from sagnac.lines.envelopes import (
    NEAR,
    Baseband,
    Description,
    baseband,
    best_description,
    coefficients_of,
    knot_values,
    knot_variances,
    mean_length,
    peak,
    pieces,
    spline_products,
    spline_values,
    steady_lines,
    sum_of_tones,
)

# Values of the baseband a block: fewer, and the mean over each would round the envelope off.
_VALUES_A_BLOCK: Final = 16
# Samples in the finest mean, and the most of such means.
_FINEST_MEAN: Final = 10
_FINE_MEANS: Final = 72_000
# Cycles of the carrier a block: fewer, and the envelope could not be told from its own mirror
# image at the negative frequency.
_CYCLES_A_BLOCK: Final = 2
# Steady lines that a drifting one may be, at least.
_FEWEST: Final = 3
# Blocks tried, at most.
_MOST_BLOCKS: Final = 8192
# If the envelope is below this share of its rms, the phase is not asked what it does.
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
        Real numbers fitted, each of which took a degree of freedom of the noise with it.
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
    """Groups of steady lines as close together as those that drift makes of one.

    There are three or more in each, each within 30 cycles a record of the next. `fit_drifting`
    finds out whether one drifting line describes them better.

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
    breaks = 1 + np.flatnonzero(np.diff(frequencies[ascending]) * samples > NEAR)
    groups = [group for group in np.split(ascending, breaks) if group.size >= _FEWEST]
    return tuple(group[np.argsort(-significance[group])] for group in groups)


def fit_drifting(
    steps: FloatArray,
    frequency: float,
    floor_level: float,
    *,
    center: float,
    steady_frequencies: FloatArray | None = None,
    steady_amplitudes: ComplexArray | None = None,
) -> DriftingLine | None:
    """The line at `frequency` as one that drifts, or None if steady lines describe it as well.

    Mixed down to zero frequency and averaged, the line is its own envelope, and splines over 1,
    2, 4 ... blocks are fitted to it by least squares. More parameters are taken if chance would
    lower the sum of squares as much in fewer than one case of a hundred. Steady lines, three
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
    steady_frequencies, steady_amplitudes
        (lines,) cycles per sample, and complex amplitude in the angle, rad, of
        ``Re[amplitude exp(2j pi f (n - center))]``: lines about `frequency` that have been taken
        out of `steps`. They are put back here, and are what the drifting line has to beat. None:
        one steady line at `frequency`, still in `steps`.

    Returns
    -------
    DriftingLine or None
        It replaces those of the steady lines given that lie in its `band`; the others stay.

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
    known = np.empty(0) if steady_frequencies is None else steady_frequencies
    removed = np.empty(0) if steady_amplitudes is None else steady_amplitudes
    phasors = removed * (np.exp(2j * np.pi * known) - 1.0)
    most = min(_MOST_BLOCKS, int(min(frequency, 0.5 - frequency) * steps.size / _CYCLES_A_BLOCK))

    def fitted(length: int) -> DriftingLine | None:
        mixed = partial(baseband, steps, floor_level=floor_level, center=center, length=length)
        blocks = min(most, steps.size // (length * _VALUES_A_BLOCK))
        if blocks < 1:
            return None
        # The first carrier may be a side line's; the second is the mean frequency, about which the
        # envelope turns least. The line's mirror image at the negative frequency goes with it.
        base = mixed(frequency)
        base = replace(base, target=base.target + sum_of_tones(base, known, phasors))
        if known.size == 0:
            alone = steady_lines(base, peak(base))
            image = sum_of_tones(base, -alone.frequencies, np.conj(alone.amplitudes))
            base = replace(base, target=base.target - image)
        best = _best(base, known, blocks)
        if best is None:
            return None
        line = _described(best, known.size)
        base = mixed(line.frequency, taken=partial(values, line))
        target = base.target + sum_of_tones(base, known, phasors) + best.shown_by(base)
        best = _best(replace(base, target=target), known, blocks)
        return None if best is None else _described(best, known.size)

    length = mean_length(steps.size)
    finer = max(_FINEST_MEAN, -(-steps.size // _FINE_MEANS))
    line = fitted(length)
    # A line that takes all the blocks that such means allow is looked at more finely. Another is
    # not: what lies near it would be described with it.
    if line and finer < length and steps.size // (length * _VALUES_A_BLOCK) < 2 * line.blocks:
        line = fitted(finer) or line
    return line


def values(line: DriftingLine, start: int, count: int) -> FloatArray:
    """(count,) the line's angle, rad, at samples `start`, `start` + 1, ...."""
    out = np.empty(count)
    scale = line.blocks / line.samples
    _kernels.drifting_tone(start, line.carrier, line.center, scale, line.envelope, line.phase, out)
    return out


def _best(base: Baseband, known: FloatArray, blocks: int) -> Description | None:
    """The best description beside the steady lines known, or else the strongest one."""
    return best_description(base, steady_lines(base, known if known.size else peak(base)), blocks)


def _mean_offset(found: Description) -> tuple[float, float]:
    """Mean frequency off the carrier weighted by power, and its error, cycles per sample."""
    at = found.places()
    carrier = np.exp(1j * spline_values(at, at.now, found.phase))
    later = np.exp(1j * spline_values(at, at.after, found.phase))
    rows = at.now * carrier[:, np.newaxis]
    slopes = at.after * later[:, np.newaxis] - rows
    envelope = spline_values(at, rows, found.coefficients)
    slope = spline_values(at, slopes, found.coefficients)
    power = float(np.vdot(envelope, envelope).real)
    offset = float(np.vdot(envelope, slope).imag) / power
    gradient = spline_products(at, rows, -1j * slope - 2.0 * offset * envelope)
    gradient += spline_products(at, slopes, 1j * envelope)
    error = np.sqrt(found.variance(gradient)) / power
    return offset / (2.0 * np.pi), float(error) / (2.0 * np.pi)


def _described(found: Description, lines: int) -> DriftingLine:
    """The line that a description found; `lines` steady ones were given."""
    base, blocks = found.base, found.blocks
    offset, frequency_error = _mean_offset(found)
    at = found.places()
    envelope = spline_values(at, at.now, found.coefficients)
    size = np.abs(envelope)
    errors = np.asarray(np.sqrt(base.variance * knot_variances(found.factor)))
    own = float(np.mean(errors**2))
    power = float(np.mean(size**2))
    spread = found.variance(2.0 / size.size * spline_products(at, at.now, envelope))
    # An error adds its own power to what it is an error of.
    amplitude = float(np.sqrt(max(power - 2.0 * own, own)))
    turned = spline_values(at, at.after, found.phase) - spline_values(at, at.now, found.phase)
    turned = turned[size > _PRESENT * np.sqrt(power)] / (2.0 * np.pi)
    half = 0.5 * coefficients_of(blocks) / base.samples
    knots = knot_values(found.coefficients) * np.exp(1j * knot_values(found.phase))
    knots.flags.writeable = errors.flags.writeable = False
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
        knots=knots,
        knot_errors=errors,
        parameters=2 * coefficients_of(blocks),
        significance=found.significance,
        band=(
            max(base.frequency + float(turned.min()) - half, 0.0),
            min(base.frequency + float(turned.max()) + half, 0.5),
        ),
        replaced=np.flatnonzero(~found.kept)[:lines],
        # These two stay writable: kernels compile anew for arrays that are not.
        envelope=pieces(found.coefficients),
        phase=pieces(found.phase),
    )
