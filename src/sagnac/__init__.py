"""Angle random walk of a gyro, at rest or on a turning table, with an honest interval.

Charter
-------
Data types
    A `Recording` holds gyro channels, the table encoder and the sample times.
    Each stage takes a value and returns a new one with what it removed and what
    it noticed; nothing is repaired silently.
Units
    SI inside (rad, rad/s, s); the field's units (″, °/h, °/√h) at the edges only,
    converted in `sagnac.core.units` and nowhere else.
Symbols
    θ measured gyro angle, α table angle, Ω table rate, e share of the table rate a
    gyro senses, η Earth rate in the table's start frame, τ cluster time, σ(τ) Allan
    deviation; Q, N, B, K, R quantization, angle random walk, bias instability, rate
    random walk and rate ramp.
Sign and frames
    Those of Yu et al., Sensors 2013, 13, 2750, Eqs. 1-7: n north-east-down, b turns
    with the table, b0 is b at the null pulse, s the gyro axes.
Kinds
    What a sample is, is always stated: ``angle`` (accumulated), ``increment`` (per
    sample) or ``rate``. There is no default.
Stability of names
    What this module exports keeps its name and its meaning for one minor version after a
    release that deprecates it, with a warning that names what to use instead. Everything else
    may move.
"""

import ast
from importlib import import_module
from pathlib import Path
from typing import Any, Final

# Module of each name: the stub that type checkers read says it once.
_HOME: Final = {
    name.name: str(line.module)
    for line in ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")).body
    if isinstance(line, ast.ImportFrom)
    for name in line.names
}
__all__ = list(_HOME)


def __getattr__(name: str) -> Any:
    # Imported at first use: the compiled kernels take half a second, which the command
    # line's --help and its usage errors must not wait for.
    if name == "plot":
        return import_module("sagnac.plot")
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
