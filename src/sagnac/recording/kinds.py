"""Kinds of samples: angle, increment or rate, and the way from each to the angle."""

import math

import numpy as np
from numpy.typing import ArrayLike

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import RecordingError
from sagnac.recording.channel import Channel, Kind, require_kind, require_rate


def angle_of(channel: Channel, sample_rate: float) -> FloatArray:
    """Accumulated angle of a channel.

    Increments and rates are summed after their mean is taken off and put back as a
    ramp, so that a large constant rate costs no precision in the noise.

    Parameters
    ----------
    channel
        Of any kind.
    sample_rate
        Samples per second.

    Returns
    -------
    FloatArray
        (samples,), rad; the channel's own values if it is one of angle.
    """
    if channel.kind == "angle":
        return channel.values
    values = channel.values
    per_step = 1.0 if channel.kind == "increment" else sample_rate
    mean = series.mean(values) / per_step
    angle = series.empty(values.size)

    def add(turned: float, block: slice) -> float:
        """Sum over one block, from what was turned before; the ramp is put back behind it."""
        steps = values[block] / per_step
        steps -= mean
        steps[0] += turned
        np.cumsum(steps, out=angle[block])
        turned = float(angle[block.stop - 1])
        angle[block] += mean * np.arange(block.start + 1, block.stop + 1)
        return turned

    series.reduce(add, 0.0, values.size, values, angle)
    return angle


def finite_extent(values: FloatArray) -> float:
    """Largest less smallest of the finite samples, 0 if there are none."""

    def ends(block: slice) -> tuple[float, float]:
        finite = values[block][np.isfinite(values[block])]
        return float(finite.min(initial=np.inf)), float(finite.max(initial=-np.inf))

    found = series.map(ends, values.size, values)
    lowest = min((low for low, _ in found), default=np.inf)
    highest = max((high for _, high in found), default=-np.inf)
    return max(highest - lowest, 0.0)


def angle_increments(values: ArrayLike, *, kind: Kind, sample_rate: float) -> FloatArray:
    """Angle turned over each sample interval.

    Parameters
    ----------
    values
        (samples,), rad for ``angle`` and ``increment``, rad/s for ``rate``.
    kind
        What one sample is.
    sample_rate
        Samples per second.

    Returns
    -------
    FloatArray
        (increments,), rad: one fewer than the samples for ``angle``, else as many.

    Raises
    ------
    RecordingError
        If a sample is not finite.
    ValueError
        If an argument makes no sense.
    """
    samples = np.asarray(values, dtype=np.float64)
    if samples.ndim != 1:
        raise ValueError(f"values has shape {samples.shape}; give one channel, shape (samples,)")
    require_kind(kind)
    require_rate(sample_rate)
    # One sum tells whole samples without a second array of their size.
    finite = samples.size == 0 or math.isfinite(series.mean(samples))
    if not finite and not np.isfinite(samples).all():
        first = int(np.argmin(np.isfinite(samples)))
        raise RecordingError(
            f"sample {first} is not finite and there is no room for gaps here",
            remedy="take a span without gaps ({slice})",
        )
    if kind == "angle":
        return series.differences(samples)
    return samples / sample_rate if kind == "rate" else samples
