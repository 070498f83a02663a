"""Lines as they are reported: amplitude, phase, errors, what each is, and the noise they take."""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import Note, counted, rounded
from sagnac.core.units import ARCSECOND
from sagnac.lines import detection, joint_fit, wandering
from sagnac.lines.model import Line, Scale, lines_of
from sagnac.lines.state import State
from sagnac.noise.laws import sinusoid_allan_variance
from sagnac.spectrum import periodogram
from sagnac.stability.curve import StabilityCurve

# ---- naming ------------------------------------------------------------------------

# Bins by which a sideband may miss its place.
_MISSED: Final = 2.0


def _turn_rate(state: State) -> float:
    """Mean rate of the table, turns a second, 0 at rest."""
    return abs(state.record.sampled.mean_rate) / (2.0 * np.pi)


def describe_lines(state: State, channel: str) -> tuple[Line, ...]:
    """The lines, strongest first, named if their frequency says what they are."""
    lines = [_of_drifting(line, state.record.sample_rate, channel) for line in state.drifting]
    if state.fit is not None and state.fit.components.size:
        lines += _of_fit(state.fit, state, channel)
    lines = sorted(lines, key=lambda line: -line.significance)
    named = (
        line if line.name else replace(line, name=_name(line, tuple(lines[:rank]), state))
        for rank, line in enumerate(lines)
    )
    least = 2.0 * state.record.threshold
    told = (_beside_earth(line, least) for line in named)
    return tuple(sorted(told, key=lambda line: -line.significance))


def _beside_earth(line: Line, least: float) -> Line:
    """Order 1 as significant as it is beside what Earth rate may make of it; others as they are.

    Below the `least` of a line it is listed, since it was taken out, but need not be one.
    """
    if line.scale == "time" or line.frequency != 1.0:
        return line
    alone = (line.amplitude / max(line.amplitude_error, math.ulp(0.0))) ** 2
    name = line.name or ("not told from Earth rate" if alone < least else "")
    return replace(line, significance=min(line.significance, alone), name=name)


# --- amplitude, phase and errors -------------------------------------------------------------


def _of_drifting(line: wandering.DriftingLine, sample_rate: float, channel: str) -> Line:
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
        name=f"drifts: fitted in {counted(line.blocks, 'block')}",
    )


def _of_fit(fit: joint_fit.ComponentFit, state: State, channel: str) -> list[Line]:
    """Steady lines, angle components first."""
    components, angles = fit.components, fit.components.orders.size
    levels = detection.floors(components, state.record.sampled, state.floor)
    covariance = fit.covariance * levels[:, np.newaxis, np.newaxis]
    amplitude = components.amplitude
    along = components.phasor / amplitude
    # Errors along the phasor, and across it.
    ways = np.stack([along, 1j * along]).view(np.float64).reshape(2, -1, 2)
    variances = np.einsum("wni,nij,wnj->wn", ways, covariance[:, :2, :2], ways)
    if state.motion is not None:
        for at in np.flatnonzero(components.orders == 1.0):
            variances[:, at] += state.motion.off_by_earth(levels[at]) ** 2
    amplitude_error, phase_error = np.sqrt(np.maximum(variances, 0.0))
    phase, phase_error = -np.angle(components.phasor), phase_error / amplitude
    frequency_error = np.sqrt(covariance[:, 2, 2])
    # At the first sample, not at the origin: the frequency's error adds to the phase's.
    center, rate = 2.0 * np.pi * components.center, state.record.sample_rate
    phase[angles:] -= center * components.frequencies
    phase_error[angles:] = np.hypot(phase_error, center * frequency_error)[angles:]
    # No larger than of a phase of which nothing is known.
    phase_error = np.minimum(phase_error, np.pi / np.sqrt(3.0))
    frequency_error[angles:] *= rate
    scales: list[Scale] = ["angle" if at < angles else "time" for at in range(components.size)]
    return lines_of(
        scales,
        channel,
        frequency=np.concatenate([components.orders, rate * components.frequencies]),
        frequency_error=frequency_error,
        amplitude=amplitude,
        amplitude_error=amplitude_error,
        phase=np.angle(np.exp(1j * phase)),
        phase_error=phase_error,
        significance=detection.significances(fit, levels),
    )


# --- names: every sideband is told here ------------------------------------------------------


