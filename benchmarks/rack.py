"""A rack of gyros through a campaign that is killed, started again, and given bad luck.

Recordings of the rig are made for every unit, day and table rate; N of each unit is drawn. Then

1. a campaign on two workers is killed with SIGKILL when half of the rows are there;
2. it is started again: no row may be lost, and none made twice;
3. late recordings come with one file that is cut off, and one worker is killed: one row must say
   each, and the rest must be complete;
4. a last start makes the row of the killed worker, and nothing else.

Run as ``python -m benchmarks.rack``; 200 recordings of ten minutes take an hour and more on two
cores. ``--units 2 --days 2 --rates 2 --seconds 60`` takes a minute. The exit status is 1 if
something was lost, made twice or not said.
"""

import argparse
import csv
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from scipy.stats import binomtest

from sagnac.fleet.tasks import result_path
from sagnac.rig.config import RigConfig, preset
from sagnac.rig.simulate import write
from sagnac.rig.truth import truth_of

SEED: Final = 20130303
PAIR: Final = ("x", "z")
RANDOM_WALKS: Final = (1e-5, 1e-4)  # deg/sqrt(h), drawn evenly in the logarithm
SAMPLE_RATE: Final = 100.0  # Hz; keeps a file at a few megabytes
SLOWEST: Final = 20.0  # deg/s; the rates are its multiples
LATE: Final = 0.1  # of the recordings come after the campaign is done
FEWEST_LATE: Final = 4  # so that both workers are at work when one is killed
PATTERN: Final = "(?P<unit>U[0-9]+)_day(?P<day>[0-9]+)_rate(?P<rate>[0-9.]+)"
BROKEN: Final = "U0_day0_rate0.parquet"


@dataclass(frozen=True, slots=True, kw_only=True)
class Rack:
    """The recordings of a rack.

    Attributes
    ----------
    early, late
        Folders of those that are there from the start, and of those that come later.
    truths
        N per gyro of the pair, deg/sqrt(h), by the name of the file.
    """

    early: Path
    late: Path
    truths: dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """What one start of the campaign left.

    Attributes
    ----------
    status
        Exit status; that of the signal, negative, if it was killed.
    said
        Standard output and standard error.
    seconds
        Wall time.
    """

    status: int
    said: str
    seconds: float


# --- the recordings ---------------------------------------------------------------------------


def configurations(stated: argparse.Namespace) -> Iterator[tuple[str, RigConfig]]:
    """The name of each file and what it is made from."""
    random = np.random.default_rng(SEED)
    base = preset("paper")
    highest = 0.5 * SAMPLE_RATE
    tones = tuple(line for line in base.disturbances.time if line[0] < highest)
    seed = 0
    for unit in range(1, stated.units + 1):
        walks = np.exp(random.uniform(*np.log(RANDOM_WALKS), 3))
        gyro = replace(base.gyro, arw_deg_per_sqrt_h=tuple(walks.tolist()))
        for day in range(1, stated.days + 1):
            for step in range(1, stated.rates + 1):
                seed += 1
                rate = SLOWEST * step
                yield (
                    f"U{unit}_day{day}_rate{rate:g}.parquet",
                    replace(
                        base,
                        seed=seed,
                        duration_s=stated.seconds,
                        sample_rate_hz=SAMPLE_RATE,
                        gyro=gyro,
                        table=replace(base.table, rate_deg_per_s=rate),
                        disturbances=replace(base.disturbances, time=tones),
                    ),
                )


def recorded(folder: Path, stated: argparse.Namespace) -> Rack:
    """Write all recordings, those that come late into a folder of their own."""
    early, late = folder / "early", folder / "late"
    early.mkdir()
    late.mkdir()
    truths: dict[str, float] = {}
    total = stated.units * stated.days * stated.rates
    every = total // max(FEWEST_LATE, round(LATE * total))
    for number, (name, config) in enumerate(configurations(stated)):
        write(config, (late if number % every == 0 else early) / name)
        truths[name] = truth_of(config).pairs["-".join(PAIR)].arw_deg_per_sqrt_h
    return Rack(early=early, late=late, truths=truths)


