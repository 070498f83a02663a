"""Basis of the answer, low-pass and readout of the sensor, as plain data in the field's units."""

from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from sagnac.analysis.result import Analysis, Part, answer_coefficients
from sagnac.core.arrays import FloatArray, extent
from sagnac.core.units import DEGREE, DEGREE_PER_HOUR, SENSED, field_unit
from sagnac.noise.band_models import ORDERS
from sagnac.noise.estimates import Interval
from sagnac.noise.laws import STOCHASTIC_NAMES, rate_density_basis
from sagnac.noise.slow_model import untold
from sagnac.quality.profile import changes_of
from sagnac.quality.readout import step_shown
from sagnac.recording.channel import unit_of_samples


def choice_data(analysis: Analysis) -> dict[str, Any]:
    """Basis of the answer.

    ``band_hz`` [low, high], ``terms``, ``share``, ``member`` and ``slow_terms``. If the member is
    ``both``, the value is of the likelihood of the whole band, and band, terms and share are of the
    average that the interval holds as well. `slow_terms` says what B and K are of:
    ``average``, ``whole band``, or ``low band``: a likelihood fit to the lowest frequencies.

    Returns
    -------
    dict
        Empty if the answer is of no average, or no band shows it.
    """
    choice = analysis.average
    if choice is None or not choice.terms:
        return {}
    data = {name: getattr(choice, name) for name in ("share", "member", "slow_terms")}
    return {"band_hz": list(choice.band_hz), "terms": list(choice.terms), **data}


def parts_data(analysis: Analysis) -> list[dict[str, Any]]:
    """The answer over parts: ``start_s``, ``stop_s``, and ``value``, ``low``, ``high``.

    Returns
    -------
    list of dict
        In order of time, angle random walk in the unit of the field; NaN if a part does not show
        it.
    """
    size = field_unit("angle_random_walk").size
    spans = ({"start_s": part.start_s, "stop_s": part.stop_s} for part in analysis.parts)
    return [span | _ends(part, size) for span, part in zip(spans, analysis.parts, strict=True)]


def shares_data(analysis: Analysis) -> dict[str, Any]:
    """Share of each gyro in the table's rate: ``share``, ``bias_deg_per_h``, ``asymmetry``.

    Returns
    -------
    dict
        By gyro, each with ``value``, ``low`` and ``high``, or None where it cannot be told.
    """
    return {
        name: {
            "share": _ends(one.share),
            "bias_deg_per_h": _ends(one.bias, DEGREE_PER_HOUR),
            "asymmetry": _ends(one.asymmetry),
            "confidence": one.confidence,
        }
        for name, one in analysis.shares.items()
    }


def triad_data(analysis: Analysis) -> dict[str, Any] | None:
    """Scale factor and axes of three gyros on a turning table.

    Returns
    -------
    dict or None
        ``scale``, and ``angles_deg`` between each gyro's axis and the table's, by gyro, each with
        ``value``, ``low`` and ``high``.
    """
    triad = analysis.triad
    if triad is None:
        return None
    angles = {name: _ends(one, DEGREE) for name, one in triad.angles.items()}
    return {"scale": _ends(triad.scale), "angles_deg": angles}


def _ends(interval: Interval | Part | None, size: float = 1.0) -> Any:
    """Value, low and high in units of a size; None of nothing."""
    return interval and {name: getattr(interval, name) / size for name in ("value", "low", "high")}


def covariance_data(analysis: Analysis) -> dict[str, Any] | None:
    """Joint covariance of the estimated coefficients: ``names``, ``units`` and ``matrix``.

    Returns
    -------
    dict or None
        Each entry of the matrix in the product of the units of its row and column; None if there
        is no average.
    """
    covariance = analysis.covariance
    if covariance is None:
        return None
    sensor = analysis.sensor
    units = [field_unit(name, sensor) for name in covariance.names]
    sizes = np.array([unit.size for unit in units])
    return {
        "names": [SENSED[sensor].keys[name] for name in covariance.names],
        "units": [unit.name for unit in units],
        "matrix": (covariance.matrix / sizes / sizes[:, np.newaxis]).tolist(),
    }


