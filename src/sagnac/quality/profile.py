"""A channel as detectors see it: its rate, its noise from block to block, the step of its readout.

Besides, noise between lines made white, and the stretch that is sound, which is a remedy for the
rest.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, rfft

from sagnac.core import arrays
from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray
from sagnac.core.errors import Note, counted
from sagnac.core.units import DEGREE, UNITS, split_factor
from sagnac.quality import _kernels
from sagnac.recording.channel import Channel, by_blocks, longest_unmarked, number_of
from sagnac.recording.encoder_readings import share_of_turns
from sagnac.recording.model import MINIMUM_SAMPLES, Recording, second_of

Notes = tuple[Note, ...]

# What is no chance happens this often, and this many times as often as chance makes it.
LEAST_OFTEN: Final = 10
OFTENER: Final = 3

# ---- lattice -----------------------------------------------------------------------

# Samples on one side of which a median is taken.
_SIDE: Final = 3
# Largest sizes that are looked at, in steps.
_WITHIN: Final = 6.0
# Changes below this many last places of the largest value are rounding: an angle of many turns is
# rounded where its changes would not be.
_LAST_PLACES: Final = 8.0
_ROUNDING: Final = float(np.finfo(np.float64).eps)


def count_step(changes: FloatArray, rounding: float = 0.0) -> float:
    """The step of a readout.

    What a sample turned is held against the median of three before and of three behind, whichever
    is nearer, so that a motion that reverses at once makes no size of its own. In numbers that are
    counted, these sizes are whole steps, or what the rounding of a file leaves of nothing; between
    the two lies a gap. In numbers that are not, the sizes go on to the smallest.

    Parameters
    ----------
    changes
        (samples,) what each sample turned.
    rounding
        Sizes up to this are nothing.

    Returns
    -------
    float
        In the unit of the changes. If the numbers are not counted, the smallest size there is;
        infinite if there is none.
    """
    # Sizes in half octaves, which the exponents of their squares count.
    counts, smallest, nothing = np.zeros(2048, dtype=np.int64), math.inf, 0
    # What is made of so few samples together stays in cache.
    for block in arrays.blocks(changes.size - 2 * _SIDE, 2**15):
        sizes = _kernels.off_nearer_side(changes[block.start : block.stop + 2 * _SIDE])
        nothing += number_of(sizes <= rounding)
        sizes = sizes[(sizes > rounding) & (sizes < math.inf)]
        smallest = min(smallest, float(sizes.min(initial=math.inf)))
        counts += np.bincount(np.square(sizes).view(np.int64) >> 52, minlength=counts.size)
    filled = np.flatnonzero(counts)
    below = nothing + np.cumsum(counts[filled])[:-1]
    # Sizes that rounding makes lie four classes, a factor of four, below those that a step makes.
    gaps = np.flatnonzero((np.diff(filled) > 4) & (below >= LEAST_OFTEN))
    # Decimals are a lattice of their own: the coarsest is the readout's.
    for gap in gaps[::-1].tolist():
        step = _whole_step(changes, 2.0 ** (0.5 * (float(filled[gap + 1]) - 1023.0)))
        if step is not None:
            return step
    return smallest


def _whole_step(changes: FloatArray, bound: float) -> float | None:
    """The step of sizes from `bound` on; None if they are not whole numbers of it."""
    # Sizes, and whether the changes go on the same way before and behind.
    parts = []
    for block in arrays.blocks(changes.size - 2 * _SIDE):
        off = _kernels.off_nearer_side(changes[block.start : block.stop + 2 * _SIDE])
        steps = np.diff(changes[block.start + _SIDE - 1 : block.stop + _SIDE + 1])
        taken = (off >= bound) & (off < 2.0 * _WITHIN * bound)
        parts.append(np.stack([off[taken], (steps[1:] * steps[:-1] > 0.0)[taken]]))
    sizes, goes_on = np.concatenate(parts, axis=1)
    least = sizes.min()
    sizes, goes_on = sizes[sizes < _WITHIN * least], goes_on[sizes < _WITHIN * least]
    # Fewer sizes are spikes.
    if sizes.size < 0.01 * changes.size:
        return None
    # A motion that speeds up or slows down evenly makes sizes as well: what it changes by in one
    # sample and, behind its first samples, in two; and the changes go on growing or falling. Steps
    # of a readout come and go, or are of more sizes.
    if np.mean(sizes < 2.5 * least) > 0.95 and goes_on.mean() > 0.6:
        return None
    step = float(np.median(sizes[sizes < 1.5 * least]))
    off = np.abs(sizes / step - np.rint(sizes / step))
    # Half of them have to lie near whole steps.
    return step if float(np.median(off)) < 0.12 else None


def rounding_in(values: FloatArray) -> float:
    """Changes up to which those of a series are rounding, in its unit."""
    return _LAST_PLACES * _ROUNDING * max(map(abs, arrays.extent(values)))


# ---- white -------------------------------------------------------------------------

# Frequencies whose median is the level of the noise there.
_TOGETHER: Final = 64
# Samples at either end that are left out.
EDGE: Final = 512


@dataclass(frozen=True, slots=True, kw_only=True)
class White:
    """White noise.

    Attributes
    ----------
    values
        (samples - 1024,) of any scale, from sample 512 on.
    innovation
        Standard deviation of what each change adds to all before it, in their unit: the root of
        the geometric mean of the spectrum between the lines (Kolmogorov). Motion that is slow,
        however large, adds next to nothing.
    """

    values: FloatArray
    innovation: float


def whitened(changes: FloatArray, *, bands: int | None = None, kept: float = 12.0) -> White:
    """Increments with each frequency divided by the level around it.

    Lines are cut down to a few times the level, which is the median over 64 frequencies, or over
    a band.

    Parameters
    ----------
    changes
        (samples,), more than 1024.
    bands
        How many equal bands have a level each, so that lines that wander stay within one.
    kept
        Times the level that a line keeps.
    """
    transform, level = _by_level(changes, bands, kept)
    held = level[level > 0.0]
    innovation = math.exp(0.5 * float(np.log(held).mean())) if held.size else 0.0
    values = _inner(transform, changes.size)
    return White(values=values, innovation=innovation / math.sqrt(changes.size))


def without_lines(changes: FloatArray) -> FloatArray:
    """(samples - 1024,) increments without lines and what is slowest, their spectrum as it was.

    `changes` are (samples,), more than 1024; the first value is of sample 512.
    """
    transform, level = _by_level(changes, None, 12.0)
    return _inner(transform * np.sqrt(level), changes.size)


def alternating(values: FloatArray) -> tuple[float, float]:
    """Variance that goes into (samples,) with one sign and out with the next, and its error.

    Errors of an angle do so in what each sample turned. Slow noise adds about as much to the
    covariance of samples one apart and two apart, white noise nothing.
    """
    size = values.size
    variance = float(values @ values) / size
    one_apart = float(values[1:] @ values[:-1]) / size
    two_apart = float(values[2:] @ values[:-2]) / size
    return two_apart - one_apart, variance * math.sqrt(2.0 / size)


def _by_level(
    changes: FloatArray, bands: int | None, kept: float
) -> tuple[NDArray[np.complex128], FloatArray]:
    """The transform divided by the root of the level around each frequency, and that level."""
    transform = rfft(changes)
    power = transform.real**2 + transform.imag**2
    together = max(_TOGETHER, power.size // bands) if bands else _TOGETHER
    number = power.size // together
    level = np.median(power[: number * together].reshape(number, together), axis=1)
    level = np.repeat(level, together) / math.log(2.0)
    level = np.append(level, np.full(power.size - level.size, level[-1]))
    scale = np.sqrt(np.maximum(level, power / kept))
    transform = np.divide(transform, scale, out=np.zeros_like(transform), where=scale > 0.0)
    # The slowest are drift.
    transform[:_TOGETHER] = 0.0
    return transform, level


def _inner(transform: NDArray[np.complex128], samples: int) -> FloatArray:
    """What a transform is of, without both ends.

    The end does not go on at the beginning, and what that makes of both is no noise.
    """
    return np.asarray(irfft(transform, samples)[EDGE:-EDGE])


# ---- profile -----------------------------------------------------------------------

# Samples, an odd number, whose mean is the motion at the middle one.
_SLOW: Final = 255
# Changes at the beginning that short searches look at, the most.
LOOKED_AT: Final = 2**17


class Survey(NamedTuple):
    """Extremes of values and of the steps between them, and how many of either are nothing.

    The first value counts for the extremes alone.
    """

    lowest: float
    highest: float
    fall: float
    rise: float
    zeros: int
    repeats: int

    @property
    def size(self) -> float:
        """Largest value, whatever its sign."""
        return max(abs(self.lowest), abs(self.highest))


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """A channel as detectors see it; what is costly is made when it is first asked for.

    Attributes
    ----------
    channel
        Of a gyro, an accelerometer or the table.
    sample_rate
        Hz.
    standing
        Whether no table turns.
    table
        Of the table, if there is one.
    together
        Of all gyros that are judged, by name.
    """

    channel: Channel
    sample_rate: float
    standing: bool = True
    table: "Profile | None" = None
    together: "dict[str, Profile]" = field(default_factory=dict)

    @classmethod
    def of(cls, recording: Recording, channel: Channel) -> Self:
        """The profile of one channel beside the table."""
        rate, table = recording.sample_rate, recording.table
        beside = None if table is None else cls(channel=table, sample_rate=rate)
        return cls(channel=channel, sample_rate=rate, table=beside)

    def each(self, recording: Recording) -> "list[Profile]":
        """Of every gyro of a recording, judged or not."""
        alone = partial(Profile, sample_rate=self.sample_rate, table=self.table)
        return [self.together.get(gyro.name) or alone(channel=gyro) for gyro in recording.gyros]

    @property
    def name(self) -> str:
        """Of the channel."""
        return self.channel.name

    @cached_property
    def changes(self) -> FloatArray:
        """What each sample turned: an angle's differences, the values of a rate or increments."""
        return changes_of(self.channel)

    @cached_property
    def survey(self) -> Survey:
        """Extremes of the values and of their steps, and how many of either are nothing."""

        def ends(before: FloatArray, here: FloatArray) -> tuple[float, ...]:
            steps = here - before
            nothing = number_of(here == 0.0), number_of(steps == 0.0)
            return before.min(), before.max(), steps.min(), steps.max(), *nothing

        values, last = self.channel.values, float(self.channel.values[-1])
        each = by_blocks(ends, values[:-1], values[1:])
        least, most = each.min(axis=0).tolist(), each.max(axis=0).tolist()
        zeros, repeats = each[:, 4:].sum(axis=0).tolist()
        lowest, highest = min(least[0], last), max(most[1], last)
        return Survey(lowest, highest, least[2], most[3], int(zeros), int(repeats))

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest change."""
        found = self.survey
        is_angle = self.channel.kind == "angle"
        return (found.fall, found.rise) if is_angle else (found.lowest, found.highest)

    @property
    def rounding(self) -> float:
        """Rounding of the changes of an angle, in its unit; 0 if the values are no differences."""
        if self.channel.kind != "angle":
            return 0.0
        return _LAST_PLACES * float(np.spacing(self.survey.size))

    @cached_property
    def step(self) -> float:
        """Step of the readout; the smallest change if it has none, infinite if nothing changes."""
        return count_step(self.changes, _LAST_PLACES * _ROUNDING * self.survey.size)

    @property
    def block(self) -> int:
        """Samples in a block; fewer than a block are one."""
        # A record is cut into 64 blocks of as many samples or more.
        return min(max(64, self.changes.size // 64), self.changes.size)

    def _rows(self) -> Iterator[FloatArray]:
        """The changes of each block, (samples,)."""
        whole = self.changes.size // self.block * self.block
        return (self.changes[some] for some in arrays.blocks(whole, self.block))

    @cached_property
    def level(self) -> FloatArray:
        """(blocks,) median of the changes."""
        apart = max(1, self.block // 4096)
        return np.array([np.median(row[::apart]) for row in self._rows()])

    @cached_property
    def power(self) -> FloatArray:
        """(blocks,) half the mean square of their differences: the variance of white noise."""
        steps = map(np.diff, self._rows())
        return np.array([0.5 * arrays.square(each) / max(each.size, 1) for each in steps])

    @cached_property
    def typical(self) -> FloatArray:
        """(blocks,) the same without the largest hundredth: single samples do not move it."""
        return np.array([_typical_power(row) for row in self._rows()])

    @cached_property
    def spread(self) -> FloatArray:
        """(blocks,) mean square of the changes about their median, those far off cut down."""
        # Beyond three roots of that power a sample counts as if it were there.
        farthest = 3.0 * np.sqrt(2.0 * self.typical)
        each = zip(self._rows(), self.level, farthest, strict=True)
        return np.array(
            [arrays.square(np.clip(row - level, -far, far)) / row.size for row, level, far in each]
        )

    @cached_property
    def white(self) -> White:
        """The changes at the beginning made white, without the motion.

        A table that reverses at once, or ends at another rate than it began with, would be louder
        at every frequency than the noise is.
        """
        changes = self.changes[:LOOKED_AT]
        steps = np.diff(changes, prepend=changes[:1])
        # Beyond ten medians, 6.7 deviations, a step counts as if it were there.
        reach = 10.0 * float(np.median(np.abs(steps)))
        if reach > 0.0:
            changes = np.cumsum(np.clip(steps, -reach, reach))
        sums = np.cumsum(changes)
        slow = (sums[_SLOW:] - sums[:-_SLOW]) / _SLOW
        return whitened(changes[_SLOW // 2 + 1 :][: slow.size] - slow)

    @cached_property
    def scale(self) -> float:
        """Standard deviation that is typical of the record, without single samples."""
        return math.sqrt(float(np.median(self.typical)))

    @property
    def is_coarse(self) -> bool:
        """Whether the noise strays over fewer than two steps of the readout."""
        return 2.0 * self.step > self.scale

    @property
    def walk(self) -> float:
        """Random walk that would scatter a gyro from sample to sample as it does, rad/sqrt(s)."""
        turned = self.scale / (self.sample_rate if self.channel.kind == "rate" else 1.0)
        return turned * math.sqrt(self.sample_rate)

    @cached_property
    def edges(self) -> IntegerArray:
        """(rates + 1,) samples between which the rates are."""
        samples = self.channel.values.size
        # Means over a second, or longer in a record of which there would be more than 4096.
        number = max(min(samples // max(1, round(self.sample_rate)), 4096), 20)
        return np.linspace(0, samples - 1, min(number, samples - 1) + 1).astype(np.int64)

    @cached_property
    def rates(self) -> FloatArray:
        """(rates,) mean rates over blocks of about a second, in SI."""
        values, edges = self.channel.values, self.edges
        seconds = np.diff(edges) / self.sample_rate
        if self.channel.kind == "angle":
            return np.asarray(np.diff(arrays.values_at(values, edges)) / seconds)
        turned = np.empty(seconds.size)
        # As many stretches at a time as a block of samples holds.
        together = max(1, arrays.BLOCK * turned.size // int(edges[-1]))
        for some in arrays.blocks(turned.size, together):
            first, last = edges[some.start], edges[some.stop]
            starts = edges[some] - first
            turned[some] = np.add.reduceat(values[first + 1 : last + 1], starts)
        turned /= self.sample_rate if self.channel.kind == "rate" else 1.0
        return np.asarray(turned / seconds)

    @cached_property
    def share(self) -> float:
        """Share of the table's rate that a gyro senses; NaN if nothing turns."""
        if self.table is None:
            return math.nan
        return share_of_turns(self.rates, self.table.rates, least=0.05 * DEGREE)

    @property
    def usual_rate(self) -> float:
        """Rate that nine in ten stay below, in SI."""
        return float(np.percentile(np.abs(self.rates), 90.0))


