"""The judgement of a recording: every pathology by name and effect, and nothing of sound data."""

import re
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from benchmarks.pathologies import with_words

import sagnac
from sagnac.core import arrays
from sagnac.core.errors import worded
from sagnac.quality.check import DETECTORS, FINDINGS, accept, check, judged
from sagnac.quality.effects import effect_words, finding, level_of
from sagnac.recording.model import Recording
from tests.quality.pathologies import (
    MEAN,
    PATHOLOGIES,
    RATE,
    SAMPLES,
    SIGMA,
    angle,
    of_angle,
    of_rate,
    still,
)
from tests.quality.recordings import mapped


@cache
def made(case):
    recording = PATHOLOGIES[case][1]()
    return recording, judged(recording)


@pytest.mark.parametrize("case", PATHOLOGIES)
def test_a_pathology_is_found_with_what_it_does_to_the_walk(case):
    name, _, effect = PATHOLOGIES[case]
    assert name in FINDINGS
    (found,) = [note for note in made(case)[1] if note.name == name]
    assert found.text.count("\n") == 0
    if effect is not None:
        assert found.effect == pytest.approx(effect, rel=0.08, abs=0.05)
    # The answer goes without spikes and bumps; its interval covers noise that is not very unsteady.
    survived = ("a block twice", "grows by a fifth")
    is_survived = name in ("spikes", "moved") or case in survived
    assert found.level == ("warning" if is_survived else "error")


@pytest.mark.parametrize("case", PATHOLOGIES)
def test_findings_are_the_same_span_by_span(monkeypatch, case):
    recording, found = made(case)
    monkeypatch.setattr(arrays, "IN_MEMORY", 0)
    monkeypatch.setattr(arrays, "BLOCK", 999)
    assert judged(mapped(recording)) == found


def test_a_pair_is_said_once_and_only_the_gyros_asked_for_are_looked_at():
    recording = of_rate(still(), y=np.clip(still(2), MEAN, 99.0), z=still(3))
    assert [note.channel for note in judged(recording)] == ["y"]
    assert judged(recording, ("x", "z")) == ()


def sound(seed: int) -> dict[str, Recording]:
    random = np.random.default_rng(seed)
    white = random.standard_normal(SAMPLES)
    seconds = np.arange(SAMPLES) / RATE
    rate = MEAN + SIGMA * white + 0.02 * np.cumsum(random.standard_normal(SAMPLES))
    turned = angle(rate)
    smooth = np.convolve(rate, np.full(5, 0.2), "valid")
    return {
        "rate": of_rate(rate),
        "pair": of_rate(rate, z=9.0 + 2.0 * random.standard_normal(SAMPLES)),
        "one decimal": of_rate(np.round(rate, 1)),
        "single precision": of_rate(rate.astype(np.float32)),
        "low-pass": of_rate(smooth),
        "line": of_rate(rate + 20.0 * np.sin(2.0 * np.pi * 17.3 * seconds)),
        "warm-up": of_rate(rate + 50.0 * np.exp(-seconds / 100.0)),
        "angle": of_angle(turned),
        "coarse angle": of_angle(0.1 * np.rint(turned / 0.1)),
        "noisy angle": of_angle(turned + 0.5 * random.standard_normal(SAMPLES)),
        "counts": Recording.from_arrays(
            x=np.rint(3.0 * white), kind="increment", unit="0.1arcsec", sample_rate=RATE
        ),
        "few counts": Recording.from_arrays(
            x=np.diff(np.rint(0.3 * np.cumsum(white))),
            kind="increment",
            unit="arcsec",
            sample_rate=RATE,
        ),
    }


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.statistics) for seed in (2, 3, 4))]
)
def test_nothing_is_found_in_sound_recordings(seed):
    found = {name: judged(one) for name, one in sound(seed).items()}
    assert {name: notes for name, notes in found.items() if notes} == {}


def test_two_gyros_that_share_a_line_are_no_copies():
    seconds = np.arange(SAMPLES) / RATE
    dither = 200.0 * np.sin(2.0 * np.pi * 29.9 * seconds)
    later = 200.0 * np.sin(2.0 * np.pi * 29.9 * (seconds - 0.05))
    assert not [
        note
        for note in judged(of_rate(still(1) + dither, z=still(2) + later))
        if note.name == "copy"
    ]


