"""Titles, field units and digits that the page, the figures and the command line share."""

import math
import re
from collections.abc import Mapping
from typing import Final

import numpy as np
from scipy.special import gammainccinv, gammaincinv

from sagnac.analysis.result import Analysis
from sagnac.analysis.spectra import Spectrum
from sagnac.core.errors import per_cent
from sagnac.core.units import ARCSECOND, DEGREE_PER_HOUR, SENSED, UNITS, Unit
from sagnac.lines.model import Line
from sagnac.noise.estimates import ConvertedEstimate, Estimate, FitName, Interval
from sagnac.noise.laws import COEFFICIENT_NAMES
from sagnac.spectrum.power_laws import running_median
from sagnac.stability import Estimator
from sagnac.stability.curve import StabilityCurve

TITLES: Final = {name: SENSED["gyro"].titles[name].capitalize() for name in COEFFICIENT_NAMES}
FIT_TITLES: Final[Mapping[FitName, str]] = {
    "likelihood": "Likelihood on the spectrum",
    "weighted": "Weighted, non-negative",
    "paper": "Least squares on Eq. 3 (paper)",
}
_POWER: Final = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)e([+-]?\d+)")
SUPERSCRIPTS: Final = str.maketrans("-−0123456789", "⁻⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def curve_unit(estimator: Estimator) -> Unit:
    """Unit that a curve is shown in."""
    return UNITS["arcsec" if estimator == "tdev" else "deg/h"]


def curve_columns(curve: StabilityCurve, unit: Unit | None = None) -> dict[str, list[float]]:
    """Columns of a curve: tau in s, deviation and its interval in `unit`, and what they rest on.

    The unit is that of the estimator unless it is given.
    """
    size = (unit or curve_unit(curve.estimator)).size
    shown = {name: getattr(curve, name) / size for name in ("deviation", "low", "high")}
    columns = {"tau": curve.tau, **shown}
    columns |= {name: getattr(curve, name) for name in ("edf", "terms", "noise_type")}
    return {name: values.tolist() for name, values in columns.items()}


def decimals_for(width: float) -> int:
    """Decimal places that show two significant digits of `width` (negative left of the point)."""
    return 1 - math.floor(math.log10(width)) if 0.0 < width < math.inf else 6


def number(value: float, width: float | None = None, *, plain: bool = False) -> str:
    """`value` with the digits that an uncertainty of `width` leaves meaningful.

    Parameters
    ----------
    value
        What to write. NaN is written as a dash.
    width
        Half width of its interval; None writes three significant digits.
    plain
        Write ``2.51e-05`` instead of ``2.51 × 10⁻⁵``, to be copied into a program.
    """
    if not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    exponent = math.floor(math.log10(abs(value)))
    digits = 3
    if width is not None and 0.0 < width < math.inf:
        digits = min(max(decimals_for(width) + exponent + 1, 1), 9)
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    if -3 <= int(power) < 5:
        return f"{value:.{max(digits - 1 - int(power), 0)}f}"
    return f"{mantissa}e{power}" if plain else _raised(mantissa, power)


def ending(text: str, most: int) -> str:
    """A text of no more characters than that: the end of a longer one."""
    return text if len(text) <= most else f"…{text[1 - most :]}"


def typeset(text: str) -> str:
    """A text with its powers of ten raised.

    Examples
    --------
    >>> typeset("N ≤ 2.6e-05 °/√h")
    'N ≤ 2.6 × 10⁻⁵ °/√h'
    """
    return _POWER.sub(lambda found: _raised(found[1], found[2]), text)


def _raised(mantissa: str, power: str) -> str:
    return f"{mantissa} × 10{str(int(power)).translate(SUPERSCRIPTS)}"


WithInterval = Estimate | ConvertedEstimate | Interval


def figures(
    estimate: WithInterval, *, plain: bool = False, width: float | None = None
) -> tuple[str, str]:
    """Value and interval of an estimate, all with the digits that its interval allows.

    The digits are those that a half width of `width` leaves; it is that of the interval unless
    given. For a person the interval is written with one power of ten; `plain` figures can be
    copied into a program one by one.
    """
    width = 0.5 * (estimate.high - estimate.low) if width is None else width
    value = number(estimate.value, width, plain=plain)
    mantissa, times, power = value.partition(" × ")
    if not times:
        low, high = (number(limit, width, plain=plain) for limit in (estimate.low, estimate.high))
        return value, f"{low} … {high}"
    scale = 10.0 ** math.floor(math.log10(abs(estimate.value)))
    decimals = len(mantissa.partition(".")[2])
    low, high = (f"{limit / scale:.{decimals}f}" for limit in (estimate.low, estimate.high))
    return value, f"{low} … {high} × {power}"


def reading_cells(
    estimate: Estimate, unit: str | None = None, *, plain: bool = True
) -> tuple[str, str, str]:
    """Value, interval and status of an estimate in SI, in the field's unit unless one is given."""
    shown = estimate.in_field_unit() if unit is None else estimate.to(unit)
    if estimate.status == "not observable":
        return "–", "", estimate.status
    if estimate.status == "upper bound":
        return f"< {number(shown.high, plain=plain)}", "", estimate.status
    return (*figures(shown, plain=plain), estimate.status)


def unit_cells(estimate: Estimate) -> list[tuple[str, str, str]]:
    """Value, interval and unit of an estimate in SI, in each unit that it is written in."""
    return [(*reading_cells(estimate, unit)[:2], unit) for unit in estimate.units]


def reading(estimate: Estimate, unit: str | None = None) -> str:
    """One estimate in SI as one table cell: value and interval, bound, or neither."""
    value, interval, status = reading_cells(estimate, unit)
    if status == "not observable":
        return status
    return f"{value} [{interval.replace(' … ', ', ')}]" if interval else value


def sentence(estimate: Estimate, *, plain: bool = False) -> str:
    """One estimate in SI, said in the field's unit: value and interval, bound, or neither."""
    unit = UNITS[estimate.in_field_unit().unit].symbol
    percent = per_cent(estimate.confidence)
    value, interval, status = reading_cells(estimate, plain=plain)
    if status == "not observable":
        return status
    if status == "upper bound":
        return f"{value} {unit}  (upper bound, {percent})"
    return f"{value} {unit}  [{interval.replace(' … ', ', ')}] {percent}"


def subject(analysis: Analysis) -> str:
    """Subject of the figures, in words."""
    readable = analysis.channel.replace("-", " − ")
    return f"gyros {readable}, per gyro (N̄)" if analysis.is_pair else f"gyro {readable}"


def worst_gyro(analysis: Analysis) -> str | None:
    """The gyro of a triad that may have the largest angle random walk; None if it has no triad."""
    highs = {name: own.high for name, own in analysis.per_gyro.items() if not math.isnan(own.high)}
    return max(highs, key=lambda name: highs[name]) if highs else None


def kalman_figures(angle_random_walk: Estimate) -> tuple[tuple[str, str], ...]:
    """The white rate noise density in the three units that filters are set in: (figure, unit).

    For an upper bound these are the bound. For what was not observable there are none.
    """
    if angle_random_walk.status == "not observable":
        return ()
    value, width = angle_random_walk.value, 0.5 * (angle_random_walk.high - angle_random_walk.low)
    units = (UNITS[name] for name in ("deg/sqrt(h)", "deg/h/sqrt(Hz)", "rad/sqrt(s)"))
    # One digit more than the interval asks: these are to be pasted and squared.
    sized = ((value / unit.size, 0.1 * width / unit.size, unit.symbol) for unit in units)
    return tuple((number(size, last, plain=True), symbol) for size, last, symbol in sized)


def line_position(line: Line) -> str:
    """Where a line stands, with the digits its error leaves: ``order 12`` or ``50.0012 Hz``."""
    place, error = line.frequency, line.frequency_error
    shown = number(place, error, plain=True) if error > 0.0 else f"{place:g}"
    return f"order {shown}" if line.scale == "angle" else f"{shown} Hz"


def line_amplitude(line: Line) -> tuple[str, str]:
    """Amplitude of a line and its standard deviation, ″, to the same decimal place."""
    amplitude, error = line.amplitude / ARCSECOND, line.amplitude_error / ARCSECOND
    # One that is lost in its error is not written as none.
    decimals = min(max(decimals_for(min(amplitude or error, error)), 0), 9)
    return f"{amplitude:.{decimals}f}", f"{error:.{decimals}f}"


# ---- spectra -----------------------------------------------------------------------

_NEIGHBOURS = 51


def shown_density(analysis: Analysis) -> Spectrum:
    """Frequency (Hz) and one-sided rate density, (deg/h)^2/Hz."""
    measured = analysis.density
    if measured is None:
        return Spectrum.empty()
    return Spectrum(frequency=measured.frequency, density=measured.density / DEGREE_PER_HOUR**2)


def coarser(spectrum: Spectrum, most: int) -> Spectrum:
    """The spectrum in `most` log-spaced bins at most, each the mean of those it takes."""
    if spectrum.frequency.size <= most:
        return spectrum
    edges = np.geomspace(spectrum.frequency[0], spectrum.frequency[-1], most + 1)[:-1]
    starts = np.unique(np.searchsorted(spectrum.frequency, edges))
    # Bins that were log-spaced before are wider at high frequency and count by their width.
    width = np.gradient(spectrum.frequency)
    total = np.add.reduceat(width, starts)
    frequency = np.add.reduceat(width * spectrum.frequency, starts) / total
    density = np.add.reduceat(width * spectrum.density, starts) / total
    return Spectrum(frequency=frequency, density=density)


def residual_peaks(analysis: Analysis) -> int:
    """How many peaks the spectrum after removal still has.

    A bin is one of a peak if it stands above the median of the bins around it by more than
    noise does in one spectrum of a thousand; bins that touch are one peak.
    Bins are means of `n` exponential ordinates, gamma distributed of shape `n`.
    """
    frequency, density = analysis.spectrum.frequency, analysis.spectrum.density
    if density.size < _NEIGHBOURS:
        return 0
    shape = np.maximum(np.round(np.gradient(frequency) * analysis.recording.duration), 1.0)
    threshold = gammainccinv(shape, 1e-3 / density.size) / gammaincinv(shape, 0.5)
    above = density > threshold * running_median(density, _NEIGHBOURS)
    return int(np.count_nonzero(above[1:] & ~above[:-1]) + above[0])
