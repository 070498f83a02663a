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

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from sagnac.core.version import __version__

if TYPE_CHECKING:
    from sagnac import plot
    from sagnac.analysis.pipeline import analyze
    from sagnac.analysis.planning import Plans, plan
    from sagnac.analysis.result import Analysis
    from sagnac.analysis.settings import Settings
    from sagnac.analysis.trial import Trial, trial
    from sagnac.analysis.verdict import judge
    from sagnac.core.errors import MissingExtra, Note, RecordingError
    from sagnac.core.texts import keywords
    from sagnac.fleet.campaign import CampaignReport, campaign
    from sagnac.formats import Statement, columns, missing, read, write
    from sagnac.lines.model import Line, Removal
    from sagnac.lines.orthogonal_search import OrthogonalSearch, fast_orthogonal_search
    from sagnac.lines.search import remove_lines
    from sagnac.navigation.align import Foresight, align
    from sagnac.navigation.export import Exported, export
    from sagnac.noise.cross_spectra import SelfNoise, self_noise
    from sagnac.noise.estimates import Estimate, Fit
    from sagnac.noise.fit import fit_coefficients
    from sagnac.quality.check import check
    from sagnac.recording.model import Channel, Recording
    from sagnac.report.page import Report, write_report
    from sagnac.rig.config import RigConfig
    from sagnac.rig.simulate import simulate
    from sagnac.stability.curve import StabilityCurve, deviation_at_every_tau, stability_curve
    from sagnac.verdict.judgement import Verdict
    from sagnac.verdict.limits import Specification

__all__ = [
    "Analysis", "CampaignReport", "Channel", "Estimate", "Exported", "Fit", "Foresight", "Line",
    "MissingExtra", "Note", "OrthogonalSearch", "Plans", "Recording", "RecordingError",
    "Removal", "Report", "RigConfig", "SelfNoise", "Settings", "Specification",
    "StabilityCurve", "Statement", "Trial", "Verdict", "__version__", "align", "analyze",
    "campaign", "check", "columns", "deviation_at_every_tau", "export",
    "fast_orthogonal_search", "fit_coefficients", "judge", "keywords", "missing", "plan", "plot",
    "read", "remove_lines", "self_noise", "simulate", "stability_curve", "trial", "write",
    "write_report",
]  # fmt: skip

_HOME: Final = {
    name: f"sagnac.{module}"
    for module, names in {
        "navigation.align": "Foresight align",
        "analysis.pipeline": "analyze",
        "analysis.planning": "Plans plan",
        "analysis.result": "Analysis",
        "analysis.settings": "Settings",
        "analysis.trial": "Trial trial",
        "analysis.verdict": "judge",
        "noise.estimates": "Estimate Fit",
        "noise.fit": "fit_coefficients",
        "noise.cross_spectra": "SelfNoise self_noise",
        "core.errors": "MissingExtra Note RecordingError",
        "navigation.export": "Exported export",
        "fleet.campaign": "CampaignReport campaign",
        "formats": "Statement columns missing read write",
        "lines.model": "Line Removal",
        "lines.orthogonal_search": "OrthogonalSearch fast_orthogonal_search",
        "lines.search": "remove_lines",
        "recording.model": "Channel Recording",
        "quality.check": "check",
        "report.page": "Report write_report",
        "rig.config": "RigConfig",
        "rig.simulate": "simulate",
        "verdict.limits": "Specification",
        "verdict.judgement": "Verdict",
        "stability.curve": "StabilityCurve deviation_at_every_tau stability_curve",
        "core.texts": "keywords",
    }.items()
    for name in names.split()
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
