"""Angle random walk of a gyro, at rest or on a turning table, with an honest interval.

Charter
-------
Data types
    A `Recording` holds gyro channels, the table encoder and the sample times.
    Each stage takes a value and returns a new one with what it removed and what
    it noticed; nothing is repaired silently.
Units
    SI inside (rad, rad/s, s); the field's units (″, °/h, °/√h) at the edges only,
    converted in `sagnac.units` and nowhere else.
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

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from sagnac import plot
    from sagnac.analysis.pipeline import analyze
    from sagnac.analysis.result import Analysis
    from sagnac.analysis.settings import Settings
    from sagnac.coefficients.estimates import Estimate
    from sagnac.coefficients.fit import fit_coefficients
    from sagnac.errors import Note, RecordingError
    from sagnac.formats import read, write
    from sagnac.lines.orthogonal_search import fast_orthogonal_search
    from sagnac.lines.search import remove_lines
    from sagnac.recording.model import Channel, Recording
    from sagnac.rig.config import RigConfig
    from sagnac.rig.simulate import simulate
    from sagnac.stability.curve import StabilityCurve, stability_curve

__version__ = "0.1.0"

__all__ = [
    "Analysis",
    "Channel",
    "Estimate",
    "Note",
    "Recording",
    "RecordingError",
    "RigConfig",
    "Settings",
    "StabilityCurve",
    "__version__",
    "analyze",
    "fast_orthogonal_search",
    "fit_coefficients",
    "plot",
    "read",
    "remove_lines",
    "simulate",
    "stability_curve",
    "write",
]

_HOME: Final = {
    "Analysis": "sagnac.analysis.result",
    "Channel": "sagnac.recording.model",
    "Estimate": "sagnac.coefficients.estimates",
    "Note": "sagnac.errors",
    "Recording": "sagnac.recording.model",
    "RecordingError": "sagnac.errors",
    "RigConfig": "sagnac.rig.config",
    "Settings": "sagnac.analysis.settings",
    "StabilityCurve": "sagnac.stability.curve",
    "analyze": "sagnac.analysis.pipeline",
    "fast_orthogonal_search": "sagnac.lines.orthogonal_search",
    "fit_coefficients": "sagnac.coefficients.fit",
    "read": "sagnac.formats",
    "remove_lines": "sagnac.lines.search",
    "simulate": "sagnac.rig.simulate",
    "stability_curve": "sagnac.stability.curve",
    "write": "sagnac.formats",
}


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
