"""What an analysis shows of N, for a forecast of what a longer recording would."""

from sagnac.analysis.headline_fit import headline_coefficients
from sagnac.analysis.result import Analysis
from sagnac.coefficients.laws import STOCHASTIC_NAMES
from sagnac.errors import RecordingError
from sagnac.specification.planning import Shown


def shown_by(analysis: Analysis) -> Shown:
    """N of an analysis with its interval, and the terms that share its spectrum.

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
    efficient = resting.member == "whole band"
    highest = resting.band_hz[1]
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
        terms=STOCHASTIC_NAMES if efficient else resting.terms,
        duration=analysis.recording.duration,
        highest=highest,
        interval=0.5 / highest if efficient else 1.0 / analysis.recording.sample_rate,
        efficient=efficient,
    )
