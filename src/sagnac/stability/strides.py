"""Windows that an estimator skips if taking every one would cost too much."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagnac.errors import Note
from sagnac.stability.names import Estimator

# Squares at one tau before windows are skipped.
LARGEST_WORK: Final = 3e7


def window_stride(windows: int, squares: int, cluster: int) -> int:
    """Spacing of the outer windows that bounds the work at one tau.

    Windows an eighth of a cluster apart are so correlated that skipping between them costs
    next to nothing, so it is never wider.

    Parameters
    ----------
    windows
        Outer windows in the record.
    squares
        In each window.
    cluster
        In samples.
    """
    return min(max(1, math.ceil(windows * squares / LARGEST_WORK)), max(1, cluster // 8))


def stride_notes(
    name: Estimator, strides: Sequence[int], clusters: NDArray[np.int64]
) -> tuple[Note, ...]:
    """Note on windows that are skipped, if any are."""
    skipped = [(int(m), stride) for m, stride in zip(clusters, strides, strict=True) if stride > 1]
    if not skipped:
        return ()
    narrowest, largest = min(s for _, s in skipped), max(s for _, s in skipped)
    widest = max(s / m for m, s in skipped)
    return (
        Note(
            text=f"{name} averages every k-th window at {len(skipped)} of {len(strides)} taus, "
            f"k = {narrowest} to {largest}, at most {widest:.2g} of a cluster"
        ),
    )
