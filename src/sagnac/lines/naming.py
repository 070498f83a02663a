"""Lines as they are reported: amplitude, phase, errors, and what each is."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sagnac.lines.model import Line, Scale
from sagnac.lines.selection import floors, significances
from sagnac.lines.wandering import DriftingLine
from sagnac.table.turns import mean_rate
from sagnac.units import ARCSECOND

if TYPE_CHECKING:
    from sagnac.lines.search import Search

# Periodic error that an encoder may have, rad.
_ENCODER_ERROR: Final = 5.0 * ARCSECOND


def describe_lines(search: Search, channel: str) -> tuple[Line, ...]:
    """The lines, strongest first, named where their frequency says what they are."""
    components, fit = search.components, search.fit
    alpha, floor, sample_rate = search.table, search.left.floor, search.sample_rate
    lines = [_of_drifting(line, sample_rate, channel) for line in search.drifting]
    if fit is None or components.size == 0:
        return _named(lines, search)
    levels = floors(components, alpha, floor)
    significance = significances(fit, levels)
    for index in range(components.size):
        a, b = float(components.cosine[index]), float(components.sine[index])
        amplitude = float(np.hypot(a, b))
        covariance = fit.covariance[index] * levels[index]
        along = np.array([a, b]) / amplitude
        across = np.array([-b, a]) / amplitude
        error = float(np.sqrt(max(along @ covariance[:2, :2] @ along, 0.0)))
        phase_error = float(np.sqrt(max(across @ covariance[:2, :2] @ across, 0.0))) / amplitude
        frequency_error = float(np.sqrt(covariance[2, 2]))
        phase = -np.arctan2(b, a)
        if index < components.orders.size:
            scale: Scale = "angle"
            frequency = float(components.orders[index])
        else:
            scale = "time"
            cycles = float(components.frequencies[index - components.orders.size])
            # Phase at the first sample; a fitted frequency adds its own error over half the record.
            phase -= 2.0 * np.pi * cycles * components.center
            phase_error = float(
                np.hypot(phase_error, 2.0 * np.pi * components.center * frequency_error)
            )
            frequency, frequency_error = cycles * sample_rate, frequency_error * sample_rate
        lines.append(
            Line(
                scale=scale,
                frequency=frequency,
                frequency_error=frequency_error,
                amplitude=amplitude,
                amplitude_error=error,
                phase=float(np.angle(np.exp(1j * phase))),
                phase_error=phase_error,
                significance=float(significance[index]),
                channel=channel,
            )
        )
    return _named(lines, search)


def _named(lines: list[Line], search: Search) -> tuple[Line, ...]:
    """The lines, strongest first, with their names."""
    lines = sorted(lines, key=lambda line: -line.significance)
    alpha, sample_rate = search.table, search.sample_rate
    turn_rate = 0.0 if alpha is None else abs(mean_rate(alpha, sample_rate)) / (2 * np.pi)
    resolution = sample_rate / (2.0 * (search.left.floor.size - 1))
    return tuple(
        line if line.name else replace(line, name=_name(line, lines[:rank], turn_rate, resolution))
        for rank, line in enumerate(lines)
    )


def _of_drifting(line: DriftingLine, sample_rate: float, channel: str) -> Line:
    """A drifting line in the terms of a steady one, with the phase that it starts with."""
    start = complex(line.knots[0] * np.exp(-2j * np.pi * line.carrier * line.center))
    return Line(
        scale="time",
        frequency=line.frequency * sample_rate,
        frequency_error=line.frequency_error * sample_rate,
        amplitude=line.amplitude,
        amplitude_error=line.amplitude_error,
        phase=float(np.angle(start)),
        phase_error=float(line.knot_errors[0]) / max(abs(start), np.finfo(float).tiny),
        significance=line.significance,
        channel=channel,
        name=f"drifts: fitted in {blocks_text(line.blocks)}",
    )


def blocks_text(blocks: int) -> str:
    """``1 block``, ``2 blocks``."""
    return f"{blocks} block" if blocks == 1 else f"{blocks} blocks"


def _name(line: Line, stronger: list[Line], turn_rate: float, resolution: float) -> str:
    """What a line is, where its frequency beside a stronger one's says so."""
    if line.scale == "angle":
        # Harmonics are removed in the angle that the encoder reports. Its periodic error, some
        # arcseconds at a low order, leaves sidebands of order * error / 2 beside each of them.
        for other in stronger:
            apart = abs(line.frequency - other.frequency)
            reach = other.amplitude * max(other.frequency, 1.0) * _ENCODER_ERROR
            if other.scale == "angle" and 0.5 < apart < 2.5 and line.amplitude < reach:
                return f"sideband of order {other.frequency:g} (encoder error)"
        whole = line.frequency == np.rint(line.frequency)
        return "" if whole else "non-integer order"
    if turn_rate == 0.0:
        return ""
    for other in stronger:
        base = other.frequency if other.scale == "time" else other.frequency * turn_rate
        if other.amplitude < 10.0 * line.amplitude:
            continue
        for multiple in (1, 2):
            if abs(abs(line.frequency - base) - multiple * turn_rate) < 2.0 * resolution:
                parent = f"{base:.6g} Hz" if other.scale == "time" else f"order {other.frequency:g}"
                times = "the table rate" if multiple == 1 else "twice the table rate"
                return f"sideband of {parent} at {times}"
        if other.scale == "time" and abs(line.frequency - base) < 20.0 * resolution:
            return f"sideband of {base:.6g} Hz (its amplitude or frequency drifts)"
        if other.scale == "angle" and abs(line.frequency - base) < 0.01 * base:
            return f"sideband of order {other.frequency:g} (table jitter)"
    return ""
