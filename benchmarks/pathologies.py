"""What goes wrong in a recording: from what strength N moves, and from what it is noticed.

``python -m benchmarks.pathologies [SEEDS]`` writes docs/pathologies.md. A still gyro of
N = 0.003 deg/sqrt(h), 100 Hz, and a pair on a table that turns at 20 deg/s, three minutes each.
"""

import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

import sagnac
from sagnac.analysis.settings import Method
from sagnac.arrays import FloatArray
from sagnac.errors import RecordingError
from sagnac.recording.effects import FINDINGS
from sagnac.recording.quality import integrity

RATE: Final = 100.0
SAMPLES: Final = 18_000
WALK: Final = 0.003  # deg/sqrt(h)
SIGMA: Final = WALK * 60.0 * math.sqrt(RATE)  # deg/h
MEAN: Final = 10.0  # deg/h
TABLE: Final = 20.0  # deg/s
SHARE: Final = 0.577
MOVED: Final = 0.05

Generator = np.random.Generator
Spoil = Callable[[FloatArray, float, Generator], FloatArray]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pathology:
    """One fault of the samples of a gyro.

    Attributes
    ----------
    name, unit
        What it is, and what its strength counts.
    strengths
        From weak to strong.
    spoil
        Rates (deg/h), strength and generator -> the rates of the file.
    """

    name: str
    unit: str
    strengths: tuple[float, ...]
    spoil: Spoil


def _clip(low: float, high: float) -> Spoil:
    """Limits at `low` and `high` sigma, divided by the strength: a stronger one lies nearer."""

    def spoil(rate: FloatArray, strength: float, _: Generator) -> FloatArray:
        mean = float(np.median(rate))
        reach = SIGMA / strength
        return np.clip(rate, mean + low * reach, mean + high * reach)

    return spoil


def _at(share: float, random: Generator) -> FloatArray:
    return random.random(SAMPLES) < share


def _spiked(height: float) -> Spoil:
    def spoil(rate: FloatArray, share: float, random: Generator) -> FloatArray:
        return np.where(_at(share, random), rate + height * SIGMA, rate)

    return spoil


def _one_spike(rate: FloatArray, strength: float, random: Generator) -> FloatArray:
    rate = rate.copy()
    rate[random.integers(100, SAMPLES - 100)] += strength * SIGMA
    return rate


def _lost(rate: FloatArray, share: float, random: Generator) -> FloatArray:
    return np.where(_at(share, random), 0.0, rate)


def _held(rate: FloatArray, share: float, random: Generator) -> FloatArray:
    rate = rate.copy()
    for place in np.flatnonzero(_at(share, random)[1:]) + 1:
        rate[place] = rate[place - 1]
    return rate


def _stuck(length: int) -> Spoil:
    def spoil(rate: FloatArray, share: float, random: Generator) -> FloatArray:
        rate = rate.copy()
        for start in random.integers(0, SAMPLES - length, round(share * SAMPLES / length)):
            rate[start : start + length] = rate[start]
        return rate

    return spoil


def _coarse(rate: FloatArray, strength: float, _: Generator) -> FloatArray:
    return strength * SIGMA * np.rint(rate / (strength * SIGMA))


def _unsigned(bits: int) -> Spoil:
    def spoil(rate: FloatArray, strength: float, _: Generator) -> FloatArray:
        counts = np.rint((rate - np.median(rate)) / SIGMA * 20.0 + 60.0 - 30.0 * strength)
        return np.where(counts < 0, counts + 2.0**bits, counts) * SIGMA / 20.0

    return spoil


def _louder(factor: float) -> Spoil:
    def spoil(rate: FloatArray, share: float, random: Generator) -> FloatArray:
        rate = rate.copy()
        count = round(share * SAMPLES)
        start = int(random.integers(0, SAMPLES - count + 1))
        mean = np.median(rate)
        rate[start : start + count] = mean + factor * (rate[start : start + count] - mean)
        return rate

    return spoil


def _growing(rate: FloatArray, strength: float, _: Generator) -> FloatArray:
    mean = np.median(rate)
    return mean + (rate - mean) * (1.0 + strength * np.linspace(0.0, 1.0, SAMPLES))


