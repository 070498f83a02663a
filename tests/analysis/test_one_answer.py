"""One recording at rest, one answer: by `analyze`, and by either command; one axis or more."""

import json
from dataclasses import replace

import numpy as np
import pytest

import sagnac
from sagnac.analysis.settings import Settings
from sagnac.cli import main

RATE, SAMPLES = 50.0, 9000
# rad/sqrt(s) of x, y, z, and m/s/sqrt(s) of the accelerometers; x and z share a part of theirs.
WALKS = {"x": 2e-6, "y": 3e-6, "z": 2.5e-6, "ax": 3e-4, "ay": 4e-4, "az": 5e-4}
KEYS = ("value", "low", "high")


def recording(gyros, forces=()):
    generator = np.random.default_rng(31)
    noise = {name: walk * generator.standard_normal(SAMPLES) for name, walk in WALKS.items()}
    noise["z"] -= 0.3 * noise["x"]
    bias = {"az": 9.81}
    names = (*gyros, *forces)
    unit = {name: "rad/s" if name in gyros else "m/s^2" for name in names}
    return sagnac.Recording.from_arrays(
        **{name: bias.get(name, 0.0) + np.sqrt(RATE) * noise[name] for name in names},
        kind="rate",
        unit=unit,
        sample_rate=RATE,
    )


def figures(estimates):
    """Figures of what a document says of coefficients."""
    return {
        name: [estimates[name][key] for key in KEYS]
        for name in estimates
        if estimates[name]["status"] != "not observable"
    }


def same(one, other):
    assert one.keys() == other.keys()
    for name, values in one.items():
        np.testing.assert_allclose(values, other[name], rtol=1e-12, atol=0.0)


def of_estimate(estimate, unit):
    shown = estimate.to(unit)
    return [shown.value, shown.low, shown.high]


@pytest.mark.parametrize(
    ("gyros", "forces"),
    [
        (("x",), ()),
        (("x", "z"), ("az",)),
    ],
    ids=["one", "three"],
)
def test_both_commands_and_python_agree(gyros, forces, tmp_path, capsys):
    path = sagnac.write(recording(gyros, forces), tmp_path / "unit.parquet")
    found = sagnac.analyze(sagnac.read(path))
    printed = {}
    for command in ("analyze", "avar"):
        assert main([command, str(path), "--json"]) == 0
        printed[command] = json.loads(capsys.readouterr().out)
    of_analyze = printed["analyze"].get("gyros", {gyros[0]: printed["analyze"]})
    analyses = printed["avar"].get("analyses", [printed["avar"]])
    of_avar = {one["channel"]: one for one in analyses}
    assert list(of_analyze) == list(of_avar) == list(gyros)
    for name in gyros:
        mine = found.gyros.get(name, found)
        # What stands beside a gyro does not move its answer.
        alone = sagnac.analyze(recording((name,)))
        assert alone.angle_random_walk.status == "estimated"
        np.testing.assert_allclose(
            of_estimate(mine.angle_random_walk, "rad/sqrt(s)"),
            of_estimate(alone.angle_random_walk, "rad/sqrt(s)"),
            rtol=1e-12,
        )
        same(figures(of_avar[name]["coefficients"]), figures(of_analyze[name]["coefficients"]))
        for coefficient, estimate in mine.coefficients.items():
            said = of_analyze[name]["coefficients"][coefficient]
            assert said["status"] == estimate.status == alone.coefficients[coefficient].status
            if estimate.status != "not observable":
                np.testing.assert_allclose(
                    [said[key] for key in KEYS], of_estimate(estimate, said["unit"]), rtol=1e-12
                )
        for one in (of_analyze[name], of_avar[name]):
            answer = [one["angle_random_walk"][key] for key in KEYS]
            shown = of_estimate(mine.angle_random_walk, "deg/sqrt(h)")
            np.testing.assert_allclose(answer, shown, rtol=1e-12)
    assert list(found.accelerometers) == list(forces)
    for name in forces:
        walk = found.accelerometers[name].angle_random_walk
        assert 0.9 * WALKS[name] < walk.value < 1.1 * WALKS[name]
        for document in (printed["analyze"], printed["avar"]):
            forced = document["accelerometers"][name]["velocity_random_walk"]
            np.testing.assert_allclose(
                [forced[key] for key in KEYS], of_estimate(walk, "m/s/sqrt(h)"), rtol=1e-12
            )


