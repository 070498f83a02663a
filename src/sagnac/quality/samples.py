"""Samples that are not what was measured then: missing, stuck, late, repeated, zero, another's."""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from sagnac.core.arrays import FloatArray, blocks, differences, elementwise, empty, every, mean
from sagnac.core.errors import Note, RecordingError, counted, ranked
from sagnac.quality import _kernels
from sagnac.quality.effects import finding
from sagnac.quality.profile import LOOKED_AT, Notes, Profile, count_step, remedy_of, remedy_without
from sagnac.recording.channel import (
    by_blocks,
    first_of,
    is_missing,
    longest_unmarked,
    marked,
    marked_steps,
    number_of,
    stretches,
)
from sagnac.recording.columns import GAP_STEPS, median_step
from sagnac.recording.encoder_readings import LARGEST_SHARE_MISSING, MOST_MISSING_IN_A_ROW
from sagnac.recording.model import Recording, second_of

# ---- missing -----------------------------------------------------------------------

# rad, rad/s or s: nothing is so large, and squares of what is larger end beyond all numbers.
_LARGEST: Final = 1e30


def missing_notes(recording: Recording, profile: Profile) -> Notes:
    """Samples of a channel that are NaN, infinite or beyond 1e30: an error."""
    return _no_numbers(recording, profile.name, profile.channel.values)


def _no_numbers(recording: Recording, name: str, values: FloatArray) -> Notes:
    bad = marked(lambda some: ~((some < _LARGEST) & (some > -_LARGEST)), values)
    number = number_of(bad)
    if number == 0:
        return ()
    not_finite = number_of(is_missing(values)) == number
    what = "NaN or infinite" if not_finite else f"NaN, infinite or beyond {_LARGEST:g}"
    # Reading has interpolated what it could of a table.
    beyond = (
        f", more than can be interpolated ({MOST_MISSING_IN_A_ROW} in a row, or as long as a gyro "
        f"tells the turn; {100.0 * LARGEST_SHARE_MISSING:g} % of all)"
        if name == "table"
        else ""
    )
    text = (
        f"{counted(number, 'sample')} {what}{beyond}, the first at "
        f"{second_of(recording, first_of(bad)):.3f} s; "
        f"{remedy_without(recording, bad)}"
    )
    return (Note(name="missing", level="error", channel=name, text=text),)


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
    whole = longest_unmarked(is_missing(gyro.values))
    is_empty, times = whole.start == whole.stop, recording.times
    if times is not None:
        times = None if is_empty else elementwise(np.subtract, times[whole], times[whole.start])
    own = tuple(one for one in recording.pickoffs if one.gyro == name)
    alone = replace(recording, gyros=(gyro,), pickoffs=own, table=None, null_pulse=None)
    start, provenance = 0.0 if is_empty else second_of(recording, whole.start), alone.provenance
    if provenance is not None and not is_empty:
        span = (start, second_of(recording, whole.stop - 1))
        provenance = replace(provenance, span_s=span)
    stretch = alone.with_columns(lambda values: values[whole], times=times, provenance=provenance)
    return stretch, start


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


