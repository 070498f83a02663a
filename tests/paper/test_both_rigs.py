"""The paper's method on the rig and on a simulator that shares no code with it."""

from dataclasses import replace

import pytest

from sagnac.analysis.pipeline import answer_of
from sagnac.analysis.settings import Settings
from sagnac.core.units import DEGREE_PER_ROOT_HOUR
from sagnac.recording.model import Recording
from sagnac.rig.config import preset
from sagnac.rig.simulate import simulate
from tests import second_rig
from tests.analysis.recorded import recorded

HALF_AN_HOUR, SAMPLE_RATE = 1800.0, 250.0
TRUTH = 2.5e-5  # deg/sqrt(h), of every gyro of both
BY_PAPER = Settings(gyros=("x", "z"), method="fos-paper")


def on_rig(rate: float, jitter: float) -> Recording:
    base = preset("paper")
    return simulate(
        replace(
            base,
            seed=round(rate),
            duration_s=HALF_AN_HOUR,
            sample_rate_hz=SAMPLE_RATE,
            table=replace(base.table, rate_deg_per_s=rate),
            encoder=replace(base.encoder, latch_jitter_s=jitter),
        )
    ).recording


def on_second_rig(rate: float, jitter: float) -> Recording:
    """A table whose rate wanders by 3e-4 of itself, and hunts; shares differ by 0.002."""
    length = {"seconds": HALF_AN_HOUR, "sample_rate": SAMPLE_RATE, "seed": round(rate)}
    return recorded(second_rig.simulate(second_rig.Bench(rate=rate, jitter=jitter, **length)))


@pytest.mark.parametrize(
    ("on", "rate", "jitter"),
    [
        pytest.param(on_rig, 10.0, 2e-5, marks=pytest.mark.statistics),
        (on_rig, 40.0, 1e-4),
        (on_second_rig, 20.0, 5e-4),
        pytest.param(on_second_rig, 60.0, 2e-5, marks=pytest.mark.statistics),
    ],
)
def test_n_is_estimated_within_a_tenth(on, rate, jitter):
    answer = answer_of(on(rate, jitter), BY_PAPER)[0].estimate
    assert answer.status == "estimated"
    assert answer.low > 0.0
    assert answer.value == pytest.approx(TRUTH * DEGREE_PER_ROOT_HOUR, rel=0.1)
