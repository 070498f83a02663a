"""The judgement of a recording: what has to hold before a figure can rest on it."""

import math
from collections.abc import Iterator
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.recording.findings import (
    Finding,
    counted,
    longest_stretch,
    not_finite_findings,
    places_where,
    tally,
)
from sagnac.recording.following import block_rates, table_findings
from sagnac.recording.gaps import time_findings
from sagnac.recording.model import MINIMUM_SAMPLES, Channel, Recording, second_of
from sagnac.recording.stuck import stuck_findings
from sagnac.units import DEGREE, DEGREE_PER_HOUR

# No gyro turns at 5000 deg/s for long, and none is stable to 1e-6 deg/h from sample to sample.
FASTEST_RATE: Final = 5000.0 * DEGREE
SLOWEST_RATE: Final = 1e-6 * DEGREE_PER_HOUR


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
        findings += not_finite_findings(recording, channel.name, channel.values)
    if recording.times is not None:
        findings += time_findings(recording, recording.times)
    for gyro in recording.gyros:
        findings += stuck_findings(recording, gyro)
    order = {"error": 0, "warning": 1, "note": 2}
    return tuple(sorted(findings, key=lambda finding: order[finding.level]))


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
        findings += table_findings(recording, gyro)
    if recording.table is not None:
        findings += _jumps(recording, recording.table)
        lowest, highest = series.extent(recording.table.values)
        turned = (highest - lowest) / (2.0 * math.pi)
        findings.append(
            Finding(level="note", channel="table", message=f"covers {turned:.2f} turns")
        )
    order = {"error": 0, "warning": 1, "note": 2}
    return tuple(sorted(findings, key=lambda finding: order[finding.level]))


def _rate_findings(recording: Recording, gyro: Channel) -> list[Finding]:
    rates, _ = block_rates(recording, gyro)
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
        return places_where(
            values, lambda some: np.abs(np.diff(some) - middle) > limit, following=1
        )

    number, first = tally(jumps()) if limit > 0.0 else (0, -1)
    if number == 0:
        return []
    return [
        Finding(
            level="warning",
            channel=channel.name,
            message=f"{counted(number, 'jump')} of over 20 times the usual step, the first at "
            f"{second_of(recording, first + 1):.3f} s; "
            f"{longest_stretch(recording, (places + 1 for places in jumps()))}",
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
        count, first = tally(places_where(values, partial(np.equal, limit)))
        if count < 10:
            continue
        inner = -math.inf
        for span in series.through(values.size, values):
            inside = values[span][values[span] != limit]
            inner = max(inner, float((sign * inside).max(initial=-math.inf)))
        following, _ = tally(places_where(values, partial(np.equal, sign * inner)))
        if count > 3 * following:
            findings.append(
                Finding(
                    level="warning",
                    channel=gyro.name,
                    message=f"is saturated: {count} samples are at its {side} limit, the first at "
                    f"{second_of(recording, first):.3f} s; take a stretch without with --slice",
                )
            )
    return findings
