"""Samples that are not there: NaN, channels that stick, gaps and repeats of the time stamps."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac.core.arrays import (
    BooleanArray,
    FloatArray,
    IntegerArray,
    blocks,
    elementwise,
    empty,
    every,
)
from sagnac.core.errors import Note, RecordingError, counted, ranked
from sagnac.quality.profile import remedy_of
from sagnac.recording.channel import Channel
from sagnac.recording.encoder_readings import LARGEST_SHARE_MISSING, MOST_MISSING_IN_A_ROW
from sagnac.recording.model import Recording, second_of
from sagnac.recording.stamps import GAP_STEPS, Places, Stretch, changes, is_not_finite, median_step

# ---- not finite --------------------------------------------------------------------

# rad, rad/s or s: nothing is so large, and squares of what is larger end beyond all numbers.
_LARGEST: Final = 1e30


def not_finite_notes(recording: Recording, name: str, values: FloatArray) -> tuple[Note, ...]:
    """Samples of one channel, or of the time, that are NaN, infinite or beyond 1e30: an error.

    Parameters
    ----------
    recording
        It tells when a sample was taken.
    name
        Gyro name, ``table`` or ``time``.
    values
        (samples,) of that channel.
    """
    places = Places(values=values, test=_is_no_number)
    bad = places.tally()
    if bad.count == 0:
        return ()
    not_finite = Places(values=values, test=is_not_finite).tally().count
    what = "NaN or infinite" if not_finite == bad.count else f"NaN, infinite or beyond {_LARGEST:g}"
    # Reading has interpolated what it could of a table.
    beyond = (
        f", more than can be interpolated ({MOST_MISSING_IN_A_ROW} in a row, or as long as a gyro "
        f"tells the turn; {100.0 * LARGEST_SHARE_MISSING:g} % of all)"
        if name == "table"
        else ""
    )
    text = (
        f"{counted(bad.count, 'sample')} {what}{beyond}, the first at "
        f"{second_of(recording, bad.first):.3f} s; "
        f"{remedy_of(recording, places.longest_between(recording.samples))}"
    )
    return (Note(name="missing", level="error", channel=name, text=text),)


def _is_no_number(values: FloatArray) -> BooleanArray:
    """Whether values are NaN, infinite, or beyond what anything turns."""
    return ~((values < _LARGEST) & (values > -_LARGEST))


# ---- stuck -------------------------------------------------------------------------

# A run of one value is a stuck channel if it is this long, and this many times longer than
# the tenth longest. A quantized quiet gyro repeats itself for long, but then it does so all
# over the record (ten runs of noise differ by less than a factor of two or three in length),
# while a channel that sticks does so once or a few times. Nothing can be said of a channel that
# repeats itself nine times out of ten anyway: an angle read out coarsely is a random walk over
# its steps, and the stays of a walk have no typical length.
STUCK_SAMPLES: Final = 100
STUCK_RATIO: Final = 10.0
STUCK_RANK: Final = 10
STUCK_REPEATS: Final = 0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class Runs:
    """Runs of one value.

    Attributes
    ----------
    number
        How many there are.
    longest
        The longest, the first if two are as long.
    lengths
        (`STUCK_RANK`,) samples in the longest, in no order; 0 if there are fewer.
    """

    number: int
    longest: Stretch
    lengths: IntegerArray


def runs_of(values: FloatArray) -> Runs:
    """The runs of one value in an array, of one sample each if it never repeats."""
    number, longest = 0, Stretch(first=0, after=0)
    ranked = np.zeros(STUCK_RANK, dtype=np.int64)
    for edges in Places(values=values, test=changes, following=1).edges():
        lengths = np.diff(edges)
        at = int(np.argmax(lengths))
        if lengths[at] > longest.samples:
            longest = Stretch(first=int(edges[at]) + 1, after=int(edges[at + 1]) + 1)
        ranked = np.partition(np.concatenate((ranked, lengths)), -STUCK_RANK)[-STUCK_RANK:]
        number += lengths.size
    return Runs(number=number, longest=longest, lengths=ranked)


def is_stuck(runs: Runs, samples: int) -> bool:
    """Whether the longest of the runs in `samples` is longer than noise explains."""
    length = runs.longest.samples
    if length == samples:
        return True
    # Share of repeats among the samples outside the longest run.
    repeats = 1.0 - (runs.number - 1) / (samples - length)
    return not (
        length < STUCK_SAMPLES
        or length <= STUCK_RATIO * runs.lengths.min()
        or repeats > STUCK_REPEATS
    )


def stuck_notes(recording: Recording, gyro: Channel) -> tuple[Note, ...]:
    """The longest run of one value, if no noise explains it: an error."""
    # A run that long shows in samples half as far apart; most gyros never repeat and are done.
    samples = gyro.values.size
    sparse = every(gyro.values, STUCK_SAMPLES // 2)
    if not (sparse[1:] == sparse[:-1]).any() and sparse.size > 1:
        return ()
    runs = runs_of(gyro.values)
    if not is_stuck(runs, samples):
        return ()
    run = runs.longest
    if run.samples == samples:
        said = "is stuck: every sample is the same" if samples > 1 else "has too few samples"
        text = f"{said}; name another channel with {{gyros}} or {{columns}}"
    else:
        before = Stretch(first=0, after=run.first)
        behind = Stretch(first=run.after, after=samples)
        sound = behind if behind.samples > before.samples else before
        text = (
            f"is stuck at one value for {run.samples} samples from "
            f"{second_of(recording, run.first):.3f} s; {remedy_of(recording, sound)}"
        )
    return (Note(name="stuck", level="error", channel=gyro.name, text=text),)


# ---- gaps --------------------------------------------------------------------------

LATE_STEPS: Final = 1.5
# Gaps that would hold this many times the samples there are belong to no one recording.
LARGEST_GAPS: Final = 9


def gaps_of(times: FloatArray, longest: float) -> Places:
    """Samples after which the time stamps jump by more than `longest`, s."""
    return Places(values=times, test=lambda some: np.diff(some) > longest, following=1)


def with_gaps_marked(recording: Recording) -> Recording:
    """The sensors at even times, NaN where a sample is missing; table and null pulse left out.

    A jump of the time stamps by more than `GAP_STEPS` steps is filled with as many NaN as
    samples fit into it; shorter ones are stamps that came late, as everywhere. The sample rate
    is that between the gaps.

    Parameters
    ----------
    recording
        As read without verification.

    Raises
    ------
    RecordingError
        If anything but gaps is wrong: infinite samples, stamps that run backwards, no gyro that
        is not stuck, or gaps that hold far more samples than there are.
    """
    recording = replace(recording, table=None, null_pulse=None)
    recording = replace(recording, notes=(*recording.notes, *_sound_apart_from_gaps(recording)))
    times = recording.times
    if times is None or times.size < 2:
        return recording
    longest = GAP_STEPS * median_step(times)
    gaps = gaps_of(times, longest)
    found = gaps.tally()
    if found.count == 0:
        return recording
    grid = grid_of(times, longest, found.count)
    missing = grid.samples - times.size
    if missing > LARGEST_GAPS * times.size:
        remedy = remedy_of(recording, gaps.longest_between(recording.samples, later=1))
        raise RecordingError(
            f"its {counted(found.count, 'gap')} would hold {missing} samples and there are "
            f"{times.size}",
            path=recording.path,
            channel="time",
            remedy=remedy,
        )
    text = (
        f"{counted(found.count, 'gap')}, {counted(missing, 'sample')} missing, the first at "
        f"{second_of(recording, found.first):.3f} s; {grid.sample_rate:.9g} Hz between"
    )
    return recording.with_columns(
        lambda values: on_grid(values, times, grid),
        sample_rate=grid.sample_rate,
        times=None,
        notes=(*recording.notes, Note(text=text, channel="time")),
    )


def _sound_apart_from_gaps(recording: Recording) -> tuple[Note, ...]:
    """Notes on a recording with gaps; an error if anything else is wrong."""
    notes: list[Note] = []
    stuck: list[Note] = []
    for gyro in recording.gyros:
        infinite = Places(values=gyro.values, test=np.isinf).tally()
        if infinite.count:
            raise RecordingError(
                f"{counted(infinite.count, 'sample')} infinite, the first at "
                f"{second_of(recording, infinite.first):.3f} s",
                path=recording.path,
                channel=gyro.name,
                remedy="mark bad samples as NaN",
            )
        stuck += stuck_notes(recording, gyro)
    if len(stuck) == len(recording.gyros):
        # One that is stuck does not cost the others.
        notes += stuck
    if recording.times is not None:
        notes += stamp_notes(recording, recording.times, omit_gaps=True)
    for note in ranked(notes):
        if note.level == "error":
            raise RecordingError.of(note, recording.path)
    return ranked((*notes, *stuck))


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Even times that stamps with gaps stand for.

    Attributes
    ----------
    sample_rate
        Mean samples per second between the gaps.
    samples
        With those that are missing.
    longest
        Interval beyond which samples are missing, s.
    """

    sample_rate: float
    samples: int
    longest: float

    def advances(self, times: FloatArray) -> FloatArray:
        """Samples from each stamp to the next."""
        steps = np.diff(times)
        return np.where(steps > self.longest, np.rint(steps * self.sample_rate), 1.0)


