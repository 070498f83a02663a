"""The step that an angle is read out in, and what dithers it."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagnac import series
from sagnac.arrays import FloatArray

# Steps of angle, in readout steps squared, at which the error of a readout is white noise: a
# quarter that the angle turns about its mean (the error's correlation is below 1 % from there on),
# and twice the error's own variance, 1/12. A steady rate alone makes at most a quarter.
_DITHERED: Final = 0.25 + 2.0 / 12.0
# Steps of angle over which a rate counts as steady: their variance is about the mean of so many.
_STEADY: Final = 8
# Steps of angle fewer than these have no variance to speak of.
_LEAST_STEPS: Final = 32
# Share of the root mean square of the second differences. Where nothing dithers the readout its
# step is larger than that, and what the rounding of a file leaves of a zero is smaller.
_ROUNDING: Final = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Readout:
    """The step of a readout, and from where on its error is white noise of the angle.

    Attributes
    ----------
    step
        rad. Of an angle that is dithered from sample to sample, the smallest change there is.
    every
        The error is white where every so-many-th sample is taken, a power of two: 1 where the
        angle is dithered as it is. None where too few samples are left before that.
    """

    step: float
    every: int | None


def readout_of(angle: ArrayLike) -> Readout:
    """Whether what an angle does dithers the steps it is read out in.

    A walk over a readout step Delta leaves an error e that is uniform, of variance Delta^2/12,
    and uncorrelated with every increment of the walk (from any place within a step the average
    over places is zero). Its autocovariance over a time in which the angle strays by
    sigma about a steady turn is ``sum_m Delta^2/(2 pi^2 m^2) exp(-2 pi^2 m^2 sigma^2/Delta^2)``
    times a cosine of the turn (Widrow and Kollár, Quantization Noise, 2008, characteristic
    functions). So it is white noise, as quantization is taken to be, only of angles taken so far
    apart that sigma is half a step or more; of angles taken closer it is a slow error of many
    samples, which a fit would call angle random walk.

    Parameters
    ----------
    angle
        (samples,) as read out, before anything is taken off.

    Returns
    -------
    Readout
        Of an angle that never leaves one steady turn the step is 0, and `every` is 1.
    """
    values = np.asarray(angle, dtype=np.float64)
    every, step = 1, 0.0
    taken = values
    while taken.size > _LEAST_STEPS:
        if every == 1:
            finest, size = _smallest_change(values, 0.0)
            if size == 0.0:
                return Readout(step=0.0, every=1)
            step, _ = _smallest_change(values, _ROUNDING * size)
        if _variance_of_steps(taken) >= _DITHERED * step**2:
            return Readout(step=finest if every == 1 else step, every=every)
        taken = series.every(taken, 2)
        every *= 2
    return Readout(step=step, every=None)


def _smallest_change(values: FloatArray, above: float) -> tuple[float, float]:
    """Smallest second difference above a size, infinite if none, and root mean square of all."""
    # Smaller ones are rounding. There is no steady rate in any, however many steps that is.
    rounding = 8.0 * np.finfo(float).eps * max(map(abs, series.extent(values)))
    smallest, squares = math.inf, 0.0
    for span in series.through(values.size - 2, values):
        changes = np.abs(np.diff(values[span.start : span.stop + 2], n=2))
        changes = changes[changes > rounding]
        squares += float(changes @ changes)
        smallest = min(smallest, float(changes[changes > above].min(initial=math.inf)))
    return smallest, math.sqrt(squares / (values.size - 2))


def _variance_of_steps(values: FloatArray) -> float:
    """Mean variance of `_STEADY` steps in a row."""
    count, total = (values.size - 1) // _STEADY, 0.0
    for some in series.spans(count, max(1, series.SPAN // _STEADY)):
        steps = np.diff(values[_STEADY * some.start : _STEADY * some.stop + 1])
        total += float(steps.reshape(-1, _STEADY).var(axis=1, ddof=1).sum())
        series.release(values)
    return total / count
