"""Laws of slow noise beside flicker of 1/f and a walk of 1/f^2, and what each makes of a spectrum.

A fit of Q, N, B and K takes slow noise to be 1/f and 1/f^2 at every frequency. That of a sensor is
often nearly so: flicker ends at its fastest relaxation, falls a little less or more steeply than
1/f, or a walk is a Markov rate that is level at the lowest frequencies. The spectrum hardly
departs from the four terms then, but they have too much or too little of it at higher frequencies,
which N makes up for, and B and K describe noise that is not theirs. So several laws are fitted, and
each is weighted by how likely the data are under it.
"""

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from scipy.special import ndtr

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.noise.laws import STOCHASTIC_NAMES, flicker_share, rate_density_basis

QUANTIZATION: Final = STOCHASTIC_NAMES.index("quantization")
WALK: Final = STOCHASTIC_NAMES.index("angle_random_walk")
FLICKER: Final = STOCHASTIC_NAMES.index("bias_instability")
RATE_WALK: Final = STOCHASTIC_NAMES.index("rate_random_walk")
# Lowest frequency at which the low-pass of a sensor may begin, Hz. What falls below it is a Markov
# rate: those of gyros last from a second to hours.
LOW_PASS: Final = 0.2
# Standard errors below zero up to which the square of Q may lie by chance.
_MOST_BELOW: Final = 4.0
# Slopes of flicker besides 1.
_SLOPES: Final = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.1, 1.2, 1.3, 1.4, 1.5)


class SlowLaw(NamedTuple):
    """What flicker and a walk of the rate are; by default 1/f and 1/f^2.

    Attributes
    ----------
    end
        Frequency above which flicker falls twice as steeply, Hz (`flicker_share`).
    slope
        The density of flicker falls as f to the power of minus this; other than 1, B is no bias
        instability.
    corner
        Frequency below which the walk is level, Hz: a Markov rate.
    sharp
        Sample interval before which a sharp filter keeps flicker 1/f up to half the sample rate, s;
        0 if each sample is its average (`rate_density_basis`).
    """

    end: float = math.inf
    slope: float = 1.0
    corner: float = 0.0
    sharp: float = 0.0

    def shares(self, frequency: FloatArray) -> FloatArray:
        """(points, 4) factors on the densities of Q, N, B and K at frequencies (points,), Hz."""
        shares = np.ones((frequency.size, len(STOCHASTIC_NAMES)))
        shares[:, FLICKER] = flicker_share(frequency, self.end) * frequency ** (1.0 - self.slope)
        if self.sharp:
            averaged = rate_density_basis(frequency, self.sharp)[:, FLICKER]
            shares[:, FLICKER] /= np.pi * frequency * averaged
        shares[:, RATE_WALK] = 1.0 / (1.0 + (self.corner / frequency) ** 2)
        return shares

    def in_words(self) -> str:
        """Phrase for a person: ``B that ends at about 0.8 Hz``; empty for 1/f and 1/f^2."""
        if math.isfinite(self.end):
            return f"B that ends at about {self.end:.2g} Hz"
        if self.slope != 1.0:
            return f"noise of f^-{self.slope:.1f} in place of B"
        if self.sharp:
            return "B that is 1/f up to half the sample rate"
        return f"K that is level below about {self.corner:.2g} Hz" if self.corner > 0.0 else ""


PLAIN: Final = SlowLaw()


def laws_to_try(frequency: FloatArray, interval: float) -> dict[SlowLaw, float]:
    """Laws of which a spectrum at frequencies (points,), Hz, can tell, and the chance of each.

    Samples are an interval apart, s.
    """
    lowest, highest = float(frequency[0]), float(frequency[-1])
    # Ends that leave flicker to be seen, an octave apart; corners that leave a walk, half an octave
    # apart, since they are sharper: N and Q make up for what the nearest one lacks.
    octaves = 2.0 ** np.arange(math.ceil(math.log2(highest / lowest)))
    halves = np.union1d(octaves, math.sqrt(2.0) * octaves)
    ends, corners = (2.0 * highest / octaves).tolist(), (2.0 * lowest * halves).tolist()
    # Beside the chance of each kind before the data are asked, chosen on sums of Markov rates and
    # on 1/f of both kinds.
    kinds = (
        (0.15, [PLAIN]),
        (0.15, [SlowLaw(sharp=interval)]),
        (0.25, [SlowLaw(end=one) for one in ends if one > 8.0 * lowest]),
        (0.2, [SlowLaw(slope=one, sharp=sharp) for one in _SLOPES for sharp in (0.0, interval)]),
        (0.25, [SlowLaw(corner=one) for one in corners if one < highest / 8.0]),
    )
    return {law: chance / len(tried) for chance, tried in kinds for law in tried}


