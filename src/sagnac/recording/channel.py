"""A channel: what one sample of it is, and its values in SI.

A sample is an angle, an increment or a rate. Readings that start over at a period are made
continuous. A dithered gyro has a pick-off beside it.
"""

import math
from contextlib import suppress
from dataclasses import dataclass, fields
from datetime import date
from typing import Any, ClassVar, Final, Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike

from sagnac.core import arrays, errors
from sagnac.core.arrays import AnyArray, FloatArray, blocks
from sagnac.core.errors import (
    ArgumentError,
    Note,
    RecordingError,
    is_finite,
    quoted,
    refusal,
    require_choice,
)
from sagnac.core.marks import first_of, is_missing, marked, number_of
from sagnac.core.units import SENSED, UNITS, Quantity, Sensor, Unit, sizes, split_factor, unit_of

# ---- channel -----------------------------------------------------------------------

Kind = Literal["angle", "increment", "rate"]
KINDS: Final[tuple[Kind, ...]] = get_args(Kind)


def quantity_of(kind: Kind, sensor: Sensor = "gyro") -> Quantity:
    """The quantity that a sample of `kind` is measured in: of a gyro ``angle`` or ``rate``.

    Raises
    ------
    ValueError
        If `kind` is none of `KINDS`.
    """
    require_choice("kind", kind, Kind)
    sensed = SENSED[sensor]
    return sensed.rate if kind == "rate" else sensed.integral


def unit_of_samples(name: str, kind: Kind, sensor: Sensor = "gyro") -> Unit:
    """The unit that the field writes a channel in: deg for ``table``, arcsec or deg/h for gyros."""
    if kind != "rate" and name == "table":
        return UNITS["deg"]
    sensed = SENSED[sensor]
    return UNITS[sensed.rate_unit if kind == "rate" else sensed.integral_unit]


def real_numbers(values: ArrayLike, argument: str) -> AnyArray:
    """Real numbers of whatever shape and type they have.

    Parameters
    ----------
    values
        A list, an array, a column of a frame. What a masked array masks becomes NaN.
    argument
        What the caller calls it, for the message.

    Raises
    ------
    ValueError
        If it holds something else.
    """
    if isinstance(values, np.ma.MaskedArray) and values.dtype.kind in "iufO":
        values = np.ma.filled(values.astype(np.float64), np.nan)
    given: AnyArray = np.asarray(values)
    # Dates of a frame would pass as their nanoseconds.
    if given.dtype.kind == "O" and not isinstance(next(given.flat, None), date):
        with suppress(TypeError, ValueError):
            return np.asarray(values, dtype=np.float64)
    if given.dtype.kind not in "iuf" and given.size:
        raise refusal(argument, f"holds {given.dtype} values; give real numbers")
    return given


def numbers(values: ArrayLike, argument: str) -> AnyArray:
    """A column of real numbers, shape (samples,), of whatever type they have.

    Raises
    ------
    ValueError
        As `real_numbers`, or if there is more than one dimension, or none.
    """
    remedy = "give one column, shape (samples,)"
    try:
        given = np.asanyarray(values)
    except ValueError:  # rows of unlike lengths
        raise refusal(argument, f"is {quoted(values)}; {remedy}") from None
    except TypeError as error:  # a recording, whose channels hold values
        raise refusal(argument, f"is {quoted(values)}: {error}") from None
    if given.ndim != 1:
        found = f"has shape {given.shape}" if given.ndim else f"is {quoted(values)}"
        raise refusal(argument, f"{found}; {remedy}")
    return real_numbers(given, argument)


def series(values: ArrayLike, argument: str) -> FloatArray:
    """The same as an array of float64 of its own.

    Raises
    ------
    ValueError
        If it holds something else, or has more than one dimension.
    """
    return np.array(numbers(values, argument), dtype=np.float64)


def whole_series(values: ArrayLike, argument: str) -> FloatArray:
    """The same as float64, which may be the values themselves, of numbers that are all there.

    Raises
    ------
    ValueError
        As `numbers`, or if a value is missing or infinite; with the first such sample.
    """
    column = np.asarray(numbers(values, argument), dtype=np.float64)
    if not arrays.all_finite(column):
        at = first_of(is_missing(column))
        raise ValueError(f"{argument}: sample {at} is {column[at]}; give a stretch without gaps")
    return column


