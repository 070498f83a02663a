"""Lines that an analysis lists beside those that were put into a simulated recording."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from benchmarks.recording_sets import RecordingSet
from sagnac.core.units import ARCSECOND, DEGREE_PER_ROOT_HOUR
from sagnac.lines.detection import detection_threshold
from sagnac.recording.columns import GYRO_NAMES
from sagnac.rig.config import RigConfig
from sagnac.rig.truth import Truth, truth_of

PAIR: Final = ("x", "z")
FALSE_ALARM: Final = 0.01  # of the search, as `analyze` runs it


def true_value(truth: Truth) -> float:
    """N of the pair, deg/sqrt(h)."""
    return truth.pairs["-".join(PAIR)].arw_deg_per_sqrt_h


Peak = tuple[float, float, float]
# Heights of lines named for each recording.
SHOWN: Final = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """Lines of one recording, each as (Hz at the mean table rate, amplitude in arcsec, height).

    `height` is that of the peak over the noise floor, in units of the detection threshold.
    `found`, `missed` and `merged` are lines put in, the last within a bin of another one that was
    found; `explained` are finds of what the Earth and the encoder's error make of the table's
    motion and of harmonics put in, and of lines that wander and dither, which are no lines of the
    truth; `false` are all other finds, a second of one line among them.
    """

    found: list[Peak]
    missed: list[Peak]
    merged: list[Peak]
    explained: list[Peak]
    false: list[Peak]


def judged(row: Mapping[str, Any], of: RecordingSet) -> Judged:
    """Lines listed beside lines put in."""
    config = of.config_of(row["number"])
    bands = of.bands_of(row["number"])
    truth = truth_of(config)
    turn_rate = truth.table_rate_deg_per_s / 360.0
    resolution = 1.0 / config.duration_s
    threshold = detection_threshold(config.samples // 2, FALSE_ALARM)
    walk = math.sqrt(2.0) * true_value(truth) * DEGREE_PER_ROOT_HOUR / ARCSECOND
    steps = [config.gyro.quantization_step_arcsec[GYRO_NAMES.index(name)] for name in PAIR]

    def peak(hertz: float, amplitude: float) -> Peak:
        """With its height over the floor of the increments."""
        transfer = 2.0 * math.sin(math.pi * hertz / config.sample_rate_hz)
        readout = sum(step**2 for step in steps) / 12.0
        floor = walk**2 / config.sample_rate_hz + readout * transfer**2
        height = config.samples * (amplitude * transfer) ** 2 / 4.0 / floor
        return hertz, amplitude, height / threshold

    rest = [
        peak(
            line["frequency"] * (turn_rate if line["scale"] == "angle" else 1.0),
            line["amplitude_arcsec"],
        )
        for line in row["lines"]
    ]
    found: list[Peak] = []
    lost: list[Peak] = []
    put_in = [
        peak(
            line.order * turn_rate if line.order is not None else line.frequency_hz or math.nan,
            line.difference_amplitude_arcsec["-".join(PAIR)],
        )
        for line in truth.lines
    ]
    for line in sorted(put_in, key=lambda one: -one[2]):
        nearest = min(rest, key=lambda other: abs(other[0] - line[0]), default=None)
        if nearest is not None and abs(nearest[0] - line[0]) < resolution:
            rest.remove(nearest)
            found.append(line)
        else:
            lost.append(line)
    merged = [line for line in lost if any(abs(other[0] - line[0]) < resolution for other in found)]
    largest = explicable(truth, config)
    explained: list[Peak] = []
    false: list[Peak] = []
    for find in rest:
        order = round(find[0] / turn_rate)
        near = abs(find[0] - order * turn_rate) < resolution
        # A weak line is found only if noise adds to it.
        noise = 4.0 * find[1] / math.sqrt(2.0 * find[2] * threshold)
        own = near and order in largest and find[1] < largest[order] + noise
        own = own or any(low < find[0] < high for low, high in bands)
        (explained if own else false).append(find)
    return Judged(
        found=found,
        missed=[line for line in lost if line not in merged],
        merged=merged,
        explained=explained,
        false=false,
    )


def explicable(truth: Truth, config: RigConfig) -> dict[int, float]:
    """Largest amplitude, arcsec, at each order, of what is there without being put in as a line.

    Earth rate at order 1, and of its amplitude E where the rate ripples by a fraction f at
    order p, E f / (2 (p + 1)) and E f / (2 (p - 1)) at p + 1 and p - 1. Where the encoder errs
    by e cos(p alpha), an order k of amplitude A in the angle that it reports has sidebands of
    A k e / 2 at k + p and k - p, and the table's motion, of which the gyros sense unequal
    shares, shows p.
    """
    channel = "-".join(PAIR)
    largest: dict[int, float] = {}

    def add(order: float, amplitude: float) -> None:
        largest[round(order)] = largest.get(round(order), 0.0) + amplitude

    if truth.earth_rate_order_one is not None:
        earth = truth.earth_rate_order_one.difference_amplitude_arcsec[channel]
        add(1.0, earth)
        for p, fraction in config.table.ripple:
            add(p + 1.0, earth * fraction / (2.0 * (p + 1.0)))
            add(p - 1.0, earth * fraction / (2.0 * (p - 1.0)))
    for p, error in config.encoder.periodic_error:
        add(p, abs(truth.shares[PAIR[0]] - truth.shares[PAIR[1]]) * error)
        for line in truth.lines:
            if line.order is not None:
                size = line.difference_amplitude_arcsec[channel] * line.order * error * ARCSECOND
                add(line.order + p, size / 2.0)
                add(abs(line.order - p), size / 2.0)
    return largest


def _heights(lines: Sequence[Peak]) -> str:
    """The highest few."""
    highest = sorted((height for _, _, height in lines), reverse=True)
    text = ", ".join(f"{height:.3g}" for height in highest[:SHOWN])
    return text if len(highest) <= SHOWN else f"{text} and {len(highest) - SHOWN} lower"


def lines_table(rows: Sequence[Mapping[str, Any]], of: RecordingSet) -> list[str]:
    """What `fos` found of the lines put in."""
    judgements = {row["number"]: judged(row, of) for row in rows if "lines" in row}

    def line(name: str, lines: Mapping[int, Sequence[Peak]], named: bool = False) -> str:
        inside = {number: own for number, own in lines.items() if own}
        text = f"| {name} | {sum(map(len, lines.values()))} | {len(inside)}"
        if named and inside:
            heights = [f"{number} ({_heights(own)})" for number, own in inside.items()]
            text += f": {', '.join(heights)}"
        return f"{text} |"

    def among(above: bool, *names: str) -> dict[int, list[Peak]]:
        return {
            number: [
                peak for name in names for peak in getattr(one, name) if (peak[2] > 1.0) is above
            ]
            for number, one in judgements.items()
        }

    return [
        "| | lines | in recordings (heights, in units of the threshold) |",
        "|---|---|---|",
        line("put in, above the detection threshold", among(True, "found", "missed", "merged")),
        line("of them found", among(True, "found")),
        line("of them within a bin (1/T) of one that was found", among(True, "merged"), True),
        line("of them missed", among(True, "missed"), True),
        line("put in, below the threshold", among(False, "found", "missed", "merged")),
        line("of them found", among(False, "found")),
        line(
            "found, of Earth rate, of the encoder's error, or of what wanders",
            {number: one.explained for number, one in judgements.items()},
        ),
        line("false", {number: one.false for number, one in judgements.items()}, True),
    ]
