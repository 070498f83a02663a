"""Names of lines: what their frequency beside a stronger one's says."""

import numpy as np
import pytest

from sagnac.lines.components import components_of
from sagnac.lines.model import Line, Removal
from sagnac.lines.naming import _name
from sagnac.lines.state import Record, State

ARCSECOND = np.pi / 648_000
RATE = 100.0
SAMPLES = 60_000


def line(scale, frequency, amplitude):
    return Line(
        scale=scale,
        frequency=frequency,
        frequency_error=0.0,
        amplitude=amplitude,
        amplitude_error=0.0,
        phase=0.0,
        phase_error=0.0,
        significance=1.0,
        channel="x",
    )


def known(turns_a_second):
    table = 2.0 * np.pi * turns_a_second / RATE * np.arange(SAMPLES)
    return State(
        record=Record(angle=np.zeros(SAMPLES), encoder=table, sample_rate=RATE),
        motion=None,
        components=components_of(SAMPLES),
        seen=np.ones(SAMPLES // 2 + 1),
    )


STRONG_TONE = line("time", 23.0, 1e-6)
STRONG_ORDER = line("angle", 5.0, 100.0 * ARCSECOND)


@pytest.mark.parametrize(
    ("weak", "strong", "name"),
    [
        (line("time", 23.1, 1e-8), STRONG_TONE, "sideband of 23 Hz at the table rate"),
        (line("time", 22.8, 1e-8), STRONG_TONE, "sideband of 23 Hz at twice the table rate"),
        (line("time", 23.1, 2e-7), STRONG_TONE, ""),
        (
            line("time", 23.01, 1e-8),
            STRONG_TONE,
            "sideband of 23 Hz (its amplitude or frequency drifts)",
        ),
        (line("time", 23.3, 1e-8), STRONG_TONE, ""),
        (line("time", 0.6, 1e-8), STRONG_ORDER, "sideband of order 5 at the table rate"),
        (line("time", 0.504, 1e-8), STRONG_ORDER, "sideband of order 5 (table jitter)"),
        (
            line("angle", 6.0, 1e-3 * ARCSECOND),
            STRONG_ORDER,
            "sideband of order 5 (encoder error)",
        ),
        (line("angle", 6.0, 1.0 * ARCSECOND), STRONG_ORDER, ""),
        (line("angle", 9.0, 1e-3 * ARCSECOND), STRONG_ORDER, ""),
        (line("angle", 9.37, 1e-3 * ARCSECOND), STRONG_ORDER, "non-integer order"),
    ],
)
def test_a_line_is_named_by_a_stronger_one(weak, strong, name):
    assert _name(weak, (strong,), known(0.1)) == name


@pytest.mark.parametrize(
    ("weak", "name"),
    [
        (line("time", 23.5, 2e-9), "product of 23 Hz and order 5"),
        (line("time", 22.5, 2e-9), "product of 23 Hz and order 5"),
        # Stronger than the two can make it, and where neither their sum nor their difference lies.
        (line("time", 23.5, 2e-8), ""),
        (line("time", 23.45, 2e-9), ""),
        # 10 turns at 0.1 Hz, on either scale.
        (line("time", 1.2, 1e-7), "product of order 7 and order 5"),
        (line("angle", 12.0, 1e-7), "product of order 7 and order 5"),
        (line("angle", 13.0, 1e-7), ""),
    ],
)
def test_a_line_at_the_sum_or_difference_of_two_is_their_product(weak, name):
    seventh = line("angle", 7.0, 50.0 * ARCSECOND)
    assert _name(weak, (STRONG_ORDER, seventh, STRONG_TONE), known(0.1)) == name
    assert _name(weak, (STRONG_TONE,), known(0.1)) == ""


def test_at_rest_there_are_no_sidebands_of_the_table():
    assert _name(line("time", 23.1, 1e-8), (STRONG_TONE,), known(0.0)) == ""


def test_a_line_and_a_removal_check_what_they_are_given():
    with pytest.raises(ValueError, match="scale is 'space'; use one of angle, time"):
        line("space", 1.0, 1.0)
    nothing = {"residual": np.zeros(3), "lines": (), "masked": (), "notes": ()}
    with pytest.raises(ValueError, match=r"taken has shape \(2, 0\); give \(3, bands\)"):
        Removal(**nothing, taken=np.empty((2, 0)))
    removal = Removal(**nothing, taken=np.empty((3, 0)))
    assert not removal.taken.flags.writeable
    assert removal.residual.flags.writeable
