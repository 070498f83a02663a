"""Q, N, B, K and R by maximum likelihood from a spectrum, and one way in to this and other fits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import chdtrc

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import Note, refusal, require_choice, require_confidence, rounded
from sagnac.core.kernels import one_thread
from sagnac.noise import cosine_spectrum
from sagnac.noise.cosine_spectrum import Band, Bands, CosineSpectrum
from sagnac.noise.curve_fit import paper_fit, weighted_fit
from sagnac.noise.estimates import USUAL_CONFIDENCE, Estimate, Fit, FitBand, FitName, unobserved
from sagnac.noise.laws import COEFFICIENT_NAMES, SLOW_NAMES, STOCHASTIC_NAMES, CoefficientName
from sagnac.noise.likelihood import Ordinates, scaled_covariance
from sagnac.noise.lowest_ordinates import ramp_estimate
from sagnac.noise.slow_laws import SlowLaw, SlowLaws, corners_beside, laws_to_try
from sagnac.recording.model import Kind
from sagnac.stability.curve import StabilityCurve


def likelihood_fit(
    values: ArrayLike,
    *,
    kind: Kind,
    sample_rate: float,
    confidence: float = 0.95,
    masked: Bands = (),
    band: Band | None = None,
    terms: Sequence[CoefficientName] = COEFFICIENT_NAMES,
) -> Fit:
    """Fit Q, N, B, K, R to the spectrum by likelihood.

    The spectrum is the squared cosine transform (DCT-II) of the angle increments, one
    degree of freedom at every k / (2 samples interval) Hz. In that basis white rate and
    rate random walk are exactly uncorrelated at every length, and the expected square of
    each term is that of the finite record (`sagnac.noise.laws.cosine_power_basis`), so that
    there is no window and no bias of a window. The rate ramp is a straight line in the
    increments. For the other terms it is taken off by least squares, and what that takes of
    each term is taken off its expected squares; its own interval is that of a line in any noise
    of the terms that the lowest ordinates allow (`sagnac.noise.lowest_ordinates`).

    Squared coefficients may come out negative inside the fit: holding them at zero would
    push what they share with N into N (a third of a standard error for white noise).
    What is reported is never negative and never zero. Intervals are of the profile
    likelihood. ``estimated``: without the term twice the log likelihood falls by more
    than 9 (three standard deviations) and the interval excludes zero. ``upper bound``:
    the one-sided limit at `confidence`. ``not observable``: at that limit the
    term alone would lie above the fitted spectrum in half of the bins or more.

    Bins that stand out above the terms by half or more and by more than chance (one in
    ten million) are left out, and said so: a line that is left, or a resonance. If the
    rest departs from the terms by more than chance, the common relative departure of the
    bins is estimated and enters the weights and intervals.

    Parameters
    ----------
    values
        (samples,), rad for ``angle`` and ``increment``, rad/s for ``rate``.
    kind
        What one sample is.
    sample_rate
        Samples per second.
    confidence
        Of every interval and bound.
    masked
        Frequency bands (low, high) in Hz to leave out, for lines that were removed; each
        is widened by one resolution cell, 1/duration, on either side.
    band
        Lowest and highest frequency used, Hz; all by default.
    terms
        The terms to fit; the others are taken to be absent and come back as
        ``not observable``.

    Returns
    -------
    Fit
        With all five names.

    Raises
    ------
    RecordingError
        If a sample is not finite, the values do not vary, or too few frequencies are left.
    ValueError
        If an argument makes no sense.
    """
    how: dict[str, Any] = {"kind": kind, "sample_rate": sample_rate, "terms": terms}
    cosine = cosine_spectrum.cosine_spectrum(values, **how)
    return spectrum_fit(cosine, confidence=confidence, masked=masked, bands=(band,))


def spectrum_fit(
    cosine: CosineSpectrum, *, confidence: float, masked: Bands, bands: Sequence[Band | None]
) -> Fit:
    """`likelihood_fit` of what is transformed already, over the first band that the terms describe.

    Parameters
    ----------
    cosine
        Of the values.
    confidence, masked
        As in `likelihood_fit`.
    bands
        Each as in `likelihood_fit`, in the order of preference. If the spectrum departs from the
        terms in every one, that with the least departure is taken.

    Raises
    ------
    RecordingError
        If the values do not vary, or too few frequencies are left.
    ValueError
        If an argument makes no sense.
    """
    require_confidence(confidence)
    trials: list[_Trial] = []
    for band in bands:
        bins = cosine_spectrum.cosine_bins(cosine.transform.size, cosine.interval, masked, band)
        spectrum = cosine_spectrum.ordinates(cosine, bins)
        trials.append(_Trial(with_departure(spectrum), spectrum, bins, band))
        if trials[-1].weighed.departure == 0.0:
            break
    first, least = trials[0], min(trials, key=lambda trial: trial.weighed.departure)
    fitted = partial(_fit_of, cosine=cosine, masked=masked, confidence=confidence)
    # Of one band alone: intervals take longer than all the rest.
    fit = fitted(least)
    departs = first.weighed.departure > 0.0 and fit.slow is not None
    if departs and _is_another_law(first.spectrum, cosine.interval):
        fit = replace(fit, of_other_law=fitted(first._replace(weighed=first.spectrum)))
    return fit


class _Trial(NamedTuple):
    """A band of a spectrum: with weights that allow for a departure, and as it is."""

    weighed: Ordinates
    spectrum: Ordinates
    bins: cosine_spectrum.SpectrumBins
    band: Band | None


def _fit_of(trial: _Trial, *, cosine: CosineSpectrum, masked: Bands, confidence: float) -> Fit:
    """The fit of a band, with its weights, and with other laws if B or K is there."""
    weighed, (low, high) = trial.weighed, trial.band or (0.0, 0.5 / cosine.interval)
    every = usual = _estimates(weighed, cosine.names, confidence)
    if confidence != USUAL_CONFIDENCE:
        usual = _estimates(weighed, cosine.names, USUAL_CONFIDENCE)
    # Other laws are asked for if all four terms were fitted, and B or K is there.
    is_slow = any(usual[name].status == "estimated" for name in SLOW_NAMES[:2])
    is_slow &= cosine.names == STOCHASTIC_NAMES
    if "rate_ramp" in cosine.terms and cosine.names:
        lowest = trial.bins.starts[trial.bins.count == 1.0]
        every = {**every, "rate_ramp": ramp_estimate(cosine, lowest, confidence)}
    left_out = tuple((float(one[0]), float(one[1])) for one in masked)
    return Fit(
        method="likelihood",
        coefficients=every,
        notes=weighed.notes,
        departure=weighed.departure,
        band=FitBand(low=low, high=high, interval=cosine.interval, masked=left_out),
        squares=dict(zip(cosine.names, weighed.best.squares.tolist(), strict=True)),
        slow=_slow_laws(weighed, cosine.interval) if is_slow else None,
    )


def _estimates(
    weighed: Ordinates, names: Sequence[CoefficientName], confidence: float
) -> dict[CoefficientName, Estimate]:
    """All five by name; those that are not fitted are not observable."""
    every = {name: unobserved(name, confidence) for name in COEFFICIENT_NAMES}
    for column, name in enumerate(names):
        every[name] = weighed.estimate(weighed.best, column, name, confidence)
    return every


def _by_law(spectrum: Ordinates, interval: float) -> dict[SlowLaw, tuple[float, Ordinates]]:
    """The chance of each law of slow noise, and a spectrum with the terms of that law."""

    def of(laws: dict[SlowLaw, float]) -> dict[SlowLaw, tuple[float, Ordinates]]:
        basis, frequency = spectrum.basis, spectrum.frequency
        return {
            law: (chance, replace(spectrum, basis=basis * law.shares(frequency)))
            for law, chance in laws.items()
        }

    tried = of(laws_to_try(spectrum.frequency, interval))
    best = min(tried, key=lambda law: tried[law][1].best.deviance)
    return tried | of(corners_beside(best, tried[best][0]))


def _is_another_law(spectrum: Ordinates, interval: float) -> bool:
    """Whether a spectrum that departs from the terms does not depart from another law."""
    tried = (data for _, data in _by_law(spectrum, interval).values())
    best = min(tried, key=lambda one: one.best.deviance)
    return _weighed(best, best.best.squares).departure == 0.0


def _slow_laws(spectrum: Ordinates, interval: float) -> SlowLaws:
    """What other laws of slow noise make of a spectrum."""
    tried, fits = _by_law(spectrum, interval), []
    for chance, data in tried.values():
        scale, covariance = scaled_covariance(data.fisher(data.best))
        # No error is less than it would be if the others were known.
        errors = scale * np.sqrt(np.maximum(covariance.diagonal(), 1.0))
        fits.append((chance, data.best.squares, errors, data.best.deviance))
    prior, squares, errors, deviance = (np.array(each) for each in zip(*fits, strict=True))
    laws = tuple(tried)
    return SlowLaws(laws=laws, prior=prior, squares=squares, errors=errors, deviance=deviance)


def fit_coefficients(
    curve_or_values: StabilityCurve | ArrayLike,
    *,
    method: FitName = "likelihood",
    kind: Kind | None = None,
    sample_rate: float | None = None,
    confidence: float = 0.95,
) -> Fit:
    """Q, N, B, K and R of one gyro, each with an interval and a status.

    Of two gyros give ``(x - z) / sqrt(2)``, or the curve of that: the coefficients are then per
    gyro.

    Parameters
    ----------
    curve_or_values
        For ``weighted`` and ``paper`` a `StabilityCurve` of an Allan deviation in rad/s. For
        ``likelihood`` (samples,), rad for ``angle`` and ``increment``, rad/s for ``rate``.
    method
        ``likelihood``: by the spectrum of the samples (`likelihood_fit`). ``weighted``: by
        generalized least squares on the curve (`weighted_fit`). ``paper``: by the paper's least
        squares on Eq. 3 (`paper_fit`).
    kind, sample_rate
        What one sample is, and samples per second; a curve knows both.
    confidence
        Of every interval and bound.

    Returns
    -------
    Fit
        With all five names.

    Raises
    ------
    RecordingError
        If the data cannot be fitted: a sample that is not finite, too few points.
    ValueError
        If the method does not take what is given, or an argument makes no sense.

    Examples
    --------
    >>> import numpy as np
    >>> from sagnac.noise.fit import fit_coefficients
    >>> from sagnac.stability.curve import stability_curve
    >>> rate = 1e-6 * np.random.default_rng(3).standard_normal(5000)  # rad/s, at 1 Hz
    >>> fit = fit_coefficients(rate, kind="rate", sample_rate=1.0)
    >>> walk = fit.coefficients["angle_random_walk"]
    >>> walk.status, bool(walk.low < 1e-6 < walk.high)
    ('estimated', True)
    >>> curve = stability_curve(rate, kind="rate", sample_rate=1.0)
    >>> by_curve = fit_coefficients(curve, method="weighted").coefficients["angle_random_walk"]
    >>> round(by_curve.to("deg/h/sqrt(Hz)").value, 1)
    0.2
    """
    require_choice("method", method, FitName)
    if not isinstance(curve_or_values, StabilityCurve):
        if method != "likelihood":
            problem = f"method {method!r} fits a StabilityCurve and was given samples"
            remedy = "give stability_curve(...) of them, or method 'likelihood'"
            raise ValueError(f"{problem}; {remedy}")
        if kind is None or sample_rate is None:
            missing = "kind" if kind is None else "sample_rate"
            raise refusal(missing, "is missing; samples take kind and sample_rate")
        values, rate = curve_or_values, sample_rate
        with one_thread():
            return likelihood_fit(values, kind=kind, sample_rate=rate, confidence=confidence)
    if method == "likelihood":
        problem = "method 'likelihood' fits the spectrum of samples and was given a StabilityCurve"
        remedy = "give the samples with their kind and sample_rate, or method 'weighted' or 'paper'"
        raise ValueError(f"{problem}; {remedy}")
    if kind is not None or sample_rate is not None:
        raise ValueError("kind and sample_rate are those of the curve; leave them out")
    fit = weighted_fit if method == "weighted" else paper_fit
    with one_thread():
        return fit(curve_or_values, confidence=confidence)


# ---- departure from the terms ------------------------------------------------------------


def with_departure(spectrum: Ordinates) -> Ordinates:
    """`spectrum` with weights that allow for what the terms do not describe.

    Bins that stand far above the terms (a line left, a resonance) weigh nothing; for the
    rest a common relative departure is estimated if it is significant.
    """
    if np.count_nonzero(spectrum.count >= 8.0) < 3 * cosine_spectrum.LEAST_BINS:
        return spectrum
    weighed = _weighed(spectrum, spectrum.best.squares)
    standing = np.zeros(spectrum.power.size, dtype=np.bool_)
    while weighed.departure > 0.0:
        ratio = spectrum.power / weighed.best.law
        # Half as much again as the terms, and not by chance, is something else. Less is taken for a
        # departure of the terms.
        more = (chdtrc(spectrum.count, spectrum.count * ratio) < 1e-7) & (ratio > 1.5) & ~standing
        if not more.any() or np.count_nonzero(standing | more) > 0.5 * standing.size:
            break
        standing |= more
        rest = replace(spectrum, weight=np.where(standing, 0.0, spectrum.weight))
        weighed = _weighed(rest, spectrum.best.squares)
    texts = []
    if standing.any():
        frequency = spectrum.frequency[standing]
        span = f"from {frequency[0]:.4g} to {frequency[-1]:.4g} Hz"
        bins = f"{frequency.size} of {standing.size} bins of the spectrum, {span}, stand far above"
        why = "the fitted terms (a line or a resonance is left)"
        texts.append(f"{bins} {why} and are left out of the likelihood fit")
    if weighed.departure > 0.0:
        ratio = spectrum.power / weighed.best.law
        worst = int(np.argmax(weighed.weight * (ratio - 1.0) ** 2))
        share = f"by {rounded(100.0 * weighed.departure)} % of the power in a bin"
        most = f"most at {spectrum.frequency[worst]:.4g} Hz (x {ratio[worst]:.3g})"
        departs = f"the spectrum departs from the fitted terms {share}, {most}"
        texts.append(f"{departs}; the likelihood intervals allow for it")
    if not texts:
        return weighed
    notes = tuple(Note(level="warning", text=text) for text in texts)
    return replace(weighed, departure=weighed.departure + float(standing.any()), notes=notes)


def _weighed(spectrum: Ordinates, start: FloatArray) -> Ordinates:
    """Weights with the relative departure of the bins that explains their scatter, if any does.

    The squares are searched for from `start` on.
    """
    used = (spectrum.count >= 8.0) & (spectrum.weight > 0.0)
    freedom = max(1, int(np.count_nonzero(used)) - spectrum.terms)
    trial = spectrum

    def misfit(departure: float) -> float:
        """Chi-square over its degrees of freedom with the weights of a departure."""
        nonlocal start, trial
        allowed = 1.0 / (1.0 / spectrum.count + 0.5 * departure**2)
        weight = np.where(spectrum.weight > 0.0, allowed, 0.0)
        trial = replace(spectrum, weight=weight, departure=departure)
        best = trial.maximum(start)
        start = best.squares
        ratio = spectrum.power / best.law - 1.0
        return 0.5 * float(weight[used] @ ratio[used] ** 2) / freedom

    # Asked twice at the ends, and the way there may lead to another maximum.
    @cache
    def excess(logarithm: float) -> float:
        # In proportion to 1 / departure^2 far out: almost a line, on which brentq is at home.
        return math.log(max(misfit(math.exp(logarithm)), 1e-9))

    chance = 5.0 * math.sqrt(np.sum(2.0 + 12.0 / spectrum.count[used]))
    if (misfit(0.0) - 1.0) * freedom < chance:
        return trial
    least, most = math.log(1e-4), math.log(10.0)
    departure = 10.0
    if excess(most) < 0.0:
        begun = excess(least) > 0.0
        departure = math.exp(brentq(excess, least, most, xtol=1e-3)) if begun else 1e-4
    misfit(departure)
    return trial
