"""Gyros without their dither, what follows the temperature, and what settles after power-on.

A pick-off shows the dither that the gyro's own stripping left.

Drift at rest with temperature: the means of the rate over some hundred stretches are fitted by
``b1 (T - T0) + b2 (T - T0)^2 + b3 dT/dt`` in white noise and a random walk, whose sizes are those
of the highest restricted likelihood (Patterson and Thompson, *Biometrika* 58, 545, 1971): what the
terms take up is not counted as missing noise. Terms that chance makes are left out.

A warm-up is an exponential beside a straight line, in white noise and a random walk.
"""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from scipy.linalg import cho_solve
from scipy.optimize import minimize_scalar

from sagnac.analysis.settings import Method
from sagnac.core.arrays import FloatArray, blocks, empty, extent, mean
from sagnac.core.errors import Note, RecordingError
from sagnac.core.units import ARCSECOND, SENSED, UNITS, field_unit
from sagnac.lines.stripping import stripped
from sagnac.recording.channel import Channel, angle_of
from sagnac.recording.model import Recording
from sagnac.table.kinematics import averages_of

if TYPE_CHECKING:
    from scipy.interpolate import BSpline


def without_dither(recording: Recording, gyros: tuple[str, ...], method: Method) -> Recording:
    """Strip the gyros asked for by their pick-offs; with the method ``none`` nothing is taken.

    A pick-off that is not whole or does not move is left alone, with a note.

    Parameters
    ----------
    recording
        Its pick-offs are used if it has any.
    gyros
        Names.
    method
        How periodic parts are removed.

    Returns
    -------
    Recording
        With a note on what was taken; stripped gyros are angles.
    """
    used = [pickoff for pickoff in recording.pickoffs if pickoff.gyro in gyros]
    if method == "none" or not used:
        return recording
    channels = {channel.name: channel for channel in recording.gyros}
    notes = []
    for pickoff in used:
        gyro = channels[pickoff.gyro]
        why = _unusable(pickoff.values)
        if why:
            text = f"its pick-off {why} and is not used: dither stays in the angle"
            notes.append(Note(level="warning", channel=gyro.name, text=text))
            continue
        left = stripped(angle_of(gyro, recording.sample_rate), pickoff.values)
        channels[gyro.name] = Channel(
            name=gyro.name, kind="angle", shown_in="arcsec", values=left.angle, sensor=gyro.sensor
        )
        text = (
            f"{left.taken / ARCSECOND:.3g} arcsec rms that follows its pick-off was taken out of "
            "the angle: dither that the gyro's own stripping left"
        )
        notes.append(Note(channel=gyro.name, text=text))
    return replace(recording, gyros=tuple(channels.values()), notes=(*recording.notes, *notes))


def _unusable(pickoff: FloatArray) -> str:
    """Why a pick-off cannot be used; empty if it can."""
    if not math.isfinite(mean(pickoff)):
        return "has samples that are missing or infinite"
    low, high = extent(pickoff)
    return "does not move" if low == high else ""


_MEANS: Final = 300
_LEAST_SAMPLES: Final = 4 * _MEANS
# Standard errors that a term has to have.
_SEEN: Final = 3.5
# Range of the variance of a step of the walk over that of the white noise of a mean.
_RATIOS: Final = (math.log(1e-6), math.log(1e3))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ThermalDrift:
    """The drift of one sensor with temperature.

    Attributes
    ----------
    coefficients, errors
        (3,) of ``T - T0``, of its square, and of ``dT/dt``, rad/s per unit of temperature, and
        their standard errors; 0 for a term that is not seen.
    temperature
        T0, the mean.
    walk, walk_before
        K of the noise beside the terms, and as it would be without them, rad/s/sqrt(s).
    rate
        Spline of the drift over time from the first sample, rad/s.
    deviation
        Its standard deviation, rad/s.
    """

    coefficients: FloatArray
    errors: FloatArray
    temperature: float
    walk: float
    walk_before: float
    rate: "BSpline"
    deviation: float


