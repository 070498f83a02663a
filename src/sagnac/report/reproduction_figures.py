"""The paper's figures from the reproduction."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sagnac.paper.reproduce import Outcome, Reproduction
from sagnac.plot.frame import BLUE, GREEN, INK, ORANGE, logarithmic
from sagnac.report.frames_figure import frames_figure
from sagnac.report.reproduction_values import cells_of, curves_of, white_deviation, within_cut
from sagnac.report.style import legend_above, styled
from sagnac.units import DEGREE, DEGREE_PER_ROOT_HOUR


def figures_of(reproduction: Reproduction) -> dict[str, Figure]:
    """Figures 1 to 6, and N against table rate, by name."""
    curves = curves_of(reproduction)
    fitted = {name: _curve_figure(curves[name]) for name in ("figure4", "figure5", "figure6")}
    return {
        "figure1": frames_figure(),
        "figure2": _fris_figure(*curves["figure2"]),
        "figure3": _intervals_figure(curves["figure3"]),
        **fitted,
        "table_rate": _rate_figure(reproduction),
    }


def _fris_figure(fris: Outcome, fos: Outcome) -> Figure:
    with styled() as canvas:
        axes = canvas.axes
        axes.plot(
            fris.tau_s, fris.deviation, color=ORANGE, marker="^", linewidth=1.0, label="fris, 9 s"
        )
        axes.plot(
            fos.tau_s, fos.deviation, color=BLUE, marker="o", linestyle="none", label="fos, 1 s"
        )
        _truth_line(axes, fos)
        logarithmic(axes, "cluster time τ (s)", "Allan deviation, x − z per gyro (°/h)")
        legend_above(axes, columns=3)
    return canvas.figure


def _intervals_figure(outcomes: Sequence[Outcome]) -> Figure:
    with styled() as canvas:
        axes = canvas.axes
        for outcome, color, marker in zip(
            outcomes, (BLUE, GREEN, ORANGE), ("o", "D", "^"), strict=True
        ):
            axes.plot(
                outcome.tau_s,
                outcome.deviation,
                color=color,
                marker=marker,
                linewidth=0.9,
                label=f"every {outcome.interval_s:g} s",
            )
        _truth_line(axes, outcomes[0])
        logarithmic(axes, "cluster time τ (s)", "Allan deviation, z (°/h)")
        legend_above(axes, columns=4)
    return canvas.figure


def _curve_figure(outcomes: Sequence[Outcome]) -> Figure:
    """The curve as published: of the difference, points with an error of 10 % or less."""
    (outcome,) = outcomes
    kept = within_cut(outcome)
    tau = np.array(outcome.tau_s)[kept]
    low, middle, high = (
        np.sqrt(2.0) * np.array(curve)[kept]
        for curve in (outcome.low_curve, outcome.deviation, outcome.high_curve)
    )
    with styled() as canvas:
        axes = canvas.axes
        axes.fill_between(
            tau,
            low,
            high,
            color=BLUE,
            alpha=0.2,
            linewidth=0,
            label=f"{100 * outcome.confidence:g} % interval",
        )
        axes.plot(tau, middle, color=BLUE, marker="o", linestyle="none", label="x − z")
        _truth_line(axes, outcome, float(np.sqrt(2.0)))
        logarithmic(axes, "cluster time τ (s)", "Allan deviation, x − z (°/h)")
        legend_above(axes, columns=3)
    return canvas.figure


def _truth_line(axes: Axes, outcome: Outcome, times: float = 1.0) -> None:
    tau = np.array([min(outcome.tau_s), max(outcome.tau_s)])
    axes.plot(
        tau,
        times * white_deviation(outcome.truth_deg_per_sqrt_h, tau),
        color=INK,
        linewidth=0.9,
        linestyle=(0, (5, 3)),
        label="N as simulated",
    )


def _rate_figure(reproduction: Reproduction) -> Figure:
    prediction = reproduction.prediction
    rates = prediction.rates / DEGREE
    with styled() as canvas:
        axes = canvas.axes
        for values, label, color, style in (
            (prediction.total, "predicted", INK, "-"),
            (prediction.lock_in, "lock-in", BLUE, "--"),
            (prediction.quantum, "quantum limit", GREEN, "--"),
        ):
            axes.plot(
                rates, values / DEGREE_PER_ROOT_HOUR, color=color, linestyle=style, label=label
            )
        cells = cells_of(reproduction, "table2")
        for label, color, marker, points in (
            (
                "ours, Table 2",
                BLUE,
                "o",
                [
                    (one.rate, one.outcome.value)
                    for one in cells
                    if one.outcome.status == "estimated"
                ],
            ),
            ("paper, Table 2", ORANGE, "x", [(one.rate, one.published) for one in cells]),
        ):
            axes.plot(
                [rate for rate, _ in points],
                [value for _, value in points],
                linestyle="none",
                marker=marker,
                color=color,
                label=label,
            )
        logarithmic(axes, "table rate (°/s)", "N̄ (°/√h)")
        legend_above(axes, columns=3)
    return canvas.figure
