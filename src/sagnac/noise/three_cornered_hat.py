"""Each of three gyros alone, from their differences."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.core.errors import Note, RecordingError
from sagnac.noise.cosine_spectrum import Band, Bands, cosine_bins, require_increments, without_slope
from sagnac.noise.estimates import Estimate
from sagnac.noise.laws import STOCHASTIC_NAMES, cosine_power_basis
from sagnac.noise.likelihood import Likelihood, Place, parabola_move
from sagnac.spectrum.transforms import cosine_length


@dataclass(frozen=True, slots=True, kw_only=True)
class Separation:
    """Angle random walk of each of three gyros, from their differences alone.

    Attributes
    ----------
    angle_random_walk
        By gyro, rad/sqrt(s).
    notes
        What was noticed, such as a negative variance.
    squares
        By gyro, squared Q, N, B and K, SI.
    """

    angle_random_walk: Mapping[str, Estimate]
    notes: tuple[Note, ...] = ()
    squares: Mapping[str, FloatArray] = field(default_factory=dict)


def three_cornered_hat(
    names: Sequence[str],
    steps: list[FloatArray],
    *,
    sample_rate: float,
    confidence: float,
    masked: Bands,
    band: Band,
) -> Separation:
    """Each gyro's own angle random walk from three that turn together.

    What the gyros share (the table, the Earth) is in each of them and in no difference of
    them, so only the differences are used. Their spectra and cross spectrum are the sum of Q, N,
    B and K of three independent gyros; all twelve squares are fitted at once by likelihood on the
    cosine transforms, as in `likelihood_fit`. This is the three-cornered hat by covariances (E.
    Lantz et al., IEEE Trans. UFFC 66:1942, 2019) with the weights that lose nothing.

    A square may come out negative where a gyro is much quieter than the other two, or
    where the gyros' noises are not independent. Then, and wherever the square is below
    three standard deviations, an upper bound is given and a note says why.

    Parameters
    ----------
    names
        Of three gyros.
    steps
        (increments,) rad, of the first gyro less the second and of the second less the third; the
        share of common motion already alike, lines removed or masked. The list is emptied, so
        that long arrays leave memory once they are transformed.
    sample_rate
        Increments per second.
    confidence
        Of every interval and bound.
    masked, band
        As in `likelihood_fit`.

    Raises
    ------
    RecordingError
        If they do not vary, or too little is left.
    """
    require_increments(steps[0].size)
    samples, interval = cosine_length(steps[0].size), 1.0 / sample_rate
    # A ramp lives in the lowest indices, and least squares took what noise looks like one.
    lowest = 4.0 / (samples * interval)
    low, high = band
    # One product of two transforms fits a singular matrix, at infinite likelihood.
    bins = cosine_bins(samples, interval, masked, (max(low, lowest), high), narrowest=4)
    basis = bins.mean_of(lambda index: cosine_power_basis(index, samples, interval))
    other, one = (without_slope(steps.pop()[:samples])[1] for _ in range(2))
    moments = np.stack([bins.mean(*pair) for pair in ((one, one), (one, other), (other, other))], 1)
    if not min(moments[:, 0].min(), moments[:, 2].min()) > 0.0:
        problem = f"two of the gyros {', '.join(names)} are the same"
        raise RecordingError(problem, remedy="check the columns ({columns})")
    spectra = _PairSpectra(basis=basis, moments=moments, count=bins.count)
    white = spectra.start(np.zeros(spectra.terms), np.ones(spectra.terms, dtype=np.bool_))
    best = spectra.maximum(white)
    estimates, notes = {}, []
    for gyro, name in enumerate(names):
        column = gyro * len(STOCHASTIC_NAMES) + STOCHASTIC_NAMES.index("angle_random_walk")
        estimates[name] = spectra.estimate(best, column, "angle_random_walk", confidence)
        if estimates[name].status == "upper bound":
            negative = best.squares[column] < 0.0
            what = "negative" if negative else "within three standard deviations of zero"
            square = f"the squared angle random walk of {name} alone came out {what}"
            why = "it is much quieter than the others, or their noises are not independent"
            notes.append(Note(text=f"{square}: {why}; an upper bound is given"))
    squares = dict(zip(names, best.squares.reshape(len(names), -1), strict=True))
    return Separation(angle_random_walk=estimates, notes=tuple(notes), squares=squares)


# First less second and second less third, in terms of the three gyros.
_DIFFERENCES: Final = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0]])


@dataclass(frozen=True, kw_only=True)
class _PairSpectra(Likelihood):
    """Spectra and cross spectrum of the two differences, in bins.

    The spectral matrix of the two is linear in the squares, those of the first gyro first.

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
    def terms(self) -> int:
        return 3 * int(self.basis.shape[1])

    def at(self, squares: FloatArray) -> Place:
        density = self.basis @ squares.reshape(3, -1).T
        spectral = np.einsum("ig,bg,jg->bij", _DIFFERENCES, density, _DIFFERENCES)
        determinant = spectral[:, 0, 0] * spectral[:, 1, 1] - spectral[:, 0, 1] ** 2
        if not (determinant.min() > 0.0 and spectral[:, 0, 0].min() > 0.0):
            return Place(squares=squares, deviance=math.inf, law=spectral)
        inverse = spectral[:, ::-1, ::-1] / determinant[:, np.newaxis, np.newaxis]
        inverse[:, [0, 1], [1, 0]] *= -1.0
        trace = (inverse[:, [0, 0, 1], [0, 1, 1]] * [1.0, 2.0, 1.0] * self.moments).sum(axis=1)
        deviance = float(self.count @ (np.log(determinant) + trace))
        return Place(squares=squares, deviance=deviance, law=inverse)

    @cached_property
    def _products(self) -> FloatArray:
        """(terms of one gyro, squared, bins) half the ordinates times two terms."""
        products = np.einsum("b,bs,bt->stb", 0.5 * self.count, self.basis, self.basis)
        return np.asarray(products.reshape(-1, self.count.size))

    def _curvature(self, weight: FloatArray) -> FloatArray:
        """(terms, terms) sum over bins of a weight of two gyros, (bins, 3, 3), times two terms."""
        terms = self.basis.shape[1]
        sums = (self._products @ weight.reshape(-1, 9)).reshape(terms, terms, 3, 3)
        return sums.transpose(2, 0, 3, 1).reshape(self.terms, self.terms)

    def fisher(self, place: Place) -> FloatArray:
        return self._curvature((_DIFFERENCES.T @ place.law @ _DIFFERENCES) ** 2)

    def move(self, place: Place, free: BooleanArray) -> FloatArray:
        reach = place.law @ _DIFFERENCES
        matrices = self.moments[:, [0, 1, 1, 2]].reshape(-1, 2, 2)
        # With the law S and the moments M, D the differences: D' inv(S) D and D' inv(S) M inv(S) D.
        # A square of gyro g times one of gyro h has the curvature law (2 seen - law) at (g, h).
        law, seen = _DIFFERENCES.T @ reach, reach.transpose(0, 2, 1) @ matrices @ reach
        own = np.einsum("bgg->bg", law - seen)
        gradient = 0.5 * np.einsum("b,bs,bg->gs", self.count, self.basis, own).ravel()
        both = np.ix_(free, free)
        observed, here = self._curvature(law * (2.0 * seen - law))[both], place.squares[free]
        return parabola_move(observed, lambda: self._curvature(law**2)[both], gradient[free], here)

    def start(self, squares: FloatArray, free: BooleanArray) -> FloatArray:
        """White noise of the three spectra by covariances, averaged over all bins."""
        total = self.moments.T @ self.count / self.count.sum()
        walks = np.maximum([total[0] + total[1], -total[1], total[2] + total[1]], 0.01 * total[0])
        white = np.zeros((3, self.basis.shape[1]))
        white[:, STOCHASTIC_NAMES.index("angle_random_walk")] = walks / self.basis[0, 1]
        return np.where(free, white.ravel(), squares)
