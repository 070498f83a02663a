"""Two lines closer than the Fourier transform tells apart: who finds them, and what is left.

The paper's third point: frequencies may be very close. Two lines of one amplitude, 0.3/T to 2/T
apart, at drawn phases and places, stand in white noise of angle. Fast orthogonal search on grids
of 1/T to 1/(8T), the joint fit of `fos`, and the peaks of a Fourier transform look for them.
"""

import argparse
import platform
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from benchmarks.stability import PAGE as STABILITY_PAGE
from sagnac.core.arrays import FloatArray
from sagnac.lines.grid_search import grid_search, grid_sinusoids
from sagnac.lines.search import remove_lines

PAGE: Final = STABILITY_PAGE.with_name("benchmarks_close_lines.md")
FIGURE: Final = PAGE.with_name("benchmarks_close_lines.png")
SAMPLES: Final = 4000
RATE: Final = 10.0  # Hz
SEPARATIONS: Final = (0.3, 0.4, 0.5, 0.7, 0.85, 1.0, 1.25, 1.5, 2.0)  # cycles a record
AMPLITUDE: Final = 0.5  # of the noise's rms: 27 dB a line in the periodogram
FALSE_ALARM: Final = 0.01
CELLS: Final = (1, 2, 4, 8)


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """What a method found of one record: frequencies in cycles a record, and what it removed."""

    places: FloatArray
    series: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """Means over the records of one separation."""

    both: float
    false: float
    error: float
    left: float


def by_grid(angle: FloatArray, cells: int) -> Found:
    found = grid_search(
        angle, cells=cells, stop="false-alarm", false_alarm=FALSE_ALARM, most_terms=12
    )
    return Found(places=(found.chosen + 1.0) / cells, series=grid_sinusoids(found, angle.size))


def by_joint_fit(angle: FloatArray) -> Found:
    removal = remove_lines(angle, None, RATE, channel="x")
    places = np.array([line.frequency for line in removal.lines]) * angle.size / RATE
    return Found(places=places, series=angle - removal.residual)


def by_peaks(angle: FloatArray) -> Found:
    """Local maxima of the periodogram, interpolated by a parabola in its logarithm."""
    sums = np.fft.rfft(angle - angle.mean())
    power = np.abs(sums) ** 2
    level = np.median(power[1:-1]) / np.log(2.0) * np.log(power.size / FALSE_ALARM)
    inner = power[1:-1]
    peaks = 1 + np.flatnonzero((inner > power[:-2]) & (inner >= power[2:]) & (inner > level))
    left, middle, right = (np.log(power[peaks + step]) for step in (-1, 0, 1))
    places = peaks + 0.5 * (left - right) / (left - 2.0 * middle + right)
    kept = np.zeros_like(sums)
    kept[peaks] = sums[peaks]
    return Found(places=places, series=np.fft.irfft(kept, angle.size))


def methods() -> dict[str, Callable[[FloatArray], Found]]:
    of: dict[str, Callable[[FloatArray], Found]] = {
        f"FOS, 1/{cells}T" if cells > 1 else "FOS, 1/T": partial(by_grid, cells=cells)
        for cells in CELLS
    }
    return of | {"joint fit (fos)": by_joint_fit, "FFT peaks": by_peaks}


