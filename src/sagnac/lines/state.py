"""A search on its way: what is known of an angle, and what follows from that.

A `State` never changes; a pass makes a new one. What follows from it by a pass over the record
(the angle without table motion, its increments without the lines, their sums at whole orders) is
made when it is first asked for and kept for as long as the same motion and lines are asked about:
states that know the same share it, and the record holds the last of each kind alone.
"""

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeVar

import numpy as np

from sagnac.core.arrays import ComplexArray, FloatArray, blocks, elementwise, empty
from sagnac.lines.components import (
    MOST_ORDERS,
    Components,
    Turning,
    no_components,
    removed,
    turning,
)
from sagnac.lines.detection import Band, Residue, Spectrum, detection_threshold, spectrum
from sagnac.lines.joint_fit import ComponentFit, earth_amplitudes, order_sums
from sagnac.lines.naming import Lineup
from sagnac.lines.products import Sampling, sampling
from sagnac.lines.rescaling import Wander, wander
from sagnac.lines.wandering import DriftingLine, values
from sagnac.recording.channel import require_rate
from sagnac.table.kinematics import averaged, block_averages, kinematics
from sagnac.table.motion import TableMotion, follow_table
from sagnac.table.turns import is_turning

_Made = TypeVar("_Made")

End = Literal[
    "nothing stands",
    "nothing new stood",
    "too many lines",
    "too many pairs",
    "too many rounds",
]


