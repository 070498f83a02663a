"""PSINS ``.imu`` text logs: increments in counts, after a header that sizes them.

Reference: the comment block of the files that the PSINS toolbox (G. Yan) writes. Three
lines of six numbers follow it: the second holds the sampling interval (ms, fifth) and g (m/s²,
sixth), the third the size of one gyro count (arcsec, first to third) and of one accelerometer
count (1e-6 g s, fourth to sixth).
"""

import os
from collections.abc import Sequence
from itertools import chain, islice
from pathlib import Path
from typing import Final

import numpy as np

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import Note, RecordingError
from sagnac.formats.source import Column, Source
from sagnac.formats.statement import Statement
from sagnac.recording.columns import ACCELEROMETER_NAMES, GYRO_NAMES

_HEADER_ROWS: Final = 3
_MOST_HEADER_LINES: Final = 1000
_NO_END: Final = Note(
    level="warning",
    text="its last line has no end: the file may be cut off, and its last number wrong",
)
_ROW: Final = (*GYRO_NAMES, *ACCELEROMETER_NAMES)


def open_source(path: Path) -> Source:
    """Columns by the header of the log, kind ``increment``.

    Gyros are ``x``, ``y``, ``z``; accelerometers are ``ax``, ``ay``, ``az`` if the header sizes all
    of their counts.

    Raises
    ------
    RecordingError
        If the header is not there or states what cannot be.
    """
    header, lines = _header(path)
    interval_ms, gravity = header[1][4:]
    gyros, forces = header[2][:3], header[2][3:]
    if not (interval_ms > 0.0 and all(size > 0.0 for size in gyros)):
        raise RecordingError(
            f"the header states a sampling interval of {interval_ms:g} ms and gyro "
            f"factors of {', '.join(f'{size:g}' for size in gyros)} arcsec",
            remedy="all must be positive",
        )
    units = [f"{size!r}arcsec" for size in gyros]
    micro_g = 1e-6 * gravity
    if all(micro_g * size > 0.0 for size in forces):
        units += [f"{micro_g * size!r}m/s" for size in forces]
    with path.open("rb") as stream:
        stream.seek(-1, os.SEEK_END)
        # A last line that was cut off between two digits has no end.
        is_ended = stream.read() == b"\n"

    def load(keys: Sequence[str]) -> dict[str, FloatArray]:
        rows = _rows(path, lines)
        return {key: rows[:, _ROW.index(key)] for key in keys}

    return Source(
        columns=tuple(
            Column(key=name, name=name, unit=unit, kind="increment")
            for name, unit in zip(_ROW, units, strict=False)
        ),
        load=load,
        stated=Statement(sample_rate=round(1e3 / interval_ms, 9)),
        notes=() if is_ended else (_NO_END,),
    )


def _header(path: Path) -> tuple[list[list[float]], int]:
    """The three rows of the header of a log, and how many lines it has, comments included.

    Raises
    ------
    RecordingError
        If it is not there.
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
    return rows, lines


def _rows(path: Path, skipped: int) -> FloatArray:
    """(samples, 6) counts."""
    with path.open(encoding="utf-8") as stream:
        lines = islice(stream, skipped, None)
        first = next((line for line in lines if line.strip()), None)
        if first is None:
            return np.empty((0, len(_ROW)))
        rows = np.loadtxt(chain((first,), lines), comments="%", ndmin=2)
        if rows.shape[1] != len(_ROW):
            raise ValueError(f"rows of {rows.shape[1]} numbers, not {len(_ROW)}")
    return rows
