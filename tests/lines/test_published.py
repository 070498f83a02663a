"""The paper's Steps 1 and 2, and the still bench without the package for angles."""

import subprocess
import sys

import numpy as np
import pytest

from sagnac.lines.published import remove_lines_as_published

RATE = 50.0
TIME = np.arange(6000) / RATE


def angle(table=None):
    """A walk, lines on the grid of one cycle a record, and a harmonic of the table."""
    steps = 1e-8 * np.random.default_rng(0).standard_normal(TIME.size)
    total = np.cumsum(steps) + 2e-5 * np.cos(2.0 * np.pi * 3.0 * TIME + 0.4)
    return total if table is None else total + 5e-5 * np.cos(4.0 * table - 0.2)


def test_both_steps_find_their_lines():
    table = 0.7 * TIME + 0.3 * np.sin(0.5 * TIME)
    shares = []
    removal = remove_lines_as_published(
        angle(table), table, RATE, channel="x", progress=shares.append
    )
    orders = [line for line in removal.lines if line.scale == "angle"]
    tones = [line for line in removal.lines if line.scale == "time"]
    assert orders[0].frequency == 4.0
    assert orders[0].amplitude == pytest.approx(5e-5, rel=0.02)
    assert orders[0].phase == pytest.approx(-0.2, abs=0.02)
    assert tones[0].frequency == pytest.approx(3.0)
    assert tones[0].amplitude == pytest.approx(2e-5, rel=0.02)
    assert tones[0].phase == pytest.approx(0.4, abs=0.02)
    assert {line.channel for line in removal.lines} == {"x"}
    assert len(removal.masked) == len(tones)
    assert np.isnan(tones[0].amplitude_error)
    assert shares == [0.3, 0.8, 1.0]
    assert np.std(np.diff(removal.residual)) < 3e-8


def test_at_rest_there_is_the_second_step_alone():
    for table in (None, np.full(TIME.size, 0.3)):
        removal = remove_lines_as_published(angle(), table, RATE, channel="x")
        assert {line.scale for line in removal.lines} == {"time"}
        assert removal.notes == ()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"angle": np.zeros((3, 2))}, r"angle has shape \(3, 2\)"),
        ({"table": np.zeros(3)}, r"table has shape \(3,\)"),
        ({"sample_rate": 0.0}, "sample_rate is 0.0"),
    ],
)
def test_refusals(change, message):
    arguments = {"angle": angle(), "table": None, "sample_rate": RATE} | change
    with pytest.raises(ValueError, match=message):
        remove_lines_as_published(**arguments, channel="x")


WITHOUT = """
import sys
sys.modules["finufft"] = None
import numpy as np
from sagnac.errors import MissingExtra
from sagnac.lines.published import remove_lines_as_published
from sagnac.lines.search import remove_lines
from sagnac.spectrum.sums import angle_sums

time = np.arange(20_000) / 100.0
walk = np.cumsum(1e-8 * np.random.default_rng(0).standard_normal(time.size))
angle = walk + 1e-6 * np.cos(2.0 * np.pi * 17.1234 * time)
removal = remove_lines(angle, None, 100.0, channel="x")
print([round(line.frequency, 3) for line in removal.lines])
remove_lines_as_published(angle, None, 100.0, channel="x")
turning = remove_lines(angle, 0.7 * time, 100.0, channel="x")
print(turning.residual.size)
try:
    angle_sums(time, time, 1000)
except MissingExtra as error:
    print(error.package, error.extra)
    print(error)
"""


def test_neither_bench_nor_table_needs_a_non_uniform_transform():
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    found, samples, names, line = done.stdout.splitlines()
    assert found == "[17.123]"
    assert samples == "20000"
    assert names == "finufft nufft"
    assert line.endswith(
        "needs finufft, which is not installed; install it with pip install 'sagnac[nufft]'"
    )