def corners_beside(law: SlowLaw, chance: float) -> dict[SlowLaw, float]:
    """Corners an eighth of an octave apart about that of a law, each with a quarter of its chance.

    A strong Markov rate tells corners a tenth apart, and N takes up what half an octave leaves.
    None is tried from `LOW_PASS` on, where the spectrum may as well be that of a low-pass.
    """
    is_markov = 0.0 < law.corner < LOW_PASS
    corners = law.corner * 2.0 ** (np.arange(-3, 4) / 8.0) if is_markov else np.empty(0)
    return {law._replace(corner=one): 0.25 * chance for one in corners.tolist()}


@dataclass(frozen=True, slots=True, kw_only=True)
class SlowLaws:
    """Fits of Q, N, B and K by several laws, 1/f and 1/f^2 first.

    Attributes
    ----------
    laws
        Of each.
    prior
        (laws,) chance of each before the data are asked.
    squares, errors
        (laws, 4) squared coefficients, SI, and their standard errors.
    deviance
        (laws,) -2 log likelihood.
    """

    laws: tuple[SlowLaw, ...]
    prior: FloatArray
    squares: FloatArray
    errors: FloatArray
    deviance: FloatArray

    @property
    def weight(self) -> FloatArray:
        """(laws,) probability of each whose N is above zero, and so is what its law is of.

        A law beside which the square of Q is four errors below zero has none: that is the fall of a
        low-pass, where it was 20 to 70 errors below.
        """
        column = [RATE_WALK if law.corner > 0.0 else FLICKER for law in self.laws]
        stands = self.squares[np.arange(len(self.laws)), column] > 0.0
        stands &= self.squares[:, QUANTIZATION] > -_MOST_BELOW * self.errors[:, QUANTIZATION]
        stands[0] = True
        stands &= self.squares[:, WALK] > 0.0
        best = self.deviance[stands].min(initial=math.inf)
        prior = self.prior * self._chance_of_readout
        weight = stands * prior * np.exp(-0.5 * np.maximum(self.deviance - best, 0.0))
        return np.asarray(weight / max(float(weight.sum()), 1e-300))

    @property
    def _chance_of_readout(self) -> FloatArray:
        """(laws,) mean likelihood of a law over all that its Q may be, in units of its highest.

        There is no Q with a chance of half; the other half is spread evenly over four decades of
        its square. It was chosen once, and tried on the slow noise of `tests/noise/test_slow_laws`.
        """
        errors = np.maximum(
            self.squares[:, QUANTIZATION] / self.errors[:, QUANTIZATION], -_MOST_BELOW
        )
        some = math.sqrt(2.0 * math.pi) / math.log(1e4) * ndtr(errors) / np.maximum(errors, 1.0)
        return np.asarray(np.exp(-0.5 * errors**2) + some)

    @property
    def seen(self) -> int:
        """Row of the law that the data show; 0 if they show no other than the first."""
        best = int(np.argmax(self.weight))
        # A gain of twice the logarithm of the likelihood of 6 is 2.5 standard deviations.
        return best if self.deviance[best] < self.deviance[0] - 6.0 else 0

    @property
    def lowest_end(self) -> float:
        """Frequency below which flicker ends with a chance of a fortieth, Hz; else infinite."""
        ends = np.array([law.end for law in self.laws])
        order = np.argsort(ends, kind="stable")
        reached = np.cumsum(self.weight[order]) >= 0.025
        return float(ends[order][reached][0]) if reached.any() else math.inf

    def holding(self, column: int) -> BooleanArray:
        """(laws,) those in which a column is the noise of its name."""
        slope = np.array([law.slope for law in self.laws])
        corner = np.array([law.corner for law in self.laws])
        every = np.ones(len(self.laws), dtype=np.bool_)
        return np.asarray({FLICKER: slope == 1.0, RATE_WALK: corner == 0.0}.get(column, every))
