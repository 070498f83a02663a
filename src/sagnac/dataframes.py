"""Tables of results as pandas frames, if pandas is installed."""

from collections.abc import Iterable, Mapping
from typing import Any

from sagnac.errors import MissingExtra


def frame_of(rows: Iterable[Mapping[str, Any]]) -> Any:
    """A pandas frame of rows.

    Raises
    ------
    MissingExtra
        If pandas is not installed.
    """
    try:
        import pandas as pd  # noqa: PLC0415
    except ImportError:
        raise MissingExtra(purpose="a data frame", package="pandas", extra="frames") from None
    return pd.DataFrame(list(rows))
