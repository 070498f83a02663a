"""Everything that one recording gave."""

from collections.abc import Mapping
from dataclasses import dataclass

from sagnac.analysis.settings import Settings
from sagnac.analysis.spectra import Spectrum
from sagnac.coefficients.estimates import Estimate, Fit, FitName
from sagnac.lines.model import Line
from sagnac.recording.model import Recording
from sagnac.stability.curve import StabilityCurve


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysis:
    """Everything one recording gave; what the report, the JSON and the tables are made of.

    Attributes
    ----------
    recording
        The input, as read (values included; the report takes only facts from it).
    channel
        ``x`` or ``x-z``: what the curve and the lines are of.
    gyros_differenced
        1 for a single gyro, 2 for a difference. Coefficients are per gyro already.
    table_rate
        Mean table rate, rad/s, or None at rest.
    angle_random_walk
        The answer, SI (rad/sqrt(s)), with the fit it rests on in `source`.
    fits
        By method.
    lines
        Every periodic component found, strongest first.
    curve, curve_before
        Stability of `channel` after and before removal (before: same interval).
    spectrum, spectrum_before
        Rate spectrum of `channel` after and before removal, smoothed for a figure.
    per_gyro
        With a triad: each gyro's own N by three-cornered hat; else empty.
    notes
        Every repair, refusal and doubt, in words.
    seconds
        Time by stage.
    family
        One curve for each estimator that the settings ask for.
    density
        Multitaper rate spectrum of what the curves are of, where estimators are asked for.
    """

    recording: Recording
    settings: Settings
    channel: str
    gyros_differenced: int
    table_rate: float | None
    angle_random_walk: Estimate
    source: str
    fits: Mapping[FitName, Fit]
    lines: tuple[Line, ...]
    curve: StabilityCurve
    curve_before: StabilityCurve
    spectrum: Spectrum
    spectrum_before: Spectrum
    per_gyro: Mapping[str, Estimate]
    notes: tuple[str, ...]
    seconds: Mapping[str, float]
    family: tuple[StabilityCurve, ...] = ()
    density: Spectrum | None = None
