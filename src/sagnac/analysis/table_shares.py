"""Share of the table's rate that each gyro shows: scale factor times direction cosine.

One axis of rotation does not tell a scale factor from a misalignment. A triad does in part: if
its axes are square, the squares of the three shares add up to the square of their scale.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.special import stdtrit

from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray, every
from sagnac.core.errors import RecordingError
from sagnac.noise.estimates import Interval
from sagnac.recording.channel import angle_of
from sagnac.recording.model import Recording

# Stretches that the errors are taken from, whatever the colour of the noise within one.
_STRETCHES: Final = 30
# Fewest seconds that make shares.
_LEAST: Final = 4 * _STRETCHES
# Errors by angle count if their variance is larger by this: white noise makes it 1 time in 20.
_MORE: Final = 2.0


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


def table_shares(
    recording: Recording, gyros: tuple[str, ...], confidence: float = 0.95
) -> tuple[dict[str, Share], Triad | None]:
    """Least squares of each gyro's mean rates over a second on the table's.

    A cosine and a sine of the table angle go along for Earth rate. The errors are those of thirty
    stretches of the recording, so that they hold for noise of any colour that does not reach from
    one to the next; or of as many stretches of the angle, if orders make these differ by more.

    Parameters
    ----------
    recording
        With a turning table.
    gyros
        Names.
    confidence
        Of every interval.

    Returns
    -------
    shares, triad
        By gyro; and of three gyros their scale and axes.

    Raises
    ------
    RecordingError
        If there is no table, it does not turn, it turns round all the time, or the recording is too
        short.
    """
    # Rates are taken over a second.
    step = max(1, round(recording.sample_rate))
    interval = step / recording.sample_rate
    table = _table_angle(recording, step)
    columns, one_way = _columns(table, np.diff(table) / interval)
    if np.count_nonzero(one_way) < _LEAST:
        few = f"the table keeps its way over {np.count_nonzero(one_way)} seconds only: too few"
        remedy = f"turn it for {_LEAST} s or more without turning round"
        raise RecordingError(f"{few} for shares of its rate", channel="table", remedy=remedy)
    angles = (angle_of(recording.gyro(name), recording.sample_rate) for name in gyros)
    rates = np.stack([np.diff(every(angle, step)) / interval for angle in angles], axis=1)
    design = np.stack(list(columns.values()), axis=1)
    # By time, and by angle: an order is the same in every sweep, and shows between angles alone.
    by_angle = np.argsort(np.argsort(table[:-1]))
    stretches = np.stack([np.arange(one_way.size), by_angle]) * _STRETCHES // one_way.size
    values, moves = _fitted(design[one_way], rates[one_way], stretches[:, one_way])
    reach = float(stdtrit(_STRETCHES - len(columns), 0.5 + 0.5 * confidence))
    errors = reach * np.linalg.norm(moves, axis=0)
    triad = _triad(gyros, values[0], moves[:, 0], reach) if len(gyros) == 3 else None
    if "asymmetry" in columns:
        values[2], errors[2] = 2.0 * values[2] / values[0], 2.0 * errors[2] / np.abs(values[0])
    shares = {}
    for name, value, error in zip(gyros, values.T, errors.T, strict=True):
        of_column = dict(zip(columns, map(_within, value, error), strict=True))
        named = {one: of_column.get(one) for one in ("bias", "asymmetry")}
        shares[name] = Share(share=of_column["share"], confidence=confidence, **named)
    return shares, triad


def _table_angle(recording: Recording, step: int) -> FloatArray:
    """The table's angle at every `step`-th sample, rad."""
    if recording.table is None:
        problem = "there is no table angle to compare the gyros with"
        raise RecordingError(problem, remedy="name its encoder ({table COLUMN:UNIT})")
    table = every(recording.table.values, step)
    if table.size < _LEAST:
        problem = f"{recording.duration:.4g} s are too short for shares of the table's rate"
        remedy = f"take {_LEAST * step / recording.sample_rate:g} s or more"
        raise RecordingError(problem, remedy=remedy)
    if not np.any(np.diff(table)):
        raise RecordingError("the table does not turn", channel="table")
    return table


