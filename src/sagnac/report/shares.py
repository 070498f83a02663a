"""Shares of the table's rate, as page and terminal say them."""

import math
from collections.abc import Sequence

from sagnac.analysis.result import Analysis
from sagnac.analysis.shares import Interval, Share
from sagnac.report.quantities import number
from sagnac.units import DEGREE, DEGREE_PER_HOUR

_PPM = 1e-6

HEADER = (
    "gyro",
    "share of the table's rate",
    "angle to the table's axis °",
    "asymmetry ppm",
    "bias °/h",
)


def share_rows(analysis: Analysis) -> list[tuple[str, ...]]:
    """A row for each gyro under `HEADER`, each value with its interval; empty at rest.

    What the recording does not tell is an empty cell.
    """
    return [
        (
            name,
            with_interval(one.share),
            _angle(analysis, name, one),
            with_interval(one.asymmetry, _PPM),
            with_interval(one.bias, DEGREE_PER_HOUR),
        )
        for name, one in analysis.shares.items()
    ]


def share_remarks(analysis: Analysis) -> list[str]:
    """Basis of the shares, and the scale factor of a triad."""
    if not analysis.shares:
        return []
    remarks = []
    if analysis.triad is not None:
        remarks.append(
            f"Common scale factor {with_interval(analysis.triad.scale)}, and angles to the "
            "table's axis, if the three axes are square to each other."
        )
    elif any(_alone(one) is not None for one in analysis.shares.values()):
        remarks.append("Angle to the table's axis if the scale factor is exactly 1.")
    shares: Sequence[Share] = tuple(analysis.shares.values())
    if all(one.bias is None for one in shares):
        remarks.append(
            "The table turns one way: a share holds the gyro's bias and the Earth's rate along "
            "the axis, over the table's rate."
        )
    elif all(one.asymmetry is None for one in shares):
        remarks.append("At one speed both ways an asymmetry is not told from a bias.")
    remarks.append(
        f"A share is scale factor times direction cosine; intervals at "
        f"{100.0 * shares[0].confidence:g} %."
    )
    return remarks


def with_interval(interval: Interval | None, size: float = 1.0) -> str:
    """``0.57735 [0.57734, 0.57736]`` in units of `size`, with the digits that it allows.

    Examples
    --------
    >>> with_interval(Interval(value=0.5773503, low=0.5773482, high=0.5773524))
    '0.5773503 [0.5773482, 0.5773524]'
    >>> with_interval(None)
    ''
    """
    if interval is None:
        return ""
    width = 0.5 * (interval.high - interval.low) / size
    ends = (interval.value, interval.low, interval.high)
    value, low, high = (number(end / size, width, plain=True) for end in ends)
    return f"{value} [{low}, {high}]"


def _angle(analysis: Analysis, name: str, share: Share) -> str:
    """Angle between a gyro's axis and the table's, deg."""
    if analysis.triad is not None:
        return with_interval(analysis.triad.angles[name], DEGREE)
    return with_interval(_alone(share), DEGREE)


def _alone(share: Share) -> Interval | None:
    """The angle of one axis if its scale factor is 1; None if no axis has so large a share."""
    one = share.share
    if abs(one.value) > 1.0:
        return None
    low, value, high = (
        math.acos(max(-1.0, min(1.0, end))) for end in (one.high, one.value, one.low)
    )
    return Interval(value=value, low=low, high=high)
