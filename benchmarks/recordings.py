"""A hundred simulated recordings analyzed by every method: bias, intervals and lines.

Each recording is drawn by its number and made on the rig; the truth is the rig's own. One row a
recording and method is kept in a folder, so that a run that was stopped goes on where it was. All
of it takes hours: `--methods` and `--recordings` take a part.
"""

import argparse
import hashlib
import json
import math
import os
import platform
import statistics
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, get_args

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import binomtest, norm

from benchmarks.stability import PAGE as STABILITY_PAGE
from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Method, Settings
from sagnac.errors import RecordingError
from sagnac.lines.detection import detection_threshold
from sagnac.rig.config import RigConfig, preset
from sagnac.rig.sections import GYRO_NAMES, DisturbanceConfig, Pairs
from sagnac.rig.simulate import Simulation, simulate
from sagnac.rig.truth import Truth, truth_of
from sagnac.units import ARCSECOND, DEGREE_PER_ROOT_HOUR

PAGE: Final = STABILITY_PAGE.with_name("benchmarks_recordings.md")
FIGURE: Final = PAGE.with_name("benchmarks_recordings.png")
FOLDER: Final = Path("out") / "recordings"
SEED: Final = 20130227
PAIR: Final = ("x", "z")
METHODS: Final[tuple[Method, ...]] = ("fos", "fos-paper", "fos-korenberg", "fris", "none")
FALSE_ALARM: Final = 0.01  # of the search, as `analyze` runs it
# What is drawn, each evenly in its logarithm.
TABLE_RATES: Final = (10.0, 80.0)  # deg/s
AMPLITUDES: Final = (0.005, 1.0)  # arcsec
RANDOM_WALKS: Final = (1e-5, 1e-4)  # deg/sqrt(h)
JITTERS: Final = (0.001, 0.01)  # deg/s
LOWEST_CYCLES: Final = 20  # a record, of a line in time
# And evenly: how many lines on each scale, of which orders; deviation of the shares.
ORDERS: Final = (3, 20)
MOST_ORDER: Final = 64
TONES: Final = (2, 12)
SHARES: Final = 0.002


# --- the recordings ---------------------------------------------------------------------------


def config_of(number: int) -> RigConfig:
    """The recording of that number: the rig of the paper, with what varies drawn."""
    random = np.random.default_rng([SEED, number])
    base = preset("paper")

    def between(ends: tuple[float, float], size: int | None = None) -> Any:
        return np.exp(random.uniform(*np.log(ends), size))

    rate = float(between(TABLE_RATES))
    orders = random.choice(MOST_ORDER, random.integers(*ORDERS, endpoint=True), replace=False) + 1.0
    tones = int(random.integers(*TONES, endpoint=True))
    band = (LOWEST_CYCLES / base.duration_s, 0.5 * base.sample_rate_hz)
    return replace(
        base,
        seed=number,
        table=replace(
            base.table,
            rate_deg_per_s=rate,
            start_deg=float(random.uniform(-180.0, 180.0)),
            jitter_rms_deg_per_s=float(between(JITTERS)),
        ),
        platform=replace(
            base.platform,
            share_deviation=tuple(random.uniform(-SHARES, SHARES, 3).tolist()),
            heading_deg=float(random.uniform(-180.0, 180.0)),
        ),
        gyro=replace(base.gyro, arw_deg_per_sqrt_h=tuple(between(RANDOM_WALKS, 3).tolist())),
        disturbances=DisturbanceConfig(
            angle=_pairs(orders, between(AMPLITUDES, orders.size)),
            time=_pairs(between(band, tones), between(AMPLITUDES, tones)),
        ),
    )


def _pairs(positions: Any, amplitudes: Any) -> Pairs:
    return tuple(sorted(zip(positions.tolist(), amplitudes.tolist(), strict=True)))


def true_value(truth: Truth) -> float:
    """N of the pair, deg/sqrt(h)."""
    return truth.pairs["-".join(PAIR)].arw_deg_per_sqrt_h


# --- rows -------------------------------------------------------------------------------------


