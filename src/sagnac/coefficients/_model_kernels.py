"""Compiled loops of the models of bands: gamma likelihood, arrays in, arrays out."""

# Compiled loops take their arrays by position.
# ruff: noqa: PLR0917

import numpy as np

from sagnac.arrays import FloatArray, IntegerArray
from sagnac.kernels import compiled

# Divisors of N: the largest at which a bin shows it, and at the upper edge of a band.
_LOWERED = 1.4
_DEEPEST = 1.5


@compiled(error_model="numpy")
def _solved(matrix: FloatArray, vector: FloatArray, size: int) -> bool:
    """Solve a small symmetric positive system in place; False if it is singular."""
    for i in range(size):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            if i == j:
                # Relative: far above a roll-off the laws are millions of times the levels.
                if total <= 1e-13 * matrix[i, i]:
                    return False
                matrix[i, i] = np.sqrt(total)
            else:
                matrix[i, j] = total / matrix[j, j]
    for i in range(size):
        total = vector[i]
        for k in range(i):
            total -= matrix[i, k] * vector[k]
        vector[i] = total / matrix[i, i]
    for i in range(size - 1, -1, -1):
        total = vector[i]
        for k in range(i + 1, size):
            total -= matrix[k, i] * vector[k]
        vector[i] = total / matrix[i, i]
    return True


@compiled(error_model="numpy")
def _gamma_deviance(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    squares: FloatArray,
    first: int,
    last: int,
    columns: IntegerArray,
    size: int,
    falls: bool,
    mean: FloatArray,
) -> float:
    """Gamma deviance, ``2 sum a (y/m - 1 - ln(y/m))``; infinite if a mean is not above zero."""
    total = 0.0
    linear = size - 1 if falls else size
    for b in range(first, last):
        value = 0.0
        for c in range(linear):
            value += laws[b, columns[c]] * squares[c]
        if falls:
            divisor = 1.0 + squares[linear] * laws[b, columns[linear]]
            if divisor < 0.5:
                return np.inf
            value /= divisor
        mean[b] = value
        if value <= 1e-6 * level[b]:
            return np.inf
        ratio = level[b] / value
        total += 2.0 * shape[b] * (ratio - 1.0 - np.log(ratio))
    return total


@compiled(error_model="numpy")
def _gamma_information(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    mean: FloatArray,
    first: int,
    last: int,
    columns: IntegerArray,
    size: int,
    falls: bool,
    fall: float,
    matrix: FloatArray,
    vector: FloatArray,
    row: FloatArray,
) -> None:
    """Fisher information and what it is multiplied by the next squares to give.

    ``fall`` is c of ``m = sum / (1 + c r)``, whose derivative ``-r m / (1 + c r)`` is the last
    column, so that ``y + c dm/dc`` takes the place of y.
    """
    for c in range(size):
        vector[c] = 0.0
        for d in range(c + 1):
            matrix[c, d] = 0.0
    for b in range(first, last):
        weight = shape[b] / mean[b] ** 2
        observed = level[b]
        for c in range(size):
            row[c] = laws[b, columns[c]]
        if falls:
            gain = 1.0 / (1.0 + fall * row[size - 1])
            for c in range(size):
                row[c] *= gain
            row[size - 1] *= -mean[b]
            observed += fall * row[size - 1]
        for c in range(size):
            part = weight * row[c]
            vector[c] += part * observed
            for d in range(c + 1):
                matrix[c, d] += part * row[d]


@compiled(error_model="numpy")
def _least_squares(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    first: int,
    last: int,
    columns: IntegerArray,
    size: int,
    falls: bool,
    squares: FloatArray,
    mean: FloatArray,
    matrix: FloatArray,
    target: FloatArray,
    row: FloatArray,
) -> float:
    """Squares by least squares on relative residuals; their deviance, infinite without any.

    With a fall these are the residuals of ``y (1 + c r) = sum``, which is linear.
    """
    for b in range(first, last):
        mean[b] = level[b]
    _gamma_information(
        level, shape, laws, mean, first, last, columns, size, falls, 0.0, matrix, target, row
    )
    if not _solved(matrix, target, size):
        return np.inf
    for c in range(size):
        squares[c] = target[c]
    deviance = _gamma_deviance(level, shape, laws, squares, first, last, columns, size, falls, mean)
    if not np.isfinite(deviance):
        # Least squares with large residuals may fall below zero: start from what is positive.
        for c in range(size):
            typical = 0.0
            for b in range(first, last):
                typical += abs(laws[b, columns[c]]) / (last - first)
            squares[c] = max(target[c], 1e-3 / typical)
        deviance = _gamma_deviance(
            level, shape, laws, squares, first, last, columns, size, falls, mean
        )
    return float(deviance)


