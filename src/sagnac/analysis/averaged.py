"""The average over bands and terms of what removal leaves, and what else is in the record."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac.analysis.corrections import (
    LEAST_FOR_WARM_UP,
    WarmUp,
    find_warm_up,
    without_warm_up,
)
from sagnac.analysis.curves import Points, points_at
from sagnac.analysis.fits import Coefficients, with_likelihood_of
from sagnac.analysis.measurement import Measurement
from sagnac.analysis.parts import Parts, Reading, over_parts, reading_in_band, walk_in_band
from sagnac.analysis.removal import Remainder
from sagnac.analysis.settings import Settings
from sagnac.arrays import FloatArray, differences, extent
from sagnac.coefficients.bounds import Hump, RollOff, hump_above, roll_off
from sagnac.coefficients.estimates import Interval
from sagnac.coefficients.laws import SLOW_NAMES
from sagnac.coefficients.model_average import (
    Average,
    ModelChoice,
    average,
    with_both,
    with_slow_terms,
)
from sagnac.coefficients.ramp import rate_ramp
from sagnac.coefficients.spectrum_fit import likelihood_fit
from sagnac.coefficients.whole_band import WholeBand, levels_bear_out
from sagnac.errors import RecordingError
from sagnac.recording.model import Recording
from sagnac.recording.readout import joint_readout
from sagnac.recording.spikes import LEAST_FOR_SPIKES, Spikes, find_spikes, without_spikes
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
    """The average of one measurement.

    Attributes
    ----------
    average
        Coefficients and what they rest on.
    roll_off
        Where the spectrum begins to be lowered.
    hump
        Above the band of the answer, with less behind it.
    parts
        N over parts; None if the whole does not show it.
    cleaned
        The increments that it is of.
    levels
        Of their spectrum.
    coefficients
        The fits, by likelihood of the angles of which it is a member.
    """

    average: Average
    roll_off: RollOff
    hump: Hump | None
    parts: Parts | None
    cleaned: Cleaned
    levels: Levels
    coefficients: Coefficients


@dataclass(frozen=True, slots=True, kw_only=True)
class _Basis:
    """Increments, their levels, and the average of these."""

    cleaned: Cleaned
    levels: Levels
    average: Average


def averaged(
    recording: Recording,
    settings: Settings,
    *,
    measured: Measurement,
    gyros: tuple[str, ...],
    left: Remainder,
    coefficients: Coefficients,
) -> Averaged | None:
    """The average over bands and terms of what removal left.

    It uses every sample. If nothing dithers the readout from one sample to the next, it uses
    samples farther apart. The likelihood fit of them is a member, and is the answer if their levels
    bear it out. Else that of fewer angles is a member of the average of those, and is the answer if
    their levels bear it out, the average of every sample allows its value, and its interval is the
    narrower one. Else B and K are of a likelihood fit to the lowest frequencies if the levels bear
    it out.

    Parameters
    ----------
    recording, settings
        For the readout, and the confidence asked for.
    measured, left
        What is measured, and what removal left of it.
    gyros
        Names: one, two or three.
    coefficients
        The fits.

    Returns
    -------
    Averaged or None
        None if the search for lines did not come to an end, or too little is left.
    """
    if left.removal.unfinished is not None or coefficients.readout.every is None:
        return None
    masked = left.removal.masked
    fine = coefficients.points
    # The average leaves out the frequencies of an encoder's error that the angles of the fit do
    # not see; one that they see is slow.
    slow = coefficients.readout.every > 1
    full = fine if left.once_a_turn else _every_sample(recording, gyros, left, fine, slow)
    cleaned, confidence = clean(full), settings.confidence
    every: Coefficients | None = coefficients
    if full.rate > fine.rate:
        every = with_likelihood_of(coefficients, full, confidence=confidence, masked=masked)
    member = None if every is None or cleaned.is_changed else _whole_band(every)
    basis = basis_of(cleaned, masked, confidence, member)
    if basis is None:
        return None
    found = roll_off(basis.levels)
    if every is not None and basis.average.rests_on.member != "average":
        coefficients = every
    elif full.rate > fine.rate and not cleaned.is_changed:
        whole_band = _whole_band(coefficients)
        if whole_band is not None:
            basis = by_whole_band(basis, fine, masked, confidence, whole_band)
    basis = _with_slow_terms(basis, masked, confidence)
    return Averaged(
        average=basis.average,
        roll_off=found,
        hump=_hump(basis),
        parts=_parts(basis, masked, confidence),
        cleaned=basis.cleaned,
        levels=basis.levels,
        coefficients=coefficients,
    )


def _hump(basis: _Basis) -> Hump | None:
    """The hump above the band of an estimate."""
    walk, choice = basis.average.angle_random_walk, basis.average.rests_on
    if walk.status != "estimated" or not choice.terms:
        return None
    return hump_above(basis.levels, choice.band_hz, walk.value)


def roll_off_of(points: Points, masked: Bands) -> RollOff:
    """Where the spectrum of some angles begins to be lowered; nowhere if there are too few."""
    levels = levels_of(differences(points.angle), points.rate, masked)
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
    spikes = warm_up = None
    if increments.size >= LEAST_FOR_SPIKES:
        spikes = find_spikes(increments, sample_rate=rate)
        if spikes.index.size:
            increments = without_spikes(increments, spikes)
    if increments.size >= LEAST_FOR_WARM_UP:
        warm_up = find_warm_up(increments, sample_rate=rate)
        if warm_up is not None:
            increments = without_warm_up(increments, warm_up, sample_rate=rate)
    return Cleaned(increments=increments, rate=rate, spikes=spikes, warm_up=warm_up)


def _every_sample(
    recording: Recording, gyros: tuple[str, ...], left: Remainder, fine: Points, slow: bool
) -> Points:
    """Angles as often as the readout is dithered, at least as often as those of the fit.

    The encoder's steps count if they are `slow`: not dithered between the angles of the fit.
    """
    readout = joint_readout(recording, gyros, left.rate, with_encoder=slow)
    if readout.every is None or left.rate / readout.every <= fine.rate:
        return fine
    return points_at(left.removal.residual, left.rate, readout.every / left.rate)


def _whole_band(coefficients: Coefficients) -> WholeBand | None:
    """The likelihood fit of what was measured, if it used the whole band."""
    fit = coefficients.fits["likelihood"]
    if fit.band is None or not fit.band.is_whole:
        return None
    return WholeBand(
        coefficients=fit.coefficients,
        band_hz=(fit.band.low, fit.band.high),
        describes=fit.departure == 0.0,
    )


def basis_of(
    cleaned: Cleaned, masked: Bands, confidence: float, member: WholeBand | None
) -> _Basis | None:
    """Levels of increments and their average; None if there is nothing to level."""
    levels = levels_of(cleaned.increments, cleaned.rate, masked)
    if levels is None:
        return None
    result = average(
        levels,
        confidence=confidence,
        ramp=rate_ramp(
            cleaned.increments,
            sample_rate=cleaned.rate,
            masked=masked,
            settling=None if cleaned.warm_up is None else cleaned.warm_up.time,
            confidence=confidence,
        ),
        whole_band=member,
    )
    return _Basis(cleaned=cleaned, levels=levels, average=result)


def by_whole_band(
    basis: _Basis, fine: Points, masked: Bands, confidence: float, whole_band: WholeBand
) -> _Basis:
    """Basis with a fit of fewer angles beside the average of every sample.

    If their levels bear it out and its interval is narrower, it is the answer. If they neither
    bear it out nor reject it, and it is narrower, the interval holds both. Of fewer angles what
    lies above half their rate folds into the band: if the terms do not describe every sample up to
    there, they do not describe what folds.
    """
    walk, fit = basis.average.angle_random_walk, whole_band.angle_random_walk
    if not reaches(basis.average.rests_on, 0.5 * fine.rate):
        return basis
    if walk.status != "not observable" and not walk.low <= fit.value <= walk.high:
        return basis
    few = Cleaned(increments=differences(fine.angle), rate=fine.rate)
    other = basis_of(few, masked, confidence, whole_band)
    if other is None or other.average.rests_on.member == "average":
        return basis
    borne_out = other.average.rests_on.member == "whole band"
    if walk.status != "estimated":
        return other if borne_out else basis
    if walk.high * fit.low <= fit.high * walk.low:
        # Every sample tells more of N.
        return basis
    return other if borne_out else replace(basis, average=with_both(basis.average, whole_band))


def _with_slow_terms(basis: _Basis, masked: Bands, confidence: float) -> _Basis:
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
            confidence=confidence,
            masked=masked,
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


def _parts(basis: _Basis, masked: Bands, confidence: float) -> Parts | None:
    """N over parts, by the band and terms that the average rests on."""
    choice, walk = basis.average.rests_on, basis.average.angle_random_walk
    if walk.status != "estimated":
        return None
    rate = basis.cleaned.rate

    def read(increments: FloatArray) -> Reading | None:
        levels = levels_of(increments, rate, masked)
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
