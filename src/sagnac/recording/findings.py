"""What is noticed about the quality of the data, and where in the record."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.recording.encoder import LARGEST_SHARE_MISSING, MOST_MISSING_IN_A_ROW
from sagnac.recording.model import MINIMUM_SAMPLES, Recording, second_of

Level = Literal["error", "warning", "note"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing noticed about the data, with its remedy where there is one.

    Attributes
    ----------
    level
        ``error``: no figure can rest on this. ``warning``: looks wrong. ``note``: to know.
    channel
        Gyro name, ``table``, ``time``, or empty where it is about the whole.
    message
        One line.
    """

    level: Level
    channel: str
    message: str


def counted(count: int, noun: str) -> str:
    """``1 sample``, ``2 samples``."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def places_where(
    values: FloatArray, test: Callable[[FloatArray], NDArray[np.bool_]], *, following: int = 0
) -> Iterator[NDArray[np.int64]]:
    """Where `test` holds, span by span, ascending.

    It is given the values of a span, and of so many samples `following` it.
    """
    for span in series.through(values.size - following, values):
        yield span.start + np.flatnonzero(test(values[span.start : span.stop + following]))


def is_not_finite(values: FloatArray) -> NDArray[np.bool_]:
    """Where values are NaN or infinite."""
    return ~np.isfinite(values)


def tally(places: Iterable[NDArray[np.int64]]) -> tuple[int, int]:
    """How many there are, and the first; -1 where there is none."""
    count, first = 0, -1
    for some in places:
        if count == 0 and some.size:
            first = int(some[0])
        count += some.size
    return count, first


def longest_between(samples: int, cuts: Iterable[NDArray[np.int64]]) -> tuple[int, int]:
    """First sample, and the one after the last, of the longest stretch between `cuts`."""
    first, last, edge = 0, -1, -1
    for places in chain(cuts, (np.array([samples]),)):
        edges = np.concatenate(([edge], places))
        lengths = np.diff(edges) - 1
        longest = int(np.argmax(lengths)) if lengths.size else 0
        if lengths.size and lengths[longest] > last - first:
            first, last = int(edges[longest]) + 1, int(edges[longest + 1])
        edge = int(edges[-1])
    return first, last


def longest_stretch(recording: Recording, cuts: Iterable[NDArray[np.int64]]) -> str:
    """``--slice START:STOP`` for the longest stretch of samples between those at `cuts`.

    Rounded inwards to ms, so that the stretch it names holds none of them.
    """
    first, after = longest_between(recording.samples, cuts)
    last = after - 1
    if last - first + 1 < MINIMUM_SAMPLES:
        return "get the file again from its source"
    start = 0.0 if first == 0 else math.ceil(second_of(recording, first) * 1e3) / 1e3
    stop = "" if last == recording.samples - 1 else f"{second_of(recording, last):.3f}"
    return f"take the sound stretch with --slice {start:g}:{stop}"


def not_finite_findings(recording: Recording, name: str, values: FloatArray) -> list[Finding]:
    """Samples of one channel that are NaN or infinite."""
    bad, first = tally(places_where(values, is_not_finite))
    if bad == 0:
        return []
    # Reading has interpolated what it could of a table.
    beyond = (
        f", more than can be interpolated ({MOST_MISSING_IN_A_ROW} in a row, "
        f"{100.0 * LARGEST_SHARE_MISSING:g} % of all)"
        if name == "table"
        else ""
    )
    return [
        Finding(
            level="error",
            channel=name,
            message=f"{counted(bad, 'sample')} NaN or infinite{beyond}, the first at "
            f"{second_of(recording, first):.3f} s; "
            f"{longest_stretch(recording, places_where(values, is_not_finite))}",
        )
    ]
