"""An alignment, and heading, attitude and position without aiding: text, data and figures."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import per_cent
from sagnac.core.units import ARCSECOND, DEGREE, DEGREE_PER_HOUR, HOUR
from sagnac.navigation.align import Prospect, Unaided
from sagnac.navigation.drift import PARTS, Growth, bias_is_prior
from sagnac.navigation.error_model import AzimuthError, azimuth_error, drift_deviation
from sagnac.navigation.noise import NAMES, GyroNoise
from sagnac.noise.laws import CoefficientName
from sagnac.report.figures import styled
from sagnac.report.frame import BLUE, INK, ORANGE, QUIET, band, logarithmic
from sagnac.report.sections import rendered

# ---- alignment ---------------------------------------------------------------------

ARCMINUTE: Final = 60.0 * ARCSECOND
SCHEMA: Final = "sagnac.alignment/1"
_HALF_TURN: Final = 180.0 * DEGREE / ARCMINUTE  # beyond it, an azimuth is not found at all
_SHARE: Final = 0.9  # of a prior in an answer, from which on nothing else was found


def compass_figure(noise: GyroNoise, *, latitude: float, confidence: float) -> Figure:
    """Azimuth error of a gyrocompass of two positions over an hour, and what makes it.

    Parameters
    ----------
    noise
        Of the gyro; if B has an upper bound only, the floor by that is drawn.
    latitude
        rad.
    confidence
        Of the interval.
    """
    times = np.geomspace(10.0, HOUR, 181)
    compass = azimuth_error(noise, latitude=latitude, times=times, confidence=confidence)
    flicker = noise.bounds.get("bias_instability", 0.0)
    highest = GyroNoise(angle_random_walk=0.0, bias_instability=flicker)
    bound = azimuth_error(highest, latitude=latitude, times=times, confidence=confidence).floor
    with styled(3) as (figure, axes):
        _draw_compass(axes, compass)
        for floor, label in ((compass.floor, "floor by B"), (bound, "floor by B, at most")):
            if floor > 0.0:
                level = floor / ARCMINUTE
                axes.axhline(level, color=INK, linewidth=0.9, linestyle=":", label=label)
        _label_axes(axes, latitude)
    return figure


def azimuth_figure(prospect: Prospect) -> Figure:
    """Azimuth error against time, what N, B and K make of it, and the filter's."""
    with styled(3) as (figure, axes):
        _draw_compass(axes, prospect.compass)
        azimuth = prospect.filtered.deviation / ARCMINUTE
        label = "Kalman filter, one position"
        axes.plot(prospect.filtered.times, azimuth, color=ORANGE, label=label)
        _label_axes(axes, prospect.latitude)
    return figure


