"""The spectrum of the likelihood fit: squared cosine transform of the increments, in bins."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray, blocks, elementwise
from sagnac.core.errors import RecordingError
from sagnac.noise import laws
from sagnac.noise.laws import CoefficientName
from sagnac.noise.likelihood import Ordinates
from sagnac.recording.channel import angle_increments, is_constant_rate
from sagnac.recording.model import Kind
from sagnac.spectrum.periodogram import bin_sums
from sagnac.spectrum.transforms import cosine_length, cosine_transform

LEAST_BINS: Final = 8
_REMEDY: Final = "a spectrum needs noise, check the channel"
SINGLE: Final = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class CosineSpectrum:
    """The increments in the basis in which `spectrum_fit` fits them.

    Attributes
    ----------
    transform
        (samples,) orthonormal cosine transform (DCT-II) of the increments, rad.
    interval
        Between samples, s.
    terms
        To fit.
    slope
        Taken off the increments first, rad per sample; zero without ``rate_ramp``.
    """

    transform: FloatArray
    interval: float
    terms: tuple[CoefficientName, ...]
    slope: float

    @property
    def names(self) -> tuple[CoefficientName, ...]:
        """The stochastic ones of the terms."""
        return tuple(name for name in laws.STOCHASTIC_NAMES if name in self.terms)

    def expected(self, index: FloatArray) -> FloatArray:
        """(bins, terms) expected squares of `names` at one, as in `cosine_power_basis`."""
        basis = laws.cosine_power_basis(index, self.transform.size, self.interval)
        return basis[:, [laws.STOCHASTIC_NAMES.index(name) for name in self.names]]


Terms = Sequence[CoefficientName]


def cosine_spectrum(
    values: ArrayLike, *, kind: Kind, sample_rate: float, terms: Terms = laws.COEFFICIENT_NAMES
) -> CosineSpectrum:
    """Transform once what is to be fitted over several bands.

    If there are 2^17 increments or more, a few of the last may be left out, so that their number
    has a divisor for a transform in parts; a long series is worked through by blocks.

    Parameters
    ----------
    values, kind, sample_rate, terms
        As in `likelihood_fit`.

    Raises
    ------
    RecordingError
        If a sample is not finite, there are too few, or only rounding varies.
    ValueError
        If an argument makes no sense.
    """
    increments = angle_increments(values, kind=kind, sample_rate=sample_rate)
    require_increments(increments.size)
    if is_constant_rate(values, kind):
        raise RecordingError("the values do not vary", remedy=_REMEDY)
    increments = increments[: cosine_length(increments.size)]
    sloping = "rate_ramp" in terms
    slope, transform = without_slope(increments) if sloping else (0.0, cosine_transform(increments))
    interval = 1.0 / sample_rate
    return CosineSpectrum(transform=transform, interval=interval, terms=tuple(terms), slope=slope)


def without_slope(increments: FloatArray) -> tuple[float, FloatArray]:
    """Slope per sample of the increments by least squares, and the transform of what is left."""
    size = increments.size
    moment = 0.0
    for block in blocks(size):
        place = np.arange(block.start, block.stop) - 0.5 * (size - 1)
        moment += float(place @ increments[block])
    slope = 12.0 * moment / (float(size) * (float(size) ** 2 - 1.0))
    transform = cosine_transform(increments)
    for block in blocks(size, start=1, multiple=2):
        odd = np.arange(block.start, block.stop, 2.0)
        transform[block][::2] -= slope * slope_transform(odd, size)
    return slope, transform


@dataclass(frozen=True, slots=True, kw_only=True)
class SpectrumBins:
    """Ranges of the index k of a cosine transform, without what is masked.

    `edges` are all starts and the last stop; `keep` says which of the ranges between them are the
    bins.
    """

    edges: IntegerArray
    keep: BooleanArray

    @property
    def starts(self) -> IntegerArray:
        """(bins,) first index of each."""
        return self.edges[:-1][self.keep]

    @property
    def count(self) -> FloatArray:
        """(bins,) ordinates in each bin."""
        return np.asarray(np.diff(self.edges)[self.keep], dtype=np.float64)

    def mean(self, one: FloatArray, other: FloatArray) -> FloatArray:
        """Mean over each bin of products of values at k = 0, 1, …"""
        sums = bin_sums(elementwise(np.multiply, one, other), self.edges)
        return np.asarray(sums[self.keep] / self.count)

    @property
    def middle(self) -> FloatArray:
        """(bins,) mean index of each."""
        return np.asarray(self.starts + 0.5 * (self.count - 1.0))

    def mean_of(self, expected: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """Mean over each bin of expected squares by index, (bins, terms)."""
        nodes, weights = np.polynomial.legendre.leggauss(4)
        # Half a step beyond the first and the last: a sum by the integral over its steps.
        half = np.where(self.count > 1.0, 0.5 * self.count, 0.0)
        index = self.middle[:, np.newaxis] + half[:, np.newaxis] * nodes
        basis = expected(index.ravel()).reshape(*index.shape, -1)
        return np.asarray(np.einsum("bnt,n->bt", basis, 0.5 * weights))


def require_increments(samples: int) -> None:
    """Refuse a record too short for a spectrum."""
    if samples <= LEAST_BINS:
        problem = f"{samples} increments are too few for a spectrum"
        raise RecordingError(problem, remedy="record longer")


Band = tuple[float, float]
Bands = Sequence[Band]
"""Lowest and highest frequency of each, Hz."""


def cosine_bins(
    samples: int, interval: float, masked: Bands, band: Band | None, *, narrowest: int = 1
) -> SpectrumBins:
    """Bins of the cosine spectrum that a fit takes.

    Parameters
    ----------
    samples
        Length of the transform.
    interval
        Between samples, s.
    masked, band
        As in `likelihood_fit`.
    narrowest
        Fewest indices in a bin.

    Raises
    ------
    RecordingError
        If too few bins are left.
    ValueError
        If `masked` or `band` makes no sense.
    """
    resolution = 1.0 / (2.0 * samples * interval)
    # First and last but one index of what is left out. Two indices are one cell, 1/duration.
    limits = np.asarray(masked, dtype=np.float64).reshape(-1, 2) / resolution
    excluded = np.stack([np.floor(limits[:, 0]) - 2, np.ceil(limits[:, 1]) + 3], axis=1)
    if band is not None:
        low, top = math.ceil(band[0] / resolution), min(band[1] / resolution, samples)
        excluded = np.concatenate([excluded, [[0, low], [math.floor(top) + 1, samples]]])
    excluded = np.clip(excluded, 1, samples).astype(np.int64)
    edges = np.unique(np.concatenate([_spaced_edges(samples, narrowest), excluded.ravel()]))
    opened = np.searchsorted(np.sort(excluded[:, 0]), edges[:-1], side="right")
    closed = np.searchsorted(np.sort(excluded[:, 1]), edges[:-1], side="right")
    keep = (opened <= closed) & (np.diff(edges) >= narrowest)
    if np.count_nonzero(keep) < LEAST_BINS:
        problem = "masked and band leave too few frequencies to fit"
        raise RecordingError(problem, remedy="mask less or record longer")
    return SpectrumBins(edges=edges, keep=keep)


def _spaced_edges(samples: int, narrowest: int) -> IntegerArray:
    """Single indices first, then 32 bins to the octave, none narrower than `narrowest`."""
    steps = max(1, round(32 * math.log2(max(samples / SINGLE, 1.0))))
    spaced = np.unique(np.round(np.geomspace(SINGLE, samples, steps + 1)).astype(np.int64))
    singles = np.arange(1, min(SINGLE, samples) + 1, narrowest)
    wide = spaced[(spaced <= samples) & (np.diff(spaced, prepend=0) >= narrowest)]
    between = np.arange(singles[-1], wide[0] if wide.size else samples, narrowest)
    return np.concatenate([singles, between, wide, [samples]])


def slope_transform(index: FloatArray, samples: int) -> FloatArray:
    """Cosine transform (DCT-II, orthonormal) of 0, 1, 2, …, at k > 0."""
    half = 0.5 * np.pi * index / samples
    shape = -math.sqrt(2.0 / samples) * np.cos(half) / (2.0 * np.sin(half) ** 2)
    return np.asarray(np.where(index % 2 == 1, shape, 0.0))


def ordinates(cosine: CosineSpectrum, bins: SpectrumBins) -> Ordinates:
    """Mean squares of a transform in bins, and what is expected of each of its terms there.

    With d the transform of a unit slope and D its square, the squares of increments less their
    slope by least squares have the mean ``A_k (1 - 2 d_k^2/D) + d_k^2 sum(d_j^2 A_j)/D^2`` in place
    of A_k. The first is left out then: nearly all of it is the slope.

    Raises
    ------
    RecordingError
        If the values do not vary.
    """
    samples, starts = cosine.transform.size, bins.starts
    power = bins.mean(cosine.transform, cosine.transform)
    # A single square may be zero, of angles a few readout steps apart.
    if not np.median(power) > 0.0:
        raise RecordingError("the values do not vary", remedy=_REMEDY)
    basis, used = bins.mean_of(cosine.expected), np.ones(starts.size, dtype=np.bool_)
    if "rate_ramp" in cosine.terms:
        index = np.arange(1.0, min(SINGLE, samples), 2.0)
        shape = slope_transform(index, samples) ** 2
        shape /= shape.sum()
        share = np.zeros((starts.size, 1))
        low = (bins.count == 1.0) & (starts < SINGLE) & (starts % 2 == 1)
        share[low, 0] = shape[starts[low] // 2]
        basis = basis * (1.0 - 2.0 * share) + share * (shape @ cosine.expected(index))
        used = starts > 1
    basis, power, count = basis[used], power[used], bins.count[used]
    frequency = (0.5 * bins.middle / (samples * cosine.interval))[used]
    return Ordinates(basis=basis, power=power, count=count, weight=count, frequency=frequency)
