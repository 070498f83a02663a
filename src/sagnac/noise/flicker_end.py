"""Flicker that may end in the band, and what N, Q and K are then.

Where flicker is a sum of relaxations that has a fastest one, as a sum of Markov rates, its density
falls twice as steeply above (`laws.flicker_share`). A fit without an end takes from N what that
lacks, and hardly departs from the spectrum. So each end is tried, and weighs what the levels say.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac.core.arrays import FloatArray
from sagnac.noise.band_models import FLICKER, WALK, BandModel
from sagnac.noise.laws import flicker_share, level_laws
from sagnac.noise.likelihood import Ordinates, scaled_covariance
from sagnac.spectrum.levels import Levels

# Ends an octave apart, down to where next to nothing of the flicker is left in any band.
_OCTAVES: Final = 14
# Chance, before the data are asked, that flicker goes on beyond the band, as in most sensors.
_ENDLESS: Final = 0.3
# Gain of twice the logarithm of the likelihood from which on an end is seen: two and a half
# standard deviations.
_SEEN: Final = 6.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FlickerEnds:
    """Fits of Q, N, B and K to a whole spectrum, each with another end of the flicker.

    Attributes
    ----------
    end
        (ends,) Hz, the first infinite.
    squares, errors
        (ends, 4) squared coefficients, SI, and their standard errors.
    deviance
        (ends,) -2 log likelihood.
    """

    end: FloatArray
    squares: FloatArray
    errors: FloatArray
    deviance: FloatArray

    @property
    def weight(self) -> FloatArray:
        """(ends,) probability of each whose N and B are above zero, or of no end alone."""
        prior = np.full(self.end.size, (1.0 - _ENDLESS) / (self.end.size - 1))
        prior[0] = _ENDLESS
        stands = np.all(self.squares[:, [WALK, FLICKER]] > 0.0, axis=1)
        if not stands[0]:
            return np.asarray(np.arange(stands.size) == 0, dtype=np.float64)
        weight = stands * prior * np.exp(-0.5 * (self.deviance - self.deviance.min()))
        return np.asarray(weight / weight.sum())

    def law(self, interval: float) -> BandModel | None:
        """The most probable one, of angles an interval (s) apart; None if the end is not seen."""
        row = int(np.argmax(self.weight))
        if not self.deviance[row] < self.deviance[0] - _SEEN:
            return None
        squares, end = tuple(self.squares[row].tolist()), float(self.end[row])
        return BandModel(squares=squares, interval=interval, flicker_end=end)


def flicker_ends(levels: Levels) -> FlickerEnds:
    """Fit Q, N, B and K to all bins for every end of the flicker that matters.

    Parameters
    ----------
    levels
        Of a spectrum that the four terms describe.
    """
    ends = np.array([math.inf, *(2.0 * levels.high[-1] * 0.5 ** np.arange(_OCTAVES))])
    fits = []
    for end in ends:
        basis = level_laws(levels).copy()
        basis[:, FLICKER] *= flicker_share(levels.frequency, end)
        weight = 2.0 * levels.shape
        data = Ordinates(
            basis=basis,
            power=levels.level,
            count=weight,
            weight=weight,
            frequency=levels.frequency,
        )
        scale, covariance = scaled_covariance(data.fisher(data.best))
        fits.append((data.best.squares, scale * np.sqrt(covariance.diagonal()), data.best.deviance))
    squares, errors, deviance = (np.array(each) for each in zip(*fits, strict=True))
    return FlickerEnds(end=ends, squares=squares, errors=errors, deviance=deviance)