def _stepped(rate: FloatArray, strength: float, random: Generator) -> FloatArray:
    rate = rate.copy()
    rate[int(random.integers(SAMPLES // 4, 3 * SAMPLES // 4)) :] += strength * SIGMA
    return rate


def _bit(rate: FloatArray, share: float, random: Generator) -> FloatArray:
    """One bit of the counts, of 64 sigma, is wrong now and then."""
    return np.where(_at(share, random), rate + 64.0 * SIGMA, rate)


def _soft(rate: FloatArray, strength: float, _: Generator) -> FloatArray:
    mean = np.median(rate)
    return mean + SIGMA / strength * np.tanh((rate - mean) * strength / SIGMA)


def _zero_runs(rate: FloatArray, share: float, random: Generator) -> FloatArray:
    rate = rate.copy()
    for start in random.integers(0, SAMPLES - 50, round(share * SAMPLES / 50)):
        rate[start : start + 50] = 0.0
    return rate


_SHARES: Final = (1e-4, 1e-3, 0.01, 0.05, 0.2)
_REACHES: Final = (0.25, 0.33, 0.5, 1.0, 3.0)
_TABLE: Final[tuple[tuple[str, str, tuple[float, ...], Spoil], ...]] = (
    (
        "clipped on both sides",
        "sigma/limit",
        _REACHES,
        _clip(-1.0, 1.0),
    ),
    (
        "clipped above",
        "sigma/limit",
        _REACHES,
        _clip(-99.0, 1.0),
    ),
    (
        "clipped below",
        "sigma/limit",
        _REACHES,
        _clip(-1.0, 99.0),
    ),
    ("one spike", "sigma", (5.0, 10.0, 30.0, 100.0, 1000.0), _one_spike),
    ("spikes of 10 sigma", "share", _SHARES, _spiked(10.0)),
    ("spikes of 100 sigma", "share", _SHARES, _spiked(100.0)),
    ("zeros", "share", _SHARES, _lost),
    ("runs of 50 zeros", "share", _SHARES, _zero_runs),
    ("held samples", "share", _SHARES, _held),
    ("stuck runs of 20", "share", _SHARES, _stuck(20)),
    ("stuck runs of 99", "share", _SHARES, _stuck(99)),
    ("coarse counts", "step/sigma", (0.3, 1.0, 1.2, 2.0, 4.0), _coarse),
    (
        "unsigned, 12 bits",
        "offset",
        (0.0, 1.0, 2.0),
        _unsigned(12),
    ),
    (
        "unsigned, 16 bits",
        "offset",
        (0.0, 1.0, 2.0),
        _unsigned(16),
    ),
    (
        "unsigned, 24 bits",
        "offset",
        (0.0, 1.0, 2.0),
        _unsigned(24),
    ),
    (
        "twice as loud for a while",
        "share",
        _SHARES[1:],
        _louder(2.0),
    ),
    (
        "ten times as loud for a while",
        "share",
        _SHARES[1:],
        _louder(10.0),
    ),
    ("louder and louder", "growth", (0.05, 0.1, 0.3, 1.0, 3.0), _growing),
    ("step of the rate", "sigma", (0.3, 1.0, 3.0, 10.0, 100.0), _stepped),
    ("a bit that flips", "share", _SHARES, _bit),
    ("soft saturation", "sigma/limit", (0.05, 0.1, 0.3, 1.0), _soft),
)
PATHOLOGIES: Final = tuple(
    Pathology(name=name, unit=unit, strengths=strengths, spoil=spoil)
    for name, unit, strengths, spoil in _TABLE
)


def recording(spoil: Spoil, strength: float, seed: int, *, turning: bool) -> sagnac.Recording:
    """A gyro at rest, or a pair on a table, of which the first is spoilt."""
    random = np.random.default_rng(seed)
    table_rate = TABLE + 0.01 * np.sin(2.0 * np.pi * np.arange(SAMPLES) / RATE * TABLE / 30.0)
    sensed = 3600.0 * SHARE * table_rate if turning else MEAN
    x, z = (sensed + SIGMA * random.standard_normal(SAMPLES) for _ in range(2))
    spoilt = spoil(x, strength, random)
    more = {"z": z, "table": np.cumsum(table_rate) / RATE, "table_unit": "deg"} if turning else {}
    return sagnac.Recording.from_arrays(
        x=spoilt, kind="rate", unit="deg/h", sample_rate=RATE, **more
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What one recording gave: N over its truth if nothing is asked, whether it is honest."""

    ratio: float
    named: bool
    held: bool


def outcome(spoilt: sagnac.Recording) -> Outcome:
    """The analysis of a spoilt recording, as it is given, and with everything accepted."""
    if any(note.level == "error" for note in integrity(spoilt)):
        return Outcome(ratio=math.nan, named=True, held=True)
    try:
        # At rest there is no line: nothing is removed.
        method: Method = "none" if spoilt.table is None else "fos"
        given = sagnac.analyze(spoilt, sagnac.Settings(method=method))
        withheld = any(note.level == "error" for note in given.findings)
        taken = (
            sagnac.analyze(spoilt, sagnac.Settings(method=method, accepted=FINDINGS))
            if withheld
            else given
        )
    except RecordingError:
        return Outcome(ratio=math.nan, named=True, held=True)
    walk = given.angle_random_walk.to("deg/sqrt(h)")
    named = any(note.level != "remark" for note in given.findings)
    held = given.angle_random_walk.status == "not observable" or walk.low <= WALK <= walk.high
    return Outcome(
        ratio=taken.angle_random_walk.to("deg/sqrt(h)").value / WALK, named=named, held=held
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A pathology: the least strengths at which N moves and at which it is said, and misses."""

    moves: float
    noticed: float
    silent: int
    recordings: int


def row(pathology: Pathology, seeds: int, *, turning: bool) -> Row:
    """All strengths of one pathology."""
    moves = noticed = math.inf
    silent = count = 0
    for strength in pathology.strengths:
        found = [
            outcome(recording(pathology.spoil, strength, seed, turning=turning))
            for seed in range(seeds)
        ]
        count += seeds
        silent += sum(not one.held and not one.named for one in found)
        ratios = np.array([one.ratio for one in found])
        moved = abs(np.nanmean(ratios) - 1.0) > MOVED if np.isfinite(ratios).any() else True
        moves = min(moves, strength if moved else math.inf)
        said = 2 * sum(one.named for one in found) > seeds
        noticed = min(noticed, strength if said else math.inf)
    return Row(moves=moves, noticed=noticed, silent=silent, recordings=count)


def _shown(strength: float) -> str:
    return f"{strength:g}" if math.isfinite(strength) else "–"


def table(seeds: int, *, turning: bool) -> Iterator[str]:
    """A row of the table after another."""
    yield "| pathology | strength | moves | noticed | silent |"
    yield "|---|---|---|---|---|"
    for pathology in PATHOLOGIES:
        found = row(pathology, seeds, turning=turning)
        cells = [pathology.name, pathology.unit, _shown(found.moves), _shown(found.noticed)]
        cells.append(f"{found.silent} of {found.recordings}")
        yield f"| {' | '.join(cells)} |"


def main(arguments: list[str]) -> None:
    """Write both tables, as far as they are."""
    seeds = int(arguments[0]) if arguments else 20
    lines = [
        "# What goes wrong in a recording, and whether it is said",
        "",
        f"`python -m benchmarks.pathologies {seeds}` writes this. A gyro of N = {WALK} °/√h, "
        f"{RATE:g} Hz, {SAMPLES / RATE / 60.0:g} min, {seeds} recordings of each strength. "
        "*Moves*: the least strength tried at which the mean N, with every finding accepted, is "
        "5 % off. *Noticed*: the least at which most recordings name a fault. *Silent*: "
        "recordings whose interval does not hold N and in which nothing is said. A dash: at no "
        "strength tried.",
    ]
    for turning, title in (
        (False, "At rest"),
        (True, f"A pair on a table at {TABLE:g} °/s, one of them spoilt"),
    ):
        lines += ["", f"## {title}", ""]
        for line in table(seeds, turning=turning):
            lines.append(line)
            print(line, flush=True)
            text = "\n".join(lines) + "\n"
            Path("docs/pathologies.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
