"""miniSEED (2 and 3), which ring lasers of geodesy write: one column a source."""

from collections.abc import Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pymseed import MS3Record, MS3TraceList, get_error_messages

from sagnac.core.errors import Note, RecordingError
from sagnac.formats.source import Column, Source
from sagnac.formats.statement import Statement

Segment = tuple[int, float, int]
"""Start in ns since 1970, sample rate in Hz and samples of a stretch without a gap."""

_TIME: Final = "time"
_PREFIX: Final = "FDSN:"


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
        facts = attrgetter("starttime", "samprate", "samplecnt")
        listed = {one.sourceid.removeprefix(_PREFIX): [*map(facts, one)] for one in traces}
    found = {name: some for name, some in listed.items() if sum(count for _, _, count in some)}
    rate = _common_rate(found)
    segments = next(iter(found.values()))
    is_whole = all(len(segments) == 1 for segments in found.values())
    columns = [Column(key=name, name=name, unit="counts") for name in found]
    notes: list[Note] = []
    if not is_whole:
        columns.append(Column(key=_TIME, name=_TIME, unit="ns"))
        text = f"records are missing: {len(segments)} stretches without a gap"
        notes.append(Note(text=text, channel=_TIME))

    def load(keys: Sequence[str]) -> dict[str, NDArray[Any]]:
        arrays: dict[str, NDArray[Any]] = {}
        if _TIME in keys:
            arrays[_TIME] = np.concatenate([_stamps(one) for one in segments])
        with MS3TraceList.from_file(path, unpack_data=True) as traces:
            # It warns of samples that do not add up to the last one that their record states
            # (Steim 1 and 2), and hands them over.
            for text in get_error_messages():
                if "integrity check" in text:
                    raise ValueError(text)
            for one in traces:
                name = one.sourceid.removeprefix(_PREFIX)
                if name in keys:
                    arrays[name] = np.concatenate([part.np_datasamples for part in one])
                    if arrays[name].dtype.kind not in "iuf":
                        raise ValueError("its samples are text")
        return arrays

    stated = Statement(sample_rate=rate if is_whole else None)
    return Source(columns=tuple(columns), load=load, stated=stated, notes=tuple(notes))


def _common_rate(traces: Mapping[str, Sequence[Segment]]) -> float:
    """Sample rate of all sources, Hz.

    Raises
    ------
    RecordingError
        If they differ in it, or do not begin together.
    """
    rates = {rate for segments in traces.values() for _, rate, _ in segments}
    if len(rates) != 1 or min(rates) <= 0.0:
        listed = ", ".join(f"{rate:g}" for rate in sorted(rates)) or "none"
        problem = f"its sources are sampled at different rates, {listed} Hz"
        raise RecordingError(problem, remedy="give a file of sources sampled together")
    (rate,) = rates
    starts = {name: segments[0][0] for name, segments in traces.items()}
    first, last = min(starts, key=starts.__getitem__), max(starts, key=starts.__getitem__)
    late = 1e-9 * (starts[last] - starts[first])
    if late > 0.5 / rate:
        remedy = "cut all sources to the same span before they are put together"
        raise RecordingError(f"begins {late:.6g} s after {first}", channel=last, remedy=remedy)
    return rate


def _stamps(segment: Segment) -> NDArray[np.int64]:
    """When the samples of a segment were taken, ns since 1970."""
    start, rate, count = segment
    steps = np.rint(np.arange(count) * (1e9 / rate)).astype(np.int64)
    return np.asarray(start + steps, dtype=np.int64)