def low_pass_data(analysis: Analysis) -> dict[str, dict[str, float]]:
    """The Butterworth low-pass that the spectrum of one gyro or accelerometer shows.

    The rate density over N, B and K falls as ``1/(1 + (tan(pi f/r)/tan(pi c/r))^(2 order))`` behind
    a filter of corner c that works at the sample rate r, and nearly so behind any of its order.
    Steps of a rate are read out behind the filter, and stay level.

    Parameters
    ----------
    analysis
        Of one channel, with its spectrum.

    Returns
    -------
    dict
        ``low_pass`` with ``corner_hz`` (-3 dB) and ``order``; empty if there is none.
    """
    walk, choice = analysis.angle_random_walk, analysis.average
    # Fits under a low-pass have a fifth of the weight or more if there is one.
    if choice is None or choice.falls < 0.2 or walk.status != "estimated":
        return {}
    frequency, density = analysis.spectrum.frequency, analysis.spectrum.density
    rate, gyro = analysis.recording.sample_rate, analysis.settings.gyros[0]
    sound = (frequency > 0.0) & (frequency < 0.49 * rate) & (density > 0.0)
    frequency, density = frequency[sound], density[sound]
    coefficients = answer_coefficients(analysis)
    terms = [coefficients.get(name) for name in STOCHASTIC_NAMES[1:]]
    squares = [one.value**2 if one and one.status == "estimated" else 0.0 for one in terms]
    laws = rate_density_basis(frequency, 1.0 / rate)[:, 1:]
    channel, added = analysis.recording.gyro(gyro), 0.0
    if channel.kind == "rate" and not analysis.is_pair:
        # Square of what the readout steps of a rate add to N.
        added = step_shown(channel) ** 2 / 12.0 / rate
    # If N is less than that, an angle was counted.
    steps = (added if added < walk.value**2 else 0.0) * laws[:, 0]
    filtered = laws @ squares - steps
    share = (density - steps) / filtered
    # At the highest frequencies a low-pass leaves less than half of N.
    if not share.size or not float(np.median(share[-5:])) < 0.5:
        return {}
    # What is left below a hundredth is a floor of another kind, such as steps of the readout.
    clear = share > np.maximum(0.01, steps / filtered)
    _, corner, order = min(_fitted(frequency[clear], share[clear], rate, one) for one in ORDERS)
    return {"low_pass": {"corner_hz": corner, "order": order}}


def readout_data(analysis: Analysis) -> dict[str, dict[str, dict[str, float | str]]]:
    """Step and range that the samples show, for JSON: ``readout``, by gyro or accelerometer.

    ``step``, and ``range`` if samples pile up at its ends, with their ``unit``: of a rate, or of
    the angle that samples are or add up to. ``{}`` if they show neither.
    """
    clipped = {note.channel for note in analysis.findings if note.name == "clipping"}
    readouts: dict[str, dict[str, float | str]] = {}
    for name in analysis.settings.gyros:
        channel = analysis.recording.gyro(name)
        unit = unit_of_samples(name, channel.kind, channel.sensor)
        sizes_si = {"step": step_shown(channel)}
        if name in clipped:
            sizes_si["range"] = max(map(abs, extent(changes_of(channel))))
        sizes = {what: value / unit.size for what, value in sizes_si.items() if value > 0.0}
        if sizes:
            readouts[name] = {**sizes, "unit": unit.name}
    return {"readout": readouts} if readouts else {}


def slow_noise_data(analysis: Analysis) -> dict[str, dict[str, Any]]:
    """Slow noise of a sensor at rest where B and K are bounds at most, for JSON: ``slow_noise``.

    ``bias_instability`` and ``rate_random_walk`` (by their titles) with ``value`` and ``unit``, and
    ``markov``, None or ``deviation`` {value, low, high, unit} and ``correlation_time_s`` {value,
    low, high}, and if there are two Markov rates the longer as ``second_markov``. Together with N
    they are what the levels of the spectrum show; ``{}`` if there is no such noise.
    """
    if analysis.table_rate is not None:
        return {}
    curve, terms = analysis.curve_of_answer or analysis.curve, answer_coefficients(analysis)
    model = untold(analysis.levels, analysis.average, terms, curve)
    if model is None:
        return {}
    sensed, sensor = SENSED[analysis.sensor], analysis.sensor
    data: dict[str, Any] = {"markov": None}
    for name in ("bias_instability", "rate_random_walk"):
        unit = field_unit(name, sensor)
        data[sensed.keys[name]] = {"value": getattr(model, name) / unit.size, "unit": unit.name}
    unit = field_unit("bias_instability", sensor)
    for key, rate in zip(("markov", "second_markov"), model.rates, strict=False):
        data[key] = {
            "deviation": {**_ends(rate.deviation, unit.size), "unit": unit.name},
            "correlation_time_s": _ends(rate.correlation_time),
        }
    return {"slow_noise": data}


def _fitted(
    frequency: FloatArray, share: FloatArray, rate: float, order: int
) -> tuple[float, float, int]:
    """Misfit of a filter of an order, bins counted by their width, its corner, and the order.

    The misfit is that of amplitudes. Only a digital Butterworth filter has a zero at half the
    sample rate: logarithms would let the highest bins rule, and put the corner of an analogue
    filter, or of an exponential average, two times too high.
    """
    warped = np.tan(np.pi * frequency / rate)

    def missed(logarithm: float) -> float:
        corner = np.tan(np.pi * np.exp(logarithm) / rate)
        passed = 1.0 / np.sqrt(1.0 + (warped / corner) ** (2 * order))
        return float(frequency @ (np.sqrt(share) - passed) ** 2)

    bounds = (np.log(frequency[0]), np.log(0.499 * rate))
    best = minimize_scalar(missed, bounds=bounds, method="bounded", options={"xatol": 1e-4})
    return float(best.fun), float(np.exp(best.x)), order
