"""Inner products of the candidates of an orthogonal search with what it has chosen.

Both kinds hold a candidate's two terms as one complex number: the first as its real part, the
second as its imaginary part. Inner products are means over the samples. Each has

`size`, `terms`
    Number of candidates, and terms of each: 1, or 2 for pairs.
`data`
    (candidates,) complex inner products with the signal without its line.
`own_first`, `own_second`, `cross`
    (candidates,) mean squares of both terms, and of their product.
`whole`
    (2, candidates) mean squares that the dependence on other terms is judged by.
`least_power`
    (2, candidates) mean squares below which a term is rejected.

A function is a row of coefficients on 1, the ramp, and the terms of each candidate chosen, two
apiece.
"""

from typing import Final

import numpy as np

from sagnac.core.arrays import ComplexArray, FloatArray
from sagnac.lines import _kernels
from sagnac.spectrum.sums import angle_sums, even_turn_sums, is_even_turn

# Sinusoids with less mean square than this are rejected: Fourier sums are good to a hundredth.
_LEAST_POWER: Final = 1e-7
# A column that is constant to this share of its mean square is one.
_CONSTANT: Final = 1e-12


class SinusoidProducts:
    """Pairs ``cos(k * argument)``, ``sin(k * argument)``, k = 1 ... `size`.

    Parameters
    ----------
    argument
        (samples,) rad.
    ramp, rest
        (samples,) the slope's function, and the signal without its line.
    size
        Number of pairs.
    """

    terms = 2

    def __init__(self, argument: FloatArray, ramp: FloatArray, rest: FloatArray, size: int) -> None:
        samples = argument.size
        if is_even_turn(argument):
            # Time in a whole record: exact, and needs no package.
            sampling, tilted, data = (
                even_turn_sums(strengths, orders) / samples
                for strengths, orders in ((np.ones(samples), 2 * size), (ramp, size), (rest, size))
            )
        else:
            sampling = angle_sums(argument, np.ones(samples), 2 * size) / samples
            tilted = angle_sums(argument, ramp, size) / samples
            data = angle_sums(argument, rest, size) / samples
        # The sums are of exp(-i k); conjugates are of exp(+i k), whose real part is the cosine's.
        self._sampling = np.conj(sampling)
        self._tilted = np.conj(tilted)
        self._chosen: list[int] = []
        self.size = size
        self.data = np.conj(data[1:])
        double = self._sampling[2::2][:size]
        self.own_first = 0.5 * (1.0 + double.real)
        self.own_second = 0.5 * (1.0 - double.real)
        self.cross = 0.5 * double.imag
        self.whole = np.stack([self.own_first, self.own_second])
        self.least_power = np.full_like(self.whole, _LEAST_POWER)

    def choose(self, index: int) -> None:
        """Let functions hold this pair as well."""
        self._chosen.append(index)

    def all(self, row: FloatArray) -> ComplexArray:
        """(candidates,) inner products of all pairs with one function: shifted sampling sums."""
        chosen = np.array(self._chosen, dtype=np.int64)
        return _kernels.orthogonal_products(self._sampling, self._tilted, chosen, row, self.size)


class MatrixProducts:
    """Columns of a matrix, alone or in pairs.

    Parameters
    ----------
    matrix
        (samples, candidates), or (samples, candidates, terms) with one or two terms.
    ramp, rest
        (samples,) the slope's function, and the signal without its line.
    """

    def __init__(self, matrix: FloatArray, ramp: FloatArray, rest: FloatArray) -> None:
        samples, self.size = matrix.shape[:2]
        self.terms = matrix.shape[2] if matrix.ndim == 3 else 1
        self._columns = matrix.reshape(samples, -1)
        self.data = self._with(rest)
        # Products of 1, of the ramp and of every chosen term with all candidates.
        self._known = [self._with(np.ones(samples)), self._with(ramp)]
        squares = np.einsum("ij,ij->j", self._columns, self._columns) / samples
        self.own_first = squares[:: self.terms].copy()
        self.own_second, self.cross = np.zeros((2, self.size))
        if self.terms == 2:
            first, second = self._columns[:, 0::2], self._columns[:, 1::2]
            self.own_second = squares[1::2].copy()
            self.cross = np.einsum("ij,ij->j", first, second) / samples
        # A large mean hides no dependence: the constant is always in.
        mean = self._known[0]
        powers = np.stack([self.own_first, self.own_second])
        self.whole = powers - np.stack([mean.real**2, mean.imag**2])
        # A pair's weaker term may be its stronger one's rounding.
        self.least_power = np.maximum(_CONSTANT * powers, _LEAST_POWER * self.whole.max(axis=0))

    def choose(self, index: int) -> None:
        """Let functions hold the terms of this candidate as well: one pass over the matrix."""
        for term in range(2):
            if term < self.terms:
                self._known.append(self._with(self._columns[:, index * self.terms + term]))
            else:
                self._known.append(np.zeros(self.size, dtype=np.complex128))

    def all(self, row: FloatArray) -> ComplexArray:
        """(candidates,) inner products of all candidates with one function."""
        total = np.zeros(self.size, dtype=np.complex128)
        for coefficient, products in zip(row, self._known, strict=True):
            total += coefficient * products
        return total

    def _with(self, values: FloatArray) -> ComplexArray:
        """(candidates,) inner products of the terms of all candidates with `values`."""
        products = (values @ self._columns / values.size).reshape(self.size, self.terms)
        if self.terms == 1:
            return products[:, 0].astype(np.complex128)
        return products[:, 0] + 1j * products[:, 1]


CandidateProducts = SinusoidProducts | MatrixProducts
