"""A hundred simulated recordings analyzed by every method: bias, intervals and lines.

Each recording is drawn by its number and made on the rig; the truth is the rig's own. One row a
recording and method is kept in a folder, so that a run that was stopped goes on where it was. All
of it takes hours: `--methods` and `--recordings` take a part. ``--set disturbed`` takes the second
hundred, with lock-in, dither, slow noise, warm-up, lines that wander and an encoder as encoders are
(`recording_sets`), by `fos` and `fos-paper` unless stated.
"""

import argparse
import json
import math
import os
import platform
import statistics
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, get_args

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from scipy.stats import binomtest, norm, spearmanr

from benchmarks.recording_lines import FALSE_ALARM, PAIR, lines_table, true_value
from benchmarks.recording_sets import (
    AMPLITUDES,
    JITTERS,
    LOWEST_CYCLES,
    MOST_ORDER,
    ORDERS,
    PLAIN,
    RANDOM_WALKS,
    SEED,
    SETS,
    SHARES,
    TABLE_RATES,
    TONES,
    RecordingSet,
)
from benchmarks.stability import PAGE as STABILITY_PAGE
from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Method, Settings
from sagnac.core.errors import RecordingError
from sagnac.core.processes import GIBIBYTE, completed, means_of
from sagnac.core.units import ARCSECOND, DEGREE_PER_ROOT_HOUR
from sagnac.rig.config import RigConfig
from sagnac.rig.sections import Pairs
from sagnac.rig.simulate import Simulation

FOLDER: Final = Path("out")
# Two hours of three gyros at 500 Hz, and what their analysis holds, bytes.
NEEDED: Final = 1.5 * GIBIBYTE
LEAST_FOR_REASONS: Final = 5
METHODS: Final[tuple[Method, ...]] = ("fos", "fos-paper", "fos-korenberg", "fris", "none")


# --- rows -------------------------------------------------------------------------------------


