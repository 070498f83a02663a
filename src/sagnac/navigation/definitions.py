"""Tools whose settings are written: how each defines its noise parameters, and which it lacks."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Literal

ToolName = Literal[
    "kalibr", "allan-variance-ros", "openvins", "gtsam", "robot-localization", "ros-imu",
    "imu-tools", "px4", "kf-gins", "psins", "imu-sensor", "gazebo", "gnss-ins-sim", "toml", "json",
]  # fmt: skip
"""Whose settings are written."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Definition:
    """How a tool defines its parameters.

    Attributes
    ----------
    tool
        Its name.
    reference
        The document that defines them.
    text
        The definition, one line.
    axes
        How many noises it takes: one for all axes, one for each of x, y and z, or any number.
    bias
        Process that its bias is.
    one_time
        Whether Markov biases of gyros and accelerometers have one correlation time.
    unused
        Option of an export (``rate``, ``topic``, ``markov``, ``accelerometer``) that the tool
        cannot use -> why.
    """

    tool: str
    reference: str
    text: str
    axes: Literal["one", "three", "any"]
    bias: Literal["walk", "markov", "none", "any"]
    one_time: bool
    unused: Mapping[str, str]


@cache
def definitions() -> Mapping[str, Definition]:
    """Definition of each tool of ``tools.toml``; ``json`` holds what ``toml`` does."""
    tools = tomllib.loads(files("sagnac.navigation").joinpath("tools.toml").read_text("utf-8"))
    reasons, definitions = tools.pop("reasons"), {}
    for name, stated in tools.items():
        tool = {"bias": "any", "one_time": False, "unused": (), **stated}
        tool["unused"] = {option: reasons[option] for option in tool["unused"]}
        if tool["bias"] != "any":
            tool["unused"]["markov"] = reasons[tool["bias"]]
        definitions[name] = Definition(**tool)
    return definitions


def definition_of(tool: str) -> Definition:
    """The definition of a tool of `sagnac.navigation.tools`."""
    return definitions()["toml" if tool == "json" else tool]