def squarable(values: ArrayLike) -> FloatArray:
    """Values as float64 whose squares are numbers; what is missing or infinite is told later.

    Raises
    ------
    ValueError
        As `numbers`, or if all are smaller, or one is larger, than anything that is measured.
    """
    samples = np.asarray(numbers(values, "values"), dtype=np.float64)
    sizes = arrays.by_blocks(lambda some: np.nanmax(np.abs(some), initial=0.0), samples)
    largest = float(sizes.max(initial=0.0))
    if 0.0 < largest < 1e-60 or 1e60 < largest < math.inf:
        raise refusal("values", f"reach {largest:.3g}; give them in the unit that is stated")
    return samples


def is_constant_rate(values: ArrayLike, kind: Kind) -> bool:
    """Whether samples are those of a constant rate, to five units in the last place.

    Angles of a computed ramp are off by four at the most (400 random ramps). In single precision
    the units are those of single precision.

    Parameters
    ----------
    values
        (samples,), two or more.
    kind
        What one sample is.
    """
    given = numbers(values, "values")
    ends = given[[0, -1]] if kind == "angle" else np.repeat(np.float64(given[0]), 2)
    first, step = float(ends[0]), (float(ends[1]) - float(ends[0])) / (given.size - 1)
    off = arrays.less(given, lambda number: first + step * number)
    return bool(max(map(abs, arrays.extent(off))) <= 5.0 * np.spacing(np.abs(ends).max()))


class Compared:
    """Dataclasses whose objects are equal if all fields are: see `same_values`."""

    __slots__ = ()
    # Equal ones may be changed in place, sample by sample.
    __hash__: ClassVar[None] = None  # type: ignore[assignment]

    def __eq__(self: Any, other: object) -> bool:
        if not isinstance(other, type(self)):
            return NotImplemented
        names = [item.name for item in fields(self)]
        return all(same_values(getattr(self, name), getattr(other, name)) for name in names)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Channel(Compared):
    """One measured column, in SI.

    `values` are in SI whatever `shown_in` says. Use `from_values` for values in another unit.

    Attributes
    ----------
    name
        What the user calls it: ``x``, ``y``, ``z``, ``table``.
    kind
        What one sample is. ``angle``: accumulated angle at the sample time.
        ``increment``: angle turned since the sample before. ``rate``: mean rate over
        the sample interval.
    values
        (samples,) float64, rad for ``angle`` and ``increment``, rad/s for ``rate``. Counters
        and 360 degree encoders are unwrapped. Missing samples are NaN. The array is held, not
        copied: what is written into it, every recording shows that holds the channel.
    shown_in
        Unit that reports show and files store the channel in, as its source stated it:
        ``arcsec``, ``deg/s``, ``0.1arcsec``. SI unless stated.
    sensor
        ``gyro``, or ``accelerometer``: its rate is a specific force, m/s², and its angle a
        velocity, m/s.

    Raises
    ------
    ValueError
        If the name is empty, kind or sensor is unknown, `shown_in` is not a unit of that kind, or
        the values are not float64 of shape (samples,).

    Examples
    --------
    >>> Channel.from_values("x", [1.0, 2.0], kind="rate", unit="deg/s").values
    array([0.01745329, 0.03490659])
    """

    name: str
    kind: Kind
    values: FloatArray
    shown_in: str = ""
    sensor: Sensor = "gyro"

    def __post_init__(self) -> None:
        errors.require_name("name", self.name)
        require_choice("sensor", self.sensor, Sensor)
        if not self.shown_in:
            known = sizes(quantity_of(self.kind, self.sensor))
            in_si = next(name for name, size in known.items() if size == 1.0)
            object.__setattr__(self, "shown_in", in_si)
        _unit_of_channel(self.name, self.kind, self.shown_in, self.sensor)
        if held := _no_series(self.values):
            remedy = "give float64 of shape (samples,) in SI, or use Channel.from_values"
            raise ValueError(f"channel {self.name}: values are {held}; {remedy}")

    @classmethod
    def from_values(
        cls,
        name: str,
        values: ArrayLike,
        *,
        kind: Kind,
        unit: str,
        sensor: Sensor = "gyro",
        out: FloatArray | None = None,
    ) -> Self:
        """A channel from values in a unit of the field.

        Parameters
        ----------
        name, kind, sensor
            See the class.
        values
            (samples,) in `unit`: a list, an array, a column of a frame.
        unit
            ``deg/s``, ``arcsec``, ``0.1arcsec``.
        out
            (samples,) that the values of the channel are put into, which may be `values`; a new
            array unless given.

        Raises
        ------
        ValueError
            If the unit is not one of that kind, or an argument makes no sense.

        Examples
        --------
        >>> Channel.from_values("x", [3600.0, 7200.0], kind="increment", unit="arcsec")
        Channel(x: 2 samples, increment, shown in arcsec)
        """
        require_choice("sensor", sensor, Sensor)
        size = _unit_of_channel(name, kind, unit, sensor).size
        in_si = arrays.elementwise(np.multiply, numbers(values, name), size, out=out)
        return cls(name=name, kind=kind, values=in_si, shown_in=unit, sensor=sensor)

    @property
    def plain_unit(self) -> Unit:
        """Unit to write the values in: `shown_in`, or the field's if a number stands before it."""
        factor, name = split_factor(self.shown_in)
        return UNITS[name] if factor == 1.0 else unit_of_samples(self.name, self.kind, self.sensor)

    def values_in(self, unit: str = "") -> FloatArray:
        """The values in a unit of the field, in `plain_unit` unless stated; a new array.

        Raises
        ------
        ValueError
            If `unit` is not one of the channel's kind.
        """
        quantity = quantity_of(self.kind, self.sensor)
        size = (unit_of(unit, quantity) if unit else self.plain_unit).size
        return arrays.elementwise(np.divide, self.values, size)

    def __repr__(self) -> str:
        samples = self.values.size
        return f"Channel({self.name}: {samples} samples, {self.kind}, shown in {self.shown_in})"


