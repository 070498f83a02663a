"""A recording: gyro channels, the table encoder, sample times, and where they came from."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.units import DEGREE, DEGREE_PER_HOUR

FloatArray = NDArray[np.float64]
Kind = Literal["angle", "increment", "rate"]
Level = Literal["error", "warning", "note"]

MINIMUM_SAMPLES: Final = 16

# An interval longer than this many nominal steps is a gap: an error. Recorders that stamp on
# arrival, on a clock of 1 ms, repeat a stamp now and then and follow it with one of two steps,
# and a busy host holds a few samples back (stamps up to 4.4 steps apart at 100 Hz are known
# from sound recordings); from more than four samples missing, the angle turned meanwhile is a
# guess. Shorter ones are a note.
GAP_STEPS: Final = 5.0
LATE_STEPS: Final = 1.5
# Gaps that would hold this many times the samples there are belong to no one recording.
LARGEST_GAPS: Final = 9

# A run of one value is a stuck channel when it is this long, and this many times longer than
# the tenth longest. A quantized quiet gyro repeats itself for long, but then it does so all
# over the record (ten runs of noise differ by less than a factor of two or three in length),
# while a channel that sticks does so once or a few times. Of a channel that repeats itself nine
# times out of ten anyway nothing can be said: an angle read out coarsely is a random walk over
# its steps, and the stays of a walk have no typical length.
STUCK_SAMPLES: Final = 100
STUCK_RATIO: Final = 10.0
STUCK_RANK: Final = 10
STUCK_REPEATS: Final = 0.9

# No gyro turns at 5000 deg/s for long, and none is stable to 1e-6 deg/h from sample to sample.
FASTEST_RATE: Final = 5000.0 * DEGREE
SLOWEST_RATE: Final = 1e-6 * DEGREE_PER_HOUR

# A gyro senses at most the whole of the table's rate; a tenth is left for its scale factor.
LARGEST_SHARE: Final = 1.1
# Missing encoder samples are interpolated up to so many in a row: as with time stamps, from there
# on the angle turned meanwhile is a guess. With more than this share missing the gaps come close
# to one another, and it is no recording but what is left of one.
MOST_MISSING_IN_A_ROW: Final = int(GAP_STEPS) - 1
LARGEST_SHARE_MISSING: Final = 0.01
# An encoder jumps when it moves by this much from one sample to the next, this many times as far as
# it usually does, and the gyro moves less than half of that in so many samples around: no table
# leaves its gyros behind, but the two may be sampled some samples apart.
LEAST_JUMP: Final = 1.0 * DEGREE
JUMP_RATIO: Final = 10.0
JUMP_REACH: Final = 2
LEAST_SHARE: Final = 0.05
# A gyro is said to turn above this rate: more than the bias of any gyro on a rate table, but
# for a MEMS gyro as it comes from the factory.
TURNING_RATE: Final = 2.0 * DEGREE


class RecordingError(ValueError):
    """Something is wrong in the data: one line with the file, the channel and the remedy."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """One measured column.

    Attributes
    ----------
    name
        As the user calls it: ``x``, ``y``, ``z``, ``table``.
    kind
        What one sample is. ``angle``: accumulated angle at the sample time.
        ``increment``: angle turned since the sample before. ``rate``: mean rate over
        the sample interval.
    unit
        Unit the source stated, for the report; `values` are SI already.
    values
        (samples,), rad for ``angle`` and ``increment``, rad/s for ``rate``. Counters
        and 360 degree encoders are unwrapped.
    """

    name: str
    kind: Kind
    unit: str
    values: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """Where a recording came from: path, SHA-256 of the file, format, span taken.

    The span is in s from the first sample of the file, as ``--slice`` takes it.
    """

    path: str
    sha256: str
    format: str
    span_s: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """Gyros and table encoder sampled together.

    Attributes
    ----------
    gyros
        One or more gyro channels, all of one length.
    sample_rate
        Nominal samples per second.
    times
        (samples,) sample times in s from the first sample, or None where sampling is
        uniform.
    table
        Table angle from the encoder, unwrapped (kind ``angle``), or None at rest.
    null_pulse
        (samples,) bool, true on the first sample at or after the null pulse, or None.
    provenance
        None for a recording that never was a file.
    notes
        Everything noticed while reading, in words.
    """

    gyros: tuple[Channel, ...]
    sample_rate: float
    times: FloatArray | None = None
    table: Channel | None = None
    null_pulse: NDArray[np.bool_] | None = None
    provenance: Provenance | None = None
    notes: tuple[str, ...] = ()

    @property
    def samples(self) -> int:
        """Number of samples."""
        return int(self.gyros[0].values.size)

    @property
    def duration(self) -> float:
        """Time covered, s: samples over sample rate, or the span of the time stamps."""
        if self.times is not None:
            return float(self.times[-1] - self.times[0]) + 1.0 / self.sample_rate
        return self.samples / self.sample_rate

    def gyro(self, name: str) -> Channel:
        """The gyro called `name`.

        Raises
        ------
        RecordingError
            If there is none; the message lists those there are.
        """
        for channel in self.gyros:
            if channel.name == name:
                return channel
        present = ", ".join(channel.name for channel in self.gyros)
        where = self.provenance.path if self.provenance else "recording"
        raise RecordingError(f"{where}: no gyro {name!r}; it has {present} (--gyros, --columns)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing noticed about the data, with its remedy where there is one.

    Attributes
    ----------
    level
        ``error``: no figure can rest on this. ``warning``: looks wrong. ``note``: to know.
    channel
        Gyro name, ``table``, ``time``, or empty where it is about the whole.
    message
        One line.
    """

    level: Level
    channel: str
    message: str


