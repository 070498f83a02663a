"""Gyros driven to the end of their range."""

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from scipy.special import ndtr, ndtri

from sagnac import series
from sagnac.arrays import BooleanArray, FloatArray
from sagnac.errors import Note
from sagnac.recording.channel import Channel
from sagnac.recording.effects import finding
from sagnac.recording.model import Recording, second_of
from sagnac.recording.profile import Profile
from sagnac.recording.stretches import Places

# A limit is taken this often at least, and this many times as often as the next value inwards.
# Noise takes an extreme value less often than the next one.
_LEAST_OFTEN: Final = 10
_OFTENER: Final = 3
# Few levels say nothing: a quiet gyro may count only 0 and 1.
_FEW_LEVELS: Final = 8
# A clipped value has others right beside it; one that lies this many standard deviations beyond
# the next is no limit of the range.
_APART: Final = 0.5
# Rounding of the differences of an angle, in units of the angle's last place.
_ROUNDING: Final = 8.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """An end of the range that samples pile up at.

    Attributes
    ----------
    side
        ``upper`` or ``lower``.
    count, first
        Samples at it, and the first of them.
    """

    side: Literal["upper", "lower"]
    count: int
    first: int


def saturation_notes(recording: Recording, gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """An extreme value taken far more often than the next one inwards.

    Looked for in what each sample turned, so that an angle made of clipped increments counts.
    """
    changes = profile.changes
    levels = np.unique(series.every(changes, max(1, changes.size // 10_000)))
    if levels.size <= _FEW_LEVELS:
        return ()
    slack = 0.0
    if gyro.kind == "angle":
        slack = _ROUNDING * float(np.spacing(max(map(abs, series.extent(gyro.values)))))
    lowest, highest = series.extent(changes)
    ends: tuple[tuple[Literal["upper", "lower"], float], ...] = (
        ("upper", highest),
        ("lower", lowest),
    )
    found = [
        limit
        for side, value in ends
        if (limit := limit_of(changes, value, side, slack=slack, scale=profile.scale)) is not None
    ]
    if not found:
        return ()
    shares = {limit.side: limit.count / changes.size for limit in found}
    effect = clipped_scatter(shares.get("lower", 0.0), shares.get("upper", 0.0))
    where = " and ".join(
        f"{limit.count} samples are at its {limit.side} limit, the first at "
        f"{second_of(recording, limit.first):.3f} s"
        for limit in found
    )
    text = f"is saturated: {where}; take a stretch without with {{slice}}"
    return (finding("clipping", gyro.name, text, effect=effect),)


def limit_of(
    changes: FloatArray,
    limit: float,
    side: Literal["upper", "lower"],
    *,
    slack: float,
    scale: float,
) -> Limit | None:
    """The extreme value `limit`, if samples pile up at it.

    Parameters
    ----------
    changes
        (samples,) what each sample turned.
    limit
        Their largest or smallest value.
    side
        Which of the two.
    slack
        Difference within which two values count as one.
    scale
        Standard deviation of the noise.
    """
    at_limit = Places(values=changes, test=lambda some: _equals(some, limit, slack)).tally()
    if at_limit.count < _LEAST_OFTEN:
        return None
    inner = next_inwards(changes, limit, side, slack=slack)
    following = Places(values=changes, test=lambda some: _equals(some, inner, slack)).tally()
    if at_limit.count <= _OFTENER * following.count or abs(limit - inner) > _APART * scale:
        return None
    return Limit(side=side, count=at_limit.count, first=at_limit.first)


def _equals(values: FloatArray, value: float, slack: float) -> BooleanArray:
    return np.asarray(np.abs(values - value) <= slack if slack else values == value)


def next_inwards(
    values: FloatArray, limit: float, side: Literal["upper", "lower"], *, slack: float = 0.0
) -> float:
    """The value next to an extreme one; infinite, away from it, if there is none."""
    sign = 1.0 if side == "upper" else -1.0

    def further(inner: float, block: slice) -> float:
        inside = values[block][~_equals(values[block], limit, slack)]
        return max(inner, float((sign * inside).max(initial=-math.inf)))

    return sign * series.reduce(further, -math.inf, values.size, values)


def clipped_scatter(below: float, above: float) -> float:
    """Standard deviation of a clipped normal number, of one that is not clipped: 1 if none is.

    Parameters
    ----------
    below, above
        Shares of the numbers at the lower and at the upper limit.

    Examples
    --------
    A limit at one standard deviation on either side:

    >>> round(clipped_scatter(0.1587, 0.1587), 3)
    0.718
    """
    low, high = float(ndtri(below)), float(ndtri(1.0 - above))
    at_low, at_high = _density(low), _density(high)
    inside = float(ndtr(high) - ndtr(low))
    ends = [(low, below), (high, above)]
    mean = at_low - at_high + sum(end * share for end, share in ends if share)
    edges = (low * at_low if at_low else 0.0) - (high * at_high if at_high else 0.0)
    square = inside + edges + sum(end * end * share for end, share in ends if share)
    return math.sqrt(max(square - mean * mean, 0.0))


def _density(place: float) -> float:
    return math.exp(-0.5 * place * place) / math.sqrt(2.0 * math.pi)
