"""Gyros without their dither, lags, what follows the temperature, and what settles after power-on.

A pick-off shows the dither that the gyro's own stripping left.

Drift at rest with temperature: the means of the rate over some hundred stretches are fitted by
``b1 (T - T0) + b2 (T - T0)^2 + b3 dT/dt`` in white noise, flicker and a random walk, whose sizes
are those of the highest restricted likelihood (Patterson and Thompson, *Biometrika* 58, 545,
1971): what the terms take up is not counted as missing noise. Terms that chance makes are left out.

A warm-up is an exponential beside a straight line, in white noise and a random walk.
"""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.linalg import solve_triangular, toeplitz
from scipy.optimize import minimize
from scipy.special import xlogy

from sagnac.analysis.settings import Method
from sagnac.core.arrays import FloatArray, extent, less, mean
from sagnac.core.errors import Note, RecordingError
from sagnac.core.units import ARCSECOND, SENSED, UNITS, field_unit
from sagnac.lines.stripping import stripped
from sagnac.recording.channel import Channel, angle_of
from sagnac.recording.model import Recording
from sagnac.table.kinematics import averages_of
from sagnac.table.lags import without_lags as lags_taken_out
from sagnac.table.turns import is_turning

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
        gyro, (low, high) = channels[pickoff.gyro], extent(pickoff.values)
        if low == high or not math.isfinite(high - low):
            why = "does not move" if low == high else "has samples that are missing or infinite"
            text = f"its pick-off {why} and is not used: dither stays in the angle"
            notes.append(Note(level="warning", channel=gyro.name, text=text))
            continue
        left, taken = stripped(angle_of(gyro, recording.sample_rate), pickoff.values)
        channels[gyro.name] = replace(gyro, kind="angle", shown_in="arcsec", values=left)
        what = f"{taken / ARCSECOND:.3g} arcsec rms that follows its pick-off"
        why = "dither that the gyro's own stripping left"
        text = f"{what} was taken out of the angle: {why}"
        notes.append(Note(channel=gyro.name, text=text))
    return replace(recording, gyros=tuple(channels.values()), notes=(*recording.notes, *notes))


def without_lags(recording: Recording, gyros: tuple[str, ...], method: Method) -> Recording:
    """Gyros on a turning table with its motion at the instants of the first one asked for.

    Parameters
    ----------
    recording
        With a table, or none.
    gyros
        Names.
    method
        How periodic parts are removed: only ``fos`` knows of lags.

    Returns
    -------
    Recording
        With a note on each lag; gyros that are moved are angles.
    """
    table, rate = recording.table, recording.sample_rate
    if method != "fos" or len(gyros) < 2 or table is None or not is_turning(table.values):
        return recording
    angles = [angle_of(recording.gyro(name), rate) for name in gyros]
    moved, lags = lags_taken_out(angles, table.values, rate)
    channels, notes = {channel.name: channel for channel in recording.gyros}, []
    for name, angle, lag in zip(gyros, moved, lags, strict=True):
        if lag is None:
            continue
        channels[name] = replace(channels[name], kind="angle", shown_in="arcsec", values=angle)
        when = "after" if lag.value > 0.0 else "before"
        late = f"{1e3 * abs(lag.value):.4g} ms (± {1e3 * lag.error:.1g} ms) {when} gyro {gyros[0]}"
        text = f"shows the table's motion {late}; the motion is shifted by that"
        notes.append(Note(channel=name, text=text))
    return replace(recording, gyros=tuple(channels.values()), notes=(*recording.notes, *notes))


_MEANS: Final = 300
_LEAST_SAMPLES: Final = 4 * _MEANS


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
    elif recording.table is not None and is_turning(recording.table.values):
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