def test_each_holds_its_own_and_the_first_stands_on_top():
    found = sagnac.analyze(recording(("x", "y", "z")))
    assert (found.channel, found.is_pair) == ("x", False)
    assert found.angle_random_walk == found.per_gyro["x"]
    assert found.settings.gyros == ("x", "y", "z")
    truth = {"x": 2e-6, "y": 3e-6, "z": np.hypot(2.5e-6, 0.3 * 2e-6)}
    for name, walk in found.per_gyro.items():
        assert 0.97 * truth[name] < walk.value < 1.03 * truth[name]


def test_a_column_of_times_does_not_cost_the_gyros():
    whole = recording(("x",))
    times = sagnac.Channel(name="t", kind="rate", values=np.arange(SAMPLES) / whole.sample_rate)
    found = sagnac.analyze(replace(whole, gyros=(*whole.gyros, times)))
    assert found.gyros["x"].angle_random_walk == sagnac.analyze(whole).angle_random_walk
    assert "t: holds no noise: its rate is even, or a ramp" in str(found.refused["t"].at(""))


@pytest.mark.usefixtures("blank_figures")
def test_a_stuck_channel_does_not_cost_the_others(tmp_path, capsys):
    gyros, forces, stuck = ("x", "z"), ("ax", "ay"), ("z", "ay")
    whole = recording(gyros, forces)
    sound = sagnac.analyze(recording(("x",), ("ax",)))

    def held(channels):
        return tuple(
            replace(one, values=np.full(SAMPLES, one.values[0])) if one.name in stuck else one
            for one in channels
        )

    spoilt = replace(whole, gyros=held(whole.gyros), accelerometers=held(whole.accelerometers))
    found = sagnac.analyze(spoilt)
    assert tuple(found.refused) == stuck
    assert all("is stuck" in str(why) for why in found.refused.values())
    answers = {**found.gyros, **found.accelerometers}
    assert set(answers) == {*gyros, *forces} - set(stuck)
    for name, before in {"x": sound, **sound.accelerometers}.items():
        assert answers[name].angle_random_walk == before.angle_random_walk
    assert not sound.refused
    path = sagnac.write(spoilt, tmp_path / "unit.parquet")
    for command in ("analyze", "avar"):
        folder = tmp_path / command
        assert main([command, str(path), "-o", str(folder)]) == 0
        said = capsys.readouterr().out
        for name in stuck:
            page = folder / "report.html"
            if command == "avar" and name == "ay":
                page = folder / "accelerometers" / "report.html"
            assert f"{name} was not analyzed" in said
            assert f"<b>{name} was not analyzed:</b>" in page.read_text()
        made = json.loads((folder / "analysis.json").read_text())
        assert tuple(made["refused"]) == stuck
    assert main(["lines", str(path)]) == 0
    assert f"{stuck[0]} was not analyzed" in capsys.readouterr().out
    assert main(["check", str(path)]) == 1
    assert f"{stuck[0]}: is stuck" in capsys.readouterr().err
    with pytest.raises(sagnac.RecordingError, match="is stuck"):
        sagnac.analyze(spoilt, Settings(strict=True))


def test_all_stuck_is_an_error():
    whole = recording(("x", "y"))
    gyros = tuple(replace(one, values=np.ones(SAMPLES)) for one in whole.gyros)
    with pytest.raises(sagnac.RecordingError, match="x: is stuck"):
        sagnac.analyze(replace(whole, gyros=gyros))


def test_lines_asked_to_stay_are_in_the_answer_of_both_commands(tmp_path, capsys):
    whole = recording(("x",))
    time = np.arange(SAMPLES) / RATE
    hum = whole.gyros[0].values + 2e-5 * np.sin(2.0 * np.pi * 7.3 * time)
    path = sagnac.write(
        replace(whole, gyros=(replace(whole.gyros[0], values=hum),)), tmp_path / "hum.parquet"
    )
    answers = {}
    asked = [("analyze", ""), ("analyze", "none"), *(("avar", one) for one in ("", "none", "fos"))]
    for command, method in asked:
        words = [command, str(path), "--json", *(["--method", method] if method else [])]
        assert main(words) == 0
        found = json.loads(capsys.readouterr().out)["angle_random_walk"]
        answers[command, method] = [found[key] for key in KEYS]
    for method in ("", "none"):
        np.testing.assert_allclose(
            answers["avar", method], answers["analyze", method], rtol=1e-12, atol=0.0
        )
    assert answers["avar", ""] == answers["avar", "fos"] != answers["avar", "none"]