@compiled(error_model="numpy")
def _scoring(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    first: int,
    last: int,
    columns: IntegerArray,
    size: int,
    falls: bool,
    squares: FloatArray,
    mean: FloatArray,
    hopeless: float,
    matrix: FloatArray,
    target: FloatArray,
    trial: FloatArray,
    row: FloatArray,
) -> float:
    """Fisher scoring from least squares on relative residuals; the deviance at its end.

    It is infinite if the deviance stays above `hopeless` after a few steps: such a model has no
    weight, and scoring takes long if a law does not describe its bins.
    """
    deviance = _least_squares(
        level, shape, laws, first, last, columns, size, falls, squares, mean, matrix, target, row
    )
    if not np.isfinite(deviance):
        return np.inf
    for step in range(20):
        if step == 4 and deviance > hopeless:
            return np.inf
        fall = squares[size - 1] if falls else 0.0
        _gamma_information(
            level, shape, laws, mean, first, last, columns, size, falls, fall, matrix, target, row
        )
        if not _solved(matrix, target, size):
            return np.inf
        share, outcome = 1.0, np.inf
        for _ in range(8):
            for c in range(size):
                trial[c] = squares[c] + share * (target[c] - squares[c])
            outcome = _gamma_deviance(
                level, shape, laws, trial, first, last, columns, size, falls, mean
            )
            if outcome <= deviance + 1e-9:
                break
            share *= 0.5
        lowered = deviance - outcome
        if not lowered >= -1e-9:
            break
        for c in range(size):
            squares[c] = trial[c]
        deviance = outcome
        if lowered < 1e-3:
            break
    return float(
        _gamma_deviance(level, shape, laws, squares, first, last, columns, size, falls, mean)
    )


@compiled(error_model="numpy")
def _gamma_covariance(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    mean: FloatArray,
    first: int,
    last: int,
    columns: IntegerArray,
    size: int,
    falls: bool,
    fall: float,
    covariances: FloatArray,
    place: int,
    information: FloatArray,
    matrix: FloatArray,
    vector: FloatArray,
    row: FloatArray,
) -> bool:
    """Inverse of the Fisher information, into rows and columns of its terms; all or zeros."""
    _gamma_information(
        level, shape, laws, mean, first, last, columns, size, falls, fall, information, vector, row
    )
    for c in range(size):
        for d in range(size):
            vector[d] = 1.0 if d == c else 0.0
            for e in range(d + 1):
                matrix[d, e] = information[d, e]
        if not _solved(matrix, vector, size):
            for d in range(size):
                for e in range(size):
                    covariances[place, columns[d], columns[e]] = 0.0
            return False
        for d in range(size):
            covariances[place, columns[d], columns[c]] = vector[d]
    return True


@compiled(error_model="numpy")
def _ruled(
    laws: FloatArray,
    squares: FloatArray,
    mean: FloatArray,
    first: int,
    last: int,
    columns: IntegerArray,
    size: int,
    falls: bool,
    walk: int,
) -> int:
    """Bins in which the walk is half of the fitted spectrum or more, and falls by 0.3 or less."""
    ruled = 0
    for c in range(size):
        if columns[c] == walk:
            for b in range(first, last):
                divisor = 1.0
                if falls:
                    divisor += squares[size - 1] * laws[b, columns[size - 1]]
                if divisor <= _LOWERED and squares[c] * laws[b, walk] >= 0.5 * mean[b] * divisor:
                    ruled += 1
    return ruled


@compiled(error_model="numpy")
def _chosen(mask: int, columns: IntegerArray) -> int:
    """Number of terms of a bit mask, their columns filled in."""
    size = 0
    for c in range(columns.size):
        if mask >> c & 1:
            columns[size] = c
            size += 1
    return size


