"""An alignment as a figure, as text and as data."""

from dataclasses import replace
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sagnac.alignment.align import Prospect
from sagnac.alignment.azimuth import AzimuthError, azimuth_error
from sagnac.alignment.initial import flicker_deviation
from sagnac.alignment.noise import GyroNoise
from sagnac.plot.frame import BLUE, INK, ORANGE, QUIET, logarithmic
from sagnac.report.quantities import TITLES, number
from sagnac.report.style import legend_above, styled
from sagnac.units import ARCSECOND, DEGREE, DEGREE_PER_HOUR, HOUR

ARCMINUTE: Final = 60.0 * ARCSECOND
SCHEMA: Final = "sagnac.alignment/1"
_SHORTEST_S: Final = 10.0
_SHARE: Final = 0.9  # of the prior, from which on nothing was found


def compass_figure(
    noise: GyroNoise, *, latitude: float, confidence: float, highest_bias_instability: float = 0.0
) -> Figure:
    """Azimuth error of a gyrocompass of two positions over an hour, and what makes it.

    Parameters
    ----------
    noise
        Of the gyro.
    latitude
        rad.
    confidence
        Of the interval.
    highest_bias_instability
        Upper bound of B, rad/s, if B was not estimated; 0 if there is none.
    """
    times = np.geomspace(_SHORTEST_S, HOUR, 181)
    compass = azimuth_error(noise, latitude=latitude, times=times, confidence=confidence)
    highest = GyroNoise(angle_random_walk=0.0, bias_instability=highest_bias_instability)
    bound = azimuth_error(highest, latitude=latitude, times=times, confidence=confidence).floor
    with styled() as canvas:
        axes = canvas.axes
        _draw_compass(axes, compass)
        for floor, label in ((compass.floor, "floor by B"), (bound, "floor by B, at most")):
            if floor > 0.0:
                axes.axhline(
                    floor / ARCMINUTE, color=INK, linewidth=0.9, linestyle=":", label=label
                )
        _label_axes(axes, latitude)
        legend_above(axes, columns=3)
    return canvas.figure


def azimuth_figure(prospect: Prospect) -> Figure:
    """Azimuth error against time, what N, B and K make of it, and the filter's."""
    with styled() as canvas:
        axes = canvas.axes
        _draw_compass(axes, prospect.compass)
        axes.plot(
            prospect.filtered.times, prospect.filtered.azimuth / ARCMINUTE, color=ORANGE,
            label="Kalman filter, one position",
        )  # fmt: skip
        _label_axes(axes, prospect.latitude)
        legend_above(axes, columns=3)
    return canvas.figure


def _draw_compass(axes: Axes, compass: AzimuthError) -> None:
    """A gyrocompass with its interval, and dashed what each of N, B and K makes of it."""
    axes.plot(
        compass.times, compass.deviation / ARCMINUTE, color=BLUE,
        label="gyrocompass, two positions",
    )  # fmt: skip
    axes.fill_between(
        compass.times, compass.low / ARCMINUTE, compass.high / ARCMINUTE,
        color=BLUE, alpha=0.18, linewidth=0.0,
        label=f"its {100 * compass.confidence:g} % interval",
    )  # fmt: skip
    parts = {
        symbol: np.sqrt(compass.parts[:, place]) / ARCMINUTE
        for place, symbol in enumerate("NBK")
        if np.any(compass.parts[:, place] > 0.0)
    }
    if len(parts) < 2:
        return  # One term alone is the whole.
    for symbol, part in parts.items():
        axes.plot(compass.times, part, color=QUIET, linewidth=0.8, linestyle="--")
        axes.annotate(symbol, (compass.times[0], part[0]), color=INK, fontsize=8.5)


def _label_axes(axes: Axes, latitude: float) -> None:
    across = "time of alignment (s)"
    logarithmic(axes, across, f"azimuth error at {latitude / DEGREE:g}°, 1 σ (′)")


def prospect_text(prospect: Prospect) -> str:
    """The answer first, then what it rests on."""
    compass, filtered = prospect.compass, prospect.filtered
    last = compass.deviation[-1] / ARCMINUTE
    low, high = compass.low[-1] / ARCMINUTE, compass.high[-1] / ARCMINUTE
    turning = []
    if prospect.rotating is not None:
        ends = (prospect.rotating.low[0], prospect.rotating.high[0])
        shown = ", ".join(number(end / ARCMINUTE) for end in ends)
        turning = [
            f"  triad turning all the time    {number(prospect.rotating.deviation[0] / ARCMINUTE)}′"
            f"  [{shown}] {100.0 * compass.confidence:g} %"
        ]
    lines = [
        f"azimuth after {compass.times[-1]:g} s at {prospect.latitude / DEGREE:g}°, 1 σ",
        f"  gyrocompass, two positions    {number(last)}′  [{number(low)}, {number(high)}] "
        f"{100.0 * compass.confidence:g} %",
        f"    its floor by B              {_floor(prospect)}",
        *_at_most(prospect),
        f"  Kalman filter, one position   {number(filtered.azimuth[-1] / ARCMINUTE)}′",
        *turning,
        f"position {prospect.position.times[-1]:g} s after the filter's alignment  "
        f"{number(prospect.position.deviation[-1])} m, 1 σ",
        "for the filter, of each gyro",
        f"  process noise N²              {number(prospect.noise.angle_random_walk**2)} rad²/s",
        f"  a priori drift                {number(_drift(prospect) / DEGREE_PER_HOUR)} °/h",
        f"  drift's process noise K²      {number(prospect.noise.rate_random_walk**2)} rad²/s³",
    ]
    lines += [f"note: {text}" for text in notes_of(prospect)]
    return "\n".join(lines)


