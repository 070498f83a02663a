"""miniSEED (2 and 3), which ring lasers of geodesy write: one column a source."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pymseed import MS3Record, MS3TraceList, get_error_messages

from sagnac.core.errors import Note, RecordingError, counted
from sagnac.formats.source import Column, Source
from sagnac.formats.statement import Statement

_TIME: Final = "time"
_PREFIX: Final = "FDSN:"
# In a warning of the library that a last sample is not the one stated.
_SUM: Final = "integrity check"


def open_source(path: Path) -> Source:
    """Sources by their identifiers, without ``FDSN:``; if records are missing, with stamps.

    Raises
    ------
    RecordingError
        If the file is not miniSEED, is cut off, holds no samples, or its sources differ in rate.
    """
    # A list of traces leaves out a last record that is not whole, and says nothing.
    for _ in MS3Record.from_file(path):
        pass
    with MS3TraceList.from_file(path) as traces:
        found = {
            one.sourceid.removeprefix(_PREFIX): [
                (segment.starttime, segment.samprate, segment.samplecnt) for segment in one
            ]
            for one in traces
        }
    found = {name: segments for name, segments in found.items() if sum(s[2] for s in segments)}
    rates = {rate for segments in found.values() for _, rate, _ in segments}
    if len(rates) != 1 or min(rates, default=0.0) <= 0.0:
        listed = ", ".join(f"{rate:g}" for rate in sorted(rates)) or "none"
        raise RecordingError(
            f"its sources are sampled at different rates, {listed} Hz",
            remedy="give a file of sources sampled together",
        )
    (rate,) = rates
    _require_together(found, rate)
    first = next(iter(found.values()))
    is_whole = all(len(segments) == 1 for segments in found.values())
    columns = tuple(Column(key=name, name=name, unit="counts") for name in found)
    notes: tuple[Note, ...] = ()
    if is_whole:
        stated = Statement(sample_rate=rate)
    else:
        columns = (*columns, Column(key=_TIME, name=_TIME, unit="ns"))
        stated = Statement()
        text = f"records are missing: {counted(len(first), 'stretch')}es without a gap"
        notes = (Note(text=text, channel=_TIME),)

    def load(keys: Sequence[str]) -> dict[str, NDArray[Any]]:
        arrays: dict[str, NDArray[Any]] = {}
        if _TIME in keys:
            arrays[_TIME] = _stamps(first)
        with MS3TraceList.from_file(path, unpack_data=True) as traces:
            _require_sums()
            for one in traces:
                name = one.sourceid.removeprefix(_PREFIX)
                if name in keys:
                    arrays[name] = np.concatenate(list(_samples(one)))
        return arrays

    return Source(columns=columns, load=load, stated=stated, notes=notes)


def _require_together(found: Mapping[str, Sequence[tuple[int, float, int]]], rate: float) -> None:
    """Refuse sources whose samples were not taken together.

    Raises
    ------
    RecordingError
        If one begins half a sample or more after another.
    """
    starts = {name: segments[0][0] for name, segments in found.items()}
    first, last = min(starts, key=lambda one: starts[one]), max(starts, key=lambda one: starts[one])
    late = 1e-9 * (starts[last] - starts[first])
    if late > 0.5 / rate:
        raise RecordingError(
            f"begins {late:.6g} s after {first}",
            channel=last,
            remedy="cut all sources to the same span before they are put together",
        )


def _require_sums() -> None:
    """Refuse samples that do not add up to the last one that their record states (Steim 1 and 2).

    The library warns of that and hands them over.
    """
    wrong = [text for text in get_error_messages() if _SUM in text]
    if wrong:
        raise ValueError(wrong[0])


def _samples(trace: Any) -> Iterator[NDArray[Any]]:
    for segment in trace:
        values = np.array(segment.np_datasamples)
        if values.dtype.kind not in "iuf":
            raise ValueError("its samples are text")
        yield values


def _stamps(segments: Sequence[tuple[int, float, int]]) -> NDArray[np.int64]:
    """When samples were taken, ns since 1970."""
    return np.concatenate(
        [
            start + np.rint(np.arange(count) * (1e9 / rate)).astype(np.int64)
            for start, rate, count in segments
        ]
    )