def row_of(number: int, method: Method, simulation: Simulation) -> dict[str, Any]:
    """What one method makes of one recording."""
    row: dict[str, Any] = {
        "number": number,
        "method": method,
        "config": digest(config_of(number)),
        "truth": true_value(simulation.truth),
    }
    start = time.process_time()
    try:
        analysis = analyze(simulation.recording, Settings(gyros=PAIR, method=method))
    except RecordingError as error:
        return row | {"status": "refused", "notes": [str(error)]}
    seconds = time.process_time() - start
    answer = analysis.angle_random_walk
    sizes = {
        name: getattr(answer, name) / DEGREE_PER_ROOT_HOUR for name in ("value", "low", "high")
    }
    return row | {
        "status": answer.status,
        **{name: size if math.isfinite(size) else None for name, size in sizes.items()},
        "source": analysis.source,
        "departure": analysis.fits["likelihood"].departure,
        "seconds": seconds,
        "stages": dict(analysis.seconds),
        "lines": [
            {
                "scale": line.scale,
                "frequency": line.frequency,
                "amplitude_arcsec": line.amplitude / ARCSECOND,
                "significance": line.significance,
                "channel": line.channel,
                "name": line.name,
            }
            for line in analysis.lines
        ],
        "notes": [str(note) for note in analysis.notes],
    }


