"""Array types that every room shares, and data frames if pandas and xarray are installed."""

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sagnac.errors import MissingExtra

FloatArray = NDArray[np.float64]
IntegerArray = NDArray[np.int64]
BooleanArray = NDArray[np.bool_]
ComplexArray = NDArray[np.complex128]


def pandas_for(purpose: str) -> Any:
    """The pandas module, imported where it is needed.

    Parameters
    ----------
    purpose
        What needs it, for the error: ``a curve as a data frame``.

    Raises
    ------
    MissingExtra
        If pandas is not installed.
    """
    try:
        return importlib.import_module("pandas")
    except ImportError:
        raise MissingExtra(purpose, "pandas", "frames") from None


def xarray_for(purpose: str) -> Any:
    """The xarray module, imported where it is needed: see `pandas_for`.

    Raises
    ------
    MissingExtra
        If xarray is not installed.
    """
    try:
        return importlib.import_module("xarray")
    except ImportError:
        raise MissingExtra(purpose, "xarray", "frames") from None
