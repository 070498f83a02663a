"""Fast orthogonal search (FOS): terms of a sinusoidal series, greedily, on any phase.

Korenberg's recursion needs no orthogonal functions, only inner products, and of sinusoids
on a grid of frequencies these are all values of two Fourier sums over the phase: the
data's and the sampling's. One non-uniform FFT makes each; after that nothing passes over
the samples again.

References
----------
Korenberg, Biol. Cybern. 60 (1989) 267; Korenberg and Paarmann, IEEE Signal Process. Mag.
8(3) (1991) 29; Eqs. 17-19 of Yu et al., Sensors 13 (2013) 2750.
"""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from sagnac.arrays import FloatArray
from sagnac.lines import _kernels
from sagnac.spectrum.sums import angle_sums

Stop = Literal["korenberg", "false-alarm", "none"]
# A candidate of which less than this share is new beside the chosen terms is rejected.
_DEPENDENT: Final = 1e-6
# And one of less mean square than this: the Fourier sums are good to a hundredth of it.
_LEAST_POWER: Final = 1e-7


@dataclass(frozen=True, slots=True, kw_only=True)
class OrthogonalSearch:
    """What a search chose, in order, and the series it makes.

    Attributes
    ----------
    constant, slope
        Of the terms 1 and phase (Eq. 19).
    frequencies
        (terms,) rad of argument per unit of phase.
    cosine, sine
        (terms,) coefficients of ``cos(frequency * phase)`` and sin.
    mean_square
        (terms + 1,) mean square of what is left, after constant and slope alone and after
        each pair.
    stop
        The rule it stopped by.
    """

    constant: float
    slope: float
    frequencies: FloatArray
    cosine: FloatArray
    sine: FloatArray
    mean_square: FloatArray
    stop: Stop

    def series(self, phase: FloatArray) -> FloatArray:
        """The chosen series at `phase`, (samples,)."""
        total = self.constant + self.slope * phase
        for frequency, cosine, sine in zip(self.frequencies, self.cosine, self.sine, strict=True):
            argument = frequency * phase
            total += cosine * np.cos(argument) + sine * np.sin(argument)
        return np.asarray(total)


def fast_orthogonal_search(
    phase: FloatArray,
    signal: FloatArray,
    *,
    spacing: float,
    candidates: int,
    stop: Stop = "korenberg",
    false_alarm: float = 0.05,
    most_terms: int = 40,
) -> OrthogonalSearch:
    """Choose pairs of sine and cosine that lower the mean square of `signal` most.

    Candidates are ``spacing * k``, k = 1 ... `candidates`; constant and slope are always in.
    A pair's merit is Q(cos) + Q(sin | cos), each C^2 / D of Korenberg's recursion.

    Parameters
    ----------
    phase
        (samples,) table angle or time; any spacing.
    signal
        (samples,) angle.
    spacing
        Between candidate frequencies, rad per unit of phase. 1 for the integer orders of a
        table angle in rad.
    candidates
        How many.
    stop
        ``korenberg``: when a pair brings less than 2 * 4 / (N + 1) of the mean square left
        (each of its two terms the published bound; per candidate, so that of many candidates
        of pure noise many pass). ``false-alarm``: less than 2 ln(candidates / false_alarm) / N,
        one probability for the whole set. ``none``: at `most_terms`.
    most_terms
        Pairs at most.

    Raises
    ------
    ValueError
        If an argument makes no sense.
    """
    if phase.shape != signal.shape or phase.ndim != 1:
        raise ValueError(
            f"phase has shape {phase.shape} and signal {signal.shape}; give one of each a sample"
        )
    if not (spacing > 0.0 and candidates >= 1 and most_terms >= 0):
        raise ValueError(
            f"spacing {spacing}, candidates {candidates}, most_terms {most_terms}: "
            "give positive numbers"
        )
    samples = phase.size
    # Centred and scaled, so that the line through the signal costs no precision; the recursion
    # then starts with 1 and the line, against which everything is made orthogonal.
    middle = float(phase.mean())
    half = max(float(np.abs(phase - middle).max()), np.finfo(float).tiny)
    ramp = (phase - middle) / half
    ramp_power = float(ramp @ ramp) / samples
    level = float(signal.mean())
    slope = float(ramp @ (signal - level)) / samples / ramp_power if ramp_power else 0.0
    rest = signal - level - slope * ramp
    left = float(rest @ rest) / samples
    argument = spacing * phase
    sampling = angle_sums(argument, np.ones(samples), 2 * candidates) / samples
    tilted = angle_sums(argument, ramp, candidates) / samples
    data = angle_sums(argument, rest, candidates) / samples
    state = _State(sampling=sampling, tilted=tilted, data=data, candidates=candidates)
    state.orthogonalize_to_line(ramp_power)
    errors = [left]
    bound = {
        "korenberg": 8.0 / (samples + 1),
        "false-alarm": 2.0 * np.log(candidates / false_alarm) / samples,
        "none": 0.0,
    }[stop]
    while len(state.chosen) < most_terms:
        merit = state.merit()
        best = int(np.argmax(merit))
        if merit[best] <= bound * left or merit[best] <= 0.0 or merit[best] >= left:
            break
        left -= float(merit[best])
        state.choose(best)
        errors.append(left)
    constants, cosine, sine = state.coefficients()
    slope = (slope + constants[1]) / half
    return OrthogonalSearch(
        constant=level + constants[0] - slope * middle,
        slope=slope,
        frequencies=spacing * (np.array(state.chosen, dtype=np.float64) + 1.0),
        cosine=cosine,
        sine=sine,
        mean_square=np.array(errors),
        stop=stop,
    )