def grid_of(times: FloatArray, longest: float, gaps: int) -> Grid:
    """The grid of stamps of which `gaps` intervals are longer than `longest`, s."""
    intervals = times.size - 1
    between = 0.0
    for block in blocks(intervals):
        steps = np.diff(times[block.start : block.stop + 1])
        between += float(steps[steps <= longest].sum())
    grid = Grid(sample_rate=(intervals - gaps) / between, samples=0, longest=longest)
    last = sum(
        float(grid.advances(times[block.start : block.stop + 1]).sum())
        for block in blocks(intervals)
    )
    return replace(grid, samples=1 + int(last))


def on_grid(values: FloatArray, times: FloatArray, grid: Grid) -> FloatArray:
    """Values at their places of a grid, NaN at the others, shape (grid.samples,)."""
    marked = empty(grid.samples)
    marked.fill(np.nan)
    marked[0] = values[0]
    place = 0.0
    for block in blocks(times.size - 1):
        places = place + np.cumsum(grid.advances(times[block.start : block.stop + 1]))
        marked[places.astype(np.intp)] = values[block.start + 1 : block.stop + 1]
        place = float(places[-1])
    return marked


def longest_whole_stretch(recording: Recording, name: str) -> tuple[Recording, float]:
    """The longest stretch of one gyro without a missing sample.

    Returns
    -------
    recording
        Of that gyro alone, without table and null pulse, possibly of no sample.
    start
        Of the stretch, s from the first sample of the file.
    """
    gyro = recording.gyro(name)
    places = Places(values=gyro.values, test=is_not_finite)
    whole = places.longest_between(gyro.values.size)
    first, after = whole.first, whole.after
    times = recording.times
    if times is not None:
        some = whole.samples > 0
        times = elementwise(np.subtract, times[first:after], times[first]) if some else None
    own = tuple(one for one in recording.pickoffs if one.gyro == name)
    alone = replace(recording, gyros=(gyro,), pickoffs=own, table=None, null_pulse=None)
    stretch = alone.with_columns(lambda values: values[first:after], times=times)
    return stretch, second_of(recording, first) if whole.samples > 0 else 0.0


