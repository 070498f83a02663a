"""Self-noise of several gyros as text, as a figure and for JSON."""

import math
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from sagnac import plot
from sagnac.arrays import FloatArray
from sagnac.coefficients.self_noise import SelfNoise
from sagnac.report.figures import legend_above, styled
from sagnac.report.quantities import in_field_unit, sentence
from sagnac.report.text import table
from sagnac.units import DEGREE_PER_HOUR, field_unit


def self_noise_text(found: SelfNoise, band: tuple[float, float]) -> str:
    """N of each gyro alone, and the gain with which it senses what all share."""
    rows = [
        (name, sentence("angle_random_walk", walk, plain=True), f"{gain:.5g}")
        for (name, walk), gain in zip(found.angle_random_walk.items(), found.gains, strict=True)
    ]
    said = f"Self-noise from the cross spectra of {len(rows)} gyros, {band[0]:g} to {band[1]:g} Hz"
    return f"{said}\n{table(('gyro', 'ARW of it alone', 'gain'), rows)}"


def self_noise_figure(found: SelfNoise) -> Figure:
    """Noise density of each alone, and what all share."""
    with styled() as canvas:
        plot.self_noise(found, canvas.axes)
        legend_above(canvas.axes, columns=4)
    return canvas.figure


def self_noise_data(found: SelfNoise) -> dict[str, Any]:
    """The same for JSON: ``self_noise``, in the field's units; what cannot be told is None."""

    def plain(values: FloatArray) -> list[float | None]:
        return [float(value) if math.isfinite(value) else None for value in values]

    gyros = {}
    for place, (name, estimate) in enumerate(found.angle_random_walk.items()):
        walk = in_field_unit("angle_random_walk", estimate)
        value, low, high = plain(np.array([walk.value, walk.low, walk.high]))
        gyros[name] = {
            "angle_random_walk": {
                "value": value,
                "low": low,
                "high": high,
                "confidence": walk.confidence,
                "unit": field_unit("angle_random_walk").name,
                "status": walk.status,
            },
            "gain": plain(found.gains)[place],
            **{
                key: plain(values[place] / DEGREE_PER_HOUR**2)
                for key, values in (
                    ("density", found.density),
                    ("low", found.low),
                    ("high", found.high),
                )
            },
        }
    return {
        "self_noise": {
            "unit": "(deg/h)^2/Hz",
            "frequency_hz": found.frequency.tolist(),
            "motion": plain(found.motion / DEGREE_PER_HOUR**2),
            "gyros": gyros,
        }
    }