def with_temperature_warnings(recording: Recording, names: tuple[str, ...]) -> Recording:
    """The same sensors, with a warning on each whose slow noise is mostly a drift with temperature.

    Parameters
    ----------
    recording, names
        As of `without_temperature`; where that is refused, nothing is told.
    """
    temperature, table, notes = recording.temperature, recording.table, list[Note]()
    few, turns = recording.samples < _LEAST_SAMPLES, table is not None and is_turning(table.values)
    if temperature is None or few or turns or not math.isfinite(mean(temperature)):
        return recording
    for gyro in recording.gyros:
        drift = None
        if gyro.name in names:
            drift = thermal_drift(gyro, temperature, recording.sample_rate)
        if drift is not None and drift.walk_before > 1.5 * drift.walk:
            text = f"its slow noise is mostly a drift with temperature: {_walks(gyro, drift)}"
            text += "; {covariates temperature} takes it off"
            notes.append(Note(channel=gyro.name, level="warning", text=text))
    return replace(recording, notes=(*recording.notes, *notes))


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
    means = averages_of(temperature[1 : edges[-1] + 1], size)
    centre = float(means.mean())
    level = means - centre
    if not np.ptp(level) > 0.0:
        return None
    # Imported here: it takes a sixth of a second that an analysis without it need not wait for.
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415

    columns = np.stack([level, level**2, np.gradient(level, width)], axis=1)
    # Of an even rise the slope is a constant, of two temperatures the square is the level.
    taken: list[int] = []
    scaled = columns / np.abs(columns).max(axis=0).clip(min=np.finfo(float).tiny)
    for place in range(columns.shape[1]):
        # Above this condition one of the columns is made of the others.
        if np.linalg.cond(np.column_stack([np.ones(_MEANS), scaled[:, [*taken, place]]])) < 1e6:
            taken.append(place)
    # The least seen of the terms is left out until all are seen.
    values, errors, _ = _fitted(rates, columns[:, taken])
    while taken and not (ratios := np.abs(values) / errors).min() > 3.5:
        taken.pop(int(np.argmin(ratios)))
        values, errors, _ = _fitted(rates, columns[:, taken])
    if not taken:
        return None
    coefficients = np.zeros((2, 3))
    coefficients[:, taken] = values, errors
    drift = columns @ coefficients[0]
    # With and without the terms all slow noise is taken for a walk, so that the two compare.
    walk, walk_before = (_fitted(rates, columns[:, which], (1e-2,))[2] for which in (taken, []))
    times = (edges[:-1] + 0.5 * size + 0.5) / sample_rate
    return ThermalDrift(
        coefficients=coefficients[0],
        errors=coefficients[1],
        temperature=centre,
        walk=walk / math.sqrt(width),
        walk_before=walk_before / math.sqrt(width),
        rate=make_interp_spline(times, drift - drift.mean(), k=1),
        deviation=float(drift.std()),
    )


def _fitted(
    rates: FloatArray, columns: FloatArray, start: tuple[float, ...] = (1e-2, 1e-1)
) -> tuple[FloatArray, FloatArray, float]:
    """Terms beside a constant and their errors, and the root of the variance of a step of the walk.

    The fit is in white noise, a walk and flicker of the highest restricted likelihood, sought from
    `start`, of one number without flicker: a walk in its place hides real terms.
    """
    count, scale = rates.size, columns.std(axis=0)
    freedom = count - 1 - scale.size
    both = np.column_stack([np.ones(count), columns / scale, rates])

    def fit(logarithms: FloatArray) -> tuple[float, FloatArray, FloatArray, float]:
        ratios = np.exp(logarithms)
        white, volume = _whitened(both, *ratios)
        basis, observed = white[:, :-1], white[:, -1]
        inverse = np.linalg.inv(basis.T @ basis)
        values = inverse @ (basis.T @ observed)
        rest = observed - basis @ values
        variance = float(rest @ rest) / freedom
        lacking = freedom * math.log(variance) + volume - float(np.linalg.slogdet(inverse)[1])
        errors = np.sqrt(variance * np.diag(inverse))
        return lacking, values[1:] / scale, errors[1:] / scale, math.sqrt(ratios[0] * variance)

    best = minimize(
        lambda logarithms: fit(logarithms)[0],
        np.log(start),
        method="Nelder-Mead",
        bounds=[(math.log(1e-6), math.log(1e3))] * len(start),
        options={"xatol": 0.05, "fatol": 0.01},
    )
    return fit(best.x)[1:]


def _whitened(columns: FloatArray, ratio: float, flicker: float = 0.0) -> tuple[FloatArray, float]:
    """Columns of means in units of the noise, and the logarithm of its determinant.

    The covariance of means over stretches of one of a walk from zero is i + 1/2 for i < j, and
    i + 1/3 of a mean itself; `ratio` is the variance of its step in that of white noise of a mean.
    That of flicker is half the second difference of -t^2 ln t, B^2/pi its unit, but for a constant
    of any size, which the fit of a constant takes up: here one that keeps it convex and above zero.
    """
    place, own = np.arange(len(columns), dtype=np.float64), np.eye(len(columns))
    wandering = np.minimum(place, place[:, np.newaxis]) + 0.5 - own / 6.0
    lags = np.abs(np.arange(-1.0, place.size + 1.0))
    flickering = toeplitz(2.0 + math.log(place.size) - np.diff(xlogy(lags**2, lags), 2) / 2.0)
    factor = np.linalg.cholesky(own + ratio * wandering + flicker * flickering)
    volume = 2.0 * float(np.log(np.diag(factor)).sum())
    return np.asarray(solve_triangular(factor, columns, lower=True)), volume


