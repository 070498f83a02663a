"""A channel as detectors see it: its rate, its noise from block to block, its units."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Final, NamedTuple, Self

import numpy as np

from sagnac.core import arrays
from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray
from sagnac.core.errors import Note
from sagnac.core.marks import number_of
from sagnac.core.units import DEGREE, UNITS, split_factor
from sagnac.quality.lattice import LAST_PLACES, count_step, largest_step, rounding_in
from sagnac.quality.whitening import White, whitened
from sagnac.recording.channel import Channel
from sagnac.recording.encoder_readings import share_of_turns
from sagnac.recording.model import Recording

Notes = tuple[Note, ...]

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
        each = arrays.by_blocks(ends, values[:-1], values[1:])
        least, most = each.min(axis=0).tolist(), each.max(axis=0).tolist()
        zeros, repeats = each[:, 4:].sum(axis=0).tolist()
        lowest, highest = min(least[0], last), max(most[1], last)
        return Survey(lowest, highest, least[2], most[3], int(zeros), int(repeats))

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest change."""
        survey = self.survey
        is_angle = self.channel.kind == "angle"
        return (survey.fall, survey.rise) if is_angle else (survey.lowest, survey.highest)

    @property
    def rounding(self) -> float:
        """Rounding of the changes of an angle, in its unit; 0 if the values are no differences."""
        if self.channel.kind != "angle":
            return 0.0
        return LAST_PLACES * float(np.spacing(max(-self.survey.lowest, self.survey.highest)))

    @cached_property
    def step(self) -> float:
        """Step of the readout; the smallest change if it has none, infinite if nothing changes."""
        return count_step(self.changes, rounding_in(self.channel.values))

    @cached_property
    def largest_step(self) -> float:
        """Step of the largest samples of a rate; `step` if all samples have the same."""
        if self.channel.kind == "angle":
            return self.step
        factor, unit = split_factor(self.channel.shown_in)
        largest = partial(largest_step, scatter=self.scale, unit=factor * UNITS[unit].size)
        return max(self.step, float(arrays.by_blocks(largest, self.channel.values).max()))

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
        each = zip(self._rows(), self.level, 3.0 * np.sqrt(2.0 * self.typical), strict=True)
        clipped = (np.clip(row - level, -far, far) for row, level, far in each)
        return np.array([arrays.square(row) / row.size for row in clipped])

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
        return self._walk_of(self.scale)

    @cached_property
    def walk_in_seconds(self) -> float:
        """Random walk that would scatter the samples within a second as they do, rad/sqrt(s)."""
        size = min(max(16, round(self.sample_rate)), self.changes.size)
        rows = self.changes[:LOOKED_AT]
        seconds = rows[: rows.size // size * size].reshape(-1, size)
        return self._walk_of(math.sqrt(float(np.median(seconds.var(axis=1)))))

    def _walk_of(self, scatter: float) -> float:
        turned = scatter / (self.sample_rate if self.channel.kind == "rate" else 1.0)
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
            turned[some] = np.add.reduceat(values[first + 1 : last + 1], edges[some] - first)
        turned /= self.sample_rate if self.channel.kind == "rate" else 1.0
        return np.asarray(turned / seconds)

    @cached_property
    def share(self) -> float:
        """Share of the table's rate that a gyro senses; NaN if nothing turns."""
        if self.table is None:
            return math.nan
        return share_of_turns(self.rates, self.table.rates, least=0.05 * DEGREE)

    @cached_property
    def even(self) -> BooleanArray:
        """(samples,) false in the seconds in which a table speeds up, stops or turns round.

        What a gyro turns there leaves what is usual, and it is the table's. If a table never turns
        evenly (it swings, or sweeps), no second stands out.
        """
        size = self.channel.values.size
        if self.standing or self.table is None or math.isnan(self.share):
            return np.broadcast_to(np.True_, size)
        changes = np.abs(self.share * np.diff(self.table.rates))
        noise = self.scale * (1.0 if self.channel.kind == "rate" else self.sample_rate)
        # A table counts as speeding up, stopping or turning round if its rate changes from one
        # second to the next by more than three times the median change, and than five times the
        # scatter of the gyro's samples. Smaller changes put no sample far off.
        uneven = np.flatnonzero(changes > max(3.0 * float(np.median(changes)), 5.0 * noise))
        return self._beside(uneven, seconds=2)

    @property
    def turning(self) -> BooleanArray:
        """(samples,) false in the seconds in which a table that turns stands still."""
        return self._beside(np.flatnonzero(np.abs(self.rates) < 0.1 * self.usual_rate), seconds=1)

    def _beside(self, places: IntegerArray, seconds: int) -> BooleanArray:
        """(samples,) true, except in some seconds after each of these places among the rates."""
        marks = np.ones(self.channel.values.size, dtype=np.bool_)
        for first, after in zip(self.edges[places], self.edges[places + seconds] + 1, strict=True):
            marks[first:after] = False
        return marks

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
    problem = "" if factor == 1.0 else f"{factor:g}"
    likely = ("deg/s", "rad/s", "deg/h") if channel.kind == "rate" else ("arcsec", "deg", "rad")
    sizes = {unit: UNITS[unit].size / UNITS[stated].size for unit in likely if unit != stated}
    return {f"{problem}{unit}": size for unit, size in sizes.items()}