@pytest.mark.parametrize("period", [2, 3, 4, 6])
def test_a_line_that_takes_few_values_is_no_wrap(period):
    line = np.tile(500.0 * np.cos(2.0 * np.pi * np.arange(period) / period + 0.3), SAMPLES)
    found = judged(of_rate(still() + line[:SAMPLES]))
    assert "wraps" not in [note.name for note in found]


def test_the_level_follows_the_effect():
    assert level_of(1.04) == level_of(0.96) == "warning"
    assert level_of(1.06) == level_of(0.94) == level_of(None) == "error"
    # Half of what a known factor moves is left if an answer is divided by it.
    assert level_of(1.09, "resolution") == level_of(0.91, "clipping") == "warning"
    assert level_of(1.11, "resolution") == level_of(0.89, "clipping") == "error"
    assert level_of(1.06, "copy") == "error"
    assert effect_words(1.001) == "the angle random walk moves by less than 1 %"
    assert "0.72 times" in effect_words(0.72)
    assert finding("copy", "x", "is one", effect=float("inf")).effect is None


def test_nothing_is_divided_by_a_factor_that_is_not_known():
    noted = finding("resolution", "x", "is stored in float32", effect=None, level="warning")
    assert noted.text.endswith("what that does to the angle random walk is not known")
    assert finding("resolution", "x", "has steps", effect=1.04).text.endswith("divided by that")


def test_an_accepted_finding_is_a_remark_that_says_so():
    found = made("upper half clipped")[1]
    (note,) = accept(found, ("clipping",))
    assert note.level == "remark"
    assert note.text.startswith("accepted: is saturated")
    assert accept(found, ("copy",)) == found
    for wrong in ("clipping", ("clip",)):
        with pytest.raises(ValueError, match="accepted is"):
            sagnac.check(PATHOLOGIES["upper half clipped"][1](), accepted=wrong)


def test_the_list_of_detectors_names_what_is_found():
    """Every name that a note or a finding is given stands in the list, and no other."""
    package = Path(sagnac.__file__).parent
    named = set()
    for room in ("recording", "quality", "analysis", "formats"):
        for path in (package / room).glob("*.py"):
            code = path.read_text(encoding="utf-8")
            named.update(re.findall(r'finding\(\s*"([a-z-]+)"', code))
            named.update(re.findall(r'Note\([^()]*?name="([a-z-]+)"', code))
            named.update(re.findall(r'name="(wraps)" if', code))
    assert named == {one.name for one in DETECTORS}
    assert named - set(FINDINGS) == {"gaps", "missing", "stuck"}


def test_the_list_of_detectors_stands_on_its_page():
    page = Path(__file__).parents[2] / "docs" / "pathologies.md"
    text = page.read_text(encoding="utf-8")
    assert with_words(text) == text, "python -m benchmarks.pathologies --words"
    for one in DETECTORS:
        assert f"| `{one.name}` | {one.sees} | {one.effect} | " in text
        assert "{" not in worded(one.remedy)


def test_accelerometers_are_judged_as_gyros_are():
    """Half of the samples of one stand at its limit; the others are sound."""
    forces = {name: 9.8 + 1e-3 * still(seed) for seed, name in enumerate(("ax", "ay", "az"), 5)}
    units = {"x": "deg/h", **dict.fromkeys(forces, "m/s^2")}
    with_forces = partial(Recording.from_arrays, kind="rate", unit=units, sample_rate=RATE)
    assert check(with_forces(x=still(), **forces)) == ()
    limit = float(np.median(forces["az"]))
    (found,) = check(with_forces(x=still(), **{**forces, "az": np.minimum(forces["az"], limit)}))
    assert (found.name, found.channel, found.level) == ("clipping", "az", "error")
    # The walk of a gyro has another name.
    assert "velocity random walk" in found.text
    assert "angle" not in found.text


def test_a_unit_of_accelerometers_that_gravity_contradicts_is_said_once():
    """9.8 g were said to turn at 5510 deg/s besides, as of a gyro."""
    forces = {name: 9.8 * axis + 1e-3 * still(axis) for axis, name in enumerate(("ax", "az"))}
    for unit, names in (("g", ["units"]), ("m/s^2", [])):
        units = {"x": "deg/h", **dict.fromkeys(forces, unit)}
        made = Recording.from_arrays(x=still(), **forces, kind="rate", unit=units, sample_rate=RATE)
        assert [note.name for note in check(made)] == names
