"""Time stamps: gaps, late and repeated stamps, and the longest stretch without any."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import RecordingError
from sagnac.recording.findings import (
    Finding,
    counted,
    is_not_finite,
    longest_between,
    longest_stretch,
    not_finite_findings,
    places_where,
    tally,
)
from sagnac.recording.kinds import median_step
from sagnac.recording.model import GAP_STEPS, Recording, second_of
from sagnac.recording.stuck import stuck_findings

LATE_STEPS: Final = 1.5
# Gaps that would hold this many times the samples there are belong to no one recording.
LARGEST_GAPS: Final = 9


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
        infinite, first = tally(places_where(gyro.values, np.isinf))
        if infinite:
            raise RecordingError(
                f"{where}: {gyro.name}: {counted(infinite, 'sample')} infinite, the first "
                f"at {second_of(recording, first):.3f} s; mark bad samples as NaN"
            )
        findings += stuck_findings(recording, gyro)
    times = recording.times
    if times is not None:
        findings += time_findings(recording, times, omit_gaps=True)
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
        return places_where(times, lambda values: np.diff(values) > longest, following=1)

    gaps, first = tally(jumps())
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
            f"are {times.size}; {longest_stretch(recording, (places + 1 for places in jumps()))}"
        )
    notes.append(
        f"time: {counted(gaps, 'gap')}, {counted(missing, 'sample')} missing, the first at "
        f"{second_of(recording, first):.3f} s; {sample_rate:.9g} Hz between"
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
    first, last = longest_between(gyro.values.size, places_where(gyro.values, is_not_finite))
    times = recording.times
    if times is not None:
        times = series.less(times[first:last], times[first]) if last > first else None
    stretch = replace(
        recording, gyros=(replace(gyro, values=gyro.values[first:last]),), times=times
    )
    return stretch, second_of(recording, first) if last > first else 0.0


def time_findings(
    recording: Recording, times: FloatArray, *, omit_gaps: bool = False
) -> list[Finding]:
    """What is wrong with time stamps, or to be known of them."""
    not_finite = not_finite_findings(recording, "time", times)
    if not_finite:
        return not_finite
    backwards, first = tally(places_where(times, lambda some: np.diff(some) < 0.0, following=1))
    if backwards:
        return [
            Finding(
                level="error",
                channel="time",
                message=f"runs backwards {counted(backwards, 'time')}, first at "
                f"{second_of(recording, first):.3f} s; correct the stamps, or state "
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
        return places_where(times, lambda some: np.diff(some) > longest, following=1)

    gaps, first = tally(jumps())
    if gaps and not omit_gaps:
        return [
            Finding(
                level="error",
                channel="time",
                message=f"has {counted(gaps, 'gap')} of more than {GAP_STEPS:g} steps of "
                f"{nominal:.6g} s, the first of {times[first + 1] - times[first]:.6g} s at "
                f"{second_of(recording, first):.3f} s; "
                f"{longest_stretch(recording, (places + 1 for places in jumps()))}",
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
