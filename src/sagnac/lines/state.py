"""A search on its way: what is known of an angle, and what follows from that.

A `State` never changes; a pass makes a new one. What follows from it by a pass over the record
(the angle without table motion, its increments without the lines, their sums at whole orders) is
made when it is first asked for and kept for as long as the same motion and lines are asked about:
states that know the same share it, and the record holds the last of each kind alone.
"""

from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, TypeVar

import numpy as np

from sagnac.core.arrays import ComplexArray, FloatArray, blocks, elementwise, empty
from sagnac.core.errors import refusal, require_shape
from sagnac.lines import detection, joint_fit, wandering
from sagnac.lines.components import Components, components_of, removed
from sagnac.lines.sampling import MOST_ORDERS, Sampling
from sagnac.recording.channel import require_rate
from sagnac.recording.model import MINIMUM_SAMPLES
from sagnac.table.kinematics import averaged, averages_of, kinematics
from sagnac.table.motion import TableMotion, follow_table
from sagnac.table.turns import is_turning

_Made = TypeVar("_Made")

End = Literal[
    "nothing stands", "nothing new stood", "too many lines", "too many pairs", "too many rounds"
]


@dataclass(frozen=True, kw_only=True, eq=False)
class Record:
    """Record that is searched, and what its table makes of it.

    Attributes
    ----------
    angle
        (samples,) gyro angle or difference of two, rad.
    encoder
        (samples,) unwrapped table angle, rad; None if nothing turns.
    sample_rate
        Hz.
    false_alarm
        Probability that noise alone yields any line at all.
    made
        The last thing of each kind that was made of it, and what it was made from.
    """

    angle: FloatArray
    encoder: FloatArray | None
    sample_rate: float
    false_alarm: float = 0.01
    made: dict[str, tuple[Hashable, Any]] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        if self.angle.ndim != 1 or self.angle.size < MINIMUM_SAMPLES:
            remedy = f"give {MINIMUM_SAMPLES} samples or more"
            raise refusal("angle", f"has shape {self.angle.shape}; {remedy}")
        if self.encoder is not None:
            require_shape("table", self.encoder.shape, self.angle.shape)
        require_rate(self.sample_rate)
        _ = self.threshold

    @cached_property
    def threshold(self) -> float:
        """Ratio of power to floor that a line has to exceed."""
        return detection.detection_threshold(self.angle.size // 2, self.false_alarm)

    @cached_property
    def sampled(self) -> Sampling:
        """When, and at which angles of a table that turns, the angle was sampled."""
        table = self.encoder if is_turning(self.encoder) else None
        return Sampling(samples=self.angle.size, table=table, sample_rate=self.sample_rate)

    def kept(self, kind: str, source: Hashable, make: Callable[[], _Made]) -> _Made:
        """Result of `make` for this source, made once for as long as no other is asked for.

        The one before is let go first: two of them may be more than memory should hold.
        """
        if kind not in self.made or self.made[kind][0] != source:
            self.made.pop(kind, None)
            self.made[kind] = (source, make())
        result: _Made = self.made[kind][1]
        return result


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class State:
    """A search on its way.

    Attributes
    ----------
    record
        What is searched.
    motion
        Table motion known so far; None at rest.
    components
        Steady lines known so far.
    fit
        The joint fit that these are from; None if they were changed since.
    drifting
        Lines whose amplitude or phase drifts.
    seen
        (bins,) noise floor of the increments when they were last looked at, rad^2. Their power is
        kept by the record alone: states that are past would hold one each.
    settled
        Whether the last step of the fit was small beside the errors.
    earth_reach
        (orders,) rad that Earth rate may put into each order at the most; None at rest.
    earth_settled
        Whether Earth rate moves no more.
    steady
        Tones, alone or in clusters, that were found to be steady lines, by their places.
    bands
        (low, high) cycles a sample, ascending: bands of vibration, in which nothing is a line.
    passes
        Passes over all samples that the joint fits took, one for each pair of lines that meet.
    rounds
        Rounds done.
    end
        Why the search is over; None while it goes on.
    """

    record: Record
    motion: TableMotion | None
    components: Components
    fit: joint_fit.ComponentFit | None = None
    drifting: tuple[wandering.DriftingLine, ...] = ()
    seen: FloatArray | None = None
    settled: bool = False
    earth_reach: FloatArray | None = None
    earth_settled: bool = False
    steady: frozenset[tuple[int, ...]] = frozenset()
    bands: tuple[detection.Band, ...] = ()
    passes: float = 0.0
    rounds: int = 0
    end: End | None = None

    @property
    def patience(self) -> FloatArray | None:
        """`earth_reach` until Earth rate is settled; None then, and at rest.

        Once taken for lines, what Earth rate makes would hide it: it waits until that is settled.
        """
        return None if self.earth_settled else self.earth_reach

    @property
    def floor(self) -> FloatArray:
        """`seen`, once the increments were looked at."""
        if self.seen is None:
            raise ValueError("floor of a state that was never looked at; look first")
        return self.seen

    # --- what is left of the angle -----------------------------------------------------------

    @property
    def without_motion(self) -> FloatArray:
        """(samples,) the angle without table motion, rad; the angle itself at rest."""
        motion, angle = self.motion, self.record.angle
        if motion is None:
            return angle
        # The harmonics of the motion are left in.
        key = motion.share, motion.drift, motion.earth
        return self.record.kept("angle without motion", key, lambda: motion.less(angle))

    @property
    def steps(self) -> FloatArray:
        """(samples - 1,) increments of the angle without motion and lines, less their mean, rad."""
        return self.record.kept("increments", self.key, self._increments)

    def _increments(self) -> FloatArray:
        steps = empty(self.record.angle.size - 1)
        first = last = 0.0
        for start, rest in self._rest(1):
            np.subtract(rest[1:], rest[:-1], out=steps[start : start + rest.size - 1])
            first, last = float(rest[0]) if start == 0 else first, float(rest[-1])
        return elementwise(np.subtract, steps, (last - first) / steps.size, out=steps)

    def averages(self, block: int) -> FloatArray:
        """(averages,) of the angle without motion and lines over blocks of samples, rad."""
        return np.concatenate([averaged(rest, block) for _, rest in self._rest()])

    @property
    def order_sums(self) -> ComplexArray:
        """(`MOST_ORDERS` + 1,) `joint_fit.order_sums` of the increments; zeros at rest."""
        table = self.record.sampled.table
        if table is None:
            return np.zeros(MOST_ORDERS + 1, dtype=np.complex128)
        return self.record.kept(
            "order sums", self.key, lambda: joint_fit.order_sums(self.steps, table, MOST_ORDERS)
        )

    def look(self) -> detection.Spectrum:
        """Power of the increments as they are now, and its floor."""
        return self.record.kept("spectrum", self.key, lambda: detection.spectrum(self.steps))

    def residual(self) -> FloatArray:
        """(samples,) the angle without table motion and lines, rad: a new array."""
        result = empty(self.record.angle.size)
        for start, rest in self._rest():
            result[start : start + rest.size] = rest
        return result

    def _rest(self, more: int = 0) -> Iterator[tuple[int, FloatArray]]:
        """The angle without table motion and lines, rad, and where it starts.

        It comes block by block as in table motion, each with so many samples `more` of the next.
        """
        angle, table = self.without_motion, self.record.sampled.table
        length = None if self.motion is None else self.motion.kinematics.length
        for block in blocks(angle.size, length):
            some = slice(block.start, block.stop + more)
            here = None if table is None else table[some]
            rest = removed(angle[some], here, self.components, start=some.start)
            for line in self.drifting:
                rest -= wandering.values(line, some.start, rest.size)
            yield some.start, rest

    @property
    def key(self) -> Hashable:
        """Terms taken out of the angle, by value."""
        motion, known = self.motion, self.components
        arrays = (known.orders, known.free, known.frequencies, known.phasor)
        moved = None if motion is None else (motion.share, motion.drift, motion.earth)
        each = ((one.carrier, one.envelope.tobytes(), one.phase.tobytes()) for one in self.drifting)
        return moved, tuple(array.tobytes() for array in arrays), tuple(each)


def first_state(record: Record) -> State:
    """A state that knows table motion alone."""
    nothing, table = components_of(record.angle.size), record.sampled.table
    motion = None
    if table is not None:
        kinematic = kinematics(table, record.sample_rate)
        motion = follow_table(averages_of(record.angle, kinematic.block), kinematic)
    reach = joint_fit.earth_amplitudes(record.sampled)
    return State(record=record, motion=motion, components=nothing, earth_reach=reach)
