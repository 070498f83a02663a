"""What goes wrong in a recording: from what strength N moves, and from what it is noticed.

    python -m benchmarks.pathologies [SEEDS] [--workers N] [--only TEXT] [--results FILE]
    python -m benchmarks.pathologies --words

Each recording makes a line of FILE. What is there is not done again, so that a run goes on where
it was ended; after a change of the code FILE has to go. The page is written from the seeds that
are whole. With ``--words`` only its table of findings is written anew, from the code.
"""

import argparse
import json
import math
import sys
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.stats import binom

import sagnac
from benchmarks._faults import PATHOLOGIES, RATE, SAMPLES, SHARES, TABLE, WALK, Pathology
from benchmarks.stability import PAGE as STABILITY_PAGE
from sagnac.analysis.settings import Method
from sagnac.core.errors import Note, RecordingError, worded
from sagnac.quality.check import DETECTORS, FINDINGS, integrity, judged

PAGE: Final = STABILITY_PAGE.parent / "pathologies.md"
RESULTS: Final = Path("out/pathologies.jsonl")
MOVED: Final = 0.05
MISSES: Final = 0.05
# Chance beyond which misses are no chance.
RARE: Final = 1e-3

Key = tuple[str, bool, float, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What one recording gave.

    Attributes
    ----------
    name, turning, strength, seed
        Of which recording.
    ratio
        N over its truth with every finding accepted; NaN if there is none.
    said
        Faults that are named, or the line with which the recording is refused.
    held
        Whether the interval holds N, or there is none.
    seconds
        Processor time.
    """

    name: str
    turning: bool
    strength: float
    seed: int
    ratio: float
    said: tuple[str, ...]
    held: bool
    seconds: float

    @property
    def key(self) -> Key:
        """What no other has."""
        return self.name, self.turning, self.strength, self.seed


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """N over its truth, what is said, and whether the interval holds."""

    ratio: float
    said: tuple[str, ...]
    held: bool


def _named(notes: Iterable[Note]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(note.name for note in notes if note.name and note.level != "remark"))


def reading(recording: sagnac.Recording) -> Reading:
    """The analysis of a recording, as it is given, and with everything accepted."""
    refused = [note for note in integrity(recording) if note.level == "error"]
    if refused:
        return Reading(ratio=math.nan, said=_named(refused) or (refused[0].text,), held=True)
    # At rest there is no line: nothing is removed.
    method: Method = "none" if recording.table is None else "fos"
    plain = sagnac.Settings(method=method)
    knowing = sagnac.Settings(method=method, accepted=FINDINGS)
    found = judged(recording)
    withheld = any(note.level == "error" for note in found)
    try:
        analysis = sagnac.analyze(recording, knowing if withheld else plain)
        said = _named((*found, *analysis.findings))
        walk = analysis.angle_random_walk.to("deg/sqrt(h)")
        held = (
            withheld
            or analysis.angle_random_walk.status == "not observable"
            or walk.low <= WALK <= walk.high
        )
        if not withheld and any(note.level == "error" for note in analysis.findings):
            taken = sagnac.analyze(recording, knowing).angle_random_walk
            walk = taken.to("deg/sqrt(h)")
    except RecordingError as error:
        return Reading(ratio=math.nan, said=(*_named(found), str(error)), held=True)
    return Reading(ratio=walk.value / WALK, said=said, held=held)


def outcome(pathology: Pathology, *, strength: float, seed: int, turning: bool) -> Outcome:
    """What one recording gave."""
    began = time.process_time()
    try:
        found = reading(pathology.recording(strength, seed, turning=turning))
    except RecordingError as error:
        found = Reading(ratio=math.nan, said=(str(error),), held=True)
    return Outcome(
        name=pathology.name,
        turning=turning,
        strength=strength,
        seed=seed,
        ratio=found.ratio,
        said=found.said,
        held=found.held,
        seconds=round(time.process_time() - began, 3),
    )


def _outcome_of(key: Key) -> Outcome:
    name, turning, strength, seed = key
    (pathology,) = (one for one in PATHOLOGIES if one.name == name)
    return outcome(pathology, strength=strength, seed=seed, turning=turning)


def keys_of(seeds: Iterable[int], only: str = "") -> Iterator[Key]:
    """Every recording, seed after seed."""
    for seed in seeds:
        for turning in (False, True):
            for pathology in PATHOLOGIES:
                if only in pathology.name and _takes_place(pathology, turning=turning):
                    for strength in pathology.strengths:
                        yield pathology.name, turning, strength, seed


def _takes_place(pathology: Pathology, *, turning: bool) -> bool:
    return pathology.turning if turning else pathology.standing


def stored(results: Path) -> dict[Key, Outcome]:
    """What an earlier run has written; a line that was cut off is left out."""
    found: dict[Key, Outcome] = {}
    if not results.exists():
        return found
    for line in results.read_text(encoding="utf-8").splitlines():
        try:
            fields = json.loads(line)
        except json.JSONDecodeError:
            continue
        one = Outcome(**fields | {"said": tuple(fields["said"])})
        found[one.key] = one
    return found


def run(keys: Sequence[Key], results: Path, workers: int) -> Iterator[Outcome]:
    """Every recording that is not stored yet, each written down before the next."""
    results.parent.mkdir(parents=True, exist_ok=True)
    with results.open("a", encoding="utf-8") as lines:
        if workers == 1:
            made: Iterator[Outcome] = map(_outcome_of, keys)
            yield from _written(made, lines)
            return
        with ProcessPoolExecutor(workers) as pool:
            yield from _written(pool.map(_outcome_of, keys), lines)


def _written(made: Iterable[Outcome], lines: object) -> Iterator[Outcome]:
    for one in made:
        print(json.dumps(asdict(one), ensure_ascii=False), file=lines, flush=True)
        yield one


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A pathology: the least strengths at which N moves and at which it is said, and misses.

    Attributes
    ----------
    moves, noticed
        Strengths; infinite if none of those tried is enough.
    silent, recordings
        Recordings whose interval does not hold N and in which nothing is said, of how many.
    unnamed
        Recordings in which nothing is said.
    """

    moves: float
    noticed: float
    silent: int
    unnamed: int
    recordings: int

    @property
    def is_chance(self) -> bool:
        """Whether sound recordings are as often outside their intervals."""
        return self.silent <= int(binom.ppf(1.0 - RARE, self.unnamed, MISSES)) or not self.unnamed

    @property
    def is_in_time(self) -> bool:
        """Whether it is noticed before N moves."""
        return self.noticed <= self.moves


def row(found: Mapping[float, Sequence[Outcome]]) -> Row:
    """All strengths of one pathology."""
    moves = noticed = math.inf
    for strength, outcomes in sorted(found.items()):
        ratios = np.array([one.ratio for one in outcomes])
        there = ratios[np.isfinite(ratios)]
        if not there.size or abs(there.mean() - 1.0) > MOVED:
            moves = min(moves, strength)
        if 2 * sum(bool(one.said) for one in outcomes) > len(outcomes):
            noticed = min(noticed, strength)
    every = [one for outcomes in found.values() for one in outcomes]
    unnamed = [one for one in every if not one.said]
    return Row(
        moves=moves,
        noticed=noticed,
        silent=sum(not one.held for one in unnamed),
        unnamed=len(unnamed),
        recordings=len(every),
    )


def _shown(strength: float) -> str:
    return f"{strength:.3g}" if math.isfinite(strength) else "–"


def table(found: Iterable[Outcome], *, turning: bool) -> Iterator[str]:
    """A row of the table after another."""
    yield "| pathology | strength | moves | noticed | silent | by chance |"
    yield "|---|---|---|---|---|---|"
    by_name: dict[str, dict[float, list[Outcome]]] = defaultdict(lambda: defaultdict(list))
    for one in found:
        if one.turning == turning:
            by_name[one.name][one.strength].append(one)
    for pathology in PATHOLOGIES:
        if pathology.name not in by_name:
            continue
        told = row(by_name[pathology.name])
        noticed = _shown(told.noticed) if told.is_in_time else f"**{_shown(told.noticed)}**"
        silent = f"{told.silent} of {told.recordings}"
        cells = (
            pathology.name,
            pathology.unit,
            _shown(told.moves),
            noticed,
            silent if told.is_chance else f"**{silent}**",
            f"{MISSES * told.unnamed:.2g}",
        )
        yield f"| {' | '.join(cells)} |"


_WORDS: Final = "## What is found, and what to do"


def words() -> str:
    """The findings by name, as the package has them."""
    lines = [
        _WORDS,
        "",
        "They are looked for in this order; the last five are seen on reading or beside the "
        "answer. `--accept NAME` takes a finding knowingly; the first three leave nothing to be "
        "read.",
        "",
        "| name | what is seen | what it does to N | what to do |",
        "|---|---|---|---|",
    ]
    for one in DETECTORS:
        remedy = worded(one.remedy, lambda option, _: f"`--{option}`")
        lines.append(f"| `{one.name}` | {one.sees} | {one.effect} | {remedy} |")
    return "\n".join(lines) + "\n"


def with_words(text: str) -> str:
    """The page with its table of findings as the package has them."""
    head, _, rest = text.partition(_WORDS)
    _, title, tables = rest.partition("## At rest")
    return f"{head}{words()}\n{title}{tables}"


def page(found: Sequence[Outcome], seeds: int) -> str:
    """Both tables, and how to read them."""
    minutes = SAMPLES / RATE / 60.0
    x, z = SHARES["x"], SHARES["z"]
    lines = [
        "# What goes wrong in a recording, and whether it is said",
        "",
        f"`python -m benchmarks.pathologies {seeds}` writes this. A gyro of N = {WALK} °/√h at "
        f"{RATE:g} Hz is recorded for {minutes:g} min, {seeds} times at each strength.",
        "",
        "- *Moves*: the least strength tried at which the mean N, with every finding accepted, "
        f"is {100.0 * MOVED:g} % off, or at which every recording is refused.",
        "- *Noticed*: the least strength at which most recordings name a fault or are refused. It "
        "is bold if it is larger than *Moves*.",
        "- *Silent*: recordings whose interval does not hold N and in which nothing is said. A "
        "95 % interval misses N in 5 % of sound recordings, too. *By chance* is 5 % of the "
        "recordings in which nothing is said; the count is bold if chance makes it in less than "
        f"{RARE:g} of all cases.",
        "- A dash: at no strength tried.",
        "- Noise that grows has its N at the start for the truth; N over the record is higher by "
        "half of the growth.",
        "",
        words().rstrip(),
    ]
    for turning, title in (
        (False, "At rest"),
        (True, f"A pair on a table at {TABLE:g} °/s; the shares of its rate are {x} and {z}"),
    ):
        lines += ["", f"## {title}", "", *table(found, turning=turning)]
    return "\n".join(lines) + "\n"


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seeds", nargs="?", type=int, default=20, help="recordings a strength")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--only", default="", help="part of the names of the pathologies")
    parser.add_argument("--results", type=Path, default=RESULTS, help="JSON lines, added to")
    parser.add_argument("--words", action="store_true", help="the table of findings alone")
    asked = parser.parse_args(arguments)
    if asked.words:
        PAGE.write_text(with_words(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
        return
    known = stored(asked.results)
    wanted = list(keys_of(range(asked.seeds), asked.only))
    missing = [key for key in wanted if key not in known]
    for done, one in enumerate(run(missing, asked.results, asked.workers), 1):
        known[one.key] = one
        if done % 100 == 0:
            print(f"{done} of {len(missing)}", flush=True)
    found = [known[key] for key in wanted]
    text = page(found, asked.seeds)
    if not asked.only:
        PAGE.write_text(text, encoding="utf-8")
    print(text)
    slowest = sorted(found, key=lambda one: -one.seconds)[:5]
    for one in slowest:
        print(f"{one.seconds:.1f} s: {one.name}, {one.strength:g}, turning {one.turning}")


if __name__ == "__main__":
    main(sys.argv[1:])
