"""The spectrum of what removal leaves: its average over bands and terms, and what else is in it."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac.analysis.corrections import WarmUp, find_warm_up, without_warm_up
from sagnac.analysis.evidence import Bands, Coefficients, Points
from sagnac.analysis.parts import Parts, Reading, over_parts, reading_in_band, walk_in_band
from sagnac.core.arrays import FloatArray, differences, extent
from sagnac.core.errors import Note, RecordingError
from sagnac.noise.bounds import Hump, RollOff, hump_above, roll_off
from sagnac.noise.estimates import Estimate, Interval
from sagnac.noise.fit import likelihood_fit
from sagnac.noise.laws import SLOW_NAMES
from sagnac.noise.model_average import Average, ModelChoice, average
from sagnac.noise.ramp import rate_ramp
from sagnac.noise.whole_band import levels_bear_out, with_slow_terms
from sagnac.quality.spikes import LEAST_FOR_SPIKES, Spikes, find_spikes, without_spikes
from sagnac.spectrum.levels import Levels, robust_levels
from sagnac.spectrum.periodogram import bin_sums
from sagnac.spectrum.tapered import LEAST_SAMPLES, tapered_spectrum

# Fewest bins that say anything of a band.
_LEAST_BINS: Final = 4
# Part of the band of fewer angles up to which the terms have to describe every sample: a bin less.
_REACHED: Final = 0.79
# Angles a second of which slow terms are read, and how many make a spectrum of a short record.
_SLOW_RATE: Final = 10.0
_SLOW_ANGLES: Final = 2048.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Averaged:
    """The spectrum that an answer is read from.

    Attributes
    ----------
    points
        The angles that it is of.
    increments
        Their increments, rad, without spikes and warm-up.
    spikes
        What was replaced; None if there are too few samples to tell.
    warm_up
        What was taken off; None if nothing settles.
    levels
        Of their spectrum.
    average
        Coefficients and what they rest on.
    coefficients
        The fits that stand beside the average.
    masked
        (low, high) bands that are left out, Hz.
    confidence
        Of the intervals.
    roll_off
        Where the spectrum of every sample begins to be lowered.
    hump
        Above the band of the answer, with less behind it.
    parts
        N over parts; None if the whole does not show it.
    """

    points: Points
    increments: FloatArray
    spikes: Spikes | None
    warm_up: WarmUp | None
    levels: Levels
    average: Average
    coefficients: Coefficients
    masked: Bands
    confidence: float
    roll_off: RollOff
    hump: Hump | None = None
    parts: Parts | None = None

    @property
    def is_changed(self) -> bool:
        """Whether a spike was replaced or a warm-up taken off."""
        return self.warm_up is not None or (self.spikes is not None and self.spikes.index.size > 0)

    @property
    def changes(self) -> bool:
        """Whether N over parts differs by more than chance."""
        return self.parts is not None and not self.parts.agree


@dataclass(frozen=True, slots=True, kw_only=True)
class Headline:
    """The answer.

    Attributes
    ----------
    estimate
        Angle random walk of one gyro, rad/sqrt(s).
    source
        What it rests on, in words.
    notes
        Why it is no more than a bound.
    found
        The spectrum that was read for it; None if none was.
    by_encoder
        Whether what is left of one gyro is the encoder's rather than its own.
    findings
        What was noticed beside the noise.
    """

    estimate: Estimate
    source: str
    notes: tuple[Note, ...] = ()
    found: Averaged | None = None
    by_encoder: bool = False
    findings: tuple[Note, ...] = ()


def levels_of(increments: FloatArray, rate: float, masked: Bands) -> Levels | None:
    """Robust levels of increments (rad) at a rate (Hz); None if there is nothing to level."""
    if increments.size < LEAST_SAMPLES or not np.any(np.diff(extent(increments))):
        return None
    try:
        levels = robust_levels(tapered_spectrum(increments, sample_rate=rate), masked=masked)
    except ValueError:
        # Masked bands that leave no cell.
        return None
    return levels if levels.level.size >= _LEAST_BINS else None


def roll_off_of(points: Points) -> RollOff:
    """Where the spectrum of some angles begins to be lowered; nowhere if there are too few."""
    levels = levels_of(differences(points.angle), points.rate, ())
    return RollOff() if levels is None else roll_off(levels)


def spectrum_of(
    points: Points,
    coefficients: Coefficients,
    *,
    masked: Bands,
    confidence: float,
    as_they_are: bool = False,
) -> Averaged | None:
    """Levels of the increments of angles and their average; None if there is nothing to level.

    Parameters
    ----------
    points
        Angles.
    coefficients
        The fits beside them.
    masked
        (low, high) bands to leave out, Hz.
    confidence
        Of the intervals.
    as_they_are
        Whether spikes and a warm-up stay in.
    """
    increments, rate = differences(points.angle), points.rate
    spikes = warm_up = None
    if not as_they_are:
        if increments.size >= LEAST_FOR_SPIKES:
            spikes = find_spikes(increments, sample_rate=rate)
            if spikes.index.size:
                increments = without_spikes(increments, spikes)
        warm_up = find_warm_up(increments, sample_rate=rate)
        if warm_up is not None:
            increments = without_warm_up(increments, warm_up, sample_rate=rate)
    levels = levels_of(increments, rate, masked)
    if levels is None:
        return None
    ramp = rate_ramp(
        increments,
        sample_rate=rate,
        masked=masked,
        settling=None if warm_up is None else warm_up.time,
        confidence=confidence,
    )
    return Averaged(
        points=points,
        increments=increments,
        spikes=spikes,
        warm_up=warm_up,
        levels=levels,
        average=average(levels, confidence=confidence, ramp=ramp),
        coefficients=coefficients,
        masked=masked,
        confidence=confidence,
        roll_off=roll_off(levels),
    )


def completed(found: Averaged) -> Averaged:
    """The spectrum with B and K of the lowest frequencies, N over parts, and a hump."""
    walk, choice = found.average.angle_random_walk, found.average.rests_on
    if walk.status != "estimated":
        return found
    if choice.member != "whole band":
        found = replace(found, average=_with_slow_terms(found))
        walk, choice = found.average.angle_random_walk, found.average.rests_on
    hump = hump_above(found.levels, choice.band_hz, walk.value) if choice.terms else None
    return replace(found, hump=hump, parts=_parts(found))


def _with_slow_terms(basis: Averaged) -> Average:
    """B and K of an average by the likelihood of angles farther apart.

    The average of every sample sees the lowest frequencies in a few levels only, and its band ends
    below a low-pass or a hump. The angles are taken so far apart, and the top of their band is left
    out, that hardly anything above the band of the average folds into it.
    """
    choice, increments, rate = basis.average.rests_on, basis.increments, basis.points.rate
    wanted = max(_SLOW_RATE, _SLOW_ANGLES * rate / increments.size)
    step = math.ceil(rate / min(wanted, 0.5 * choice.band_hz[1]))
    # Fitted where it is not seen, Q would take from N what a low-pass takes.
    quantization = tuple(name for name in choice.terms if name == "quantization")
    try:
        fit = likelihood_fit(
            bin_sums(increments, step * np.arange(increments.size // step + 1)),
            kind="increment",
            sample_rate=rate / step,
            confidence=basis.confidence,
            masked=basis.masked,
            band=(0.0, 0.25 * rate / step),
            terms=(*quantization, "angle_random_walk", *SLOW_NAMES),
        )
    except RecordingError:
        return basis.average
    if not levels_bear_out(basis.levels, fit, basis.average.angle_random_walk):
        return basis.average
    return with_slow_terms(basis.average, fit)


def reaches(choice: ModelChoice, highest: float) -> bool:
    """Whether what an average rests on describes every sample up to a frequency, Hz."""
    return choice.band_hz[1] >= _REACHED * highest


def _parts(basis: Averaged) -> Parts:
    """N over parts, by the band and terms that the average rests on."""
    choice, walk = basis.average.rests_on, basis.average.angle_random_walk
    rate, confidence = basis.points.rate, basis.confidence

    def read(increments: FloatArray) -> Reading | None:
        levels = levels_of(increments, rate, basis.masked)
        if levels is None:
            return None
        # A part does not reach as low as the whole: if the whole read over the frequencies of the
        # part gives another N, the part does not show it.
        band = (max(choice.band_hz[0], float(levels.low[0])), choice.band_hz[1])
        seen = walk_in_band(basis.levels, replace(choice, band_hz=band), confidence)
        if seen is None or not walk.low <= seen.value <= walk.high:
            return None
        return reading_in_band(levels, choice, confidence)

    return over_parts(
        basis.increments,
        sample_rate=rate,
        read=read,
        whole=Interval(value=walk.value, low=walk.low, high=walk.high),
        confidence=confidence,
    )
