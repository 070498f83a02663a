"""The step that an angle is read out in, and what dithers it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import Note
from sagnac.recording.channel import require_rate
from sagnac.recording.kinds import angle_of
from sagnac.recording.lattice import count_step
from sagnac.recording.model import Recording
from sagnac.units import ARCSECOND

# Steps of angle, in readout steps squared, at which the error of a readout is white noise: a
# quarter that the angle turns about its mean (the error's correlation is below 1 % from there on),
# and twice the error's own variance, 1/12. A steady rate alone makes at most a quarter.
_DITHERED: Final = 0.25 + 2.0 / 12.0
# Steps of angle over which a rate counts as steady: the variance of this many is about their mean.
_STEADY: Final = 8
# Steps of angle fewer than these have no variance to speak of.
_LEAST_STEPS: Final = 32
# Share of the stretches of `_STEADY` steps that count, those of least variance: the others hold the
# reversals of a table, which dither nothing between them.
_COUNT: Final = 0.99
# Changes below this many last places of the largest angle are rounding.
_LAST_PLACES: Final = 8.0
# Angles that a readout step has to leave for a fit. If there are fewer, five terms are not told
# apart: even with white readout noise nine intervals in ten hold N, and what is estimated lies
# half an error high.
LEAST_DITHERED: Final = 320
# A table that covers less than this, rad, stands still.
_TURNS: Final = math.radians(1.0)
# Variance of the error of an encoder's steps, of the variance of what a gyro turns from one angle
# to the next, below which it moves N by less than 2 % however slow it is.
_MATTERS: Final = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class Readout:
    """The step of a readout, and from where on its error is white noise of the angle.

    Attributes
    ----------
    step
        rad. For an angle that is dithered from sample to sample, the smallest change there is.
    every
        The error is white if one in `every` samples is taken, a power of two: 1 if the angle is
        dithered as it is. None if too few samples are left before that.

    Raises
    ------
    ValueError
        If the step is negative or `every` is below 1.
    """

    step: float
    every: int | None

    def __post_init__(self) -> None:
        _require_readout(self.step, self.every)


@dataclass(frozen=True, slots=True, kw_only=True)
class JointReadout:
    """Clusters that the readouts of several gyros together allow.

    Attributes
    ----------
    step
        Sum of their steps, rad.
    every
        The readouts are dithered if one in `every` angles is taken. None if too few angles are
        left for a fit.
    time
        Time between angles so taken, s; 0 if all are, infinite if they are dithered at no time.
    notes
        What a reader of the figures has to know of it.

    Raises
    ------
    ValueError
        If the step or the time is negative or `every` is below 1.
    """

    step: float = 0.0
    every: int | None = 1
    time: float = 0.0
    notes: tuple[Note, ...] = ()

    def __post_init__(self) -> None:
        _require_readout(self.step, self.every)
        if not self.time >= 0.0:
            raise ValueError(f"time is {self.time}; give s, 0 or more")


def _require_readout(step: float, every: int | None) -> None:
    if not step >= 0.0:
        raise ValueError(f"step is {step}; give rad, 0 or more")
    if every is not None and every < 1:
        raise ValueError(f"every is {every}; give 1 or more, or None")


def readout_of(angle: ArrayLike) -> Readout:
    """Whether what an angle does dithers the steps it is read out in.

    A walk over a readout step Delta leaves an error e that is uniform, of variance Delta^2/12,
    and uncorrelated with every increment of the walk (from any place within a step the average
    over places is zero). Its autocovariance over a time in which the angle strays by
    sigma about a steady turn is ``sum_m Delta^2/(2 pi^2 m^2) exp(-2 pi^2 m^2 sigma^2/Delta^2)``
    times a cosine of the turn (Widrow and Kollár, Quantization Noise, 2008, characteristic
    functions). The error is therefore white noise, as quantization is taken to be, only if angles
    are taken far enough apart for sigma to be half a step or more. If they are taken closer, it is
    a slow error of many samples, which a fit would call angle random walk.

    Parameters
    ----------
    angle
        (samples,) as read out, before anything is taken off.

    Returns
    -------
    Readout
        If the angle never leaves one steady turn, the step is 0 and `every` is 1.
    """
    values = np.asarray(angle, dtype=np.float64)
    every = 1
    taken = values
    rounding = _LAST_PLACES * float(np.finfo(float).eps) * max(map(abs, series.extent(values)))
    step = count_step(series.differences(values), rounding)
    if not math.isfinite(step):
        return Readout(step=0.0, every=1)
    while taken.size > _LEAST_STEPS:
        if _variance_of_steps(taken) >= _DITHERED * step**2:
            return Readout(step=step, every=every)
        taken = series.every(taken, 2)
        every *= 2
    return Readout(step=step, every=None)


def joint_readout(
    recording: Recording, gyros: Sequence[str], angle_rate: float, *, with_encoder: bool = True
) -> JointReadout:
    """Clusters that the readouts of gyros allow, differenced or used side by side.

    For one gyro alone on a turning table the steps of its encoder count as well, times the share
    of the table rate that it senses, unless they are small beside its noise.

    Parameters
    ----------
    recording
        That holds the gyros.
    gyros
        Names of those that are used.
    angle_rate
        Angles per second that are used: the sample rate, or a whole part of it.
    with_encoder
        Whether the steps of the encoder count.

    Raises
    ------
    RecordingError
        If one of the gyros is not there.
    ValueError
        If none is named or the rate makes no sense.
    """
    require_rate(angle_rate)
    if not gyros:
        raise ValueError("gyros is empty; name one or more")
    taken = round(recording.sample_rate / angle_rate)
    readouts = {}
    for name in gyros:
        angle = angle_of(recording.gyro(name), recording.sample_rate)
        readouts[name] = readout_of(angle if taken == 1 else series.every(angle, taken))
    encoder = _encoder_readout(recording, gyros, taken) if with_encoder else None
    if encoder is not None:
        readouts[f"the encoder, as {gyros[0]} senses the table"] = encoder
    step = sum(readout.step for readout in readouts.values())
    undithered = {name: readout for name, readout in readouts.items() if readout.every != 1}
    if not undithered:
        return JointReadout(step=step)
    largest = max(readout.step for readout in undithered.values()) / ARCSECOND
    what = f"the readout step of {', '.join(undithered)} ({largest:.3g} arcsec)"
    counts = [readout.every for readout in undithered.values() if readout.every is not None]
    apart = max(counts) / angle_rate if len(counts) == len(undithered) else math.inf
    if not recording.duration / apart >= LEAST_DITHERED:
        text = (
            f"{recording.duration:.4g} s dither {what} too few times for a fit to tell angle "
            "random walk from it, and no fit is an estimate of it; record longer, or read out "
            "finer"
        )
        note = Note(text=text, level="warning")
        return JointReadout(step=step, every=None, time=apart, notes=(note,))
    text = (
        f"nothing dithers {what} in less than {apart:.4g} s: coefficients are of angles that far "
        "apart, and the curve at shorter cluster times shows the readout"
    )
    return JointReadout(step=step, every=max(counts), time=apart, notes=(Note(text=text),))


def _encoder_readout(recording: Recording, gyros: Sequence[str], taken: int) -> Readout | None:
    """The steps of an encoder as one gyro senses them; None if they do not matter.

    What is taken off a gyro as table motion is its share of the encoder's reading, the error of
    its steps included. A difference of two gyros holds next to nothing of it.
    """
    if len(gyros) > 1 or recording.table is None:
        return None
    lowest, highest = series.extent(recording.table.values)
    if highest - lowest < _TURNS:
        return None
    gyro = angle_of(recording.gyro(gyros[0]), recording.sample_rate)
    table = recording.table.values
    if taken > 1:
        gyro, table = series.every(gyro, taken), series.every(table, taken)
    readout = readout_of(table)
    share = _sensed_share(gyro, table)
    step = abs(share) * readout.step
    if not step**2 / 12.0 > _MATTERS * _variance_beside(gyro, table, share):
        return None
    return Readout(step=step, every=readout.every)


def _sensed_share(gyro: FloatArray, table: FloatArray) -> float:
    """Share of the table's steps that a gyro senses, by least squares."""

    def products(block: slice) -> FloatArray:
        turned = np.diff(table[block.start : block.stop + 1])
        sensed = np.diff(gyro[block.start : block.stop + 1])
        return np.array([sensed @ turned, turned @ turned])

    both, own = series.total(products, table.size - 1, table)
    return float(both / own) if own > 0.0 else 0.0


def _variance_beside(gyro: FloatArray, table: FloatArray, share: float) -> float:
    """Variance of a gyro's steps beside table motion, if they are white."""

    def squares(block: slice) -> float:
        part = slice(block.start, block.stop + 2)
        changes = np.diff(gyro[part] - share * table[part], n=2)
        return float(changes @ changes)

    size = table.size - 2
    return 0.5 * series.total(squares, size, table) / size


def _variance_of_steps(values: FloatArray) -> float:
    """Mean variance of `_STEADY` steps in a row, the largest hundredth of them left out."""
    count = (values.size - 1) // _STEADY

    def variances(some: slice) -> FloatArray:
        steps = np.diff(values[_STEADY * some.start : _STEADY * some.stop + 1])
        # What all of them share is no variance, and would leave it to rounding.
        steps -= steps.mean()
        rows = steps.reshape(-1, _STEADY)
        return np.asarray(rows.var(axis=1, ddof=1))

    length = max(1, series.SPAN // _STEADY)
    found = np.concatenate(series.map(variances, count, values, length=length))
    kept = max(1, math.ceil(_COUNT * count))
    if kept < count:
        found.partition(kept - 1)
    return float(found[:kept].mean())
