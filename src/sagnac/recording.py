"""A recording: gyro channels, the table encoder, sample times, and where they came from."""

import math
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

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
    step = channel.values if channel.kind == "increment" else channel.values / sample_rate
    mean = float(step.mean())
    return np.cumsum(step - mean) + mean * np.arange(1, step.size + 1)


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
    turns = np.diff(values)
    turns /= period
    np.rint(turns, out=turns)
    at = np.flatnonzero(turns)
    at = at[np.isfinite(turns[at])]
    if at.size == 0:
        return values, 0
    # Whole periods between one wrap and the next: sums of integers, so nothing is lost.
    lengths = np.diff(np.append(at + 1, values.size))
    offset = np.repeat(np.cumsum(turns[at]) * period, lengths)
    result = values.copy()
    result[at[0] + 1 :] -= offset
    return result, int(at.size)


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
        infinite = np.flatnonzero(np.isinf(gyro.values))
        if infinite.size:
            raise RecordingError(
                f"{where}: {gyro.name}: {_counted(infinite.size, 'sample')} infinite, the first "
                f"at {_second(recording, int(infinite[0])):.3f} s; mark bad samples as NaN"
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

    steps = np.diff(times)
    jumps = steps > GAP_STEPS * np.median(steps)
    if not jumps.any():
        return replace(recording, notes=tuple(notes))
    sample_rate = float(np.count_nonzero(~jumps) / steps[~jumps].sum())
    places = np.concatenate(([0.0], np.cumsum(np.where(jumps, np.rint(steps * sample_rate), 1.0))))
    samples = int(places[-1]) + 1
    missing = samples - times.size
    if missing > LARGEST_GAPS * times.size:
        raise RecordingError(
            f"{where}: time: its {_counted(int(jumps.sum()), 'gap')} would hold {missing} samples "
            f"and there are {times.size}; {_longest_stretch(recording, np.flatnonzero(jumps) + 1)}"
        )
    notes.append(
        f"time: {_counted(int(jumps.sum()), 'gap')}, {_counted(missing, 'sample')} missing, the "
        f"first at {_second(recording, int(np.argmax(jumps))):.3f} s; {sample_rate:.9g} Hz between"
    )
    gyros = []
    for gyro in recording.gyros:
        values = np.full(samples, np.nan)
        values[places.astype(np.intp)] = gyro.values
        gyros.append(replace(gyro, values=values))
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
    edges = np.concatenate(([-1], np.flatnonzero(~np.isfinite(gyro.values)), [gyro.values.size]))
    longest = int(np.argmax(np.diff(edges)))
    first, last = int(edges[longest]) + 1, int(edges[longest + 1])
    times = recording.times
    if times is not None:
        times = times[first:last] - times[first] if last > first else None
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
        turned = float(np.ptp(recording.table.values)) / (2.0 * math.pi)
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


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _longest_stretch(recording: Recording, cuts: NDArray[np.intp]) -> str:
    """``--slice START:STOP`` for the longest stretch of samples between those at `cuts`.

    Rounded inwards to ms, so that the stretch it names holds none of them.
    """
    edges = np.concatenate(([-1], cuts, [recording.samples]))
    longest = int(np.argmax(np.diff(edges)))
    first, last = int(edges[longest]) + 1, int(edges[longest + 1]) - 1
    if last - first + 1 < MINIMUM_SAMPLES:
        return "get the file again from its source"
    start = 0.0 if first == 0 else math.ceil(_second(recording, first) * 1e3) / 1e3
    stop = "" if last == recording.samples - 1 else f"{_second(recording, last):.3f}"
    return f"take the sound stretch with --slice {start:g}:{stop}"


def _not_finite(recording: Recording, name: str, values: FloatArray) -> list[Finding]:
    finite = np.isfinite(values)
    if finite.all():
        return []
    bad = np.flatnonzero(~finite)
    return [
        Finding(
            level="error",
            channel=name,
            message=f"{_counted(bad.size, 'sample')} NaN or infinite, the first at "
            f"{_second(recording, int(bad[0])):.3f} s; {_longest_stretch(recording, bad)}",
        )
    ]


def _time_findings(
    recording: Recording, times: FloatArray, *, omit_gaps: bool = False
) -> list[Finding]:
    not_finite = _not_finite(recording, "time", times)
    if not_finite:
        return not_finite
    steps = np.diff(times)
    backwards = np.flatnonzero(steps < 0.0)
    if backwards.size:
        return [
            Finding(
                level="error",
                channel="time",
                message=f"runs backwards {_counted(backwards.size, 'time')}, first at "
                f"{_second(recording, int(backwards[0])):.3f} s; correct the stamps, or state "
                "--time none with --rate",
            )
        ]
    nominal = float(np.median(steps))
    if nominal <= 0.0:
        return [
            Finding(
                level="error",
                channel="time",
                message="most stamps repeat the one before: the clock is too coarse; state "
                "--time none with --rate",
            )
        ]
    gaps = np.flatnonzero(steps > GAP_STEPS * nominal)
    if gaps.size and not omit_gaps:
        first = int(gaps[0])
        return [
            Finding(
                level="error",
                channel="time",
                message=f"has {_counted(gaps.size, 'gap')} of more than {GAP_STEPS:g} steps of "
                f"{nominal:.6g} s, the first of {steps[first]:.6g} s at "
                f"{_second(recording, first):.3f} s; {_longest_stretch(recording, gaps + 1)}",
            )
        ]
    findings: list[Finding] = []
    repeated = int(np.count_nonzero(steps == 0.0))
    steps = np.delete(steps, gaps)
    late = int(np.count_nonzero(steps > LATE_STEPS * nominal))
    if repeated:
        findings.append(
            Finding(
                level="note",
                channel="time",
                message=_counted(repeated, "repeated stamp"),
            )
        )
    if late:
        findings.append(
            Finding(
                level="note",
                channel="time",
                message=f"{_counted(late, 'interval')} longer than {LATE_STEPS:g} "
                f"steps of {nominal:.6g} s, the longest {float(steps.max()):.6g} s",
            )
        )
    return findings


def _stuck(recording: Recording, gyro: Channel) -> list[Finding]:
    # A run that long shows in samples half as far apart; most gyros never repeat and are done.
    sparse = gyro.values[:: STUCK_SAMPLES // 2]
    if not (sparse[1:] == sparse[:-1]).any() and sparse.size > 1:
        return []
    changes = np.flatnonzero(gyro.values[1:] != gyro.values[:-1])
    runs = np.diff(np.concatenate(([-1], changes, [gyro.values.size - 1])))
    longest = int(np.argmax(runs))
    length = int(runs[longest])
    usual = (
        float(np.partition(runs, runs.size - STUCK_RANK)[runs.size - STUCK_RANK])
        if runs.size >= STUCK_RANK
        else 0.0
    )
    whole = length == gyro.values.size
    # Share of repeats among the samples outside the longest run.
    repeats = 1.0 if whole else 1.0 - (runs.size - 1) / (gyro.values.size - length)
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
    first = int(changes[longest - 1]) + 1 if longest else 0
    return [
        Finding(
            level="error",
            channel=gyro.name,
            message=f"is stuck at one value for {length} samples from "
            f"{_second(recording, first):.3f} s; "
            f"{_longest_stretch(recording, np.arange(first, first + length))}",
        )
    ]


def _block_angles(channel: Channel, sample_rate: float, edges: NDArray[np.intp]) -> FloatArray:
    """Angle turned from each edge to the next, rad, shape (edges - 1,)."""
    if channel.kind == "angle":
        return np.diff(channel.values[edges])
    sums = np.add.reduceat(channel.values[: edges[-1] + 1], edges[:-1] + 1)
    # reduceat runs its last sum to the end of what it is given: the last edge included.
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
    return None


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
    steps = np.diff(channel.values)
    steps -= np.median(steps[:: max(1, steps.size // 100_000)])
    np.abs(steps, out=steps)
    usual = float(np.quantile(steps[:: max(1, steps.size // 100_000)], 0.99))
    at = np.flatnonzero(steps > 20.0 * usual) if usual > 0.0 else np.empty(0, np.intp)
    if at.size == 0:
        return []
    return [
        Finding(
            level="warning",
            channel=channel.name,
            message=f"{_counted(at.size, 'jump')} of over 20 times the usual step, the first at "
            f"{_second(recording, int(at[0]) + 1):.3f} s; "
            f"{_longest_stretch(recording, at + 1)}",
        )
    ]


def _saturation(recording: Recording, gyro: Channel) -> list[Finding]:
    """An extreme value taken far oftener than the next one inwards, as noise never does."""
    if gyro.kind == "angle":
        return []
    findings: list[Finding] = []
    for sign, side in ((1.0, "upper"), (-1.0, "lower")):
        values = sign * gyro.values
        limit = float(values.max())
        at_limit = values == limit
        count = int(np.count_nonzero(at_limit))
        if count < 10 or count == values.size:
            continue
        inside = values[~at_limit]
        following = int(np.count_nonzero(inside == inside.max()))
        # Few levels say nothing: a quiet gyro may count only 0 and 1.
        if count > 3 * following and np.unique(values[:: max(1, values.size // 10_000)]).size > 8:
            first = int(np.argmax(at_limit))
            findings.append(
                Finding(
                    level="warning",
                    channel=gyro.name,
                    message=f"is saturated: {count} samples are at its {side} limit, the first at "
                    f"{_second(recording, first):.3f} s; take a stretch without with --slice",
                )
            )
    return findings