@dataclass(frozen=True, slots=True, kw_only=True)
class Conversion:
    """A channel made of a column, and what was noticed on the way."""

    channel: Channel
    notes: tuple[Note, ...] = ()


def _unit_of_channel(name: str, kind: Kind, unit: str, sensor: Sensor) -> Unit:
    try:
        return unit_of(unit, quantity_of(kind, sensor))
    except ArgumentError as error:
        where = f"channel {name} of kind {kind}: "
        raise refusal(error.argument, error.problem, where) from None


def _no_series(values: object) -> str:
    """Type and shape of values that are not (samples,) float64; empty if they are."""
    if not isinstance(values, np.ndarray):
        return f"a {type(values).__name__}"
    is_series = values.dtype == np.float64 and values.ndim == 1
    return "" if is_series else f"{values.dtype} of shape {values.shape}"


def same_values(one: Any, other: Any) -> bool:
    """Whether two values are equal; of two arrays all of them, NaN to NaN."""
    arrays = isinstance(one, np.ndarray) + isinstance(other, np.ndarray)
    if arrays < 2:
        return arrays == 0 and bool(one == other)
    pairs = ((one[block], other[block]) for block in blocks(one.size))
    are_equal = (np.array_equal(*pair, equal_nan=True) for pair in pairs)
    return one is other or (one.size == other.size and all(are_equal))


# Hz: squares of times between samples, over any record, stay numbers.
_SLOWEST: Final = 1e-12
_FASTEST: Final = 1e12


def require_rate(sample_rate: float) -> None:
    """Refuse what is no sample rate.

    Raises
    ------
    ValueError
        If it is not a finite number above zero, or one that no instrument has.
    """
    problem = f"is {quoted(sample_rate)}; give samples per second,"
    if not (is_finite(sample_rate) and sample_rate > 0.0):
        raise refusal("sample_rate", f"{problem} above zero")
    if not _SLOWEST <= sample_rate <= _FASTEST:
        raise refusal("sample_rate", f"{problem} {_SLOWEST:g} to {_FASTEST:g}")


# ---- pickoff -----------------------------------------------------------------------