@dataclass(slots=True, kw_only=True)
class Kept:
    """The last thing of each kind that was made, and what it was made from."""

    made: dict[str, tuple[Hashable, Any]] = field(default_factory=dict)

    def of(self, kind: str, source: Hashable, make: Callable[[], _Made]) -> _Made:
        """Result of `make` for this source, made once for as long as no other is asked for.

        The one before is let go first: two of them may be more than memory should hold.
        """
        if kind in self.made and self.made[kind][0] != source:
            del self.made[kind]
        if kind not in self.made:
            self.made[kind] = (source, make())
        result: _Made = self.made[kind][1]
        return result


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Record:
    """Record that is searched.

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
    threshold
        Ratio of power to floor that a line has to exceed.
    kept
        What was made of it last.
    """

    angle: FloatArray
    encoder: FloatArray | None
    sample_rate: float
    false_alarm: float = 0.01
    threshold: float = field(init=False)
    kept: Kept = field(default_factory=Kept, repr=False)

    def __post_init__(self) -> None:
        if self.angle.ndim != 1 or self.angle.size < 2:
            raise ValueError(f"angle has shape {self.angle.shape}; give two samples or more")
        if self.encoder is not None and self.encoder.shape != self.angle.shape:
            raise ValueError(
                f"table has shape {self.encoder.shape}; give that of the angle, {self.angle.shape}"
            )
        require_rate(self.sample_rate)
        threshold = detection_threshold(self.angle.size // 2, self.false_alarm)
        object.__setattr__(self, "threshold", threshold)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Increments:
    """An angle without table motion and lines.

    Attributes
    ----------
    steps
        (samples - 1,) increments, rad, without their mean.
    averages
        (averages,) of the angle itself, rad, over the blocks of `Kinematics`; none at rest.
    """

    steps: FloatArray
    averages: FloatArray


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
    fit: ComponentFit | None = None
    drifting: tuple[DriftingLine, ...] = ()
    seen: FloatArray | None = None
    settled: bool = False
    earth_reach: FloatArray | None = None
    earth_settled: bool = False
    steady: frozenset[tuple[int, ...]] = frozenset()
    bands: tuple[Band, ...] = ()
    passes: float = 0.0
    rounds: int = 0
    end: End | None = None

    def __post_init__(self) -> None:
        if self.fit is not None and self.fit.components.size != self.components.size:
            raise ValueError(
                f"fit is of {self.fit.components.size} components; give that of the "
                f"{self.components.size} known ones, or none"
            )

    # --- the table ---------------------------------------------------------------------------

    @property
    def table(self) -> FloatArray | None:
        """(samples,) table angle, rad."""
        return None if self.motion is None else self.motion.kinematics.table

    @property
    def turning(self) -> Turning | None:
        """How the table turns; None at rest."""
        table, rate = self.table, self.record.sample_rate
        if table is None:
            return None
        return self.record.kept.of("turning", None, lambda: turning(table, rate))

    @property
    def wander(self) -> Wander | None:
        """How the table strays from a steady rate; None if it has none."""
        turns = self.turning
        if turns is None:
            return None
        return self.record.kept.of("wander", None, lambda: wander(turns))

    @property
    def sampled(self) -> Sampling:
        """When, and at which table angles, the angle was sampled."""
        table, samples = self.table, self.record.angle.size
        return self.record.kept.of("sampling", None, lambda: sampling(samples, table))

    @property
    def patience(self) -> FloatArray | None:
        """`earth_reach` until Earth rate is settled; None then, and at rest.

        Once taken for lines, what Earth rate makes would hide it: it waits until that is settled.
        """
        return None if self.earth_settled else self.earth_reach

    # --- what is left of the angle -----------------------------------------------------------

    @property
    def without_motion(self) -> FloatArray:
        """(samples,) the angle without table motion, rad; the angle itself at rest."""
        motion, angle = self.motion, self.record.angle
        if motion is None:
            return angle
        return self.record.kept.of(
            "angle without motion", _key_of_motion(motion), lambda: motion_removed(angle, motion)
        )

    @property
    def increments(self) -> Increments:
        """Increments and averages of the angle without table motion and lines."""
        return self.record.kept.of("increments", self._key, lambda: lines_removed(self))

    @property
    def order_sums(self) -> ComplexArray | None:
        """(`MOST_ORDERS` + 1,) sums of the increments at whole orders; None at rest.

        As `joint_fit.order_sums` gives them.
        """
        table = self.table
        if table is None:
            return None
        return self.record.kept.of(
            "order sums",
            self._key,
            lambda: order_sums(self.increments.steps, table, MOST_ORDERS),
        )

    @property
    def residue(self) -> Residue:
        """Arrays in which new lines are looked for."""
        return Residue(
            steps=self.increments.steps,
            sampled=self.sampled,
            turning=self.turning,
            threshold=self.record.threshold,
            spectrum=self.look(),
            order_sums=self.order_sums,
        )

    @property
    def floor(self) -> FloatArray:
        """`seen`, once the increments were looked at."""
        if self.seen is None:
            raise ValueError("floor of a state that was never looked at; look first")
        return self.seen

    def look(self) -> Spectrum:
        """Power of the increments as they are now, and its floor."""
        return self.record.kept.of("spectrum", self._key, lambda: spectrum(self.increments.steps))

    def residual(self) -> FloatArray:
        """(samples,) the angle without table motion and lines, rad: a new array."""
        result = empty(self.record.angle.size)
        for block in blocks(result.size, self._length):
            result[block] = _rest(self, block.start, block.stop)
        return result

    def with_all_lines(self) -> "State":
        """The state that knows the same table motion and no line."""
        nothing = no_components(self.record.angle.size)
        return replace(self, components=nothing, fit=None, drifting=())

    def lineup(self, floor: FloatArray) -> Lineup:
        """Knowledge from which the lines are described, over the floor of the residue."""
        return Lineup(
            fit=self.fit,
            drifting=self.drifting,
            turning=self.turning,
            floor=floor,
            sample_rate=self.record.sample_rate,
            samples=self.record.angle.size,
        )

    @property
    def _length(self) -> int | None:
        """Samples in a block: as in table motion."""
        return None if self.motion is None else self.motion.kinematics.length

    @property
    def _key(self) -> Hashable:
        """Terms taken out of the angle, by value."""
        motion = None if self.motion is None else _key_of_motion(self.motion)
        known = self.components
        arrays = (known.orders, known.free, known.frequencies, known.cosine, known.sine)
        lines = tuple(
            (line.carrier, line.envelope.tobytes(), line.phase.tobytes()) for line in self.drifting
        )
        return motion, tuple(array.tobytes() for array in arrays), lines


def first_state(record: Record) -> State:
    """A state that knows table motion alone."""
    encoder, angle = record.encoder, record.angle
    motion = None
    if encoder is not None and is_turning(encoder):
        kinematic = kinematics(encoder, record.sample_rate)
        motion = follow_table(block_averages(angle, kinematic), kinematic)
    state = State(record=record, motion=motion, components=no_components(angle.size))
    turns = state.turning
    return state if turns is None else replace(state, earth_reach=earth_amplitudes(turns))


def _key_of_motion(motion: TableMotion) -> Hashable:
    """Table motion taken out, by value; its harmonics are left in."""
    return motion.share, motion.drift, motion.earth


def _rest(state: State, start: int, stop: int) -> FloatArray:
    """(stop - start,) the angle without table motion and lines, rad."""
    angle, table = state.without_motion[start:stop], state.table
    rest = removed(
        angle, None if table is None else table[start:stop], state.components, start=start
    )
    for line in state.drifting:
        rest -= values(line, start, rest.size)
    return rest


def motion_removed(angle: FloatArray, motion: TableMotion) -> FloatArray:
    """(samples,) an angle without table motion, rad: a new array."""
    rest = empty(angle.size)
    for block in blocks(angle.size, motion.kinematics.length):
        np.subtract(angle[block], motion.over(block.start, block.stop), out=rest[block])
    return rest


def lines_removed(state: State) -> Increments:
    """`Increments` of the angle without table motion and lines, as a state knows them."""
    size = state.record.angle.size
    steps = empty(size - 1)
    means = [np.empty(0)]
    first = last = 0.0
    for block in blocks(size, state._length):
        # One sample more: the increment that leads to the next block.
        stop = min(block.stop + 1, size)
        rest = _rest(state, block.start, stop)
        np.subtract(rest[1:], rest[:-1], out=steps[block.start : stop - 1])
        if state.motion is not None:
            own = rest[: block.stop - block.start]
            means.append(averaged(own, state.motion.kinematics.block))
        first, last = float(rest[0]) if block.start == 0 else first, float(rest[-1])
    elementwise(np.add, steps, (first - last) / steps.size, out=steps)
    return Increments(steps=steps, averages=np.concatenate(means))
