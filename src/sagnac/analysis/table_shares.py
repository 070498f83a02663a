"""Share of the table's rate that each gyro shows: scale factor times direction cosine.

One axis of rotation does not tell a scale factor from a misalignment. A triad does in part: if
its axes are square, the squares of the three shares add up to the square of their scale.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from scipy.special import stdtrit

from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray, every
from sagnac.core.errors import RecordingError
from sagnac.noise.estimates import Interval
from sagnac.recording.channel import angle_of
from sagnac.recording.model import Recording

# Stretches that the errors are taken from, whatever the colour of the noise within one.
_STRETCHES: Final = 30
_INTERVAL: Final = 1.0  # s, that a rate is taken over
# Part of the time that a table must turn each way for the bias to be told from the share.
_EACH_WAY: Final = 0.1
# Part of the mean speed by which it must vary for an asymmetry to be told from a bias.
_UNEVEN: Final = 0.1
# Part of the fastest rate below which a second counts for neither way.
_TURNING: Final = 0.1
_AXES: Final = 3
# Fewest seconds that make shares.
_LEAST: Final = 4 * _STRETCHES


@dataclass(frozen=True, slots=True, kw_only=True)
class Share:
    """Share of one gyro in the table's rate.

    Attributes
    ----------
    share
        Rate shown over table rate, signed.
    bias
        rad/s; None on a table that turns one way at one rate, whose share holds bias over rate.
    asymmetry
        Share one way less share the other, over their mean; None unless the table turns both
        ways at more than one speed: at one, it is a bias.
    confidence
        Of every interval.
    """

    share: Interval
    bias: Interval | None
    asymmetry: Interval | None
    confidence: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Triad:
    """The scale factor and the axes of three gyros whose axes are square.

    Attributes
    ----------
    scale
        Common scale factor: the root of the sum of the squares of the shares.
    angles
        Gyro -> angle between its axis and the table's, rad, 0 to pi.
    """

    scale: Interval
    angles: Mapping[str, Interval]


@dataclass(frozen=True, slots=True, kw_only=True)
class TableShares:
    """Shares of the gyros on a turning table and, of three, scale and axes."""

    shares: Mapping[str, Share] = field(default_factory=dict)
    triad: Triad | None = None


def table_shares(
    recording: Recording, gyros: tuple[str, ...], *, confidence: float = 0.95
) -> TableShares:
    """Least squares of each gyro's mean rates over a second on the table's.

    A cosine and a sine of the table angle go along for Earth rate. The errors are those of thirty
    stretches of the recording, so that they hold for noise of any colour that does not reach from
    one to the next.

    Parameters
    ----------
    recording
        With a turning table.
    gyros
        Names.
    confidence
        Of every interval.

    Raises
    ------
    RecordingError
        If there is no table, it does not turn, it turns round all the time, or the recording is too
        short.
    """
    table, rates, interval = _table_rates(recording)
    design = _design(table, rates)
    if design.columns.shape[0] < _LEAST:
        raise RecordingError(
            f"the table keeps its way over {design.columns.shape[0]} seconds only: too few for "
            "shares of its rate",
            channel="table",
            remedy=f"turn it for {_LEAST} s or more without turning round",
        )
    shares, moves = {}, []
    for name in gyros:
        angle = angle_of(recording.gyro(name), recording.sample_rate)
        shown = np.diff(every(angle, round(interval * recording.sample_rate))) / interval
        shares[name], own = _share(design, shown[design.kept], confidence)
        moves.append(own)
    triad = (
        _triad(shares, np.stack(moves), design.reach(confidence)) if len(gyros) == _AXES else None
    )
    return TableShares(shares=shares, triad=triad)


def _table_rates(recording: Recording) -> tuple[FloatArray, FloatArray, float]:
    """The table's angle and rate at even intervals, rad and rad/s, and the interval, s."""
    if recording.table is None:
        raise RecordingError(
            "there is no table angle to compare the gyros with",
            remedy="name its encoder ({table COLUMN:UNIT})",
        )
    step = max(1, round(_INTERVAL * recording.sample_rate))
    interval = step / recording.sample_rate
    table = every(recording.table.values, step)
    if table.size < _LEAST:
        raise RecordingError(
            f"{recording.duration:.4g} s are too short for shares of the table's rate",
            remedy=f"take {_LEAST * interval:g} s or more",
        )
    rates = np.diff(table) / interval
    if not np.any(rates):
        raise RecordingError("the table does not turn", channel="table")
    return table, rates, interval