def _name(line: Line, stronger: tuple[Line, ...], state: State) -> str:
    """Origin of a line, if its frequency beside a stronger one's tells."""
    if line.scale == "time":
        if not _turn_rate(state):
            return ""
        names = (_sideband_in_time(line, other, state) for other in stronger)
        return next(filter(None, names), _product(line, stronger, state))
    for other in stronger:
        # Harmonics are removed in the angle that the encoder reports. Its periodic error, some
        # arcseconds at a low order, leaves sidebands of order * error / 2 beside each of them.
        apart = abs(line.frequency - other.frequency)
        reach = other.amplitude * max(other.frequency, 1.0) * 5.0 * ARCSECOND
        if other.scale == "angle" and 0.5 < apart < 2.5 and line.amplitude < reach:
            return f"sideband of {_parent(other)} (encoder error)"
    made = _product(line, stronger, state)
    return made or ("" if line.frequency == np.rint(line.frequency) else "non-integer order")


def _product(line: Line, stronger: tuple[Line, ...], state: State) -> str:
    """Origin of a line at the sum or the difference of an order and another line; else empty.

    At high frequency the angle of the table is that of the gyros. A line in them is in that angle,
    too, and so in the phase of every order.
    """
    turn_rate = _turn_rate(state)
    place = line.hertz(turn_rate)
    for order in (one for one in stronger if one.scale == "angle"):
        moved = order.frequency * turn_rate
        # A product is at most twice the order times both amplitudes, in rad. By theory it is half
        # of that, over the share of the rate that the gyros sense; two orders make it twice.
        reach = 2.0 * order.frequency * order.amplitude
        for other in (one for one in stronger if line.amplitude < reach * one.amplitude):
            missed = min(abs(place - abs(other.hertz(turn_rate) + way)) for way in (-moved, moved))
            # An order twice as high is the table's own as likely.
            of_line = other is not order and (other.scale == "angle" or line.scale == "time")
            if of_line and missed < _MISSED * _resolution(state):
                return f"product of {_parent(other)} and order {order.frequency:g}"
    return ""


def _parent(line: Line) -> str:
    """A line as the names of others have it."""
    return f"{line.frequency:.6g} Hz" if line.scale == "time" else f"order {line.frequency:g}"


def _resolution(state: State) -> float:
    """Width of a bin of the spectrum, Hz."""
    return state.record.sample_rate / (2.0 * (state.floor.size - 1))


def _sideband_in_time(line: Line, other: Line, state: State) -> str:
    """Origin of a line in time beside a stronger line on either scale; empty if there is none."""
    # A sideband is weaker than its line by a factor of ten or more.
    if other.amplitude < 10.0 * line.amplitude:
        return ""
    turn_rate, resolution = _turn_rate(state), _resolution(state)
    base, parent = other.hertz(turn_rate), _parent(other)
    apart = abs(line.frequency - base)
    for multiple, times in ((1, "the table rate"), (2, "twice the table rate")):
        if abs(apart - multiple * turn_rate) < _MISSED * resolution:
            return f"sideband of {parent} at {times}"
    if other.scale == "time" and apart < 20.0 * resolution:
        return f"sideband of {parent} (its amplitude or frequency drifts)"
    if other.scale == "angle" and apart < 0.01 * base:
        return f"sideband of {parent} (table jitter)"
    return ""


# ---- taken noise -------------------------------------------------------------------

# Bins on each side of a line whose noise the fit takes with the line.
TAKEN_BINS: Final = 2.0
# Bins on each side of an order that are left out: a table that is not quite steady spreads it.
WIDEST_BINS: Final = 20.0


def masked_bands(lines: tuple[Line, ...], state: State) -> tuple[tuple[float, float], ...]:
    """(low, high) bands in Hz in which the fit took the noise with the line."""
    rate = state.record.sample_rate
    cell = rate / state.record.angle.size
    width, spread = TAKEN_BINS * cell, WIDEST_BINS * cell
    bands = [(one.band[0] * rate - width, one.band[1] * rate + width) for one in state.drifting]
    for line in lines:
        if line.scale == "time":
            bands.append((line.frequency - width, line.frequency + width))
        else:
            speed = state.record.sampled.speeds * rate / (2.0 * np.pi)
            low, high = float(speed[0]), float(speed[-1])
            # An order spread over more bands of that width takes two of many ordinates: nothing to
            # mask.
            if line.frequency * (high - low) < 20.0 * width:
                center = 0.5 * (low + high) * line.frequency
                bands.append((center - spread, center + spread))
    return tuple(bands)