PICKOFF: Final = "pickoff_"
"""First letters of a pick-off's column; the name of the gyro follows."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pickoff(Compared):
    """The dither of one gyro as its pick-off shows it.

    Attributes
    ----------
    gyro
        Name of the gyro that is dithered.
    values
        (samples,) in any unit, proportional to the angle of the dither and sampled with the gyro.

    Raises
    ------
    ValueError
        If the values are no series of float64.
    """

    gyro: str
    values: FloatArray

    def __post_init__(self) -> None:
        if _no_series(self.values):
            raise ValueError(f"pick-off of gyro {self.gyro}: give a series of float64")

    @property
    def column(self) -> str:
        """Name of its column in a file."""
        return PICKOFF + self.gyro


# ---- unwrapping --------------------------------------------------------------------


def unwrapped(values: FloatArray, period: float) -> tuple[FloatArray, int]:
    """A reading that starts over at `period`, made continuous.

    If two samples differ by more than half a period, the shorter way round is taken, so the
    direction may be either and may change.

    Parameters
    ----------
    values
        (samples,) readings; samples that are not finite are passed over.
    period
        Reading at which the counter starts over, in the unit of `values`.

    Returns
    -------
    values
        (samples,), a new array if anything was unwrapped, else the one given.
    wraps
        How often the reading started over.
    """

    def periods(before: FloatArray, here: FloatArray) -> FloatArray:
        """Whole periods from each sample to the next."""
        whole = np.rint((here - before) / period)
        whole[~np.isfinite(whole)] = 0.0
        return whole

    wraps = number_of(marked(periods, values[:-1], values[1:]))
    if wraps == 0:
        return values, 0
    result = arrays.empty(values.size)
    result[0], over = values[0], 0.0
    for block in blocks(values.size - 1):
        here = slice(block.start + 1, block.stop + 1)
        # Sums of integers, so nothing is lost.
        started = over + np.cumsum(periods(values[block], values[here]))
        np.subtract(values[here], started * period, out=result[here])
        over = started[-1]
    return result, wraps


PAIR_SIZE: Final = math.sqrt(2.0)
"""Size of the difference of two gyros over that of one: independent gyros add in square (Eq. 3)."""


# ---- kinds -------------------------------------------------------------------------


def angle_of(channel: Channel, sample_rate: float) -> FloatArray:
    """Accumulated angle of a channel.

    Increments and rates are summed after their mean is taken off and put back as a
    ramp, so that a large constant rate costs no precision in the noise.

    Parameters
    ----------
    channel
        Of any kind.
    sample_rate
        Samples per second.

    Returns
    -------
    FloatArray
        (samples,), rad; the channel's own values if it is one of angle.
    """
    values, per_step = channel.values, 1.0 if channel.kind == "increment" else sample_rate
    if channel.kind == "angle":
        return values
    usual = arrays.mean(values) / per_step
    angle = arrays.empty(values.size)
    turned = 0.0
    for block in blocks(values.size):
        steps = values[block] / per_step
        steps -= usual
        steps[0] += turned
        np.cumsum(steps, out=angle[block])
        turned = float(angle[block.stop - 1])
        angle[block] += usual * np.arange(block.start + 1, block.stop + 1)
    return angle


def finite_extent(values: FloatArray) -> float:
    """Largest less smallest of the finite samples, 0 if there are none."""

    def ends(some: FloatArray) -> tuple[float, float]:
        with np.errstate(over="ignore", invalid="ignore"):
            are_finite = np.isfinite(some.sum())
        finite = some if are_finite else some[np.isfinite(some)]
        return finite.max(initial=-np.inf), -finite.min(initial=np.inf)

    return max(float(arrays.by_blocks(ends, values).max(axis=0, initial=-np.inf).sum()), 0.0)


def angle_increments(values: ArrayLike, *, kind: Kind, sample_rate: float) -> FloatArray:
    """Angle turned over each sample interval.

    Parameters
    ----------
    values
        (samples,), rad for ``angle`` and ``increment``, rad/s for ``rate``.
    kind
        What one sample is.
    sample_rate
        Samples per second.

    Returns
    -------
    FloatArray
        (increments,), rad: one fewer than the samples for ``angle``, else as many.

    Raises
    ------
    RecordingError
        If a sample is not finite.
    ValueError
        If an argument makes no sense.
    """
    samples = squarable(values)
    require_choice("kind", kind, Kind)
    require_rate(sample_rate)
    # One sum tells whole samples without a second array of their size.
    finite = samples.size == 0 or math.isfinite(arrays.mean(samples))
    if not finite and not np.isfinite(samples).all():
        first = int(np.argmin(np.isfinite(samples)))
        problem = f"sample {first} is not finite and there is no room for gaps here"
        raise RecordingError(problem, remedy="take a span without gaps ({slice})")
    if kind == "angle":
        return arrays.differences(samples)
    return samples / sample_rate if kind == "rate" else samples
