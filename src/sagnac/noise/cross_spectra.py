"""Cross spectra of gyros that turn together: what each makes alone, and what they share.

*Alone.* What all share is motion: the cross spectra of n gyros about one axis are
``P = g g* S + diag(N)``, a motion S that each senses by its own gain g (its misalignment in it),
and the noise N of each alone. Three gyros solve for it (R. Sleeman, A. van Wettum and J. Trampert,
Bull. Seismol. Soc. Am. 96, 258, 2006: ``N_1 = P_11 - P_21 P_13 / P_23``); of more, the maximum of
the Wishart likelihood is the weighted least-squares form. Gyros about several axes, as three triads
side by side, share as many motions as they have axes, and a misalignment mixes these:
``P = G S G* + diag(N)``.

With N given, the likelihood is highest with the largest eigenvectors of ``N^-1/2 P N^-1/2`` for the
motion (D. N. Lawley and A. E. Maxwell, Factor Analysis as a Statistical Method, 1971), so that N
alone is searched for, by scoring: with the other eigenvalues l and vectors u, and their projector
F, the gradient is ``sum_k |u_ik|^2 (1 - l_k)`` and the information on ln N ``M |F_ij|^2``. Each
motion takes one of the M degrees of freedom, which N is given back.

*Shared.* Two gyros with a common part (drive, temperature, table) read low when differenced: it
cancels. The real part of their cross spectrum over the band of N is the common part, with the sign
that the difference sees. What gyros show beyond the motion of their table holds their own noise,
what they share, and the error of the encoder that said how the table moves. The error of a readout
is white noise of the angle: its cross spectrum rises as f^2. What gyros warm up by falls as f^-2.
An angle random walk that gyros share is level between. So the three are fitted to the cross
spectra.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.fft import prev_fast_len, rfft
from scipy.special import chdtri, ndtri, stdtrit

from sagnac.core import errors
from sagnac.core.arrays import ComplexArray, FloatArray, IntegerArray
from sagnac.core.errors import RecordingError, quoted, refusal
from sagnac.noise.estimates import Estimate, rooted
from sagnac.noise.laws import rate_density_basis
from sagnac.noise.likelihood import PRESENCE
from sagnac.noise.slow_laws import QUANTIZATION, RATE_WALK, WALK
from sagnac.recording.channel import Compared, angle_increments
from sagnac.recording.model import Recording, require_recording
from sagnac.spectrum.periodogram import CELL, TAPERS, band_degrees_of_freedom, sine_taper
from sagnac.spectrum.power_laws import running_median

Band = tuple[float, float]

# ---- noise of each alone -----------------------------------------------------------------

# Gyros that each motion needs: with two there is more than one way to tell them apart.
_FOR_EACH: Final = 3
# Chance of noise alone to be taken for a motion, or an ordinate of it for a line.
_UNLIKELY: Final = 1e-4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class SelfNoise(Compared):
    """Noise of each gyro without what all share.

    Attributes
    ----------
    gyros
        Their names.
    frequency
        (bands,) Hz.
    density, low, high
        (gyros, bands) one-sided rate density of each alone, (rad/s)^2/Hz, and its interval; NaN
        where it cannot be told.
    motion
        (bands,) mean density of what they share.
    gains
        (gyros,) with which each senses the motion, of their mean; empty of several motions.
    left_out
        (bands,) ordinates that were left out as lines of one gyro.
    angle_random_walk
        N of each over the band that was asked for; else empty.
    confidence
        Of the intervals.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.random.default_rng(2).standard_normal((4, 20_000))
    >>> x, y, z = noise[3] * [[30.0], [31.0], [29.0]] + noise[:3]
    >>> still = Recording.from_arrays(x=x, y=y, z=z, kind="rate", unit="deg/h", sample_rate=10.0)
    >>> self_noise(still).gains.round(2).tolist()
    [1.0, 1.03, 0.97]
    """

    gyros: tuple[str, ...]
    frequency: FloatArray
    density: FloatArray
    low: FloatArray
    high: FloatArray
    motion: FloatArray
    gains: FloatArray
    left_out: IntegerArray
    angle_random_walk: Mapping[str, Estimate]
    confidence: float

    def __repr__(self) -> str:
        walks = [f"{name} {one!r}" for name, one in self.angle_random_walk.items()]
        parts = [f"{self.frequency.size} bands", *([", ".join(walks)] if walks else [])]
        return f"<SelfNoise of {', '.join(self.gyros)}: {'; '.join(parts)}>"


def self_noise(
    recording: Recording,
    *,
    gyros: Sequence[str] | None = None,
    motions: int = 1,
    band: tuple[float, float] | None = None,
    confidence: float = 0.95,
) -> SelfNoise:
    """Spectrum of the noise of each of several gyros, and N of each over a band.

    Parameters
    ----------
    recording
        Of gyros that turn together.
    gyros
        Three or more for each motion; all of the recording unless stated.
    motions
        Axes about which they turn: 1 of parallel gyros, 3 of triads side by side.
    band
        Lowest and highest frequency, Hz, over which the noise of each is white; N is read there.
    confidence
        Of the intervals.

    Raises
    ------
    RecordingError
        If a sample is not finite, or the recording is too short.
    ValueError
        If there are too few gyros, or a band or a confidence that cannot be.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.random.default_rng(1).standard_normal((4, 20_000))
    >>> turned = 30.0 * noise[3]
    >>> three = {name: turned + one for name, one in zip("xyz", noise, strict=False)}
    >>> still = Recording.from_arrays(**three, kind="rate", unit="deg/h", sample_rate=10.0)
    >>> found = self_noise(still, band=(0.1, 5.0)).angle_random_walk["x"].to("deg/h/sqrt(Hz)")
    >>> bool(found.low < 1.0 / np.sqrt(10.0) < found.high)
    True
    """
    require_recording(recording)
    errors.require_confidence(confidence)
    errors.require_count("motions", motions, 1)
    every = tuple(one.name for one in recording.gyros)
    names = every if gyros is None else errors.choices_of("gyros", gyros, every)
    if len(set(names)) < _FOR_EACH * motions:
        remedy = f"give {_FOR_EACH} or more for each of {motions} motions"
        raise refusal("gyros", f"are {', '.join(names)}; {remedy}")
    gyros_taken, rate = map(recording.gyro, names), recording.sample_rate
    turned = [angle_increments(one.values, kind=one.kind, sample_rate=rate) for one in gyros_taken]
    samples = min(one.size for one in turned)
    rates = np.array([one[:samples] for one in turned]) * recording.sample_rate
    length = min(rates.shape[1], 2**17)
    frequency = np.arange(length // 2 + 1) * recording.sample_rate / length
    half = 0.5 * recording.sample_rate
    if band is not None and not (errors.is_band(band) and band[1] <= half * (1.0 + 1e-9)):
        remedy = f"give two frequencies in Hz, the lower first, up to {half:g}"
        raise refusal("band", f"is {quoted(band)}; {remedy}")
    segments = rates.shape[1] // length
    cross = _cross_spectra(rates, length) / recording.sample_rate
    first, last = CELL, frequency.size - CELL
    # Complex degrees of freedom of a band from which on intervals hold.
    least = 30 * motions**2
    edges = _edges(first, last, segments, least)
    if edges.size < 2:
        few = f"{errors.counted(rates.shape[1], 'sample')} are too few"
        problem = f"{few} for cross spectra of {len(names)} gyros"
        raise RecordingError(problem, remedy="record longer")
    bands = list(pairwise(edges))
    apart = [_apart(cross[slice(*each)], motions, segments, confidence) for each in bands]
    noise, low, high, sensed, left_out = map(np.array, zip(*apart, strict=True))
    walks: dict[str, Estimate] = {}
    if band is not None:
        ends = np.clip(np.searchsorted(frequency, band), first, last)
        if band_degrees(int(ends[1] - ends[0]), segments) < least:
            problem = f"holds too little between {band[0]:g} and {band[1]:g} Hz"
            raise RecordingError(problem, remedy="give a wider band, or record longer")
        in_band = _apart(cross[slice(*ends)], motions, segments, confidence)
        # N^2 is half of the one-sided density.
        squares = (0.5 * np.transpose(in_band[:3])).tolist()
        estimates = (rooted("angle_random_walk", confidence, *each) for each in squares)
        walks = dict(zip(names, estimates, strict=True))
    return SelfNoise(
        gyros=names,
        frequency=np.array([frequency[slice(*each)].mean() for each in bands]),
        density=noise.T,
        low=low.T,
        high=high.T,
        motion=np.mean(np.sum(np.abs(sensed) ** 2, axis=2), axis=1),
        gains=_gains(noise, sensed[:, :, 0]) if motions == 1 else np.empty(0),
        left_out=left_out,
        angle_random_walk=walks,
        confidence=confidence,
    )


def band_degrees(ordinates: int, segments: int) -> float:
    """Complex degrees of freedom of the mean of neighbouring ordinates over some segments."""
    return 0.5 * band_degrees_of_freedom(ordinates) * segments if ordinates > 0 else 0.0


def _cross_spectra(rates: FloatArray, length: int) -> ComplexArray:
    """(ordinates, gyros, gyros) one-sided, over all tapers and segments, times the sample rate."""
    total = np.zeros((length // 2 + 1, len(rates), len(rates)), dtype=np.complex128)
    segments = rates.shape[1] // length
    for place in range(segments):
        some = rates[:, place * length : (place + 1) * length]
        for turned in _tapered(some - some.mean(axis=1, keepdims=True)):
            total += turned.T[:, :, np.newaxis] * turned.T[:, np.newaxis, :].conj()
    return np.asarray(total * (2.0 / (TAPERS * segments)))


def _tapered(values: FloatArray) -> Iterator[ComplexArray]:
    """(gyros, ordinates) transforms of values (gyros, samples) under each sine taper."""
    length = values.shape[1]
    for order in range(1, TAPERS + 1):
        yield rfft(values * sine_taper(order, length), axis=1)


def _edges(first: int, last: int, segments: int, least: int) -> IntegerArray:
    """Ordinates at which bands begin and end, each with enough degrees of freedom."""
    edges = [first]
    while edges[-1] < last:
        # Ten bands a decade.
        high = max(edges[-1] + 1, round(edges[-1] * 10.0**0.1))
        while high < last and band_degrees(high - edges[-1], segments) < least:
            high += 1
        if high > last or band_degrees(high - edges[-1], segments) < least:
            break
        edges.append(high)
    return np.array(edges)


def _apart(
    cross: ComplexArray, motions: int, segments: int, confidence: float
) -> tuple[FloatArray, FloatArray, FloatArray, ComplexArray, int]:
    """One band, without ordinates at which one gyro has a line.

    Returns
    -------
    noise, low, high
        (gyros,) noise of each with its interval.
    sensed
        (gyros, motions) how each senses each motion.
    left_out
        Number of ordinates.
    """
    noise_alone = np.ones(len(cross), dtype=np.bool_)
    for _ in range(2):
        degrees = band_degrees(int(noise_alone.sum()), segments)
        mean = cross[noise_alone].mean(axis=0)
        noise, _, _, beside, _ = _noise_and_motion(mean, motions, degrees)
        # What is not motion, of each ordinate, over what is to be expected of it.
        whitened = beside / np.sqrt(noise)
        residual = np.einsum("ij,fjk,ik->f", whitened, cross, whitened.conj()).real
        freedom = 2.0 * TAPERS * segments * len(beside)
        # An ordinate of noise is taken for a line in one of ten thousand.
        noise_alone = residual / len(beside) < chdtri(freedom, _UNLIKELY) / freedom
        if noise_alone.all() or band_degrees(int(noise_alone.sum()), segments) < 2 * motions:
            break
    left_out = int(np.count_nonzero(~noise_alone))
    some = cross[noise_alone] if noise_alone.any() else cross
    degrees = band_degrees(len(some), segments)
    noise, variance, sensed, _, error = _noise_and_motion(some.mean(axis=0), motions, degrees)
    # Fewer than four degrees of freedom tell next to nothing of a noise.
    each = 2.0 * degrees / np.where(variance < 0.5 * degrees, variance, np.nan)
    noise, tail = np.where(np.isnan(each), np.nan, noise), 0.5 * (1.0 - confidence)
    low, high = (noise * each / chdtri(each, chance) for chance in (tail, 1.0 - tail))
    if error > 0.0:
        shared = float(np.mean(np.abs(sensed) ** 2)) + float(ndtri(confidence)) * error
        low = np.maximum(low - shared, 0.0)
    return noise, low, high, sensed, left_out


def _noise_and_motion(
    mean: ComplexArray, motions: int, degrees: float
) -> tuple[FloatArray, FloatArray, ComplexArray, ComplexArray, float]:
    """`_factored`, if the gyros share more than chance makes; else all that each shows is its own.

    A motion that is not seen has no gains, and its most likely ones take away from one gyro or
    another what it makes alone.

    Returns
    -------
    noise, variance, motion, beside
        As of `_factored`, noise by the degrees of freedom that the motions leave.
    error
        Standard error of a motion that is not seen and that all sense alike; 0 if one is seen.
    """
    own, gyros = np.diagonal(mean).real, len(mean)
    coherency = mean / np.sqrt(np.outer(own, own))
    together = -2.0 * degrees * float(np.linalg.slogdet(coherency)[1])
    if together > chdtri(gyros * (gyros - 1), _UNLIKELY):
        noise, variance, motion, beside = _factored(mean, motions)
        return noise * degrees / (degrees - motions), variance, motion, beside, 0.0
    first, second = np.triu_indices(gyros, 1)
    weight = 1.0 / (own[first] * own[second])
    shared = max(float(weight @ mean[first, second].real / weight.sum()), 0.0)
    motion = np.zeros((gyros, motions), dtype=np.complex128)
    motion[:, 0] = math.sqrt(shared)
    error = 1.0 / math.sqrt(2.0 * degrees * weight.sum())
    return own, np.ones(gyros), motion, np.eye(gyros, dtype=np.complex128), error


def _factored(
    mean: ComplexArray, motions: int
) -> tuple[FloatArray, FloatArray, ComplexArray, ComplexArray]:
    """Most likely noise of a cross-spectral matrix.

    Returns
    -------
    noise, variance
        (gyros,) and the variance of its logarithm times the degrees of freedom; NaN if the noise
        cannot be told.
    motion
        (gyros, motions) what of each motion each senses, root of a density.
    beside
        (gyros - motions, gyros) conjugate vectors of what is not motion, whitened.
    """
    # What the others do not foretell of each is no less than its noise.
    logarithm = -np.log(np.diagonal(np.linalg.inv(mean)).real)
    begun, root, information = logarithm, logarithm, np.empty((0, 0))
    for _ in range(100):
        root = np.exp(-0.5 * logarithm)
        values, vectors = np.linalg.eigh(root[:, np.newaxis] * mean * root)
        lower, beside = values[:-motions], vectors[:, :-motions]
        gradient = (np.abs(beside) ** 2) @ (1.0 - lower)
        information = np.abs(beside @ beside.conj().T) ** 2
        step = np.clip(np.linalg.lstsq(information, gradient)[0], -1.0, 1.0)
        logarithm = logarithm - step
        if np.abs(step).max() < 1e-9:
            break
    noise = np.exp(logarithm)
    variance = np.diagonal(np.linalg.pinv(information)).copy()
    # A noise far below where the search began is none that can be told.
    variance[logarithm < begun + math.log(1e-4)] = math.nan
    motion = vectors[:, -motions:] * np.sqrt(np.maximum(values[-motions:] - 1.0, 0.0))
    return noise, variance, motion / root[:, np.newaxis], beside.conj().T


def _gains(noise: FloatArray, sensed: ComplexArray) -> FloatArray:
    """(gyros,) gains of one motion, of their mean, by bands, (bands, gyros) both.

    Bands count by how far the motion stands out.
    """
    measured = ~np.isnan(noise).all(axis=1)
    noise, sensed = noise[measured], sensed[measured]
    along = (sensed * sensed.mean(axis=1, keepdims=True).conj()).real
    total = (along / np.nanmean(noise, axis=1, keepdims=True)).sum(axis=0)
    mean = float(total.mean())
    return np.asarray(total / mean if mean else np.full(total.size, math.nan))


# ---- the angle random walk that gyros share ----------------------------------------------


def band_cells(
    increments: FloatArray, sample_rate: float, band_hz: Band, masked: Sequence[Band] = ()
) -> tuple[FloatArray, ComplexArray]:
    """Spectral matrices of several gyros over a band, in cells that hold no line.

    Parameters
    ----------
    increments
        (gyros, samples), rad, of one span.
    sample_rate
        Samples per second.
    band_hz
        Lowest and highest frequency, Hz: that in which N rules.
    masked
        Bands (low, high), Hz, to leave out. Lines that gyros on one bench share are no noise;
        what stands out is left out besides.

    Returns
    -------
    frequency, matrices
        (cells,) in the middle of each, Hz, ascending; (gyros, gyros, cells) one-sided rate density
        under sine tapers, (rad/s)^2/Hz.

    Raises
    ------
    ValueError
        If no ordinate lies in the band.
    """
    length = int(prev_fast_len(increments.shape[1], real=True))
    time = np.arange(length) - 0.5 * (length - 1)
    values = increments[:, :length] - increments[:, :length].mean(axis=1, keepdims=True)
    values -= np.outer(values @ time / (time @ time), time)
    unit = sample_rate / length
    first, last = np.searchsorted(np.arange(1, length // 2 + 1) * unit, band_hz, side="left")
    cells = int((last - first) // CELL)
    if cells <= 0:
        raise ValueError(f"too few frequencies between {band_hz[0]:g} and {band_hz[1]:g} Hz")
    used = slice(1 + int(first), 1 + int(first) + cells * CELL)
    matrices = np.zeros((values.shape[0], values.shape[0], cells), dtype=np.complex128)
    for turned in _tapered(values):
        pairs = turned[:, np.newaxis, used] * turned[:, used].conj()
        matrices += pairs.reshape(*matrices.shape, CELL).sum(axis=3)
    matrices *= 2.0 * sample_rate / (TAPERS * CELL)
    frequency = (1 + first + CELL * (np.arange(cells) + 0.5)) * unit
    plain = np.ones(cells, dtype=np.bool_)
    for density in np.einsum("ggc->gc", matrices.real):
        standing = density > 3.0 * running_median(density, 41)
        plain &= ~np.convolve(standing, np.ones(3), mode="same").astype(bool)[:cells]
    for low, high in masked:
        plain &= (frequency <= low - CELL * unit) | (frequency >= high + CELL * unit)
    if not plain.any():
        raise ValueError(f"only lines between {band_hz[0]:g} and {band_hz[1]:g} Hz")
    return frequency[plain], matrices[:, :, plain]


# Terms that the cross spectra may have, and fewest bins to tell them from each other.
_TERMS: Final = (QUANTIZATION, WALK, RATE_WALK)
_LEAST_BINS: Final = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class CommonWalk:
    """Square of the angle random walk that gyros share.

    Attributes
    ----------
    square, low, high
        rad^2/s with its interval; below zero if the gyros lean on each other.
    confidence
        Of the interval.
    error
        Standard error of the square.
    """

    square: float
    low: float
    high: float
    confidence: float
    error: float

    @property
    def is_present(self) -> bool:
        """Whether it is farther from zero than three standard deviations, as any term has to be.

        Chance alone brings the end of an interval beyond zero, and N would then have to allow for
        all that the interval holds.
        """
        return self.square**2 > PRESENCE * self.error**2

    @property
    def reach(self) -> float:
        """Largest square that may be there: half the interval, at least, if none is seen."""
        return self.high if self.is_present else max(self.high, self.high - self.square)


def differenced_factor(shared: float, walk: float) -> float:
    """Factor that differencing puts on N per gyro: ``sqrt(n^2 / (n^2 + c))``.

    Parameters
    ----------
    shared
        c, square of the angle random walk that both share, rad^2/s.
    walk
        n, per gyro as the difference shows it, rad/sqrt(s).
    """
    own = walk**2
    # What gyros share with opposite sign raises n^2 by no more than all of it.
    return math.sqrt(own / max(own + shared, 1e-3 * own))


def common_walk(
    increments: FloatArray,
    *,
    sample_rate: float,
    band_hz: Band,
    masked: Sequence[Band] = (),
    confidence: float = 0.95,
) -> CommonWalk:
    """Angle random walk that two or more gyros share, from their cross spectra.

    White noise, its sum and its second difference (N, K and Q) are fitted to the cross spectra of
    all pairs by least squares in the metric of the Wishart law,
    ``cov(S_ij, S_kl) = (S_ik S_jl + S_il S_jk) / degrees of freedom``.

    Parameters
    ----------
    increments
        (gyros, samples), rad, of angles that were averaged over the interval between them, table
        motion out.
    sample_rate
        Samples per second.
    band_hz, masked
        As in `band_cells`.
    confidence
        Of the interval, which grows by what the three terms do not explain.

    Returns
    -------
    CommonWalk

    Raises
    ------
    ValueError
        If the band is too narrow to tell the three from each other.
    """
    places, matrices = band_cells(increments, sample_rate, band_hz, masked)
    bins = _bins(places)
    if len(bins) < _LEAST_BINS:
        raise ValueError(f"{len(bins)} bins do not tell what gyros share; give {_LEAST_BINS}")
    frequency = np.array([places[span].mean() for span in bins])
    basis = rate_density_basis(frequency, 1.0 / sample_rate)[:, _TERMS]
    # Averages over the interval make of a walk's increments c_0 = 2/3 and c_1 = 1/6; white noise of
    # the angle stays white.
    basis[:, 1:] *= ((2.0 + np.cos(2.0 * np.pi * frequency / sample_rate)) / 3.0)[:, np.newaxis]
    scale = np.sqrt(np.mean(basis**2, axis=0))
    own = _TERMS.index(WALK)
    freedom = np.array([band_degrees_of_freedom(CELL * (one.stop - one.start)) for one in bins])
    spectra = np.stack([matrices[:, :, one].real.mean(axis=2) for one in bins])
    solution, covariance, chi_square = _fitted_terms(spectra, basis / scale, freedom)
    left = freedom.size * math.comb(spectra.shape[1], 2) - solution.size
    square = float(solution[own] / scale[own])
    error = math.sqrt(max(1.0, chi_square / left) * float(covariance[own, own])) / scale[own]
    reach = float(stdtrit(left, 0.5 + 0.5 * confidence)) * error
    low, high = square - reach, square + reach
    return CommonWalk(square=square, low=low, high=high, confidence=confidence, error=error)


def _fitted_terms(
    spectra: FloatArray, basis: FloatArray, freedom: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Terms of the cross spectra of all pairs, their covariance, and the chi-square they leave.

    The metric is of smooth spectra: in that of the observed ones what chance makes low would weigh
    more.
    """
    first, second = np.triu_indices(spectra.shape[1], 1)
    known, cross = _smooth(spectra, basis, freedom), spectra[:, first, second]
    # The covariance is that of every pair with every other pair.
    one, other = first[:, np.newaxis], second[:, np.newaxis]
    covariance = known[:, one, first] * known[:, other, second]
    covariance += known[:, one, second] * known[:, other, first]
    metric = np.linalg.inv(covariance / freedom[:, np.newaxis, np.newaxis])
    weight = metric.sum(axis=1)
    inverse = np.asarray(np.linalg.inv(basis.T * weight.sum(axis=1) @ basis), dtype=np.float64)
    score = basis.T @ (weight * cross).sum(axis=1)
    solution = inverse @ score
    total = float(np.einsum("bp,bpq,bq->", cross, metric, cross))
    return solution, inverse, total - float(score @ solution)


