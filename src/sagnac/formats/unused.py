"""Columns that are not taken and speak against what is: time stamps, and counters of samples."""

import re
from collections.abc import Sequence
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import Note, RecordingError, counted
from sagnac.formats.choice import Choice, is_like_time, is_time_unit
from sagnac.formats.precedence import Statements
from sagnac.formats.sampling import Stretch
from sagnac.formats.source import Column, Source
from sagnac.formats.suspicions import likely_time_unit
from sagnac.units import TIME_UNITS, canonical

_COUNTER: Final = re.compile(
    r"(?:^|[^a-z])(?:count(?:er)?s?|cnt|seq(?:uence)?|samples?|index|idx|frames?|packets?|pkt|nr|no|"
    r"num(?:ber)?|row|n|#|zähler|lfd)(?:$|[^a-z])",
    re.IGNORECASE,
)
# Units that stamps without one may be in.
_UNITS: Final = ("s", "ms", "us", "ns", "min", "h")
# How nearly stamps and a stated rate agree, and share of the steps that are usual ones: within half
# of the median for stamps, and one of a counter exactly.
_AGREES: Final = 0.02
_USUAL: Final = 0.9
_WITHIN: Final = 0.5


def unused_notes(
    source: Source, choice: Choice, statements: Statements, stretch: Stretch
) -> tuple[Note, ...]:
    """Notes by the columns beside those that are taken.

    Parameters
    ----------
    source
        The opened file.
    choice
        Columns that are taken.
    statements
        Of caller, TOML and file.
    stretch
        The samples that are taken, and when they were.

    Returns
    -------
    tuple of Note
        Samples that a counter shows to be missing.

    Raises
    ------
    RecordingError
        If time stamps that are not taken contradict the rate that is stated.
    """
    left = [one for one in source.columns if one.key not in choice.keys]
    if choice.time is None and statements.role("time") != "none":
        for column in left:
            if is_like_time(column):
                _require_rate(source, column, stretch)
    notes: list[Note] = []
    for column in left:
        if _COUNTER.search(column.name) and not is_like_time(column):
            notes += _lost(source, column, stretch)
    return tuple(notes[:1])


def _require_rate(source: Source, column: Column, stretch: Stretch) -> None:
    """Refuse a rate that even stamps contradict, in whatever unit of time they may be.

    Raises
    ------
    RecordingError
        It names the rate that they give.
    """
    stamps = _loaded(source, column, stretch)
    steps = np.diff(stamps)
    usual = float(np.median(steps)) if steps.size else 0.0
    if not usual > 0.0 or not _mostly(np.abs(steps - usual) < _WITHIN * usual):
        return
    known = column.unit is not None and is_time_unit(column.unit)
    if usual == 1.0 and not known:
        # It numbers the rows.
        return
    step = float(stamps[-1] - stamps[0]) / steps.size
    stated = stretch.sampling.sample_rate
    units: Sequence[str] = _UNITS
    if known and canonical(column.unit or "") in TIME_UNITS:
        units = (canonical(column.unit or ""),)
    rates = {unit: 1.0 / (step * TIME_UNITS[unit]) for unit in units}
    if any(abs(rate / stated - 1.0) < _AGREES for rate in rates.values()):
        return
    unit = units[0] if len(units) == 1 else likely_time_unit(step)
    if unit is None:
        return
    raise RecordingError(
        f"its stamps are those of {rates[unit]:.6g} Hz in {unit}, and {stated:.6g} Hz is stated",
        channel=column.key,
        remedy=f"state {{rate {rates[unit]:.6g}}} or {{time {column.name}:{unit}}}, or ignore the "
        "stamps with {time none}",
    )


def _lost(source: Source, column: Column, stretch: Stretch) -> tuple[Note, ...]:
    """Samples that a counter leaves out: a warning; nothing if the column is no counter."""
    counts = _loaded(source, column, stretch)
    steps = np.diff(counts)
    if steps.size == 0 or not np.array_equal(counts, np.rint(counts)):
        return ()
    usual = float(np.median(steps))
    if usual == 0.0 or not _mostly(steps == usual):
        return ()
    ahead = steps * np.sign(usual)
    one = abs(usual)
    back = ahead < 0.0
    if back.any():
        # It starts over at what most of its falls come to.
        falls, often = np.unique(one - ahead[back], return_counts=True)
        ahead = np.where(back, ahead + falls[int(np.argmax(often))], ahead)
    missing = np.rint(ahead / one) - 1.0
    places = np.flatnonzero((ahead > one) & (np.mod(ahead, one) == 0.0))
    if places.size == 0:
        return ()
    at = stretch.start + (int(places[0]) + 1) / stretch.sampling.sample_rate
    text = (
        f"counts {counted(int(missing[places].sum()), 'sample')} that are not there, at "
        f"{counted(places.size, 'place')}, the first at {at:.3f} s: they were lost; take a stretch "
        "without such a place with {slice}"
    )
    return (Note(level="warning", channel=column.key, text=text),)


def _mostly(usual: np.ndarray) -> bool:
    return bool(np.count_nonzero(usual) >= _USUAL * usual.size)


def _loaded(source: Source, column: Column, stretch: Stretch) -> FloatArray:
    """The numbers of a column that is not taken; none if they cannot be read or are not finite."""
    nothing = np.empty(0)
    try:
        stored = source.load([column.key])
        if stored.lengths[column.key] < stretch.stop:
            return nothing
        values = series.Filling(stretch.stop - stretch.first)
        origin = None
        for piece in stored.pieces([column.key], stretch.first, stretch.stop):
            raw = piece[column.key]
            # A counter that starts over falls below where it began.
            raw = raw.astype(np.int64) if raw.dtype.kind in "ub" else raw
            origin = raw[0] if origin is None and raw.size else origin
            values.append(np.asarray(raw - origin, dtype=np.float64))
    except (RecordingError, TypeError):
        return nothing
    filled = np.asarray(values.filled)
    return filled if filled.size > 1 and np.isfinite(filled).all() else nothing