@compiled(error_model="numpy")
def _stands(deviance: float, squares: FloatArray, size: int, depth: float) -> bool:
    """Whether a model was fitted, its terms are above zero and it falls no deeper than known."""
    positive = np.isfinite(deviance)
    for c in range(size):
        positive = positive and squares[c] > 0.0
    return positive and depth <= _DEEPEST


def every_model(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    walk: int,
    least: int,
    needed: int,
    barred: int,
    falls: bool,
    lightest: float,
) -> tuple[IntegerArray, FloatArray, FloatArray, FloatArray]:
    """Fit every contiguous band with every choice of terms.

    Parameters are scaled so that laws are about one. Models with a coefficient at or below zero
    are those with fewer terms and are left out. The terms of the bit mask `needed` are in every
    model, those of `barred` in none. If the model `falls`, its last column is no law but r of the
    divisor ``1 + c r`` of all others; it has to be needed then, and bands that reach below
    1/2.5 are left out. Models that weigh nothing beside a cost of `lightest` are not finished.

    Returns
    -------
    places, deviance, squares, covariance
        One column (places) or row a model. Its places are the first bin of its band, the one
        behind the last, its bit mask of terms, and the number of bins that the walk rules.
    """
    # Arrays are made and cut here, which costs seconds of compilation in a loop.
    bins, terms = laws.shape
    most = (1 << terms) * bins * (bins + 1) // 2
    places, deviances = np.empty((4, most), dtype=np.int64), np.empty(most)
    squares, covariances = np.zeros((most, terms)), np.zeros((most, terms, terms))
    found = _fit_every_model(
        level, shape, laws, walk, least, needed, barred, falls, float(lightest), places, deviances,
        squares, covariances, np.empty(terms, dtype=np.int64), np.empty(terms), np.empty(bins),
        np.empty((terms, terms)), np.empty((terms, terms)), np.empty(terms), np.empty(terms),
        np.empty(terms),
    )  # fmt: skip
    return places[:, :found], deviances[:found], squares[:found], covariances[:found]


@compiled(error_model="numpy")
def _fit_every_model(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    walk: int,
    least: int,
    needed: int,
    barred: int,
    falls: bool,
    lightest: float,
    places: IntegerArray,
    deviances: FloatArray,
    squares_of: FloatArray,
    covariance_of: FloatArray,
    columns: IntegerArray,
    squares: FloatArray,
    mean: FloatArray,
    matrix: FloatArray,
    information: FloatArray,
    target: FloatArray,
    trial: FloatArray,
    row: FloatArray,
) -> int:
    """Models into the arrays that `every_model` returns; their number.

    What follows those is room to work in: (bins,) `mean`, (terms, terms) `matrix` and
    `information`, (terms,) the others.
    """
    bins, terms = laws.shape
    found = 0
    for mask in range(1, 1 << terms):
        if mask & needed != needed or mask & barred != 0:
            continue
        size = _chosen(mask, columns)
        fewest = least if least > size + 1 else size + 1
        for first in range(bins):
            for last in range(first + fewest, bins + 1):
                left_out = bins - (last - first)
                hopeless = lightest + 60.0 - 2.0 * left_out
                if hopeless < 0.0:
                    continue
                deviance = _scoring(
                    level, shape, laws, first, last, columns, size, falls, squares, mean, hopeless,
                    matrix, target, trial, row,
                )  # fmt: skip
                fall = squares[size - 1] if falls else 0.0
                if not _stands(deviance, squares, size, fall * laws[last - 1, terms - 1]):
                    continue
                cost = deviance + 2.0 * (size + left_out)
                lightest = min(lightest, cost)
                if not _gamma_covariance(
                    level, shape, laws, mean, first, last, columns, size, falls, fall,
                    covariance_of, found, information, matrix, target, row,
                ):  # fmt: skip
                    continue
                places[0, found], places[1, found], places[2, found] = first, last, mask
                places[3, found] = _ruled(
                    laws, squares, mean, first, last, columns, size, falls, walk
                )
                deviances[found] = deviance
                for c in range(size):
                    squares_of[found, columns[c]] = squares[c]
                found += 1
    return found