def without_temperature(recording: Recording, names: tuple[str, ...]) -> Recording:
    """Sensors without the drift that follows the temperature, with a note on what it was.

    Parameters
    ----------
    recording
        At rest, with its temperature.
    names
        Of the gyros to correct.

    Raises
    ------
    RecordingError
        If it has no temperature, the temperature is not whole, the table turns, or the recording
        is too short.
    """
    temperature = recording.temperature
    problem = channel = ""
    if temperature is None:
        problem = "has no column of temperature"
        remedy = "name it ({columns temperature=COLUMN}), or leave out {covariates}"
    elif recording.table is not None:
        problem = "temperature cannot be told from the motion of a table in the rate of one gyro"
        remedy = "leave out {covariates}, or take a recording at rest"
    elif recording.samples < _LEAST_SAMPLES:
        problem = f"{recording.samples} samples are too few for what temperature does"
        remedy = f"give {_LEAST_SAMPLES} or more, or leave out {{covariates}}"
    elif not math.isfinite(mean(temperature)):
        problem, channel = "has samples that are missing or infinite", "temperature"
        remedy = "leave out {covariates}, or take a whole stretch with {slice START:STOP}"
    if temperature is None or problem:
        raise RecordingError(problem, path=recording.path, channel=channel, remedy=remedy)
    gyros, notes = [], []
    for gyro in recording.gyros:
        if gyro.name not in names:
            gyros.append(gyro)
            continue
        drift = thermal_drift(gyro, temperature, recording.sample_rate)
        notes.append(_note(gyro, drift, temperature))
        gyros.append(gyro if drift is None else _corrected(gyro, drift, recording.sample_rate))
    return replace(recording, gyros=tuple(gyros), notes=(*recording.notes, *notes))


