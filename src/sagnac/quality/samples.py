"""Samples that are not what was measured then: missing, stuck, late, repeated, zero, another's."""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from sagnac.core import arrays, marks
from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray
from sagnac.core.errors import Note, RecordingError, counted, ranked
from sagnac.quality.effects import STRETCH, finding, remedy_of, remedy_without, seen
from sagnac.quality.lattice import LEAST_OFTEN, OFTENER, count_step, rounding_in
from sagnac.quality.profile import LOOKED_AT, Notes, Profile, scatter_of
from sagnac.recording.encoder_readings import LARGEST_SHARE_MISSING, MOST_MISSING_IN_A_ROW
from sagnac.recording.model import Recording, second_of
from sagnac.recording.stamps import CORRECT_STAMPS, GAP_STEPS, median_step, round_figure

# Share of the scatter of a record below which differences of its samples are rounding.
_ROUNDING: Final = 1e-9

LEAVE_OUT: Final = "leave these rows out and keep the time stamps"
# Samples whose mean is of noise below a low-pass, and the fewest means.
_TOGETHER: Final = 64
_FEWEST_MEANS: Final = 32

# ---- missing -----------------------------------------------------------------------


def missing_notes(recording: Recording, profile: Profile) -> Notes:
    """Samples of a channel that are NaN, infinite or beyond 1e30: an error."""
    return _no_numbers(recording, profile.name, profile.channel.values)


def _no_numbers(recording: Recording, name: str, values: FloatArray) -> Notes:
    # Nothing is so large, and squares of what is larger end beyond all numbers.
    bad = marks.marked(lambda some: ~((some < 1e30) & (some > -1e30)), values)
    if not bad.any():
        return ()
    not_finite = marks.number_of(marks.is_missing(values)) == marks.number_of(bad)
    what = "NaN or infinite" if not_finite else "NaN, infinite or beyond 1e+30"
    if name == "table" and (bad[0] or bad[-1]):
        what += ", at an end of the record, where nothing lies beyond to interpolate to"
    elif name == "table":
        # Reading has interpolated what it could.
        most = f"{MOST_MISSING_IN_A_ROW} in a row, or as long as a gyro tells the turn"
        share = f"{100.0 * LARGEST_SHARE_MISSING:g} % of all"
        what += f", more than can be interpolated ({most}; {share})"
    remedy = remedy_without(recording, bad)
    firsts, afters = marks.stretches(bad)
    if name != "table" and (afters - firsts).max() <= MOST_MISSING_IN_A_ROW:
        # Rows that stamps show to be missing do not end the record.
        remedy = f"{LEAVE_OUT}, or {remedy}"
    text = f"{seen(recording, bad, 'sample', what)}; {remedy}"
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
    whole = marks.longest_unmarked(marks.is_missing(gyro.values))
    is_empty, times = whole.start == whole.stop, recording.times
    if is_empty:
        times = None
    elif times is not None:
        times = arrays.elementwise(np.subtract, times[whole], times[whole.start])
    own = tuple(one for one in recording.pickoffs if one.gyro == name)
    alone = replace(recording, gyros=(gyro,), pickoffs=own, table=None, null_pulse=None)
    start, provenance = 0.0 if is_empty else second_of(recording, whole.start), alone.provenance
    if provenance is not None and not is_empty:
        provenance = replace(provenance, span_s=(start, second_of(recording, whole.stop - 1)))
    stretch = alone.with_columns(lambda values: values[whole], times=times, provenance=provenance)
    return stretch, start


# ---- stuck -------------------------------------------------------------------------