def _columns(table: FloatArray, rates: FloatArray) -> tuple[dict[str, FloatArray], BooleanArray]:
    """Columns of the fit, and the seconds in which the table does not turn round.

    The table's rate shows the share, a constant the bias unless it turns one way at one rate, its
    speed an asymmetry if that varies both ways.
    """
    speeds = np.abs(rates)
    # A second below a tenth of the fastest rate counts for neither way.
    way = np.sign(rates) * (speeds > 0.1 * speeds.max())
    columns, one_way = {"share": rates}, np.ones(rates.size, dtype=np.bool_)
    # A table that turns each way, or at several rates, tells the bias from the share.
    both = min(np.mean(way > 0.0), np.mean(way < 0.0)) > 0.1
    if both or np.std(rates) > 0.1 * np.mean(speeds):
        columns["bias"] = np.ones_like(rates)
        # A second beside one of rest starts or stops, and keeps its way.
        near = sliding_window_view(np.pad(way, 1, mode="edge"), 3)
        one_way = near.min(axis=1) * near.max(axis=1) >= 0.0
    # Speeds that vary tell an asymmetry from a bias.
    if both and np.std(speeds[way != 0.0]) > 0.1 * np.mean(speeds):
        columns["asymmetry"] = speeds
    middle = 0.5 * (table[1:] + table[:-1])
    columns |= {"cosine": np.cos(middle), "sine": np.sin(middle)}
    if "bias" in columns:
        # What the table makes at order 1 goes with its rate, and is told from Earth rate thereby.
        columns |= {"order cosine": rates * np.cos(middle), "order sine": rates * np.sin(middle)}
    return columns, one_way


def _fitted(
    design: FloatArray, rates: FloatArray, stretches: IntegerArray
) -> tuple[FloatArray, FloatArray]:
    """Least squares of (seconds, gyros) on (seconds, columns), and what each stretch moves it by.

    (columns, gyros), and (stretches, columns, gyros) whose squares add up to the variances; two
    ways to divide the seconds, by time and by angle.
    """
    size = np.maximum(np.linalg.norm(design, axis=0), np.finfo(np.float64).tiny)
    columns = design / size
    # A table that moved once or twice, or always between the same angles, tells no columns apart.
    if np.linalg.matrix_rank(columns.T @ columns, hermitian=True) < size.size:
        problem = "the table's angles and rates vary too little to show shares of its rate"
        raise RecordingError(problem, channel="table", remedy="turn it to several angles")
    inverse = np.linalg.inv(columns.T @ columns)
    solution = inverse @ (columns.T @ rates)
    rest = rates - columns @ solution
    within = (stretches[:, np.newaxis] == np.arange(_STRETCHES)[:, np.newaxis]).astype(np.float64)
    by_time, by_angle = inverse @ np.einsum("wsn,nc,ng->wscg", within, columns, rest, optimize=True)
    angle = np.sum(by_angle**2, axis=(0, 2)) > _MORE * np.sum(by_time**2, axis=(0, 2))
    moves = np.where(angle[:, np.newaxis], by_angle, by_time)
    scale = math.sqrt(_STRETCHES / (_STRETCHES - size.size)) / size[:, np.newaxis]
    return solution / size[:, np.newaxis], moves * scale


def _within(value: float, error: float) -> Interval:
    return Interval(value=float(value), low=float(value - error), high=float(value + error))


def _triad(gyros: Sequence[str], shares: FloatArray, moves: FloatArray, reach: float) -> Triad:
    """Scale and axes, with the covariance of the shares from the stretches that they have alike."""
    scale = float(np.linalg.norm(shares))
    cosines = shares / scale
    along, angles = moves @ cosines, {}
    for name, cosine, own in zip(gyros, cosines, moves.T, strict=True):
        error = reach * float(np.linalg.norm(own - cosine * along)) / scale
        low, value, high = np.arccos(np.clip([cosine + error, cosine, cosine - error], -1.0, 1.0))
        angles[name] = Interval(value=float(value), low=float(low), high=float(high))
    return Triad(scale=_within(scale, reach * float(np.linalg.norm(along))), angles=angles)