def thermal_drift(
    gyro: Channel, temperature: FloatArray, sample_rate: float
) -> ThermalDrift | None:
    """The drift of a sensor with temperature; None if none is seen.

    Parameters
    ----------
    gyro
        A gyro or an accelerometer at rest.
    temperature
        (samples,), in any unit.
    sample_rate
        Hz.
    """
    size = (temperature.size - 1) // _MEANS
    edges = size * np.arange(_MEANS + 1)
    width = size / sample_rate
    rates = np.diff(angle_of(gyro, sample_rate)[edges]) / width
    means = np.array(
        [float(np.mean(temperature[first + 1 : first + 1 + size])) for first in edges[:-1]]
    )
    centre = float(means.mean())
    level = means - centre
    if not np.ptp(level) > 0.0:
        return None
    # Imported here: it takes a sixth of a second that an analysis without it need not wait for.
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415

    columns = np.stack([level, level**2, np.gradient(level, width)], axis=1)
    # The least seen of the terms is left out until all are seen.
    taken = [place for place in range(columns.shape[1]) if np.ptp(columns[:, place]) > 0.0]
    fit = _fitted(rates, columns[:, taken])
    while taken and not (ratios := np.abs(fit.values) / fit.errors).min() > _SEEN:
        taken.pop(int(np.argmin(ratios)))
        fit = _fitted(rates, columns[:, taken])
    if not taken:
        return None
    coefficients, errors = np.zeros(3), np.zeros(3)
    coefficients[taken], errors[taken] = fit.values, fit.errors
    drift = columns @ coefficients
    times = (edges[:-1] + 0.5 * size + 0.5) / sample_rate
    return ThermalDrift(
        coefficients=coefficients,
        errors=errors,
        temperature=centre,
        walk=fit.walk / math.sqrt(width),
        walk_before=_fitted(rates, columns[:, :0]).walk / math.sqrt(width),
        rate=make_interp_spline(times, drift - drift.mean(), k=1),
        deviation=float(drift.std()),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Fit:
    """Terms beside a constant, and the root of the variance of a step of the walk."""

    values: FloatArray
    errors: FloatArray
    walk: float
    likelihood: float


def _fitted(rates: FloatArray, columns: FloatArray) -> _Fit:
    """The fit in white noise and a walk of the highest restricted likelihood."""
    scale = columns.std(axis=0)
    basis = np.column_stack([np.ones(rates.size), columns / scale])
    place = np.arange(rates.size, dtype=np.float64)
    # Of means of a walk over stretches of one: i + 1/2 for i < j, and i + 1/3 of its own.
    wandering = np.minimum(place, place[:, np.newaxis]) + 0.5 - np.eye(rates.size) / 6.0

    def fit(logarithm: float) -> _Fit:
        ratio = math.exp(logarithm)
        factor = np.linalg.cholesky(np.eye(rates.size) + ratio * wandering)
        weighed = cho_solve((factor, True), basis)
        information = basis.T @ weighed
        values = np.linalg.solve(information, weighed.T @ rates)
        rest = rates - basis @ values
        variance = float(rest @ cho_solve((factor, True), rest)) / (rates.size - basis.shape[1])
        covariance = variance * np.linalg.inv(information)
        likelihood = (
            -(rates.size - basis.shape[1]) * math.log(variance)
            - 2.0 * float(np.log(np.diag(factor)).sum())
            - float(np.linalg.slogdet(information)[1])
        )
        return _Fit(
            values=values[1:] / scale,
            errors=np.sqrt(np.diag(covariance))[1:] / scale,
            walk=math.sqrt(ratio * variance),
            likelihood=likelihood,
        )

    best = minimize_scalar(
        lambda logarithm: -fit(logarithm).likelihood, bounds=_RATIOS, method="bounded",
        options={"xatol": 0.05},
    )  # fmt: skip
    return fit(float(best.x))


def _corrected(gyro: Channel, drift: ThermalDrift, sample_rate: float) -> Channel:
    """The same channel without the drift."""
    turned = drift.rate.antiderivative()
    values, step = gyro.values, 1.0 / sample_rate
    corrected = empty(values.size)
    for block in blocks(values.size):
        times = np.arange(block.start, block.stop) * step
        drifted = turned(times)
        if gyro.kind != "angle":
            drifted -= turned(times - step)
            drifted /= 1.0 if gyro.kind == "increment" else step
        np.subtract(values[block], drifted, out=corrected[block])
    return replace(gyro, values=corrected)


def _note(gyro: Channel, drift: ThermalDrift | None, temperature: FloatArray) -> Note:
    low, high = extent(temperature)
    span = f"temperature from {low:.4g} to {high:.4g}"
    if drift is None:
        return Note(channel=gyro.name, text=f"{span}: no drift with it is seen, none is taken off")
    sensed = SENSED[gyro.sensor]
    unit, walk = UNITS[sensed.rate_unit], field_unit("rate_random_walk", gyro.sensor)
    return Note(
        channel=gyro.name,
        text=f"{span}: a drift of {_in_words(drift, unit.size)} {unit.name}, "
        f"{drift.deviation / unit.size:.3g} {unit.name} rms, was taken off; with it the slow noise "
        f"would have been that of a {sensed.titles['rate_random_walk']} of "
        f"{drift.walk_before / walk.size:.3g} instead of {drift.walk / walk.size:.3g} {walk.name}",
    )


def _in_words(drift: ThermalDrift, size: float) -> str:
    names = (f"(T - {drift.temperature:.4g})", f"(T - {drift.temperature:.4g})^2", "dT/dt per s")
    shown = [
        f"({value / size:.3g} +- {error / size:.1g}) {name}"
        for value, error, name in zip(drift.coefficients, drift.errors, names, strict=True)
        if error > 0.0
    ]
    return " + ".join(shown)


# Means that the warm-up is sought in, and the square of its significance.
_WARM_UP_MEANS: Final = 200
_WARM: Final = 30.0
# Fewest samples in which a warm-up is looked for.
_LEAST_FOR_WARM_UP: Final = 4 * _WARM_UP_MEANS


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmUp:
    """A bias that settles exponentially.

    Attributes
    ----------
    rate
        At the start, rad/s.
    time
        Constant of the settling, s.
    until_s
        When it has fallen to a hundredth, s, at most the length of the record.
    """

    rate: float
    time: float
    until_s: float


def find_warm_up(increments: FloatArray, *, sample_rate: float) -> WarmUp | None:
    """Fit ``rate exp(-t/time)`` besides a straight line, and keep it if chance does not make it.

    The fit is by generalized least squares to 200 block means of the rate, in white noise and a
    random walk whose sizes come from the steps between the means that the fit leaves. So the
    wandering of a rate random walk is not taken for a warm-up.

    Parameters
    ----------
    increments
        (samples,), rad.
    sample_rate
        Samples per second.

    Returns
    -------
    WarmUp or None
        None if nothing settles, the time is longer than a third of the record, or that is short.
    """
    if increments.size < _LEAST_FOR_WARM_UP:
        return None
    size = increments.size // _WARM_UP_MEANS
    means = averages_of(increments[: size * _WARM_UP_MEANS], size) * sample_rate
    width = size / sample_rate
    time: FloatArray = (np.arange(_WARM_UP_MEANS, dtype=np.float64) + 0.5) * width
    constants = np.geomspace(2.0 * width, _WARM_UP_MEANS * width / 3.0, 40)
    # First in the differences alone, which a walk leaves white.
    best = _settling(means, time, constants, _walk_precision(0.0, 1.0))
    for _ in range(2):
        rest = np.diff(means - best.rate * np.exp(-time / best.constant))
        rest -= rest.mean()
        variance, beside = float(rest @ rest) / rest.size, float(rest[1:] @ rest[:-1]) / rest.size
        white = max(-beside, 0.0)
        walk = max(variance - 2.0 * white, 0.02 * variance / _WARM_UP_MEANS)
        best = _settling(means, time, constants, _walk_precision(white, walk))
    if not best.statistic >= _WARM:
        return None
    return WarmUp(
        rate=best.rate,
        time=best.constant,
        until_s=min(math.log(100.0) * best.constant, increments.size / sample_rate),
    )


class _Settling(NamedTuple):
    """An exponential beside a line: squared significance, constant (s) and rate (rad/s)."""

    statistic: float
    constant: float
    rate: float


def _walk_precision(white: float, walk: float) -> FloatArray:
    """Inverse covariance of means in white noise and a random walk that starts anywhere."""
    place = np.arange(_WARM_UP_MEANS, dtype=np.float64)
    wandering = np.minimum(place, place[:, np.newaxis]) + 1.0
    return np.asarray(
        np.linalg.inv(white * np.eye(_WARM_UP_MEANS) + walk * wandering), dtype=np.float64
    )


def _settling(
    means: FloatArray, time: FloatArray, constants: FloatArray, precision: FloatArray
) -> _Settling:
    """The best exponential beside a line."""
    fits = [_Settling(statistic=0.0, constant=float(constants[0]), rate=0.0)]
    line = np.stack([np.ones(time.size), time / time[-1] - 0.5], axis=1)
    for constant in constants:
        basis = np.column_stack([np.exp(-time / constant), line])
        information = np.linalg.inv(basis.T @ precision @ basis)
        answer = information @ (basis.T @ precision @ means)
        rest = means - basis @ answer
        scatter = float(rest @ precision @ rest) / (time.size - 4)
        statistic = float(answer[0]) ** 2 / (scatter * float(information[0, 0]))
        fits.append(_Settling(statistic, float(constant), float(answer[0])))
    return max(fits, key=lambda fit: fit.statistic)


def without_warm_up(increments: FloatArray, warm_up: WarmUp, *, sample_rate: float) -> FloatArray:
    """Increments with the settling taken off.

    Parameters
    ----------
    increments
        (samples,), rad.
    warm_up
        Of `find_warm_up`.
    sample_rate
        Samples per second.
    """
    settled = empty(increments.size)
    for block in blocks(increments.size):
        time = (np.arange(block.start, block.stop) + 0.5) / sample_rate
        settling = warm_up.rate / sample_rate * np.exp(-time / warm_up.time)
        np.subtract(increments[block], settling, out=settled[block])
    return settled