class _State:
    """Inner products of every candidate with the residual and with itself, kept orthogonal.

    A function is a row of coefficients on (1, ramp, cos k1, sin k1, cos k2, ...) of the chosen
    terms. Its inner product with every candidate is a combination of shifted sampling
    sums, so nothing but those sums is stored per candidate.
    """

    def __init__(
        self,
        *,
        sampling: NDArray[np.complex128],
        tilted: NDArray[np.complex128],
        data: NDArray[np.complex128],
        candidates: int,
    ) -> None:
        # The sums are of exp(-i k); conjugates are of exp(+i k), whose real part is the cosine's.
        self.sampling = np.conj(sampling)
        self.tilted = np.conj(tilted)
        self.data = np.conj(data[1:])
        double = self.sampling[2::2][:candidates]
        self.own_cosine = 0.5 * (1.0 + double.real)
        self.own_sine = 0.5 * (1.0 - double.real)
        self.cross = 0.5 * double.imag
        whole = np.stack([self.own_cosine, self.own_sine])
        self.least = np.maximum(_DEPENDENT * whole, _LEAST_POWER)
        self.candidates = candidates
        self.chosen: list[int] = []
        self.rows: list[FloatArray] = []  # orthogonal functions
        self.power: list[float] = []  # D(r, r)
        self.shares: list[float] = []  # C(r) / D(r, r)

    def orthogonalize_to_line(self, ramp_power: float) -> None:
        """Take 1 and the ramp, in which the data have nothing left, out of all candidates."""
        self._take(np.array([1.0, 0.0]), 1.0, 0.0)
        if ramp_power > 0.0:
            self._take(np.array([0.0, 1.0]), ramp_power, 0.0)

    def merit(self) -> FloatArray:
        """(candidates,) drop in mean square that each pair would bring."""
        determinant = self.own_cosine * self.own_sine - self.cross**2
        c, s = self.data.real, self.data.imag
        joint = self.own_sine * c**2 + self.own_cosine * s**2 - 2.0 * self.cross * c * s
        usable = (
            (self.own_cosine > self.least[0])
            & (self.own_sine > self.least[1])
            & (determinant > _DEPENDENT * self.own_cosine * self.own_sine)
        )
        merit = np.where(usable, joint / np.where(usable, determinant, 1.0), 0.0)
        merit[self.chosen] = 0.0
        return merit

    def choose(self, index: int) -> None:
        """Add the pair of candidate `index`: its cosine, then its sine."""
        size = 2 + 2 * len(self.chosen)
        self.chosen.append(index)
        self.rows = [np.pad(row, (0, 2)) for row in self.rows]
        for part, is_sine in ((size, False), (size + 1, True)):
            row = np.zeros(size + 2)
            row[part] = 1.0
            # The candidate made orthogonal to every function so far.
            for other, power in zip(list(self.rows), self.power, strict=True):
                product = self._products_at(other, index)
                row -= (product.imag if is_sine else product.real) / power * other
            own = float((self.own_sine if is_sine else self.own_cosine)[index])
            shared = float((self.data.imag if is_sine else self.data.real)[index])
            self._take(row, own, shared)

    def coefficients(self) -> tuple[tuple[float, float], FloatArray, FloatArray]:
        """Coefficients of (1, ramp), of the cosines and of the sines."""
        size = 2 + 2 * len(self.chosen)
        total = np.zeros(size)
        for row, share in zip(self.rows, self.shares, strict=True):
            total += share * row
        return (float(total[0]), float(total[1])), total[2::2], total[3::2]

    def _take(self, row: FloatArray, power: float, shared: float) -> None:
        """Make every candidate, and the data, orthogonal to one more function."""
        products = _kernels.orthogonal_products(
            self.sampling, self.tilted, np.array(self.chosen, dtype=np.int64), row, self.candidates
        )
        self.rows.append(row)
        self.power.append(power)
        self.shares.append(shared / power)
        self.own_cosine -= products.real**2 / power
        self.own_sine -= products.imag**2 / power
        self.cross -= products.real * products.imag / power
        self.data -= products * (shared / power)

    def _products_at(self, row: FloatArray, index: int) -> complex:
        """Inner product of one function and exp(i) of one candidate."""
        total = row[0] * self.sampling[index + 1] + row[1] * self.tilted[index + 1]
        for term, other in enumerate(self.chosen):
            a, b = row[2 + 2 * term], row[3 + 2 * term]
            above = self.sampling[index + other + 2]
            below = self.sampling[abs(index - other)]
            below = below if index >= other else np.conj(below)
            total += 0.5 * (a - 1j * b) * above + 0.5 * (a + 1j * b) * below
        return complex(total)