def stuck_run(values: FloatArray) -> slice | None:
    """The longest run of one value, if it is longer than noise explains."""
    # A run that long shows in samples half as far apart; most gyros never repeat and are done.
    sparse = every(values, STUCK_SAMPLES // 2)
    if not (sparse[1:] == sparse[:-1]).any() and sparse.size > 1:
        return None
    repeats = marked(np.equal, values[1:], values[:-1])
    firsts, afters = stretches(repeats)
    # Samples of each run; the others are runs of one.
    lengths = afters - firsts + 1
    longest = int(lengths.max(initial=min(1, values.size)))
    if longest == values.size:
        return slice(0, longest)
    ones = np.ones(STUCK_RANK, dtype=np.int64)
    tenth = np.sort(np.concatenate([ones, lengths]))[-STUCK_RANK]
    outside = values.size - longest
    others = 1.0 - (values.size - number_of(repeats) - 1) / outside
    few = longest < STUCK_SAMPLES or longest <= STUCK_RATIO * tenth
    if few or others > STUCK_REPEATS:
        return None
    first = int(firsts[np.argmax(lengths)])
    return slice(first, first + longest)


def stuck_notes(recording: Recording, profile: Profile) -> Notes:
    """The longest run of one value, if no noise explains it: an error; a table may stand still."""
    samples = profile.channel.values.size
    run = None if profile.name == "table" else stuck_run(profile.channel.values)
    if run is None:
        return ()
    length = run.stop - run.start
    if length == samples:
        said = "is stuck: every sample is the same" if samples > 1 else "has too few samples"
        text = f"{said}; name another channel with {{gyros}} or {{columns}}"
    else:
        sound = slice(0, run.start)
        if samples - run.stop > run.start:
            sound = slice(run.stop, samples)
        text = (
            f"is stuck at one value for {length} samples from "
            f"{second_of(recording, run.start):.3f} s; {remedy_of(recording, sound)}"
        )
    return (Note(name="stuck", level="error", channel=profile.name, text=text),)


# ---- stamps ------------------------------------------------------------------------

LATE_STEPS: Final = 1.5
# Gaps that would hold this many times the samples there are belong to no one recording.
LARGEST_GAPS: Final = 9


def stamp_notes(recording: Recording, profile: Profile, *, omit_gaps: bool = False) -> Notes:
    """Faults of the time stamps of a recording, if there are any; gaps may be none."""
    times = recording.times
    if times is None:
        return ()
    not_finite = _no_numbers(recording, "time", times)
    if not_finite:
        return not_finite
    nominal, problem = median_step(times), ""
    steps = differences(times)
    backwards, gaps = steps < 0.0, steps > GAP_STEPS * nominal
    if backwards.any():
        first = first_of(backwards)
        problem = (
            f"runs backwards {counted(number_of(backwards), 'time')}, first at "
            f"{second_of(recording, first):.3f} s; correct the stamps, or state "
            "{time none} with {rate}"
        )
    elif nominal <= 0.0:
        problem = (
            "most stamps repeat the one before: the clock is too coarse for times, and their mean "
            f"rate is {recording.sample_rate:.6g} Hz; state {{time none}} and "
            f"{{rate {recording.sample_rate:.6g}}}"
        )
    elif gaps.any() and not omit_gaps:
        first = first_of(gaps)
        problem = (
            f"has {counted(number_of(gaps), 'gap')} of more than {GAP_STEPS:g} steps of "
            f"{nominal:.6g} s, the first of {steps[first]:.6g} s at "
            f"{second_of(recording, first):.3f} s; "
            f"{remedy_without(recording, np.flatnonzero(gaps) + 1)}"
        )
    if problem:
        return (Note(name="gaps", level="error", channel="time", text=problem),)
    return uneven_notes(times, nominal)


def uneven_notes(times: FloatArray, nominal: float) -> Notes:
    """Stamps that repeat the one before, and those that come late without leaving a gap.

    Parameters
    ----------
    times
        (samples,) s.
    nominal
        Step of their clock, s.
    """

    steps = differences(times)
    late = (steps > LATE_STEPS * nominal) & (steps <= GAP_STEPS * nominal)
    repeated = number_of(steps == 0.0)
    texts = [counted(repeated, "repeated stamp")] if repeated else []
    if late.any():
        texts.append(
            f"{counted(number_of(late), 'interval')} longer than {LATE_STEPS:g} "
            f"steps of {nominal:.6g} s, the longest {steps.max(where=late, initial=0.0):.6g} s"
        )
    return tuple(Note(channel="time", text=text) for text in texts)


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
    later = np.flatnonzero(differences(times) > GAP_STEPS * median_step(times)) + 1
    if not later.size:
        return recording
    jumps = times[later] - times[later - 1]
    between = float(times[-1] - times[0] - jumps.sum())
    rate = (times.size - 1 - later.size) / between
    skipped = np.rint(jumps * rate).astype(np.int64) - 1
    before = np.concatenate([[0], np.cumsum(skipped)])
    missing, gaps = int(before[-1]), counted(int(later.size), "gap")
    if missing > LARGEST_GAPS * times.size:
        raise RecordingError(
            f"its {gaps} would hold {missing} samples and there are {times.size}",
            path=recording.path,
            channel="time",
            remedy=remedy_without(recording, later),
        )
    text = (
        f"{gaps}, {counted(missing, 'sample')} missing, the first at "
        f"{second_of(recording, int(later[0]) - 1):.3f} s; {rate:.9g} Hz between"
    )

    def on_grid(values: FloatArray) -> FloatArray:
        """Values at their places, NaN at the others."""
        grid = empty(values.size + missing)
        grid.fill(np.nan)
        for block in blocks(values.size):
            here = np.arange(block.start, block.stop)
            grid[here + before[np.searchsorted(later, here, side="right")]] = values[block]
        return grid

    notes = (*recording.notes, Note(text=text, channel="time"))
    return recording.with_columns(on_grid, sample_rate=rate, times=None, notes=notes)


def _sound_apart_from_gaps(recording: Recording) -> Notes:
    """Notes on a recording with gaps; an error if anything else is wrong."""
    stuck: list[Note] = []
    for gyro in recording.gyros:
        infinite = np.isinf(gyro.values)
        if infinite.any():
            raise RecordingError(
                f"{counted(number_of(infinite), 'sample')} infinite, the first at "
                f"{second_of(recording, first_of(infinite)):.3f} s",
                path=recording.path,
                channel=gyro.name,
                remedy="mark bad samples as NaN",
            )
        profile = Profile.of(recording, gyro)
        stuck += stuck_notes(recording, profile)
    # One that is stuck does not cost the others.
    all_stuck = stuck if len(stuck) == len(recording.gyros) else []
    notes = (*all_stuck, *stamp_notes(recording, profile, omit_gaps=True))
    for note in ranked(notes):
        if note.level == "error":
            raise RecordingError.of(note, recording.path)
    return ranked((*notes, *stuck))


# ---- repeats -----------------------------------------------------------------------

# Repeats, or zeros, are this many, and this many times as many as their neighbours would be. Noise
# repeats itself half as often as it makes one of the two smallest changes, if it is read out in
# steps of a third of its scatter or finer.
_LEAST_OFTEN: Final = 10
_OFTENER: Final = 3
_FINE: Final = 3.0
# Samples whose values are counted.
_LOOKED_AT: Final = 20_000
# Changes below this part of the scatter are rounding.
_ROUNDING: Final = 1e-9
# Runs of this many samples are a channel that sticks; shorter ones are samples that are held.
_STICKS: Final = 8
# Share of held samples from which on they are how the recorder works: it is faster than the gyro.
_ALL_HELD: Final = 0.45


def repeat_notes(recording: Recording, profile: Profile) -> Notes:
    """Samples that repeat the one before, if no readout step explains them."""
    samples, number = profile.channel.values.size, profile.survey.repeats
    if number < _LEAST_OFTEN or number <= _OFTENER * _explained(profile):
        return ()
    repeats = marked_steps(profile.channel.values, lambda steps: steps == 0.0)
    text = (
        f"{counted(number, 'sample')} repeat the one before, the first at "
        f"{second_of(recording, first_of(repeats)):.3f} s"
    )
    firsts, afters = stretches(repeats)
    in_runs = int((afters - firsts)[afters - firsts >= _STICKS - 1].sum())
    held = (number - in_runs) / samples
    if in_runs > held * samples:
        text = f"sticks again and again: {text}; take a stretch without with {{slice}}"
        # That of the noise as far as the runs are long; what they make of slower noise is open.
        effect = math.sqrt(1.0 - in_runs / samples)
        return (finding("repeats", profile.name, text, effect=effect, level="error"),)
    if number / samples > _ALL_HELD:
        text = f"{text}: it is sampled faster than it measures"
        return (Note(name="repeats", channel=profile.name, text=text, level="warning"),)
    # Runs of held samples have lengths L, and slow noise grows by <L^2>/<L>: (1 + p)/(1 - p).
    effect = math.sqrt((1.0 + held) / (1.0 - held))
    return (finding("repeats", profile.name, text, effect=effect),)


def _explained(profile: Profile) -> float:
    """Repeats that the steps of a readout make, or few values in any order; all if it is coarse."""
    values, step = profile.channel.values, profile.step
    rounding = _ROUNDING * profile.scale
    if profile.channel.kind == "angle":
        step = count_step(values, rounding)
    if step * _FINE > math.sqrt(2.0) * profile.scale or not math.isfinite(step):
        return math.inf
    smallest = marked_steps(
        values, lambda steps: (np.abs(steps) > rounding) & (np.abs(steps) < 1.5 * step)
    )
    some = every(values, max(1, values.size // _LOOKED_AT))
    counts = np.unique(some, return_counts=True)[1].astype(np.float64)
    by_values = values.size * float(counts @ (counts - 1.0)) / (some.size * (some.size - 1.0))
    return max(0.5 * number_of(smallest), by_values)


# ---- twice -------------------------------------------------------------------------

# Samples of a window by which a block is known again, and odd numbers that mix their bits.
_WINDOW: Final = 8
_MIXED_BY: Final = 0x9E3779B97F4A7C15
# One in sixteen windows is kept; there is room for twice as many.
_ROOM: Final = 8
# A block is this long at least, and takes this many values: what few steps of a readout make comes
# about by chance.
_LEAST: Final = 64
_VALUES: Final = 16
# Distances between two windows alike that are looked at, the most frequent.
_DISTANCES: Final = 4


def twice_notes(recording: Recording, profile: Profile) -> Notes:
    """The longest block that stands in the record twice: a warning."""
    block, distance = longest_twice(profile.channel.values)
    if not distance:
        return ()
    text = (
        f"{block.stop - block.start} samples from {second_of(recording, block.start):.3f} s on are "
        f"there again from {second_of(recording, block.start + distance):.3f} s on: an interval "
        "counts them twice; take a stretch without with {slice}"
    )
    return (finding("repeats", profile.name, text, effect=1.0),)


def longest_twice(values: FloatArray) -> tuple[slice, int]:
    """The longest block that stands in a series twice, value by value.

    Parameters
    ----------
    values
        (samples,)

    Returns
    -------
    block
        Its samples; none if there is no such block.
    distance
        Samples to its repetition.
    """
    longest = (slice(0, 0), 0)
    if values.size < 2 * _LEAST:
        return longest
    places = np.empty(values.size // _ROOM, dtype=np.int64)
    mixed = np.empty(places.size, dtype=np.uint64)
    bits = np.ascontiguousarray(values).view(np.uint64)
    # Uncompiled, numpy would warn of the products that wrap around.
    with np.errstate(over="ignore"):
        kept = _kernels.kept_windows(bits, np.uint64(_MIXED_BY), _WINDOW, places, mixed)
    places, numbers = places[:kept], mixed[:kept].view(np.int64)
    # Told by a sort of the numbers alone, in most records, which takes a tenth of that of places.
    ascending = np.sort(numbers)
    alike = np.flatnonzero(ascending[1:] == ascending[:-1])
    if alike.size == 0:
        return longest
    order = np.argsort(numbers, kind="stable")
    apart = places[order[alike + 1]] - places[order[alike]]
    distances, counts = np.unique(apart[apart >= _LEAST], return_counts=True)
    for distance in distances[np.argsort(-counts, kind="stable")[:_DISTANCES]].tolist():
        same = longest_unmarked(marked(np.not_equal, values[:-distance], values[distance:]))
        # A block that reaches into its repetition is a channel that goes round.
        block = slice(same.start, min(same.stop, same.start + distance))
        length = block.stop - block.start
        if length < _LEAST or np.unique(values[block]).size < _VALUES:
            continue
        if length > longest[0].stop - longest[0].start:
            longest = (block, distance)
    return longest


# ---- dropouts ----------------------------------------------------------------------

# Steps of the readout that noise strays over if a sample is 0 by chance alone; and standard
# deviations of the noise by which 0 lies off the rest, however coarse the steps.
_BY_CHANCE: Final = 20.0
_AWAY: Final = 4.0
# An angle falls to zero by this many of its usual steps.
_FALL: Final = 50.0


def dropout_notes(recording: Recording, profile: Profile) -> Notes:
    """Zeros far more often than the values beside zero; of an angle, zeros that it falls to."""
    values, effect = profile.channel.values, None
    if profile.survey.zeros == 0:
        return ()
    zeros = values == 0.0
    if profile.channel.kind == "angle":
        usual = every(profile.changes, max(1, profile.changes.size // 100_000))
        fall = _FALL * float(np.median(np.abs(usual)))
        zeros &= marked_steps(values, lambda steps: np.abs(steps) > fall)
        number = number_of(zeros) if fall else 0
    else:
        number = number_of(zeros)
        # A gyro that counts coarsely, and turns little, counts 0 most of the time.
        fine = profile.scale > _BY_CHANCE * profile.step
        away = abs(float(np.median(profile.level))) > _AWAY * profile.scale
        if number < _LEAST_OFTEN or not (fine or away) or number <= _OFTENER * _beside(values):
            return ()
        effect = _scatter_with_zeros(values, number)
    if number == 0:
        return ()
    text = (
        f"{counted(number, 'sample')} of exactly zero, the first at "
        f"{second_of(recording, first_of(zeros)):.3f} s, as if readings were lost "
        "(dropouts); mark lost samples as NaN"
    )
    return (finding("dropouts", profile.name, text, effect=effect),)


def _beside(values: FloatArray) -> int:
    """How often the values next to zero stand there, the more frequent of the two."""
    above = values.min(where=values > 0.0, initial=math.inf)
    below = values.max(where=values < 0.0, initial=-math.inf)
    return max(number_of(values == above), number_of(values == below))


def _scatter_with_zeros(values: FloatArray, zeros: int) -> float | None:
    """Scatter of all samples over that without the zeros."""
    left = values.size - zeros
    if left <= 1:
        return None
    usual = mean(values) * values.size / left
    squares = by_blocks(lambda some: np.square(some[some != 0.0] - usual).sum(), values).sum()
    inside = float(squares) / left
    # Zeros lie by the mean off the rest.
    share = zeros / values.size
    whole = (1.0 - share) * inside + share * (1.0 - share) * usual * usual
    return math.sqrt(whole / inside) if inside > 0.0 else None


# ---- interleaved -------------------------------------------------------------------

# How many sensors may take turns. Of four, a line at a quarter of the sample rate (mains at 200 Hz)
# looks alike.
_ORDINALS: Final = {2: "second", 3: "third"}
# Parts of the samples looked at that all have to show it, and fewest samples.
_PARTS: Final = 4
_LEAST_SAMPLES: Final = 4096
# Standard errors by which the means of the turns differ, and least difference, in scatters of one
# sensor; ratio of their scatters.
_TURN_SIGMAS: Final = 8.0
_LEAST_SHARE: Final = 0.5
_RATIO: Final = 1.3
# Scatters beyond which a sample counts as if it were there.
_FAR: Final = 5.0
# Median of the size of the difference of two standard normal numbers.
_MEDIAN_STEP: Final = 0.9539


def interleaved_notes(recording: Recording, profile: Profile) -> Notes:
    """Every second sample, or every third, has a mean or a scatter of its own: an error.

    One sensor has that only of a line at exactly half its sample rate, or a third.
    """
    for sensors in _ORDINALS:
        if _take_turns(profile, sensors):
            text = (
                f"every {_ORDINALS[sensors]} sample is of another kind: {sensors} sensors seem to "
                "stand in this column by turns; write each into a column of its own"
            )
            return (Note(name="interleaved", level="error", channel=profile.name, text=text),)
    return ()


def _take_turns(profile: Profile, sensors: int) -> bool:
    """Whether samples `sensors` apart are alike and those between are not, all along."""
    changes = profile.changes[:LOOKED_AT]
    if changes.size < _LEAST_SAMPLES:
        return False
    turns = _turns(changes, sensors)
    typical = float(np.median(_scatters(turns)))
    if not typical > profile.rounding:
        return False
    # Motion is taken off by the mean of each round, and single samples far off shift no mean.
    off = turns - turns.mean(axis=2, keepdims=True)
    middle = np.median(off, axis=1)
    reach = _FAR * typical
    means = middle + np.clip(off - middle[:, np.newaxis], -reach, reach).mean(axis=1)
    least = max(_TURN_SIGMAS * typical / math.sqrt(turns.shape[1]), _LEAST_SHARE * typical)
    # The same one in every part, on the same side.
    if (np.all(means > least, axis=0) | np.all(means < -least, axis=0)).any():
        return True
    # Some turns see more of a line at a part of the sample rate: the noise between lines tells.
    white = profile.white
    if not white.innovation > profile.rounding:
        return False
    scatters = _scatters(_turns(white.values, sensors))
    order = np.argsort(scatters, axis=1)
    louder = scatters.max(axis=1) > _RATIO * scatters.min(axis=1)
    return bool(louder.all() and (order == order[0]).all())


def _turns(values: FloatArray, sensors: int) -> FloatArray:
    """(parts, rounds, sensors)"""
    length = values.size // _PARTS // sensors
    return values[: _PARTS * length * sensors].reshape(_PARTS, length, sensors)


def _scatters(turns: FloatArray) -> FloatArray:
    """(parts, sensors) by the median of the steps from each sample to the next of its own turn."""
    return np.asarray(np.median(np.abs(np.diff(turns, axis=1)), axis=1) / _MEDIAN_STEP)
