"""Configuration: presets, TOML, refusals, documentation."""

import dataclasses
import inspect
import json
import re
from dataclasses import replace
from functools import reduce
from pathlib import Path

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.rig.config import RigConfig, preset
from sagnac.rig.sections import ConfigurationError, GyroConfig, TableConfig, allowed, rules_of
from sagnac.rig.simulate import simulate


def test_toml_is_laid_over_its_preset(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(
        'preset = "paper"\nduration_s = 60\nseed = 9\n'
        "[table]\nrate_deg_per_s = 20\nprofile = [[0, 10], [30, 20]]\n"
        "[gyro]\narw_deg_per_sqrt_h = 3e-5\nbias_deg_per_h = [1, 2, 3]\n"
    )
    config = RigConfig.from_toml(path)
    assert (config.duration_s, config.seed, config.table.rate_deg_per_s) == (60, 9, 20)
    assert config.table.profile == ((0, 10), (30, 20))
    assert config.gyro.arw_deg_per_sqrt_h == (3e-5, 3e-5, 3e-5)
    assert config.gyro.bias_deg_per_h == (1, 2, 3)
    assert config.disturbances == preset("paper").disturbances
    assert RigConfig.from_mapping({}) == RigConfig()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("speed = 3", r"unknown key 'speed'; did you mean seed\? known here: duration_s, "),
        (
            "[table]\nrate = 40",
            r"unknown key 'table\.rate'; did you mean table\.rate_deg_per_s\? known here: rate",
        ),
        ("noise = 3", r"unknown key 'noise'; known here: duration_s, "),
        ("table = 3", r"table is 3; it is a table, write \[table\]"),
        ("[table]\nrate_deg_per_s = 900", r"table\.rate_deg_per_s is 900; .*from -400 to 400"),
        ("[table]\nrate_deg_per_s = nan", r"table\.rate_deg_per_s is nan; .*from -400 to 400"),
        ('[table]\nrate_deg_per_s = "40"', r"table\.rate_deg_per_s is '40'; it must be a number"),
        ("seed = 1.5", r"seed is 1\.5; it must be a whole number"),
        ("seed = true", r"seed is True; it must be a number"),
        ("[table]\nripple = [[12, 0.5]]", r"table\.ripple \(fraction\) is 0\.5; .*0 to 0\.2"),
        ("[table]\nripple = [12, 0.1]", r"table\.ripple holds 12; .*pairs \[order, fraction\]"),
        ("[table]\nripple = 12", r"table\.ripple is 12; it must be a list of pairs"),
        ("[gyro]\narw_deg_per_sqrt_h = [1, 2]", r"arw_deg_per_sqrt_h is \[1, 2\]; .*list of three"),
        ("[gyro]\narw_deg_per_sqrt_h = [1, 2, 30]", r"arw_deg_per_sqrt_h is 30; .*from 0 to 10"),
        ("[gyro]\narw_deg_per_sqrt_h = -1", r"gyro\.arw_deg_per_sqrt_h is -1; .*from 0 to 10"),
        ('[gyro]\nmode = "fast"', r"gyro\.mode is 'fast'; use one of ideal, still, dithered"),
        ('preset = "calm"', r"'calm' does not exist; use one of quiet, paper, dithered, harsh"),
        ("[disturbances]\ntime = [[300, 1]]", r"300 Hz is above 250 Hz, half of sample_rate_hz"),
        ("[table]\nprofile = [[5, 1], [5, 2]]", r"table\.profile: times .* do not increase"),
        ("duration_s = 0.01\nsample_rate_hz = 1", r"holds no sample at 1 Hz; make it longer"),
        (
            "[table]\nreversal_interval_s = 0.5",
            r"reversal_interval_s 0\.5 leaves no time to turn round in 0\.8 s",
        ),
        (
            "[table]\nreversal_interval_s = 60\ndwell_s = 59.5",
            r"reversal_interval_s 60 leaves no time to turn round in 60\.3 s",
        ),
        (
            "[table]\ndwell_s = 5",
            r"table\.dwell_s is 5, but nothing says when the table stands; give table",
        ),
        (
            "sample_rate_hz = 20\n[motion]\nnutation_hz = 6\nnutation_rms_arcsec = 1",
            r"motion\.nutation_hz 6 is above 5 Hz, a quarter of sample_rate_hz; lower it",
        ),
        (
            "[encoder]\nlatency_s = 0.1\nclock_ppm = 300",
            r"clock_ppm put readings 2\.25\d* s late after 7200 s; keep it from 0 to 2 s; ",
        ),
        (
            "[encoder]\nlatency_s = 0.001\nclock_ppm = -20",
            r"put readings -0\.143\d* s late after 7200 s; keep it from 0 to 2 s; a clock that ",
        ),
        (
            "[table]\nripple = [[1, 0.2], [2, 0.2], [3, 0.2], [4, 0.2], [5, 0.2]]",
            r"table\.ripple: fractions add up to 1",
        ),
        ('[gyro]\nmode = "still"', r"gyro\.mode is 'still' on a turning table"),
        (
            '[gyro]\nmode = "rate-biased"\n[table]\nreversal_interval_s = 10',
            r"gyro x comes down to 0 deg/s; the table must turn one way and give it 0\.0667",
        ),
        (
            '[gyro]\nmode = "dithered"\ndither_rate_deg_per_s = 20',
            r"gyro\.mode 'dithered': input rate .* raise the dither's rate",
        ),
        ("table]", r"no TOML"),
    ],
)
def test_a_wrong_configuration_is_refused_in_one_line(tmp_path, text, message):
    path = tmp_path / "rig.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=message) as caught:
        RigConfig.from_toml(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_a_missing_configuration_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"none\.toml: no such file"):
        RigConfig.from_toml(tmp_path / "none.toml")
    with pytest.raises(ValueError, match="cannot be opened"):
        RigConfig.from_toml(tmp_path)


