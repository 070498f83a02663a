"""PSINS ``.imu`` text logs: increments in counts, after a header that sizes them.

Reference: the comment block of the files that the PSINS toolbox (G. Yan) writes. Of the
three lines of six numbers after it, the second holds the sampling interval (ms, fifth),
the third the size of one gyro count (arcsec, first to third).
"""

from collections.abc import Sequence
from itertools import chain, islice
from pathlib import Path
from typing import Final

import numpy as np

from sagnac.errors import RecordingError
from sagnac.formats.source import Column, Source, Stored, damaged, in_memory
from sagnac.formats.statement import Statement

FORMAT: Final = "PSINS imu"
SUFFIXES: Final = (".imu",)

_HEADER_ROWS: Final = 3
_ROW: Final = ("x", "y", "z", "accelerometer_x", "accelerometer_y", "accelerometer_z")


def open_source(path: Path) -> Source:
    """Header of the log. Gyros are ``x``, ``y``, ``z``, kind ``increment``.

    Raises
    ------
    RecordingError
        If the header is not there or states what cannot be.
    """
    header: list[list[float]] = []
    skip = 0
    with damaged(path, FORMAT), path.open(encoding="utf-8", errors="strict") as stream:
        for line in islice(stream, 1000):
            skip += 1
            if not line.strip() or line.lstrip().startswith("%"):
                continue
            header.append([float(item) for item in line.split()])
            if len(header) == _HEADER_ROWS:
                break
    if len(header) < _HEADER_ROWS or any(len(row) != len(_ROW) for row in header):
        raise RecordingError(
            f"{path}: has no PSINS header, three lines of six numbers after the comments; "
            "correct it, or give a CSV with --rate, --kind and --unit"
        )
    interval_ms, factors = header[1][4], header[2][:3]
    if not (interval_ms > 0.0 and all(factor > 0.0 for factor in factors)):
        raise RecordingError(
            f"{path}: the header states a sampling interval of {interval_ms:g} ms and gyro factors "
            f"of {', '.join(f'{factor:g}' for factor in factors)} arcsec; all must be positive"
        )

    def load(keys: Sequence[str]) -> Stored:
        with damaged(path, FORMAT), path.open(encoding="utf-8") as stream:
            rows = islice(stream, skip, None)
            first = next((line for line in rows if line.strip()), None)
            if first is None:
                return in_memory({key: np.empty(0) for key in keys})
            table = np.loadtxt(chain((first,), rows), comments="%", ndmin=2)
            if table.shape[1] != len(_ROW):
                raise ValueError(f"rows of {table.shape[1]} numbers, not {len(_ROW)}")
        return in_memory({key: table[:, _ROW.index(key)] for key in keys})

    return Source(
        format=FORMAT,
        columns=tuple(
            Column(key=name, name=name, unit=f"{factor!r}arcsec", kind="increment")
            for name, factor in zip(_ROW, factors, strict=False)
        ),
        load=load,
        stated=Statement(sample_rate=round(1e3 / interval_ms, 9)),
    )
