"""What an analysis shows of N, for a forecast of what a longer recording would."""

from dataclasses import replace
from typing import Final

from sagnac.analysis.averaged import reaches
from sagnac.analysis.headline_coefficients import headline_coefficients
from sagnac.analysis.result import Analysis
from sagnac.coefficients.estimates import Fit, FitBand
from sagnac.coefficients.laws import STOCHASTIC_NAMES
from sagnac.coefficients.model_average import Resting
from sagnac.errors import RecordingError
from sagnac.lines.naming import WIDEST_BINS
from sagnac.specification.verdict import LeftOut, Shown

# Cells that a fit leaves out on either side of what is masked.
_BESIDE: Final = 1.0
# Times as long as the recording: where the forecast asks what the answer will rest on.
_LONGER: Final = 10.0
# Share of the weight from which on fits under the beginning of a low-pass count.
_FALLS: Final = 0.1


def shown_by(analysis: Analysis) -> Shown:
    """N of an analysis with its interval, and what a longer recording's answer will rest on.

    That is the likelihood of the whole band or the average over bands, whichever is narrower after
    ten times as long: the likelihood leaves every line out with up to forty cells of 1/duration,
    and may use fewer angles than there are samples.

    Raises
    ------
    RecordingError
        If the recording does not estimate N.
    """
    walk, resting = analysis.angle_random_walk, analysis.average
    if walk.status != "estimated" or walk.low <= 0.0:
        raise RecordingError(
            f"N is {walk.status} after {analysis.recording.duration:.4g} s, so that no interval "
            "can be forecast",
            channel=analysis.channel,
            remedy="record four times as long and ask again",
        )
    if resting is None or not resting.terms:
        raise RecordingError(
            "the answer rests on no band of the spectrum",
            channel=analysis.channel,
            remedy="record longer",
        )
    duration = analysis.recording.duration
    fit = analysis.fits.get("likelihood")
    band = None if fit is None else fit.band
    average = Shown(
        value=walk.value,
        low=walk.low,
        high=walk.high,
        confidence=walk.confidence,
        coefficients={
            name: found.value
            for name, found in headline_coefficients(analysis).items()
            if found.status == "estimated" and name in STOCHASTIC_NAMES
        },
        terms=STOCHASTIC_NAMES,
        falls=resting.falls > _FALLS,
        duration=duration,
        highest=resting.band_hz[1],
        interval=1.0 / analysis.recording.sample_rate,
        left_out=() if band is None else tuple(_left_out(*one, duration) for one in band.masked),
    )
    if fit is None or band is None or not _likely(fit, band, resting):
        return average
    whole_band = replace(average, highest=band.high, interval=band.interval, efficient=True)
    return min((whole_band, average), key=lambda one: one.expected(_LONGER * duration))


def _likely(fit: Fit, band: FitBand, resting: Resting) -> bool:
    """Whether the likelihood of the whole band is, or may become, the answer.

    It is if it is now, or stands beside the average, or if nothing speaks against it but that so
    little of the band is left beside the lines.
    """
    if not band.is_whole:
        return False
    if resting.member in ("whole band", "both"):
        return True
    return fit.departure == 0.0 and reaches(resting, band.high)


def _left_out(low: float, high: float, duration: float) -> LeftOut:
    """What a line or a band of vibration takes: of a line as many cells at any duration."""
    cells = min(0.5 * (high - low) * duration, WIDEST_BINS)
    beside = cells / duration
    return LeftOut(
        low=min(low + beside, 0.5 * (low + high)),
        high=max(high - beside, 0.5 * (low + high)),
        cells=cells + _BESIDE,
    )