def notes_of(prospect: Prospect) -> list[str]:
    """Limits of the answer."""
    unseen = prospect.noise.unseen
    notes = [prospect.foretold] if prospect.foretold else []
    notes += [
        f"{TITLES[name]} was not estimated and is taken as zero"
        + (", and as its upper bound in the second figure" if name in prospect.noise.bounds else "")
        for name in unseen
        if name != "angle_random_walk"
    ]
    if "angle_random_walk" in unseen:
        notes.append("N is an upper bound, and so is the azimuth error that it makes")
    prior, filtered = prospect.start.azimuth, prospect.filtered.azimuth[-1]
    if filtered > _SHARE * prior:
        notes.append(
            f"the filter's azimuth is only the prior of {number(prior / DEGREE)}°: these gyros do "
            "not find it in that time"
        )
    if prospect.start.drift == 0.0:
        notes.append("the bias is taken as known except for its flicker; accelerometers are ideal")
    return notes


def prospect_document(prospect: Prospect) -> dict[str, Any]:
    """The same as JSON, schema ``sagnac.alignment/1``, SI except where a key names its unit."""
    compass, filtered, highest = prospect.compass, prospect.filtered, _highest(prospect)
    return {
        "schema": SCHEMA,
        "latitude_deg": prospect.latitude / DEGREE,
        "confidence": compass.confidence,
        "gyrocompass": {
            "time_s": compass.times.tolist(),
            "azimuth_arcmin": (compass.deviation / ARCMINUTE).tolist(),
            "low_arcmin": (compass.low / ARCMINUTE).tolist(),
            "high_arcmin": (compass.high / ARCMINUTE).tolist(),
            "floor_arcmin": compass.floor / ARCMINUTE,
            "highest_arcmin": (highest.deviation / ARCMINUTE).tolist(),
            "highest_floor_arcmin": highest.floor / ARCMINUTE,
        },
        "filter": {
            "time_s": filtered.times.tolist(),
            "azimuth_arcmin": (filtered.azimuth / ARCMINUTE).tolist(),
            "process_noise_rad2_per_s": prospect.noise.angle_random_walk**2,
            "drift_deviation_rad_per_s": _drift(prospect),
            "drift_process_noise_rad2_per_s3": prospect.noise.rate_random_walk**2,
            "covariance": filtered.covariance.tolist(),
        },
        **_turning(prospect),
        "position": {
            "time_s": prospect.position.times.tolist(),
            "deviation_m": prospect.position.deviation.tolist(),
        },
        "notes": notes_of(prospect),
    }


def _turning(prospect: Prospect) -> dict[str, Any]:
    """The triad that turns, if a table rate was given."""
    found = prospect.rotating
    if found is None:
        return {}
    return {
        "rotating_triad": {
            "time_s": float(found.times[0]),
            "azimuth_arcmin": float(found.deviation[0] / ARCMINUTE),
            "low_arcmin": float(found.low[0] / ARCMINUTE),
            "high_arcmin": float(found.high[0] / ARCMINUTE),
        }
    }


def _highest(prospect: Prospect) -> AzimuthError:
    """The gyrocompass with the worst upper bound of what was not estimated in the place of zero."""
    found = [
        azimuth_error(
            noise,
            latitude=prospect.latitude,
            times=prospect.compass.times,
            confidence=prospect.compass.confidence,
        )
        for noise in prospect.noise.bounded
    ]
    worst = max(found, key=lambda one: float(one.deviation[-1]))
    return replace(worst, floor=max(one.floor for one in found))


def _at_most(prospect: Prospect) -> list[str]:
    """The second, pessimistic figure, if there is an upper bound."""
    if not prospect.noise.bounds:
        return []
    highest = _highest(prospect)
    return [
        f"    with the worst upper bound  {number(highest.deviation[-1] / ARCMINUTE)}′, "
        f"floor {number(highest.floor / ARCMINUTE)}′"
    ]


def _floor(prospect: Prospect) -> str:
    if "bias_instability" in prospect.noise.unseen:
        return "not known, since B was not estimated"
    return f"{number(prospect.compass.floor / ARCMINUTE)}′"


def _drift(prospect: Prospect) -> float:
    return float(np.hypot(prospect.start.drift, flicker_deviation(prospect.noise)))
