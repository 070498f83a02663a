"""Names of files and gyros that would be code, keys or formulas in the files of other tools."""

import ast
import json
import tomllib
from dataclasses import replace
from xml.etree import ElementTree

import pytest
import yaml

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
KEYS = {
    "kalibr": {"rostopic", "update_rate", "gyroscope_noise_density", "gyroscope_random_walk"},
    "robot-localization": {"imu"},
    "ros-imu": {"imu"},
    "imu-tools": {"imu_filter_madgwick"},
    "kf-gins": {"imunoise"},
    "toml": {
        "schema", "version", "definition", "reference", "confidence", "tau_s", "update_rate_hz",
        "sensors",
    },
}  # fmt: skip
KEYS["allan-variance-ros"], KEYS["json"] = KEYS["kalibr"], KEYS["toml"]


def hostile(name: str):
    """A gyro of that name out of a file of that name."""
    one = setting("x")
    return replace(one, name=name, source=f"{name}, SHA-256 {name}")


def gtsam_names(text: str) -> list[str]:
    """What the file defines; it imports numpy and nothing else."""
    tree = ast.parse(text)
    imports, *others = [one for one in tree.body if not isinstance(one, ast.Expr)]
    assert isinstance(imports, ast.Import)
    assert [one.name for one in imports.names] == ["numpy"]
    assert len(tree.body) == 4
    space: dict[str, object] = {}
    exec(text, space)
    return [getattr(one, "name", None) or one.targets[0].id for one in others]


@pytest.mark.parametrize("name", HOSTILE)
def test_a_name_stays_text_in_every_format(name):
    wanted = {"settings": (hostile(name),)}
    plain = {"settings": (setting("x"),)}
    for tool in TOOLS:
        text = written(tool, **wanted)
        text.encode()  # no halves of characters
        lines = len(written(tool, **plain).splitlines())
        assert len(text.splitlines()) == lines, tool
        if tool == "gtsam":
            assert gtsam_names(text) == [
                "GYROSCOPE_COVARIANCE", "BIAS_OMEGA_COVARIANCE", "set_gyroscope",
            ]  # fmt: skip
        elif tool == "px4":
            rows = [line.split("\t") for line in text.splitlines() if line[:1] not in ("#", "")]
            assert [row[2] for row in rows] == ["EKF2_GYR_NOISE", "EKF2_GYR_B_NOISE"]
        elif tool == "psins":
            rows = [line for line in text.splitlines() if line[:1] != "%"]
            assert [row.partition(" ")[0] for row in rows] == [
                "eb", "web", "sqrtR0G", "TauG", "wdb", "imuerr",
            ]  # fmt: skip
        elif tool == "imu-sensor":
            rows = [line for line in text.splitlines() if line[:1] != "%"]
            assert [row.partition(" ")[0] for row in rows if row[:1] != " "] == [
                "imu", "imu.SampleRate", "imu.Gyroscope",
            ]  # fmt: skip
        elif tool == "gazebo":
            root = ElementTree.fromstring(text)
            assert [one.tag for one in root.iter()][:4] == [
                "sensor", "update_rate", "imu", "angular_velocity",
            ]  # fmt: skip
        elif tool == "gnss-ins-sim":
            space: dict[str, object] = {}
            exec(text, space)
            assert set(space) == {"__builtins__", "numpy", "imu_err"}
        else:
            read = {"json": json.loads, "toml": tomllib.loads}.get(tool, yaml.safe_load)
            found = read(text.removeprefix("%YAML:1.0\n"))
            assert set(found) == (KEYS.get(tool) or {"imu0"})
            if tool in ("json", "toml"):
                assert len(found["sensors"]) == 1
    assert written("json", **plain) != written("json", **wanted)


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
