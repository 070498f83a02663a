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
from typing import Any, Final

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike

from sagnac.core.arrays import ComplexArray, FloatArray, IntegerArray, blocks
from sagnac.lines import _kernels, orthogonal_search
from sagnac.lines.orthogonal_search import OrthogonalSearch, Stop
from sagnac.spectrum.transforms import THREADS

# A candidate with less mean square than this beside the chosen terms is rejected: neighbours on a
# fine grid would cancel each other with coefficients without bound.
_DEPENDENT: Final = 5e-5


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
    count = (cells * values.size - 1) // 2
    search = _Search(values, cells, count, lowest)
    independent = math.ceil(count / cells)
    sizes = {"terms": 2, "candidates": independent, "samples": values.size}
    bound = orthogonal_search.share_to_bring(stop, false_alarm, **sizes)
    if lowest > 1 and stop == "false-alarm":
        search.times_noise, bound = math.log(independent / false_alarm), 0.0
    fit = search.fit
    orthogonal_search.choose_all(search.best, search.choose, fit.mean_square, bound, most_terms)
    rule = {"stop": stop, "false_alarm": false_alarm, "most_terms": most_terms}
    return fit.result(candidates=count, **rule)


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
    """
    values = np.asarray(signal, dtype=np.float64)
    count = (cells * values.size - 1) // 2
    places = np.asarray(chosen, dtype=np.int64) + 1
    fit = _Fit(values, cells, count)
    for place in places.tolist():
        if fit.new_part(np.array([place]), place, fit.places).min() > _DEPENDENT:
            fit.add(place)
    return fit.result(candidates=count, stop="none", false_alarm=0.5, most_terms=places.size)


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


class _Fit:
    """Least squares of a constant, a ramp and pairs at places on the grid, one pair at a time.

    Samples are counted from mid-record, so that the constant and the cosines are one problem
    (part 0), the ramp and the sines another (part 1).
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
        self.places: IntegerArray = np.empty(0, dtype=np.int64)
        # Coefficients on the constant or the ramp and on the pairs, and what these share with data.
        self.coefficients: FloatArray = np.zeros((2, 1))
        self._data: FloatArray = np.zeros((2, 1))

    def add(self, place: int) -> None:
        """Add the pair at a place, and solve for all coefficients together."""
        self.places = np.append(self.places, place)
        self._data = np.append(self._data, self.from_middle(self.places[-1:]), axis=1)
        solved = np.linalg.solve(self._gram(self.places), self._data[..., np.newaxis])[..., 0]
        self.coefficients = np.asarray(solved, dtype=np.float64)
        left = max(self.mean_square[0] - float((self.coefficients * self._data).sum()), 0.0)
        # A candidate that brings all that is left brings more by rounding as often as less.
        self.mean_square.append(min(left, self.mean_square[-1]))

    def new_part(self, around: IntegerArray, place: int, others: IntegerArray) -> FloatArray:
        """(2, around) products of candidates with what is new of the pair at a place.

        New is what the constant or the ramp and `others` do not hold.
        """
        here = np.array([place])
        shared = np.append(self._with_line(here), self._with_pairs(here, others)[:, 0], axis=1)
        weights = np.linalg.solve(self._gram(others), shared[..., np.newaxis])
        part = self._with_pairs(around, here)[..., 0] - self._with_line(around) * weights[:, 0]
        return np.asarray(part - (self._with_pairs(around, others) @ weights[:, 1:])[..., 0])

    def result(self, **settings: Any) -> OrthogonalSearch:
        """The fitted series, along the number of the sample, of a search of some settings."""
        middle = 0.5 * (self.samples - 1)
        level, ramp = self.coefficients[:, 0]
        slope = float(self._slope + ramp) / middle
        # The phase is 0 at the first sample, not at mid-record.
        pair = self.coefficients[0, 1:] - 1j * self.coefficients[1, 1:]
        pair *= np.conj(self._ahead(self.places))
        return OrthogonalSearch(
            constant=float(self._level + level) - slope * middle,
            slope=slope,
            chosen=self.places - 1,
            coefficients=np.stack([pair.real, -pair.imag], axis=1),
            mean_square=np.array(self.mean_square),
            spacing=2.0 * np.pi / self.length,
            **settings,
        )

    def from_middle(self, places: IntegerArray) -> FloatArray:
        """(2, places) means of the data times cosine and sine, the phase 0 at mid-record."""
        means = self._sums[places - 1] / self.samples * self._ahead(places)
        return np.stack([means.real, -means.imag])

    def cosines(self, lags: IntegerArray) -> FloatArray:
        """Mean of the cosine at some sums or differences of places: the Dirichlet kernel."""
        step = np.where(lags == 0, 1.0, np.sin(np.pi / self.length * lags))
        # The sine of half the phase over the record repeats.
        turns = np.sin(np.pi / self.cells * np.arange(2 * self.cells))[lags % (2 * self.cells)]
        return np.where(lags == 0, 1.0, turns / (self.samples * step))

    def tilts(self, places: IntegerArray) -> FloatArray:
        """Mean of ramp times sine at some places, none of them 0."""
        half = np.pi * places / self.length
        sine, cosine = np.sin(half), np.cos(half)
        turn = np.pi / self.cells * (places % (2 * self.cells))
        slope = np.sin(turn) * cosine / sine - self.samples * np.cos(turn)
        return np.asarray(slope / (self.samples * sine * (self.samples - 1)))

    def _gram(self, places: IntegerArray) -> FloatArray:
        """(2, terms, terms) products of the constant or the ramp and of pairs with each other."""
        gram = np.empty((2, places.size + 1, places.size + 1))
        gram[:, 0, 0] = 1.0, self.ramp_power
        gram[:, 0, 1:] = gram[:, 1:, 0] = self._with_line(places)
        gram[:, 1:, 1:] = self._with_pairs(places, places)
        return gram

    def _with_line(self, places: IntegerArray) -> FloatArray:
        """(2, places) products of cosines with the constant, and of sines with the ramp."""
        return np.stack([self.cosines(places), self.tilts(places)])

    def _with_pairs(self, rows: IntegerArray, columns: IntegerArray) -> FloatArray:
        """(2, rows, columns) products of cosines with cosines, and of sines with sines."""
        near = self.cosines(rows[:, np.newaxis] - columns)
        far = self.cosines(rows[:, np.newaxis] + columns)
        return np.stack([0.5 * (near + far), 0.5 * (near - far)])

    def _ahead(self, places: IntegerArray) -> ComplexArray:
        """Phase factor of the middle of the record against its first sample."""
        # Whole turns are taken out in integers, so that the angle keeps its digits.
        halves = places * (self.samples - 1) % (2 * self.length)
        return np.asarray(np.exp(1j * np.pi / self.length * halves))


