"""Scratch numbers in rows, for transforms whose rounds cross rows and columns."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BufferedRandom
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Scratch:
    """Numbers in rows, in memory or in a file, written and read in blocks.

    A file is not mapped: writes to pages all over a mapping cost several times what plain ones
    do, and each may map two megabytes around it.

    Attributes
    ----------
    width
        Numbers in a row.
    values
        (rows, width) in memory; empty where they lie in the file.
    file
        None where they lie in memory.
    """

    width: int
    values: NDArray[Any]
    file: BufferedRandom | None

    def write(self, row: int, column: int, block: NDArray[Any]) -> None:
        """Store `block`, (rows, columns), from a row and a column on."""
        if self.file is None:
            self.values[row : row + block.shape[0], column : column + block.shape[1]] = block
            return
        block = np.ascontiguousarray(block)
        for index, line in enumerate(block, start=row):
            self.file.seek((index * self.width + column) * block.itemsize)
            self.file.write(line.view(np.uint8))

    def read(self, rows: slice, columns: slice) -> NDArray[Any]:
        """Stored values, (rows, columns); not to be written to."""
        if self.file is None:
            return self.values[rows, columns]
        block = np.empty((rows.stop - rows.start, columns.stop - columns.start), self.values.dtype)
        for index, line in enumerate(block, start=rows.start):
            self.file.seek((index * self.width + columns.start) * block.itemsize)
            self.file.readinto(line.view(np.uint8))
        return block

    def first_row(self) -> FloatArray:
        """The first row, which holds real numbers, as a series."""
        if self.file is None:
            return np.asarray(self.values[0])
        self.file.flush()
        return series.mapped(self.file, self.width)


@contextmanager
def scratch(rows: int, width: int, dtype: type) -> Iterator[Scratch]:
    """Room for (rows, width) numbers, in a file if that is more than `series.IN_MEMORY` floats."""
    itemsize = np.dtype(dtype).itemsize
    if rows * width * itemsize <= 8 * series.IN_MEMORY:
        yield Scratch(width=width, values=np.empty((rows, width), dtype), file=None)
    else:
        with tempfile.TemporaryFile(prefix="sagnac-") as file:
            yield Scratch(width=width, values=np.empty(0, dtype), file=file)
