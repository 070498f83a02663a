"""PSINS ``.imu`` text logs: increments in counts, after a header that sizes them.

Reference: the comment block of the files that the PSINS toolbox (G. Yan) writes. Three
lines of six numbers follow it: the second holds the sampling interval (ms, fifth) and g (m/s²,
sixth), the third the size of one gyro count (arcsec, first to third) and of one accelerometer
count (1e-6 g s, fourth to sixth).
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import Final

import numpy as np

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import Note, RecordingError
from sagnac.formats.registry import PSINS
from sagnac.formats.source import Column, Source, Stored, in_memory
from sagnac.formats.statement import Statement
from sagnac.recording.columns import ACCELEROMETER_NAMES, GYRO_NAMES

_HEADER_ROWS: Final = 3
_MOST_HEADER_LINES: Final = 1000
_NO_END: Final = Note(
    level="warning",
    text="its last line has no end: the file may be cut off, and its last number wrong",
)
_ROW: Final = (*GYRO_NAMES, *ACCELEROMETER_NAMES)


@dataclass(frozen=True, slots=True, kw_only=True)
class Header:
    """Statements of the header of a log.

    Attributes
    ----------
    lines
        In the header, comments included.
    interval_ms
        Sampling interval, ms.
    counts_arcsec
        Sizes of one count of x, y and z, arcsec.
    counts_m_per_s
        Sizes of one count of ax, ay and az, m/s; those of a log without accelerometers are 0.

    Raises
    ------
    RecordingError
        If the interval or a size of a gyro is not positive.
    """

    lines: int
    interval_ms: float
    counts_arcsec: tuple[float, float, float]
    counts_m_per_s: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not (self.interval_ms > 0.0 and all(size > 0.0 for size in self.counts_arcsec)):
            sizes = ", ".join(f"{size:g}" for size in self.counts_arcsec)
            raise RecordingError(
                f"the header states a sampling interval of {self.interval_ms:g} ms and gyro "
                f"factors of {sizes} arcsec",
                remedy="all must be positive",
            )


def read_header(path: Path) -> Header:
    """The header of a log.

    Raises
    ------
    RecordingError
        If it is not there or states what cannot be.
    """
    rows: list[list[float]] = []
    lines, commented = 0, False
    with path.open(encoding="utf-8", errors="strict") as stream:
        for line in islice(stream, _MOST_HEADER_LINES):
            lines += 1
            if not line.strip() or line.lstrip().startswith("%"):
                commented = commented or bool(line.strip())
                continue
            rows.append([float(item) for item in line.split()])
            if len(rows) == _HEADER_ROWS:
                break
    # Without the comments that open a log, the first rows of its data would pass for a header.
    if not commented or len(rows) < _HEADER_ROWS or any(len(row) != len(_ROW) for row in rows):
        raise RecordingError(
            "has no PSINS header, three lines of six numbers after the comments",
            remedy="correct it, or give a CSV with {rate}, {kind} and {unit}",
        )
    x, y, z = rows[2][:3]
    micro_g = 1e-6 * rows[1][5]
    ax, ay, az = (micro_g * size for size in rows[2][3:])
    return Header(
        lines=lines,
        interval_ms=rows[1][4],
        counts_arcsec=(x, y, z),
        counts_m_per_s=(ax, ay, az),
    )


def open_source(path: Path) -> Source:
    """Columns by the header of the log, kind ``increment``.

    Gyros are ``x``, ``y``, ``z``; accelerometers are ``ax``, ``ay``, ``az`` if the header sizes all
    of their counts.

    Raises
    ------
    RecordingError
        If the header is not there or states what cannot be.
    """
    header = read_header(path)

    def load(keys: Sequence[str]) -> Stored:
        rows = _rows(path, header)
        return in_memory({key: rows[:, _ROW.index(key)] for key in keys})

    has_forces = all(size > 0.0 for size in header.counts_m_per_s)
    units = (
        *(f"{size!r}arcsec" for size in header.counts_arcsec),
        *(f"{size!r}m/s" for size in header.counts_m_per_s if has_forces),
    )
    return Source(
        format=PSINS.name,
        columns=tuple(
            Column(key=name, name=name, unit=unit, kind="increment")
            for name, unit in zip(_ROW, units, strict=False)
        ),
        load=load,
        stated=Statement(sample_rate=round(1e3 / header.interval_ms, 9)),
        notes=() if _ends_with_a_line(path) else (_NO_END,),
    )


def _ends_with_a_line(path: Path) -> bool:
    """Whether the last line has an end; one that was cut off between two digits has none."""
    with path.open("rb") as stream:
        stream.seek(-1, os.SEEK_END)
        return stream.read() == b"\n"


def _rows(path: Path, header: Header) -> FloatArray:
    """(samples, 6) counts."""
    with path.open(encoding="utf-8") as stream:
        lines = islice(stream, header.lines, None)
        first = next((line for line in lines if line.strip()), None)
        if first is None:
            return np.empty((0, len(_ROW)))
        rows = np.loadtxt(chain((first,), lines), comments="%", ndmin=2)
        if rows.shape[1] != len(_ROW):
            raise ValueError(f"rows of {rows.shape[1]} numbers, not {len(_ROW)}")
    return rows