@dataclass(frozen=True, slots=True, kw_only=True)
class _Design:
    """Columns of the fit: the table's rate, 1 if it turns both ways, its size if that varies.

    Seconds in which the table turns round belong to neither way: they are not `kept`.
    """

    columns: FloatArray
    kept: BooleanArray
    both_ways: bool
    two_speeds: bool
    stretch: IntegerArray

    @property
    def freedom(self) -> int:
        """Stretches less columns."""
        return _STRETCHES - int(self.columns.shape[1])

    def reach(self, confidence: float) -> float:
        """Standard errors that an interval reaches on either side."""
        return float(stdtrit(self.freedom, 0.5 + 0.5 * confidence))


def _design(table: FloatArray, rates: FloatArray) -> _Design:
    """Design that the rates of a gyro are fitted with."""
    speeds = np.abs(rates)
    way = np.sign(rates) * (speeds > _TURNING * speeds.max())
    both_ways = min(np.mean(way > 0.0), np.mean(way < 0.0)) > _EACH_WAY
    uneven = np.std(speeds[way != 0.0]) > _UNEVEN * np.mean(speeds)
    two_speeds = bool(both_ways and uneven)
    middle = 0.5 * (table[1:] + table[:-1])
    columns, kept = [rates], np.ones(rates.size, dtype=np.bool_)
    if both_ways:
        columns.append(np.ones_like(rates))
        kept[1:] &= way[1:] == way[:-1]
        kept[:-1] &= way[1:] == way[:-1]
    if two_speeds:
        columns.append(speeds)
    columns += [np.cos(middle), np.sin(middle)]
    return _Design(
        columns=np.stack(columns, axis=1)[kept],
        kept=kept,
        both_ways=bool(both_ways),
        two_speeds=two_speeds,
        stretch=(np.arange(rates.size) * _STRETCHES // rates.size)[kept],
    )


def _share(design: _Design, shown: FloatArray, confidence: float) -> tuple[Share, FloatArray]:
    """Share, bias and asymmetry of one gyro, and by how much each stretch moves the share.

    The moves, (stretches,), are scaled so that the sum of their squares is the variance.
    """
    size = np.linalg.norm(design.columns, axis=0)
    columns = design.columns / size
    inverse = np.linalg.inv(columns.T @ columns)
    solution = inverse @ (columns.T @ shown)
    sums = np.zeros((_STRETCHES, size.size))
    np.add.at(sums, design.stretch, columns * (shown - columns @ solution)[:, np.newaxis])
    moves = (sums @ inverse) / size * math.sqrt(_STRETCHES / design.freedom)
    solution, covariance = solution / size, moves.T @ moves
    reach = design.reach(confidence)

    def of_column(number: int, scale: float = 1.0) -> Interval:
        weights = np.eye(size.size)[number] * scale
        error = reach * math.sqrt(float(weights @ covariance @ weights))
        return _within(float(weights @ solution), error)

    share = Share(
        share=of_column(0),
        bias=of_column(1) if design.both_ways else None,
        asymmetry=of_column(2, 2.0 / float(solution[0])) if design.two_speeds else None,
        confidence=confidence,
    )
    return share, moves[:, 0]


def _within(value: float, error: float) -> Interval:
    return Interval(value=value, low=value - error, high=value + error)


def _triad(shares: Mapping[str, Share], moves: FloatArray, reach: float) -> Triad:
    """Scale and axes, with the covariance of the shares from the stretches that they have alike."""
    values = np.array([one.share.value for one in shares.values()])
    scale = float(np.linalg.norm(values))
    cosines = values / scale
    angles = {}
    for name, cosine, own in zip(shares, cosines, moves, strict=True):
        error = reach * float(np.linalg.norm(own - cosine * (cosines @ moves))) / scale
        low, value, high = np.arccos(np.clip([cosine + error, cosine, cosine - error], -1.0, 1.0))
        angles[name] = Interval(value=float(value), low=float(low), high=float(high))
    scale_error = reach * float(np.linalg.norm(cosines @ moves))
    return Triad(scale=_within(scale, scale_error), angles=angles)
