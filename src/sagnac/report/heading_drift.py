"""Heading, attitude and position after a time without aiding: text, data and a picture."""

from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from sagnac.alignment.align import Unaided
from sagnac.alignment.drift import PARTS, Drift, Growth
from sagnac.alignment.noise import NAMES
from sagnac.coefficients.laws import CoefficientName
from sagnac.plot.frame import BLUE, INK, ORANGE, logarithmic
from sagnac.report.quantities import TITLES, number
from sagnac.report.style import legend_above, styled
from sagnac.units import DEGREE, DEGREE_PER_HOUR, SENSED

_SYMBOLS: Final = dict(
    zip(PARTS, ("N", "B", "K", "initial bias", "accelerometers", "misalignment"), strict=True)
)
# Axis of the gyro, and what is shown of it: unit, its size, title.
_SHOWN: Final = (
    ("heading", "deg", "°", DEGREE),
    ("attitude", "deg", "°", DEGREE),
    ("position", "m", "m", 1.0),
)
# Of the parts in a picture.
_STYLES: Final = ("--", ":", "-.", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 4)))
_RAISED: Final = 1.01  # by upper bounds, from which on they are shown
_SHARE: Final = 0.9  # of the answer, from which on it is the prior alone


def drift_document(unaided: Unaided) -> dict[str, Any]:
    """``heading_drift``, ``attitude``, ``position_unaided`` and ``priors`` for JSON.

    ``sigma_deg`` of a heading drift is what N, B, K and the initial bias make, and accelerometers
    if they were measured; ``heading_deg`` has the azimuth and the tilts at the start besides.
    """
    found, priors = unaided.drift, unaided.drift.priors
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
                "after_s": float(time),
                "sigma_deg": float(sigma / DEGREE),
                "by": _by(found.heading, row, DEGREE, PARTS[:-1]),
                "low_deg": float(sigma / DEGREE * np.exp(-0.5 * reach)),
                "high_deg": float(sigma / DEGREE * np.exp(0.5 * reach)),
                "heading_deg": float(whole / DEGREE),
                "misalignment_deg": _by(found.heading, row, DEGREE, PARTS)["misalignment"],
                "highest_deg": float(highest / DEGREE),
            }
            for row, (time, sigma, reach, whole, highest) in enumerate(
                zip(
                    found.heading.times,
                    found.heading.deviation(misaligned=False),
                    found.heading.reach,
                    found.heading.deviation(),
                    found.heading.highest,
                    strict=True,
                )
            )
        ],
        "attitude": _listed(found.attitude, "deg", DEGREE),
        "position_unaided": _listed(found.position, "m", 1.0),
    }


def _by(growth: Growth, row: int, size: float, parts: tuple[str, ...]) -> dict[str, float]:
    values = dict(zip(PARTS, np.sqrt(growth.variances[row]) / size, strict=True))
    measured = bool(np.any(growth.variances[:, PARTS.index("accelerometers")]))
    return {name: float(values[name]) for name in parts if measured or name != "accelerometers"}


def _listed(growth: Growth, unit: str, size: float) -> list[dict[str, Any]]:
    return [
        {
            "after_s": float(time),
            f"sigma_{unit}": float(sigma / size),
            "by": _by(growth, row, size, PARTS),
            f"highest_{unit}": float(highest / size),
        }
        for row, (time, sigma, highest) in enumerate(
            zip(growth.times, growth.deviation(), growth.highest, strict=True)
        )
    ]


def drift_text(unaided: Unaided) -> str:
    """The priors first, then a line for each time and quantity, and what is left out."""
    found, priors = unaided.drift, unaided.drift.priors
    known = (
        f"from {priors.rest:g} s at rest"
        if priors.bias is None
        else f"{number(priors.bias / DEGREE_PER_HOUR)} °/h or from {priors.rest:g} s at rest"
    )
    lines = [
        f"priors, 1 σ: azimuth {number(priors.azimuth / DEGREE)}°, tilt "
        f"{number(priors.tilt / DEGREE)}°, bias {known}; latitude {unaided.latitude / DEGREE:g}°",
        "without aiding, 1 σ",
    ]
    for row, time in enumerate(found.heading.times):
        heading = found.heading
        sigma = heading.deviation(misaligned=False)[row] / DEGREE
        low, high = (sigma * np.exp(sign * 0.5 * heading.reach[row]) for sign in (-1.0, 1.0))
        lines += [
            f"  after {time:g} s",
            f"    heading drift  {number(sigma)}°  [{number(low)}, {number(high)}] "
            f"{100.0 * unaided.confidence:g} %, by {_split(heading, row, DEGREE, '°', PARTS[:-1])}",
        ]
        for name, _, unit, size in _SHOWN:
            growth: Growth = getattr(found, name)
            lines.append(
                f"    {name:<13}  {number(growth.deviation()[row] / size)} {unit}".replace(
                    " °", "°"
                )
                + f", by {_split(growth, row, size, unit, PARTS)}"
            )
        lines += _at_most(found, row)
    return "\n".join([*lines, *(f"note: {text}" for text in drift_notes(unaided))])