def digest(config: RigConfig) -> str:
    text = json.dumps(asdict(config), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def place(folder: Path, number: int, method: Method) -> Path:
    return folder / f"{number:03d}-{method}.json"


def known(folder: Path, number: int, method: Method) -> dict[str, Any] | None:
    """The row that is kept, None if there is none or it is of another recording."""
    path = place(folder, number, method)
    if not path.exists():
        return None
    row: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return row if row["config"] == digest(config_of(number)) else None


def make_rows(folder: Path, recordings: int, methods: Sequence[Method]) -> None:
    """Every row that is not kept yet, one recording after another."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(1, recordings + 1):
        missing = [method for method in methods if known(folder, number, method) is None]
        if not missing:
            continue
        simulation = simulate(config_of(number))
        for method in missing:
            row = row_of(number, method, simulation)
            path = place(folder, number, method)
            draft = path.with_suffix(".part")
            draft.write_text(json.dumps(row, indent=1, allow_nan=False), encoding="utf-8")
            os.replace(draft, path)
            print(
                f"{number}/{recordings} {method}: {row['status']}, {row.get('seconds', 0.0):.1f} s",
                file=sys.stderr,
                flush=True,
            )


# --- lines against the truth ------------------------------------------------------------------


Peak = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """Lines of one recording, each as (Hz at the mean table rate, amplitude in arcsec, height).

    `height` is that of the peak over the noise floor, in units of the detection threshold.
    `found`, `missed` and `merged` are lines put in, the last within a bin of another one that was
    found; `explained` are finds of what the Earth and the encoder's error make of the table's
    motion and of harmonics put in; `false` are all other finds, a second of one line among them.
    """

    found: list[Peak]
    missed: list[Peak]
    merged: list[Peak]
    explained: list[Peak]
    false: list[Peak]


def judged(row: Mapping[str, Any]) -> Judged:
    config = config_of(row["number"])
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
        # Of what is weak, only what noise adds to is found.
        noise = 4.0 * find[1] / math.sqrt(2.0 * find[2] * threshold)
        own = near and order in largest and find[1] < largest[order] + noise
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


# --- the page ---------------------------------------------------------------------------------


def errors_of(rows: Sequence[Mapping[str, Any]]) -> list[float]:
    """Relative errors of what is estimated."""
    return [row["value"] / row["truth"] - 1.0 for row in rows if row["status"] == "estimated"]


def bias(rows: Sequence[Mapping[str, Any]]) -> str:
    """Mean relative error and its standard error, in %."""
    errors = errors_of(rows)
    if len(errors) < 2:
        return "–"
    scatter = statistics.stdev(errors) / math.sqrt(len(errors))
    return f"{100.0 * statistics.fmean(errors):+.3f} ± {100.0 * scatter:.3f}"


def scatter(rows: Sequence[Mapping[str, Any]]) -> str:
    """Root mean square error of what is estimated, in standard errors as the interval has them."""
    errors = [
        2.0 * norm.ppf(0.975) * (row["value"] - row["truth"]) / (row["high"] - row["low"])
        for row in rows
        if row["status"] == "estimated"
    ]
    return f"{math.sqrt(np.mean(np.square(errors))):.2f}" if errors else "–"


def held(row: Mapping[str, Any]) -> bool:
    return bool(row["low"] <= row["truth"] <= row["high"])


def coverage(rows: Sequence[Mapping[str, Any]]) -> str:
    """Part of the intervals that hold the truth, in %, with its own 95 % interval."""
    judgements = [held(row) for row in rows if row["status"] == "estimated"]
    if not judgements:
        return "–"
    test = binomtest(sum(judgements), len(judgements)).proportion_ci(0.95)
    share = 100.0 * sum(judgements) / len(judgements)
    return f"{share:.1f} ({100.0 * test.low:.1f}–{100.0 * test.high:.1f})"


def answers(rows: Mapping[Method, Sequence[Mapping[str, Any]]]) -> list[str]:
    text = [
        "| method | recordings | estimated | upper bound | other | bias of the estimated, % "
        "| rms error, % | in standard errors | 95 % intervals that hold the truth, % "
        "| bounds that hold | value / truth, median (extremes) | seconds, median |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for method, own in rows.items():
        if not own:
            continue
        errors = errors_of(own)
        bounds = [row for row in own if row["status"] == "upper bound"]
        ratios = [row["value"] / row["truth"] for row in own if row.get("value") is not None]
        seconds = [row["seconds"] for row in own if "seconds" in row]
        rms = f"{100.0 * math.sqrt(np.mean(np.square(errors))):.2f}" if errors else "–"
        text.append(
            f"| {method} | {len(own)} | {len(errors)} | {len(bounds)} "
            f"| {len(own) - len(errors) - len(bounds)} | {bias(own)} | {rms} | {scatter(own)} "
            f"| {coverage(own)} "
            f"| {f'{sum(held(row) for row in bounds)} of {len(bounds)}' if bounds else '–'} "
            f"| {statistics.median(ratios):.3f} ({min(ratios):.3f}–{max(ratios):.3g}) "
            f"| {statistics.median(seconds):.1f} |"
        )
    return text


def parts(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Bias and coverage of `fos` by what was drawn."""
    configs = {row["number"]: config_of(row["number"]) for row in rows}
    middle_rate = math.sqrt(TABLE_RATES[0] * TABLE_RATES[1])
    middle_walk = math.sqrt(RANDOM_WALKS[0] * RANDOM_WALKS[1])
    of = {
        f"table below {middle_rate:.0f} °/s": lambda row: _rate(configs, row) < middle_rate,
        f"table above {middle_rate:.0f} °/s": lambda row: _rate(configs, row) >= middle_rate,
        f"N̄ below {middle_walk:.1e} °/√h": lambda row: row["truth"] < middle_walk,
        f"N̄ above {middle_walk:.1e} °/√h": lambda row: row["truth"] >= middle_walk,
        "at most 18 lines": lambda row: _lines(configs, row) <= 18,
        "more than 18 lines": lambda row: _lines(configs, row) > 18,
    }
    text = [
        "| recordings with | number | bias, % | intervals that hold the truth, % |",
        "|---|---|---|---|",
    ]
    for name, chosen in of.items():
        own = [row for row in rows if chosen(row)]
        text.append(f"| {name} | {len(own)} | {bias(own)} | {coverage(own)} |")
    return text


def _rate(configs: Mapping[int, RigConfig], row: Mapping[str, Any]) -> float:
    return configs[row["number"]].table.rate_deg_per_s


def _lines(configs: Mapping[int, RigConfig], row: Mapping[str, Any]) -> int:
    disturbances = configs[row["number"]].disturbances
    return len(disturbances.angle) + len(disturbances.time)


def lines_table(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """What `fos` found of the lines put in."""
    judgements = {row["number"]: judged(row) for row in rows if "lines" in row}

    def line(name: str, lines: Mapping[int, Sequence[Peak]], named: bool = False) -> str:
        inside = {number: own for number, own in lines.items() if own}
        text = f"| {name} | {sum(map(len, lines.values()))} | {len(inside)}"
        if named and inside:
            heights = [
                f"{number} ({', '.join(f'{peak[2]:.3g}' for peak in own)})"
                for number, own in inside.items()
            ]
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
            "found, of Earth rate and of the encoder's error",
            {number: one.explained for number, one in judgements.items()},
        ),
        line("false", {number: one.false for number, one in judgements.items()}, True),
    ]