def changes_of(channel: Channel) -> FloatArray:
    """Turn of each sample, in the unit of the values: an angle's differences, or the values."""
    return arrays.differences(channel.values) if channel.kind == "angle" else channel.values


def turned(table: Channel | None) -> float:
    """Angle between the ends of what an encoder covers, rad; 0 if it stands still."""
    if table is None:
        return 0.0
    lowest, highest = arrays.extent(table.values)
    # A table that covers less is at rest: no encoder reads finer for hours.
    return highest - lowest if highest - lowest > math.radians(1.0) else 0.0


def _typical_power(row: FloatArray) -> float:
    """Variance of white noise by the steps between samples, without the largest hundredth."""
    size = np.abs(np.diff(row))
    kept = max(1, int(0.99 * size.size))
    if kept < size.size:
        size.partition(kept)
    # The mean square of a standard normal number among the smallest 99 %.
    return 0.5 * arrays.square(size[:kept]) / kept / 0.9247


# ---- robust ------------------------------------------------------------------------


def scatter_of(values: FloatArray) -> float:
    """Standard deviation of normal numbers about zero, by the median of their size."""
    return 1.4826 * float(np.median(np.abs(values)))


# ---- units -------------------------------------------------------------------------


def other_units(channel: Channel) -> dict[str, float]:
    """Units that a gyro's own is taken for by mistake -> size of one, of its own.

    A number before its own unit stands before them, too.
    """
    factor, stated = split_factor(channel.shown_in)
    said = "" if factor == 1.0 else f"{factor:g}"
    likely = ("deg/s", "rad/s", "deg/h") if channel.kind == "rate" else ("arcsec", "deg", "rad")
    sizes = {unit: UNITS[unit].size / UNITS[stated].size for unit in likely if unit != stated}
    return {f"{said}{unit}": size for unit, size in sizes.items()}


