"""Names of files and gyros that would be code, keys or formulas in the files of other tools."""

import json
import re
import tomllib
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from tests.navigation.examples import written
from tests.navigation.test_tools import TOOLS, TRIAD, setting

HOSTILE = (
    "x\nimport os; os.abort()",
    "x\rgyroscope_noise_density: 1.0",
    "x\x85gyroscope_noise_density: 1.0",
    "x\u2028gyroscope_noise_density: 1.0",
    "x\n1\t1\tEKF2_GYR_NOISE\t1.0\t9",
    'x"\n[sensors]\n"""\n\'\'\'',
    "x]\n[sensors.y",
    "x: {a: [1, 2]} # $HOME `id` ${IFS} %s {0}",
    "--> <sensor> <!-- & ]]> </sensor>",
    "x\x1b[2J\x07\x7f\x00",
    "x\udcff\ufffe",
    "λ · 陀螺 😀",
    "-",
    "",
)


def hostile(name: str):
    """A gyro of that name out of a file of that name."""
    one = setting("x")
    return replace(one, name=name, source=f"{name}, SHA-256 {name}")


def content(tool: str, text: str) -> object:
    """What a reader takes of a file: neither comments nor the name."""
    if tool == "gazebo":
        return ElementTree.canonicalize(text)
    if tool in ("toml", "json"):
        found = {"toml": tomllib, "json": json}[tool].loads(text)
        (sensor,) = found["sensors"].values()
        return {**found, "sensors": {**sensor, "source": ""}}
    return [line for line in text.splitlines() if line.lstrip()[:1] not in ("#", "%")]


@pytest.mark.parametrize("name", HOSTILE)
def test_a_name_stays_text_in_every_format(name):
    for tool in TOOLS:
        text, plain = (written(tool, settings=(one,)) for one in (hostile(name), setting("x")))
        # No halves of characters either.
        assert re.sub(r"[\n\t]", "", text).isprintable(), tool
        assert len(text.splitlines()) == len(plain.splitlines()), tool
        assert text != plain, tool
        assert content(tool, text) == content(tool, plain), tool


def test_each_gyro_of_hostile_names_keeps_its_own_numbers():
    names = ("a\n[b]", 'a"]', "ä.b")
    settings = tuple(replace(one, name=name) for one, name in zip(TRIAD, names, strict=True))
    found = tomllib.loads(written("toml", settings=settings, each=True))["sensors"]
    white = [one["simple"]["continuous"]["white_rad_per_s_per_sqrt_hz"] for one in found.values()]
    assert white == pytest.approx([one.simple.white for one in settings])
    assert list(found) == ["a\\u000a[b]", 'a"]', "ä.b"]


@pytest.mark.parametrize("topic", ["/imu0\nupdate_rate: 1", "a: b", "", "/imu 0", "é", "/x # y"])
def test_a_topic_is_a_name_of_ros(topic):
    with pytest.raises(ValueError, match=r"topic is .*; give a name of ROS"):
        written("kalibr", TRIAD, topic=topic)
    assert "rostopic: /rig_2/imu0\n" in written("kalibr", TRIAD, topic="/rig_2/imu0")