def cut_off(rack: Rack) -> Path:
    """One more file among the late ones: the first half of another."""
    whole = min(rack.late.glob("*.parquet")).read_bytes()
    path = rack.late / BROKEN
    path.write_bytes(whole[: len(whole) // 2])
    return path


# --- the campaign -----------------------------------------------------------------------------


def started(
    sources: Sequence[Path], output: Path, meanwhile: Callable[[int], None] | None = None
) -> Start:
    """One start of the campaign, to its end and that of all its workers.

    `meanwhile` is given the number of the process while it works.
    """
    command = [sys.executable, "-m", "sagnac", "campaign", *map(str, sources), "-o", str(output)]
    options = ["--gyros", ",".join(PAIR), "--pattern", PATTERN, "--workers", "2"]
    began = time.perf_counter()
    with (output.parent / "said.txt").open("w+", encoding="utf-8") as said:
        # Its workers are of the same session, which ends with the last of them.
        process = subprocess.Popen(
            [*command, *options], stdout=said, stderr=subprocess.STDOUT, start_new_session=True
        )
        if meanwhile is not None:
            meanwhile(process.pid)
        status = process.wait()
        _wait_until(lambda: not _alive(process.pid), 60.0, "workers outlive their campaign")
        said.seek(0)
        text = said.read()
    return Start(status=status, said=text, seconds=time.perf_counter() - began)


def _alive(session: int) -> bool:
    """Whether a process of this session is left."""
    try:
        os.killpg(session, 0)
    except ProcessLookupError:
        return False
    return True


def _wait_until(reached: Callable[[], bool], seconds: float, otherwise: str) -> None:
    end = time.monotonic() + seconds
    while not reached():
        if time.monotonic() > end:
            raise TimeoutError(otherwise)
        time.sleep(0.05)


def kept(output: Path) -> dict[str, int]:
    """Files of results with the instant at which each was made, ns."""
    folder = result_path(output, "").parent
    return {path.name: path.stat().st_mtime_ns for path in folder.glob("[!.]*.json")}


def workers_of(campaign: int) -> list[int]:
    """Numbers of the processes that measure for a campaign."""
    listed = subprocess.run(
        ["ps", "-A", "-o", "pid=,ppid=,args="], capture_output=True, text=True, check=True
    )
    found = []
    for line in listed.stdout.splitlines():
        number, parent, arguments = line.split(maxsplit=2)
        if int(parent) == campaign and "spawn_main" in arguments:
            found.append(int(number))
    return found


def rows(output: Path) -> list[dict[str, str]]:
    """The table of the campaign."""
    with (output / "campaign.csv").open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


# --- what it must show ------------------------------------------------------------------------


class Verdict:
    """Lines printed as they come, and whether all is as it must be."""

    def __init__(self) -> None:
        self.sound = True

    def count(self, what: str, found: int, wanted: int) -> None:
        """Print a count, and the one that was to come if it differs."""
        right = found == wanted
        self.sound &= right
        print(f"  {what:<52}{found:6d}{'' if right else f'   WRONG, not {wanted}'}", flush=True)


def killed_half_way(rack: Rack, output: Path, seconds: float, verdict: Verdict) -> None:
    """SIGKILL when half of the rows are there; then a start that does the other half."""
    total = len(list(rack.early.glob("*.parquet")))

    def kill(process: int) -> None:
        limit = 600.0 + 10.0 * seconds * total
        _wait_until(lambda: 2 * len(kept(output)) >= total, limit, "half of the rows do not come")
        os.kill(process, signal.SIGKILL)

    print(f"killed with SIGKILL half-way, {total} recordings", flush=True)
    first = started([rack.early], output, kill)
    before = kept(output)
    verdict.count("exit status", first.status, -signal.SIGKILL)
    print(f"  {'rows made before':<52}{len(before):6d}   in {first.seconds:.0f} s")
    print("started again", flush=True)
    second = started([rack.early], output)
    after = kept(output)
    verdict.count("exit status", second.status, 0)
    print(f"  {'rows made after':<52}{len(after) - len(before):6d}   in {second.seconds:.0f} s")
    lost = sum(row["state"] != "done" for row in rows(output)) + total - len(rows(output))
    verdict.count("rows lost", lost, 0)
    verdict.count("rows made twice", sum(after.get(name) != at for name, at in before.items()), 0)
    made = f"{total - len(before)} row{'' if total - len(before) == 1 else 's'}"
    said = f"{made} analyzed now, {len(before)} kept" in second.said
    verdict.count("starts that miscount what they made", int(not said), 0)


def bad_luck(rack: Rack, output: Path, verdict: Verdict) -> None:
    """Late recordings, one of them cut off, and one worker killed at work."""
    before = kept(output)
    broken = cut_off(rack)
    total = len(rack.truths) + 1

    def kill(campaign: int) -> None:
        # The cut-off file is a row at once; after the next both workers have begun another.
        wanted = len(before) + 2
        _wait_until(lambda: len(kept(output)) >= wanted, 600.0, "no row comes")
        time.sleep(0.2)
        os.kill(workers_of(campaign)[0], signal.SIGKILL)

    print("late recordings, one file cut off, one worker killed", flush=True)
    started([rack.early, rack.late], output, kill)
    first = {Path(row["file"]).name: row for row in rows(output)}
    verdict.count("rows", len(first), total)
    says = sum(row["state"] == "lost" and "worker died" in row["reason"] for row in first.values())
    verdict.count("rows that say that the worker died", says, 1)
    failed = [name for name, row in first.items() if row["state"] == "failed"]
    verdict.count("rows that say that the file is damaged", int(failed == [broken.name]), 1)
    complete = sum(row["state"] == "done" for row in first.values())
    verdict.count("rows complete", complete, total - 2)
    middle = kept(output)
    last = started([rack.early, rack.late], output)
    print("started once more", flush=True)
    verdict.count("rows made, that of the killed worker", len(kept(output)) - len(middle), 1)
    after = {**before, **middle}
    again = sum(kept(output).get(name) != at for name, at in after.items())
    verdict.count("rows made twice", again, 0)
    verdict.count("exit status, for the damaged file is still there", last.status, 1)
    verdict.count("rows complete", sum(row["state"] == "done" for row in rows(output)), total - 1)


def held(rack: Rack, output: Path) -> str:
    """How many intervals hold the truth."""
    answers = [
        (float(row["low"] or "nan"), float(row["high"]), rack.truths[Path(row["file"]).name])
        for row in rows(output)
        if row["status"] == "estimated"
    ]
    right = sum(low <= truth <= high for low, high, truth in answers)
    chance = binomtest(right, len(answers)).proportion_ci(0.95)
    bounds = len(rack.truths) - len(answers)
    return (
        f"intervals of 95 % that hold the truth: {right} of {len(answers)} "
        f"({100.0 * right / len(answers):.1f} %, chance {100.0 * chance.low:.1f} to "
        f"{100.0 * chance.high:.1f} %); recordings without an estimate: {bounds}"
    )


@contextmanager
def place(stated: argparse.Namespace) -> Iterator[Path]:
    """The folder to work in: a new one that is kept, or one that goes."""
    if stated.output is None:
        with tempfile.TemporaryDirectory() as name:
            yield Path(name)
    else:
        stated.output.mkdir(parents=True)
        yield stated.output


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=10)
    parser.add_argument("--days", type=int, default=5)
    parser.add_argument("--rates", type=int, default=4, help="multiples of 20 deg/s")
    parser.add_argument("--seconds", type=float, default=600.0, help="length of each recording")
    parser.add_argument("-o", "--output", type=Path, default=None, help="new folder, kept")
    stated, _ = parser.parse_known_args(arguments)
    if stated.units * stated.days * stated.rates < 2 * FEWEST_LATE:
        parser.error(f"units × days × rates is below {2 * FEWEST_LATE}; raise one of them")
    verdict = Verdict()
    with place(stated) as folder:
        rack = recorded(folder, stated)
        print(f"{len(rack.truths)} recordings of {stated.seconds:g} s made", flush=True)
        output = folder / "campaign"
        output.mkdir()
        killed_half_way(rack, output, stated.seconds, verdict)
        bad_luck(rack, output, verdict)
        print(held(rack, output))
    print("all as it must be" if verdict.sound else "NOT as it must be")
    if not verdict.sound:
        sys.exit(1)


if __name__ == "__main__":
    main(sys.argv[1:])