def record(separation: float, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Angle, the lines in it, and their places in cycles a record."""
    random = np.random.default_rng([SAMPLES, round(1000 * separation), seed])
    first = random.uniform(300.0, 1500.0)
    places = np.array([first, first + separation])
    turns = np.arange(SAMPLES) / SAMPLES * 2.0 * np.pi
    phases = random.uniform(-np.pi, np.pi, 2)
    lines = AMPLITUDE * np.cos(places[:, np.newaxis] * turns + phases[:, np.newaxis]).sum(axis=0)
    return lines + random.standard_normal(SAMPLES), lines, places


def score(look: Callable[[FloatArray], Found], separation: float, records: int) -> Score:
    both = false = 0
    errors, left = [], []
    within = min(0.25, 0.5 * separation)
    for seed in range(records):
        angle, lines, places = record(separation, seed)
        found = look(angle)
        away = np.abs(found.places[:, np.newaxis] - places)
        nearest = away.min(axis=0) if found.places.size else np.full(2, np.inf)
        hits = nearest < within
        both += bool(hits.all())
        false += int(found.places.size - np.count_nonzero(hits))
        errors += (nearest[hits] ** 2).tolist()
        rest = lines - found.series
        left.append(float(np.sqrt(np.mean((rest - rest.mean()) ** 2) / np.mean(lines**2))))
    return Score(
        both=both / records,
        false=false / records,
        error=float(np.sqrt(np.mean(errors))) if errors else float("nan"),
        left=float(np.median(left)),
    )


def draw(scores: dict[str, list[Score]]) -> Figure:
    figure = Figure(figsize=(12.0, 4.2), layout="constrained")
    panels = figure.subplots(1, 4)
    for axes, (name, title) in zip(
        panels,
        (
            ("both", "both lines found, part of records"),
            ("false", "other lines listed, per record"),
            ("error", "rms error of frequency, 1/T"),
            ("left", "left of the lines, part (median)"),
        ),
        strict=True,
    ):
        for (method, own), mark in zip(scores.items(), "osD^v*", strict=True):
            values = [getattr(one, name) for one in own]
            axes.plot(SEPARATIONS, values, marker=mark, linewidth=0.9, markersize=4.0, label=method)
        axes.set_xlabel("separation, 1/T")
        axes.set_title(title, fontsize=9)
        if name in {"error", "left"}:
            axes.set_yscale("log")
    figure.legend(
        *panels[0].get_legend_handles_labels(),
        loc="outside lower center",
        ncols=len(scores),
        frameon=False,
    )
    return figure


def page(scores: dict[str, list[Score]], records: int) -> str:
    text = [
        "# Two close lines",
        "",
        f"`python -m benchmarks.close_lines --write`; {platform.machine()}, Python "
        f"{platform.python_version()}, numpy {np.__version__}.",
        "",
        f"{records} records for each separation: {SAMPLES} samples of white angle noise with two "
        f"lines of {AMPLITUDE:g} times its rms at drawn places and phases. A line is found if one "
        "is listed nearer to it than a quarter of 1/T and than half the separation; every other "
        "line listed is false. All methods are given a false alarm of "
        f"{FALSE_ALARM:g} a record.",
        "",
        f"![Found, false, error and left, against separation]({FIGURE.name})",
        "",
    ]
    for name, title, form in (
        ("both", "Both found, %", lambda value: f"{100 * value:.0f}"),
        ("false", "Others listed, per record", lambda value: f"{value:.2f}"),
        ("error", "Rms error of a found frequency, 1/T", lambda value: f"{value:.3f}"),
        ("left", "What is left of the lines after removal, % of their rms (median)",
         lambda value: f"{100 * value:.1f}"),
    ):  # fmt: skip
        text += [
            f"## {title}",
            "",
            "| separation, 1/T | " + " | ".join(f"{one:g}" for one in SEPARATIONS) + " |",
            "|---|" + "---|" * len(SEPARATIONS),
            *(
                f"| {method} | " + " | ".join(form(getattr(one, name)) for one in own) + " |"
                for method, own in scores.items()
            ),
            "",
        ]
    return "\n".join(text)


def main(arguments: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.close_lines", description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.name} and its figure")
    parser.add_argument("--records", type=int, default=100, metavar="N")
    options = parser.parse_args(arguments)
    scores = {
        name: [score(look, separation, options.records) for separation in SEPARATIONS]
        for name, look in methods().items()
    }
    text = page(scores, options.records)
    print(text)
    if options.write:
        draw(scores).savefig(FIGURE, dpi=130)
        PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