def angle_of(channel: Channel, sample_rate: float) -> FloatArray:
    """Accumulated angle of a channel, rad, shape (samples,).

    Increments and rates are summed after their mean is taken off and put back as a
    ramp, so that a large constant rate costs no precision in the noise.
    """
    if channel.kind == "angle":
        return channel.values
    values = channel.values
    per_step = 1.0 if channel.kind == "increment" else sample_rate
    mean = series.mean(values) / per_step
    angle = series.empty(values.size)
    turned = 0.0
    for span in series.through(values.size, values, angle):
        steps = values[span] / per_step
        steps -= mean
        steps[0] += turned
        np.cumsum(steps, out=angle[span])
        turned = float(angle[span.stop - 1])
        angle[span] += mean * np.arange(span.start + 1, span.stop + 1)
    return angle


def unwrapped(values: FloatArray, period: float) -> tuple[FloatArray, int]:
    """A reading that starts over at `period`, made continuous.

    Of two samples less than half a period apart either way is taken to be the shorter
    one, so the direction may be either and may change.

    Parameters
    ----------
    values
        (samples,) readings; samples that are not finite are passed over.
    period
        Reading at which the counter starts over, in the unit of `values`.

    Returns
    -------
    values
        (samples,), a new array where anything was unwrapped, else the one given.
    wraps
        How often the reading started over.
    """

    def periods(span: slice) -> FloatArray:
        """Whole periods between each sample of a span and the next."""
        result = np.diff(values[span.start : span.stop + 1])
        result /= period
        np.rint(result, out=result)
        result[~np.isfinite(result)] = 0.0
        return result

    steps = values.size - 1
    if not any(periods(span).any() for span in series.through(steps, values)):
        return values, 0
    result = series.empty(values.size)
    result[0] = values[0]
    wraps, total = 0, 0.0
    for span in series.through(steps, values, result):
        over = periods(span)
        wraps += int(np.count_nonzero(over))
        # Sums of integers, so nothing is lost.
        over[0] += total
        np.cumsum(over, out=over)
        total = float(over[-1])
        over *= period
        later = slice(span.start + 1, span.stop + 1)
        np.subtract(values[later], over, out=result[later])
    return result, wraps