def _smooth(spectra: FloatArray, basis: FloatArray, freedom: FloatArray) -> FloatArray:
    """(bins, gyros, gyros) spectra as the terms make them, near the observed ones."""
    gyros = spectra.shape[1]
    own = np.einsum("bgg->bg", spectra)
    model = own
    for _ in range(4):
        weight, fitted = np.sqrt(freedom)[:, np.newaxis] / model, np.empty_like(own)
        for gyro, part in enumerate(weight.T):
            weighed = basis * part[:, np.newaxis]
            fitted[:, gyro] = basis @ np.linalg.lstsq(weighed, part * own[:, gyro], rcond=None)[0]
        model = np.clip(fitted, own / 3.0, own * 3.0)
    size, seen = np.sqrt(model), np.sqrt(own)
    coherency = spectra / (seen[:, :, np.newaxis] * seen[:, np.newaxis, :])
    # Coherency changes slowly, and that of a bin itself would weigh it: its neighbours say it.
    padded = np.concatenate([coherency[1:2], coherency, coherency[-2:-1]])
    coherency = 0.5 * (padded[:-2] + padded[2:])
    coherency[:, np.arange(gyros), np.arange(gyros)] = 1.0
    return np.asarray(coherency * size[:, :, np.newaxis] * size[:, np.newaxis, :])


def _bins(frequency: FloatArray) -> list[slice]:
    """Runs of cells, a sixth of a decade and six cells long or more.

    A covariance made of fewer cells bends its own weights.
    """
    bins: list[slice] = []
    start = 0
    for stop in range(1, frequency.size + 1):
        if stop - start >= 6 and frequency[stop - 1] >= frequency[start] * 10.0 ** (1.0 / 6.0):
            bins.append(slice(start, stop))
            start = stop
    return bins
