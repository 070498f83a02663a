"""N by every reading of the paper's Step 4, of one and the same residual."""

import math

from sagnac.analysis.result import Answer
from sagnac.coefficients.curve_fit import paper_squares
from sagnac.coefficients.readings import READINGS, ReadingName
from sagnac.errors import RecordingError
from sagnac.lines.naming import with_noise_restored


def by_each_reading(answer: Answer) -> dict[ReadingName, float]:
    """N by name of the reading, rad/sqrt(s), whatever its interval.

    The paper has no intervals, so what its squares give is the answer of its method. NaN of a
    curve too short for them.

    Parameters
    ----------
    answer
        Of a method that leaves the noise of its lines out of the curve, as the paper's methods do
        unless `Settings.step_4` asks for it.
    """
    restored = with_noise_restored(answer.curve, answer.taken, len(answer.lines))
    found: dict[ReadingName, float] = {}
    for name, reading in READINGS.items():
        curve = restored if reading.noise_restored else answer.curve
        try:
            found[name] = paper_squares(curve, squares=reading.squares)
        except RecordingError:
            found[name] = math.nan
    return found