class _Search:
    """The search as it goes on: every candidate's products with what is left.

    `left` is of the cosines and of the sines; the powers are theirs beside the constant, the ramp
    and the pairs chosen. A candidate has to bring `times_noise` times what the noise of a walk and
    white noise brings at its place.
    """

    def __init__(self, values: FloatArray, cells: int, count: int, lowest: int) -> None:
        self.fit = fit = _Fit(values, cells, count)
        self.lowest, self.times_noise = lowest, 0.0
        self.left = np.empty((2, count))
        for some in blocks(count):
            self.left[:, some] = fit.from_middle(np.arange(some.start + 1, some.stop + 1))
        self.overlap = np.empty(fit.length // 2 + 1)
        for some in blocks(self.overlap.size):
            self.overlap[some] = fit.cosines(np.arange(some.start, some.stop))
        # Far from both ends a pair is orthogonal to the constant and the ramp, and as long as any.
        self.power = np.full((2, count), 0.5)
        far = min((1 << 14) * cells, count)
        for places in (np.arange(1, far + 1), np.arange(count - far + 1, count + 1)):
            double = fit.cosines(2 * places)
            self.power[0, places - 1] = 0.5 * (1.0 + double) - fit.cosines(places) ** 2
            tilted = fit.tilts(places) ** 2 / fit.ramp_power
            self.power[1, places - 1] = 0.5 * (1.0 - double) - tilted
        # A frequency without power is no candidate; those below are searched for their level alone.
        self.power[:, : lowest - 1] = 0.0
        self._white = self._noise_level(slice(count // 2, count), 0)
        # Mean square of the signal without its lines, from medians over neighbouring candidates.
        size = min(1024, count)
        brought = 2.0 * (self.left[:, : count // size * size] ** 2).sum(axis=0)
        medians = np.median(brought.reshape(-1, size), axis=1)
        self.noise = float(medians.sum() * size / cells / math.log(2.0))

    def best(self) -> tuple[float, int]:
        """Greatest drop of the mean square that a candidate above the noise brings, and which."""
        walk = white = 0.0
        if self.times_noise > 0.0:
            # A strong slow line hides the walk until it is chosen, so the level is taken anew.
            slow = slice(self.lowest - 1, min(2 * self.lowest, self.left.shape[1]))
            walk = self.times_noise * self._noise_level(slow, 2)
            white = self.times_noise * self._white
        return _kernels.best_pair(self.left, self.power, _DEPENDENT, walk, white)

    def choose(self, index: int) -> None:
        """Add the pair at a place, if enough of it is new beside those that are in."""
        # It is taken out of the powers of the candidates around it, to 128 cycles a record.
        fit, width = self.fit, 128 * self.fit.cells
        around = np.arange(max(1, index - width), min(self.power.shape[1], index + width) + 1)
        shared = fit.new_part(around, index, fit.places[np.abs(fit.places - index) <= 2 * width])
        own = shared[:, index - around[0]]
        is_new = bool(np.all(own > _DEPENDENT))
        if is_new:
            self.power[:, around - 1] -= shared**2 / own[:, np.newaxis]
        # Chosen or rejected, it is no candidate any more.
        self.power[:, index - 1] = 0.0
        if is_new:
            before = np.append(fit.coefficients, np.zeros((2, 1)), axis=1)
            fit.add(index)
            self._update(fit.coefficients - before)

    def _noise_level(self, places: slice, power: int) -> float:
        """Mean of what candidates bring times `power` of their place, from its median."""
        # Cosine and sine of a candidate whose neighbours are not chosen have a power of one half.
        free = np.all(self.power[:, places] > 0.25, axis=0)
        brought = (self.left[:, places][:, free] ** 2 / self.power[:, places][:, free]).sum(axis=0)
        place = np.arange(places.start + 1, places.stop + 1)[free]
        return float(np.median(brought * place**power)) / math.log(2.0) if brought.size else 0.0

    def _update(self, change: FloatArray) -> None:
        """Every product after a change of the coefficients, as far as it is not negligible."""
        fit = self.fit
        left = max(self.noise, orthogonal_search.NOTHING_LEFT * fit.mean_square[0])
        # Changes below a ten thousandth of what a candidate has to bring are left out.
        least = max(1e-4 * math.sqrt(8.0 / (fit.samples + 1) * left), 1e-300)
        tilt, pairs = change[1, 0], change.copy()
        pairs[1, 0] = 0.0
        reach = np.abs(pairs).max(axis=0) * fit.cells / (2.0 * np.pi * least)
        # The overlap of a pair with the constant counts twice, as sum and as difference of places.
        reach[0] *= 2.0
        places, reached = np.append(0, fit.places), np.minimum(reach, fit.length).astype(np.int64)
        # Beyond half a cycle a sample the overlaps mirror those below.
        lengths = reached, fit.length, 1.0 if fit.samples % 2 else -1.0
        _kernels.take_pairs(self.left, self.overlap, places, 0.5 * pairs, *lengths)
        tilted = min(abs(tilt) * fit.cells / (np.pi * least), self.left.shape[1])
        places = np.arange(1, int(tilted) + 1)
        self.left[1, : places.size] -= tilt * fit.tilts(places)