def median_step(times: FloatArray, *, repeats: bool = True) -> float:
    """Median interval of time stamps, of those that are finite and do not run backwards.

    Parameters
    ----------
    times
        (samples,) s.
    repeats
        Whether stamps that repeat the one before count.

    Returns
    -------
    s, or NaN where there is no such interval.
    """

    def usable(span: slice) -> FloatArray:
        steps = np.diff(times[span.start : span.stop + 1])
        return steps[np.isfinite(steps) & ((steps >= 0.0) if repeats else (steps > 0.0))]

    size = max(times.size - 1, 0)
    if not series.is_mapped(times):
        steps = usable(slice(0, size))
        return float(np.median(steps)) if steps.size else math.nan

    def ranked(rank: int) -> float:
        # Floats that are not negative are ordered as the integers of the same bits; those are
        # found sixteen at a time, by counting.
        found = 0
        for shift in (48, 32, 16, 0):
            counts = np.zeros(2**16, dtype=np.int64)
            for span in series.through(size, times):
                bits = usable(span).view(np.int64)
                bits = bits[bits >> (shift + 16) == found] if shift < 48 else bits
                counts += np.bincount((bits >> shift) & 0xFFFF, minlength=2**16)
            until = np.cumsum(counts)
            digit = int(np.searchsorted(until, rank, side="right"))
            rank -= int(until[digit] - counts[digit])
            found = found << 16 | digit
        return float(np.int64(found).view(np.float64))

    number = sum(usable(span).size for span in series.through(size, times))
    if number == 0:
        return math.nan
    return float(np.mean([ranked((number - 1) // 2), ranked(number // 2)]))


def integrity(recording: Recording) -> tuple[Finding, ...]:
    """What has to hold before any figure can rest on the data; errors come first.

    Enough samples, all finite, time that runs forwards without gaps, no stuck gyro. A
    table may stand still, so a constant encoder is judged against the gyro, by
    `require_encoder_follows`.

    Returns
    -------
    findings
        Times in the messages are s from the first sample of the file, as ``--slice``
        takes them.
    """
    findings: list[Finding] = []
    if recording.samples < MINIMUM_SAMPLES:
        return (
            Finding(
                level="error",
                channel="",
                message=f"{recording.samples} samples are too few, at least {MINIMUM_SAMPLES} are "
                "needed; give a longer file or a wider --slice",
            ),
        )
    channels = [*recording.gyros, *([recording.table] if recording.table else [])]
    for channel in channels:
        findings += _not_finite(recording, channel.name, channel.values)
    if recording.times is not None:
        findings += _time_findings(recording, recording.times)
    for gyro in recording.gyros:
        findings += _stuck(recording, gyro)
    order = {"error": 0, "warning": 1, "note": 2}
    return tuple(sorted(findings, key=lambda finding: order[finding.level]))


def with_gaps_marked(recording: Recording) -> Recording:
    """The gyros at even times, NaN where a sample is missing; table and null pulse left out.

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
        If anything but gaps is wrong: infinite samples, stamps that run backwards, a stuck
        gyro, or gaps that hold far more samples than there are.
    """
    where = recording.provenance.path if recording.provenance else "recording"
    recording = replace(recording, table=None, null_pulse=None)
    findings: list[Finding] = []
    for gyro in recording.gyros:
        infinite, first = _tally(_places(gyro.values, np.isinf))
        if infinite:
            raise RecordingError(
                f"{where}: {gyro.name}: {counted(infinite, 'sample')} infinite, the first "
                f"at {_second(recording, first):.3f} s; mark bad samples as NaN"
            )
        findings += _stuck(recording, gyro)
    times = recording.times
    if times is not None:
        findings += _time_findings(recording, times, omit_gaps=True)
    notes = list(recording.notes)
    for finding in sorted(findings, key=lambda finding: finding.level != "error"):
        message = f"{finding.channel}: {finding.message}"
        if finding.level == "error":
            raise RecordingError(f"{where}: {message}")
        notes.append(message)
    if times is None or times.size < 2:
        return replace(recording, notes=tuple(notes))

    longest = GAP_STEPS * median_step(times)

    def jumps() -> Iterator[NDArray[np.int64]]:
        return _places(times, lambda values: np.diff(values) > longest, following=1)

    gaps, first = _tally(jumps())
    if gaps == 0:
        return replace(recording, notes=tuple(notes))
    between = 0.0
    for span in series.through(times.size - 1, times):
        steps = np.diff(times[span.start : span.stop + 1])
        between += float(steps[steps <= longest].sum())
    sample_rate = (times.size - 1 - gaps) / between

    def advances(span: slice) -> FloatArray:
        """Samples from each stamp of a span to the next."""
        steps = np.diff(times[span.start : span.stop + 1])
        return np.where(steps > longest, np.rint(steps * sample_rate), 1.0)

    samples = 1 + int(sum(advances(s).sum() for s in series.through(times.size - 1, times)))
    missing = samples - times.size
    if missing > LARGEST_GAPS * times.size:
        raise RecordingError(
            f"{where}: time: its {counted(gaps, 'gap')} would hold {missing} samples and there "
            f"are {times.size}; {_longest_stretch(recording, (places + 1 for places in jumps()))}"
        )
    notes.append(
        f"time: {counted(gaps, 'gap')}, {counted(missing, 'sample')} missing, the first at "
        f"{_second(recording, first):.3f} s; {sample_rate:.9g} Hz between"
    )
    gyros = [replace(gyro, values=series.empty(samples)) for gyro in recording.gyros]
    for marked, gyro in zip(gyros, recording.gyros, strict=True):
        for span in series.through(samples, marked.values):
            marked.values[span] = np.nan
        marked.values[0] = gyro.values[0]
        place = 0.0
        for span in series.through(times.size - 1, times, gyro.values, marked.values):
            places = place + np.cumsum(advances(span))
            place = float(places[-1])
            marked.values[places.astype(np.intp)] = gyro.values[span.start + 1 : span.stop + 1]
    return replace(
        recording, gyros=tuple(gyros), sample_rate=sample_rate, times=None, notes=tuple(notes)
    )


def longest_whole_stretch(recording: Recording, name: str) -> tuple[Recording, float]:
    """The longest stretch of one gyro without a missing sample.

    Returns
    -------
    recording
        Of that gyro alone, possibly of no sample.
    start
        Of the stretch, s from the first sample of the file.
    """
    gyro = recording.gyro(name)
    first, last = _longest_between(gyro.values.size, _places(gyro.values, _is_not_finite))
    times = recording.times
    if times is not None:
        times = series.less(times[first:last], times[first]) if last > first else None
    stretch = replace(
        recording, gyros=(replace(gyro, values=gyro.values[first:last]),), times=times
    )
    return stretch, _second(recording, first) if last > first else 0.0


def check(recording: Recording) -> tuple[Finding, ...]:
    """Everything that can be said about the quality of the data; errors come first.

    Besides `integrity`: jumps, saturation, units that look wrong, and an encoder that the
    gyros do not follow. The latter are looked at only where the former found no error.
    """
    findings = list(integrity(recording))
    if any(finding.level == "error" for finding in findings):
        return tuple(findings)
    for gyro in recording.gyros:
        findings += _rate_findings(recording, gyro)
        findings += _jumps(recording, gyro)
        findings += _saturation(recording, gyro)
        findings += _table_findings(recording, gyro)
    if recording.table is not None:
        findings += _jumps(recording, recording.table)
        lowest, highest = series.extent(recording.table.values)
        turned = (highest - lowest) / (2.0 * math.pi)
        findings.append(
            Finding(level="note", channel="table", message=f"covers {turned:.2f} turns")
        )
    order = {"error": 0, "warning": 1, "note": 2}
    return tuple(sorted(findings, key=lambda finding: order[finding.level]))


def require_encoder_follows(recording: Recording, gyro: Channel) -> None:
    """Refuse an encoder whose motion is not the gyro's.

    The record is cut into blocks of at least 1 s and the share of the table rate that the
    gyro senses is taken as the median over the blocks in which the table turns. A block
    disagrees when gyro rate minus share times table rate exceeds the larger of 2 deg/s and
    a fifth of the rate sensed at the table's usual rate. One block in a hundred may (a
    start, a stop, a stamp that came late); more is an error. So a gyro across the axis,
    whose share is about zero, follows any encoder as long as it does not turn itself, and
    turning below 2 deg/s decides nothing. A share beyond 1.1 is an error too: no gyro
    turns faster than its table.

    Raises
    ------
    RecordingError
        If the two do not belong together.
    """
    finding = _encoder_finding(recording, gyro)
    if finding is not None:
        where = recording.provenance.path if recording.provenance else "recording"
        raise RecordingError(f"{where}: {finding.channel}: {finding.message}")


def _second(recording: Recording, index: int) -> float:
    """When sample `index` was taken, s from the first sample of the file."""
    provenance = recording.provenance
    offset = provenance.span_s[0] if provenance and provenance.span_s else 0.0
    if recording.times is not None and math.isfinite(recording.times[index]):
        return offset + float(recording.times[index])
    return offset + index / recording.sample_rate


def counted(count: int, noun: str) -> str:
    """``1 sample``, ``2 samples``."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _places(
    values: FloatArray, test: Callable[[FloatArray], NDArray[np.bool_]], *, following: int = 0
) -> Iterator[NDArray[np.int64]]:
    """Where `test` holds, span by span, ascending.

    It is given the values of a span, and of so many samples `following` it.
    """
    for span in series.through(values.size - following, values):
        yield span.start + np.flatnonzero(test(values[span.start : span.stop + following]))


def _is_not_finite(values: FloatArray) -> NDArray[np.bool_]:
    return ~np.isfinite(values)


def _tally(places: Iterable[NDArray[np.int64]]) -> tuple[int, int]:
    """How many there are, and the first; -1 where there is none."""
    count, first = 0, -1
    for some in places:
        if count == 0 and some.size:
            first = int(some[0])
        count += some.size
    return count, first


def _longest_between(samples: int, cuts: Iterable[NDArray[np.int64]]) -> tuple[int, int]:
    """First sample, and the one after the last, of the longest stretch between `cuts`."""
    first, last, edge = 0, -1, -1
    for places in chain(cuts, (np.array([samples]),)):
        edges = np.concatenate(([edge], places))
        lengths = np.diff(edges) - 1
        longest = int(np.argmax(lengths)) if lengths.size else 0
        if lengths.size and lengths[longest] > last - first:
            first, last = int(edges[longest]) + 1, int(edges[longest + 1])
        edge = int(edges[-1])
    return first, last


def _longest_stretch(recording: Recording, cuts: Iterable[NDArray[np.int64]]) -> str:
    """``--slice START:STOP`` for the longest stretch of samples between those at `cuts`.

    Rounded inwards to ms, so that the stretch it names holds none of them.
    """
    first, after = _longest_between(recording.samples, cuts)
    last = after - 1
    if last - first + 1 < MINIMUM_SAMPLES:
        return "get the file again from its source"
    start = 0.0 if first == 0 else math.ceil(_second(recording, first) * 1e3) / 1e3
    stop = "" if last == recording.samples - 1 else f"{_second(recording, last):.3f}"
    return f"take the sound stretch with --slice {start:g}:{stop}"


def _not_finite(recording: Recording, name: str, values: FloatArray) -> list[Finding]:
    bad, first = _tally(_places(values, _is_not_finite))
    if bad == 0:
        return []
    # Reading has interpolated what it could of a table.
    beyond = (
        f", more than can be interpolated ({MOST_MISSING_IN_A_ROW} in a row, "
        f"{100.0 * LARGEST_SHARE_MISSING:g} % of all)"
        if name == "table"
        else ""
    )
    return [
        Finding(
            level="error",
            channel=name,
            message=f"{counted(bad, 'sample')} NaN or infinite{beyond}, the first at "
            f"{_second(recording, first):.3f} s; "
            f"{_longest_stretch(recording, _places(values, _is_not_finite))}",
        )
    ]


def _time_findings(
    recording: Recording, times: FloatArray, *, omit_gaps: bool = False
) -> list[Finding]:
    not_finite = _not_finite(recording, "time", times)
    if not_finite:
        return not_finite
    backwards, first = _tally(_places(times, lambda some: np.diff(some) < 0.0, following=1))
    if backwards:
        return [
            Finding(
                level="error",
                channel="time",
                message=f"runs backwards {counted(backwards, 'time')}, first at "
                f"{_second(recording, first):.3f} s; correct the stamps, or state "
                "--time none with --rate",
            )
        ]
    nominal = median_step(times)
    if nominal <= 0.0:
        return [
            Finding(
                level="error",
                channel="time",
                message="most stamps repeat the one before: the clock is too coarse; state "
                "--time none with --rate",
            )
        ]
    longest = GAP_STEPS * nominal

    def jumps() -> Iterator[NDArray[np.int64]]:
        return _places(times, lambda some: np.diff(some) > longest, following=1)

    gaps, first = _tally(jumps())
    if gaps and not omit_gaps:
        return [
            Finding(
                level="error",
                channel="time",
                message=f"has {counted(gaps, 'gap')} of more than {GAP_STEPS:g} steps of "
                f"{nominal:.6g} s, the first of {times[first + 1] - times[first]:.6g} s at "
                f"{_second(recording, first):.3f} s; "
                f"{_longest_stretch(recording, (places + 1 for places in jumps()))}",
            )
        ]
    findings: list[Finding] = []
    repeated, late, latest = 0, 0, 0.0
    for span in series.through(times.size - 1, times):
        steps = np.diff(times[span.start : span.stop + 1])
        repeated += int(np.count_nonzero(steps == 0.0))
        slow = steps[(steps > LATE_STEPS * nominal) & (steps <= longest)]
        late += slow.size
        latest = max(latest, float(slow.max(initial=0.0)))
    if repeated:
        findings.append(
            Finding(
                level="note",
                channel="time",
                message=counted(repeated, "repeated stamp"),
            )
        )
    if late:
        findings.append(
            Finding(
                level="note",
                channel="time",
                message=f"{counted(late, 'interval')} longer than {LATE_STEPS:g} "
                f"steps of {nominal:.6g} s, the longest {latest:.6g} s",
            )
        )
    return findings


def _stuck(recording: Recording, gyro: Channel) -> list[Finding]:
    # A run that long shows in samples half as far apart; most gyros never repeat and are done.
    samples = gyro.values.size
    sparse = series.every(gyro.values, STUCK_SAMPLES // 2)
    if not (sparse[1:] == sparse[:-1]).any() and sparse.size > 1:
        return []
    changes = _places(gyro.values, lambda some: some[1:] != some[:-1], following=1)
    first, length, number, edge = 0, 0, 0, -1
    longest = np.empty(0, dtype=np.int64)
    for places in chain(changes, (np.array([samples - 1]),)):
        edges = np.concatenate(([edge], places))
        edge = int(edges[-1])
        runs = np.diff(edges)
        number += runs.size
        if runs.size and runs.max() > length:
            at = int(np.argmax(runs))
            first, length = int(edges[at]) + 1, int(runs[at])
        longest = np.concatenate((longest, runs))
        if longest.size > STUCK_RANK:
            longest = np.partition(longest, longest.size - STUCK_RANK)[-STUCK_RANK:]
    usual = float(longest.min()) if number >= STUCK_RANK else 0.0
    whole = length == samples
    # Share of repeats among the samples outside the longest run.
    repeats = 1.0 if whole else 1.0 - (number - 1) / (samples - length)
    if not whole and (
        length < STUCK_SAMPLES or length <= STUCK_RATIO * usual or repeats > STUCK_REPEATS
    ):
        return []
    if whole:
        return [
            Finding(
                level="error",
                channel=gyro.name,
                message="is stuck: every sample is the same; name another channel with --gyros "
                "or --columns",
            )
        ]
    stuck = (first + np.arange(span.start, span.stop) for span in series.spans(length))
    return [
        Finding(
            level="error",
            channel=gyro.name,
            message=f"is stuck at one value for {length} samples from "
            f"{_second(recording, first):.3f} s; "
            f"{_longest_stretch(recording, stuck)}",
        )
    ]


def _block_angles(channel: Channel, sample_rate: float, edges: NDArray[np.intp]) -> FloatArray:
    """Angle turned from each edge to the next, rad, shape (edges - 1,)."""
    if channel.kind == "angle":
        return np.diff(series.at(channel.values, edges))
    sums = np.empty(edges.size - 1)
    for blocks in series.spans(sums.size, max(1, series.SPAN * sums.size // edges[-1])):
        inside = edges[blocks.start : blocks.stop + 1]
        # reduceat runs its last sum to the end of what it is given: the last edge included.
        values = channel.values[inside[0] + 1 : inside[-1] + 1]
        sums[blocks] = np.add.reduceat(values, inside[:-1] - inside[0])
        series.release(values)
    return sums if channel.kind == "increment" else sums / sample_rate


def _block_rates(recording: Recording, channel: Channel) -> tuple[FloatArray, NDArray[np.intp]]:
    """Mean rate over blocks of about a second, rad/s, and the samples they start at."""
    samples = recording.samples
    second = max(1, round(recording.sample_rate))
    blocks = max(min(samples // second, 4096), min(samples - 1, 20))
    edges = np.linspace(0, samples - 1, blocks + 1).astype(np.intp)
    seconds = np.diff(edges) / recording.sample_rate
    return _block_angles(channel, recording.sample_rate, edges) / seconds, edges[:-1]


def _share(gyro_rate: FloatArray, table_rate: FloatArray) -> float:
    """Share of the table rate that the gyro senses; NaN where the table does not turn."""
    usual = float(np.percentile(np.abs(table_rate), 90.0))
    turning = np.abs(table_rate) > max(0.2 * usual, 0.05 * DEGREE)
    if not turning.any():
        return math.nan
    return float(np.median(gyro_rate[turning] / table_rate[turning]))


def _encoder_finding(recording: Recording, gyro: Channel) -> Finding | None:
    if recording.table is None:
        return None
    gyro_rate, starts = _block_rates(recording, gyro)
    table_rate, _ = _block_rates(recording, recording.table)
    share = _share(gyro_rate, table_rate)
    usual = float(np.percentile(np.abs(table_rate), 90.0))
    if math.isnan(share):
        share = 0.0
    limit = max(TURNING_RATE, 0.2 * abs(share) * usual)
    disagree = np.flatnonzero(np.abs(gyro_rate - share * table_rate) > limit)
    if disagree.size > max(2.0, 0.01 * gyro_rate.size):
        at = _second(recording, int(starts[disagree[0]]))
        first = disagree[0]
        return Finding(
            level="error",
            channel="table",
            message=f"the encoder does not follow gyro {gyro.name} in "
            f"{100.0 * disagree.size / gyro_rate.size:.0f} % of the record, first at {at:.1f} s "
            f"(gyro {gyro_rate[first] / DEGREE:.3g} deg/s, encoder "
            f"{table_rate[first] / DEGREE:.3g} deg/s); name the right column and unit with "
            "--table, or take a sound stretch with --slice",
        )
    if abs(share) > LARGEST_SHARE:
        return Finding(
            level="error",
            channel=gyro.name,
            message=f"turns {share:.3g} times as fast as the table: a unit or kind is wrong; "
            "state --unit and --kind, or the table's with --table COLUMN:UNIT",
        )
    return _unfollowed_jump(recording, recording.table, gyro, share)


def _unfollowed_jump(
    recording: Recording, table: Channel, gyro: Channel, share: float
) -> Finding | None:
    """A jump of the encoder that the gyro does not make; None where it senses too little."""
    if abs(share) < LEAST_SHARE:
        return None
    angle, values = table.values, gyro.values
    sample = np.arange(0, angle.size - 1, max(1, (angle.size - 1) // 100_000))
    steps = np.abs(series.at(angle, sample + 1) - series.at(angle, sample))
    limit = max(LEAST_JUMP, JUMP_RATIO * float(np.quantile(steps, 0.99)))
    found = _places(angle, lambda some: np.abs(np.diff(some)) > limit, following=1)
    jumps = np.concatenate([np.empty(0, dtype=np.int64), *found])
    if jumps.size == 0:
        return None
    jump = series.at(angle, jumps + 1) - series.at(angle, jumps)
    # Step n leads from sample n to the next.
    first = np.maximum(jumps - JUMP_REACH, 0)
    last = np.minimum(jumps + 1 + JUMP_REACH, values.size - 1)
    if gyro.kind == "angle":
        turned = series.at(values, last) - series.at(values, first)
    else:
        around = [first + number for number in range(1, 2 * JUMP_REACH + 2)]
        turned = sum(series.at(values, np.minimum(some, last)) * (some <= last) for some in around)
        turned = turned / (recording.sample_rate if gyro.kind == "rate" else 1.0)
    alone = np.flatnonzero(np.abs(turned) < 0.5 * np.abs(share * jump))
    if alone.size == 0:
        return None
    at = jumps[alone]
    return Finding(
        level="error",
        channel="table",
        message=f"{counted(alone.size, 'jump')} that gyro {gyro.name} does not make, the first by "
        f"{jump[alone[0]] / DEGREE:.3g} deg at {_second(recording, int(at[0]) + 1):.3f} s; "
        f"{_longest_stretch(recording, (at + 1,))}",
    )


def _table_findings(recording: Recording, gyro: Channel) -> list[Finding]:
    if recording.table is None:
        return []
    finding = _encoder_finding(recording, gyro)
    if finding is not None:
        return [finding]
    gyro_rate, _ = _block_rates(recording, gyro)
    table_rate, _ = _block_rates(recording, recording.table)
    share = _share(gyro_rate, table_rate)
    if math.isnan(share):
        return [Finding(level="note", channel="table", message="the table does not turn")]
    if abs(share) < 0.01 and float(np.percentile(np.abs(table_rate), 90.0)) > TURNING_RATE:
        return [
            Finding(
                level="warning",
                channel=gyro.name,
                message=f"senses {100.0 * share:.2g} % of the table rate: it is mounted across "
                "the axis, or its unit or kind is wrong (--unit, --kind)",
            )
        ]
    return [
        Finding(level="note", channel=gyro.name, message=f"senses {share:.4f} of the table rate")
    ]


def _rate_findings(recording: Recording, gyro: Channel) -> list[Finding]:
    rates, _ = _block_rates(recording, gyro)
    typical = float(np.median(np.abs(rates)))
    scatter = float(np.sqrt(np.mean(np.square(np.diff(rates))))) if rates.size > 1 else typical
    if typical > FASTEST_RATE:
        return [
            Finding(
                level="warning",
                channel=gyro.name,
                message=f"turns at {typical / DEGREE:.3g} deg/s: the unit, kind or rate looks "
                "wrong (--unit, --kind, --rate)",
            )
        ]
    if scatter < SLOWEST_RATE:
        return [
            Finding(
                level="warning",
                channel=gyro.name,
                message=f"scatters by only {scatter / DEGREE_PER_HOUR:.2g} deg/h from second to "
                "second: the unit or kind looks wrong (--unit, --kind)",
            )
        ]
    return []


def _jumps(recording: Recording, channel: Channel) -> list[Finding]:
    """Single steps far outside the rest: 20 times the 99 % quantile, 50 sigma of noise."""
    values = channel.values
    sample = np.arange(0, values.size - 1, max(1, (values.size - 1) // 100_000))
    steps = series.at(values, sample + 1) - series.at(values, sample)
    middle = float(np.median(steps))
    limit = 20.0 * float(np.quantile(np.abs(steps - middle), 0.99))

    def jumps() -> Iterator[NDArray[np.int64]]:
        return _places(values, lambda some: np.abs(np.diff(some) - middle) > limit, following=1)

    number, first = _tally(jumps()) if limit > 0.0 else (0, -1)
    if number == 0:
        return []
    return [
        Finding(
            level="warning",
            channel=channel.name,
            message=f"{counted(number, 'jump')} of over 20 times the usual step, the first at "
            f"{_second(recording, first + 1):.3f} s; "
            f"{_longest_stretch(recording, (places + 1 for places in jumps()))}",
        )
    ]


def _saturation(recording: Recording, gyro: Channel) -> list[Finding]:
    """An extreme value taken far oftener than the next one inwards, as noise never does."""
    if gyro.kind == "angle":
        return []
    values = gyro.values
    # Few levels say nothing: a quiet gyro may count only 0 and 1.
    if np.unique(series.every(values, max(1, values.size // 10_000))).size <= 8:
        return []
    findings: list[Finding] = []
    lowest, highest = series.extent(values)
    for limit, sign, side in ((highest, 1.0, "upper"), (lowest, -1.0, "lower")):
        count, first = _tally(_places(values, partial(np.equal, limit)))
        if count < 10:
            continue
        inner = -math.inf
        for span in series.through(values.size, values):
            inside = values[span][values[span] != limit]
            inner = max(inner, float((sign * inside).max(initial=-math.inf)))
        following, _ = _tally(_places(values, partial(np.equal, sign * inner)))
        if count > 3 * following:
            findings.append(
                Finding(
                    level="warning",
                    channel=gyro.name,
                    message=f"is saturated: {count} samples are at its {side} limit, the first at "
                    f"{_second(recording, first):.3f} s; take a stretch without with --slice",
                )
            )
    return findings
