"""What could have made the paper's Figure 3: the search for one slow line, and forms of the fit.

The paper reads N of one dithered gyro at rest from angles 1, 6 and 12 s apart, and gets three
numbers that grow eighteenfold. Decimation changes no point that a curve keeps. Here one line in
time is put on the rig's noise, its period and amplitude are searched for, and the same least
squares as in `sagnac.paper` are asked for N, in each of their five forms. On white noise alone the
forms are compared as well: what they read, and how much that scatters.
"""

import argparse
import platform
import sys
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from benchmarks._made import made_page, with_stamp
from benchmarks.stability import PAGE as STABILITY_PAGE
from sagnac.core import arrays
from sagnac.core.arrays import FloatArray
from sagnac.core.units import ARCSECOND
from sagnac.paper.prediction import FIGURE_3
from sagnac.paper.reproduce import least_squares_of
from sagnac.paper.trials import FORMS, Form, config_of_run, with_time_lines
from sagnac.rig.simulate import simulate
from sagnac.rig.truth import truth_of
from sagnac.stability.curve import StabilityCurve, stability_curve

PAGE: Final = STABILITY_PAGE.with_name("benchmarks_figure_3.md")
SEED: Final = 3001  # of the trials in `sagnac.paper`
WHITE_RECORDS: Final = 100
DURATION: Final = 7200.0
PERIODS: Final = np.geomspace(15.0, 150.0, 161)  # s
AMPLITUDES: Final = np.geomspace(0.005, 0.3, 61)  # arcsec


@dataclass(frozen=True, slots=True, kw_only=True)
class Nearest:
    """The line that comes nearest to the paper's three numbers.

    `distance` is the root mean square of the logarithms of the three ratios; `values` are by
    interval, deg/sqrt(h).
    """

    period: float
    amplitude: float
    distance: float
    values: dict[float, float]


def noise_of(seed: int, sample_rate: float) -> FloatArray:
    """Angles of gyro z once a second: noise alone, dithered, at rest."""
    base = with_time_lines(config_of_run("dithered", 0.0, seed, DURATION), ())
    recording = simulate(replace(base, sample_rate_hz=sample_rate)).recording
    return arrays.every(recording.gyro("z").values, round(sample_rate))


def phase_of_line(seed: int) -> float:
    """Phase that the rig gives a line in gyro z, rad; that of a line alone has no other cause."""
    config = with_time_lines(config_of_run("dithered", 0.0, seed, DURATION), ((0.02, 1.0),))
    return next(line for line in truth_of(config).lines if line.scale == "time").phase_rad["z"]


def curve_of(angle: FloatArray, interval: float) -> StabilityCurve:
    """The curve of angles once a second, taken every `interval` s."""
    step = round(interval)
    return stability_curve(angle[::step], kind="angle", sample_rate=1.0 / step)


def with_amplitudes(noise: FloatArray, line: FloatArray, interval: float) -> list[StabilityCurve]:
    """Curves of noise and a line of unit amplitude times each of `AMPLITUDES`.

    An Allan variance is of second degree in the amplitude: three curves give all.
    """
    size = AMPLITUDES.max() * ARCSECOND
    without, plus, minus = (
        curve_of(noise + sign * size * line, interval) for sign in (0.0, 1.0, -1.0)
    )
    square = 0.5 * (plus.deviation**2 + minus.deviation**2) - without.deviation**2
    cross = 0.5 * (plus.deviation**2 - minus.deviation**2)
    parts = AMPLITUDES / AMPLITUDES.max()
    variances = [without.deviation**2 + part * cross + part**2 * square for part in parts]
    return [
        replace(without, deviation=np.sqrt(variance), low=np.sqrt(variance), high=np.sqrt(variance))
        for variance in variances
    ]


