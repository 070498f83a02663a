"""The spectrum of what removal leaves: its average over bands and terms, and what else is in it."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac.analysis.corrections import WarmUp, find_warm_up, without_warm_up
from sagnac.analysis.curves import Coefficients, Points
from sagnac.analysis.parts import Parts, Reading, over_parts, reading_in_band, walk_in_band
from sagnac.core.arrays import FloatArray, differences, extent
from sagnac.core.errors import RecordingError
from sagnac.noise.bounds import Hump, RollOff, hump_above, roll_off
from sagnac.noise.estimates import Interval
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

Bands = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Cleaned:
    """Angle increments without spikes and warm-up.

    Attributes
    ----------
    increments
        (samples,) rad.
    rate
        Hz.
    spikes
        What was replaced; None if there are too few samples to tell.
    warm_up
        What was taken off; None if nothing settles.
    """

    increments: FloatArray
    rate: float
    spikes: Spikes | None = None
    warm_up: WarmUp | None = None

    @property
    def is_changed(self) -> bool:
        """Whether anything was replaced or taken off."""
        return self.warm_up is not None or (self.spikes is not None and self.spikes.index.size > 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Averaged:
    """The spectrum that an answer is read from.

    Attributes
    ----------
    cleaned
        The increments that it is of.
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

    cleaned: Cleaned
    levels: Levels
    average: Average
    coefficients: Coefficients
    masked: Bands
    confidence: float
    roll_off: RollOff
    hump: Hump | None = None
    parts: Parts | None = None

    @property
    def changes(self) -> bool:
        """Whether N over parts differs by more than chance."""
        return self.parts is not None and not self.parts.agree


def completed(found: Averaged) -> Averaged:
    """The spectrum with B and K of the lowest frequencies, N over parts, and a hump."""
    found = _with_slow_terms(found)
    return replace(found, hump=_hump(found), parts=_parts(found))


def _hump(basis: Averaged) -> Hump | None:
    """The hump above the band of an estimate."""
    walk, choice = basis.average.angle_random_walk, basis.average.rests_on
    if walk.status != "estimated" or not choice.terms:
        return None
    return hump_above(basis.levels, choice.band_hz, walk.value)


def roll_off_of(points: Points) -> RollOff:
    """Where the spectrum of some angles begins to be lowered; nowhere if there are too few."""
    levels = levels_of(differences(points.angle), points.rate, ())
    return RollOff() if levels is None else roll_off(levels)


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


def clean(points: Points) -> Cleaned:
    """Increments of some angles without spikes and without warm-up."""
    increments, rate = differences(points.angle), points.rate
    spikes = None
    if increments.size >= LEAST_FOR_SPIKES:
        spikes = find_spikes(increments, sample_rate=rate)
        if spikes.index.size:
            increments = without_spikes(increments, spikes)
    warm_up = find_warm_up(increments, sample_rate=rate)
    if warm_up is not None:
        increments = without_warm_up(increments, warm_up, sample_rate=rate)
    return Cleaned(increments=increments, rate=rate, spikes=spikes, warm_up=warm_up)


def uncleaned(points: Points) -> Cleaned:
    """Increments of some angles as they are."""
    return Cleaned(increments=differences(points.angle), rate=points.rate)


def spectrum_of(
    cleaned: Cleaned, coefficients: Coefficients, *, masked: Bands, confidence: float
) -> Averaged | None:
    """Levels of increments and their average; None if there is nothing to level.

    Parameters
    ----------
    cleaned
        Increments.
    coefficients
        The fits beside them.
    masked
        (low, high) bands to leave out, Hz.
    confidence
        Of the intervals.
    """
    levels = levels_of(cleaned.increments, cleaned.rate, masked)
    if levels is None:
        return None
    ramp = rate_ramp(
        cleaned.increments,
        sample_rate=cleaned.rate,
        masked=masked,
        settling=None if cleaned.warm_up is None else cleaned.warm_up.time,
        confidence=confidence,
    )
    return Averaged(
        cleaned=cleaned,
        levels=levels,
        average=average(levels, confidence=confidence, ramp=ramp),
        coefficients=coefficients,
        masked=masked,
        confidence=confidence,
        roll_off=roll_off(levels),
    )


def _with_slow_terms(basis: Averaged) -> Averaged:
    """B and K of an average by the likelihood of angles farther apart.

    The average of every sample sees the lowest frequencies in a few levels only, and its band ends
    below a low-pass or a hump. The angles are taken so far apart, and the top of their band is left
    out, that hardly anything above the band of the average folds into it.
    """
    walk, choice = basis.average.angle_random_walk, basis.average.rests_on
    if walk.status != "estimated" or choice.member == "whole band":
        return basis
    increments, rate = basis.cleaned.increments, basis.cleaned.rate
    wanted = max(_SLOW_RATE, _SLOW_ANGLES * rate / increments.size)
    step = math.ceil(rate / min(wanted, 0.5 * choice.band_hz[1]))
    edges = step * np.arange(increments.size // step + 1)
    sums = bin_sums(increments, edges)
    # Fitted where it is not seen, Q would take from N what a low-pass takes.
    quantization = tuple(name for name in choice.terms if name == "quantization")
    try:
        fit = likelihood_fit(
            sums,
            kind="increment",
            sample_rate=rate / step,
            confidence=basis.confidence,
            masked=basis.masked,
            band=(0.0, 0.25 * rate / step),
            terms=(*quantization, "angle_random_walk", *SLOW_NAMES),
        )
    except RecordingError:
        return basis
    if not levels_bear_out(basis.levels, fit, walk):
        return basis
    return replace(basis, average=with_slow_terms(basis.average, fit))


def reaches(choice: ModelChoice, highest: float) -> bool:
    """Whether what an average rests on describes every sample up to a frequency, Hz."""
    return choice.band_hz[1] >= _REACHED * highest


def _parts(basis: Averaged) -> Parts | None:
    """N over parts, by the band and terms that the average rests on."""
    choice, walk = basis.average.rests_on, basis.average.angle_random_walk
    if walk.status != "estimated":
        return None
    rate, confidence = basis.cleaned.rate, basis.confidence

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
        basis.cleaned.increments,
        sample_rate=rate,
        read=read,
        whole=Interval(value=walk.value, low=walk.low, high=walk.high),
        confidence=confidence,
    )
