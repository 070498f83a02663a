"""Fast orthogonal search over frequencies on an even grid, in even time.

It chooses what `orthogonal_search` chooses from the same candidates. Time counted from mid-record
makes every cosine orthogonal to every sine, so that a pair's two terms are two searches that share
their choice; the mean of a product of two candidates is a value of one function, the Dirichlet
kernel, of the sum or the difference of their places. One zero-padded transform gives the data's
products; after each choice the coefficients of all terms are solved together, and every product
is moved by what the changes make of it. Changes that matter nowhere are not followed, so that a
weak term costs little.

References
----------
Korenberg, Biol. Cybern. 60 (1989) 267; McGaughey, Korenberg, Adeney, Collins and Aitken, Ann.
Biomed. Eng. 31 (2003) 741, for grids finer than one cycle a record.
"""

import math
from typing import Final

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike

from sagnac.core.arrays import BooleanArray, ComplexArray, FloatArray, IntegerArray
from sagnac.lines import _kernels
from sagnac.lines.orthogonal_search import (
    NOTHING_LEFT,
    OrthogonalSearch,
    Stop,
    require_rule,
    share_to_bring,
)
from sagnac.spectrum.transforms import THREADS

# Candidates whose best is kept together.
_BLOCK: Final = 4096
# A candidate with less mean square than this beside the chosen terms is rejected: neighbours on a
# fine grid would cancel each other with coefficients without bound.
_DEPENDENT: Final = 5e-5
# Power of cosine or sine, of one half, that a candidate has whose neighbours are not chosen.
_FREE: Final = 0.25
# Changes of products below this share of what a candidate has to bring are left out.
_NEGLIGIBLE: Final = 1e-4
# Cycles a record around a chosen term within which others are made orthogonal to it.
_NEAR: Final = 128
# Candidates whose products are made at once.
_AT_ONCE: Final = 1 << 18
# Candidates over which the level of the noise is taken.
_LEVEL_BLOCK: Final = 1024


def grid_search(
    signal: ArrayLike,
    *,
    cells: int,
    lowest: int = 1,
    stop: Stop = "korenberg",
    false_alarm: float = 0.05,
    most_terms: int = 40,
) -> OrthogonalSearch:
    """Fast orthogonal search over the frequencies k / (cells * record) below half a cycle a sample.

    Parameters
    ----------
    signal
        (samples,) in any unit, evenly sampled.
    cells
        Frequencies for each cycle a record: 1 is the grid of the Fourier transform, 4 leaves no
        line further than an eighth of a cycle a record from a candidate.
    lowest
        The first k that is a candidate. Above 1 the false alarm is that of a random walk and white
        noise together, whose levels are medians: of the candidates from `lowest` to twice that, and
        of the upper half of all. The slow wander of a walk, which has most of its mean square, then
        neither is taken for lines nor hides those that stand above the walk where they are.
    stop, false_alarm, most_terms
        As in `fast_orthogonal_search`. ``false-alarm`` counts the frequencies of the Fourier
        transform among the candidates, since those between them are not independent.

    Returns
    -------
    OrthogonalSearch
        Its phase is the number of the sample, its `spacing` in rad per sample.

    Raises
    ------
    ValueError
        If an argument makes no sense.

    Examples
    --------
    A line a quarter of a cycle a record off the Fourier grid, at 100.25 cycles:

    >>> import numpy as np
    >>> number = np.arange(1000)
    >>> signal = np.cos(2.0 * np.pi * 100.25 * number / 1000.0 + 0.3)
    >>> found = grid_search(signal, cells=4, most_terms=1)
    >>> found.frequencies * 1000.0 / (2.0 * np.pi)
    array([100.25])
    """
    values = np.asarray(signal, dtype=np.float64)
    count = _candidates(values, cells)
    if not 1 <= lowest <= count:
        raise ValueError(f"lowest is {lowest}; give 1 to {count}, the number of candidates")
    require_rule(stop, false_alarm, most_terms)
    search = _Search(values, cells, count, lowest)
    independent, bound = math.ceil(count / cells), 0.0
    if lowest > 1 and stop == "false-alarm":
        search.times_noise = math.log(independent / false_alarm)
    else:
        bound = share_to_bring(
            stop, false_alarm, terms=2, candidates=independent, samples=values.size
        )
    search.choose_all(bound, most_terms)
    return search.result(count, stop, false_alarm, most_terms)


