"""One step of a gyro's angle on a turning table: what is replaced is said, and N holds."""

import math

import numpy as np
import pytest

from sagnac.analysis.pipeline import analyze
from sagnac.recording.model import Recording

RATE, SECONDS = 100.0, 300.0
# Above what the time of an encoder may wander unseen, so that one gyro alone has an estimate.
WALK = 0.015  # deg/sqrt(h)
STEP = 50.0  # arcsec


def stepping(seed, gyros):
    """Gyros on a table at 40 deg/s whose rate ripples; the angle of x steps once."""
    random = np.random.default_rng(seed)
    samples = round(SECONDS * RATE)
    table = 40.0 + 0.05 * np.sin(2.0 * np.pi * np.arange(samples) / RATE * 40.0 / 30.0)
    table += 5e-3 * random.standard_normal(samples)
    sigma = WALK * 60.0 * math.sqrt(RATE)
    angles = {
        name: np.cumsum(2077.0 * table + sigma * random.standard_normal(samples)) / RATE
        for name in gyros
    }
    angles["x"][random.integers(samples // 4, 3 * samples // 4) :] += STEP
    return Recording.from_arrays(
        **angles,
        kind="angle",
        unit="arcsec",
        sample_rate=RATE,
        table=np.cumsum(table) / RATE,
        table_unit="deg",
    )


@pytest.mark.parametrize("gyros", ["xz", "x"])
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.statistics)])
def test_a_step_is_replaced_and_said_with_what_it_would_add(gyros, seed):
    analysis = analyze(stepping(seed, gyros))
    walk = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert analysis.angle_random_walk.status == "estimated"
    assert walk.low <= WALK <= walk.high < 1.2 * WALK
    (found,) = [note for note in analysis.findings if note.name == "spikes"]
    # Left in, the step adds its square over the duration to N^2 of the difference.
    own = STEP / 3600.0 / math.sqrt(SECONDS / 3600.0)
    added = math.hypot(1.0, own / (math.sqrt(len(gyros)) * WALK))
    assert found.effect == pytest.approx(added, rel=0.05)
    assert found.level == "warning"
