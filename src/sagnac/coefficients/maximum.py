"""The maximum of the likelihood of a spectrum, and intervals by its profile."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.stats import chi2

from sagnac.arrays import FloatArray
from sagnac.coefficients.cosine_spectrum import LEAST_BINS, Ordinates
from sagnac.coefficients.estimates import CONVERGED, PRESENCE, Status, crossing, typical_square

# How far above the terms a bin has to be to be called something else, where chance (one in
# ten million) does not put it there. Less is taken for a departure of the terms.
_STANDS_OUT: Final = 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Optimum:
    """Squared coefficients at a maximum, -2 log likelihood, Fisher information, mean."""

    squares: FloatArray
    deviance: float
    fisher: FloatArray
    mean: FloatArray


def maximize(
    spectrum: Ordinates,
    *,
    start: FloatArray | None = None,
    fixed: tuple[int, float] | None = None,
    limited: bool = False,
) -> Optimum:
    """Most likely squared coefficients, one of them held if asked, or all kept above zero."""
    basis = spectrum.basis
    free = np.ones(basis.shape[1], dtype=np.bool_)
    offset = np.zeros(spectrum.power.size)
    if fixed is not None:
        free[fixed[0]] = False
        offset = basis[:, fixed[0]] * fixed[1]
    columns = basis[:, free]
    squares = np.zeros(columns.shape[1]) if start is None else start[free]
    if limited:
        squares = np.maximum(squares, 0.0)
    mean = offset + columns @ squares
    if not mean.min() > 0.0:
        squares = _non_negative_start(spectrum, columns)
        mean = offset + columns @ squares
    deviance = _deviance(spectrum, mean)
    while squares.size and math.isfinite(deviance):
        # Newton's curvature where it is one, which squares of one degree of freedom leave in
        # doubt far from the maximum; else its expectation (scoring).
        expected = spectrum.weight / mean**2
        gradient = columns.T @ (expected * (mean - spectrum.power))
        observed = expected * (2.0 * spectrum.power / mean - 1.0)
        curvature = columns.T @ (observed[:, np.newaxis] * columns)
        if not _is_positive(curvature):
            curvature = columns.T @ (expected[:, np.newaxis] * columns)
        solve = _solve_non_negative if limited else solve_normal
        move = solve(curvature, curvature @ squares - gradient) - squares
        before = deviance
        for halvings in range(40):
            trial = squares + 0.5**halvings * move
            trial_mean = offset + columns @ trial
            outcome = _deviance(spectrum, trial_mean)
            if outcome < deviance:
                squares, mean, deviance = trial, trial_mean, outcome
                break
        if before - deviance < CONVERGED:
            break
    weight = spectrum.weight / mean**2 if math.isfinite(deviance) else np.zeros(mean.size)
    return Optimum(
        squares=_joined(squares, free, fixed),
        deviance=deviance,
        fisher=0.5 * basis.T @ (weight[:, np.newaxis] * basis),
        mean=mean,
    )


def _deviance(spectrum: Ordinates, mean: FloatArray) -> float:
    """-2 log likelihood of the squares, infinite where their mean is not positive."""
    if not mean.min() > 0.0:
        return math.inf
    return float(spectrum.weight @ (np.log(mean) + spectrum.power / mean))


def _joined(
    squares: FloatArray, free: NDArray[np.bool_], fixed: tuple[int, float] | None
) -> FloatArray:
    whole = np.zeros(free.size)
    whole[free] = squares
    if fixed is not None:
        whole[fixed[0]] = fixed[1]
    return whole


def _is_positive(matrix: FloatArray) -> bool:
    diagonal = np.diag(matrix)
    if not diagonal.min() > 0.0:
        return False
    scale = 1.0 / np.sqrt(diagonal)
    try:
        # With room for rounding: nearly collinear terms are not a direction to trust.
        np.linalg.cholesky(matrix * scale * scale[:, np.newaxis] - 1e-9 * np.eye(scale.size))
    except np.linalg.LinAlgError:
        return False
    return True


def solve_normal(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Solve normal equations; directions that the data cannot see stay at zero."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    scaled = matrix * scale * scale[:, np.newaxis]
    return np.asarray(np.linalg.lstsq(scaled, scale * vector, rcond=1e-12)[0] * scale)


def _solve_non_negative(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Solve normal equations for the best squares that are not negative."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    values, vectors = np.linalg.eigh(matrix * scale * scale[:, np.newaxis])
    seen = values > 1e-12 * values[-1]
    root = np.sqrt(values[seen])
    side = vectors[:, seen].T
    return np.asarray(nnls(root[:, np.newaxis] * side, side @ (scale * vector) / root)[0] * scale)


def _non_negative_start(spectrum: Ordinates, columns: FloatArray) -> FloatArray:
    if not columns.shape[1]:
        return np.zeros(0)
    # Single squares have a chi-square of one degree of freedom: smooth before weighting.
    kernel = np.ones(min(9, spectrum.power.size))
    count = spectrum.count
    smooth = np.convolve(spectrum.power * count, kernel, "same") / np.convolve(
        count, kernel, "same"
    )
    root = np.sqrt(spectrum.weight) / smooth
    scale = 1.0 / np.maximum(np.linalg.norm(columns * root[:, np.newaxis], axis=0), 1e-300)
    solution, _ = nnls(columns * root[:, np.newaxis] * scale, spectrum.power * root)
    return np.asarray(solution * scale)


def with_departure(spectrum: Ordinates) -> tuple[Ordinates, float, tuple[str, ...]]:
    """`spectrum` with weights that allow for what the terms do not describe, how much, and notes.

    Bins that stand far above the terms (a line left, a resonance) weigh nothing; for the
    rest a common relative departure is estimated where it is significant.
    """
    if np.count_nonzero(spectrum.count >= 8.0) < 3 * LEAST_BINS:
        return spectrum, 0.0, ()
    notes = []
    trial, departure = _departure(spectrum)
    standing = np.zeros(spectrum.power.size, dtype=np.bool_)
    while departure > 0.0:
        ratio = spectrum.power / maximize(trial).mean
        chance = chi2.sf(spectrum.count * ratio, spectrum.count)
        more = ~standing & (ratio > _STANDS_OUT) & (chance < 1e-7)
        if not more.any() or np.count_nonzero(standing | more) > 0.5 * standing.size:
            break
        standing |= more
        trial, departure = _departure(
            replace(spectrum, weight=np.where(standing, 0.0, spectrum.weight))
        )
    if standing.any():
        frequency = spectrum.frequency[standing]
        notes.append(
            f"{frequency.size} of {standing.size} bins of the spectrum, from {frequency[0]:.4g} to "
            f"{frequency[-1]:.4g} Hz, stand far above the fitted terms (a line or a resonance is "
            "left) and are left out of the likelihood fit"
        )
    if departure > 0.0:
        ratio = spectrum.power / maximize(trial).mean
        worst = int(np.argmax(trial.weight * (ratio - 1.0) ** 2))
        notes.append(
            f"the spectrum departs from the fitted terms by {100.0 * departure:.2g} % of the power "
            f"in a bin, most at {spectrum.frequency[worst]:.4g} Hz (x {ratio[worst]:.3g}); the "
            "likelihood intervals allow for it"
        )
    return trial, departure + float(standing.any()), tuple(notes)


def _departure(spectrum: Ordinates) -> tuple[Ordinates, float]:
    """Weights with the relative departure of the bins that explains their scatter, or 0."""
    used = (spectrum.count >= 8.0) & (spectrum.weight > 0.0)
    freedom = max(1, np.count_nonzero(used) - spectrum.basis.shape[1])

    def weighted(departure: float) -> tuple[Ordinates, float]:
        weight = np.where(
            spectrum.weight > 0.0, 1.0 / (1.0 / spectrum.count + 0.5 * departure**2), 0.0
        )
        trial = replace(spectrum, weight=weight)
        ratio = spectrum.power / maximize(trial).mean - 1.0
        return trial, float(0.5 * weight[used] @ ratio[used] ** 2) - freedom

    trial, surplus = weighted(0.0)
    if surplus < 5.0 * math.sqrt(np.sum(2.0 + 12.0 / spectrum.count[used])):
        return trial, 0.0
    low, high = math.log(1e-4), math.log(10.0)
    for _ in range(12):
        trial, surplus = weighted(math.exp(0.5 * (low + high)))
        if surplus > 0.0:
            low = 0.5 * (low + high)
        else:
            high = 0.5 * (low + high)
    departure = math.exp(high)
    return weighted(departure)[0], departure


def profile_interval(
    spectrum: Ordinates, best: Optimum, column: int, confidence: float
) -> tuple[float, float, float, Status]:
    """Square of one coefficient: value, low, high and status by profile likelihood."""
    two_sided = likelihood_drop(confidence)
    one_sided = likelihood_drop(2.0 * confidence - 1.0)
    scale = 1.0 / np.sqrt(np.diag(best.fisher))
    covariance = np.linalg.pinv(best.fisher * scale * scale[:, np.newaxis], rcond=1e-12)
    error = math.sqrt(max(covariance[column, column], 1.0)) * scale[column]
    value = float(best.squares[column])
    # How the other squares move when this one does.
    direction = covariance[:, column] * scale / (covariance[column, column] * scale[column])

    def deviance(square: float) -> float:
        start = best.squares + direction * (square - value)
        return maximize(spectrum, start=start, fixed=(column, square)).deviance

    absent = deviance(0.0)
    if value > 0.0 and absent - best.deviance > max(PRESENCE, two_sided):

        def rise(square: float) -> float:
            return math.sqrt(max(deviance(square) - best.deviance, 0.0)) - math.sqrt(two_sided)

        step = error * math.sqrt(two_sided)
        high = crossing(rise, value, step)
        if math.isfinite(high):
            return value, crossing(rise, value, -step, 0.0), high, "estimated"
    reference, origin = (best.deviance, value) if value > 0.0 else (absent, 0.0)

    def rise_above(square: float) -> float:
        return math.sqrt(max(deviance(square) - reference, 0.0)) - math.sqrt(one_sided)

    high = crossing(rise_above, origin, error * math.sqrt(one_sided))
    if not high < typical_square(spectrum.basis[:, column], best.mean):
        return math.nan, math.nan, math.nan, "not observable"
    return high, 0.0, high, "upper bound"


def likelihood_drop(confidence: float) -> float:
    """Drop of twice the log likelihood at the end of an interval."""
    return float(chi2.ppf(max(confidence, 1e-6), 1))
