"""What an analysis shows of N, for a forecast of what a longer recording would."""

from typing import Final

from sagnac.analysis.averaged import reaches
from sagnac.analysis.headline_coefficients import headline_coefficients
from sagnac.analysis.result import Analysis
from sagnac.coefficients.estimates import FitBand
from sagnac.coefficients.laws import STOCHASTIC_NAMES
from sagnac.coefficients.model_average import Resting
from sagnac.errors import RecordingError
from sagnac.lines.taken_noise import WIDEST_BINS
from sagnac.specification.planning import LeftOut, Shown

# Cells that a fit leaves out on either side of what is masked.
_BESIDE: Final = 1.0


def shown_by(analysis: Analysis) -> Shown:
    """N of an analysis with its interval, and the terms that share its spectrum.

    The likelihood of the whole band leaves every order out with forty cells of 1/duration. So a
    short recording may show too little of the band for it to be the answer, and a longer one
    enough. If the fit describes the spectrum of the short one, it is taken to be the answer of the
    longer.

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
    band = _likely_band(analysis, resting)
    duration = analysis.recording.duration
    return Shown(
        value=walk.value,
        low=walk.low,
        high=walk.high,
        confidence=walk.confidence,
        coefficients={
            name: found.value
            for name, found in headline_coefficients(analysis).items()
            if found.status == "estimated" and name in STOCHASTIC_NAMES
        },
        # The likelihood fits them all; a band those that it needs.
        terms=resting.terms if band is None else STOCHASTIC_NAMES,
        duration=duration,
        highest=resting.band_hz[1] if band is None else band.high,
        interval=1.0 / analysis.recording.sample_rate if band is None else band.interval,
        efficient=band is not None,
        left_out=() if band is None else tuple(_left_out(*one, duration) for one in band.masked),
    )


def _likely_band(analysis: Analysis, resting: Resting) -> FitBand | None:
    """The whole band of the likelihood if a longer recording's answer will be of it, else None.

    It is if it is now, or stands beside the average, or if nothing speaks against it but that so
    little of the band is left beside the lines.
    """
    fit = analysis.fits.get("likelihood")
    if fit is None or fit.band is None or not fit.band.is_whole:
        return None
    if resting.member in ("whole band", "both"):
        return fit.band
    describes = fit.departure == 0.0 and reaches(resting, fit.band.high)
    return fit.band if describes else None


def _left_out(low: float, high: float, duration: float) -> LeftOut:
    """What a line or a band of vibration takes: of a line as many cells at any duration."""
    cells = min(0.5 * (high - low) * duration, WIDEST_BINS)
    beside = cells / duration
    return LeftOut(
        low=min(low + beside, 0.5 * (low + high)),
        high=max(high - beside, 0.5 * (low + high)),
        cells=cells + _BESIDE,
    )