def meanings_of(section, prefix=""):
    """What the docstring of each section says of its keys, by their dotted names."""
    blocks = inspect.getdoc(type(section)).partition("Attributes\n----------\n")[2]
    said = dict(re.findall(r"^(\w+)\n((?: {4}.*\n?)+)", blocks, re.M))
    found = {prefix + name: " ".join(text.split()) for name, text in said.items()}
    for field in dataclasses.fields(section):
        inner = getattr(section, field.name)
        if dataclasses.is_dataclass(inner):
            found |= meanings_of(inner, f"{field.name}.")
    return found


def test_every_key_is_documented_with_its_default_and_range():
    text = (Path(__file__).parents[2] / "docs" / "simulate.md").read_text()
    rows = [
        [cell.strip() for cell in line.strip("|").split(" | ")]
        for line in text.splitlines()
        if line.startswith("| `")
    ]
    known, meanings = rules_of(RigConfig), meanings_of(RigConfig())
    assert [row[0].strip("`") for row in rows] == list(known)
    for name, default, shown_range, meaning in rows:
        rule = known[name.strip("`")]
        assert meaning == meanings[name.strip("`")]
        value = reduce(getattr, name.strip("`").split("."), RigConfig())
        shown = json.loads(default.strip("`"))
        if isinstance(value, tuple) and not isinstance(shown, list):
            shown = [shown] * 3
        assert (list(value) if isinstance(value, tuple) else value) == shown
        assert shown_range == allowed(rule)


@pytest.mark.parametrize("name", ["quiet", "paper", "dithered", "harsh"])
def test_presets_run_and_hold_their_place_in_the_paper(name):
    config = preset(name)
    assert max(abs(d) for d in config.platform.share_deviation) <= 0.002  # Eq. 2
    assert config.encoder.lines == 7_200_000
    simulation = simulate(replace(config, duration_s=2.0))
    assert all(np.isfinite(g.values).all() for g in simulation.recording.gyros)


def test_a_file_that_is_wrong_is_an_error_as_data(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text("[table]\nrate_deg_per_s = 900")
    with pytest.raises(RecordingError) as caught:
        RigConfig.from_toml(path)
    error = caught.value
    assert (error.path, error.problem) == (str(path), "table.rate_deg_per_s is 900")
    assert error.remedy == "it must lie from -400 to 400"


def test_every_section_checks_itself_as_it_is_made():
    with pytest.raises(
        ConfigurationError, match=r"^gyro\.warm_up_time_s is 0; it must lie from 1 "
    ):
        GyroConfig(warm_up_time_s=0)
    with pytest.raises(ConfigurationError, match=r"^table is 3; it is a table"):
        RigConfig(table=3)
    with pytest.raises(ConfigurationError, match=r"^seed is 0\.5; it must be a whole number"):
        RigConfig(seed=0.5)


def test_repr_is_one_short_line():
    shown = repr(preset("harsh"))
    assert shown == "RigConfig(7200 s at 500 Hz, table at 40 deg/s, gyros ideal, seed 1)"
    profile = RigConfig(table=TableConfig(profile=((0.0, 1.0), (5.0, 2.0))))
    assert "on a profile of 2 knots" in repr(profile)
