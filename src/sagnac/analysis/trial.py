"""N at once with some lines put back and some bands masked, from the levels of an analysis.

A line that is put back adds what the tapers make of a sinusoid to the spectrum, and what a sinusoid
has to the curve, on average over its phase: no sample is looked at again.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import NoneType

import numpy as np

from sagnac.analysis.result import Analysis, require_analysis
from sagnac.analysis.spectra import Spectrum
from sagnac.core.errors import RecordingError, as_several, is_band, quoted, refusal, require_type
from sagnac.lines.model import Line
from sagnac.noise.estimates import Estimate
from sagnac.noise.model_average import average
from sagnac.recording.channel import PAIR_SIZE
from sagnac.spectrum.levels import robust_levels
from sagnac.spectrum.tapered import TaperedSpectrum, line_density
from sagnac.stability.curve import StabilityCurve

Bands = tuple[tuple[float, float], ...]
Lines = Sequence[tuple[float, float]]
"""Frequency, Hz, and amplitude, rad, of lines that are put back."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """Answer of an analysis with some lines put back and some bands masked.

    Attributes
    ----------
    angle_random_walk
        Of one gyro, by the average over bands and terms of the levels.
    before
        The same with nothing put back and nothing masked: what it is to be compared with.
    curve, spectrum
        With the lines that are put back; of the channel, as those of the analysis.

    Examples
    --------
    >>> import numpy as np, sagnac
    >>> rate = np.random.default_rng(1).standard_normal(4000)
    >>> still = sagnac.Recording.from_arrays(x=rate, kind="rate", unit="deg/h", sample_rate=10.0)
    >>> sagnac.trial(sagnac.analyze(still), masked=[(4.0, 5.0)]).angle_random_walk.status
    'estimated'
    """

    angle_random_walk: Estimate
    before: Estimate
    curve: StabilityCurve
    spectrum: Spectrum


@np.errstate(under="ignore")
def trial(
    analysis: Analysis,
    *,
    left_in: Sequence[Line] = (),
    masked: Sequence[tuple[float, float]] = (),
    before: Estimate | None = None,
) -> Trial:
    """N with some lines put back and some bands masked, without looking at the samples again.

    Parameters
    ----------
    analysis
        Of one gyro or of a difference; of several gyros at rest one of `Analysis.gyros`.
    left_in
        Some of its lines.
    masked
        (low, high) bands to leave out besides those of the lines, Hz.
    before
        `Trial.before` of an earlier trial of this analysis, which takes half of the time.

    Raises
    ------
    RecordingError
        If the analysis rests on no levels of a spectrum, or too few are left.
    TypeError
        If `before` is no estimate.
    ValueError
        If a line is none of the analysis, a band ends before it begins, or the analysis was read
        from a file.

    Examples
    --------
    A gyro with a line at 2 Hz; with it the Allan deviation is higher, and N is about the same:

    >>> import numpy as np
    >>> from sagnac import Recording, analyze, trial
    >>> rate = 1e-6 * np.random.default_rng(1).standard_normal(6000)
    >>> rate += 1e-6 * np.cos(2.0 * np.pi * 2.0 * np.arange(6000) / 10.0)
    >>> recording = Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=10.0)
    >>> analysis = analyze(recording)
    >>> tried = trial(analysis, left_in=analysis.lines, masked=[(3.0, 4.0)])
    >>> bool((tried.curve.deviation > analysis.curve.deviation).any())
    True
    >>> 0.9 < tried.angle_random_walk.value / tried.before.value < 1.1
    True
    """
    require_analysis(analysis, recorded=True)
    levels = analysis.levels
    if levels is None:
        problem = "the answer rests on no levels of a spectrum, so that nothing can be put back"
        remedy = "analyze by {method fos} or {method none} what a readout step does not hide"
        raise RecordingError(problem, channel=analysis.channel, remedy=remedy)
    own = [line for line in analysis.lines if line.channel == analysis.channel]
    left_in, masked = as_several(left_in), as_several(masked)
    require_type("before", before, (Estimate, NoneType), "give the before of an earlier trial")
    if not all(any(line is one for one in own) for line in left_in):
        raise refusal("left_in", f"has a line that is none of {analysis.channel}")
    if not all(map(is_band, masked)):
        raise refusal("masked", f"is {quoted(masked)}; give bands (low, high), Hz")
    # Amplitudes in what the spectra are of: per gyro, rad.
    size = PAIR_SIZE if analysis.is_pair else 1.0
    turning = abs(analysis.table_rate or 0.0) / (2.0 * math.pi)
    put_back = [(line.hertz(turning), line.amplitude / size) for line in left_in]
    taken = [line.hertz(turning) for line in own if not any(line is one for one in left_in)]
    bands = tuple(
        (low, high)
        for low, high in analysis.masked
        if any(low <= hertz <= high for hertz in taken)
        or not any(low <= hertz <= high for hertz, _ in put_back)
    )
    more = tuple((float(low), float(high)) for low, high in masked)
    cells = levels.spectrum.cells
    density = cells.density + sum(line_density(levels.spectrum, *line) for line in put_back)
    with_lines = replace(levels.spectrum, cells=replace(cells, density=density))
    walk = _walk(analysis, with_lines, bands + more)
    before = before or _walk(analysis, levels.spectrum, analysis.masked)
    curve, spectrum = _curve(analysis.curve, put_back), _spectrum(analysis.spectrum, put_back)
    return Trial(angle_random_walk=walk, before=before, curve=curve, spectrum=spectrum)


def _walk(analysis: Analysis, spectrum: TaperedSpectrum, bands: Bands) -> Estimate:
    try:
        levels = robust_levels(spectrum, masked=bands)
    except ValueError as error:
        raise RecordingError(str(error), channel=analysis.channel) from None
    walk = average(levels, confidence=analysis.settings.confidence).angle_random_walk
    return replace(walk, sensor=analysis.sensor)


def _curve(curve: StabilityCurve, lines: Lines) -> StabilityCurve:
    """The curve with the Allan variance of each line, ``4 A^2 sin^4(pi f tau) / tau^2``."""
    hertz, amplitude = np.reshape(lines, (-1, 2)).T
    tau = curve.tau[:, np.newaxis]
    more = (2.0 * amplitude * np.sin(np.pi * hertz * tau) ** 2 / tau) ** 2
    higher = np.sqrt(1.0 + more.sum(axis=1) / curve.deviation**2)
    raised = {name: getattr(curve, name) * higher for name in ("deviation", "low", "high")}
    return replace(curve, **raised)


def _spectrum(spectrum: Spectrum, lines: Lines) -> Spectrum:
    """The spectrum with the power of each line in the bin that it falls into."""
    frequency, density = spectrum.frequency, spectrum.density.copy()
    if frequency.size > 1:
        width = np.gradient(frequency)
        for hertz, amplitude in lines:
            place = int(np.argmin(np.abs(frequency - hertz)))
            density[place] += 2.0 * (np.pi * hertz * amplitude) ** 2 / width[place]
    return Spectrum(frequency=frequency.copy(), density=density)
