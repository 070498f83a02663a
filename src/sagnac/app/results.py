"""An analysis as plain data: its figures as the report draws them, its answer, its lines."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

import sagnac
from sagnac.app import stated
from sagnac.app.looks import noted, numbers

_PER_HOUR: Final = math.degrees(3600.0)
_FIGURES: Final[dict[str, Callable[..., Axes]]] = {
    "stability": sagnac.plot.stability,
    "spectrum": sagnac.plot.spectrum,
    "parts": sagnac.plot.parts,
    "residual": sagnac.plot.residual,
    "angle": sagnac.plot.residual_by_angle,
    "orders": sagnac.plot.orders,
}
# A line of a drawing with nothing of its own.
_PLAIN: Final = {"width": 0.9, "dash": False, "marker": "", "size": 0.0, "alpha": 1.0, "label": ""}


def result(analysis: sagnac.Analysis, specification: str = "") -> dict[str, Any]:
    """Everything that the page shows of an analysis: a part for each gyro and accelerometer."""
    channels = [_channel(one, "gyro") for one in analysis.each]
    channels += [_channel(one, "accelerometer") for one in analysis.accelerometers.values()]
    each = analysis.refused.items()
    refused = [f"{name} was not analyzed: {stated.line(error)}" for name, error in each]
    judged: list[dict[str, str]] = []
    try:
        judged = verdict(analysis, specification) if specification else []
    except (ValueError, OSError) as error:
        # The answer stands without it, and the page judges again when the limit is corrected.
        refused.append(stated.line(error))
    return {
        "channels": channels,
        "refused": refused,
        "notes": [noted(note) for note in analysis.notes],
        "seconds": dict(analysis.seconds),
        "verdict": judged,
    }


def verdict(analysis: sagnac.Analysis, specification: str) -> list[dict[str, str]]:
    """Every limit beside every gyro.

    ValueError if the text states no limits.
    """
    judged = sagnac.judge(analysis, specification).judgements
    return [{"gyro": one.gyro, "decision": one.decision, "reason": one.reason} for one in judged]


def _channel(analysis: sagnac.Analysis, sensor: str) -> dict[str, Any]:
    # Each gyro of a triad on a table; the answer is that of a pair of them.
    of_each = analysis.per_gyro if analysis.is_pair else {}
    return {
        "name": analysis.channel,
        "sensor": sensor,
        "source": analysis.source,
        "answer": _estimate(analysis.angle_random_walk),
        "of_each": {name: _estimate(one)["text"] for name, one in of_each.items()},
        "coefficients": {name: _estimate(one) for name, one in analysis.coefficients.items()},
        "lines": lines(analysis),
        "figures": figures(analysis),
        "curve": curve(analysis.curve),
    }


def lines(analysis: sagnac.Analysis) -> list[dict[str, Any]]:
    """The lines that were removed, strongest first, where they stand in Hz."""
    turning = abs(analysis.table_rate or 0.0) / (2.0 * math.pi)
    unit, symbol = ("arcsec", "″") if analysis.sensor == "gyro" else ("m/s", " m/s")
    return [
        {
            **{key: getattr(one, key) for key in ("scale", "frequency", "channel", "name")},
            "hz": one.frequency * (turning if one.scale == "angle" else 1.0),
            **dict(zip(("amplitude", "error"), one.amplitude_in(unit), strict=True)),
            "unit": symbol,
        }
        for one in analysis.lines
    ]


def tried(analysis: sagnac.Analysis, request: dict[str, Any], before: Any) -> dict[str, Any]:
    """N with the lines of some numbers put back and some bands masked, and what is drawn of it.

    `before` keeps, by channel, what is the same each time. RecordingError if the analysis rests on
    no levels, or too few are left.
    """
    left_in = [analysis.lines[number] for number in request["off"]]
    masked = [(float(low), float(high)) for low, high in request["bands"]]
    kept = before.get(request["channel"])
    trial = sagnac.trial(analysis, left_in=left_in, masked=masked, before=kept)
    before[request["channel"]] = trial.before
    again = replace(analysis, curve=trial.curve, spectrum=trial.spectrum)
    return {
        "asked": request,
        "before": _estimate(trial.before),
        "after": _estimate(trial.angle_random_walk),
        "ratio": trial.angle_random_walk.value / trial.before.value,
        "figures": {name: drawn(_FIGURES[name], again) for name in ("stability", "spectrum")},
    }


def curve(found: sagnac.StabilityCurve) -> dict[str, Any]:
    """A curve of one gyro in deg/h."""
    shown = {name: _PER_HOUR * getattr(found, name) for name in ("deviation", "low", "high")}
    return {name: numbers(values) for name, values in {"tau": found.tau, **shown}.items()}


def _estimate(one: sagnac.Estimate) -> dict[str, Any]:
    shown = one.in_field_unit()
    three = numbers(np.array([shown.value, shown.low, shown.high]))
    ends = dict(zip(("value", "low", "high"), three, strict=True))
    stated = {"unit": shown.unit, "status": one.status, "confidence": one.confidence}
    return {"text": format(shown), **stated, **ends}


def figures(analysis: sagnac.Analysis) -> dict[str, Any]:
    """The figures of the report as plain data; one that the analysis has not is not among them."""
    residual = analysis.residual
    turned = residual is not None and residual.by_angle is not None
    several = sum(part.shows for part in analysis.parts) > 1
    drawable = residual is not None and residual.time.size > 1
    has = {"parts": several, "residual": drawable, "angle": turned, "orders": turned}
    return {name: drawn(draw, analysis) for name, draw in _FIGURES.items() if has.get(name, True)}


def drawn(draw: Callable[..., Axes], *given: Any) -> dict[str, Any]:
    """The picture of a function of `sagnac.plot`, as lines, bands and texts.

    Parameters
    ----------
    draw
        Takes `given` and an axis.
    """
    axes = draw(*given, ax=Figure(figsize=(9.0, 4.5)).add_subplot())
    across, up = axes.get_xlim(), axes.get_ylim()
    of_errors = (one for one in axes.collections if isinstance(one, LineCollection))
    bands = (one for one in axes.collections if isinstance(one, PolyCollection))
    spans = (one for one in axes.patches if isinstance(one, Rectangle))
    named = (one for one in axes.texts if hasattr(one, "xy"))
    return {
        "x": {"label": axes.get_xlabel(), "log": axes.get_xscale() == "log", "range": list(across)},
        "y": {"label": axes.get_ylabel(), "log": axes.get_yscale() == "log", "range": list(up)},
        "lines": [
            *(one for one in (_line(each, axes) for each in axes.get_lines()) if one["x"]),
            *(segment for each in of_errors for segment in _error_bars(each)),
        ],
        "bands": [
            *(_filled(one.get_paths()[0].vertices, one) for one in bands),
            *(_filled(_in_data(one, one.get_path().vertices, axes), one) for one in spans),
        ],
        "texts": [{**_points(np.array([one.xy])), "text": one.get_text()} for one in named],
    }


def _in_data(one: Artist, points: Any, axes: Axes) -> Any:
    """Points of an artist, (points, 2), some of which stand in shares of the axis, in data."""
    return axes.transData.inverted().transform(one.get_transform().transform(points))


def _points(points: Any) -> dict[str, Any]:
    x, y = np.asarray(points, dtype=np.float64).T
    return {"x": numbers(x), "y": numbers(y)}


def _line(one: Any, axes: Axes) -> dict[str, Any]:
    points = np.column_stack(one.get_data())
    if one.get_transform() != axes.transData:
        points = _in_data(one, points, axes)
    marker, style = one.get_marker(), one.get_linestyle()
    return {
        **_points(points),
        "color": to_hex(one.get_color()),
        "width": float(one.get_linewidth()) if style != "None" else 0.0,
        "dash": style not in ("-", "None"),
        "marker": "" if marker in ("None", None, "") else str(marker),
        "size": float(one.get_markersize()),
        **_of_any(one),
    }


def _of_any(one: Any) -> dict[str, Any]:
    """Opacity, and the label if it has one."""
    label = str(one.get_label())
    return {"alpha": float(one.get_alpha() or 1.0), "label": "" if label.startswith("_") else label}


def _error_bars(group: Any) -> Iterator[dict[str, Any]]:
    """The bars of points with their errors, as lines of two points each."""
    color = to_hex(group.get_color()[0])
    for segment in group.get_segments():
        yield {**_points(segment), "color": color, **_PLAIN}


def _filled(corners: Any, one: Any) -> dict[str, Any]:
    color = to_hex(np.atleast_2d(one.get_facecolor())[0])
    return {**_points(corners), "color": color, **_of_any(one)}