def _draw_compass(axes: Axes, compass: AzimuthError) -> None:
    """A gyrocompass with its interval, and dashed what each of N, B and K makes of it."""
    ends = (compass.deviation, compass.low, compass.high)
    deviation, low, high = (one / ARCMINUTE for one in ends)
    interval = f"its {per_cent(compass.confidence)} interval"
    axes.plot(compass.times, deviation, color=BLUE, label="gyrocompass, two positions")
    band(axes, compass.times, low, high, BLUE, alpha=0.18, label=interval)
    if high.max() > _HALF_TURN:
        axes.axhline(_HALF_TURN, color=INK, linestyle="-.", label="half a turn: no heading")
    parts = np.sqrt(compass.parts.T) / ARCMINUTE
    there = [(symbol, part) for symbol, part in zip("NBK", parts, strict=True) if part.any()]
    # One term alone is the whole.
    for symbol, part in there if len(there) > 1 else ():
        axes.plot(compass.times, part, color=QUIET, linewidth=0.8, linestyle="--")
        # N falls and K rises: each is named at the end where it stands apart.
        at, side = {"N": (0, "left"), "B": (part.size // 2, "center"), "K": (-1, "right")}[symbol]
        axes.annotate(symbol, (compass.times[at], part[at]), color=INK, fontsize=8.5, ha=side)


def _label_axes(axes: Axes, latitude: float) -> None:
    logarithmic(axes, "time of alignment (s)", f"azimuth error at {latitude / DEGREE:g}°, 1 σ (′)")


def prospect_text(prospect: Prospect) -> str:
    """The answer first, then what it rests on."""
    shown, noise = prospect_document(prospect), prospect.noise
    return rendered("azimuth.txt", shown=shown, noise=noise, raised=_RAISED, **_phrases([noise]))


def _phrases(noises: Sequence[GyroNoise]) -> dict[str, str]:
    """Why an interval is wide, and what it is without: slow noise of which nothing is known."""
    # N that is bounded is taken at its bound.
    bounded = {name for one in noises for name in one.bounds}
    unknown = {name for one in noises for name in {*one.unseen} - {*one.bounds}}
    wide, without = (
        [symbol for name, symbol in zip(NAMES[1:], "BK", strict=True) if name in names]
        for names in (bounded, unknown)
    )
    have = "have upper bounds" if len(wide) > 1 else "has an upper bound"
    return {
        "wide": f" ({' and '.join(wide)} {have} only)" if wide else "",
        "without": f", without {' and '.join(without)}" if without else "",
    }


def prospect_document(prospect: Prospect) -> dict[str, Any]:
    """The same as JSON, schema ``sagnac.alignment/1``, SI except where a key names its unit.

    ``notes`` are limits of the answer.
    """
    compass, filtered, highest = prospect.compass, prospect.filtered, _highest(prospect)
    turning = {} if prospect.rotating is None else _azimuths(prospect.rotating)
    return {
        "schema": SCHEMA,
        "latitude_deg": prospect.latitude / DEGREE,
        "confidence": compass.confidence,
        "gyrocompass": {
            **_azimuths(compass),
            "floor_arcmin": compass.floor / ARCMINUTE,
            "highest_arcmin": (highest.deviation / ARCMINUTE).tolist(),
            "highest_floor_arcmin": highest.floor / ARCMINUTE,
        },
        "filter": {
            "time_s": filtered.times.tolist(),
            "azimuth_arcmin": (filtered.deviation / ARCMINUTE).tolist(),
            "process_noise_rad2_per_s": prospect.noise.angle_random_walk**2,
            "drift_deviation_rad_per_s": drift_deviation(prospect.noise, prospect.start),
            "drift_process_noise_rad2_per_s3": prospect.noise.rate_random_walk**2,
            "covariance": filtered.covariance.tolist(),
        },
        **({"rotating_triad": {key: one[0] for key, one in turning.items()}} if turning else {}),
        "position": {
            "time_s": prospect.position.times.tolist(),
            "deviation_m": prospect.position.deviation.tolist(),
        },
        "notes": rendered("azimuth_notes.txt", prospect=prospect, share=_SHARE).splitlines(),
    }


def _azimuths(azimuth: AzimuthError) -> dict[str, list[float]]:
    """Times, azimuth errors and the ends of their intervals."""
    errors = {"azimuth": azimuth.deviation, "low": azimuth.low, "high": azimuth.high}
    in_minutes = {f"{name}_arcmin": (one / ARCMINUTE).tolist() for name, one in errors.items()}
    return {"time_s": azimuth.times.tolist(), **in_minutes}


def _highest(prospect: Prospect) -> AzimuthError:
    """The gyrocompass with the worst upper bound of what was not estimated in the place of zero."""
    how = {"latitude": prospect.latitude, "confidence": prospect.compass.confidence}
    times = prospect.compass.times
    azimuths = [azimuth_error(noise, times=times, **how) for noise in prospect.noise.bounded]
    worst = max(azimuths, key=lambda one: float(one.deviation[-1]))
    return replace(worst, floor=max(one.floor for one in azimuths))


# ---- heading drift -----------------------------------------------------------------

_NAMES: Final = ("N", "B", "K", "Markov rate", "initial bias", "accelerometers", "misalignment")
_SYMBOLS: Final = dict(zip(PARTS, _NAMES, strict=True))
# Line styles of the parts in a picture.
_STYLES: Final = ("--", ":", "-.", (0, (8, 2)), (0, (5, 1, 1, 1, 1, 1)), (0, (1, 4)))
# Parts that are named only if they are there.
_OPTIONAL: Final = ("markov_rate", "accelerometers")
_RAISED: Final = 1.01  # by upper bounds, from which on they are shown


def drift_document(unaided: Unaided) -> dict[str, Any]:
    """``heading_drift``, ``attitude``, ``position_unaided`` and ``priors`` for JSON.

    ``sigma_deg`` of a heading drift is what N, B, K and the initial bias make, and accelerometers
    if they were measured; ``heading_deg`` has the azimuth and the tilts at the start besides.
    """
    drift, priors = unaided.drift, unaided.drift.priors
    heading, sigma = drift.heading, drift.heading.deviation(misaligned=False) / DEGREE
    low, high = (one / DEGREE for one in heading.interval)
    drifts = {
        "after_s": heading.times,
        "sigma_deg": sigma,
        "low_deg": low,
        "high_deg": high,
        "heading_deg": heading.deviation() / DEGREE,
        "highest_deg": heading.highest / DEGREE,
    }
    return {
        "priors": {
            "azimuth_deg": priors.azimuth / DEGREE,
            "tilt_deg": priors.tilt / DEGREE,
            "rest_s": priors.rest,
            "bias_deg_per_h": None if priors.bias is None else priors.bias / DEGREE_PER_HOUR,
            "latitude_deg": unaided.latitude / DEGREE,
        },
        "heading_drift": [
            {
                **values,
                "by": _by(heading, row, DEGREE, PARTS[:-1]),
                "misalignment_deg": _by(heading, row, DEGREE, PARTS)["misalignment"],
            }
            for row, values in enumerate(_rows(drifts))
        ],
        "attitude": _listed(drift.attitude, "deg", DEGREE),
        "position_unaided": _listed(drift.position, "m", 1.0),
    }


def _by(growth: Growth, row: int, size: float, parts: tuple[str, ...]) -> dict[str, float]:
    values = dict(zip(PARTS, np.sqrt(growth.variances[row]) / size, strict=True))
    there = np.any(growth.variances > 0.0, axis=0)
    named = [name for name in parts if name not in _OPTIONAL or there[PARTS.index(name)]]
    return {name: float(values[name]) for name in named}


def _listed(growth: Growth, unit: str, size: float) -> list[dict[str, Any]]:
    # Both with the misalignment at the start.
    columns = {
        "after_s": growth.times,
        f"sigma_{unit}": growth.deviation() / size,
        f"highest_{unit}": np.hypot(growth.highest, np.sqrt(growth.variances[:, -1])) / size,
    }
    rows = enumerate(_rows(columns))
    return [{**values, "by": _by(growth, row, size, PARTS)} for row, values in rows]


def _rows(columns: Mapping[str, FloatArray]) -> list[dict[str, float]]:
    """Columns of one length as a mapping a row."""
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def drift_text(unaided: Unaided) -> str:
    """The priors first, then a line for each time and quantity, and what is left out."""
    shown, notes = drift_document(unaided), drift_notes(unaided)
    more = {"percent": per_cent(unaided.confidence), "symbols": _SYMBOLS, "zip": zip}
    more |= _phrases(unaided.noises)
    return rendered("drift.txt", shown=shown, notes=notes, raised=_RAISED, **more)


def drift_notes(unaided: Unaided) -> list[str]:
    """Limits of the answer: what it leaves out, and where it is no more than a prior."""
    drift, priors = unaided.drift, unaided.drift.priors
    alone = {}
    for name in ("heading", "attitude", "position"):
        growth: Growth = getattr(drift, name)
        share = np.sqrt(growth.variances[:, -1]) / np.maximum(growth.deviation(), 1e-300)
        alone[name] = growth.times[share > _SHARE].tolist()
    unseen = {name for one in unaided.noises for name in one.unseen if name not in one.bounds}
    return rendered(
        "drift_notes.txt",
        unaided=unaided,
        names=NAMES,
        alone=alone,
        bias_is_prior=any(bias_is_prior(one, priors) for one in unaided.noises),
        unseen=unseen - {"angle_random_walk"},
        bounded={name: _bounded_axes(unaided, name) for name in NAMES},
    ).splitlines()


def _bounded_axes(unaided: Unaided, name: CoefficientName) -> tuple[str, str]:
    """The axes of whose gyros a coefficient is bounded only: those without it, and with it."""
    axes = dict(zip(("north", "east", "down"), unaided.noises, strict=True))

    def shown(there: bool) -> str:
        bounded = {axis: noise for axis, noise in axes.items() if name in noise.bounds}
        named = [axis for axis, noise in bounded.items() if (getattr(noise, name) > 0.0) == there]
        return "all axes" if len(named) == len(axes) else " and ".join(named)

    return shown(False), shown(True)


def drift_figure(unaided: Unaided) -> Figure:
    """Heading drift against time with its interval, what makes it, and the pessimistic line."""
    heading, times = unaided.along.heading, unaided.along.heading.times
    sigma = heading.deviation(misaligned=False) / DEGREE
    low, high = (one / DEGREE for one in heading.interval)
    interval = f"its {per_cent(unaided.confidence)} interval"
    with styled(3) as (figure, axes):
        axes.plot(times, sigma, color=BLUE, label="heading drift")
        band(axes, times, low, high, BLUE, alpha=0.18, label=interval)
        for place, (name, style) in enumerate(zip(PARTS[:-1], _STYLES, strict=True)):
            part = np.sqrt(heading.variances[:, place]) / DEGREE
            if np.any(part > 0.0):
                label = f"by {_SYMBOLS[name]}"
                axes.plot(times, part, color=INK, linewidth=0.8, linestyle=style, label=label)
        highest = heading.highest / DEGREE
        if np.any(highest > _RAISED * sigma):
            axes.plot(times, highest, color=ORANGE, label="with the worst upper bound")
        logarithmic(axes, "time without aiding (s)", "heading drift, 1 σ (°)")
    return figure
