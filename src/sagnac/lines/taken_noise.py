"""The noise that goes with the lines when they are removed, and how the curve gets it back."""

from dataclasses import replace
from typing import Final

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.coefficients.laws import sinusoid_allan_variance
from sagnac.errors import Note, rounded
from sagnac.lines.model import Line
from sagnac.lines.naming import Lineup
from sagnac.lines.wandering import DriftingLine
from sagnac.spectrum import periodogram
from sagnac.stability.curve import StabilityCurve

# Bins on each side of a line whose noise the fit takes with the line.
TAKEN_BINS: Final = 2.0
# Bins on each side of an order that are left out: a table that is not quite steady spreads it.
WIDEST_BINS: Final = 20.0
# Cells that the noise taken with one line is spread over.
_MOST_CELLS: Final = 64
# An order spread over as many bands of that width takes two of many ordinates: nothing to mask.
_SPREAD: Final = 20.0
# Parameters of a line, in pairs: amplitudes alone, and with a frequency of its own.
_AMPLITUDES: Final = 1.0
_WITH_FREQUENCY: Final = 1.5
# Share of the variance below which nobody asks what removing lines took.
_SEEN_SHARE: Final = 1e-3


def masked_bands(lines: tuple[Line, ...], known: Lineup) -> tuple[tuple[float, float], ...]:
    """(low, high) bands in Hz in which the fit took the noise with the line."""
    rate = known.sample_rate
    cell = rate / known.samples
    width, spread = TAKEN_BINS * cell, WIDEST_BINS * cell
    bands = [
        (found.band[0] * rate - width, found.band[1] * rate + width) for found in known.drifting
    ]
    for line in lines:
        if line.scale == "time":
            bands.append((line.frequency - width, line.frequency + width))
        elif known.turning is not None:
            speed = known.turning.speeds * rate / (2.0 * np.pi)
            low, high = float(speed[0]), float(speed[-1])
            if line.frequency * (high - low) < _SPREAD * width:
                center = 0.5 * (low + high) * line.frequency
                bands.append((center - spread, center + spread))
    return tuple(bands)


def noise_taken(lines: tuple[Line, ...], known: Lineup) -> FloatArray:
    """`taken` of `Removal`: half a cycle per record for each parameter, at its frequency.

    Returns
    -------
    (3, bands) frequency and bandwidth, Hz, and one-sided rate density, (rad/s)^2/Hz.
    """
    rate = known.sample_rate
    bands: list[tuple[float, float]] = []
    for found in known.drifting:
        cells = zip(*taken_bands(found), strict=True)
        bands += [(place * rate, width * rate) for place, width in cells]
    drifting = {found.frequency * rate for found in known.drifting}
    steady = [line for line in lines if line.scale == "angle" or line.frequency not in drifting]
    bands += [_taken_by(line, known) for line in steady]
    frequency, bandwidth = np.array(bands).reshape(-1, 2).T
    inside = (frequency > 0.0) & (frequency < 0.5 * rate)
    frequency, bandwidth = frequency[inside], bandwidth[inside]
    bins = np.rint(frequency / rate * (2.0 * (known.floor.size - 1))).astype(np.int64)
    return np.stack([frequency, bandwidth, periodogram.density(known.floor[bins], rate)])


def _taken_by(line: Line, known: Lineup) -> tuple[float, float]:
    """Where noise went with a steady line, Hz, and how much of it, Hz."""
    cell = known.sample_rate / known.samples
    if line.scale == "time":
        return line.frequency, _WITH_FREQUENCY * cell
    turn_rate = 0.0
    if known.turning is not None:
        turn_rate = float(np.median(known.turning.speeds)) * known.sample_rate / (2.0 * np.pi)
    fitted = _WITH_FREQUENCY if line.frequency_error > 0.0 else _AMPLITUDES
    return line.frequency * turn_rate, fitted * cell


def taken_bands(line: DriftingLine) -> tuple[FloatArray, FloatArray]:
    """Where noise went with the line, and how much: frequencies and bandwidths.

    Half the parameters, in cycles a record, spread evenly over the band. What stays of a line
    because it lies below the noise makes up for some of it, up to a quarter in trials.

    Returns
    -------
    frequency, bandwidth
        (cells,) cycles per sample.
    """
    low, high = line.band
    cells = int(np.clip(round((high - low) * line.samples), 1, _MOST_CELLS))
    frequency = low + (np.arange(cells) + 0.5) * (high - low) / cells
    return frequency, np.full(cells, 0.5 * line.parameters / (line.samples * cells))


def taken_allan_variance(
    tau: FloatArray,
    frequency: FloatArray,
    bandwidth: FloatArray,
    density: FloatArray,
    *,
    interval: float,
) -> FloatArray:
    """Allan variance of the noise that goes with fitted lines when they are removed.

    Least squares of p real parameters takes p degrees of freedom of the noise, on average the
    power in a bandwidth of p/2 cycles a record; the Allan variance of the rest is lower by
    ``sum 2 sin^4(pi f tau) / (pi f tau)^2`` times that power. The same holds for angles taken at
    any multiple of `interval`: what lies above their Nyquist frequency is folded by the sine.

    Parameters
    ----------
    tau
        (points,), s, multiples of `interval`.
    frequency
        (bands,) where noise was taken, Hz, above zero and below ``0.5 / interval``.
    bandwidth
        (bands,) how much, Hz: half the parameters over the length of the record.
    density
        (bands,) one-sided rate density of the noise there, (rad/s)^2/Hz, of increments over
        `interval` as `spectrum.periodogram.density` gives it.
    interval
        Of the samples that the lines were fitted to, s.

    Returns
    -------
    FloatArray
        (points,), (rad/s)^2.
    """
    # Increments over an interval show less of a rate than its amplitude: here it is the angle's.
    amplitude = np.sqrt(2.0 * bandwidth * density) / np.sinc(frequency * interval)
    return np.asarray(
        sinusoid_allan_variance(np.asarray(tau)[:, np.newaxis], amplitude, frequency).sum(axis=1)
    )


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

    Raises
    ------
    ValueError
        If `curve` is not an Allan deviation, or `taken` does not fit it.
    """
    if curve.estimator not in {"adev", "oadev"}:
        raise ValueError(
            f"curve is of {curve.estimator}, and what lines took is known for an Allan deviation; "
            "give adev or oadev"
        )
    if taken.shape != curve.tau.shape or not np.all(taken >= 0.0):
        raise ValueError(
            f"taken has shape {taken.shape}; give one variance, zero or more, for each of the "
            f"{curve.tau.size} points"
        )
    raised = np.hypot(curve.deviation, np.sqrt(taken))
    share = np.divide(taken, raised**2, out=np.zeros_like(raised), where=raised > 0.0)
    changed = curve
    if restored:
        factor = np.divide(
            raised, curve.deviation, out=np.ones_like(raised), where=curve.deviation > 0.0
        )
        changed = replace(curve, deviation=raised, low=curve.low * factor, high=curve.high * factor)
    most = int(np.argmax(share))
    if share[most] < _SEEN_SHARE:
        return changed
    counted = "1 line" if lines == 1 else f"{lines} lines"
    back = "it is added back" if restored else "it is not added back, as in the paper"
    note = Note(
        text=f"removal of {counted} took up to {rounded(100.0 * share[most])} % of the noise "
        f"variance (at tau = {curve.tau[most]:.4g} s); {back}"
    )
    return replace(changed, notes=(*curve.notes, note))