def search(noise: FloatArray, phase: float) -> dict[Form, Nearest]:
    """The nearest line by each form."""
    times = np.arange(noise.size)
    best: dict[Form, Nearest] = {}
    for period in PERIODS:
        line = np.cos(2.0 * np.pi * times / period + phase)
        fits = {
            interval: [least_squares_of(curve) for curve in with_amplitudes(noise, line, interval)]
            for interval in FIGURE_3
        }
        for place, amplitude in enumerate(AMPLITUDES):
            for form in FORMS:
                values = {interval: fits[interval][place][form] for interval in FIGURE_3}
                if min(values.values()) <= 0.0:
                    continue
                ratios = [np.log(values[interval] / FIGURE_3[interval]) for interval in FIGURE_3]
                distance = float(np.sqrt(np.mean(np.square(ratios))))
                if form not in best or distance < best[form].distance:
                    best[form] = Nearest(
                        period=float(period),
                        amplitude=float(amplitude),
                        distance=distance,
                        values=values,
                    )
    return best


def on_white_noise(interval: float) -> dict[Form, FloatArray]:
    """N over truth by each form, of `WHITE_RECORDS` records of noise alone."""
    read: dict[Form, list[float]] = {form: [] for form in FORMS}
    for seed in range(1, WHITE_RECORDS + 1):
        truth = truth_of(config_of_run("dithered", 0.0, seed, DURATION)).gyros["z"]
        fits = least_squares_of(curve_of(noise_of(seed, 1.0), interval))
        for form, value in fits.items():
            read[form].append(value / truth.arw_deg_per_sqrt_h)
    return {form: np.array(values) for form, values in read.items()}


def page(found: dict[Form, Nearest], white: dict[float, dict[Form, FloatArray]]) -> str:
    rows = [
        f"| {form} | {one.period:.1f} | {one.amplitude:.4f} | "
        + " | ".join(f"{1e4 * one.values[interval]:.2f}" for interval in FIGURE_3)
        + f" | {one.distance:.2f} |"
        for form, one in found.items()
    ]
    scatter = [
        f"| {form} | "
        + " | ".join(
            f"{np.median(white[interval][form]):.2f} ({_spread(white[interval][form])})"
            for interval in FIGURE_3
        )
        + " |"
        for form in FORMS
    ]
    paper = " | ".join(f"{1e4 * value:.2f}" for value in FIGURE_3.values())
    return "\n".join(
        [
            "# Figure 3 of the paper: a search",
            "",
            f"`python -m benchmarks.figure_3 --write`; {platform.machine()}, "
            f"Python {platform.python_version()}, numpy {np.__version__}.",
            "",
            "One line in time was put on two hours of the rig's gyro z, dithered, at rest "
            f"(seed {SEED}). {PERIODS.size} periods from {PERIODS[0]:g} to {PERIODS[-1]:g} s and "
            f"{AMPLITUDES.size} amplitudes from {AMPLITUDES[0]:g} to {AMPLITUDES[-1]:g}″ were "
            "tried, even in the logarithm; the line that comes nearest to the paper's three "
            "numbers is listed for each form of the fit. Distance is the root mean square of the "
            "logarithms of the three ratios. Two parameters were fitted to three numbers: what is "
            "near shows that a line suffices, not that there was one.",
            "",
            "| form | period, s | amplitude, ″ | N at 1 s, 10⁻⁴ °/√h | at 6 s | at 12 s | "
            "distance |",
            "|---|---|---|---|---|---|---|",
            f"| the paper | – | – | {paper} | – |",
            *rows,
            "",
            "## The forms on white noise",
            "",
            f"{WHITE_RECORDS} records of two hours of noise alone, angles once a second: N over "
            "truth, median, and half the range from the 16th to the 84th percentile. A form that "
            "reads 0 or below zero counts as it stands.",
            "",
            "| form | 1 s | 6 s | 12 s |",
            "|---|---|---|---|",
            *scatter,
            "",
        ]
    )


def _spread(values: FloatArray) -> str:
    low, high = np.percentile(values, [15.87, 84.13])
    return f"± {0.5 * (high - low):.2f}"


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.name}")
    options = parser.parse_args(arguments)
    found = search(noise_of(SEED, 500.0), phase_of_line(SEED))
    text = page(found, {interval: on_white_noise(interval) for interval in FIGURE_3})
    print(text)
    if options.write:
        PAGE.write_text(with_stamp(text, made_page(PAGE.name).digest), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
