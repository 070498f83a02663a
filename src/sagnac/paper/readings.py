"""N by every reading of the paper's Step 4, of one and the same residual."""

from sagnac.analysis.fits import unobserved
from sagnac.analysis.result import Answer
from sagnac.coefficients.curve_fit import paper_fit
from sagnac.coefficients.estimates import Estimate
from sagnac.coefficients.readings import READINGS, Reading, ReadingName
from sagnac.errors import RecordingError
from sagnac.lines.taken_noise import with_noise_restored
from sagnac.stability.curve import StabilityCurve


def by_each_reading(answer: Answer) -> dict[ReadingName, Estimate]:
    """N of one gyro by name of the reading, rad/sqrt(s).

    Parameters
    ----------
    answer
        Of a method that leaves the noise of its lines out of the curve, as the paper's methods do
        unless `Settings.step_4` asks for it.
    """
    restored = with_noise_restored(answer.curve, answer.taken, len(answer.lines))
    return {
        name: _reading(restored if reading.noise_restored else answer.curve, reading, answer)
        for name, reading in READINGS.items()
    }


def _reading(curve: StabilityCurve, reading: Reading, answer: Answer) -> Estimate:
    """N by one reading; of a curve too short for it nothing is observed."""
    try:
        fit = paper_fit(curve, squares=reading.squares, gyros_differenced=answer.gyros_differenced)
    except RecordingError:
        return unobserved("angle_random_walk", answer.angle_random_walk.confidence)
    return fit.coefficients["angle_random_walk"]
