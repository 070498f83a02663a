"""NumPy arrays by themselves (``.npy``), which say nothing of their columns."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.errors import RecordingError
from sagnac.formats.files import damaged, require_content
from sagnac.formats.registry import NPY
from sagnac.formats.source import Column, Source, Stored

_MOST_COLUMNS: Final = 4096


Pieces = Iterator[dict[str, NDArray[Any]]]


def open_source(path: Path) -> Source:
    """Columns by their numbers, from 1, along the short side; those of records by their names.

    Raises
    ------
    RecordingError
        If the file is no array of real numbers in one or two dimensions, or is cut off.
    """
    with damaged(NPY.name):
        array = np.load(path, mmap_mode="r", allow_pickle=False)
        require_content(array.nbytes, path.stat().st_size, path.name)
    names = array.dtype.names
    if names is not None and array.ndim == 1:
        columns = {name: array[name] for name in names if array[name].dtype.kind in "biuf"}
    elif array.dtype.kind in "biuf" and array.ndim in (1, 2) and min(array.shape) <= _MOST_COLUMNS:
        table = array.reshape(-1, 1) if array.ndim == 1 else array
        table = table if table.shape[0] >= table.shape[1] else table.T
        columns = {str(number + 1): table[:, number] for number in range(table.shape[1])}
    else:
        raise RecordingError(
            f"holds {array.dtype} of shape {array.shape}, no table of real numbers",
            remedy="store one row a sample and one column a channel",
        )

    def load(keys: Sequence[str]) -> Stored:
        def pieces(wanted: Sequence[str], start: int, stop: int) -> Pieces:
            with damaged(NPY.name):
                for first in range(start, stop, series.SPAN):
                    block = slice(first, min(first + series.SPAN, stop))
                    yield {key: np.array(columns[key][block]) for key in wanted}

        return Stored(lengths={key: columns[key].shape[0] for key in keys}, pieces=pieces)

    return Source(
        format=NPY.name,
        columns=tuple(
            Column(key=key, name=key, number=number) for number, key in enumerate(columns, start=1)
        ),
        load=load,
    )