def stamp_notes(
    recording: Recording, times: FloatArray, *, omit_gaps: bool = False
) -> tuple[Note, ...]:
    """Faults of time stamps, and notes on them.

    Parameters
    ----------
    recording
        It tells when a sample was taken.
    times
        (samples,) s.
    omit_gaps
        Whether gaps are no error here.
    """
    not_finite = not_finite_notes(recording, "time", times)
    if not_finite:
        return not_finite
    backwards = Places(values=times, test=lambda some: np.diff(some) < 0.0, following=1).tally()
    if backwards.count:
        text = (
            f"runs backwards {counted(backwards.count, 'time')}, first at "
            f"{second_of(recording, backwards.first):.3f} s; correct the stamps, or state "
            "{time none} with {rate}"
        )
        return (Note(name="gaps", level="error", channel="time", text=text),)
    nominal = median_step(times)
    if nominal <= 0.0:
        text = (
            "most stamps repeat the one before: the clock is too coarse for times, and their mean "
            f"rate is {recording.sample_rate:.6g} Hz; state {{time none}} and "
            f"{{rate {recording.sample_rate:.6g}}}"
        )
        return (Note(name="gaps", level="error", channel="time", text=text),)
    gaps = gaps_of(times, GAP_STEPS * nominal)
    found = gaps.tally()
    if found.count and not omit_gaps:
        text = (
            f"has {counted(found.count, 'gap')} of more than {GAP_STEPS:g} steps of "
            f"{nominal:.6g} s, the first of {times[found.first + 1] - times[found.first]:.6g} s at "
            f"{second_of(recording, found.first):.3f} s; "
            f"{remedy_of(recording, gaps.longest_between(recording.samples, later=1))}"
        )
        return (Note(name="gaps", level="error", channel="time", text=text),)
    return uneven_notes(times, nominal)


def uneven_notes(times: FloatArray, nominal: float) -> tuple[Note, ...]:
    """Stamps that repeat the one before, and those that come late without leaving a gap.

    Parameters
    ----------
    times
        (samples,) s.
    nominal
        Step of their clock, s.
    """
    repeated, late, latest = 0, 0, 0.0
    for block in blocks(times.size - 1):
        steps = np.diff(times[block.start : block.stop + 1])
        slow = steps[(steps > LATE_STEPS * nominal) & (steps <= GAP_STEPS * nominal)]
        repeated += int(np.count_nonzero(steps == 0.0))
        late += slow.size
        latest = float(slow.max(initial=latest))
    notes = []
    if repeated:
        notes.append(Note(channel="time", text=counted(repeated, "repeated stamp")))
    if late:
        text = (
            f"{counted(late, 'interval')} longer than {LATE_STEPS:g} "
            f"steps of {nominal:.6g} s, the longest {latest:.6g} s"
        )
        notes.append(Note(channel="time", text=text))
    return tuple(notes)
