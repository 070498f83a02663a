"""What was tried to explain Figure 3."""

import pytest

from sagnac.paper import trials
from sagnac.paper.trials import NEAREST_TRIAL
from sagnac.rig.truth import truth_of


def test_trials_have_the_line_that_they_name():
    named = {trial.name: trial for trial in trials.trials()}
    line = next(
        line for line in truth_of(named[NEAREST_TRIAL].config).lines
        if line.scale == "time"
    )  # fmt: skip
    assert line.amplitude_arcsec["z"] == pytest.approx(0.0387, rel=1e-9)
    assert line.frequency_hz == pytest.approx(1.0 / 39.9)
    assert named["white"].config.disturbances.time == ()
    assert min(f for f, _ in named["aliasing"].config.disturbances.time) > 0.5


def test_trials_differ_from_the_preset_in_what_they_name_alone():
    made = trials.trials(60.0)
    assert [trial.name for trial in made[:2]] == ["as-simulated", "white"]
    assert made[-1].method == "fos"
    base = made[0].config
    assert made[-1].config == base
    assert {trial.config.duration_s for trial in made} == {60.0}
    for trial in made:
        if trial.name != "warm-up":
            assert trials.with_time_lines(trial.config, ()) == trials.with_time_lines(base, ())