def _corrected(gyro: Channel, drift: ThermalDrift, sample_rate: float) -> Channel:
    """The same channel without the drift."""
    angle = drift.rate.antiderivative()
    size = 1.0 if gyro.kind == "increment" else 1.0 / sample_rate

    def drifted(number: FloatArray) -> FloatArray:
        turned = angle(number / sample_rate)
        if gyro.kind != "angle":
            turned = (turned - angle((number - 1.0) / sample_rate)) / size
        return np.asarray(turned)

    return replace(gyro, values=less(gyro.values, drifted))


def _note(gyro: Channel, drift: ThermalDrift | None, temperature: FloatArray) -> Note:
    low, high = extent(temperature)
    span = f"temperature from {low:.4g} to {high:.4g}"
    if drift is None:
        return Note(channel=gyro.name, text=f"{span}: no drift with it is seen, none is taken off")
    unit = UNITS[SENSED[gyro.sensor].rate_unit]
    names = (f"(T - {drift.temperature:.4g})", f"(T - {drift.temperature:.4g})^2", "dT/dt per s")
    terms = " + ".join(
        f"({value / unit.size:.3g} +- {error / unit.size:.1g}) {name}"
        for value, error, name in zip(drift.coefficients, drift.errors, names, strict=True)
        if error > 0.0
    )
    return Note(
        channel=gyro.name,
        text=f"{span}: a drift of {terms} {unit.name} (+- 1 sigma), "
        f"{drift.deviation / unit.size:.3g} {unit.name} rms, was taken off; {_walks(gyro, drift)}",
    )


def _walks(gyro: Channel, drift: ThermalDrift) -> str:
    """K of the slow noise with the drift in it, and without."""
    title = SENSED[gyro.sensor].titles["rate_random_walk"]
    unit = field_unit("rate_random_walk", gyro.sensor)
    with_drift, known = (f"{one / unit.size:.3g}" for one in (drift.walk_before, drift.walk))
    return f"with it the {title} of the slow noise is {with_drift} instead of {known} {unit.name}"


# Means that the warm-up is sought in.
_WARM_UP_MEANS: Final = 200


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
    random walk. Twice the logarithm of the restricted likelihood has to rise by 20, with the
    likeliest walk each time: what an exponential takes up, a walk takes up nearly as well.

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
    if increments.size < 4 * _WARM_UP_MEANS:
        return None
    size = increments.size // _WARM_UP_MEANS
    means = averages_of(increments[: size * _WARM_UP_MEANS], size) * sample_rate
    if not np.ptp(means) > 0.0:
        return None
    gain, constant, rate = _settling(means)
    if gain < 20.0:
        return None
    time = constant * size / sample_rate
    until = min(math.log(100.0) * time, increments.size / sample_rate)
    return WarmUp(rate=rate, time=time, until_s=until)


def _settling(means: FloatArray) -> tuple[float, float, float]:
    """The likeliest exponential beside a line, in white noise and a walk.

    Returns
    -------
    gain, constant, rate
        By how much it raises twice the logarithm of the restricted likelihood, its constant in
        stretches of a mean, and its value at the start.
    """
    place = np.arange(means.size) + 0.5
    constants = np.geomspace(2.0, means.size / 3.0, 40)
    shapes = np.exp(-place[:, np.newaxis] / constants)
    columns = np.column_stack([np.ones(place.size), place / place.size - 0.5, means, shapes])
    # Minus twice the logarithms of the likelihoods, the second with the exponential beside it.
    line_alone, settling = math.inf, (math.inf, 0.0, 0.0)
    for ratio in np.geomspace(1e-5, 1e3, 17):
        white, volume = _whitened(columns, float(ratio))
        line, corner = np.linalg.qr(white[:, :2])
        beside = white[:, 2:] - line @ (line.T @ white[:, 2:])
        observed, settles = beside[:, 0], beside[:, 1:]
        information = (settles**2).sum(axis=0)
        rates = observed @ settles / information
        rest = np.maximum(observed @ observed - rates**2 * information, np.finfo(float).tiny)
        best = int(np.argmin(rest))
        volume += 2.0 * float(np.log(np.abs(np.diag(corner))).sum())
        lacking = (place.size - 2) * np.log([observed @ observed, rest[best]]) + volume
        line_alone = min(line_alone, float(lacking[0]))
        settling = min(settling, (float(lacking[1]), float(constants[best]), float(rates[best])))
    lacking_least, constant, rate = settling
    return line_alone - lacking_least, constant, rate


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
    step, constant = warm_up.rate / sample_rate, sample_rate * warm_up.time
    return less(increments, lambda number: step * np.exp(-(number + 0.5) / constant))
