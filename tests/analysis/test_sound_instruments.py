"""Sound recordings of instruments that are not the rig's: what is said of them, and N.

Two hundred on a turning table and forty on a still bench (``make test-statistics``), and some of
either in every run of the tests.
"""

import numpy as np
import pytest

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.result import Analysis
from sagnac.analysis.settings import Settings
from sagnac.recording.model import Recording
from tests.instruments import WALK_UNIT, Readout, bench, turntable

# Of forty on tables, chance makes five misses one time in twenty; of two hundred it cannot.
COUNTS = {"table": 200, "bench": 40}
LEAST_HELD, MOST_WARNED = 0.93, 0.05


def on_table(number: int) -> tuple[Recording, float]:
    """Laser gyros in counts of 0.0008 arcsec, as a file of one of several makers holds them."""
    random = np.random.default_rng([77, number])
    made = turntable(
        number,
        seconds=600.0,
        sample_rate=float(random.choice([200.0, 400.0])),
        table_rate=float(random.choice([5.0, 20.0, 40.0])),
        walk=float(random.choice([2.5e-5, 1e-4, 1e-3])),
        mains=float(random.choice([0.0, 0.005, 0.05])),
        orders=float(random.choice([0.0, 2.0, 20.0])),
        jitter=float(random.choice([1e-5, 1e-4, 1e-3])),
        readout=Readout(step=0.0008),
    )
    angles, unit = made.angles, "arcsec"
    stored = number % 3
    if stored == 1:
        unit = "deg"
        angles = {name: one * (0.0008 / 3600.0) / 0.0008 for name, one in angles.items()}
    elif stored == 2:
        unit = "deg"
        angles = {name: np.round(one / 3600.0, 9) for name, one in angles.items()}
    recording = Recording.from_arrays(
        kind="angle",
        unit=unit,
        sample_rate=made.sample_rate,
        table=made.encoder,
        table_unit="deg",
        **angles,
    )
    return recording, made.walk


def on_bench(number: int) -> tuple[Recording, float]:
    """A gyro at rest: MEMS in 16 bit counts behind a low-pass, or fibre in decimal text."""
    random = np.random.default_rng([78, number])
    rate = float(random.choice([100.0, 200.0, 400.0]))
    mains = float(random.choice([0.0, 0.3, 2.0]))
    if number % 2:
        made = bench(
            number,
            sample_rate=rate,
            walk=float(random.choice([0.15, 0.3])),
            bias_instability=float(random.choice([0.0, 5.0])),
            low_pass=40.0,
            mains=mains,
            readout=Readout(
                step=float(random.choice([1.0 / 131.0, 0.00875, 0.02])),
                storage=str(random.choice(["float64", "float32", "text"])),
                decimals=5,
            ),
        )
    else:
        made = bench(
            number,
            sample_rate=rate,
            walk=float(random.choice([0.002, 0.02])),
            bias=0.001,
            mains=mains,
            sway=float(random.choice([0.0, 2e-4])),
            readout=Readout(step=1e-6, storage="text", decimals=6),
        )
    recording = Recording.from_arrays(
        kind="rate", unit="deg/s", sample_rate=rate, x=made.rates["x"]
    )
    return recording, made.walk


def answered(made: tuple[Recording, float], *gyros: str) -> tuple[Analysis, bool, list[str]]:
    """The analysis, whether its interval holds N, and what it warns of."""
    recording, walk = made
    analysis = analyze(recording, Settings(gyros=gyros))
    found = analysis.angle_random_walk
    holds = found.status == "estimated" and found.low <= walk * WALK_UNIT <= found.high
    return analysis, holds, [str(note) for note in analysis.notes if note.level != "remark"]


@pytest.mark.parametrize(
    ("where", "number", "gyros"),
    [*((on_table, number, "xz") for number in (1, 2)), (on_bench, 0, "x"), (on_bench, 1, "x")],
)
def test_nothing_is_said_of_a_sound_recording(where, number, gyros):
    analysis, _, warned = answered(where(number), *gyros)
    assert analysis.angle_random_walk.status == "estimated"
    assert warned == []


@pytest.mark.statistics
@pytest.mark.parametrize(("where", "count"), COUNTS.items())
def test_many_sound_recordings(where, count):
    held, warned = 0, []
    for number in range(count):
        made = on_table(number) if where == "table" else on_bench(number)
        _, holds, said = answered(made, *(("x", "z") if where == "table" else ("x",)))
        held += holds
        warned += [f"{number}: {' | '.join(said)}"] if said else []
    print(f"{where}: {held} of {count} hold N, {len(warned)} with a warning", *warned, sep="\n")
    assert len(warned) <= MOST_WARNED * count
    assert held >= LEAST_HELD * count