def stuck_run(values: FloatArray) -> slice | None:
    """The longest run of one value, if it is longer than noise explains."""
    repeats = marks.marked(np.equal, values[1:], values[:-1])
    firsts, afters = marks.stretches(repeats)
    # Samples of each run; the others are runs of one.
    lengths = afters - firsts + 1
    longest = int(lengths.max(initial=min(1, values.size)))
    if longest == values.size:
        return slice(0, longest)
    tenth = np.sort(np.concatenate([np.ones(10, dtype=np.int64), lengths]))[-10]
    others = 1.0 - (values.size - marks.number_of(repeats) - 1) / (values.size - longest)
    # A run of one value is a stuck channel if it is of a hundred samples, and ten times longer than
    # the tenth longest. A quantized quiet gyro repeats itself for long, but then it does so all
    # over the record (ten runs of noise differ by less than a factor of two or three in length),
    # while a channel that sticks does so once or a few times. Nothing can be said of a channel that
    # repeats itself nine times out of ten anyway: an angle read out coarsely is a random walk over
    # its steps, and the stays of a walk have no typical length.
    if longest < 100 or longest <= 10.0 * tenth or others > 0.9:
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
        problem = "is stuck: every sample is the same" if samples > 1 else "has too few samples"
        text = f"{problem}; name another channel with {{gyros}} or {{columns}}"
    else:
        sound = slice(run.stop, samples) if samples - run.stop > run.start else slice(0, run.start)
        problem = f"{length} samples from {second_of(recording, run.start):.3f} s"
        text = f"is stuck at one value for {problem}; {remedy_of(recording, sound)}"
    return (Note(name="stuck", level="error", channel=profile.name, text=text),)


# ---- stamps ------------------------------------------------------------------------


def stamp_notes(recording: Recording, profile: Profile, *, omit_gaps: bool = False) -> Notes:
    """Faults of the time stamps of a recording, if there are any; gaps may be none."""
    times = recording.times
    if times is None:
        return ()
    if not_finite := _no_numbers(recording, "time", times):
        return not_finite
    nominal, problem = median_step(times), ""
    steps = arrays.differences(times)
    backwards, gaps = steps < 0.0, steps > GAP_STEPS * nominal
    number = 0 if omit_gaps else marks.number_of(gaps)
    # Bursts may be packets of two hundred samples. Then most of the time lies in the gaps, unlike
    # where packets were lost.
    in_bursts = number > 0.005 * steps.size and recording.sample_rate * nominal < 0.5
    if backwards.any():
        first = marks.first_of(backwards)
        fact = f"runs backwards {counted(marks.number_of(backwards), 'time')}, first at "
        problem = f"{fact}{second_of(recording, first):.3f} s; {CORRECT_STAMPS}"
    elif nominal <= 0.0:
        problem = "most stamps repeat the one before: the clock is too coarse for times"
        problem += _rate_of_ticks(times, np.flatnonzero(steps) + 1)
    elif in_bursts:
        fact = f"comes in bursts: most stamps lie {nominal:.6g} s after the one before"
        more = f"{number} more than {GAP_STEPS:g} times as far"
        by_rate = f"state {{time none}} and {{rate {recording.sample_rate:.6g}}}"
        remedy = f"if the samples were taken evenly, {by_rate}"
        problem = f"{fact}, and {more}. Those are times of arrival; {remedy}"
    elif number:
        first = marks.first_of(gaps)
        several = f"{counted(number, 'gap')} of more than {GAP_STEPS:g} steps"
        when = f"the first of {steps[first]:.6g} s at {second_of(recording, first):.3f} s"
        remedy = remedy_without(recording, np.flatnonzero(gaps) + 1)
        problem = f"has {several} of {nominal:.6g} s, {when}; {remedy}"
    if problem := problem or _change_of_rate(recording, times):
        return (Note(name="gaps", level="error", channel="time", text=problem),)
    return uneven_notes(times, nominal)


