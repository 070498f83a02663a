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
from sagnac.lines import _kernels, envelopes
from sagnac.lines.sampling import MIX_BLOCK

# Values of the baseband a block: fewer, and the mean over each would round the envelope off.
_VALUES_A_BLOCK: Final = 16


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
        Which of the steady lines this line stands for.
    envelope, phase
        (4, blocks) polynomials in blocks from the start of each, highest power first: complex a in
        rad, and phi in rad.
    """

    frequency: float
    frequency_error: float
    carrier: float
    center: float
    samples: int
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

    @property
    def blocks(self) -> int:
        """How many blocks the record is cut into."""
        return int(self.envelope.shape[1])


def clusters(frequencies: FloatArray, significance: FloatArray, samples: int) -> list[IntegerArray]:
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
    # Cycles a record between the lines that drift makes of one: they thin out as they grow weak.
    breaks = 1 + np.flatnonzero(np.diff(frequencies[ascending]) * samples > 30.0)
    groups = [group for group in np.split(ascending, breaks) if group.size >= 3]
    return [group[np.argsort(-significance[group])] for group in groups]


def fit_drifting(
    steps: FloatArray, frequencies: FloatArray, amplitude: ComplexArray, level: float, center: float
) -> DriftingLine | None:
    """Steady lines as one that drifts, or None if they describe it as well.

    Mixed down to zero frequency and averaged, the line is its own envelope, and splines over 1,
    2, 4 ... blocks are fitted to it by least squares. More parameters are taken if chance would
    lower the sum of squares as much in fewer than one case of a hundred. Steady lines, three
    parameters each, are judged alike.

    Parameters
    ----------
    steps
        (samples - 1,) increments of the angle, rad, without the steady lines; step n leads from
        sample n to n + 1. The series may be mapped.
    frequencies, amplitude
        (lines,) cycles per sample, and complex amplitude in the angle, rad, of
        ``Re[amplitude exp(2j pi f (n - center))]``: one line or a cluster, the strongest first.
        They are put back here, and are what the drifting line has to beat.
    level
        Noise power of the increments about the first, as `spectrum.noise_floor` gives it, rad^2.
    center
        Sample number of the phase origin.

    Returns
    -------
    DriftingLine or None
        It replaces those of the steady lines that lie in its `band`; the others stay.
    """
    strongest = float(frequencies[0])
    phasors = amplitude * (np.exp(2j * np.pi * frequencies) - 1.0)
    # With fewer than two cycles of the carrier a block, the envelope could not be told from its own
    # mirror image at the negative frequency.
    most = min(8192, int(min(strongest, 0.5 - strongest) * steps.size / 2.0))

    def fitted(length: int) -> DriftingLine | None:
        blocks = min(most, steps.size // (length * _VALUES_A_BLOCK))
        if blocks < 1:
            return None
        # The first carrier may be a side line's; the second is the mean frequency, about which the
        # envelope turns least. The line's mirror image at the negative frequency goes with it.
        line: DriftingLine | None = None
        best, carrier = None, strongest
        for _ in range(2):
            taken = partial(values, line) if line else None
            base = envelopes.baseband(
                steps, carrier, level, center=center, length=length, taken=taken
            )
            target = base.target + envelopes.sum_of_tones(base, frequencies, phasors)
            target = target if best is None else target + best.shown_by(base)
            base = replace(base, target=target)
            steady = envelopes.steady_lines(base, frequencies)
            best = envelopes.best_description(base, steady, blocks)
            if best is None:
                return None
            line = _described(best)
            carrier = line.frequency
        return line

    # 2^18 values are enough for any number of blocks; the finest means are of ten samples.
    length = MIX_BLOCK * -(-steps.size // (MIX_BLOCK * 2**18))
    finer = max(10, -(-steps.size // 72_000))
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


def _described(description: envelopes.Description) -> DriftingLine:
    """The line that a description found."""
    base = description.base
    at = envelopes.places(base.middles, base.samples, description.blocks)
    phase = description.phase
    now, after = (envelopes.spline_values(at, rows, phase) for rows in (at.now, at.after))
    # Mean frequency off the carrier weighted by power.
    rows = at.now * np.exp(1j * now)[:, np.newaxis]
    slopes = at.after * np.exp(1j * after)[:, np.newaxis] - rows
    turning = envelopes.spline_values(at, rows, description.coefficients)
    slope = envelopes.spline_values(at, slopes, description.coefficients)
    energy = float(np.vdot(turning, turning).real)
    offset = float(np.vdot(turning, slope).imag) / energy
    gradient = envelopes.spline_products(at, rows, -1j * slope - 2.0 * offset * turning)
    gradient += envelopes.spline_products(at, slopes, 1j * turning)
    frequency_error = float(np.sqrt(description.variance(gradient))) / energy / (2.0 * np.pi)
    envelope = envelopes.spline_values(at, at.now, description.coefficients)
    size = np.abs(envelope)
    errors = np.asarray(np.sqrt(base.variance * envelopes.knot_variances(description.factor)))
    own, power = float(np.mean(errors**2)), float(np.mean(size**2))
    spread = description.variance(2.0 / size.size * envelopes.spline_products(at, at.now, envelope))
    # An error adds its own power to what it is an error of.
    amplitude = float(np.sqrt(max(power - 2.0 * own, own)))
    # Where the envelope is nearly gone, the phase is not asked what it does.
    turned = (after - now)[size > 0.1 * np.sqrt(power)] / (2.0 * np.pi)
    half = 0.5 * (description.blocks + 3) / base.samples
    lowest = max(base.frequency + float(turned.min()) - half, 0.0)
    highest = min(base.frequency + float(turned.max()) + half, 0.5)
    turns = np.exp(1j * envelopes.knot_values(description.phase))
    knots = envelopes.knot_values(description.coefficients) * turns
    knots.flags.writeable = errors.flags.writeable = False
    return DriftingLine(
        frequency=base.frequency + offset / (2.0 * np.pi),
        frequency_error=frequency_error,
        carrier=base.frequency,
        center=base.center,
        samples=base.samples,
        amplitude=amplitude,
        amplitude_error=float(np.sqrt(spread)) / (2.0 * amplitude),
        drift=float(np.sqrt(max(float(np.var(size)) - own, 0.0))) / amplitude,
        knots=knots,
        knot_errors=errors,
        parameters=2 * (description.blocks + 3),
        significance=description.significance,
        band=(lowest, highest),
        replaced=np.flatnonzero(~description.kept),
        # These two stay writable: kernels compile anew for arrays that are not.
        envelope=envelopes.pieces(description.coefficients),
        phase=envelopes.pieces(description.phase),
    )
