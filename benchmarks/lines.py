"""Line removal: cost by stage on a two-hour record, and the same search by other tools.

Records are made here by seed: white increments and readout quantization, harmonics of an unsteady
table, lines in time that fall between grid frequencies. Each measurement runs in a process of its
own, which reads its record from a file, so that its peak memory is its own; the libraries' own
threads are off, and sagnac has none.
"""

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from benchmarks.stability import peak_memory
from sagnac.core.units import ARCSECOND, DEGREE, HOUR
from sagnac.lines import joint_fit, passes, sampling, search, state
from sagnac.lines.detection import detection_threshold
from sagnac.lines.search import remove_lines
from sagnac.table import motion

FloatArray = NDArray[np.float64]
Found = list[tuple[str, float]]

PAGE: Final = Path(__file__).parents[1] / "docs" / "benchmarks_lines.md"
REPEATS: Final = 3
FALSE_ALARM: Final = 0.01
# Walk of a difference of two gyros of 2.5e-5 deg/sqrt(h) each, and its readout step.
RANDOM_WALK: Final = np.sqrt(2.0) * 2.5e-5 * DEGREE / np.sqrt(HOUR)
READOUT_STEP: Final = 0.001 * ARCSECOND
TABLE_RATE: Final = 40.0 * DEGREE  # rad/s
# Candidates of the angle scale that the other tools are given, and pairs they may choose.
MOST_ORDERS: Final = 32
MOST_PAIRS: Final = 60
# What a search spends its time in: none of these calls another.
STAGES: Final = {
    "table motion taken out": (motion.TableMotion, "less"),
    "lines taken out": (state, "removed"),
    "sums at whole orders": (state, "order_sums"),
    "spectrum and noise floor": (state, "spectrum"),
    "joint least squares": (joint_fit, "fit"),
    "candidates in frequency and in order": (search, "new_lines"),
    "table motion and Earth rate": (passes, "follow_table"),
    "sampling of the table": (sampling, "angle_sums"),
    "averages of the table": (state, "kinematics"),
    "angle or time": (passes, "rescaled_components"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A record's make: `orders` whole orders from 1, `tones` lines in time."""

    seed: int
    sample_rate: float
    duration: float
    orders: int
    tones: int

    @property
    def samples(self) -> int:
        return round(self.sample_rate * self.duration)


LONG: Final = Case(seed=1, sample_rate=500.0, duration=7200.0, orders=100, tones=20)
SHORT: Final = Case(seed=2, sample_rate=20.0, duration=400.0, orders=24, tones=20)
MIDDLE: Final = Case(seed=4, sample_rate=100.0, duration=3600.0, orders=24, tones=20)


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """A record and what it is made of.

    `angle` and `table` are (samples,) rad, `noise` is the (samples - 1,) increments of `angle`
    without the lines, and `frequencies` are in Hz.
    """

    angle: FloatArray
    table: FloatArray
    noise: FloatArray
    orders: FloatArray
    frequencies: FloatArray


def make(case: Case) -> Truth:
    generator = np.random.default_rng(case.seed)
    samples, dt = case.samples, 1.0 / case.sample_rate
    clock = np.arange(samples) * dt
    # The rate wanders by 2 % and ripples twelve times a turn.
    wander = 0.02 * np.sin(2.0 * np.pi * 3.3 * clock / case.duration + 1.0)
    wander += 0.01 * np.sin(2.0 * np.pi * 17.7 * clock / case.duration)
    ripple = 0.002 * np.sin(12.0 * TABLE_RATE * clock)
    table = np.cumsum(TABLE_RATE * (1.0 + wander + ripple) * dt)
    walk = np.cumsum(RANDOM_WALK * np.sqrt(dt) * generator.standard_normal(samples))
    orders = np.arange(1.0, case.orders + 1.0)
    # One line in each of equal log-spaced stretches of the band, 0.3 to 0.7 of a bin off the grid.
    place = (np.arange(case.tones) + generator.uniform(0.2, 0.8, case.tones)) / case.tones
    band = np.array([20.0 / case.duration, 0.48 * case.sample_rate])
    bins = np.floor(case.duration * band[0] * (band[1] / band[0]) ** place)
    frequencies = (bins + generator.uniform(0.3, 0.7, case.tones)) / case.duration
    at = np.concatenate([orders * TABLE_RATE / (2.0 * np.pi), frequencies]) * dt
    # Heights of the peaks over the floor: those in angle up to 1e5, those in time up to 6e3.
    heights = np.exp(
        np.concatenate(
            [
                generator.uniform(np.log(1e2), np.log(1e5), case.orders),
                generator.uniform(np.log(60.0), np.log(6e3), case.tones),
            ]
        )
    )
    transfer = 2.0 * np.sin(np.pi * at)
    floor = RANDOM_WALK**2 * dt + READOUT_STEP**2 / 12.0 * transfer**2
    amplitudes = np.sqrt(4.0 * heights * floor / samples) / transfer
    phases = generator.uniform(0.0, 2.0 * np.pi, at.size)
    angle = walk.copy()
    for order, amplitude, phase in zip(orders, amplitudes, phases, strict=False):
        angle += amplitude * np.cos(order * table + phase)
    for frequency, amplitude, phase in zip(
        frequencies, amplitudes[case.orders :], phases[case.orders :], strict=True
    ):
        angle += amplitude * np.cos(2.0 * np.pi * frequency * clock + phase)
    read = READOUT_STEP * np.rint(angle / READOUT_STEP)
    noise = np.diff(walk + (read - angle))
    return Truth(angle=read, table=table, noise=noise, orders=orders, frequencies=frequencies)


# --- the searches: (angle, table, sample rate) -> lines, increments left ----------------------


def ours(angle: FloatArray, table: FloatArray, sample_rate: float) -> tuple[Found, FloatArray]:
    removal = remove_lines(angle, table, sample_rate, channel="x-z", false_alarm=FALSE_ALARM)
    return [(line.scale, line.frequency) for line in removal.lines], np.diff(removal.residual)


def candidates(samples: int, sample_rate: float) -> Found:
    """The other tools' grid: whole orders, and multiples of one cycle a record from the fourth."""
    duration = samples / sample_rate
    grid: Found = [("angle", float(order)) for order in range(1, MOST_ORDERS + 1)]
    return grid + [("time", bin_ / duration) for bin_ in range(4, samples // 2)]


def pair(line: tuple[str, float], table: FloatArray, sample_rate: float) -> FloatArray:
    """(2, samples - 1) increments of the cosine and sine of one line, of unit length each."""
    scale, frequency = line
    clock = np.arange(table.size) / sample_rate
    phase = frequency * table if scale == "angle" else 2.0 * np.pi * frequency * clock
    rows = np.diff(np.stack([np.cos(phase), np.sin(phase)]), axis=1)
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


def dictionary(grid: Found, table: FloatArray, sample_rate: float) -> FloatArray:
    """(2 * lines, samples - 1), the pairs of all lines of `grid`."""
    rows = np.empty((2 * len(grid), table.size - 1))
    for index, line in enumerate(grid):
        rows[2 * index : 2 * index + 2] = pair(line, table, sample_rate)
    return rows


def dense_search(
    angle: FloatArray, table: FloatArray, sample_rate: float
) -> tuple[Found, FloatArray]:
    """Korenberg's recursion as in the textbook: every candidate a row, pairs, his stop."""
    grid = candidates(angle.size, sample_rate)
    rows = dictionary(grid, table, sample_rate)
    target = np.diff(angle)
    target -= target.mean()
    squares = float(target @ target)  # of what is left
    own = np.ones(len(rows))  # D(m, m): what of each candidate is new beside the chosen
    cross = np.einsum("ij,ij->i", rows[0::2], rows[1::2])  # of a pair's cosine and sine
    shared = rows @ target  # C(m)
    functions: list[FloatArray] = []  # inner products of every candidate with each one chosen
    chosen: list[int] = []
    while len(chosen) < MOST_PAIRS:
        (c, s), (d_c, d_s) = shared.reshape(-1, 2).T, own.reshape(-1, 2).T
        determinant = d_c * d_s - cross**2
        usable = determinant > 1e-6
        joint = d_s * c**2 + d_c * s**2 - 2.0 * cross * c * s
        merit = np.where(usable, joint / np.where(usable, determinant, 1.0), 0.0)
        merit[chosen] = 0.0
        best = int(np.argmax(merit))
        if merit[best] < 2.0 * 4.0 / (target.size + 1) * squares:
            break
        chosen.append(best)
        squares -= float(merit[best])
        for term in (2 * best, 2 * best + 1):
            product = rows @ rows[term]
            for function in functions:
                product -= function * function[term]
            product /= np.sqrt(own[term])
            functions.append(product)
            shared = shared - product * (shared[term] / np.sqrt(own[term]))
            own = own - product**2
            cross = cross - product[0::2] * product[1::2]
    columns = rows[[2 * index + part for index in chosen for part in (0, 1)]].T
    rest = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    return [grid[index] for index in chosen], rest


def matching_pursuit(
    angle: FloatArray, table: FloatArray, sample_rate: float
) -> tuple[Found, FloatArray]:
    """scikit-learn's orthogonal matching pursuit, told how many terms there are."""
    # Loaded only where used, so that no other's peak memory holds it.
    from sklearn.linear_model import OrthogonalMatchingPursuit  # noqa: PLC0415

    grid = candidates(angle.size, sample_rate)
    columns = dictionary(grid, table, sample_rate).T
    steps = np.diff(angle)
    scale = float(np.std(steps))
    model = OrthogonalMatchingPursuit(n_nonzero_coefs=2 * (SHORT.orders + SHORT.tones))
    model.fit(columns, steps / scale)
    lines = sorted({int(index) // 2 for index in np.flatnonzero(model.coef_)})
    return [grid[index] for index in lines], steps - scale * model.predict(columns)


def prewhitened(method: str) -> Callable[..., tuple[Found, FloatArray]]:
    """Lomb-Scargle again and again: fit the highest peak, subtract, until it may be chance.

    First over table angle at the whole orders, then over time to Nyquist, five to a bin.
    """

    def search(
        angle: FloatArray, table: FloatArray, sample_rate: float
    ) -> tuple[Found, FloatArray]:
        from astropy.timeseries import LombScargle  # noqa: PLC0415

        if method == "fastnifty":
            # It enters itself among astropy's methods.
            import nifty_ls  # noqa: F401, PLC0415

        rest = np.diff(angle)
        rest -= rest.mean()
        clock = (np.arange(rest.size) + 0.5) / sample_rate
        turn = 0.5 * (table[1:] + table[:-1]) / (2.0 * np.pi)
        duration = angle.size / sample_rate
        fine = np.arange(20, 5 * (angle.size // 2)) / (5.0 * duration)
        found: Found = []
        for scale, at, grid in (
            ("angle", turn, np.arange(1.0, MOST_ORDERS + 1.0)),
            ("time", clock, fine),
        ):
            for _ in range(MOST_PAIRS):
                model = LombScargle(at, rest, fit_mean=False, center_data=False)
                power = model.power(grid, method=method, assume_regular_frequency=True)
                best = int(np.argmax(power))
                # Independent frequencies: the whole orders, or the bins of the record.
                trials = grid.size if scale == "angle" else angle.size // 2
                if trials * (1.0 - power[best]) ** (0.5 * (rest.size - 3)) > FALSE_ALARM:
                    break
                found.append((scale, float(grid[best])))
                columns = pair(found[-1], table, sample_rate).T
                rest = rest - columns @ np.linalg.lstsq(columns, rest, rcond=None)[0]
        return found, rest

    return search


SEARCHES: Final[dict[str, Callable[..., tuple[Found, FloatArray]]]] = {
    "sagnac": ours,
    "textbook dense FOS": dense_search,
    "scikit-learn OMP": matching_pursuit,
    "astropy Lomb–Scargle": prewhitened("fast"),
    "nifty-ls": prewhitened("fastnifty"),
}


# --- measurement ----------------------------------------------------------------------------


def measure(name: str, case: Case, folder: Path, *, profiled: bool = False) -> dict[str, Any]:
    """One search in a process of its own: processor seconds, MB, lines, increments left."""
    environment = dict(os.environ)
    for library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
        environment[f"{library}_NUM_THREADS"] = "1"
    command = [sys.executable, "-m", "benchmarks.lines", "--search", name, str(folder)]
    command += ["--sample-rate", repr(case.sample_rate)]
    command += ["--profile"] if profiled else []
    run = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
    return dict(json.loads(run.stdout.splitlines()[-1]))


def run_search(name: str, folder: Path, sample_rate: float, profiled: bool) -> None:
    """What `measure` starts."""
    search = SEARCHES[name]
    little = make(Case(seed=3, sample_rate=20.0, duration=100.0, orders=3, tones=2))
    search(little.angle, little.table, 20.0)  # imports and compilation are done before the clock
    angle, table = np.load(folder / "angle.npy"), np.load(folder / "table.npy")
    before = peak_memory()
    stages = timed_stages() if profiled else {}
    start, began = time.process_time(), time.perf_counter()
    found, rest = search(angle, table, sample_rate)
    answer: dict[str, Any] = {
        "seconds": time.process_time() - start,
        "wall": time.perf_counter() - began,
        "peak": peak_memory(),
        "above": peak_memory() - before,
        "found": found,
        "stages": stages,
    }
    np.save(folder / "rest.npy", rest)
    print(json.dumps(answer))


def timed_stages() -> dict[str, list[float]]:
    """Calls, processor and wall seconds of each stage, counted from now on."""
    spent: dict[str, list[float]] = {}
    for stage, (owner, name) in STAGES.items():
        spent[stage] = [0, 0.0, 0.0]
        setattr(owner, name, timed(getattr(owner, name), spent[stage]))
    return spent


def timed(work: Callable[..., Any], row: list[float]) -> Callable[..., Any]:
    """`work`, adding its calls, processor and wall seconds to `row`."""

    def counted(*arguments: Any, **options: Any) -> Any:
        start, began = time.process_time(), time.perf_counter()
        try:
            return work(*arguments, **options)
        finally:
            row[0] += 1
            row[1] += time.process_time() - start
            row[2] += time.perf_counter() - began

    return counted


def save(truth: Truth, folder: Path) -> None:
    np.save(folder / "angle.npy", truth.angle)
    np.save(folder / "table.npy", truth.table)


def judged(found: Found, truth: Truth, case: Case) -> tuple[int, int]:
    """True lines found, to within one bin; and finds that are no line or one already found."""
    hits: set[tuple[str, int]] = set()
    for scale, frequency in found:
        true = truth.orders if scale == "angle" else truth.frequencies
        width = 0.1 if scale == "angle" else 1.0 / case.duration
        nearest = int(np.argmin(np.abs(true - frequency)))
        if abs(true[nearest] - frequency) < width:
            hits.add((scale, nearest))
    return len(hits), len(found) - len(hits)


def left(rest: FloatArray, truth: Truth, case: Case) -> int:
    """True lines whose remainder stands above the detection threshold, all fitted at once."""
    lines: Found = [("angle", float(order)) for order in truth.orders]
    lines += [("time", float(frequency)) for frequency in truth.frequencies]
    columns = dictionary(lines, truth.table, case.sample_rate).T
    solution = np.linalg.lstsq(columns, rest, rcond=None)[0]
    at = np.concatenate([truth.orders * TABLE_RATE / (2.0 * np.pi), truth.frequencies])
    transfer = 2.0 * np.sin(np.pi * at / case.sample_rate)
    floor = RANDOM_WALK**2 / case.sample_rate + READOUT_STEP**2 / 12.0 * transfer**2
    height = 0.5 * (solution[0::2] ** 2 + solution[1::2] ** 2) / floor
    return int((height > detection_threshold(rest.size // 2, FALSE_ALARM)).sum())


def long_record() -> list[str]:
    truth = make(LONG)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        save(truth, folder)
        run = measure("sagnac", LONG, folder, profiled=True)
        rest = np.load(folder / "rest.npy")
    hits, false = judged(run["found"], truth, LONG)
    true = LONG.orders + LONG.tones
    power = float(np.mean(rest**2) / np.mean(truth.noise**2))
    text = [
        f"## {LONG.samples:.1e} samples, {LONG.orders} orders, {LONG.tones} lines in time",
        "",
        "| | measured | bar |",
        "|---|---|---|",
        f"| seconds | {run['wall']:.1f} | 5 |",
        f"| processor seconds | {run['seconds']:.1f} | |",
        f"| peak memory of the process, MiB | {run['peak'] * 1e6 / 2**20:.0f} | 1024 |",
        f"| of it above the record, MiB | {run['above'] * 1e6 / 2**20:.0f} | |",
        f"| lines found | {hits} of {true} | {true} |",
        f"| lines missed | {true - hits} | 0 |",
        f"| false lines | {false} | 0 |",
        f"| power left over power of the noise | {power:.5f} | |",
        "",
        "By stage:",
        "",
        "| stage | calls | processor seconds | seconds |",
        "|---|---|---|---|",
    ]
    other = [run["seconds"], run["wall"]]
    for stage, (calls, spent, wall) in run["stages"].items():
        text.append(f"| {stage} | {calls} | {spent:.2f} | {wall:.2f} |")
        other = [other[0] - spent, other[1] - wall]
    return [*text, f"| everything else | | {other[0]:.2f} | {other[1]:.2f} |"]


def side_by_side(case: Case, searches: tuple[str, ...], repeats: int, preface: str) -> list[str]:
    """The same record searched by each in turn, `repeats` times."""
    truth = make(case)
    runs: dict[str, list[dict[str, Any]]] = {name: [] for name in searches}
    rests: dict[str, FloatArray] = {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        save(truth, folder)
        for _ in range(repeats):
            for name in searches:
                runs[name].append(measure(name, case, folder))
                rests[name] = np.load(folder / "rest.npy")
    middle = {
        name: [statistics.median(run[what] for run in runs[name]) for what in ("seconds", "above")]
        for name in searches
    }
    true = case.orders + case.tones
    text = [
        f"## Beside other tools: {case.samples} samples, {case.orders} orders, "
        f"{case.tones} lines in time",
        "",
        preface,
        "",
        "| search | seconds | × sagnac | MB | × sagnac | found | false | left | "
        "power left / noise |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    first_seconds, first_memory = middle["sagnac"]
    for name, (seconds, memory) in middle.items():
        hits, false = judged(runs[name][-1]["found"], truth, case)
        power = float(np.mean(rests[name] ** 2) / np.mean(truth.noise**2))
        text.append(
            f"| {name} | {seconds:.3f} | {seconds / first_seconds:.1f} | {memory:.0f} "
            f"| {memory / max(first_memory, 0.1):.1f} | {hits} of {true} | {false} "
            f"| {left(rests[name], truth, case)} | {power:.3f} |"
        )
    return text


def beside_others() -> list[str]:
    dense = (
        f"{SHORT.duration:g} s at {SHORT.sample_rate:g} Hz: about the most that a dense dictionary "
        f"of all bins to Nyquist ({SHORT.samples // 2 + MOST_ORDERS - 4} pairs) allows. All work "
        "on increments, where random walk is white, of a record without table motion; the others "
        f"search whole orders to {MOST_ORDERS} and the multiples of one cycle a record (the "
        f"Lomb–Scargles five times finer) and choose at most {MOST_PAIRS} pairs. OMP is told how "
        "many terms there are, the dense search stops by Korenberg's rule, the Lomb–Scargles "
        f"when the highest peak may be chance at {FALSE_ALARM:g}. A line is found within one bin; "
        "what is no line, or one found already, is false. A line is left if its remainder stands "
        "above the detection threshold. Medians, in turn in one run; memory is above the record."
    )
    long = (
        f"{MIDDLE.duration:g} s at {MIDDLE.sample_rate:g} Hz, where no dense dictionary fits; once."
    )
    quick = ("sagnac", "astropy Lomb–Scargle", "nifty-ls")
    return [
        *side_by_side(SHORT, tuple(SEARCHES), REPEATS, dense),
        "",
        *side_by_side(MIDDLE, quick, 1, long),
    ]


def report() -> str:
    text = [
        "# Line removal: speed, memory and what is found",
        "",
        f"`python -m benchmarks.lines --write`; {platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, numpy {np.__version__}, "
        f"finufft {version('finufft')}, numba {version('numba')}, astropy {version('astropy')}, "
        f"scikit-learn {version('scikit-learn')}, nifty-ls {version('nifty-ls')}. "
        "Difference of two gyros of 2.5e-5 °/√h each, read to 0.001″; table at 40 °/s, "
        "its rate wandering by 2 %; "
        f"false-alarm probability {FALSE_ALARM:g} for the whole search; seeds "
        f"{LONG.seed}, {SHORT.seed} and {MIDDLE.seed}. Seconds are of processor time unless said "
        "otherwise, so that other work on the machine counts little.",
        "",
    ]
    return "\n".join([*text, *long_record(), "", *beside_others()]) + "\n"


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.lines", description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.name}")
    parser.add_argument("--search", nargs=2, metavar=("NAME", "FOLDER"))
    parser.add_argument("--sample-rate", type=float)
    parser.add_argument("--profile", action="store_true")
    options = parser.parse_args(arguments)
    if options.search:
        run_search(options.search[0], Path(options.search[1]), options.sample_rate, options.profile)
        return
    text = report()
    print(text)
    if options.write:
        draft = PAGE.with_suffix(".part")
        draft.write_text(text, encoding="utf-8")
        os.replace(draft, PAGE)


if __name__ == "__main__":
    main(sys.argv[1:])
