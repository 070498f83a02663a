"""Columns of an Arrow schema, which Parquet and Feather share."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from sagnac.formats.source import Column, column


def text_of(metadata: Mapping[bytes, bytes] | None) -> dict[str, str]:
    """Metadata as text."""
    return {
        key.decode(errors="replace"): value.decode(errors="replace")
        for key, value in (metadata or {}).items()
    }


def is_numeric(kind: pa.DataType) -> bool:
    """Whether columns of that type hold numbers, times among them."""
    return bool(
        pa.types.is_integer(kind)
        or pa.types.is_floating(kind)
        or pa.types.is_boolean(kind)
        or pa.types.is_timestamp(kind)
    )


def column_of(item: pa.Field) -> Column:
    """A field with the unit and kind that its metadata states."""
    metadata = text_of(item.metadata)
    unit = item.type.unit if pa.types.is_timestamp(item.type) else metadata.get("unit")
    return column(item.name, unit=unit, kind=metadata.get("kind"))


def as_numpy(values: pa.Array) -> NDArray[Any]:
    """Numbers of an array; times as integers in their unit."""
    if pa.types.is_timestamp(values.type):
        values = values.cast(pa.int64())
    if pa.types.is_boolean(values.type) and not values.null_count:
        # A bit each. A cast would import what computes on arrays: a twentieth of a second.
        bits = np.frombuffer(values.buffers()[1], dtype=np.uint8)
        ones = np.unpackbits(bits, bitorder="little")
        return ones[values.offset : values.offset + len(values)]
    if pa.types.is_boolean(values.type):
        values = values.cast(pa.uint8())
    if values.null_count:
        values = values.cast(pa.float64(), safe=False).fill_null(np.nan)
    # Not by `to_numpy`, which imports pandas where it is installed: half a second.
    return np.from_dlpack(values)
