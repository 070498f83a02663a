"""Uniform cubic B-splines over equal blocks of a record: values and least squares.

These are written out because scipy's are slower here: a least squares fit of a complex envelope by
`scipy.interpolate.BSpline.design_matrix` and sparse products takes 3 to 7 times as long (63 to
104 ms for 21 to 27 ms at 72,000 values, 3.9 for 0.6 ms at 3,000; one core), and agrees to rounding
except for the blocks' ends, at which a `Places.after` goes on with the block's own piece.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from sagnac.arrays import ComplexArray, FloatArray, IntegerArray
from sagnac.lines import _kernels

# Rows are the powers of the place in a block, highest first; columns are the four coefficients that
# reach into it. Cubic pieces follow a smooth envelope in half the blocks that straight ones need.
_CUBIC: Final = (
    np.array([[-1.0, 3.0, -3.0, 1.0], [3.0, -6.0, 3.0, 0.0], [-3.0, 0.0, 3.0, 0.0], [1, 4, 1, 0]])
    / 6.0
)
_REACH: Final = 4
# Columns of the inverse of a normal matrix that are held at a time.
_AT_ONCE: Final = 64


def coefficients_of(blocks: int) -> int:
    """Number of coefficients of a spline over that many blocks."""
    return blocks + _REACH - 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Places:
    """Places in the blocks of a record, and the splines there.

    Attributes
    ----------
    blocks
        In the record.
    block
        (places,) block of each.
    now, after
        (places, 4) the four splines that reach there, and one sample later. The pieces are smooth
        enough to be carried on by that sample at the end of a block.
    """

    blocks: int
    block: IntegerArray
    now: FloatArray
    after: FloatArray


def places(middles: FloatArray, samples: int, blocks: int) -> Places:
    """Places of the sample numbers `middles` in a record of `samples` cut into `blocks`.

    Raises
    ------
    ValueError
        If there is no block.
    """
    if blocks < 1:
        raise ValueError(f"blocks is {blocks}; give 1 or more")
    scale = blocks / samples
    block = np.minimum((middles * scale).astype(np.int64), blocks - 1)
    place = middles * scale - block
    now, after = (
        np.stack([x**3, x**2, x, np.ones_like(x)], axis=1) @ _CUBIC for x in (place, place + scale)
    )
    return Places(blocks=blocks, block=block, now=now, after=after)


def spline_values(at: Places, rows: NDArray[Any], coefficients: NDArray[Any]) -> NDArray[Any]:
    """(places,) sum of each row, (places, 4), times the coefficients that reach there."""
    reached = at.block[:, np.newaxis] + np.arange(_REACH)
    return np.asarray(np.einsum("ij,ij->i", rows, coefficients[reached]))


def spline_products(at: Places, rows: NDArray[Any], weights: ComplexArray) -> ComplexArray:
    """(coefficients,) inner products of each column of `rows`, (places, 4), with `weights`."""
    return _kernels.spline_products(at.block, rows.astype(np.complex128), weights, at.blocks)


def normal_bands(at: Places, rows: ComplexArray) -> ComplexArray:
    """(4, coefficients) upper bands of the normal matrix of `rows`; the last is the diagonal."""
    return _kernels.spline_normal(at.block, rows, at.blocks)


def knot_values(coefficients: NDArray[Any]) -> NDArray[Any]:
    """(blocks + 1,) values of a spline where blocks meet."""
    windows = np.lib.stride_tricks.sliding_window_view
    return np.asarray(windows(coefficients, _REACH - 1) @ _CUBIC[3, :3])


def pieces(coefficients: NDArray[Any]) -> NDArray[Any]:
    """(4, blocks) polynomials in blocks from the start of each, highest power first."""
    windows = np.lib.stride_tricks.sliding_window_view
    return np.ascontiguousarray(_CUBIC @ windows(coefficients, _REACH).T)


def knot_variances(factor: ComplexArray) -> FloatArray:
    """(blocks + 1,) variances of the values where blocks meet, for data of unit variance.

    `factor` is the banded Cholesky factor of the normal matrix.
    """
    size = factor.shape[1]
    variances = np.empty(size - 2)
    # The inverse of a banded matrix is full: some columns at a time.
    for first in range(0, variances.size, _AT_ONCE):
        knots = np.arange(first, min(first + _AT_ONCE, variances.size))
        columns = np.zeros((size, knots.size))
        for part in range(3):
            columns[knots + part, np.arange(knots.size)] = _CUBIC[3, part]
        solved = scipy.linalg.cho_solve_banded((factor, False), columns)
        variances[knots] = np.einsum("ij,ij->j", columns, solved.real)
    return variances