def grid_fit(signal: ArrayLike, chosen: ArrayLike, *, cells: int) -> OrthogonalSearch:
    """Least squares of a constant, a slope and the pairs at chosen frequencies of a grid.

    Parameters
    ----------
    signal
        (samples,) in any unit, evenly sampled.
    chosen
        (pairs,) candidates as `grid_search` numbers them; one of which too little is new beside
        those before it is left out.
    cells
        Frequencies of the grid for each cycle a record.

    Returns
    -------
    OrthogonalSearch
        As `grid_search` returns it, without a rule.

    Raises
    ------
    ValueError
        If an argument makes no sense.
    """
    values = np.asarray(signal, dtype=np.float64)
    count = _candidates(values, cells)
    places = np.asarray(chosen, dtype=np.int64) + 1
    if places.ndim != 1 or np.any((places < 1) | (places > count)):
        raise ValueError(f"chosen has shape {places.shape}; give numbers from 0 to {count - 1}")
    fit = _Fit(values, cells, count)
    for place in places.tolist():
        if fit.is_new(place):
            fit.add(place)
    return fit.result(count, "none", 0.5, places.size)


def grid_sinusoids(found: OrthogonalSearch, samples: int) -> FloatArray:
    """The chosen sinusoids without constant and slope, by one transform.

    Parameters
    ----------
    found
        A search of `grid_search`.
    samples
        Of the signal.

    Returns
    -------
    (samples,) in the unit of the signal.
    """
    if found.spacing is None:
        raise ValueError("candidates of a matrix are no frequencies; give a search of a grid")
    length = round(2.0 * np.pi / found.spacing)
    waves = np.zeros(length // 2 + 1, dtype=np.complex128)
    waves[found.chosen + 1] = 0.5 * length * (found.cosine - 1j * found.sine)
    return np.asarray(scipy.fft.irfft(waves, length, workers=THREADS)[:samples])


def _candidates(values: FloatArray, cells: int) -> int:
    """Number of candidates of a signal that can be searched."""
    if values.ndim != 1 or values.size < 8:
        raise ValueError(f"signal has shape {values.shape}; give (samples,), 8 or more")
    if not np.isfinite(values).all():
        raise ValueError("signal has values that are not finite; leave these samples out")
    if cells < 1:
        raise ValueError(f"cells is {cells}; give 1 or more")
    return (cells * values.size - 1) // 2


def _tables(samples: int, cells: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Factors of the Dirichlet kernel.

    Returns
    -------
    sines, cosines
        (2 cells,) of half the phase over the record, which repeats.
    inverse
        (cells * samples // 2 + 1,) 1 / (samples * sine of half a step of the phase), 0 at place 0.
    """
    number = np.arange(2 * cells)
    length = cells * samples
    half: FloatArray = np.pi / length * np.arange(length // 2 + 1, dtype=np.float64)
    inverse = np.zeros(half.size)
    np.divide(1.0 / samples, np.sin(half), out=inverse, where=half > 0.0)
    return np.sin(np.pi / cells * number), np.cos(np.pi / cells * number), inverse


class _Fit:
    """Least squares of a constant, a ramp and pairs at places on the grid, one pair at a time.

    Samples are counted from mid-record, so that the cosines and the constant are one problem, the
    sines and the ramp another.
    """

    def __init__(self, values: FloatArray, cells: int, count: int) -> None:
        samples = values.size
        self.samples, self.cells, self.length = samples, cells, cells * samples
        ramp = np.linspace(-1.0, 1.0, samples)
        self.ramp_power = float(ramp @ ramp) / samples
        self._level = float(values.mean())
        self._slope = float(ramp @ values) / samples / self.ramp_power
        rest = values - self._level - self._slope * ramp
        self.mean_square = [float(rest @ rest) / samples]
        self._sums = scipy.fft.rfft(rest, self.length, workers=THREADS)[1 : count + 1]
        self.tables = _tables(samples, cells)
        self.places: IntegerArray = np.empty(0, dtype=np.int64)
        # On 1 and the cosines, and on the ramp and the sines; and what they are made from.
        self.cosines: FloatArray = np.zeros(1)
        self.sines: FloatArray = np.zeros(1)
        self._gram = (np.ones((1, 1)), np.full((1, 1), self.ramp_power))
        self._data = (np.zeros(1), np.zeros(1))

    def add(self, place: int) -> None:
        """Add the pair at a place, and solve for all coefficients together."""
        data = complex(self.from_middle(np.array([place]))[0])
        columns = self._columns(place)
        widened = []
        for gram, column in zip(self._gram, columns, strict=True):
            wide = np.empty((column.size, column.size))
            wide[:-1, :-1] = gram
            wide[-1] = wide[:, -1] = column
            widened.append(wide)
        self._gram = (widened[0], widened[1])
        self._data = (np.append(self._data[0], data.real), np.append(self._data[1], -data.imag))
        self.places = np.append(self.places, place)
        self.cosines, self.sines = (
            np.asarray(np.linalg.solve(gram, own), dtype=np.float64)
            for gram, own in zip(self._gram, self._data, strict=True)
        )
        explained = float(self.cosines @ self._data[0] + self.sines @ self._data[1])
        left = max(self.mean_square[0] - explained, 0.0)
        # A candidate that brings all that is left brings more by rounding as often as less.
        self.mean_square.append(min(left, self.mean_square[-1]))

    def is_new(self, place: int) -> bool:
        """Whether enough of the pair at a place is new beside those that are in."""
        for gram, column in zip(self._gram, self._columns(place), strict=True):
            own = column[-1] - column[:-1] @ np.linalg.solve(gram, column[:-1])
            if own <= _DEPENDENT:
                return False
        return True

    def result(
        self, candidates: int, stop: Stop, false_alarm: float, most_terms: int
    ) -> OrthogonalSearch:
        """The fitted series, along the number of the sample."""
        middle = 0.5 * (self.samples - 1)
        slope = float(self._slope + self.sines[0]) / middle
        # The phase is 0 at the first sample, not at mid-record.
        pair = (self.cosines[1:] - 1j * self.sines[1:]) * np.conj(self._ahead(self.places))
        return OrthogonalSearch(
            constant=float(self._level + self.cosines[0]) - slope * middle,
            slope=slope,
            chosen=self.places - 1,
            coefficients=np.stack([pair.real, -pair.imag], axis=1),
            mean_square=np.array(self.mean_square),
            spacing=2.0 * np.pi / self.length,
            candidates=candidates,
            stop=stop,
            false_alarm=false_alarm,
            most_terms=most_terms,
        )

    def from_middle(self, places: IntegerArray) -> ComplexArray:
        """Mean of the data times exp(-i phase) at some places, the phase 0 at mid-record."""
        return np.asarray(self._sums[places - 1] / self.samples * self._ahead(places))

    def overlaps(self, lags: IntegerArray) -> FloatArray:
        """Mean of the cosine at some sums or differences of places."""
        return _kernels.grid_overlaps(lags, self.length, self.tables)

    def tilts(self, places: IntegerArray) -> FloatArray:
        """Mean of ramp times sine at some places."""
        return _kernels.grid_tilts(places, self.samples, self.tables)

    def _columns(self, place: int) -> tuple[FloatArray, FloatArray]:
        """Products of the pair at a place with all terms that are in, and with itself."""
        here = np.array([place])
        near, far = self.overlaps(place - self.places), self.overlaps(place + self.places)
        double = self.overlaps(2 * here)
        return (
            np.concatenate([self.overlaps(here), 0.5 * (near + far), 0.5 * (1.0 + double)]),
            np.concatenate([self.tilts(here), 0.5 * (near - far), 0.5 * (1.0 - double)]),
        )

    def _ahead(self, places: IntegerArray) -> ComplexArray:
        """Phase factor of the middle of the record against its first sample."""
        # Whole turns are taken out in integers, so that the angle keeps its digits.
        halves = places * (self.samples - 1) % (2 * self.length)
        return np.asarray(np.exp(1j * np.pi / self.length * halves))


class _Search(_Fit):
    """The search as it goes on: every candidate's product with what is left.

    `even` is of the cosines and `odd` of the sines; the powers are theirs beside the constant,
    the ramp and the terms chosen. A candidate has to bring `times_noise` times what the noise of a
    walk and white noise brings at its place.
    """

    def __init__(self, values: FloatArray, cells: int, count: int, lowest: int) -> None:
        super().__init__(values, cells, count)
        self.lowest, self.times_noise = lowest, 0.0
        self.even, self.odd = np.empty(count), np.empty(count)
        for start in range(0, count, _AT_ONCE):
            part = slice(start, min(start + _AT_ONCE, count))
            products = self.from_middle(np.arange(part.start + 1, part.stop + 1))
            self.even[part], self.odd[part] = products.real, -products.imag
        self.even_power, self.odd_power = np.empty(count), np.empty(count)
        _kernels.grid_powers(
            self.even_power,
            self.odd_power,
            self.tables,
            self.length,
            self.samples,
            self.ramp_power,
        )
        # A frequency without power is no candidate; those below are searched for their level alone.
        self.even_power[: lowest - 1] = self.odd_power[: lowest - 1] = 0.0
        self._white = self._noise_level(slice(count // 2, count), 0)
        self.noise = _noise(self.even, self.odd, cells)
        blocks = -(-count // _BLOCK)
        self._stale: BooleanArray = np.ones(blocks, dtype=np.bool_)
        self._best = np.zeros(blocks)
        self._best_place = np.zeros(blocks, dtype=np.int64)

    def choose_all(self, bound: float, most_terms: int) -> None:
        """Choose until the best candidate brings too little of what is left."""
        self._update(self.cosines, self.sines)
        enough = NOTHING_LEFT * self.mean_square[0]
        while self.places.size < most_terms and self.mean_square[-1] > enough:
            number = int(np.argmax(self._best))
            brought = float(self._best[number])
            if brought <= bound * self.mean_square[-1] or brought <= 0.0:
                break
            place = int(self._best_place[number])
            before = self.cosines, self.sines
            if self._narrow_powers(place):
                self.add(place)
                before = np.append(before[0], 0.0), np.append(before[1], 0.0)
            self._update(self.cosines - before[0], self.sines - before[1])

    def _noise_level(self, places: slice, power: int) -> float:
        """Mean of what candidates bring times `power` of their place, from its median."""
        even_power, odd_power = self.even_power[places], self.odd_power[places]
        free = (even_power > _FREE) & (odd_power > _FREE)
        brought = (
            self.even[places][free] ** 2 / even_power[free]
            + self.odd[places][free] ** 2 / odd_power[free]
        )
        where = np.arange(places.start + 1, places.stop + 1)[free]
        return float(np.median(brought * where**power)) / math.log(2.0) if brought.size else 0.0

    def _narrow_powers(self, place: int) -> bool:
        """Take a pair about to be chosen out of the powers of the candidates around it.

        Returns
        -------
        bool
            False if too little of the pair is new beside the chosen ones: it is rejected.
        """
        width = _NEAR * self.cells
        around = np.arange(max(1, place - width), min(self.even.size, place + width) + 1)
        others = self.places[np.abs(self.places - place) <= 2 * width]
        self._stale[(around[0] - 1) // _BLOCK : (around[-1] - 1) // _BLOCK + 1] = True
        powers = (self.even_power, self.odd_power)
        shared = [self._new_part(around, place, others, sign) for sign in (1.0, -1.0)]
        is_new = all(part[place - around[0]] > _DEPENDENT for part in shared)
        if is_new:
            for part, power in zip(shared, powers, strict=True):
                power[around - 1] -= part**2 / part[place - around[0]]
        # Chosen or rejected, it is no candidate any more.
        for power in powers:
            power[place - 1] = 0.0
        return is_new

    def _new_part(
        self, around: IntegerArray, place: int, others: IntegerArray, sign: float
    ) -> FloatArray:
        """Products of candidates with what is new of the pair at a place.

        New is what the constant or the ramp and `others` do not hold.
        """
        here = np.array([place])
        gram = np.empty((others.size + 1, others.size + 1))
        gram[0, 0] = 1.0 if sign > 0.0 else self.ramp_power
        gram[0, 1:] = gram[1:, 0] = self._line_products(others, sign)
        gram[1:, 1:] = self._products(others, others, sign)
        shared = np.append(
            self._line_products(here, sign), self._products(others, here, sign)[:, 0]
        )
        weights = np.linalg.solve(gram, shared)
        part = self._products(around, here, sign)[:, 0]
        part -= self._line_products(around, sign) * weights[0]
        return np.asarray(part - self._products(around, others, sign) @ weights[1:])

    def _line_products(self, places: IntegerArray, sign: float) -> FloatArray:
        """Products of cosines with the constant (sign 1), or of sines with the ramp (-1)."""
        return self.overlaps(places) if sign > 0.0 else self.tilts(places)

    def _products(self, rows: IntegerArray, columns: IntegerArray, sign: float) -> FloatArray:
        """(rows, columns) products of cosines (sign 1) or sines (-1)."""
        near = self.overlaps((rows[:, np.newaxis] - columns).reshape(-1))
        far = self.overlaps((rows[:, np.newaxis] + columns).reshape(-1))
        return np.asarray(0.5 * (near + sign * far).reshape(rows.size, columns.size))

    def _update(self, even_change: FloatArray, odd_change: FloatArray) -> None:
        """Every product after a change of the coefficients, and the best candidates."""
        left = max(self.noise, NOTHING_LEFT * self.mean_square[0])
        least = _NEGLIGIBLE * math.sqrt(8.0 / (self.samples + 1) * left)
        size = np.maximum(np.abs(even_change), np.abs(odd_change))
        size[0] = 2.0 * abs(even_change[0])
        reach = np.minimum(size * self.cells / (2.0 * np.pi * max(least, 1e-300)), self.length)
        tilt = abs(odd_change[0]) * self.cells / (np.pi * max(least, 1e-300))
        moved = odd_change.copy()
        moved[0] = 0.0
        walk = white = 0.0
        if self.times_noise > 0.0:
            # A strong slow line hides the walk until it is chosen, so the level is taken anew.
            slow = slice(self.lowest - 1, min(2 * self.lowest, self.even.size))
            walk, white = (
                self.times_noise * level for level in (self._noise_level(slow, 2), self._white)
            )
            self._stale[:] = True
        _kernels.grid_update(
            self.even,
            self.odd,
            self.even_power,
            self.odd_power,
            self.tables,
            self.length,
            self.samples,
            np.concatenate([[0], self.places]),
            even_change,
            moved,
            reach.astype(np.int64),
            float(odd_change[0]),
            int(min(tilt, self.length)),
            _DEPENDENT,
            walk,
            white,
            self._stale,
            self._best,
            self._best_place,
            _BLOCK,
        )


def _noise(even: FloatArray, odd: FloatArray, cells: int) -> float:
    """Mean square of the signal without its lines, from medians over neighbouring candidates."""
    size = min(_LEVEL_BLOCK, even.size)
    whole = even.size // size * size
    merit = 2.0 * (even[:whole] ** 2 + odd[:whole] ** 2)
    medians = np.median(merit.reshape(-1, size), axis=1)
    return float(medians.sum()) * size / cells / math.log(2.0)