# ---- words -------------------------------------------------------------------------


def seen(recording: Recording, marks: BooleanArray | IntegerArray, noun: str, rest: str) -> str:
    """``12 samples of exactly zero, the first at 3.500 s``.

    Parameters
    ----------
    recording
        It tells when a sample was taken.
    marks
        Samples, as booleans (samples,) or by their numbers.
    noun, rest
        Of one of them, and what is said of them.
    """
    places = np.flatnonzero(marks) if marks.dtype == np.bool_ else marks
    when = second_of(recording, int(places[0]))
    return f"{counted(places.size, noun)} {rest}, the first at {when:.3f} s"


def remedy_of(recording: Recording, stretch: slice) -> str:
    """Remedy if only this stretch is sound: ``take the sound stretch with {slice 30:90}``.

    Rounded inwards to ms, so that the slice named holds no sample outside the stretch.
    """
    first, last = stretch.start, stretch.stop - 1
    begin = 0.0 if first == 0 else second_of(recording, first) * 1e3
    # Stamps of a damaged file may be any number.
    if stretch.stop - first < MINIMUM_SAMPLES or not math.isfinite(begin):
        return "get the file again from its source"
    start = math.ceil(begin) / 1e3
    stop = "" if last == recording.samples - 1 else f"{second_of(recording, last):.3f}"
    return f"take the sound stretch with {{slice {start:g}:{stop}}}"


def remedy_without(recording: Recording, bad: BooleanArray | IntegerArray) -> str:
    """Remedy if some samples are bad, given as booleans (samples,) or by their numbers."""
    marks = np.zeros(recording.samples, dtype=np.bool_)
    marks[bad] = True
    return remedy_of(recording, longest_unmarked(marks))
