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

import math
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtri

from sagnac.core.arrays import ComplexArray, FloatArray, IntegerArray
from sagnac.core.errors import quoted
from sagnac.lines.candidate_products import (
    CandidateProducts,
    MatrixProducts,
    SinusoidProducts,
)

Stop = Literal["korenberg", "false-alarm", "none"]
STOPS: Final[tuple[Stop, ...]] = get_args(Stop)
# A candidate of which less than this share is new beside the chosen terms is rejected.
_DEPENDENT: Final = 1e-6
NOTHING_LEFT: Final = 1e-13
"""A mean square below this share of the first one is rounding."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OrthogonalSearch:
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

    Raises
    ------
    ValueError
        If the sizes do not agree.

    Examples
    --------
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
        count = self.chosen.size
        if len(self.coefficients) != count or self.mean_square.shape != (count + 1,):
            raise ValueError(
                f"chosen, coefficients and mean_square have shapes {self.chosen.shape}, "
                f"{self.coefficients.shape} and {self.mean_square.shape}; they do not go together"
            )
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
            raise ValueError("phase is None; the series has a slope or sinusoids along it")
        if (candidates is None) != (self.spacing is not None):
            raise ValueError("candidates are given for a matrix, and not for sinusoids of a phase")
        total: FloatArray | float = self.constant
        if along is not None:
            total = self.constant + self.slope * along
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
    phase. A pair's merit is Q(cos) + Q(sin | cos), each C^2 / D of Korenberg's recursion.

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
        If an argument makes no sense.
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
    checked = np.asarray(signal, dtype=np.float64)
    along = None if phase is None else np.asarray(phase, dtype=np.float64)
    _check(along, checked, spacing, candidates)
    require_rule(stop, false_alarm, most_terms)
    line = _line_through(along, checked)
    products = _products(along, line, candidates, spacing)
    state = _State(products)
    state.orthogonalize_to_line(line.ramp_power)
    bound = share_to_bring(
        stop,
        false_alarm,
        terms=products.terms,
        candidates=products.size,
        samples=checked.size,
    )
    mean_square = state.choose_all(line.mean_square, bound, most_terms)
    total = state.coefficients()
    slope = (line.slope + float(total[1])) / line.half
    return OrthogonalSearch(
        constant=line.level + float(total[0]) - slope * line.middle,
        slope=slope,
        chosen=np.array(state.chosen, dtype=np.int64),
        coefficients=total[2:].reshape(-1, 2)[:, : products.terms],
        mean_square=mean_square,
        spacing=spacing,
        candidates=products.size,
        stop=stop,
        false_alarm=false_alarm,
        most_terms=most_terms,
    )


def _check(
    phase: FloatArray | None,
    signal: FloatArray,
    spacing: float | None,
    candidates: int | ArrayLike,
) -> None:
    """Refuse arrays and frequencies that make no sense."""
    if signal.ndim != 1 or signal.size == 0:
        raise ValueError(f"signal has shape {signal.shape}; give (samples,)")
    if phase is not None and phase.shape != signal.shape:
        raise ValueError(
            f"phase has shape {phase.shape} and signal {signal.shape}; give one of each a sample"
        )
    for name, given in (("phase", phase), ("signal", signal)):
        if given is not None and not np.isfinite(given).all():
            raise ValueError(f"{name} has values that are not finite; leave these samples out")
    if not isinstance(candidates, int | np.integer):
        _check_matrix(np.asarray(candidates, dtype=np.float64), signal, spacing)
        return
    if phase is None:
        raise ValueError("phase is None; sinusoids need one (a matrix of candidates does not)")
    if spacing is None or not (spacing > 0.0 and math.isfinite(spacing)) or candidates < 1:
        raise ValueError(f"spacing {spacing}, candidates {candidates}: give positive numbers")


def _check_matrix(matrix: FloatArray, signal: FloatArray, spacing: float | None) -> None:
    """Refuse a matrix of candidates that makes no sense."""
    if spacing is not None:
        raise ValueError(f"spacing is {spacing}, and candidates is a matrix; give one of them")
    fits = matrix.ndim == 2 or (matrix.ndim == 3 and matrix.shape[2] in {1, 2})
    if not fits or matrix.shape[0] != signal.size or matrix.shape[1] == 0:
        raise ValueError(
            f"candidates has shape {matrix.shape}; give ({signal.size}, candidates), or "
            f"({signal.size}, candidates, 2) for pairs"
        )
    if not np.isfinite(matrix).all():
        raise ValueError("candidates has values that are not finite; leave these samples out")


def require_rule(stop: Stop, false_alarm: float, most_terms: int) -> None:
    """Refuse a rule that makes no sense.

    Raises
    ------
    ValueError
        If the stop is none of `STOPS`, or a number is out of range.
    """
    if stop not in STOPS:
        raise ValueError(f"stop is {quoted(stop)}; use one of {', '.join(STOPS)}")
    if not 0.0 < false_alarm < 1.0:
        raise ValueError(f"false_alarm is {false_alarm!r}; give a probability between 0 and 1")
    if most_terms < 0:
        raise ValueError(f"most_terms {most_terms}: give 0 or more")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Line:
    """Least squares of a constant and a slope.

    Attributes
    ----------
    level, slope
        ``level + slope * ramp``.
    ramp, ramp_power
        (samples,) the phase centred and scaled to 1, so that the line costs no precision, or
        zeros; and its mean square.
    middle, half
        ``phase = middle + half * ramp``.
    rest, mean_square
        (samples,) of the signal without the line, and its mean square.
    """

    level: float
    slope: float
    ramp: FloatArray
    ramp_power: float
    middle: float
    half: float
    rest: FloatArray
    mean_square: float


def _line_through(phase: FloatArray | None, signal: FloatArray) -> _Line:
    """The line that the recursion starts with, against which everything is made orthogonal."""
    samples = signal.size
    middle, half, ramp = 0.0, 1.0, np.zeros(samples)
    if phase is not None:
        middle = float(phase.mean())
        half = max(float(np.abs(phase - middle).max()), np.finfo(float).tiny)
        ramp = (phase - middle) / half
    ramp_power = float(ramp @ ramp) / samples
    level = float(signal.mean())
    slope = float(ramp @ (signal - level)) / samples / ramp_power if ramp_power else 0.0
    rest = signal - level - slope * ramp
    return _Line(
        level=level,
        slope=slope,
        ramp=ramp,
        ramp_power=ramp_power,
        middle=middle,
        half=half,
        rest=rest,
        mean_square=float(rest @ rest) / samples,
    )


def _products(
    phase: FloatArray | None, line: _Line, candidates: int | ArrayLike, spacing: float | None
) -> CandidateProducts:
    """Inner products of the candidates, which `_check` has let through."""
    if phase is not None and spacing is not None:
        return SinusoidProducts(spacing * phase, line.ramp, line.rest, int(np.asarray(candidates)))
    return MatrixProducts(np.asarray(candidates, dtype=np.float64), line.ramp, line.rest)


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
    if terms == 1:
        return float(chdtri(1, false_alarm / candidates)) / samples
    return float(2.0 * np.log(candidates / false_alarm) / samples)


class _State:
    """Inner products of every candidate with the residual and with itself, kept orthogonal.

    A function is a row of coefficients on (1, ramp, first k1, second k1, first k2, ...) of the
    chosen terms. Its inner products with all candidates come from `CandidateProducts`, so that no
    orthogonal function is ever made. The second term of single candidates is 0 throughout.
    """

    def __init__(self, products: CandidateProducts) -> None:
        self.products = products
        self.data = products.data.copy()
        self.own_first = products.own_first.copy()
        self.own_second = products.own_second.copy()
        self.cross = products.cross.copy()
        self.least = np.maximum(_DEPENDENT * products.whole, products.least_power)
        self.chosen: list[int] = []
        self.rows: list[FloatArray] = []  # orthogonal functions
        self.with_all: list[ComplexArray] = []  # their products with all candidates
        self.power: list[float] = []  # D(r, r)
        self.shares: list[float] = []  # C(r) / D(r, r)

    def orthogonalize_to_line(self, ramp_power: float) -> None:
        """Take 1 and the ramp, in which the data have nothing left, out of all candidates."""
        self._take(np.array([1.0, 0.0]), 1.0, 0.0)
        if ramp_power > 0.0:
            self._take(np.array([0.0, 1.0]), ramp_power, 0.0)

    def choose_all(self, left: float, bound: float, most_terms: int) -> FloatArray:
        """Choose until the best candidate brings too little of what is left.

        Returns
        -------
        FloatArray
            (chosen + 1,) mean square left: `left`, and after each candidate.
        """
        mean_square = [left]
        while len(self.chosen) < most_terms and mean_square[-1] > NOTHING_LEFT * left:
            merit = self.merit()
            best = int(np.argmax(merit))
            brought = float(merit[best])
            if brought <= bound * mean_square[-1] or brought <= 0.0:
                break
            # A candidate that brings all that is left brings more by rounding as often as less.
            mean_square.append(max(mean_square[-1] - brought, 0.0))
            self.choose(best)
        return np.array(mean_square)

    def merit(self) -> FloatArray:
        """(candidates,) drop in mean square that each would bring."""
        usable = self.own_first > self.least[0]
        if self.products.terms == 1:
            above, below = self.data.real**2, self.own_first
        else:
            below = self.own_first * self.own_second - self.cross**2
            c, s = self.data.real, self.data.imag
            above = self.own_second * c**2 + self.own_first * s**2 - 2.0 * self.cross * c * s
            usable &= self.own_second > self.least[1]
            usable &= below > _DEPENDENT * self.own_first * self.own_second
        merit = np.divide(above, below, out=np.zeros(usable.size), where=usable)
        merit[self.chosen] = 0.0
        return merit

    def choose(self, index: int) -> None:
        """Add candidate `index`: its first term, then its second."""
        size = 2 + 2 * len(self.chosen)
        self.chosen.append(index)
        self.products.choose(index)
        self.rows = [np.pad(row, (0, 2)) for row in self.rows]
        for is_second in (False, True)[: self.products.terms]:
            row = np.zeros(size + 2)
            row[size + is_second] = 1.0
            # The candidate made orthogonal to every function so far.
            for other, products, power in zip(self.rows, self.with_all, self.power, strict=True):
                product = products[index]
                row -= (product.imag if is_second else product.real) / power * other
            own = float((self.own_second if is_second else self.own_first)[index])
            shared = float((self.data.imag if is_second else self.data.real)[index])
            self._take(row, own, shared)

    def coefficients(self) -> FloatArray:
        """(2 + 2 chosen,) coefficients of 1, of the ramp, and of the terms of each candidate."""
        total = np.zeros(2 + 2 * len(self.chosen))
        for row, share in zip(self.rows, self.shares, strict=True):
            total += share * row
        return total

    def _take(self, row: FloatArray, power: float, shared: float) -> None:
        """Make every candidate, and the data, orthogonal to one more function."""
        products: ComplexArray = self.products.all(row)
        self.rows.append(row)
        self.with_all.append(products)
        self.power.append(power)
        self.shares.append(shared / power)
        self.own_first -= products.real**2 / power
        self.own_second -= products.imag**2 / power
        self.cross -= products.real * products.imag / power
        self.data -= products * (shared / power)
