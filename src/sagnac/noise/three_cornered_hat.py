"""Each of three gyros alone, from their differences."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagnac.core.arrays import FloatArray, elementwise
from sagnac.core.errors import Note, RecordingError
from sagnac.noise.cosine_spectrum import (
    bin_means,
    cosine_bins,
    require_increments,
    without_slope,
)
from sagnac.noise.estimates import Estimate, SquaredEstimate
from sagnac.noise.laws import STOCHASTIC_NAMES, cosine_power_basis
from sagnac.noise.likelihood import (
    CONVERGED,
    Profile,
    detected,
    errors_of,
    scaled_covariance,
    solve_normal,
)
from sagnac.recording.channel import angle_increments
from sagnac.recording.model import Kind
from sagnac.spectrum.transforms import cosine_length, cosine_transform


@dataclass(frozen=True, slots=True, kw_only=True)
class Separation:
    """Angle random walk of each of three gyros, from their differences alone.

    Attributes
    ----------
    angle_random_walk
        By gyro, rad/sqrt(s).
    notes
        What was noticed, such as a negative variance.
    """

    angle_random_walk: Mapping[str, Estimate]
    notes: tuple[Note, ...] = ()


def three_cornered_hat(
    gyros: Mapping[str, ArrayLike],
    *,
    kind: Kind,
    sample_rate: float,
    confidence: float = 0.95,
    masked: Sequence[tuple[float, float]] = (),
    band: tuple[float, float] | None = None,
) -> Separation:
    """Each gyro's own angle random walk from three that turn together.

    What the gyros share (the table, the Earth) is in each of them and in no difference of
    them, so only the differences are used: the first less the second and the second less
    the third. Their spectra and cross spectrum are the sum of Q, N, B and K of three
    independent gyros; all twelve squares are fitted at once by likelihood on the cosine
    transforms, as in `likelihood_fit`. This is the three-cornered hat by covariances (E. Lantz
    et al., IEEE Trans. UFFC 66:1942, 2019) with the weights that lose nothing.

    A square may come out negative where a gyro is much quieter than the other two, or
    where the gyros' noises are not independent. Then, and wherever the square is below
    three standard deviations, an upper bound is given and a note says why.

    Parameters
    ----------
    gyros
        Three channels of one length by name, rad for ``angle`` and ``increment``, rad/s
        for ``rate``; the share of common motion already alike, lines removed or masked.
    kind
        What one sample is.
    sample_rate
        Samples per second.
    confidence
        Of every interval and bound.
    masked, band
        As in `likelihood_fit`.

    Returns
    -------
    Separation
        By the names given.

    Raises
    ------
    RecordingError
        If a sample is not finite, the differences do not vary, or too little is left.
    """
    spectra = _pair_spectra(gyros, kind, sample_rate, masked, band)
    # The spectral matrix of the two differences is linear in the squares; scoring is least squares
    # on its entries in the metric of their own covariance, repeated.
    best = _climbed(spectra, _white_start(spectra))
    errors = errors_of(_scored(spectra, best)[0]).reshape(best.squares.shape)
    column = STOCHASTIC_NAMES.index("angle_random_walk")
    estimates, notes = {}, []
    for gyro, name in enumerate(gyros):
        at = gyro, column
        square = float(best.squares[at])
        found = _profile(spectra, best, at, float(errors[at]), confidence)
        estimates[name] = found.root("angle_random_walk", confidence)
        if found.status == "upper bound":
            notes.append(_bound_note(name, square))
    return Separation(angle_random_walk=estimates, notes=tuple(notes))


def _profile(
    spectra: "_PairSpectra", best: "_Place", at: tuple[int, int], error: float, confidence: float
) -> SquaredEstimate:
    """Interval of a square that is three standard deviations above zero, or a bound."""
    value = float(best.squares[at])

    def deviance(square: float) -> float:
        return _held(spectra, best, at, square).deviance

    profile = Profile(
        deviance=deviance,
        lowest=best.deviance,
        value=value,
        error=error,
        confidence=confidence,
    )
    found = profile.estimated(deviance(0.0)) if value > 0.0 else None
    # What is larger than the second would have been estimated.
    return found or SquaredEstimate.bound(
        max(profile.bound(deviance(max(value, 0.0))), detected(confidence) * error)
    )


def _bound_note(gyro: str, square: float) -> Note:
    what = "negative" if square < 0.0 else "within three standard deviations of zero"
    return Note(
        text=f"the squared angle random walk of {gyro} alone came out {what}: it is much quieter "
        "than the others, or their noises are not independent; an upper bound is given"
    )


# First less second and second less third, in terms of the three gyros.
_DIFFERENCES: Final = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0]])


@dataclass(frozen=True, slots=True, kw_only=True)
class _PairSpectra:
    """Spectra and cross spectrum of the two differences, in bins.

    Attributes
    ----------
    basis
        (bins, terms) expected squares of one gyro with its coefficients at one.
    moments
        (bins, 3) mean squares of the first difference, products, and squares of the second.
    count
        (bins,) ordinates in each.
    """

    basis: FloatArray
    moments: FloatArray
    count: FloatArray

    @property
    def matrices(self) -> FloatArray:
        """(bins, 2, 2) the moments as spectral matrices."""
        columns = [self.moments[:, k] for k in (0, 1, 1, 2)]
        return np.stack(columns, axis=1).reshape(-1, 2, 2)


def _pair_spectra(
    gyros: Mapping[str, ArrayLike],
    kind: Kind,
    sample_rate: float,
    masked: Sequence[tuple[float, float]],
    band: tuple[float, float] | None,
) -> _PairSpectra:
    channels = [
        angle_increments(values, kind=kind, sample_rate=sample_rate) for values in gyros.values()
    ]
    require_increments(channels[0].size)
    samples, interval = cosine_length(channels[0].size), 1.0 / sample_rate
    # A ramp lives in the lowest indices, and least squares took what noise looks like one.
    lowest = 4.0 / (samples * interval)
    low, high = band if band is not None else (0.0, math.inf)
    # One product of two transforms fits a singular matrix, at infinite likelihood.
    bins = cosine_bins(samples, interval, masked, (max(low, lowest), high), narrowest=4)
    basis = bin_means(bins, lambda index: cosine_power_basis(index, samples, interval))
    one, other = (
        cosine_transform(without_slope(elementwise(np.subtract, first, second)[:samples])[1])
        for first, second in pairwise(channels)
    )
    moments = np.stack([bins.mean(*pair) for pair in ((one, one), (one, other), (other, other))], 1)
    if not min(moments[:, 0].min(), moments[:, 2].min()) > 0.0:
        raise RecordingError(
            f"two of the gyros {', '.join(gyros)} are the same",
            remedy="check the columns ({columns})",
        )
    return _PairSpectra(basis=basis, moments=moments, count=bins.count)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """Squares (3, terms) of the gyros, -2 log likelihood and inverse spectral matrices there."""

    squares: FloatArray
    deviance: float
    inverse: FloatArray


def _climbed(spectra: _PairSpectra, place: _Place, held: tuple[int, int] | None = None) -> _Place:
    """The most likely place from one on, one square `held` as it is there."""
    for _ in range(100):
        lowered = _lowered(spectra, place, _target(spectra, place, held))
        if lowered is None:
            break
        fall = place.deviance - lowered.deviance
        place = lowered
        if fall < CONVERGED:
            break
    return place


def _target(spectra: _PairSpectra, place: _Place, held: tuple[int, int] | None) -> FloatArray:
    """(3, terms) squares that scoring goes to."""
    fisher, score = _scored(spectra, place)
    squares = place.squares.ravel().copy()
    free = np.ones(squares.size, dtype=np.bool_)
    if held is not None:
        free[held[0] * place.squares.shape[1] + held[1]] = False
    score = score - fisher[:, ~free] @ squares[~free]
    squares[free] = solve_normal(fisher[np.ix_(free, free)], score[free])
    return squares.reshape(place.squares.shape)


def _held(spectra: _PairSpectra, best: _Place, at: tuple[int, int], square: float) -> _Place:
    """The most likely place with one square held at a value."""
    fisher, _ = _scored(spectra, best)
    covariance = scaled_covariance(fisher)
    scale = 1.0 / np.sqrt(np.diag(fisher))
    row = at[0] * best.squares.shape[1] + at[1]
    # How the other squares move when this one does.
    direction = covariance[:, row] * scale / (covariance[row, row] * scale[row])
    moved = best.squares + (direction * (square - best.squares[at])).reshape(best.squares.shape)
    moved[at] = square
    start = _likelihood(spectra, moved)
    if not math.isfinite(start.deviance):
        squares = best.squares.copy()
        squares[at] = square
        start = _likelihood(spectra, squares)
    return _climbed(spectra, start, at) if math.isfinite(start.deviance) else start


def _likelihood(spectra: _PairSpectra, squares: FloatArray) -> _Place:
    """-2 log likelihood, infinite where a spectral matrix is not positive."""
    moments = spectra.moments
    density = spectra.basis @ squares.T
    spectral = np.einsum("ig,bg,jg->bij", _DIFFERENCES, density, _DIFFERENCES)
    determinant = spectral[:, 0, 0] * spectral[:, 1, 1] - spectral[:, 0, 1] ** 2
    if not (determinant.min() > 0.0 and spectral[:, 0, 0].min() > 0.0):
        return _Place(squares=squares, deviance=math.inf, inverse=spectral)
    inverse = spectral[:, ::-1, ::-1] / determinant[:, np.newaxis, np.newaxis]
    inverse[:, 0, 1] *= -1.0
    inverse[:, 1, 0] *= -1.0
    trace = (
        inverse[:, 0, 0] * moments[:, 0]
        + 2.0 * inverse[:, 0, 1] * moments[:, 1]
        + inverse[:, 1, 1] * moments[:, 2]
    )
    deviance = float(spectra.count @ (np.log(determinant) + trace))
    return _Place(squares=squares, deviance=deviance, inverse=inverse)


def _white_start(spectra: _PairSpectra) -> _Place:
    """White noise of the three spectra by covariances, averaged over all bins."""
    total = spectra.moments.T @ spectra.count / spectra.count.sum()
    start = np.maximum([total[0] + total[1], -total[1], total[2] + total[1]], 0.01 * total[0])
    squares = np.zeros((3, spectra.basis.shape[1]))
    squares[:, STOCHASTIC_NAMES.index("angle_random_walk")] = start / spectra.basis[0, 1]
    return _likelihood(spectra, squares)


def _scored(spectra: _PairSpectra, place: _Place) -> tuple[FloatArray, FloatArray]:
    """Fisher information, (3 terms, 3 terms), and its product with the squares to go to."""
    basis, terms = spectra.basis, spectra.basis.shape[1]
    reach = place.inverse @ _DIFFERENCES
    coupling = np.einsum("ig,bih->bgh", _DIFFERENCES, reach) ** 2
    fisher = 0.5 * np.einsum("b,bs,bt,bgh->gsht", spectra.count, basis, basis, coupling)
    observed = np.einsum("big,bij,bjg->bg", reach, spectra.matrices, reach)
    score = 0.5 * np.einsum("b,bs,bg->gs", spectra.count, basis, observed)
    fisher = fisher.reshape(3 * terms, -1)
    return fisher, score.ravel()


def _lowered(spectra: _PairSpectra, place: _Place, target: FloatArray) -> _Place | None:
    """The first of the step and its halves that does not raise the deviance, if any does not."""
    share = 1.0
    for _ in range(40):
        trial = _likelihood(spectra, place.squares + share * (target - place.squares))
        if trial.deviance <= place.deviance:
            return trial
        share *= 0.5
    return None
