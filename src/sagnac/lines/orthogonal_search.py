"""Fast orthogonal search (FOS): terms of a series, greedily, without orthogonal functions.

Korenberg's recursion needs only inner products. Those of sinusoids on a grid of frequencies are
all values of two Fourier sums over the phase: the data's and the sampling's. One non-uniform FFT
makes each, and nothing passes over the samples again. Candidates of one's own come as a matrix,
which is passed over once for every term chosen.

References
----------
Korenberg, Biol. Cybern. 60 (1989) 267; Korenberg and Paarmann, IEEE Signal Process. Mag.
8(3) (1991) 29; Eqs. 17-19 of Yu et al., Sensors 13 (2013) 2750.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtri

from sagnac.core.arrays import ComplexArray, FloatArray, IntegerArray
from sagnac.core.errors import is_finite, quoted, refusal, require_choice, require_count
from sagnac.core.processes import GIBIBYTE, free_memory
from sagnac.recording.channel import Compared, real_numbers, whole_series
from sagnac.spectrum.sums import angle_sums

Stop = Literal["korenberg", "false-alarm", "none"]
# A candidate of which less than this share is new beside the chosen terms is rejected.
_DEPENDENT: Final = 1e-6
# Sinusoids with less mean square than this are rejected: Fourier sums are good to a hundredth.
_LEAST_POWER: Final = 1e-7
# Memory that a candidate takes as the search begins.
_BYTES: Final = 300
# A mean square below this share of the first one is rounding.
NOTHING_LEFT: Final = 1e-13


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OrthogonalSearch(Compared):
    """Choices of a search, in order, the series they make, and its settings.

    Attributes
    ----------
    constant, slope
        Of the terms 1 and phase (Eq. 19); the slope is 0 without a phase.
    chosen
        (chosen,) which candidates, counted from 0, in the order of their choice.
    coefficients
        (chosen, terms) of the terms of each: one, or the two of a pair (cosine, then sine).
    mean_square
        (chosen + 1,) mean square of what is left, after constant and slope alone and after
        each candidate.
    spacing
        Between the frequencies of the candidates, rad per unit of phase; None for a matrix.
    candidates
        Number of candidates.
    stop, false_alarm, most_terms
        The rule it stopped by, its probability, and the most candidates it might choose.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(1000) / 100.0
    >>> signal = 2.0 + 0.5 * np.cos(3.0 * time)
    >>> found = fast_orthogonal_search(time, signal, spacing=1.0, candidates=8, most_terms=1)
    >>> found.frequencies, found.cosine.round(3)
    (array([3.]), array([0.5]))
    >>> bool(np.allclose(found.series(time), signal))
    True
    """

    constant: float
    slope: float
    chosen: IntegerArray
    coefficients: FloatArray
    mean_square: FloatArray
    spacing: float | None
    candidates: int
    stop: Stop
    false_alarm: float
    most_terms: int

    def __post_init__(self) -> None:
        for array in (self.chosen, self.coefficients, self.mean_square):
            array.flags.writeable = False

    @property
    def frequencies(self) -> FloatArray:
        """(chosen,) rad of argument per unit of phase.

        Raises
        ------
        ValueError
            If the candidates were a matrix.
        """
        if self.spacing is None:
            raise ValueError("candidates of a matrix have no frequencies; read chosen instead")
        return np.asarray(self.spacing * (self.chosen + 1.0))

    @property
    def cosine(self) -> FloatArray:
        """(chosen,) coefficients of ``cos(frequency * phase)``, or of each first term."""
        return np.asarray(self.coefficients[:, 0])

    @property
    def sine(self) -> FloatArray:
        """(chosen,) coefficients of ``sin(frequency * phase)``, or of each second term."""
        return np.asarray(self.coefficients[:, 1])

    def series(self, phase: ArrayLike | None, candidates: ArrayLike | None = None) -> FloatArray:
        """The chosen series, (samples,) in the unit of the signal.

        Parameters
        ----------
        phase
            (samples,) as it was searched; None if there was none.
        candidates
            The matrix, if it was one.

        Raises
        ------
        ValueError
            If what was searched is missing here.
        """
        along = None if phase is None else np.asarray(phase, dtype=np.float64)
        if along is None and (self.spacing is not None or self.slope != 0.0):
            raise refusal("phase", "is None; the series has a slope or sinusoids along it")
        if (candidates is None) != (self.spacing is not None):
            raise refusal("candidates", "are given for a matrix, and not for sinusoids of a phase")
        total = self.constant + (0.0 if along is None else self.slope * along)
        if self.spacing is not None and along is not None:
            for frequency, cosine, sine in zip(
                self.frequencies, self.cosine, self.sine, strict=True
            ):
                argument = frequency * along
                total += cosine * np.cos(argument) + sine * np.sin(argument)
            return np.asarray(total)
        matrix = np.asarray(candidates, dtype=np.float64)
        columns = matrix.reshape(*matrix.shape[:2], -1)[:, self.chosen]
        return np.asarray(total + np.einsum("ijk,jk->i", columns, self.coefficients))


def fast_orthogonal_search(
    phase: ArrayLike | None,
    signal: ArrayLike,
    *,
    candidates: int | ArrayLike,
    spacing: float | None = None,
    stop: Stop = "korenberg",
    false_alarm: float = 0.05,
    most_terms: int = 40,
) -> OrthogonalSearch:
    """Choose those candidates, one after another, that lower the mean square of `signal` most.

    The candidates are pairs of cosine and sine of ``spacing * k * phase``, k = 1 ...
    `candidates`, or the columns of a matrix. A constant is always in, and so is a slope along the
    phase. A pair's merit is Q(cos) + Q(sin | cos), each C^2 / D of Korenberg's recursion. If what
    was chosen explains one term of a pair, or the term is zero, the pair counts by its other term.

    Parameters
    ----------
    phase
        (samples,) table angle or time; any spacing. None: no slope, for a matrix alone.
    signal
        (samples,) in any unit.
    candidates
        Number of frequencies; or (samples, candidates) one term each, or (samples, candidates, 2)
        pairs of terms that are chosen together.
    spacing
        Between candidate frequencies, rad per unit of phase. 1 for the integer orders of a
        table angle in rad. None for a matrix.
    stop
        ``korenberg``: when a candidate brings less than 4 / (N + 1) of the mean square left for
        each of its terms, the published bound. It holds for one candidate, so that among many
        candidates of pure noise many pass. ``false-alarm``: less than noise alone would bring with
        probability `false_alarm` in the whole set; for pairs 2 ln(candidates / false_alarm) / N.
        ``none``: at `most_terms`.
    false_alarm
        Between 0 and 1.
    most_terms
        Candidates chosen at most.

    Returns
    -------
    OrthogonalSearch
        Its coefficients are in the unit of the signal over that of the terms.

    Raises
    ------
    ValueError
        If an argument makes no sense, or there are more candidates than memory holds.
    MissingExtra
        If finufft is not installed, and the phase is not one even turn.

    Examples
    --------
    Orders 2 and 5 of an angle that turns unevenly:

    >>> import numpy as np
    >>> time = np.arange(1000) / 100.0
    >>> angle = 3.0 * time + np.sin(time)
    >>> signal = 0.5 * np.cos(2.0 * angle) + 0.2 * np.sin(5.0 * angle)
    >>> found = fast_orthogonal_search(angle, signal, spacing=1.0, candidates=8, most_terms=2)
    >>> found.frequencies
    array([2., 5.])

    Candidates of one's own, such as temperatures:

    >>> own = np.stack([time**2, np.sqrt(time), np.cos(2.0 * angle)], axis=1)
    >>> found = fast_orthogonal_search(time, signal, candidates=own, most_terms=1)
    >>> found.chosen
    array([2])
    >>> found.coefficients.round(2)
    array([[0.5]])
    """
    values = whole_series(signal, "signal")
    along = None if phase is None else whole_series(phase, "phase")
    _check(along, values, spacing, candidates)
    require_rule(stop, false_alarm, most_terms)
    # The line that is always in; the phase is centred and scaled, so that it costs no precision.
    middle, half, ramp = 0.0, 1.0, np.zeros(values.size)
    if along is not None:
        middle = float(along.mean())
        half = max(float(np.abs(along - middle).max()), np.finfo(float).tiny)
        ramp = (along - middle) / half
    ramp_power = float(ramp @ ramp) / values.size
    level = float(values.mean())
    slope = float(ramp @ (values - level)) / values.size / ramp_power if ramp_power else 0.0
    rest = values - level - slope * ramp
    if along is not None and spacing is not None:
        search = _sinusoid_search(spacing * along, ramp, rest, int(np.asarray(candidates)))
    else:
        search = _column_search(np.asarray(candidates, dtype=np.float64), ramp, rest)
    search.take(np.array([1.0, 0.0]), search.with_one, 1.0, 0.0)
    if ramp_power > 0.0:
        search.take(np.array([0.0, 1.0]), search.with_ramp, ramp_power, 0.0)
    count = search.data.size
    sizes = {"terms": search.terms, "candidates": count, "samples": values.size}
    bound = share_to_bring(stop, false_alarm, **sizes)
    choose_all(search.best, search.choose, search.mean_square, bound, most_terms)
    total = search.coefficients()
    slope = (slope + float(total[1])) / half
    return OrthogonalSearch(
        constant=level + float(total[0]) - slope * middle,
        slope=slope,
        chosen=np.array(search.chosen, dtype=np.int64),
        coefficients=total[2:].reshape(-1, 2)[:, : search.terms],
        mean_square=np.array(search.mean_square),
        spacing=spacing,
        candidates=count,
        stop=stop,
        false_alarm=false_alarm,
        most_terms=most_terms,
    )


def _check(
    phase: FloatArray | None, signal: FloatArray, spacing: float | None, candidates: int | ArrayLike
) -> None:
    """Refuse arrays and frequencies that make no sense."""
    if signal.size == 0:
        raise refusal("signal", f"has shape {signal.shape}; give (samples,)")
    if phase is not None and phase.shape != signal.shape:
        shapes = f"has shape {phase.shape} and signal {signal.shape}"
        raise refusal("phase", f"{shapes}; give one of each a sample")
    if np.ndim(candidates) > 0:
        matrix = real_numbers(candidates, "candidates")
        if not np.isfinite(matrix).all():
            raise refusal("candidates", "has values that are not finite; leave these samples out")
        if spacing is not None:
            raise refusal("spacing", f"is {spacing}, and candidates is a matrix; give one of them")
        fits = matrix.ndim == 2 or (matrix.ndim == 3 and matrix.shape[2] in {1, 2})
        if not fits or matrix.shape[0] != signal.size or matrix.shape[1] == 0:
            wanted = f"({signal.size}, candidates), or ({signal.size}, candidates, 2) for pairs"
            raise refusal("candidates", f"has shape {matrix.shape}; give {wanted}")
        return
    if phase is None:
        raise refusal("phase", "is None; sinusoids need one (a matrix of candidates does not)")
    count = np.asarray(candidates).item()
    require_count("candidates", count, 1)
    free = free_memory()
    if _BYTES * count > free:
        needed = f"{_BYTES * count / GIBIBYTE:.3g} GiB of memory are needed"
        there = f"{free / GIBIBYTE:.3g} are free; give {int(free / _BYTES)} or fewer"
        raise refusal("candidates", f"is {count}, for which {needed}, and {there}")
    if spacing is None or not (is_finite(spacing) and spacing > 0.0):
        raise refusal("spacing", f"is {quoted(spacing)}; give a number above zero")


def require_rule(stop: Stop, false_alarm: float, most_terms: int) -> None:
    """Refuse a rule that makes no sense.

    Raises
    ------
    ValueError
        If the stop is none of its choices, or a number is out of range.
    """
    require_choice("stop", stop, Stop)
    if not (is_finite(false_alarm) and 0.0 < false_alarm < 1.0):
        raise refusal("false_alarm", f"is {quoted(false_alarm)}; give a number between 0 and 1")
    require_count("most_terms", most_terms, 0)


def share_to_bring(
    stop: Stop, false_alarm: float, *, terms: int, candidates: int, samples: int
) -> float:
    """Least share of the mean square left that a candidate has to bring.

    Parameters
    ----------
    stop, false_alarm
        As `fast_orthogonal_search` takes them.
    terms
        Of a candidate: 1, or 2 for pairs.
    candidates
        Independent ones in the whole set.
    samples
        Of the signal.
    """
    if stop == "none":
        return 0.0
    if stop == "korenberg":
        return 4.0 * terms / (samples + 1)
    return float(chdtri(terms, false_alarm / candidates)) / samples


Best = Callable[[], tuple[float, int]]


def choose_all(
    best: Best, choose: Callable[[int], None], left: list[float], bound: float, most_terms: int
) -> None:
    """Choose until the best candidate brings too little of what is left.

    Parameters
    ----------
    best
        Gives the greatest drop of the mean square that a candidate would bring, and which.
    choose
        Chooses a candidate, or rejects it for good if too little of it is new.
    left
        Mean square left, at first and after each candidate chosen.
    bound
        Share of what is left that a candidate has to bring.
    most_terms
        Candidates chosen at most.
    """
    while len(left) <= most_terms and left[-1] > NOTHING_LEFT * left[0]:
        brought, index = best()
        if brought <= bound * left[-1] or brought <= 0.0:
            break
        choose(index)


@dataclass(slots=True, kw_only=True)
class _Search:
    """Inner products of every candidate with what is left and with itself, kept orthogonal.

    A candidate's two terms are one complex number: the first is its real part, the second its
    imaginary part (0 if it has one term). Inner products are means over the samples.

    Attributes
    ----------
    terms
        Of each candidate: 1, or 2 for pairs.
    data
        (candidates,) complex, with the signal without what was chosen.
    own, cross
        (2, candidates) mean squares of both terms, and (candidates,) mean of their product, less
        what chosen functions hold of them.
    least
        (2, candidates) mean squares below which a term is rejected.
    with_one, with_ramp
        (candidates,) complex, with the constant and with the slope's function.
    with_term
        Gives those with one term (0 or 1) of one candidate.
    mean_square
        What is left, at first and after each candidate.
    chosen
        Candidates, in the order of their choice.
    functions
        For each orthogonal function its coefficients on 1, the ramp and the chosen terms, its
        products with all candidates, its mean square, and its share of the signal.
    """

    terms: int
    data: ComplexArray
    own: FloatArray
    cross: FloatArray
    least: FloatArray
    with_one: ComplexArray
    with_ramp: ComplexArray
    with_term: Callable[[int, int], ComplexArray]
    mean_square: list[float]
    chosen: list[int] = field(default_factory=list)
    functions: list[tuple[FloatArray, ComplexArray, float, float]] = field(default_factory=list)

    def best(self) -> tuple[float, int]:
        """Greatest drop of the mean square that a candidate would bring, and which."""
        (first, second), (c, s) = self.own, (self.data.real, self.data.imag)
        usable = self.own > self.least
        merit = np.divide(c**2, first, out=np.zeros(c.size), where=usable[0])
        if self.terms == 2:
            alone = np.divide(s**2, second, out=np.zeros(c.size), where=usable[1])
            below = first * second - self.cross**2
            above = second * c**2 + first * s**2 - 2.0 * self.cross * c * s
            both = usable.all(axis=0) & (below > _DEPENDENT * first * second)
            merit = np.divide(above, below, out=np.maximum(merit, alone), where=both)
        merit[self.chosen] = 0.0
        index = int(np.argmax(merit))
        return float(merit[index]), index

    def choose(self, index: int) -> None:
        """Take the terms of a candidate, one after the other."""
        size, left = 2 + 2 * len(self.chosen), self.mean_square[-1]
        self.chosen.append(index)
        for term in range(self.terms):
            if not self.own[term, index] > self.least[term, index]:
                continue
            row = np.zeros(size + 2)
            row[size + term] = 1.0
            products = self.with_term(index, term).copy()
            for other, with_all, power, _ in self.functions:
                share = with_all.view(np.float64)[2 * index + term] / power
                row[: other.size] -= share * other
                products -= share * with_all
            shared = float(self.data.view(np.float64)[2 * index + term])
            power = float(self.own[term, index])
            left -= shared**2 / power
            self.take(row, products, power, shared)
        # A candidate that brings all that is left brings more by rounding as often as less.
        self.mean_square.append(max(left, 0.0))

    def take(self, row: FloatArray, products: ComplexArray, power: float, shared: float) -> None:
        """Make every candidate, and the data, orthogonal to one more function."""
        self.functions.append((row, products, power, shared / power))
        self.own[0] -= products.real**2 / power
        self.own[1] -= products.imag**2 / power
        self.cross -= products.real * products.imag / power
        self.data -= products * (shared / power)

    def coefficients(self) -> FloatArray:
        """(2 + 2 chosen,) coefficients of 1, of the ramp, and of the terms of each candidate."""
        total = np.zeros(2 + 2 * len(self.chosen))
        for row, _, _, share in self.functions:
            total[: row.size] += share * row
        return total


def _sinusoid_search(phase: FloatArray, ramp: FloatArray, rest: FloatArray, size: int) -> _Search:
    """A search of pairs ``cos(k * phase)``, ``sin(k * phase)``, k = 1 ... `size`."""

    # The sums are of exp(-i k); conjugates are of exp(+i k), whose real part is the cosine's.
    def sums(strengths: FloatArray, orders: int) -> ComplexArray:
        return angle_sums(phase, strengths, orders).conj() / phase.size

    sampling = sums(np.ones(phase.size), 2 * size)
    tilted, data = sums(ramp, size), sums(rest, size)
    double = sampling[2::2][:size]
    # Means of exp(i k phase) from k = -size on: a product of two terms shifts them.
    around = np.concatenate([np.conj(sampling[size:0:-1]), sampling])

    def with_term(index: int, term: int) -> ComplexArray:
        up, down = around[size + index + 2 :][:size], around[size - index :][:size]
        return np.asarray(0.5j * (down - up) if term else 0.5 * (down + up))

    own = np.stack([0.5 * (1.0 + double.real), 0.5 * (1.0 - double.real)])
    return _Search(
        terms=2,
        data=data[1:],
        own=own,
        cross=0.5 * double.imag,
        mean_square=[float(rest @ rest) / rest.size],
        least=np.maximum(_DEPENDENT * own, _LEAST_POWER),
        with_one=sampling[1 : size + 1],
        with_ramp=tilted[1:],
        with_term=with_term,
    )


def _column_search(matrix: FloatArray, ramp: FloatArray, rest: FloatArray) -> _Search:
    """A search of the columns of a (samples, candidates[, terms]) matrix, alone or in pairs."""
    samples, size = matrix.shape[:2]
    columns = np.zeros((samples, size, 2))
    columns[:, :, : matrix.shape[2] if matrix.ndim == 3 else 1] = matrix.reshape(samples, size, -1)

    def products(values: FloatArray) -> ComplexArray:
        return np.asarray((values @ columns.reshape(samples, -1) / samples).view(np.complex128))

    mean = products(np.ones(samples))
    own = np.einsum("ijk,ijk->kj", columns, columns) / samples
    # A large mean hides no dependence: the constant is always in.
    whole = own - np.stack([mean.real**2, mean.imag**2])
    # A column that is constant to 1e-12 of its mean square is one, and a pair's weaker term may be
    # its stronger one's rounding.
    least_power = np.maximum(1e-12 * own, _LEAST_POWER * whole.max(axis=0))
    return _Search(
        terms=matrix.shape[2] if matrix.ndim == 3 else 1,
        data=products(rest),
        own=own,
        cross=np.einsum("ij,ij->j", columns[:, :, 0], columns[:, :, 1]) / samples,
        mean_square=[float(rest @ rest) / samples],
        least=np.maximum(_DEPENDENT * whole, least_power),
        with_one=mean,
        with_ramp=products(ramp),
        with_term=lambda index, term: products(columns[:, index, term]),
    )
