"""The noise floor of a spectrum with lines in it."""

from collections.abc import Callable
from typing import Final

import numpy as np
from scipy.optimize import nnls

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.spectrum.transforms import run_columns

_FLOOR_HALF_WIDTH: Final = 256  # bins; the median of 513 ordinates is good to 6 %
_FLOOR_MOST_HALF_WIDTH: Final = 4096
# An ordinate this many floors high in a narrow bin is a line, not noise: exp(-9) of them by chance.
_LINE_RATIO: Final = 9.0
_LAW_ROUNDS: Final = 16


def noise_floor(power: FloatArray) -> FloatArray:
    """Expected power without lines, at every bin of a periodogram.

    Two steps. A sum of non-negative power laws in frequency (f^-2, f^-1, 1 and
    4 sin^2(pi f): rate random walk, flicker, angle random walk, quantization) is fitted
    to binned ordinates, lines excluded; it carries the slope at low frequency where
    bins are few. The running median of power over that fit then follows whatever else
    the noise does.

    Parameters
    ----------
    power
        (bins,) ordinates at k / size cycles per sample, k = 0 .... Bin 0 is not used.

    Returns
    -------
    (bins,) floor; bin 0 takes the value of bin 1.
    """
    bins = power.size
    if bins < 32:
        return np.full(bins, max(float(np.median(power[1:])) / np.log(2.0), np.finfo(float).tiny))
    law = _power_laws(power[1:])
    # The law at points half a percent apart, and straight lines between them: a part in 1e5.
    points = np.unique(
        np.concatenate([np.arange(1.0, min(bins, 401)), np.geomspace(1.0, bins - 1, 3000)])
    )
    levels = law(points)
    windows = _floor_windows(bins)
    ratios = np.empty(len(windows))

    def whitened(some: slice) -> None:
        first = windows[some.start].start
        stop = windows[some.stop - 1].stop
        white = power[first:stop] / np.interp(np.arange(float(first), stop), points, levels)
        for index in range(some.start, some.stop):
            window = windows[index]
            ratios[index] = _median(white[window.start - first : window.stop - first])

    # Sixty-four of the widest windows cover a span.
    run_columns(whitened, len(windows), 64, power)
    ratios /= np.log(2.0)
    knots = np.array([0.5 * (window.start + window.stop) for window in windows])
    floor = series.empty(bins)

    def filled(span: slice) -> None:
        number = np.arange(float(span.start), span.stop)
        np.multiply(
            np.interp(number, points, levels), np.interp(number, knots, ratios), out=floor[span]
        )

    run_columns(filled, bins, series.SPAN, floor)
    floor[0] = floor[1]
    return floor


def _floor_windows(bins: int) -> list[slice]:
    """Bins of which medians are taken; each begins at the middle of the one before."""
    windows: list[slice] = []
    start = 1
    while start < bins:
        half = int(min(max(0.1 * start, _FLOOR_HALF_WIDTH), _FLOOR_MOST_HALF_WIDTH))
        stop = min(start + 2 * half, bins)
        if stop - start < half and windows:
            break
        windows.append(slice(start, stop))
        start += half
    return windows


def _median(values: FloatArray) -> float:
    """The median, by partition of only those values that can be it (Floyd and Rivest 1975)."""
    size = values.size
    if size < 1024:
        return float(np.median(values))
    sample = np.sort(values[::8])
    # Four standard errors of the sample's median; where it lies beyond, nothing is gained.
    margin = int(2.0 * np.sqrt(sample.size))
    low, high = sample[sample.size // 2 - margin], sample[sample.size // 2 + margin]
    middle = values[(values >= low) & (values <= high)]
    below = int(np.count_nonzero(values < low))
    ranks = ((size - 1) // 2 - below, size // 2 - below)
    if ranks[0] < 0 or ranks[1] >= middle.size:
        return float(np.median(values))
    middle.partition(ranks)
    return 0.5 * float(middle[ranks[0]] + middle[ranks[1]])


def floor_scatter(bins: int) -> float:
    """Relative standard error of `noise_floor` at the middle of a periodogram of `bins`.

    That of the median of as many exponential variates as its window holds.
    """
    half = np.clip(0.05 * bins, _FLOOR_HALF_WIDTH, _FLOOR_MOST_HALF_WIDTH)
    return float(1.0 / (np.log(2.0) * np.sqrt(2.0 * half)))


def _power_laws(power: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Non-negative sum of power laws fitted to `power` by iterated Gamma weights.

    Parameters
    ----------
    power
        (bins,) ordinates at bins 1, 2, ....

    Returns
    -------
    The law, as a function of bin number.
    """
    edges = np.unique(
        np.concatenate([np.arange(9), np.geomspace(9, power.size, 160).astype(np.int64)])
    )
    starts, stops = edges[:-1], edges[1:]
    counts = stops - starts
    # Median over mean of n exponential variates, to within 1 %: 1 at n = 1, ln 2 for many.
    shrink = np.log(2.0) + (1.0 - np.log(2.0)) / counts
    level = np.empty(counts.size)

    def medians(some: slice) -> None:
        for index in range(some.start, some.stop):
            level[index] = _median(power[starts[index] : stops[index]])
            # The widest bins of a long series are each some spans.
            series.release(power)

    run_columns(medians, counts.size, 4)
    level /= shrink
    center = 0.5 * (starts + stops + 1.0)
    scale = max(float(np.median(level)), np.finfo(float).tiny)
    level = level / scale

    def basis(number: FloatArray) -> FloatArray:
        f = number / (2.0 * power.size)
        return np.column_stack([f**-2.0, 1.0 / f, np.ones_like(f), 4.0 * np.sin(np.pi * f) ** 2])

    design = basis(center)
    size = np.linalg.norm(design, axis=0)
    design = design / size
    model = np.maximum(level, 1e-12)
    target, keep = level, np.ones(level.size, dtype=bool)
    for round_ in range(_LAW_ROUNDS):
        # Maximum likelihood for Gamma ordinates is least squares with weights n / model^2.
        weight = np.where(keep, np.sqrt(counts) / model, 0.0)
        solution, _ = nnls(design * weight[:, None], target * weight)
        least = max(1e-12 * float(np.max(level)), np.finfo(float).tiny)
        model = np.maximum(design @ solution, least)
        highest = model * (1.0 + _LINE_RATIO / np.sqrt(counts))
        if round_ < _LAW_ROUNDS // 2:
            # What stands above the law may be a line or a law not seen yet: it pulls, but no
            # harder than a line may. Left out at once, a law could never come in.
            target = np.minimum(level, highest)
        else:
            target, keep = level, level < highest
    fitted = solution / size
    return lambda number: np.asarray(np.maximum(basis(number) @ fitted, 1e-12) * scale)