def _change_of_rate(recording: Recording, times: FloatArray) -> str:
    """Whether the rate changes by over a tenth somewhere, and what to do; empty if not.

    Lost rows move a mean step alone, and the ticks of a coarse clock a median one, so both have to,
    by six deviations of a mean of random steps.
    """
    apart = -(-times.size // 10_000)
    some = arrays.every(times, apart)
    at = apart * int(np.abs(some - np.linspace(some[0], some[-1], some.size)).argmax())
    fewest, sides = min(at, times.size - at), (times[: at + 1], times[at:])
    if fewest < max(0.05 * times.size, 64):
        return ""
    mean = np.array([(one[-1] - one[0]) / (one.size - 1) for one in sides])
    longer = int(mean.argmax())
    if not mean[longer] > 1.1 * mean[1 - longer] > 0.0:
        return ""
    usual = [median_step(one, repeats=False) for one in sides]
    scatter = np.std(arrays.differences(times)) / math.sqrt(fewest)
    if not usual[longer] > 1.1 * usual[1 - longer] or np.ptp(mean) < 6.0 * scatter:
        return ""
    remedy = remedy_without(recording, np.arange(max(0, at - apart + 1), at + apart))
    fact = f"the samples come at {1.0 / mean[0]:.3g} Hz, and at {1.0 / mean[1]:.3g} Hz from about"
    return f"{fact} {second_of(recording, at):.3f} s on; {remedy}"


def _rate_of_ticks(times: FloatArray, ticks: IntegerArray) -> str:
    """The rate that a clock too coarse for times shows, and how it is stated.

    The first and the last reading of the clock hold a part of their samples only, so that the rate
    is that between the first and the last tick.

    Parameters
    ----------
    times
        (samples,) s.
    ticks
        First sample of each reading of the clock except the first.
    """
    if ticks.size < 2:
        return "; state {time none} and {rate HZ}"
    samples = int(ticks[-1] - ticks[0])
    rate = round_figure(samples / float(times[ticks[-1]] - times[ticks[0]]), 1.0 / samples)
    return f", and their mean rate is {rate:.6g} Hz; state {{time none}} and {{rate {rate:.6g}}}"


def uneven_notes(times: FloatArray, nominal: float) -> Notes:
    """Stamps that repeat the one before, and those that come late without leaving a gap.

    Parameters
    ----------
    times
        (samples,) s.
    nominal
        Step of their clock, s.
    """

    steps = arrays.differences(times)
    late = (steps > 1.5 * nominal) & (steps <= GAP_STEPS * nominal)
    repeated = marks.number_of(steps == 0.0)
    texts = [counted(repeated, "repeated stamp")] if repeated else []
    if late.any():
        number, longest = marks.number_of(late), float(steps.max(where=late, initial=0.0))
        problem = f"{counted(number, 'interval')} longer than 1.5 steps of {nominal:.6g} s"
        texts.append(f"{problem}, the longest {longest:.6g} s")
    return tuple(Note(channel="time", text=text) for text in texts)


def lost_row_notes(recording: Recording, profile: Profile) -> Notes:
    """Rows that even stamps show to be missing, of a gyro whose samples are of their own span.

    Each sample of a rate, or increment, has the noise of a step of the clock, and counts for the
    mean step. An angle holds what was turned meanwhile.
    """
    times, kind = recording.times, profile.channel.kind
    if times is None or kind == "angle":
        return ()
    nominal = median_step(times)

    def counts(some: FloatArray) -> tuple[float, float]:
        """Steps on the grid of the clock, and the rows that they leap over."""
        whole = np.rint(some / nominal)
        on_grid = (np.abs(some / nominal - whole) < 0.1) & (whole >= 1.0)
        return float(np.count_nonzero(on_grid)), float((whole[on_grid] - 1.0).sum())

    steps = arrays.differences(times)
    even, lost = arrays.by_blocks(counts, steps).sum(axis=0).tolist()
    # Stamps that come late and catch up again are of rows that are all there.
    # Stamps of an even clock are nearly all on its grid.
    if not lost or even < 0.95 * steps.size:
        return ()
    more = math.sqrt(1.0 + lost / steps.size)
    apart = f"{nominal:.6g} s apart or a multiple of that"
    problem = f"{lost:.0f} rows are not there, for its stamps lie {apart}"
    text = f"{problem}; get the file again from its source"
    return (finding("dropouts", profile.name, text, effect=more if kind == "rate" else 1.0 / more),)


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
    later = np.flatnonzero(arrays.differences(times) > GAP_STEPS * median_step(times)) + 1
    if not later.size:
        return recording
    jumps = times[later] - times[later - 1]
    rate = (times.size - 1 - later.size) / float(times[-1] - times[0] - jumps.sum())
    before = np.concatenate([[0], np.cumsum(np.rint(jumps * rate).astype(np.int64) - 1)])
    missing, gaps = int(before[-1]), counted(int(later.size), "gap")
    # Such gaps belong to no one recording.
    if missing > 9 * times.size:
        problem = f"its {gaps} would hold {missing} samples and there are {times.size}"
        remedy = remedy_without(recording, later)
        raise RecordingError(problem, path=recording.path, channel="time", remedy=remedy)
    fact, at = f"{gaps}, {counted(missing, 'sample')} missing", int(later[0]) - 1
    text = f"{fact}, the first at {second_of(recording, at):.3f} s; {rate:.9g} Hz between"

    def on_grid(values: FloatArray) -> FloatArray:
        """Values at their places, NaN at the others."""
        grid = arrays.empty(values.size + missing)
        grid.fill(np.nan)
        for block in arrays.blocks(values.size):
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
            problem = seen(recording, infinite, "sample", "infinite")
            remedy = "mark bad samples as NaN"
            raise RecordingError(problem, path=recording.path, channel=gyro.name, remedy=remedy)
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


def repeat_notes(recording: Recording, profile: Profile) -> Notes:
    """Samples that repeat the one before, if no readout step explains them."""
    samples, number = profile.channel.values.size, profile.survey.repeats
    if number < LEAST_OFTEN or number <= OFTENER * _explained(profile):
        return ()
    repeats = marks.marked_steps(profile.channel.values, lambda steps: steps == 0.0)
    text = seen(recording, repeats, "sample", "repeat the one before")
    firsts, afters = marks.stretches(repeats)
    # Runs of eight samples are a channel that sticks; shorter ones are samples that are held.
    is_run = afters - firsts >= 7
    in_runs = int((afters - firsts)[is_run].sum())
    held = (number - in_runs) / samples
    # A recorder that is faster than its source holds each value equally long, or one sample longer.
    is_even = int((afters - firsts).max()) < math.ceil(samples / (samples - number))
    if in_runs > held * samples and not (is_even and number / samples > 0.45):
        # The first sample of a run repeats nothing.
        first, length = firsts[is_run] - 1, (afters - firsts)[is_run] + 1
        often = "once, for" if first.size == 1 else f"{first.size} times, for up to"
        text = f"sticks {often} {length.max()} samples: {text}; {STRETCH}"
        # If slow noise grows by no more, an answer stands. N is of faster noise, too, and moved by
        # 0.7 % at most, as tried with one run and three of 15 to 99 samples.
        if _slow_growth(profile, first, length) <= 1.04:
            return (finding("repeats", profile.name, text, effect=1.0),)
        # That of the noise as far as the runs are long; what they make of slower noise is open.
        effect = math.sqrt(1.0 - in_runs / samples)
        return (finding("repeats", profile.name, text, effect=effect, level="error"),)
    # Then that is how the recorder works.
    if number / samples > 0.45:
        text = f"{text}: it is sampled faster than it measures"
        return (Note(name="repeats", channel=profile.name, text=text, level="warning"),)
    # Runs of held samples have lengths L, and slow noise grows by <L^2>/<L>: (1 + p)/(1 - p).
    effect = math.sqrt((1.0 + held) / (1.0 - held))
    return (finding("repeats", profile.name, text, effect=effect),)


def _slow_growth(profile: Profile, first: IntegerArray, length: IntegerArray) -> float:
    """Most that runs of one value raise slow noise by, as a factor on N; infinite if it is open.

    L samples of white noise turn sqrt(L) times as far as one of them, a run of one value L times.

    Parameters
    ----------
    profile
        Of a gyro.
    first, length
        (runs,) samples.
    """
    # An angle leaps behind a run, and motion goes on during it.
    if profile.channel.kind == "angle" or not profile.standing or not profile.scale > 0.0:
        return math.inf
    block = np.minimum(first // profile.block, profile.level.size - 1)
    off = np.abs(profile.channel.values[first] - profile.level[block]) / profile.scale
    # By chance a run stands anywhere within the noise; if it stands farther off, it counts as such.
    turned = length * (length - 1.0) * np.maximum(off, 1.0) ** 2
    return math.sqrt(1.0 + float(turned.sum()) / profile.channel.values.size)


def _explained(profile: Profile) -> float:
    """Repeats that the steps of a readout make, or few values in any order; all if it is coarse.

    Noise repeats itself half as often as it makes one of the two smallest changes, if it is read
    out in steps of a third of its scatter or finer.
    """
    values, step = profile.channel.values, profile.largest_step
    rounding = _ROUNDING * profile.scale
    if profile.channel.kind == "angle":
        step = count_step(values, rounding)
    if not math.isfinite(step):
        # If each sample is held four times or more, every one has an equal beside it: the samples
        # that differ from the one before tell the step.
        step = count_step(values[1:][np.diff(values) != 0.0], rounding)
    if step * 3.0 > math.sqrt(2.0) * profile.scale or not math.isfinite(step):
        return math.inf
    smallest = marks.marked_steps(
        values, lambda steps: (np.abs(steps) > rounding) & (np.abs(steps) < 1.5 * step)
    )
    some = arrays.every(values, arrays.distance_between(20_000, values.size))
    counts = np.unique(some, return_counts=True)[1].astype(np.float64)
    by_values = values.size * float(counts @ (counts - 1.0)) / (some.size * (some.size - 1.0))
    return max(0.5 * marks.number_of(smallest), by_values)


# ---- filled ------------------------------------------------------------------------


def filled_notes(recording: Recording, profile: Profile) -> Notes:
    """Samples of a rate on the straight line between their neighbours: gaps that were filled."""
    values, reach = profile.channel.values, _reach_of_straight(profile)
    # An angle between two others shares out what was turned, and N is as it was.
    if profile.channel.kind == "angle" or values.size < 4096 or not reach:
        return ()
    three = values[:-2], values[1:-1], values[2:]
    straight = np.zeros(values.size, dtype=np.bool_)
    straight[1:-1] = marks.marked(
        lambda before, here, after: (_bent(before, here, after) <= reach) & (here != after), *three
    )
    number = marks.number_of(straight)
    if number < LEAST_OFTEN:
        return ()

    def is_beside(before: FloatArray, here: FloatArray, after: FloatArray) -> BooleanArray:
        bent = _bent(before, here, after)
        return (bent > reach) & (bent <= 3.0 * reach)

    # By chance as many lie in half of a stretch twice as wide.
    if number <= LEAST_OFTEN + OFTENER * 0.5 * marks.number_of(marks.marked(is_beside, *three)):
        return ()
    problem = seen(recording, straight, "sample", "on the straight line between two others")
    if number > _MOST_STRAIGHT * values.size:
        text = f"{problem}: it is sampled faster than it measures"
        return (Note(name="repeats", channel=profile.name, text=text, level="warning"),)
    text = f"{problem}, as if gaps were filled by interpolation; {LEAVE_OUT}"
    return (finding("repeats", profile.name, text, effect=_effect_of_filling(values, straight)),)


# Share of samples on straight lines above which the rate of all was raised by interpolation.
_MOST_STRAIGHT: Final = 0.45


def _reach_of_straight(profile: Profile) -> float:
    """How far off a straight line its rounding puts a sample; 0 if that is no less than noise."""
    if 20.0 * profile.largest_step > profile.scale:
        return 0.0
    return max(1.5 * profile.largest_step, rounding_in(profile.channel.values))


def _bent(before: FloatArray, here: FloatArray, after: FloatArray) -> FloatArray:
    """How far samples are off twice the straight line between their neighbours."""
    return np.abs(after - 2.0 * here + before)


def _effect_of_filling(values: FloatArray, straight: BooleanArray) -> float | None:
    """Factor on N if gaps are filled by straight lines.

    A gap of n samples adds n/2 to what each sample beside it counts, which raises the noise of
    white samples by n + n^2/2 parts of one of them. Across one or two samples, what is added goes
    with the noise between neighbours, which behind a low-pass is small; a longer line leaves N's.
    """
    firsts, afters = marks.stretches(straight)
    gaps = (afters - firsts).astype(np.float64)
    added = (gaps + 0.5 * gaps**2) / values.size
    # Across longer gaps the noise of neighbours does not tell how far a line is off.
    is_short = gaps <= 2
    values, straight = values[:LOOKED_AT], straight[:LOOKED_AT]
    apart = ~(straight[2:] | straight[1:-1] | straight[:-2])
    if not apart.any():
        return None
    # Of white noise this is six times the variance.
    between = float(np.mean(_bent(values[:-2], values[1:-1], values[2:])[apart] ** 2)) / 6.0
    means = values[: values.size // _TOGETHER * _TOGETHER].reshape(-1, _TOGETHER).mean(axis=1)
    slow = 0.5 * _TOGETHER * float(np.mean(np.diff(means) ** 2))
    # Beyond that it raises N by so much that no more need be known.
    left = max(slow - float(added[is_short].sum()) * between, 0.5 * slow)
    return math.sqrt((1.0 + float(added[~is_short].sum())) * slow / left)


# ---- twice -------------------------------------------------------------------------

# Samples of a block, at least, and of the windows that are compared.
_LEAST: Final = 64
_WINDOW: Final = 8


def twice_notes(recording: Recording, profile: Profile) -> Notes:
    """The longest block that stands in the record twice: a warning, or an error if most does."""
    values = profile.channel.values
    block, distance = longest_twice(values)
    if not distance:
        return ()
    # A record that goes round repeats a block again and again. Its noise is lines then, of which
    # removal leaves little: of a record that stands there twice N came out up to 23 % too small.
    same = marks.longest_unmarked(marks.marked(np.not_equal, values[:-distance], values[distance:]))
    # Up to a quarter of it, repeated samples move N by less than 5 %, as tried.
    effect = 1.0 if same.stop - same.start <= 0.25 * values.size else None
    first, again = (second_of(recording, block.start + later) for later in (0, distance))
    problem = f"{block.stop - block.start} samples from {first:.3f} s on are there again"
    text = f"{problem} from {again:.3f} s on: an interval counts them twice; {STRETCH}"
    return (finding("repeats", profile.name, text, effect=effect),)


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
    kept, factor = [], np.uint64(0x9E3779B97F4A7C15)
    for block in arrays.blocks(values.size - _WINDOW + 1, 2**16):
        bits = np.ascontiguousarray(values[block.start : block.stop + _WINDOW - 1]).view(np.uint64)
        first, second = bits[: 1 - _WINDOW], bits[1 : 2 - _WINDOW]
        # Products wrap around, which mixes the bits. Windows whose first two values mix to four
        # leading zeros are kept, one in sixteen.
        state = (first ^ (first >> 32)) * factor + second
        place = np.flatnonzero((state ^ (state >> 29)) * factor < 2**60)
        state = state[place]
        for later in range(2, _WINDOW):
            state = (state ^ (state >> 29)) * factor + bits[place + later]
        kept.append((place + block.start, ((state ^ (state >> 32)) * factor).view(np.int64)))
    places, numbers = map(np.concatenate, zip(*kept, strict=True))
    order = np.argsort(numbers, kind="stable")
    alike = np.flatnonzero(np.diff(numbers[order]) == 0)
    apart = places[order[alike + 1]] - places[order[alike]]
    distances, counts = np.unique(apart[apart >= _LEAST], return_counts=True)
    # Those that most windows are apart are looked at.
    for distance in distances[np.argsort(-counts, kind="stable")[:4]].tolist():
        differ = marks.marked(np.not_equal, values[:-distance], values[distance:])
        same = marks.longest_unmarked(differ)
        # A block that reaches into its repetition is a channel that goes round.
        block = slice(same.start, min(same.stop, same.start + distance))
        length = block.stop - block.start
        # What few steps of a readout make comes about by chance.
        if length < _LEAST or np.unique(values[block]).size < 16:
            continue
        # Beside what was copied, values are alike by chance, and by a dither that comes round.
        beside = slice(max(0, same.start - 2 * length), same.stop + 2 * length)
        if np.sum(~differ[beside]) - (same.stop - same.start) > (4 * length) // 3:
            continue
        if length > longest[0].stop - longest[0].start:
            longest = (block, distance)
    return longest


# ---- dropouts ----------------------------------------------------------------------


def dropout_notes(recording: Recording, profile: Profile) -> Notes:
    """Zeros far more often than the values beside zero; of an angle, zeros that it falls to."""
    values, effect = profile.channel.values, None
    if profile.survey.zeros == 0:
        return ()
    zeros = values == 0.0
    if profile.channel.kind == "angle":
        changes = profile.changes
        usual = arrays.every(changes, arrays.distance_between(100_000, changes.size))
        fall = 50.0 * float(np.median(np.abs(usual)))
        zeros &= marks.marked_steps(values, lambda steps: np.abs(steps) > fall)
        if not (fall and zeros.any()):
            return ()
    else:
        number = marks.number_of(zeros)
        # A gyro that counts coarsely, and turns little, counts 0 most of the time.
        fine = profile.scale > 20.0 * profile.step
        away = abs(float(np.median(profile.level))) > 4.0 * profile.scale
        is_rare = number < LEAST_OFTEN or number <= OFTENER * _beside(values)
        if is_rare or not (fine or away or _is_dead_band(values)):
            return ()
        effect = _effect_of_zeros(values, number)
    problem = seen(recording, zeros, "sample", "of exactly zero")
    problem += ", as if readings were lost (dropouts), or small ones set to zero (a dead band)"
    return (finding("dropouts", profile.name, f"{problem}; {LEAVE_OUT}", effect=effect),)


def _is_dead_band(values: FloatArray) -> bool:
    """Whether values other than zero begin at a distance from it and then scatter.

    Those of a coarse counter are often one count, which may be rounded, and those of one that adds
    up pulses of several counts lie at smaller ones, too.
    """
    size = np.abs(values[values != 0.0])
    least, usual = np.quantile(size, (0.01, 0.5))
    alike = np.count_nonzero(np.abs(size - least) < 1e-3 * least)
    return bool(least > 0.4 * usual and alike < 0.2 * size.size)


def _beside(values: FloatArray) -> int:
    """How often the values next to zero stand there, the more frequent of the two.

    Counts that were subtracted from each other differ by their rounding: within a tenth of the
    first one, or of the scatter if they are far from zero, they are one value.
    """
    above = float(values.min(where=values > 0.0, initial=math.inf))
    below = float(values.max(where=values < 0.0, initial=-math.inf))
    # Lost samples widen a standard deviation, and no median.
    some = arrays.every(values, arrays.distance_between(20_000, values.size))
    scatter = scatter_of(some - np.median(some))
    up, down = above + 0.1 * min(above, scatter), below - 0.1 * min(-below, scatter)
    higher = marks.marked(lambda some: (some > 0.0) & (some <= up), values)
    lower = marks.marked(lambda some: (some < 0.0) & (some >= down), values)
    return max(marks.number_of(higher), marks.number_of(lower))


def _effect_of_zeros(values: FloatArray, zeros: int) -> float | None:
    """Factor on N of zeros that stand in the place of samples here and there.

    They take their share p from the noise, and are white noise of p (1 - p) times the mean square
    of the rest. What that is beside N depends on how far the noise reaches up in frequency: behind
    a low-pass N^2 times the sample rate is more than the variance of the samples.
    """
    left = values.size - zeros
    usual = arrays.mean(values) * values.size / left
    squares = arrays.by_blocks(lambda some: np.square(some[some != 0.0] - usual).sum(), values)
    inside = float(squares.sum()) / left
    if not inside > 0.0:
        return None
    share = zeros / values.size
    slower = _slow_over_fast(values) if share < 0.5 else 1.0
    white = share * (1.0 - share) * (inside + usual * usual)
    return math.sqrt((1.0 - share) ** 2 + white / (slower * inside))


def _slow_over_fast(values: FloatArray) -> float:
    """Noise of means of 64 samples over what it would be if the noise were white.

    Samples that are zero are left out; 1 if there are too few means.
    """
    values = values[:LOOKED_AT]
    rows = values[: values.size // _TOGETHER * _TOGETHER].reshape(-1, _TOGETHER)
    number = np.count_nonzero(rows, axis=1)
    counted_rows = number > _TOGETHER // 2
    if np.count_nonzero(counted_rows) < _FEWEST_MEANS:
        return 1.0
    rows, number = rows[counted_rows], number[counted_rows]
    means = rows.sum(axis=1) / number
    off = np.where(rows == 0.0, 0.0, rows - means[:, np.newaxis])
    inside = float(np.sum(off**2)) / float(np.sum(number - 1))
    between = 0.5 * float(np.mean(np.diff(means) ** 2 / (0.5 / number[1:] + 0.5 / number[:-1])))
    return between / inside if between > 0.0 and inside > 0.0 else 1.0


# ---- interleaved -------------------------------------------------------------------


def interleaved_notes(recording: Recording, profile: Profile) -> Notes:
    """Every second sample, or every third, has a mean or a scatter of its own: an error.

    One sensor has that only of a line at exactly half its sample rate, or a third.
    """
    values, reach = profile.channel.values[:LOOKED_AT], _reach_of_straight(profile)
    if reach and np.mean(_bent(values[:-2], values[1:-1], values[2:]) <= reach) > _MOST_STRAIGHT:
        # About half of the samples or more are means of their neighbours: see `filled_notes`.
        return ()
    # Of four, a line at a quarter of the sample rate (mains at 200 Hz) looks alike.
    for sensors, ordinal in ((2, "second"), (3, "third")):
        if _take_turns(profile, sensors):
            problem = f"{sensors} sensors seem to stand in this column by turns"
            text = f"every {ordinal} sample is of another kind: {problem}"
            text += "; write each into a column of its own"
            return (Note(name="interleaved", level="error", channel=profile.name, text=text),)
    return ()


def _take_turns(profile: Profile, sensors: int) -> bool:
    """Whether samples `sensors` apart are alike and those between are not, all along."""
    changes = profile.changes[:LOOKED_AT]
    if changes.size < 4096:
        return False
    turns = _turns(changes, sensors)
    typical = float(np.median(_scatters(turns)))
    # Counts that hardly scatter differ by what the rounding of their file makes.
    if not typical > max(profile.rounding, _ROUNDING * profile.scale):
        return False
    # Motion is taken off by the mean of each round, and single samples far off shift no mean.
    off = turns - turns.mean(axis=2, keepdims=True)
    middle = np.median(off, axis=1)
    reach = 5.0 * typical
    means = middle + np.clip(off - middle[:, np.newaxis], -reach, reach).mean(axis=1)
    # Half a scatter, and eight standard errors.
    least = max(8.0 * typical / math.sqrt(turns.shape[1]), 0.5 * typical)
    # The same one in every part, on the same side.
    if (np.all(means > least, axis=0) | np.all(means < -least, axis=0)).any():
        return True
    # Some turns see more of a line at a part of the sample rate: the noise between lines tells.
    white = profile.white
    if not white.innovation > profile.rounding:
        return False
    scatters = _scatters(_turns(white.values, sensors))
    order = np.argsort(scatters, axis=1)
    louder = scatters.max(axis=1) > 1.3 * scatters.min(axis=1)
    return bool(louder.all() and (order == order[0]).all())


def _turns(values: FloatArray, sensors: int) -> FloatArray:
    """(parts, rounds, sensors) of four parts, all of which have to show it."""
    length = values.size // 4 // sensors
    return values[: 4 * length * sensors].reshape(4, length, sensors)


def _scatters(turns: FloatArray) -> FloatArray:
    """(parts, sensors) by the median of the steps from each sample to the next of its own turn."""
    # Median of the size of the difference of two standard normal numbers.
    return np.asarray(np.median(np.abs(np.diff(turns, axis=1)), axis=1) / 0.9539)