def noise_taken(lines: tuple[Line, ...], state: State) -> FloatArray:
    """`taken` of `Removal`: half a cycle per record for each parameter, at its frequency.

    Returns
    -------
    (3, bands) frequency and bandwidth, Hz, and one-sided rate density, (rad/s)^2/Hz.
    """
    rate, cell = state.record.sample_rate, state.record.sample_rate / state.record.angle.size
    bands: list[tuple[float, float]] = []
    for drifting_line in state.drifting:
        bands += (rate * np.stack(taken_bands(drifting_line), axis=1)).tolist()
    turn_rate = float(np.median(state.record.sampled.speeds)) * rate / (2.0 * np.pi)
    drifting = {drifting_line.frequency * rate for drifting_line in state.drifting}
    for line in lines:
        # Parameters in pairs: two amplitudes, and often a frequency.
        pairs = 1.5 if line.scale == "time" or line.frequency_error > 0.0 else 1.0
        if line.scale == "angle" or line.frequency not in drifting:
            bands.append((line.hertz(turn_rate), pairs * cell))
    frequency, bandwidth = np.array(bands).reshape(-1, 2).T
    inside = (frequency > 0.0) & (frequency < 0.5 * rate)
    frequency, bandwidth = frequency[inside], bandwidth[inside]
    return np.stack([frequency, bandwidth, periodogram.density_at(frequency, state.floor, rate)])


def taken_bands(line: wandering.DriftingLine) -> tuple[FloatArray, FloatArray]:
    """Where noise went with the line, and how much: frequencies and bandwidths.

    Half the parameters, in cycles a record, spread evenly over the band. What stays of a line
    because it lies below the noise makes up for some of it, up to a quarter in trials.

    Returns
    -------
    frequency, bandwidth
        (cells,) cycles per sample.
    """
    low, high = line.band
    cells = int(np.clip(round((high - low) * line.samples), 1, 64))
    frequency = low + (np.arange(cells) + 0.5) * (high - low) / cells
    return frequency, np.full(cells, 0.5 * line.parameters / (line.samples * cells))


def taken_allan_variance(tau: FloatArray, taken: FloatArray, *, interval: float) -> FloatArray:
    """Allan variance of the noise that goes with fitted lines when they are removed.

    Least squares of p real parameters takes p degrees of freedom of the noise, on average the
    power in a bandwidth of p/2 cycles a record; the Allan variance of the rest is lower by
    ``sum 2 sin^4(pi f tau) / (pi f tau)^2`` times that power. The same holds for angles taken at
    any multiple of `interval`: what lies above their Nyquist frequency is folded by the sine.

    Parameters
    ----------
    tau
        (points,), s, multiples of `interval`.
    taken
        (3, bands) where noise was taken, Hz, above zero and below ``0.5 / interval``; how much, Hz:
        half the parameters over the length of the record; and one-sided rate density of the noise
        there, (rad/s)^2/Hz, of increments over `interval` as `spectrum.periodogram.density` gives
        it.
    interval
        Of the samples that the lines were fitted to, s.

    Returns
    -------
    FloatArray
        (points,), (rad/s)^2.
    """
    frequency, bandwidth, density = taken
    # Increments over an interval show less of a rate than its amplitude: here it is the angle's.
    amplitude = np.sqrt(2.0 * bandwidth * density) / np.sinc(frequency * interval)
    each = sinusoid_allan_variance(np.asarray(tau)[:, np.newaxis], amplitude, frequency)
    return np.asarray(each.sum(axis=1))


def with_noise_restored(
    curve: StabilityCurve, taken: FloatArray, lines: int, *, restored: bool = True
) -> StabilityCurve:
    """`curve` with the variance added that went with removed lines, and a note that says so.

    Parameters
    ----------
    curve
        Allan deviation of what the removal left.
    taken
        (points,) Allan variance that `taken_allan_variance` gives, in the square of the curve's
        unit.
    lines
        How many were removed, for the note.
    restored
        False leaves the curve as it is, and the note says that.

    Returns
    -------
    StabilityCurve
        `deviation`, `low` and `high` all raised by the same factor at each point.
    """
    raised = np.hypot(curve.deviation, np.sqrt(taken))
    share = np.divide(taken, raised**2, out=np.zeros_like(raised), where=raised > 0.0)
    changed = curve
    if restored:
        there, factor = curve.deviation > 0.0, np.ones_like(raised)
        np.divide(raised, curve.deviation, out=factor, where=there)
        changed = replace(curve, deviation=raised, low=curve.low * factor, high=curve.high * factor)
    most = int(np.argmax(share))
    # Nobody asks for less than a thousandth.
    if share[most] < 1e-3:
        return changed
    back = "it is added back" if restored else "it is not added back, as in the paper"
    # A function of the table angle is no line.
    what = f"removal of {counted(lines, 'line')}" if lines else "what was taken out"
    took = f"{what} took up to {rounded(100.0 * share[most])} % of the noise variance"
    note = Note(text=f"{took} (at tau = {curve.tau[most]:.4g} s); {back}")
    return replace(changed, notes=(*curve.notes, note))