def row_of(
    number: int, method: Method, simulation: Simulation, of: RecordingSet = PLAIN
) -> dict[str, Any]:
    """What one method makes of one recording."""
    row: dict[str, Any] = {
        "number": number,
        "method": method,
        "config": of.digest_of(number),
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


def page_of(of: RecordingSet) -> Path:
    """The page of a set in the docs."""
    name = "" if of is PLAIN else f"_{of.name}"
    return STABILITY_PAGE.with_name(f"benchmarks_recordings{name}.md")


def place(folder: Path, number: int, method: Method) -> Path:
    return folder / f"{number:03d}-{method}.json"


def known(folder: Path, number: int, method: Method, of: RecordingSet) -> dict[str, Any] | None:
    """The row that is kept, None if there is none or it is of another recording."""
    path = place(folder, number, method)
    if not path.exists():
        return None
    row: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return row if row["config"] == of.digest_of(number) else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Missing:
    """A recording that is still to be made, and the methods that it lacks."""

    number: int
    methods: tuple[Method, ...]


def make_rows(
    folder: Path, of: RecordingSet, numbers: Sequence[int], methods: Sequence[Method], workers: int
) -> None:
    """Every row that is not kept yet, each recording made once for all methods that it lacks."""
    folder.mkdir(parents=True, exist_ok=True)
    lacking = [
        Missing(
            number=number,
            methods=tuple(one for one in methods if known(folder, number, one, of) is None),
        )
        for number in numbers
    ]
    lacking = [one for one in lacking if one.methods]
    work = partial(make_rows_of, folder=folder, name=of.name)
    left = len(lacking)
    for one, future in completed(lacking, work, means_of(workers), lambda _: NEEDED):
        left -= 1
        said = ", ".join(future.result())
        print(f"recording {one.number}: {said}; {left} left", file=sys.stderr, flush=True)


def make_rows_of(one: Missing, folder: Path, name: str) -> list[str]:
    """Every row of one recording; says how it went."""
    of = SETS[name]
    simulation = of.simulation_of(one.number)
    said = []
    for method in one.methods:
        row = row_of(one.number, method, simulation, of)
        path = place(folder, one.number, method)
        draft = path.with_suffix(".part")
        draft.write_text(json.dumps(row, indent=1, allow_nan=False), encoding="utf-8")
        os.replace(draft, path)
        said.append(f"{method} {row['status']} in {row.get('seconds', 0.0):.1f} s")
    return said


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


_FAULTS: Final[Mapping[str, Callable[[RigConfig], bool]]] = {
    "latch jitter below 100 µs": lambda config: 0.0 < config.encoder.latch_jitter_s < 1e-4,
    "latch jitter above 100 µs": lambda config: config.encoder.latch_jitter_s >= 1e-4,
    "latency that drifts": lambda config: config.encoder.latency_drift_s > 0.0,
    "latency that walks": lambda config: config.encoder.latency_walk_s > 0.0,
    "a clock that runs fast": lambda config: config.encoder.clock_ppm > 0.0,
    "readings held": lambda config: config.encoder.reading_rate_hz > 0.0,
    "steps of 1″ and more": lambda config: config.encoder.lines <= 1_296_000,
    "readings lost": lambda config: config.encoder.lost_fraction > 0.0,
    "a servo that hunts": lambda config: config.table.hunting_rms_deg_per_s > 0.0,
    "mounts that resonate": lambda config: any(config.motion.resonance_rms_arcsec),
}


def parts(rows: Sequence[Mapping[str, Any]], of: RecordingSet) -> list[str]:
    """Bias and coverage of `fos` by what was drawn."""
    configs = {row["number"]: of.config_of(row["number"]) for row in rows}
    middle_rate = math.sqrt(TABLE_RATES[0] * TABLE_RATES[1])
    middle_walk = math.sqrt(RANDOM_WALKS[0] * RANDOM_WALKS[1])
    groups = {
        f"table below {middle_rate:.0f} °/s": lambda row: _rate(configs, row) < middle_rate,
        f"table above {middle_rate:.0f} °/s": lambda row: _rate(configs, row) >= middle_rate,
        f"N̄ below {middle_walk:.1e} °/√h": lambda row: row["truth"] < middle_walk,
        f"N̄ above {middle_walk:.1e} °/√h": lambda row: row["truth"] >= middle_walk,
        "at most 18 lines": lambda row: _lines(configs, row) <= 18,
        "more than 18 lines": lambda row: _lines(configs, row) > 18,
        **{
            f"gyros {mode}": lambda row, mode=mode: configs[row["number"]].gyro.mode == mode
            for mode in sorted({config.gyro.mode for config in configs.values()})
        },
        **{
            fault: lambda row, there=there: there(configs[row["number"]])
            for fault, there in _FAULTS.items()
            if any(there(config) for config in configs.values())
        },
    }
    text = [
        "| recordings with | number | bias, % | intervals that hold the truth, % |",
        "|---|---|---|---|",
    ]
    for name, chosen in groups.items():
        own = [row for row in rows if chosen(row)]
        text.append(f"| {name} | {len(own)} | {bias(own)} | {coverage(own)} |")
    return text


def reasons(rows: Mapping[Method, Sequence[Mapping[str, Any]]], of: RecordingSet) -> list[str]:
    """Rank correlation of value over truth, bounds as values, with what was drawn."""

    def strength(lines: Pairs, row: Mapping[str, Any]) -> float:
        return math.sqrt(sum(size**2 for _, size in lines)) / row["truth"]

    drawn: dict[str, Callable[[RigConfig, Mapping[str, Any]], float]] = {
        "table rate": lambda config, _: config.table.rate_deg_per_s,
        "N̄": lambda _, row: row["truth"],
        "orders, rms over N̄": lambda config, row: strength(config.disturbances.angle, row),
        "lines in time, rms over N̄": lambda config, row: strength(config.disturbances.time, row),
        "lines below 1 Hz, rms over N̄": lambda config, row: strength(
            tuple(line for line in config.disturbances.time if line[0] < 1.0), row
        ),
    }
    text = [f"| method | {' | '.join(drawn)} |", f"|---|{'---|' * len(drawn)}"]
    for method, own in rows.items():
        shown = [row for row in own if row.get("value") is not None]
        if len(shown) < LEAST_FOR_REASONS:
            continue
        ratios = [row["value"] / row["truth"] for row in shown]
        found = [
            spearmanr(ratios, [one(of.config_of(row["number"]), row) for row in shown]).statistic
            for one in drawn.values()
        ]
        text.append(f"| {method} | {' | '.join(f'{value:+.2f}' for value in found)} |")
    return text


def _rate(configs: Mapping[int, RigConfig], row: Mapping[str, Any]) -> float:
    return configs[row["number"]].table.rate_deg_per_s


def _lines(configs: Mapping[int, RigConfig], row: Mapping[str, Any]) -> int:
    disturbances = configs[row["number"]].disturbances
    return len(disturbances.angle) + len(disturbances.time)


def outside(rows: Sequence[Mapping[str, Any]], of: RecordingSet) -> list[str]:
    """Recordings whose interval does not hold the truth."""
    text = [
        "| recording | table, °/s | truth, °/√h | value | low | high | error, % | lines |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        if row["status"] != "estimated" or held(row):
            continue
        text.append(
            f"| {row['number']} | {of.config_of(row['number']).table.rate_deg_per_s:.1f} "
            f"| {row['truth']:.4e} | {row['value']:.4e} | {row['low']:.4e} | {row['high']:.4e} "
            f"| {100.0 * (row['value'] / row['truth'] - 1.0):+.2f} | {len(row['lines'])} |"
        )
    return text


def draw(rows: Mapping[Method, Sequence[Mapping[str, Any]]], of: RecordingSet) -> Figure:
    figure = Figure(figsize=(10.0, 4.0), layout="constrained")
    every, close = figure.subplots(1, 2)
    for (method, own), mark in zip(rows.items(), "o^vsx", strict=True):
        shown = [row for row in own if row.get("value") is not None]
        if not shown:
            continue
        every.plot(
            [of.config_of(row["number"]).table.rate_deg_per_s for row in shown],
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
        title="every method" if len([own for own in rows.values() if own]) > 1 else "",
    )
    every.set_xticks([10, 20, 40, 80], ["10", "20", "40", "80"])
    every.set_xticks([], minor=True)
    every.yaxis.set_major_formatter("{x:g}")
    every.yaxis.set_minor_formatter("{x:g}" if every.get_ylim()[1] < 2.0 else NullFormatter())
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


def report(
    rows: Mapping[Method, Sequence[Mapping[str, Any]]], numbers: Sequence[int], of: RecordingSet
) -> str:
    recordings = len(numbers)
    few = {method: len(own) for method, own in rows.items() if 0 < len(own) < recordings}
    text = [
        f"# {'A hundred' if recordings == 100 else recordings} recordings"
        f"{'' if of is PLAIN else f', {of.name}'}: bias, intervals and lines",
        "",
        f"`python -m benchmarks.recordings --set {of.name} --write`; {platform.machine()}, "
        f"{os.cpu_count()} cores, Python {platform.python_version()}, numpy {np.__version__}, "
        f"finufft {version('finufft')}, numba {version('numba')}. Seconds are of processor time, "
        "so that other work on the machine counts little.",
        "",
        f"Recordings {numbers[0]} to {numbers[-1]} of the rig with its preset `paper` (two hours "
        "at 500 Hz, readout 0.001″, encoder of 0.18″ steps and 1″ of periodic error, ripple at "
        "orders 12 and 36, Earth rate at 28.2°). Drawn for each, evenly in the logarithm: table "
        f"rate {TABLE_RATES[0]:g} to {TABLE_RATES[1]:g} °/s, its jitter {JITTERS[0]:g} to "
        f"{JITTERS[1]:g} °/s rms, N of each gyro {RANDOM_WALKS[0]:g} to {RANDOM_WALKS[1]:g} °/√h, "
        f"{ORDERS[0]} to {ORDERS[1]} whole orders to {MOST_ORDER} and {TONES[0]} to {TONES[1]} "
        f"lines in time from {LOWEST_CYCLES} cycles a record to Nyquist, amplitudes "
        f"{AMPLITUDES[0]:g} to {AMPLITUDES[1]:g}″; and evenly: the shares within ±{SHARES:g}, "
        f"start and heading. Seed ({SEED}, number); the number is the rig's own seed. Gyros "
        f"{','.join(PAIR)}; the truth is the pair's N̄ as put in.",
        "",
        of.switched_on,
        "",
        "`fos-paper` and `fos-korenberg` answer by their own Step 4, the least squares "
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
    text += [
        "## What the errors go with",
        "",
        "Rank correlation (Spearman) of value over truth, bounds as values, with what was drawn. "
        f"Of a hundred recordings, chance makes {1.96 / math.sqrt(99.0):.1f} or more one time in "
        "twenty.",
        "",
        *reasons(rows, of),
        "",
    ]
    if own := rows["fos"]:
        figure = page_of(of).with_suffix(".png").name
        text += [f"![Value over truth, and the error of fos]({figure})", ""]
        text += ["## `fos` by what was drawn", "", *parts(own, of), ""]
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
            "none of these, or a second of one line, is false. A line that lies in a band of "
            "vibration goes with it and counts as missed. Noise alone would give "
            f"{FALSE_ALARM * len(own):g} false line in {len(own)} recordings.",
            "",
            *lines_table(own, of),
            "",
            "Recordings whose interval does not hold the truth:",
            "",
            *outside(own, of),
            "",
        ]
    return "\n".join(text)


def write(path: Path, text: str) -> None:
    draft = path.with_suffix(".part")
    draft.write_text(text, encoding="utf-8")
    os.replace(draft, path)


def numbers_of(text: str) -> range:
    """``100`` or ``1:100``: the first and the last number of a set."""
    first, _, last = text.rpartition(":")
    numbers = range(int(first or 1), int(last) + 1)
    if not numbers or numbers[0] < 1:
        raise ValueError(text)
    return numbers


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.recordings", description=__doc__)
    parser.add_argument("--write", action="store_true", help="write the page and its figure")
    parser.add_argument("--set", choices=tuple(SETS), default=PLAIN.name, dest="name")
    parser.add_argument("--recordings", type=numbers_of, default=range(1, 101), metavar="[M:]N")
    parser.add_argument("--methods", metavar="NAME,…", help="those of the set unless stated")
    parser.add_argument("--workers", type=int, default=1, metavar="N")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="DIR",
        help="of the rows; out/recordings or out/recordings-disturbed unless stated",
    )
    options = parser.parse_args(arguments)
    of = SETS[options.name]
    named = options.methods.split(",") if options.methods else of.methods
    methods = [method for method in METHODS if method in named]
    if len(methods) < len(named):
        parser.error(f"--methods {options.methods}: use {', '.join(get_args(Method))}")
    folder = options.output or FOLDER / f"recordings{'' if of is PLAIN else f'-{of.name}'}"
    make_rows(folder, of, options.recordings, methods, options.workers)
    rows = {
        method: [row for number in options.recordings if (row := known(folder, number, method, of))]
        for method in METHODS
    }
    text = report(rows, options.recordings, of)
    print(text)
    if options.write:
        figure = page_of(of).with_suffix(".png")
        draft = figure.with_suffix(".part")
        draw(rows, of).savefig(draft, dpi=150, format="png")
        os.replace(draft, figure)
        write(page_of(of), text)


if __name__ == "__main__":
    # Workers do not load the program: they find what they are to do by the name of its module.
    from benchmarks.recordings import main as run

    run(sys.argv[1:])