def outside(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Recordings whose interval does not hold the truth."""
    text = [
        "| recording | table, °/s | truth, °/√h | value | low | high | error, % | lines |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        if row["status"] != "estimated" or held(row):
            continue
        text.append(
            f"| {row['number']} | {config_of(row['number']).table.rate_deg_per_s:.1f} "
            f"| {row['truth']:.4e} | {row['value']:.4e} | {row['low']:.4e} | {row['high']:.4e} "
            f"| {100.0 * (row['value'] / row['truth'] - 1.0):+.2f} | {len(row['lines'])} |"
        )
    return text


def draw(rows: Mapping[Method, Sequence[Mapping[str, Any]]]) -> Figure:
    figure = Figure(figsize=(10.0, 4.0), layout="constrained")
    every, close = figure.subplots(1, 2)
    for (method, own), mark in zip(rows.items(), "o^vsx", strict=True):
        shown = [row for row in own if row.get("value") is not None]
        every.plot(
            [config_of(row["number"]).table.rate_deg_per_s for row in shown],
            [row["value"] / row["truth"] for row in shown],
            mark,
            markersize=3.0,
            label=method,
        )
    every.axhline(1.0, color="0.6", linewidth=0.8)
    every.set(
        xscale="log",
        yscale="log",
        xlabel="table rate, °/s",
        ylabel="value or bound / truth",
        title="every method",
    )
    every.set_xticks([10, 20, 40, 80], ["10", "20", "40", "80"])
    every.set_xticks([], minor=True)
    every.legend(frameon=False)
    estimated = [row for row in rows["fos"] if row["status"] == "estimated"]
    for held_truth, color in ((True, "C0"), (False, "C3")):
        own = [row for row in estimated if held(row) is held_truth]
        error = 100.0 * np.array([row["value"] / row["truth"] - 1.0 for row in own])
        ends = 100.0 * np.array(
            [
                [(row["value"] - row["low"]) / row["truth"] for row in own],
                [(row["high"] - row["value"]) / row["truth"] for row in own],
            ]
        )
        close.errorbar(
            [row["number"] for row in own],
            error,
            ends,
            fmt=".",
            color=color,
            linewidth=0.8,
            markersize=4.0,
        )
    close.axhline(0.0, color="0.6", linewidth=0.8)
    close.set(
        xlabel="recording",
        ylabel="error, % of the truth",
        title="fos with 95 % intervals (red: truth outside)",
    )
    return figure


def report(rows: Mapping[Method, Sequence[Mapping[str, Any]]], recordings: int) -> str:
    few = {method: len(own) for method, own in rows.items() if 0 < len(own) < recordings}
    text = [
        "# A hundred recordings: bias, intervals and lines"
        if recordings == 100
        else f"# {recordings} recordings: bias, intervals and lines",
        "",
        f"`python -m benchmarks.recordings --write`; {platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, numpy {np.__version__}, "
        f"finufft {version('finufft')}, numba {version('numba')}. Seconds are of processor time, "
        "so that other work on the machine counts little.",
        "",
        f"Recordings 1 to {recordings} of the rig with its preset `paper` (two hours at 500 Hz, "
        "readout 0.001″, encoder of 0.18″ steps and 1″ of periodic error, ripple at orders 12 and "
        "36, Earth rate at 28.2°). Drawn for each, evenly in the logarithm: table rate "
        f"{TABLE_RATES[0]:g} to {TABLE_RATES[1]:g} °/s, its jitter {JITTERS[0]:g} to "
        f"{JITTERS[1]:g} °/s rms, N of each gyro {RANDOM_WALKS[0]:g} to {RANDOM_WALKS[1]:g} °/√h, "
        f"{ORDERS[0]} to {ORDERS[1]} whole orders to {MOST_ORDER} and {TONES[0]} to {TONES[1]} "
        f"lines in time from {LOWEST_CYCLES} cycles a record to Nyquist, amplitudes "
        f"{AMPLITUDES[0]:g} to {AMPLITUDES[1]:g}″; and evenly: the shares within ±{SHARES:g}, "
        f"start and heading. Seed ({SEED}, number); the number is the rig's own seed. Gyros "
        f"{','.join(PAIR)}; the truth is the pair's N̄ as put in.",
        "",
        "Switched off, and so not tested here: bias instability and rate random walk (B = K = 0), "
        "lock-in (gyros `ideal`), lines that wander, and any time between the samples of encoder "
        "and gyros. `fos-paper` and `fos-korenberg` answer by their own Step 4, the least squares "
        "on the Allan curve; `fris` and `none` are judged by our average and bounds.",
        "",
        *[f"{method}: only the first {count} were run." for method, count in few.items()],
        *([""] if few else []),
        *answers(rows),
        "",
        "Bars: the bias of `fos` under 0.5 %, its intervals hold 93–97 % of the truths; of 100, "
        "chance moves a coverage by 2.2 % (one standard error), and the rms error in standard "
        "errors, as the intervals have them, by 0.07. The bias is the mean relative error with its "
        "standard error, the interval beside a coverage is binomial, 95 %. An "
        "upper bound holds where the truth lies below it; value / truth takes bounds as values.",
        "",
    ]
    if own := rows["fos"]:
        text += [f"![Value over truth, and the error of fos]({FIGURE.name})", ""]
        text += ["## `fos` by what was drawn", "", *parts(own), ""]
        text += [
            "## Lines by `fos`",
            "",
            "A line is found if one is listed within a bin (1/T) of it, angle lines taken at the "
            "mean table rate. It is above the threshold if its peak in the difference stands above "
            "the floor of ARW and readout by as much as the search asks of noise at "
            f"{FALSE_ALARM:g} for the whole of it. At order 1 stands Earth rate, with the table's "
            "ripple also beside orders 12 and 36; and harmonics are removed in the angle that the "
            "encoder reports, whose periodic error makes sidebands of them: what is found there, "
            "no larger than these are, is counted apart. What is "
            "none of these, or a second of one line, is false; of noise, "
            f"{FALSE_ALARM * len(own):g} is expected in {len(own)} recordings.",
            "",
            *lines_table(own),
            "",
            "Recordings whose interval does not hold the truth:",
            "",
            *outside(own),
            "",
        ]
    return "\n".join(text)


def write(path: Path, text: str) -> None:
    draft = path.with_suffix(".part")
    draft.write_text(text, encoding="utf-8")
    os.replace(draft, path)


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.recordings", description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.name} and its figure")
    parser.add_argument("--recordings", type=int, default=100, metavar="N")
    parser.add_argument("--methods", default=",".join(METHODS), metavar="NAME,…")
    parser.add_argument("-o", "--output", type=Path, default=FOLDER, metavar="DIR")
    options = parser.parse_args(arguments)
    methods = [method for method in METHODS if method in options.methods.split(",")]
    if len(methods) < len(options.methods.split(",")):
        parser.error(f"--methods {options.methods}: use {', '.join(get_args(Method))}")
    make_rows(options.output, options.recordings, methods)
    numbers = range(1, options.recordings + 1)
    rows = {
        method: [row for number in numbers if (row := known(options.output, number, method))]
        for method in METHODS
    }
    text = report(rows, options.recordings)
    print(text)
    if options.write:
        draft = FIGURE.with_suffix(".part")
        draw(rows).savefig(draft, dpi=150, format="png")
        os.replace(draft, FIGURE)
        write(PAGE, text)


if __name__ == "__main__":
    main(sys.argv[1:])
