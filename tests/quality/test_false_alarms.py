"""Sound recordings of every kind: what is said of them, counted (``make test-statistics``).

The kinds are those of the gallery whose samples nothing is wrong with, and the rig's presets, at
rest and on a turning table.
"""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.gallery import GALLERY

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.quality.check import integrity, judged
from sagnac.recording.model import Recording
from sagnac.rig.config import preset
from sagnac.rig.simulate import simulate

SEED = 20261212
RATE = 100.0
SAMPLES = 60_000
# One unit of N of the gallery, rad/sqrt(s).
UNIT = 1e-6
# What a finding names by right: these have it in their samples. A dither whose frequency wanders
# by more than its width changes the power that is left between lines.
NAMED = (
    "coarse rate steps",
    "spikes",
    "noise steps half-way",
    "wandering dither, folded",
    "wandering dither in band",
)
KINDS = [name for name in GALLERY if name not in NAMED]
PRESETS = ("quiet", "paper", "dithered", "harsh")
OF_A_KIND, AT_REST, TURNING = 10, 10, 5
RECORDINGS = OF_A_KIND * len(KINDS) + (AT_REST + TURNING) * len(PRESETS)


def of_gallery(name: str, number: int) -> Recording:
    generator = np.random.default_rng([SEED, list(GALLERY).index(name), number])
    x, z = (GALLERY[name](generator, SAMPLES, RATE).increments for _ in range(2))
    return Recording.from_arrays(
        x=UNIT * x, z=UNIT * z, kind="increment", unit="rad", sample_rate=RATE
    )


def of_rig(name: str, number: int, *, table_rate: float) -> Recording:
    config = preset(name)
    table = replace(config.table, rate_deg_per_s=table_rate)
    return simulate(replace(config, duration_s=200.0, seed=number, table=table)).recording


def said(notes) -> list[str]:
    return [f"{one.name} {one.channel}" for one in notes if one.name and one.level != "remark"]


def of_data(recording: Recording) -> list[str]:
    return said((*integrity(recording), *judged(recording)))


def alarms() -> Counter[str]:
    """What is said, by kind."""
    found: Counter[str] = Counter()
    for name in KINDS:
        for number in range(OF_A_KIND):
            found.update(f"{name}: {one}" for one in of_data(of_gallery(name, number)))
    for name in PRESETS:
        for number in range(AT_REST):
            at_rest = of_rig(name, number, table_rate=0.0)
            found.update(f"{name} at rest: {one}" for one in of_data(at_rest))
        for number in range(TURNING):
            analysis = analyze(of_rig(name, number, table_rate=40.0), Settings(gyros=("x", "z")))
            found.update(f"{name}, turning: {one}" for one in said(analysis.findings))
    return found


@pytest.mark.statistics
def test_nothing_is_said_of_sound_recordings():
    found = alarms()
    print(f"{RECORDINGS} sound recordings: {dict(found) or 'nothing is said'}")
    assert RECORDINGS >= 200
    assert not found