def _split(growth: Growth, row: int, size: float, unit: str, parts: tuple[str, ...]) -> str:
    by = _by(growth, row, size, parts)
    gap = "" if unit == "°" else " "
    return ", ".join(
        f"{_SYMBOLS[name]} {number(value)}{gap}{unit}" for name, value in by.items() if value > 0.0
    )


def _at_most(found: Drift, row: int) -> list[str]:
    """The second, pessimistic line, if upper bounds raise anything."""
    shown = []
    for name, _, unit, size in _SHOWN:
        growth: Growth = getattr(found, name)
        if growth.highest[row] > _RAISED * growth.deviation(misaligned=False)[row]:
            gap = "" if unit == "°" else " "
            shown.append(f"{name} {number(growth.highest[row] / size)}{gap}{unit}")
    return [f"    by the sensors with the worst upper bound: {', '.join(shown)}"] if shown else []


def drift_notes(unaided: Unaided) -> list[str]:
    """Limits of the answer: what it leaves out, and where it is no more than a prior."""
    found, priors = unaided.drift, unaided.drift.priors
    notes = []
    for name in ("heading", "attitude", "position"):
        growth: Growth = getattr(found, name)
        share = np.sqrt(growth.variances[:, -1]) / np.maximum(growth.deviation(), 1e-300)
        times = growth.times[share > _SHARE]
        if times.size:
            shown = ", ".join(f"{time:g} s" for time in times)
            notes.append(f"{name} after {shown} is only the prior of azimuth and tilt")
    if priors.bias is not None and any(priors.bias_is_prior(one) for one in unaided.noises):
        notes.append("the initial bias is only the prior, which the rest does not improve")
    open_names = {
        name
        for noise in unaided.noises
        for name in noise.unseen
        if name != "angle_random_walk" and name not in noise.bounds
    }
    notes += [
        f"{TITLES[name]} was not observable, so that nothing of it is in here"
        for name in sorted(open_names)
    ]
    bounded = {name for noise in unaided.noises for name in noise.bounds}
    notes += [
        f"{TITLES[name]} of {_bounded_axes(unaided, name)} is zero here: "
        "only an upper bound is known"
        for name in sorted(bounded)
    ]
    if len({id(noise) for noise in unaided.noises}) == 1:
        notes.append("one gyro stands for all three axes")
    if not unaided.latitude_stated:
        notes.append("the latitude is not stated; it counts little over minutes")
    left_out = [
        SENSED["accelerometer"].titles[name]
        for name in NAMES
        if any(name in one.unseen for one in unaided.accelerometers)
    ]
    if left_out:
        notes.append(f"{' and '.join(left_out)} of accelerometers: zero, since not estimated")
    ideal = "" if unaided.accelerometers else "accelerometers are ideal, and "
    notes.append(f"{ideal}the vehicle stands still")
    return notes


def _bounded_axes(unaided: Unaided, name: CoefficientName) -> str:
    """The axes of whose gyros a coefficient is bounded only."""
    axes = zip(("north", "east", "down"), unaided.noises, strict=True)
    found = [axis for axis, noise in axes if name in noise.bounds]
    return "all axes" if len(found) == len(unaided.noises) else " and ".join(found)


def drift_figure(unaided: Unaided) -> Figure:
    """Heading drift against time with its interval, what makes it, and the pessimistic line."""
    heading = unaided.along.heading
    sigma = heading.deviation(misaligned=False) / DEGREE
    spread = np.exp(0.5 * heading.reach)
    with styled() as canvas:
        axes = canvas.axes
        axes.plot(heading.times, sigma, color=BLUE, label="heading drift")
        axes.fill_between(
            heading.times, sigma / spread, sigma * spread, color=BLUE, alpha=0.18, linewidth=0.0,
            label=f"its {100 * unaided.confidence:g} % interval",
        )  # fmt: skip
        for place, (name, style) in enumerate(zip(PARTS[:-1], _STYLES, strict=True)):
            part = np.sqrt(heading.variances[:, place]) / DEGREE
            if np.any(part > 0.0):
                axes.plot(
                    heading.times, part, color=INK, linewidth=0.8, linestyle=style,
                    label=f"by {_SYMBOLS[name]}",
                )  # fmt: skip
        if np.any(heading.highest / DEGREE > _RAISED * sigma):
            axes.plot(
                heading.times, heading.highest / DEGREE, color=ORANGE,
                label="with the worst upper bound",
            )  # fmt: skip
        logarithmic(axes, "time without aiding (s)", "heading drift, 1 σ (°)")
        legend_above(axes, columns=3)
    return canvas.figure
