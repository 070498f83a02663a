"""When samples were taken: stamps, sample rate, and the stretch of the file that is taken."""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from sagnac import series
from sagnac.arrays import BooleanArray, FloatArray
from sagnac.errors import RecordingError
from sagnac.formats.source import Stored
from sagnac.recording.stamps import Sampling, sampling

Span = tuple[float | None, float | None]

# A stamp that misses the limit of a slice by less than this, s, is at it.
_SLACK: Final = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """The samples of a file that are taken, and when they were.

    Attributes
    ----------
    first, stop
        First sample of the file that is taken, and the one after the last.
    start
        Time of the first, s from the first sample of the file.
    sampling
        Rate and times of those taken.

    Raises
    ------
    ValueError
        If the stretch stops before it starts.
    """

    first: int
    stop: int
    start: float
    sampling: Sampling

    def __post_init__(self) -> None:
        if not 0 <= self.first <= self.stop:
            raise ValueError(f"first and stop are {self.first} and {self.stop}; stop comes last")

    @property
    def span_s(self) -> tuple[float, float]:
        """Start of the first sample and end of the last, s from the first of the file."""
        return self.start, self.start + (self.stop - self.first) / self.sampling.sample_rate


def sampled_by_rate(samples: int, rate: float, span: Span | None) -> Stretch:
    """Uniform samples without stamps.

    Parameters
    ----------
    samples
        In the file.
    rate
        Samples per second.
    span
        Start and stop to take, s from the first sample, or None for all.

    Raises
    ------
    RecordingError
        If fewer than two samples lie in the span.
    """
    even = Sampling(times=None, sample_rate=rate)
    if span is None:
        return Stretch(first=0, stop=samples, start=0.0, sampling=even)
    start, stop = span
    first = min(samples, math.ceil((start or 0.0) * rate - 1e-6))
    last = samples if stop is None else min(samples, math.ceil(stop * rate - 1e-6))
    _check_slice(first, last)
    return Stretch(first=first, stop=last, start=first / rate, sampling=even)


def sampled_by_stamps(stamps: FloatArray, span: Span | None, stated_rate: float | None) -> Stretch:
    """Samples with stamps.

    Parameters
    ----------
    stamps
        (two samples or more,) s from the first of the file.
    span
        Start and stop to take, s from the first sample, or None for all.
    stated_rate
        Samples per second in words, or None.

    Raises
    ------
    RecordingError
        If fewer than two samples lie in the span, time does not run forwards, or the stamps
        contradict the rate in words.
    """
    first, last = 0, stamps.size
    if span is not None:
        start, stop = span
        first = first_at(stamps, start or 0.0)
        last = stamps.size if stop is None else first + first_at(stamps[first:], stop)
        _check_slice(first, last)
    taken = sampling(stamps[first:last], stated_rate)
    return Stretch(first=first, stop=last, start=float(stamps[first]), sampling=taken)


def _check_slice(first: int, stop: int) -> None:
    """Refuse a slice of too few samples to tell a rate from their stamps."""
    if stop - first < 2:
        raise RecordingError(
            "fewer than two samples lie in the slice", remedy="widen {slice START:STOP}"
        )


def stamps_in_seconds(stored: Stored, key: str, unit: float, until: float | None) -> FloatArray:
    """Stamps in s from the first, to the one at `until`.

    The first is taken off before anything is converted, so that integers lose nothing by the size
    of the epoch.

    Parameters
    ----------
    stored
        Columns of the file.
    key
        That of the stamps.
    unit
        Seconds in one unit of them.
    until
        s from the first, after which none are needed, or None.
    """
    samples = stored.lengths[key]
    times = series.Filling(samples)
    origin: Any = None
    for piece in stored.pieces([key], 0, samples):
        raw = piece[key]
        origin = raw[0] if origin is None else origin
        seconds = np.asarray(raw - origin, dtype=np.float64) * unit
        times.append(seconds)
        if until is not None and (seconds >= until - _SLACK).any():
            break
    return times.filled


def first_at(times: FloatArray, limit: float) -> int:
    """First sample at or after `limit`, s; their number if there is none."""

    def reached(block: slice) -> BooleanArray:
        return np.asarray(times[block] >= limit - _SLACK)

    return series.first_where(reached, times.size, times)
